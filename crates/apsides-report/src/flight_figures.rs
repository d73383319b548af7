//! Figures of a flight about its body: to scale with the body, over ground, the last kilometre, and what an analyst draws over time.

use apsides_ad::vector::{cross, dot, norm};
use apsides_ephemeris::{Ephemeris, Sampling};
use apsides_pipeline::{Curve, Outcome, Pipeline};

use crate::axis_layout::FLAT;
use crate::figure::{Axis, Figure, Series, Span};

/// The flight on a page, beside what every outcome has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Presentation {
    /// The heading of the page; the kind of the mission where it is empty.
    pub heading: String,
    /// The subject in a few words, with which the page begins.
    pub title: String,
    /// Figures of the flight as a whole: its path about the body and over ground, its end, and those of the mission's own.
    pub paths: Vec<Figure>,
    /// Quantities over time beside the states of the problem: altitude, speeds, path angles, velocity change, thrust, loads.
    pub histories: Vec<Figure>,
}

/// Rows of the flight that figures are drawn from.
const ROWS: u64 = 1200;

impl Presentation {
    /// All that the page of a solved mission shows beside its outcome: its own curves, and its flight about a body. A flight that has no rows,
    /// such as one that did not converge, has its other figures.
    #[must_use]
    pub fn of_mission(title: impl Into<String>, mission: &Pipeline, outcome: &Outcome) -> Self {
        let Outcome { decisions, ocp, trajectory, .. } = outcome;
        let flight = mission.ephemeris(decisions, ocp, trajectory, Sampling::Points(ROWS)).ok();
        Self::new(title, curve_figures(&outcome.curves), flight.as_ref())
    }

    /// The mission's `own` figures, with those that follow from its `flight` about a body, where it has one.
    #[must_use]
    pub fn new(title: impl Into<String>, own: Vec<Figure>, flight: Option<&Ephemeris>) -> Self {
        let path = flight.and_then(Path::of);
        let mut paths: Vec<Figure> = path.iter().flat_map(Path::figures).collect();
        // A figure of the mission's own stands in the place of one with the same axes; a plane without the body says less.
        let labels = |figure: &Figure| [figure.x.label.clone(), figure.y.label.clone()];
        let is_plane = |figure: &Figure| labels(figure) == ["x", "y"];
        let own = own.into_iter().filter(|figure| path.is_none() || !is_plane(figure));
        let (in_time, own): (Vec<Figure>, Vec<Figure>) = own.partition(|figure| figure.x.label == "time");
        let owned: Vec<[String; 2]> = own.iter().map(labels).collect();
        let has_altitude = own.iter().any(|f| f.y.label == "altitude" && f.x.unit.ends_with('m'));
        let is_owned =
            |figure: &Figure| owned.contains(&labels(figure)) || has_altitude && figure.title == PROFILE;
        paths.retain(|figure| !is_owned(figure));
        let shown = own.into_iter().map(with_scale);
        // What the mission draws over time itself is not drawn twice.
        let is_drawn = |history: &Figure| in_time.iter().any(|figure| figure.y.label == history.y.label);
        let mut histories = flight.map(histories).unwrap_or_default();
        histories.retain(|history| !is_drawn(history));
        Self {
            heading: String::new(),
            title: title.into(),
            paths: paths.into_iter().chain(shown).collect(),
            histories: in_time.into_iter().chain(histories).collect(),
        }
    }
}

/// Curves of a mission as figures.
#[must_use]
pub fn curve_figures(curves: &[Curve]) -> Vec<Figure> {
    let axis = |(name, unit): &(String, String)| Axis::new(name.clone(), unit.clone());
    let drawn = |c: &Curve| {
        let empty = Figure::new(c.title.clone(), axis(&c.x), axis(&c.y));
        let line = |(name, points): &(String, Vec<[f64; 2]>)| Series::line(name.clone(), points.clone());
        c.series.iter().map(line).fold(empty, Figure::with)
    };
    curves.iter().map(drawn).collect()
}

