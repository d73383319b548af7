//! Requirements of a problem, item by item: every bound that a user states, as limits of the discretised problem.
//!
//! The equations of motion, the links between phases, a fixed start time, the least duration and bounds that are guards are no
//! requirements: they hold in every relaxation.

use std::fmt;

use apsides_nlp::{Limit, Nlp, Place, Requirement as NlpRequirement, Side};
use apsides_ocp::{Bounds, Ocp, Phase, Variable};

use crate::layout::CollocationPhase;
use crate::transcription::Transcription;

/// The quantity that a requirement bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RequirementKind {
    /// A state at the start of its phase.
    InitialState,
    /// A state at the end of its phase.
    FinalState,
    /// A state along its phase.
    State,
    /// A control.
    Control,
    /// A path constraint, at every instant.
    Path,
    /// The integral over a phase.
    Integral,
    /// A start time.
    InitialTime,
    /// An end time.
    FinalTime,
    /// The duration of a phase.
    Duration,
    /// A condition on end quantities.
    Endpoint,
    /// A static parameter.
    Parameter,
}

impl RequirementKind {
    /// Returns true for the bounds of a quantity itself, not those at an end.
    fn is_along(self) -> bool {
        matches!(self, Self::State | Self::Control | Self::Path | Self::Integral | Self::Parameter)
    }
}

/// One side of a bound that the problem states.
#[derive(Clone, Debug, PartialEq)]
pub struct Requirement {
    /// Phase, where the bound belongs to one.
    pub phase: Option<String>,
    /// Name of the bounded quantity.
    pub name: String,
    /// The kind of quantity.
    pub kind: RequirementKind,
    /// Lower: relaxed by lowering; upper: relaxed by raising.
    pub side: Side,
    /// The bound, in `unit`.
    pub limit: f64,
    /// True when the quantity is fixed at this value.
    pub fixed: bool,
    /// Unit of the quantity.
    pub unit: String,
    /// The name that the user states the bound by, such as the key of a file, where it is known.
    pub stated_by: Option<String>,
}

impl Requirement {
    /// The bounded quantity in words: "phase `braking`: final radial speed".
    #[must_use]
    pub fn quantity(&self) -> String {
        let phase = self.phase.as_ref().map_or(String::new(), |p| format!("phase `{p}`: "));
        let end = match self.kind {
            RequirementKind::InitialState => "initial ",
            RequirementKind::FinalState => "final ",
            _ => "",
        };
        format!("{phase}{end}{}", self.name)
    }

    /// The bound after a relaxation by `amount`.
    #[must_use]
    pub fn relaxed(&self, amount: f64) -> f64 {
        match self.side {
            Side::Lower => self.limit - amount,
            Side::Upper => self.limit + amount,
        }
    }

    /// States another bound in a problem that has this requirement.
    pub(crate) fn restate(&self, ocp: &mut Ocp, to: f64) {
        let mut places: Vec<&mut Bounds> = Vec::new();
        if self.kind == RequirementKind::Parameter {
            places.extend(ocp.parameters.iter_mut().filter(|p| p.name == self.name).map(|p| &mut p.bounds));
        }
        if self.kind == RequirementKind::Endpoint {
            for c in &mut ocp.constraints {
                let rows = c.rows.iter_mut().filter(|row| self.name == of_constraint(&c.name, &row.name));
                places.extend(rows.map(|row| &mut row.bounds));
            }
        }
        for phase in ocp.phases.iter_mut().filter(|phase| self.phase.as_ref() == Some(&phase.name)) {
            let states = phase.states.iter_mut().filter(|s| s.variable.name == self.name);
            match self.kind {
                RequirementKind::InitialState => places.extend(states.map(|s| &mut s.initial)),
                RequirementKind::FinalState => places.extend(states.map(|s| &mut s.terminal)),
                RequirementKind::State => places.extend(states.map(|s| &mut s.variable.bounds)),
                RequirementKind::Control => places.extend(named(&mut phase.controls, &self.name)),
                RequirementKind::Path => {
                    places.extend(named(phase.path.iter_mut().flat_map(|c| &mut c.rows), &self.name));
                }
                RequirementKind::Integral => {
                    places.extend(named(phase.integrals.iter_mut().map(|q| &mut q.variable), &self.name));
                }
                RequirementKind::InitialTime => places.push(&mut phase.initial_time),
                RequirementKind::FinalTime => places.push(&mut phase.final_time),
                RequirementKind::Duration => places.push(&mut phase.duration),
                RequirementKind::Parameter | RequirementKind::Endpoint => {}
            }
        }
        for bounds in places {
            match self.side {
                Side::Lower => bounds.lower = to,
                Side::Upper => bounds.upper = to,
            }
        }
    }
}

