//! Problems of the gallery with other numbers: fixed ends and times move by up to 3 and 5 %, bounds of controls by up to 5 %.

use apsides_ocp::{Bounds, Ocp};

/// Relative change of ends, and of bounds and times.
const END: f64 = 0.03;
const BOUND: f64 = 0.05;

/// Numbers from -1 to 1 (D. E. Knuth's linear congruential generator).
struct Random(u64);

impl Random {
    /// The numbers of a case.
    fn of_case(case: u64) -> Self {
        let mut random = Self(case.wrapping_mul(7919).wrapping_add(12345));
        (0..10).for_each(|_| _ = random.next());
        random
    }

    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn moved(&mut self, bounds: Bounds, amount: f64) -> Bounds {
        let factor = 1.0 + amount * self.next();
        if bounds.is_fixed() { Bounds::fixed(bounds.lower * factor) } else { bounds }
    }
}

/// Moves the numbers of a problem to those of a case.
pub fn perturb(ocp: &mut Ocp, case: u64) {
    let mut random = Random::of_case(case);
    for phase in &mut ocp.phases {
        for state in &mut phase.states {
            let within = state.variable.bounds;
            for end in [&mut state.initial, &mut state.terminal] {
                *end = random.moved(*end, END);
                if end.is_fixed() {
                    *end = Bounds::fixed(within.clamp(end.lower));
                }
            }
        }
        for control in &mut phase.controls {
            let (factor, Bounds { lower, upper }) = (1.0 + BOUND * random.next(), control.bounds);
            if lower.is_finite() && upper.is_finite() {
                control.bounds = Bounds::new(lower * factor, upper * factor);
            }
        }
        if phase.initial_time.lower == 0.0 && phase.initial_time.is_fixed() {
            phase.final_time = random.moved(phase.final_time, BOUND);
        }
    }
}
