//! Vehicle, state at ignition, and what no flight can mend.

use std::f64::consts::TAU;

use apsides_dynamics::planar::PlanarFlight;
use apsides_dynamics::planar::flat::FlatConstantThrust;
use apsides_dynamics::{Body, DynamicsError, Engine, Hohmann};

use crate::key::Values;

/// Vehicle and state at ignition.
#[derive(Clone, Copy)]
pub(super) struct Start {
    pub(super) flight: PlanarFlight,
    pub(super) radius: f64,
    pub(super) horizontal_speed: f64,
    pub(super) mass: f64,
    pub(super) dry_mass: f64,
    pub(super) touchdown_speed: f64,
}

impl Start {
    /// Ignition on the parking orbit.
    pub(super) fn direct(v: &Values) -> Result<Self, String> {
        let body =
            Body::new(v.number("gravitational_parameter_km3_s2") * 1e9, v.number("moon_radius_km") * 1e3)
                .map_err(text)?;
        let exhaust_velocity = v.number("isp_s") * v.number("standard_gravity_m_s2");
        let engine = Engine::with_exhaust_velocity(v.number("thrust_n"), exhaust_velocity).map_err(text)?;
        let altitude = v.number("orbit_altitude_km") * 1e3;
        let start = Self {
            flight: PlanarFlight::new(body, engine),
            radius: body.radius + altitude,
            horizontal_speed: body.circular_speed(altitude).map_err(text)?,
            mass: v.number("initial_mass_kg"),
            dry_mass: v.number("dry_mass_kg"),
            touchdown_speed: v.number("touchdown_radial_velocity_m_s"),
        };
        start.check()?;
        Ok(start)
    }

    /// Ignition at the perilune of a Hohmann transfer from the parking orbit.
    pub(super) fn perilune(v: &Values) -> Result<Self, String> {
        Ok(Self::direct(v)?.after_transfer(v, "perilune_altitude_km")?.1)
    }

    /// The Hohmann transfer from this circular orbit down to the altitude of a key, and the state at its end after an
    /// impulse at its beginning.
    pub(super) fn after_transfer(self, v: &Values, key: &str) -> Result<(Hohmann, Self), String> {
        let (altitude, orbit) = (v.number(key), v.number("orbit_altitude_km"));
        if altitude >= orbit {
            return Err(format!(
                "`{key}` is {altitude}, it must be below the parking orbit (`orbit_altitude_km` = {orbit})"
            ));
        }
        let radius = self.body_radius() + altitude * 1e3;
        let transfer = Hohmann::new(&self.flight.body, self.radius, radius).map_err(text)?;
        let start = Self {
            radius,
            horizontal_speed: transfer.arrival_speed,
            mass: self.flight.engine.mass_after(self.mass, transfer.departure_impulse),
            ..self
        };
        start.check()?;
        Ok((transfer, start))
    }

    /// Full thrust from here on, in flat outputs.
    pub(super) fn flat(&self) -> FlatConstantThrust {
        FlatConstantThrust { flight: self.flight, ignition: 0.0, mass: self.mass }
    }

    /// What no flight can mend: too little thrust even when empty, too little propellant even without losses.
    fn check(&self) -> Result<(), String> {
        if self.dry_mass >= self.mass {
            return Err(format!(
                "`dry_mass_kg` is {}, it must be below the mass at ignition, {:.3} kg",
                self.dry_mass, self.mass
            ));
        }
        let engine = self.flight.engine;
        let weight = self.dry_mass * self.flight.body.surface_gravity();
        if engine.thrust <= weight {
            return Err(format!(
                "`thrust_n` is {}, it cannot stop the vehicle: even empty (`dry_mass_kg` = {}) it weighs {weight:.1} N \
                 on the surface; raise the thrust or reduce the dry mass",
                engine.thrust, self.dry_mass
            ));
        }
        let available = engine.velocity_change(self.mass, self.dry_mass);
        if available <= self.horizontal_speed {
            return Err(format!(
                "the propellant gives {available:.1} m/s down to `dry_mass_kg` = {}, but {:.1} m/s must be braked; \
                 raise `isp_s` or `initial_mass_kg` or reduce `dry_mass_kg`",
                self.dry_mass, self.horizontal_speed
            ));
        }
        Ok(())
    }

    /// Time to burn all propellant, s.
    fn burn_time(&self) -> f64 {
        (self.mass - self.dry_mass) / self.flight.engine.mass_flow()
    }

    /// Time to burn the whole mass, s: above any burn, so that the dry mass alone limits the propellant.
    pub(super) fn longest_burn(&self) -> f64 {
        self.mass / self.flight.engine.mass_flow()
    }

    /// Period of the circular orbit through the point of ignition, s: above any coast of less than a revolution.
    pub(super) fn longest_coast(&self) -> f64 {
        TAU * (self.radius.powi(3) / self.flight.body.gravitational_parameter).sqrt()
    }

    /// Expected time of the braking: the rocket equation with a tenth of losses, at most nine tenths of the burn time.
    pub(super) fn expected_time(&self) -> f64 {
        let engine = self.flight.engine;
        let burnt = self.mass - engine.mass_after(self.mass, 1.1 * self.horizontal_speed);
        (burnt / engine.mass_flow()).min(0.9 * self.burn_time())
    }

    pub(super) fn body_radius(&self) -> f64 {
        self.flight.body.radius
    }
}

fn text(e: DynamicsError) -> String {
    e.to_string()
}
