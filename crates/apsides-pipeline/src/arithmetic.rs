//! The arithmetic of a machine, as far as results depend on it: whether multiplications and additions are fused, and the bits of the elementary
//! functions of its mathematical library, which chooses programs by the processor as well.

use crate::digest::sha256;

/// Arguments of each function.
const ARGUMENTS: u32 = 256;

/// Digits of the digest that tell two kinds of arithmetic apart.
const DIGITS: usize = 16;

/// The level of vector instructions of this machine: of x86-64 by the levels of its psABI.
#[must_use]
pub fn vector_level() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        let four = std::arch::is_x86_feature_detected!("avx512f")
            && std::arch::is_x86_feature_detected!("avx512bw")
            && std::arch::is_x86_feature_detected!("avx512cd")
            && std::arch::is_x86_feature_detected!("avx512dq")
            && std::arch::is_x86_feature_detected!("avx512vl");
        match (four, is_fused()) {
            (true, _) => "x86-64-v4",
            (false, true) => "x86-64-v3",
            (false, false) => "x86-64",
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        std::env::consts::ARCH
    }
}

/// True where linear systems are factored with fused operations: the choice that pulp makes.
fn is_fused() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        true
    }
}

/// A digest that two machines share where samples computed on them have the same bits.
#[must_use]
pub fn digest_of_arithmetic() -> String {
    let mut bytes = vec![u8::from(is_fused())];
    for function in ONE {
        for k in 0..ARGUMENTS {
            bytes.extend_from_slice(&function(argument(k)).to_bits().to_le_bytes());
        }
    }
    for function in TWO {
        for k in 0..ARGUMENTS {
            bytes.extend_from_slice(&function(argument(k), argument(k + ARGUMENTS)).to_bits().to_le_bytes());
        }
    }
    let mut digest = sha256(&bytes);
    digest.truncate(DIGITS);
    digest
}

const ONE: [fn(f64) -> f64; 15] = [
    f64::sin,
    f64::cos,
    f64::tan,
    |x| (x / LARGEST).asin(),
    |x| (x / LARGEST).acos(),
    f64::atan,
    f64::exp,
    f64::exp_m1,
    f64::ln,
    f64::ln_1p,
    f64::log10,
    f64::sinh,
    f64::cosh,
    f64::tanh,
    f64::cbrt,
];

const TWO: [fn(f64, f64) -> f64; 3] = [f64::atan2, f64::powf, f64::hypot];

/// Above all arguments.
const LARGEST: f64 = 8.0;

/// Numbers between 0 and [`LARGEST`] without a pattern: multiples of the golden section, less their whole part.
fn argument(k: u32) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    (f64::from(k + 1) * GOLDEN).fract() * LARGEST
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_is_of_the_machine() {
        let digest = digest_of_arithmetic();
        assert_eq!((digest.len(), digest == digest_of_arithmetic()), (DIGITS, true));
        assert!(!vector_level().is_empty());
    }

    #[test]
    fn arguments_are_in_the_domain_of_all() {
        let all = (0..2 * ARGUMENTS).map(argument);
        assert!(all.clone().all(|x| x > 0.0 && x < LARGEST));
        assert!(all.clone().all(|x| ONE.iter().all(|f| f(x).is_finite())));
        assert!(all.clone().zip(all.rev()).all(|(x, y)| TWO.iter().all(|f| f(x, y).is_finite())));
    }
}
