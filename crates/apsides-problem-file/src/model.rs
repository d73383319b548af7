//! The parts of a problem as they are stated, in a file or by a program.
//!
//! Each part has a place, `at`: bytes of the text of a file, or the index of a place where a program states it, as an empty range
//! ([`at_place`]).

use std::ops::Range;

use apsides_expressions::{Expression, Library, Relation, Unit};

/// A number in the unit of its quantity, or a formula of constants.
#[derive(Clone, Debug, PartialEq)]
pub enum Amount {
    /// A number.
    Number(f64),
    /// A formula of constants, in coherent SI units.
    Formula(Expression),
}

/// An amount with its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Stated {
    /// The number, or the formula that it follows from.
    pub amount: Amount,
    /// Its place.
    pub at: Range<usize>,
}

/// Allowed values at an end.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// Any value.
    Free,
    /// One value.
    Fixed(Stated),
    /// Values from the first to the second.
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
    /// The place of its name.
    pub at: Range<usize>,
}

/// The table of a function of one or two variables.
#[derive(Clone, Debug, PartialEq)]
pub struct TableData {
    /// Its name.
    pub name: String,
    /// Knots of the first variable, in coherent SI units.
    pub x: Vec<f64>,
    /// Empty in a table of one variable.
    pub y: Vec<f64>,
    /// A row for each `x`.
    pub values: Vec<f64>,
    /// The curve through the values.
    pub shape: Shape,
    /// The text of its file, where it comes from one.
    pub csv: Option<String>,
    /// Its place.
    pub at: Range<usize>,
}

/// The curve through a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Cubic splines with two continuous derivatives.
    Spline,
    /// Piecewise cubics that keep the shape of the data, constant outside.
    Monotone,
}

/// A named quantity with unit and bounds: a state, a control, a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Its place.
    pub at: Range<usize>,
    /// The unit that its numbers are in.
    pub unit: Unit,
    /// Smallest value; none where there is no bound.
    pub least: Option<Stated>,
    /// Largest value; none where there is no bound.
    pub most: Option<Stated>,
    /// A typical size; one is chosen where none is stated.
    pub scale: Option<Stated>,
    /// Bounds that no solution is meant to reach, the smallest and the largest value.
    pub guards: [bool; 2],
    /// Values at the start of the phase, of a state.
    pub start: Option<End>,
    /// Values at the end of the phase, of a state.
    pub end: Option<End>,
    /// The largest miss that a re-simulation may show, of a state.
    pub tolerance: Option<Stated>,
    /// The value where a solve begins, of a parameter.
    pub guess: Option<Stated>,
    /// Smallest and largest rate of a control, in its unit per second. It has values at the ends then, as a state has.
    pub rate: Option<[Stated; 2]>,
}

impl Variable {
    /// A quantity of which nothing but its name, its place and its unit is stated.
    #[must_use]
    pub fn new(name: String, at: Range<usize>, unit: Unit) -> Self {
        Self {
            name,
            at,
            unit,
            least: None,
            most: None,
            scale: None,
            guards: [false; 2],
            start: None,
            end: None,
            tolerance: None,
            guess: None,
            rate: None,
        }
    }
}

/// A formula with bounds: a path constraint, a constraint of ends, an integral.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Its name.
    pub name: String,
    /// Its place.
    pub at: Range<usize>,
    /// The formula, and its bounds.
    pub formula: Bounded,
    /// Its unit, where one is stated.
    pub unit: Option<Unit>,
    /// A typical size.
    pub scale: Option<Stated>,
    /// Bounds that no solution is meant to reach.
    pub guards: [bool; 2],
}

/// A formula and its bounds.
#[derive(Clone, Debug, PartialEq)]
pub enum Bounded {
    /// A row of comparisons: `a <= b <= c`.
    Relation(Relation),
    /// A row of keys.
    Keys {
        /// The formula.
        value: Expression,
        /// Smallest value.
        least: Option<Stated>,
        /// Largest value.
        most: Option<Stated>,
    },
}

/// Times of a phase.
#[derive(Clone, Debug, PartialEq)]
pub struct Times {
    /// The time at which the phase begins.
    pub start: Option<End>,
    /// The time at which it ends.
    pub end: Option<End>,
    /// The time that it takes.
    pub duration: Option<End>,
    /// The unit of these times.
    pub unit: Option<Unit>,
    /// Its place.
    pub at: Range<usize>,
}

/// A phase.
#[derive(Clone, Debug, PartialEq)]
pub struct Phase {
    /// Its name.
    pub name: String,
    /// Its place.
    pub at: Range<usize>,
    /// Its times.
    pub times: Option<Times>,
    /// States, in order.
    pub states: Vec<Variable>,
    /// Controls, in order.
    pub controls: Vec<Variable>,
    /// Name of a state, its bytes, its rate.
    pub dynamics: Vec<(String, Range<usize>, Expression)>,
    /// Constraints along the phase.
    pub path: Vec<Row>,
    /// Integrals over the phase.
    pub integrals: Vec<Row>,
    /// Names of states, and values at which formulas have a kink.
    pub kinks: Vec<(String, Range<usize>, Vec<Stated>)>,
    /// Names of controls that are the angles of a direction, one or two.
    pub directions: Vec<(Vec<String>, Range<usize>)>,
}

