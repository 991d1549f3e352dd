//! When a combination of sources passes a level: the switching times of switches that sources alone control.

use super::{Source, Wave, piece::Tone};

/// A passage through a level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// When, s.
    pub time: f64,
    /// Above the level right after `time` (and not above before), or below it right after (and not below before).
    pub rising: bool,
}

/// What a combination that comes to rest on the level does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rest {
    /// It stays on the side that it came from.
    IsNeither,
    /// It has fallen below the level.
    IsBelow,
}

/// All passages of `constant + Σ gain·source` through `level` in (from, to], in order of time. Touching the level without
/// leaving to the other side is no passage; a jump through it is one, at the time of the edge.
///
/// Straight pieces are solved exactly; where sinusoids or exponentials are involved each passage is enclosed by bounds on the
/// first two derivatives, so that none is missed, and located to rounding by bisection.
#[must_use]
pub fn crossings(
    terms: &[(f64, &Source)],
    levels: (f64, f64),
    rest: Rest,
    from: f64,
    to: f64,
) -> Vec<Crossing> {
    let mut found = Vec::new();
    let all = |crossing| {
        found.push(crossing);
        false
    };
    first_crossing(terms, levels, rest, (from, to), all);
    found
}

/// The first passage that is `wanted`, among those of [`crossings`]; what comes after it is not looked at.
pub(crate) fn first_crossing(
    terms: &[(f64, &Source)],
    (constant, level): (f64, f64),
    rest: Rest,
    (from, to): (f64, f64),
    mut wanted: impl FnMut(Crossing) -> bool,
) -> Option<Crossing> {
    let combination = Combination {
        terms,
        constant: constant - level,
    };
    let side = |value: f64| match (sign(value), rest) {
        (0, Rest::IsBelow) => -1,
        (sign, _) => sign,
    };
    let mut passages = Passages {
        side: side(combination.just_after(from)),
        wanted: &mut wanted,
        found: None,
    };
    let mut start = from;
    while start < to && passages.found.is_none() {
        let end = terms
            .iter()
            .filter_map(|(_, source)| source.next_breakpoint(start))
            .fold(to, f64::min);
        passages.enter(start, side(combination.just_after(start)));
        combination.search(start, end, &mut passages);
        passages.enter(end, side(combination.just_after(end)));
        start = end;
    }
    passages.found
}

fn sign(value: f64) -> i8 {
    if value > 0.0 {
        1
    } else if value < 0.0 {
        -1
    } else {
        0
    }
}

/// The last side of the level that was not the level itself, and the first passage that is wanted.
struct Passages<'a> {
    side: i8,
    wanted: &'a mut dyn FnMut(Crossing) -> bool,
    found: Option<Crossing>,
}

impl Passages<'_> {
    /// Right after `time` the combination is on this side of the level.
    fn enter(&mut self, time: f64, side: i8) {
        if side == 0 || side == self.side || self.found.is_some() {
            return;
        }
        self.side = side;
        let rising = side > 0;
        let crossing = Crossing { time, rising };
        self.found = (self.wanted)(crossing).then_some(crossing);
    }
}

struct Combination<'a> {
    terms: &'a [(f64, &'a Source)],
    constant: f64,
}

impl Combination<'_> {
    /// The value right after `t`: where it vanishes, a value with the sign of what follows.
    fn just_after(&self, t: f64) -> f64 {
        let value = self.sum(|source| source.value(t)) + self.constant;
        let size = self.sum_abs(|source| source.value(t)) + self.constant.abs();
        if value.abs() > f64::EPSILON * size {
            value
        } else {
            self.sum(|source| source.derivative(t))
        }
    }

    fn sum(&self, of: impl Fn(&Source) -> f64) -> f64 {
        self.terms
            .iter()
            .map(|&(gain, source)| gain * of(source))
            .sum()
    }

    fn sum_abs(&self, of: impl Fn(&Source) -> f64) -> f64 {
        self.terms
            .iter()
            .map(|&(gain, source)| (gain * of(source)).abs())
            .sum()
    }

    /// Passages strictly inside (start, end), an interval without breakpoints.
    fn search(&self, start: f64, end: f64, passages: &mut Passages<'_>) {
        let smooth = Smooth::new(self, start);
        if smooth.is_line() {
            let (value, slope) = (smooth.value(start), smooth.derivative(start));
            let root = start - value / slope;
            if root > start && root < end && sign(value) != sign(slope) {
                passages.enter(root, sign(slope));
            }
        } else {
            smooth.search(start, end, passages);
        }
    }
}

