//! Spans that recur: a circuit that a clock switches travels the same times period by period, from an edge to a row or to the next edge.
//! The exponentials of those that are met often are kept.

use crate::linalg::kernel::Kernel;

/// Spans of a mode that are known at most.
const MOST: usize = 32;
/// A span is prepared when it is met so often: before, that is more work than it spares.
const PATIENCE: u32 = 16;

/// A span that a mode was asked for.
#[derive(Debug, Clone)]
struct Span {
    /// Its length, s.
    time: f64,
    met: u32,
    /// exp(𝒜 time) − I, once it is prepared.
    increment: Option<Kernel>,
}

/// The spans that a mode was asked for.
#[derive(Debug, Clone, Default)]
pub(super) struct Recurring {
    spans: Vec<Span>,
    /// The place of the next new span once all are taken.
    next: usize,
    /// How many exponentials are kept.
    kept: usize,
}

impl Recurring {
    /// The place of the span of this length, of which all within `same` are one, once it was met often enough to be prepared.
    #[inline]
    pub(super) fn find(&mut self, time: f64, same: f64) -> Option<usize> {
        let is = |span: &Span| (span.time - time).abs() <= same;
        let Some(at) = self.spans.iter().position(is) else {
            self.meet(time);
            return None;
        };
        let span = &mut self.spans[at];
        span.met += 1;
        (span.met >= PATIENCE).then_some(at)
    }

    /// Notes a new span, in the place of one that is not prepared if there is no other.
    fn meet(&mut self, time: f64) {
        let span = Span {
            time,
            met: 1,
            increment: None,
        };
        if self.spans.len() < MOST {
            self.spans.push(span);
            return;
        }
        let mut places = (self.next..MOST).chain(0..self.next);
        if let Some(at) = places.find(|&at| self.spans[at].increment.is_none()) {
            self.spans[at] = span;
            self.next = (at + 1) % MOST;
        }
    }

    /// Something happens on the span at a place: it waits as if it were new.
    pub(super) fn refuse(&mut self, at: usize) {
        self.spans[at].met = 1;
    }

    /// The length of the span at a place, s.
    pub(super) fn time(&self, at: usize) -> f64 {
        self.spans[at].time
    }

    /// exp(𝒜 t) − I of the span at a place, prepared when first asked for; `None` beyond doubles.
    #[inline]
    pub(super) fn increment(
        &mut self,
        at: usize,
        prepare: impl FnOnce(f64) -> Option<Kernel>,
    ) -> Option<&Kernel> {
        let span = &mut self.spans[at];
        if span.increment.is_none() {
            span.increment = prepare(span.time);
            self.kept += usize::from(span.increment.is_some());
        }
        span.increment.as_ref()
    }

    /// How many exponentials are kept.
    pub(super) fn kept(&self) -> usize {
        self.kept
    }

    /// Gives up the exponentials: they are prepared again when asked for.
    pub(super) fn forget(&mut self) {
        self.spans.iter_mut().for_each(|span| span.increment = None);
        self.kept = 0;
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
            assert_eq!(
                recurring.find(1e-6 * (k + 2) as f64, 1e-15),
                None,
                "{k} is new"
            );
            let again = recurring.find(1e-6 + 1e-16 * (k % 3) as f64, 1e-15);
            assert_eq!(again.is_some(), k + 1 >= PATIENCE as usize, "{k}");
            if let Some(at) = again {
                assert_eq!(*found.get_or_insert(at), at);
                assert_eq!(recurring.time(at), 1e-6);
                let prepared = recurring.increment(at, |_| Some(Kernel::default()));
                assert!(prepared.is_some());
            }
        }
        let at = found.expect("a span that recurs");
        recurring.refuse(at);
        let waits = (0..100).take_while(|_| recurring.find(1e-6, 1e-15).is_none());
        assert_eq!(waits.count(), PATIENCE as usize - 2);
    }
}
