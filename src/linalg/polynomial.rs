//! First sign change of a polynomial on [0, 1], missed by nothing: the control polygon of Bernstein's form bounds the
//! polynomial from below (Farin, Curves and Surfaces for CAGD, ch. 6).

use super::series::MAX_DEGREE;

/// Halvings of [0, 1] before an undecided piece counts as a contact.
const MAX_DEPTH: u32 = 48;

type Coefficients = [f64; MAX_DEGREE + 1];

/// The first s in [0, 1] at which p(s) = Σ a_k s^k falls through zero to values below `-floor`, or `None` if
/// p ≥ −floor on [0, 1]. A dip that stays above `-floor` is a contact, not a crossing.
pub(crate) fn first_crossing(a: &[f64], floor: f64) -> Option<f64> {
    let degree = a.len().checked_sub(1)?;
    let rest: f64 = a[1..].iter().map(|v| v.abs()).sum();
    if a[0] - rest >= -floor {
        return None;
    }
    let coefficient = |k: usize| a.get(k).copied().unwrap_or(0.0);
    let [a0, a1, a2, a3] = [0, 1, 2, 3].map(coefficient);
    let tail = a.iter().skip(4);
    let size: f64 = tail.clone().map(|v| v.abs()).sum();
    if cubic_holds([a0, a1, a2, a3], size, floor) {
        return None;
    }
    // Falling all the way, by Bernstein's form of the slope of the cubic and by how much the others rise at most: one crossing.
    let rise = |(k, c): (usize, &f64)| (k as f64 * c).max(0.0);
    let rises: f64 = (4..).zip(tail).map(rise).sum();
    let steepest = a1.max(a1 + a2).max(a1 + 2.0 * a2 + 3.0 * a3) + rises;
    if a0 > 0.0 && steepest < 0.0 && value(a, 1.0) < -floor {
        return Some(root(a, 0.0, 1.0, f64::EPSILON));
    }
    let bernstein = to_bernstein(a);
    search(a, &bernstein[..=degree], floor, 0.0, 1.0, 0)
}

/// Whether a0 + a1 s + a2 s² + a3 s³, and further powers of s whose coefficients add up to at most `tail`, cannot fall below −floor on
/// [0, 1]: none is less than −tail s⁴.
#[inline]
pub(crate) fn cubic_holds([a0, a1, a2, a3]: [f64; 4], tail: f64, floor: f64) -> bool {
    let half = a0 + 0.5 * a1 + a2 / 6.0;
    let least = a0.min(a0 + 0.25 * a1).min(half);
    let third = a0 + 0.75 * a1 + 0.5 * a2 + 0.25 * a3;
    least.min(third).min(a0 + a1 + a2 + a3 - tail) >= -floor
}

/// Nearly a zero on [0, 1] of the cubic with these values and slopes at 0 and 1, the first of them ≥ 0 and the second < 0.
pub(crate) fn zero_of_cubic(values: [f64; 2], slopes: [f64; 2]) -> f64 {
    let rise = values[1] - values[0];
    let a = [
        values[0],
        slopes[0],
        3.0 * rise - 2.0 * slopes[0] - slopes[1],
        slopes[0] + slopes[1] - 2.0 * rise,
    ];
    root(&a, 0.0, 1.0, f64::EPSILON.sqrt())
}

/// p(s) by Horner's rule.
pub(crate) fn value(a: &[f64], s: f64) -> f64 {
    a.iter().rev().fold(0.0, |sum, &c| sum * s + c)
}

/// p(s) and p'(s).
fn value_and_slope(a: &[f64], s: f64) -> (f64, f64) {
    a.iter()
        .rev()
        .fold((0.0, 0.0), |(p, slope), &c| (p * s + c, slope * s + p))
}

/// b_i = Σ_{k ≤ i} C(i,k)/C(n,k) a_k.
fn to_bernstein(a: &[f64]) -> Coefficients {
    let n = a.len() - 1;
    let mut b = [0.0; MAX_DEGREE + 1];
    for (i, out) in b.iter_mut().enumerate().take(n + 1) {
        let mut weight = 1.0;
        let mut sum = a[0];
        for (k, &coefficient) in a.iter().enumerate().take(i + 1).skip(1) {
            weight *= (i + 1 - k) as f64 / (n + 1 - k) as f64;
            sum += weight * coefficient;
        }
        *out = sum;
    }
    b
}

fn search(a: &[f64], b: &[f64], floor: f64, low: f64, high: f64, depth: u32) -> Option<f64> {
    if b.iter().all(|&v| v >= -floor) {
        return None;
    }
    if b[0] <= 0.0 && b[0] >= -floor && b[1..].iter().all(|&v| v <= 0.0) || b[0] < -floor {
        return Some(low);
    }
    let last = b.len() - 1;
    let changes = b
        .windows(2)
        .filter(|w| (w[0] >= 0.0) != (w[1] >= 0.0))
        .count();
    if b[0] > 0.0 && b[last] < -floor && changes == 1 {
        return Some(root(a, low, high, f64::EPSILON));
    }
    if depth == MAX_DEPTH {
        return Some(low);
    }
    let (left, right) = halves(b);
    let middle = 0.5 * (low + high);
    search(a, &left[..=last], floor, low, middle, depth + 1)
        .or_else(|| search(a, &right[..=last], floor, middle, high, depth + 1))
}

