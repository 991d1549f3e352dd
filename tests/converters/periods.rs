//! Measurements at the end of long runs of random converters: with the periods before them taken together, and with everything seen.

use circ::analysis::transient;
use circ::{Method, Model, SimOptions};

use crate::circuit::states;
use crate::topologies::case;

/// Both agree to this part of the value or of what the signal spans, whichever is larger.
const TOLERANCE: f64 = 1e-9;

/// Runs are so many times as long: 40 to 100 periods, whose pieces are not too many to be seen as a whole.
const LONGER: f64 = 20.0;

/// What came of some circuits.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    pub(crate) compared: usize,
    pub(crate) refused: usize,
    pub(crate) wrong: Vec<String>,
}

/// `None` where there is no run, or measurements do not see all of it.
fn measured(text: &str) -> Option<Vec<(String, Option<f64>)>> {
    let model = Model::parse(text, "random.cir").ok()?;
    let finished = transient(
        &model,
        SimOptions {
            method: Method::Exact,
            ..SimOptions::default()
        },
    );
    let (run, found) = finished.run.filter(|_| finished.error.is_none())?;
    if run
        .notes
        .iter()
        .any(|note| note.code == "measured-on-rows" || note.code == "rows-apart")
    {
        return None;
    }
    let value = |m: &circ::circuit::Measured| m.result.as_ref().ok().map(|found| found.value);
    Some(
        found
            .measured
            .iter()
            .map(|m| (m.name.clone(), value(m)))
            .collect(),
    )
}

/// Compares what is measured of one circuit.
pub(crate) fn compare(seed: u64, tally: &mut Tally) {
    let mut case = case(seed);
    let circuit = &mut case.circuit;
    circuit.stop *= LONGER;
    circuit.rows = 1000;
    let signals = states(circuit);
    let Some(first) = signals.first() else {
        tally.refused += 1;
        return;
    };
    let mut text = circuit.text();
    text.truncate(text.rfind(".end").unwrap_or(text.len()));
    // No simple fractions: an edge on an end of the window is in it or not by rounding.
    let window = [0.9273, 0.9911].map(|part| part * circuit.stop);
    let window = format!("from={:e} to={:e}", window[0], window[1]);
    for (k, signal) in signals.iter().take(3).enumerate() {
        text += &format!(
            ".meas tran a{k} avg {signal} {window}\n.meas tran p{k} pp {signal} {window}\n"
        );
    }
    let late = measured(&format!("{text}.end\n"));
    let seen = measured(&format!(
        "{text}.meas tran whole max {first} from=0\n.end\n"
    ));
    let (Some(late), Some(seen)) = (late, seen) else {
        tally.refused += 1;
        return;
    };
    tally.compared += 1;
    for pair in late.chunks_exact(2).zip(seen.chunks_exact(2)) {
        let size = pair
            .1
            .iter()
            .filter_map(|m| m.1)
            .fold(0.0, |m: f64, v| m.max(v.abs()));
        for (a, b) in pair.0.iter().zip(pair.1) {
            let same = match (a.1, b.1) {
                (Some(a), Some(b)) => (a - b).abs() <= TOLERANCE * size,
                (a, b) => a == b,
            };
            if !same {
                tally.wrong.push(format!(
                    "{seed}: {}: {:?}, and {:?} where all is seen\n{text}",
                    a.0, a.1, b.1
                ));
            }
        }
    }
}
