//! How what measurements find moves with the pieces of the signals that they see.

use super::formula::Formula;
use super::measurement::{Measured, NamedMeasurement, expression};
use crate::measure::{
    Curves, Found, INTERVALS, Instant, Measurement, Rival, Signals, Trace, TraceSlopes, VALUES,
    basis, interpolated,
};

/// dJ = Σ (values · δvalues) + begins · δbegins + lengths · δlengths + Σ results · δresults of one measurement J.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Weights {
    /// By piece of a lap and signal.
    pub(crate) values: Vec<[f64; VALUES]>,
    /// By piece of a lap, 1/s.
    pub(crate) begins: Vec<f64>,
    /// By piece of a lap, 1/s.
    pub(crate) lengths: Vec<f64>,
    /// By measurement: what is used of it.
    pub(crate) results: Vec<f64>,
    /// What it would be if an extremum that is reached several times were another one of these.
    pub(crate) rivals: Vec<Tie>,
}

/// Another time at which an extremum is reached with the same value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tie {
    /// When it is reached and counts, and when again, s.
    pub(crate) times: (f64, f64),
    /// What the values span.
    pub(crate) span: f64,
    /// Of the measurement if this one counted; of the value there, for when it is reached.
    pub(crate) weights: Weights,
    /// Those of the value that counts, for when it is reached.
    pub(crate) value: Option<Weights>,
}

/// A waveform, and of which pieces of the signals its own are parts, of one lap where it repeats: number, where on it, and how much of it.
struct Traced<'a> {
    trace: Trace<'static>,
    places: Vec<(usize, f64, f64)>,
    formula: &'a Formula,
    less: Option<&'a Formula>,
}

impl Traced<'_> {
    /// Of its k-th piece.
    fn place(&self, k: usize) -> (usize, f64, f64) {
        self.places[k % self.places.len()]
    }
}

/// What measurements saw and found.
struct Scene<'a> {
    curves: &'a Curves,
    span: (f64, f64),
    /// Part of what values span to which extrema are the same.
    same: f64,
    /// Of all measurements; NaN where one has none.
    results: Vec<f64>,
}

/// The derivatives of measurements that are needed, by themselves or by others, and found something; none where they are not known, as where an expression jumps by itself. An extremum that
/// is reached again to `same`, a part of what the values span, has rivals.
pub(crate) fn weights(
    all: &[NamedMeasurement],
    (curves, same): (&Curves, f64),
    found: &[Measured],
    needed: &mut [bool],
) -> Vec<Option<Weights>> {
    let value = |measured: &Measured| measured.result.as_ref().map_or(f64::NAN, |f| f.value);
    let scene = Scene {
        span: Signals::Curves(curves).span(),
        curves,
        same,
        results: found.iter().map(value).collect(),
    };
    let of = |k: usize| scene.weights(all[k].what.as_ref()?, found[k].result.as_ref().ok()?);
    let mut weights: Vec<Option<Weights>> = vec![None; all.len()];
    let mut left: Vec<usize> = (0..all.len()).filter(|k| needed[*k]).collect();
    while let Some(k) = left.pop() {
        weights[k] = of(k);
        let results = weights[k]
            .iter()
            .flat_map(|own| own.results.iter().enumerate());
        for (used, _) in results.filter(|(_, weight)| **weight != 0.0) {
            if !std::mem::replace(&mut needed[used], true) {
                left.push(used);
            }
        }
    }
    weights
}

impl<'a> Scene<'a> {
    fn weights(&self, what: &'a Measurement<Formula>, found: &Found) -> Option<Weights> {
        let (pieces, values) = (self.curves.len(), self.curves.values() / VALUES);
        let mut into = Weights {
            values: vec![[0.0; VALUES]; values],
            begins: vec![0.0; pieces],
            lengths: vec![0.0; pieces],
            results: vec![0.0; self.results.len()],
            rivals: vec![],
        };
        let time = |name: &str| found.at.iter().find(|(own, _)| *own == name);
        let time = |name: &str| time(name).map(|(_, t)| *t);
        match what {
            Measurement::Over(over, of, window) => {
                let (from, to) = (time("from")?, time("to")?);
                let traced = self.traced(of, None)?;
                let slopes = traced.trace.over_slopes(*over, (from, to), self.same);
                let (slopes, rivals) = slopes.ok()??;
                let rivals = self.apart(&traced, &slopes, rivals);
                let place = |slopes: &TraceSlopes, into: &mut Weights| {
                    self.add(&traced, slopes, 1.0, into);
                    let ends = [
                        (&window.from, from, slopes.from),
                        (&window.to, to, slopes.to),
                    ];
                    for (instant, t, slope) in ends {
                        // What the run ends stays where it is.
                        let inside = t > self.span.0 && t < self.span.1;
                        if let Some(instant) = instant.as_ref().filter(|_| inside) {
                            self.instant(instant, t, slope, into)?;
                        }
                    }
                    Some(())
                };
                let placed = |slopes: &TraceSlopes| {
                    let mut weights = into.clone();
                    place(slopes, &mut weights)?;
                    Some(weights)
                };
                let ties = rivals.into_iter().map(|rival| {
                    let times = (rival.beside, rival.at);
                    Some(Tie {
                        times,
                        span: rival.span,
                        weights: placed(&rival.slopes)?,
                        value: match &rival.value {
                            Some(slopes) => Some(placed(slopes)?),
                            None => None,
                        },
                    })
                });
                let ties = ties.collect::<Option<Vec<_>>>()?;
                place(&slopes, &mut into)?;
                into.rivals = ties;
            }
            Measurement::Find { of, slope, when } => {
                let t = time("at")?;
                let traced = self.traced(of, None)?;
                let slopes = traced.trace.at_slopes(t, *slope)?;
                self.add(&traced, &slopes, 1.0, &mut into);
                self.instant(when, t, slopes.from, &mut into)?;
            }
            Measurement::When(when) => self.instant(when, found.value, 1.0, &mut into)?,
            Measurement::Delay(trig, targ) => {
                self.instant(trig, time("trig")?, -1.0, &mut into)?;
                self.instant(targ, time("targ")?, 1.0, &mut into)?;
            }
            Measurement::Param(of) => self.number(of, 1.0, &mut into),
        }
        let all = into.values.iter().flatten();
        let all = all.chain(&into.begins).chain(&into.lengths);
        let finite = all.chain(&into.results).all(|weight| weight.is_finite());
        finite.then_some(into)
    }

