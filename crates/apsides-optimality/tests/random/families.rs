//! Families of random programs with a known kind of answer. Each generator draws sizes (1 to 30 variables, 0 to 30
//! constraints), sparsity, ranks and bounds anew; the answer follows from the construction, mostly from a point known
//! to be feasible.

use apsides_nlp::Scaling;

use super::program::{Form, Function, Program, Random, Row, Term, multiple, square, value};
use crate::support::INF;

/// A program, and the units of variables, constraints and objective to state it in.
pub(crate) struct Case {
    pub program: Program,
    pub units: Option<Scaling>,
}

impl From<Program> for Case {
    fn from(program: Program) -> Self {
        Self { program, units: None }
    }
}

fn size(r: &mut Random) -> usize {
    let most = if r.chance(0.5) { 6 } else { 30 };
    1 + r.below(most)
}

/// A linear function of about `density n` of the variables, of one at least.
fn linear(r: &mut Random, n: usize, density: f64) -> Function {
    let mut function = Function::new();
    for i in 0..n {
        if r.chance(density) {
            function.push(Term::new(r.coefficient(), i, Form::Linear));
        }
    }
    if function.is_empty() {
        function.push(Term::new(r.coefficient(), r.below(n), Form::Linear));
    }
    function
}

/// A strongly convex quadratic: a positive diagonal and some squares of sparse linear functions.
fn convex(r: &mut Random, n: usize) -> Function {
    let mut function = Function::new();
    for i in 0..n {
        function.extend(square(
            &[Term::new(1.0, i, Form::Linear)],
            r.between(-3.0, 3.0),
            r.between(0.1, 2.0),
        ));
    }
    for _ in 0..r.below(1 + n.min(5)) {
        function.extend(square(&linear(r, n, 2.0 / n as f64), r.between(-2.0, 2.0), r.between(0.1, 1.0)));
    }
    function
}

/// A linear function, or one that depends on earlier rows: a copy, a combination of two, or zero.
fn linear_or_dependent(r: &mut Random, n: usize, density: f64, rows: &[Row]) -> Function {
    if rows.is_empty() || r.chance(0.6) {
        return linear(r, n, density);
    }
    let copy = |r: &mut Random| multiple(&rows[r.below(rows.len())].function, r.coefficient());
    match r.below(3) {
        0 => copy(r),
        1 => {
            let mut sum = copy(r);
            sum.extend(copy(r));
            sum
        }
        _ => vec![Term::new(0.0, r.below(n), Form::Linear)],
    }
}

/// A row of any kind that `x` satisfies; as an inequality with at least `slack` to spare.
fn satisfied(r: &mut Random, function: Function, x: &[f64], slack: f64) -> Row {
    let value = value(&function, x);
    let mut room = || slack + r.between(0.0, 2.0);
    let (below, above) = (value - room(), value + room());
    let (lower, upper) = match r.below(5) {
        0 => (value, value),
        1 => (below, INF),
        2 => (-INF, above),
        3 => (below, above),
        _ => (-INF, INF),
    };
    Row { function, lower, upper }
}

/// Bounds of all kinds that `x` satisfies strictly.
fn bound_around(r: &mut Random, program: &mut Program, x: &[f64]) {
    for (i, x) in x.iter().enumerate() {
        let (below, above) = (x - r.between(0.05, 5.0), x + r.between(0.05, 5.0));
        (program.lower[i], program.upper[i]) = match r.below(4) {
            0 => (-INF, INF),
            1 => (below, INF),
            2 => (-INF, above),
            _ => (below, above),
        };
    }
}

/// Strongly convex objective, linear rows and bounds around a feasible point. Returns that point too.
fn convex_around(r: &mut Random) -> (Program, Vec<f64>) {
    let n = size(r);
    let x = r.point(n, -3.0, 3.0);
    let mut program = Program::free(r.point(n, -10.0, 10.0));
    program.objective = convex(r, n);
    bound_around(r, &mut program, &x);
    let density = r.between(0.05, 1.0);
    for _ in 0..r.below(31) {
        let function = linear_or_dependent(r, n, density, &program.rows);
        let row = satisfied(r, function, &x, 0.01);
        program.rows.push(row);
    }
    (program, x)
}