/// de Casteljau at the middle.
fn halves(b: &[f64]) -> (Coefficients, Coefficients) {
    let n = b.len() - 1;
    let mut work = [0.0; MAX_DEGREE + 1];
    work[..=n].copy_from_slice(b);
    let (mut left, mut right) = ([0.0; MAX_DEGREE + 1], [0.0; MAX_DEGREE + 1]);
    for level in 0..=n {
        left[level] = work[0];
        right[n - level] = work[n - level];
        for i in 0..n - level {
            work[i] = 0.5 * (work[i] + work[i + 1]);
        }
    }
    (left, right)
}

/// The root of p in [low, high], where p(low) > 0 > p(high), once it moves by no more than the part `close` of itself: Newton from the
/// chord's zero, bracketed.
fn root(a: &[f64], mut low: f64, mut high: f64, close: f64) -> f64 {
    /// Bisections alone reach rounding within this many steps.
    const STEPS: usize = 64;
    let (from, to) = (value(a, low), value(a, high));
    let mut s = low + (high - low) * (from / (from - to));
    for _ in 0..STEPS {
        let (p, slope) = value_and_slope(a, s);
        if p == 0.0 {
            break;
        }
        if p > 0.0 {
            low = s;
        } else {
            high = s;
        }
        let newton = s - p / slope;
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        let moved = (next - s).abs();
        s = next;
        if moved <= close * s {
            break;
        }
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Coefficients of Π (s − r).
    fn from_roots(roots: &[f64]) -> Vec<f64> {
        roots.iter().fold(vec![1.0], |p, &r| {
            let mut next = vec![0.0; p.len() + 1];
            for (k, c) in p.iter().enumerate() {
                next[k + 1] += c;
                next[k] -= r * c;
            }
            next
        })
    }

    #[test]
    fn single_root() {
        let s = first_crossing(&[0.3, -1.0], 1e-15).unwrap();
        assert!((s - 0.3).abs() < 1e-16);
        assert_eq!(first_crossing(&[0.3, -0.2], 1e-15), None);
    }

    #[test]
    fn a_cubic_is_judged_with_its_rest_and_solved() {
        // (s − 0.25)(s² + 1): values −0.25 and 1.5, slopes 1 and 3.5
        let a = [-0.25, 1.0, -0.25, 1.0];
        let s = zero_of_cubic([0.25, -1.5], [-1.0, -3.5]);
        assert!((s - 0.25).abs() < 1e-7);
        // What is left of further powers counts where s is large.
        let rising = [0.0, a[1], a[2], a[3]];
        assert!(cubic_holds(rising, 1.7, 0.0) && !cubic_holds(rising, 1.8, 0.0));
        assert!(!cubic_holds(a, 0.0, 0.2) && cubic_holds(a, 0.0, 0.3));
    }

    #[test]
    fn a_dip_between_positive_ends_is_found() {
        let p = from_roots(&[0.5, 0.5001]);
        let s = first_crossing(&p, 1e-15).unwrap();
        assert!((s - 0.5).abs() < 1e-11, "{s}");
    }

    #[test]
    fn a_contact_is_not_a_crossing() {
        let p = from_roots(&[0.37, 0.37]);
        assert_eq!(first_crossing(&p, 1e-15), None);
        let lifted: Vec<f64> = p
            .iter()
            .enumerate()
            .map(|(k, c)| if k == 0 { c + 1e-9 } else { *c })
            .collect();
        assert_eq!(first_crossing(&lifted, 1e-15), None);
    }

    #[test]
    fn leaving_zero_downwards_fires_at_once() {
        assert_eq!(first_crossing(&[0.0, -1.0, 0.2], 1e-15), Some(0.0));
        assert_eq!(first_crossing(&[0.0, 0.0, -1.0], 1e-15), Some(0.0));
        let s = first_crossing(&[0.0, 1.0, -2.0], 1e-15).unwrap();
        assert!((s - 0.5).abs() < 1e-15);
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), ..ProptestConfig::default() })]
        /// Against the known roots: p falls through its smallest root in (0, 1) of odd multiplicity.
        #[test]
        fn agrees_with_known_roots(mut roots in prop::collection::vec(-0.5_f64..1.5, 1..7)) {
            roots.sort_by(f64::total_cmp);
            prop_assume!(roots.windows(2).all(|w| w[1] - w[0] > 1e-2));
            prop_assume!(roots.iter().all(|r| r.abs() > 1e-2 && (r - 1.0).abs() > 1e-2));
            let mut p = from_roots(&roots);
            if value(&p, 0.0) < 0.0 {
                p.iter_mut().for_each(|c| *c = -*c);
            }
            let expected = roots.iter().copied().find(|&r| r > 0.0 && r < 1.0);
            match (first_crossing(&p, 1e-15), expected) {
                (Some(s), Some(r)) => prop_assert!((s - r).abs() < 1e-9, "{} {}", s, r),
                (found, wanted) => prop_assert_eq!(found, wanted),
            }
        }
    }
}
