//! Programs over stages against Clarabel, and what has no solution.

use apsides_conic::{Cone, ConicData, ConicProgram, ConicSettings};
use apsides_stage_cone::sparse::Entry;
use apsides_stage_cone::{
    Row, Stage, StageError, StageProgram, StageSettings, StageWork, Status, solve_stages,
};
use proptest::prelude::*;

/// The program in the form of the general solver.
fn sparse<const NX: usize, const NW: usize, const NR: usize, const NE: usize>(
    program: &StageProgram<'_, NX, NW, NR, NE>,
) -> ConicData {
    let [variables, equations, linear] = program.sparse_sizes();
    let mut data = ConicData { linear: vec![0.0; variables], ..ConicData::default() };
    data.cones = vec![Cone::Zero(equations)];
    if linear > 0 {
        data.cones.push(Cone::NonNegative(linear));
    }
    let mut constants = Vec::new();
    program.sparse(|entry| match entry {
        Entry::Cost { column, value } => data.linear[column] = value,
        Entry::Matrix { row, column, value } => data.matrix.push(row, column, value),
        Entry::Constant { row, value } => constants.push((row, value)),
        Entry::Cone { size } => data.cones.push(Cone::SecondOrder(size)),
    });
    data.right_hand_side = vec![0.0; constants.len()];
    constants.iter().for_each(|&(row, value)| data.right_hand_side[row] = value);
    // A cone of one row is a linear one there, too.
    data.cones.iter_mut().filter(|c| **c == Cone::SecondOrder(1)).for_each(|c| *c = Cone::NonNegative(1));
    data
}

const NX: usize = 3;
const NW: usize = 5;
const NR: usize = 11;
type Small = Stage<NX, NW, NR>;

/// Numbers between -1 and 1.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
    fn row(&mut self) -> Row<NW> {
        let mut row = Row::ZERO;
        for c in 0..NW {
            let value = self.next();
            if self.next() > -0.4 {
                row.add(c, value);
            }
        }
        row
    }
}

/// Stages with a point inside all constraints, and bounded variables.
fn random(seed: u64, count: usize) -> (Vec<Small>, [f64; NX], [f64; NX]) {
    let mut numbers = Numbers(seed.wrapping_mul(7919) + 1);
    let mut stages = vec![Stage::EMPTY; count];
    let start: [f64; NX] = std::array::from_fn(|_| numbers.next());
    let mut x = start;
    let mut end = x;
    for stage in &mut stages {
        let mut w = [0.0; NW];
        for c in 0..NW {
            w[c] = if c < 2 { numbers.next() } else { x[c - 2] };
            stage.cost[c] = numbers.next();
        }
        end = x;
        for i in 0..NX {
            stage.dynamics[i] = numbers.row();
            stage.offset[i] = 0.3 * numbers.next();
            x[i] = stage.offset[i] + stage.dynamics[i].terms().map(|(c, v)| v * w[c]).sum::<f64>();
        }
        let at = |row: &Row<NW>| row.dot(&w);
        for _ in 0..2 {
            let row = numbers.row();
            stage.add_linear(row, 0.1 - at(&row) + 0.5 * (1.0 + numbers.next()));
        }
        let rows: [Row<NW>; 3] = std::array::from_fn(|_| numbers.row());
        let tail = at(&rows[1]).hypot(at(&rows[2]));
        stage.add_cone(&[(rows[0], tail - at(&rows[0]) + 0.2), (rows[1], 0.0), (rows[2], 0.0)]);
        let size = w.iter().map(|v| v * v).sum::<f64>().sqrt();
        let ball: Vec<_> = (0..=NW)
            .map(|c| if c == 0 { (Row::ZERO, size + 1.0) } else { (Row::of(&[(c - 1, 1.0)]), 0.0) })
            .collect();
        stage.add_cone(&ball);
    }
    (stages, start, end)
}

/// Solver: the gap at which both iterations stop, relative to the objective.
const GAP: f64 = 3e-8;
/// Solver: gap of a reduced solution.
const REDUCED: f64 = 1e-4;
/// Solver: what rows and states may be off by, relative to the size of the solution.
const RESIDUAL: f64 = 1e-6;

