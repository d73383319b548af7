//! Formulas traced from Python: graphs whose nodes are shared, with the operators of numbers.

use std::collections::HashMap;
use std::sync::Arc;

use apsides_expressions::Comparison;
use apsides_expressions::function::{Binary, Unary};
use apsides_problem_file::model::TableData;
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::error::ProblemError;

/// The quantities among which a leaf has its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Scope {
    /// Constants and parameters of a problem.
    Problem,
    /// States, controls and time along a phase.
    Phase(String),
    /// States and time at an end, durations, integrals.
    End,
    /// The arguments of a function.
    Input(usize),
}

/// A quantity that is not known while a formula is traced.
#[derive(Clone, Debug)]
pub(crate) struct Leaf {
    /// The number of the problem or function that it belongs to.
    pub(crate) owner: u64,
    pub(crate) scope: Scope,
    pub(crate) name: String,
}

pub(crate) enum Operation {
    Number(f64),
    Leaf(Leaf),
    Unary(Unary, Symbol),
    Binary(Binary, Symbol, Symbol),
    /// Two sides of a comparison, then what is chosen.
    Choose(Comparison, [Symbol; 4]),
    Table(Arc<TableData>, Vec<Symbol>),
}

impl Operation {
    fn operands(&self) -> Vec<&Symbol> {
        match self {
            Self::Number(_) | Self::Leaf(_) => vec![],
            Self::Unary(_, a) => vec![a],
            Self::Binary(_, a, b) => vec![a, b],
            Self::Choose(_, all) => all.iter().collect(),
            Self::Table(_, all) => all.iter().collect(),
        }
    }

    fn take(&mut self) -> Vec<Symbol> {
        match std::mem::replace(self, Self::Number(0.0)) {
            Self::Number(_) | Self::Leaf(_) => vec![],
            Self::Unary(_, a) => vec![a],
            Self::Binary(_, a, b) => vec![a, b],
            Self::Choose(_, all) => all.into(),
            Self::Table(_, all) => all,
        }
    }
}

pub(crate) struct Node {
    pub(crate) operation: Operation,
}

impl Drop for Node {
    /// One by one: a formula may be as deep as it is long.
    fn drop(&mut self) {
        let mut open = self.operation.take();
        while let Some(Symbol(node)) = open.pop() {
            if let Some(mut node) = Arc::into_inner(node) {
                open.extend(node.operation.take());
            }
        }
    }
}

/// A quantity that is not known while equations are traced: a state, a control, the time, a parameter, or a formula of these.
///
/// It has the operators of numbers, and NumPy's elementary functions take it: ``v * np.sin(theta)``.
#[pyclass(frozen, from_py_object, module = "apsides")]
#[derive(Clone)]
pub(crate) struct Symbol(pub(crate) Arc<Node>);

/// A comparison of quantities that are not known while equations are traced: for ``apsides.where``, and for constraints.
#[pyclass(frozen, from_py_object, module = "apsides")]
#[derive(Clone)]
pub(crate) struct Condition {
    pub(crate) left: Symbol,
    pub(crate) comparison: Comparison,
    pub(crate) right: Symbol,
}

/// A number or a symbol.
#[derive(FromPyObject)]
pub(crate) enum Operand {
    Symbol(Symbol),
    Number(f64),
}

impl Operand {
    pub(crate) fn symbol(self) -> Symbol {
        match self {
            Self::Symbol(symbol) => symbol,
            Self::Number(number) => Symbol::new(Operation::Number(number)),
        }
    }
}

/// An operand of Python's operators; anything else may know the operation itself, as an array does.
fn operand(other: &Bound<'_, PyAny>) -> Option<Symbol> {
    if let Ok(symbol) = other.cast::<Symbol>() {
        return Some(symbol.get().clone());
    }
    // An array of one number would be taken for a number.
    if other.hasattr("__len__").unwrap_or(true) || other.hasattr("shape").unwrap_or(true) && !is_scalar(other)
    {
        return None;
    }
    other.extract::<f64>().ok().map(|number| Operand::Number(number).symbol())
}

/// True of NumPy's numbers.
fn is_scalar(other: &Bound<'_, PyAny>) -> bool {
    other.getattr("ndim").and_then(|n| n.extract::<usize>()).is_ok_and(|n| n == 0)
        && other.hasattr("item").unwrap_or(false)
}

fn both(f: Binary, x: Symbol, other: &Bound<'_, PyAny>, swapped: bool) -> PyResult<Py<PyAny>> {
    let py = other.py();
    match operand(other) {
        None => Ok(py.NotImplemented()),
        Some(y) => {
            let (a, b) = if swapped { (y, x) } else { (x, y) };
            Symbol::new(Operation::Binary(f, a, b)).into_py_any(py)
        }
    }
}

