//! The table of a flight: one column, one unit, one meaning across all phases.

use std::ops::Range;

use crate::flight::{About, Axes, Flight, Point, Span};
use crate::frames::{Frames, Plane, Topocentric};
use crate::iau::CentralBody;
use crate::orientation::turned_quaternion;
use crate::quantity::Column;
use crate::sampling::Sampling;
use crate::{EphemerisError, Epoch};

/// The settings of an ephemeris that a mission states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placing {
    /// Time zero of the mission.
    pub epoch: Epoch,
    /// The mission's inertial axes.
    pub plane: Plane,
}

/// The rows of a phase: their place among all rows.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseRows {
    /// Name of the phase.
    pub name: String,
    /// First row, and the one after the last.
    pub rows: Range<usize>,
    /// The rows of its parts along which nothing jumps, in order: at a jump of a control stand a row of before and one of after it.
    pub arcs: Vec<Range<usize>>,
}

/// Position and velocity about the body of a row, in axes of the ICRF and fixed to the body; m and m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedState {
    /// Position in axes of the ICRF.
    pub position: [f64; 3],
    /// Velocity in axes of the ICRF.
    pub velocity: [f64; 3],
    /// Position in axes fixed to the body.
    pub fixed_position: [f64; 3],
    /// Velocity relative to the body, in axes fixed to it.
    pub fixed_velocity: [f64; 3],
    /// Mass, kg, where it is known.
    pub mass: Option<f64>,
    /// Unit quaternion, scalar first, that turns vectors from the axes of the vehicle to those of the ICRF; none of a point.
    pub attitude: Option<[f64; 4]>,
}

/// An ephemeris: the states of a flight at times, by columns, and about its body where it has one.
#[derive(Clone, Debug, PartialEq)]
pub struct Ephemeris {
    /// Name of the mission.
    pub name: String,
    /// Time zero.
    pub epoch: Epoch,
    /// The body, if the flight has a place.
    pub body: Option<CentralBody>,
    /// The phases.
    pub phases: Vec<PhaseRows>,
    /// Times of the rows, s.
    pub times: Vec<f64>,
    /// Every column but the time, with its values.
    pub columns: Vec<(Column, Vec<f64>)>,
    /// Positions and velocities of the rows; empty without a place.
    pub states: Vec<PlacedState>,
}

/// Columns of a place about a body, before the loads.
const PLACED: [(&str, &str); 32] = [
    ("position icrf x", "m"),
    ("position icrf y", "m"),
    ("position icrf z", "m"),
    ("velocity icrf x", "m/s"),
    ("velocity icrf y", "m/s"),
    ("velocity icrf z", "m/s"),
    ("position fixed x", "m"),
    ("position fixed y", "m"),
    ("position fixed z", "m"),
    ("velocity fixed x", "m/s"),
    ("velocity fixed y", "m/s"),
    ("velocity fixed z", "m/s"),
    ("longitude", "deg"),
    ("latitude", "deg"),
    ("altitude", "m"),
    ("speed", "m/s"),
    ("flight path angle", "deg"),
    ("course", "deg"),
    ("ground speed", "m/s"),
    ("ground path angle", "deg"),
    ("ground course", "deg"),
    ("mass", "kg"),
    ("delta-v", "m/s"),
    ("thrust", "N"),
    ("thrust icrf x", "N"),
    ("thrust icrf y", "N"),
    ("thrust icrf z", "N"),
    ("thrust up", "N"),
    ("thrust east", "N"),
    ("thrust north", "N"),
    ("thrust acceleration", "m/s2"),
    ("thrust to weight", "-"),
];
/// Columns of a site.
const OF_SITE: [(&str, &str); 3] = [("east of site", "m"), ("north of site", "m"), ("above site", "m")];

/// A body and the axes of a flight about it.
struct Placed {
    about: About,
    frames: Frames,
    site: Option<Topocentric>,
}