/// The largest residual of the dual constraints of a solution, from the data: `cost + (0, y_k) - rows' z - dynamics' y_k+1`, and the end equations.
fn dual_residual<const NE: usize>(
    program: &StageProgram<'_, NX, NW, NR, NE>,
    work: &[StageWork<NX, NW, NR, NE>],
    ends: &[f64; NE],
) -> f64 {
    let residual = |k: usize| {
        let (stage, here) = (&program.stages[k], &work[k]);
        let mut off = stage.cost;
        (0..NX).for_each(|i| off[Small::state(i)] += here.state_multipliers()[i]);
        let mut take = |row: &Row<NW>, by: f64| row.terms().for_each(|(c, v)| off[c] -= by * v);
        stage.constraints().zip(here.multipliers()).for_each(|((row, _), z)| take(row, *z));
        if let Some(next) = work.get(k + 1) {
            stage.dynamics.iter().zip(next.state_multipliers()).for_each(|(row, y)| take(row, *y));
        } else {
            let ends = program.end.iter().zip(ends);
            ends.for_each(|(row, y)| (0..NX).for_each(|i| off[Small::state(i)] += y * row[i]));
        }
        off.iter().fold(0.0_f64, |m, v| m.max(v.abs()))
    };
    (0..work.len()).map(residual).fold(0.0, f64::max)
}

/// Solves by both; checks both sides of the solution from the data, and the objective against Clarabel's, or where Clarabel finds none, as in one
/// of some thousand programs with given ends, against the dual objective.
fn agrees<const NE: usize>(program: &StageProgram<'_, NX, NW, NR, NE>) {
    let mut work = vec![StageWork::ZERO; program.stages.len()];
    let report = solve_stages(program, &mut work, &StageSettings::default()).expect("well-posed");
    let mut other = ConicProgram::new(&sparse(program), ConicSettings::default()).expect("well-posed");
    let objective =
        if other.solve().has_solution() { other.report().objective } else { report.dual_objective };
    let difference = (report.objective - objective).abs() / (1.0 + objective.abs());
    match report.status {
        Status::Solved => assert!(difference < GAP, "{report:?} {objective}"),
        Status::SolvedReduced => assert!(difference < REDUCED, "{report:?} {objective}"),
        _ => panic!("{report:?}"),
    }
    let size = work.iter().flat_map(|w| w.variables()).fold(1.0_f64, |m, v| m.max(v.abs()));
    let multipliers = work.iter().flat_map(|w| w.state_multipliers().iter().chain(w.multipliers()));
    let largest = multipliers.chain(&report.end_multipliers).fold(1.0_f64, |m, v| m.max(v.abs()));
    assert!(dual_residual(program, &work, &report.end_multipliers) < RESIDUAL * largest, "{report:?}");
    let mut state = program.start;
    for (work, stage) in work.iter().zip(program.stages) {
        let w = work.variables();
        assert!((0..NX).all(|i| (state[i] - w[Small::state(i)]).abs() < RESIDUAL * size));
        let rows: Vec<f64> = stage.constraints().map(|(row, constant)| row.dot(w) + constant).collect();
        assert!(inside(stage, &rows, RESIDUAL * size), "{rows:?}");
        assert!(inside(stage, &work.multipliers()[..stage.rows()], 0.0));
        state = std::array::from_fn(|i| stage.offset[i] + stage.dynamics[i].dot(w));
    }
}

/// True if the rows of a stage are in their cones but for a tolerance.
fn inside<const NX: usize, const NW: usize, const NR: usize>(
    stage: &Stage<NX, NW, NR>,
    rows: &[f64],
    tolerance: f64,
) -> bool {
    let mut from = stage.linear_rows();
    let linear = rows[..from].iter().all(|v| *v >= -tolerance);
    let cones = stage.cone_sizes().iter().all(|&size| {
        let cone = &rows[from..from + usize::from(size)];
        from += usize::from(size);
        let tail = cone[1..].iter().map(|v| v * v).sum::<f64>().sqrt();
        cone[0] - tail >= -tolerance
    });
    linear && cones
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]
    #[test]
    fn random_programs_have_the_optimum_of_clarabel(seed in 0..1_000_000_u64, count in 1..25_usize) {
        let (stages, start, _) = random(seed, count);
        agrees(&StageProgram::<NX, NW, NR, 0> { stages: &stages, start, end: [], end_values: [] });
    }

    #[test]
    fn random_programs_with_given_ends_have_the_optimum_of_clarabel(seed in 0..1_000_000_u64, count in 5..25_usize) {
        let (stages, start, x) = random(seed, count);
        let (end, end_values) = ([[1.0, 0.0, 0.0], [0.0, 1.0, 1.0]], [x[0], x[1] + x[2]]);
        agrees(&StageProgram::<NX, NW, NR, 2> { stages: &stages, start, end, end_values });
    }
}

