//! Quadratic functions of states that the equations of motion keep whatever the controls are, such as the length of an attitude quaternion or
//! an energy that no control changes.
//!
//! Ends with different values of one are out of reach. Collocation keeps what is linear in the states, and a quadratic function to the
//! error of its mesh alone: where requirements are relaxed, a motion that uses this error comes nearer than any flight. So a relaxed problem
//! states that both ends of a phase have the same value. The functions are found by linear algebra: their rates
//!
//! ```text
//! sum_k c_k d(m_k)/dt = 0     with monomials m_k of degree one and two
//! ```
//!
//! vanish at all states, controls, parameters and times, so that `c` is in the kernel of a matrix of samples.

use apsides_ad::{FormulaBuilder, Value, formula_node};
use apsides_ocp::{Bounds, EndpointConstraint, EndpointInput, Ocp, Phase, Variable};

/// Most states of a phase in which invariants are looked for: there are as many monomials as half its square.
const MOST_STATES: usize = 12;
/// Samples for each monomial.
const SAMPLES: usize = 3;
/// A pivot, and a rate beside its terms, that is rounding.
const ROUNDING: f64 = 1e-11;
/// Largest difference of a function between both ends, in the scales of its states: more than the error of a mesh, and less than amounts that
/// count.
const KEPT: f64 = 1e-7;
/// Irrational multiples of this are spread evenly over a unit interval (H. Weyl, 1916).
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// A monomial of states over their scales: one state, or the product of two.
pub(crate) type Monomial = (usize, Option<usize>);

/// Monomials and their coefficients.
pub(crate) type Terms = Vec<(Monomial, f64)>;

/// The problem whose phases have at their ends the same values of what their motion keeps, as guards; none where nothing is found.
pub(crate) fn with_invariants(ocp: &Ocp) -> Option<Ocp> {
    let mut with = ocp.clone();
    for (k, phase) in ocp.phases.iter().enumerate() {
        let scales = scales(phase);
        let all: Vec<usize> = (0..phase.states.len()).collect();
        let found = kept(ocp, phase, &scales, &all).quadratic.into_iter();
        let stated = found.filter(|terms| is_stated(phase, terms));
        for (number, terms) in stated.enumerate() {
            let terms = &terms;
            with.constraints.extend(constraint(k, number, terms, &scales));
        }
    }
    (with.constraints.len() > ocp.constraints.len()).then_some(with)
}

/// True if both ends of the phase fix a state that the function is made of: the ends of others can follow the motion.
fn is_stated(phase: &Phase, terms: &[(Monomial, f64)]) -> bool {
    let states = || terms.iter().flat_map(|((first, second), _)| [Some(*first), *second]).flatten();
    states().any(|i| phase.states[i].initial.is_fixed())
        && states().any(|i| phase.states[i].terminal.is_fixed())
}

/// Sizes of the states.
pub(crate) fn scales(phase: &Phase) -> Vec<f64> {
    let scale = |s: &apsides_ocp::State| {
        let ends = [s.initial.lower, s.initial.upper, s.terminal.lower, s.terminal.upper].map(f64::abs);
        let met = ends.into_iter().filter(|v| v.is_finite()).fold(0.0, f64::max);
        let size = s.variable.scale.or((met > 0.0).then_some(met)).or_else(|| s.variable.size());
        size.unwrap_or(1.0)
    };
    phase.states.iter().map(scale).collect()
}

/// The functions of some states that the motion of a phase keeps.
#[derive(Default)]
pub(crate) struct Kept {
    pub(crate) linear: Vec<Terms>,
    pub(crate) quadratic: Vec<Terms>,
}

