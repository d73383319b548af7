//! Deficiencies: reasons why a converged solution is not one of the problem, as data and as sentences.

use std::fmt::{self, Write as _};

use apsides_iteration::Status;

use super::accuracy::Accuracy;

/// A reason why a converged solution is not one of the problem, with the remedies that may mend it.
#[derive(Clone, Debug, PartialEq)]
pub struct Deficiency {
    /// The reason.
    pub reason: Reason,
    /// Its likely cause in words, as it stands in a sentence, where that is known.
    pub cause: Option<String>,
    /// Each of these may mend it.
    pub remedies: Vec<Remedy>,
}

/// A reason why a converged solution is not one of the problem.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Reason {
    /// The discretisation is too coarse.
    Inaccurate {
        /// Measures of accuracy, those that miss their tolerance among them.
        measures: Vec<Accuracy>,
        /// Refinements of the first discretisation.
        refinements: usize,
    },
    /// The discretisation is too coarse, and finer ones gained nothing, as where a control chatters or nothing determines it.
    Stalled {
        /// Measures of accuracy, those that miss their tolerance among them.
        measures: Vec<Accuracy>,
        /// Refinements of the first discretisation.
        refinements: usize,
    },
    /// Bounds along the phases that the method does not impose are exceeded.
    BoundsExceeded(Vec<Exceeded>),
    /// The method did not converge; the solution is that of the method it started from.
    NotConverged {
        /// The method that did not converge.
        method: &'static str,
        /// The end of its solve.
        status: Status,
        /// The method that gave the solution.
        instead: &'static str,
    },
}

/// A state bound or a path constraint that a solution exceeds.
#[derive(Clone, Debug, PartialEq)]
pub struct Exceeded {
    /// Name of the phase.
    pub phase: String,
    /// Name of the state or of the path constraint row.
    pub name: String,
    /// Largest excess, in `unit`.
    pub amount: f64,
    /// Unit.
    pub unit: String,
}

/// A remedy for a deficiency. Settings go by the names of their fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Remedy {
    /// One of these settings is to be raised.
    Raise(&'static [&'static str]),
    /// A setting is to be switched on.
    Enable(&'static str),
    /// Another method is to be used, by its name.
    Method(&'static str),
}

impl Deficiency {
    /// A discretisation that is too coarse by its measures of accuracy after so many refinements.
    #[must_use]
    pub fn inaccurate(measures: &[Accuracy], refinements: usize, remedy: Remedy) -> Self {
        let reason = Reason::Inaccurate { measures: measures.to_vec(), refinements };
        Self { reason, cause: None, remedies: vec![remedy] }
    }

    /// A discretisation that is too coarse by its measures of accuracy and that the last of so many refinements did not better.
    #[must_use]
    pub fn stalled(measures: &[Accuracy], refinements: usize, remedy: Remedy) -> Self {
        let reason = Reason::Stalled { measures: measures.to_vec(), refinements };
        Self { reason, cause: None, remedies: vec![remedy] }
    }

    /// Says whether it is the accuracy of the discretisation alone that is missing.
    #[must_use]
    pub fn is_of_accuracy(&self) -> bool {
        matches!(self.reason, Reason::Inaccurate { .. } | Reason::Stalled { .. })
    }

    /// The word for files and scripts.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match self.reason {
            Reason::Inaccurate { .. } => "mesh-limit",
            Reason::Stalled { .. } => "mesh-stalled",
            Reason::BoundsExceeded(_) => "limits-exceeded",
            Reason::NotConverged { .. } => "not-converged",
        }
    }

    /// The deficiency and its remedies as a sentence without full stop. `name` gives the name that the reader knows a setting by, such as
    /// the key of a file, from the name of its field.
    #[must_use]
    pub fn sentence(&self, name: &dyn Fn(&'static str) -> String) -> String {
        let mut text = match &self.reason {
            Reason::Inaccurate { measures, refinements } => inaccurate(measures, *refinements, name),
            Reason::Stalled { measures, refinements } => format!(
                "{}; the last refinements have not brought it down",
                inaccurate(measures, *refinements, name)
            ),
            Reason::BoundsExceeded(exceeded) => format!(
                "limits along the flight that the method does not impose are exceeded ({})",
                exceeded.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
            ),
            Reason::NotConverged { method, status, instead } => format!(
                "{method} from the solution by {instead} ends without success ({status}), and that solution is returned; along singular arcs \
                 it does not converge"
            ),
        };
        if let Some(cause) = &self.cause {
            text += &format!("; {cause}");
        }
        for (k, remedy) in self.remedies.iter().enumerate() {
            text.push_str(if k == 0 { "; " } else { ", or " });
            match remedy {
                Remedy::Raise(settings) => {
                    let names: Vec<String> = settings.iter().map(|s| format!("`{}`", name(s))).collect();
                    text += &format!("raise {}", alternatives(&names));
                }
                Remedy::Enable(setting) => text += &format!("set `{}` = true", name(setting)),
                Remedy::Method(method) => text += &format!("use the method \"{method}\""),
            }
        }
        text
    }
}

