//! States that follow the others within no time: a current that decays with L/Roff, a voltage behind a small resistance.
//!
//! For component j of w' = 𝒜 w with d = −𝒜_jj > 0
//!
//! ```text
//! |w_j(t)| ≤ e^{−dt} |w_j(0)| + Σ_{k ≠ j} |𝒜_jk| |w_k| / d,
//! ```
//!
//! and an error of w obeys the same. Several of them, F, that push each other decay together: with D = diag(d) and u, v from
//!
//! ```text
//! (D − |𝒜_FF + D|) [u, v] = [|𝒜_FS| |w_S|, D |w_F(0)|]:   |w_F(t)| ≤ v e^{−μt} + u,   μ = min_j d_j |w_j(0)| / v_j,
//! ```
//!
//! wherever v > 0 exists (M-matrices; A. Berman, R. J. Plemmons, "Nonnegative Matrices in the Mathematical Sciences", ch. 6): windings
//! with little leakage behind a Roff each. Once the remainder has decayed, the rounding of a guard with Roff·i in it is that of the
//! voltages which i follows, and not Roff times that of the largest current of the run. With F the components that follow and S the
//! others, w_F = K w_S with 𝒜_FF K + 𝒜_FS = K (𝒜_SS + 𝒜_SF K), and on that manifold w_S' = (𝒜_SS + 𝒜_SF K) w_S: where the difference
//! from it is rounding, the sign of a guard is that of its value there, of its derivative there, and so on. K comes from −𝒜_FF⁻¹ 𝒜_FS,
//! which is right to the ratio of the rates: the current of a capacitor behind a small resistance is all that it leaves out.

use nalgebra::DMatrix;

use super::map::{Map, Sizes};
use crate::linalg::levelled::Levelled;
use crate::settings::tolerances::exponentials::{
    FORGOTTEN, LEAST_PART, LEVEL, MOST_COUPLED, SHRINKS, SLAVED,
};

/// Sweeps towards the invariant manifold; each gains the ratio of the rates.
const INVARIANT: usize = 2;

/// Sweeps over the components that follow each other.
const SWEEPS: usize = 64;

/// A component that follows others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Follower {
    /// Its index in w.
    pub(crate) component: usize,
    /// How large it is then.
    pub(crate) size: f64,
    /// How long after a change of mode, s.
    pub(crate) age: f64,
}

/// The components of w = [x; z] that follow the others where |w| ≤ `sizes`; `n` states come first. The fastest first.
pub(crate) fn followers(
    generator: &DMatrix<f64>,
    n: usize,
    sizes: &[f64],
    found: &mut Vec<Follower>,
) {
    found.clear();
    let mut settled: Option<Vec<f64>> = None;
    for _ in 0..SWEEPS {
        let mut shrunk = false;
        for j in 0..n {
            let decay = -generator[(j, j)];
            if decay <= 0.0 || sizes[j] == 0.0 {
                continue;
            }
            let known = settled.as_deref().unwrap_or(sizes);
            let size = coupled(generator, j, known, |_| true) / decay;
            if size < SHRINKS * known[j] {
                settled.get_or_insert_with(|| sizes.to_vec())[j] = size;
                shrunk = true;
            }
        }
        if !shrunk {
            break;
        }
    }
    if let Some(settled) = settled {
        let slaved = |j: usize| j < n && settled[j] <= SLAVED * sizes[j];
        for j in (0..n).filter(|&j| slaved(j)) {
            let decay = -generator[(j, j)];
            let part = coupled(generator, j, sizes, slaved) / (decay * sizes[j]);
            if part <= MOST_COUPLED {
                found.push(Follower {
                    component: j,
                    size: settled[j],
                    age: FORGOTTEN / (decay * (1.0 - part)),
                });
            }
        }
    }
    find_joint(generator, n, sizes, found);
    found.sort_by(|a, b| a.age.total_cmp(&b.age));
}

