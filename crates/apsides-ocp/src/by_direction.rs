//! Vectors of controls whose length occurs, by length and direction.
//!
//! ```text
//! u = s d,   |u| = s,   d . d = 1,   s >= 0
//! ```
//!
//! Where the vector is nothing, as a thrust on a coast, its length has no derivative; that of a length of its own has one (D. F. Lawden,
//! Optimal Trajectories for Space Navigation, Butterworths 1963, chapter 3). A limit of the length is a bound of `s`. A length that occurs
//! in limits alone needs no direction: its square has no kink. One that a [cone](crate::cones) keeps below a radius needs one where the radius may
//! be nothing.

mod lengths;
mod writer;

use apsides_ad::AdError;

use crate::{
    Bounds, Guess, LagrangianSlope, Ocp, Phase, PhaseGuess, PhaseTrajectory, PiecewisePolynomial, Trajectory,
    Variable,
};
use lengths::{Lengths, Measure};
use writer::Writer;

/// Points at which lengths and directions of a guess are taken.
const SAMPLES: usize = 65;
/// A length below this part of the largest one, or of one where that is infinite, has no direction.
const NOTHING: f64 = 1e-9;
/// Rounding of lengths for a start, relative to the same.
const ROUNDED: f64 = 0.1;
/// The bounds of a length without a limit.
const NOT_NEGATIVE: Bounds = Bounds { lower: 0.0, upper: f64::INFINITY };
/// A length closer to its bound than this part of it is at it.
const AT_BOUND: f64 = 1e-6;

/// A problem in which vectors of controls are stated by length and direction.
pub struct ByDirection {
    /// The problem with lengths and directions.
    pub ocp: Ocp,
    /// The problem as it was posed with rounded lengths `sqrt(u . u + e^2)`, which has slopes where a guess has no direction; its solution is a
    /// start. None where lengths occur in limits alone.
    pub rounded: Option<Ocp>,
    phases: Vec<PhaseVectors>,
}

/// The vectors of a phase, with its rows as they were posed.
#[derive(Default)]
struct PhaseVectors {
    vectors: Vec<ControlVector>,
    controls: usize,
    rows: Vec<Row>,
    /// The vector and the control of each row that bounds a component, behind the rows of the directions.
    components: Vec<(usize, usize)>,
}

/// A vector of controls whose length occurs.
struct ControlVector {
    /// Places of the components, which their directions take.
    components: Vec<usize>,
    /// Place of the length.
    length: usize,
    /// The length that the bounds of the components allow.
    most: f64,
}

/// The place of a row of a path constraint among those with directions.
enum Row {
    /// The row at an index.
    Kept(usize),
    /// The row at an index, which is the square of the length of controls.
    Squared(usize, Vec<usize>),
    /// The row at an index, by the length of a vector instead of its square, and its sign where the vector is longer than the radius.
    Cone { row: usize, vector: usize, sign: f64 },
    /// The upper bound of the length of a vector: its index, and true for a row that was the square. A lower one would keep it from being
    /// nothing.
    Bound { vector: usize, squared: bool, most: f64 },
}

impl ByDirection {
    /// The problem with lengths and directions; none where no length of a vector of controls occurs.
    #[must_use]
    pub fn of(ocp: &Ocp) -> Option<Self> {
        let (mut by_direction, mut rounded) = (ocp.clone(), ocp.clone());
        let mut phases = Vec::new();
        let mut any = false;
        for ((phase, rounded), posed) in
            by_direction.phases.iter_mut().zip(&mut rounded.phases).zip(&ocp.phases)
        {
            let lengths = Lengths::of(posed).filter(|l| l.occur());
            let split = lengths.and_then(|lengths| split(&lengths, rounded).ok());
            any |= split.is_some();
            let kept = || PhaseVectors {
                controls: posed.controls.len(),
                rows: (0..posed.path_rows()).map(Row::Kept).collect(),
                ..PhaseVectors::default()
            };
            phases.push(match split {
                Some((split, vectors)) => {
                    *phase = split;
                    vectors
                }
                None => kept(),
            });
        }
        let rounded = phases.iter().any(|p| !p.vectors.is_empty()).then_some(rounded);
        any.then_some(Self { ocp: by_direction, rounded, phases })
    }