/// The bounds of the variables of a name.
fn named<'a>(
    variables: impl IntoIterator<Item = &'a mut Variable>,
    name: &str,
) -> impl Iterator<Item = &'a mut Bounds> {
    variables.into_iter().filter(move |v| v.name == name).map(|v| &mut v.bounds)
}

/// The name of a row of a constraint.
fn of_constraint(constraint: &str, row: &str) -> String {
    format!("{constraint}: {row}")
}

impl fmt::Display for Requirement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let relation = match (self.fixed, self.side) {
            (true, _) => "=",
            (_, Side::Lower) => "at least",
            (_, Side::Upper) => "at most",
        };
        write!(f, "{} {relation} {} {}", self.quantity(), short(self.limit), self.unit)
    }
}

/// Six significant digits.
pub(crate) fn short(v: f64) -> f64 {
    rounded(v, decimals(v, DIGITS), f64::round)
}

/// A bound that replaces a limit in six significant digits, or as many more as show three of the change, rounded so that the change does not
/// become smaller by more than a hundredth of the last.
pub(crate) fn outward(v: f64, limit: f64, side: Side) -> f64 {
    let of_change = decimals(v - limit, DIGITS_OF_CHANGE).min(decimals(v, MOST_DIGITS));
    let decimals = decimals(v, DIGITS).max(of_change);
    match side {
        Side::Lower => rounded(v, decimals, |v| (v + 0.01).floor()),
        Side::Upper => rounded(v, decimals, |v| (v - 0.01).ceil()),
    }
}

/// So many significant digits, rounded up: a number that is named as enough.
#[must_use]
pub fn rounded_up(v: f64, digits: i32) -> f64 {
    rounded(v, decimals(v, digits), f64::ceil)
}

/// Significant digits of a number that is said.
const DIGITS: i32 = 6;
const DIGITS_OF_CHANGE: i32 = 3;
/// More than these are those of its rounding.
const MOST_DIGITS: i32 = 14;

/// Decimals that show so many significant digits.
fn decimals(v: f64, digits: i32) -> i32 {
    if v == 0.0 || !v.is_finite() { 0 } else { digits - 1 - v.abs().log10().floor() as i32 }
}

fn rounded(v: f64, digits: i32, to_whole: fn(f64) -> f64) -> f64 {
    if v == 0.0 || !v.is_finite() {
        return v;
    }
    // Dividing by a power of ten gives the nearest decimal, multiplying by its inverse does not.
    let unit = 10f64.powi(digits.abs());
    if digits >= 0 { to_whole(v * unit) / unit } else { to_whole(v / unit) * unit }
}

/// A requirement with its limits.
pub(crate) struct Item {
    /// Description; none for what holds in every relaxation.
    pub(crate) requirement: Option<Requirement>,
    pub(crate) limits: NlpRequirement,
    /// Phase and normalised time of each limit, where the requirement stands along a phase.
    pub(crate) instants: Vec<(usize, f64)>,
}

