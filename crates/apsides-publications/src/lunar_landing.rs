//! Tables 2 and 3 of Reza Jamilnia on planar lunar landings, Modares Mechanical Engineering 17(10), 2017.
//!
//! Full thrust in minimum time. Table 2: from the circular orbit at 100 km, and from perilunes below it. Table 3: from a perilune of
//! 15 km with horizontal braking to a gate, then upright. The paper's nonlinear program: radius and polar angle as splines of order
//! 6 over 10 segments, 15 uniform points with both ends per phase.

use apsides_ad::Dynamics;
use apsides_dynamics::planar::{HORIZONTAL_SPEED, PlanarFlight, RADIAL_SPEED, RADIUS, VerticalThrust};
use apsides_missions::lunar::{DirectLanding, TwoPhaseLanding};
use apsides_ode::{FnSystem, Integrator, OdeSettings, Status};
use apsides_verify::{VerifySettings, verify};

use super::{Comparison, FindingKind, HandOn, Miss, PrintedRow, PrintedTable, Publication, Solved};
use crate::change::{Change, number, word};
use crate::stop::Stop;
use crate::workers::Workers;
use crate::{Error, Outcome, Pipeline};

mod flights;
mod items;
mod splines;

const TIME: &str = "flight_time_s";
const MASS: &str = "final_mass_kg";
const ANGLE: &str = "final_thrust_angle_deg";
const BRAKING: &str = "braking_time_s";
const DESCENT: &str = "descent_time_s";
const GATE_SPEED: &str = "gate_radial_velocity_m_s";

/// Half of the last printed digit.
const ROUNDING: f64 = 5e-4;
/// Altitude of a touchdown that rounding cannot explain, m: half a digit of the gate speed and of the time make 0.1 m.
const TOUCHDOWN_ALTITUDE_M: f64 = 1.0;
/// Altitude of the parking orbit, km; the row of Table 2 without a transfer.
const ORBIT_KM: f64 = 100.0;
/// Speed that the text gives for that orbit, m/s.
const PRINTED_ORBITAL_SPEED: f64 = 1691.97;

pub(super) const PUBLICATION: Publication = Publication {
    name: "lunar-landing",
    title: "Planar lunar landings in minimum time by flatness and B-splines (Jamilnia 2017, Tables 2 and 3)",
    source: "R. Jamilnia, Modares Mechanical Engineering 17(10), 2017",
    remarks,
    memory_mb: [21.0, 1.0],
    tables: &[TABLE_2, TABLE_3],
    sheets: &["without-flatness", "objectives", "rise", "figures", "dispersion"],
    compute: sheets,
    items: items::ITEMS,
    missions: &["lunar-direct.toml", "lunar-perilune.toml", "lunar-two-phase.toml"],
};

fn sheets(workers: &mut Workers<'_>, hand_on: HandOn<'_>) -> Result<(), Stop> {
    hand_on(splines::without_flatness(workers)?)?;
    hand_on(splines::objectives(workers)?)?;
    hand_on(splines::rise(workers)?)?;
    hand_on(flights::figures(workers)?)?;
    hand_on(flights::dispersion(workers)?)
}

const OWN_METHOD: &[Change<'static>] = &[
    word("method", "flatness"),
    number("flatness.order", 6.0),
    number("flatness.intervals", 10.0),
    number("flatness.points", 15.0),
    word("flatness.placement", "uniform"),
    number("flatness.max_refinements", 0.0),
];

const TABLE_2: PrintedTable = PrintedTable {
    id: "table-2",
    figure: "table-2.svg",
    title: "Table 2: from the circular orbit at 100 km, and from the perilune of a transfer",
    parameter: "initial_altitude_km",
    keys: &[TIME, MASS, ANGLE],
    rows: &[
        row(100.0, &[1036.458, 149.932, 122.853]),
        row(50.0, &[1012.252, 152.384, 127.473]),
        row(25.0, &[1001.326, 153.395, 130.186]),
        row(20.0, &[999.288, 153.575, 130.757]),
        row(15.0, &[997.303, 153.747, 131.337]),
        row(10.0, &[995.371, 153.911, 131.927]),
        PrintedRow {
            parameter: 5.0,
            values: &[993.586, 154.053, 133.528],
            notes: &[
                (
                    TIME,
                    "breaks the trend: the rows from 50 to 10 km fall below the minimum by 0.04 to 0.08 s",
                ),
                (
                    ANGLE,
                    "132.528 likely meant: the other rows exceed the optimum by 0.80 to 0.88 deg, this one by 1.81 deg",
                ),
            ],
        },
    ],
    remarks: &[],
    case: |altitude| {
        if altitude == ORBIT_KM {
            ("lunar-direct", number("orbit_altitude_km", altitude))
        } else {
            ("lunar-perilune", number("perilune_altitude_km", altitude))
        }
    },
    own_method: OWN_METHOD,
    findings: |found, quantities| {
        bounds(quantities);
        time_and_mass(found, quantities);
        Ok(())
    },
};

