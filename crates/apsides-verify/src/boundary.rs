//! Feasibility at the ends: misses of the re-simulation, bounds, endpoint constraints, objective.

use apsides_ad::NodeFunction;
use apsides_ocp::curvature::{mean_along, share_of_curvature};
use apsides_ocp::linkage;
use apsides_ocp::{Bounds, EndpointInput, Ocp, Phase, PhaseScaling, Scaling, Trajectory, Variable};

use crate::ends::{EndScales, Ends, PhaseEnds, largest_bound};
use crate::place::place;
use crate::simulation::Flight;
use crate::worst::Worst;
use crate::{Check, CheckKind, VerifySettings};

const KIND: CheckKind = CheckKind::Feasibility;

/// Parts of an objective that cancel each other to less than this part of the largest one determine its size.
const CANCELLING: f64 = 0.1;
/// Local errors of this many steps add up in a re-simulation.
const STEPS: f64 = 1e3;

/// Everything that is compared at the ends of phases.
pub(crate) struct Boundary<'a> {
    pub(crate) ocp: &'a Ocp,
    pub(crate) trajectory: &'a Trajectory,
    pub(crate) flights: &'a [Flight],
    pub(crate) scaling: &'a Scaling,
    pub(crate) settings: &'a VerifySettings,
}

