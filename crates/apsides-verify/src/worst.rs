//! One check for a group: the member that exceeds its limit most, or comes closest to it.

use crate::{Check, CheckKind};

/// The worst member of a group so far, by excess over limit.
#[derive(Default)]
pub(crate) struct Worst {
    member: Option<Member>,
}

struct Member {
    excess: f64,
    limit: f64,
    unit: String,
    at: String,
}

/// Returns true if `candidate` is worse than `current`; a NaN is worse than any number.
pub(crate) fn is_worse(candidate: f64, current: f64) -> bool {
    !current.is_nan() && (candidate.is_nan() || candidate > current)
}

/// `max(0, excess)` that keeps a NaN.
pub(crate) fn violation(excess: f64) -> f64 {
    if excess <= 0.0 { 0.0 } else { excess }
}

/// `value / scale`, zero for a zero value whatever the scale.
pub(crate) fn relative(value: f64, scale: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value / scale }
}

impl Worst {
    /// Adds a member: `excess` (negative inside its bounds) and its positive `limit`, both in `unit`.
    pub(crate) fn consider(&mut self, excess: f64, limit: f64, unit: &str, at: impl FnOnce() -> String) {
        let rank = excess / limit;
        if self.member.as_ref().is_none_or(|m| is_worse(rank, m.excess / m.limit)) {
            self.member = Some(Member { excess, limit, unit: unit.into(), at: at() });
        }
    }

    /// The check of the group; none if it has no member.
    pub(crate) fn into_check(self, name: impl Into<String>, kind: CheckKind) -> Option<Check> {
        let m = self.member?;
        Some(Check::new(name, kind, violation(m.excess), m.limit, m.unit, m.at))
    }

    /// The same with a remark on where.
    pub(crate) fn into_check_with(
        self,
        name: impl Into<String>,
        kind: CheckKind,
        remark: Option<String>,
    ) -> Option<Check> {
        let mut check = self.into_check(name, kind)?;
        if let Some(remark) = remark {
            check.at = format!("{}; {remark}", check.at);
        }
        Some(check)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_ratio_wins_and_nan_beats_all() {
        let mut worst = Worst::default();
        worst.consider(5.0, 10.0, "m", || "a".into());
        worst.consider(-1.0, 1.0, "kg", || "b".into());
        worst.consider(0.9, 1.0, "s", || "c".into());
        let check = worst.into_check("group", CheckKind::Feasibility).expect("has members");
        assert_eq!((check.value, check.limit, check.at.as_str(), check.passed), (0.9, 1.0, "c", true));

        let mut worst = Worst::default();
        worst.consider(f64::NAN, 1.0, "m", || "nan".into());
        worst.consider(f64::INFINITY, 1.0, "m", || "inf".into());
        let check = worst.into_check("group", CheckKind::Feasibility).expect("has members");
        assert!(check.value.is_nan() && !check.passed && check.at == "nan");
    }

    #[test]
    fn inside_bounds_counts_as_zero() {
        let mut worst = Worst::default();
        worst.consider(-3.0, 1e-6, "m", || "inside".into());
        let check = worst.into_check("group", CheckKind::Feasibility).expect("has members");
        assert_eq!((check.value, check.margin), (0.0, 1e-6));
        assert!(Worst::default().into_check("none", CheckKind::Feasibility).is_none());
    }
}
