//! Spans that recur: a circuit that a clock switches travels the same times period by period, from an edge to the next one over all
//! output rows between them, or from edge to row and from row to edge. Their exponentials are kept.

use super::kernel::Kernel;

/// Spans of a mode that are known at most.
const MOST: usize = 32;
/// A span is prepared when it is met so often: before, that is more work than it spares.
const PATIENCE: u32 = 16;

/// The flow over one span. Its time differs from that of a span it stands for by roundings, of which the first order is taken along.
#[derive(Debug, Clone)]
pub(super) struct Prepared {
    /// exp(𝒜t) − I, and below it 𝒜 exp(𝒜t).
    pub(super) flow: Kernel,
    /// The forms of its energy, see [`Work::span`](super::work::Work::span), if any is asked for.
    pub(super) energy: Option<[Kernel; 2]>,
    /// The output rows on the way, one below the other.
    pub(super) rows: Kernel,
}

/// The spans that a mode was asked for.
#[derive(Debug, Clone, Default)]
pub(super) struct Recurring {
    /// The span, and where in it the first output row is; 0 without rows, s.
    times: Vec<[f64; 2]>,
    met: Vec<u32>,
    prepared: Vec<Option<Prepared>>,
    /// The place of the next new span once all are taken.
    next: usize,
}

impl Recurring {
    /// The place of the span of these times, of which all within `same` are one, once it was met often enough to be prepared.
    #[inline]
    pub(super) fn find(&mut self, t: [f64; 2], same: f64) -> Option<usize> {
        let is = |time: &[f64; 2]| (time[0] - t[0]).abs() <= same && (time[1] - t[1]).abs() <= same;
        let Some(at) = self.times.iter().position(is) else {
            self.meet(t);
            return None;
        };
        self.met[at] += 1;
        (self.met[at] >= PATIENCE).then_some(at)
    }

    /// Notes a new span, in the place of the oldest that is not prepared if there is no other.
    fn meet(&mut self, t: [f64; 2]) {
        if self.times.len() < MOST {
            self.times.push(t);
            self.met.push(1);
            self.prepared.push(None);
            return;
        }
        let free = (self.next..MOST)
            .chain(0..self.next)
            .find(|&at| self.prepared[at].is_none());
        if let Some(at) = free {
            self.times[at] = t;
            self.met[at] = 1;
            self.next = (at + 1) % MOST;
        }
    }

    /// Something happened on the span at a place: it waits as if it were new.
    pub(super) fn refuse(&mut self, at: usize) {
        self.met[at] = 1;
    }

    /// The times and the flow of the span at a place from [`Self::find`]; prepared when first asked for. `None` beyond doubles.
    #[inline]
    pub(super) fn get(
        &mut self,
        at: usize,
        prepare: impl FnOnce([f64; 2]) -> Option<Prepared>,
    ) -> Option<([f64; 2], &Prepared)> {
        let t = self.times[at];
        if self.prepared[at].is_none() {
            self.prepared[at] = prepare(t);
        }
        Some((t, self.prepared[at].as_ref()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_recurs_is_known_among_what_does_not() {
        let mut recurring = Recurring::default();
        let mut found = None;
        for k in 0..20 * MOST {
            let other = if k % 2 == 0 {
                [1e-6 * (k + 2) as f64, 0.0]
            } else {
                [1e-6, 1e-9 * k as f64]
            };
            assert_eq!(recurring.find(other, 1e-15), None, "{k}");
            let again = recurring.find([1e-6 + 1e-16 * (k % 3) as f64, 0.0], 1e-15);
            assert_eq!(again.is_some(), k + 1 >= PATIENCE as usize, "{k}");
            if let Some(at) = again {
                assert_eq!(*found.get_or_insert(at), at);
                let flow = Prepared {
                    flow: Kernel::default(),
                    energy: None,
                    rows: Kernel::default(),
                };
                let time = recurring.get(at, |_| Some(flow)).map(|(t, _)| t);
                assert_eq!(time, Some([1e-6, 0.0]));
            }
        }
        let at = found.unwrap();
        recurring.refuse(at);
        let waits = (0..100).take_while(|_| recurring.find([1e-6, 0.0], 1e-15).is_none());
        assert_eq!(waits.count(), PATIENCE as usize - 2);
    }
}
