//! Random starts: how often and how fast collocation converges from them, with two forms of the control.

use apsides_metaheuristics::Generator;
use apsides_ocp::{Guess, Mesh, Phase, PhaseGuess};
use apsides_shooting::profile::{FlightRules, MeshWish, ProfileShape, ProfileShooting, Stop as FlightStop};

use super::model::{Model, mission};
use super::reference::BASE;
use crate::change::{number, word};
use crate::sheet::{Sheet, median};
use crate::stop::Stop;
use crate::workers::Workers;
use crate::{Error, Observer, Pipeline, Posed};

/// The mesh of all solves.
const INTERVALS: usize = 10;
const POINTS: usize = 4;
/// The limit of the reference.
const MOST_ITERATIONS: usize = 500;
const FLIGHTS: usize = 3000;
/// Relative distance from the optimum that counts as the same: the coarse mesh alone is worth 8e-4.
const SAME: f64 = 1e-3;
const MOST_BANK_DEG: f64 = 90.0;
const TIMES_S: [f64; 2] = [450.0, 800.0];
/// Speed, path angle and azimuth at the end of a guess; m/s, deg.
const END: [f64; 3] = [250.0, -50.0, -45.0];
/// Shapes are powers of the time with an exponent in this range.
const SHAPES: [f64; 2] = [0.3, 3.3];
const NODES: usize = 6;
const SAMPLES: usize = 41;

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Straight,
    Shot,
    Shapes,
    Search,
}

/// Name, kind, successes of twenty and median iterations of the reference.
const KINDS: [(&str, Kind, [f64; 2]); 4] = [
    ("straight lines, random bank and time", Kind::Straight, [20.0, 234.0]),
    ("flight at a random bank", Kind::Shot, [20.0, 288.0]),
    ("random shapes, random bank at 6 nodes", Kind::Shapes, [16.0, 292.0]),
    ("best of 3000 flights of the cooperation", Kind::Search, [20.0, 40.0]),
];

const CONTROLS: [(&str, &str); 2] = [("cosine and sine", "bank-vector"), ("bank angle", "bank")];

struct Start<'a> {
    mission: &'a Pipeline,
    posed: &'a Posed,
    is_angle: bool,
}

impl Start<'_> {
    fn controls(&self, bank: f64) -> Vec<f64> {
        if self.is_angle { vec![bank] } else { vec![bank.cos(), bank.sin()] }
    }

    /// States on lines or curves between the ends, each of its own shape.
    fn guess(&self, time: f64, shapes: [f64; 6], bank: impl Fn(f64) -> f64) -> Result<(Guess, Mesh), Stop> {
        let ocp = &self.posed.ocp;
        let phase = &ocp.phases[0];
        let ends: Vec<[f64; 2]> = phase.states.iter().enumerate().map(|(k, _)| ends(phase, k)).collect();
        let fractions = || (0..SAMPLES).map(|k| k as f64 / (SAMPLES - 1) as f64);
        let state =
            |s: f64| ends.iter().zip(shapes).map(|([a, b], p)| a + (b - a) * s.powf(p)).collect::<Vec<f64>>();
        let times: Vec<f64> = fractions().map(|s| s * time).collect();
        let controls = fractions().map(|s| self.controls(bank(s))).collect();
        let guess = PhaseGuess::samples(&times, fractions().map(state).collect(), controls)?;
        Ok((Guess::from_phases(ocp, vec![guess]), Mesh::uniform(ocp, INTERVALS, POINTS)?))
    }

    /// A flight at one bank angle down to the altitude of the target.
    fn shot(&self, bank: f64) -> Result<(Guess, Mesh), Stop> {
        let ocp = &self.posed.ocp;
        let search = self
            .posed
            .profile
            .as_ref()
            .ok_or_else(|| Error::in_mission("the mission has no control profiles"))?;
        let rules = FlightRules::new(ProfileShape::new(0, 1, search.bounds.clone()))
            .of(search.independent.clone())
            .steered(search.steering.clone())
            .until(FlightStop::at_end(&ocp.phases[0], &search.stop)?);
        let wish = MeshWish { intervals: INTERVALS, points: POINTS, joints: false };
        let start = ProfileShooting::new(ocp, rules)?.start(&[bank], wish)?;
        Ok((start.guess, start.mesh))
    }

    fn of(&self, kind: Kind, seed: u64, observer: &mut dyn Observer) -> Result<(Guess, Mesh), Stop> {
        let mut random = Generator::new(seed);
        let most = MOST_BANK_DEG.to_radians();
        let bank = random.between(-most, most);
        let time = random.between(TIMES_S[0], TIMES_S[1]);
        match kind {
            Kind::Straight => self.guess(time, [1.0; 6], |_| bank),
            Kind::Shot => self.shot(bank),
            Kind::Shapes => {
                let nodes: [f64; NODES] = std::array::from_fn(|_| random.between(-most, most));
                let shapes = std::array::from_fn(|_| random.between(SHAPES[0], SHAPES[1]));
                self.guess(time, shapes, |s| {
                    let place = s * (NODES - 1) as f64;
                    let k = (place as usize).min(NODES - 2);
                    nodes[k] + (nodes[k + 1] - nodes[k]) * (place - k as f64)
                })
            }
            Kind::Search => {
                let mission = self.mission.clone().with_seed(seed);
                let found = mission.methods().search(self.posed, observer)?;
                if found.summary.stop == "interrupted" {
                    return Err(Stop::Interrupted);
                }
                let start = found.start.ok_or_else(|| Stop::NotSolved("every flight failed".into()))?;
                Ok((start.guess, start.mesh))
            }
        }
    }

    /// Iterations of one solve, and whether it found the optimum.
    fn solve(&self, kind: Kind, seed: u64, observer: &mut dyn Observer) -> Result<(usize, bool), Stop> {
        let (guess, mesh) = self.of(kind, seed, observer)?;
        let mut method = self.mission.methods().radau.method();
        method.settings.max_refinements = 0;
        method.settings.nlp.max_iterations = MOST_ITERATIONS;
        let solution = method.solve_on(&self.posed.ocp, &guess, mesh, observer)?;
        if solution.status == apsides_nlp::Status::Interrupted {
            return Err(Stop::Interrupted);
        }
        let (_, _, fine) = Model::E.reference();
        let near = (solution.trajectory.objective / fine.base[0] - 1.0).abs() < SAME;
        Ok((
            solution.meshes.iter().map(|m| m.counters.iterations).sum(),
            solution.status.is_success() && near,
        ))
    }
}

