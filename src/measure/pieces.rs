//! The smooth pieces of a waveform, which an orbit repeats lap by lap.

use super::curve::Curve;

/// Laps of a waveform that repeats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Laps {
    /// The first one: of lap k all begins k periods later than told, less the origin.
    pub(crate) from: usize,
    /// So many.
    pub(crate) count: usize,
    /// s.
    pub(crate) period: f64,
    /// s.
    pub(crate) origin: f64,
}

impl Laps {
    /// As they are told, once.
    pub(crate) const ONE: Self = Self {
        from: 0,
        count: 1,
        period: 0.0,
        origin: 0.0,
    };

    /// By lap how much later all begins than told, s.
    pub(crate) fn shift(&self, lap: usize) -> f64 {
        (self.from + lap) as f64 * self.period - self.origin
    }
}

/// Pieces in the order of time, lap after lap.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Pieces {
    /// Of one lap.
    own: Vec<Curve>,
    laps: Laps,
}

impl Pieces {
    /// These, once.
    pub(super) const fn once(own: Vec<Curve>) -> Self {
        let laps = Laps::ONE;
        Self { own, laps }
    }

    /// These again and again.
    pub(super) const fn repeated(own: Vec<Curve>, laps: Laps) -> Self {
        Self { own, laps }
    }

    fn len(&self) -> usize {
        self.own.len() * self.laps.count
    }

    /// The k-th one of all laps.
    pub(super) fn get(&self, k: usize) -> Curve {
        let (lap, own) = (k / self.own.len(), self.own[k % self.own.len()]);
        Curve {
            begin: own.begin + self.laps.shift(lap),
            ..own
        }
    }

    /// The values of one lap.
    pub(super) fn values(&self) -> impl Iterator<Item = f64> {
        self.own.iter().flat_map(|curve| curve.values)
    }

    /// Where they begin and end, s.
    pub(super) fn span(&self) -> Option<(f64, f64)> {
        let last = self.len().checked_sub(1)?;
        Some((self.get(0).begin, self.get(last).end()))
    }