    /// A guess of the problem as it was posed, as one of the problem with lengths and directions.
    #[must_use]
    pub fn guess(&self, guess: &Guess) -> Guess {
        let phases = guess.phases.iter().zip(&self.phases).zip(&self.ocp.phases);
        let phases = phases.map(|((guess, vectors), phase)| match vectors.vectors.is_empty() {
            true => guess.clone(),
            false => vectors.guess(guess, phase),
        });
        Guess { phases: phases.collect(), ..guess.clone() }
    }

    /// A trajectory of the problem with lengths and directions as one of the problem as it was posed.
    #[must_use]
    pub fn as_posed(&self, solved: &Trajectory) -> Trajectory {
        let phases = self.phases.iter().zip(&solved.phases).enumerate();
        let phases = phases.map(|(k, (vectors, found))| {
            let slope = LagrangianSlope::new(&self.ocp, k, found, &solved.parameters);
            vectors.as_posed(&self.ocp.phases[k], found, slope)
        });
        Trajectory { phases: phases.collect(), ..solved.clone() }
    }

    /// A trajectory of the problem as it was posed as one of the problem with lengths and directions.
    #[must_use]
    pub fn with_directions(&self, posed: &Trajectory) -> Trajectory {
        let phases = self.phases.iter().zip(&posed.phases).enumerate();
        let phases = phases.map(|(k, (vectors, found))| {
            let phase = &self.ocp.phases[k];
            let mut split = vectors.with_directions(phase, found);
            if split.path_multipliers.is_some() && !vectors.vectors.is_empty() {
                if let Some(pushed) = vectors.pushed_by_cones(&split) {
                    let both = [&split, &pushed];
                    let slopes = both.map(|of| LagrangianSlope::new(&self.ocp, k, of, &posed.parameters));
                    split.path_multipliers = Some(vectors.multipliers_at_tips(phase, both, slopes));
                }
                let slope = LagrangianSlope::new(&self.ocp, k, &split, &posed.parameters);
                split.path_multipliers = Some(vectors.multipliers(phase, &split, slope));
            }
            split
        });
        Trajectory { phases: phases.collect(), ..posed.clone() }
    }
}

impl PhaseVectors {
    /// Length and direction of each vector in place of its components; one that is nothing keeps the direction that is there, else has the
    /// same components all along.
    fn split(&self, phase: &Phase, posed: &[f64], u: &mut [f64], before: Option<&[f64]>) {
        u[..posed.len()].copy_from_slice(posed);
        for v in &self.vectors {
            let length = v.components.iter().map(|j| posed[*j] * posed[*j]).sum::<f64>().sqrt();
            let even = 1.0 / (v.components.len() as f64).sqrt();
            for j in &v.components {
                let kept = before.map_or(even, |before| before[*j]);
                u[*j] = if length > v.nothing(phase) { posed[*j] / length } else { kept };
            }
            u[v.length] = length;
        }
    }

    fn guess(&self, guess: &PhaseGuess, phase: &Phase) -> PhaseGuess {
        guess.with_samples(SAMPLES, |_, _, u| {
            let posed = u.clone();
            u.resize(phase.controls.len(), 0.0);
            self.split(phase, &posed, u, None);
        })
    }

    fn as_posed(
        &self,
        phase: &Phase,
        solved: &PhaseTrajectory,
        slope: LagrangianSlope<'_>,
    ) -> PhaseTrajectory {
        let mut t = solved.clone();
        t.control = solved.control.map_nodes(self.controls, |solved, posed| {
            posed.copy_from_slice(&solved[..self.controls]);
            for v in &self.vectors {
                v.components.iter().for_each(|j| posed[*j] *= solved[v.length]);
            }
        });
        t.path_multipliers =
            solved.path_multipliers.as_ref().map(|all| self.multipliers_as_posed(phase, solved, all, slope));
        t.contacts.retain_mut(|contact| {
            let row = self.rows.iter().position(|row| matches!(row, Row::Kept(k) if *k == contact.row));
            row.map(|row| contact.row = row).is_some()
        });
        // An arc of a length is none of its components.
        t.mesh = t.mesh.clone().without_arcs();
        t
    }

