//! Paths in space of problems whose states are places.

use apsides_ocp::{Ocp, PhaseTrajectory, Trajectory};
use apsides_pipeline::Curve;

/// Points of a path in each phase.
const POINTS: usize = 400;

/// Names of Cartesian axes, by which places without a unit are known.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Curves of the second and the third place over the first: states in metres, or states without a unit that are named as axes; those that
/// all phases have. None of fewer than two.
pub(super) fn paths(ocp: &Ocp, flight: &Trajectory) -> Vec<Curve> {
    let Some(first) = ocp.phases.first() else { return Vec::new() };
    let is_place =
        |name: &str, unit: &str| unit == "m" || unit == "-" && AXES.contains(&name.to_lowercase().as_str());
    let everywhere = |name: &str| {
        ocp.phases.iter().all(|phase| phase.states.iter().any(|state| state.variable.name == name))
    };
    let variables = first.states.iter().map(|state| &state.variable);
    let mut places = variables.filter(|v| is_place(&v.name, &v.unit) && everywhere(&v.name));
    let Some(x) = places.next() else { return Vec::new() };
    let over_first = |y: &apsides_ocp::Variable| {
        let of_phase = |p: &PhaseTrajectory| (p.name.clone(), points(ocp, p, [&x.name, &y.name]));
        let mut series: Vec<_> = flight.phases.iter().map(of_phase).collect();
        if let [(name, _)] = series.as_mut_slice() {
            name.clear();
        }
        Curve {
            title: format!("Path: {} over {}", y.name, x.name),
            x: (x.name.clone(), x.unit.clone()),
            y: (y.name.clone(), y.unit.clone()),
            series,
        }
    };
    places.filter(|y| y.unit == x.unit).take(2).map(over_first).collect()
}

fn points(ocp: &Ocp, flight: &PhaseTrajectory, names: [&str; 2]) -> Vec<[f64; 2]> {
    let Some(phase) = ocp.phases.iter().find(|phase| phase.name == flight.name) else { return Vec::new() };
    let place = |name: &str| phase.states.iter().position(|state| state.variable.name == name);
    let [Some(x), Some(y)] = names.map(place) else { return Vec::new() };
    let point = |k: usize| {
        let state = flight.state_at(flight.time_at(k as f64 / POINTS as f64));
        [x, y].map(|place| state.get(place).copied().unwrap_or(f64::NAN))
    };
    (0..=POINTS).map(point).collect()
}
