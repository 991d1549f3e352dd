//! When a combination of sources passes a level: the switching times of switches that sources alone control.

use super::piece::{Oscillation, Tone, decayed};
use super::{Source, Wave};
use crate::settings::tolerances::events::CONTROL_ROUNDINGS;

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
    first_crossing(terms, (levels, rest), (from, to), 0.0, all);
    found
}

/// The first passage that is `wanted`, among those of [`crossings`] that are not back within `instant`, s; what comes after it is not looked at.
pub(crate) fn first_crossing(
    terms: &[(f64, &Source)],
    ((constant, level), rest): ((f64, f64), Rest),
    (from, to): (f64, f64),
    instant: f64,
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
    let mut smooth = Smooth::new(&combination, from);
    let mut passages = Passages {
        from,
        instant,
        side: side(combination.just_after(from, &smooth)),
        last: None,
        wanted: &mut wanted,
        found: None,
    };
    let mut start = from;
    while start < to && !passages.end_before(start) {
        let end = terms
            .iter()
            .filter_map(|(_, source)| source.next_breakpoint(start))
            .fold(to, f64::min);
        passages.enter(start, side(combination.just_after(start, &smooth)));
        smooth.search(start, end, &mut passages);
        smooth = Smooth::new(&combination, end);
        passages.enter(end, side(combination.just_after(end, &smooth)));
        start = end;
    }
    passages.end_before(f64::INFINITY);
    passages.found
}

/// Right after `t` the combination is above the level (1), below it (−1), or rests on it (0).
pub(crate) fn side_after(terms: &[(f64, &Source)], (constant, level): (f64, f64), t: f64) -> i8 {
    let combination = Combination {
        terms,
        constant: constant - level,
    };
    sign(combination.just_after(t, &Smooth::new(&combination, t)))
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
    /// What passes here has passed before.
    from: f64,
    /// A passage that is back within this time, s, is none: what touches the level is beyond it for some roundings.
    instant: f64,
    side: i8,
    /// The last passage, as long as it may be back.
    last: Option<Crossing>,
    wanted: &'a mut dyn FnMut(Crossing) -> bool,
    found: Option<Crossing>,
}

impl Passages<'_> {
    /// Right after `time` the combination is on this side of the level.
    fn enter(&mut self, time: f64, side: i8) {
        if side == 0 || side == self.side || self.end_before(time) {
            return;
        }
        self.side = side;
        let rising = side > 0;
        let is_back = self.last.take().is_some();
        if !is_back && time > self.from {
            self.last = Some(Crossing { time, rising });
        }
    }

    /// Whether a passage is found that is not back before `time`.
    fn end_before(&mut self, time: f64) -> bool {
        let lasts = |last: &mut Crossing| time > last.time + self.instant;
        if let (None, Some(last)) = (self.found, self.last.take_if(lasts)) {
            self.found = (self.wanted)(last).then_some(last);
        }
        self.found.is_some()
    }
}

struct Combination<'a> {
    terms: &'a [(f64, &'a Source)],
    constant: f64,
}

impl Combination<'_> {
    /// The value right after `t`, where it is `smooth`; where it vanishes, the first of its derivatives that does not.
    fn just_after(&self, t: f64, smooth: &Smooth) -> f64 {
        let values = self
            .terms
            .iter()
            .map(|&(gain, source)| gain * source.value(t));
        let value = values.sum::<f64>() + self.constant;
        let rounding = |k: usize| CONTROL_ROUNDINGS * f64::EPSILON * smooth.sizes[k];
        let noise = if smooth.is_constant() {
            rounding(0)
        } else {
            f64::EPSILON * smooth.sizes[0]
        };
        if value.abs() > noise {
            return value;
        }
        let slope = smooth.derivative(t);
        if slope.abs() > rounding(1) {
            return slope;
        }
        let curvature = smooth.second_derivative(t);
        if curvature.abs() > rounding(2) {
            return curvature;
        }
        0.0
    }
}

/// The combination between two breakpoints, as an analytic function: constant + slope (t − start) + Σ oscillations + Σ tones. What cancels but for
/// rounding is left out, so that two equal sines have no difference that passes zero without end.
struct Smooth {
    start: f64,
    constant: f64,
    slope: f64,
    oscillations: Vec<Oscillation>,
    tones: Vec<(f64, Tone)>,
    /// What it and its first two derivatives are sums of, in absolute values; a phase is known to its last place.
    sizes: [f64; 3],
}

