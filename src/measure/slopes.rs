//! How what is measured on a waveform moves with the pieces that it is made of.
//!
//! A piece has its values at begin + s length, s = 0, ⅛ … 1. With l_j the polynomials of Lagrange and y(s) = Σ l_j(s) y_j a part from
//! s₀ to s₁ of it has
//!
//! ```text
//! δ ∫ y dt = length Σ_j δy_j ∫ l_j ds + δlength ∫ y ds + length (y(s₁) δs₁ − y(s₀) δs₀),
//! δ y(t)   = Σ_j l_j(s) δy_j + y'(s) δs,     length δs = δt − δbegin − s δlength,
//! ```
//!
//! an extremum is where y'(s) = 0 or stays at the end of a piece, and where y meets a level δt follows from δy(t) = 0.

use super::curve::{Curve, VALUES, basis, basis_slopes};
use super::pieces::Pieces;
use super::trace::{Shape, Trace};
use super::{MeasureError, Over};
use crate::linalg::gauss::{NODES, WEIGHTS};
use crate::settings::tolerances::periodic::MOST_RIVALS;
use crate::settings::tolerances::times::SAME_TIME;

/// Another time at which an extremum is reached with the same value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rival {
    /// When that is, s.
    pub(crate) at: f64,
    /// The time that counts, s.
    pub(crate) beside: f64,
    /// What the values span.
    pub(crate) span: f64,
    /// The derivatives of the measure if this one counted; for when an extreme value is reached, of the value there.
    pub(crate) slopes: TraceSlopes,
    /// Those of the value that counts, for when it is reached: that time jumps where the two part.
    pub(crate) value: Option<TraceSlopes>,
}

/// Where an extremum is reached: the piece, and where on it.
type Reached = (usize, f64);

/// Derivatives of a number to one piece.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct PieceSlopes {
    /// To its values.
    pub(crate) values: [f64; VALUES],
    /// To where it begins, 1/s.
    pub(crate) begin: f64,
    /// To its length, 1/s.
    pub(crate) length: f64,
}

/// Derivatives of a number to the pieces of a waveform, and to the two times that it was asked for at.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct TraceSlopes {
    /// Numbers of pieces and what belongs to them.
    pub(crate) pieces: Vec<(usize, PieceSlopes)>,
    /// 1/s.
    pub(crate) from: f64,
    /// 1/s.
    pub(crate) to: f64,
}

impl PieceSlopes {
    fn add(&mut self, factor: f64, other: &Self) {
        for (own, other) in self.values.iter_mut().zip(other.values) {
            *own += factor * other;
        }
        self.begin += factor * other.begin;
        self.length += factor * other.length;
    }

    /// Of y(s) where s moves with `time` in t = begin + s length; also the derivative to that time.
    fn of_value(curve: &Curve, s: f64) -> (Self, f64) {
        let slope = curve.slope(s);
        let own = Self {
            values: basis(s),
            begin: -slope,
            length: -slope * s,
        };
        (own, slope)
    }
}

/// A piece: its number, from where to where on it, and how often it is there.
type Counted = (usize, Curve, (f64, f64), f64);

/// By node of Gauss and Legendre on a part of a piece l_j there.
type AtNodes = [[f64; VALUES]; NODES.len()];

/// Those of a part from s to s, of which the last ones are known: an orbit has the same ones again and again.
fn bases_of(known: &mut Vec<((f64, f64), AtNodes)>, (low, high): (f64, f64)) -> &AtNodes {
    /// So many are kept.
    const KNOWN: usize = 16;
    let found = known.iter().position(|(part, _)| *part == (low, high));
    let at = found.unwrap_or_else(|| {
        if known.len() == KNOWN {
            known.remove(0);
        }
        let own = NODES.map(|x| basis(low + (high - low) * x));
        known.push(((low, high), own));
        known.len() - 1
    });
    &known[at].1
}

/// What is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Integrand {
    One,
    Value,
    Square,
}

