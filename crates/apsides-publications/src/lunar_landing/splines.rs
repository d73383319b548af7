//! The paper's splines with and without flatness, and both objectives: unknowns, work, and where the solutions lead when they are flown.

use apsides_ocp::Trajectory;

use super::{OWN_METHOD, miss};
use crate::change::{Change, flag, number, word};
use crate::sheet::Sheet;
use crate::stop::{Stop, ended, keep, solved};
use crate::workers::Workers;
use crate::{Miss, Outcome};

/// Solves of which the shortest counts: times vary by what else runs.
const REPEATS: usize = 3;

/// A landing of Table 2 or 3.
type Landing = (&'static str, &'static str, &'static [Change<'static>]);

const LANDINGS: [Landing; 3] = [
    ("from 100 km", "lunar-direct", &[]),
    ("from a perilune at 15 km", "lunar-perilune", &[]),
    ("to a gate at 2 km", "lunar-two-phase", &[]),
];

/// Least time of several solves from a start, ms, and the last one. The paper's programs end without a trajectory between their points, which is
/// no failure of theirs.
fn timed(
    mission: &str,
    changes: &[Change<'_>],
    start: Option<&Trajectory>,
    repeats: usize,
    workers: &mut Workers<'_>,
) -> Result<(f64, Outcome), Stop> {
    let loaded = crate::load(mission, changes)?.with_threads(1);
    let mut solve = || {
        let outcome = loaded.solve(start, &mut *workers.observer)?;
        ended(mission, "the program", outcome.status)?;
        Ok::<_, Stop>(outcome)
    };
    let mut outcome = solve()?;
    let mut least = outcome.summary.timing_ms.solve;
    for _ in 1..repeats {
        outcome = solve()?;
        least = least.min(outcome.summary.timing_ms.solve);
    }
    Ok((least, outcome))
}

fn time_of(outcome: &Outcome) -> f64 {
    outcome.summary.results.get("flight_time_s").copied().unwrap_or(f64::NAN)
}

/// The same curves with the flat outputs alone as unknowns, and with all states and the thrust angle.
pub(super) fn without_flatness(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "without-flatness",
        "The paper's splines (order 6, 10 segments, 15 points) with flat outputs, and with all states and the thrust angle as splines",
        "landing, unknowns",
        &[
            ("variables", 0),
            ("constraints", 0),
            ("iterations", 0),
            ("solve_ms", 2),
            ("flight_time_s", 4),
            ("less_optimum_s", 4),
            ("miss_radius_m", 1),
            ("miss_horizontal_speed_m_s", 3),
            ("miss_radial_speed_m_s", 3),
        ],
    );
    let (mut ratios, mut failed_from_guess) = (Vec::new(), Vec::new());
    for (label, mission, changes) in LANDINGS {
        let optimum = solved(mission, changes, workers.threads, None, &mut *workers.observer);
        let Some((_, optimum)) = keep(&mut sheet, optimum)? else { continue };
        let mut work = Vec::new();
        for (name, outputs) in [("flat outputs", "flat"), ("all states", "all")] {
            let own: Vec<Change<'_>> = changes
                .iter()
                .chain(OWN_METHOD)
                .copied()
                .chain([word("flatness.outputs", outputs)])
                .collect();
            let found = match timed(mission, &own, None, REPEATS, workers) {
                // From the guess of the mission it may not converge: from the optimum.
                Err(Stop::NotSolved(_)) => {
                    failed_from_guess.push(format!("{label}, {name}"));
                    timed(mission, &own, Some(&optimum.trajectory), REPEATS, workers)
                }
                found => found,
            };
            let (ms, outcome) = match found {
                Err(Stop::NotSolved(why)) => {
                    sheet.push(format!("{label}, {name}"), vec![None; sheet.columns.len()]);
                    sheet.findings.push(format!("{label}, {name}: not from the optimum either: {why}"));
                    continue;
                }
                found => found?,
            };
            let counters = outcome.summary.counters;
            let Miss { radius_m, horizontal_speed_m_s, radial_speed_m_s } = miss(&outcome)?;
            sheet.push(
                format!("{label}, {name}"),
                vec![
                    Some(counters.variables as f64),
                    Some(counters.constraints as f64),
                    Some(counters.iterations as f64),
                    Some(ms),
                    Some(time_of(&outcome)),
                    Some(time_of(&outcome) - time_of(&optimum)),
                    Some(radius_m),
                    Some(horizontal_speed_m_s).filter(|v| v.is_finite()),
                    Some(radial_speed_m_s),
                ],
            );
            work.push((ms, counters.iterations as f64, radius_m.abs()));
        }
        if let [flat, all] = work[..] {
            ratios.push((label, all.0 / flat.0, all.1 / flat.1, [flat.2, all.2]));
        }
    }
    for (label, time, iterations, [flat, all]) in &ratios {
        sheet.findings.push(format!(
            "{label}: without flatness {time:.1} times the time and {iterations:.1} times the iterations; flown again it misses the surface by \
             {all:.1} m, with flat outputs by {flat:.1} m"
        ));
    }
    if !failed_from_guess.is_empty() {
        sheet.findings.push(format!(
            "from the guess of the mission these do not converge, and are solved from the optimum: {}",
            failed_from_guess.join("; ")
        ));
    }
    if !ratios.is_empty() {
        let faster = ratios.iter().filter(|r| r.1 > 1.0).count();
        sheet.findings.push(format!(
            "the claim that flatness makes the program smaller holds (31 and 22 beside 76 and 67); that it is solved faster holds in {faster} of \
             {} landings here, where both programs take milliseconds; neither is a trajectory between its points",
            ratios.len()
        ));
    }
    Ok(sheet)
}

