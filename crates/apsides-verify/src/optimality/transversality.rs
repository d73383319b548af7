//! Conditions at the ends of phases and in the static parameters, and signs of the endpoint multipliers.

use apsides_ocp::{Bounds, EndpointInput, Ocp, Phase, Scaling, Trajectory};

use super::{Among, GAUSS, KIND, Lengths, PhaseConditions, Point, natural_residual, ridges};
use crate::ends::{EndGradient, EndScales, Ends, is_duration_at_bound};
use crate::equations::Equations;
use crate::worst::{Worst, relative};
use crate::{Check, VerifySettings};

/// Gauss rules per control interval.
const PANELS: usize = 4;

pub(super) fn checks(
    ocp: &Ocp,
    trajectory: &Trajectory,
    scaling: &Scaling,
    settings: &VerifySettings,
    conditions: &mut [PhaseConditions<'_>],
) -> Vec<Check> {
    let ends = Ends::of(trajectory);
    let scales = EndScales::new(ocp, scaling, settings);
    let cost = EndGradient::of_cost(ocp, &ends);
    let mut gradient = cost.clone();
    gradient.add_constraints(ocp, &ends, trajectory.constraint_multipliers.as_ref());
    let costate_size = conditions.iter().fold(0.0, |m: f64, c| m.max(c.costate_size));
    let end_conditions = EndConditions {
        ocp,
        trajectory,
        scaling,
        settings,
        ends: &ends,
        scales: &scales,
        cost,
        curvature: EndGradient::curvature_of_cost(ocp, &ends),
        gradient,
        costate_size,
        at_kinks: Vec::new(),
    };
    let mut checks = Vec::new();
    let ridges = end_conditions.ridges(conditions);
    let end_conditions = EndConditions { at_kinks: ridges.inputs, ..end_conditions };
    for (k, phase) in conditions.iter_mut().enumerate() {
        checks.extend(end_conditions.phase(k, phase));
    }
    checks.extend(end_conditions.parameters(conditions));
    checks.extend(end_conditions.multipliers());
    checks.extend(end_conditions.integral_multipliers(conditions));
    checks.extend(ridges.check);
    conditions.iter_mut().for_each(|c| c.ends_hide_curvature = ridges.hides_curvature);
    checks
}

struct EndConditions<'a> {
    ocp: &'a Ocp,
    trajectory: &'a Trajectory,
    scaling: &'a Scaling,
    settings: &'a VerifySettings,
    ends: &'a Ends,
    scales: &'a EndScales<'a>,
    /// Diagonal of the Hessian of the end cost, without its sign.
    curvature: EndGradient,
    /// Gradient of the end cost, and of the end cost with the endpoint constraints.
    cost: EndGradient,
    gradient: EndGradient,
    /// Largest costate times scale over all phases.
    costate_size: f64,
    /// Quantities in which functions have kinks at the point: their conditions are those of [`ridges`].
    at_kinks: Vec<EndpointInput>,
}

/// One condition `slope = 0`, or pushing against a bound.
struct Condition {
    name: String,
    input: EndpointInput,
    /// Contribution of the phase to the gradient of cost and constraints.
    inner: f64,
    bounds: Bounds,
    /// The slope times the scale of the quantity is compared with this.
    size: f64,
}

