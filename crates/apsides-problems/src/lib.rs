//! A gallery of benchmark problems of optimal control, each with an optimum from the literature or a closed form.
//!
//! Every module is one page: statement, source, evidence for the optimum, and the problem in the language of
//! [`apsides_ocp`]. The crate holds no method: any method that takes an [`Ocp`](apsides_ocp::Ocp) and a
//! [`Guess`](apsides_ocp::Guess) can run the whole gallery.
//!
//! ```
//! let problem = apsides_problems::find("moon_lander_soft").expect("in the gallery");
//! let case = problem.pose()?; // `case.ocp` and `case.guess` are what a method takes
//! assert_eq!(case.ocp.phases.len(), 1);
//! // What a method finds is held against the optimum, to the tolerance that its source supports.
//! assert!(problem.optimum.agrees_with(1.420_312_6) && !problem.optimum.agrees_with(1.4204));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | what is hard about it |
//! | --- | --- |
//! | [`lqr_scalar`], [`di_min_energy`], [`di_min_energy_free_speed`] | nothing: linear equations, quadratic cost |
//! | [`brachistochrone_free_y`], [`brachistochrone_dymos`], [`linear_tangent`] | free final time |
//! | [`hanging_chain`] | an integral with a given value |
//! | [`hypersensitive`] | boundary layers at both ends, of a long phase and of a very long one |
//! | [`orbit_raising`] | a nonlinear end condition, an equality along the path |
//! | [`cart_pole`], [`pvtol`], [`shuttle_reentry`] | strongly nonlinear equations |
//! | [`min_time_climb`] | tables of thrust, aerodynamics and atmosphere |
//! | [`delta_iii`] | four phases with dropped masses, orbital elements at the end |
//! | [`van_der_pol`], [`rayleigh_path`], [`shuttle_heat_limit`] | arcs at a control bound, at a mixed constraint |
//! | [`brachistochrone_wall`], [`bryson_denham`] | state constraints of first and second order, along arcs and at a contact |
//! | [`di_bang_bang`], [`moon_lander_soft`], [`free_flying_robot`], [`powered_descent`] | jumps of the control |
//! | [`di_singular_arc`], [`catmix`], [`goddard_cops`] | singular arcs |
//!
//! [`files`] has the same problems without Rust, as files that `apsides solve` takes. [`search`] has functions for searches without derivatives, [`nlp`] nonlinear programs.
//!
//! Values of collections that are those of a coarse discretisation, or of a statement with a misprint, are not used;
//! the modules say where that matters.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

pub mod brachistochrone_dymos;
pub mod brachistochrone_free_y;
pub mod brachistochrone_wall;
pub mod bryson_denham;
pub mod cart_pole;
pub mod catmix;
pub mod delta_iii;
pub mod di_bang_bang;
pub mod di_min_energy;
pub mod di_min_energy_free_speed;
pub mod di_singular_arc;
pub mod double_integrator;
pub mod files;
pub mod free_flying_robot;
pub mod goddard_cops;
pub mod hanging_chain;
pub mod hypersensitive;
pub mod linear_tangent;
pub mod lqr_scalar;
pub mod min_time_climb;
pub mod moon_lander_soft;
pub mod nlp;
pub mod orbit_raising;
pub mod powered_descent;
pub mod problem;
pub mod pvtol;
pub mod rayleigh_path;
pub mod search;
pub mod shuttle_heat_limit;
pub mod shuttle_reentry;
pub mod van_der_pol;

pub use files::file;
pub use problem::{Case, Evidence, Optimum, Problem, Structure};

/// Every problem, the simple ones first.
pub const GALLERY: &[Problem] = &[
    lqr_scalar::PROBLEM,
    di_min_energy::PROBLEM,
    di_min_energy_free_speed::PROBLEM,
    brachistochrone_free_y::PROBLEM,
    brachistochrone_dymos::PROBLEM,
    linear_tangent::PROBLEM,
    hanging_chain::PROBLEM,
    hypersensitive::PROBLEM,
    hypersensitive::LONG,
    orbit_raising::PROBLEM,
    cart_pole::PROBLEM,
    pvtol::PROBLEM,
    shuttle_reentry::PROBLEM,
    shuttle_heat_limit::PROBLEM,
    min_time_climb::PROBLEM,
    delta_iii::PROBLEM,
    van_der_pol::PROBLEM,
    rayleigh_path::PROBLEM,
    brachistochrone_wall::PROBLEM,
    bryson_denham::PROBLEM,
    bryson_denham::CONTACT,
    di_bang_bang::PROBLEM,
    moon_lander_soft::PROBLEM,
    free_flying_robot::PROBLEM,
    powered_descent::PROBLEM,
    powered_descent::ABOVE_GROUND,
    powered_descent::GLIDE_SLOPE,
    di_singular_arc::PROBLEM,
    catmix::PROBLEM,
    catmix::REVERSED,
    catmix::ARCS,
    goddard_cops::PROBLEM,
];

/// The problem of a name.
#[must_use]
pub fn find(name: &str) -> Option<&'static Problem> {
    GALLERY.iter().find(|p| p.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_problem_poses_and_its_guess_fits() {
        for problem in GALLERY {
            let case = problem.pose().unwrap();
            assert_eq!(case.ocp.name, problem.name);
            case.guess.check(&case.ocp).unwrap();
            assert_eq!(case.ocp.objective.unit, problem.optimum.unit, "{}", problem.name);
            assert!(problem.optimum.agrees_with(problem.optimum.value));
        }
    }

    #[test]
    fn names_are_unique_and_found() {
        for (k, problem) in GALLERY.iter().enumerate() {
            assert!(GALLERY[..k].iter().all(|p| p.name != problem.name));
            assert_eq!(find(problem.name).map(|p| p.title), Some(problem.title));
        }
        assert!(find("nothing").is_none());
    }

    #[test]
    fn differences_are_relative_and_signed() {
        let optimum = catmix::PROBLEM.optimum;
        assert!(optimum.relative_difference(-0.048) > 0.0);
        assert!(optimum.relative_difference(-0.049) < 0.0);
        assert!(!optimum.agrees_with(f64::NAN));
    }
}
