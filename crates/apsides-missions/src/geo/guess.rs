//! The start: the orbits of the impulsive transfer, with burns of equal times at perigee and ignitions that are symmetric to the apses.

use std::f64::consts::{PI, TAU};

use apsides_dynamics::elements::Equinoctial;
use apsides_dynamics::impulsive::{ApsidalOrbit, ImpulsiveTransfer};
use apsides_ocp::{Guess, Ocp, OcpError, PhaseGuess};
use apsides_pipeline::Error;

use super::coast::Conic;
use super::injection::{BurnSteering, GeoInjection};

/// Points of a guessed coast, equally spaced in eccentric longitude.
const COAST_POINTS: usize = 60;
/// Steps of a guessed burn.
const BURN_STEPS: usize = 20;
/// Part of the propellant that the guess burns at most.
const MOST_PROPELLANT: f64 = 0.98;

/// One burn of the guess.
struct Burn {
    /// Orbits and masses at both ends.
    orbits: [ApsidalOrbit; 2],
    masses: [f64; 2],
    longitudes: [f64; 2],
    duration: f64,
    /// Angles of the thrust in and out of the orbital plane.
    angles: [f64; 2],
    /// Longitude and latitude of the thrust in inertial space.
    inertial: [f64; 2],
    /// Costates of `[p, f, h, m]` at both ends of a burn before the second impulse.
    costates: Option<[[f64; 4]; 2]>,
}

/// The guess of a flight.
pub(super) struct ImpulsiveGuess<'a> {
    injection: &'a GeoInjection,
    burns: Vec<Burn>,
    /// Angle by which the apses are turned so that the first longitude is zero.
    turn: f64,
}

impl<'a> ImpulsiveGuess<'a> {
    /// # Errors
    /// When the orbits of the injection are none.
    pub(super) fn of(injection: &'a GeoInjection) -> Result<Self, Error> {
        let transfer = injection.impulsive_transfer()?;
        let engine = injection.engine();
        let mu = injection.mu();
        let mut burns = Vec::new();
        let (mut mass, mut apsis) =
            (injection.initial_mass, if injection.starts_at_apogee() { PI } else { 0.0 });
        let at_once = injection.burns() == 1 && !injection.starts_at_apogee();
        let groups: Vec<usize> = if at_once {
            vec![1]
        } else {
            injection.pattern.chunk_by(|a, b| a == b).map(<[_]>::len).collect()
        };
        for (group, (&count, impulse)) in groups.iter().zip(&transfer.impulses).enumerate() {
            let size = impulse.size();
            let (first, last) = (mass, engine.mass_after(mass, size));
            for k in 0..count {
                // Equal burn times burn equal masses; the parts of the impulse follow from the rocket equation.
                let at = |k: usize| {
                    let mass = first + (last - first) * k as f64 / count as f64;
                    (mass, engine.velocity_change(first, mass) / size)
                };
                let ((from, begin), (to, end)) = (at(k), at(k + 1));
                let duration = (from - to) / engine.mass_flow();
                let middle = 0.5 * (begin + end);
                let half = 0.5 * duration * impulse.speed(middle) / impulse.radius;
                let (latitude, angles) = impulse.angles(middle);
                let backwards = angles[0];
                let costates = [(from, begin), (to, end)]
                    .map(|(mass, part)| transfer.costates(part, mass, engine.exhaust_velocity));
                burns.push(Burn {
                    orbits: [impulse.orbit(mu, begin), impulse.orbit(mu, end)],
                    masses: [from, to],
                    longitudes: [apsis - half, apsis + half],
                    duration,
                    angles,
                    inertial: [apsis + 0.5 * PI + backwards, latitude],
                    costates: (group == 0).then_some(costates),
                });
                apsis += if k + 1 < count { TAU } else { PI };
            }
            mass = last;
        }
        if at_once {
            burns = burns.iter().take(1).map(|first| Self::single(injection, &transfer, first)).collect();
        }
        let turn = match burns.first() {
            Some(first) if !injection.is_spatial() && injection.parking_eccentricity == 0.0 => {
                -first.longitudes[0]
            }
            _ => 0.0,
        };
        Ok(Self { injection, burns, turn })
    }

    /// One burn all the way: from the parking orbit to the target at the mean of both angular rates.
    fn single(injection: &GeoInjection, transfer: &ImpulsiveTransfer, first: &Burn) -> Burn {
        let engine = injection.engine();
        let arrival =
            transfer.impulses.last().map_or(first.orbits[1], |last| last.orbit(injection.mu(), 1.0));
        let mass = injection.initial_mass;
        let burnt = mass - engine.mass_after(mass, 1.2 * transfer.velocity_change());
        let burnt = burnt.min(MOST_PROPELLANT * injection.propellant);
        let duration = burnt / engine.mass_flow();
        let rate = |radius: f64| (injection.mu() / radius.powi(3)).sqrt();
        let angle =
            0.5 * duration * (rate(injection.parking_radius) + rate(injection.target_semi_major_axis));
        Burn {
            orbits: [first.orbits[0], arrival],
            masses: [mass, mass - burnt],
            longitudes: [0.0, angle],
            duration,
            ..*first
        }
    }

