//! `apsides problems` and `apsides certify`: the gallery, and trajectories of any program judged against a problem.

use std::fmt::Write as _;
use std::path::Path;

use apsides::pipeline::regular_file;
use apsides_ocp::{Ocp, Phase, Sense, Variable};
use apsides_problems::{Evidence, GALLERY, Optimum, find};
use apsides_report::read_samples;
use apsides_verify::{Certificate, CheckKind, Interpolation, Sampled, VerifySettings, sampled, verify};
use serde::Serialize;
use serde_json::json;

use crate::arguments::{CertifyArguments, allowed_memory};
use crate::exit::{Exit, Refusal, refusal};
use crate::output::{certificate, print, print_json, print_words, titles};
use crate::progress::Progress;
use crate::sentence::name;
use crate::speech::is_json;

/// The problem against which a trajectory is judged.
enum Problem {
    Gallery(&'static apsides_problems::Problem, Box<Ocp>),
    Mission(Box<apsides::Pipeline>, Box<Ocp>),
}

/// The answer, as JSON too.
#[derive(Serialize)]
struct Judged {
    problem: String,
    interpolation: &'static str,
    /// Largest distance of the samples from the flight under their controls, relative to scales.
    deviation: f64,
    deviation_at: String,
    objective: f64,
    unit: String,
    /// Largest feasibility check as a multiple of its limit.
    feasible_to: f64,
    /// Largest optimality check as a multiple of its limit; none where none was made.
    optimal_to: Option<f64>,
    reference: Option<Reference>,
    certificate: Certificate,
}

/// The best objective known.
#[derive(Serialize)]
struct Reference {
    value: f64,
    source: String,
    /// The loss of the trajectory, relative to the value; negative where it is better.
    above: f64,
}

pub(crate) fn problems(name: Option<&str>) -> Result<Exit, Refusal> {
    let Some(name) = name else {
        if is_json() {
            let listed = GALLERY.iter().map(|p| json!({ "name": p.name, "title": p.title }));
            print_json(&listed.collect::<Vec<_>>())?;
        } else {
            print_words(&titles(GALLERY.iter().map(|p| (p.name, p.title))));
        }
        return Ok(Exit::Verified);
    };
    let problem = find(name).ok_or_else(|| unknown(name))?;
    let ocp = problem.pose().map_err(refusal)?.ocp;
    let Optimum { value, unit, relative_tolerance, evidence, source } = problem.optimum;
    if is_json() {
        let columns = |phase: &Phase| {
            let states = phase.states.iter().map(|s| &s.variable);
            let of = |v: &Variable| json!({ "name": v.name, "unit": v.unit });
            json!({
                "phase": phase.name,
                "time_unit": phase.time_unit,
                "states": states.map(of).collect::<Vec<_>>(),
                "controls": phase.controls.iter().map(of).collect::<Vec<_>>(),
            })
        };
        print_json(&json!({
            "name": problem.name,
            "title": problem.title,
            "optimum": value,
            "unit": unit,
            "relative_tolerance": relative_tolerance,
            "evidence": words(evidence),
            "source": source,
            "phases": ocp.phases.iter().map(columns).collect::<Vec<_>>(),
        }))?;
        return Ok(Exit::Verified);
    }
    let mut text = format!(
        "{}: {}\n\noptimum   {value} {unit}, to {relative_tolerance:.0e}\n",
        problem.name, problem.title
    );
    let _ = writeln!(text, "evidence  {}\nsource    {source}\n", words(evidence));
    for phase in &ocp.phases {
        let _ = writeln!(text, "phase `{}`, columns of a trajectory: time ({})", phase.name, phase.time_unit);
        for s in &phase.states {
            let _ = writeln!(text, "  state    {} ({})", s.variable.name, s.variable.unit);
        }
        for c in &phase.controls {
            let _ = writeln!(text, "  control  {} ({})", c.name, c.unit);
        }
    }
    print(&text);
    Ok(Exit::Verified)
}

fn words(evidence: Evidence) -> &'static str {
    match evidence {
        Evidence::ClosedForm => "a formula, or quadrature and root finding to double precision",
        Evidence::Published => "a value that one source prints or asserts",
        Evidence::SeveralPrograms => "several programs that agree",
    }
}

fn unknown(name: &str) -> Refusal {
    let names: Vec<_> = GALLERY.iter().map(|p| p.name).collect();
    format!("no problem of the gallery is named `{name}`: {}", names.join(", ")).into()
}