impl Boundary<'_> {
    pub(crate) fn checks(&self) -> Vec<Check> {
        let scales = EndScales::new(self.ocp, self.scaling, self.settings);
        let mut checks = Vec::new();
        for k in 0..self.ocp.phases.len() {
            match self.failed_flight(k) {
                Some(check) => checks.push(check),
                None => {
                    checks.extend(misses(self.ocp, self.trajectory, k, &self.flights[k], &scales));
                    checks.extend(self.changes(k));
                    checks.extend(self.state_bounds(k, &scales));
                    checks.extend(self.integral_bounds(k));
                }
            }
            checks.extend(self.times(k));
        }
        checks.extend(self.parameters());
        checks.extend(self.constraints(&scales));
        checks.push(self.objective());
        checks
    }

    fn failed_flight(&self, k: usize) -> Option<Check> {
        let failure = self.flights[k].failure.as_ref()?;
        let phase = &self.ocp.phases[k];
        let missing = self.trajectory.phases[k].final_time - failure.time;
        let name = format!("time of {} left when its re-simulation stopped", phase.name);
        let at = format!("{}: {}", place(phase, failure.time), failure.reason);
        // Stopping at the last instant is a failure too.
        let missing = missing.max(f64::MIN_POSITIVE);
        Some(Check::new(name, KIND, missing, 0.0, phase.time_unit.clone(), at))
    }

    /// The changes of the controls that join the pieces of a flight.
    fn changes(&self, k: usize) -> Option<Check> {
        let phase = &self.ocp.phases[k];
        let mut worst = Worst::default();
        for restart in &self.flights[k].restarts {
            worst.consider(restart.change, self.settings.end_tolerance, "-", || place(phase, restart.time));
        }
        worst.into_check(
            format!("change of the controls that joins the re-simulated pieces of {}", phase.name),
            KIND,
        )
    }

    /// A sentence for each phase that is flown in pieces.
    pub(crate) fn pieces(&self) -> impl Iterator<Item = String> {
        let phases =
            self.ocp.phases.iter().zip(self.flights).filter(|(_, flight)| !flight.restarts.is_empty());
        phases.map(|(phase, flight)| {
            let growth: f64 = flight.restarts.iter().map(|restart| restart.growth.max(1.0).log10()).sum();
            let (name, pieces) = (&phase.name, flight.restarts.len());
            format!(
                "phase `{name}` is re-simulated in {pieces} pieces: its errors grow up to 1e{growth:.0} times on the way, so that feedback alone holds it on \
                 its course"
            )
        })
    }

    fn state_bounds(&self, k: usize, scales: &EndScales<'_>) -> Option<Check> {
        let (phase, found, flight) = (&self.ocp.phases[k], &self.trajectory.phases[k], &self.flights[k]);
        let mut worst = Worst::default();
        for (i, state) in phase.states.iter().enumerate() {
            let limit = scales.tolerance(EndpointInput::FinalState { phase: k, state: i });
            let ends = [
                ("initial", &state.initial, flight.initial_state[i], found.initial_time),
                ("final", &state.terminal, flight.final_state[i], found.final_time),
            ];
            for (which, bounds, value, t) in ends {
                if *bounds != Bounds::FREE {
                    let at = || format!("{which} {}, {}", state.variable.name, place(phase, t));
                    worst.consider(bounds.excess(value), limit, &state.variable.unit, at);
                }
            }
        }
        worst.into_check(format!("boundary conditions of {}", phase.name), KIND)
    }

    fn integral_bounds(&self, k: usize) -> Option<Check> {
        let phase = &self.ocp.phases[k];
        let mut worst = Worst::default();
        let scales = &self.scaling.phases[k].integrals;
        for ((q, value), scale) in phase.integrals.iter().zip(&self.flights[k].integrals).zip(scales) {
            let limit = self.settings.end_tolerance * scale;
            if q.variable.bounds != Bounds::FREE {
                let at = || format!("{}, phase `{}`", q.variable.name, phase.name);
                worst.consider(q.variable.bounds.excess(*value), limit, &q.variable.unit, at);
            }
        }
        worst.into_check(format!("bounds on the integrals of {}", phase.name), KIND)
    }

    fn times(&self, k: usize) -> Option<Check> {
        let (phase, found) = (&self.ocp.phases[k], &self.trajectory.phases[k]);
        let limit = self.settings.end_tolerance * self.scaling.phases[k].time;
        let mut worst = Worst::default();
        for (which, bounds, value) in [
            ("initial time", phase.initial_time, found.initial_time),
            ("final time", phase.final_time, found.final_time),
            ("duration", phase.duration, found.final_time - found.initial_time),
        ] {
            let at = || format!("{which}, {}", place(phase, value));
            worst.consider(bounds.excess(value), limit, &phase.time_unit, at);
        }
        worst.into_check(format!("times of {}", phase.name), KIND)
    }

    fn parameters(&self) -> Option<Check> {
        let mut worst = Worst::default();
        for (i, (p, value)) in self.ocp.parameters.iter().zip(&self.trajectory.parameters).enumerate() {
            let limit = self.settings.end_tolerance * self.scaling.parameters[i];
            worst.consider(p.bounds.excess(*value), limit, &p.unit, || p.name.clone());
        }
        worst.into_check("bounds on the static parameters", KIND)
    }

    /// One check per name. Initial states are the trajectory's own, or linkages would hold by construction.
    fn constraints(&self, scales: &EndScales<'_>) -> Vec<Check> {
        let mut ends = Ends::of(self.trajectory);
        for (end, flight) in ends.phases.iter_mut().zip(self.flights) {
            end.final_state.copy_from_slice(&flight.final_state);
        }
        let mut groups: Vec<(&str, Worst)> = Vec::new();
        for (k, c) in self.ocp.constraints.iter().enumerate() {
            let values = ends.evaluate(c.function.as_ref(), &c.inputs);
            let tolerances = scales.row_tolerances(k, &ends);
            let linked = linkage::linked_rows(c);
            let known = groups.iter().position(|(name, _)| *name == c.name);
            let group = known.unwrap_or(groups.len());
            if known.is_none() {
                groups.push((&c.name, Worst::default()));
            }
            for (row, variable) in c.rows.iter().enumerate() {
                let limit = match linked[row] {
                    Some((phase, state)) => scales.tolerance(EndpointInput::InitialState { phase, state }),
                    None => tolerances[row],
                };
                let at = || variable.name.clone();
                groups[group].1.consider(variable.bounds.excess(values[row]), limit, &variable.unit, at);
            }
        }
        groups
            .into_iter()
            .filter_map(|(name, worst)| worst.into_check(format!("constraint {name}"), KIND))
            .collect()
    }

    fn objective(&self) -> Check {
        let ends = self.flown_ends();
        let integrals: Vec<_> = self.flights.iter().map(|f| f.integrals.clone()).collect();
        let stated = self.trajectory.objective;
        let value = ends.objective(self.ocp, &integrals);
        let o = &self.ocp.objective;
        let at = format!("recomputed {value}, stated {stated}");
        let limit = self.objective_limit(self.settings.objective_tolerance);
        Check::new(format!("objective {}", o.name), KIND, (value - stated).abs(), limit, o.unit.clone(), at)
    }

    /// The ends that were flown.
    fn flown_ends(&self) -> Ends {
        let phases = self.trajectory.phases.iter().zip(self.flights).map(|(found, flight)| PhaseEnds {
            initial_time: found.initial_time,
            final_time: found.final_time,
            initial_state: flight.initial_state.clone(),
            final_state: flight.final_state.clone(),
        });
        Ends { phases: phases.collect(), parameters: self.trajectory.parameters.clone() }
    }

    /// The change of the objective that is this part of its size, or what the re-simulation and, to second order, quantities within their tolerances
    /// leave, where that is more: all there is of an objective such as a sum of squares that can be brought down to nothing.
    pub(crate) fn objective_limit(&self, part: f64) -> f64 {
        let scales = EndScales::new(self.ocp, self.scaling, self.settings);
        let stated = self.trajectory.objective.abs();
        let scale = self.ocp.objective.scale.unwrap_or(0.0);
        let size = stated.max(scale).max(CANCELLING * self.largest_part(&self.flown_ends()));
        let size = if size > 0.0 && size.is_finite() { size } else { 1.0 };
        let of_curvature = share_of_curvature(
            self.ocp,
            self.trajectory,
            self.scaling,
            self.settings.path_tolerance,
            |input| scales.tolerance(input),
        );
        (part * size).max(of_curvature).max(self.share_of_simulation(&scales))
    }

    /// The change of an objective to first order by the errors of the re-simulation, where end quantities enter it as they are.
    fn share_of_simulation(&self, scales: &EndScales<'_>) -> f64 {
        let errors = STEPS * self.settings.integration_tolerance;
        self.ocp
            .objective
            .linear
            .iter()
            .map(|(input, weight)| errors * weight.abs() * scales.scale(*input))
            .sum()
    }

    /// Size of the largest part of the objective: parts that cancel each other leave the rounding of each. An integral counts with the
    /// magnitude of its integrand.
    fn largest_part(&self, ends: &Ends) -> f64 {
        let o = &self.ocp.objective;
        let linear = o.linear.iter().map(|(input, weight)| (weight * ends.value(*input)).abs());
        let mut value = [0.0];
        let functions = o.functions.iter().map(|(inputs, f)| ends.evaluate(f.as_ref(), inputs)[0].abs());
        let integrals = o.integrals.iter().map(|&(phase, q, weight)| {
            let magnitude = |f: &dyn NodeFunction, z: &[f64]| {
                f.value(z, &mut value);
                value[0].abs()
            };
            weight.abs() * mean_along(self.ocp, self.trajectory, [phase, q], magnitude)
        });
        let parts = linear.chain(functions).chain(integrals);
        parts.filter(|part| part.is_finite()).fold(0.0, f64::max)
    }
}