/// (8) and (9): least flight time and largest final mass, by the paper's program and by collocation.
pub(super) fn objectives(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "objectives",
        "Objectives (8) and (9): the same optimum by least flight time and by largest final mass",
        "landing, method, objective",
        &[("iterations", 0), ("solve_ms", 2), ("flight_time_s", 7), ("final_mass_kg", 7)],
    );
    let mut apart = 0.0_f64;
    let mut iterations = Vec::new();
    for (label, mission, changes) in LANDINGS {
        for (method, own) in [("the paper's NLP", OWN_METHOD), ("collocation", &[])] {
            let mut times = Vec::new();
            for (name, objective) in [("flight time", "flight-time"), ("final mass", "final-mass")] {
                let all: Vec<Change<'_>> =
                    changes.iter().chain(own).copied().chain([word("optimum_of", objective)]).collect();
                let found = timed(mission, &all, None, REPEATS, workers);
                let Some((ms, outcome)) = keep(&mut sheet, found)? else { continue };
                let mass = outcome.summary.results.get("final_mass_kg").copied();
                let count = outcome.summary.counters.iterations as f64;
                sheet.push(
                    format!("{label}, {method}, {name}"),
                    vec![Some(count), Some(ms), Some(time_of(&outcome)), mass],
                );
                times.push((time_of(&outcome), count));
            }
            if let [time, mass] = times[..] {
                apart = apart.max((time.0 - mass.0).abs());
                iterations.push((time.1, mass.1));
            }
        }
    }
    let sum = |of: fn(&(f64, f64)) -> f64| iterations.iter().map(of).sum::<f64>();
    sheet.findings.push(format!(
        "both objectives have the same optimum: flight times agree to {apart:.0e} s; iterations in all: {:.0} with the flight time, {:.0} with \
         the final mass, {} the paper's claim that the flight time converges better",
        sum(|i| i.0),
        sum(|i| i.1),
        if sum(|i| i.0) < sum(|i| i.1) { "which supports" } else { "which does not support" }
    ));
    Ok(sheet)
}

/// Perilunes of the sheet, km.
const PERILUNES_KM: [f64; 4] = [5.0, 15.0, 25.0, 50.0];
/// A rise that counts as none, m.
const NO_RISE_M: f64 = 1.0;
/// The first upper bound of the impulse, m/s, and bisections down from it.
const FIRST_IMPULSE_M_S: f64 = 64.0;
const BISECTIONS: usize = 10;
/// Start of a search for the best impulse among large ones, m/s.
const LARGE_IMPULSE_M_S: f64 = 1000.0;

