//! A trajectory as some program reports it, and the same with a wrong control: the certificate tells them apart.
#![allow(clippy::print_stdout)]

use std::sync::Arc;

use apsides_ad::{Dynamics, Scalar};
use apsides_basis::Barycentric;
use apsides_ocp::{
    At, Bounds, Ocp, Phase, PhaseMesh, PhaseTrajectory, PiecewisePolynomial, Segment, State, Trajectory,
    Variable,
};
use apsides_verify::{Verdict, VerifySettings, verify};

struct Cart;

impl Dynamics<1, 1> for Cart {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
        [u[0]]
    }
}

/// 6 m in 2 s with the speed (m/s) that is reported.
fn report(speed: f64) -> Result<Trajectory, Box<dyn std::error::Error>> {
    let ends = Arc::new(Barycentric::new(&[-1.0, 1.0])?);
    let line = |values: [f64; 2]| {
        let segment = Segment { basis: ends.clone(), values: values.into() };
        PiecewisePolynomial::new(1, vec![0.0, 2.0], vec![segment])
    };
    let run = PhaseTrajectory {
        name: "run".into(),
        initial_time: 0.0,
        final_time: 2.0,
        mesh: PhaseMesh::uniform(1, 2)?,
        state: line([0.0, 6.0])?,
        control: line([speed; 2])?,
        costate: None,
        path_multipliers: None,
        contacts: vec![],
        integral_multipliers: None,
        interval_errors: vec![0.0],
    };
    Ok(Trajectory { phases: vec![run], parameters: vec![], objective: 2.0, constraint_multipliers: None })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let phase = Phase::new("run", Cart)
        .states([State::new("position", "m").within(-1.0, 10.0).starts_at(0.0).ends_at(6.0)])
        .controls([Variable::new("speed", "m/s").within(-3.0, 3.0)])
        .final_time(Bounds::new(0.1, 10.0));
    let ocp = Ocp::builder("run").phase(phase).minimize("time", "s", At::FinalTime("run")).build()?;
    for (speed, verdict) in [(3.0, Verdict::StrictLocalOptimum), (2.9, Verdict::Rejected)] {
        let certificate = verify(&ocp, &report(speed)?, &VerifySettings::default())?.certificate;
        println!("{speed} m/s: {}", certificate.verdict);
        for check in certificate.failures() {
            println!("  {}: {:.3} {} of {:.1e} allowed", check.name, check.value, check.unit, check.limit);
        }
        // The report states no costates: they are swept back from the end.
        assert_eq!(certificate.verdict, verdict);
    }
    Ok(())
}