const TABLE_3: PrintedTable = PrintedTable {
    id: "table-3",
    figure: "table-3.svg",
    title: "Table 3: from a perilune of 15 km to a gate, then upright",
    parameter: "gate_altitude_km",
    keys: &[TIME, BRAKING, DESCENT, GATE_SPEED, MASS],
    rows: &[
        row(5.0, &[1042.956, 959.520, 83.436, -109.201, 147.140]),
        row(4.0, &[1035.662, 963.165, 72.497, -95.115, 148.195]),
        row(3.0, &[1029.202, 967.450, 61.752, -81.685, 149.130]),
        PrintedRow {
            parameter: 2.0,
            values: &[1020.595, 974.204, 46.391, -62.442, 150.376],
            notes: &[(TIME, "near the optimum by coincidence: the differences of the two phases cancel")],
        },
        row(1.0, &[1011.411, 983.827, 27.584, -39.145, 151.705]),
    ],
    remarks: &[
        "No statement of this strategy gives the printed rows: neither the optimum of both phases, nor braking in minimum time \
         to a free or to the printed speed at the gate, nor the paper's own NLP with the same points in each phase.",
        "In upright flight the radius alone is an output, so that the paper's NLP has 47 variables here; with the polar angle as a \
         second one it has 62 and the same times.",
        "Altitude and mass at the gate determine the speed there and the time of an upright descent at full thrust.",
    ],
    case: |gate| ("lunar-two-phase", number("gate_altitude_km", gate)),
    own_method: OWN_METHOD,
    findings: |found, quantities| {
        bounds(quantities);
        time_and_mass(found, quantities);
        upright_descent(found, quantities)
    },
};

const fn row(parameter: f64, values: &'static [f64]) -> PrintedRow {
    PrintedRow { parameter, values, notes: &[] }
}

/// Body and engine of a landing of Table 2 from the circular orbit, or of Table 3.
fn flight(mission: &Pipeline) -> Result<PlanarFlight, Error> {
    let direct = mission.mission_as::<DirectLanding>().map(|m| m.lander.flight);
    let flight = direct.or_else(|| mission.mission_as::<TwoPhaseLanding>().map(|m| m.lander.flight));
    flight.ok_or_else(|| Error::in_mission("the mission is no landing of the tables"))
}

fn remarks() -> Result<Vec<String>, Error> {
    let body = flight(&crate::load("lunar-direct", &[])?)?.body;
    let circular = |altitude: f64| body.orbital_speed(body.radius + altitude, body.radius + altitude);
    Ok(vec![
        format!(
            "The text gives {PRINTED_ORBITAL_SPEED} m/s on the circular orbit at {ORBIT_KM} km; its equation (11) gives \
             {:.2} m/s, and no circular orbit is faster than {:.2} m/s, at the surface. Table 2 was not computed with it.",
            circular(ORBIT_KM * 1e3),
            circular(0.0)
        ),
        "The gravitational parameter of Table 1, 4904.8695 km3/s2, is not that of the Moon (GRAIL: 4902.8001); Table 2 fits the \
         printed one, which is used here."
            .into(),
        "Assumption (a) is a uniform field, equation (4) an inverse-square one, which is used here.".into(),
        "Equation (24) has its denominators misplaced: t(i+k) - t(i) belongs to the first term, t(i+k+1) - t(i+1) with the \
         numerator t(i+k+1) - t to the second. Equation (20) names n + 1 knots where n + 1 plus the order are needed."
            .into(),
        "The arctangents of equations (32) and (37) need the quadrant: all solutions thrust at 90 to 192 deg. Equation (38) is \
         squared and loses the sign of the thrust."
            .into(),
    ])
}

fn quantity<'a>(quantities: &'a mut [Comparison], key: &str) -> Option<&'a mut Comparison> {
    quantities.iter_mut().find(|q| q.key == key)
}

