//! A smooth piece of a waveform as the polynomial through values at instants that are equally far apart.

use crate::linalg::gauss::{NODES, WEIGHTS};
use crate::settings::tolerances::periodic::EXTREMUM;

/// Intervals between the values of a curve.
pub(crate) const INTERVALS: usize = 8;
/// Its values.
pub(crate) const VALUES: usize = INTERVALS + 1;
/// Of the polynomial through values at x = 0 … 8 in its barycentric form: (−1)^j 8!/(j! (8 − j)!).
const BARYCENTRIC: [f64; VALUES] = [1.0, -8.0, 28.0, -56.0, 70.0, -56.0, 28.0, -8.0, 1.0];
/// 8!: l_j(x) = [`BARYCENTRIC`]_j Π_{i ≠ j} (x − i) / 8!.
const PRODUCT: f64 = 40320.0;
/// By j the slopes of l_j at x = i.
const SLOPES: [[f64; VALUES]; VALUES] = slopes();
/// By j what l_j is at the nodes of Gauss and Legendre.
const AT_NODES: [[f64; NODES.len()]; VALUES] = at_nodes();
/// ∫ over its length by Newton and Cotes, exact up to degree 9.
const COTES: [f64; VALUES] = [
    989.0, 5888.0, -928.0, 10496.0, -4540.0, 10496.0, -928.0, 5888.0, 989.0,
];
const COTES_SUM: f64 = 28350.0;

const fn slopes() -> [[f64; VALUES]; VALUES] {
    let mut all = [[0.0; VALUES]; VALUES];
    let mut i = 0;
    while i < VALUES {
        let mut j = 0;
        while j < VALUES {
            if j != i {
                let slope = BARYCENTRIC[j] / BARYCENTRIC[i] / (i as f64 - j as f64);
                all[j][i] = slope;
                all[i][i] -= slope;
            }
            j += 1;
        }
        i += 1;
    }
    all
}

const fn at_nodes() -> [[f64; NODES.len()]; VALUES] {
    let mut all = [[0.0; NODES.len()]; VALUES];
    let mut i = 0;
    while i < NODES.len() {
        let (mut sum, mut j) = (0.0, 0);
        while j < VALUES {
            all[j][i] = BARYCENTRIC[j] / (NODES[i] * INTERVALS as f64 - j as f64);
            sum += all[j][i];
            j += 1;
        }
        while j > 0 {
            j -= 1;
            all[j][i] /= sum;
        }
        i += 1;
    }
    all
}

/// A smooth piece of a waveform: the polynomial of degree 8 through its values at begin + s length, s = 0, 1/8 … 1, up to s = `until`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve {
    /// Where it begins, s.
    pub begin: f64,
    /// Between the first and the last value, s.
    pub length: f64,
    /// The part of its length that belongs to the waveform, 0 < `until` ≤ 1.
    pub until: f64,
    /// The values.
    pub values: [f64; VALUES],
}

/// Σ_j l_j(s) y_j, l_j the polynomials of Lagrange; of constant values it is that constant.
pub(crate) fn interpolated(values: &[f64; VALUES], s: f64) -> f64 {
    if let Some(y) = on_a_value(s * INTERVALS as f64) {
        return values[y];
    }
    let terms = values.iter().zip(basis(s));
    values[0] + terms.map(|(y, part)| part * (y - values[0])).sum::<f64>()
}

/// y_0 + Σ_j (y_j − y_0) row_j.
pub(super) fn blended<const N: usize>(
    values: &[f64; VALUES],
    rows: &[[f64; N]; VALUES],
) -> [f64; N] {
    offs(values, rows).map(|off| values[0] + off)
}

/// Σ_j (y_j − y_0) row_j.
fn offs<const N: usize>(values: &[f64; VALUES], rows: &[[f64; N]; VALUES]) -> [f64; N] {
    let mut sums = [0.0; N];
    for (y, row) in values.iter().zip(rows) {
        let off = y - values[0];
        sums.iter_mut()
            .zip(row)
            .for_each(|(sum, part)| *sum += part * off);
    }
    sums
}

/// By j what l_j is at s = 0, `until`/8 … `until`.
pub(super) fn cut(until: f64) -> [[f64; VALUES]; VALUES] {
    let mut rows = [[0.0; VALUES]; VALUES];
    for k in 0..VALUES {
        let own = basis(until * k as f64 / INTERVALS as f64);
        rows.iter_mut()
            .zip(own)
            .for_each(|(row, part)| row[k] = part);
    }
    rows
}

/// The value at x intervals from the first one, where there is one.
fn on_a_value(x: f64) -> Option<usize> {
    let j = x as usize;
    (x == j as f64 && j < VALUES).then_some(j)
}