impl Smooth {
    fn new(combination: &Combination<'_>, start: f64) -> Self {
        let mut smooth = Self {
            start,
            constant: combination.constant,
            slope: 0.0,
            oscillations: Vec::new(),
            tones: Vec::new(),
            sizes: [combination.constant.abs(), 0.0, 0.0],
        };
        let mut amplitudes = Vec::new();
        for &(gain, source) in combination.terms {
            if let Wave::Sffm { .. } = source.wave {
                let tone = source.wave.tone().map(|tone| (gain, tone));
                smooth.tones.extend(tone);
                continue;
            }
            let Some(piece) = source.piece(start) else {
                continue;
            };
            let s = start - piece.origin;
            let line = gain * (piece.constant + piece.slope * s);
            smooth.constant += line;
            smooth.slope += gain * piece.slope;
            smooth.sizes[0] += line.abs();
            smooth.sizes[1] += (gain * piece.slope).abs();
            for term in piece.terms() {
                let term = Oscillation {
                    amplitude: gain * term.amplitude * decayed(term.decay, s),
                    phase: term.phase + term.frequency * s,
                    ..*term
                };
                let amplitude = term.amplitude.abs() * (1.0 + term.phase.abs());
                let rate = term.decay.hypot(term.frequency);
                for (size, power) in smooth.sizes.iter_mut().zip(0..) {
                    *size += amplitude * rate.powi(power);
                }
                let mut others = smooth.oscillations.iter();
                match others.position(|other| term.goes_with(other)) {
                    Some(k) => {
                        smooth.oscillations[k] = smooth.oscillations[k].plus(&term);
                        amplitudes[k] += amplitude;
                    }
                    None => {
                        smooth.oscillations.push(term);
                        amplitudes.push(amplitude);
                    }
                }
            }
        }
        let rounding = CONTROL_ROUNDINGS * f64::EPSILON;
        if smooth.slope.abs() <= rounding * smooth.sizes[1] {
            smooth.slope = 0.0;
        }
        let mut amplitudes = amplitudes.into_iter();
        let remains =
            |term: &Oscillation| Some(term.amplitude.abs() / rounding) > amplitudes.next();
        smooth.oscillations.retain(remains);
        smooth
    }

    fn is_line(&self) -> bool {
        self.tones.is_empty() && self.oscillations.is_empty()
    }

    fn is_constant(&self) -> bool {
        self.is_line() && self.slope == 0.0
    }

    fn value(&self, t: f64) -> f64 {
        let s = t - self.start;
        let terms = self.oscillations.iter().map(|term| term.value(s));
        let tones = self.tones.iter().map(|(gain, tone)| gain * tone.value(t));
        self.constant + self.slope * s + terms.chain(tones).sum::<f64>()
    }

    fn derivative(&self, t: f64) -> f64 {
        let s = t - self.start;
        let terms = self.oscillations.iter().map(|term| term.derivative(s));
        let tones = self
            .tones
            .iter()
            .map(|(gain, tone)| gain * tone.derivative(t));
        self.slope + terms.chain(tones).sum::<f64>()
    }

    /// Without that of tones.
    fn second_derivative(&self, t: f64) -> f64 {
        let s = t - self.start;
        let terms = self.oscillations.iter();
        terms.map(|term| term.second_derivative(s)).sum()
    }

    /// Bounds of |f'| and |f''| on [a, b].
    fn derivative_bounds(&self, a: f64, b: f64) -> (f64, f64) {
        let (a, b) = (a - self.start, b - self.start);
        let terms = self
            .oscillations
            .iter()
            .map(|term| (1.0, term.derivative_bounds(a, b)));
        let tones = self
            .tones
            .iter()
            .map(|(gain, tone)| (gain.abs(), tone.derivative_bounds()));
        terms.chain(tones).fold(
            (self.slope.abs(), 0.0),
            |(first, second), (gain, (d1, d2))| (first + gain * d1, second + gain * d2),
        )
    }

    /// Passages strictly inside (start, end), an interval without breakpoints.
    fn search(&self, start: f64, end: f64, passages: &mut Passages<'_>) {
        if !self.is_line() {
            return self.halve(start, end, passages);
        }
        let (value, slope) = (self.value(start), self.slope);
        // It may round to the start.
        let root = start - value / slope;
        if root < end && sign(value) != sign(slope) {
            passages.enter(root, sign(slope));
        }
    }

    /// Halves [a, b] until on each part f keeps its sign or is monotone, then bisects. Parts come in order of time.
    fn halve(&self, start: f64, end: f64, passages: &mut Passages<'_>) {
        let mut parts = vec![(start, end)];
        while let Some((a, b)) = parts.pop()
            && !passages.end_before(a)
        {
            let (middle, half) = (a + 0.5 * (b - a), 0.5 * (b - a));
            let (first, second) = self.derivative_bounds(a, b);
            let value = self.value(middle);
            if value.abs() > first * half {
                // On this side all along, whatever rounding said of its start.
                passages.enter(a, sign(value));
                continue;
            }
            if middle <= a || middle >= b || self.derivative(middle).abs() > second * half {
                let (left, right) = (self.value(a), self.value(b));
                if sign(left) == sign(right) {
                    passages.enter(a, sign(right));
                } else if sign(right) != 0 && sign(right) != passages.side {
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
