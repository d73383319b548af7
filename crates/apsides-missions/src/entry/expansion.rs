//! The flight with the bank angle as its control from that with its cosine and sine, with the same costates.

use std::f64::consts::TAU;

use apsides_ocp::{Ocp, PhaseTrajectory, PiecewisePolynomial, Trajectory};

use super::steering::Steering;

/// The trajectory with the bank angle as its control. The row of the norm, the last one, falls away.
pub(super) fn expand(whole: &Ocp, solution: &Trajectory) -> Trajectory {
    let rows = whole.phases.first().map_or(0, apsides_ocp::Phase::path_rows);
    let phase = |p: &PhaseTrajectory| {
        let found = p.path_multipliers.as_ref().filter(|_| rows > 0);
        let path_multipliers = found.map(|found| first_components(found, rows));
        PhaseTrajectory { control: angle(&p.control), path_multipliers, ..p.clone() }
    };
    Trajectory { phases: solution.phases.iter().map(phase).collect(), ..solution.clone() }
}

/// The flight with the vector of the bank angle as its control, as a start; nothing says how hard the length of the vector is to keep.
pub(super) fn reduce(flight: &Trajectory) -> Trajectory {
    let phase = |p: &PhaseTrajectory| {
        let control = p.control.map_nodes(2, |bank, vector| {
            vector.copy_from_slice(&Steering::Vector.controls_of(bank[0]));
        });
        PhaseTrajectory { control, path_multipliers: None, ..p.clone() }
    };
    Trajectory { phases: flight.phases.iter().map(phase).collect(), ..flight.clone() }
}

/// The angle at the nodes, continuous from one to the next.
fn angle(vector: &PiecewisePolynomial) -> PiecewisePolynomial {
    let mut last: Option<f64> = None;
    let mut next = |controls: &[f64]| {
        let mut bank = Steering::Vector.bank_of(controls);
        if let Some(last) = last {
            bank += ((last - bank) / TAU).round() * TAU;
        }
        last = Some(bank);
        bank
    };
    vector.map_nodes(1, |controls, bank| bank[0] = next(controls))
}

fn first_components(p: &PiecewisePolynomial, count: usize) -> PiecewisePolynomial {
    p.map_nodes(count, |all, first| first.copy_from_slice(&all[..count]))
}
