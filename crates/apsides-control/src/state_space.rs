//! Linear systems `x' = A x + B u, y = C x + D u`, continuous or sampled: plants, laws and the loops they make.
//!
//! A loop is broken at the control: [`StateSpace::series`] of a law and a plant, with negative feedback. Sampled plants are exact for a held
//! control with any delay (K. J. Astrom, B. Wittenmark, *Computer-Controlled Systems*, 3rd ed., Prentice-Hall 1997, section 2.3).

use std::f64::consts::PI;

use nalgebra::DMatrix;

use crate::error::{ControlError, not_negative, positive};
use crate::linear::{Eigenvalue, Plant, eigenvalues_of};
use crate::matrix::{finite, from_rows, held_input, inverse};
use crate::pid::PidSettings;

/// Longest delay in samples: each is a state.
const MAX_WAITING: f64 = 1000.0;

/// A linear system of any size.
#[derive(Clone, Debug, PartialEq)]
pub struct StateSpace {
    pub(crate) a: DMatrix<f64>,
    pub(crate) b: DMatrix<f64>,
    pub(crate) c: DMatrix<f64>,
    pub(crate) d: DMatrix<f64>,
    pub(crate) sample_time: Option<f64>,
}

/// Poles of a loop at one gain.
#[derive(Clone, Debug, PartialEq)]
pub struct LocusPoint {
    /// Factor on the loop.
    pub gain: f64,
    /// Poles of the closed loop; each stands in the place of the one that it continues.
    pub poles: Vec<Eigenvalue>,
}

impl StateSpace {
    /// A plant with outputs `y = C x`; continuous.
    ///
    /// # Errors
    /// [`ControlError::Parameter`] where a number is not finite.
    pub fn of_plant<const NX: usize, const NU: usize, const NY: usize>(
        plant: &Plant<NX, NU>,
        c: &[[f64; NX]; NY],
    ) -> Result<Self, ControlError> {
        let (a, b) = (from_rows(&plant.a), from_rows(&plant.b));
        Self::checked(a, b, from_rows(c), DMatrix::zeros(NY, NU), None)
    }

    /// The transfer function `numerator / denominator`, coefficients of falling powers of `s`, or of `z` with a sample time (s).
    ///
    /// # Errors
    /// [`ControlError::Dimension`] where the numerator has the higher degree or the denominator is empty,
    /// [`ControlError::Parameter`] where a number is not finite, the leading coefficient zero or the sample time not positive.
    ///
    /// # Examples
    /// ```
    /// use apsides_control::state_space::StateSpace;
    ///
    /// // The loop 1 / (s (s + 1) (s + 2)) is stable up to a gain of 6, at which it oscillates with sqrt 2 rad/s.
    /// let open = StateSpace::of_transfer(&[1.0], &[1.0, 3.0, 2.0, 0.0], None)?;
    /// assert!(open.closed(5.99)?.is_stable()? && !open.closed(6.01)?.is_stable()?);
    /// # Ok::<(), apsides_control::ControlError>(())
    /// ```
    pub fn of_transfer(
        numerator: &[f64],
        denominator: &[f64],
        sample_time: Option<f64>,
    ) -> Result<Self, ControlError> {
        let n = denominator.len().saturating_sub(1);
        if denominator.is_empty() || numerator.len() > n + 1 {
            let (expected, found) = (n + 1, numerator.len());
            return Err(ControlError::Dimension {
                what: "numerator of a transfer function",
                expected,
                found,
            });
        }
        let lead = denominator[0];
        positive("magnitude of the leading coefficient", lead.abs())?;
        // Controllable form; what the numerator has of full degree goes past the states.
        let mut num = vec![0.0; n + 1];
        num[n + 1 - numerator.len()..].copy_from_slice(numerator);
        let direct = num[0] / lead;
        let a = DMatrix::from_fn(n, n, |i, j| match i {
            0 => -denominator[j + 1] / lead,
            _ if i == j + 1 => 1.0,
            _ => 0.0,
        });
        let b = DMatrix::from_fn(n, 1, |i, _| if i == 0 { 1.0 } else { 0.0 });
        let c = DMatrix::from_fn(1, n, |_, j| num[j + 1] / lead - direct * denominator[j + 1] / lead);
        Self::checked(a, b, c, DMatrix::from_element(1, 1, direct), sample_time)
    }

