//! Any bytes are read as a trajectory of this program and of others: an error or a trajectory, never a panic.

#![no_main]

use std::sync::LazyLock;

use apsides_missions::registry;
use apsides_ocp::Ocp;
use apsides_report::{read_samples, read_trajectory};
use libfuzzer_sys::fuzz_target;

static PROBLEM: LazyLock<Ocp> = LazyLock::new(|| {
    let mission = registry().load("lunar-direct", &[]).expect("invariant: a mission that comes with the program");
    mission.pose().expect("invariant: it is well-posed").ocp
});

fuzz_target!(|bytes: &[u8]| {
    let _ = read_trajectory(bytes, &PROBLEM, None);
    let _ = read_samples(bytes, &PROBLEM);
});
