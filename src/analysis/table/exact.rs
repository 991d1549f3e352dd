//! The sums of a table over a run that is exact throughout.

use std::f64::consts::TAU;

use nalgebra::{Complex, DVector};

use super::columns::{Columns, Sums, distortion};
use super::commutation::{Commutations, Costs};
use super::extrema::Extrema;
use super::integrals;
use super::means::Span;
use crate::analysis::variation::{Course, Leap, Linear};
use crate::circuit::Kind;
use crate::integrate::Error;
use crate::settings::tolerances::periodic::FUNDAMENTAL;
use crate::settings::tolerances::times::SAME_TIME;

/// Integrals of a quantity, without impulses.
#[derive(Clone, Copy, Default)]
struct Moments {
    seconds: f64,
    /// ∫ y dt.
    first: f64,
    /// ∫ (y − ȳ)² dt about the mean ȳ, in which a ripple keeps its digits.
    second: f64,
}

impl Moments {
    /// Goes on with a stretch.
    fn add(&mut self, other: Self) {
        if self.seconds > 0.0 {
            let apart = other.mean() - self.mean();
            let both = self.seconds + other.seconds;
            self.second += apart * apart * (self.seconds * other.seconds / both);
        }
        self.seconds += other.seconds;
        self.first += other.first;
        self.second += other.second;
    }

    fn mean(&self) -> f64 {
        self.first / self.seconds
    }

    /// ∫ y² dt.
    fn square(&self) -> f64 {
        self.second + self.first * self.mean()
    }
}

pub(super) fn sums(
    columns: &Columns<'_>,
    course: &Course,
    span: Span,
    (period, closes): (Option<f64>, bool),
) -> Result<Sums, Error> {
    let (count, elements) = (columns.probes.len(), columns.elements.len());
    // The last period: in those before it a circuit may still settle.
    let whole = period.map(|period| (span.to - period).max(span.from));
    let omega = period.map(|period| TAU / period);
    let mut works = vec![0.0; elements];
    let mut all = vec![Moments::default(); count];
    let mut periods = all.clone();
    let mut harmonics = vec![Complex::default(); count];
    let mut extrema = Extrema::of(count);
    let mut known = Vec::new();
    let mut last: Vec<Option<DVector<f64>>> = vec![None; course.stretches.len()];
    let mut first = last.clone();
    for (k, stretch) in course.stretches.iter().enumerate() {
        let (at, mut w) = Linear::of(&mut known, &course.systems, stretch);
        let linear = &known[at];
        first[k] = Some(&linear.rows[0] * &w);
        let mut from = stretch.from;
        let cuts = [span.from, whole.unwrap_or(span.from), stretch.to];
        for cut in cuts {
            let to = cut.min(stretch.to);
            if to <= from {
                continue;
            }
            let mut motion = linear.over(to - from);
            if from >= span.from {
                let counts = whole.is_some_and(|whole| from >= whole);
                let integrals = integrals::over(&mut motion, &w, omega.filter(|_| counts))?;
                let mean = &linear.rows[0] * &integrals.mean;
                let factor = &linear.rows[0] * &integrals.factor;
                let seconds = to - from;
                for c in 0..count {
                    let stretch = Moments {
                        seconds,
                        first: mean[c],
                        second: factor.row(c).norm_squared(),
                    };
                    all[c].add(stretch);
                    if counts {
                        periods[c].add(stretch);
                    }
                }
                for (work, (i, v)) in works.iter_mut().zip(&columns.elements) {
                    *work += factor.row(*i).dot(&factor.row(*v)) + mean[*i] * mean[*v] / seconds;
                }
                if let (Some(harmonic), Some(omega)) = (&integrals.harmonic, omega) {
                    let turn = Complex::from_polar(1.0, -omega * (from - span.from));
                    for (c, sum) in harmonics.iter_mut().enumerate() {
                        let row = linear.rows[0].row(c);
                        let value: Complex<f64> =
                            row.iter().zip(harmonic.iter()).map(|(r, h)| h * *r).sum();
                        *sum += turn * value;
                    }
                }
                extrema.over(&mut motion, &w)?;
            }
            w = motion.after(0, &w)?;
            from = to;
        }
        last[k] = Some(&linear.rows[0] * &w);
    }
    // Areas of impulses, and by what the last period has of them.
    let mut areas = vec![0.0; count];
    let mut struck = areas.clone();
    for leap in &course.leaps {
        if leap.t < span.from || leap.into == 0 {
            continue;
        }
        let sides = (last[leap.into - 1].as_ref(), first[leap.into].as_ref());
        if let (Some(before), Some(after)) = sides {
            for c in 0..count {
                areas[c] += leap.areas[c];
                if whole.is_some_and(|whole| leap.t >= whole) {
                    struck[c] += leap.areas[c].abs();
                }
            }
            let sources = work_in(columns, leap, (before, after));
            for (work, more) in works.iter_mut().zip(sources) {
                *work += more;
            }
        }
    }
    let costs = costs(
        columns,
        course,
        (span.from, closes),
        (&first, &last),
        &extrema,
    );
    // Areas of a rounding are no impulses.
    let has_impulses = |c: usize| {
        let Moments { seconds, .. } = periods[c];
        struck[c] > FUNDAMENTAL * (periods[c].square() * seconds).sqrt()
    };
    let distortions = columns.shown.iter().map(|&c| {
        if period.is_none() || has_impulses(c) {
            return None;
        }
        let Moments {
            seconds, second, ..
        } = periods[c];
        let harmonic: f64 = harmonics[c].norm();
        let fundamental = 2.0 * (harmonic / seconds).powi(2);
        distortion(periods[c].mean(), second / seconds, fundamental)
    });
    let struck = columns.shown.iter().map(|&c| has_impulses(c));
    Ok(Sums {
        distortion: distortions.collect(),
        struck: struck.collect(),
        mean: all
            .iter()
            .zip(&areas)
            .map(|(y, area)| y.first + area)
            .collect(),
        square: all.iter().map(Moments::square).collect(),
        work: works,
        least: extrema.least,
        greatest: extrema.greatest,
        costs,
    })
}