/// Rounding: residual of a certificate of value one with multipliers of 5e6, to which 1e-5 out of reach lead, sixteen times that of one of them.
const CERTIFICATE: f64 = 2e-8;

/// `u` and `s >= |u|`, position and speed, `s <= most`.
type Cart = Stage<2, 4, 3>;

fn carts(most: f64, count: usize) -> Vec<Cart> {
    let mut stage = Cart::EMPTY;
    stage.cost[1] = 1.0;
    stage.dynamics = [Row::of(&[(2, 1.0), (3, 1.0), (0, 0.5)]), Row::of(&[(3, 1.0), (0, 1.0)])];
    stage.add_linear(Row::of(&[(1, -1.0)]), most);
    stage.add_cone(&[(Row::of(&[(1, 1.0)]), 0.0), (Row::of(&[(0, 1.0)]), 0.0)]);
    vec![stage; count]
}

fn to_rest(stages: &[Cart], distance: f64) -> StageProgram<'_, 2, 4, 3, 2> {
    let end = [[1.0, 0.0], [0.0, 1.0]];
    StageProgram { stages, start: [0.0; 2], end, end_values: [distance, 0.0] }
}

#[test]
fn the_least_push_over_a_distance_has_its_closed_form() {
    // One push at the start, one at the end: in ten steps 9 u = 1, and the multipliers are those of the distance.
    let stages = carts(5.0, 11);
    let mut work = vec![StageWork::ZERO; 11];
    let report = solve_stages(&to_rest(&stages, 1.0), &mut work, &StageSettings::default()).unwrap();
    assert_eq!(report.status, Status::Solved);
    assert!((report.objective - 2.0 / 9.0).abs() < GAP && (report.dual_objective - 2.0 / 9.0).abs() < GAP);
    assert!((report.end_multipliers[0] + 2.0 / 9.0).abs() < RESIDUAL, "{report:?}");
    assert!((work[0].variables()[0] - 1.0 / 9.0).abs() < RESIDUAL);
    assert!((work[9].variables()[0] + 1.0 / 9.0).abs() < RESIDUAL);
    assert!(work[5].variables()[0].abs() < RESIDUAL && work[5].slack()[0] > 4.0);
}

#[test]
fn a_target_out_of_reach_has_a_certificate() {
    // In ten steps of at most 0.04 each way the cart comes 1 far: sum of 25 pushes of 0.04.
    let stages = carts(0.04, 11);
    let mut work = vec![StageWork::ZERO; 11];
    let settings = StageSettings::default();
    let near = solve_stages(&to_rest(&stages, 0.999), &mut work, &settings).unwrap();
    assert_eq!(near.status, Status::Solved);
    for distance in [1.001, 2.0, 1e6] {
        let program = to_rest(&stages, distance);
        let report = solve_stages(&program, &mut work, &settings).unwrap();
        assert_eq!(report.status, Status::Infeasible, "{distance}");
        assert!(
            report.objective == f64::INFINITY && report.certificate_residual < settings.feasibility_tolerance
        );
        // Checked from the sparse data: A' z = 0, b' z = -1, z in the cones.
        let data = sparse(&program);
        let states = work.iter().flat_map(|w| w.state_multipliers());
        let mut dual: Vec<f64> = states.chain(&report.end_multipliers).copied().collect();
        dual.extend(work.iter().map(|w| w.multipliers()[0]));
        dual.extend(work.iter().flat_map(|w| &w.multipliers()[1..3]));
        assert_eq!(dual.len(), data.right_hand_side.len());
        let mut products = vec![0.0; data.linear.len()];
        for ((&row, &column), value) in
            data.matrix.rows.iter().zip(&data.matrix.columns).zip(&data.matrix.values)
        {
            products[column] += value * dual[row];
        }
        assert!(products.iter().all(|v: &f64| v.abs() < GAP), "{products:?}");
        let value: f64 = data.right_hand_side.iter().zip(&dual).map(|(b, z)| b * z).sum();
        assert!((value + 1.0).abs() < GAP, "{value}");
        assert!(work.iter().zip(&stages).all(|(w, s)| inside(s, w.multipliers(), 0.0)));
    }
}

