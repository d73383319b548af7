//! Published tables computed again: what is printed beside what the published method gives and beside the optimum.
//!
//! ```text
//! printed row -> the paper's own discretisation, solved and flown again -> refined flatness, Radau -> findings
//! ```
//!
//! Each row of a [`Table`] is solved three ways: by the nonlinear program of the publication, by flatness refined until the splines meet
//! the equations of motion, and by collocation at Radau points. The last two make the optimum; findings say what a printed number
//! cannot be. A [`Sheet`] has columns of its own, for publications whose rows have rules of their own.
#![cfg_attr(not(test), warn(clippy::expect_used, clippy::panic, clippy::unimplemented, clippy::unreachable))]

use std::time::Instant;

use apsides_nlp::Status;
use apsides_ocp::Trajectory;
use apsides_verify::Verdict;

use apsides_pipeline::memory::Foreseen;
use apsides_pipeline::{Error, Observer, Outcome, Pipeline, Posed, SearchProgress};
use change::Change;
use stop::Stop;
use workers::Workers;

mod capsule_reentry;
mod chang_e;
mod change;
mod geo_injection;
mod items;
mod lunar_landing;
mod moving_mass;
mod pages;
mod powered_descent;
mod sheet;
mod sheet_text;
mod stop;
mod workers;

pub use items::{PaperItem, Shown, items, items_markdown};
pub use pages::{COMPARISON_HEADS, comparison_columns, miss_sentence, write_reproduction};
pub use sheet::{Column, Graph, GraphSeries, Sheet, SheetRow};
pub use sheet_text::sheet_text;

/// Reads one of the missions that come with apsides.
fn load(name: &str, changes: &[Change<'_>]) -> Result<Pipeline, Error> {
    apsides_missions::registry().load_with(name, changes.iter().map(Change::stated))
}

/// A publication whose tables can be computed again.
struct Publication {
    name: &'static str,
    title: &'static str,
    source: &'static str,
    /// Remarks on the whole.
    remarks: fn() -> Result<Vec<String>, Error>,
    /// The largest resident memory that was measured with one thread, and what each further one added, MB.
    memory_mb: [f64; 2],
    /// Tables whose rows are each computed three ways.
    tables: &'static [PrintedTable],
    /// Short names of the sheets, in the order in which they are handed on.
    sheets: &'static [&'static str],
    compute: ComputeSheets,
    /// Everything that the publication states, with what shows it.
    items: &'static [PaperItem],
    /// Files of the missions behind the numbers: the name of a mission with `.toml`.
    missions: &'static [&'static str],
}

/// Computes sheets and hands each on.
type ComputeSheets = fn(&mut Workers<'_>, HandOn<'_>) -> Result<(), Stop>;

/// Takes a sheet that is done, or ends the work.
type HandOn<'a> = &'a mut dyn FnMut(Sheet) -> Result<(), Stop>;

impl Publication {
    fn parts(&self) -> usize {
        self.tables.iter().map(|t| t.rows.len()).sum::<usize>() + self.sheets.len()
    }
}

/// A table as printed, and how to compute its rows.
struct PrintedTable {
    id: &'static str,
    figure: &'static str,
    title: &'static str,
    parameter: &'static str,
    /// Printed quantities; the first is minimised.
    keys: &'static [&'static str],
    rows: &'static [PrintedRow],
    remarks: &'static [&'static str],
    /// Mission of the case with this parameter, and the value that it changes.
    case: fn(f64) -> (&'static str, Change<'static>),
    /// Changes that give the publication's own nonlinear program.
    own_method: &'static [Change<'static>],
    findings: fn(&Solved<'_>, &mut [Comparison]) -> Result<(), Error>,
}

impl PrintedTable {
    fn empty(&self) -> Table {
        let Self { id, figure, title, parameter, remarks, .. } = *self;
        Table { id, figure, title, parameter, rows: Vec::new(), remarks }
    }
}

/// A row as printed.
struct PrintedRow {
    parameter: f64,
    /// One value per key of the table.
    values: &'static [f64],
    /// Notes that the numbers alone do not give, with the key that each belongs to.
    notes: &'static [(&'static str, &'static str)],
}

