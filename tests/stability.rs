//! Stiff and extreme circuits: every one ends with the right answer or with the right refusal, by every method.
//!
//! A case is a netlist in `tests/stability/`; its comments say what is right and how closely each method must meet it
//! (`tests/stability/table.py` tells the form, and makes the table of `docs/stability.md`).
#![allow(missing_docs, reason = "tests")]

use std::path::PathBuf;

use circ::circuit::ElaborateOptions;
use circ::integrate::{Method, Run, SimOptions, simulate};
use circ::mna::behaviour;
use circ::netlist::{load, value};
use circ::settings::Settings;
use circ::solve::lcp::{Lcp, Status};
use circ::solve::{Driver, enumerate};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

const METHODS: [(&str, Method); 3] = [
    ("exact", Method::Exact),
    ("euler", Method::Euler),
    ("theta", Method::Theta),
];

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/stability")
}

fn number(word: &str) -> f64 {
    value::parse(word)
        .unwrap_or_else(|_| panic!("`{word}` is no number"))
        .f64
}

/// Runs a netlist; a refusal comes back in words.
fn run(path: &std::path::Path, method: Method, step: Option<f64>) -> Result<Run, String> {
    let loaded = load(path, &ElaborateOptions::default());
    let circuit = loaded
        .circuit
        .ok_or_else(|| format!("{:?}", loaded.diagnostics))?;
    let behaviour = behaviour(&circuit).map_err(|e| format!("{e:?}"))?;
    let options = SimOptions {
        method,
        step: step.filter(|_| method != Method::Exact),
        ..SimOptions::default()
    };
    simulate(&circuit, &behaviour, options).map_err(|e| e.to_string())
}

/// One `*CHECK` or `*EITHER` line.
struct Check<'a> {
    probe: &'a str,
    words: Vec<(&'a str, &'a str)>,
}

impl<'a> Check<'a> {
    fn of(line: &'a str) -> Option<Self> {
        let rest = line
            .strip_prefix("*CHECK ")
            .or_else(|| line.strip_prefix("*EITHER "))?;
        let (probe, words) = rest.split_once(' ').expect("a probe and what it is");
        let words = words
            .split_whitespace()
            .map(|word| word.split_once('=').expect("key=value"));
        Some(Self {
            probe,
            words: words.collect(),
        })
    }

    fn get(&self, key: &str) -> Option<f64> {
        let word = self.words.iter().find(|(k, _)| *k == key)?;
        Some(number(word.1))
    }

    /// The error at the row nearest to the time asked for, relative to the scale.
    fn error(&self, run: &Run) -> f64 {
        let waves = &run.waveforms;
        let j = waves.find(self.probe).expect("the probe");
        let at = self.get("at").expect("at=");
        let rows = 0..waves.len();
        let k = rows
            .min_by(|&a, &b| {
                (waves.time[a] - at)
                    .abs()
                    .total_cmp(&(waves.time[b] - at).abs())
            })
            .expect("rows");
        assert!((waves.time[k] - at).abs() <= 1e-9 * at, "no row at {at}");
        let found = waves.column(j).nth(k).expect("a value");
        let right: Vec<f64> = ["is", "or"]
            .iter()
            .filter_map(|key| self.get(key))
            .collect();
        let largest = right.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        let scale = self.get("of").unwrap_or(largest);
        assert!(scale > 0.0, "zero needs of=SCALE");
        right
            .iter()
            .map(|right| (found - right).abs() / scale)
            .fold(f64::INFINITY, f64::min)
    }
}

