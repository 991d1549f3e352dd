//! How large a run has been in its mode, and what of that is rounding by now.

use super::{Travel, larger, smaller};
use crate::integrate::exact::flow::Flow;
use crate::linalg::refill::{raise, refill};

impl Travel {
    #[inline]
    pub(super) fn note_peak(&mut self) {
        raise(&mut self.peak, &self.now);
    }

    pub(super) fn refresh_noise(&mut self, flow: &Flow) {
        self.note_peak();
        raise(&mut self.amplitude, &self.now);
        if self.age >= self.follows {
            self.follow(flow);
        }
        if self.following == 0 {
            flow.noise(&self.amplitude, &mut self.floors);
        } else {
            let mut sizes = std::mem::take(&mut self.sizes);
            refill(&mut sizes, &self.amplitude);
            self.take_followers(&mut sizes);
            flow.noise(&sizes, &mut self.floors);
            self.sizes = sizes;
        }
        self.add_slack();
    }

    /// The states that follow others by now. A guard that has risen since needs no slack.
    fn follow(&mut self, flow: &Flow) {
        let age = self.age;
        let later = self.followers[self.following..].iter();
        self.following += later.take_while(|follower| follower.age <= age).count();
        self.note_next_follower();
        let guards = &self.now[flow.dim()..];
        for (slack, g) in self.slack.iter_mut().zip(guards) {
            *slack = smaller(*slack, larger(-g, 0.0));
        }
    }

    /// The age at which the next state follows the others.
    pub(super) fn note_next_follower(&mut self) {
        let next = self.followers.get(self.following);
        self.follows = next.map_or(f64::INFINITY, |next| next.age);
    }

    #[inline(never)]
    pub(super) fn add_slack(&mut self) {
        for (floor, slack) in self.floors.iter_mut().zip(&self.slack) {
            *floor += slack;
        }
        self.since_refresh = 0;
    }

    /// How large x was on the way here.
    pub(crate) fn peak(&self) -> &[f64] {
        &self.peak
    }

    /// How large w can have been on the way here.
    pub(crate) fn reach(&self, reach: &mut Vec<f64>) {
        refill(reach, &self.amplitude);
        reach[..self.peak.len()].copy_from_slice(&self.peak);
    }

    /// How large what w was rounded from is by now, where some states follow others: what they were before has decayed, and its rounding
    /// with it.
    pub(crate) fn known(&self, known: &mut Vec<f64>) -> bool {
        if self.following == 0 {
            return false;
        }
        refill(known, &self.amplitude);
        self.take_followers(known);
        true
    }

    /// Takes the states that follow others by now as large as they are.
    fn take_followers(&self, sizes: &mut [f64]) {
        for follower in &self.followers[..self.following] {
            let j = follower.component;
            sizes[j] = larger(follower.size, self.now[j].abs());
        }
    }
}
