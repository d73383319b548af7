//! Flights that deviate from a planned main braking.

use apsides_ad::{Dual, Dynamics};
use apsides_dynamics::cartesian::CartesianForce;
use apsides_dynamics::frames::{BodyFixed, Local};
use apsides_ocp::{At, Bounds, Guess, Mesh, Ocp, PhaseTrajectory, Trajectory};
use apsides_ode::{Integrator, Linearised, OdeSettings, OdeSystem, Status, StmPropagator};
use apsides_radau::Radau;

use super::lander::{Lander, Motion};
use super::phases::{ABOVE_M, BELOW_M, BRAKING};
use crate::Error;
use crate::dispersion::Deviations;
use crate::key::Values;
use crate::montecarlo::{Dispersed, Guidance};

/// What a flight amounts to: where and how fast it is at the planned end, relative to the plan, in the local axes there.
pub(super) const COLUMNS: &[&str] = &[
    "up_m",
    "along_m",
    "across_m",
    "up_m_s",
    "along_m_s",
    "across_m_s",
    "horizontal_miss_m",
    "final_mass_kg",
    "flight_time_s",
];

/// Number of components of the state that the state-transition matrix maps.
const N: usize = 7;
/// Relative accuracy of flights, and of positions (m), velocities (m/s) and masses (kg).
const ACCURACY: f64 = 1e-11;

/// A planned main braking and what is needed to fly it again.
pub(super) struct PlannedBraking {
    lander: Lander,
    plan: PhaseTrajectory,
    mesh: Mesh,
    whole: Trajectory,
    frame: BodyFixed,
    /// Position, velocity and mass in inertial axes at start and end.
    start: [f64; N],
    end: [f64; N],
    /// Local axes at start and end: up, along the course, across it to the right, in inertial axes.
    start_axes: [[f64; 3]; 3],
    end_axes: [[f64; 3]; 3],
}

impl PlannedBraking {
    /// # Errors
    /// Missions in the plane, and those with a field of higher degree.
    pub(super) fn new(v: &Values, t: &Trajectory) -> Result<Self, Error> {
        let conflict = |reason: String| Error::Conflict { place: "mission".into(), reason };
        let lander = Lander::of(v).map_err(conflict)?;
        if lander.motion == Motion::Plane || lander.descent.gravity.degree() > 0 {
            let reason = "Monte Carlo needs `motion` = \"space\" and `gravity` = \"central\"".into();
            return Err(conflict(reason));
        }
        let plan = t.phases.first().cloned().ok_or_else(|| conflict("the plan has no phase".into()))?;
        let frame = BodyFixed { rotation_rate: lander.descent.rotation_rate, epoch_angle: 0.0 };
        let at = |time: f64| -> [f64; N] {
            let x = plan.state_at(time);
            let local = Local::at(x[1], x[2]);
            let (p, v) =
                frame.to_inertial(time, local.up.map(|c| c * x[0]), local.vector([x[3], x[4], x[5]]));
            [p[0], p[1], p[2], v[0], v[1], v[2], x[6]]
        };
        let axes = |time: f64| {
            let x = plan.state_at(time);
            let local = Local::at(x[1], x[2]);
            let (sin, cos) = lander.azimuth.sin_cos();
            let turned = |v: [f64; 3]| frame.to_inertial(time, v, [0.0; 3]).0;
            [local.up, local.vector([0.0, sin, cos]), local.vector([0.0, cos, -sin])].map(turned)
        };
        let (start, end) = (at(plan.initial_time), at(plan.final_time));
        let (start_axes, end_axes) = (axes(plan.initial_time), axes(plan.final_time));
        let mesh = Mesh { phases: vec![plan.mesh.clone()] };
        Ok(Self { lander, plan, mesh, whole: t.clone(), frame, start, end, start_axes, end_axes })
    }

    fn force(&self, time: f64) -> [f64; 3] {
        let (mut x, mut u) = ([0.0; 7], [0.0; 3]);
        self.plan.state.evaluate(time, &mut x);
        self.plan.control.evaluate(time, &mut u);
        let ((sin_course, cos_course), (sin_pitch, cos_pitch)) = (u[0].sin_cos(), u[1].sin_cos());
        let size = u[2] * self.lander.descent.engine.thrust;
        let thrust = [size * sin_pitch, size * cos_pitch * sin_course, size * cos_pitch * cos_course];
        self.frame.to_inertial(time, Local::at(x[1], x[2]).vector(thrust), [0.0; 3]).0
    }