#[test]
fn what_only_just_cannot_be_met_is_told_at_any_tolerance() {
    // The cart of the test above: a certificate of the last distances is worth so little that its residual is rounding.
    let stages = carts(0.04, 11);
    let mut work = vec![StageWork::ZERO; 11];
    for beyond in [1e-2, 1e-3, 1e-4, 1e-5] {
        for tolerance in [1e-6, 1e-8, 1e-10, 1e-12, 1e-14] {
            let settings = StageSettings {
                feasibility_tolerance: tolerance,
                gap_tolerance: tolerance,
                ..StageSettings::default()
            };
            let report = solve_stages(&to_rest(&stages, 1.0 + beyond), &mut work, &settings).unwrap();
            assert_eq!(report.status, Status::Infeasible, "{beyond} {tolerance} {report:?}");
            assert!(report.certificate_residual <= tolerance.max(CERTIFICATE), "{report:?}");
        }
    }
}

#[test]
fn an_objective_without_a_bound_has_a_ray() {
    let mut stages = carts(5.0, 4);
    for stage in &mut stages {
        stage.clear();
        stage.add_cone(&[(Row::of(&[(1, 1.0)]), 0.0), (Row::of(&[(0, 1.0)]), 0.0)]);
        stage.cost[1] = -1.0;
    }
    let mut work = vec![StageWork::ZERO; 4];
    let report = solve_stages(&to_rest(&stages, 1.0), &mut work, &StageSettings::default()).unwrap();
    assert_eq!(report.status, Status::Unbounded);
    assert!(report.objective == f64::NEG_INFINITY && report.certificate_residual < GAP);
    let descent: f64 = work.iter().map(|w| -w.variables()[1]).sum();
    assert!((descent + 1.0).abs() < GAP && work.iter().all(|w| w.variables()[1] >= w.variables()[0].abs()));
}

#[test]
fn cones_without_rows_of_one_row_and_stages_without_constraints_are_taken() {
    // min x_2 with x_k+1 = x_k + u_k, u_0 >= -1 as a cone of one row, u_1 left out, u_2 without use.
    let mut stages = [Stage::<1, 2, 1>::EMPTY; 3];
    for stage in &mut stages {
        stage.dynamics = [Row::of(&[(0, 1.0), (1, 1.0)])];
        stage.add_cone(&[]);
    }
    stages[0].add_cone(&[(Row::of(&[(0, 1.0)]), 1.0)]);
    stages[1].controls[0] = false;
    stages[1].dynamics = [Row::of(&[(1, 1.0)])];
    stages[2].controls[0] = false;
    stages[2].cost[1] = 1.0;
    let program = StageProgram { stages: &stages, start: [3.0], end: [], end_values: [] };
    let mut work = [StageWork::ZERO; 3];
    let report = solve_stages(&program, &mut work, &StageSettings::default()).unwrap();
    assert!(report.status == Status::Solved && (report.objective - 2.0).abs() < GAP, "{report:?}");
    // Nothing but equations: x_2 = 3 + 4 by an end equation, at the cost of nothing.
    let mut free = [Stage::<1, 2, 0>::EMPTY; 2];
    free[0].dynamics = [Row::of(&[(0, 1.0), (1, 1.0)])];
    free[1].controls[0] = false;
    let program = StageProgram { stages: &free, start: [3.0], end: [[1.0]], end_values: [7.0] };
    let mut work = [StageWork::ZERO; 2];
    let report = solve_stages(&program, &mut work, &StageSettings::default()).unwrap();
    assert_eq!(report.status, Status::Solved);
    assert!((work[0].variables()[0] - 4.0).abs() < GAP);
}

#[test]
fn the_limit_of_iterations_is_a_status() {
    let stages = carts(5.0, 11);
    let mut work = vec![StageWork::ZERO; 11];
    let settings = StageSettings { max_iterations: 2, ..StageSettings::default() };
    let report = solve_stages(&to_rest(&stages, 1.0), &mut work, &settings).unwrap();
    assert!(report.status == Status::IterationLimit && report.iterations == 2);
    assert!(!report.status.has_solution() && report.objective.is_finite());
}

