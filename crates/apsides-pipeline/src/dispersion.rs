//! Deviations of a flight from its plan: their sizes, samples of them by a seed, and how a deviating flight is steered.

use apsides_control::guidance::feed_forward::{AngleCorrections, FeedForward};
use apsides_metaheuristics::Generator;
use serde::Serialize;

/// Deviations of one flight at its start, or the standard deviations of many, which are normal and independent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Deviations {
    /// Position upwards, along the course and across it (to the right), m.
    pub position_m: [f64; 3],
    /// Velocity along the same axes, m/s.
    pub velocity_m_s: [f64; 3],
    /// Thrust, relative.
    pub thrust: f64,
    /// Exhaust velocity, relative.
    pub exhaust_velocity: f64,
    /// Mass, kg.
    pub mass_kg: f64,
    /// The error of the position in navigation, measured less true, along the axes of the start, constant over the flight, m. Open loop
    /// knows nothing of it.
    pub navigation_position_m: [f64; 3],
    /// The same of the velocity, m/s.
    pub navigation_velocity_m_s: [f64; 3],
}

/// Number of deviations.
const NUMBER: usize = 15;

/// Steps between the seeds of two samples: 2^64 by the golden ratio, so that neighbours have nothing in common.
const STEP: u64 = 0x9E37_79B9_7F4A_7C15;

/// The seed of the sample of an index: a function of seed and index alone.
#[must_use]
pub fn sample_seed(seed: u64, index: usize) -> u64 {
    seed.wrapping_add(STEP.wrapping_mul(index as u64 + 1))
}

impl Deviations {
    /// The deviations of the sample of an index, these being standard deviations: a function of seed and index alone, whatever is sampled
    /// before it.
    #[must_use]
    pub fn sample(&self, seed: u64, index: usize) -> Self {
        let mut random = Generator::new(sample_seed(seed, index));
        let mut draw = |sigma: f64| sigma * random.normal();
        Self {
            position_m: self.position_m.map(&mut draw),
            velocity_m_s: self.velocity_m_s.map(&mut draw),
            thrust: draw(self.thrust),
            exhaust_velocity: draw(self.exhaust_velocity),
            mass_kg: draw(self.mass_kg),
            navigation_position_m: self.navigation_position_m.map(&mut draw),
            navigation_velocity_m_s: self.navigation_velocity_m_s.map(&mut draw),
        }
    }

    /// All of them, in the order of the fields.
    #[must_use]
    pub fn values(&self) -> [f64; NUMBER] {
        let ([a, b, c], [d, e, f]) = (self.position_m, self.velocity_m_s);
        let ([g, h, i], [j, k, l]) = (self.navigation_position_m, self.navigation_velocity_m_s);
        [a, b, c, d, e, f, self.thrust, self.exhaust_velocity, self.mass_kg, g, h, i, j, k, l]
    }

    /// Their names in the same order, the unit at the end.
    #[must_use]
    pub const fn names() -> [&'static str; NUMBER] {
        [
            "start_up_m",
            "start_along_m",
            "start_across_m",
            "start_up_speed_m_s",
            "start_along_speed_m_s",
            "start_across_speed_m_s",
            "thrust",
            "exhaust_velocity",
            "mass_kg",
            "navigation_up_m",
            "navigation_along_m",
            "navigation_across_m",
            "navigation_up_speed_m_s",
            "navigation_along_speed_m_s",
            "navigation_across_speed_m_s",
        ]
    }
}

/// The steering of a deviating flight.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Guidance {
    /// The thrust of the plan as a function of time, along the same directions in space.
    OpenLoop,
    /// The optimum to the planned end from where the flight is thought to be; a miss of the end costs propellant, so that there is a
    /// plan where the end is out of reach. Between two plans the thrust of the last one is flown, as in open loop.
    Replanned(Replanning),
    /// The thrust of the plan until it is full, then full thrust with a radial acceleration linear in time and its horizontal part along the
    /// velocity to be gained: altitude and velocity are met, the range is not controlled. Both angles are corrected by the errors of the start,
    /// in range and across it, unless all gains are zero.
    LinearRadial(
        /// The gains.
        #[serde(serialize_with = "gains")]
        FeedForward,
    ),
    /// An acceleration linear in time to position and velocity of the planned end (E-guidance), within the limits of the thrust.
    Polynomial,
}

/// The gains in the order of their fields.
fn gains<S: serde::Serializer>(law: &FeedForward, to: S) -> Result<S::Ok, S::Error> {
    [law.along, law.along_speed, law.across, law.across_speed].serialize(to)
}

