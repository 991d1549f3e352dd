//! Derivatives of measurements of random converters against extrapolated differences of exact runs, and backward against forward along the run.

use std::panic::{AssertUnwindSafe, catch_unwind};

use circ::analysis::{Gradient, SensitivityMethod, SensitivityOptions, sensitivity, transient};
use circ::settings::Settings;
use circ::{Method, Model, SimOptions};

use crate::circuit::{Part, states};
use crate::random::Random;
use crate::topologies::{Style, plain_case};

/// Derivatives agree to this part of the measurement or of its change with ln p, whichever is larger.
const TOLERANCE: f64 = 1e-6;

/// Backward and forward along the run they agree to this part of the largest p ∂J/∂p of a measurement or of what it measures, and a value that has
/// decayed to nothing beside what its signal spans, to rounding of that, is known to this part of the rounding.
const BOTH_WAYS: f64 = 1e-12;

/// And besides to so many roundings of the terms that they are sums of: inductors that are coupled by 0.99 have terms of 19 for a derivative of 1e-3 (71025), of which 1e-12 is less than
/// one.
const OF_TERMS: f64 = 4.0 * f64::EPSILON;

/// Differences of two sizes that are this far apart tell nothing: an event changes its order, or rounding shows.
const KNOWN: f64 = 2e-7;

/// Steps of the differences, relative.
const STEPS: [f64; 2] = [4e-5, 1e-5];

/// What came of the derivatives of some circuits.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    pub(crate) compared: usize,
    pub(crate) circuits: usize,
    /// Derivatives that were computed both ways.
    pub(crate) both: usize,
    /// Circuits whose derivatives along sparse steps were compared, and where there are none.
    pub(crate) in_steps: usize,
    pub(crate) without_steps: Vec<String>,
    /// Where differences tell nothing.
    pub(crate) unknown: usize,
    /// Circuits without a derivative, and why.
    pub(crate) refused: Vec<String>,
    pub(crate) wrong: Vec<String>,
}

fn measured(model: &Model) -> Option<Vec<Option<f64>>> {
    let options = SimOptions {
        method: Method::Exact,
        ..SimOptions::default()
    };
    let finished = transient(model, options);
    let (_, found) = finished.run.filter(|_| finished.error.is_none())?;
    let value = |m: &circ::circuit::Measured| m.result.as_ref().ok().map(|f| f.value);
    Some(found.measured.iter().map(value).collect())
}

/// (8 (f(h) − f(−h)) − (f(2h) − f(−2h)))/12h by measurement.
fn difference(model: &Model, name: &str, value: f64, h: f64) -> Option<Vec<Option<f64>>> {
    let at = |k: f64| {
        let mut model = model.clone();
        model.set(name, value * (1.0 + k * h)).ok()?;
        measured(&model)
    };
    let [a, b, c, d] = [at(-2.0)?, at(-1.0)?, at(1.0)?, at(2.0)?];
    let of = |k: usize| Some((8.0 * (c[k]? - b[k]?) - (d[k]? - a[k]?)) / (12.0 * h));
    Some((0..a.len()).map(of).collect())
}