/// The impulse with which the perilune is left so that the path does not rise, and what it costs.
pub(super) fn rise(workers: &mut Workers<'_>) -> Result<Sheet, Stop> {
    let mut sheet = Sheet::new(
        "rise",
        "The rise at first, and the impulse against the motion that removes it, by the altitude of the perilune",
        "perilune (km)",
        &[
            ("rise_m", 1),
            ("impulse_m_s", 2),
            ("propellant_kg", 4),
            ("propellant_with_impulse_kg", 4),
            ("price_kg", 4),
            ("flight_time_s", 3),
            ("flight_time_with_impulse_s", 3),
            ("best_impulse_m_s", 2),
            ("propellant_with_best_impulse_kg", 4),
            ("best_is_verified", 0),
        ],
    )
    .with_flags(&["best_is_verified"]);
    let rows = workers.all(&PERILUNES_KM, |&perilune, observer| {
        let mut start = None;
        let mut solve = |impulse: f64| {
            let changes =
                [number("perilune_altitude_km", perilune), number("departure_impulse_m_s", impulse)];
            let (_, outcome) = solved("lunar-perilune", &changes, 1, start.as_ref(), &mut *observer)?;
            start = Some(outcome.trajectory.clone());
            let of = |key: &str| outcome.summary.results.get(key).copied().unwrap_or(f64::NAN);
            let rise = 1e3 * (of("max_altitude_km") - perilune);
            Ok::<_, Stop>([rise, of("propellant_kg"), of("flight_time_s")])
        };
        let without = solve(0.0)?;
        let mut upper = FIRST_IMPULSE_M_S;
        while solve(upper)?[0] > NO_RISE_M {
            upper *= 2.0;
        }
        let mut lower = 0.0;
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (lower + upper);
            if solve(middle)?[0] > NO_RISE_M { lower = middle } else { upper = middle }
        }
        let removed = solve(upper)?;
        // The size of the impulse as an unknown, for the mass at touchdown with the propellant of the impulse counted.
        let mut best = |start: f64| {
            let changes = [
                number("perilune_altitude_km", perilune),
                number("departure_impulse_m_s", start),
                flag("free_departure_impulse", true),
            ];
            let (_, best) = solved("lunar-perilune", &changes, 1, None, &mut *observer)?;
            let of = |key: &str| best.summary.results.get(key).copied().unwrap_or(f64::NAN);
            let verified = best.summary.certificate.is_verified();
            Ok::<_, Stop>(([of("departure_impulse_m_s"), of("propellant_kg")], verified))
        };
        // Small impulses and large ones have an optimum each.
        let (from_none, from_removal, from_large) = (best(0.0)?, best(upper)?, best(LARGE_IMPULSE_M_S)?);
        let least = if from_large.0[1] < from_removal.0[1] { from_large } else { from_removal };
        Ok((without, upper, removed, from_none.0[0], least))
    })?;
    let mut prices = Vec::new();
    for (perilune, row) in PERILUNES_KM.iter().zip(rows) {
        match row {
            Ok(([rise, propellant, time], impulse, [_, with, with_time], near_none, best)) => {
                let ([size, least], verified) = best;
                let price = with - propellant;
                let proved = f64::from(u8::from(verified));
                let values = [rise, impulse, propellant, with, price, time, with_time, size, least, proved];
                sheet.push(format!("{perilune}"), values.map(Some).to_vec());
                if !verified {
                    sheet.unverified.push(format!("perilune at {perilune} km, best impulse"));
                }
                prices.push((perilune, rise, impulse, price, size, least - propellant, near_none));
            }
            Err(why) => sheet.failures.push(why),
        }
    }
    for (perilune, rise, impulse, price, size, gain, near_none) in prices {
        let removal = if rise <= NO_RISE_M {
            "the path does not rise".to_owned()
        } else {
            format!(
                "the path rises by {rise:.0} m; {impulse:.1} m/s against the motion remove the rise and change the propellant by {price:+.3} kg, \
                 the impulse being without losses"
            )
        };
        sheet.findings.push(format!(
            "perilune at {perilune} km: {removal}; the best impulse for the mass at touchdown is {size:.1} m/s, {gain:+.3} kg of propellant; a search \
             from none ends at {near_none:.1} m/s"
        ));
    }
    Ok(sheet)
}
