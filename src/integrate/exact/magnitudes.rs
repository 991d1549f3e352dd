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

    /// Which of the manifolds w is on, as far as this `holds`: that of the most states that follow. Its jets are known then.
    pub(super) fn settle(
        &mut self,
        flow: &Flow,
        holds: impl Fn(&Manifold) -> bool,
    ) -> Option<usize> {
        self.find_manifolds(flow);
        let mut most_first = self.manifolds.iter_mut().enumerate().rev();
        most_first.find_map(|(at, manifold)| {
            let met = holds(manifold)
                && (manifold.has_jets() || {
                    let guards = (&flow.guard_matrix(), flow.sizes());
                    manifold.find_jets(flow.generator(), guards, ORDERS)
                });
            met.then_some(at)
        })
    }

    /// Finds the manifolds of the states that follow others.
    fn find_manifolds(&mut self, flow: &Flow) {
        let followers = &self.followers;
        let ages = followers.windows(2).enumerate();
        let apart = ages.filter(|(_, pair)| pair[1].age > LEVEL * pair[0].age);
        let last = (!followers.is_empty()).then_some(followers.len());
        let levels = apart.map(|(k, _)| k + 1).chain(last);
        let mut known = self.manifolds.iter().zip(levels.clone());
        if self.manifolds.len() == levels.clone().count()
            && known.all(|(m, k)| m.is_of(&followers[..k]))
        {
            return;
        }
        let manifold = |k: usize| {
            let faster = followers[..k].iter();
            let components: Vec<usize> = faster.map(|f| f.component).collect();
            Manifold::new(flow.generator(), &components)
        };
        self.manifolds = levels.filter_map(manifold).collect();
    }
}