impl Symbol {
    pub(crate) fn new(operation: Operation) -> Self {
        Self(Arc::new(Node { operation }))
    }

    pub(crate) fn leaf(owner: u64, scope: Scope, name: &str) -> Self {
        Self::new(Operation::Leaf(Leaf { owner, scope, name: name.to_owned() }))
    }

    fn apply(&self, f: Unary) -> Self {
        Self::new(Operation::Unary(f, self.clone()))
    }

    fn scaled(&self, factor: f64) -> Self {
        Self::new(Operation::Binary(Binary::Multiply, self.clone(), Operand::Number(factor).symbol()))
    }

    /// Folds formulas over their operations, each once, operands first.
    pub(crate) fn fold<V: Copy>(
        outputs: &[Self],
        mut value: impl FnMut(&Operation, &[V]) -> PyResult<V>,
    ) -> PyResult<Vec<V>> {
        let mut known: HashMap<*const Node, V> = HashMap::new();
        for output in outputs {
            let mut open = vec![output];
            while let Some(symbol) = open.last().copied() {
                let key = Arc::as_ptr(&symbol.0);
                if known.contains_key(&key) {
                    open.pop();
                    continue;
                }
                let operands = symbol.0.operation.operands();
                let before = open.len();
                open.extend(operands.iter().copied().filter(|o| !known.contains_key(&Arc::as_ptr(&o.0))));
                if open.len() > before {
                    continue;
                }
                let values: Vec<V> = operands.iter().map(|o| known[&Arc::as_ptr(&o.0)]).collect();
                known.insert(key, value(&symbol.0.operation, &values)?);
                open.pop();
            }
        }
        Ok(outputs.iter().map(|o| known[&Arc::as_ptr(&o.0)]).collect())
    }

    /// The formula as text for messages, cut where it is long.
    fn text(&self, depth: usize) -> String {
        if depth == 0 {
            return "..".into();
        }
        let of = |s: &Self| s.text(depth - 1);
        match &self.0.operation {
            Operation::Number(number) => number.to_string(),
            Operation::Leaf(leaf) => leaf.name.clone(),
            Operation::Unary(f, a) => match f.name() {
                Some(name) => format!("{name}({})", of(a)),
                None => format!("-{}", of(a)),
            },
            Operation::Binary(f, a, b) => {
                let (a, b) = (of(a), of(b));
                match f {
                    Binary::Add => format!("({a} + {b})"),
                    Binary::Subtract => format!("({a} - {b})"),
                    Binary::Multiply => format!("{a}*{b}"),
                    Binary::Divide => format!("{a}/{b}"),
                    Binary::Power => format!("{a}**{b}"),
                    Binary::Atan2 => format!("arctan2({a}, {b})"),
                    Binary::Min => format!("min({a}, {b})"),
                    Binary::Max => format!("max({a}, {b})"),
                }
            }
            Operation::Choose(c, [l, r, a, b]) => {
                format!("where({} {} {}, {}, {})", of(l), c.symbol(), of(r), of(a), of(b))
            }
            Operation::Table(table, at) => {
                format!("{}({})", table.name, at.iter().map(of).collect::<Vec<_>>().join(", "))
            }
        }
    }
}

const INSTEAD: &str = "so Python's `if`, `and`, `or`, `not`, `in`, `min`, `max` cannot use it: write apsides.where(condition, then, otherwise), \
                       apsides.min or apsides.max";

