//! Checks besides those that every problem has: the flight in Cartesian coordinates, and the sign of the switching function.

use apsides_ad::vector::{cross, dot, scale};
use apsides_ocp::{PhaseTrajectory, Trajectory};
use apsides_ode::{FnSystem, Integrator, OdeSettings, Status, Tolerance};
use apsides_verify::{Check, CheckKind};

use super::injection::{BurnSteering, GeoInjection};
use super::phases::is_burn;

/// Largest miss of the target orbit.
const POSITION_MISS_M: f64 = 1.0;
const SPEED_MISS_M_S: f64 = 1e-3;
/// Largest value of the wrong sign of the switching function, in kg of final mass per kg burnt: as for the other conditions of an
/// optimum.
const SWITCHING_TOLERANCE: f64 = 1e-5;

/// A limit counts as reached this close to it, relative.
const AT_THE_LIMIT: f64 = 1e-6;

/// Accuracy of the integration in Cartesian coordinates: relative, in m, in m/s and in kg per step.
const RELATIVE_TOLERANCE: f64 = 1e-13;
const POSITION_TOLERANCE: f64 = 1e-6;
const SPEED_TOLERANCE: f64 = 1e-9;
const MASS_TOLERANCE: f64 = 1e-9;
const MAX_STEPS: usize = 100_000;

type Vector = [f64; 3];

pub(super) fn checks(injection: &GeoInjection, trajectory: &Trajectory) -> Vec<Check> {
    let mut checks = arrival(injection, trajectory).to_vec();
    let switching = Switching::of(injection, trajectory);
    if let Some(switching) = switching {
        let kind = CheckKind::Optimality;
        let check = |name: &str, extreme: Extreme| {
            Check::new(name, kind, extreme.value.max(0.0), SWITCHING_TOLERANCE, "-", extreme.place)
        };
        checks.extend(switching.burns.map(|e| check("switching function above zero on a burn", e)));
        // Where a burn ends because it must, the engine had better stay on.
        if let Some(coasts) = switching.coasts.filter(|_| !burns_are_limited(injection, trajectory)) {
            let below = Extreme { value: -coasts.value, ..coasts };
            checks.push(check("switching function below zero on a coast", below));
        }
    }
    checks
}

/// Returns true if a burn ends because of its longest time or of the highest apogee.
fn burns_are_limited(injection: &GeoInjection, trajectory: &Trajectory) -> bool {
    let at = |value: f64, limit: Option<f64>| limit.is_some_and(|l| value > l * (1.0 - AT_THE_LIMIT));
    trajectory.phases.iter().filter(|p| is_burn(&p.name)).any(|p| {
        let orbit = injection.elements(&p.final_state());
        let apogee = orbit.semi_latus_rectum / (1.0 - orbit.f.hypot(orbit.g));
        at(p.final_time - p.initial_time, injection.burn_time_limit) || at(apogee, injection.apogee_limit)
    })
}

/// The whole flight in Cartesian coordinates, from the parking orbit with the thrust of the trajectory, against the target orbit.
fn arrival(injection: &GeoInjection, trajectory: &Trajectory) -> [Check; 2] {
    let kind = CheckKind::Feasibility;
    let (position, speed, at) = match fly(injection, trajectory) {
        Ok(end) => {
            let [position, speed] = misses(injection, &end);
            (position, speed, "end of the last burn".to_owned())
        }
        // Not a number is above every limit.
        Err(Stopped(place)) => (f64::NAN, f64::NAN, place),
    };
    let check = |what: &str, value, limit, unit| {
        let name = format!("{what} off the target orbit, flown in Cartesian coordinates");
        Check::new(name, kind, value, limit, unit, at.clone())
    };
    [check("position", position, POSITION_MISS_M, "m"), check("velocity", speed, SPEED_MISS_M_S, "m/s")]
}

/// Where a flight stopped on the way, and why.
struct Stopped(String);

