//! Closed-loop descents against the independent simulation of the reference.
#![allow(clippy::unwrap_used)]

use super::{Case, DampingSet, Descent, Law, Metrics, Record};
use apsides_control::pid::PidGains;

fn fly(case: &Case) -> Metrics {
    Descent::new(case).unwrap().fly(&mut Record::every(1)).unwrap()
}

#[test]
#[ignore]
fn explore() {
    let show = |what: &str, case: &Case| {
        let begin = std::time::Instant::now();
        let m = fly(case);
        let w = m.window;
        println!(
            "{what}: {:?} {:.2} s rms {:?} peak {:?} sat {:.2} travel {:?} rate {:?} beyond {:.2} step {:.1e} in {:.1} ms",
            m.ending,
            m.time,
            w.map(|w| w.rms.map(f64::to_degrees)),
            w.map(|w| w.peak.map(f64::to_degrees)),
            m.saturated_time,
            m.largest_travel,
            m.largest_rate,
            m.beyond_table,
            m.step_error,
            begin.elapsed().as_secs_f64() * 1e3
        );
    };
    let with = |mut case: Case, law: Law| {
        case.law = law;
        case
    };
    let pid = |p, i, d| Law::pid(PidGains::new(p, i, d));
    show("none 2.034/2.032 4.84 4.73", &with(Case::cross(10.0), Law::None));
    let mut unstable = with(Case::cross(10.0), Law::None);
    unstable.vehicle.damping = DampingSet::Unstable;
    show("none unstable", &unstable);
    show("cross10 1.0036e-5 9e-9", &Case::cross(10.0));
    show("cross5 .5906 .5897 1.377 1.344", &Case::cross(5.0));
    show("cross5 retuned .58853 .58811 1.1499", &with(Case::cross(5.0), pid(0.7859, 0.3535, 8.469)));
    show("radial5 1.548e-5 1.009e-5", &Case::radial(5.0));
    show("radial10 (30,30,10) 1.727e-6 1.894e-8", &with(Case::radial(10.0), pid(30.0, 30.0, 10.0)));
    for rate in [1.0, 0.5, 0.2, 0.1, 0.05] {
        let mut case = Case::cross(10.0);
        case.actuators.rate = rate;
        show(&format!("rate {rate}: 0.2 10.08 10.05, .1 5.965 5.687 .05 2.874 3.705"), &case);
    }
    for angle in [0.0_f64, 1.0] {
        let a = angle * std::f64::consts::FRAC_PI_4;
        let mut case = Case::cross(5.0);
        case.vehicle.offset = [0.01 * a.cos(), 0.01 * a.sin()];
        show(&format!("cross5 dir {angle} 1.308 .0326"), &case);
        let mut case = Case::radial(5.0);
        case.vehicle.offset = [0.01 * a.cos(), 0.01 * a.sin()];
        show(&format!("radial5 dir {angle} 4.546e-5 4.426e-5"), &case);
    }
    for (name, masses) in
        [("cross5", Case::cross(5.0)), ("cross10", Case::cross(10.0)), ("radial5", Case::radial(5.0))]
    {
        for mass in [350.0, 400.0, 500.0, 525.0, 550.0, 600.0, 700.0, 800.0] {
            let mut case = with(masses.clone(), pid(30.0, 30.0, 10.0));
            case.vehicle.mass = mass;
            show(&format!("{name} {mass}"), &case);
        }
    }
}
