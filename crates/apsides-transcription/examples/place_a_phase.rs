//! The columns, rows and bounds of a phase of three nodes, as a method of one's own would place them, and values at many nodes by threads.
#![allow(clippy::print_stdout)]

use apsides_ad::{Dynamics, Scalar};
use apsides_ocp::{Bounds, Phase, State, Variable};
use apsides_transcription::{Limits, PhaseEnds, Places, Workers, in_pieces};

struct Cart;

impl Dynamics<2, 1> for Cart {
    fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
        [x[1], u[0]]
    }
}

fn main() {
    let phase = Phase::new("move", Cart)
        .states([State::new("x", "m").starts_at(0.0).ends_at(1.0), State::new("v", "m/s").starts_at(0.0)])
        .controls([Variable::new("a", "m/s2").within(-1.0, 1.0)])
        .final_time(Bounds::new(0.5, 10.0));
    let (nodes, width) = (3, phase.states.len() + phase.controls.len());
    let mut places = Places::default();
    let first = places.take_columns(nodes * width);
    let times = places.take_columns(2);
    let first_row = places.take_rows((nodes - 1) * phase.states.len());
    let ends = PhaseEnds::new(&phase, (first, first + (nodes - 1) * width), (times, times + 1), &mut places);
    println!("matching conditions from row {first_row}, {ends:?}");

    let mut limits = Limits::new(times + 2, Bounds::FREE);
    for (s, state) in phase.states.iter().enumerate() {
        limits.set(ends.initial_state + s, state.initial);
        limits.set(ends.final_state + s, state.terminal);
    }
    limits.set(ends.final_time, phase.final_time);
    println!("{limits:?}");

    let (workers, count) = (Workers::new(2), 10_000);
    let mut squares = vec![0.0; count];
    let mut scratch = vec![(); workers.pieces(count)];
    workers.run(|| {
        in_pieces(&mut scratch, count, [(&mut squares[..], 1)], |nodes, (), [own]| {
            nodes.zip(own).for_each(|(node, value)| *value = (node as f64).powi(2));
        });
    });
    println!("sum of squares: {}", squares.iter().sum::<f64>());
}
