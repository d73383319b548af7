//! The moon lander of the paper: vertical descent with least impulse, whose optimum is a fall and a burn.
//!
//! ```text
//! minimise int u dt,   h' = v,   v' = u - 1.5,   0 <= u <= 3,   h(0) = 10,   v(0) = -2,   h(tf) = v(tf) = 0
//! ```

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_metaheuristics::{Evaluation, Search, SearchSpace};
use apsides_ocp::{Bounds, Guess, Mesh, Ocp, OcpError, Phase, PhaseTrajectory, State, Variable};
use apsides_radau::{Radau, RadauSettings};
use apsides_shooting::profile::{
    FlightRules, ProfileScore, ProfileShape, ProfileShooting, Stop as FlightStop,
};

use super::reference::LANDER;
use super::{ALGORITHMS, algorithm};
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::{Stop, ended};
use crate::workers::Workers;

const GRAVITY: f64 = 1.5;
const MOST_THRUST: f64 = 3.0;
const HEIGHT: f64 = 10.0;
const SPEED: f64 = -2.0;
/// Impulse for one unit of speed missed at the ground: above the costate there, which is 2, so that the least sum misses nothing.
const PRICE: f64 = 3.0;
const MESH_TOLERANCE: f64 = 1e-10;
const NLP_TOLERANCE: f64 = 1e-11;

#[derive(Clone, Copy)]
struct Lander;

impl Dynamics<2, 1> for Lander {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0] - GRAVITY]
    }
}

struct Thrust;

impl PathFunction<2, 1, 1> for Thrust {
    fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}

fn ocp() -> Result<Ocp, OcpError> {
    let phase = Phase::new("descent", Lander)
        .states([
            State::new("height", "-").within(-20.0, 20.0).scaled_by(1.0).starts_at(HEIGHT).ends_at(0.0),
            State::new("speed", "-").within(-20.0, 20.0).scaled_by(1.0).starts_at(SPEED).ends_at(0.0),
        ])
        .controls([Variable::new("thrust", "-").within(0.0, MOST_THRUST)])
        .final_time(Bounds::new(0.5, 10.0))
        .time_unit("-")
        .integral(Variable::new("impulse", "-").scaled_by(1.0), Thrust);
    Ocp::builder("moon lander").phase(phase).minimize_integral("descent", "impulse").build()
}

/// Start of the burn, landing, impulse: the fall ends where the height is that of the burn to rest.
fn closed_form() -> [f64; 3] {
    let a = MOST_THRUST - GRAVITY;
    // h0 + v0 t - g t^2 / 2 = (v0 - g t)^2 / (2 a).
    let square = 0.5 * GRAVITY + 0.5 * GRAVITY * GRAVITY / a;
    let linear = -SPEED * (1.0 + GRAVITY / a);
    let constant = 0.5 * SPEED * SPEED / a - HEIGHT;
    let start = (-linear + (linear * linear - 4.0 * square * constant).sqrt()) / (2.0 * square);
    let end = start + (GRAVITY * start - SPEED) / a;
    [start, end, MOST_THRUST * (end - start)]
}

/// Thrust, height and speed of the closed form at a time.
fn closed_at(time: f64) -> [f64; 3] {
    let [start, end, _] = closed_form();
    if time < start {
        let speed = SPEED - GRAVITY * time;
        return [0.0, HEIGHT + 0.5 * (SPEED + speed) * time, speed];
    }
    let (deceleration, left) = (MOST_THRUST - GRAVITY, end - time);
    [MOST_THRUST, 0.5 * deceleration * left * left, -deceleration * left]
}

/// Figures of the paper with the place of their quantity in [`closed_at`].
const FIGURES: [(&str, &str, &str); 3] = [
    ("lander_thrust.svg", "Fig. 3: thrust of the moon lander", "thrust"),
    ("lander_height.svg", "Fig. 4: height of the moon lander", "height"),
    ("lander_speed.svg", "Fig. 5: speed of the moon lander", "speed"),
];
/// Points of the lines, and every so many of them a dot.
const POINTS: usize = 300;
const POINTS_A_DOT: usize = 10;

/// Lines of the closed form with dots of the collocation.
fn figures(flown: &PhaseTrajectory) -> Vec<Graph> {
    let [start, end, _] = closed_form();
    let mut times: Vec<f64> = (0..=POINTS).map(|k| end * k as f64 / POINTS as f64).collect();
    // Both sides of the switch.
    times.extend([start.next_down(), start]);
    times.sort_by(f64::total_cmp);
    let graph = |(k, (file, title, name)): (usize, &(&'static str, &str, &'static str))| {
        let radau = |time: f64| {
            let (thrust, state) = (flown.control_at(time), flown.state_at(time));
            let value = [&thrust[..], &state[..]].concat().get(k).copied();
            [time, value.unwrap_or(f64::NAN)]
        };
        let line = times.iter().map(|&t| [t, closed_at(t)[k]]).collect();
        let dots = (0..=POINTS / POINTS_A_DOT)
            .map(|j| radau(flown.time_at((j * POINTS_A_DOT) as f64 / POINTS as f64)))
            .collect();
        Graph {
            file,
            title: (*title).into(),
            x: ("time", "-"),
            y: (name, "-"),
            series: vec![
                GraphSeries { label: "closed form".into(), line, dots: Vec::new() },
                GraphSeries { label: "Radau".into(), line: Vec::new(), dots },
            ],
        }
    };
    FIGURES.iter().enumerate().map(graph).collect()
}