/// Lengths, and coordinates without a unit, with one scale where they spread alike; a map with one scale in its middle.
#[must_use]
pub fn with_scale(figure: Figure) -> Figure {
    if figure.x.label == "longitude" && figure.y.label == "latitude" && figure.y.unit == "deg" {
        let ratio = ratio_of_map(figure.series.iter().flat_map(|s| s.points.iter().map(|p| p[1])));
        return figure.to_scale(ratio);
    }
    let spread = |axis: usize| {
        let [low, high] = ends(figure.series.iter().flat_map(|s| s.points.iter().map(move |p| p[axis])));
        high - low
    };
    let is_place = figure.x.unit == figure.y.unit && ["m", "km", "-"].contains(&figure.x.unit.as_str());
    let shape = spread(0) / spread(1);
    if is_place && shape > 1.0 / FLATTEST && shape < FLATTEST { figure.to_scale(1.0) } else { figure }
}

/// Length of a degree of latitude beside one of longitude, in the middle of these latitudes (deg).
fn ratio_of_map(latitudes: impl Iterator<Item = f64>) -> f64 {
    let [south, north] = ends(latitudes);
    1.0 / (0.5 * (south + north)).to_radians().cos().max(LEAST_COSINE)
}

/// Width of a path by its height, or the other way, up to which it is drawn to scale.
const FLATTEST: f64 = 8.0;
const PROFILE: &str = "Altitude over distance on the ground";
/// Altitude as a part of the radius, and angle about the body (rad), from which the whole body is drawn.
const HIGH: f64 = 0.2;
const FAR: f64 = 1.2;
/// Angle about the body that a flight must travel for a plane to be known, rad.
const LEAST_ANGLE: f64 = 1e-4;
/// Depth of the ground that is drawn below its lowest place, as a part of its width.
const STRIP: f64 = 0.03;
/// Height above the end that is drawn to scale, m.
const LAST: f64 = 1000.0;
/// Change of longitude or latitude from which there is a track, deg.
const LEAST_TRACK: f64 = 1e-3;
/// Least factor of longitudes on a map: beyond 84 degrees of latitude a map of degrees is none.
const LEAST_COSINE: f64 = 0.1;
/// Thrust of an engine that is off, as a part of the largest.
const OFF: f64 = 1e-6;
/// Points of a circle or an orbit.
const CIRCLE: usize = 360;

/// The path of a flight about its body.
struct Path<'a> {
    table: &'a Ephemeris,
    /// Radius of the body where the flight begins, m.
    radius: f64,
    /// True of a flight that is drawn with the whole body, not with the ground below it.
    whole: bool,
    /// Positions in inertial axes where the whole body is drawn, else in axes fixed to the body, m.
    places: Vec<[f64; 3]>,
    /// Axes of the plane of the flight: along the middle of the path, and 90 degrees ahead.
    axes: [[f64; 3]; 2],
}

impl<'a> Path<'a> {
    fn of(table: &'a Ephemeris) -> Option<Self> {
        let first = table.states.first()?.position;
        let radius = radius_at_start(table)?;
        let inertial: Vec<[f64; 3]> = table.states.iter().map(|s| s.position).collect();
        let whole = travelled(&inertial) > FAR || !is_near_ground(table);
        // The ground below a flight stands still.
        let fixed = || table.states.iter().map(|s| s.fixed_position).collect();
        let places = if whole { inertial } else { fixed() };
        let (units, angle) = (places.iter().map(|r| unit(*r)).collect::<Vec<_>>(), travelled(&places));
        let normal = (table.states.iter())
            .map(|s| match whole {
                true => cross(&s.position, &s.velocity),
                false => cross(&s.fixed_position, &s.fixed_velocity),
            })
            .fold([0.0; 3], |sum, n| [0, 1, 2].map(|k| sum[k] + n[k]));
        let up = if whole { unit(first) } else { middle(&units, angle)? };
        let ahead = unit(cross(&normal, &up));
        let is_known = radius > 0.0 && angle > LEAST_ANGLE && ahead.iter().chain(&up).all(|c| c.is_finite());
        is_known.then_some(Self { table, radius, whole, places, axes: [up, ahead] })
    }

    fn figures(&self) -> Vec<Figure> {
        [self.view(), self.track(), self.profile(), self.end()].into_iter().flatten().collect()
    }