    /// Rivals but those that are one lap or more away from where the extremum counts, or from another one: they move together.
    fn apart(&self, traced: &Traced<'a>, own: &TraceSlopes, rivals: Vec<Rival>) -> Vec<Rival> {
        if !self.curves.repeats() {
            return rivals;
        }
        let place = |k: usize| {
            let (whole, from, part) = traced.place(k);
            (whole % self.curves.len(), from, part)
        };
        let together = |a: &TraceSlopes, b: &TraceSlopes| {
            let mut pieces = a.pieces.iter().zip(&b.pieces);
            (a.from, a.to, a.pieces.len()) == (b.from, b.to, b.pieces.len())
                && pieces.all(|((k, a), (l, b))| place(*k) == place(*l) && a == b)
        };
        let mut apart: Vec<Rival> = Vec::new();
        for rival in rivals {
            let counts = rival.value.as_ref().unwrap_or(own);
            let again = together(&rival.slopes, counts)
                || apart
                    .iter()
                    .any(|other| together(&rival.slopes, &other.slopes));
            if !again {
                apart.push(rival);
            }
        }
        apart
    }

    /// Adds what an expression of results moves with.
    fn number(&self, of: &Formula, factor: f64, into: &mut Weights) {
        let slopes = of.slopes(f64::NAN, &[], &self.results);
        for (own, slope) in into.results.iter_mut().zip(slopes.results) {
            *own += factor * slope;
        }
    }

    /// Adds what an instant moves with.
    fn instant(
        &self,
        instant: &'a Instant<Formula>,
        t: f64,
        factor: f64,
        into: &mut Weights,
    ) -> Option<()> {
        match instant {
            Instant::At(at) => self.number(at, factor, into),
            Instant::Crossing { left, right, .. } => {
                let traced = self.traced(left, Some(right))?;
                let slopes = traced.trace.crossing_slopes(t)?;
                self.add(&traced, &slopes, factor, into);
            }
        }
        Some(())
    }

    fn traced(&self, formula: &'a Formula, less: Option<&'a Formula>) -> Option<Traced<'a>> {
        let (trace, places) = match (formula, less) {
            (Formula::Signal(index), None) => {
                let places = (0..self.curves.len()).map(|k| (k, 0.0, 1.0));
                (self.curves.signal(*index), places.collect())
            }
            _ => {
                let value = |t: f64, row: &[f64]| {
                    let less = less.map_or(0.0, |less| less.value(t, row, &self.results));
                    formula.value(t, row, &self.results) - less
                };
                self.curves
                    .drawn(&expression(&value, formula, less))
                    .ok()??
            }
        };
        Some(Traced {
            trace,
            places,
            formula,
            less,
        })
    }

    /// Adds derivatives to the pieces of a waveform, times a factor.
    fn add(&self, traced: &Traced<'a>, slopes: &TraceSlopes, factor: f64, into: &mut Weights) {
        for (k, own) in &slopes.pieces {
            let (whole, from, part) = traced.place(*k);
            let ((begin, length, _), signals) = self.curves.get(whole);
            let (whole, columns) = (whole % self.curves.len(), signals.len());
            into.begins[whole] += factor * own.begin;
            into.lengths[whole] += factor * (from * own.begin + part * own.length);
            let values = &mut into.values[columns * whole..columns * (whole + 1)];
            for (j, weight) in own.values.iter().enumerate() {
                let weight = factor * weight;
                if weight == 0.0 {
                    continue;
                }
                if let (Formula::Signal(index), None) = (traced.formula, traced.less) {
                    values[*index][j] += weight;
                    continue;
                }
                let s = from + part * j as f64 / INTERVALS as f64;
                let t = begin + s * length;
                let row: Vec<f64> = signals.iter().map(|y| interpolated(y, s)).collect();
                let basis = basis(s);
                let mut along = |formula: &Formula, weight: f64| {
                    let slopes = formula.slopes(t, &row, &self.results);
                    into.begins[whole] += weight * slopes.time;
                    into.lengths[whole] += weight * slopes.time * s;
                    for (own, slope) in into.results.iter_mut().zip(slopes.results) {
                        *own += weight * slope;
                    }
                    for (values, slope) in values.iter_mut().zip(slopes.signals) {
                        if slope != 0.0 {
                            let both = values.iter_mut().zip(basis);
                            both.for_each(|(own, basis)| *own += weight * slope * basis);
                        }
                    }
                };
                along(traced.formula, weight);
                if let Some(less) = traced.less {
                    along(less, -weight);
                }
            }
        }
    }
}
