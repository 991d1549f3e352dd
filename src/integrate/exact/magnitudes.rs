//! How large a mode's state can be, and what follows from it.

use super::flow::Flow;
use super::slaved::{Follower, Manifold, followers};
use crate::settings::tolerances::exponentials::LEVEL;

/// Derivatives looked at: g, g', g'', g'''.
pub(super) const ORDERS: usize = 4;

/// How large things were when a mode was last inspected.
#[derive(Debug, Clone, Default)]
pub(crate) struct Magnitudes {
    /// Amplitudes of w.
    pub(crate) sizes: Vec<f64>,
    /// Rounding of g and g' that comes of them.
    pub(crate) noise: Vec<f64>,
    /// The states that are small beside their amplitudes once they follow the others.
    pub(crate) followers: Vec<Follower>,
    /// Where they do: one manifold for each [level](LEVEL) of their ages, the fastest alone first.
    pub(crate) manifolds: Vec<Manifold>,
}

impl Magnitudes {
    /// How long it takes until the states of one of the manifolds follow, s.
    pub(super) fn age_of(&self, manifold: &Manifold) -> f64 {
        let slowest = manifold.len().checked_sub(1);
        let slowest = slowest.and_then(|k| self.followers.get(k));
        slowest.map_or(0.0, |follower| follower.age)
    }

    /// Finds which states follow the others.
    pub(super) fn find_followers(&mut self, flow: &Flow) {
        followers(
            flow.generator(),
            flow.states(),
            &self.sizes,
            &mut self.followers,
        );
        let faster = |k: usize| &self.followers[..k];
        let ages = self.followers.windows(2).enumerate();
        let apart = ages.filter(|(_, pair)| pair[1].age > LEVEL * pair[0].age);
        let mut levels: Vec<usize> = apart.map(|(k, _)| k + 1).collect();
        levels.extend((!self.followers.is_empty()).then_some(self.followers.len()));
        let known = self.manifolds.iter().zip(&levels);
        if self.manifolds.len() == levels.len() && known.clone().all(|(m, &k)| m.is_of(faster(k))) {
            return;
        }
        let guards = flow.guard_matrix();
        let manifold = |&k: &usize| {
            let components: Vec<usize> = faster(k).iter().map(|f| f.component).collect();
            Manifold::new(
                flow.generator(),
                (&guards, flow.sizes()),
                &components,
                ORDERS,
            )
        };
        self.manifolds = levels.iter().filter_map(manifold).collect();
    }
}