/// The functions of these states that the motion of a phase keeps, of the states over their scales.
pub(crate) fn kept(ocp: &Ocp, phase: &Phase, scales: &[f64], among: &[usize]) -> Kept {
    if phase.states.len() > MOST_STATES {
        return Kept::default();
    }
    let of = |monomials: &[Monomial]| -> Vec<Terms> {
        let rates = |samples| rates(ocp, phase, scales, monomials, samples);
        // Most motions keep nothing, which the least number of samples shows.
        if Eliminated::of(rates(monomials.len())).is_some_and(|e| e.rank == monomials.len()) {
            return Vec::new();
        }
        let found = kernel(rates(SAMPLES * monomials.len())).into_iter();
        let terms = |kept: Vec<f64>| monomials.iter().copied().zip(kept).filter(|(_, c)| *c != 0.0).collect();
        found.map(terms).collect()
    };
    let linear = of(&among.iter().map(|i| (*i, None)).collect::<Vec<_>>());
    // A state that follows from others, which linear functions make known, has no part in the quadratic ones.
    let leads: Vec<usize> = linear.iter().filter_map(|terms| terms.last()).map(|((i, _), _)| *i).collect();
    let free: Vec<usize> = among.iter().copied().filter(|i| !leads.contains(i)).collect();
    let mut monomials: Vec<Monomial> = Vec::new();
    for (n, &i) in free.iter().enumerate() {
        monomials.extend(free[n..].iter().map(|&j| (i, Some(j))));
    }
    monomials.extend(free.iter().map(|&i| (i, None)));
    let is_quadratic = |terms: &Terms| terms.iter().any(|((_, second), _)| second.is_some());
    Kept { quadratic: of(&monomials).into_iter().filter(is_quadratic).collect(), linear }
}

/// States with bounds, and the largest magnitude that each of them can have since the motion keeps a sum of squares which the initial states fix.
pub(crate) fn largest_by_motion(ocp: &Ocp, phase: &Phase) -> Vec<(usize, f64)> {
    let is_fixed = |s: &usize| phase.states[*s].initial.is_fixed();
    let fixed: Vec<usize> = (0..phase.states.len()).filter(is_fixed).collect();
    let has_bounds = |s: &usize| {
        let Bounds { lower, upper } = phase.states[*s].variable.bounds;
        lower.is_finite() || upper.is_finite()
    };
    if !fixed.iter().any(has_bounds) {
        return Vec::new();
    }
    let scales = scales(phase);
    let mut found = Vec::new();
    for terms in kept(ocp, phase, &scales, &fixed).quadratic {
        let squares = terms.iter().map(|&((i, j), c)| (j == Some(i)).then_some((i, c)));
        let Some(squares) = squares.collect::<Option<Vec<_>>>() else { continue };
        let sign = squares.first().map_or(1.0, |(_, c)| c.signum());
        if squares.iter().any(|(_, c)| c * sign <= 0.0) {
            continue;
        }
        let start = |i: usize| phase.states[i].initial.lower / scales[i];
        let sum: f64 = squares.iter().map(|&(i, c)| c * sign * start(i).powi(2)).sum();
        let bounded = squares.iter().filter(|(i, _)| has_bounds(i));
        found.extend(bounded.map(|&(i, c)| (i, scales[i] * (sum / (c * sign)).sqrt())));
    }
    found
}

/// The rates of monomials at samples: one row for each. Nothing where the equations of motion have no values.
fn rates(ocp: &Ocp, phase: &Phase, scales: &[f64], monomials: &[Monomial], samples: usize) -> Vec<Vec<f64>> {
    let motion = phase.dynamics.as_ref();
    let nx = phase.states.len();
    let parameters = ocp.parameters.iter().map(|p| (p.bounds, p.size().unwrap_or(1.0)));
    let controls = phase.controls.iter().map(|c| (c.bounds, c.size().unwrap_or(1.0)));
    let taken = phase.takes_parameters(motion);
    let (start, end) = phase.time_bounds();
    let time = (Bounds::new(start.lower, end.upper), 1.0);
    let others = controls.chain(parameters.filter(|_| taken)).chain([time]);
    let states = phase.states.iter().zip(scales).map(|(s, scale)| (s.variable.bounds, *scale));
    let ranges: Vec<(Bounds, f64)> = states.chain(others).collect();
    let mut z = vec![0.0; ranges.len()];
    let (mut f, mut rows) = (vec![0.0; nx], Vec::new());
    for sample in 0..samples {
        for (j, (z, (bounds, size))) in z.iter_mut().zip(&ranges).enumerate() {
            let spread = (GOLDEN * ((sample + 1) * (2 * j + 3)) as f64 + 0.37 * (j * j) as f64).fract();
            *z = between(*bounds, *size, spread);
        }
        motion.value(&z, &mut f);
        if f.iter().any(|v| !v.is_finite()) {
            continue;
        }
        let rate = |&(i, second): &Monomial| match second {
            None => f[i] / scales[i],
            Some(j) => (z[i] * f[j] + z[j] * f[i]) / (scales[i] * scales[j]),
        };
        rows.push(monomials.iter().map(rate).collect());
    }
    rows
}