impl Trace<'_> {
    fn own(&self) -> Option<&Pieces> {
        match &self.shape {
            Shape::Curves(pieces) => Some(pieces),
            Shape::Lines { .. } => None,
        }
    }

    /// The pieces in a window, and how often each is there.
    fn counted(&self, window: (f64, f64)) -> impl Iterator<Item = Counted> {
        self.own()
            .into_iter()
            .flat_map(move |pieces| pieces.counted(window))
    }

    /// ∫ over a window, and its derivatives.
    fn integral_slopes(&self, of: Integrand, window: (f64, f64)) -> (f64, TraceSlopes) {
        let mut found = TraceSlopes::default();
        let mut sum = 0.0;
        let value = |y: f64| match of {
            Integrand::One => 1.0,
            Integrand::Value => y,
            Integrand::Square => y * y,
        };
        let mut known = Vec::new();
        for (k, curve, (low, high), count) in self.counted(window) {
            let length = count * curve.length;
            let mut own = PieceSlopes::default();
            let (bases, mut mean) = match of {
                Integrand::One => (&[][..], high - low),
                _ => (&bases_of(&mut known, (low, high))[..], 0.0),
            };
            for (basis, weight) in bases.iter().zip(WEIGHTS) {
                let part = (high - low) * weight;
                let both = basis.iter().zip(curve.values);
                let y = both.map(|(basis, y)| basis * y).sum();
                mean += part * value(y);
                let slope = if of == Integrand::Value { 1.0 } else { 2.0 * y };
                for (own, basis) in own.values.iter_mut().zip(basis) {
                    *own += length * part * slope * basis;
                }
            }
            sum += length * mean;
            own.length += count * mean;
            if low > 0.0 {
                let y = value(curve.at(low));
                own.begin += y;
                own.length += y * low;
                found.from -= y;
            }
            if high < curve.until {
                let y = value(curve.at(high));
                own.begin -= y;
                own.length -= y * high;
                found.to += y;
            }
            found.pieces.push((k, own));
        }
        (sum, found)
    }

    /// The derivatives of a measure over from ≤ t ≤ to, and what those of an extreme value are at the other times, with lower values between, at which it is reached to `same`, a part of
    /// all that the values span; `None` where they are not known.
    ///
    /// # Errors
    /// [`MeasureError::Window`] where the run has no piece of positive length there.
    pub(crate) fn over_slopes(
        &self,
        what: Over,
        window: (f64, f64),
        same: f64,
    ) -> Result<Option<(TraceSlopes, Vec<Rival>)>, MeasureError> {
        let extreme = |sign, when| self.extreme_slopes((sign, when), window, same);
        let mean = |of: Integrand| {
            let (length, lengths) = self.integral_slopes(Integrand::One, window);
            let (sum, found) = self.integral_slopes(of, window);
            let part = -sum / (length * length);
            (
                sum / length,
                combined((1.0 / length, found), (part, &lengths)),
            )
        };
        let alone = |slopes: TraceSlopes| (slopes, vec![]);
        Ok(match what {
            Over::Integral => Some(alone(self.integral_slopes(Integrand::Value, window).1)),
            Over::Average => Some(alone(mean(Integrand::Value).1)),
            Over::Rms => {
                let (square, found) = mean(Integrand::Square);
                let none = TraceSlopes::default();
                let root = || combined((0.5 / square.sqrt(), found), (0.0, &none));
                (square > 0.0).then(root).map(alone)
            }
            Over::Minimum => extreme(-1.0, false),
            Over::Maximum => extreme(1.0, false),
            Over::PeakToPeak => {
                let most = extreme(1.0, false);
                let both = most.zip(extreme(-1.0, false));
                both.map(|((most, above), (least, below))| {
                    let difference = |most: TraceSlopes, least: &TraceSlopes| {
                        combined((1.0, most), (-1.0, least))
                    };
                    let above = above.into_iter().map(|rival| Rival {
                        slopes: difference(rival.slopes, &least),
                        ..rival
                    });
                    let below = below.into_iter().map(|rival| Rival {
                        slopes: difference(most.clone(), &rival.slopes),
                        ..rival
                    });
                    let rivals = above.chain(below).collect();
                    (difference(most.clone(), &least), rivals)
                })
            }
            Over::WhenMinimum => extreme(-1.0, true),
            Over::WhenMaximum => extreme(1.0, true),
        })
    }

    /// Where the extreme value is reached, then the other places where it is to this part of what the values span, with lower values between; and what they span.
    fn reached(&self, sign: f64, window: (f64, f64), same: f64) -> (Vec<Reached>, f64) {
        let (mut first, mut most, mut least) = (None, f64::NEG_INFINITY, f64::INFINITY);
        let mut largest = Vec::new();
        for (k, curve, part, _) in self.counted(window) {
            let mut own = f64::NEG_INFINITY;
            curve.corners(part, |s, y| {
                own = (sign * y).max(own);
                least = (sign * y).min(least);
                if sign * y > most {
                    (first, most) = (Some((k, s)), sign * y);
                }
            });
            largest.push(own);
        }
        let Some(first) = first else {
            return (vec![], 0.0);
        };
        let level = most - same * (most - least);
        let mut tops: Vec<(Reached, f64)> = vec![];
        let mut above = false;
        for ((k, curve, part, _), largest) in self.counted(window).zip(largest) {
            if largest <= level {
                above = false;
                continue;
            }
            curve.corners(part, |s, y| {
                let y = sign * y;
                let begins = y > level && !above;
                above = y > level;
                match tops.last_mut() {
                    _ if begins => tops.push(((k, s), y)),
                    Some(top) if above && y > top.1 => *top = ((k, s), y),
                    _ => {}
                }
            });
        }
        let others = tops.into_iter().map(|(at, _)| at).filter(|at| *at != first);
        let all = [first].into_iter().chain(others).collect();
        (all, most - least)
    }

    /// Of the extreme value, or of when it is reached, and those of the value where it is reached again.
    fn extreme_slopes(
        &self,
        (sign, when): (f64, bool),
        window: (f64, f64),
        same: f64,
    ) -> Option<(TraceSlopes, Vec<Rival>)> {
        let (all, span) = self.reached(sign, window, same);
        let own = self.own()?;
        let time = |(k, s): Reached| own.get(k).time(s);
        let (first, rest) = all.split_first()?;
        let value = self.extreme_slopes_at(*first, window, false)?;
        let rivals = rest.iter().take(MOST_RIVALS + 1).filter_map(|at| {
            Some(Rival {
                at: time(*at),
                beside: time(*first),
                span,
                slopes: self.extreme_slopes_at(*at, window, false)?,
                value: when.then(|| value.clone()),
            })
        });
        let rivals = rivals.collect();
        if when {
            return Some((self.extreme_slopes_at(*first, window, true)?, rivals));
        }
        Some((value, rivals))
    }

    fn extreme_slopes_at(
        &self,
        (k, s): Reached,
        window: (f64, f64),
        when: bool,
    ) -> Option<TraceSlopes> {
        let curve = &self.own()?.get(k);
        let (low, high) = (curve.place(window.0), curve.place(window.1));
        let mut slopes = TraceSlopes::default();
        // An end of the window that lies inside of a piece stays at its time.
        let at_from = s == low && window.0 > curve.begin;
        let at_to = s == high && window.1 < curve.end();
        let own = if at_from || at_to {
            let (mut own, mut slope) = PieceSlopes::of_value(curve, s);
            if when {
                (own, slope) = (PieceSlopes::default(), 1.0);
            }
            *(if at_from {
                &mut slopes.from
            } else {
                &mut slopes.to
            }) = slope;
            own
        } else if when {
            let mut own = PieceSlopes {
                begin: 1.0,
                length: s,
                ..PieceSlopes::default()
            };
            if s > low && s < high {
                let bend: f64 = basis_slopes(s, 2)
                    .iter()
                    .zip(curve.values)
                    .map(|(b, y)| b * y)
                    .sum();
                if bend == 0.0 {
                    return None;
                }
                own.values = basis_slopes(s, 1).map(|slope| -curve.length * slope / bend);
            }
            own
        } else {
            PieceSlopes {
                values: basis(s),
                ..PieceSlopes::default()
            }
        };
        slopes.pieces.push((k, own));
        Some(slopes)
    }

    /// The derivatives of the value at `t`, or of the slope there; that to t itself is `from`.
    pub(crate) fn at_slopes(&self, t: f64, slope: bool) -> Option<TraceSlopes> {
        let near = SAME_TIME * t.abs();
        let (k, curve) = &self.own()?.begun_by(t + near)?;
        let s = curve.place(t);
        let (own, from) = if slope {
            let bend: f64 = basis_slopes(s, 2)
                .iter()
                .zip(curve.values)
                .map(|(b, y)| b * y)
                .sum();
            let bend = bend / (curve.length * curve.length);
            let own = PieceSlopes {
                values: basis_slopes(s, 1).map(|slope| slope / curve.length),
                begin: -bend,
                length: -bend * s - curve.slope(s) / curve.length,
            };
            (own, bend)
        } else {
            PieceSlopes::of_value(curve, s)
        };
        Some(TraceSlopes {
            pieces: vec![(*k, own)],
            from,
            to: 0.0,
        })
    }

    /// The derivatives of the time t at which it passes zero: within a piece, or where one begins.
    pub(crate) fn crossing_slopes(&self, t: f64) -> Option<TraceSlopes> {
        let pieces = self.own()?;
        let near = SAME_TIME * t.abs();
        let (first, reached) = pieces.within((t - near, t + near));
        let largest = pieces.values().fold(0.0, |m: f64, y| m.max(y.abs()));
        let meets = |k: &usize| {
            let curve = pieces.get(*k);
            let s = curve.place(t);
            let slope = curve.slope(s);
            let rounding = largest + slope.abs() * (t.abs() + curve.length);
            (slope != 0.0 && curve.at(s).abs() <= 64.0 * f64::EPSILON * rounding).then_some(s)
        };
        let inside = (first..reached).find_map(|k| Some((k, meets(&k)?)));
        let (k, own) = match inside {
            Some((k, s)) => {
                let slope = pieces.get(k).slope(s);
                let own = PieceSlopes {
                    values: basis(s).map(|part| -part / slope),
                    begin: 1.0,
                    length: s,
                };
                (k, own)
            }
            None => {
                let k = reached.checked_sub(1)?;
                if (pieces.get(k).begin - t).abs() > near {
                    return None;
                }
                let own = PieceSlopes {
                    begin: 1.0,
                    ..PieceSlopes::default()
                };
                (k, own)
            }
        };
        Some(TraceSlopes {
            pieces: vec![(k, own)],
            from: 0.0,
            to: 0.0,
        })
    }
}

