//! Footprints: the ends that a vehicle can reach at the altitude of its target, by a fan of optimal problems.
//!
//! First the flights that end farthest along each of the bearings, anywhere (the support function of the set of ends, so
//! that these ends span its convex hull); then the boundary on rays from a centre inside, so that the outline need not be convex; last the
//! boundary point nearest to the target. Each problem starts from the solution of a neighbour, and from the mission's own guess where
//! that fails. All ends that were found make the outline together, in order around the centre.

use apsides_ocp::Trajectory;
use apsides_verify::Verdict;
use serde::Serialize;

use crate::Error;
use crate::fault::guarded;
use crate::mission::{Ground, Past, Reach};
use crate::observer::Observer;
use crate::outcome::Outcome;
use crate::pipeline::Pipeline;
use outline::{Map, Place};

mod outline;

/// Fewest bearings that surround an area.
pub const FEWEST_BEARINGS: usize = 3;

/// Accuracy of these solves between the points of the mesh: the ends are within metres, and certificates can hold.
const MESH_TOLERANCE: f64 = 1e-8;

/// A bearing whose own flight ends shorter than another one by this distance (km) was not the optimum.
const SHORT_KM: f64 = 1e-3;
/// A ray that ends inside the hull by this part of its length is tried from other starts.
const SHORT_OF_HULL: f64 = 0.01;
/// The nearest boundary point may be off the line to the target by this distance, km.
const OFF_NEAREST_KM: f64 = 0.1;
const MOST_NEAREST: usize = 8;

/// The problem that a boundary point is the optimum of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PointKind {
    /// Farthest along a bearing, anywhere.
    Extreme,
    /// Farthest on a ray from the centre.
    Ray,
    /// Nearest to the target, from inside the hull.
    Nearest,
}

impl PointKind {
    /// The word in files.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Extreme => "extreme",
            Self::Ray => "ray",
            Self::Nearest => "nearest",
        }
    }
}

/// An end on the boundary.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BoundaryPoint {
    /// The problem that it is the optimum of.
    pub kind: PointKind,
    /// From the centre, from north towards east.
    pub bearing_deg: f64,
    /// From the centre.
    pub distance_km: f64,
    /// Longitude.
    pub longitude_deg: f64,
    /// Latitude.
    pub latitude_deg: f64,
    /// Duration of the flight that ends there.
    pub flight_time_s: f64,
    /// From the start, along the great circle of its velocity.
    pub downrange_km: f64,
    /// To the right of it.
    pub crossrange_km: f64,
    /// `optimal`, `acceptable`, `mesh-limit`.
    pub status: String,
    /// Verdict of the certificate of the flight.
    pub verdict: Verdict,
    /// True if the certificate is verified.
    pub verified: bool,
}

impl BoundaryPoint {
    /// Longitude and latitude, deg.
    #[must_use]
    pub fn place(&self) -> [f64; 2] {
        [self.longitude_deg, self.latitude_deg]
    }
}

/// The ends that can be reached. Places are longitude and latitude in deg.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Footprint {
    /// Name of the mission.
    pub mission: String,
    /// Altitude of the ends.
    pub altitude_km: f64,
    /// Place under the start.
    pub start_deg: [f64; 2],
    /// Place of the mission's target.
    pub target_deg: [f64; 2],
    /// Place that the rays start from.
    pub centre_deg: [f64; 2],
    /// The area that the outline surrounds; straight on a map of equal areas from point to point.
    pub area_km2: f64,
    /// Least and largest `downrange_km` on the boundary.
    pub along_course_km: [f64; 2],
    /// Least and largest `crossrange_km` on the boundary.
    pub across_course_km: [f64; 2],
    /// True if the target is inside.
    pub target_inside: bool,
    /// Distance of the target from the boundary, negative outside.
    pub target_margin_km: f64,
    /// Problems solved, those included that were improved upon or failed.
    pub cases: usize,
    /// Points of the boundary whose certificate is verified.
    pub verified: usize,
    /// The reasons for which bearings have no point, one sentence each.
    pub failures: Vec<String>,
    /// True if all was computed; it was stopped else.
    pub complete: bool,
    /// The boundary, in order of the bearing.
    pub points: Vec<BoundaryPoint>,
    /// Places under the mission's own flight; empty if that was not solved.
    pub track_deg: Vec<[f64; 2]>,
}