fn by_radau(ocp: &Ocp, workers: &mut Workers<'_>) -> Result<([f64; 3], Option<PhaseTrajectory>), Stop> {
    let mut settings = RadauSettings { tolerance: MESH_TOLERANCE, ..RadauSettings::default() };
    settings.nlp.tolerance = NLP_TOLERANCE;
    let mesh = Mesh::uniform(ocp, settings.intervals, settings.points)?;
    let solution = Radau { settings }.solve_on(ocp, &Guess::linear(ocp), mesh, &mut *workers.observer)?;
    ended(&ocp.name, "Radau", solution.status)?;
    let switch = solution.switches.first().map_or(f64::NAN, |s| s.time);
    let phase = solution.trajectory.phases.into_iter().next();
    let landing = phase.as_ref().map_or(f64::NAN, |p| p.final_time);
    Ok(([switch, landing, solution.trajectory.objective], phase))
}

/// Two constants with free lengths, flown down to the ground.
fn by_search(shooting: &ProfileShooting<'_>, search: &Search) -> Result<[f64; 3], Stop> {
    let score = ProfileScore::new(shooting, PRICE);
    let (lower, upper) = shooting.space();
    let space = SearchSpace::new(lower.to_vec(), upper.to_vec())?;
    let value =
        |x: &[f64]| shooting.flown(x, |f| Evaluation::from(score.penalised(f))).unwrap_or(Evaluation::FAILED);
    let report = search.minimize(&space, &value)?;
    let Some(best) = report.best else { return Err(Stop::NotSolved("every flight failed".into())) };
    let end = shooting.flown(&best.x, |f| f.final_time)?;
    // The last number is the end of the profile, which the ground may cut short.
    let length = best.x.last().copied().unwrap_or(f64::NAN);
    let start = shooting.profile(&best.x)?.joints()[1] * length;
    Ok([start, end, best.evaluation.objective])
}

pub(super) fn sheet(seeds: u64, budget: usize, workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "moon-lander",
        format!(
            "Moon lander: closed form, Radau, and the median of {seeds} searches of {budget} flights over two constants with free \
             lengths"
        ),
        "method",
        &[("burn_starts", 9), ("landing", 9), ("impulse", 9), ("impulse_less_closed_form", 9)],
    );
    let exact = closed_form();
    let mut push = |label: &str, v: [f64; 3]| {
        sheet.push(label, v.into_iter().chain([v[2] - exact[2]]).map(Some).collect());
    };
    push("closed form", exact);
    push("reference", LANDER);
    let ocp = ocp()?;
    let (radau, flown) = by_radau(&ocp, workers)?;
    push("Radau", radau);
    let shape = ProfileShape { free_lengths: true, ..ProfileShape::of_controls(0, 2, &ocp.phases[0]) };
    let ground = FlightStop::at_end(&ocp.phases[0], "height")?;
    let shooting = ProfileShooting::new(&ocp, FlightRules::new(shape).until(ground))?;
    let mut failures = Vec::new();
    for (word, label) in ALGORITHMS {
        let base = algorithm(word, budget)?;
        let jobs: Vec<u64> = (0..seeds).collect();
        let found = workers.all(&jobs, |&seed, _| by_search(&shooting, &Search { seed, ..base.clone() }))?;
        let mut solved = Vec::new();
        for result in found {
            match result {
                Ok(v) => solved.push(v),
                Err(why) => failures.push(format!("{label}: {why}")),
            }
        }
        solved.sort_by(|a, b| a[2].total_cmp(&b[2]));
        if let Some(v) = solved.get(solved.len() / 2) {
            push(label, *v);
        }
    }
    sheet.failures = failures;
    sheet.graphs = flown.as_ref().map(figures).unwrap_or_default();
    sheet.findings.push(format!(
        "Formulas (21) and (22) hold: the burn starts at {:.10}, the landing is at {:.10}, the impulse is g tf - v0 = {:.10}; Radau \
         differs by {:.1e}.",
        exact[0],
        exact[1],
        GRAVITY * exact[1] - SPEED,
        (radau[2] - exact[2]).abs()
    ));
    Ok(sheet)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-12;

    /// The closed form begins and ends as the problem says, and joins where the burn starts.
    #[test]
    fn the_closed_form_meets_its_ends() {
        let [start, end, _] = closed_form();
        assert_eq!(closed_at(0.0), [0.0, HEIGHT, SPEED]);
        assert_eq!(closed_at(end), [MOST_THRUST, 0.0, -0.0]);
        let ([_, h0, v0], [_, h1, v1]) = (closed_at(start.next_down()), closed_at(start));
        assert!((h0 - h1).abs() < ROUNDING && (v0 - v1).abs() < ROUNDING, "{h0} {h1} {v0} {v1}");
    }
}
