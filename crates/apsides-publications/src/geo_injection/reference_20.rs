//! The sequence that the text compares Table 6 with, its reference [20] (Bortakovskii, Konovalova 2013): which initial mass it has.

use super::along_velocity::burn;
use super::burns::Apsis;
use super::printed::{REFERENCE_20, REFERENCE_20_BURNS, TABLES, USED_MASS};
use super::stage::{Solver, Stage, Stop, keep};
use crate::change::{Change, number, word};
use crate::sheet::Sheet;

/// Steps of the fit, and the difference of its slopes, kg.
const STEPS: usize = 4;
const DIFFERENCE_KG: f64 = 10.0;
/// The vehicle of the sequence.
const MISSION: &str = "geo-5-burn";

/// Eccentricities after burns along the velocity at perigee, each half its time before it, in the printed times.
fn eccentricities(stage: &Stage) -> Result<Vec<f64>, Stop> {
    let (mut orbit, mut mass) = ([stage.parking_radius, 0.0, 0.0], stage.mass);
    let mut found = Vec::new();
    for (_, propellant) in REFERENCE_20_BURNS.iter().take(REFERENCE_20_BURNS.len() - 1) {
        let [p, f, g, _, left] = burn(stage, orbit, Apsis::Perigee, mass, propellant / stage.mass_flow())?;
        // Perigee stays on the first axis: the burn is symmetric to it but for a small turn of the apses.
        (orbit, mass) = ([p, f.hypot(g), 0.0], left);
        found.push(f.hypot(g));
    }
    Ok(found)
}

/// Eccentricities less the printed ones.
fn misses(stage: &Stage) -> Result<Vec<f64>, Stop> {
    Ok(eccentricities(stage)?.iter().zip(REFERENCE_20_BURNS).map(|(e, (printed, _))| e - printed).collect())
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The initial mass that fits the eccentricities best, by least squares.
fn fitted(stage: &Stage) -> Result<Stage, Stop> {
    let mut stage = *stage;
    for _ in 0..STEPS {
        let here = misses(&stage)?;
        let beside = misses(&Stage { mass: stage.mass + DIFFERENCE_KG, ..stage })?;
        let slopes = here.iter().zip(&beside).map(|(a, b)| (b - a) / DIFFERENCE_KG);
        let (with, of) = here.iter().zip(slopes).fold((0.0, 0.0), |(w, o), (d, s)| (w + d * s, o + s * s));
        stage.mass -= with / of;
    }
    Ok(stage)
}

pub(super) fn sheet(used: &Stage, solver: &mut Solver<'_>) -> Result<Sheet, Stop> {
    let columns = [
        ("reference_20_eccentricity", 5),
        ("reference_20_propellant_kg", 1),
        ("along_velocity_fitted_eccentricity", 5),
        ("along_velocity_22170_eccentricity", 5),
        ("table_6_eccentricity", 4),
        ("table_6_propellant_kg", 1),
    ];
    let title = "The sequence of reference [20] beside Table 6: four burns along the velocity at perigee, 20 kN and 6.14 kg/s";
    let mut sheet = Sheet::new("reference-20", title, "burn", &columns);
    let fit = fitted(used);
    let Some(fit) = keep(&mut sheet, fit)? else { return Ok(sheet) };
    let (own, ours) = (eccentricities(&fit)?, eccentricities(used)?);
    let table_6 = TABLES.iter().find(|t| t.number == 6).map_or(&[][..], |t| t.burns);
    for (k, (eccentricity, propellant)) in REFERENCE_20_BURNS.iter().enumerate() {
        let row = table_6.get(k);
        sheet.push(
            format!("{}", k + 1),
            vec![
                Some(*eccentricity),
                Some(*propellant),
                own.get(k).copied(),
                ours.get(k).copied(),
                row.map(|b| b.eccentricity),
                row.map(|b| b.propellant),
            ],
        );
    }
    sheet.findings.push(format!(
        "{:.0} kg at the start give the eccentricities of [20] to {:.1e} (root mean square): that is its initial mass; {USED_MASS} kg give \
         them to {:.1e}",
        fit.mass,
        rms(&misses(&fit)?),
        rms(&misses(used)?)
    ));
    let mass = number("initial_mass_kg", fit.mass);
    let along = [mass, word("steering", "velocity")];
    let ways: [(&str, &[Change<'_>]); 2] =
        [("with optimal steering", &[mass]), ("along the velocity", &along)];
    for (way, changes) in ways {
        let solved = solver.mission(MISSION, changes, None);
        let Some(outcome) = keep(&mut sheet, solved)? else { continue };
        if !outcome.summary.certificate.is_verified() {
            sheet.unverified.push(format!("{MISSION} with {:.0} kg {way}", fit.mass));
        }
        let Some(propellant) = outcome.summary.results.get("propellant_kg") else { continue };
        sheet.findings.push(format!(
            "five burns of {:.0} kg, jointly optimal {way}, take {propellant:.2} kg: the {REFERENCE_20} kg of [20] are {:+.2} kg from it",
            fit.mass,
            REFERENCE_20 - propellant
        ));
    }
    let table: f64 = table_6.iter().map(|b| b.propellant).sum();
    sheet.findings.push(format!(
        "the {:.0} kg by which Table 6 undercuts [20] are the propellant of {:.0} kg less at the start, not of steering",
        REFERENCE_20 - table,
        fit.mass - USED_MASS
    ));
    Ok(sheet)
}