/// Adds what follows the others together with what decays as fast or faster, where one by one it does not.
fn find_joint(generator: &DMatrix<f64>, n: usize, sizes: &[f64], found: &mut Vec<Follower>) {
    let decay = |j: usize| -generator[(j, j)];
    let decays = |&j: &usize| decay(j) > 0.0 && sizes[j] > 0.0;
    let mut order: Vec<usize> = (0..n).filter(decays).collect();
    order.sort_by(|&a, &b| decay(b).total_cmp(&decay(a)));
    for end in 1..=order.len() {
        let next = order.get(end).map_or(0.0, |&j| decay(j));
        if decay(order[end - 1]) <= LEVEL * next {
            continue;
        }
        let joint = &order[..end];
        let is_known = |j: &usize| found.iter().any(|f| f.component == *j);
        if joint.iter().all(is_known) {
            continue;
        }
        let outside = |k: usize| !joint.contains(&k);
        let pushed = |&j: &usize| coupled(generator, j, sizes, outside);
        if joint
            .iter()
            .any(|j| pushed(j) > SLAVED * decay(*j) * sizes[*j])
        {
            return;
        }
        let Some((settled, slowest)) = settle_jointly(generator, joint, sizes, pushed) else {
            return;
        };
        let ages = joint.iter().zip(&settled);
        let new = ages.filter(|(j, size)| !is_known(j) && **size <= SLAVED * sizes[**j]);
        let new: Vec<Follower> = new
            .map(|(&component, &size)| Follower {
                component,
                size,
                age: FORGOTTEN / slowest,
            })
            .collect();
        found.extend(new);
    }
}

/// How large components F are once they follow the others, and the rate μ, 1/s, at which they come to do so.
fn settle_jointly(
    generator: &DMatrix<f64>,
    joint: &[usize],
    sizes: &[f64],
    pushed: impl Fn(&usize) -> f64,
) -> Option<(Vec<f64>, f64)> {
    let count = joint.len();
    let decay = |row: usize| -generator[(joint[row], joint[row])];
    let own = DMatrix::from_fn(count, count, |i, j| {
        if i == j {
            decay(i)
        } else {
            -generator[(joint[i], joint[j])].abs()
        }
    });
    let known = DMatrix::from_fn(count, 2, |i, column| {
        if column == 0 {
            pushed(&joint[i])
        } else {
            decay(i) * sizes[joint[i]]
        }
    });
    let solved = Levelled::new(&own).solve(known)?;
    let size = |row: usize| sizes[joint[row]];
    let weight = |row: usize| solved[(row, 1)];
    let bounds = |row: usize| weight(row) > 0.0 && size(row) >= LEAST_PART * weight(row);
    (0..count).all(bounds).then(|| {
        let rates = (0..count).map(|row| decay(row) * size(row) / weight(row));
        let settled = solved.column(0).iter().copied().collect();
        (settled, rates.fold(f64::INFINITY, f64::min))
    })
}

/// Σ_{k ≠ j} |𝒜_jk| sizes_k over these k.
fn coupled(
    generator: &DMatrix<f64>,
    j: usize,
    sizes: &[f64],
    which: impl Fn(usize) -> bool,
) -> f64 {
    let row = generator.row(j);
    let others = row.iter().zip(sizes).enumerate();
    let others = others.filter(|&(k, (a, _))| *a != 0.0 && k != j && which(k));
    others.map(|(_, (a, size))| a.abs() * size).sum()
}

/// Guards on the manifold on which some components follow the others.
#[derive(Debug, Clone)]
pub(crate) struct Manifold {
    /// F, and by component of w whether it is of F.
    followers: Vec<usize>,
    follows: Vec<bool>,
    /// w_F = K w_S, over all of w.
    slaves: DMatrix<f64>,
    /// The rate of w_F − K w_S over w, by row in units of the follower's decay −𝒜_jj: zero to rounding where w stays there.
    drift: DMatrix<f64>,
    /// |𝒜_FF|, by row in the same units.
    own: DMatrix<f64>,
    /// Guards over w_S and below them their derivatives, as many as there are orders, once w was on it.
    jets: Option<Map>,
}

