//! Meshes that stay too coarse: where the error is largest, how it went from mesh to mesh, what stands there, and what would mend it.

use std::ops::Range;

use apsides_ocp::mesh::ArcKind;
use apsides_ocp::method::{Accuracy, Deficiency, Remedy};
use apsides_ocp::{Bounds, Ocp, Phase, PhaseTrajectory, Variable};

use crate::along::Along;
use crate::{RadauSettings, RadauSolution};

/// Meshes at the end of a solve that are held against those before.
const LAST: usize = 2;

/// Fewest meshes before these from which on a want of gain counts.
const PATIENCE: usize = 3;

/// Part of the error before that the last meshes have to leave where it still falls.
const FALL: f64 = 0.5;

/// Distance from a bound that counts as none, by its size.
const AT_BOUND: f64 = 1e-6;

/// Names that a sentence lists.
const MOST_NAMES: usize = 3;

/// The error of a solution as a measure with its place, and the deficiency that it is where it is too large.
pub(crate) fn shortfall(
    ocp: &Ocp,
    settings: &RadauSettings,
    solution: &RadauSolution,
) -> (Accuracy, Deficiency) {
    let errors: Vec<f64> = solution.meshes.iter().map(|mesh| mesh.error).collect();
    let error = errors.last().copied().unwrap_or(f64::NAN);
    let accuracy = Accuracy::new("error between the points", error, settings.tolerance, "tolerance");
    let worst = worst(ocp, solution);
    let accuracy = match &worst {
        Some(worst) => accuracy.at(worst.place()),
        None => accuracy,
    };
    let (limits, switches, has_singular) = worst.as_ref().map_or_else(Default::default, |worst| {
        (worst.limits(), worst.switches(solution), worst.has_singular())
    });
    let falls = falls(&errors);
    let too_large = errors.len() <= settings.max_refinements;
    let remedy = if solution.stalled || (falls == Some(false) && !too_large) {
        // Nothing is said by the tolerance of limits where none is met.
        Remedy::Raise(if limits.is_empty() { &["tolerance"] } else { &["tolerance", "path_tolerance"] })
    } else if !switches.is_empty() && !settings.switches {
        Remedy::Enable("switches")
    } else {
        // The next mesh would have been too large, or one too many.
        Remedy::Raise(if too_large { &["max_total_points"] } else { &["max_refinements"] })
    };
    let mut cause = Vec::new();
    if !solution.stalled
        && let Some(falls) = falls
    {
        let (before, last) = errors.split_at(errors.len() - LAST);
        let last: Vec<String> = last.iter().map(|error| format!("{error:.1e}")).collect();
        let before = format!("{:.1e} at the least of the meshes before", least(before));
        let words = if falls { "it still falls" } else { "it no longer falls" };
        cause.push(format!("{words} ({before}, then {})", last.join(", ")));
    }
    let of_names = |names: &[String], one: &str, several: &str| {
        format!("there {} {}", listed(names), if names.len() == 1 { one } else { several })
    };
    if !switches.is_empty() {
        cause.push(of_names(&switches, "switches", "switch"));
    }
    if !limits.is_empty() {
        cause.push(of_names(&limits, "is at its limit", "are at their limits"));
    }
    if has_singular {
        cause.push("there a control is between its bounds where the Hamiltonian is linear in it".into());
    }
    let stands_still = solution.stalled || falls == Some(false);
    if stands_still && worst.is_some() && switches.is_empty() && limits.is_empty() && !has_singular {
        cause.push(
            "no limit is met and no control switches there: where a formula has a corner or a jump at this place, divide the phase there"
                .into(),
        );
    }
    let refinements = errors.len().saturating_sub(1);
    let made = if solution.stalled { Deficiency::stalled } else { Deficiency::inaccurate };
    let deficiency = made(std::slice::from_ref(&accuracy), refinements, remedy);
    let cause = (!cause.is_empty()).then(|| cause.join("; "));
    (accuracy, Deficiency { cause, ..deficiency })
}

/// True where the last meshes brought the error down, false where they did not; none where so few meshes tell nothing.
fn falls(errors: &[f64]) -> Option<bool> {
    let (before, last) = errors.split_at_checked(errors.len().checked_sub(LAST)?)?;
    match least(last) < FALL * least(before) {
        true => (!before.is_empty()).then_some(true),
        false => (before.len() >= PATIENCE).then_some(false),
    }
}

fn least(errors: &[f64]) -> f64 {
    errors.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Names in quotes, the first few of them.
fn listed(names: &[String]) -> String {
    let shown: Vec<String> = names.iter().take(MOST_NAMES).map(|name| format!("`{name}`")).collect();
    let more = if names.len() > MOST_NAMES { " and others" } else { "" };
    format!("{}{more}", shown.join(", "))
}

/// The interval with the largest error.
struct Worst<'a> {
    phase: &'a Phase,
    flown: &'a PhaseTrajectory,
    parameters: &'a [f64],
    interval: usize,
}

fn worst<'a>(ocp: &'a Ocp, solution: &'a RadauSolution) -> Option<Worst<'a>> {
    let phases = ocp.phases.iter().zip(&solution.trajectory.phases);
    let all = phases.flat_map(|(phase, flown)| {
        let errors = flown.interval_errors.iter().enumerate();
        let parameters = &*solution.trajectory.parameters;
        errors.map(move |(interval, error)| (*error, Worst { phase, flown, parameters, interval }))
    });
    let largest = all.filter(|(error, _)| *error > 0.0).max_by(|a, b| a.0.total_cmp(&b.0));
    largest.map(|(_, worst)| worst)
}

