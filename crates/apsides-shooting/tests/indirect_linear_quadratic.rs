//! Indirect shooting on random linear-quadratic problems, whose solution is that of the linear Hamiltonian system.
#![allow(clippy::unwrap_used)]

use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_nlp::Status;
use apsides_ocp::{Bounds, Guess, Ocp, Phase, State, Variable};
use apsides_shooting::indirect::{IndirectSettings, IndirectShooting, IndirectStart};
use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};
use proptest::prelude::*;

/// Discretisation: the tolerances of the integration and what its steps add up to.
const INTEGRATION: f64 = 1e-8;

/// `x' = A x + b u` with the cost `(x^T Q x + r u^2) / 2 + u s^T x`.
#[derive(Clone, Copy, Debug)]
struct Plant {
    a: [f64; 4],
    b: [f64; 2],
    q: [f64; 3],
    r: f64,
    s: [f64; 2],
}

impl Dynamics<2, 1> for Plant {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        let [a, b, c, d] = self.a;
        [x[0] * a + x[1] * b + u[0] * self.b[0], x[0] * c + x[1] * d + u[0] * self.b[1]]
    }
}

impl PathFunction<2, 1, 1> for Plant {
    fn evaluate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        let [q, mixed, w] = self.q;
        let states = x[0].square() * (0.5 * q) + x[0] * x[1] * mixed + x[1].square() * (0.5 * w);
        [states + u[0].square() * (0.5 * self.r) + u[0] * (x[0] * self.s[0] + x[1] * self.s[1])]
    }
}

impl Plant {
    /// `A`, `b` and the lower triangle of a square root of `[Q, s; s^T, r]`, which is then positive definite.
    fn new(a: [f64; 4], b: [f64; 2], l: [f64; 6]) -> Self {
        // The diagonal away from zero.
        let d = [0, 2, 5].map(|k: usize| 1.0 + l[k] * l[k]);
        Self {
            a,
            b,
            q: [d[0] * d[0], d[0] * l[1], l[1] * l[1] + d[1] * d[1]],
            s: [d[0] * l[3], l[1] * l[3] + d[1] * l[4]],
            r: l[3] * l[3] + l[4] * l[4] + d[2] * d[2],
        }
    }

    /// The matrix of `(x, lambda)' = M (x, lambda)` with `u = -(s^T x + b^T lambda) / r`.
    fn canonical(&self) -> Matrix4<f64> {
        let a = Matrix2::new(self.a[0], self.a[1], self.a[2], self.a[3]);
        let (b, s) = (Vector2::from(self.b), Vector2::from(self.s));
        let q = Matrix2::new(self.q[0], self.q[1], self.q[1], self.q[2]);
        let closed = a - b * s.transpose() / self.r;
        let mut m = Matrix4::zeros();
        m.fixed_view_mut::<2, 2>(0, 0).copy_from(&closed);
        m.fixed_view_mut::<2, 2>(0, 2).copy_from(&(-b * b.transpose() / self.r));
        m.fixed_view_mut::<2, 2>(2, 0).copy_from(&(s * s.transpose() / self.r - q));
        m.fixed_view_mut::<2, 2>(2, 2).copy_from(&(-closed.transpose()));
        m
    }

    fn pose(self, start: [f64; 2], end: f64, time: f64) -> Ocp {
        let phase = Phase::new("regulate", self)
            .states([
                State::new("x", "-").starts_at(start[0]).ends_at(end).scaled_by(1.0),
                State::new("y", "-").starts_at(start[1]).scaled_by(1.0),
            ])
            .controls([Variable::new("u", "-")])
            .final_time(Bounds::fixed(time))
            .integral(Variable::new("cost", "-"), self);
        Ocp::builder("plant").phase(phase).minimize_integral("regulate", "cost").build().unwrap()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// First state given at both ends, second one free at the end: `lambda(T)` is `(nu, 0)`. Objective
    /// `(lambda(0)^T x(0) - lambda(T)^T x(T)) / 2`. The conditions are linear: one iteration, and at most one more for rounding.
    #[test]
    fn solutions_are_those_of_the_linear_system(
        a in prop::array::uniform4(-1.0..1.0),
        b in (0.5..1.0, -1.0..1.0),
        l in prop::array::uniform6(-0.7..0.7),
        start in prop::array::uniform2(-1.0..1.0),
        end in -1.0..1.0,
        time in 0.5..2.0,
        segments in 1_usize..4,
    ) {
        let plant = Plant::new(a, [b.0, b.1], l);
        let ocp = plant.pose(start, end, time);
        let flow = |t: f64| (plant.canonical() * t).exp();
        let last = flow(time);
        // x1(T) = end and lambda2(T) = 0 for the costates at the start.
        let rows = Matrix2::new(last[(0, 2)], last[(0, 3)], last[(3, 2)], last[(3, 3)]);
        let known = Vector2::new(
            end - last[(0, 0)] * start[0] - last[(0, 1)] * start[1],
            -last[(3, 0)] * start[0] - last[(3, 1)] * start[1],
        );
        let costate = rows.lu().solve(&known).unwrap();
        let first = Vector4::new(start[0], start[1], costate[0], costate[1]);
        let size = first.amax().max(1.0);
        // A plant that the control hardly moves takes costates of any size.
        prop_assume!(size < 1e4);

        let zero = [[vec![0.0; 2], vec![0.0; 2]]];
        let from = IndirectStart::from_guess(&ocp, &Guess::linear(&ocp), &zero, segments).unwrap();
        // The default limits a step to 100 times the sizes at the start, which are small for small states.
        let settings = IndirectSettings { step_limit: 1e9, ..IndirectSettings::default() };
        let solution = IndirectShooting { settings }.solve(&ocp, &from, &mut ()).unwrap();
        prop_assert_eq!(solution.status, Status::Optimal);
        prop_assert!(solution.iterations <= 2, "{} iterations", solution.iterations);
        let trajectory = solution.trajectory.unwrap();
        let found = &trajectory.phases[0];
        for k in 0..=8 {
            let t = time * f64::from(k) / 8.0;
            let exact = flow(t) * first;
            let x = found.state_at(t);
            for i in 0..2 {
                let costate = found.costate.as_ref().unwrap().component(t, i);
                prop_assert!((x[i] - exact[i]).abs() < INTEGRATION * size, "state {i} at {t}: {} {}", x[i], exact[i]);
                let off = (costate - exact[2 + i]).abs();
                prop_assert!(off < INTEGRATION * size, "costate {i} at {t}: {costate} {}", exact[2 + i]);
            }
            let control = -(plant.s[0] * exact[0] + plant.s[1] * exact[1] + plant.b[0] * exact[2] + plant.b[1] * exact[3]) / plant.r;
            prop_assert!((found.control_at(t)[0] - control).abs() < INTEGRATION * size);
        }
        let end = last * first;
        let cost = 0.5 * (costate.dot(&Vector2::from(start)) - end[2] * end[0] - end[3] * end[1]);
        prop_assert!((trajectory.objective - cost).abs() < INTEGRATION * size, "{} {cost}", trajectory.objective);
    }
}