impl fmt::Display for Deficiency {
    /// The sentence with the settings' own names.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.sentence(&|setting| setting.to_owned()))
    }
}

impl fmt::Display for Exceeded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "phase `{}`, `{}` by {:.3e} {}", self.phase, self.name, self.amount, self.unit)
    }
}

/// Those measures that miss their tolerance; all where the deficiency is in none of them alone.
fn inaccurate(measures: &[Accuracy], refinements: usize, name: &dyn Fn(&'static str) -> String) -> String {
    let all = measures.iter().all(Accuracy::is_met);
    let parts = measures.iter().filter(|m| all || !m.is_met()).map(|m| {
        let compared = if m.is_met() { "allowed is" } else { "above" };
        let place = m.place.as_ref().map_or_else(String::new, |place| format!(" ({place})"));
        let Accuracy { measure, reached, tolerance, setting, .. } = m;
        format!("the {measure} is {reached:.1e}{place}, {compared} `{}` = {tolerance:.1e}", name(setting))
    });
    let parts: Vec<String> = parts.collect();
    let mut text = match refinements {
        0 => String::new(),
        1 => "after one refinement ".to_owned(),
        n => format!("after {n} refinements "),
    };
    text += &parts.join(", and ");
    text
}

/// `a`, `b` or `c`.
fn alternatives(names: &[String]) -> String {
    let mut text = String::new();
    for (k, name) in names.iter().enumerate() {
        let separator = match k {
            0 => "",
            k if k + 1 == names.len() => " or ",
            _ => ", ",
        };
        let _ = write!(text, "{separator}{name}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn accuracy(reached: f64) -> Accuracy {
        Accuracy::new("error between the points", reached, 1e-8, "tolerance")
    }

    #[test]
    fn sentences_name_measures_and_settings() {
        let reason = Reason::Inaccurate { measures: vec![accuracy(2e-7)], refinements: 3 };
        let remedies = vec![Remedy::Raise(&["max_refinements"])];
        let deficiency = Deficiency { reason, cause: None, remedies };
        assert_eq!(deficiency.word(), "mesh-limit");
        assert_eq!(
            deficiency.to_string(),
            "after 3 refinements the error between the points is 2.0e-7, above `tolerance` = 1.0e-8; raise `max_refinements`"
        );
        let keys = deficiency.sentence(&|setting| format!("radau.{setting}"));
        assert!(keys.ends_with("above `radau.tolerance` = 1.0e-8; raise `radau.max_refinements`"), "{keys}");
        let deficiency = Deficiency { cause: Some("there `throttle` switches".into()), ..deficiency };
        let ended = deficiency.to_string();
        assert!(ended.ends_with(" = 1.0e-8; there `throttle` switches; raise `max_refinements`"), "{ended}");
    }

    #[test]
    fn remedies_are_alternatives() {
        let remedies = vec![Remedy::Raise(&["intervals", "points", "order"]), Remedy::Method("radau")];
        let exceeded =
            Exceeded { phase: "turn".into(), name: "rate".into(), amount: 0.25, unit: "rad/s".into() };
        let deficiency = Deficiency { reason: Reason::BoundsExceeded(vec![exceeded]), cause: None, remedies };
        assert_eq!(
            deficiency.to_string(),
            "limits along the flight that the method does not impose are exceeded (phase `turn`, `rate` by 2.500e-1 rad/s); raise \
             `intervals`, `points` or `order`, or use the method \"radau\""
        );
    }

    #[test]
    fn what_is_not_a_number_meets_no_tolerance() {
        assert!(!accuracy(f64::NAN).is_met());
        assert!(accuracy(1e-8).is_met());
    }
}
