//! From a mission to a verified outcome.

mod certified;
mod further_starts;
mod run_away;
mod unsolved;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use apsides_ephemeris::Placing;
use apsides_nlp::Status;
use apsides_ocp::method::Counters;
use apsides_ocp::not_finite::not_finite;
use apsides_ocp::{Guess, Solution, Trajectory};
use apsides_radau::{Explanation, Unmet};

use crate::Error;
use crate::cancellation::Cancellation;
use crate::explanation::{ExplanationSummary, in_keys};
use crate::key::{Key, Value};
use crate::method::{CheckpointFile, MethodName, Methods};
use crate::mission::{EasierCase, Kind, Mission, Offers, Scalars, downcast};
use crate::named_data::NamedData;
use crate::observer::Observer;
use crate::outcome::{Decisions, ObjectiveValue, Outcome, Reduced, Summary, Timing};
use crate::placing;
use crate::posed::{self, Posed};
use crate::values::Values;

use certified::{Certified, Flight};
use unsolved::{Unsolved, doubts, explain, is_coarse};

/// Bent starts from which a smaller conflict is looked for.
const BENT_BESIDE_CONFLICT: usize = 4;

/// A mission that was read, with all it takes to solve it: the values of its keys, the mission made of them, methods and their settings.
#[derive(Clone, Debug)]
pub struct Pipeline {
    kind: Kind,
    /// The kinds that it was chosen among.
    kinds: Arc<[Kind]>,
    values: Values,
    /// Data that keys name, such as vehicles.
    data: Arc<[NamedData]>,
    mission: Arc<dyn Mission>,
    methods: Methods,
    placing: Placing,
    run: Run,
}

/// Options of a solve that are no values of the mission: they stay when a value changes.
#[derive(Clone, Debug)]
struct Run {
    threads: usize,
    seed: u64,
    /// Collocation is no more accurate between the points of the mesh than this.
    least_tolerance: f64,
    /// The file in which a search is kept.
    checkpoint: Option<PathBuf>,
    /// Bytes that a solve may take, as far as that is foreseen.
    memory: Option<u64>,
    /// Prices are asked for after a solve.
    priced: bool,
    /// Ends decisions and explanations.
    cancellation: Cancellation,
}

impl Default for Run {
    fn default() -> Self {
        Self {
            threads: 1,
            seed: 0,
            least_tolerance: 0.0,
            checkpoint: None,
            memory: None,
            priced: false,
            cancellation: Cancellation::default(),
        }
    }
}

impl PartialEq for Pipeline {
    /// Two are equal when their kind and all values are.
    fn eq(&self, other: &Self) -> bool {
        self.kind == other.kind && self.values == other.values && self.to_file() == other.to_file()
    }
}

impl Pipeline {
    /// A mission of a kind from the values of its keys.
    ///
    /// # Errors
    /// Values that do not go together, and what no flight or method can mend.
    pub fn new(kind: Kind, kinds: Arc<[Kind]>, values: Values) -> Result<Self, Error> {
        let mission = kind.read(&values)?;
        values.check_sizes()?;
        let methods = match kind.offers.simulated_only {
            // Its values have no keys of methods.
            true => {
                Methods::read(&Values::new(String::new(), String::new(), Methods::keys().cloned().collect()))?
            }
            false => Methods::read(&values)?,
        };
        let placing = placing::placing_from(&values, mission.start_epoch())?;
        let data = Arc::default();
        let pipeline = Self { kind, kinds, values, data, mission, methods, placing, run: Run::default() };
        pipeline.methods.check(|| pipeline.pose(), &pipeline.values)?;
        Ok(pipeline)
    }

    /// The mission with the data that its keys name, so that another name brings other numbers.
    pub(crate) fn with_data(self, data: Arc<[NamedData]>) -> Self {
        Self { data, ..self }
    }

    /// The same mission with another value of a key: a number, a word, a flag. The name of a body, a vehicle or a site brings the numbers
    /// that the mission does not state itself.
    ///
    /// # Errors
    /// A key that the mission does not have, a value that it does not take, values that do not go together.
    pub fn with(self, path: &str, value: impl Into<Value>) -> Result<Self, Error> {
        let mut values = self.values;
        values.set(path, value)?;
        if let Some(data) = self.data.iter().find(|d| d.key == path) {
            data.state_numbers(&mut values)?;
        }
        Ok(Self::new(self.kind, self.kinds, values)?.with_data(self.data).running(self.run))
    }

