//! Bounds and path constraints along the re-simulated path, between the nodes of the solution too.
//!
//! Every interval of the control polynomial is looked at in equally spaced points; around the worst one a golden
//! section search finds the worst time.

use apsides_basis::golden_section;
use apsides_ocp::{Bounds, Phase, PhaseScaling, PhaseTrajectory, Variable};

use crate::boundary::row_scale;
use crate::equations::Equations;
use crate::place::place;
use crate::simulation::{Flight, sample_times};
use crate::worst::{Worst, is_worse};
use crate::{Check, CheckKind, VerifySettings};

/// Evaluations of the search: the bracket ends at 1e-8 of its length.
const SEARCH_EVALUATIONS: usize = 41;

/// Scales count up to this many times the largest value along the path, and values up to this part of the scale are none.
const BESIDE_FAR_BOUNDS: f64 = 1e3;
/// See there.
const NOTHING_MET: f64 = 1e-5;

/// A quantity that is watched, in the row `[x, u, path rows]`.
struct Watched<'a> {
    row: usize,
    variable: &'a Variable,
    /// Smallest limit, whatever the scale.
    floor: f64,
    excess: f64,
    /// Typical size where neither a scale nor a bound says one.
    size: f64,
    /// Largest magnitude along the path.
    met: f64,
    leg: usize,
    time: f64,
}

impl Watched<'_> {
    /// The allowed excess. Where the scale is the width of bounds, and they are far apart beside what lies between them, that counts.
    fn limit(&self, settings: &VerifySettings) -> f64 {
        let scale = row_scale(self.variable, self.size);
        let most = BESIDE_FAR_BOUNDS * self.met.max(NOTHING_MET * scale);
        let is_width = self.variable.scale.is_none() && self.variable.size_within_bounds(0.0).is_some();
        let size = if is_width { scale.min(most) } else { scale };
        (settings.path_tolerance * size).max(self.floor)
    }
}

/// The trajectory's states at their own nodes against the re-simulated path.
pub(crate) fn deviation(
    phase: &Phase,
    found: &PhaseTrajectory,
    flight: &Flight,
    scaling: &PhaseScaling,
    settings: &VerifySettings,
) -> Option<Check> {
    let nx = phase.states.len();
    let (mut flown, mut stated) = (vec![0.0; nx], vec![0.0; nx]);
    let mut scratch = vec![0.0; flight.dimension()];
    let mut worst = Worst::default();
    for segment in 0..found.state.segments().len() {
        for t in found.state.node_times(segment) {
            flight.state(found.control.segment_at(t), t, &mut scratch, &mut flown);
            found.state.evaluate_in(segment, t, &mut stated);
            for (i, state) in phase.states.iter().enumerate() {
                let limit = settings.limit_of_state(state, scaling.states[i]);
                let at = || format!("{}, {}", state.variable.name, place(phase, t));
                worst.consider((flown[i] - stated[i]).abs(), limit, &state.variable.unit, at);
            }
        }
    }
    worst.into_check(format!("states along {} against the re-simulation", phase.name), CheckKind::Feasibility)
}

/// Checks of one phase: all state bounds, all control bounds, each path constraint row.
pub(crate) fn checks(
    mut equations: Equations<'_>,
    found: &PhaseTrajectory,
    flight: &Flight,
    scaling: &PhaseScaling,
    settings: &VerifySettings,
) -> Vec<Check> {
    let phase = equations.phase;
    let (nx, nu) = (equations.nx, equations.nu);
    let mut row = vec![0.0; nx + nu + phase.path_rows()];
    let mut scratch = vec![0.0; flight.dimension()];
    let mut evaluate = |leg: usize, t: f64, row: &mut [f64]| {
        let (x, rest) = row.split_at_mut(nx);
        let (u, path) = rest.split_at_mut(nu);
        flight.state(leg, t, &mut scratch, x);
        found.control.evaluate_in(leg, t, u);
        equations.set(found.control.within(leg, t), x, u);
        equations.path(path);
    };
    let mut watched = watched(phase, scaling);
    for leg in 0..flight.legs() {
        for t in sample_times(flight.leg_times(leg), settings.scan_points) {
            evaluate(leg, t, &mut row);
            for w in &mut watched {
                let value = row[w.row];
                let excess = w.variable.bounds.excess(value);
                w.met = w.met.max(value.abs());
                if is_worse(excess, w.excess) {
                    (w.excess, w.leg, w.time) = (excess, leg, t);
                }
            }
        }
    }
    for w in &mut watched {
        let (start, end) = flight.leg_times(w.leg);
        let spacing = (end - start) / (settings.scan_points - 1) as f64;
        let around = [(w.time - spacing).max(start), (w.time + spacing).min(end)];
        golden_section(around, SEARCH_EVALUATIONS, |t| {
            evaluate(w.leg, t, &mut row);
            let excess = w.variable.bounds.excess(row[w.row]);
            if is_worse(excess, w.excess) {
                (w.excess, w.time) = (excess, t);
            }
            -excess
        });
    }
    report(phase, nx, nu, watched, settings)
}

fn watched<'a>(phase: &'a Phase, scaling: &PhaseScaling) -> Vec<Watched<'a>> {
    let watch = |row, variable, floor, size| Watched {
        row,
        variable,
        floor,
        excess: f64::NEG_INFINITY,
        size,
        met: 0.0,
        leg: 0,
        time: 0.0,
    };
    let (nx, nu) = (phase.states.len(), phase.controls.len());
    let states = phase.states.iter().enumerate().map(|(i, s)| {
        // The path may leave its bounds by as much as a stated tolerance lets its end miss.
        watch(i, &s.variable, s.tolerance.unwrap_or(0.0), scaling.states[i])
    });
    let controls = phase.controls.iter().enumerate().map(|(i, c)| watch(nx + i, c, 0.0, scaling.controls[i]));
    let path = phase
        .path
        .iter()
        .flat_map(|p| &p.rows)
        .enumerate()
        .map(|(i, r)| watch(nx + nu + i, r, 0.0, scaling.path[i]));
    let bounded = |w: &Watched<'_>| w.variable.bounds != Bounds::FREE;
    states.chain(controls).chain(path).filter(bounded).collect()
}

fn report(
    phase: &Phase,
    nx: usize,
    nu: usize,
    watched: Vec<Watched<'_>>,
    settings: &VerifySettings,
) -> Vec<Check> {
    let kind = CheckKind::Feasibility;
    let (mut states, mut controls) = (Worst::default(), Worst::default());
    let mut rows = Vec::new();
    for w in &watched {
        let variable = w.variable;
        let limit = w.limit(settings);
        let named = || format!("{}, {}", variable.name, place(phase, w.time));
        if w.row < nx {
            states.consider(w.excess, limit, &variable.unit, named);
        } else if w.row < nx + nu {
            controls.consider(w.excess, limit, &variable.unit, named);
        } else {
            let mut worst = Worst::default();
            worst.consider(w.excess, limit, &variable.unit, || place(phase, w.time));
            rows.extend(worst.into_check(format!("{} along {}", variable.name, phase.name), kind));
        }
    }
    let states = states.into_check(format!("state bounds along {}", phase.name), kind);
    let controls = controls.into_check(format!("control bounds along {}", phase.name), kind);
    states.into_iter().chain(controls).chain(rows).collect()
}
