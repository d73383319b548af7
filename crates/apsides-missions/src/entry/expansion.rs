//! The flight with the bank angle as its control from that with its cosine and sine, with the same costates.

use std::f64::consts::TAU;

use apsides_ocp::{Ocp, OcpError, PhaseTrajectory, PiecewisePolynomial, Segment, Trajectory};

use apsides_pipeline::Error;

use super::steering::Steering;

/// The trajectory with the bank angle as its control. The row of the norm, the last one, falls away.
pub(super) fn expand(whole: &Ocp, solution: &Trajectory) -> Result<Trajectory, Error> {
    let rows = whole.phases.first().map_or(0, apsides_ocp::Phase::path_rows);
    let phase = |p: &PhaseTrajectory| -> Result<PhaseTrajectory, OcpError> {
        let path_multipliers = match &p.path_multipliers {
            Some(found) if rows > 0 => Some(first_components(found, rows)?),
            _ => None,
        };
        Ok(PhaseTrajectory { control: angle(&p.control)?, path_multipliers, ..p.clone() })
    };
    let phases = solution.phases.iter().map(phase).collect::<Result<_, _>>()?;
    Ok(Trajectory { phases, ..solution.clone() })
}

/// The angle at the nodes, continuous from one to the next.
fn angle(vector: &PiecewisePolynomial) -> Result<PiecewisePolynomial, OcpError> {
    let mut last: Option<f64> = None;
    let mut next = |controls: &[f64]| {
        let mut bank = Steering::Vector.bank_of(controls);
        if let Some(last) = last {
            bank += ((last - bank) / TAU).round() * TAU;
        }
        last = Some(bank);
        bank
    };
    let segments = vector.segments().iter().map(|s| {
        let values = s.values.chunks(vector.dimension()).map(&mut next).collect();
        Segment { basis: s.basis.clone(), values }
    });
    PiecewisePolynomial::new(1, vector.breaks().to_vec(), segments.collect())
}

fn first_components(p: &PiecewisePolynomial, count: usize) -> Result<PiecewisePolynomial, OcpError> {
    let segments = p.segments().iter().map(|s| {
        let values = s.values.chunks(p.dimension()).flat_map(|c| &c[..count]).copied().collect();
        Segment { basis: s.basis.clone(), values }
    });
    PiecewisePolynomial::new(count, p.breaks().to_vec(), segments.collect())
}