/// Holds every method to what a case says of it; returns how many statements that were.
fn hold(name: &str) -> usize {
    let path = folder().join(format!("{name}.cir"));
    let text = std::fs::read_to_string(&path).expect("a case");
    let checks: Vec<Check<'_>> = text.lines().filter_map(Check::of).collect();
    let line = |prefix: &str| text.lines().find_map(|line| line.strip_prefix(prefix));
    let refuses: Vec<&str> =
        line("*REFUSES ").map_or(Vec::new(), |l| l.split_whitespace().collect());
    let step = line("*STEP ").map(number);
    let mut held = 0;
    for (word, method) in METHODS {
        if refuses.contains(&word) {
            let reason = run(&path, method, step).expect_err("a refusal");
            let said = [
                "no solution",
                "satisfies the circuit equations",
                "contradict each other",
            ];
            assert!(
                said.iter().any(|s| reason.contains(s)),
                "{name}, {word}: {reason}"
            );
            held += 1;
            continue;
        }
        let asked: Vec<&Check<'_>> = checks.iter().filter(|c| c.get(word).is_some()).collect();
        if asked.is_empty() {
            continue;
        }
        let run = run(&path, method, step).unwrap_or_else(|e| panic!("{name}, {word}: {e}"));
        for j in 0..run.waveforms.names.len() {
            let finite = run.waveforms.column(j).all(f64::is_finite);
            assert!(
                finite,
                "{name}, {word}: {} is no number",
                run.waveforms.names[j]
            );
        }
        for check in asked {
            let (error, allowed) = (check.error(&run), check.get(word).unwrap_or(0.0));
            assert!(
                error <= allowed,
                "{name}, {word}: {} is off by {error:.2e}, allowed {allowed:.0e}",
                check.probe
            );
            held += 1;
        }
    }
    held
}

/// A test for each case, and their list.
macro_rules! cases {
    ($($name:ident),* $(,)?) => {
        $(#[test]
        fn $name() {
            let held = hold(&stringify!($name).replace('_', "-"));
            assert!(held > 0, "the case says nothing");
        })*

        const CASES: &[&str] = &[$(stringify!($name)),*];
    };
}

cases! {
    amplitude_giga,
    amplitude_nano,
    amplitudes_together,
    capacitor_loop_through_a_diode,
    capacitors_tied_micro,
    capacitors_tied_pico,
    coupling_one,
    current_against_a_diode,
    current_interrupted,
    diode_across_a_sine,
    diode_across_a_source,
    diode_across_a_source_backward,
    diodes_in_a_ring,
    diodes_in_series,
    floating_between_diodes,
    graded_fifteen_decades,
    inconsistent_capacitors,
    inconsistent_inductors,
    inductor_cut_set_through_a_switch,
    multiplier_forty_diodes,
    multiplier_of_forty_diodes_charging,
    negative_resistor_growing,
    negative_resistor_two_solutions,
    negative_resistor_without_solution,
    picosecond_edges,
    picosecond_pulse,
    positive_feedback_in_the_run,
    positive_feedback_without_solution,
    print_step_of_eighty_periods,
    ringing_after_edges,
    ringing_after_jump,
    source_shorted_by_a_switch,
    ten_thousand_periods,
    ten_thousand_swings,
    values_all_extreme,
    values_lc_fast,
    values_lc_slow,
    values_rc,
    values_rectifier,
    values_rl,
}

#[test]
fn every_case_is_run_and_stands_in_the_table() {
    let page = std::fs::read_to_string(folder().join("../../docs/stability.md")).expect("the page");
    let mut files = 0;
    for entry in std::fs::read_dir(folder()).expect("the folder") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|e| e == "cir") {
            let name = path
                .file_stem()
                .expect("a name")
                .to_string_lossy()
                .into_owned();
            assert!(
                CASES.contains(&name.replace('-', "_").as_str()),
                "{name} is not run"
            );
            assert!(
                page.contains(&format!("stability/{name}.cir")),
                "{name} is not in the table"
            );
            files += 1;
        }
    }
    assert_eq!(files, CASES.len());
}

fn solve(m: DMatrix<f64>, q: &DVector<f64>) -> (Lcp, circ::solve::Solution) {
    let solution = Driver::new(m.clone(), Settings::default().lcp_residual).solve(q);
    (Lcp::new(m, q.clone()).expect("a problem"), solution)
}

/// The natural residual, componentwise.
fn residual(lcp: &Lcp, lambda: &DVector<f64>) -> f64 {
    lambda.zip_map(&lcp.y(lambda), |l, y| l.min(y).abs()).amax()
}

/// Murty's example, on which pivoting in the order of the indices takes 2ⁿ steps: z = (0, …, 0, 1) for q = −1.
#[test]
fn murtys_exponential_example() {
    let n = 40;
    let m = DMatrix::from_fn(n, n, |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Less => 2.0,
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Greater => 0.0,
    });
    let (lcp, solution) = solve(m, &DVector::from_element(n, -1.0));
    assert_eq!(solution.status, Status::Solved);
    assert!(residual(&lcp, &solution.lambda) < 1e-12);
    let expected = DVector::from_fn(n, |i, _| f64::from(u8::from(i == n - 1)));
    assert!(
        (&solution.lambda - expected).amax() < 1e-12,
        "{}",
        solution.lambda
    );
}