impl Footprint {
    /// Longest extent along the course of the start.
    #[must_use]
    pub fn length_km(&self) -> f64 {
        self.along_course_km[1] - self.along_course_km[0]
    }

    /// Widest extent across the course of the start.
    #[must_use]
    pub fn width_km(&self) -> f64 {
        self.across_course_km[1] - self.across_course_km[0]
    }
}

/// A case of a footprint.
#[derive(Clone, Copy, Debug)]
pub struct FootprintCase<'a> {
    /// The name of the solve, in words.
    pub name: &'a str,
    /// Status of the last solve, in a word.
    pub status: &'a str,
    /// Its boundary point, if it has one; bearing and distance are not known yet.
    pub point: Option<&'a BoundaryPoint>,
}

/// Number of cases that a footprint reports, without those that improve others.
#[must_use]
pub fn count(bearings: usize) -> usize {
    2 * bearings + 2
}

impl Pipeline {
    /// Refuses a mission that has no footprint.
    ///
    /// # Errors
    /// When its kind has none.
    pub fn check_footprint(&self) -> Result<(), Error> {
        self.reach().map(|_| ())
    }

    fn reach(&self) -> Result<&dyn Reach, Error> {
        self.optimised()?;
        self.mission().reach().ok_or_else(|| {
            let with_one = self.kinds_that(|o| o.footprint);
            self.kind().refused(&format!(
                "its end is not free over ground, so it has no footprint; missions with one: {with_one}"
            ))
        })
    }
}

/// Computes the footprint of a mission under its limits. `report` gets each case as soon as it is there and ends the work by returning
/// false; so does the observer by stopping a solve. What was found until then is returned.
///
/// # Errors
/// A mission without a footprint, fewer than [`FEWEST_BEARINGS`], values that do not make a problem.
pub fn footprint(
    mission: &Pipeline,
    bearings: usize,
    observer: &mut dyn Observer,
    report: impl FnMut(&FootprintCase<'_>) -> bool,
) -> Result<Footprint, Error> {
    let reach = mission.reach()?;
    let refused = |reason| Error::Conflict { place: "footprint".into(), reason };
    if bearings < FEWEST_BEARINGS {
        return Err(refused(format!("{bearings} bearings; at least {FEWEST_BEARINGS} surround an area")));
    }
    let ground = reach.ground();
    let mission = &mission.clone().with_tolerance_from(MESH_TOLERANCE);
    let mut fan =
        Fan { mission, reach, ground, observer, report, cases: 0, stopped: false, failures: Vec::new() };
    let track = fan.track()?;
    let mut found = fan.extremes(bearings)?;
    let hull: Vec<Place> = found.iter().map(|f| f.point.place()).collect();
    let centre = centre(&hull, &ground);
    fan.rays(bearings, centre, &mut found)?;
    let nearest = fan.nearest(&found)?;
    found.extend(nearest);
    Ok(fan.finish(centre, found, track))
}

/// The centre of the hull; the mean of its points where these surround nothing.
fn centre(hull: &[Place], ground: &Ground) -> Place {
    let Some(first) = hull.first() else { return ground.target };
    let map = Map { middle: *first, radius: ground.radius };
    match map.area(hull) {
        (area, centre) if area > 0.0 && centre.iter().all(|c| c.is_finite()) => centre,
        _ => [0, 1].map(|k| hull.iter().map(|p| p[k]).sum::<f64>() / hull.len() as f64),
    }
}

/// A flight to the boundary.
struct BoundaryFlight {
    /// The bearing that it was to end farthest along, deg.
    asked: f64,
    point: BoundaryPoint,
    solution: Trajectory,
}

/// The status of a solve that panicked.
fn of_fault(message: &str) -> String {
    format!("a fault of the program ({message}): please report it")
}

/// The solves of a footprint.
struct Fan<'a, R> {
    mission: &'a Pipeline,
    reach: &'a dyn Reach,
    ground: Ground,
    observer: &'a mut dyn Observer,
    report: R,
    cases: usize,
    stopped: bool,
    failures: Vec<String>,
}