/// Compares the derivatives to these elements backward and forward along the run.
fn both_ways((seed, model): (u64, &Model), elements: &[(&str, f64)], tally: &mut Tally) {
    let by = |method| {
        let options = SensitivityOptions {
            to: elements
                .iter()
                .map(|(name, _)| (*name).to_string())
                .collect(),
            method,
            ..SensitivityOptions::default()
        };
        sensitivity(model, &options)
    };
    let found = (
        by(SensitivityMethod::Forward),
        by(SensitivityMethod::Adjoint),
    );
    let (Ok(forward), Ok(backward)) = found else {
        return;
    };
    if backward.passes.backward == 0 {
        return;
    }
    for (a, b) in forward.of.iter().zip(&backward.of) {
        let pairs = a.to.iter().zip(&b.to).zip(elements);
        let scaled = pairs.filter_map(|((a, b), (_, value))| Some((value * a.1?, value * b.1?)));
        let scaled: Vec<(f64, f64)> = scaled.collect();
        let size = |a: &Gradient| a.value.as_ref().map_or(0.0, |value| value.abs());
        let of_signal = forward.of.iter().filter(|b| b.name[1..] == a.name[1..]);
        let span = of_signal.fold(0.0, |m: f64, b| m.max(size(b)));
        let least = size(a).max(f64::EPSILON * span);
        let largest = scaled.iter().fold(least, |m, pair| m.max(pair.0.abs()));
        for (((own, other), (name, _)), terms) in scaled.iter().zip(elements).zip(&b.terms) {
            tally.both += 1;
            if (own - other).abs() > BOTH_WAYS * largest + OF_TERMS * terms {
                let apart = (own - other).abs() / largest;
                tally.wrong.push(format!(
                    "{seed}: {} to {name}: {own:e} forward, {other:e} backward, {apart:e} apart, terms of {terms:e}",
                    a.name
                ));
            }
        }
    }
}

/// Besides what they state derivatives along sparse steps may be off by this part of the largest p ∂J/∂p of a measurement, of what it measures, or of what others measure of the same signal.
const IN_STEPS: f64 = 1e-5;

/// Compares the derivatives to all of these elements with those along sparse steps, where these are told.
fn in_steps((seed, model): (u64, &Model), elements: &[(&str, f64)], tally: &mut Tally) {
    let with = |large| {
        let own = Settings::default();
        let options = SensitivityOptions {
            to: elements
                .iter()
                .map(|(name, _)| (*name).to_string())
                .collect(),
            settings: Settings {
                large: if large { 0 } else { own.large },
                ..own
            },
            ..SensitivityOptions::default()
        };
        catch_unwind(AssertUnwindSafe(|| sensitivity(model, &options)))
    };
    let (exact, stepped) = match (with(false), with(true)) {
        (Ok(Ok(exact)), Ok(Ok(stepped))) => (exact, stepped),
        (_, Err(_)) => return tally.wrong.push(format!("{seed} panicked in steps")),
        (_, Ok(Err(error))) => return tally.without_steps.push(format!("{seed}: {error}")),
        _ => return,
    };
    let stated = stepped.notes.iter().filter(|note| note.code == "tangents");
    let mut stated = stated.filter_map(|note| {
        let (_, number) = note.text.split_once("be off by ")?;
        number.split(' ').next()?.parse::<f64>().ok()
    });
    let Some(stated) = stated.next_back().filter(|_| stepped.passes.backward > 0) else {
        return tally.without_steps.push(format!("{seed}: otherwise"));
    };
    tally.in_steps += 1;
    for (a, b) in exact.of.iter().zip(&stepped.of) {
        let named = format!("`{}`", a.name);
        let mut notes = exact.notes.iter().chain(&stepped.notes);
        if notes.any(|note| note.code == "one-sided" && note.text.contains(&named)) {
            continue;
        }
        let pairs = a.to.iter().zip(&b.to).zip(elements);
        let scaled = pairs.filter_map(|((a, b), (_, value))| Some((value * a.1?, value * b.1?)));
        let scaled: Vec<(f64, f64)> = scaled.collect();
        let size = |a: &Gradient| a.value.as_ref().map_or(0.0, |value| value.abs());
        let of_signal = exact.of.iter().filter(|b| b.name[1..] == a.name[1..]);
        let span = of_signal.fold(0.0, |m: f64, b| m.max(size(b)));
        let largest = scaled.iter().fold(size(a), |m, pair| m.max(pair.0.abs()));
        // Of what does not move at all nothing but rounding is left.
        if largest.max(span) == 0.0 {
            continue;
        }
        let allowed = stated * largest + IN_STEPS * largest.max(span);
        for ((own, other), (name, _)) in scaled.iter().zip(elements) {
            if (own - other).abs() > allowed {
                tally.wrong.push(format!(
                    "{seed}: {} to {name}: {own:e} exact, {other:e} in steps, {:.1e} of {largest:e} apart, {stated:e} stated",
                    a.name,
                    (own - other).abs() / largest,
                ));
            }
        }
    }
}

