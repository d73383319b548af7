//! The certificate: named checks with value, limit, margin, unit and place.

use serde::{Deserialize, Deserializer, Serialize};

/// The name of the check of the minimum principle, before that of the phase.
pub(crate) const LEAST_HAMILTONIAN: &str = "least Hamiltonian among all admissible controls";

/// The remark where the second variation has no sign that can be told.
pub(crate) const NO_CURVATURE: &str = "first order only: along some change that the active constraints allow the second variation is zero, or too small to tell";

/// The place of a remark where controls are singular from the start of a phase to its end.
pub(crate) const THROUGHOUT: &str = "throughout phase";

/// The property of a trajectory that a check concerns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CheckKind {
    /// The trajectory can be flown and meets every constraint.
    Feasibility,
    /// The first-order conditions hold: Pontryagin's minimum principle.
    Optimality,
    /// The second-order necessary condition holds: no admissible change has negative curvature.
    Curvature,
    /// The second-order sufficient conditions hold: the second variation is positive on all admissible changes.
    Strictness,
    /// The problem is convex: an extremal is a global optimum.
    Convexity,
}

/// One verified property: `value <= limit`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// Name of the quantity that is checked, for instance `re-simulated radius at the end`.
    pub name: String,
    /// Feasibility or optimality.
    pub kind: CheckKind,
    /// The measured violation or residual, not negative; a NaN fails.
    #[serde(deserialize_with = "number")]
    pub value: f64,
    /// Largest value allowed.
    #[serde(deserialize_with = "number")]
    pub limit: f64,
    /// `limit - value`.
    #[serde(deserialize_with = "number")]
    pub margin: f64,
    /// Unit of value, limit and margin.
    pub unit: String,
    /// Phase and time of the largest value.
    pub at: String,
    /// True if the value is within the limit.
    pub passed: bool,
}

/// A number; JSON writes NaN and infinity as `null`, which is read as NaN.
fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

impl Check {
    /// A check of `value <= limit`.
    #[must_use]
    pub fn new(
        name: impl Into<String>,
        kind: CheckKind,
        value: f64,
        limit: f64,
        unit: impl Into<String>,
        at: impl Into<String>,
    ) -> Self {
        Self {
            name: name.into(),
            kind,
            value,
            limit,
            margin: limit - value,
            unit: unit.into(),
            at: at.into(),
            passed: value <= limit,
        }
    }
}

/// The conclusion from all checks, from the weakest to the strongest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// At least one requirement of the problem is not met.
    Rejected,
    /// Every requirement is met; the conditions of an optimum were not met or could not be checked.
    Feasible,
    /// Feasible, and Pontryagin's minimum principle holds over the whole control set; no negative curvature was found.
    Extremal,
    /// Extremal, and the second-order sufficient conditions hold: better than every trajectory near it.
    StrictLocalOptimum,
    /// Not worse than any admissible trajectory: an extremal of a convex problem.
    GlobalOptimum,
}

impl Verdict {
    /// The word of the verdict, the same in text, JSON and Rust.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Rejected => "rejected",
            Self::Feasible => "feasible",
            Self::Extremal => "extremal",
            Self::StrictLocalOptimum => "strict-local-optimum",
            Self::GlobalOptimum => "global-optimum",
        }
    }

    /// One sentence that says what the word means.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Rejected => "At least one requirement of the problem is not met.",
            Self::Feasible => "Every requirement is met; optimality is not shown.",
            Self::Extremal => {
                "Every requirement is met and Pontryagin's minimum principle holds over the whole control set; \
                 second-order sufficient conditions are not shown."
            }
            Self::StrictLocalOptimum => {
                "Every requirement is met, Pontryagin's minimum principle holds over the whole control set, and the second \
                 variation is positive: no trajectory near it is as good."
            }
            Self::GlobalOptimum => {
                "Every requirement is met, Pontryagin's minimum principle holds and the problem is convex: no trajectory is \
                 better."
            }
        }
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.word())
    }
}

/// A conclusion that holds among a part of the admissible controls, where it does not among all of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// The controls among which it holds, for instance `controls constant on each of 30 intervals`.
    pub among: String,
    /// The conclusion, of these controls.
    pub verdict: Verdict,
    /// The checks of optimality among them.
    pub checks: Vec<Check>,
}

impl Claim {
    /// The claim in a few words.
    #[must_use]
    pub fn words(&self) -> String {
        format!("{} among {}", self.verdict, self.among)
    }
}

/// The result of a verification.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// The conclusion from all checks.
    pub verdict: Verdict,
    /// Every check made.
    pub checks: Vec<Check>,
    /// Reasons why the verdict is not a stronger one, where no failed check says it.
    #[serde(default)]
    pub remarks: Vec<String>,
    /// The conclusion among controls of the trajectory's own kind, where the verdict is less than `extremal`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub claim: Option<Claim>,
}