impl Guidance {
    /// The angles that are added to those of the law of a flight with such deviations, as its navigation has them.
    #[must_use]
    pub fn corrections(&self, d: &Deviations) -> AngleCorrections {
        let Self::LinearRadial(law) = self else { return AngleCorrections::default() };
        let error = |off: &[f64; 3], seen: &[f64; 3]| [1, 2].map(|k| -(off[k] + seen[k]));
        law.corrections(
            error(&d.position_m, &d.navigation_position_m),
            error(&d.velocity_m_s, &d.navigation_velocity_m_s),
        )
    }
}

/// The rule by which a flight is planned anew.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Replanning {
    /// Times, s.
    pub at_s: Vec<f64>,
    /// After every so many seconds besides.
    pub every_s: Option<f64>,
}

impl Replanning {
    /// At the start alone.
    #[must_use]
    pub fn at_start() -> Self {
        Self { at_s: vec![0.0], every_s: None }
    }

    /// The times between 0 and an end, increasing.
    #[must_use]
    pub fn times(&self, end: f64) -> Vec<f64> {
        let periodic = self
            .every_s
            .into_iter()
            .flat_map(|period| (1..).map(move |k| f64::from(k) * period).take_while(move |t| *t < end));
        let mut times: Vec<f64> = self.at_s.iter().copied().filter(|t| *t < end).chain(periodic).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }
}

/// The knowledge and the reserve of the steering of a flight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Onboard {
    /// True if thrust and exhaust velocity are known with their deviations. Otherwise those of the mission are taken for true. The mass is
    /// known.
    pub engine_known: bool,
    /// Largest thrust in flight, N, where it is above that of the plan: a reserve.
    pub full_thrust_n: Option<f64>,
}

impl Default for Onboard {
    fn default() -> Self {
        Self { engine_known: true, full_thrust_n: None }
    }
}

/// Deviating flights of a solved mission.
pub trait Dispersed: Sync {
    /// Results of one flight, steered so, in the order of the kind's columns; none if it does not end.
    fn fly(&self, deviations: &Deviations, guidance: &Guidance, onboard: &Onboard) -> Option<Vec<f64>>;
    /// The reason for which no flight at all can be steered so, where there is one.
    fn refused(&self, _guidance: &Guidance) -> Option<&'static str> {
        None
    }
    /// Covariance of the first results by the state-transition matrix, with the thrust of the plan; row-major.
    fn linear_covariance(&self, dispersions: &Deviations) -> Option<Vec<f64>>;
}

#[cfg(test)]
mod tests {
    use super::{Deviations, NUMBER};

    #[test]
    fn samples_have_their_deviations_and_no_correlation() {
        let dispersions = Deviations {
            position_m: [100.0, 10.0, 1.0],
            velocity_m_s: [3.0; 3],
            thrust: 0.01,
            exhaust_velocity: 0.002,
            mass_kg: 5.0,
            navigation_position_m: [50.0, 20.0, 20.0],
            navigation_velocity_m_s: [0.1, 0.2, 0.3],
        };
        const N: usize = 20_000;
        /// Four standard deviations of a mean of so many samples, `4 / sqrt(N)`, and a little more.
        const MEAN: f64 = 0.03;
        /// Five standard deviations of their variance, `5 sqrt(2 / N)`.
        const VARIANCE: f64 = 0.05;
        let samples: Vec<[f64; NUMBER]> = (0..N).map(|k| dispersions.sample(7, k).values()).collect();
        let sigmas = dispersions.values();
        let mean_of = |f: &dyn Fn(&[f64; NUMBER]) -> f64| samples.iter().map(f).sum::<f64>() / N as f64;
        for i in 0..NUMBER {
            assert!(mean_of(&|s| s[i] / sigmas[i]).abs() < MEAN);
            assert!((mean_of(&|s| (s[i] / sigmas[i]).powi(2)) - 1.0).abs() < VARIANCE);
            for j in 0..i {
                assert!(mean_of(&|s| s[i] * s[j] / (sigmas[i] * sigmas[j])).abs() < MEAN);
            }
        }
        // The next sample of the same component as well.
        let successive = samples.windows(2).map(|w| w[0][0] * w[1][0]).sum::<f64>() / N as f64 / 1e4;
        assert!(successive.abs() < MEAN);
        assert_eq!(dispersions.sample(7, 12), dispersions.sample(7, 12));
        assert_ne!(dispersions.sample(7, 12), dispersions.sample(8, 12));
    }
}