    /// A vector in the plane of the flight: ahead, and up.
    fn flat(&self, v: [f64; 3]) -> [f64; 2] {
        let [up, ahead] = self.axes;
        if self.whole { [dot(&v, &up), dot(&v, &ahead)] } else { [dot(&v, &ahead), dot(&v, &up)] }
    }

    /// The flight in its plane, to scale: with the whole body and the orbits of its ends, or with the ground below it.
    fn view(&self) -> Option<Figure> {
        let mut places: Vec<[f64; 2]> = self.places.iter().map(|r| self.flat(*r)).collect();
        let axis = |label: &str| Axis::new(label, "m");
        let figure = if self.whole {
            let title = "Flight in its plane, to scale with the body";
            let mut figure = Figure::new(title, axis("x"), axis("y"));
            figure = figure.with(Series::body("body", circle(self.radius, [0.0, std::f64::consts::TAU])));
            for (label, state) in [
                ("orbit of the start", self.table.states.first()),
                ("orbit of the end", self.table.states.last()),
            ] {
                let state = state?;
                let orbit = self.orbit(state.position, state.velocity);
                figure = figure.with(Series::bound(label, orbit.unwrap_or_default()));
            }
            figure
        } else {
            let title = "Flight over the curved ground, to scale";
            let figure = Figure::new(
                title,
                axis("across the middle of the path"),
                axis("up, from the ground in the middle"),
            );
            // Heights count from the ground, not from the centre of the body.
            places.iter_mut().for_each(|[_, y]| *y -= self.radius);
            figure.with(Series::body("ground", self.ground(&places)))
        };
        let figure = self.by_thrust(places).into_iter().fold(figure, Figure::with);
        Some(figure.to_scale(1.0))
    }

    /// The outline of the ground below places whose heights count from it: its arc, and a strip below that.
    fn ground(&self, places: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let angles = places.iter().map(|[x, y]| (y + self.radius).atan2(*x));
        let mut outline = circle(self.radius, ends(angles));
        outline.iter_mut().for_each(|[_, y]| *y -= self.radius);
        let [low, _] = ends(outline.iter().map(|p| p[1]));
        let [left, right] = ends(outline.iter().map(|p| p[0]));
        let bottom = low - STRIP * (right - left);
        // The arc ends on the left.
        outline.extend([[left, bottom], [right, bottom]]);
        outline
    }

    /// The points of a path, as far as the engine burns and as far as it does not.
    fn by_thrust(&self, points: Vec<[f64; 2]>) -> Vec<Series> {
        let thrust = self.table.column("thrust_N").unwrap_or_default();
        let largest = thrust.iter().copied().fold(0.0, f64::max);
        if largest <= 0.0 {
            return vec![Series::line("flight", points).colored(0)];
        }
        let burns: Vec<bool> = thrust.iter().map(|f| *f > OFF * largest).collect();
        let part = |burning: bool| {
            let mut line = Vec::with_capacity(points.len());
            for (k, point) in points.iter().enumerate() {
                let is_of = |k: usize| burns.get(k) == Some(&burning);
                // A point where the engine changes belongs to both.
                let touches = is_of(k) || (k > 0 && is_of(k - 1)) || is_of(k + 1);
                line.push(if touches { *point } else { [f64::NAN; 2] });
            }
            line
        };
        let mut series = Vec::new();
        if burns.iter().any(|burning| !burning) {
            series.push(Series::line("coast", part(false)).colored(0));
        }
        series.push(Series::line("thrust", part(true)).colored(1));
        series
    }

