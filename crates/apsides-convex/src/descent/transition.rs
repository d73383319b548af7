//! Exact discretisation of the linear equations of motion.
//!
//! ```text
//! d/dt (r, v) = A (r, v) + B (u + g),   u held (zero order) or linear (first order) over an interval of length h
//! (r, v)_{k+1} = Phi (r, v)_k + B0 u_k + B1 u_{k+1} + G g
//! ```
//!
//! With `E_n = sum_j A^j h^(j+n) / (j+n)!` and `Phi = E_0`: zero order `B0 = E_1 B`, `B1 = 0`; first order `B1 = E_2 B / h`,
//! `B0 = E_1 B - B1`; `G = E_1 B`. The sums end where terms are lost in rounding; without rotation after two terms.

/// Matrix of position and velocity.
pub(crate) type Square = [[f64; 6]; 6];
/// Position and velocity by acceleration.
pub(crate) type Gain = [[f64; 3]; 6];

/// The course of the control over an interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hold {
    /// Constant.
    Zero,
    /// Linear and continuous.
    #[default]
    First,
}

/// One interval.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transition {
    pub(crate) phi: Square,
    pub(crate) first: Gain,
    pub(crate) last: Gain,
    pub(crate) constant: Gain,
}

impl Transition {
    pub(crate) fn new(rotation: &[f64; 3], h: f64, hold: Hold) -> Self {
        let a = system(rotation);
        // E_n by columns of the identity: term_j = A^j h^j / j!, weights h^n j! / (j+n)!.
        let mut term = identity();
        let (mut e0, mut e1, mut e2) = ([[0.0; 6]; 6], [[0.0; 6]; 6], [[0.0; 6]; 6]);
        for j in 0..60 {
            let j = f64::from(j);
            let mut size = 0.0_f64;
            for r in 0..6 {
                for c in 0..6 {
                    let t = term[r][c];
                    e0[r][c] += t;
                    e1[r][c] += t * h / (j + 1.0);
                    e2[r][c] += t * h * h / ((j + 1.0) * (j + 2.0));
                    size = size.max(t.abs());
                }
            }
            if size < 1e-18 {
                break;
            }
            term = product(&a, &term);
            term.iter_mut().flatten().for_each(|t| *t *= h / (j + 1.0));
        }
        let gain = |e: &Square, factor: f64| -> Gain {
            std::array::from_fn(|r| std::array::from_fn(|c| factor * e[r][3 + c]))
        };
        let whole = gain(&e1, 1.0);
        let last = match hold {
            Hold::Zero => [[0.0; 3]; 6],
            Hold::First => gain(&e2, 1.0 / h),
        };
        let first = std::array::from_fn(|r| std::array::from_fn(|c| whole[r][c] - last[r][c]));
        Self { phi: e0, first, last, constant: whole }
    }
}

/// `r' = v`, `v' = -2 w x v - w x (w x r)`.
fn system(w: &[f64; 3]) -> Square {
    let mut a = [[0.0; 6]; 6];
    let cross = [[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]];
    let square: f64 = w.iter().map(|c| c * c).sum();
    for r in 0..3 {
        a[r][3 + r] = 1.0;
        for c in 0..3 {
            a[3 + r][3 + c] = -2.0 * cross[r][c];
            let diagonal = if r == c { square } else { 0.0 };
            a[3 + r][c] = diagonal - w[r] * w[c];
        }
    }
    a
}

fn identity() -> Square {
    std::array::from_fn(|r| std::array::from_fn(|c| if r == c { 1.0 } else { 0.0 }))
}

pub(crate) fn product<const C: usize>(a: &Square, b: &[[f64; C]; 6]) -> [[f64; C]; 6] {
    let mut out = [[0.0; C]; 6];
    for r in 0..6 {
        for k in 0..6 {
            let factor = a[r][k];
            if factor != 0.0 {
                for c in 0..C {
                    out[r][c] += factor * b[k][c];
                }
            }
        }
    }
    out
}

/// Powers of one interval: states at an offset in a block from the state at its start and the controls since.
#[derive(Clone, Debug)]
pub(crate) struct BlockMaps {
    pub(crate) length: usize,
    /// `Phi^j`, `j = 0..=length`.
    pub(crate) phi: Vec<Square>,
    /// Gain of control `i` at offset `j` at index `j (length + 1) + i`.
    gains: Vec<Gain>,
    /// Share of a constant acceleration at offset `j`.
    pub(crate) constant: Vec<Gain>,
}