    /// The multipliers of the rows as they were posed: those of limits that are bounds now are what the bounds push.
    fn multipliers_as_posed(
        &self,
        phase: &Phase,
        solved: &PhaseTrajectory,
        all: &PiecewisePolynomial,
        slope: LagrangianSlope<'_>,
    ) -> PiecewisePolynomial {
        let nx = phase.states.len();
        let mut at = Slopes::new(all, phase, solved, slope);
        all.map_nodes(self.rows.len(), |found, posed| {
            let (u, slopes) = at.next();
            for (row, multiplier) in self.rows.iter().zip(posed) {
                *multiplier = match row {
                    Row::Kept(k) => found[*k],
                    Row::Squared(k, components) => 2.0 * length(u, components) * found[*k],
                    Row::Cone { row, vector, .. } => self.of_square(*vector, u, found[*row], phase),
                    Row::Bound { vector, squared, most } => {
                        let length = self.vectors[*vector].length;
                        let is_at = u[length] >= (1.0 - AT_BOUND) * most;
                        let push = if is_at { (-slopes[nx + length]).max(0.0) } else { 0.0 };
                        // Along a coast the limit of the square pushes nothing.
                        if *squared && push > 0.0 { push / (2.0 * u[length]) } else { push }
                    }
                };
            }
        })
    }

    /// The multiplier of a row by the square of the length of a vector that has one by the length; nothing holds a square at nothing.
    fn of_square(&self, vector: usize, u: &[f64], of_length: f64, phase: &Phase) -> f64 {
        let v = &self.vectors[vector];
        let length = u[v.length];
        if length > v.nothing(phase) { of_length / (2.0 * length) } else { 0.0 }
    }

    /// The trajectory with lengths and directions, and the multipliers of the rows that both problems have.
    fn with_directions(&self, phase: &Phase, found: &PhaseTrajectory) -> PhaseTrajectory {
        let mut t = found.clone();
        let nu = phase.controls.len();
        let mut before: Option<Vec<f64>> = None;
        t.control = found.control.map_nodes(nu, |posed, u| {
            self.split(phase, posed, u, before.as_deref());
            before = Some(u.to_vec());
        });
        let mut u = vec![0.0; self.controls];
        t.path_multipliers = found.path_multipliers.as_ref().map(|stated| {
            let mut at = Nodes::new(stated);
            stated.map_nodes(phase.path_rows(), |posed, all| {
                let (interval, time) = at.next();
                found.control.evaluate_in(interval, time, &mut u);
                for (row, multiplier) in self.rows.iter().zip(posed) {
                    match row {
                        Row::Kept(k) => all[*k] = *multiplier,
                        Row::Squared(k, components) if *multiplier != 0.0 => {
                            all[*k] = multiplier / (2.0 * length(&u, components));
                        }
                        Row::Cone { row, vector, .. } => {
                            let components = &self.vectors[*vector].components;
                            all[*row] = 2.0 * length(&u, components) * multiplier;
                        }
                        Row::Squared(..) | Row::Bound { .. } => {}
                    }
                }
            })
        });
        // With directions there are rows where none may have been.
        if t.path_multipliers.is_none() && self.rows.is_empty() && phase.path_rows() > 0 {
            t.path_multipliers = Some(t.control.map_nodes(phase.path_rows(), |_, all| all.fill(0.0)));
        }
        t.contacts.retain_mut(|contact| match self.rows.get(contact.row) {
            Some(Row::Kept(k)) => {
                contact.row = *k;
                true
            }
            _ => false,
        });
        t
    }