/// A value within bounds, at a part of their range no farther than its size from zero, or from the bound next to zero.
fn between(bounds: Bounds, size: f64, part: f64) -> f64 {
    let middle = bounds.clamp(0.0);
    let (least, most) = (bounds.lower.max(middle - size), bounds.upper.min(middle + size));
    least + part * (most - least)
}

/// A matrix after elimination with complete pivoting; its columns were first brought to one size.
struct Eliminated {
    rows: Vec<Vec<f64>>,
    sizes: Vec<f64>,
    /// The columns, those with pivots first.
    columns: Vec<usize>,
    rank: usize,
}

impl Eliminated {
    /// None for a matrix without columns.
    fn of(mut rows: Vec<Vec<f64>>) -> Option<Self> {
        let n = rows.first().map(Vec::len).filter(|n| *n > 0)?;
        let size = |k: usize| rows.iter().map(|r| r[k].abs()).fold(0.0, f64::max);
        let sizes: Vec<f64> = (0..n).map(size).map(|s| if s > 0.0 { s } else { 1.0 }).collect();
        for row in &mut rows {
            row.iter_mut().zip(&sizes).for_each(|(v, s)| *v /= s);
        }
        let mut columns: Vec<usize> = (0..n).collect();
        let mut rank = 0;
        while rank < n {
            let places = (rank..rows.len()).flat_map(|i| (rank..n).map(move |k| (i, k)));
            let Some((i, k)) = places.max_by(|a, b| {
                let at = |&(i, k): &(usize, usize)| rows[i][columns[k]].abs();
                at(a).total_cmp(&at(b))
            }) else {
                break;
            };
            if rows[i][columns[k]].abs() <= ROUNDING {
                break;
            }
            rows.swap(rank, i);
            columns.swap(rank, k);
            let pivot = rows[rank].clone();
            let column = columns[rank];
            for (_, row) in rows.iter_mut().enumerate().filter(|(i, _)| *i != rank) {
                let factor = row[column] / pivot[column];
                row.iter_mut().zip(&pivot).for_each(|(v, p)| *v -= factor * p);
            }
            rank += 1;
        }
        Some(Self { rows, sizes, columns, rank })
    }

    /// The vector that the matrix maps to zero, of which a column without a pivot has a part.
    fn kept(&self, free: usize) -> Vec<f64> {
        let Self { rows, sizes, columns, rank } = self;
        let mut kept = vec![0.0; sizes.len()];
        kept[columns[free]] = 1.0 / sizes[columns[free]];
        for (row, &column) in rows.iter().zip(&columns[..*rank]) {
            let part = -row[columns[free]] / row[column];
            kept[column] = if part.abs() <= ROUNDING.sqrt() { 0.0 } else { part / sizes[column] };
        }
        let largest = kept.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
        kept.iter_mut().for_each(|c| *c /= largest);
        kept
    }
}

/// A basis of what a matrix maps to zero; nothing where it has too few rows to tell.
fn kernel(rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let tells = rows.first().is_some_and(|row| rows.len() >= 2 * row.len());
    let Some(eliminated) = Eliminated::of(rows).filter(|_| tells) else { return Vec::new() };
    (eliminated.rank..eliminated.columns.len()).map(|free| eliminated.kept(free)).collect()
}

/// Both ends of a phase have the same value of a function.
fn constraint(
    phase: usize,
    number: usize,
    terms: &[(Monomial, f64)],
    scales: &[f64],
) -> Option<EndpointConstraint> {
    let mut states: Vec<usize> = terms.iter().flat_map(|((i, j), _)| [Some(*i), *j]).flatten().collect();
    states.sort_unstable();
    states.dedup();
    let place = |state: usize| states.iter().position(|s| *s == state).unwrap_or_default();
    let mut b = FormulaBuilder::new(2 * states.len());
    let sum = |b: &mut FormulaBuilder, first: usize| {
        let mut sum = b.constant(0.0);
        for ((i, j), c) in terms {
            let over = |b: &mut FormulaBuilder, state: usize| -> Value {
                let (x, factor) = (b.input(first + place(state)), b.constant(1.0 / scales[state]));
                b.mul(x, factor)
            };
            let (mut term, factor) = (over(b, *i), b.constant(*c));
            if let Some(j) = j {
                let second = over(b, *j);
                term = b.mul(term, second);
            }
            term = b.mul(factor, term);
            sum = b.add(sum, term);
        }
        sum
    };
    let (start, end) = (sum(&mut b, 0), sum(&mut b, states.len()));
    let change = b.sub(end, start);
    let initial = states.iter().map(|&state| EndpointInput::InitialState { phase, state });
    let terminal = states.iter().map(|&state| EndpointInput::FinalState { phase, state });
    let row = Variable {
        scale: Some(1.0),
        guards: [true; 2],
        ..Variable::new(format!("invariant {}", number + 1), "-").within(-KEPT, KEPT)
    };
    Some(EndpointConstraint {
        name: "what the motion keeps".into(),
        rows: vec![row],
        inputs: initial.chain(terminal).collect(),
        function: formula_node(b.formula(&[change]).ok()?),
    })
}