/// Position, velocity and mass at the end.
fn fly(injection: &GeoInjection, trajectory: &Trajectory) -> Result<[f64; 7], Stopped> {
    let settings = OdeSettings {
        relative_tolerance: RELATIVE_TOLERANCE,
        absolute_tolerance: Tolerance::PerComponent(
            [[POSITION_TOLERANCE; 3], [SPEED_TOLERANCE; 3]]
                .concat()
                .into_iter()
                .chain([MASS_TOLERANCE])
                .collect(),
        ),
        max_steps: MAX_STEPS,
        stiffness_interval: None,
        ..OdeSettings::default()
    };
    let mut integrator = Integrator::new(7, settings).map_err(|e| Stopped(e.to_string()))?;
    let first = trajectory.phases.first().ok_or_else(|| Stopped("no phase".into()))?;
    let begin = injection.elements(&first.state_at(first.initial_time));
    let mut state = parking(injection, begin.true_longitude);
    for phase in &trajectory.phases {
        for (segment, times) in phase.control.breaks().windows(2).enumerate() {
            let mut end = [0.0; 7];
            let system = FnSystem::new(7, |t: f64, x: &[f64], rate: &mut [f64]| {
                rates(injection, phase, segment, t, x, rate);
            });
            let reached = integrator.integrate(&system, times[0], &state, times[1], &mut end);
            match reached {
                Ok(summary) if summary.status == Status::Completed => state = end,
                Ok(summary) => {
                    let place = format!("{}, {:.3} s: {:?}", phase.name, summary.time, summary.status);
                    return Err(Stopped(place));
                }
                Err(e) => return Err(Stopped(format!("{}: {e}", phase.name))),
            }
        }
    }
    Ok(state)
}

/// Position, velocity and mass on the parking orbit, whose node is on the first axis.
fn parking(injection: &GeoInjection, longitude: f64) -> [f64; 7] {
    let (p, e) = (injection.parking_latus_rectum(), injection.parking_eccentricity);
    let (sin, cos) = longitude.sin_cos();
    let radius = p / (1.0 + e * cos);
    let unit = (injection.mu() / p).sqrt();
    let (climb, forward) = (unit * e * sin, unit * (1.0 + e * cos));
    let (tilt, along) = injection.inclination.sin_cos();
    let (up, ahead) = ([cos, sin * along, sin * tilt], [-sin, cos * along, cos * tilt]);
    let [x, y, z] = up.map(|c| radius * c);
    let [u, v, w] = std::array::from_fn(|i| climb * up[i] + forward * ahead[i]);
    [x, y, z, u, v, w, injection.initial_mass]
}

/// Gravity, oblateness (Vallado 2013, section 8.7.1) and thrust.
fn rates(
    injection: &GeoInjection,
    phase: &PhaseTrajectory,
    segment: usize,
    t: f64,
    x: &[f64],
    rate: &mut [f64],
) {
    let &[rx, ry, rz, vx, vy, vz, mass] = x else { return rate.fill(f64::NAN) };
    let (r, v) = ([rx, ry, rz], [vx, vy, vz]);
    let radius = dot(&r, &r).sqrt();
    let mu = injection.mu();
    let mut acceleration = scale(&r, -mu / radius.powi(3));
    let flight = &injection.flight;
    if flight.j2 != 0.0 {
        let size = 1.5 * flight.j2 * mu * flight.body.radius.powi(2) / radius.powi(5);
        let z2 = (rz / radius).powi(2);
        for (i, a) in acceleration.iter_mut().enumerate() {
            *a += size * r[i] * (5.0 * z2 - if i == 2 { 3.0 } else { 1.0 });
        }
    }
    let mut flow = 0.0;
    if is_burn(&phase.name) {
        let engine = injection.engine();
        let thrust = direction(injection, phase, segment, t, &r, &v);
        for i in 0..3 {
            acceleration[i] += engine.thrust / mass * thrust[i];
        }
        flow = engine.mass_flow();
    }
    for (rate, value) in rate.iter_mut().zip(v.into_iter().chain(acceleration).chain([-flow])) {
        *rate = value;
    }
}

fn unit(v: &Vector) -> Vector {
    scale(v, 1.0 / dot(v, v).sqrt())
}

/// Unit vector along the thrust.
fn direction(
    injection: &GeoInjection,
    phase: &PhaseTrajectory,
    segment: usize,
    t: f64,
    r: &Vector,
    v: &Vector,
) -> Vector {
    match injection.steering {
        BurnSteering::Velocity => unit(v),
        BurnSteering::InertialFixed => {
            // The angles follow the states of a coast: longitude, and latitude in space.
            let state = phase.state_at(phase.initial_time);
            let mut angles = state.into_iter().skip(injection.coast_states().len());
            let [longitude, latitude] = [(); 2].map(|()| angles.next().unwrap_or(0.0));
            let ((sin_a, cos_a), (sin_d, cos_d)) = (longitude.sin_cos(), latitude.sin_cos());
            [cos_d * cos_a, cos_d * sin_a, sin_d]
        }
        BurnSteering::Optimal => {
            let mut u = vec![0.0; phase.control.dimension()];
            phase.control.evaluate_in(segment, t, &mut u);
            let mut angles = u.into_iter();
            let [in_plane, out_of_plane] = [(); 2].map(|()| angles.next().unwrap_or(0.0));
            let (radial, normal) = (unit(r), unit(&cross(r, v)));
            let transverse = cross(&normal, &radial);
            let ((sin_a, cos_a), (sin_b, cos_b)) = (in_plane.sin_cos(), out_of_plane.sin_cos());
            std::array::from_fn(|i| {
                sin_a * cos_b * radial[i] + cos_a * cos_b * transverse[i] + sin_b * normal[i]
            })
        }
    }
}