pub(crate) fn convex_quadratic(r: &mut Random) -> Case {
    convex_around(r).0.into()
}

pub(crate) fn linear_program(r: &mut Random) -> Case {
    let (mut program, x) = convex_around(r);
    program.objective = linear(r, x.len(), 0.7);
    for (i, x) in x.iter().enumerate() {
        program.lower[i] = program.lower[i].max(x - r.between(0.05, 5.0));
        program.upper[i] = program.upper[i].min(x + r.between(0.05, 5.0));
    }
    program.into()
}

/// A convex function of one variable, which must stay positive.
fn convex_term(r: &mut Random, i: usize) -> Function {
    let factor = r.between(0.1, 2.0);
    let form = match r.below(5) {
        0 => Form::Exp(r.coefficient()),
        1 => Form::Fourth,
        2 => Form::Reciprocal,
        3 => return vec![Term::new(-factor, i, Form::Log)],
        _ => Form::Product(i),
    };
    vec![Term::new(factor, i, form)]
}

pub(crate) fn convex_nonlinear(r: &mut Random) -> Case {
    let n = size(r);
    let x = r.point(n, 0.2, 3.0);
    let mut program = Program::free(r.point(n, -1.0, 6.0));
    program.objective = convex(r, n);
    for i in 0..n {
        program.lower[i] = r.between(0.01, 0.15);
        program.upper[i] = if r.chance(0.5) { r.between(3.1, 20.0) } else { INF };
        program.objective.extend(convex_term(r, i));
    }
    for _ in 0..r.below(1 + n.min(12)) {
        let mut function = linear(r, n, 0.3);
        for _ in 0..=r.below(4) {
            let i = r.below(n);
            function.extend(convex_term(r, i));
        }
        let most = value(&function, &x) + r.between(0.01, 3.0);
        program.rows.push(Row::at_most(function, most));
    }
    for _ in 0..r.below(1 + n / 2) {
        let function = linear_or_dependent(r, n, 0.3, &[]);
        let target = value(&function, &x);
        program.rows.push(Row::equality(function, target));
    }
    program.into()
}

/// Consistent equalities, half of them dependent, often more than variables.
fn overdetermined(r: &mut Random) -> (Program, Vec<f64>) {
    let n = 1 + r.below(12);
    let x = r.point(n, -3.0, 3.0);
    let mut program = Program::free(r.point(n, -10.0, 10.0));
    program.objective = convex(r, n);
    for _ in 0..1 + n / 2 + r.below(18) {
        let function = linear_or_dependent(r, n, 0.5, &program.rows);
        let target = value(&function, &x);
        program.rows.push(Row::equality(function, target));
    }
    (program, x)
}

pub(crate) fn dependent_equalities(r: &mut Random) -> Case {
    overdetermined(r).0.into()
}

pub(crate) fn inconsistent_equalities(r: &mut Random) -> Case {
    let (mut program, x) = overdetermined(r);
    let function = multiple(&program.rows[0].function, r.coefficient());
    let target = value(&function, &x) + r.coefficient();
    program.rows.push(Row::equality(function, target));
    program.into()
}

/// A row that asks for more than the bounds on its variables allow.
pub(crate) fn row_against_bounds(r: &mut Random) -> Case {
    let Case { mut program, .. } = linear_program(r);
    let function = linear(r, program.start.len(), 0.5);
    let most: f64 = function
        .iter()
        .map(|term| {
            (term.factor * program.lower[term.variable]).max(term.factor * program.upper[term.variable])
        })
        .sum();
    program.rows.push(Row::at_least(function, most + r.between(0.1, 5.0)));
    program.into()
}

