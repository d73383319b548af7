//! Poles of the closed loops over a factor on their gain, where the dynamic pressure of a flight is largest.
//!
//! The linear loops are those of the margins: short-period motion and law, sampled with the delays of actuators and sensors, the factor on one
//! loop with the other one closed.

use apsides_control::record::Sample;
use apsides_pipeline::Error;
use apsides_pipeline::simulation::RootLocus;

use super::descent::{Descent, Record};
use super::law::Law;

/// Most states of a loop whose poles are followed: a hundred times the eigenvalues of more take seconds. 15 samples of delay are 40 states.
const MOST_STATES: usize = 40;

impl Descent {
    /// Root loci where the dynamic pressure of a recorded flight is largest, at factors in increasing order. None for a descent without law, an
    /// empty record, and for delays that are many samples long.
    ///
    /// # Errors
    /// A linear system that is not finite, or whose eigenvalues are not found.
    pub fn root_locus(&self, record: &Record, gains: &[f64]) -> Result<Option<RootLocus>, Error> {
        let pressure = |s: &Sample<13, 2>| self.condition(&s.state).dynamic_pressure;
        let known = record.samples().iter().filter(|s| pressure(s).is_finite());
        let densest = known.max_by(|a, b| pressure(a).total_cmp(&pressure(b)));
        match densest {
            Some(sample) if self.case().law != Law::None && self.too_long_delay().is_none() => {
                self.root_locus_at(sample, gains)
            }
            _ => Ok(None),
        }
    }

    fn root_locus_at(&self, sample: &Sample<13, 2>, gains: &[f64]) -> Result<Option<RootLocus>, Error> {
        let condition = self.condition(&sample.state);
        let [attack, sideslip] = self.loops(sample.time, &sample.state, &sample.control)?;
        if attack.size()[0] > MOST_STATES {
            return Ok(None);
        }
        Ok(Some(RootLocus {
            altitude: condition.altitude,
            time: sample.time,
            dynamic_pressure: condition.dynamic_pressure,
            sample_time: self.case().run.sample_time,
            loops: [attack.continuous_root_locus(gains)?, sideslip.continuous_root_locus(gains)?],
        }))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use apsides_control::linear::Eigenvalue;
    use apsides_control::state_space::LocusPoint;

    use super::*;
    use crate::moving_mass::Case;

    /// Solver: the bisection for a gain margin, relative.
    const SOLVER: f64 = 1e-6;

    /// Published: three digits.
    const PUBLISHED: f64 = 0.01;

    fn flown(case: &Case) -> (Descent, Record) {
        let descent = Descent::new(case).unwrap();
        let mut record = Record::every(1);
        descent.fly(&mut record).unwrap();
        (descent, record)
    }

    /// At 25 km, with ideal actuators and with a delay of two samples and a half.
    #[test]
    fn a_branch_crosses_the_axis_at_the_gain_margin() {
        for delay in [0.0, 0.025] {
            let mut case = Case::cross(10.0);
            case.actuators.delay = delay;
            let (descent, record) = flown(&case);
            let row = descent.margins(&record, &[25e3]).unwrap()[0];
            let sample = record.samples().iter().find(|s| s.time == row.time).unwrap();
            for (k, margins) in row.margins.iter().enumerate() {
                let margin = margins.gain.unwrap();
                let gains = [1.0, 0.999 * margin.margin, margin.margin, 1.001 * margin.margin];
                let found = descent.root_locus_at(sample, &gains).unwrap().unwrap();
                let [nominal, before, at, beyond] = &found.loops[k][..] else { panic!("four points") };
                let largest = |p: &LocusPoint| p.poles.iter().map(|s| s.re).fold(f64::NEG_INFINITY, f64::max);
                assert!(margins.stable && largest(nominal) < 0.0, "{nominal:?}");
                assert!(largest(before) < 0.0 && largest(beyond) > 0.0, "{before:?} {beyond:?}");
                // |z| = 1 where the real part is 0.
                let z = (largest(at) * case.run.sample_time).exp();
                assert!((z - 1.0).abs() < SOLVER, "{z}");
                let crosses = |s: &Eigenvalue| (s.im - margin.frequency).abs() < SOLVER * margin.frequency;
                assert!(at.poles.iter().any(crosses), "{margin:?} {at:?}");
            }
        }
    }

    /// The loops hardly know of each other: half of the poles are those of the other one, which the factor does not move.
    #[test]
    fn branches_are_followed_past_the_poles_of_the_other_loop() {
        let (descent, record) = flown(&Case::cross(10.0));
        let gains: Vec<f64> = (0..=100).map(|k| 10_f64.powf(f64::from(k) / 50.0 - 1.0)).collect();
        let found = descent.root_locus(&record, &gains).unwrap().unwrap();
        assert!((found.altitude / 25.6e3 - 1.0).abs() < PUBLISHED, "{}", found.altitude);
        assert!((found.dynamic_pressure / 11.5e3 - 1.0).abs() < PUBLISHED, "{}", found.dynamic_pressure);
        for locus in &found.loops {
            assert_eq!(locus.len(), 101);
            // Slower than a sample: without those that a difference of two samples leaves at z = 0.
            let slow = (0..10).filter(|k| locus[0].poles[*k].re * found.sample_time > -10.0);
            let moved = |k: &usize| {
                let from = locus[0].poles[*k];
                let farthest =
                    locus.iter().map(|p| (p.poles[*k].re - from.re).hypot(p.poles[*k].im - from.im));
                farthest.fold(0.0, f64::max) > 0.01 * from.frequency()
            };
            let (moving, still): (Vec<usize>, Vec<usize>) = slow.partition(moved);
            assert_eq!((moving.len(), still.len()), (4, 4), "{locus:?}");
        }
    }

    #[test]
    fn no_law_and_long_delays_have_none() {
        let mut late = Case::cross(10.0);
        late.actuators.delay = 0.2;
        for case in [Case { law: Law::None, ..Case::cross(10.0) }, late] {
            let (descent, record) = flown(&case);
            assert_eq!(descent.root_locus(&record, &[1.0]).unwrap(), None);
        }
        let descent = Descent::new(&Case::cross(10.0)).unwrap();
        assert_eq!(descent.root_locus(&Record::every(1), &[1.0]).unwrap(), None);
    }
}