/// Distance from the nearest point of the target orbit, by its longitude, and difference of the velocity to that of the orbit there.
fn misses(injection: &GeoInjection, end: &[f64; 7]) -> [f64; 2] {
    let &[rx, ry, rz, vx, vy, vz, _] = end;
    let (r, v) = ([rx, ry, rz], [vx, vy, vz]);
    let mu = injection.mu();
    let (e, a) = (injection.target_eccentricity, injection.target_semi_major_axis);
    let longitude = ry.atan2(rx);
    // The direction of the perigee is free: that of the orbit reached.
    let momentum = cross(&r, &v);
    let pull = cross(&v, &momentum);
    let radius = dot(&r, &r).sqrt();
    let [apse_x, apse_y, _]: Vector = std::array::from_fn(|i| pull[i] / mu - r[i] / radius);
    let anomaly = if e > 0.0 { longitude - apse_y.atan2(apse_x) } else { 0.0 };
    let p = a * (1.0 - e * e);
    let (sin, cos) = anomaly.sin_cos();
    let target_radius = p / (1.0 + e * cos);
    let (radial, transverse) = ((mu / p).sqrt() * e * sin, (mu / p).sqrt() * (1.0 + e * cos));
    let (outward, forward) =
        ([longitude.cos(), longitude.sin(), 0.0], [-longitude.sin(), longitude.cos(), 0.0]);
    let distance = |found: &Vector, expected: Vector| {
        let d: Vector = std::array::from_fn(|i| found[i] - expected[i]);
        dot(&d, &d).sqrt()
    };
    [
        distance(&r, scale(&outward, target_radius)),
        distance(&v, std::array::from_fn(|i| radial * outward[i] + transverse * forward[i])),
    ]
}

/// A value with its place.
#[derive(Clone, Debug)]
pub(super) struct Extreme {
    pub(super) value: f64,
    pub(super) place: String,
}

/// Extremes of the switching function: the change of the Hamiltonian of the minimised objective with the throttle, in the direction that
/// makes it least, per mass flow.
///
/// It is in kg of final mass lost per kg burnt then: not above zero on a burn, not below on a coast. With oblateness the first and the
/// last burn are left out.
#[derive(Clone, Debug)]
pub(super) struct Switching {
    /// Largest value on a burn.
    pub(super) burns: Option<Extreme>,
    /// Smallest value on a coast.
    pub(super) coasts: Option<Extreme>,
}

/// Samples in each interval of the control polynomial.
const SAMPLES: usize = 8;

impl Switching {
    /// None without costates, and where the direction of the thrust is not free.
    pub(super) fn of(injection: &GeoInjection, trajectory: &Trajectory) -> Option<Self> {
        if injection.steering != BurnSteering::Optimal {
            return None;
        }
        let n = injection.coast_states().len();
        let (mut burns, mut coasts): (Option<Extreme>, Option<Extreme>) = (None, None);
        let (mut x, mut lambda) = (vec![0.0; n], vec![0.0; n]);
        let last = trajectory.phases.len() - 1;
        for (number, phase) in trajectory.phases.iter().enumerate() {
            let costate = phase.costate.as_ref()?;
            // With oblateness a circle is one for an instant: where the flight begins and ends on one, waiting is worth something.
            if injection.flight.j2 != 0.0 && (number == 0 || number == last) {
                continue;
            }
            let burns_here = is_burn(&phase.name);
            for times in phase.state.breaks().windows(2) {
                for k in 0..=SAMPLES {
                    let t = times[0] + (times[1] - times[0]) * k as f64 / SAMPLES as f64;
                    phase.state.evaluate(t, &mut x);
                    costate.evaluate(t, &mut lambda);
                    let value = injection.switching_function(&x, &lambda);
                    let extreme = if burns_here { &mut burns } else { &mut coasts };
                    let worse = extreme.as_ref().is_none_or(|e| {
                        value.is_nan() || if burns_here { value > e.value } else { value < e.value }
                    });
                    if worse {
                        *extreme = Some(Extreme { value, place: format!("{}, {t:.3} s", phase.name) });
                    }
                }
            }
        }
        Some(Self { burns, coasts })
    }
}