/// Fixed end values and times are usually meant as stated, and bounds on a control describe the vehicle and where its model
/// holds, so that other limits are named before them.
const WEIGHT_OF_CONTROL: f64 = 10.0;
const WEIGHT_OF_FIXED_TIME: f64 = 10.0;
const WEIGHT_OF_FIXED_END: f64 = 10.0;
const WEIGHT_OF_FIXED_START: f64 = 20.0;
/// A positive lower bound along a phase keeps at least this part of its value: most such quantities have no meaning at zero.
const LEAST_PART: f64 = 1e-3;

/// Collects the items of a problem.
struct Items {
    units: apsides_nlp::Scaling,
    items: Vec<Item>,
    phase: Option<(usize, String)>,
}

/// Every requirement of a discretised problem.
pub(crate) fn items(ocp: &Ocp, nlp: &Transcription) -> Vec<Item> {
    let Some(units) = nlp.scaling() else { return Vec::new() };
    let mut items = Items { units, items: Vec::new(), phase: None };
    for (k, (phase, p)) in ocp.phases.iter().zip(&nlp.layout.phases).enumerate() {
        items.phase = Some((k, phase.name.clone()));
        items.phase_bounds(phase, p);
        items.times(phase, p);
    }
    items.phase = None;
    for (k, v) in ocp.parameters.iter().enumerate() {
        let place = Place::Variable(nlp.layout.first_parameter + k);
        items.add(RequirementKind::Parameter, v, v.bounds, &[place], &[]);
    }
    for (c, &first) in ocp.constraints.iter().zip(&nlp.layout.endpoint_rows) {
        if c.joins_phases() {
            continue;
        }
        for (k, row) in c.rows.iter().enumerate() {
            let named = Variable { name: of_constraint(&c.name, &row.name), ..row.clone() };
            items.add(RequirementKind::Endpoint, &named, row.bounds, &[Place::Constraint(first + k)], &[]);
        }
    }
    items.items
}

impl Items {
    fn phase_bounds(&mut self, phase: &Phase, p: &CollocationPhase) {
        let last = p.nodes.len();
        let fractions: Vec<f64> = p.nodes.iter().map(|n| n.fraction).chain([1.0]).collect();
        for (s, state) in phase.states.iter().enumerate() {
            let column = |node: usize| Place::Variable(p.state_column(node) + s);
            let along: Vec<Place> = (0..=last).map(column).collect();
            let v = &state.variable;
            self.add(RequirementKind::State, v, v.bounds, &along, &fractions);
            self.add(RequirementKind::InitialState, v, state.initial, &[column(0)], &[]);
            self.add(RequirementKind::FinalState, v, state.terminal, &[column(last)], &[]);
        }
        for (c, v) in phase.controls.iter().enumerate() {
            let along: Vec<Place> = (0..last).map(|i| Place::Variable(p.control_column(i) + c)).collect();
            self.add(RequirementKind::Control, v, v.bounds, &along, &fractions);
        }
        for (k, v) in phase.path.iter().flat_map(|c| &c.rows).enumerate() {
            let along: Vec<Place> = (0..last).map(|i| Place::Constraint(p.path_row(i) + k)).collect();
            self.add(RequirementKind::Path, v, v.bounds, &along, &fractions);
        }
        for (q, row) in phase.integrals.iter().zip(&p.ends.integral_rows) {
            if let Some(r) = row {
                let v = &q.variable;
                self.add(RequirementKind::Integral, v, v.bounds, &[Place::Constraint(*r)], &[]);
            }
        }
    }