impl BlockMaps {
    pub(crate) fn new(length: usize) -> Self {
        Self {
            length,
            phi: vec![identity(); length + 1],
            gains: vec![[[0.0; 3]; 6]; (length + 1) * (length + 1)],
            constant: vec![[[0.0; 3]; 6]; length + 1],
        }
    }

    pub(crate) fn fill(&mut self, step: &Transition) {
        let side = self.length + 1;
        for j in 0..self.length {
            self.phi[j + 1] = product(&step.phi, &self.phi[j]);
            self.constant[j + 1] = sum(&product(&step.phi, &self.constant[j]), &step.constant);
            for i in 0..=j + 1 {
                let mut gain = product(&step.phi, &self.gains[j * side + i]);
                if i == j {
                    gain = sum(&gain, &step.first);
                }
                if i == j + 1 {
                    gain = step.last;
                }
                self.gains[(j + 1) * side + i] = gain;
            }
        }
    }

    pub(crate) fn gain(&self, offset: usize, control: usize) -> &Gain {
        &self.gains[offset * (self.length + 1) + control]
    }
}

fn sum(a: &Gain, b: &Gain) -> Gain {
    std::array::from_fn(|r| std::array::from_fn(|c| a[r][c] + b[r][c]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Round-off of the arithmetic.
    const ROUNDING: f64 = 1e-10;

    /// Runge-Kutta steps of order 4, fine enough for twelve digits.
    fn fly(w: &[f64; 3], x: [f64; 6], u: impl Fn(f64) -> [f64; 3], h: f64) -> [f64; 6] {
        let a = system(w);
        let rate = |t: f64, x: &[f64; 6]| -> [f64; 6] {
            let u = u(t);
            std::array::from_fn(|r| {
                (0..6).map(|c| a[r][c] * x[c]).sum::<f64>() + if r > 2 { u[r - 3] } else { 0.0 }
            })
        };
        let (mut x, n) = (x, 2000);
        let d = h / f64::from(n);
        for k in 0..n {
            let t = f64::from(k) * d;
            let step = |k: &[f64; 6], f: f64| -> [f64; 6] { std::array::from_fn(|i| x[i] + f * k[i]) };
            let k1 = rate(t, &x);
            let k2 = rate(t + 0.5 * d, &step(&k1, 0.5 * d));
            let k3 = rate(t + 0.5 * d, &step(&k2, 0.5 * d));
            let k4 = rate(t + d, &step(&k3, d));
            x = std::array::from_fn(|i| x[i] + d / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        }
        x
    }

    #[test]
    fn blocks_are_the_flight_with_held_controls() {
        let w = [0.3, -0.2, 0.5];
        let (x0, h) = ([1.0, -2.0, 3.0, 0.5, 0.2, -1.0], 0.7);
        let controls = [[1.0, 0.2, -0.3], [0.4, -1.0, 0.8], [-0.6, 0.5, 2.0], [0.3, 0.1, -0.7]];
        for hold in [Hold::Zero, Hold::First] {
            let mut maps = BlockMaps::new(3);
            maps.fill(&Transition::new(&w, h, hold));
            let mut x = x0;
            for j in 0..3 {
                let slope = if hold == Hold::First { 1.0 } else { 0.0 };
                let (a, b) = (controls[j], controls[j + 1]);
                let u = |t: f64| std::array::from_fn(|k| a[k] + slope * t / h * (b[k] - a[k]));
                x = fly(&w, x, u, h);
                for r in 0..6 {
                    let free: f64 = (0..6).map(|c| maps.phi[j + 1][r][c] * x0[c]).sum();
                    let forced: f64 = (0..=j + 1)
                        .map(|i| (0..3).map(|c| maps.gain(j + 1, i)[r][c] * controls[i][c]).sum::<f64>())
                        .sum();
                    assert!((free + forced - x[r]).abs() < ROUNDING, "{hold:?} {j} {r}");
                }
            }
            let constant = fly(&w, [0.0; 6], |_| [0.1, -0.4, 0.9], 3.0 * h);
            for r in 0..6 {
                let share = maps.constant[3][r];
                let value = 0.1 * share[0] - 0.4 * share[1] + 0.9 * share[2];
                assert!((value - constant[r]).abs() < ROUNDING);
            }
        }
    }
}
