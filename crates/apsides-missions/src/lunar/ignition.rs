//! The state at the first ignition, and what no flight from there can mend.

use std::f64::consts::TAU;

use apsides_dynamics::Hohmann;
use apsides_pipeline::Error;

use super::lander::LunarLander;
use crate::Refuse;

/// Times in which an engine may burn all propellant, s: a landing is neither an impulse nor a spiral of days.
const SHORTEST_BURN_S: f64 = 2.0;
const LONGEST_BURN_S: f64 = 1e6;

/// A lander at its first ignition, in horizontal flight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ignition {
    pub(super) lander: LunarLander,
    /// Distance from the centre of the body, m.
    pub(super) radius: f64,
    /// Speed along the local horizontal, m/s.
    pub(super) horizontal_speed: f64,
    /// Mass, kg.
    pub(super) mass: f64,
}

impl Ignition {
    /// Ignition on the parking orbit.
    pub(super) fn in_orbit(lander: &LunarLander, refuse: Refuse<'_>) -> Result<Self, Error> {
        lander.check_steering(refuse)?;
        let body = lander.flight.body;
        let ignition = Self {
            lander: *lander,
            radius: body.radius + lander.orbit_altitude,
            horizontal_speed: body.circular_speed(lander.orbit_altitude).map_err(Error::model)?,
            mass: lander.initial_mass,
        };
        ignition.check(refuse)?;
        Ok(ignition)
    }

    /// Ignition at the end of a Hohmann transfer from the parking orbit down to an altitude (m), which `key` states.
    pub(super) fn at_perilune(
        lander: &LunarLander,
        altitude: f64,
        key: &str,
        refuse: Refuse<'_>,
    ) -> Result<Self, Error> {
        Ok(Self::in_orbit(lander, refuse)?.after_transfer(altitude, key, refuse)?.1)
    }

    /// The Hohmann transfer from this circular orbit down to an altitude (m), which `key` states, and the state at its end after an
    /// impulse at its beginning.
    pub(super) fn after_transfer(
        self,
        altitude: f64,
        key: &str,
        refuse: Refuse<'_>,
    ) -> Result<(Hohmann, Self), Error> {
        let orbit = self.lander.orbit_altitude;
        if altitude >= orbit {
            return Err(refuse(format!(
                "`{key}` is {}, it must be below the parking orbit (`orbit_altitude_km` = {})",
                altitude / 1e3,
                orbit / 1e3
            )));
        }
        let flight = self.lander.flight;
        let radius = self.body_radius() + altitude;
        let transfer = Hohmann::new(&flight.body, self.radius, radius).map_err(Error::model)?;
        let ignition = Self {
            radius,
            horizontal_speed: transfer.arrival_speed,
            mass: flight.engine.mass_after(self.mass, transfer.departure_impulse),
            ..self
        };
        ignition.check(refuse)?;
        Ok((transfer, ignition))
    }

    /// The same after an impulse (m/s) against the motion.
    pub(super) fn after_impulse(self, impulse: f64, refuse: Refuse<'_>) -> Result<Self, Error> {
        if impulse >= self.horizontal_speed {
            return Err(refuse(format!(
                "`departure_impulse_m_s` is {impulse}, it must be below the speed at the perilune, {:.1} m/s",
                self.horizontal_speed
            )));
        }
        let ignition = Self {
            horizontal_speed: self.horizontal_speed - impulse,
            mass: self.lander.flight.engine.mass_after(self.mass, impulse),
            ..self
        };
        ignition.check(refuse)?;
        Ok(ignition)
    }

    /// Refuses what no flight can mend: too little thrust even when empty, too little propellant even without losses.
    fn check(&self, refuse: Refuse<'_>) -> Result<(), Error> {
        let dry_mass = self.lander.dry_mass;
        if dry_mass >= self.mass {
            return Err(refuse(format!(
                "`dry_mass_kg` is {dry_mass}, it must be below the mass at ignition, {:.3} kg",
                self.mass
            )));
        }
        let engine = self.lander.flight.engine;
        let weight = dry_mass * self.lander.flight.body.surface_gravity();
        if engine.thrust <= weight {
            return Err(refuse(format!(
                "`thrust_n` is {}, it cannot stop the vehicle: even empty (`dry_mass_kg` = {dry_mass}) it weighs {weight:.1} N \
                 on the surface; raise the thrust or reduce the dry mass",
                engine.thrust
            )));
        }
        let burn = self.burn_time();
        if !(SHORTEST_BURN_S..=LONGEST_BURN_S).contains(&burn) {
            let change = if burn < SHORTEST_BURN_S { "reduce" } else { "raise" };
            return Err(refuse(format!(
                "`thrust_n` is {:e}, it burns the propellant in {burn:.3e} s; this must be {SHORTEST_BURN_S} to {LONGEST_BURN_S:e} s: \
                 {change} the thrust",
                engine.thrust
            )));
        }
        let available = engine.velocity_change(self.mass, dry_mass);
        if available <= self.horizontal_speed {
            return Err(refuse(format!(
                "the propellant gives {available:.1} m/s down to `dry_mass_kg` = {dry_mass}, but {:.1} m/s must be braked; \
                 raise `isp_s` or `initial_mass_kg` or reduce `dry_mass_kg`",
                self.horizontal_speed
            )));
        }
        Ok(())
    }

    /// Time to burn all propellant, s.
    fn burn_time(&self) -> f64 {
        (self.mass - self.lander.dry_mass) / self.lander.flight.engine.mass_flow()
    }

    /// Time to burn the whole mass, s: above any burn, so that the dry mass alone limits the propellant.
    pub(super) fn longest_burn(&self) -> f64 {
        self.mass / self.lander.flight.engine.mass_flow()
    }

    /// Period of the circular orbit through the point of ignition, s: above any coast of less than a revolution.
    pub(super) fn longest_coast(&self) -> f64 {
        TAU * (self.radius.powi(3) / self.lander.flight.body.gravitational_parameter).sqrt()
    }

    /// Expected time of the braking, s: the rocket equation with a tenth of losses, at most nine tenths of the burn time.
    pub(super) fn expected_time(&self) -> f64 {
        let engine = self.lander.flight.engine;
        let burnt = self.mass - engine.mass_after(self.mass, 1.1 * self.horizontal_speed);
        (burnt / engine.mass_flow()).min(0.9 * self.burn_time())
    }

    /// Radius of the surface, m.
    pub(super) fn body_radius(&self) -> f64 {
        self.lander.flight.body.radius
    }
}