/// One check per state: the re-simulation against the trajectory at the end of the phase.
pub(crate) fn misses(
    ocp: &Ocp,
    trajectory: &Trajectory,
    k: usize,
    flight: &Flight,
    scales: &EndScales<'_>,
) -> Vec<Check> {
    let (phase, found) = (&ocp.phases[k], &trajectory.phases[k]);
    let expected = found.final_state();
    let miss = |(i, state): (usize, &apsides_ocp::State)| {
        let Variable { name, unit, .. } = &state.variable;
        let limit = scales.tolerance(EndpointInput::FinalState { phase: k, state: i });
        Check::new(
            format!("re-simulated {name} at the end of {}", phase.name),
            KIND,
            (flight.final_state[i] - expected[i]).abs(),
            limit,
            unit.clone(),
            place(phase, found.final_time),
        )
    };
    phase.states.iter().enumerate().map(miss).collect()
}

/// Typical size of a bounded quantity: as stated, else from its bounds and what is met between them, else the larger finite bound, else the
/// given one, else one.
pub(crate) fn row_scale(variable: &Variable, size: f64) -> f64 {
    let usable = |s: &f64| *s > 0.0 && s.is_finite();
    variable
        .scale
        .or(variable.size_within_bounds(size.abs()))
        .or(Some(largest_bound(variable)).filter(usable))
        .or(Some(size.abs()).filter(usable))
        .unwrap_or(1.0)
}

/// Typical sizes of the rows of path constraints, by the largest values met: of a row that stays at a bound of zero these are rounding, and what
/// its inputs change it by counts.
pub(crate) fn row_scales(phase: &Phase, scaling: &PhaseScaling, met: impl Fn(usize) -> f64) -> Vec<f64> {
    let rows = phase.path.iter().flat_map(|p| &p.rows).enumerate();
    rows.map(|(r, row)| row_scale(row, met(r).max(scaling.path[r]))).collect()
}