/// A ball and a half space that do not meet.
pub(crate) fn ball_and_half_space(r: &mut Random) -> Case {
    let n = size(r);
    let mut program = Program::free(r.point(n, -5.0, 5.0));
    program.objective = convex(r, n);
    let (centre, radius) = (r.point(n, -2.0, 2.0), r.between(0.1, 3.0));
    let ball = (0..n).flat_map(|i| square(&[Term::new(1.0, i, Form::Linear)], -centre[i], 1.0)).collect();
    program.rows.push(Row::at_most(ball, radius * radius));
    let half_space = linear(r, n, 0.5);
    let norm = half_space.iter().map(|term| term.factor * term.factor).sum::<f64>().sqrt();
    let least = value(&half_space, &centre) + norm * radius + r.between(0.1, 3.0);
    program.rows.push(Row::at_least(half_space, least));
    program.into()
}

/// A linear objective that falls along a ray of the feasible set.
pub(crate) fn unbounded_ray(r: &mut Random) -> Case {
    let Case { mut program, .. } = linear_program(r);
    program.upper[0] = INF;
    program.objective.push(Term::new(-r.between(3.0, 5.0), 0, Form::Linear));
    for row in &mut program.rows {
        row.function.retain(|term| term.variable != 0);
        // Without its first variable the row still holds the other way round, or is dropped.
        (row.lower, row.upper) = (-INF, INF);
        row.function.push(Term::new(-r.between(0.0, 1.0), 0, Form::Linear));
        row.upper = value(&row.function, &program.start) + 1.0;
    }
    for i in 1..program.start.len() {
        // The start is feasible, so that the ray through it is.
        program.lower[i] = program.lower[i].min(program.start[i]);
        program.upper[i] = program.upper[i].max(program.start[i]);
    }
    program.lower[0] = program.lower[0].min(program.start[0]);
    program.into()
}

/// An objective that is concave in a free variable.
pub(crate) fn unbounded_concave(r: &mut Random) -> Case {
    let n = size(r);
    let mut program = Program::free(r.point(n, -3.0, 3.0));
    let i = r.below(n);
    program.objective = convex(r, n);
    program.objective.retain(|term| term.variable != i && term.form != Form::Product(i));
    let form = [Form::Product(i), Form::Fourth, Form::Exp(1.0)][r.below(3)];
    program.objective.push(Term::new(-r.between(0.1, 2.0), i, form));
    program.objective.push(Term::new(r.coefficient(), i, Form::Linear));
    program.into()
}

/// A convex objective whose infimum lies at infinity.
pub(crate) fn infimum_not_attained(r: &mut Random) -> Case {
    let n = size(r);
    let mut program = Program::free(r.point(n, 0.5, 3.0));
    let i = r.below(n);
    program.objective = convex(r, n);
    program.objective.retain(|term| term.variable != i && term.form != Form::Product(i));
    let form = if r.chance(0.5) { Form::Exp(-1.0) } else { Form::Reciprocal };
    program.objective.push(Term::new(r.between(0.1, 2.0), i, form));
    program.lower[i] = 0.1;
    program.into()
}

pub(crate) fn indefinite_quadratic(r: &mut Random) -> Case {
    let Case { mut program, .. } = linear_program(r);
    let n = program.start.len();
    for _ in 0..n {
        let (i, j) = (r.below(n), r.below(n));
        program.objective.push(Term::new(r.coefficient(), i, Form::Product(j)));
    }
    program.into()
}