/// The solutions that the findings of a row are drawn from.
struct Solved<'a> {
    mission: &'a Pipeline,
    printed: &'static PrintedRow,
    own: Option<&'a Outcome>,
    radau: Option<&'a Outcome>,
}

const PUBLICATIONS: &[Publication] = &[
    lunar_landing::PUBLICATION,
    geo_injection::PUBLICATION,
    capsule_reentry::PUBLICATION,
    chang_e::PUBLICATION,
    moving_mass::PUBLICATION,
    powered_descent::PUBLICATION,
];

/// All rows of a publication that were computed.
#[derive(Clone, Debug, PartialEq)]
pub struct Reproduction {
    /// Name, as given to [`reproduce`].
    pub name: &'static str,
    /// One line on the subject.
    pub title: &'static str,
    /// The place of the printed values.
    pub source: &'static str,
    /// Tables in their order; those that were not reached have no rows.
    pub tables: Vec<Table>,
    /// Tables with columns of their own, as far as they were reached.
    pub sheets: Vec<Sheet>,
    /// Findings besides the rows.
    pub remarks: Vec<String>,
    /// True if all rows are there; false after an interruption.
    pub complete: bool,
}

/// A part of the work, reported as it is done.
#[derive(Clone, Copy, Debug)]
pub enum Part<'a> {
    /// A table that has a new row, its last one.
    Row(&'a Table),
    /// A sheet.
    Sheet(&'a Sheet),
}

/// A table computed again.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Short name: `table-2`.
    pub id: &'static str,
    /// File of its figure.
    pub figure: &'static str,
    /// Number and subject.
    pub title: &'static str,
    /// The key that tells the rows apart; the unit ends it.
    pub parameter: &'static str,
    /// Rows in the printed order.
    pub rows: Vec<Row>,
    /// Remarks that hold for all rows.
    pub remarks: &'static [&'static str],
}

/// A row computed again.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Value of the table's parameter.
    pub parameter: f64,
    /// Printed quantities, the minimised one first.
    pub quantities: Vec<Comparison>,
    /// The end to which the solution of the publication's own nonlinear program leads; none if it does not converge.
    pub miss: Option<Miss>,
    /// Variables and constraints of that program.
    pub size: Option<(usize, usize)>,
    /// True if both methods of the optimum converged.
    pub solved: bool,
    /// True if Radau's solution is verified as an extremal at least and the one by flatness as feasible.
    pub verified: bool,
}

/// One printed quantity beside the computed ones, in the unit that ends the key.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Key of the quantity among the mission's results.
    pub key: &'static str,
    /// The printed value.
    pub paper: f64,
    /// By the publication's own nonlinear program.
    pub paper_nlp: Option<f64>,
    /// By refined flatness.
    pub flatness: Option<f64>,
    /// By Radau collocation: the optimum.
    pub radau: Option<f64>,
    /// Findings on the printed value.
    pub findings: Vec<Finding>,
}

impl Comparison {
    /// Printed value less the optimum.
    #[must_use]
    pub fn paper_difference(&self) -> Option<f64> {
        Some(self.paper - self.radau?)
    }

    /// The publication's own nonlinear program less the optimum.
    #[must_use]
    pub fn paper_nlp_difference(&self) -> Option<f64> {
        Some(self.paper_nlp? - self.radau?)
    }

    /// Refined flatness less Radau.
    #[must_use]
    pub fn flatness_difference(&self) -> Option<f64> {
        Some(self.flatness? - self.radau?)
    }

    fn find(&mut self, kind: FindingKind, text: impl Into<String>) {
        self.findings.push(Finding { kind, text: text.into() });
    }
}

/// Kinds of findings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FindingKind {
    /// A time that no trajectory has.
    BelowMinimum,
    /// A time above the minimum.
    AboveMinimum,
    /// A final mass that no trajectory has.
    ImpossibleMass,
    /// Printed values of a row that exclude each other.
    Contradiction,
    /// Said of the printed value by comparison with others: a misprint, most likely.
    Note,
    /// A method that did not converge.
    NotSolved,
    /// An optimum that the certificate does not confirm.
    NotVerified,
}

/// Something to be said of a printed value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Its kind.
    pub kind: FindingKind,
    /// One sentence.
    pub text: String,
}