pub(crate) fn certify(a: &CertifyArguments) -> Result<Exit, Refusal> {
    let problem = match find(&a.problem) {
        Some(entry) => Problem::Gallery(entry, Box::new(entry.pose().map_err(refusal)?.ocp)),
        None => {
            let mission = apsides::load(&a.problem, &a.set)
                .map_err(|e| format!("{e} (nor is it a problem of the gallery: see `apsides problems`)"))?;
            let ocp = mission.pose().map_err(refusal)?.flight().clone();
            Problem::Mission(Box::new(mission), Box::new(ocp))
        }
    };
    let judged = judge(a, &problem)?;
    if is_json() {
        print_json(&judged)?;
    } else {
        print_words(&text(&judged));
    }
    Ok(if judged.certificate.is_verified() { Exit::Verified } else { Exit::NotVerified })
}

fn judge(a: &CertifyArguments, problem: &Problem) -> Result<Judged, Refusal> {
    let ocp = match problem {
        Problem::Gallery(_, ocp) | Problem::Mission(_, ocp) => ocp,
    };
    let path: &Path = &a.trajectory;
    let shown = name(&path.to_string_lossy());
    let file = regular_file::read(path).map_err(|e| format!("{shown}: {e}"))?;
    let samples = read_samples(&file[..], ocp).map_err(|e| format!("{shown}: {e}"))?;
    let settings = VerifySettings::default();
    let interpolation = a.interpolation.map(Interpolation::from);
    let Sampled { trajectory, interpolation, deviation, place, checks } =
        sampled(ocp, &samples.phases, &samples.parameters, interpolation, &settings).map_err(refusal)?;
    let certificate = match problem {
        Problem::Gallery(..) => verify(ocp, &trajectory, &settings).map_err(refusal)?.certificate,
        Problem::Mission(mission, _) => mission.verify(&trajectory).map_err(refusal)?,
    };
    let certificate = certificate.with_checks(checks);
    let worst = |kind: CheckKind| {
        let ratios = certificate.checks.iter().filter(|c| c.kind == kind).map(|c| c.value / c.limit);
        ratios.fold(None, |m: Option<f64>, r| Some(m.map_or(r, |m| if r.is_nan() { r } else { m.max(r) })))
    };
    let objective = trajectory.objective;
    let reference = reference(a, problem)?.map(|(value, source)| {
        let sign = if ocp.objective.sense == Sense::Minimize { 1.0 } else { -1.0 };
        let size = if value == 0.0 { 1.0 } else { value.abs() };
        Reference { value, source, above: sign * (objective - value) / size }
    });
    Ok(Judged {
        problem: a.problem.clone(),
        interpolation: interpolation.word(),
        deviation,
        deviation_at: place,
        objective,
        unit: ocp.objective.unit.clone(),
        feasible_to: worst(CheckKind::Feasibility).unwrap_or(f64::NAN),
        optimal_to: worst(CheckKind::Optimality),
        reference,
        certificate,
    })
}

/// The best objective known: of the gallery, or of a solve of the mission.
fn reference(a: &CertifyArguments, problem: &Problem) -> Result<Option<(f64, String)>, Refusal> {
    match problem {
        Problem::Gallery(entry, _) => Ok(Some((entry.optimum.value, entry.optimum.source.to_owned()))),
        Problem::Mission(..) if a.no_reference => Ok(None),
        Problem::Mission(mission, _) => {
            let stop = a.limit.stop();
            let mut progress = Progress::silent(stop);
            let mission = mission.as_ref().clone().with_memory(allowed_memory(a.memory));
            let mission = mission.with_cancellation(stop.cancellation());
            let solved = mission.solve(None, &mut progress).map_err(refusal)?;
            if !solved.summary.certificate.is_verified() {
                return Ok(None);
            }
            let source =
                format!("apsides by {}, {}", solved.summary.method, solved.summary.certificate.verdict);
            Ok(Some((solved.trajectory.objective, source)))
        }
    }
}

fn text(j: &Judged) -> String {
    let mut text = format!("{}: objective {} {}\n", j.problem, j.objective, j.unit);
    let _ = writeln!(
        text,
        "  flown again with {} controls; the samples are {:.1e} of their scale from the flight{}",
        j.interpolation,
        j.deviation,
        if j.deviation_at.is_empty() { String::new() } else { format!(" ({})", j.deviation_at) }
    );
    let _ = writeln!(text, "  feasible to {:.1e} times the limits of the certificate", j.feasible_to);
    if let Some(optimal) = j.optimal_to {
        let _ = writeln!(text, "  optimal to {optimal:.1e} times the limits of the certificate");
    }
    if let Some(r) = &j.reference {
        let (amount, word) = (100.0 * r.above.abs(), if r.above < 0.0 { "better" } else { "worse" });
        let _ = writeln!(text, "  {amount:.2e} % {word} than {} {} ({})", r.value, j.unit, r.source);
    }
    text + "\n" + &certificate(&j.certificate)
}