impl Certificate {
    /// Draws the verdict from the checks.
    #[must_use]
    pub fn new(checks: Vec<Check>) -> Self {
        let all = |kind| checks.iter().filter(|c| c.kind == kind).all(|c| c.passed);
        let any = |kind| checks.iter().any(|c| c.kind == kind);
        let verdict = if !any(CheckKind::Feasibility) || !all(CheckKind::Feasibility) {
            Verdict::Rejected
        } else if !any(CheckKind::Optimality) || !all(CheckKind::Optimality) || !all(CheckKind::Curvature) {
            Verdict::Feasible
        } else if any(CheckKind::Convexity) && all(CheckKind::Convexity) {
            Verdict::GlobalOptimum
        } else if any(CheckKind::Curvature) && any(CheckKind::Strictness) && all(CheckKind::Strictness) {
            Verdict::StrictLocalOptimum
        } else {
            Verdict::Extremal
        };
        Self { verdict, checks, remarks: Vec::new(), claim: None }
    }

    /// The certificate with further checks, for instance those of a mission; the verdict is drawn again.
    #[must_use]
    pub fn with_checks(self, checks: impl IntoIterator<Item = Check>) -> Self {
        Self::new(self.checks.into_iter().chain(checks).collect())
            .with_remarks(self.remarks)
            .with_claim(self.claim)
    }

    /// The same with a claim.
    #[must_use]
    pub(crate) fn with_claim(self, claim: Option<Claim>) -> Self {
        Self { claim, ..self }
    }

    /// The same with remarks.
    #[must_use]
    pub fn with_remarks(self, remarks: impl IntoIterator<Item = String>) -> Self {
        Self { remarks: remarks.into_iter().collect(), ..self }
    }

    /// The verdict in words, with the claim where there is one.
    #[must_use]
    pub fn words(&self) -> String {
        let claim = self.claim.as_ref().map(|c| format!("; {}", c.words()));
        format!("{}{}", self.verdict, claim.unwrap_or_default())
    }

    /// The checks that failed.
    pub fn failures(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|c| !c.passed)
    }

    /// Returns true if the trajectory is feasible and what it fails by shows a better one: a control with a smaller Hamiltonian, or a change
    /// of negative curvature, where all else of an extremal holds.
    #[must_use]
    pub fn names_something_better(&self) -> bool {
        let names_it = |c: &Check| match c.kind {
            CheckKind::Curvature => true,
            CheckKind::Optimality => c.name.starts_with(LEAST_HAMILTONIAN),
            _ => false,
        };
        self.verdict == Verdict::Feasible && self.failures().count() > 0 && self.failures().all(names_it)
    }

    /// Returns true if the trajectory is an extremal that may be a saddle: some change has no curvature that can be told, or controls that could move are
    /// singular from the start of a phase to its end, as where a symmetry is kept.
    #[must_use]
    pub fn leaves_open_a_saddle(&self) -> bool {
        let leaves_it_open = |remark: &String| remark == NO_CURVATURE || remark.contains(THROUGHOUT);
        self.verdict == Verdict::Extremal && self.remarks.iter().any(leaves_it_open)
    }

    /// Returns true if the trajectory is feasible and at least an extremal, of all controls or of those that its claim names.
    #[must_use]
    pub fn is_verified(&self) -> bool {
        let claimed = self.claim.as_ref().is_some_and(|c| c.verdict >= Verdict::Extremal);
        self.verdict >= Verdict::Extremal || self.verdict == Verdict::Feasible && claimed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(kind: CheckKind, value: f64) -> Check {
        Check::new("name", kind, value, 1.0, "m", "here")
    }

    #[test]
    fn the_verdict_follows_from_the_checks() {
        let (feasible, optimal) = (CheckKind::Feasibility, CheckKind::Optimality);
        let (curved, strict) = (CheckKind::Curvature, CheckKind::Strictness);
        let cases = [
            (vec![], Verdict::Rejected),
            (vec![check(optimal, 0.0)], Verdict::Rejected),
            (vec![check(feasible, 1.0)], Verdict::Feasible),
            (vec![check(feasible, 1.0), check(optimal, 1.0)], Verdict::Extremal),
            (vec![check(feasible, 1.0), check(optimal, 1.1)], Verdict::Feasible),
            (vec![check(feasible, 0.0), check(optimal, 0.0), check(curved, 2.0)], Verdict::Feasible),
            (vec![check(feasible, 0.0), check(optimal, 0.0), check(curved, 0.0)], Verdict::Extremal),
            (
                vec![check(feasible, 0.0), check(optimal, 0.0), check(curved, 0.0), check(strict, 0.0)],
                Verdict::StrictLocalOptimum,
            ),
            (vec![check(feasible, 0.0), check(optimal, 2.0), check(strict, 0.0)], Verdict::Feasible),
            (vec![check(feasible, f64::NAN), check(optimal, 0.0)], Verdict::Rejected),
            (vec![check(feasible, 0.0), check(optimal, f64::NAN)], Verdict::Feasible),
        ];
        for (checks, verdict) in cases {
            let certificate = Certificate::new(checks);
            assert_eq!(certificate.verdict, verdict, "{certificate:?}");
            assert_eq!(certificate.is_verified(), verdict >= Verdict::Extremal);
        }
    }

    #[test]
    fn json_keeps_a_failed_nan() {
        let certificate = Certificate::new(vec![check(CheckKind::Feasibility, f64::NAN)]);
        let text = serde_json::to_string(&certificate).expect("serialisable");
        assert!(text.contains(r#""verdict":"rejected""#) && text.contains(r#""value":null"#), "{text}");
        let read: Certificate = serde_json::from_str(&text).expect("readable");
        assert!(read.checks[0].value.is_nan() && !read.checks[0].passed);
        assert_eq!(read.failures().count(), 1);
    }
}