/// Start and end of a state in a guess.
fn ends(phase: &Phase, k: usize) -> [f64; 2] {
    let state = &phase.states[k];
    let free = [END[0], END[1].to_radians(), END[2].to_radians()];
    let end = if state.terminal.is_fixed() { state.terminal.lower } else { free[k.saturating_sub(3)] };
    [state.initial.lower, end]
}

pub(super) fn sheet(seeds: u64, workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let title = format!(
        "Random starts, model E with the limits of the paper: {seeds} each on {INTERVALS} intervals of {POINTS} points; success is a heat \
         load within {SAME} of the optimum"
    );
    let mut sheet = Sheet::new(
        "starts",
        title,
        "start, control",
        &[
            ("successes", 0),
            ("median_iterations", 1),
            ("most_iterations", 0),
            ("reference_successes_of_20", 0),
            ("reference_median_iterations", 0),
        ],
    );
    for (control, steering) in CONTROLS {
        let changes = [
            word("steering", steering),
            number("search.evaluations", FLIGHTS as f64),
            number("radau.intervals", INTERVALS as f64),
            number("radau.points", POINTS as f64),
        ];
        let mission = mission(Model::E, BASE, &changes)?;
        let posed = mission.pose()?;
        let start =
            Start { mission: &mission, posed: &posed, is_angle: posed.ocp.phases[0].controls.len() == 1 };
        let jobs: Vec<(Kind, u64)> =
            KINDS.iter().flat_map(|(_, kind, _)| (0..seeds).map(move |seed| (*kind, seed))).collect();
        let results = workers.all(&jobs, |(kind, seed), observer| start.solve(*kind, *seed, observer))?;
        let mut lines = Vec::new();
        for (k, (name, _, reference)) in KINDS.iter().enumerate() {
            let runs = &results[k * seeds as usize..(k + 1) * seeds as usize];
            let successes: Vec<f64> =
                runs.iter().filter_map(|r| r.as_ref().ok().filter(|r| r.1).map(|r| r.0 as f64)).collect();
            let (count, middle) = (successes.len(), median(successes.iter().copied()));
            let most = successes.iter().copied().reduce(f64::max);
            // The reference has cosine and sine.
            let printed = |v: f64| (steering == CONTROLS[0].1).then_some(v);
            sheet.push(
                format!("{name}, {control}"),
                vec![Some(count as f64), middle, most, printed(reference[0]), printed(reference[1])],
            );
            lines.push(format!("{count} of {seeds} and {:.0} iterations", middle.unwrap_or(f64::NAN)));
        }
        sheet.findings.push(format!(
            "With {control} as control: straight lines {}, flights at a random bank {}, random shapes {}, from the search {}.",
            lines[0], lines[1], lines[2], lines[3]
        ));
    }
    Ok(sheet)
}
