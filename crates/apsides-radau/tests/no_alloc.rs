//! Evaluations of the discretised problem allocate nothing.
#![allow(clippy::unwrap_used)]

use allocation_counter::measure;
use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_nlp::Nlp;
use apsides_ocp::{Bounds, Guess, Mesh, Ocp, Phase, State, Variable};
use apsides_radau::Transcription;

struct Pendulum;
impl Dynamics<2, 1> for Pendulum {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0] - x[0].sin()]
    }
}
impl PathFunction<2, 1, 1> for Pendulum {
    fn evaluate<S: Scalar>(&self, t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0].square() + x[1] * t]
    }
}

#[test]
fn evaluations_allocate_nothing() {
    let phase = Phase::new("swing", Pendulum)
        .states([State::new("angle", "rad").starts_at(0.0).ends_at(1.0), State::new("rate", "rad/s")])
        .controls([Variable::new("torque", "1/s2").within(-3.0, 3.0)])
        .final_time(Bounds::new(0.5, 5.0))
        .path([Variable::new("mixed", "-").at_most(9.0)], Pendulum)
        .integral(Variable::new("effort", "-").at_most(50.0), Pendulum);
    let ocp = Ocp::builder("swing").phase(phase).minimize_integral("swing", "effort").build().unwrap();
    let mesh = Mesh::uniform(&ocp, 20, 4).unwrap();
    let mut nlp = Transcription::new(&ocp, &mesh, &Guess::linear(&ocp)).unwrap();
    let (n, m) = (nlp.variables(), nlp.constraints());
    let mut x = vec![0.0; n];
    nlp.initial_point(&mut x);
    let (mut gradient, mut rows, y) = (vec![0.0; n], vec![0.0; m], vec![1.0; m]);
    let mut jacobian = vec![0.0; nlp.jacobian_pattern().len()];
    let mut hessian = vec![0.0; nlp.hessian_pattern().len()];
    let counted = measure(|| {
        for k in 0..3 {
            x[3] += f64::from(k);
            let _ = nlp.objective(&x);
            nlp.gradient(&x, &mut gradient);
            nlp.constraint_values(&x, &mut rows);
            nlp.jacobian(&x, &mut jacobian);
            nlp.hessian(&x, 1.0, &y, &mut hessian);
        }
    });
    assert_eq!(counted.count_total, 0);
}
