//! The certificate: named checks with value, limit, margin, unit and place.

use serde::{Deserialize, Serialize};

/// What a check speaks of.
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
    /// What is checked, for instance `re-simulated radius at the end`.
    pub name: String,
    /// Feasibility or optimality.
    pub kind: CheckKind,
    /// The measured violation or residual, not negative; a NaN fails.
    pub value: f64,
    /// Largest value allowed.
    pub limit: f64,
    /// `limit - value`.
    pub margin: f64,
    /// Unit of value, limit and margin.
    pub unit: String,
    /// Where the largest value stands: phase and time.
    pub at: String,
    /// Whether the value is within the limit.
    pub passed: bool,
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

/// What the checks amount to. Nothing here speaks of a global optimum.
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
    /// What the checks amount to.
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

    /// Whether feasibility and local optimality are verified.
    #[must_use]
    pub fn is_verified(&self) -> bool {
        self.verdict == Verdict::LocalOptimum
    }
}