impl Ephemeris {
    /// The rows of a flight of the mission `name`.
    ///
    /// # Errors
    /// [`EphemerisError::NotFinite`] where a position or a velocity is no number.
    pub fn of(
        name: &str,
        flight: &dyn Flight,
        placing: &Placing,
        sampling: Sampling,
    ) -> Result<Self, EphemerisError> {
        let spans = flight.spans();
        let placed = flight.about().and_then(|about| Placed::new(about, placing));
        let of_spans = sampling.times(&spans);
        let count = of_spans.iter().map(Vec::len).sum();
        let mut columns: Vec<(Column, Vec<f64>)> = Vec::new();
        let mut add = |column: Column| {
            // A quantity of a mission's own that is among the common ones stands there.
            let is_new = columns.iter().all(|(known, _)| known.header() != column.header());
            if is_new {
                columns.push((column, Vec::with_capacity(count)));
            }
            is_new
        };
        if let Some(placed) = &placed {
            placed.columns().into_iter().for_each(|column| _ = add(column));
        }
        let kept: Vec<bool> = flight.own().into_iter().map(&mut add).collect();
        let mut table = Self {
            name: name.into(),
            epoch: placing.epoch,
            body: placed.as_ref().map(|p| p.frames.body),
            phases: Vec::new(),
            times: Vec::with_capacity(count),
            columns,
            states: Vec::new(),
        };
        for (index, (span, times)) in spans.iter().zip(of_spans).enumerate() {
            let begin = table.times.len();
            for time in times {
                let instant = flight.at(index, time);
                let mut row = Vec::with_capacity(table.columns.len());
                if let Some(placed) = &placed {
                    let point = instant.point.as_ref();
                    let (state, values) =
                        point.map(|p| placed.row(time, p)).ok_or_else(|| missing(span, time))?;
                    if let Some(quantity) = state.not_finite() {
                        let phase = span.name.clone();
                        return Err(EphemerisError::NotFinite { quantity: quantity.into(), time, phase });
                    }
                    table.states.push(state);
                    row.extend(values);
                }
                row.extend(instant.own.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(v, _)| *v));
                for ((_, values), value) in table.columns.iter_mut().zip(row) {
                    values.push(value);
                }
                table.times.push(time);
            }
            table.add_arc(&span.name, begin..table.times.len());
        }
        if table.body.is_some() {
            table.without_gaps();
        }
        Ok(table)
    }

    fn add_arc(&mut self, phase: &str, rows: Range<usize>) {
        match self.phases.last_mut().filter(|last| last.name == phase) {
            Some(last) => {
                last.rows.end = rows.end;
                last.arcs.push(rows);
            }
            None => self.phases.push(PhaseRows { name: phase.into(), rows: rows.clone(), arcs: vec![rows] }),
        }
    }

    /// Leaves out the quantities that some phases do not have: what they say is in those that all have, or is not known.
    fn without_gaps(&mut self) {
        self.columns.retain(|(_, values)| values.iter().all(|v| v.is_finite()));
    }

    /// The rows of each part along which nothing jumps, with the name of its phase, in order.
    pub(crate) fn arcs(&self) -> impl Iterator<Item = (&str, Range<usize>)> {
        self.phases.iter().flat_map(|p| p.arcs.iter().map(|rows| (p.name.as_str(), rows.clone())))
    }

    /// The instant of a row.
    #[must_use]
    pub fn epoch_of(&self, row: usize) -> Epoch {
        self.epoch.elapsed(self.times.get(row).copied().unwrap_or(f64::NAN))
    }

    /// Header of the instants: the time scale ends it.
    #[must_use]
    pub fn epoch_header(&self) -> String {
        format!("epoch_{}", self.epoch.scale().word().to_lowercase())
    }

    /// The phase of a row.
    #[must_use]
    pub fn phase_of(&self, row: usize) -> &str {
        self.phases.iter().find(|p| p.rows.contains(&row)).map_or("", |p| &p.name)
    }

    /// The values of a column by its header; none where there is no such column.
    #[must_use]
    pub fn column(&self, header: &str) -> Option<&[f64]> {
        self.columns.iter().find(|(column, _)| column.header() == header).map(|(_, values)| &values[..])
    }
}

fn missing(span: &Span, time: f64) -> EphemerisError {
    EphemerisError::NotFinite { quantity: "position".into(), time, phase: span.name.clone() }
}

impl PlacedState {
    fn not_finite(&self) -> Option<&'static str> {
        let finite = |v: &[f64]| v.iter().all(|v| v.is_finite());
        let position = finite(&self.position) && finite(&self.fixed_position);
        let velocity = finite(&self.velocity) && finite(&self.fixed_velocity);
        match (position, velocity, self.mass.is_none_or(f64::is_finite)) {
            (false, ..) => Some("position"),
            (_, false, _) => Some("velocity"),
            (.., false) => Some("mass"),
            _ => None,
        }
    }
}

