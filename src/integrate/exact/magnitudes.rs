//! How large a mode's state can be, and what follows from it.

use super::flow::Flow;
use super::slaved::{Follower, Manifold, followers};
use crate::linalg::refill::refill;
use crate::settings::tolerances::events::SIMULTANEOUS;
use crate::settings::tolerances::exponentials::LEVEL;

/// Inspections after which the sizes of a mode are taken anew: what was large may have become small.
const USES: u32 = 64;
/// Derivatives looked at: g, g', g'', g'''.
pub(super) const ORDERS: usize = 4;

/// How large things were when a mode was last inspected closely.
#[derive(Debug, Clone, Default)]
pub(crate) struct Magnitudes {
    /// Amplitudes of w.
    pub(crate) sizes: Vec<f64>,
    /// Rounding of g and g' that comes of them.
    pub(crate) noise: Vec<f64>,
    /// The states that are small beside their amplitudes once they follow the others.
    pub(crate) followers: Vec<Follower>,
    /// Where they do: one manifold for each [level](LEVEL) of their ages, the fastest alone first, found when a guard asks for them.
    pub(crate) manifolds: Vec<Manifold>,
    /// How often it was enough to look at these since.
    uses: u32,
    /// What they were taken from.
    taken: Vec<f64>,
    work: Vec<f64>,
}

impl Magnitudes {
    /// How long it takes until the states of one of the manifolds follow, s.
    pub(super) fn age_of(&self, manifold: &Manifold) -> f64 {
        let slowest = manifold.len().checked_sub(1);
        let slowest = slowest.and_then(|k| self.followers.get(k));
        slowest.map_or(0.0, |follower| follower.age)
    }

    /// Takes them from |w| ≤ `sizes`, of which `waves` raises those of the sources to what they come back to. The same sizes make the same.
    pub(super) fn take(&mut self, flow: &Flow, sizes: &[f64], waves: impl Fn(&mut [f64])) {
        self.uses = 0;
        if self.taken == sizes {
            return;
        }
        refill(&mut self.taken, sizes);
        refill(&mut self.sizes, sizes);
        waves(&mut self.sizes[flow.states()..]);
        flow.noise(&self.sizes, &mut self.noise);
        self.find_followers(flow);
    }

    /// Whether w is of no other size than it was.
    pub(super) fn cover(&mut self, sizes: &[f64]) -> bool {
        self.uses += 1;
        let mut pairs = sizes.iter().zip(&self.sizes);
        self.uses < USES && self.sizes.len() == sizes.len() && pairs.all(|(now, then)| now <= then)
    }

    /// Whether all guards g are positive by more than their noise and what the resolution of the time leaves of them.
    pub(super) fn clear(&self, g: &[f64], drift: impl Fn(usize) -> f64) -> bool {
        let mut guards = g.iter().zip(&self.noise).enumerate();
        guards.all(|(i, (g, noise))| *g > SIMULTANEOUS * noise + drift(i))
    }

    /// Finds which states follow the others.
    fn find_followers(&mut self, flow: &Flow) {
        self.followers.clear();
        flow.sizes_of_rates(&self.sizes, &mut self.work);
        let generator = flow.generator();
        // A bound of the first sweep that needs no look at single entries.
        let may = |j: usize| self.work[j] < 2.0 * generator[(j, j)].abs() * self.sizes[j];
        if (0..flow.states()).any(may) {
            let found = &mut self.followers;
            followers(generator, flow.states(), &self.sizes, found);
        }
    }

    /// Whether a guard sees a state that follows others.
    pub(super) fn is_slaved(&self, flow: &Flow, guard: usize) -> bool {
        let row = flow.guard_row(guard);
        self.followers.iter().any(|f| row[f.component] != 0.0)
    }

    /// Finds the manifolds of the states that follow others.
    pub(super) fn find_manifolds(&mut self, flow: &Flow) {
        let faster = |k: usize| &self.followers[..k];
        let ages = self.followers.windows(2).enumerate();
        let apart = ages.filter(|(_, pair)| pair[1].age > LEVEL * pair[0].age);
        let mut levels: Vec<usize> = apart.map(|(k, _)| k + 1).collect();
        levels.extend((!self.followers.is_empty()).then_some(self.followers.len()));
        let mut known = self.manifolds.iter().zip(&levels);
        if self.manifolds.len() == levels.len() && known.all(|(m, &k)| m.is_of(faster(k))) {
            return;
        }
        let guards = flow.guard_matrix();
        let manifold = |&k: &usize| {
            let components: Vec<usize> = faster(k).iter().map(|f| f.component).collect();
            let guards = (&guards, flow.sizes());
            Manifold::new(flow.generator(), guards, &components, ORDERS)
        };
        self.manifolds = levels.iter().filter_map(manifold).collect();
    }
}