#[test]
fn a_solve_allocates_nothing() {
    let (stages, start, _) = random(7, 20);
    let program = StageProgram::<NX, NW, NR, 0> { stages: &stages, start, end: [], end_values: [] };
    let mut work = vec![StageWork::ZERO; 20];
    let measured = allocation_counter::measure(|| {
        solve_stages(&program, &mut work, &StageSettings::default()).unwrap();
    });
    assert_eq!(measured.count_total, 0);
}

#[test]
fn two_solves_in_one_workspace_have_the_same_bits() {
    let (stages, start, _) = random(11, 12);
    let program = StageProgram::<NX, NW, NR, 0> { stages: &stages, start, end: [], end_values: [] };
    let mut work = vec![StageWork::ZERO; 12];
    let mut solve = || {
        let report = solve_stages(&program, &mut work, &StageSettings::default()).unwrap();
        (report.objective.to_bits(), work.iter().map(|w| *w.variables()).collect::<Vec<_>>())
    };
    assert_eq!(solve(), solve());
}

fn refusal(change: impl FnOnce(&mut Vec<Cart>, &mut [f64; 2], &mut StageSettings)) -> String {
    let (mut stages, mut start, mut settings) = (carts(5.0, 3), [0.0; 2], StageSettings::default());
    change(&mut stages, &mut start, &mut settings);
    let program = StageProgram { start, ..to_rest(&stages, 1.0) };
    let mut work = vec![StageWork::ZERO; stages.len()];
    solve_stages(&program, &mut work, &settings).expect_err("ill-posed").to_string()
}

#[test]
fn ill_posed_programs_are_refused_by_name() {
    assert!(refusal(|s, _, _| s.clear()).contains("no stage"));
    assert!(refusal(|s, _, _| s[1].cost[0] = f64::NAN).contains("stage 1: a cost, a constant or an offset"));
    assert!(refusal(|s, _, _| s[0].offset[1] = f64::INFINITY).contains("stage 0: a cost"));
    assert!(refusal(|s, _, _| s[2].add_linear(Row::ZERO, 1.0)).contains("stage 2: more than 3 rows"));
    assert!(
        refusal(|s, _, _| {
            s[2].clear();
            s[2].add_cone(&[(Row::ZERO, 1.0)]);
            s[2].add_linear(Row::ZERO, 1.0);
        })
        .contains("linear row after a cone")
    );
    assert!(refusal(|s, _, _| s[1].dynamics[0].add(4, 1.0)).contains("outside the columns 0..4"));
    assert!(refusal(|s, _, _| s[1].dynamics[0].add(0, f64::NAN)).contains("stage 1: a row has an entry"));
    assert!(
        refusal(|s, _, _| s[1].controls[0] = false).contains("stage 1: a row has an entry for a control")
    );
    assert!(refusal(|_, x, _| x[0] = f64::NAN).contains("start or end equations"));
    assert!(refusal(|_, _, s| s.gap_tolerance = 0.0).contains("gap_tolerance"));
    assert!(refusal(|_, _, s| s.feasibility_tolerance = f64::NAN).contains("feasibility_tolerance"));
    assert!(refusal(|_, _, s| s.max_iterations = 0).contains("max_iterations"));
    let stages = carts(5.0, 3);
    let error = solve_stages(&to_rest(&stages, 1.0), &mut [StageWork::ZERO; 2], &StageSettings::default());
    assert_eq!(error.unwrap_err(), StageError::Workspace { stages: 3, workspace: 2 });
}

#[test]
fn numbers_near_the_largest_end_with_a_status() {
    for size in [1e150, 1e-150, 1e300] {
        let mut stages = carts(5.0, 4);
        stages.iter_mut().for_each(|s| s.cost[1] = size);
        let mut work = vec![StageWork::ZERO; 4];
        for distance in [size, 1.0] {
            let report =
                solve_stages(&to_rest(&stages, distance), &mut work, &StageSettings::default()).unwrap();
            assert!(report.iterations <= StageSettings::default().max_iterations);
        }
    }
}