/// By how much a landing misses when its controls are flown: re-simulated less stated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Miss {
    /// Radius at the end, m.
    pub radius_m: f64,
    /// Horizontal speed at the end of planar flight, m/s.
    pub horizontal_speed_m_s: f64,
    /// Radial speed at the end, m/s.
    pub radial_speed_m_s: f64,
}

/// Name and title of every publication.
pub fn list() -> impl Iterator<Item = (&'static str, &'static str)> {
    PUBLICATIONS.iter().map(|p| (p.name, p.title))
}

/// Number of parts of a publication: rows of tables, sheets.
///
/// # Errors
/// [`Error::Value`] when there is no publication of this name.
pub fn parts(name: &str) -> Result<usize, Error> {
    Ok(find(name)?.parts())
}

fn find(name: &str) -> Result<&'static Publication, Error> {
    PUBLICATIONS.iter().find(|p| p.name == name).ok_or_else(|| Error::Value {
        place: "reproduce".into(),
        key: "name".into(),
        found: format!("\"{name}\""),
        allowed: list().map(|(n, _)| format!("\"{n}\"")).collect::<Vec<_>>().join(" or "),
    })
}

/// Memory beside what was measured, as a part of it: other machines, other allocators.
const MEMORY_MARGIN: f64 = 0.5;

/// The memory that [`reproduce`] takes with so many threads.
///
/// # Errors
/// [`Error::Value`] when there is no publication of this name.
pub fn foreseen_memory(name: &str, threads: usize) -> Result<Foreseen, Error> {
    let [one, further] = find(name)?.memory_mb;
    let bytes = (1.0 + MEMORY_MARGIN) * 1e6 * (one + further * (threads.max(1) - 1) as f64);
    Ok(Foreseen { bytes, cause: format!("`{name}` with {threads} threads") })
}

