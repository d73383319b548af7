//! The motion about a body that the file of a problem states.

use apsides_dynamics::{Body, Ellipsoid};
use apsides_ephemeris::{About, Axes, CentralBody, Motion, Point, Site, Topocentric};
use apsides_pipeline::Error;
use apsides_problem_file::PosedMotion;
use apsides_problem_file::model::MotionAxes;
use apsides_problem_file::statement::Statement;

use crate::data::{BODIES, BODY_RADIUS, GRAVITATIONAL_PARAMETER, GRAVITY, RADIUS, RENAMED};

/// The body that a problem names.
///
/// # Errors
/// A name that is not known, and a body that is none of those whose axes are known.
pub(super) fn body_of(statement: &Statement) -> Result<Option<Body>, Error> {
    let (Some(stated), Some(place)) = (statement.motion(), statement.place_of_body()) else {
        return Ok(None);
    };
    let place = place.to_string();
    let keys = [GRAVITY, RADIUS];
    let numbers = BODIES.numbers(&stated.body, &keys, &place, RENAMED)?;
    let number =
        |path: &str| numbers.iter().filter(|(key, ..)| *key == path).map(|(_, v, _)| *v).sum::<f64>();
    let (parameter, radius) = (number(GRAVITATIONAL_PARAMETER), number(BODY_RADIUS));
    let refused = |found: String| Error::Value {
        place: place.clone(),
        key: "motion.body".into(),
        found,
        allowed: "Earth, Moon or Mars, whose axes alone are known".into(),
    };
    let body = Body::new(parameter * 1e9, radius * 1e3)
        .map_err(|e| refused(format!("\"{}\" ({e})", stated.body)))?;
    match CentralBody::of_gravity(body.gravitational_parameter) {
        Some(_) => Ok(Some(body)),
        None => Err(refused(format!("\"{}\"", stated.body))),
    }
}

/// A stated motion with its body.
pub(super) struct StatedFlight<'a> {
    posed: &'a PosedMotion,
    about: About,
    site: Option<Topocentric>,
    parameters: &'a [f64],
}

impl<'a> StatedFlight<'a> {
    pub(super) fn new(posed: &'a PosedMotion, body: &Body, parameters: &'a [f64]) -> Self {
        let surface = Ellipsoid::sphere(body.radius, body.gravitational_parameter, 0.0, 0.0);
        let site = posed.site.map(|[longitude, latitude, altitude]| Site { longitude, latitude, altitude });
        let axes = if posed.axes == MotionAxes::Inertial { Axes::Inertial } else { Axes::Fixed };
        let local = site.map(|s| Topocentric::at(&surface, s.longitude, s.latitude, s.altitude));
        let about = About { axes, site, ..About::sphere(body.radius, body.gravitational_parameter) };
        Self { posed, about, site: local, parameters }
    }
}

impl Motion for StatedFlight<'_> {
    fn about(&self) -> About {
        self.about.clone()
    }

    fn point(&self, phase: usize, time: f64, state: &[f64], control: &[f64]) -> Option<Point> {
        let motion = self.posed.at(phase, [state, control, self.parameters], time)?;
        let turned = |v: [f64; 3]| self.site.map_or(v, |site| site.vector(v));
        Some(Point {
            position: self.site.map_or(motion.position, |site| site.position(motion.position)),
            velocity: turned(motion.velocity),
            thrust: motion.thrust.map(turned),
            mass: motion.mass,
            delta_v: None,
            attitude: None,
            loads: Vec::new(),
        })
    }
}