    /// The orbit of a state by Kepler's laws, in the plane of the flight; none where it is not closed or hits the ground deeply.
    fn orbit(&self, position: [f64; 3], velocity: [f64; 3]) -> Option<Vec<[f64; 2]>> {
        let mu = self.table.body?.gravitational_parameter();
        let momentum = cross(&position, &velocity);
        let eccentricity = {
            let (turned, up) = (cross(&velocity, &momentum), unit(position));
            [0, 1, 2].map(|k| turned[k] / mu - up[k])
        };
        let parameter = dot(&momentum, &momentum) / mu;
        let e = norm(&eccentricity, 0.0);
        let perigee = parameter / (1.0 + e);
        if e >= 1.0 || perigee < 0.9 * self.radius {
            return None;
        }
        let towards = if e > 1e-9 { unit(eccentricity) } else { unit(position) };
        let ahead = unit(cross(&momentum, &towards));
        let point = |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / CIRCLE as f64).sin_cos();
            let distance = parameter / (1.0 + e * cos);
            self.flat([0, 1, 2].map(|k| distance * (cos * towards[k] + sin * ahead[k])))
        };
        Some((0..=CIRCLE).map(point).collect())
    }

    /// Longitude and latitude of the point below.
    fn track(&self) -> Option<Figure> {
        let (longitude, latitude) = (self.table.column("longitude_deg")?, self.table.column("latitude_deg")?);
        let mut points: Vec<[f64; 2]> = Vec::with_capacity(longitude.len());
        for (x, y) in longitude.iter().zip(latitude) {
            if points.last().is_some_and(|last| (last[0] - x).abs() > 180.0) {
                points.push([f64::NAN; 2]);
            }
            points.push([*x, *y]);
        }
        let moves = |values: &[f64]| {
            let [low, high] = ends(values.iter().copied());
            high - low > LEAST_TRACK
        };
        if !moves(longitude) || !moves(latitude) {
            return None;
        }
        let figure = Figure::new("Ground track", Axis::new("longitude", "deg"), Axis::new("latitude", "deg"));
        let figure = figure
            .with(Series::line("track", points.clone()).colored(0))
            .with(Series::dots("start", points.get(..1)?.to_vec()).colored(2))
            .with(Series::dots("end", points.get(points.len() - 1..)?.to_vec()).colored(1));
        Some(figure.to_scale(ratio_of_map(latitude.iter().copied())))
    }

    /// Distances on the ground from the start, m.
    fn distances(&self) -> Option<Vec<f64>> {
        let columns = ["x", "y", "z"].map(|axis| self.table.column(&format!("position_fixed_{axis}_m")));
        let [Some(x), Some(y), Some(z)] = columns else { return None };
        let units: Vec<[f64; 3]> = x.iter().zip(y).zip(z).map(|((x, y), z)| unit([*x, *y, *z])).collect();
        let mut sum = 0.0;
        let steps = units.windows(2).map(|pair| {
            if let [a, b] = pair {
                sum += self.radius * angle_between(a, b);
            }
            sum
        });
        Some(std::iter::once(0.0).chain(steps).collect())
    }

    fn profile(&self) -> Option<Figure> {
        if self.whole {
            return None;
        }
        let altitude = self.table.column("altitude_m")?;
        let points = self.distances()?.into_iter().zip(altitude).map(|(x, y)| [x, *y]).collect();
        let figure =
            Figure::new(PROFILE, Axis::new("distance", "m"), Axis::new("altitude", "m").including(0.0));
        Some(self.by_thrust(points).into_iter().fold(figure, Figure::with))
    }

    /// The last kilometre above the end, to scale; none of flights that do not come down to their end.
    fn end(&self) -> Option<Figure> {
        let altitude = self.table.column("altitude_m")?;
        let end = *altitude.last()?;
        let first = altitude.iter().rposition(|a| a - end > LAST)?;
        let distances = self.distances()?;
        let total = *distances.last()?;
        let points: Vec<[f64; 2]> =
            distances.iter().zip(altitude).skip(first + 1).map(|(x, a)| [x - total, a - end]).collect();
        if points.len() < 5 || end > LAST {
            return None;
        }
        let figure = Figure::new(
            "The last kilometre above the end, to scale",
            Axis::new("distance over ground from the end", "m"),
            Axis::new("height above the end", "m").including(0.0),
        );
        Some(figure.with(Series::line("flight", points).colored(0)).to_scale(1.0))
    }
}

/// The angle about the body along a path, rad.
fn travelled(places: &[[f64; 3]]) -> f64 {
    places.windows(2).map(|pair| if let [a, b] = pair { angle_between(a, b) } else { 0.0 }).sum()
}

