//! Problems with equations of their own: files with `kind = "problem"`, and statements of a program.
//!
//! They say what states, controls, equations of motion, constraints and the objective are; their constants are the keys of the mission.

mod motion;
mod paths;

use std::sync::{Arc, OnceLock};

use apsides_dynamics::Body;
use apsides_ephemeris::Motion;
pub use apsides_expressions::function_names;
use apsides_ocp::not_finite::NamedFormula;
use apsides_ocp::{PhaseTrajectory, Trajectory};
use apsides_pipeline::file::{StatedValue, line};
use apsides_pipeline::key::{Key, KeyKind, Range, Value};
use apsides_pipeline::method::{MethodName, Methods};
use apsides_pipeline::placing::{self, Whereabouts};
use apsides_pipeline::registry::Document;
use apsides_pipeline::values::Values;
use apsides_pipeline::{Curve, Error, Kind, Mission, Offers, Pipeline, Posed, Scalars, regular_file};
use apsides_problem_file::{Constant, DeclaredUnit, PosedProblem, ProblemFile, Statement, Written};

/// Names of the units that files may declare.
///
/// # Examples
/// ```
/// use apsides_missions::problem::unit_names;
///
/// assert!(["km", "kg", "deg"].iter().all(|name| unit_names().any(|known| known == *name)));
/// ```
pub fn unit_names() -> impl Iterator<Item = &'static str> {
    apsides_expressions::Unit::names()
}

/// The word that files of this kind begin with.
pub const WORD: &str = "problem";

/// A file of this kind, with comments, that is solved as it is.
pub const STARTER: &str = include_str!("../../missions/problem/starter.toml");

/// The table that a file without a place needs.
const MOTION_NEEDED: &str = "a table [motion] with body, position and velocity would say them";

/// A problem with the values of its constants.
#[derive(Clone)]
pub struct OwnProblem {
    statement: Arc<Statement>,
    posed: PosedProblem,
    /// The body of the motion that is stated.
    body: Option<Body>,
    /// Keys of the results that name a case in a table.
    headline: Vec<String>,
}

impl std::fmt::Debug for OwnProblem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OwnProblem").field("name", &self.statement.name()).finish_non_exhaustive()
    }
}

/// The kind of mission of a file, and what the file states besides its equations.
///
/// # Errors
/// The first mistake with its place, or all that is missing.
pub fn read(document: &Document<'_>) -> Result<(Kind, Vec<StatedValue>), Error> {
    let files =
        |path: &str| regular_file::read_text(&document.directory.unwrap_or_else(|| "".as_ref()).join(path));
    let mut others: Vec<&str> =
        Methods::keys().chain(placing::KEYS).filter_map(|k| k.path.split('.').next()).collect();
    others.dedup();
    let file = ProblemFile::parse(document.text, document.source, &files, &others).map_err(Error::model)?;
    let place = |offset| format!("{}, line {}", document.source, line(document.text, offset));
    let mut stated = apsides_pipeline::file::entries(document.text, place)?;
    stated.retain(|e| others.contains(&e.path.split('.').next().unwrap_or_default()));
    let statement = Arc::new(file.statement().clone());
    let is_placing = |e: &&StatedValue| placing::KEYS.iter().any(|key| key.path == e.path);
    if let Some(e) = stated.iter().find(is_placing).filter(|_| statement.motion().is_none()) {
        let reason =
            format!("`{}` is of ephemerides, and the file says no position: {MOTION_NEEDED}", e.path);
        return Err(Error::Conflict { place: e.place.clone(), reason });
    }
    stated.extend(stated_constants(&statement));
    Ok((kind_of(statement, move |values| written(&file, values)), stated))
}