    /// The gain `y = K u` as a law without memory.
    ///
    /// # Errors
    /// [`ControlError::Parameter`] where a number is not finite or the sample time (s) not positive.
    ///
    /// # Examples
    /// ```
    /// use apsides_control::state_space::StateSpace;
    ///
    /// // A gain of 3 before an integrator: closed, a pole at -3.
    /// let law = StateSpace::of_gain(&[[3.0]], None)?;
    /// let plant = StateSpace::of_transfer(&[1.0], &[1.0, 0.0], None)?;
    /// let poles = plant.series(&law)?.closed(1.0)?.poles()?;
    /// assert!((poles[0].re + 3.0).abs() < 1e-14 && poles[0].im == 0.0);
    /// # Ok::<(), apsides_control::ControlError>(())
    /// ```
    pub fn of_gain<const NU: usize, const NY: usize>(
        gain: &[[f64; NU]; NY],
        sample_time: Option<f64>,
    ) -> Result<Self, ControlError> {
        let (a, b) = (DMatrix::zeros(0, 0), DMatrix::zeros(0, NU));
        Self::checked(a, b, DMatrix::zeros(NY, 0), from_rows(gain), sample_time)
    }

    /// The sampled PID law without limits, from the error to the output.
    ///
    /// # Errors
    /// As [`crate::pid::Pid::new`].
    pub fn of_pid(settings: &PidSettings) -> Result<Self, ControlError> {
        crate::pid::Pid::new(*settings)?;
        let (gains, t) = (&settings.gains, settings.sample_time);
        // States: integral and filtered derivative before the sample, error before it.
        let filter = settings.filter_time / (settings.filter_time + t);
        let difference = 1.0 / (settings.filter_time + t);
        let a = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.0, 0.0, filter, -difference, 0.0, 0.0, 0.0]);
        let b = DMatrix::from_row_slice(3, 1, &[t, difference, 1.0]);
        let (i, d) = (gains.integral, gains.derivative);
        let c = DMatrix::from_row_slice(1, 3, &[i, d * filter, -d * difference]);
        let direct = gains.proportional + i * t + d * difference;
        Self::checked(a, b, c, DMatrix::from_element(1, 1, direct), Some(t))
    }

    fn checked(
        a: DMatrix<f64>,
        b: DMatrix<f64>,
        c: DMatrix<f64>,
        d: DMatrix<f64>,
        sample_time: Option<f64>,
    ) -> Result<Self, ControlError> {
        if let Some(time) = sample_time {
            positive("sample time in s", time)?;
        }
        let f = |m| finite("a coefficient of a linear system", m);
        Ok(Self { a: f(a)?, b: f(b)?, c: f(c)?, d: f(d)?, sample_time })
    }

    /// Numbers of states, inputs and outputs.
    #[must_use]
    pub fn size(&self) -> [usize; 3] {
        [self.a.nrows(), self.b.ncols(), self.c.nrows()]
    }

    /// Time between samples (s), `None` of a continuous system.
    #[must_use]
    pub fn sample_time(&self) -> Option<f64> {
        self.sample_time
    }

    /// The system as a computer sees it that holds its inputs for a sample time and whose inputs act after a delay (both s): exact,
    /// also for a delay that is no multiple of the sample time.
    ///
    /// # Errors
    /// [`ControlError::Parameter`] where the sample time is not positive, the delay negative or above a thousand samples, [`ControlError::Dimension`] where the
    /// system is sampled already, or where inputs act on outputs at once and are delayed by part of a sample.
    pub fn sampled(&self, sample_time: f64, delay: f64) -> Result<Self, ControlError> {
        positive("sample time in s", sample_time)?;
        not_negative("delay in s", delay)?;
        let [n, m, p] = self.size();
        if self.sample_time.is_some() {
            return Err(ControlError::Dimension {
                what: "sample times of one system",
                expected: 1,
                found: 2,
            });
        }
        let ratio = delay / sample_time;
        let whole = if (ratio - ratio.round()).abs() < 1e-9 { ratio.round() } else { ratio.floor() };
        let part = (delay - whole * sample_time).max(0.0);
        if whole > MAX_WAITING {
            let allowed = "at most 1000 sample times";
            return Err(ControlError::Parameter { what: "delay in s", value: delay, allowed });
        }
        let whole = whole as usize;
        let (late, early, a) = if part < 1e-9 * sample_time {
            let (a, b) = held_input(&self.a, &self.b, sample_time)?;
            (DMatrix::zeros(n, m), b, a)
        } else {
            if self.d.iter().any(|v| *v != 0.0) {
                let what = "parts of a sample that a direct input may be delayed by";
                return Err(ControlError::Dimension { what, expected: 0, found: 1 });
            }
            // The older input acts for `part`, the newer for the rest of the sample.
            let (older, b0) = held_input(&self.a, &self.b, part)?;
            let (newer, b1) = held_input(&self.a, &self.b, sample_time - part)?;
            (&newer * b0, b1, newer * older)
        };
        // Inputs on their way are states, the latest first: x+ = A x + early u(k - whole) + late u(k - whole - 1).
        let has_part = usize::from(part >= 1e-9 * sample_time);
        let waiting = whole + has_part;
        let mut system = Self {
            a: DMatrix::zeros(n + m * waiting, n + m * waiting),
            b: DMatrix::zeros(n + m * waiting, m),
            c: DMatrix::zeros(p, n + m * waiting),
            d: DMatrix::zeros(p, m),
            sample_time: Some(sample_time),
        };
        system.a.view_mut((0, 0), (n, n)).copy_from(&a);
        system.c.view_mut((0, 0), (p, n)).copy_from(&self.c);
        let place = |k: usize| n + m * (k - 1);
        if whole == 0 {
            system.b.view_mut((0, 0), (n, m)).copy_from(&early);
            system.d.copy_from(&self.d);
        } else {
            system.a.view_mut((0, place(whole)), (n, m)).copy_from(&early);
            system.c.view_mut((0, place(whole)), (p, m)).copy_from(&self.d);
        }
        if has_part == 1 {
            system.a.view_mut((0, place(whole + 1)), (n, m)).copy_from(&late);
        }
        for k in 1..=waiting {
            let identity = DMatrix::identity(m, m);
            if k == 1 {
                system.b.view_mut((place(1), 0), (m, m)).copy_from(&identity);
            } else {
                system.a.view_mut((place(k), place(k - 1)), (m, m)).copy_from(&identity);
            }
        }
        Ok(system)
    }

    /// This system, then the next one: `y = next(self(u))`.
    ///
    /// # Errors
    /// [`ControlError::Dimension`] where outputs and inputs differ in number, or sample times differ.
    pub fn series(&self, next: &Self) -> Result<Self, ControlError> {
        let [n1, m, p1] = self.size();
        let [n2, m2, p] = next.size();
        require("inputs of the next system", p1, m2)?;
        self.require_same_time(next)?;
        let mut a = DMatrix::zeros(n1 + n2, n1 + n2);
        a.view_mut((0, 0), (n1, n1)).copy_from(&self.a);
        a.view_mut((n1, 0), (n2, n1)).copy_from(&(&next.b * &self.c));
        a.view_mut((n1, n1), (n2, n2)).copy_from(&next.a);
        let mut b = DMatrix::zeros(n1 + n2, m);
        b.view_mut((0, 0), (n1, m)).copy_from(&self.b);
        b.view_mut((n1, 0), (n2, m)).copy_from(&(&next.b * &self.d));
        let mut c = DMatrix::zeros(p, n1 + n2);
        c.view_mut((0, 0), (p, n1)).copy_from(&(&next.d * &self.c));
        c.view_mut((0, n1), (p, n2)).copy_from(&next.c);
        Ok(Self { a, b, c, d: &next.d * &self.d, sample_time: self.sample_time })
    }

    /// Two systems side by side, inputs and outputs of this one first: one law per axis.
    ///
    /// # Errors
    /// [`ControlError::Dimension`] where sample times differ.
    pub fn beside(&self, other: &Self) -> Result<Self, ControlError> {
        self.require_same_time(other)?;
        let diagonal = |p: &DMatrix<f64>, q: &DMatrix<f64>| {
            let mut m = DMatrix::zeros(p.nrows() + q.nrows(), p.ncols() + q.ncols());
            m.view_mut((0, 0), p.shape()).copy_from(p);
            m.view_mut(p.shape(), q.shape()).copy_from(q);
            m
        };
        Ok(Self {
            a: diagonal(&self.a, &other.a),
            b: diagonal(&self.b, &other.b),
            c: diagonal(&self.c, &other.c),
            d: diagonal(&self.d, &other.d),
            sample_time: self.sample_time,
        })
    }

    /// The loop closed by `u = r - gain y`, from `r` to `y`.
    ///
    /// # Errors
    /// [`ControlError::Dimension`] where outputs and inputs differ in number, [`ControlError::Singular`] where the loop has no
    /// solution because outputs act on themselves at once.
    pub fn closed(&self, gain: f64) -> Result<Self, ControlError> {
        let [_, m, p] = self.size();
        require("outputs of a loop", m, p)?;
        let direct = inverse("I + D of the loop", DMatrix::identity(m, m) + &self.d * gain)?;
        let back = &self.b * &direct;
        Ok(Self {
            a: &self.a - &back * &self.c * gain,
            c: &direct * &self.c,
            d: &direct * &self.d,
            b: back,
            sample_time: self.sample_time,
        })
    }

    /// The loop at one input with all the others closed: what is opened for the margins of one control of several.
    ///
    /// # Errors
    /// As [`closed`](Self::closed), and [`ControlError::Dimension`] where there is no such input.
    pub fn loop_at(&self, input: usize) -> Result<Self, ControlError> {
        let [_, m, p] = self.size();
        require("outputs of a loop", m, p)?;
        if input >= m {
            return Err(ControlError::Dimension { what: "input of a loop", expected: m, found: input });
        }
        // u = e v - S y, S selecting the other channels: then y = (I + D S)^-1 (C x + D e v).
        let e = DMatrix::from_fn(m, 1, |i, _| f64::from(u8::from(i == input)));
        let select = DMatrix::from_fn(m, m, |i, j| f64::from(u8::from(i == j && i != input)));
        let direct = inverse("I + D of the other loops", DMatrix::identity(m, m) + &self.d * &select)?;
        let c = &direct * &self.c;
        let d = &direct * &self.d * &e;
        Ok(Self {
            a: &self.a - &self.b * &select * &c,
            b: &self.b * (&e - &select * &d),
            c: c.rows(input, 1).into_owned(),
            d: d.rows(input, 1).into_owned(),
            sample_time: self.sample_time,
        })
    }

    /// Poles, by real part, then by imaginary part.
    ///
    /// # Errors
    /// [`ControlError::Eigenvalues`] where their iteration does not converge.
    pub fn poles(&self) -> Result<Vec<Eigenvalue>, ControlError> {
        eigenvalues_of("the state matrix of a linear system", &self.a)
    }

    /// Tells whether all poles are in the open left half plane, or in the open unit disk.
    ///
    /// # Errors
    /// As [`poles`](Self::poles).
    pub fn is_stable(&self) -> Result<bool, ControlError> {
        Ok(self.poles()?.iter().all(|p| match self.sample_time {
            Some(_) => p.frequency() < 1.0,
            None => p.re < 0.0,
        }))
    }

    /// Poles of the loop closed at each gain, in order of the gains; those of a sampled loop are in the plane of `z`.
    ///
    /// # Errors
    /// As [`closed`](Self::closed) and [`poles`](Self::poles).
    pub fn root_locus(&self, gains: &[f64]) -> Result<Vec<LocusPoint>, ControlError> {
        let mut locus: Vec<LocusPoint> = Vec::with_capacity(gains.len());
        for &gain in gains {
            let mut poles = self.closed(gain)?.poles()?;
            if let Some(expected) = continued(&locus) {
                poles = in_the_order_of(&expected, poles);
            }
            locus.push(LocusPoint { gain, poles });
        }
        Ok(locus)
    }

    /// The [`root_locus`](Self::root_locus) in the plane of `s`: poles of a sampled loop as [those of continuous modes](Eigenvalue::continuous),
    /// at either end of the imaginary range where a branch comes from there.
    ///
    /// # Errors
    /// As [`root_locus`](Self::root_locus).
    pub fn continuous_root_locus(&self, gains: &[f64]) -> Result<Vec<LocusPoint>, ControlError> {
        let mut locus = self.root_locus(gains)?;
        if let Some(time) = self.sample_time {
            let mut before: Vec<f64> = Vec::new();
            for point in &mut locus {
                for (k, pole) in point.poles.iter_mut().enumerate() {
                    *pole = pole.continuous(time);
                    // The ends of the range are the same pole.
                    if pole.im == PI / time && before.get(k).is_some_and(|im| *im < 0.0) {
                        pole.im = -pole.im;
                    }
                }
                before = point.poles.iter().map(|pole| pole.im).collect();
            }
        }
        Ok(locus)
    }

    fn require_same_time(&self, other: &Self) -> Result<(), ControlError> {
        if self.sample_time == other.sample_time {
            Ok(())
        } else {
            Err(ControlError::Dimension { what: "sample times of one loop", expected: 1, found: 2 })
        }
    }
}