/// The direction in the middle of a path of unit vectors with this angle.
fn middle(units: &[[f64; 3]], angle: f64) -> Option<[f64; 3]> {
    let mut sum = 0.0;
    let passed = units.windows(2).find(|pair| {
        if let [a, b] = pair {
            sum += angle_between(a, b);
        }
        sum >= 0.5 * angle
    });
    passed.and_then(|pair| pair.first().copied())
}

/// An arc about the origin between two angles, from the horizontal axis.
fn circle(radius: f64, [from, to]: [f64; 2]) -> Vec<[f64; 2]> {
    let point = |k: usize| {
        let (sin, cos) = (from + (to - from) * k as f64 / CIRCLE as f64).sin_cos();
        [radius * cos, radius * sin]
    };
    (0..=CIRCLE).map(point).collect()
}

/// Curves of one figure: their names and the headers of their columns.
type NamedColumns = &'static [(&'static str, &'static str)];

/// Title and unit of a figure over time, and its curves.
const HISTORIES: [(&str, &str, NamedColumns); 11] = [
    ("altitude", "m", &[("", "altitude_m")]),
    ("speed", "m/s", &[("inertial", "speed_m_per_s"), (OVER_GROUND, "ground_speed_m_per_s")]),
    (
        "flight path angle",
        "deg",
        &[("inertial", "flight_path_angle_deg"), (OVER_GROUND, "ground_path_angle_deg")],
    ),
    ("mass", "kg", &[("", "mass_kg")]),
    ("velocity change spent", "m/s", &[("", "delta_v_m_per_s")]),
    ("thrust", "N", &[("", "thrust_N")]),
    ("thrust to weight", "-", &[("", "thrust_to_weight")]),
    ("dynamic pressure", "Pa", &[("", "dynamic_pressure_Pa")]),
    ("aerodynamic acceleration", "m/s2", &[("", "aerodynamic_acceleration_m_per_s2")]),
    ("heat rate", "W/m2", &[("", "heat_rate_W_per_m2")]),
    ("Mach number", "-", &[("", "Mach_number")]),
];

/// Name of curves of the motion relative to the ground.
const OVER_GROUND: &str = "over ground";

/// Curves that differ by less than this part of their size are one.
const SAME: f64 = 0.01;
/// Speed below which a motion has no direction, m/s.
const STILL: f64 = 0.1;

/// Quantities over time; those that do not change are left out, and so are curves that say what another one says.
fn histories(table: &Ephemeris) -> Vec<Figure> {
    if table.body.is_none() {
        return Vec::new();
    }
    // High above a body that turns, the motion relative to its ground has neither the speed nor the direction of the orbit: towards the orbit
    // of the rotation both vanish.
    let is_low = is_near_ground(table);
    let figure = |(title, unit, curves): &(&str, &str, NamedColumns)| {
        let axis = Axis::new(*title, *unit);
        let mut shown: Vec<(&str, &[f64])> = Vec::new();
        for (name, header) in *curves {
            let Some(values) = table.column(header).filter(|_| is_low || *name != OVER_GROUND) else {
                continue;
            };
            let size = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            let [low, high] = ends(values.iter().copied());
            let differs = |other: &[f64]| values.iter().zip(other).any(|(a, b)| (a - b).abs() > SAME * size);
            if high - low > (FLAT * size).max(axis.resolution)
                && shown.iter().all(|(_, other)| differs(other))
            {
                shown.push((name, values));
            }
        }
        let mut figure = Figure::new(*title, Axis::new("time", "s"), axis);
        figure.spans = spans(table);
        let is_alone = shown.len() == 1;
        for (k, (name, values)) in shown.into_iter().enumerate() {
            let speed = match name {
                _ if *unit != "deg" => None,
                OVER_GROUND => table.column("ground_speed_m_per_s"),
                _ => table.column("speed_m_per_s"),
            };
            let is_still = |row: usize| speed.and_then(|speed| speed.get(row)).is_some_and(|v| *v < STILL);
            let value = |row: usize, v: f64| if is_still(row) { f64::NAN } else { v };
            let rows = table.times.iter().zip(values).enumerate();
            let points = rows.map(|(row, (t, v))| [*t, value(row, *v)]).collect();
            figure = figure.with(Series::line(if is_alone { "" } else { name }, points).colored(k));
        }
        (!figure.series.is_empty()).then_some(figure)
    };
    HISTORIES.iter().filter_map(figure).collect()
}

