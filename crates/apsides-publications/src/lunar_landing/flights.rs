//! Figures 2 and 3, and what the conclusion asks for: the landings under noise, disturbances and uncertainty.

use apsides_control::guidance::feed_forward::FeedForward;
use apsides_ocp::{PhaseTrajectory, Trajectory};
use apsides_pipeline::dispersion::{Deviations, Guidance, Onboard, Replanning};
use apsides_pipeline::montecarlo::MonteCarlo;

use crate::change::Change;
use crate::sheet::{Graph, GraphSeries, Sheet};
use crate::stop::{Stop, keep, solved};
use crate::workers::Workers;

const LANDINGS: [(&str, &str, &[Change<'static>]); 2] = [
    ("perilune at 15 km (Fig. 2)", "lunar-perilune", &[]),
    ("gate at 2 km (Fig. 3)", "lunar-two-phase", &[]),
];
/// Radius of the Moon of the paper, m.
const SURFACE: f64 = 1_737_000.0;
/// Points of a curve along each phase.
const POINTS: usize = 150;

/// A curve of a figure: file, name and unit of the abscissa and of the ordinate, the point at a time of a phase; the polar angle at the
/// gate stands in where a vertical flight has none.
type Curve =
    (&'static str, [(&'static str, &'static str); 2], fn(&PhaseTrajectory, f64, f64) -> Option<[f64; 2]>);

const CURVES: [Curve; 4] = [
    ("paths.svg", [("distance on the ground", "m"), ("altitude", "m")], |p, t, gate| {
        let x = p.state_at(t);
        Some([SURFACE * if x.len() > 3 { *x.get(1)? } else { gate }, x.first()? - SURFACE])
    }),
    ("horizontal_speeds.svg", [("time", "s"), ("horizontal speed", "m/s")], |p, t, _| {
        let x = p.state_at(t);
        Some([t, if x.len() > 3 { *x.get(2)? } else { 0.0 }])
    }),
    ("radial_speeds.svg", [("time", "s"), ("radial speed", "m/s")], |p, t, _| {
        let x = p.state_at(t);
        Some([t, *x.get(if x.len() > 3 { 3 } else { 1 })?])
    }),
    ("thrust_angles.svg", [("time", "s"), ("thrust angle from the horizontal", "deg")], |p, t, _| {
        Some([t, p.control_at(t).first().map_or(90.0, |angle| angle.to_degrees())])
    }),
];

fn curve(trajectory: &Trajectory, of: fn(&PhaseTrajectory, f64, f64) -> Option<[f64; 2]>) -> Vec<[f64; 2]> {
    let gate = trajectory.phases.iter().rev().find(|p| p.state.dimension() > 3);
    let gate = gate.and_then(|p| p.final_state().get(1).copied()).unwrap_or(0.0);
    let points = |p: &PhaseTrajectory| {
        (0..=POINTS).filter_map(|k| of(p, p.time_at(k as f64 / POINTS as f64), gate)).collect::<Vec<_>>()
    };
    trajectory.phases.iter().flat_map(points).collect()
}

pub(super) fn figures(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "figures",
        "Figs 2 and 3: path, speeds and thrust angle of the optimum from a perilune at 15 km, directly and by way of a gate at 2 km",
        "landing",
        &[
            ("flight_time_s", 3),
            ("final_mass_kg", 4),
            ("max_altitude_km", 3),
            ("downrange_km", 3),
            ("final_thrust_angle_deg", 3),
        ],
    );
    let mut graphs: Vec<Graph> = CURVES
        .iter()
        .map(|&(file, [x, y], _)| Graph {
            file,
            title: format!("Optimal landings: {}", y.0),
            x,
            y,
            series: Vec::new(),
        })
        .collect();
    for (label, mission, changes) in LANDINGS {
        let found = solved(mission, changes, workers.threads, None, &mut *workers.observer);
        let Some((_, outcome)) = keep(&mut sheet, found)? else { continue };
        let columns: Vec<&str> = sheet.columns.iter().map(|c| c.key).collect();
        let values = columns.iter().map(|key| outcome.summary.results.get(*key).copied()).collect();
        sheet.push(label, values);
        for (graph, (.., of)) in graphs.iter_mut().zip(CURVES) {
            graph.series.push(GraphSeries {
                label: label.into(),
                line: curve(&outcome.trajectory, of),
                dots: Vec::new(),
            });
        }
    }
    sheet.findings.push(
        "the thrust is oblique at touchdown on the direct way and upright by way of the gate, where it jumps: a lander with a limited rate of \
         turn needs time there (`max_pitch_rate_deg_s`)"
            .into(),
    );
    sheet.graphs = graphs;
    Ok(sheet)
}

/// Standard deviations: position (m) and velocity (m/s) at the start, thrust and exhaust velocity, mass (kg); of the navigation.
const DISPERSIONS: Deviations = Deviations {
    position_m: [300.0; 3],
    velocity_m_s: [1.0; 3],
    thrust: 0.003,
    exhaust_velocity: 0.002,
    mass_kg: 0.5,
    navigation_position_m: [20.0; 3],
    navigation_velocity_m_s: [0.1; 3],
};
const SEED: u64 = 17;
/// Flights with the thrust of the plan, and by each of the others.
const FLIGHTS: usize = 300;
const STEERED: usize = 12;
/// Time between plans, s.
const PERIOD_S: f64 = 60.0;

pub(super) fn dispersion(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "dispersion",
        "Landings under noise, disturbance and uncertainty: where flights end relative to the plan, standard deviations",
        "landing, steering",
        &[
            ("flights", 0),
            ("failed", 0),
            ("up_m", 2),
            ("along_m", 1),
            ("across_m", 1),
            ("up_speed_m_s", 3),
            ("along_speed_m_s", 3),
            ("across_speed_m_s", 3),
            ("final_mass_kg", 4),
        ],
    );
    let steerings = [
        ("thrust of the plan", Guidance::OpenLoop, FLIGHTS),
        ("linear radial acceleration", Guidance::LinearRadial(FeedForward::default()), STEERED),
        (
            "planned anew",
            Guidance::Replanned(Replanning { at_s: vec![0.0], every_s: Some(PERIOD_S) }),
            STEERED,
        ),
    ];
    for (label, name, changes) in LANDINGS {
        let found = solved(name, changes, workers.threads, None, &mut *workers.observer);
        let Some((mission, plan)) = keep(&mut sheet, found)? else { continue };
        for (steering, guidance, samples) in &steerings {
            let run = MonteCarlo {
                samples: *samples,
                seed: SEED,
                threads: workers.threads,
                dispersions: DISPERSIONS,
                guidance: guidance.clone(),
                onboard: Onboard::default(),
            };
            let (flown, statistics) = run.run(&mission, &plan, Vec::new(), |_| true)?;
            let failed = flown.iter().filter(|s| s.results.iter().any(|v| !v.is_finite())).count();
            let mut values = vec![Some(flown.len() as f64), Some(failed as f64)];
            // The other columns have the names of results.
            let of_results: Vec<&str> =
                sheet.columns.iter().skip(values.len()).map(|column| column.key).collect();
            values.extend(of_results.iter().map(|key| statistics.spread(key).map(|s| s.sigma)));
            sheet.push(format!("{label}, {steering}"), values);
        }
    }
    sheet.findings.push(format!(
        "three sigma of 900 m and 3 m/s at the start, 0.9 % of thrust, 60 m and 0.3 m/s of navigation: the thrust of the plan does not land; a law \
         on altitude and speed lands farther on, for its steering is another than the optimal one, and so does a new plan every {PERIOD_S} s, whose range is free; what the navigation does \
         not see is left at touchdown. Behind the gate the law leaves an upright descent as planned, which its later and lighter arrival does not fit"
    ));
    Ok(sheet)
}
