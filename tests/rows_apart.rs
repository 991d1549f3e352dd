//! Linear circuits whose rows are many periods apart: the rows that they share with a run a thousand times as fine are the same.
//!
//! `CIRC_ROWS_APART=1000` tries as many circuits, `CIRC_ROWS_APART_SEED` begins elsewhere.
#![allow(missing_docs, reason = "tests")]

use std::env;
use std::f64::consts::TAU;

use circ::circuit::{ElaborateOptions, elaborate};
use circ::diagnostic::SourceMap;
use circ::integrate::{Method, Run, SimOptions, simulate};
use circ::mna::behaviour;

const ROWS: usize = 4;
/// Print steps of the fine run in one of the coarse.
const FINER: usize = 1000;

/// The next of a sequence (SplitMix64), in [0, 1).
fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Of the source, V.
const AMPLITUDE: f64 = 10.0;
/// No capacitor is larger, F: nothing would be left of the source behind it.
const LARGEST: f64 = 1e-3;

/// One to three resonances of 1 to 1e7 rad/s in a row on a sine or a pulse train.
struct Ladder {
    cards: String,
    /// The coarse print step, s.
    step: f64,
    /// A bound of the fastest resonance, rad/s.
    fastest: f64,
    /// Of the first inductor where it swings with all of the source, A.
    current: f64,
}

fn ladder(seed: u64) -> Ladder {
    let state = &mut seed.wrapping_mul(0x2545_f491_4f6c_dd1d);
    let mut decades = |from: f64, to: f64| 10f64.powf(from + (to - from) * random(state));
    let f = decades(1.0, 5.0);
    let mut cards = if decades(0.0, 1.0) < 4.0 {
        let (edge, width, period) = (0.1 / f, 0.4 / f, 1.0 / f);
        format!("v1 n0 0 pulse(0 {AMPLITUDE} 0 {edge:e} {edge:e} {width:e} {period:e})\n")
    } else {
        format!("v1 n0 0 sin(0 {AMPLITUDE} {f:e})\n")
    };
    let count = decades(0.0, 0.6).floor() as usize;
    let (mut fastest, mut current): (f64, f64) = (TAU * f, 0.0);
    // 1/C and 1/L of the section before.
    let mut before = (0.0, 0.0);
    for k in 0..count {
        let (omega, l) = (decades(0.0, 7.0), decades(-7.0, -1.0));
        let c = (1.0 / (l * omega * omega)).min(LARGEST);
        let (r, load) = (decades(-3.0, 3.0), decades(0.0, 12.0));
        // A capacitor swings with both inductors beside it.
        let own = (1.0 / c, 1.0 / l);
        for squared in [own.0 * own.1, before.0 * (before.1 + own.1)] {
            fastest = fastest.max((2.0 * squared).sqrt());
        }
        if k == 0 {
            current = AMPLITUDE * (c / l).sqrt();
        }
        before = own;
        let next = k + 1;
        let section = [
            format!("r{k} n{k} a{k} {r:e}\nl{k} a{k} n{next} {l:e}\n"),
            format!("c{k} n{next} 0 {c:e}\nrp{k} n{next} 0 {load:e}\n"),
        ];
        cards.extend(section);
    }
    let (r, c) = (decades(0.0, 3.0), decades(-15.0, -9.0));
    let last = format!("rs n{count} s {r:e}\ncs s 0 {c:e}\n.save v(s) i(l0)\n");
    Ladder {
        cards: cards + &last,
        step: decades(-1.0, 2.0) / f,
        fastest,
        current,
    }
}

fn run(cards: &str, step: f64, stop: f64) -> Run {
    let mut sources = SourceMap::default();
    let text = format!("rows apart\n{cards}.tran {step:e} {stop:e} uic\n.end\n");
    let root = sources.add("rows.cir", text);
    let (netlist, _) = circ::netlist::parse(&mut sources, root, &|_| {
        Err(std::io::ErrorKind::NotFound.into())
    });
    let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
    let circuit = circuit.unwrap_or_else(|| panic!("{findings:?}"));
    let behaviour = behaviour(&circuit).expect("a behaviour");
    let options = SimOptions {
        method: Method::Exact,
        ..SimOptions::default()
    };
    simulate(&circuit, &behaviour, options).unwrap_or_else(|e| panic!("{cards}: {e}"))
}

/// The largest difference of a row that both have, relative to the signal or to what the source could make of it.
fn apart(ladder: &Ladder) -> f64 {
    let (cards, step) = (&ladder.cards, ladder.step);
    let stop = step * ROWS as f64;
    let (coarse, fine) = (
        run(cards, step, stop),
        run(cards, step / FINER as f64, stop),
    );
    let mut worst: f64 = 0.0;
    for (signal, least) in [AMPLITUDE, ladder.current].into_iter().enumerate() {
        let [coarse, fine] =
            [&coarse, &fine].map(|run| run.waveforms.column(signal).collect::<Vec<f64>>());
        let size = fine.iter().fold(least, |most: f64, v| most.max(v.abs()));
        assert_eq!((coarse.len(), fine.len()), (ROWS + 1, ROWS * FINER + 1));
        for (k, value) in coarse.iter().enumerate() {
            worst = worst.max((value - fine[k * FINER]).abs() / size);
        }
    }
    worst
}

#[test]
fn rows_do_not_depend_on_how_far_apart_they_are() {
    let number = |name: &str| env::var(name).ok().and_then(|value| value.parse().ok());
    let (count, first): (u64, u64) = (
        number("CIRC_ROWS_APART").unwrap_or(60),
        number("CIRC_ROWS_APART_SEED").unwrap_or(1),
    );
    for seed in first..first + count {
        let ladder = ladder(seed);
        // An exponential is over up to sixteen rows, and known to the rounding of the angle that the fastest resonance turns in them.
        let angle = ladder.fastest * ladder.step * 16.0;
        let off = apart(&ladder);
        let (step, cards) = (ladder.step, &ladder.cards);
        assert!(
            off <= 1e-10 + 1e-15 * angle,
            "seed {seed}, step {step:e}: {off:e}\n{cards}"
        );
    }
}