    /// How many lie before the first one that this does not hold of, while it holds of all those before it.
    pub(super) fn before(&self, holds: impl Fn(&Curve) -> bool) -> usize {
        let (mut low, mut high) = (0, self.len());
        while low < high {
            let middle = low.midpoint(high);
            if holds(&self.get(middle)) {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        low
    }

    /// The last one that has begun by `t`, and its number.
    pub(super) fn begun_by(&self, t: f64) -> Option<(usize, Curve)> {
        let k = self.before(|curve| curve.begin <= t).checked_sub(1)?;
        Some((k, self.get(k)))
    }

    /// The pieces of from ≤ t ≤ to: their numbers, and from where to where they lie there.
    pub(super) fn parts(
        &self,
        window: (f64, f64),
    ) -> impl Iterator<Item = (usize, Curve, (f64, f64))> {
        self.numbered(window, self.within(window))
    }

    /// The same where whole laps after the first one are left out, and how often each piece is there: they begin with part of a piece, one whole lap, and what is left of laps.
    pub(super) fn counted(
        &self,
        window: (f64, f64),
    ) -> impl Iterator<Item = (usize, Curve, (f64, f64), f64)> {
        let (first, end) = self.within(window);
        // Of the first and the last one there may be a part.
        let lap = self.own.len().max(1);
        let again = (end - first).saturating_sub(lap + 2) / lap;
        let seen = first + 1 + lap;
        let (all, rest) = if again == 0 {
            ((first, end), (end, end))
        } else {
            ((first, seen), (seen + again * lap, end))
        };
        let all = self
            .numbered(window, all)
            .chain(self.numbered(window, rest));
        all.map(move |(k, curve, part)| {
            if again > 0 && k > first && k < seen {
                return (k, curve, (0.0, curve.until), (1 + again) as f64);
            }
            (k, curve, part, 1.0)
        })
    }

    /// The numbers of those within a window: the first one, and that after the last one.
    pub(super) fn within(&self, (from, to): (f64, f64)) -> (usize, usize) {
        let first = self.before(|curve| curve.end() < from);
        let end = self.before(|curve| curve.begin <= to);
        (first, end.max(first))
    }

    fn numbered(
        &self,
        (from, to): (f64, f64),
        (first, end): (usize, usize),
    ) -> impl Iterator<Item = (usize, Curve, (f64, f64))> {
        (first..end).map(move |k| {
            let curve = self.get(k);
            (k, curve, (curve.place(from), curve.place(to)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::{INTERVALS, Over, Trace};

    const PERIOD: f64 = 1.0;
    const LAPS: Laps = Laps {
        from: 3,
        count: 12,
        period: PERIOD,
        origin: 0.25,
    };

    /// A lap of three pieces, with an edge before the last one.
    fn lap() -> Vec<Curve> {
        let all = [(0.0, 0.375, 1.0), (0.375, 0.5, 0.75), (0.75, 0.25, 1.0)];
        let piece = |(k, (begin, length, until)): (usize, (f64, f64, f64))| {
            let value = |j: usize| {
                let t = begin + length * j as f64 / INTERVALS as f64;
                (7.0 * t).sin() + (k / 2) as f64
            };
            Curve {
                begin,
                length,
                until,
                values: std::array::from_fn(value),
            }
        };
        all.into_iter().enumerate().map(piece).collect()
    }

    fn windows() -> impl Iterator<Item = (f64, f64)> {
        let begin = LAPS.shift(0);
        let ends = [0.0, 0.1, 0.375, 1.0, 1.2, 2.0, 2.75, 5.9, 11.0, 11.99, 12.0];
        let all = ends.into_iter().flat_map(move |a| ends.map(|b| (a, b)));
        let all = all.filter(|(a, b)| a < b);
        all.map(move |(a, b)| (begin + a, begin + b))
    }

    /// In windows of any length, whole laps or not.
    #[test]
    fn measures_of_laps_are_those_of_all_their_pieces() {
        let pieces = Pieces::repeated(lap(), LAPS);
        let all = (0..pieces.len()).map(|k| pieces.get(k)).collect();
        let (laps, all) = (Trace::pieced(pieces, vec![]), Trace::curves(all, vec![]));
        for (from, to) in windows() {
            for what in Over::ALL {
                let [own, exact] = [&laps, &all].map(|trace| trace.over(what, from, to).unwrap());
                let apart = (own - exact).abs();
                assert!(
                    apart <= 1e-13 * exact.abs(),
                    "{what:?} {from} {to}: {own} {exact}"
                );
            }
        }
    }

    /// What belongs to one piece of a lap, taken together.
    #[test]
    fn derivatives_of_laps_are_those_of_all_their_pieces() {
        let pieces = Pieces::repeated(lap(), LAPS);
        let count = pieces.own.len();
        let all = (0..pieces.len()).map(|k| pieces.get(k)).collect();
        let (laps, all) = (Trace::pieced(pieces, vec![]), Trace::curves(all, vec![]));
        for (from, to) in windows() {
            for what in Over::ALL {
                let of = |trace: &Trace<'_>| {
                    let (slopes, _) = trace.over_slopes(what, (from, to), 1e-9).unwrap().unwrap();
                    let mut sums = vec![0.0; count * (INTERVALS + 3) + 2];
                    for (k, piece) in &slopes.pieces {
                        let own = &mut sums[(k % count) * (INTERVALS + 3)..];
                        let parts = piece.values.into_iter().chain([piece.begin, piece.length]);
                        own.iter_mut()
                            .zip(parts)
                            .for_each(|(sum, part)| *sum += part);
                    }
                    let ends = sums.len() - 2;
                    sums[ends..].copy_from_slice(&[slopes.from, slopes.to]);
                    sums
                };
                let (own, exact) = (of(&laps), of(&all));
                let largest = exact.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
                for (a, b) in own.iter().zip(&exact) {
                    assert!(
                        (a - b).abs() <= 1e-12 * largest,
                        "{what:?} {from} {to}: {a} {b}"
                    );
                }
            }
        }
    }

    /// However many laps there are, the work is that of two.
    #[test]
    fn laps_are_seen_once() {
        let pieces = Pieces::repeated(lap(), LAPS);
        for (from, to) in windows() {
            let (seen, all) = (pieces.counted((from, to)), pieces.parts((from, to)));
            let (seen, all): (Vec<f64>, usize) = (seen.map(|seen| seen.3).collect(), all.count());
            assert!(seen.len() <= 2 * pieces.own.len() + 1, "{from} {to}");
            assert_eq!(seen.iter().sum::<f64>(), all as f64, "{from} {to}");
        }
    }
}
