//! The certificate: named checks with value, limit, margin, unit and place.

use serde::{Deserialize, Deserializer, Serialize};

/// The property of a trajectory that a check concerns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CheckKind {
    /// The trajectory can be flown and meets every constraint.
    Feasibility,
    /// First-order conditions of a local optimum hold.
    Optimality,
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

/// The conclusion from all checks. None of them claims a global optimum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Feasible, and the first-order conditions of a local optimum hold.
    LocalOptimum,
    /// Feasible; the optimality conditions were not met or could not be checked.
    Feasible,
    /// At least one feasibility check failed.
    Rejected,
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::LocalOptimum => "verified local optimum",
            Self::Feasible => "feasible, optimality not verified",
            Self::Rejected => "rejected",
        })
    }
}

/// The result of a verification.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// The conclusion from all checks.
    pub verdict: Verdict,
    /// Every check made.
    pub checks: Vec<Check>,
}

impl Certificate {
    /// Draws the verdict from the checks.
    #[must_use]
    pub fn new(checks: Vec<Check>) -> Self {
        let all = |kind| checks.iter().filter(|c| c.kind == kind).all(|c| c.passed);
        let any = |kind| checks.iter().any(|c| c.kind == kind);
        let verdict = if !any(CheckKind::Feasibility) || !all(CheckKind::Feasibility) {
            Verdict::Rejected
        } else if any(CheckKind::Optimality) && all(CheckKind::Optimality) {
            Verdict::LocalOptimum
        } else {
            Verdict::Feasible
        };
        Self { verdict, checks }
    }

    /// The checks that failed.
    pub fn failures(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|c| !c.passed)
    }

    /// Returns true if feasibility and local optimality are verified.
    #[must_use]
    pub fn is_verified(&self) -> bool {
        self.verdict == Verdict::LocalOptimum
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
        let cases = [
            (vec![], Verdict::Rejected),
            (vec![check(optimal, 0.0)], Verdict::Rejected),
            (vec![check(feasible, 1.0)], Verdict::Feasible),
            (vec![check(feasible, 1.0), check(optimal, 1.0)], Verdict::LocalOptimum),
            (vec![check(feasible, 1.0), check(optimal, 1.1)], Verdict::Feasible),
            (vec![check(feasible, f64::NAN), check(optimal, 0.0)], Verdict::Rejected),
            (vec![check(feasible, 0.0), check(optimal, f64::NAN)], Verdict::Feasible),
        ];
        for (checks, verdict) in cases {
            let certificate = Certificate::new(checks);
            assert_eq!(certificate.verdict, verdict, "{certificate:?}");
            assert_eq!(certificate.is_verified(), verdict == Verdict::LocalOptimum);
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