/// a·first + b·second, of which the first one has all pieces of the second one or they are added.
fn combined((a, first): (f64, TraceSlopes), (b, second): (f64, &TraceSlopes)) -> TraceSlopes {
    let mut pieces = first.pieces;
    for (_, own) in &mut pieces {
        let old = std::mem::take(own);
        own.add(a, &old);
    }
    for (k, other) in &second.pieces {
        let mut scaled = PieceSlopes::default();
        scaled.add(b, other);
        pieces.push((*k, scaled));
    }
    TraceSlopes {
        pieces,
        from: a * first.from + b * second.from,
        to: a * first.to + b * second.to,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::{Edge, Which};

    const WINDOW: (f64, f64) = (0.3, 1.7);

    /// Two pieces with an edge between them; moved by h in all that they are made of, entry by entry as in `along`.
    fn trace(h: f64, along: &[PieceSlopes; 2]) -> Trace<'static> {
        let base = [(0.1, 0.9, 1.0), (1.0, 1.2, 0.8)];
        let curves = base.iter().zip(along).enumerate();
        let curves = curves.map(|(k, (&(begin, length, until), along))| Curve {
            begin: begin + h * along.begin,
            length: length + h * along.length,
            until,
            values: std::array::from_fn(|j| {
                let s = j as f64 / 8.0;
                let own = (2.5 * s + k as f64).sin() - 1.4 * k as f64 - 0.3;
                own + h * along.values[j]
            }),
        });
        Trace::curves(curves.collect(), vec![])
    }

    fn along() -> [PieceSlopes; 2] {
        let of = |k: usize| PieceSlopes {
            values: std::array::from_fn(|j| (1.0 + 0.7 * (j + 3 * k) as f64).cos()),
            begin: 0.3 - 0.5 * k as f64,
            length: 0.2 + 0.1 * k as f64,
        };
        [of(0), of(1)]
    }

    fn close(name: &str, slopes: &TraceSlopes, at: impl Fn(&Trace<'_>, (f64, f64)) -> f64) {
        let along = along();
        let mut own = 0.7 * slopes.from - 0.4 * slopes.to;
        for (k, piece) in &slopes.pieces {
            let values = piece.values.iter().zip(along[*k].values);
            own += values.map(|(a, b)| a * b).sum::<f64>();
            own += piece.begin * along[*k].begin + piece.length * along[*k].length;
        }
        let value = |h: f64| {
            let window = (WINDOW.0 + 0.7 * h, WINDOW.1 - 0.4 * h);
            at(&trace(h, &along), window)
        };
        let difference = |h: f64| (value(h) - value(-h)) / (2.0 * h);
        let slope = (4.0 * difference(1e-4) - difference(2e-4)) / 3.0;
        assert!(
            (own - slope).abs() < 1e-9 * (1.0 + slope.abs()),
            "{name}: {own} {slope}"
        );
    }

    #[test]
    fn slopes_are_those_of_the_measures() {
        let own = trace(0.0, &along());
        for what in Over::ALL {
            let (slopes, _) = own.over_slopes(what, WINDOW, 1e-9).unwrap().unwrap();
            close(&format!("{what:?}"), &slopes, |trace, (from, to)| {
                trace.over(what, from, to).unwrap()
            });
        }
        close(
            "value",
            &own.at_slopes(WINDOW.0, false).unwrap(),
            |trace, (t, _)| trace.at(t).unwrap(),
        );
        close(
            "slope",
            &own.at_slopes(WINDOW.0, true).unwrap(),
            |trace, (t, _)| trace.slope(t).unwrap(),
        );
    }

    #[test]
    fn slopes_of_crossings() {
        let when = |trace: &Trace<'_>, n| {
            let which = Which::Number(n);
            trace.crossing(0.0, Edge::Cross, which, (0.0, 2.0)).unwrap()
        };
        let own = trace(0.0, &along());
        for n in 1..=2 {
            let t = when(&own, n);
            let slopes = own.crossing_slopes(t).unwrap();
            close(&format!("crossing {n} at {t}"), &slopes, |trace, _| {
                when(trace, n)
            });
        }
    }
}