    /// The trajectory with multipliers of the rows of cones that are larger by one; none where there are no cones.
    fn pushed_by_cones(&self, split: &PhaseTrajectory) -> Option<PhaseTrajectory> {
        let mut cones = self.cones().peekable();
        cones.peek()?;
        let known = split.path_multipliers.as_ref()?;
        let cones: Vec<(usize, usize, f64)> = cones.collect();
        let pushed = known.map_nodes(known.dimension(), |known, all| {
            all.copy_from_slice(known);
            cones.iter().for_each(|(row, _, sign)| all[*row] += sign);
        });
        Some(PhaseTrajectory { path_multipliers: Some(pushed), ..split.clone() })
    }

    /// Row, vector and sign of each cone.
    fn cones(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        self.rows.iter().filter_map(|row| match row {
            Row::Cone { row, vector, sign } => Some((*row, *vector, *sign)),
            _ => None,
        })
    }

    /// The multipliers with those of cones at their tips, by the slopes without and with a multiplier of one. Any between the least that holds
    /// the vector there and the largest that the controls of the radius bear is one; the middle leaves both pushing. Where states are in the
    /// radius the costates depend on the multiplier, which stays as it is.
    fn multipliers_at_tips(
        &self,
        phase: &Phase,
        [split, pushed]: [&PhaseTrajectory; 2],
        [slope, slope_of_pushed]: [LagrangianSlope<'_>; 2],
    ) -> PiecewisePolynomial {
        let nx = phase.states.len();
        let known = split.path_multipliers.as_ref().unwrap_or(&split.control);
        let mut at =
            [Slopes::new(known, phase, split, slope), Slopes::new(known, phase, pushed, slope_of_pushed)];
        known.map_nodes(known.dimension(), |known, all| {
            all.copy_from_slice(known);
            let [(u, slopes), (_, with_one)] = at.each_mut().map(Slopes::next);
            let by_row = |j: usize| with_one[nx + j] - slopes[nx + j];
            for (row, vector, sign) in self.cones() {
                let v = &self.vectors[vector];
                if u[v.length] > v.nothing(phase) {
                    continue;
                }
                let others = (0..phase.controls.len()).filter(|j| by_row(*j) < 0.0);
                let is_of_controls = slopes[..nx] == with_one[..nx];
                if !is_of_controls || others.clone().any(|j| u[j] > v.nothing(phase)) {
                    continue;
                }
                let least = (-slopes[nx + v.length]).max(0.0);
                let most = others.map(|j| slopes[nx + j] / -by_row(j)).fold(f64::INFINITY, f64::min);
                let bears_more = most > least && most.is_finite();
                all[row] = sign * if bears_more { 0.5 * (least + most) } else { least };
            }
        })
    }

    /// The multipliers with those of the directions and of bounds of components, which are what the slope in the direction leaves.
    fn multipliers(
        &self,
        phase: &Phase,
        split: &PhaseTrajectory,
        slope: LagrangianSlope<'_>,
    ) -> PiecewisePolynomial {
        let nx = phase.states.len();
        let known = split.path_multipliers.as_ref().unwrap_or(&split.control);
        let rows = known.dimension();
        let first = rows - self.components.len() - self.vectors.len();
        let mut at = Slopes::new(known, phase, split, slope);
        known.map_nodes(rows, |known, all| {
            all.copy_from_slice(known);
            let (u, slopes) = at.next();
            for (k, v) in self.vectors.iter().enumerate() {
                let s = u[v.length];
                let bounded = |j: usize| {
                    let row = self.components.iter().position(|c| *c == (k, j))?;
                    let bounds = phase.path[phase.path.len() - self.components.len() + row].rows[0].bounds;
                    let reach = bounds.lower.abs().max(bounds.upper.abs());
                    (s > v.nothing(phase) && bounds.excess(s * u[j]) >= -AT_BOUND * reach)
                        .then_some(first + self.vectors.len() + row)
                };
                let free = v.components.iter().filter(|j| bounded(**j).is_none());
                let (along, square) = free.fold((0.0, 0.0), |(along, square), j| {
                    (along + u[*j] * slopes[nx + j], square + u[*j] * u[*j])
                });
                let multiplier = if square > 0.0 { -0.5 * along / square } else { 0.0 };
                all[first + k] = multiplier;
                for j in &v.components {
                    if let Some(row) = bounded(*j) {
                        all[row] = -(slopes[nx + j] + 2.0 * multiplier * u[*j]) / s;
                    }
                }
            }
        })
    }
}

impl ControlVector {
    /// A length that has no direction.
    fn nothing(&self, phase: &Phase) -> f64 {
        let most = phase.controls[self.length].bounds.upper.min(self.most);
        NOTHING * if most.is_finite() { most } else { 1.0 }
    }
}

/// The length of the vector of controls.
fn length(u: &[f64], components: &[usize]) -> f64 {
    components.iter().map(|j| u[*j] * u[*j]).sum::<f64>().sqrt()
}

/// Interval and time of each node of polynomials, one after the other.
struct Nodes(std::vec::IntoIter<(usize, f64)>);

impl Nodes {
    fn new(of: &PiecewisePolynomial) -> Self {
        let nodes = (0..of.segments().len()).flat_map(|k| of.node_times(k).map(move |t| (k, t)));
        Self(nodes.collect::<Vec<_>>().into_iter())
    }