/// The pipeline of a problem that a program states. Its mission file is that of the same problem.
///
/// # Errors
/// Values that do not make a problem.
pub fn pipeline(statement: Arc<Statement>) -> Result<Pipeline, Error> {
    let (stated, exported) = (stated_constants(&statement), Arc::clone(&statement));
    // The text is made when it is asked for, and once.
    let file = OnceLock::new();
    let writes = move |values: &Values| {
        let source = format!("problem `{}`", exported.name());
        let none = |_: &str| Err(std::io::ErrorKind::NotFound.into());
        let numbers = constants(&exported, values).unwrap_or_default();
        // Definitions in definitions have a limit.
        let read = || {
            let file = ProblemFile::parse(&exported.exported(), &source, &none, &[]).ok()?;
            file.statement().pose(&numbers).is_ok().then_some(file)
        };
        match file.get_or_init(read) {
            Some(file) => with_settings(file, &numbers, values),
            None => format!("# The formulas of {source} are too long for a file.\n"),
        }
    };
    let kind = kind_of(statement, writes);
    let mut values = Values::new(format!("problem `{}`", kind.name), kind.name.to_string(), kind.all_keys());
    for e in stated {
        values.state(&e.path, e.value, &e.place)?;
    }
    Pipeline::new(kind.clone(), vec![kind].into(), values)
}

fn path(constant: &Constant) -> String {
    format!("constants.{}", constant.name)
}

fn stated_constants(statement: &Statement) -> Vec<StatedValue> {
    let entry = |c: &Constant| {
        let place = statement.place_of(c);
        let place = format!("{}, line {}", place.source, place.line);
        StatedValue { path: path(c), value: Value::Number(c.value), place }
    };
    statement.constants().iter().map(entry).collect()
}

/// The kind of mission of a problem: its constants are keys.
fn kind_of(statement: Arc<Statement>, writes: impl Fn(&Values) -> String + Send + Sync + 'static) -> Kind {
    let key = |c: &Constant| {
        let range = match c.range.map(|v| (v, v.is_finite())) {
            [least, most] => Range { least, most },
        };
        let unit = if c.unit.to_string() == "-" { String::new() } else { c.unit.to_string() };
        let meaning = if c.meaning.is_empty() {
            format!("constant `{}` of the problem", c.name)
        } else {
            c.meaning.clone()
        };
        Key::of_file(path(c), c.value, range, meaning, unit)
    };
    let keys: Vec<Key> = statement.constants().iter().map(key).collect();
    let (name, title) = (statement.name().to_owned(), statement.title().to_owned());
    let offers = Offers { ephemeris: statement.motion().is_some(), ..Offers::default() };
    let reads = move |values: &Values| -> Result<Arc<dyn Mission>, Error> {
        Ok(Arc::new(OwnProblem::new(&statement, values)?))
    };
    Kind::of_file(name, title, keys, reads, writes).offering(offers)
}

fn constants(statement: &Statement, values: &Values) -> Result<Vec<f64>, Error> {
    statement.constants().iter().map(|c| values.number(&path(c))).collect()
}

fn written(file: &ProblemFile, values: &Values) -> String {
    // The keys are those of the file.
    with_settings(file, &constants(file.statement(), values).unwrap_or_default(), values)
}

/// The file with numbers of its constants, and with the settings of methods that are stated.
fn with_settings(file: &ProblemFile, numbers: &[f64], values: &Values) -> String {
    let of_method =
        values.keys().filter(|k| !k.path.starts_with("constants.") && values.place(&k.path).is_some());
    let of_method = of_method.filter_map(|k| {
        let written = match (values.get(&k.path)?, &k.kind) {
            (Value::Number(v), KeyKind::Count(..)) => Written::Count(*v as i64),
            (Value::Number(v), _) => Written::Number(*v),
            (Value::Word(w), _) => Written::Word(w),
            (Value::Flag(v), _) => Written::Flag(*v),
            (Value::Other(_), _) => return None,
        };
        Some((&*k.path, written))
    });
    file.written(numbers, of_method)
}

impl OwnProblem {
    fn new(statement: &Arc<Statement>, values: &Values) -> Result<Self, Error> {
        let posed = statement.pose(&constants(statement, values)?).map_err(Error::model)?;
        let mut headline = vec![objective_key(&posed)];
        let body = motion::body_of(statement)?;
        let times = posed.ocp.phases.iter().map(|p| {
            let unit = statement.time_unit(&p.name).map_or_else(String::new, |u| u.name);
            with_unit(&before(&p.name, posed.ocp.phases.len() > 1, "final_time"), &unit)
        });
        headline.extend(times);
        Ok(Self { statement: Arc::clone(statement), posed, body, headline })
    }

    /// The problem as it is stated.
    #[must_use]
    pub fn statement(&self) -> &Statement {
        &self.statement
    }

    /// The problem with a start.
    #[must_use]
    pub fn posed(&self) -> &PosedProblem {
        &self.posed
    }