/// Everything at once: any functions, any bounds, feasible or not, bounded or not.
pub(crate) fn anything(r: &mut Random) -> Case {
    let n = size(r);
    let mut program = Program::free(r.point(n, -3.0, 3.0));
    let function = |r: &mut Random| -> Function {
        let mut out = linear(r, n, 0.3);
        for _ in 0..r.below(5) {
            let (i, j) = (r.below(n), r.below(n));
            let form = match r.below(7) {
                0 => Form::Fourth,
                1 => Form::Exp(r.coefficient()),
                2 => Form::Log,
                3 => Form::Reciprocal,
                4 => Form::Product(i),
                _ => Form::Product(j),
            };
            out.push(Term::new(r.coefficient() * r.power_of_ten(-2.0, 2.0), i, form));
        }
        out
    };
    let mut centre = r.point(n, -3.0, 3.0);
    if r.chance(0.8) {
        // Within the domain of the logarithms.
        program.start.iter_mut().chain(&mut centre).for_each(|x| *x = x.abs());
    }
    program.objective = function(r);
    bound_around(r, &mut program, &centre);
    let most = if r.chance(0.2) { 30 } else { n / 2 };
    for _ in 0..r.below(1 + most) {
        let (function, target) = (function(r), r.between(-2.0, 2.0));
        let (lower, upper) = match r.below(5) {
            0 => (target, target),
            1 => (target, INF),
            2 => (-INF, target),
            3 => (target, target + r.between(0.0, 3.0)),
            _ => (-INF, INF),
        };
        program.rows.push(Row { function, lower, upper });
    }
    program.into()
}

/// `sum c x - a ln x` without bounds, from a point where it is defined.
pub(crate) fn logarithms(r: &mut Random) -> Case {
    let n = size(r);
    let mut program = Program::free(r.point(n, 0.05, 5.0));
    for i in 0..n {
        program.objective.push(Term::new(r.between(0.1, 2.0), i, Form::Linear));
        program.objective.push(Term::new(-r.power_of_ten(-2.0, 1.0), i, Form::Log));
    }
    program.into()
}

/// A function that is not defined at the start.
pub(crate) fn undefined_start(r: &mut Random) -> Case {
    let Case { mut program, .. } = logarithms(r);
    let n = program.start.len();
    let i = r.below(n);
    program.start[i] = -r.between(0.0, 3.0);
    if r.chance(0.5) {
        program.rows.push(Row::at_least(vec![Term::new(1.0, i, Form::Log)], -1.0));
        program.objective = convex(r, n);
    }
    program.into()
}

/// A logarithm that draws the iterates to the edge of its domain, at the bound or without one.
pub(crate) fn edge_of_the_domain(r: &mut Random) -> Case {
    let n = size(r);
    let mut program = Program::free(r.point(n, 0.05, 3.0));
    program.objective = convex(r, n);
    let i = r.below(n);
    program.objective.push(Term::new(r.between(0.5, 3.0), i, Form::Log));
    program.lower[i] = if r.chance(0.5) { 0.0 } else { -INF };
    program.into()
}

/// Intervals of width 1e-9 for variables and rows.
pub(crate) fn nearly_equal_bounds(r: &mut Random) -> Case {
    const WIDTH: f64 = 1e-9;
    let (mut program, x) = convex_around(r);
    for (i, x) in x.iter().enumerate() {
        if r.chance(0.3) {
            (program.lower[i], program.upper[i]) = (x - 0.5 * WIDTH, x + 0.5 * WIDTH);
        }
    }
    for row in &mut program.rows {
        if r.chance(0.3) {
            let value = value(&row.function, &x);
            (row.lower, row.upper) = (value - 0.5 * WIDTH, value + 0.5 * WIDTH);
        }
    }
    program.into()
}

/// Few free variables or none, and rows that are satisfied with room.
pub(crate) fn fixed_variables(r: &mut Random) -> Case {
    let (mut program, x) = convex_around(r);
    let share = r.between(0.3, 1.3);
    for (i, x) in x.iter().enumerate() {
        if r.chance(share) {
            (program.lower[i], program.upper[i]) = (*x, *x);
        }
    }
    program.into()
}

pub(crate) fn huge_bounds(r: &mut Random) -> Case {
    let (mut program, _) = convex_around(r);
    let huge = |r: &mut Random| [1e6, 1e10, 1e15, 1e18, 1e20, 1e30][r.below(6)];
    for i in 0..program.start.len() {
        if program.lower[i] == -INF {
            program.lower[i] = -huge(r);
        }
        if program.upper[i] == INF {
            program.upper[i] = huge(r);
        }
    }
    for row in &mut program.rows {
        if row.lower == -INF {
            row.lower = -huge(r);
        }
        if row.upper == INF {
            row.upper = huge(r);
        }
    }
    program.into()
}