    /// The thrust of the plan, changed by its deviations.
    fn open_loop(&self, thrust: f64, exhaust_velocity: f64) -> OpenLoop<'_> {
        let body = self.lander.body;
        let exhaust_velocity = self.lander.descent.engine.exhaust_velocity * (1.0 + exhaust_velocity);
        OpenLoop { plan: self, thrust: 1.0 + thrust, model: CartesianForce { body, exhaust_velocity } }
    }

    /// A state from deviations of the planned start.
    fn deviating(&self, d: &Deviations) -> [f64; N] {
        let mut x = self.start;
        for (k, axis) in self.start_axes.iter().enumerate() {
            for c in 0..3 {
                x[c] += d.position_m[k] * axis[c];
                x[3 + c] += d.velocity_m_s[k] * axis[c];
            }
        }
        x[6] += d.mass_kg;
        x
    }

    /// The intervals of the control polynomial, whose ends an integration must meet.
    fn legs(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.plan.control.breaks().windows(2).map(|w| (w[0], w[1]))
    }

    fn fly_open_loop(&self, d: &Deviations) -> Option<Vec<f64>> {
        let system = self.open_loop(d.thrust, d.exhaust_velocity);
        let mut integrator = Integrator::new(N, settings()).ok()?;
        let mut x = self.deviating(d);
        for (start, end) in self.legs() {
            let from = x;
            let summary = integrator.integrate(&system, start, &from, end, &mut x).ok()?;
            if summary.status != Status::Completed {
                return None;
            }
        }
        Some(self.results(&x, self.plan.final_time))
    }

    /// Relative to the planned end.
    fn results(&self, x: &[f64; N], time: f64) -> Vec<f64> {
        let difference = |from: usize| [0, 1, 2].map(|c| x[from + c] - self.end[from + c]);
        let along = |v: [f64; 3], axis: &[f64; 3]| v.iter().zip(axis).map(|(a, b)| a * b).sum::<f64>();
        let (place, speed) = (difference(0), difference(3));
        let radius = |x: &[f64; N]| x[..3].iter().map(|c| c * c).sum::<f64>().sqrt();
        let mut results = vec![radius(x) - radius(&self.end)];
        results.extend(self.end_axes[1..].iter().map(|a| along(place, a)));
        results.extend(self.end_axes.iter().map(|a| along(speed, a)));
        results.push(results[1].hypot(results[2]));
        results.extend([x[6], time]);
        results
    }

    fn replan(&self, d: &Deviations) -> Option<Vec<f64>> {
        let x = self.deviating(d);
        let (p, v) = self.frame.to_fixed(self.plan.initial_time, [x[0], x[1], x[2]], [x[3], x[4], x[5]]);
        let (r, longitude, latitude) = Local::spherical(p);
        let [w, e, n] = Local::at(longitude, latitude).components(v);
        let mut lander = self.lander.clone();
        lander.descent.engine.thrust *= 1.0 + d.thrust;
        lander.descent.engine.exhaust_velocity *= 1.0 + d.exhaust_velocity;
        let ocp = lander.replanning(&[r, longitude, latitude, w, e, n, x[6]]).ok()?;
        let guess = Guess::earlier(&self.whole);
        let solution = Radau::default().solve_on(&ocp, &guess, self.mesh.clone(), &mut ()).ok()?;
        if !solution.status.is_success() {
            return None;
        }
        // The new plan is flown by an integration of its own.
        let mut whole = solution.trajectory;
        let new = Self {
            lander,
            plan: whole.phases.remove(0),
            mesh: self.mesh.clone(),
            whole: self.whole.clone(),
            ..*self
        };
        let mut integrator = Integrator::new(N, settings()).ok()?;
        let (system, mut x) = (new.open_loop(0.0, 0.0), x);
        for (start, end) in new.legs() {
            let from = x;
            integrator.integrate(&system, start, &from, end, &mut x).ok()?;
        }
        // The planned end is a place on the ground, which moves on with the body.
        let time = new.plan.final_time;
        let (p, v) = self.frame.to_fixed(time, [x[0], x[1], x[2]], [x[3], x[4], x[5]]);
        let (p, v) = self.frame.to_inertial(self.plan.final_time, p, v);
        Some(self.results(&[p[0], p[1], p[2], v[0], v[1], v[2], x[6]], time))
    }

    /// State-transition matrix from start to end in inertial axes, with the thrust of the plan: row-major, position, velocity and mass.
    fn transition(&self) -> Option<Vec<f64>> {
        let system = self.open_loop(0.0, 0.0);
        let mut x = self.start;
        let mut total: Vec<f64> = (0..N * N).map(|k| f64::from(u8::from(k % (N + 1) == 0))).collect();
        let mut propagator = StmPropagator::new(N, 0, settings()).ok()?;
        for (start, end) in self.legs() {
            let summary = propagator.propagate(&system, start, &x, end).ok()?;
            if summary.status != Status::Completed {
                return None;
            }
            x.copy_from_slice(propagator.state());
            let leg = propagator.stm();
            let entry = |i: usize, j: usize| (0..N).map(|k| leg[i * N + k] * total[k * N + j]).sum();
            total = (0..N * N).map(|k| entry(k / N, k % N)).collect();
        }
        Some(total)
    }
}