/// l_j(s), j = 0 … 8: Σ l_j(s) y_j is the polynomial's value.
pub(crate) fn basis(s: f64) -> [f64; VALUES] {
    let x = s * INTERVALS as f64;
    if let Some(own) = on_a_value(x) {
        return std::array::from_fn(|j| f64::from(u8::from(j == own)));
    }
    // Those before it from the left, then those behind it from the right.
    let mut product = 1.0;
    let mut own: [f64; VALUES] = std::array::from_fn(|j| {
        let before = product;
        product *= x - j as f64;
        before
    });
    product = 1.0;
    for (j, own) in own.iter_mut().enumerate().rev() {
        *own *= product * (BARYCENTRIC[j] / PRODUCT);
        product *= x - j as f64;
    }
    own
}

/// The first, second … derivatives of l_j at s.
pub(super) fn basis_slopes(s: f64, order: usize) -> [f64; VALUES] {
    let mut own = basis(s);
    for _ in 0..order {
        let mut slopes = [0.0; VALUES];
        for (i, value) in own.iter().enumerate() {
            for (j, slope) in slopes.iter_mut().enumerate().filter(|(j, _)| *j != i) {
                let off = i as f64 - j as f64;
                let part = INTERVALS as f64 * BARYCENTRIC[j] / BARYCENTRIC[i] / off * value;
                *slope += part;
            }
            let own: f64 = (0..VALUES)
                .filter(|j| *j != i)
                .map(|j| BARYCENTRIC[j] / BARYCENTRIC[i] / (i as f64 - j as f64))
                .sum();
            slopes[i] -= INTERVALS as f64 * own * value;
        }
        own = slopes;
    }
    own
}

impl Curve {
    /// Where it ends as a part of the waveform, s.
    #[must_use]
    pub fn end(&self) -> f64 {
        self.time(self.until)
    }

    pub(super) fn time(&self, s: f64) -> f64 {
        self.begin + s * self.length
    }

    /// Where on it a time is.
    pub(super) fn place(&self, t: f64) -> f64 {
        ((t - self.begin) / self.length).clamp(0.0, self.until)
    }

    /// Its value at s.
    pub(super) fn at(&self, s: f64) -> f64 {
        interpolated(&self.values, s)
    }

    /// dy/ds at the instants of its values.
    fn slopes(&self) -> [f64; VALUES] {
        offs(&self.values, &SLOPES).map(|slope| INTERVALS as f64 * slope)
    }

    /// dy/dt at s.
    pub(super) fn slope(&self, s: f64) -> f64 {
        interpolated(&self.slopes(), s) / self.length
    }

    /// ∫ f(y) ds from `low` to `high` by Gauss and Legendre, exact up to degree 15; f(y, s) with s from −1 to 1.
    pub(super) fn gauss(&self, (low, high): (f64, f64), f: impl Fn(f64, f64) -> f64) -> f64 {
        let values = if (low, high) == (0.0, 1.0) {
            blended(&self.values, &AT_NODES)
        } else {
            NODES.map(|x| self.at(low + (high - low) * x))
        };
        let points = NODES.iter().zip(WEIGHTS).zip(values);
        let terms = points.map(|((x, weight), y)| weight * f(y, 2.0 * x - 1.0));
        (high - low) * terms.sum::<f64>()
    }

    /// ∫ y ds from `low` to `high`.
    pub(super) fn integral(&self, (low, high): (f64, f64)) -> f64 {
        if (low, high) != (0.0, 1.0) {
            return self.gauss((low, high), |y, _| y);
        }
        let terms = self.values.iter().zip(COTES);
        let terms = terms.map(|(y, weight)| weight / COTES_SUM * (y - self.values[0]));
        self.values[0] + terms.sum::<f64>()
    }

    /// Visits the curve from `low` to `high` where it has its ends, values and extrema: it is monotone from each of these to the next.
    pub(super) fn corners(&self, (low, high): (f64, f64), mut see: impl FnMut(f64, f64)) {
        see(low, self.at(low));
        let slopes = self.slopes();
        let size = self.values.iter().fold(0.0, |m: f64, y| m.max(y.abs()));
        let mut inside = |s: f64, y: f64| {
            if s > low && s < high {
                see(s, y);
            }
        };
        for i in 0..INTERVALS {
            let [a, b] = [i, i + 1].map(|k| k as f64 / INTERVALS as f64);
            if b <= low || a >= high {
                continue;
            }
            inside(a, self.values[i]);
            let (left, right) = (slopes[i], slopes[i + 1]);
            let reach = (b - a) * left.abs().max(right.abs());
            if left * right < 0.0 && reach > EXTREMUM * size {
                let s = zero((a, left), b, |s| interpolated(&slopes, s));
                inside(s, self.at(s));
            }
        }
        see(high, self.at(high));
    }