/// Radius of the body where the flight begins, m.
fn radius_at_start(table: &Ephemeris) -> Option<f64> {
    Some(norm(&table.states.first()?.position, 0.0) - table.column("altitude_m")?.first()?)
}

/// True of a flight that stays within a part of the radius above the ground.
fn is_near_ground(table: &Ephemeris) -> bool {
    let radius = radius_at_start(table);
    let highest = table.column("altitude_m").and_then(|a| a.iter().copied().reduce(f64::max));
    highest.zip(radius).is_some_and(|(highest, radius)| highest <= HIGH * radius)
}

fn spans(table: &Ephemeris) -> Vec<Span> {
    let is_one = table.phases.len() < 2;
    let span = |phase: &apsides_ephemeris::PhaseRows| {
        let times = table.times.get(phase.rows.clone())?;
        let label = if is_one { String::new() } else { phase.name.clone() };
        Some(Span { label, range: *times.first()?..*times.last()? })
    };
    table.phases.iter().filter_map(span).collect()
}

fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

/// The angle between two vectors, rad; exact for small ones.
fn angle_between(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    norm(&cross(a, b), 0.0).atan2(dot(a, b))
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    let size = norm(&a, 0.0);
    a.map(|c| c / size)
}

#[cfg(test)]
mod tests {
    use apsides_ephemeris::{
        About, CentralBody, Column, Flight, Instant, Placing, Plane, Point, Reference, Sampling,
        Span as Phase,
    };

    use super::*;
    use crate::figure::SeriesStyle;

    const RADIUS: f64 = 1.7371e6;
    const GRAVITY: f64 = CentralBody::Moon.gravitational_parameter();
    /// Round-off of places in single turns of axes, relative.
    const ROUNDING: f64 = 1e-9;
    /// Discretisation: the change of height between a few rows, m.
    const STEP: f64 = 200.0;

    /// A flight along a circle at an altitude (m), over an angle (rad), down to the ground at its end if it lands; thrust in the second half.
    struct Arc {
        altitude: f64,
        angle: f64,
        lands: bool,
    }

    impl Flight for Arc {
        fn spans(&self) -> Vec<Phase> {
            let half = |name: &str, times| Phase { name: name.into(), times };
            vec![half("coast", [0.0, 50.0]), half("brake", [50.0, 100.0])]
        }

        fn about(&self) -> Option<About> {
            Some(About::sphere(RADIUS, GRAVITY))
        }

        fn own(&self) -> Vec<Column> {
            Vec::new()
        }

        fn at(&self, phase: usize, time: f64) -> Instant {
            let (sin, cos) = (self.angle * time / 100.0).sin_cos();
            let left = if self.lands { 1.0 - time / 100.0 } else { 1.0 };
            let r = RADIUS + self.altitude * left;
            let speed = (GRAVITY / r).sqrt();
            let thrust = if phase == 1 { 300.0 } else { 0.0 };
            let point = Point {
                position: [r * cos, r * sin, 0.0],
                velocity: [-speed * sin, speed * cos, 0.0],
                thrust: Some([thrust * sin, -thrust * cos, 0.0]),
                mass: Some(300.0 - time),
                delta_v: Some(time),
                attitude: None,
                loads: Vec::new(),
            };
            Instant { point: Some(point), own: Vec::new() }
        }
    }

    fn shown(flight: &Arc, own: Vec<Figure>) -> Presentation {
        let plane = Plane { reference: Reference::Body, node: 0.0, inclination: 0.4, argument: 0.0 };
        let placing = Placing { epoch: apsides_ephemeris::Epoch::DEFAULT.parse().unwrap(), plane };
        let table = Ephemeris::of("arc", flight, &placing, Sampling::Points(400)).unwrap();
        Presentation::new("an arc", own, Some(&table))
    }

    fn titles(figures: &[Figure]) -> Vec<&str> {
        figures.iter().map(|figure| figure.title.as_str()).collect()
    }