impl<R: FnMut(&FootprintCase<'_>) -> bool> Fan<'_, R> {
    fn map(&self, middle: Place) -> Map {
        Map { middle, radius: self.ground.radius }
    }

    fn solve(&mut self, mission: &Pipeline, start: Option<&Trajectory>) -> Result<Outcome, Error> {
        self.cases += 1;
        let outcome = mission.solve(start, self.observer)?;
        self.stopped |= outcome.status == apsides_nlp::Status::Interrupted;
        Ok(outcome)
    }

    fn tell(&mut self, name: &str, status: &str, point: Option<&BoundaryPoint>) {
        self.stopped |= !(self.report)(&FootprintCase { name, status, point });
    }

    /// Places under the mission's own flight.
    fn track(&mut self) -> Result<Vec<Place>, Error> {
        const NAME: &str = "the flight of the mission";
        let outcome = match guarded(|| self.solve(self.mission, None)) {
            Ok(outcome) => outcome?,
            Err(fault) => {
                let status = of_fault(&fault);
                self.failures.push(format!("{NAME}: {status}"));
                self.tell(NAME, &status, None);
                return Ok(Vec::new());
            }
        };
        self.tell(NAME, &outcome.summary.status, None);
        let solved = outcome.status.is_success();
        Ok(if solved { self.reach.track(&outcome.trajectory) } else { Vec::new() })
    }

    /// The end farthest past a place along a bearing, from the first of the starts that leads to one, the mission's own guess last; or the
    /// status of the last solve.
    fn farthest(
        &mut self,
        kind: PointKind,
        past: &Past,
        starts: &[&Trajectory],
    ) -> Result<Result<BoundaryFlight, String>, Error> {
        let mission = self.mission.clone().with_mission(self.reach.past(past));
        let mut status = "interrupted".to_owned();
        for start in starts.iter().copied().map(Some).chain([None]) {
            if self.stopped {
                break;
            }
            let outcome = match guarded(|| self.solve(&mission, start)) {
                Ok(outcome) => outcome?,
                Err(fault) => {
                    status = of_fault(&fault);
                    continue;
                }
            };
            if outcome.status.is_success()
                && let Some(found) = self.found(kind, past.bearing, &outcome)
            {
                return Ok(Ok(found));
            }
            status = outcome.explanation.unwrap_or(outcome.summary.status);
        }
        Ok(Err(status))
    }

    fn found(&self, kind: PointKind, asked: f64, outcome: &Outcome) -> Option<BoundaryFlight> {
        let [longitude_deg, latitude_deg] = *self.reach.track(&outcome.trajectory).last()?;
        let summary = &outcome.summary;
        let result = |key: &str| summary.results.get(key).copied().unwrap_or(f64::NAN);
        // As seen from the target, until the middle of the footprint is known.
        let [bearing_deg, distance_km] = self.map(self.ground.target).polar([longitude_deg, latitude_deg]);
        let point = BoundaryPoint {
            kind,
            bearing_deg,
            distance_km,
            longitude_deg,
            latitude_deg,
            flight_time_s: result("flight_time_s"),
            downrange_km: result("downrange_km"),
            crossrange_km: result("crossrange_km"),
            status: summary.status.clone(),
            verdict: summary.certificate.verdict,
            verified: summary.certificate.is_verified(),
        };
        Some(BoundaryFlight { asked, point, solution: outcome.solved().1.clone() })
    }

    /// As [`Self::farthest`], and tells of it; a failure is kept.
    fn case(
        &mut self,
        kind: PointKind,
        past: &Past,
        starts: &[&Trajectory],
    ) -> Result<Option<BoundaryFlight>, Error> {
        let found = self.farthest(kind, past, starts)?;
        Ok(self.told(kind, past.bearing, found))
    }

    fn told(
        &mut self,
        kind: PointKind,
        bearing: f64,
        found: Result<BoundaryFlight, String>,
    ) -> Option<BoundaryFlight> {
        let from = match kind {
            PointKind::Extreme => "farthest along",
            PointKind::Ray => "from the centre along",
            PointKind::Nearest => "nearest to the target, along",
        };
        let name = format!("{from} {bearing:.1} deg");
        match &found {
            Ok(f) => self.tell(&name, &f.point.status, Some(&f.point)),
            Err(status) => {
                if !self.stopped {
                    self.failures.push(format!("{name}: {status}"));
                }
                self.tell(&name, status, None);
            }
        }
        found.ok()
    }

    /// The farthest ends along bearings, in their order.
    fn extremes(&mut self, bearings: usize) -> Result<Vec<BoundaryFlight>, Error> {
        let map = self.map(self.ground.target);
        let past = |bearing| Past { place: map.middle, bearing, half_width: None };
        let mut found: Vec<BoundaryFlight> = Vec::new();
        for bearing in fan_of(bearings) {
            if self.stopped {
                break;
            }
            let starts: Vec<&Trajectory> = found.last().map(|f| &f.solution).into_iter().collect();
            found.extend(self.case(PointKind::Extreme, &past(bearing), &starts)?);
        }
        // A flight to another bearing that ends farther shows a local optimum, and is a better start.
        let along = |bearing: f64, f: &BoundaryFlight| map.along(bearing, f.point.place())[0];
        for k in 0..found.len() {
            let bearing = found[k].asked;
            let best = found.iter().max_by(|a, b| along(bearing, a).total_cmp(&along(bearing, b)));
            let Some(best) = best.filter(|best| along(bearing, best) > along(bearing, &found[k]) + SHORT_KM)
            else {
                continue;
            };
            let farthest = self.farthest(PointKind::Extreme, &past(bearing), &[&best.solution])?;
            if let Ok(better) = farthest
                && along(bearing, &better) > along(bearing, &found[k])
            {
                found[k] = better;
            }
        }
        // What is still short of another end is no extreme.
        let is_extreme =
            |f: &BoundaryFlight| found.iter().all(|o| along(f.asked, o) <= along(f.asked, f) + SHORT_KM);
        let mut extreme = found.iter().map(is_extreme).collect::<Vec<_>>().into_iter();
        found.retain(|_| extreme.next().unwrap_or(false));
        Ok(found)
    }

    /// Adds the boundary on rays from the centre.
    fn rays(&mut self, bearings: usize, centre: Place, found: &mut Vec<BoundaryFlight>) -> Result<(), Error> {
        let map = self.map(centre);
        let mut hull: Vec<Place> = found.iter().map(|f| f.point.place()).collect();
        hull.sort_by(|a, b| map.polar(*a)[0].total_cmp(&map.polar(*b)[0]));
        let mut last: Option<Trajectory> = None;
        for bearing in fan_of(bearings) {
            if self.stopped {
                break;
            }
            let off = |f: &BoundaryFlight| {
                let [along, right] = map.along(bearing, f.point.place());
                right.atan2(along).abs()
            };
            let extremes = found.iter().filter(|f| f.point.kind == PointKind::Extreme);
            let near = extremes.min_by(|a, b| off(a).total_cmp(&off(b))).map(|f| f.solution.clone());
            let past = Past { place: centre, bearing, half_width: Some(0.0) };
            let starts: Vec<&Trajectory> = near.iter().chain(&last).collect();
            let Some(mut ray) = self.case(PointKind::Ray, &past, &starts)? else { continue };
            let length = |f: &BoundaryFlight| map.along(bearing, f.point.place())[0];
            let expected = map.distance_along(bearing, &hull).unwrap_or(0.0) * (1.0 - SHORT_OF_HULL);
            if length(&ray) < expected && !self.stopped {
                // Either the outline is not convex here, or this is a local optimum.
                let others: Vec<&Trajectory> = last.iter().collect();
                if let Ok(other) = self.farthest(PointKind::Ray, &past, &others)?
                    && length(&other) > length(&ray)
                {
                    ray = other;
                }
            }
            last = Some(ray.solution.clone());
            found.push(ray);
        }
        Ok(())
    }

    /// The boundary point nearest to the target, as far as the outline is convex there: the farthest end along a bearing that lies on
    /// the line from the target along it.
    fn nearest(&mut self, found: &[BoundaryFlight]) -> Result<Option<BoundaryFlight>, Error> {
        let map = self.map(self.ground.target);
        let seen = |f: &BoundaryFlight| map.along(f.asked, f.point.place());
        let extremes: Vec<&BoundaryFlight> =
            found.iter().filter(|f| f.point.kind == PointKind::Extreme).collect();
        let least =
            (0..extremes.len()).min_by(|a, b| seen(extremes[*a])[0].total_cmp(&seen(extremes[*b])[0]));
        let Some(k) = least.filter(|_| extremes.len() >= FEWEST_BEARINGS) else { return Ok(None) };
        // The end's distance to the right is the derivative of its distance along the bearing: at the minimum it passes zero.
        let side = |f: &BoundaryFlight| {
            let turns = ((f.asked - extremes[k].asked) / 360.0).round();
            [f.asked - 360.0 * turns, seen(f)[1]]
        };
        let count = extremes.len();
        let (mut low, mut high) = (side(extremes[(k + count - 1) % count]), side(extremes[(k + 1) % count]));
        let [bearing, right] = side(extremes[k]);
        *(if right < 0.0 { &mut low } else { &mut high }) = [bearing, right];
        let mut nearest: Option<Result<BoundaryFlight, String>> = None;
        for step in 0..MOST_NEAREST {
            if self.stopped || low[1] >= 0.0 || high[1] <= 0.0 {
                break;
            }
            let part = if step % 3 == 2 { 0.5 } else { -low[1] / (high[1] - low[1]) };
            let bearing = low[0] + part * (high[0] - low[0]);
            let past = Past { place: map.middle, bearing, half_width: None };
            let start = nearest.as_ref().and_then(|n| n.as_ref().ok()).unwrap_or(extremes[k]);
            let found = self.farthest(PointKind::Nearest, &past, &[&start.solution])?;
            let right = found.as_ref().map_or(0.0, |end| seen(end)[1]);
            nearest = Some(found);
            if right.abs() <= OFF_NEAREST_KM {
                break;
            }
            *(if right < 0.0 { &mut low } else { &mut high }) = [bearing, right];
        }
        let bearing = nearest.as_ref().and_then(|n| n.as_ref().ok()).map_or(bearing, |end| end.asked);
        Ok(nearest.and_then(|found| self.told(PointKind::Nearest, bearing, found)))
    }

    fn finish(self, centre: Place, found: Vec<BoundaryFlight>, track_deg: Vec<Place>) -> Footprint {
        let map = self.map(centre);
        let mut points: Vec<BoundaryPoint> = found.into_iter().map(|f| f.point).collect();
        for p in &mut points {
            [p.bearing_deg, p.distance_km] = map.polar(p.place());
        }
        points.sort_by(|a, b| a.bearing_deg.total_cmp(&b.bearing_deg));
        let outline: Vec<Place> = points.iter().map(BoundaryPoint::place).collect();
        let margin = self.map(self.ground.target).depth(&outline);
        let extent = |of: fn(&BoundaryPoint) -> f64| {
            let least = points.iter().map(of).fold(f64::INFINITY, f64::min);
            [least, points.iter().map(of).fold(f64::NEG_INFINITY, f64::max)]
        };
        Footprint {
            mission: self.mission.name().into(),
            altitude_km: self.ground.altitude,
            start_deg: self.ground.start,
            target_deg: self.ground.target,
            centre_deg: centre,
            area_km2: map.area(&outline).0,
            along_course_km: extent(|p| p.downrange_km),
            across_course_km: extent(|p| p.crossrange_km),
            target_inside: margin > 0.0,
            target_margin_km: margin,
            cases: self.cases,
            verified: points.iter().filter(|p| p.verified).count(),
            failures: self.failures,
            complete: !self.stopped,
            points,
            track_deg,
        }
    }
}

/// So many bearings from north on, deg.
fn fan_of(bearings: usize) -> impl Iterator<Item = f64> {
    (0..bearings).map(move |k| 360.0 * k as f64 / bearings as f64)
}