impl Placed {
    fn new(about: About, placing: &Placing) -> Option<Self> {
        let body = CentralBody::of_gravity(about.gravitational_parameter)?;
        let frames = Frames::new(body, placing.epoch, &placing.plane);
        let site = about.site.map(|s| Topocentric::at(&about.surface, s.longitude, s.latitude, s.altitude));
        Some(Self { about, frames, site })
    }

    fn columns(&self) -> Vec<Column> {
        let site: &[(&str, &str)] = if self.site.is_some() { &OF_SITE } else { &[] };
        let common = PLACED.iter().chain(site).map(|(name, unit)| Column::new(*name, *unit));
        common.chain(self.about.loads.iter().cloned()).collect()
    }

    /// State and values of the columns of a point at a time of the mission.
    fn row(&self, time: f64, point: &Point) -> (PlacedState, Vec<f64>) {
        let orientation = self.frames.orientation(time);
        let ((position, velocity), (fixed_position, fixed_velocity), to_icrf): (
            _,
            _,
            &dyn Fn([f64; 3]) -> [f64; 3],
        ) = match self.about.axes {
            Axes::Fixed => {
                let fixed = (point.position, point.velocity);
                let inertial = orientation.to_icrf(point.position, point.velocity);
                (inertial, fixed, &|v| orientation.vector_to_icrf(v))
            }
            Axes::Inertial => {
                let inertial = (
                    self.frames.inertial_to_icrf(point.position),
                    self.frames.inertial_to_icrf(point.velocity),
                );
                let fixed = orientation.to_fixed(inertial.0, inertial.1);
                (inertial, fixed, &|v| self.frames.inertial_to_icrf(v))
            }
        };
        // What is not known has no number, and no column then.
        let unknown = f64::NAN;
        let (mass, delta_v) = (point.mass.unwrap_or(unknown), point.delta_v.unwrap_or(unknown));
        let thrust = to_icrf(point.thrust.unwrap_or([unknown; 3]));
        let attitude = point.attitude.map(|q| turned_quaternion(q, to_icrf));
        let at = self.about.surface.geodetic(&fixed_position);
        let local = [at.up, at.east, at.north];
        let along = |v: [f64; 3]| local.map(|axis| dot(axis, v));
        // Angles in inertial space count from the same local horizontal, at the instant.
        let [inertial, ground, push] =
            [orientation.vector_to_fixed(velocity), fixed_velocity, orientation.vector_to_fixed(thrust)]
                .map(along);
        let (size, weight) = (norm(thrust), self.weight(&position, mass));
        let state =
            PlacedState { position, velocity, fixed_position, fixed_velocity, mass: point.mass, attitude };
        let longitude = fixed_position[1].atan2(fixed_position[0]);
        let latitude = at.up[2].clamp(-1.0, 1.0).asin();
        let mut row = Vec::with_capacity(PLACED.len() + OF_SITE.len() + point.loads.len());
        row.extend([position, velocity, fixed_position, fixed_velocity].as_flattened());
        row.extend([longitude.to_degrees(), latitude.to_degrees(), at.altitude]);
        row.extend(polar(inertial));
        row.extend(polar(ground));
        row.extend([mass, delta_v, size]);
        row.extend([thrust, push].as_flattened());
        row.extend([size / mass, size / weight]);
        row.extend(self.site.iter().flat_map(|site| site.components(fixed_position)));
        row.extend(&point.loads);
        (state, row)
    }

    /// Weight at a position, N.
    fn weight(&self, position: &[f64; 3], mass: f64) -> f64 {
        mass * self.about.gravitational_parameter / dot(*position, *position)
    }
}

/// Size, angle above the horizontal and course from north towards east (deg) of a velocity upwards, to the east and to the north.
fn polar([up, east, north]: [f64; 3]) -> [f64; 3] {
    let across = east.hypot(north);
    let course = east.atan2(north).to_degrees().rem_euclid(360.0);
    [across.hypot(up), up.atan2(across).to_degrees(), course]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(v: [f64; 3]) -> f64 {
    dot(v, v).sqrt()
}

#[cfg(test)]
mod tests;
