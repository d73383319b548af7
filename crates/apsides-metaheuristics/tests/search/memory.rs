//! Generations after the first few allocate nothing.

use crate::{methods, search, sphere};
use apsides_metaheuristics::{Noise, Run, Search, SearchSpace};

/// So many that no method has converged yet.
const MEASURED: usize = 150;

/// Allocations of many generations after the first ones.
fn allocations(name: &str, search: &Search) -> u64 {
    const FIRST: usize = 30;
    let space = SearchSpace::cube(10, -5.0, 5.0).expect("a box");
    let mut run = Run::new(search, &space).expect(name);
    for _ in 0..FIRST {
        assert_eq!(run.step(&sphere).expect(name), None, "{name}");
    }
    let count = allocation_counter::measure(|| {
        for _ in 0..MEASURED {
            assert_eq!(run.step(&sphere).expect(name), None, "{name}");
        }
    });
    count.count_total
}

#[test]
fn generations_allocate_nothing() {
    for (name, method) in methods() {
        assert_eq!(allocations(name, &search(&method, 1_000_000)), 0, "{name}");
        let noise = Noise::ConfirmBest { repeats: 3 };
        assert_eq!(allocations(name, &Search { noise, ..search(&method, 1_000_000) }), 0, "{name}");
    }
}

#[test]
fn several_threads_cost_the_calling_one_a_block_of_jobs_at_times() {
    // The queue of rayon gets a block for each 63 jobs; one job is a generation.
    for (name, method) in methods() {
        let count = allocations(name, &Search { threads: 2, ..search(&method, 1_000_000) });
        assert!(count <= MEASURED as u64 / 63 + 1, "{name}: {count}");
    }
}