    /// Guess of the problem with the burns alone.
    pub(super) fn reduced(&self, ocp: &Ocp) -> Result<Guess, OcpError> {
        let phases = self.burns.iter().map(|burn| self.burn_guess(burn, 0.0)).collect::<Result<_, _>>()?;
        Ok(Guess::from_phases(ocp, phases))
    }

    /// Guess of the problem with burns and coasts.
    pub(super) fn whole(&self, ocp: &Ocp) -> Result<Guess, OcpError> {
        let mut phases = Vec::new();
        for (k, burn) in self.burns.iter().enumerate() {
            let begin = self.ignition(k);
            phases.push(self.burn_guess(burn, begin)?);
            if k + 1 < self.burns.len() {
                phases.push(self.coast_guess(k, begin + burn.duration)?);
            }
        }
        Ok(Guess::from_phases(ocp, phases))
    }

    /// Costates at both ends of each burn: along a coast they are constant, and after the first impulse they follow from their equation
    /// along the guessed burns.
    pub(super) fn costates(&self) -> Vec<[Vec<f64>; 2]> {
        let (sin, cos) = self.turn.sin_cos();
        let of = |[p, f, h, m]: [f64; 4]| {
            let mut row = vec![p, f * cos, f * sin];
            if self.injection.is_spatial() {
                // By symmetry nothing changes with the second component.
                row.extend([h, 0.0]);
            }
            row.extend([0.0, m]);
            row
        };
        let mut rows: Vec<[Vec<f64>; 2]> = Vec::new();
        for burn in &self.burns {
            let ends = match (burn.costates, rows.last()) {
                (Some(ends), _) => ends.map(of),
                (None, Some([_, begin])) => [begin.clone(), self.carried(burn, begin.clone())],
                (None, None) => continue,
            };
            rows.push(ends);
        }
        let fixed = self.injection.steering == BurnSteering::InertialFixed;
        let angles = if !fixed {
            0
        } else if self.injection.is_spatial() {
            2
        } else {
            1
        };
        for row in rows.iter_mut().flatten() {
            row.extend(vec![0.0; angles]);
        }
        rows
    }

    /// Costates at the end of a burn from those at its start, along the guessed states (classical Runge-Kutta steps); that of the
    /// longitude is zero on a coast.
    fn carried(&self, burn: &Burn, begin: Vec<f64>) -> Vec<f64> {
        let first = self.state(&burn.orbits[0], burn.longitudes[0] + self.turn, burn.masses[0]);
        let flown = self.flown(burn, first);
        let step = 2.0 * burn.duration / (flown.len() - 1) as f64;
        let rate =
            |x: &[f64], lambda: &[f64]| self.injection.costate_rate(x, lambda, self.thrust_angles(burn, x));
        let mut lambda = begin;
        for x in flown.windows(3).step_by(2) {
            let k1 = rate(&x[0], &lambda);
            let k2 = rate(&x[1], &moved(&lambda, &k1, 0.5 * step));
            let k3 = rate(&x[1], &moved(&lambda, &k2, 0.5 * step));
            let k4 = rate(&x[2], &moved(&lambda, &k3, step));
            lambda = moved(&lambda, &mean_slope([k1, k2, k3, k4]), step);
        }
        lambda[self.injection.longitude_index()] = 0.0;
        lambda
    }

    /// Time from the first ignition to the last cut-off, s.
    pub(super) fn flight_time(&self) -> f64 {
        self.burns.last().map_or(0.0, |last| self.ignition(self.burns.len() - 1) + last.duration)
    }

    /// Time of an ignition since the first one, s.
    fn ignition(&self, burn: usize) -> f64 {
        (0..burn).map(|k| self.burns[k].duration + self.coast_time(k)).sum()
    }

    fn conic(&self, orbit: &ApsidalOrbit) -> Conic<f64> {
        let (sin, cos) = self.turn.sin_cos();
        Conic::new(orbit.p, orbit.f * cos, orbit.f * sin)
    }

    fn coast_time(&self, k: usize) -> f64 {
        let (from, to) = self.coast_longitudes(k);
        self.conic(&self.burns[k].orbits[1]).time(self.injection.mu(), from, to)
    }

    fn coast_longitudes(&self, k: usize) -> (f64, f64) {
        (self.burns[k].longitudes[1] + self.turn, self.burns[k + 1].longitudes[0] + self.turn)
    }