    fn times(&mut self, phase: &Phase, p: &CollocationPhase) {
        let time = |name: &str| Variable::new(name, phase.time_unit.clone());
        let (start, end) = (Place::Variable(p.ends.initial_time), Place::Variable(p.ends.final_time));
        if !phase.initial_time.is_fixed() {
            self.add(RequirementKind::InitialTime, &time("start time"), phase.initial_time, &[start], &[]);
        }
        self.add(RequirementKind::FinalTime, &time("final time"), phase.final_time, &[end], &[]);
        // The duration: as a row, or as the bounds on one time that the other, fixed time makes of it.
        let (lower, upper) = match p.ends.duration_row {
            Some(r) => {
                let limit = |side, value| Limit { place: Place::Constraint(r), side, value };
                (limit(Side::Lower, phase.duration.lower), limit(Side::Upper, phase.duration.upper))
            }
            None if phase.initial_time.is_fixed() => {
                let t = phase.initial_time.lower;
                let limit = |side, value| Limit { place: end, side, value: t + value };
                (limit(Side::Lower, phase.duration.lower), limit(Side::Upper, phase.duration.upper))
            }
            None if phase.final_time.is_fixed() => {
                let t = phase.final_time.lower;
                let limit = |side, value| Limit { place: start, side, value: t - value };
                (limit(Side::Upper, phase.duration.lower), limit(Side::Lower, phase.duration.upper))
            }
            None => return,
        };
        for (limit, side, value) in
            [(lower, Side::Lower, phase.duration.lower), (upper, Side::Upper, phase.duration.upper)]
        {
            // A duration that is not negative is no statement of the user.
            let stated = side == Side::Upper || value > 0.0;
            let fixed = phase.duration.is_fixed();
            let requirement = stated
                .then(|| self.describe(RequirementKind::Duration, &time("duration"), side, value, fixed));
            self.push(requirement, vec![limit], vec![], f64::INFINITY);
        }
    }

    /// Both sides of the bounds on one quantity, which stands at one or more places.
    fn add(
        &mut self,
        kind: RequirementKind,
        variable: &Variable,
        bounds: Bounds,
        places: &[Place],
        fractions: &[f64],
    ) {
        let phase = self.phase.as_ref().map_or(0, |(k, _)| *k);
        for (side, value) in [(Side::Lower, bounds.lower), (Side::Upper, bounds.upper)] {
            let limits = places.iter().map(|&place| Limit { place, side, value }).collect();
            let instants = places.iter().zip(fractions).map(|(_, &s)| (phase, s)).collect();
            let inward = if side == Side::Lower { value } else { -value };
            let most = if kind == RequirementKind::State && inward > 0.0 {
                (1.0 - LEAST_PART) * inward
            } else {
                f64::INFINITY
            };
            let described = self.describe(kind, variable, side, value, bounds.is_fixed());
            let guard = (kind.is_along() || kind == RequirementKind::Endpoint)
                && variable.guards[usize::from(side == Side::Upper)];
            self.push((!guard).then_some(described), limits, instants, most);
        }
    }

    fn describe(
        &self,
        kind: RequirementKind,
        v: &Variable,
        side: Side,
        limit: f64,
        fixed: bool,
    ) -> Requirement {
        let phase = self.phase.as_ref().map(|(_, name)| name.clone());
        Requirement {
            phase,
            name: v.name.clone(),
            kind,
            side,
            limit,
            fixed,
            unit: v.unit.clone(),
            stated_by: None,
        }
    }

    fn push(
        &mut self,
        requirement: Option<Requirement>,
        limits: Vec<Limit>,
        instants: Vec<(usize, f64)>,
        most: f64,
    ) {
        let Some(first) = limits.first().filter(|l| l.value.is_finite()) else { return };
        let unit = match first.place {
            Place::Variable(i) => self.units.variables[i],
            Place::Constraint(i) => self.units.constraints[i],
        };
        let weight = match &requirement {
            Some(r) if r.fixed && r.kind == RequirementKind::InitialState => WEIGHT_OF_FIXED_START,
            Some(r) if r.fixed && r.kind == RequirementKind::FinalState => WEIGHT_OF_FIXED_END,
            Some(r) if r.kind == RequirementKind::Control => WEIGHT_OF_CONTROL,
            Some(r) if r.fixed && r.kind == RequirementKind::FinalTime => WEIGHT_OF_FIXED_TIME,
            _ => 1.0,
        };
        let limits = NlpRequirement { limits, unit, weight, most };
        self.items.push(Item { requirement, limits, instants });
    }
}