impl Manifold {
    /// That of these components; `None` where they do not follow (𝒜_FF is singular).
    pub(crate) fn new(generator: &DMatrix<f64>, followers: &[usize]) -> Option<Self> {
        let dim = generator.nrows();
        let follows: Vec<bool> = (0..dim).map(|j| followers.contains(&j)).collect();
        let mut fast = generator.select_rows(followers);
        let own = fast.select_columns(followers);
        for &j in followers {
            fast.column_mut(j).fill(0.0);
        }
        let inverse = Levelled::new(&own);
        let mut slaves = -inverse.solve(fast.clone())?;
        for _ in 0..INVARIANT {
            let moves = &slaves * restricted(generator, followers, &slaves);
            slaves = inverse.solve(moves - &fast)?;
        }
        let mut drift = generator.select_rows(followers) - &slaves * generator;
        let mut own = own.abs();
        for (k, &j) in followers.iter().enumerate() {
            drift.row_mut(k).unscale_mut(-generator[(j, j)]);
            own.row_mut(k).unscale_mut(-generator[(j, j)]);
        }
        Some(Self {
            followers: followers.to_vec(),
            follows,
            slaves,
            drift,
            own,
            jets: None,
        })
    }

    /// Finds the guards on it and their derivatives, as many as there are orders; whether they are finite. Most manifolds are never met: one
    /// that w is on alone needs them.
    pub(crate) fn find_jets(
        &mut self,
        generator: &DMatrix<f64>,
        (guards, sizes): (&DMatrix<f64>, &Sizes),
        orders: usize,
    ) -> bool {
        let (followers, slaves) = (&self.followers, &self.slaves);
        let magnitudes = slaves.abs();
        let added = |rows: &DMatrix<f64>, sizes: &DMatrix<f64>| {
            let mut added = sizes + rows.select_columns(followers).abs() * &magnitudes;
            for &j in followers {
                added.column_mut(j).fill(0.0);
            }
            added
        };
        let slow = |rows: &DMatrix<f64>| restricted(rows, followers, slaves);
        let sizes = Sizes {
            guards: added(guards, &sizes.guards),
            summed: added(generator, &sizes.summed),
        };
        let (jets, whole) = sizes.jets(&slow(guards), &slow(generator), orders);
        let finite = jets.iter().all(|v| v.is_finite());
        self.jets = finite.then(|| Map::with_sizes(&jets, &whole));
        finite
    }

    /// Whether [`Self::find_jets`] has found them.
    pub(crate) fn has_jets(&self) -> bool {
        self.jets.is_some()
    }

    /// Whether it is that of these components.
    pub(crate) fn is_of(&self, followers: &[Follower]) -> bool {
        followers.len() == self.followers.len()
            && followers.iter().all(|f| self.follows[f.component])
    }

    /// Whether w is on it and stays there, up to this part of the sizes of its components and what each is not `known` to besides, if
    /// anything: a quantity that passes zero may be the difference from the manifold itself, and then its rate is none of the manifold's.
    pub(crate) fn holds(&self, w: &[f64], sizes: &[f64], rounding: f64, known: &[f64]) -> bool {
        let near = |(k, &j): (usize, &usize)| {
            let row = self.slaves.row(k).into_iter().zip(sizes);
            let size = row.fold(sizes[j], |whole, (s, size)| whole + (s * size).abs());
            rounding * size + known.get(j).map_or(0.0, |known| known.abs())
        };
        let over =
            |row: &DMatrix<f64>, k| row.row(k).iter().zip(w).map(|(a, w)| a * w).sum::<f64>();
        let mut followers = self.followers.iter().enumerate();
        if !followers.all(|(k, &j)| (w[j] - over(&self.slaves, k)).abs() <= near((k, &j))) {
            return false;
        }
        let near: Vec<f64> = self.followers.iter().enumerate().map(near).collect();
        (0..near.len()).all(|k| {
            // Those that are off push each other.
            let pushed: f64 = self.own.row(k).iter().zip(&near).map(|(a, n)| a * n).sum();
            over(&self.drift, k).abs() <= pushed
        })
    }

    /// Number of components that follow.
    pub(crate) fn len(&self) -> usize {
        self.followers.len()
    }

