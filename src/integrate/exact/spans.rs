//! Stretches of a mode whose energy is still to be integrated: neighbours of one length become one of twice the length, so
//! that a stretch of N steps costs log N forms.

use super::flow::Flow;
use super::work::Sizes;

/// Spans in order of time; each begins at a state and lasts 2^k steps of the deepest level.
#[derive(Debug, Clone, Default)]
pub(crate) struct Spans {
    lengths: Vec<u32>,
    /// One w per span.
    begins: Vec<f64>,
    /// Spans before this one are not neighbours of later ones.
    first: usize,
}

impl Spans {
    /// A span of 2^k units from w.
    #[inline]
    pub(crate) fn push(&mut self, k: u32, w: &[f64], flow: &mut Flow, sizes: Sizes<'_>) {
        let dim = flow.dim();
        let (mut k, mut last) = (k, self.lengths.len());
        while last > self.first && self.lengths[last - 1] == k && flow.may_join(k, sizes) {
            last -= 1;
            k += 1;
        }
        if last < self.lengths.len() {
            // The joined span begins where the first of them did.
            self.lengths.truncate(last + 1);
            self.begins.truncate((last + 1) * dim);
            self.lengths[last] = k;
        } else {
            self.lengths.push(k);
            self.begins.extend_from_slice(&w[..dim]);
        }
    }

    /// What comes next is no neighbour of what is there.
    pub(crate) fn part(&mut self) {
        self.first = self.lengths.len();
    }

    /// Adds the energy of all spans (from sources, dissipated), J, and forgets them.
    pub(crate) fn drain(&mut self, flow: &mut Flow, sizes: Sizes<'_>, energy: &mut [f64; 2]) {
        let dim = flow.dim();
        for (&k, w) in self.lengths.iter().zip(self.begins.chunks_exact(dim)) {
            let [source, dissipated] = flow.energy(k, w, sizes);
            energy[0] += source;
            energy[1] += dissipated;
        }
        self.lengths.clear();
        self.begins.clear();
        self.first = 0;
    }
}
