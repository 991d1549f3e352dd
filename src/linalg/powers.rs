//! Powers of two, from the exponents of doubles: what scales without rounding.

use std::f64::consts::SQRT_2;

use nalgebra::{DMatrix, DVector};

/// 2^k; 0 or ∞ where no double is.
pub(crate) fn two_to(k: i32) -> f64 {
    match k {
        // Above the 52 digits of the mantissa.
        -1022..=1023 => f64::from_bits(((k + 1023) as u64) << 52),
        -1074..-1022 => f64::from_bits(1 << (k + 1074)),
        _ if k > 0 => f64::INFINITY,
        _ => 0.0,
    }
}

/// x/2^k.
pub(crate) fn halved(x: f64, k: u32) -> f64 {
    x * two_to(-(k as i32))
}

/// The power of two nearest to x in the logarithm, at most 2^900 and at least 2^−900; 1 for what has no size.
pub(crate) fn power_of_two(x: f64) -> f64 {
    if !(x.is_finite() && x > 0.0) {
        return 1.0;
    }
    let below = exponent(x).clamp(-900, 900);
    let is_above = x * two_to(-below) >= SQRT_2;
    two_to((below + i32::from(is_above)).min(900))
}

/// The least k ≥ 0 with x ≤ 2^k: how often x is halved until it is at most 1. No number is not halved, ∞ always.
pub(crate) fn halvings(x: f64) -> u32 {
    if x > 1.0 {
        let below = exponent(x);
        let is_more = x > two_to(below);
        below.unsigned_abs() + u32::from(is_more)
    } else {
        0
    }
}

/// The largest k with 2^k ≤ x, for a normal x > 0.
fn exponent(x: f64) -> i32 {
    (x.to_bits() >> 52) as i32 - 1023
}

/// Rows of which the largest entries are in 1 up to this factor need no further round of [`equilibrate`], which rounds to powers of two.
const LEVEL: f64 = 1.1;

/// Rounds of [`equilibrate`]; each takes the square root of what is left of the imbalance.
const SWEEPS: usize = 24;

/// Powers of two d, 2^±500 at most, with max_j d_i M_ij d_j ≈ 1 in every nonzero row of a nonnegative symmetric M (D. Ruiz, RAL-TR-2001-034).
pub(crate) fn equilibrate(magnitude: &DMatrix<f64>) -> DVector<f64> {
    let mut d = DVector::from_element(magnitude.nrows(), 1.0);
    for _ in 0..SWEEPS {
        let columns = magnitude.column_iter().zip(&d);
        let largest: Vec<f64> = columns
            .map(|(column, own)| {
                let entries = column.iter().zip(&d);
                entries.fold(0.0_f64, |most, (entry, d)| most.max(entry * d)) * own
            })
            .collect();
        let is_level = |v: &f64| *v == 0.0 || (LEVEL.recip()..=LEVEL).contains(v);
        if largest.iter().all(is_level) {
            break;
        }
        for (d, largest) in d.iter_mut().zip(largest) {
            if largest > 0.0 {
                *d /= largest.sqrt();
            }
        }
    }
    // d² stays a normal number.
    let (least, most) = (two_to(-500), two_to(500));
    d.map(|d| power_of_two(d.clamp(least, most)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_those_of_the_library() {
        for k in -1100..1100 {
            assert_eq!(two_to(k), f64::from(k).exp2(), "{k}");
        }
    }

    #[test]
    fn the_nearest_power_is_that_of_the_logarithm() {
        for k in -900..=900 {
            let x = two_to(k);
            for factor in [0.708, 1.0, 1.414] {
                assert_eq!(power_of_two(factor * x), x, "{factor}·2^{k}");
            }
        }
        for (x, power) in [(1.415, 2.0), (0.707, 0.5), (0.0, 1.0), (-3.0, 1.0)] {
            assert_eq!(power_of_two(x), power, "{x}");
        }
        assert_eq!(power_of_two(f64::NAN), 1.0);
        assert_eq!(power_of_two(f64::INFINITY), 1.0);
        assert_eq!(power_of_two(1e-320), two_to(-900));
        assert_eq!(power_of_two(f64::MAX), two_to(900));
    }

    #[test]
    fn a_number_is_halved_until_it_is_at_most_one() {
        for (x, k) in [
            (-1.0, 0),
            (1.0, 0),
            (1.0 + f64::EPSILON, 1),
            (2.0, 1),
            (2.5, 2),
            (4.0, 2),
            (1e300, 997),
        ] {
            assert_eq!(halvings(x), k, "{x}");
        }
        assert_eq!(halvings(f64::NAN), 0);
        assert!(halvings(f64::INFINITY) > 1000);
    }
}
