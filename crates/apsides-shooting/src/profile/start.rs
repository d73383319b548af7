//! From a flight to what other methods start from.

use std::sync::Arc;

use apsides_basis::{Barycentric, chebyshev_lobatto};
use apsides_ocp::{Guess, Mesh, PhaseMesh, PhaseTrajectory, PiecewisePolynomial, Segment, Sense, Trajectory};

use super::flight::Flight;
use super::motion::{Motion, Scratch};
use super::rules::Independent;
use super::shooting::ProfileShooting;
use super::watch::Recording;
use crate::error::ShootingError;

/// Joints nearer to each other than this part of the flight are one.
const NEAREST_JOINTS: f64 = 1e-4;
/// Part of an interval by which its ends are moved inside to tell on which side of a joint they are.
const INSIDE: f64 = 1e-9;

/// The mesh that is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshWish {
    /// Intervals of the flight, 1 or more; those between joints are a few more.
    pub intervals: usize,
    /// Collocation points of each, 1 or more; the polynomials of the trajectory have one point more.
    pub points: usize,
    /// The joints of the profile are ends of intervals.
    pub joints: bool,
}

/// A start for another method.
#[derive(Clone, Debug)]
pub struct ProfileStart {
    /// The flight as a whole: states and controls, no costates.
    pub trajectory: Trajectory,
    /// The same as a guess.
    pub guess: Guess,
    /// Its mesh.
    pub mesh: Mesh,
    /// The flight.
    pub flight: Flight,
}

impl ProfileShooting<'_> {
    /// Flies a decision vector and keeps the whole flight. This allocates.
    ///
    /// # Errors
    /// [`ShootingError::Start`] where the flight fails, see [`FlightEnd::is_complete`](super::FlightEnd::is_complete);
    /// [`ShootingError::Ocp`] or [`ShootingError::Basis`] where the mesh has no interval or point;
    /// [`ShootingError::Dimension`].
    pub fn start(&self, decision: &[f64], wish: MeshWish) -> Result<ProfileStart, ShootingError> {
        let mut workspace = self.workspace()?;
        let mut recording = Recording::new();
        self.fly_recorded(decision, &mut workspace, Some(&mut recording))?;
        let flight = workspace.flight().clone();
        let phase = self.phase();
        let place = || format!("phase `{}`", phase.name);
        if !flight.end.is_complete() {
            let reason =
                format!("the flight failed at {} {}: {:?}", flight.final_time, phase.time_unit, flight.end);
            return Err(ShootingError::Start { place: place(), reason });
        }
        let (t0, tf) = (flight.initial_time, flight.final_time);
        let fractions = fractions(&recording, t0, tf, wish);
        let mesh = PhaseMesh::new(fractions.clone(), vec![wish.points; fractions.len().saturating_sub(1)])?;
        let basis = Arc::new(Barycentric::new(&chebyshev_lobatto(wish.points + 1)?)?);
        let breaks: Vec<f64> = fractions.iter().map(|f| t0 * (1.0 - f) + tf * f).collect();
        let (n, m) = (phase.states.len(), phase.controls.len());
        let motion = Motion {
            phase,
            rules: self.rules(),
            profile: workspace.profile(),
            parameters: &flight.parameters,
            times: [t0, self.horizon(decision)],
            energy: match &self.rules().independent {
                Independent::Time => f64::NAN,
                Independent::Energy { energy, .. } => energy(&flight.initial_state),
            },
        };
        let mut scratch = Scratch::new(phase, self.rules(), flight.parameters.len());
        let mut x = vec![0.0; n + phase.integrals.len()];
        let (mut states, mut controls) = (Vec::new(), Vec::new());
        for ends in breaks.windows(2) {
            let (a, b) = (ends[0], ends[1]);
            let mut values = (Vec::new(), Vec::new());
            for node in basis.nodes() {
                let t = (a + 0.5 * (b - a) * (node + 1.0)).clamp(a, b);
                recording.solution.evaluate(t, &mut x)?;
                let inside = t.clamp(a + INSIDE * (b - a), b - INSIDE * (b - a));
                motion.take(recording.interval_at(inside), t, &x, &mut scratch);
                values.0.extend_from_slice(&x[..n]);
                values.1.extend_from_slice(scratch.controls(phase));
            }
            states.push(Segment { basis: Arc::clone(&basis), values: values.0 });
            controls.push(Segment { basis: Arc::clone(&basis), values: values.1 });
        }
        let errors = vec![self.rules().settings.tolerance; states.len()];
        let sign = match self.ocp().objective.sense {
            Sense::Minimize => 1.0,
            Sense::Maximize => -1.0,
        };
        let trajectory = Trajectory {
            phases: vec![PhaseTrajectory {
                name: phase.name.clone(),
                initial_time: t0,
                final_time: tf,
                mesh: mesh.clone(),
                state: PiecewisePolynomial::new(n, breaks.clone(), states)?,
                control: PiecewisePolynomial::new(m, breaks, controls)?,
                costate: None,
                path_multipliers: None,
                integral_multipliers: None,
                contacts: Vec::new(),
                interval_errors: errors,
            }],
            parameters: flight.parameters.clone(),
            objective: sign * flight.objective,
            constraint_multipliers: None,
        };
        let guess = Guess::earlier(&trajectory);
        Ok(ProfileStart { trajectory, guess, mesh: Mesh { phases: vec![mesh] }, flight })
    }
}

impl Recording {
    /// Sub-interval of the profile at a time.
    fn interval_at(&self, t: f64) -> usize {
        let k = self.pieces.partition_point(|&(_, _, end)| end < t).min(self.pieces.len() - 1);
        self.pieces[k].0
    }
}

/// Ends of the intervals: equal, or equal between the joints.
fn fractions(recording: &Recording, t0: f64, tf: f64, wish: MeshWish) -> Vec<f64> {
    let mut joints = vec![0.0];
    if wish.joints {
        for &(_, _, end) in &recording.pieces {
            let f = (end - t0) / (tf - t0);
            if f - joints[joints.len() - 1] > NEAREST_JOINTS && f < 1.0 - NEAREST_JOINTS {
                joints.push(f);
            }
        }
    }
    joints.push(1.0);
    let mut fractions = vec![0.0];
    for ends in joints.windows(2) {
        let length = ends[1] - ends[0];
        let count = (length * wish.intervals as f64 - 1e-9).ceil().max(wish.intervals.min(1) as f64) as usize;
        for k in 1..count {
            fractions.push(ends[0] + length * k as f64 / count as f64);
        }
        if count > 0 {
            fractions.push(ends[1]);
        }
    }
    fractions
}