/// Times below the minimum, masses above the largest: at full thrust one is the other.
fn bounds(quantities: &mut [Comparison]) {
    if let Some(time) = quantity(quantities, TIME)
        && let Some(d) = time.paper_difference()
    {
        if d < -ROUNDING {
            let text = format!("printed time below the minimum by {:.3} s: not a feasible trajectory", -d);
            time.find(FindingKind::BelowMinimum, text);
        } else if d > ROUNDING {
            time.find(FindingKind::AboveMinimum, format!("printed time above the minimum by {d:.3} s"));
        }
    }
    if let Some(mass) = quantity(quantities, MASS)
        && let Some(d) = mass.paper_difference()
        && d > ROUNDING
    {
        let text = format!("printed mass above the largest possible by {d:.3} kg");
        mass.find(FindingKind::ImpossibleMass, text);
    }
}

/// Printed mass against printed time: the mass flow is constant.
fn time_and_mass(found: &Solved<'_>, quantities: &mut [Comparison]) {
    let Some(radau) = found.radau else { return };
    let results = &radau.summary.results;
    let (ignition, end, duration) = (results["ignition_mass_kg"], results[MASS], results[TIME]);
    let flow = (ignition - end) / duration;
    let time = quantity(quantities, TIME).map_or(f64::NAN, |q| q.paper);
    let Some(mass) = quantity(quantities, MASS) else { return };
    if (ignition - flow * time - mass.paper).abs() <= ROUNDING * (1.0 + flow) {
        return;
    }
    let of_mass = (ignition - mass.paper) / flow;
    let mut text = format!(
        "printed mass and time disagree: {:.3} kg are left after {of_mass:.3} s, not after {time:.3} s",
        mass.paper
    );
    if let Some(own) = found.own {
        let own = own.summary.results[TIME];
        let likely = if (of_mass - own).abs() < (time - own).abs() { "time" } else { "mass" };
        text += &format!("; the paper's own NLP takes {own:.3} s, so that the {likely} is likely misprinted");
    }
    mass.find(FindingKind::Contradiction, text);
}

/// The printed descent flown from the printed gate, with the mass there that leaves the printed final mass.
fn upright_descent(found: &Solved<'_>, quantities: &mut [Comparison]) -> Result<(), Error> {
    let flight = flight(found.mission)?;
    let mut printed = |key: &str| quantity(quantities, key).map_or(f64::NAN, |q| q.paper);
    let (time, speed, mass) = (printed(DESCENT), printed(GATE_SPEED), printed(MASS));
    let gate = found.printed.parameter * 1e3;
    let end = descend(&flight, gate, speed, mass + flight.engine.mass_flow() * time, time);
    if let Some((altitude, speed)) = end
        && altitude.abs() > TOUCHDOWN_ALTITUDE_M
        && let Some(descent) = quantity(quantities, DESCENT)
    {
        let text = format!(
            "the row contradicts itself: flown upright from the printed gate, speed and mass for the printed time, the vehicle \
             is {altitude:.0} m above the ground at {speed:.2} m/s"
        );
        descent.find(FindingKind::Contradiction, text);
    }
    Ok(())
}

/// Altitude (m) and radial speed (m/s) after `time` of upright full thrust; none if it cannot be flown.
fn descend(flight: &PlanarFlight, altitude: f64, speed: f64, mass: f64, time: f64) -> Option<(f64, f64)> {
    let model = VerticalThrust(*flight);
    let system = FnSystem::new(3, |t, x: &[f64], dx: &mut [f64]| {
        dx.copy_from_slice(&model.rate(t, &[x[0], x[1], x[2]], &[], &[]));
    });
    let mut end = [0.0; 3];
    let begin = [flight.body.radius + altitude, speed, mass];
    let mut integrator = Integrator::new(3, OdeSettings::default()).ok()?;
    let summary = integrator.integrate(&system, 0.0, &begin, time, &mut end).ok()?;
    (summary.status == Status::Completed).then(|| (end[0] - flight.body.radius, end[1]))
}

/// Re-simulated less stated, each at the end of the last phase that has the state.
pub(super) fn miss(outcome: &Outcome) -> Result<Miss, Error> {
    let flown = verify(&outcome.ocp, &outcome.trajectory, &VerifySettings::default())?.simulation;
    let of = |name: &str| {
        let (k, i) = (outcome.ocp.phases.iter().enumerate().rev())
            .find_map(|(k, p)| Some((k, p.states.iter().position(|s| s.variable.name == name)?)))?;
        let end = flown[k].states.rchunks_exact(outcome.ocp.phases[k].states.len()).next()?;
        Some(end[i] - outcome.trajectory.phases[k].final_state()[i])
    };
    Ok(Miss {
        radius_m: of(RADIUS.name).unwrap_or(f64::NAN),
        horizontal_speed_m_s: of(HORIZONTAL_SPEED.name).unwrap_or(f64::NAN),
        radial_speed_m_s: of(RADIAL_SPEED.name).unwrap_or(f64::NAN),
    })
}