    /// Sets the value of a key: a number, a word, a flag.
    ///
    /// # Errors
    /// As of [`Self::with`]; the mission stays as it was then.
    pub fn set(&mut self, path: &str, value: impl Into<Value>) -> Result<(), Error> {
        *self = self.clone().with(path, value)?;
        Ok(())
    }

    fn running(self, run: Run) -> Self {
        let methods = self
            .methods
            .with_threads(run.threads)
            .with_seed(run.seed)
            .with_tolerance_from(run.least_tolerance);
        Self { methods, run, ..self }
    }

    /// The mission, to be solved with so many threads, 1 to 1024; no result depends on it.
    #[must_use]
    pub fn with_threads(self, threads: usize) -> Self {
        let run = Run { threads, ..self.run.clone() };
        self.running(run)
    }

    /// The mission, to be solved with this seed of everything random.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        let run = Run { seed, ..self.run.clone() };
        self.running(run)
    }

    /// The seed of everything random.
    #[must_use]
    pub fn seed(&self) -> u64 {
        self.run.seed
    }

    /// The mission, whose search is kept in a file: it goes on from there if the file exists.
    #[must_use]
    pub fn with_checkpoint(self, file: PathBuf) -> Self {
        Self { run: Run { checkpoint: Some(file), ..self.run }, ..self }
    }

    /// The mission, refused where a solve would take more memory than so many bytes.
    #[must_use]
    pub fn with_memory(self, bytes: u64) -> Self {
        Self { run: Run { memory: Some(bytes), ..self.run }, ..self }
    }

    /// The mission, of whose solutions prices are asked afterwards.
    #[must_use]
    pub fn with_prices(self, priced: bool) -> Self {
        Self { run: Run { priced, ..self.run }, ..self }
    }

    /// The mission, whose decisions, and explanations of what conflicts, end where it is asked for; an observer ends its solve.
    #[must_use]
    pub fn with_cancellation(self, cancellation: Cancellation) -> Self {
        Self { run: Run { cancellation, ..self.run }, ..self }
    }

    /// Bytes that work may take.
    pub(crate) fn memory(&self) -> Option<u64> {
        self.run.memory
    }

    /// Epoch and axes of the mission.
    #[must_use]
    pub fn placing(&self) -> &Placing {
        &self.placing
    }

    /// All that decides the result of a solve beside its start.
    pub(crate) fn statement(&self) -> String {
        let Run { seed, least_tolerance, .. } = self.run;
        format!("{:?}\n{}\nseed {seed}, tolerance {least_tolerance:e}\n", self.mission, self.to_file())
    }

    /// The mission, solved no more accurately between the points of the mesh than this.
    #[must_use]
    pub fn with_tolerance_from(self, least: f64) -> Self {
        let run = Run { least_tolerance: least, ..self.run.clone() };
        self.running(run)
    }

    /// Another mission of the same kind, with the same methods; its values stay those of the file.
    #[must_use]
    pub(crate) fn with_mission(self, mission: Arc<dyn Mission>) -> Self {
        Self { mission, ..self }
    }

    /// The name of the kind of mission.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.kind.name
    }

    /// One line on what the mission does.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.kind.title
    }

    /// The kind of mission.
    #[must_use]
    pub fn kind(&self) -> &Kind {
        &self.kind
    }

    /// Names of the kinds of mission that offer something, for messages.
    pub(crate) fn kinds_that(&self, offer: impl Fn(&Offers) -> bool) -> String {
        let names = self.kinds.iter().filter(|k| offer(&k.offers)).map(|k| format!("`{}`", k.name));
        names.collect::<Vec<_>>().join(", ")
    }

    /// Keys of the mission.
    pub fn keys(&self) -> impl Iterator<Item = &Key> {
        self.values.keys()
    }

    /// Values of the keys.
    #[must_use]
    pub fn values(&self) -> &Values {
        &self.values
    }

    /// The mission in SI units.
    #[must_use]
    pub fn mission(&self) -> &dyn Mission {
        &*self.mission
    }

    /// The mission as the struct of its kind; none where it is of another kind.
    #[must_use]
    pub fn mission_as<M: Mission>(&self) -> Option<&M> {
        downcast(self.mission())
    }

    /// The method and the settings of all methods.
    #[must_use]
    pub fn methods(&self) -> &Methods {
        &self.methods
    }

    /// The mission file with every value written out.
    #[must_use]
    pub fn to_file(&self) -> String {
        self.kind.written(&self.values)
    }

    /// Returns true if the mission is simulated under a law, not optimised.
    #[must_use]
    pub fn is_simulated(&self) -> bool {
        self.kind.offers.simulated_only
    }

    /// The problem and a start.
    ///
    /// # Errors
    /// When the values do not make a problem.
    pub fn pose(&self) -> Result<Posed, Error> {
        self.optimised()?;
        self.decided(&self.decide()?)?.pose_decided()
    }

    pub(crate) fn pose_decided(&self) -> Result<Posed, Error> {
        self.mission.pose(self.methods.name)
    }

    /// Refuses a mission that is simulated.
    pub(crate) fn optimised(&self) -> Result<(), Error> {
        if self.is_simulated() {
            return Err(self
                .kind
                .refused("it is simulated under its law, not optimised: use `apsides simulate`"));
        }
        Ok(())
    }

    /// Decides what the mission leaves open before its flight is posed, for instance a site on a map.
    ///
    /// # Errors
    /// When the values do not make a problem, no site is fit, or the work is cancelled; the sentence names what comes nearest.
    pub fn decide(&self) -> Result<Decisions, Error> {
        self.kept_decisions()
    }

    pub(crate) fn decide_anew(&self) -> Result<Decisions, Error> {
        self.mission.decide(&self.run.cancellation)
    }

    /// The mission with its decisions as values, so that nothing is open.
    ///
    /// # Errors
    /// Decisions of another mission.
    pub fn decided(&self, decisions: &Decisions) -> Result<Self, Error> {
        if decisions.values.is_empty() {
            return Ok(self.clone());
        }
        let mut values = self.values.clone();
        for (path, number) in &decisions.values {
            values.set(path, *number)?;
        }
        Ok(Self { mission: self.kind.read(&values)?, values, ..self.clone() })
    }

    /// Returns true if a trajectory has the phases of the problem that is solved, so that a solve can start from it.
    ///
    /// # Errors
    /// When the values do not make a problem.
    pub fn has_phases_of(&self, trajectory: &Trajectory) -> Result<bool, Error> {
        Ok(posed::fits(&self.pose()?.ocp, trajectory).is_ok())
    }

    /// Scalars of a solution; the unit ends the key.
    #[must_use]
    pub fn results(&self, trajectory: &Trajectory) -> Scalars {
        self.mission.results(trajectory)
    }

    /// Solves the mission and verifies the answer.
    ///
    /// `start` replaces the mission's own guess, for instance by that of a neighbouring case ([`Outcome::solved`]). The observer sees every
    /// iteration and can stop the solve; the best trajectory so far is returned then.
    ///
    /// # Errors
    /// When the request is ill-posed. A mission that cannot be flown ends with a status and an explanation.
    pub fn solve(&self, start: Option<&Trajectory>, observer: &mut dyn Observer) -> Result<Outcome, Error> {
        self.solve_with(start, true, observer)
    }

    /// Solves with or without the scalars that take solves of their own.
    pub(crate) fn solve_with(
        &self,
        start: Option<&Trajectory>,
        margins: bool,
        observer: &mut dyn Observer,
    ) -> Result<Outcome, Error> {
        self.optimised()?;
        self.kept(start, margins, self.run.priced, || {
            let (begin, decisions) = (Instant::now(), self.decide()?);
            let outcome =
                self.decided(&decisions)?.solve_decided(decisions, begin, start, margins, observer)?;
            Ok(Outcome { mission_file: self.to_file(), ..outcome })
        })
    }

    fn solve_decided(
        &self,
        decisions: Decisions,
        begin: Instant,
        start: Option<&Trajectory>,
        margins: bool,
        observer: &mut dyn Observer,
    ) -> Result<Outcome, Error> {
        let posed = self.pose_decided()?;
        self.check_memory(&posed, self.run.memory)?;
        let build = milliseconds(begin);
        let begin = Instant::now();
        let solution = match start {
            Some(start) => self.solve_posed(&posed, Some(&posed.as_start(start)?), observer)?,
            None => self.solve_from_guess(&posed, observer)?,
        };
        let mut solve = milliseconds(begin);
        let begin = Instant::now();
        let flight = self.flight(&posed, &decisions, &solution)?;
        let mut verify = milliseconds(begin);
        let mut found = Certified::new(solution, flight);
        if found.found_none_feasible() {
            found.conflict = Some(self.conflict(&posed, &found.solution)?);
            if self.is_cancelled() {
                // With more time there might be another conflict: work that goes on later must not take this one for the answer.
                found.solution.status = Status::Interrupted;
            }
        }
        let mut run_away = None;
        if start.is_none() {
            let begin = Instant::now();
            found = self.better_from_elsewhere(&posed, &decisions, found, observer)?;
            (found, run_away) = self.marked_run_away(&posed, &decisions, found, observer)?;
            solve += milliseconds(begin);
        }
        let Certified { solution, flight, conflict } = found.with_true_status();
        let begin = Instant::now();
        let margins = match solution.is_success() && margins {
            true => self.mission.margins(&self.methods, &solution.trajectory, &self.run.cancellation)?,
            false => Scalars::new(),
        };
        verify += milliseconds(begin);
        let timing_ms = Timing { build, solve, verify };
        let has_no_value = matches!(solution.status, Status::EvaluationFailed(_));
        let not_finite = has_no_value.then(|| not_finite(&posed.ocp, &solution.trajectory)).flatten();
        let not_finite = not_finite.map(|found| {
            let place = self.mission.place_of(&found.formula);
            (found, place)
        });
        let unsolved = Unsolved {
            conflict: conflict.as_ref(),
            run_away: run_away.as_ref(),
            not_finite: not_finite.as_ref(),
        };
        Ok(self.outcome(posed, decisions, solution, margins, &unsolved, flight, timing_ms))
    }

    fn solve_posed(
        &self,
        posed: &Posed,
        start: Option<&Trajectory>,
        observer: &mut dyn Observer,
    ) -> Result<Solution, Error> {
        let path = self.run.checkpoint.clone();
        let checkpoint = path.map(|path| CheckpointFile::new(path, &self.to_file(), self.run.seed));
        self.methods.solve(posed, start, checkpoint.as_ref(), observer)
    }

    /// Solves from the mission's own guess, through the easier cases that lead to it where it has some.
    fn solve_from_guess(&self, posed: &Posed, observer: &mut dyn Observer) -> Result<Solution, Error> {
        let mut start: Option<Trajectory> = None;
        let mut work = Vec::new();
        // Indirect shooting leads its own solution to a limit.
        let own = self.methods.name == MethodName::Indirect && posed.costates.is_some();
        let approach = if own { Vec::new() } else { self.mission.approach(self.methods.name) };
        for EasierCase { mission, method } in approach {
            let easier = Self { mission, methods: self.methods.clone().with_method(method), ..self.clone() };
            let easier_posed = easier.pose_decided()?;
            let solution = easier.solve_posed(&easier_posed, start.as_ref(), observer)?;
            work.push(solution.counters);
            if !solution.status.is_success() {
                // From here on it would not become easier.
                break;
            }
            // Where the easier case is a reduction and this one is not, its whole flight is what this one starts from.
            let fits = Guess::earlier(&solution.trajectory).check(&posed.ocp).is_ok();
            start =
                Some(if fits { solution.trajectory } else { easier_posed.expand(&solution.trajectory)? });
        }
        let mut solution = self.solve_posed(posed, start.as_ref(), observer)?;
        // Constant controls have local optima of their own, between which no single start decides.
        let several = self.methods.name == MethodName::Piecewise && solution.status != Status::Interrupted;
        if start.is_some() && several {
            let other = self.solve_posed(posed, None, observer)?;
            let cost = |s: &Solution| match s.status.is_success() {
                true => posed.ocp.objective.sense.sign() * s.trajectory.objective,
                false => f64::INFINITY,
            };
            let worse =
                if cost(&other) < cost(&solution) { std::mem::replace(&mut solution, other) } else { other };
            work.push(worse.counters);
        }
        solution.counters = Counters::total(work.into_iter().chain([solution.counters]));
        Ok(solution)
    }

    /// Explains what conflicts and what to relax: from the best trajectory reached, else from the guess.
    fn conflict(&self, posed: &Posed, solution: &Solution) -> Result<Explanation, Error> {
        let method = self.methods.radau.method();
        let mut observer = self.run.cancellation.clone();
        let (ocp, own) = (&posed.ocp, &posed.guess);
        let bent = (1..=BENT_BESIDE_CONFLICT).map(|number| own.bent(ocp, number));
        let mut further: Vec<Guess> = own.around(ocp).into_iter().chain(bent).collect();
        if solution.trajectory.has_costates() {
            let (reached, mesh) = (Guess::earlier(&solution.trajectory), solution.trajectory.mesh());
            let starts = [&[own.clone()][..], &further].concat();
            let found = method.explain_from(ocp, &reached, &mesh, &starts, &mut observer)?;
            if found.status.is_success() {
                return Ok(found);
            }
            further.push(reached);
        }
        let mesh = self.methods.first_mesh(ocp)?;
        Ok(method.explain_from(ocp, own, &mesh, &further, &mut observer)?)
    }

    /// The largest residuals of the mission's own guess before the first iteration, by name, at most `most`.
    ///
    /// # Errors
    /// When the values do not make a problem.
    pub fn guess_residuals(&self, most: usize) -> Result<Vec<Unmet>, Error> {
        let posed = self.pose()?;
        self.check_memory(&posed, self.run.memory)?;
        let Posed { ocp, guess, .. } = posed;
        let mesh = self.methods.first_mesh(&ocp)?;
        Ok(self.methods.radau.method().guess_residuals(&ocp, &guess, &mesh, most)?)
    }

    fn outcome(
        &self,
        posed: Posed,
        decisions: Decisions,
        mut solution: Solution,
        margins: Scalars,
        unsolved: &Unsolved<'_>,
        flight: Flight,
        timing_ms: Timing,
    ) -> Outcome {
        let conflict = unsolved.conflict;
        let Posed { ocp, expansion, .. } = posed;
        let objective = ObjectiveValue {
            name: ocp.objective.name.clone(),
            value: solution.trajectory.objective,
            unit: ocp.objective.unit.clone(),
        };
        let missing = conflict.and_then(|c| self.mission.missing(&self.methods, c, &self.run.cancellation));
        if conflict.is_some() && self.is_cancelled() {
            // The explanation may lack what there was no time for.
            solution.status = Status::Interrupted;
        }
        let conflict = conflict.map(|c| in_keys(c, &self.values, self.mission.datum()));
        let cause = match is_coarse(&solution) {
            true => self.mission.undetermined(&solution.trajectory),
            false => None,
        };
        let of_sites = decisions.sites.iter().filter_map(|site| site.summary.warning.clone());
        let warnings =
            doubts(&self.methods, &solution, cause.as_deref()).into_iter().chain(of_sites).collect();
        let explanation =
            explain(&self.methods, &ocp, &solution, &Unsolved { conflict: conflict.as_ref(), ..*unsolved })
                .map(|text| {
                    [Some(text), cause, missing.clone()].into_iter().flatten().collect::<Vec<_>>().join("; ")
                });
        let status = solution.word().into();
        let certificate = flight.certificate;
        let (ocp, trajectory, reduced) = match (flight.expanded, expansion) {
            (Some(trajectory), Some(whole)) => {
                (whole.ocp, trajectory, Some(Reduced { ocp, trajectory: solution.trajectory }))
            }
            _ => (ocp, solution.trajectory, None),
        };
        let summary = Summary {
            mission: self.name().into(),
            method: self.methods.name.word().into(),
            solved_by: solution.instead.unwrap_or(self.methods.name.word()).into(),
            status,
            message: explanation.clone(),
            explanation: conflict
                .filter(|c| c.status.is_success())
                .map(|c| ExplanationSummary::new(&c, missing)),
            objective,
            results: self.results(&trajectory).into_iter().chain(margins).collect(),
            counters: solution.counters.into(),
            timing_ms,
            certificate,
            warnings,
            switches: solution.switches.iter().map(ToString::to_string).collect(),
            search: solution.search.and_then(|record| self.methods.search_summary(record)),
            sites: decisions.sites.iter().map(|site| site.summary.clone()).collect(),
            sensitivity: None,
        };
        Outcome {
            headline: self.mission.headline().into_iter().map(str::to_owned).collect(),
            curves: self.mission.curves(&trajectory),
            ocp,
            trajectory,
            reduced,
            status: solution.status,
            report: solution.report,
            summary,
            mission_file: self.to_file(),
            decisions,
            explanation,
            kept: None,
        }
    }
}

pub(crate) fn milliseconds(begin: Instant) -> f64 {
    begin.elapsed().as_secs_f64() * 1e3
}
