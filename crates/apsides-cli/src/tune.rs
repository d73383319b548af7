//! `apsides tune`.

use std::fmt::Write as _;
use std::time::Duration;

use apsides::missions::moving_mass::{
    DampingSet, LeastMargins, RequiredMargins, SetFlight, Tuned, TunedGains, Tuning, case, tune as search,
};
use apsides_report::replace;
use serde_json::json;

use crate::arguments::TuneArguments;
use crate::commands::{claim, probe_directory};
use crate::exit::{Exit, Refusal, refusal};
use crate::output::{print, print_json, print_words, warn, written};
use crate::speech::is_json;
use crate::stop::LONGEST;

/// Name of the file.
const MISSION: &str = "mission.toml";

pub(crate) fn tune(a: &TuneArguments) -> Result<Exit, Refusal> {
    let mission = a.mission.load()?.with_seed(a.seed);
    let case = case(&mission).map_err(refusal)?;
    if a.entry_attack_deg.iter().any(|attack| !attack.is_finite()) {
        return Err("--entry-attack-deg: finite angles are needed".into());
    }
    let required = [
        ("--least-gain-margin", a.least_gain_margin),
        ("--least-phase-margin-deg", a.least_phase_margin_deg),
        ("--least-delay-margin-s", a.least_delay_margin_s),
    ];
    if let Some((name, _)) = required.iter().find(|(_, value)| !(0.0..f64::INFINITY).contains(value)) {
        return Err(format!("{name}: a finite number from 0 on is needed").into());
    }
    let mut tuning = Tuning::new(&case);
    tuning.required = RequiredMargins {
        gain: a.least_gain_margin,
        phase: a.least_phase_margin_deg.to_radians(),
        delay: a.least_delay_margin_s,
    };
    tuning.set.directions = a.directions as usize;
    tuning.set.attacks = a.entry_attack_deg.iter().map(|attack| attack.to_radians()).collect();
    if a.all_damping {
        tuning.set = tuning.set.with_all_damping();
    }
    (tuning.evaluations, tuning.threads, tuning.seed) = (a.evaluations as usize, a.threads.count(), a.seed);
    if let Some(dir) = &a.out {
        // Before the work, not after it.
        probe_directory(dir)?;
    }
    let _lock = a.out.as_deref().map(claim).transpose()?;
    tuning.time_limit = a.limit.time_limit.map(|limit| Duration::from_secs_f64(limit.min(LONGEST)));
    let found = search(&case, &tuning).map_err(refusal)?;
    let keys = keys(&found);
    let robust = tuning.required.met_by(&found.margins);
    if is_json() {
        print_json(&object(&mission, &found, robust))?;
    } else {
        print_words(&text(&mission, &found, robust, &keys));
    }
    if let Some(dir) = &a.out {
        let mut overrides = a.mission.set.clone();
        overrides.push(format!("law={}", found.gains.law().word()));
        overrides.extend(keys);
        let tuned = apsides::load(&a.mission.mission, &overrides).map_err(refusal)?;
        let files = replace(dir, &[(MISSION, Some(tuned.to_file().into_bytes()))])?;
        if !is_json() {
            print(&written(&files));
        }
    }
    let late = found.ended_by_time();
    if late {
        warn("the time limit (--time-limit) is over: these are the best gains so far");
    }
    Ok(if found.held() && robust && !late { Exit::Verified } else { Exit::NotSolved })
}

/// Gains as `--set` takes them.
fn keys(found: &Tuned) -> Vec<String> {
    let angles = ["attack", "sideslip"];
    match found.gains {
        TunedGains::Linear(g) => {
            let gains = [("p", g.proportional), ("i", g.integral), ("d", g.derivative)];
            angles
                .into_iter()
                .flat_map(|angle| gains.map(|(name, value)| format!("pid.{angle}_{name}={value}")))
                .collect()
        }
        TunedGains::Nonlinear(c) => {
            let twelve: Vec<String> = c.iter().map(f64::to_string).collect();
            angles.map(|angle| format!("nonlinear_pid.{angle}={}", twelve.join(" "))).into()
        }
    }
}