/// Beale's degenerate program as a complementarity problem: simplex pivoting by largest coefficient cycles on it. Its optimum is −1/20.
#[test]
fn beales_cycling_example() {
    let a = dmatrix![0.25, -60.0, -0.04, 9.0; 0.5, -90.0, -0.02, 3.0; 0.0, 0.0, 1.0, 0.0];
    let b = dvector![0.0, 0.0, 1.0];
    let c = dvector![-0.75, 150.0, -0.02, 6.0];
    let mut m = DMatrix::zeros(7, 7);
    m.view_mut((0, 4), (4, 3)).copy_from(&a.transpose());
    m.view_mut((4, 0), (3, 4)).copy_from(&-&a);
    let mut q = DVector::zeros(7);
    q.rows_mut(0, 4).copy_from(&c);
    q.rows_mut(4, 3).copy_from(&b);
    let (lcp, solution) = solve(m, &q);
    assert_eq!(solution.status, Status::Solved);
    assert!(
        residual(&lcp, &solution.lambda) < 1e-9,
        "{}",
        solution.lambda
    );
    let value = c.dot(&solution.lambda.rows(0, 4));
    assert!((value + 0.05).abs() < 1e-9, "{value}");
}

/// Degenerate in every pair: forty identical diodes in parallel across zero volts.
#[test]
fn forty_pairs_on_the_edge() {
    let (lcp, solution) = solve(DMatrix::from_element(40, 40, 1.0), &DVector::zeros(40));
    assert_eq!(
        (solution.status.clone(), residual(&lcp, &solution.lambda)),
        (Status::Solved, 0.0)
    );
    let (lcp, solution) = solve(
        DMatrix::from_element(40, 40, 1.0),
        &DVector::from_element(40, -1.0),
    );
    assert_eq!(solution.status, Status::Solved);
    assert!(residual(&lcp, &solution.lambda) < 1e-12);
    assert!((solution.lambda.sum() - 1.0).abs() < 1e-12);
}

/// Monotone and infeasible: the ray proves it. r ≥ 0, Mᵀr ≤ 0 and qᵀr < 0 leave no λ ≥ 0 with Mλ + q ≥ 0.
#[test]
fn infeasible_with_a_proof() {
    let m = dmatrix![0.0, 1.0, 0.0; -1.0, 0.0, 0.0; 0.0, 0.0, 2.0];
    let q = dvector![1.0, -1.0, -3.0];
    let Status::Infeasible(ray) = solve(m.clone(), &q).1.status else {
        panic!("not refused")
    };
    assert!(ray.min() >= 0.0 && q.dot(&ray) < 0.0, "{ray}");
    assert!((m.transpose() * &ray).max() <= 1e-12 * ray.amax(), "{ray}");
}

/// Values from 1e-15 to 1e12 on one diagonal, coupled: right to rounding in every component.
#[test]
fn twenty_seven_decades() {
    let scale: Vec<f64> = (0..10).map(|k| 10_f64.powi(3 * k - 15)).collect();
    let m = DMatrix::from_fn(10, 10, |i, j| {
        let coupling = if i == j { 2.0 } else { -1.0 / 10.0 };
        coupling * (scale[i] * scale[j]).sqrt()
    });
    let q = DVector::from_fn(
        10,
        |i, _| if i % 2 == 0 { -1.0 } else { 0.5 } * scale[i].sqrt(),
    );
    let (lcp, solution) = solve(m, &q);
    assert_eq!(solution.status, Status::Solved);
    let y = lcp.y(&solution.lambda);
    for i in 0..10 {
        let (l, w) = (solution.lambda[i] * scale[i].sqrt(), y[i] / scale[i].sqrt());
        assert!(l.min(w).abs() < 1e-12, "pair {i}: {l:e} {w:e}");
    }
    let oracle = enumerate::solve(&lcp, 1e-12);
    assert_eq!(oracle.len(), 1);
}