    fn state(&self, orbit: &ApsidalOrbit, longitude: f64, mass: f64) -> Vec<f64> {
        let (sin, cos) = self.turn.sin_cos();
        let mut state = vec![orbit.p, orbit.f * cos, orbit.f * sin];
        if self.injection.is_spatial() {
            state.extend([orbit.h, 0.0]);
        }
        state.extend([longitude, mass]);
        state
    }

    /// A burn along the velocity, or against it, from the orbit of the impulses before it.
    fn burn_guess(&self, burn: &Burn, begin: f64) -> Result<PhaseGuess, OcpError> {
        let [longitude, latitude] = burn.inertial;
        let spatial = self.injection.is_spatial();
        let first = self.state(&burn.orbits[0], burn.longitudes[0] + self.turn, burn.masses[0]);
        let mut flown = self.flown(burn, first);
        if self.injection.steering == BurnSteering::InertialFixed {
            for state in &mut flown {
                state.push(longitude + self.turn);
                state.extend(spatial.then_some(latitude));
            }
        }
        let control = |state: &Vec<f64>| match (self.injection.steering, spatial) {
            (BurnSteering::Optimal, true) => self.thrust_angles(burn, state).to_vec(),
            (BurnSteering::Optimal, false) => vec![self.thrust_angles(burn, state)[0]],
            _ => Vec::new(),
        };
        let controls = flown.iter().map(control).collect();
        let times: Vec<f64> =
            (0..flown.len()).map(|i| begin + burn.duration * i as f64 / (flown.len() - 1) as f64).collect();
        PhaseGuess::samples(&times, flown, controls)
    }

    /// Angles of the thrust along the velocity, turned as the impulse is.
    fn thrust_angles(&self, burn: &Burn, state: &[f64]) -> [f64; 2] {
        let Equinoctial { f, g, true_longitude, .. } = self.injection.elements(state);
        let (sin, cos) = true_longitude.sin_cos();
        let (climb, forward) = (f * sin - g * cos, 1.0 + f * cos + g * sin);
        let [in_plane, out_of_plane] = burn.angles;
        [in_plane + climb.atan2(forward), out_of_plane]
    }

    /// States of a burn at equal steps of time (classical Runge-Kutta steps), or straight lines where they leave ellipses.
    fn flown(&self, burn: &Burn, first: Vec<f64>) -> Vec<Vec<f64>> {
        let step = burn.duration / BURN_STEPS as f64;
        let rate = |x: &[f64]| self.injection.rate_with_thrust(x, self.thrust_angles(burn, x));
        let mut flown = vec![first];
        for i in 0..BURN_STEPS {
            let x = &flown[i];
            let k1 = rate(x);
            let k2 = rate(&moved(x, &k1, 0.5 * step));
            let k3 = rate(&moved(x, &k2, 0.5 * step));
            let k4 = rate(&moved(x, &k3, step));
            flown.push(moved(x, &mean_slope([k1, k2, k3, k4]), step));
        }
        let is_orbit = |state: &Vec<f64>| {
            let Equinoctial { semi_latus_rectum, f, g, .. } = self.injection.elements(state);
            Conic::new(semi_latus_rectum, f, g).is_ellipse()
        };
        if flown.iter().all(is_orbit) && self.injection.burns() > 1 {
            return flown;
        }
        let last = self.state(&burn.orbits[1], burn.longitudes[1] + self.turn, burn.masses[1]);
        vec![flown.swap_remove(0), last]
    }

    fn coast_guess(&self, k: usize, begin: f64) -> Result<PhaseGuess, OcpError> {
        let burn = &self.burns[k];
        let conic = self.conic(&burn.orbits[1]);
        let (from, to) = self.coast_longitudes(k);
        let [first, last] = [from, to].map(|l| conic.eccentric_longitude(l));
        let rate = conic.time_per_radian(self.injection.mu());
        let (mut times, mut states) = (Vec::new(), Vec::new());
        for i in 0..=COAST_POINTS {
            let eccentric = first + (last - first) * i as f64 / COAST_POINTS as f64;
            times.push(begin + (conic.mean_longitude(eccentric) - conic.mean_longitude(first)) * rate);
            states.push(self.state(&burn.orbits[1], conic.true_longitude(eccentric), burn.masses[1]));
        }
        PhaseGuess::samples(&times, states, vec![vec![]; COAST_POINTS + 1])
    }
}

fn moved(x: &[f64], slope: &[f64], h: f64) -> Vec<f64> {
    x.iter().zip(slope).map(|(x, k)| x + h * k).collect()
}

/// The mean of the four slopes of a classical Runge-Kutta step.
fn mean_slope(k: [Vec<f64>; 4]) -> Vec<f64> {
    (0..k[0].len()).map(|j| (k[0][j] + 2.0 * (k[1][j] + k[2][j]) + k[3][j]) / 6.0).collect()
}