/// Computes all tables of a publication again, with so many threads.
///
/// `report` gets each part when it is done, and ends the work by returning false. The observer sees every iteration; when it stops a
/// solve, the parts done are returned.
///
/// # Errors
/// [`Error::Value`] when there is no publication of this name.
pub fn reproduce(
    name: &str,
    threads: usize,
    observer: &mut dyn Observer,
    mut report: impl FnMut(Part<'_>) -> bool,
) -> Result<Reproduction, Error> {
    let publication = find(name)?;
    let mut done = Reproduction {
        name: publication.name,
        title: publication.title,
        source: publication.source,
        tables: Vec::new(),
        sheets: Vec::new(),
        remarks: (publication.remarks)()?,
        complete: false,
    };
    done.tables = publication.tables.iter().map(PrintedTable::empty).collect();
    let mut finished = fill(publication.tables, &mut done.tables, threads, observer, &mut report)?;
    if finished {
        let mut begun = Instant::now();
        let mut keep = |mut sheet: Sheet| {
            sheet.seconds = begun.elapsed().as_secs_f64();
            begun = Instant::now();
            let go_on = report(Part::Sheet(&sheet));
            done.sheets.push(sheet);
            if go_on { Ok(()) } else { Err(Stop::Interrupted) }
        };
        finished = match (publication.compute)(&mut Workers { threads, observer }, &mut keep) {
            Ok(()) => true,
            Err(stop) => stop.end(publication.name)?,
        };
    }
    let rows = done.tables.iter().map(|t| t.rows.len()).sum::<usize>();
    done.complete = finished || rows + done.sheets.len() == publication.parts();
    Ok(done)
}

/// Computes the rows of tables; false when that was ended.
fn fill(
    printed: &'static [PrintedTable],
    tables: &mut [Table],
    threads: usize,
    observer: &mut dyn Observer,
    report: &mut dyn FnMut(Part<'_>) -> bool,
) -> Result<bool, Error> {
    for (printed, table) in printed.iter().zip(tables) {
        let mut work = Work { printed, threads, observer: &mut *observer, neighbour: None };
        for row in printed.rows {
            let Some(row) = work.row(row)? else { return Ok(false) };
            table.rows.push(row);
            if !report(Part::Row(table)) {
                return Ok(false);
            }
        }
    }
    Ok(true)
}

/// The rows of one table, in their order.
struct Work<'a> {
    printed: &'static PrintedTable,
    threads: usize,
    observer: &'a mut dyn Observer,
    /// Solution of the publication's own program in the row before.
    neighbour: Option<Trajectory>,
}

impl Work<'_> {
    /// None when the observer stopped a solve.
    fn row(&mut self, printed: &'static PrintedRow) -> Result<Option<Row>, Error> {
        let mission = self.mission(printed, &[])?;
        let Some(radau) = self.solve(&mission, None)? else { return Ok(None) };
        let refined = self.mission(printed, &[change::word("method", "flatness")])?;
        let Some(flatness) = self.solve(&refined, None)? else { return Ok(None) };
        let own = self.mission(printed, self.printed.own_method)?;
        let Some(own) = self.own(&own, &radau)? else { return Ok(None) };
        let converged = |o: &Outcome| o.status.is_success();
        let result = |o: &Outcome, key: &str| o.summary.results.get(key).copied().filter(|_| converged(o));
        let mut quantities: Vec<Comparison> = (self.printed.keys.iter().zip(printed.values))
            .map(|(&key, &paper)| Comparison {
                key,
                paper,
                paper_nlp: result(&own, key),
                flatness: result(&flatness, key),
                radau: result(&radau, key),
                findings: Vec::new(),
            })
            .collect();
        let ways = [("the paper's own NLP", &own), ("flatness", &flatness), ("Radau", &radau)];
        for (way, outcome) in ways.into_iter().filter(|(_, o)| !converged(o)) {
            let why = outcome.explanation.as_deref().unwrap_or(&outcome.summary.status);
            quantities[0].find(FindingKind::NotSolved, format!("{way} does not converge: {why}"));
        }
        let solved = [&flatness, &radau].into_iter().all(|o| o.explanation.is_none());
        let verified = radau.summary.certificate.is_verified()
            && flatness.summary.certificate.verdict != Verdict::Rejected;
        if solved && !verified {
            quantities[0].find(FindingKind::NotVerified, "the optimum is not verified");
        }
        let found = Solved {
            mission: &mission,
            printed,
            own: Some(&own).filter(|o| converged(o)),
            radau: Some(&radau).filter(|o| converged(o)),
        };
        (self.printed.findings)(&found, &mut quantities)?;
        for (key, text) in printed.notes {
            for q in quantities.iter_mut().filter(|q| q.key == *key) {
                q.find(FindingKind::Note, *text);
            }
        }
        let counters = own.summary.counters;
        let row = Row {
            parameter: printed.parameter,
            quantities,
            miss: found.own.map(lunar_landing::miss).transpose()?,
            size: found.own.map(|_| (counters.variables, counters.constraints)),
            solved,
            verified,
        };
        if converged(&own) {
            self.neighbour = Some(own.trajectory);
        }
        Ok(Some(row))
    }

    fn mission(&self, printed: &PrintedRow, method: &[Change<'_>]) -> Result<Pipeline, Error> {
        let (name, case) = (self.printed.case)(printed.parameter);
        Ok(load(name, &[&[case], method].concat())?.with_threads(self.threads))
    }

    fn solve(&mut self, mission: &Pipeline, start: Option<&Trajectory>) -> Result<Option<Outcome>, Error> {
        let outcome = mission.solve(start, self.observer)?;
        let stopped = outcome.status == Status::Interrupted;
        Ok((!stopped).then_some(outcome))
    }

    /// The publication's own program has several local minima: the least of those reached from the mission's guess, from the
    /// optimum and from the row before.
    fn own(&mut self, mission: &Pipeline, optimum: &Outcome) -> Result<Option<Outcome>, Error> {
        let Some(mut best) = self.solve(mission, None)? else { return Ok(None) };
        for start in [Some(optimum.trajectory.clone()), self.neighbour.clone()].into_iter().flatten() {
            if !mission.has_phases_of(&start)? {
                continue;
            }
            let Some(other) = self.solve(mission, Some(&start))? else { return Ok(None) };
            if rank(&other) < rank(&best) {
                best = other;
            }
        }
        Ok(Some(best))
    }
}

/// Least objective of what converged; a solution that did not converge comes last.
fn rank(outcome: &Outcome) -> f64 {
    if outcome.status.is_success() { outcome.trajectory.objective } else { f64::INFINITY }
}