/// The outputs at one end of each stretch.
type Ends<'a> = &'a [Option<DVector<f64>>];

/// Of changes of state after a time; where the course closes, its end and its start are an instant too.
fn costs(
    columns: &Columns<'_>,
    course: &Course,
    (from, closes): (f64, bool),
    (first, last): (Ends<'_>, Ends<'_>),
    extrema: &Extrema,
) -> Vec<Costs> {
    let mut commutations = Commutations::of(columns, (&extrema.least, &extrema.greatest));
    let stretches = &course.stretches;
    let same = SAME_TIME * stretches.last().map_or(0.0, |last| last.to.abs());
    let following = (1..stretches.len()).map(|k| (k - 1, k));
    let following = following.filter(|(_, k)| stretches[*k].from > from + same);
    let closing = closes.then(|| (stretches.len().saturating_sub(1), 0));
    for (a, b) in following.chain(closing) {
        let positions = [a, b].map(|k| &course.systems[stretches[k].system].key.switches);
        let moved = |name: &str| {
            let at = columns.switches.iter().position(|own| own == name)?;
            let [was, is] = positions.map(|switches| switches.get(at).copied());
            is.filter(|_| was != is)
        };
        if let (Some(before), Some(after)) = (&last[a], &first[b]) {
            commutations.see(moved, (before.as_slice(), after.as_slice()));
        }
    }
    commutations.costs
}

/// Work into sources and storage in a leap, J: the area of one factor's impulse times the other factor. That moves linearly with the charge
/// (flux) between its values before and after in storage, and where an edge of a source acts without devices; what devices and switches take comes
/// after the edge. What a leap loses is no element's.
fn work_in(
    columns: &Columns<'_>,
    leap: &Leap,
    (before, after): (&DVector<f64>, &DVector<f64>),
) -> Vec<f64> {
    let areas = &leap.areas;
    let middle = |c: usize| 0.5 * (before[c] + after[c]);
    let elements = columns.circuit.elements.iter().zip(&columns.elements);
    let work = elements.map(|(element, &(i, v))| match element.kind {
        Kind::Capacitor(_) | Kind::Inductor(_) => areas[i] * middle(v) + areas[v] * middle(i),
        Kind::VoltageSource(_) | Kind::CurrentSource(_) => {
            let by = |area: usize, at: usize| {
                leap.direct[area] * middle(at) + (areas[area] - leap.direct[area]) * after[at]
            };
            by(i, v) + by(v, i)
        }
        _ => 0.0,
    });
    work.collect()
}