    /// Where it meets a level between two places, of which the first one lies `above` it by so much, and the second one not on that side.
    pub(super) fn meets(&self, level: f64, (from, above): (f64, f64), to: f64) -> f64 {
        zero((from, above), to, |s| self.at(s) - level)
    }

    /// Its halves.
    pub(crate) fn halved(values: &[f64; VALUES]) -> [[f64; VALUES]; 2] {
        let at = |k: usize| interpolated(values, k as f64 / (2 * INTERVALS) as f64);
        [0, INTERVALS].map(|from| std::array::from_fn(|j| at(from + j)))
    }
}

/// Where f, which has this value at a, and another sign at b, passes zero: by the secant where it brackets, else halved.
fn zero((mut a, mut low): (f64, f64), mut b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let mut high = f(b);
    // What lies on zero is passed there.
    if high == 0.0 || low == 0.0 {
        return if low == 0.0 { a } else { b };
    }
    for _ in 0..2 * f64::MANTISSA_DIGITS {
        if (b - a).abs() <= f64::EPSILON {
            break;
        }
        let secant = a + (b - a) * (low / (low - high));
        let middle = if secant > a && secant < b {
            secant
        } else {
            0.5 * (a + b)
        };
        let between = f(middle);
        if between == 0.0 {
            return middle;
        }
        // The end that stays counts half next time (Illinois).
        if (between < 0.0) == (low < 0.0) {
            (a, low) = (middle, between);
            high *= 0.5;
        } else {
            (b, high) = (middle, between);
            low *= 0.5;
        }
    }
    if low.abs() < high.abs() { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(f: impl Fn(f64) -> f64, until: f64) -> Curve {
        Curve {
            begin: 2.0,
            length: 0.5,
            until,
            values: std::array::from_fn(|k| f(k as f64 / 8.0)),
        }
    }

    #[test]
    fn polynomials_are_kept() {
        let of = |s: f64| 1.0 + s - 3.0 * s.powi(4) + 2.0 * s.powi(8);
        let own = curve(of, 0.9);
        for k in 0..=90 {
            let s = f64::from(k) / 100.0;
            assert!((own.at(s) - of(s)).abs() < 1e-13, "{s}");
            let slope = 1.0 - 12.0 * s.powi(3) + 16.0 * s.powi(7);
            assert!((0.5 * own.slope(s) - slope).abs() < 1e-11, "{s}");
        }
        let primitive = |s: f64| s + 0.5 * s * s - 0.6 * s.powi(5) + 2.0 / 9.0 * s.powi(9);
        assert!((own.integral((0.0, 1.0)) - primitive(1.0)).abs() < 1e-14);
        assert!((own.integral((0.2, 0.9)) - primitive(0.9) + primitive(0.2)).abs() < 1e-14);
        let [first, second] = Curve::halved(&own.values);
        assert!((first[3] - of(3.0 / 16.0)).abs() < 1e-14);
        assert!((second[5] - of(13.0 / 16.0)).abs() < 1e-14);
        assert_eq!(own.end(), 2.45);
    }

    #[test]
    fn a_part_is_the_same_polynomial_through_other_values() {
        let of = |s: f64| 1.0 + s - 3.0 * s.powi(4) + 2.0 * s.powi(8);
        for until in [1.0, 0.9, 0.37, 1e-3] {
            let own = curve(of, 1.0);
            let part = Curve {
                length: own.length * until,
                values: blended(&own.values, &cut(until)),
                ..own
            };
            for k in 0..=20 {
                let s = f64::from(k) / 20.0;
                assert!((part.at(s) - of(until * s)).abs() < 1e-13, "{until} {s}");
            }
            let whole = own.length * own.integral((0.0, until));
            assert!((part.length * part.integral((0.0, 1.0)) - whole).abs() < 1e-15);
        }
    }

    #[test]
    fn constants_stay_what_they_are() {
        let own = curve(|_| 0.3, 1.0);
        assert_eq!(own.at(0.77), 0.3);
        assert_eq!(own.integral((0.0, 1.0)), 0.3);
        own.corners((0.0, 1.0), |_, y| assert_eq!(y, 0.3));
    }

    #[test]
    fn extrema_and_crossings_of_a_sine() {
        let own = curve(|s| (3.0 * s - 0.5).sin(), 1.0);
        let mut most = (0.0, f64::MIN);
        own.corners((0.0, 1.0), |s, y| {
            if y > most.1 {
                most = (s, y);
            }
        });
        assert!((most.1 - 1.0).abs() < 1e-6 && (most.0 - 0.690_265_442).abs() < 1e-3);
        let s = own.meets(0.0, (0.0, own.at(0.0)), 0.5);
        assert!((s - 0.5 / 3.0).abs() < 1e-6);
    }
}