/// The end of one phase is the start of another.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// The phase that ends.
    pub from: String,
    /// The phase that begins.
    pub to: String,
    /// Its place.
    pub at: Range<usize>,
    /// States that change between the phases by an amount.
    pub jumps: Vec<(String, Range<usize>, Stated)>,
    /// States that are not joined.
    pub free: Vec<(String, Range<usize>)>,
}

/// The objective.
#[derive(Clone, Debug, PartialEq)]
pub struct Objective {
    /// It is maximised, not minimised.
    pub maximize: bool,
    /// The formula, of quantities at ends, parameters and integrals.
    pub formula: Expression,
    /// Its name.
    pub name: Option<String>,
    /// Its unit.
    pub unit: Option<Unit>,
    /// A typical size.
    pub scale: Option<Stated>,
}

/// Values of a quantity along a phase.
#[derive(Clone, Debug, PartialEq)]
pub enum Profile {
    /// Values along the phase.
    Samples(Vec<Stated>),
    /// A formula of time and of constants.
    Formula(Expression),
}

/// The guess of a phase.
#[derive(Clone, Debug, PartialEq)]
pub struct Guess {
    /// The phase; none of the only one.
    pub phase: Option<String>,
    /// Its place.
    pub at: Range<usize>,
    /// At least two times that increase.
    pub times: Option<Vec<Stated>>,
    /// Names of states and controls, and their values.
    pub profiles: Vec<(String, Range<usize>, Profile)>,
}

/// The axes of a stated motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotionAxes {
    /// Inertial axes at the centre of the body.
    Inertial,
    /// Axes fixed to the body, at its centre; velocities are relative to it.
    Fixed,
    /// To the east, to the north and upwards at a site, from there; velocities are relative to the body.
    Site,
}

impl MotionAxes {
    /// The words of all axes.
    pub const WORDS: [(&str, Self); 3] =
        [("inertial", Self::Inertial), ("fixed", Self::Fixed), ("site", Self::Site)];

    /// The axes of a word, if it is one of theirs.
    #[must_use]
    pub fn of_word(word: &str) -> Option<Self> {
        Self::WORDS.iter().find(|(name, _)| *name == word).map(|(_, axes)| *axes)
    }
}

/// A place on a body.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionSite {
    /// Longitude; numbers are in deg.
    pub longitude: Stated,
    /// Geodetic latitude; numbers are in deg.
    pub latitude: Stated,
    /// Height above the surface, where it is not zero; numbers are in m.
    pub altitude: Option<Stated>,
}

/// The formulas of a quantity of a motion, in one phase or in all.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionPart {
    /// The phase; none of all.
    pub phase: Option<String>,
    /// Its place.
    pub at: Range<usize>,
    /// Formulas of states, controls, parameters and time: three of a vector, one of a mass.
    pub components: Vec<Expression>,
}

/// The motion about a body that ephemerides are made of.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedMotion {
    /// Its place.
    pub at: Range<usize>,
    /// Name of the body, or the path of its file.
    pub body: String,
    /// The place of the name of the body.
    pub body_at: Range<usize>,
    /// The axes of the vectors.
    pub axes: MotionAxes,
    /// The site of the axes, if they have one.
    pub site: Option<MotionSite>,
    /// Position.
    pub position: Vec<MotionPart>,
    /// Velocity.
    pub velocity: Vec<MotionPart>,
    /// Thrust; empty where it is not stated.
    pub thrust: Vec<MotionPart>,
    /// Mass; empty where it is not stated.
    pub mass: Vec<MotionPart>,
}

/// Everything that a file states.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// Its name.
    pub name: Option<String>,
    /// Its purpose, in one line.
    pub title: Option<String>,
    /// Constants, the keys of a mission.
    pub constants: Vec<Constant>,
    /// Definitions and tables that formulas name.
    pub library: Library,
    /// Places of the definitions.
    pub definitions: Vec<Range<usize>>,
    /// The data of the tables, in the order of the library.
    pub tables: Vec<TableData>,
    /// Unknown constants of the whole problem.
    pub parameters: Vec<Variable>,
    /// The phases in order.
    pub phases: Vec<Phase>,
    /// Phases that are joined.
    pub links: Vec<Link>,
    /// Constraints of quantities at ends.
    pub boundary: Vec<Row>,
    /// The objective.
    pub objective: Option<Objective>,
    /// The start of a solve.
    pub guess: Vec<Guess>,
    /// The motion about a body, if there is one.
    pub motion: Option<StatedMotion>,
    /// Units are declared.
    pub has_units: bool,
    /// Units are checked through all formulas.
    pub checks_units: bool,
}

/// The place of a part that a program states, by the index of the place.
#[must_use]
pub fn at_place(index: usize) -> Range<usize> {
    index..index
}
