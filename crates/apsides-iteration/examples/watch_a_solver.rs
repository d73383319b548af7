//! A solver of one's own that speaks the shared words: Newton's method for a square root, watched, stopped, and stopped by its limit.
#![allow(clippy::print_stdout)]

use apsides_iteration::{Flow, IterationRecord, Observer, Status};

/// The positive root of `x^2 = a` by Newton's method, and how it ended.
fn square_root(a: f64, most: usize, observer: &mut dyn Observer) -> (f64, Status) {
    let mut x = a;
    for iteration in 0..most {
        let step = 0.5 * (a / x - x);
        let record = IterationRecord { iteration, step_norm: step.abs(), ..IterationRecord::default() };
        if observer.iteration(&record) == Flow::Stop {
            return (x, Status::Interrupted);
        }
        x += step;
        if step.abs() < 1e-12 * x {
            return (x, Status::Optimal);
        }
    }
    (x, Status::IterationLimit)
}

fn main() {
    let mut table = |record: &IterationRecord| {
        println!("{:2} {:9.2e}", record.iteration, record.step_norm);
        Flow::Continue
    };
    let (root, status) = square_root(2.0, 50, &mut table);
    println!("{root:.15}: {status}");
    assert_eq!(status, Status::Optimal);
    assert!((root - std::f64::consts::SQRT_2).abs() < 1e-15);

    let (_, short) = square_root(2.0, 3, &mut ());
    let mut impatient =
        |record: &IterationRecord| if record.iteration < 1 { Flow::Continue } else { Flow::Stop };
    let (_, stopped) = square_root(2.0, 50, &mut impatient);
    println!("three iterations: {}; stopped: {}", short.word(), stopped.word());
    assert_eq!((short, stopped), (Status::IterationLimit, Status::Interrupted));
}
