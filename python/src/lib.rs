//! The native part of the Python package `apsides`: symbols, problems, missions and solves. `python/apsides` has the rest.
//!
//! | module | subject |
//! | --- | --- |
//! | `symbol`, `functions`, `table` | formulas that are traced from Python |
//! | `statement`, `motion` | the parts of a problem from Python's |
//! | `mission` | missions and problems: keys, solves, sweeps, prices |
//! | `solution` | what a solve returns |
//! | `trace` | traced functions with exact derivatives |
//! | `nlp`, `ode` | nonlinear programs and integration of traced functions |
//! | `search`, `hazard` | search without derivatives; hazard maps |
//! | `watch` | progress, and Ctrl-C |
//! | `error` | exceptions |

use pyo3::prelude::*;

mod error;
mod functions;
mod hazard;
mod mission;
mod motion;
mod nlp;
mod ode;
mod search;
mod solution;
mod statement;
mod symbol;
mod table;
mod trace;
mod watch;

#[pymodule]
fn _native(m: &Bound<'_, PyModule>) -> PyResult<()> {
    error::add(m)?;
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add_class::<symbol::Symbol>()?;
    m.add_class::<symbol::Condition>()?;
    m.add_class::<table::Table>()?;
    m.add_function(wrap_pyfunction!(functions::unary, m)?)?;
    m.add_function(wrap_pyfunction!(functions::binary, m)?)?;
    m.add_function(wrap_pyfunction!(functions::choose, m)?)?;
    m.add_function(wrap_pyfunction!(functions::unit_factor, m)?)?;
    m.add_function(wrap_pyfunction!(functions::is_name, m)?)?;
    m.add_class::<mission::Mission>()?;
    m.add_class::<solution::Solution>()?;
    m.add_function(wrap_pyfunction!(statement::state, m)?)?;
    m.add_function(wrap_pyfunction!(mission::load, m)?)?;
    m.add_function(wrap_pyfunction!(mission::missions, m)?)?;
    m.add_function(wrap_pyfunction!(trace::arguments, m)?)?;
    m.add_function(wrap_pyfunction!(nlp::minimize, m)?)?;
    m.add_function(wrap_pyfunction!(nlp::evaluate, m)?)?;
    m.add_function(wrap_pyfunction!(nlp::bounded, m)?)?;
    m.add_function(wrap_pyfunction!(ode::integrate, m)?)?;
    m.add_function(wrap_pyfunction!(search::search, m)?)?;
    m.add_class::<hazard::Hazards>()?;
    m.add_function(wrap_pyfunction!(hazard::known_criteria, m)?)?;
    Ok(())
}