#[pymethods]
impl Symbol {
    fn __add__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        both(Binary::Add, self.clone(), other, false)
    }
    fn __radd__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        both(Binary::Add, self.clone(), other, true)
    }
    fn __sub__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        both(Binary::Subtract, self.clone(), other, false)
    }
    fn __rsub__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        both(Binary::Subtract, self.clone(), other, true)
    }
    fn __mul__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        both(Binary::Multiply, self.clone(), other, false)
    }
    fn __rmul__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        both(Binary::Multiply, self.clone(), other, true)
    }
    fn __truediv__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        both(Binary::Divide, self.clone(), other, false)
    }
    fn __rtruediv__(&self, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        both(Binary::Divide, self.clone(), other, true)
    }
    fn __pow__(&self, other: &Bound<'_, PyAny>, _modulo: Option<&Bound<'_, PyAny>>) -> PyResult<Py<PyAny>> {
        both(Binary::Power, self.clone(), other, false)
    }
    fn __rpow__(&self, other: &Bound<'_, PyAny>, _modulo: Option<&Bound<'_, PyAny>>) -> PyResult<Py<PyAny>> {
        both(Binary::Power, self.clone(), other, true)
    }
    fn __neg__(&self) -> Self {
        self.apply(Unary::Negate)
    }
    fn __pos__(&self) -> Self {
        self.clone()
    }
    fn __abs__(&self) -> Self {
        self.apply(Unary::Abs)
    }

    fn __richcmp__(&self, other: &Bound<'_, PyAny>, op: pyo3::basic::CompareOp) -> PyResult<Py<PyAny>> {
        use pyo3::basic::CompareOp;
        let py = other.py();
        let comparison = match op {
            CompareOp::Lt => Comparison::Less,
            CompareOp::Le => Comparison::AtMost,
            CompareOp::Gt => Comparison::Greater,
            CompareOp::Ge => Comparison::AtLeast,
            CompareOp::Eq => Comparison::Equal,
            CompareOp::Ne => {
                let reason = "`!=` of symbols is no constraint and no condition: write <, <=, > or >=";
                return Err(PyTypeError::new_err(reason));
            }
        };
        match operand(other) {
            None => Ok(py.NotImplemented()),
            Some(right) => Condition { left: self.clone(), comparison, right }.into_py_any(py),
        }
    }

    fn __hash__(&self) -> usize {
        Arc::as_ptr(&self.0) as usize
    }

    fn __bool__(&self) -> PyResult<bool> {
        let text = self.text(6);
        Err(PyTypeError::new_err(format!(
            "the value of `{text}` is not known while equations are traced, {INSTEAD}"
        )))
    }

    fn __float__(&self) -> PyResult<f64> {
        let text = self.text(6);
        Err(PyTypeError::new_err(format!(
            "`{text}` has no number while equations are traced: functions of `math`, interpolators and arrays of floats do not take it; use \
             functions of numpy or apsides, apsides.table for data, and arrays of objects"
        )))
    }

    fn __int__(&self) -> PyResult<i64> {
        self.__float__().map(|_| 0)
    }

    fn __repr__(&self) -> String {
        self.text(8)
    }

    /// Name of the quantity; None of a formula.
    #[getter]
    fn name(&self) -> Option<&str> {
        match &self.0.operation {
            Operation::Leaf(leaf) => Some(&leaf.name),
            _ => None,
        }
    }

    /// The state at the start of its phase, for constraints and objectives.
    #[getter]
    fn start(&self) -> PyResult<Self> {
        self.at_end("start")
    }

    /// The state at the end of its phase, for constraints and objectives.
    #[getter]
    fn end(&self) -> PyResult<Self> {
        self.at_end("end")
    }

    /// A quantity of a problem (Python's classes call it). `phase` is none of what belongs to the whole problem.
    #[staticmethod]
    fn quantity(owner: u64, name: &str, phase: Option<String>, at_end: bool) -> Self {
        let scope = match phase {
            _ if at_end => Scope::End,
            Some(phase) => Scope::Phase(phase),
            None => Scope::Problem,
        };
        Self::leaf(owner, scope, name)
    }

    // NumPy calls these methods of objects.
    fn sin(&self) -> Self {
        self.apply(Unary::Sin)
    }
    fn cos(&self) -> Self {
        self.apply(Unary::Cos)
    }
    fn tan(&self) -> Self {
        self.apply(Unary::Tan)
    }
    fn arcsin(&self) -> Self {
        self.apply(Unary::Asin)
    }
    fn arccos(&self) -> Self {
        self.apply(Unary::Acos)
    }
    fn arctan(&self) -> Self {
        self.apply(Unary::Atan)
    }
    fn sinh(&self) -> Self {
        self.apply(Unary::Sinh)
    }
    fn cosh(&self) -> Self {
        self.apply(Unary::Cosh)
    }
    fn tanh(&self) -> Self {
        self.apply(Unary::Tanh)
    }
    fn arcsinh(&self) -> Self {
        self.apply(Unary::Asinh)
    }
    fn arccosh(&self) -> Self {
        self.apply(Unary::Acosh)
    }
    fn arctanh(&self) -> Self {
        self.apply(Unary::Atanh)
    }
    fn exp(&self) -> Self {
        self.apply(Unary::Exp)
    }
    fn log(&self) -> Self {
        self.apply(Unary::Ln)
    }
    fn log10(&self) -> Self {
        self.apply(Unary::Ln).scaled(std::f64::consts::LOG10_E)
    }
    fn log2(&self) -> Self {
        self.apply(Unary::Ln).scaled(std::f64::consts::LOG2_E)
    }
    fn exp2(&self) -> Self {
        self.scaled(std::f64::consts::LN_2).apply(Unary::Exp)
    }
    fn sqrt(&self) -> Self {
        self.apply(Unary::Sqrt)
    }
    fn cbrt(&self) -> Self {
        self.apply(Unary::Cbrt)
    }
    fn square(&self) -> Self {
        Self::new(Operation::Binary(Binary::Multiply, self.clone(), self.clone()))
    }
    fn conjugate(&self) -> Self {
        self.clone()
    }
    fn deg2rad(&self) -> Self {
        self.scaled(std::f64::consts::PI / 180.0)
    }
    fn radians(&self) -> Self {
        self.deg2rad()
    }
    fn rad2deg(&self) -> Self {
        self.scaled(180.0 / std::f64::consts::PI)
    }
    fn degrees(&self) -> Self {
        self.rad2deg()
    }
    #[pyo3(signature = (ufunc, method, *inputs, **kwargs))]
    fn __array_ufunc__<'py>(
        &self,
        ufunc: &Bound<'py, PyAny>,
        method: &str,
        inputs: &Bound<'py, PyTuple>,
        kwargs: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        array_ufunc(ufunc, method, inputs, kwargs)
    }

    fn __array_function__<'py>(
        &self,
        function: &Bound<'py, PyAny>,
        _types: &Bound<'py, PyAny>,
        args: &Bound<'py, PyAny>,
        kwargs: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        of_numpy(function.py(), "array_function")?.call1((function, args, kwargs))
    }

    fn arctan2(&self, x: Operand) -> Self {
        Self::new(Operation::Binary(Binary::Atan2, self.clone(), x.symbol()))
    }
    fn hypot(&self, y: Operand) -> Self {
        let y = y.symbol();
        let square = |s: &Self| Self::new(Operation::Binary(Binary::Multiply, s.clone(), s.clone()));
        Self::new(Operation::Binary(Binary::Add, square(self), square(&y))).apply(Unary::Sqrt)
    }
}