    #[test]
    fn an_orbit_is_drawn_about_its_body() {
        let found = shown(&Arc { altitude: 1e5, angle: 5.0, lands: false }, Vec::new());
        assert_eq!(titles(&found.paths), ["Flight in its plane, to scale with the body", "Ground track"]);
        let view = &found.paths[0];
        assert_eq!(view.scale_ratio, Some(1.0));
        let styles: Vec<SeriesStyle> = view.series.iter().map(|s| s.style).collect();
        use SeriesStyle::{Body, Bound, Line};
        assert_eq!(styles, [Body, Bound, Bound, Line, Line]);
        // The orbit of the start is the circle itself, and the flight is on it.
        for series in &view.series[1..] {
            for [x, y] in series.points.iter().filter(|p| p[0].is_finite()) {
                assert!((x.hypot(*y) / (RADIUS + 1e5) - 1.0).abs() < ROUNDING, "{}", series.label);
            }
        }
        assert!(
            (view.series[3].points[0][0] / (RADIUS + 1e5) - 1.0).abs() < ROUNDING,
            "the start is to the right"
        );
        assert_eq!([&view.series[3].label, &view.series[4].label], ["coast", "thrust"]);
    }

    #[test]
    fn the_motion_over_ground_is_of_low_flights() {
        let curves = |altitude: f64| {
            let found = shown(&Arc { altitude, angle: 5.0, lands: true }, Vec::new());
            let speeds = found.histories.iter().find(|f| f.title == "speed").unwrap();
            speeds.series.iter().map(|s| s.label.clone()).collect::<Vec<_>>()
        };
        // The Moon turns slowly: four Earth radii away its ground is tens of metres a second off, of a thousand.
        assert_eq!(curves(2e7), [""], "inertial alone");
        assert_eq!(curves(1e5).len(), 1, "the same to a percent");
    }

    #[test]
    fn a_landing_is_drawn_over_the_ground_and_at_its_end() {
        let own =
            |x: &str, y: &str| Figure::new(format!("{y} over {x}"), Axis::new(x, "km"), Axis::new(y, "km"));
        let landing = Arc { altitude: 2e4, angle: 0.3, lands: true };
        let found = shown(&landing, vec![own("x", "y"), own("time", "thrust")]);
        let last = "The last kilometre above the end, to scale";
        assert_eq!(
            titles(&found.paths),
            ["Flight over the curved ground, to scale", "Ground track", PROFILE, last]
        );
        // The middle of the path is up: 10 km above the ground there.
        let flight = &found.paths[0].series.last().unwrap().points;
        assert!(flight.iter().any(|[x, y]| x.abs() < 2e3 && (y - 1e4).abs() < STEP));
        // The ground touches the middle of the figure, and the flight its end, 0.15 rad on.
        let ground = &found.paths[0].series[0];
        assert_eq!((ground.style, ground.label.as_str()), (SeriesStyle::Body, "ground"));
        let highest = ground.points.iter().map(|p| p[1]).fold(f64::NEG_INFINITY, f64::max);
        assert!((-STEP..=ROUNDING * RADIUS).contains(&highest), "{highest}");
        let landed = flight.last().unwrap();
        let depth = RADIUS * (1.0 - 0.15_f64.cos());
        assert!((landed[1] + depth).abs() < STEP, "{landed:?} {depth}");
        let end = found.paths[3].series[0].points.last().unwrap();
        assert_eq!(*end, [0.0, 0.0]);
        assert!(found.paths[3].series[0].points.iter().all(|p| p[1] < LAST));
        // The mission's own thrust over time stands first, and alone.
        let thrusts = titles(&found.histories).into_iter().filter(|title| title.contains("thrust"));
        assert_eq!(thrusts.collect::<Vec<_>>(), ["thrust over time", "thrust to weight"]);
        assert!(titles(&found.histories).contains(&"altitude"));
        assert_eq!(found.histories[1].spans.len(), 2);
    }

    #[test]
    fn a_flight_without_a_body_has_what_is_its_own() {
        let own = Figure::new("plane", Axis::new("x", "m"), Axis::new("y", "m"));
        let found = Presentation::new("", vec![own.clone()], None);
        assert_eq!((found.paths, found.histories), (vec![own], Vec::new()));
    }
}