fn word(damping: DampingSet) -> &'static str {
    match damping {
        DampingSet::Constant => "constant",
        DampingSet::Unstable => "unstable",
    }
}

fn text(mission: &apsides::Pipeline, found: &Tuned, robust: bool, keys: &[String]) -> String {
    let held = found.flights.iter().filter(|f| f.metrics.held()).count();
    let mut text = format!(
        "gains of {} after {} sets of descents: {held} of {} held\n\n",
        mission.name(),
        found.evaluations,
        found.flights.len()
    );
    let _ = writeln!(
        text,
        "  {:>9}  {:>9}  {:>9}  {:<8}  {:>11}  {:>11}  {:>11}",
        "offset y", "offset z", "attack", "damping", "RMS", "peak", "saturated"
    );
    let _ = writeln!(
        text,
        "  {:>9}  {:>9}  {:>9}  {:<8}  {:>11}  {:>11}  {:>11}",
        "cm", "cm", "deg", "", "deg", "deg", "s"
    );
    for f in &found.flights {
        let m = &f.metrics;
        let _ = writeln!(
            text,
            "  {:>9.4}  {:>9.4}  {:>9.3}  {:<8}  {:>11.3e}  {:>11.3e}  {:>11.2}",
            1e2 * f.offset[0],
            1e2 * f.offset[1],
            f.attack.to_degrees(),
            word(f.damping),
            m.worst_rms().to_degrees(),
            m.worst_peak().to_degrees(),
            m.saturated_time
        );
    }
    if let Some(worst) = found.worst() {
        let _ = writeln!(
            text,
            "\nworst RMS {:.3e} deg; in the directions alone {:.3e} deg",
            worst.metrics.worst_rms().to_degrees(),
            found.worst_rms_of_directions().to_degrees()
        );
    }
    let m = &found.margins;
    let _ = writeln!(
        text,
        "margins at {} kPa and more: gain {:.2}, phase {:.1} deg, delay {:.4} s{}",
        LeastMargins::PRESSURE / 1e3,
        m.gain,
        m.phase.to_degrees(),
        m.delay,
        match (m.stable, robust) {
            (false, _) => "; a linear loop is not stable",
            (_, false) => "; less than required",
            _ => "",
        }
    );
    let _ = writeln!(text, "\n{}", keys.iter().map(|k| format!("  --set {k}\n")).collect::<String>());
    text
}

fn object(mission: &apsides::Pipeline, found: &Tuned, robust: bool) -> serde_json::Value {
    let flight = |f: &SetFlight| {
        json!({
            "offset_m": f.offset,
            "attack_deg": f.attack.to_degrees(),
            "damping": word(f.damping),
            "held": f.metrics.held(),
            "rms_deg": f.metrics.worst_rms().to_degrees(),
            "peak_deg": f.metrics.worst_peak().to_degrees(),
            "saturated_s": f.metrics.saturated_time,
        })
    };
    json!({
        "mission": mission.name(),
        "held": found.held(),
        "gains": match found.gains {
            TunedGains::Linear(g) => json!({"p": g.proportional, "i": g.integral, "d": g.derivative}),
            TunedGains::Nonlinear(c) => json!({"coefficients": c}),
        },
        "worst_rms_deg": found.worst().map(|f| f.metrics.worst_rms().to_degrees()),
        "worst_rms_of_directions_deg": found.worst_rms_of_directions().to_degrees(),
        "margins": {
            "robust": robust,
            "stable": found.margins.stable,
            "gain": found.margins.gain,
            "phase_deg": found.margins.phase.to_degrees(),
            "delay_s": found.margins.delay,
        },
        "evaluations": found.evaluations,
        "flights": found.flights.iter().map(flight).collect::<Vec<_>>(),
    })
}