#[cfg(test)]
mod tests {
    use apsides_ad::{Dynamics, Scalar};
    use apsides_ocp::{At, State};

    use super::*;

    /// Coefficients are found by elimination.
    const ROUND: f64 = 1e-9;

    /// A turn of a vector, with a rate that grows by `growth` times its length.
    struct Turn {
        growth: f64,
    }

    impl Dynamics<3, 1> for Turn {
        fn rate<S: Scalar>(&self, _t: S, x: &[S; 3], u: &[S; 1], _p: &[S; 0]) -> [S; 3] {
            [-x[1] * u[0] + x[0] * self.growth, x[0] * u[0] + x[1] * self.growth, u[0]]
        }
    }

    fn turn(growth: f64) -> Ocp {
        let phase = Phase::new("turn", Turn { growth })
            .states([
                State::new("c", "m").starts_at(2.0),
                State::new("s", "m").starts_at(0.0).ends_at(4.0),
                State::new("angle", "rad").starts_at(0.0),
            ])
            .controls([Variable::new("w", "rad/s").within(-1.0, 1.0)])
            .final_time(Bounds::fixed(1.0));
        Ocp::builder("turn")
            .phase(phase)
            .minimize("angle", "rad", At::FinalState("turn", "angle"))
            .build()
            .unwrap()
    }

    #[test]
    fn the_length_of_a_vector_that_turns_is_kept() {
        let ocp = turn(0.0);
        let scales = scales(&ocp.phases[0]);
        let found = kept(&ocp, &ocp.phases[0], &scales, &[0, 1, 2]).quadratic;
        let [terms] = &found[..] else { panic!("{found:?}") };
        // c^2 + s^2 with scales of 2 and 4.
        let [((0, Some(0)), c), ((1, Some(1)), s)] = terms[..] else { panic!("{terms:?}") };
        assert!((s / c - 4.0).abs() <= ROUND, "{terms:?}");
        let with = with_invariants(&ocp).unwrap();
        let mut change = [0.0];
        with.constraints[0].function.value(&[2.0, 0.0, 0.0, 2.0], &mut change);
        assert!(change[0].abs() <= ROUND, "{change:?}");
        with.constraints[0].function.value(&[2.0, 0.0, 0.0, 2.1], &mut change);
        assert!(change[0].abs() > 1e-2, "{change:?}");
    }

    /// A state that is larger than its size is sampled along its bound otherwise, where its square is as good as the state itself.
    #[test]
    fn samples_are_spread_within_bounds_far_from_zero() {
        let values = [0.0, 0.25, 1.0].map(|part| between(Bounds::at_least(4.8), 5.0, part));
        assert_eq!(values, [4.8, 6.05, 9.8]);
        assert_eq!(between(Bounds::new(-1e9, 1.0), 5.0, 0.5), -2.0);
        assert_eq!(between(Bounds::fixed(3.0), 5.0, 0.5), 3.0);
    }

    #[test]
    fn components_of_a_vector_that_turns_stay_within_its_length() {
        let mut ocp = turn(0.0);
        assert!(largest_by_motion(&ocp, &ocp.phases[0]).is_empty());
        ocp.phases[0].states[1].variable.bounds = Bounds::at_most(9.0);
        let [(1, most)] = largest_by_motion(&ocp, &ocp.phases[0])[..] else { panic!("the length is kept") };
        assert!((most - 2.0).abs() <= ROUND, "{most}");
        let mut grows = turn(1e-6);
        grows.phases[0].states[1].variable.bounds = Bounds::at_most(9.0);
        assert!(largest_by_motion(&grows, &grows.phases[0]).is_empty());
    }

    #[test]
    fn what_grows_a_little_is_not_kept() {
        assert!(with_invariants(&turn(1e-6)).is_none());
    }
}
