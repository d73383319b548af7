//! Figures 4 to 9: each burn of the joint optimum of two burns over its time, beside the same burn with thrust along the velocity.

use apsides_ad::Dynamics;
use apsides_dynamics::elements::PlanarEquinoctial;
use apsides_dynamics::equinoctial::PlanarVelocityThrust;
use apsides_ocp::PhaseTrajectory;
use apsides_ode::{FnSystem, Integrator, OdeSettings, Status};

use super::printed::USED_MASS;
use super::stage::{Solver, Stage, Stop, keep};
use crate::change::number;
use crate::sheet::{Graph, GraphSeries, Sheet};

const MISSION: &str = "geo-2-burn";
/// Points of a curve, and of the curve beside it.
const POINTS: usize = 120;
const DOTS: usize = 24;

/// A figure: file, quantity, unit, and the quantity of a state.
type Profile = (&'static str, &'static str, &'static str, fn(&Instant) -> f64);

/// A time of a burn.
struct Instant {
    time: f64,
    /// Distance from the centre, m; radial and horizontal speed, m/s; polar angle, rad.
    radius: f64,
    radial_speed: f64,
    horizontal_speed: f64,
    angle: f64,
    /// From the local horizontal, rad.
    thrust_angle: f64,
}

impl Instant {
    fn flight_path_angle(&self) -> f64 {
        self.radial_speed.atan2(self.horizontal_speed)
    }
}

const PROFILES: [Profile; 6] = [
    ("burns_radius.svg", "distance from the centre", "m", |i| i.radius),
    ("burns_radial_speed.svg", "radial speed", "m/s", |i| i.radial_speed),
    ("burns_horizontal_speed.svg", "horizontal speed", "m/s", |i| i.horizontal_speed),
    ("burns_polar_angle.svg", "polar angle from ignition", "rad", |i| i.angle),
    ("burns_thrust_angle.svg", "thrust angle", "rad", |i| i.thrust_angle),
    ("burns_flight_path_angle.svg", "flight path angle", "rad", Instant::flight_path_angle),
];

fn instant(
    stage: &Stage,
    time: f64,
    state: &[f64],
    first: f64,
    thrust_angle: Option<f64>,
) -> Option<Instant> {
    let &[p, f, g, longitude, ..] = state else { return None };
    let polar = PlanarEquinoctial::new([p, f, g, longitude]).to_polar(stage.mu());
    let along = polar.radial_speed.atan2(polar.horizontal_speed);
    Some(Instant {
        time,
        radius: polar.radius,
        radial_speed: polar.radial_speed,
        horizontal_speed: polar.horizontal_speed,
        angle: longitude - first,
        thrust_angle: thrust_angle.unwrap_or(along),
    })
}

/// A burn of the optimum.
fn optimal(stage: &Stage, burn: &PhaseTrajectory) -> Vec<Instant> {
    let state = |t: f64| burn.state_at(t);
    let first = state(burn.initial_time).get(3).copied().unwrap_or(0.0);
    (0..=POINTS)
        .map(|k| burn.time_at(k as f64 / POINTS as f64))
        .filter_map(|t| {
            let angle = burn.control_at(t).first().copied();
            instant(stage, t - burn.initial_time, &state(t), first, angle)
        })
        .collect()
}

/// The same burn from the same ignition for the same time along the velocity.
fn along_velocity(stage: &Stage, burn: &PhaseTrajectory) -> Result<Vec<Instant>, Stop> {
    let failed = |why: String| Stop::NotSolved(format!("burn along the velocity: {why}"));
    let model = PlanarVelocityThrust(stage.flight);
    let system = FnSystem::new(5, |t, x: &[f64], dx: &mut [f64]| {
        if let Ok(x) = <&[f64; 5]>::try_from(x) {
            dx.copy_from_slice(&model.rate(t, x, &[], &[]));
        }
    });
    let mut integrator = Integrator::new(5, OdeSettings::default()).map_err(|e| failed(e.to_string()))?;
    let mut state = burn.state_at(burn.initial_time);
    let first = state.get(3).copied().unwrap_or(0.0);
    let step = (burn.final_time - burn.initial_time) / DOTS as f64;
    let mut flown = Vec::new();
    for k in 0..=DOTS {
        flown.extend(instant(stage, step * k as f64, &state, first, None));
        if k < DOTS {
            let from = state.clone();
            let summary = integrator
                .integrate(&system, 0.0, &from, step, &mut state)
                .map_err(|e| failed(e.to_string()))?;
            if summary.status != Status::Completed {
                return Err(failed("the integration ends early".into()));
            }
        }
    }
    Ok(flown)
}

/// Dots of the parking orbit and of the geostationary one.
const CIRCLES: [usize; 2] = [24, 72];

pub(super) fn sheet(stage: &Stage, solver: &mut Solver<'_>) -> Result<Sheet, Stop> {
    let columns = [
        ("burn_time_s", 2),
        ("radius_km", 2),
        ("radial_speed_m_s", 3),
        ("horizontal_speed_m_s", 3),
        ("polar_angle_deg", 3),
        ("largest_angle_between_deg", 3),
    ];
    let title = "Figs 4 to 9: ends of the burns of the optimum of two burns (22170 kg), and of the same burns with thrust along the velocity";
    let mut sheet = Sheet::new("profiles", title, "burn", &columns);
    let solved = solver.mission(MISSION, &[number("initial_mass_kg", USED_MASS)], None);
    let Some(outcome) = keep(&mut sheet, solved)? else { return Ok(sheet) };
    let mut graphs: Vec<Graph> = PROFILES
        .iter()
        .map(|&(file, name, unit, _)| Graph {
            file,
            title: format!("Burns of the optimum: {name} (lines), along the velocity (dots)"),
            x: ("time since ignition", "s"),
            y: (name, unit),
            series: Vec::new(),
        })
        .collect();
    let mut plane = Graph {
        file: "burns_plane.svg",
        title: "Burns of the optimum in the plane".into(),
        x: ("x", "m"),
        y: ("y", "m"),
        series: Vec::new(),
    };
    let mut widest = Vec::new();
    for (k, burn) in outcome.solved().1.phases.iter().enumerate() {
        let (best, other) = (optimal(stage, burn), along_velocity(stage, burn));
        let Some(other) = keep(&mut sheet, other)? else { continue };
        let label = format!("burn {}", k + 1);
        for (graph, (.., of)) in graphs.iter_mut().zip(PROFILES) {
            let points = |flown: &[Instant]| flown.iter().map(|i| [i.time, of(i)]).collect();
            graph.series.push(GraphSeries {
                label: label.clone(),
                line: points(&best),
                dots: points(&other),
            });
        }
        let start = burn.state_at(burn.initial_time).get(3).copied().unwrap_or(0.0);
        let place = |i: &Instant| {
            let (sin, cos) = (start + i.angle).sin_cos();
            [i.radius * cos, i.radius * sin]
        };
        plane.series.push(GraphSeries {
            label: label.clone(),
            line: best.iter().map(place).collect(),
            dots: Vec::new(),
        });
        let between = best
            .iter()
            .map(|i| (i.thrust_angle - i.flight_path_angle()).abs())
            .fold(0.0, f64::max)
            .to_degrees();
        widest.push(between);
        for (way, flown, between) in [("optimal", &best, Some(between)), ("along the velocity", &other, None)]
        {
            let Some(end) = flown.last() else { continue };
            sheet.push(
                format!("{label}, {way}"),
                vec![
                    Some(end.time),
                    Some(end.radius / 1e3),
                    Some(end.radial_speed),
                    Some(end.horizontal_speed),
                    Some(end.angle.to_degrees()),
                    between,
                ],
            );
        }
    }
    if let [first, .., last] = widest[..] {
        sheet.findings.push(format!(
            "optimal thrust leaves the velocity by up to {first:.1} deg in the first burn and {last:.1} deg in the last: the burns for the \
             same times along the velocity end on other orbits, and redesigned ones cost little (sheet sequences)"
        ));
    }
    for (label, radius, count) in [
        ("parking orbit", stage.parking_radius, CIRCLES[0]),
        ("geostationary orbit", stage.target_radius, CIRCLES[1]),
    ] {
        let place = |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
            [radius * cos, radius * sin]
        };
        // Dots, so that a burn along an orbit is seen.
        let dots = (0..count).map(place).collect();
        plane.series.push(GraphSeries { label: label.into(), line: Vec::new(), dots });
    }
    sheet.graphs = graphs;
    sheet.graphs.push(plane);
    Ok(sheet)
}