    /// Times, and states at both ends, of one phase.
    fn of_phase(&self, flight: &PhaseTrajectory, several: bool) -> Scalars {
        let mut scalars = Scalars::new();
        let mut add = |name: String, value: f64, unit: Option<DeclaredUnit>| {
            let unit = unit.unwrap_or_else(|| DeclaredUnit { name: "-".into(), factor: 1.0 });
            let key = with_unit(&before(&flight.name, several, &name), &unit.name);
            scalars.insert(key, value / unit.factor);
        };
        add("final_time".into(), flight.final_time, self.statement.time_unit(&flight.name));
        if flight.initial_time != 0.0 {
            add("initial_time".into(), flight.initial_time, self.statement.time_unit(&flight.name));
        }
        let Some(phase) = self.posed.ocp.phases.iter().find(|p| p.name == flight.name) else {
            return scalars;
        };
        let (start, end) = (flight.state_at(flight.initial_time), flight.final_state());
        for (k, state) in phase.states.iter().enumerate() {
            let name = &state.variable.name;
            let unit = || self.statement.unit_of(&flight.name, name);
            add(format!("final_{name}"), end[k], unit());
            if !state.initial.is_fixed() {
                add(format!("initial_{name}"), start[k], unit());
            }
        }
        scalars
    }
}

/// A key of a phase, with the name of the phase where there are several.
fn before(phase: &str, several: bool, name: &str) -> String {
    if several { format!("{phase}_{name}") } else { name.to_owned() }
}

/// The key of the objective among the results.
fn objective_key(posed: &PosedProblem) -> String {
    let objective = &posed.ocp.objective;
    let name: String = objective.name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
    // Where none is stated the name is that word.
    let key = if name == "objective" { name } else { format!("objective_{name}") };
    with_unit(&key, &objective.unit)
}

/// A key that ends with its unit.
fn with_unit(name: &str, unit: &str) -> String {
    if unit == "-" {
        return name.to_owned();
    }
    let mut key = name.to_owned();
    for part in unit.split(|c: char| !c.is_alphanumeric()).filter(|part| !part.is_empty()) {
        key.push('_');
        key.push_str(&part.to_lowercase());
    }
    key
}

impl Mission for OwnProblem {
    /// A file has a kind of its own: see [`read`].
    fn kind() -> Kind {
        Kind::new::<Self>(WORD, "A problem with equations of its file", &[])
    }

    /// Refused: see [`read`].
    fn read(values: &Values) -> Result<Self, Error> {
        Err(values.conflict("a problem has its equations in a file that begins with `kind = \"problem\"`"))
    }

    fn place_of(&self, formula: &NamedFormula) -> Option<String> {
        self.statement.place_of_formula(formula).map(|place| place.with_line())
    }

    fn pose(&self, _method: MethodName) -> Result<Posed, Error> {
        let PosedProblem { ocp, guess, .. } = self.posed.clone();
        Ok(Posed::new(ocp, guess))
    }

    fn whereabouts(&self) -> Whereabouts {
        if self.body.is_some() { Whereabouts::Point } else { Whereabouts::NotSo(MOTION_NEEDED) }
    }

    fn motion<'a>(&'a self, solution: &'a Trajectory) -> Option<Box<dyn Motion + 'a>> {
        let (posed, body) = (self.posed.motion.as_ref()?, self.body.as_ref()?);
        Some(Box::new(motion::StatedFlight::new(posed, body, &solution.parameters)))
    }

    fn headline(&self) -> Vec<&str> {
        self.headline.iter().map(String::as_str).collect()
    }

    fn curves(&self, solution: &Trajectory) -> Vec<Curve> {
        paths::paths(&self.posed.ocp, solution)
    }

    fn results(&self, solution: &Trajectory) -> Scalars {
        let several = solution.phases.len() > 1;
        let mut scalars: Scalars = solution.phases.iter().flat_map(|p| self.of_phase(p, several)).collect();
        for (parameter, value) in self.posed.ocp.parameters.iter().zip(&solution.parameters) {
            if let Some(unit) = self.statement.parameter_unit(&parameter.name) {
                scalars.insert(with_unit(&parameter.name, &unit.name), value / unit.factor);
            }
        }
        scalars.insert(objective_key(&self.posed), solution.objective);
        scalars
    }
}