    fn next(&mut self) -> (usize, f64) {
        self.0.next().unwrap_or_default()
    }
}

/// Controls and slope of the Lagrangian at each node of polynomials, one after the other.
struct Slopes<'a> {
    nodes: Nodes,
    control: &'a PiecewisePolynomial,
    lagrangian: LagrangianSlope<'a>,
    u: Vec<f64>,
    slopes: Vec<f64>,
}

impl<'a> Slopes<'a> {
    fn new(
        at: &PiecewisePolynomial,
        phase: &Phase,
        found: &'a PhaseTrajectory,
        lagrangian: LagrangianSlope<'a>,
    ) -> Self {
        let nu = phase.controls.len();
        let (u, slopes) = (vec![0.0; nu], vec![0.0; phase.states.len() + nu]);
        Self { nodes: Nodes::new(at), control: &found.control, lagrangian, u, slopes }
    }

    /// Controls, and slopes in the states and the controls.
    fn next(&mut self) -> (&[f64], &[f64]) {
        let (interval, time) = self.nodes.next();
        self.control.evaluate_in(interval, time, &mut self.u);
        self.slopes.fill(0.0);
        self.lagrangian.add(interval, time, &mut self.slopes);
        (&self.u, &self.slopes)
    }
}

/// The phase with lengths and directions in place of the vectors, and the vectors; `rounded` gets functions with rounded lengths.
fn split(lengths: &Lengths<'_>, rounded: &mut Phase) -> Result<(Phase, PhaseVectors), AdError> {
    let phase = lengths.phase;
    let mut split = phase.clone();
    let first = phase.controls.len();
    let found = lengths.vectors().into_iter().enumerate();
    let most = |components: &[usize]| {
        let largest = components.iter().map(|j| {
            let bounds = phase.controls[*j].bounds;
            bounds.lower.abs().max(bounds.upper.abs())
        });
        largest.map(|l| l * l).sum::<f64>().sqrt()
    };
    let vector = |(k, components): (usize, Vec<usize>)| ControlVector {
        most: most(&components),
        components,
        length: first + k,
    };
    let vectors: Vec<ControlVector> = found.map(vector).collect();
    for v in &vectors {
        let names: Vec<&str> = v.components.iter().map(|j| phase.controls[*j].name.as_str()).collect();
        let first = &phase.controls[v.components[0]];
        split.controls.push(Variable {
            name: format!("length of ({})", names.join(", ")),
            // What the components allow, their own bounds say.
            bounds: NOT_NEGATIVE,
            guards: [false; 2],
            ..first.clone()
        });
        for j in &v.components {
            let name = format!("direction of {}", phase.controls[*j].name);
            split.controls[*j] = Variable::new(name, "-").within(-1.0, 1.0);
        }
    }
    let writer = Writer { lengths, vectors: &vectors, controls: split.controls.len() };
    let mut functions = Vec::new();
    for formula in &lengths.formulas {
        functions.push(writer.function(formula)?);
    }
    let mut rows = Vec::new();
    let mut kept = 0;
    split.path.clear();
    for (k, constraint) in phase.path.iter().enumerate() {
        let limited = lengths.limited(constraint, k + 1);
        let vector = limited.as_ref().and_then(|(c, _)| vectors.iter().position(|v| v.components == *c));
        match (limited, vector) {
            (Some((_, measures)), Some(vector)) => {
                for (row, measure) in constraint.rows.iter().zip(measures) {
                    let squared = measure == Measure::Square;
                    let bounds = if squared { lengths_of(row.bounds) } else { row.bounds };
                    let of_length = &mut split.controls[vectors[vector].length].bounds;
                    *of_length = of_length.intersect(&bounds);
                    rows.push(Row::Bound { vector, squared, most: bounds.upper });
                }
            }
            (Some((components, measures)), None) if measures.contains(&Measure::Length) => {
                split.path.push(writer.squared(constraint, &components, &measures)?);
                for measure in measures {
                    rows.push(match measure {
                        Measure::Length => Row::Squared(kept, components.clone()),
                        Measure::Square => Row::Kept(kept),
                    });
                    kept += 1;
                }
            }
            _ => {
                let function = functions[k + 1].clone();
                let mut of_lengths = constraint.rows.clone();
                for (r, row) in of_lengths.iter_mut().enumerate() {
                    let cone = lengths.cone(k, r);
                    let components = cone.and_then(|cone| cone.controls(phase));
                    let vector = vectors.iter().position(|v| components.as_ref() == Some(&v.components));
                    rows.push(match (cone, vector) {
                        (Some(cone), Some(vector)) => {
                            *row = cone.row(row);
                            let sign = if cone.is_reversed { -1.0 } else { 1.0 };
                            Row::Cone { row: kept + r, vector, sign }
                        }
                        _ => Row::Kept(kept + r),
                    });
                }
                kept += of_lengths.len();
                split.path.push(crate::PathConstraint { function, rows: of_lengths });
            }
        }
    }
    let integrals = functions.split_off(1 + phase.path.len());
    split.dynamics = functions.swap_remove(0);
    for (integral, function) in split.integrals.iter_mut().zip(integrals) {
        integral.function = function;
    }
    let roundings: Vec<f64> = vectors.iter().map(|v| v.nothing(&split) * (ROUNDED / NOTHING)).collect();
    let mut rounds = Vec::new();
    for formula in &lengths.formulas {
        rounds.push(writer.rounded(formula, &roundings)?);
    }
    let path = rounded.path.iter_mut().map(|c| &mut c.function);
    let integrals = rounded.integrals.iter_mut().map(|i| &mut i.function);
    for (old, new) in std::iter::once(&mut rounded.dynamics).chain(path).chain(integrals).zip(rounds) {
        *old = new;
    }
    for v in &vectors {
        let length = &mut split.controls[v.length];
        if length.bounds == NOT_NEGATIVE && v.most.is_finite() {
            length.scale = length.scale.or(Some(v.most));
        }
        split.path.push(writer.unit(v)?);
    }
    let mut components = Vec::new();
    for (k, v) in vectors.iter().enumerate() {
        // Bounds that no vector of an allowed length reaches bind nothing.
        let most = split.controls[v.length].bounds.upper.min(v.most);
        for j in &v.components {
            let bounds = phase.controls[*j].bounds;
            if bounds.lower > -most || bounds.upper < most {
                split.path.push(writer.component(v, *j)?);
                components.push((k, *j));
            }
        }
    }
    Ok((split, PhaseVectors { vectors, controls: first, rows, components }))
}

/// Bounds of a length whose square has bounds.
fn lengths_of(squares: Bounds) -> Bounds {
    Bounds::new(squares.lower.max(0.0).sqrt(), squares.upper.max(0.0).sqrt())
}
