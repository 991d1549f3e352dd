//! Which curves share an axis of values: those that are seen beside each other.

/// The least part of a panel's height that what varies takes: four of 220 pixels.
const FLAT: f64 = 0.02;
/// The same where what stands still alone makes the panel that high: nothing is lost where that has a panel of its own.
const BESIDE_STILL: f64 = 0.1;
/// What varies by less of its size stands still: a source with its rounding.
const STILL: f64 = 1e-6;
/// What varies by less of the largest value in the unit stands still too: the rounding of a difference.
const ROUNDING: f64 = 1e-12;
/// Panels of a unit at most; beyond them a curve goes where it is seen best.
const MOST: usize = 6;

/// From the lowest to the highest value of a signal, of all its runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extent {
    low: f64,
    high: f64,
}

impl Extent {
    /// That of values; those that are no numbers have none.
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Self {
        let none = Self {
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
        };
        values.fold(none, |all, value| Self {
            low: all.low.min(value),
            high: all.high.max(value),
        })
    }

    fn with(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    fn height(self) -> f64 {
        (self.high - self.low).max(0.0)
    }

    /// The largest value.
    fn size(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// Its middle alone where it is no higher than this, itself else.
    fn above(self, rounding: f64) -> Self {
        if self.height() > rounding || self.low > self.high {
            return self;
        }
        let middle = self.low.midpoint(self.high);
        Self {
            low: middle,
            high: middle,
        }
    }

    /// Neither seen nor in the way: it stands still, or has no values.
    fn is_still(self) -> bool {
        self.height() <= STILL * self.size()
    }
}

/// Signals of one panel, by number, and how high it is.
struct Group {
    members: Vec<usize>,
    whole: Extent,
}

impl Group {
    /// The part of the height that the least of its varying members and another take together.
    fn least_part(&self, extents: &[Extent], other: Extent) -> f64 {
        let height = self.whole.with(other).height();
        let members = self.members.iter().map(|&k| extents[k]);
        let varying = members
            .chain([other])
            .filter(|extent| !extent.is_still())
            .map(|extent| extent.height() / height);
        varying.fold(f64::INFINITY, f64::min)
    }

    fn take(&mut self, k: usize, extent: Extent) {
        self.members.push(k);
        self.whole = self.whole.with(extent);
    }
}

/// Panels of signals, each in order: the larger ones first take those beside which both are seen, what stands still goes where it flattens nothing.
/// Panels stand in the order of their first signals, those of what stands still last.
pub(super) fn panels(extents: &[Extent]) -> Vec<Vec<usize>> {
    let sizes = extents.iter().map(|extent| extent.size());
    let rounding = ROUNDING * sizes.filter(|size| size.is_finite()).fold(0.0, f64::max);
    let extents: Vec<Extent> = extents
        .iter()
        .map(|extent| extent.above(rounding))
        .collect();
    let (still, mut varying): (Vec<usize>, Vec<usize>) =
        (0..extents.len()).partition(|&k| extents[k].is_still());
    varying.sort_by(|&a, &b| extents[b].height().total_cmp(&extents[a].height()));
    let mut groups: Vec<Group> = Vec::new();
    let place = |groups: &mut Vec<Group>, k: usize, least: f64| {
        let extent = extents[k];
        let parts = groups
            .iter()
            .map(|group| group.least_part(&extents, extent));
        let best = parts.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        let full = groups.len() >= MOST;
        match best.filter(|(_, part)| full || *part >= least) {
            Some((best, _)) => groups[best].take(k, extent),
            None => groups.push(Group {
                members: vec![k],
                whole: extent,
            }),
        }
    };
    for k in varying {
        place(&mut groups, k, FLAT);
    }
    let moving = groups.len();
    for k in still {
        let extent = extents[k];
        // Within what a panel shows anyway it takes nothing.
        let inside = |group: &Group| group.whole.with(extent) == group.whole;
        match groups[..moving].iter().position(inside) {
            Some(inside) => groups[inside].take(k, extent),
            None => place(&mut groups, k, BESIDE_STILL),
        }
    }
    let last = groups.split_off(moving);
    let mut ordered: Vec<Vec<usize>> = groups.into_iter().map(|group| group.members).collect();
    ordered
        .iter_mut()
        .for_each(|members| members.sort_unstable());
    ordered.sort();
    ordered.extend(last.into_iter().map(|group| group.members));
    ordered
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panels_of(extents: &[(f64, f64)]) -> Vec<Vec<usize>> {
        let extents = extents.iter().map(|&(low, high)| Extent { low, high });
        panels(&extents.collect::<Vec<_>>())
    }

    #[test]
    fn a_ripple_does_not_share_a_panel_with_a_large_source() {
        // 400 V in, which stands still or sags; 12 V out, from its start or at its ripple.
        for input in [(400.0, 400.0), (399.9, 400.0)] {
            for output in [(0.0, 12.3), (11.98, 12.02)] {
                assert_eq!(panels_of(&[input, output]).len(), 2);
            }
        }
        // The source that stands still comes last.
        assert_eq!(panels_of(&[(400.0, 400.0), (0.0, 12.0)]), [[1], [0]]);
        // A control that has settled, to rounding, beside an output.
        assert_eq!(panels_of(&[(0.0, 12.0), (-2.7e-15, 2.7e-15)]).len(), 1);
        // Two outputs at levels of their own have panels of their own.
        assert_eq!(panels_of(&[(11.98, 12.02), (4.99, 5.01)]), [[0], [1]]);
    }

    #[test]
    fn what_is_seen_together_stays_together() {
        // A rectifier with its smoothed output, a buck from 24 V to 5 V, a divider, sines with a still bias between their peaks.
        for extents in [
            &[(-325.0, 325.0), (300.0, 325.0)][..],
            &[(24.0, 24.0), (0.0, 5.2)],
            &[(-10.0, 10.0), (-1.0, 1.0)],
            &[(-1.0, 1.0), (0.5, 0.5), (0.0, 0.0)],
            &[(5.0, 5.0), (400.0, 400.0)],
        ] {
            assert_eq!(panels_of(extents).len(), 1, "{extents:?}");
        }
    }

    #[test]
    fn there_are_not_more_panels_than_can_be_seen() {
        let ladder: Vec<(f64, f64)> = (0..30)
            .map(|k| (f64::from(k), f64::from(k) + 0.01))
            .collect();
        let panels = panels_of(&ladder);
        assert_eq!(panels.len(), MOST);
        let mut all = panels.concat();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..30));
        // What has no values is nobody's trouble.
        assert_eq!(
            panels_of(&[(f64::INFINITY, f64::NEG_INFINITY), (0.0, 1.0)])
                .concat()
                .len(),
            2
        );
    }
}