fn require(what: &'static str, expected: usize, found: usize) -> Result<(), ControlError> {
    if expected == found { Ok(()) } else { Err(ControlError::Dimension { what, expected, found }) }
}

/// Where the poles of the next point are expected: as far on as from the last point but one to the last. Nearness alone would not tell a pole
/// that passes another one from one that stops there.
fn continued(locus: &[LocusPoint]) -> Option<Vec<Eigenvalue>> {
    match locus {
        [] => None,
        [only] => Some(only.poles.clone()),
        [.., before, last] => {
            let on = |(p, q): (&Eigenvalue, &Eigenvalue)| Eigenvalue {
                re: 2.0 * q.re - p.re,
                im: 2.0 * q.im - p.im,
            };
            Some(before.poles.iter().zip(&last.poles).map(on).collect())
        }
    }
}

/// Each pole in the place of the nearest one that is expected, the closest pairs first.
fn in_the_order_of(expected: &[Eigenvalue], now: Vec<Eigenvalue>) -> Vec<Eigenvalue> {
    if expected.len() != now.len() {
        return now;
    }
    let mut pairs: Vec<(f64, usize, usize)> = Vec::with_capacity(now.len() * now.len());
    for (i, p) in expected.iter().enumerate() {
        pairs.extend(now.iter().enumerate().map(|(j, q)| ((p.re - q.re).hypot(p.im - q.im), i, j)));
    }
    pairs.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)).then(p.2.cmp(&q.2)));
    let mut place: Vec<Option<Eigenvalue>> = vec![None; now.len()];
    let mut used = vec![false; now.len()];
    for (_, i, j) in pairs {
        if place[i].is_none() && !used[j] {
            place[i] = Some(now[j]);
            used[j] = true;
        }
    }
    place.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests;