/// The combination between two breakpoints, as an analytic function.
struct Smooth {
    pieces: Vec<(f64, super::Piece)>,
    tones: Vec<(f64, Tone)>,
    constant: f64,
}

impl Smooth {
    fn new(combination: &Combination<'_>, start: f64) -> Self {
        let mut smooth = Self {
            pieces: Vec::new(),
            tones: Vec::new(),
            constant: combination.constant,
        };
        for &(gain, source) in combination.terms {
            match source.wave {
                Wave::Sffm { .. } => smooth
                    .tones
                    .extend(source.wave.tone().map(|tone| (gain, tone))),
                _ => smooth
                    .pieces
                    .extend(source.piece(start).map(|piece| (gain, piece))),
            }
        }
        smooth
    }

    fn is_line(&self) -> bool {
        self.tones.is_empty()
            && self
                .pieces
                .iter()
                .all(|(_, piece)| piece.terms().next().is_none())
    }

    fn value(&self, t: f64) -> f64 {
        let pieces = self
            .pieces
            .iter()
            .map(|(gain, piece)| gain * piece.value(t));
        let tones = self.tones.iter().map(|(gain, tone)| gain * tone.value(t));
        pieces.chain(tones).sum::<f64>() + self.constant
    }

    fn derivative(&self, t: f64) -> f64 {
        let pieces = self
            .pieces
            .iter()
            .map(|(gain, piece)| gain * piece.derivative(t));
        let tones = self
            .tones
            .iter()
            .map(|(gain, tone)| gain * tone.derivative(t));
        pieces.chain(tones).sum()
    }

    /// Bounds of |f'| and |f''| on [a, b].
    fn derivative_bounds(&self, a: f64, b: f64) -> (f64, f64) {
        let pieces = self
            .pieces
            .iter()
            .map(|(gain, piece)| (gain, piece.derivative_bounds(a, b)));
        let tones = self
            .tones
            .iter()
            .map(|(gain, tone)| (gain, tone.derivative_bounds()));
        pieces
            .chain(tones)
            .fold((0.0, 0.0), |(first, second), (gain, (d1, d2))| {
                (first + gain.abs() * d1, second + gain.abs() * d2)
            })
    }

    /// Halves [a, b] until on each part f keeps its sign or is monotone, then bisects. Parts come in order of time.
    fn search(&self, start: f64, end: f64, passages: &mut Passages<'_>) {
        let mut parts = vec![(start, end)];
        while let Some((a, b)) = parts.pop()
            && passages.found.is_none()
        {
            let (middle, half) = (a + 0.5 * (b - a), 0.5 * (b - a));
            let (first, second) = self.derivative_bounds(a, b);
            if self.value(middle).abs() > first * half {
                continue;
            }
            if middle <= a || middle >= b || self.derivative(middle).abs() > second * half {
                let (left, right) = (self.value(a), self.value(b));
                if sign(right) != 0 && sign(left) != sign(right) && sign(right) != passages.side {
                    passages.enter(self.root(a, b, sign(right)), sign(right));
                }
            } else {
                parts.push((middle, b));
                parts.push((a, middle));
            }
        }
    }

    /// The double in [a, b] where a monotone f takes the sign it has at b.
    fn root(&self, mut a: f64, mut b: f64, after: i8) -> f64 {
        loop {
            let middle = a + 0.5 * (b - a);
            if middle <= a || middle >= b {
                return b;
            }
            if sign(self.value(middle)) == after {
                b = middle;
            } else {
                a = middle;
            }
        }
    }
}