impl Symbol {
    fn at_end(&self, end: &str) -> PyResult<Self> {
        match &self.0.operation {
            Operation::Leaf(Leaf { owner, scope: Scope::Phase(phase), name }) => {
                Ok(Self::leaf(*owner, Scope::End, &format!("{phase}.{end}.{name}")))
            }
            Operation::Leaf(Leaf { name, .. }) => Err(ProblemError::new_err(format!(
                "`{name}` is no state of a phase, so that it has no `{end}`"
            ))),
            _ => Err(ProblemError::new_err(format!(
                "only a state has its value at an end: write the formula with `.{end}` of each state in it"
            ))),
        }
    }
}

/// A function of the module that knows NumPy's.
fn of_numpy<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("apsides._numpy")?.getattr(name)
}

fn array_ufunc<'py>(
    ufunc: &Bound<'py, PyAny>,
    method: &str,
    inputs: &Bound<'py, PyTuple>,
    kwargs: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = ufunc.py();
    let kwargs = kwargs.cloned().unwrap_or_else(|| PyDict::new(py));
    of_numpy(py, "array_ufunc")?.call1((ufunc, method, inputs, kwargs))
}

impl Condition {
    /// The left side less the right one.
    pub(crate) fn difference(&self) -> Symbol {
        Symbol::new(Operation::Binary(Binary::Subtract, self.left.clone(), self.right.clone()))
    }
}

#[pymethods]
impl Condition {
    fn __bool__(&self) -> PyResult<bool> {
        let text = self.__repr__();
        Err(PyTypeError::new_err(format!(
            "whether `{text}` holds is not known while equations are traced, {INSTEAD}"
        )))
    }

    #[pyo3(signature = (ufunc, method, *inputs, **kwargs))]
    fn __array_ufunc__<'py>(
        &self,
        ufunc: &Bound<'py, PyAny>,
        method: &str,
        inputs: &Bound<'py, PyTuple>,
        kwargs: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        array_ufunc(ufunc, method, inputs, kwargs)
    }

    fn __array_function__<'py>(
        &self,
        function: &Bound<'py, PyAny>,
        _types: &Bound<'py, PyAny>,
        args: &Bound<'py, PyAny>,
        kwargs: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        of_numpy(function.py(), "array_function")?.call1((function, args, kwargs))
    }

    fn __repr__(&self) -> String {
        format!("{} {} {}", self.left.text(6), self.comparison.symbol(), self.right.text(6))
    }
}