pub(crate) fn far_start(r: &mut Random) -> Case {
    let (mut program, _) = convex_around(r);
    let far = r.power_of_ten(2.0, 6.0);
    program.start.iter_mut().for_each(|x| *x *= far);
    program.into()
}

pub(crate) fn bad_units(r: &mut Random) -> Case {
    let (program, _) = convex_around(r);
    let mut units = |count: usize| (0..count).map(|_| r.power_of_ten(-6.0, 6.0)).collect::<Vec<f64>>();
    let (variables, constraints) = (units(program.start.len()), units(program.rows.len()));
    let units = Scaling { objective: r.power_of_ten(-6.0, 6.0), variables, constraints };
    Case { program, units: Some(units) }
}

/// Convex but for pairs `x y <= 0`, `x, y >= 0`.
pub(crate) fn complementarity(r: &mut Random) -> Case {
    let pairs = 1 + r.below(10);
    let n = 2 * pairs + r.below(5);
    let mut program = Program::free(r.point(n, -1.0, 3.0));
    program.objective = convex(r, n);
    let mut x = r.point(n, 0.0, 2.0);
    for k in 0..pairs {
        x[2 * k + usize::from(r.chance(0.5))] = 0.0;
        program.lower[2 * k] = 0.0;
        program.lower[2 * k + 1] = 0.0;
        program.rows.push(Row::at_most(vec![Term::new(1.0, 2 * k, Form::Product(2 * k + 1))], 0.0));
    }
    for _ in 0..r.below(6) {
        let function = linear(r, n, 0.4);
        let row = satisfied(r, function, &x, 0.1);
        program.rows.push(row);
    }
    program.into()
}

/// As many equations as variables, each variable dominating its equation, so that there is one solution.
pub(crate) fn square_system(r: &mut Random) -> Case {
    let n = size(r);
    let x = r.point(n, -2.0, 2.0);
    let mut program = Program::free(r.point(n, -4.0, 4.0));
    for i in 0..n {
        let mut function = multiple(&linear(r, n, 2.0 / n as f64), 0.2 / n as f64);
        function.push(Term::new(1.0, i, Form::Linear));
        function.push(Term::new(r.between(0.0, 1.0), i, Form::Exp(1.0)));
        let target = value(&function, &x);
        program.rows.push(Row::equality(function, target));
    }
    program.into()
}

/// Squares of linear functions that have to be zero: no gradient at any feasible point.
pub(crate) fn vanishing_gradients(r: &mut Random) -> Case {
    let n = 2 + r.below(8);
    let x = r.point(n, -2.0, 2.0);
    let mut program = Program::free(r.point(n, -4.0, 4.0));
    program.objective = convex(r, n);
    for _ in 0..=r.below(n) {
        let function = linear(r, n, 0.5);
        let offset = -value(&function, &x);
        let square = square(&function, offset, 1.0);
        let is_equality = r.chance(0.5);
        program.rows.push(if is_equality { Row::equality(square, 0.0) } else { Row::at_most(square, 0.0) });
    }
    program.into()
}

/// Feasible, but inequalities that leave no interior.
pub(crate) fn empty_interior(r: &mut Random) -> Case {
    let (mut program, x) = convex_around(r);
    for _ in 0..=r.below(3) {
        let function = linear(r, x.len(), 0.5);
        let value = value(&function, &x);
        program.rows.push(Row::at_most(function.clone(), value));
        program.rows.push(Row::at_least(function, value));
    }
    program.into()
}

/// Bounded below, with many stationary points.
pub(crate) fn quartic(r: &mut Random) -> Case {
    let n = size(r);
    let mut program = Program::free(r.point(n, -5.0, 5.0));
    program.objective = linear(r, n, 0.5);
    for i in 0..n {
        program.objective.push(Term::new(r.between(0.1, 1.0), i, Form::Fourth));
        for _ in 0..2 {
            let other = r.below(n);
            program.objective.push(Term::new(r.coefficient(), i, Form::Product(other)));
        }
    }
    program.into()
}