    /// Whether a guard with these entries over w sees a component that follows.
    pub(crate) fn is_seen_by(&self, guard: &[f64]) -> bool {
        self.followers.iter().any(|&j| guard[j] != 0.0)
    }

    /// The guards and their derivatives on it at w, and the sums of the magnitudes they come from.
    pub(crate) fn jets(
        &self,
        w: &[f64],
        sizes: &[f64],
        values: &mut Vec<f64>,
        whole: &mut Vec<f64>,
    ) {
        if let Some(jets) = &self.jets {
            jets.values(w, values);
            jets.largest(sizes, whole);
        }
    }
}

/// Rows over w on the manifold w_F = K w_S, over w_S.
fn restricted(rows: &DMatrix<f64>, followers: &[usize], slaves: &DMatrix<f64>) -> DMatrix<f64> {
    let mut slow = rows + rows.select_columns(followers) * slaves;
    for &j in followers {
        slow.column_mut(j).fill(0.0);
    }
    slow
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Those of entries that are no sums.
    fn sizes(guards: &DMatrix<f64>) -> Sizes {
        Sizes {
            guards: guards.abs(),
            summed: DMatrix::zeros(guards.ncols(), guards.ncols()),
        }
    }

    /// The manifold of these components with the jets of a guard.
    fn met(
        generator: &DMatrix<f64>,
        guard: &DMatrix<f64>,
        of: &[usize],
        orders: usize,
    ) -> Manifold {
        let mut manifold = Manifold::new(generator, of).unwrap();
        assert!(manifold.find_jets(generator, (guard, &sizes(guard)), orders));
        manifold
    }

    fn of(generator: &DMatrix<f64>, n: usize, sizes: &[f64]) -> Vec<Follower> {
        let mut found = Vec::new();
        followers(generator, n, sizes, &mut found);
        found
    }

    /// L i' = v − Roff i beside a capacitor and a source.
    #[test]
    fn a_current_into_a_large_resistance_follows_its_voltage() {
        let (l, roff, c, r) = (1e-3, 1e16, 1e-6, 10.0);
        let mut a = DMatrix::zeros(3, 3);
        a[(0, 0)] = -roff / l;
        a[(0, 1)] = -1.0 / l;
        a[(0, 2)] = 1.0 / l;
        a[(1, 1)] = -1.0 / (r * c);
        let found = of(&a, 2, &[10.0, 5.0, 3.0]);
        // The capacitor discharges, slower.
        assert_eq!(found.len(), 2);
        assert!((found[1].component, found[1].size) == (1, 0.0));
        let Follower {
            component,
            size,
            age,
        } = found[0];
        assert_eq!(component, 0);
        assert!((size * roff / 3.0 - 1.0).abs() < 1e-12, "{size}");
        assert!((age * roff / l / 100.0 - 1.0).abs() < 1e-12, "{age}");
        // A current that is small anyway.
        let small = of(&a, 2, &[1e-15, 5.0, 3.0]);
        assert!(small.iter().all(|follower| follower.component == 1));
    }

    /// v − Roff i falls through zero with v: the signs of g, g', … there are those of v alone.
    #[test]
    fn a_guard_on_the_manifold_is_that_of_the_voltage() {
        let (l, roff) = (1e-3, 1e16);
        let mut a = DMatrix::zeros(3, 3);
        a[(0, 0)] = -roff / l;
        a[(0, 1)] = 1.0 / l;
        a[(1, 2)] = 314.0;
        a[(2, 1)] = -314.0;
        let guard = DMatrix::from_row_slice(1, 3, &[roff, 0.0, 0.0]);
        let manifold = met(&a, &guard, &[0], 3);
        let (w, sizes) = ([1e-17, 1e-20, 5.0], [10.0, 5.0, 5.0]);
        assert!(manifold.holds(&w, &sizes, 1e-14, &[]));
        assert!(!manifold.holds(&[1e-12, 0.0, 5.0], &sizes, 1e-14, &[]));
        let (mut values, mut whole) = (Vec::new(), Vec::new());
        manifold.jets(&w, &sizes, &mut values, &mut whole);
        // v − τ v' + τ² v'' … with τ = L/Roff.
        let (tau, v, slope) = (l / roff, 1e-20, 314.0 * 5.0);
        let expected = [v - tau * slope, slope, -314.0 * 314.0 * (v - tau * slope)];
        for (found, expected) in values.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        }
        assert!((whole[0] / 5.0 - 1.0).abs() < 1e-12 && manifold.is_seen_by(&[roff, 0.0, 0.0]));
    }

    /// A capacitor behind a small resistance follows a voltage that falls: what it gives back passes the resistance.
    #[test]
    fn on_the_manifold_a_capacitor_has_a_current() {
        let (fast, slow) = (1e12, 1e5);
        let a = DMatrix::from_row_slice(2, 2, &[-fast, fast, 0.0, -slow]);
        let guard = DMatrix::from_row_slice(1, 2, &[1.0, -1.0]);
        let manifold = met(&a, &guard, &[0], 2);
        let (mut values, mut whole) = (Vec::new(), Vec::new());
        manifold.jets(&[5.0, 5.0], &[5.0, 5.0], &mut values, &mut whole);
        let expected = 5.0 * slow / (fast - slow);
        assert!(
            (values[0] / expected - 1.0).abs() < 1e-6,
            "{values:?} {expected}"
        );
    }

    /// Two currents decay with rates of one size, i₁ towards −i₀/2, and the guard is their difference from that: where it passes zero
    /// its rate is none of the manifold's.
    #[test]
    fn what_passes_through_the_manifold_is_not_on_it() {
        let a = DMatrix::from_row_slice(2, 2, &[-33.0, -33.0, -33.0, -66.0]);
        let guard = DMatrix::from_row_slice(1, 2, &[-10.0, -20.0]);
        let manifold = met(&a, &guard, &[1], 3);
        assert!(!manifold.holds(&[-0.24, 0.12], &[0.53, 0.53], 1e-14, &[]));
    }

    #[test]
    fn currents_that_decay_together_follow_together() {
        // Two legs of a star behind Roff each.
        let rate = 1e15;
        let a = DMatrix::from_row_slice(2, 3, &[-2.0 * rate, rate, 1e3, rate, -2.0 * rate, 1e3]);
        let found = of(&a, 2, &[10.0, 10.0, 300.0]);
        assert_eq!(found.len(), 2);
        for follower in found {
            let size = follower.size / (1e3 * 300.0 / rate);
            assert!((0.99..2.0).contains(&size), "{size}");
            assert!((follower.age * rate / 100.0 - 1.0).abs() < 1e-12);
        }
        // A ring of two that only oscillates follows nothing.
        let a = DMatrix::from_row_slice(2, 2, &[-1.0, 1e3, -1e3, -1.0]);
        assert!(of(&a, 2, &[1.0, 1.0]).is_empty());
        // Their difference lives on: neither follows.
        let a = DMatrix::from_row_slice(2, 2, &[-rate, rate, rate, -rate]);
        assert!(of(&a, 2, &[1.0, 1.0]).is_empty());
    }

    /// Row sums are no bound where 1 % of leakage or unlike sizes are all that tells two rates from each other.
    #[test]
    fn windings_with_little_leakage_follow_together() {
        let (rate, k) = (1e18, 0.99);
        let a = DMatrix::from_row_slice(2, 3, &[-rate, k * rate, 1e3, k * rate, -rate, 1e3]);
        for sizes in [[1.0, 1.0, 5.0], [1.0, 0.1, 5.0]] {
            let found = of(&a, 2, &sizes);
            assert_eq!(found.len(), 2, "{sizes:?}");
            for follower in found {
                assert!((1e-13..1e-12).contains(&follower.size), "{follower:?}");
                // The slower rate is (1 − k) · rate.
                let constants = follower.age * (1.0 - k) * rate;
                assert!((99.0..2000.0).contains(&constants), "{follower:?}");
            }
        }
        // With no leakage at all there is nothing that tells them.
        let lives_on = DMatrix::from_row_slice(2, 2, &[-rate, rate, rate, -rate]);
        assert!(of(&lives_on, 2, &[1.0, 0.95]).is_empty());
    }
}