impl EndConditions<'_> {
    /// The worst condition at both ends of a phase.
    fn phase(&self, k: usize, conditions: &mut PhaseConditions<'_>) -> Option<Check> {
        let phase = &self.ocp.phases[k];
        let mut all = self.state_conditions(k, phase, conditions);
        let times = self.time_conditions(k, phase, conditions);
        let mut worst = Worst::default();
        let mut unknown = 0;
        if self.is_duration_at_bound(k, phase) {
            match self.with_a_bound_on_the_duration(k, phase, &times) {
                Some(residual) => {
                    let at = || format!("times with the bound on the duration, phase `{}`", phase.name);
                    worst.consider(residual, self.settings.transversality_tolerance, "-", at);
                }
                None => unknown += 1,
            }
        } else {
            all.extend(times);
        }
        for c in all {
            let Some(slope) = self.slope(&c) else {
                unknown += usize::from(!c.bounds.is_fixed());
                continue;
            };
            if self.at_kinks.contains(&c.input) {
                continue;
            }
            let residual = self.residual(&c, slope);
            let at = || format!("{}, phase `{}`", c.name, phase.name);
            worst.consider(residual, self.settings.transversality_tolerance, "-", at);
        }
        let remark = (unknown > 0)
            .then(|| format!("{unknown} conditions left out for want of endpoint constraint multipliers"));
        worst.into_check_with(format!("transversality at the ends of {}", phase.name), KIND, remark)
    }

    /// The conditions in the quantities in which functions of the ends have kinks at the point.
    fn ridges(&self, conditions: &mut [PhaseConditions<'_>]) -> ridges::Ridges {
        let multipliers = self.trajectory.constraint_multipliers.as_ref();
        let kinked = ridges::kinked(self.ocp, self.ends, self.scales, multipliers);
        if kinked.is_empty() {
            return ridges::Ridges::default();
        }
        let mut inner = Vec::new();
        for (k, phase) in conditions.iter_mut().enumerate() {
            let mut all = self.state_conditions(k, &self.ocp.phases[k], phase);
            if !self.is_duration_at_bound(k, &self.ocp.phases[k]) {
                all.extend(self.time_conditions(k, &self.ocp.phases[k], phase));
            }
            inner.extend(all.into_iter().map(|c| (c.input, c.inner)));
        }
        let (slopes, _) = parameter_slopes(self.ocp.parameters.len(), conditions);
        let parameters = slopes.into_iter().enumerate();
        inner.extend(parameters.map(|(index, slope)| (EndpointInput::Parameter { index }, slope)));
        let slope = |input: EndpointInput| {
            let (_, inner) = inner.iter().find(|(of, _)| *of == input)?;
            Some(inner + self.gradient.value(input)?)
        };
        let others = ridges::Others { slope: &slope, size: self.costate_size };
        ridges::look(self.ocp, self.ends, self.scales, self.settings, kinked, &others)
    }

    fn state_conditions(&self, k: usize, phase: &Phase, conditions: &PhaseConditions<'_>) -> Vec<Condition> {
        let found = conditions.found;
        let (mut first, mut last) = (vec![0.0; phase.states.len()], vec![0.0; phase.states.len()]);
        conditions.costate.evaluate(found.initial_time, &mut first);
        conditions.costate.evaluate(found.final_time, &mut last);
        let mut all = Vec::new();
        for (i, state) in phase.states.iter().enumerate() {
            let ends = [
                (EndpointInput::InitialState { phase: k, state: i }, "initial", first[i], state.initial),
                (EndpointInput::FinalState { phase: k, state: i }, "final", -last[i], state.terminal),
            ];
            for (input, which, inner, bounds) in ends {
                let scale = self.scales.scale(input);
                let cost = self.cost.value(input).unwrap_or(0.0) * scale;
                // Where the cost is flat at the optimum, costates are rounding: then by what the slope would change, were the state off by its value.
                let own = scale.min(self.ends.value(input).abs());
                let bend = scale * own * self.curvature.value(input).unwrap_or(0.0);
                all.push(Condition {
                    name: format!("{which} {}", state.variable.name),
                    input,
                    inner,
                    bounds: bounds.intersect(&state.variable.bounds),
                    size: self.costate_size.max(cost.abs()).max(bend),
                });
            }
        }
        all
    }

    /// The slope of cost and constraints in a quantity, relative to the size of the condition; none without multipliers of constraints.
    fn slope(&self, c: &Condition) -> Option<f64> {
        let outer = self.gradient.value(c.input)?;
        Some(relative((c.inner + outer) * self.scales.scale(c.input), c.size))
    }

    fn residual(&self, c: &Condition, slope: f64) -> f64 {
        natural_residual(slope, self.ends.value(c.input), &c.bounds, self.scales.scale(c.input))
    }

    fn is_duration_at_bound(&self, k: usize, phase: &Phase) -> bool {
        let own = self.scales.scale(EndpointInput::InitialTime { phase: k });
        is_duration_at_bound(phase, self.duration(k), own, self.settings)
    }

    fn duration(&self, k: usize) -> f64 {
        self.ends.phases[k].final_time - self.ends.phases[k].initial_time
    }

    /// The residual of both times with the multiplier of an active bound on the duration, positive at the upper one and negative at the
    /// lower one, that leaves the least: it takes the same from the slope in the initial time as it adds to that in the final time. None
    /// without multipliers of constraints.
    fn with_a_bound_on_the_duration(&self, k: usize, phase: &Phase, times: &[Condition]) -> Option<f64> {
        let [first, last] = times else { return None };
        let known = |c: &Condition| self.slope(c).or_else(|| c.bounds.is_fixed().then_some(0.0));
        let (at_start, at_end) = (known(first)?, known(last)?);
        let (to_lower, to_upper) =
            (self.duration(k) - phase.duration.lower, phase.duration.upper - self.duration(k));
        let allowed = match phase.duration.is_fixed() {
            true => Bounds::FREE,
            false if to_lower < to_upper => Bounds::new(f64::NEG_INFINITY, 0.0),
            false => Bounds::new(0.0, f64::INFINITY),
        };
        let residual = |multiplier: f64| {
            let multiplier = allowed.clamp(multiplier);
            self.residual(first, at_start - multiplier).max(self.residual(last, at_end + multiplier))
        };
        let candidates = [0.0, at_start, -at_end, 0.5 * (at_start - at_end)];
        Some(candidates.map(residual).into_iter().fold(f64::INFINITY, f64::min))
    }

    /// Conditions on the times, in which an active bound on the duration has a part.
    fn time_conditions(
        &self,
        k: usize,
        phase: &Phase,
        conditions: &mut PhaseConditions<'_>,
    ) -> Vec<Condition> {
        let initial = EndpointInput::InitialTime { phase: k };
        let scale = self.scales.scale(initial);
        let [first, last] = conditions.end_hamiltonians();
        let ends = [
            (initial, "initial time", -first, phase.initial_time),
            (EndpointInput::FinalTime { phase: k }, "final time", last, phase.final_time),
        ];
        let costs = ends.map(|(input, ..)| self.cost.value(input).unwrap_or(0.0).abs());
        // A bound on the duration has the same part in both, so that they are measured alike.
        let common = self.is_duration_at_bound(k, phase).then_some(costs[0].max(costs[1]));
        let condition = |((input, which, inner, bounds), cost): ((EndpointInput, &str, f64, Bounds), f64)| {
            let size = scale * conditions.hamiltonian_size.max(common.unwrap_or(cost));
            Condition { name: which.into(), input, inner, bounds, size }
        };
        ends.into_iter().zip(costs).map(condition).collect()
    }

    /// `integral of dL/dp + dB/dp = 0` over all phases.
    fn parameters(&self, conditions: &mut [PhaseConditions<'_>]) -> Option<Check> {
        let (slopes, sizes) = parameter_slopes(self.ocp.parameters.len(), conditions);
        let along =
            |c: &PhaseConditions<'_>| c.hamiltonian_size * (c.found.final_time - c.found.initial_time);
        let objective_size = conditions
            .iter()
            .map(along)
            .fold(self.trajectory.objective.abs(), |sum, of_phase| sum + of_phase);
        if self.ocp.parameters.is_empty() {
            return None;
        }
        let mut worst = Worst::default();
        for (i, p) in self.ocp.parameters.iter().enumerate() {
            let input = EndpointInput::Parameter { index: i };
            let Some(outer) = self.gradient.value(input) else { continue };
            if self.at_kinks.contains(&input) {
                continue;
            }
            let (scale, cost) = (self.scales.scale(input), self.cost.value(input).unwrap_or(0.0));
            let value = self.ends.value(input);
            // Where the cost of the ends is flat in it, nothing else has a size: then by what the parameter, were it off by its own size, would change.
            let own = if value == 0.0 { scale } else { scale.min(value.abs()) };
            let bend = own * self.curvature.value(input).unwrap_or(0.0);
            let size = (scale * sizes[i].max(cost.abs()).max(bend)).max(self.costate_size);
            let slope = relative((slopes[i] + outer) * scale, size);
            // Beside a wide range a way to the bound that looks short may be worth much.
            let reach = p.bounds.clamp(value - (slopes[i] + outer).signum() * scale);
            let gain = ((slopes[i] + outer) * (reach - p.bounds.clamp(value))).abs();
            let residual = natural_residual(slope, value, &p.bounds, scale)
                .max(slope.abs().min(relative(gain, objective_size)));
            worst.consider(residual, self.settings.stationarity_tolerance, "-", || p.name.clone());
        }
        worst.into_check("stationarity in the static parameters", KIND)
    }

    /// A multiplier is zero inside the bounds, positive at the upper, negative at the lower one.
    fn multipliers(&self) -> Option<Check> {
        let multipliers = self.trajectory.constraint_multipliers.as_ref()?;
        let mut worst = Worst::default();
        for (k, c) in self.ocp.constraints.iter().enumerate() {
            let values = self.ends.evaluate(c.function.as_ref(), &c.inputs);
            let scales = self.scales.row_scales(k, self.ends);
            for (r, row) in c.rows.iter().enumerate() {
                let slope = relative(-multipliers[k][r] * scales[r], self.costate_size);
                let residual = natural_residual(slope, values[r], &row.bounds, scales[r]);
                let at = || format!("{}, constraint `{}`", row.name, c.name);
                worst.consider(residual, self.settings.transversality_tolerance, "-", at);
            }
        }
        worst.into_check("signs of the endpoint constraint multipliers", KIND)
    }

    /// The same of the bounds on integrals.
    fn integral_multipliers(&self, conditions: &mut [PhaseConditions<'_>]) -> Option<Check> {
        let mut worst = Worst::default();
        for (k, phase) in conditions.iter_mut().enumerate() {
            let Some(multipliers) = self.trajectory.phases[k].integral_multipliers.as_ref() else { continue };
            let integrals = self.ocp.phases[k].integrals.iter().zip(multipliers).enumerate();
            // One without bounds has no multiplier: one that is stated all the same is judged, too.
            let pushed: Vec<_> = integrals
                .filter(|(_, (integral, m))| integral.variable.bounds != Bounds::FREE || **m != 0.0)
                .collect();
            if pushed.is_empty() {
                continue;
            }
            let values = phase.integrals();
            for (q, (integral, multiplier)) in pushed {
                let scale = self.scaling.phases[k].integrals[q];
                let slope = relative(-multiplier * scale, self.costate_size);
                let residual = natural_residual(slope, values[q], &integral.variable.bounds, scale);
                let at = || format!("{}, phase `{}`", integral.variable.name, self.ocp.phases[k].name);
                worst.consider(residual, self.settings.transversality_tolerance, "-", at);
            }
        }
        worst.into_check("signs of the multipliers of integrals", KIND)
    }
}

/// The integrals over all phases of `dL/dp` and of its magnitude.
pub(crate) fn parameter_slopes(n: usize, conditions: &mut [PhaseConditions<'_>]) -> (Vec<f64>, Vec<f64>) {
    let (mut slopes, mut sizes) = (vec![0.0; n], vec![0.0; n]);
    for phase in conditions.iter_mut().filter(|_| n > 0) {
        phase.add_parameter_slopes(&mut slopes, &mut sizes);
    }
    (slopes, sizes)
}

impl PhaseConditions<'_> {
    /// Values of the integrals of the phase.
    pub(crate) fn integrals(&mut self) -> Vec<f64> {
        let (nx, count) = (self.equations.nx, self.equations.phase.integrals.len());
        let mut sums = vec![0.0; count];
        let mut rates = vec![0.0; nx + count];
        for segment in 0..self.found.control.segments().len() {
            if count == 0 {
                break;
            }
            self.integrate_over(segment, |equations, _, _, _, weight| {
                equations.rates(&mut rates);
                sums.iter_mut().zip(&rates[nx..]).for_each(|(s, r)| *s += weight * r);
            });
        }
        sums
    }

    /// Hamiltonian at both ends: its mean where it is constant. Where the intervals keep their parts of the duration, what the cost gains
    /// by an earlier start or a later end.
    pub(crate) fn end_hamiltonians(&mut self) -> [f64; 2] {
        if self.among == Among::Constant(Lengths::Given) {
            return self.stretching_hamiltonians();
        }
        if self.equations.is_autonomous() && self.instants.is_empty() {
            return [self.mean_hamiltonian(); 2];
        }
        let last = self.found.control.segments().len() - 1;
        [(0, self.found.initial_time), (last, self.found.final_time)]
            .map(|(segment, t)| self.evaluate_within_bounds(segment, t).value)
    }

    /// Adds the integrals of `dL/dp` and of its magnitude, contacts included, and jumps at times that parameters move.
    fn add_parameter_slopes(&mut self, slopes: &mut [f64], sizes: &mut [f64]) {
        let first = self.equations.nx + self.equations.nu;
        for (k, rates) in self.instants.clone().into_iter().zip(self.rates_of_instants.clone()) {
            if rates.iter().all(|rate| *rate == 0.0) {
                continue;
            }
            let time = self.found.control.breaks()[k];
            let [before, after] = [k - 1, k].map(|segment| self.evaluate_within_bounds(segment, time).value);
            for (i, rate) in rates.iter().enumerate() {
                slopes[i] += (before - after) * rate;
                sizes[i] += ((before - after) * rate).abs();
            }
        }
        for impulse in &self.impulses {
            for i in 0..slopes.len() {
                slopes[i] += impulse.jump[first + i];
                sizes[i] += impulse.jump[first + i].abs();
            }
        }
        for segment in 0..self.found.control.segments().len() {
            self.integrate_over(segment, |_, point, _, _, weight| {
                for i in 0..slopes.len() {
                    let part = weight * point.gradient[first + i];
                    slopes[i] += part;
                    sizes[i] += part.abs();
                }
            });
        }
    }

    /// Calls `add(equations, point, hamiltonian, time, weight)` at the points of a quadrature over an interval of the control.
    pub(super) fn integrate_over(
        &mut self,
        segment: usize,
        mut add: impl FnMut(&mut Equations<'_>, &Point, f64, f64, f64),
    ) {
        let (a, b) = (self.found.control.breaks()[segment], self.found.control.breaks()[segment + 1]);
        let panel = (b - a) / PANELS as f64;
        for k in 0..PANELS {
            for (abscissa, weight) in GAUSS {
                let time = a + (k as f64 + abscissa) * panel;
                let h = self.evaluate(segment, time).value;
                add(&mut self.equations, &self.point, h, time, weight * panel);
            }
        }
    }
}