impl Item {
    /// Time of the largest violation at the point `x` with the row values `c`.
    pub(crate) fn worst_instant(&self, nlp: &Transcription, x: &[f64], c: &[f64]) -> Option<f64> {
        let value = |l: &Limit| match l.place {
            Place::Variable(i) => x[i],
            Place::Constraint(i) => c[i],
        };
        let mut worst: Option<(f64, f64)> = None;
        for (limit, &(phase, s)) in self.limits.limits.iter().zip(&self.instants) {
            let excess = limit.excess(value(limit));
            // The first of equal ones: a relaxed limit is often met at many instants.
            let margin = 1e-6 * self.limits.unit;
            if worst.is_none_or(|(largest, _)| excess > largest + margin) {
                let p = &nlp.layout.phases[phase];
                worst = Some((excess, (1.0 - s) * x[p.ends.initial_time] + s * x[p.ends.final_time]));
            }
        }
        worst.map(|(_, t)| t)
    }
}

#[cfg(test)]
mod tests {
    use apsides_ad::{Dynamics, Scalar};
    use apsides_ocp::{At, State};

    use super::*;

    struct Walk;
    impl Dynamics<1, 1> for Walk {
        fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
            *u
        }
    }

    /// A change in late digits is shown, and towards the side that helps.
    #[test]
    fn advice_is_rounded_to_the_safe_side() {
        assert_eq!(outward(59.966_722_3, 60.0, Side::Lower), 59.9667);
        assert_eq!(outward(153.736_498_76, 153.7365, Side::Lower), 153.736_498_76);
        assert_eq!(outward(153.736_498_761_3, 153.7365, Side::Lower), 153.736_498_76);
        assert_eq!(outward(-6.171_461_2, -5.0, Side::Lower), -6.171_47);
        assert_eq!(outward(22_102.325_18, 22_100.0, Side::Upper), 22_102.33);
        assert_eq!(outward(1.000_000_123_4, 1.0, Side::Upper), 1.000_000_124);
        assert_eq!(outward(0.0, 5.0, Side::Lower), 0.0);
        assert_eq!(rounded_up(440.244, 3), 441.0);
        assert_eq!(rounded_up(0.013_101, 3), 0.0132);
    }

    /// Each kind of requirement finds its own bound, and that alone.
    #[test]
    fn another_bound_is_stated_at_its_place() {
        let named = |name: &str| Variable::new(name, "m").within(0.0, 1.0);
        let state = State::new("x", "m").within(0.0, 1.0).starts_within(0.0, 1.0).ends_within(0.0, 1.0);
        let mut ocp = Ocp::builder("walk")
            .phase(
                Phase::new("walk", Walk)
                    .states([state])
                    .controls([named("v")])
                    .final_time(Bounds::new(0.0, 1.0)),
            )
            .minimize("time", "s", At::FinalTime("walk"))
            .build()
            .expect("a problem");
        let mut to = 1.0;
        for (kind, name) in [
            (RequirementKind::InitialState, "x"),
            (RequirementKind::FinalState, "x"),
            (RequirementKind::State, "x"),
            (RequirementKind::Control, "v"),
            (RequirementKind::FinalTime, "final time"),
        ] {
            to += 1.0;
            let requirement = Requirement {
                phase: Some("walk".into()),
                name: name.into(),
                kind,
                side: Side::Upper,
                limit: 1.0,
                fixed: false,
                unit: "m".into(),
                stated_by: None,
            };
            requirement.restate(&mut ocp, to);
        }
        let phase = &ocp.phases[0];
        let x = &phase.states[0];
        let found = [x.initial, x.terminal, x.variable.bounds, phase.controls[0].bounds, phase.final_time];
        assert_eq!(found.map(|bounds| bounds.lower), [0.0; 5]);
        assert_eq!(found.map(|bounds| bounds.upper), [2.0, 3.0, 4.0, 5.0, 6.0]);
    }
}