/// Compares the derivatives of one circuit to some of its elements.
pub(crate) fn compare(seed: u64, tally: &mut Tally) {
    let mut random = Random::new(seed ^ 0x5e45);
    let style = if seed.is_multiple_of(2) {
        Style::Ideal
    } else {
        Style::Finite
    };
    let case = plain_case(seed, style);
    let circuit = &case.circuit;
    let signals = states(circuit);
    let mut text = circuit.text();
    let end = text.rfind(".end").unwrap_or(text.len());
    text.truncate(end);
    for (k, signal) in signals.iter().take(3).enumerate() {
        let at = 0.79 * circuit.stop;
        text += &format!(
            ".meas tran a{k} avg {signal}\n.meas tran r{k} rms {signal}\n\
             .meas tran f{k} find {signal} at={at:e}\n.meas tran p{k} pp {signal}\n"
        );
    }
    text += ".end\n";
    let Ok(model) = Model::parse(&text, "random.cir") else {
        return tally.refused.push(format!("{seed}: not read"));
    };
    let Some(values) = measured(&model) else {
        return tally.refused.push(format!("{seed}: no exact run"));
    };
    let mut elements: Vec<(&str, f64)> = circuit
        .cards
        .iter()
        .filter_map(|card| match card.part {
            Part::R(value) | Part::C(value, _) | Part::L(value, _) => Some((&*card.name, value)),
            _ => None,
        })
        .collect();
    random.shuffle(&mut elements);
    let all = elements.clone();
    elements.truncate(2);
    let options = SensitivityOptions {
        to: elements
            .iter()
            .map(|(name, _)| (*name).to_string())
            .collect(),
        ..SensitivityOptions::default()
    };
    let found = match catch_unwind(AssertUnwindSafe(|| sensitivity(&model, &options))) {
        Ok(Ok(found)) if found.exact => found,
        Ok(Ok(_)) => return tally.refused.push(format!("{seed}: in steps")),
        Ok(Err(error)) => return tally.refused.push(format!("{seed}: {error}")),
        Err(_) => return tally.wrong.push(format!("{seed} panicked\n{text}")),
    };
    tally.circuits += 1;
    both_ways((seed, &model), &all, tally);
    in_steps((seed, &model), &all, tally);
    for (name, value) in elements {
        let [coarse, fine] = STEPS.map(|h| difference(&model, name, value, h));
        let (Some(coarse), Some(fine)) = (coarse, fine) else {
            tally.unknown += 1;
            continue;
        };
        for (k, gradient) in found.of.iter().enumerate() {
            // Differences to both sides have the mean of two derivatives.
            let named = format!("`{}`", gradient.name);
            let mut notes = found.notes.iter();
            if notes.any(|note| note.code == "one-sided" && note.text.contains(&named)) {
                tally.unknown += 1;
                continue;
            }
            let (Some(a), Some(b), Some(of)) = (coarse[k], fine[k], values[k]) else {
                continue;
            };
            let Some(own) = found.derivative(&gradient.name, name) else {
                tally.wrong.push(format!(
                    "{seed}: no derivative of {} to {name}",
                    gradient.name
                ));
                continue;
            };
            let own = own * value;
            let size = of.abs().max(a.abs()).max(1e-9);
            if (a - b).abs() > KNOWN * size {
                tally.unknown += 1;
                continue;
            }
            tally.compared += 1;
            let apart = (own - a).abs() / size;
            if apart > TOLERANCE {
                tally.wrong.push(format!(
                    "{seed} {}: {} to {name}: {own:e}, but {a:e} and {b:e} by differences\n{text}",
                    case.stage, gradient.name
                ));
            }
        }
    }
}
