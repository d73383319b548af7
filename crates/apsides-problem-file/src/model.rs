//! The parts of a problem as its file states them.

use std::ops::Range;

use apsides_expressions::{Expression, Library, Relation, Unit};

/// A number in the unit of its quantity, or a formula of constants.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Amount {
    Number(f64),
    Formula(Expression),
}

/// An amount with its bytes in the file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Stated {
    pub(crate) amount: Amount,
    pub(crate) at: Range<usize>,
}

/// Allowed values at an end.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum End {
    Free,
    Fixed(Stated),
    Between(Stated, Stated),
}

/// A constant: a key of the mission.
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    /// Its name.
    pub name: String,
    /// Its value in `unit`.
    pub value: f64,
    /// Its unit.
    pub unit: Unit,
    /// Smallest and largest value that it may be given, in `unit`.
    pub range: [f64; 2],
    /// Its meaning, in the words of the file.
    pub meaning: String,
    /// The bytes of its name in the file.
    pub(crate) at: Range<usize>,
}

/// The table of a function of one or two variables.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TableData {
    pub(crate) name: String,
    pub(crate) x: Vec<f64>,
    /// Empty in a table of one variable.
    pub(crate) y: Vec<f64>,
    /// A row for each `x`.
    pub(crate) values: Vec<f64>,
    pub(crate) shape: Shape,
    /// The text of its file, where it comes from one.
    pub(crate) csv: Option<String>,
    pub(crate) at: Range<usize>,
}

/// The curve through a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    /// Cubic splines with two continuous derivatives.
    Spline,
    /// Piecewise cubics that keep the shape of the data, constant outside.
    Monotone,
}

/// A named quantity with unit and bounds: a state, a control, a parameter.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Variable {
    pub(crate) name: String,
    pub(crate) at: Range<usize>,
    pub(crate) unit: Unit,
    pub(crate) least: Option<Stated>,
    pub(crate) most: Option<Stated>,
    pub(crate) scale: Option<Stated>,
    pub(crate) guards: [bool; 2],
    pub(crate) start: Option<End>,
    pub(crate) end: Option<End>,
    pub(crate) tolerance: Option<Stated>,
    pub(crate) guess: Option<Stated>,
}

/// A formula with bounds: a path constraint, a constraint of ends, an integral.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    pub(crate) name: String,
    pub(crate) at: Range<usize>,
    pub(crate) formula: Bounded,
    pub(crate) unit: Option<Unit>,
    pub(crate) scale: Option<Stated>,
    pub(crate) guards: [bool; 2],
}

/// A formula and its bounds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Bounded {
    /// As comparisons: `a <= b <= c`.
    Relation(Relation),
    /// As keys.
    Keys { value: Expression, least: Option<Stated>, most: Option<Stated> },
}

/// Times of a phase.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Times {
    pub(crate) start: Option<End>,
    pub(crate) end: Option<End>,
    pub(crate) duration: Option<End>,
    pub(crate) unit: Option<Unit>,
    pub(crate) at: Range<usize>,
}

/// A phase.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Phase {
    pub(crate) name: String,
    pub(crate) at: Range<usize>,
    pub(crate) times: Option<Times>,
    pub(crate) states: Vec<Variable>,
    pub(crate) controls: Vec<Variable>,
    /// Name of a state, its bytes, its rate.
    pub(crate) dynamics: Vec<(String, Range<usize>, Expression)>,
    pub(crate) path: Vec<Row>,
    pub(crate) integrals: Vec<Row>,
    pub(crate) kinks: Vec<(String, Range<usize>, Vec<Stated>)>,
    /// Names of controls that are the angles of a direction, one or two.
    pub(crate) directions: Vec<(Vec<String>, Range<usize>)>,
}

/// The end of one phase is the start of another.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Link {
    pub(crate) from: String,
    pub(crate) to: String,
    pub(crate) at: Range<usize>,
    /// States that change between the phases by an amount.
    pub(crate) jumps: Vec<(String, Range<usize>, Stated)>,
    /// States that are not joined.
    pub(crate) free: Vec<(String, Range<usize>)>,
}

/// The objective.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Objective {
    pub(crate) maximize: bool,
    pub(crate) formula: Expression,
    pub(crate) name: Option<String>,
    pub(crate) unit: Option<Unit>,
    pub(crate) scale: Option<Stated>,
}

/// Values of a quantity along a phase.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Profile {
    Samples(Vec<Stated>),
    /// A formula of time and of constants.
    Formula(Expression),
}

/// The guess of a phase.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Guess {
    pub(crate) phase: Option<String>,
    pub(crate) at: Range<usize>,
    pub(crate) times: Option<Vec<Stated>>,
    pub(crate) profiles: Vec<(String, Range<usize>, Profile)>,
}

/// Everything that a file states.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Model {
    pub(crate) name: Option<String>,
    pub(crate) title: Option<String>,
    pub(crate) constants: Vec<Constant>,
    pub(crate) library: Library,
    /// Bytes of the names of the definitions.
    pub(crate) definitions: Vec<Range<usize>>,
    pub(crate) tables: Vec<TableData>,
    pub(crate) parameters: Vec<Variable>,
    pub(crate) phases: Vec<Phase>,
    pub(crate) links: Vec<Link>,
    pub(crate) boundary: Vec<Row>,
    pub(crate) objective: Option<Objective>,
    pub(crate) guess: Vec<Guess>,
    /// Units are declared, and so they are checked.
    pub(crate) has_units: bool,
}