fn settings() -> OdeSettings {
    OdeSettings::with_tolerance(ACCURACY)
}

impl Dispersed for PlannedBraking {
    fn fly(&self, deviations: &Deviations, guidance: Guidance) -> Option<Vec<f64>> {
        match guidance {
            Guidance::OpenLoop => self.fly_open_loop(deviations),
            Guidance::Replanned => self.replan(deviations),
        }
    }

    fn linear_sigmas(&self, dispersions: &Deviations) -> Vec<f64> {
        let Some(phi) = self.transition() else { return Vec::new() };
        let sigmas = dispersions.values();
        let mut variances = [0.0; 6];
        // One column for each deviation of position and velocity along the local axes at the start, and one for the mass.
        for (k, sigma) in sigmas.iter().enumerate().filter(|(k, s)| (*k < 6 || *k == 8) && **s > 0.0) {
            let mut from = [0.0; N];
            match k {
                8 => from[6] = 1.0,
                _ => from[k / 3 * 3..][..3].copy_from_slice(&self.start_axes[k % 3]),
            }
            let to: Vec<f64> =
                (0..N).map(|i| phi[i * N..][..N].iter().zip(from).map(|(a, b)| a * b).sum()).collect();
            for (j, variance) in variances.iter_mut().enumerate() {
                let axis = &self.end_axes[j % 3];
                let part: f64 = to[j / 3 * 3..][..3].iter().zip(axis).map(|(a, b)| a * b).sum();
                *variance += (sigma * part).powi(2);
            }
        }
        // Thrust and exhaust velocity by central differences of two flights.
        for k in [6, 7].into_iter().filter(|k| sigmas[*k] > 0.0) {
            let at = |sign: f64| {
                let mut d = Deviations::default();
                if k == 6 {
                    d.thrust = sign * sigmas[6]
                } else {
                    d.exhaust_velocity = sign * sigmas[7]
                }
                self.fly_open_loop(&d)
            };
            if let Some((above, below)) = at(1.0).zip(at(-1.0)) {
                for (j, variance) in variances.iter_mut().enumerate() {
                    *variance += (0.5 * (above[j] - below[j])).powi(2);
                }
            }
        }
        variances.map(f64::sqrt).to_vec()
    }
}

/// The thrust of the plan by a factor.
struct OpenLoop<'a> {
    plan: &'a PlannedBraking,
    thrust: f64,
    model: CartesianForce,
}

impl OdeSystem for OpenLoop<'_> {
    fn dimension(&self) -> usize {
        N
    }

    fn rate(&self, t: f64, x: &[f64], dx: &mut [f64]) {
        let Ok(state) = <&[f64; N]>::try_from(x) else { return };
        let force = self.plan.force(t).map(|f| f * self.thrust);
        dx.copy_from_slice(&self.model.rate(t, state, &force, &[]));
    }
}

impl Linearised for OpenLoop<'_> {
    fn jacobian(&self, t: f64, x: &[f64], jac: &mut [f64]) {
        let state: [Dual<N>; N] = std::array::from_fn(|k| Dual::variable(x[k], k));
        let force = self.plan.force(t).map(|f| Dual::constant(f * self.thrust));
        let rates = self.model.rate(Dual::constant(t), &state, &force, &[]);
        for (row, rate) in jac.chunks_exact_mut(N).zip(rates) {
            row.copy_from_slice(&rate.eps);
        }
    }
}

impl Lander {
    /// The main braking from any state to the gate above the site.
    fn replanning(&self, start: &[f64]) -> Result<Ocp, Error> {
        let mut phase = self.ending_at_site(self.braking_phase());
        for (s, value) in phase.states.iter_mut().zip(start) {
            s.initial = Bounds::fixed(*value);
        }
        // The guards are those of a start at the perilune.
        let guard = &mut phase.states[0].variable.bounds;
        guard.lower = guard.lower.min((start[0] - BELOW_M).max(self.body.radius));
        guard.upper = guard.upper.max(start[0] + ABOVE_M);
        let ocp = self.with_gate_speed(Ocp::builder("main braking from a state").phase(phase));
        let mass = At::FinalState(BRAKING, apsides_dynamics::planar::MASS.name);
        Ok(ocp.maximize("final_mass", "kg", mass).objective_scale(self.initial_mass).build()?)
    }
}

#[cfg(test)]
mod tests;