impl Worst<'_> {
    fn times(&self) -> Option<Range<f64>> {
        let fractions = self.flown.mesh.fractions();
        let [a, b] = [self.interval, self.interval + 1].map(|k| fractions.get(k).copied());
        Some(self.flown.time_at(a?)..self.flown.time_at(b?))
    }

    /// Phase and times in words.
    fn place(&self) -> String {
        let Phase { name, time_unit, .. } = self.phase;
        match self.times() {
            Some(Range { start, end }) => format!("phase `{name}`, t = {start:.6} to {end:.6} {time_unit}"),
            None => format!("phase `{name}`"),
        }
    }

    /// Names of controls and limits that switch within the interval or at its ends.
    fn switches(&self, solution: &RadauSolution) -> Vec<String> {
        let Some(Range { start, end }) = self.times() else { return Vec::new() };
        let here = solution.switches.iter().filter(|s| {
            let close = AT_BOUND * (self.flown.final_time - self.flown.initial_time).abs();
            s.phase == self.phase.name && (start - close..=end + close).contains(&s.time)
        });
        unique(here.map(|s| s.name.clone()))
    }

    /// Names of states and path constraints that are at their bounds somewhere in the interval.
    fn limits(&self) -> Vec<String> {
        let Self { phase, flown, parameters, interval } = *self;
        let rows: Vec<&Variable> = phase.path.iter().flat_map(|path| &path.rows).collect();
        let Some(segment) = flown.state.segments().get(interval) else { return Vec::new() };
        let mut along = Along::new(phase, flown, parameters, |_| Ok(segment.basis.nodes().to_vec()));
        if along.go(interval).is_err() {
            return Vec::new();
        }
        let mut found = Vec::new();
        for values in along.states().chunks_exact(phase.states.len().max(1)) {
            let states = phase.states.iter().map(|state| &state.variable).zip(values);
            found.extend(states.filter(|(variable, v)| is_at_bound(variable, **v)).map(|(state, _)| state));
        }
        for path in &phase.path {
            let mut values = vec![0.0; along.count() * path.rows.len()];
            along.values(path.function.as_ref(), &mut values);
            for values in values.chunks_exact(path.rows.len().max(1)) {
                let at_bound = path.rows.iter().zip(values).filter(|(row, v)| is_at_bound(row, **v));
                found.extend(at_bound.map(|(row, _)| row));
            }
        }
        let beside = interval..=interval + 1;
        let contacts = flown.contacts.iter().filter(|contact| beside.contains(&contact.end));
        found.extend(contacts.filter_map(|contact| rows.get(contact.row)));
        unique(found.into_iter().map(|variable| variable.name.clone()))
    }

    fn has_singular(&self) -> bool {
        let mesh = &self.flown.mesh;
        let here = (0..mesh.arcs().len()).find(|arc| mesh.arc_intervals(*arc).contains(&self.interval));
        let arc = here.and_then(|arc| mesh.arcs().get(arc));
        arc.is_some_and(|arc| arc.controls.contains(&Some(ArcKind::Singular)))
    }
}

fn is_at_bound(variable: &Variable, value: f64) -> bool {
    let Bounds { lower, upper } = variable.bounds;
    let size = variable.scale.unwrap_or(1.0).max(value.abs());
    lower < upper && [lower, upper].iter().any(|bound| (value - bound).abs() <= AT_BOUND * size)
}

/// Names without those that stood before.
fn unique(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for name in names {
        if !found.contains(&name) {
            found.push(name);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_course_of_errors_tells_whether_more_meshes_help() {
        assert_eq!(falls(&[1e-3, 1e-4]), None);
        assert_eq!(falls(&[1e-3, 1e-4, 1e-5]), Some(true));
        assert_eq!(falls(&[1e-3, 1e-5, 9e-6, 8e-6]), None);
        assert_eq!(falls(&[1e-3, 1e-4, 1e-5, 9e-6, 8e-6]), Some(false));
        assert_eq!(falls(&[1e-3, 1e-5, 1e-4, 2e-6]), Some(true));
    }

    #[test]
    fn a_value_at_a_bound_is_seen_by_its_size() {
        let limited =
            |lower, upper| Variable { bounds: Bounds { lower, upper }, ..Variable::new("altitude", "m") };
        assert!(is_at_bound(&limited(0.0, 1e5), 1e-9));
        assert!(is_at_bound(&limited(0.0, 1e5), 1e5 - 0.01));
        assert!(!is_at_bound(&limited(0.0, 1e5), 10.0));
        // What is held is no limit that is met.
        assert!(!is_at_bound(&limited(7.0, 7.0), 7.0));
        assert!(!is_at_bound(&limited(f64::NEG_INFINITY, f64::INFINITY), 1.0));
    }

    #[test]
    fn names_stand_once_and_few() {
        let names = unique(["a", "b", "a", "c", "d"].iter().map(|name| (*name).to_owned()));
        assert_eq!(listed(&names), "`a`, `b`, `c` and others");
        assert_eq!(listed(&names[..1]), "`a`");
    }
}
