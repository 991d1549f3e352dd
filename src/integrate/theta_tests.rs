//! The steppers against published rows, exact columns and themselves.

use nalgebra::{DVector, dvector};

use crate::integrate::Run;
use crate::integrate::fixtures;
use crate::integrate::run::{Frame, Grid, Log, run};
use crate::integrate::step::Scheme;
use crate::integrate::theta::{Setup, Start, Stepping, Theta};
use crate::lcs::Lcs;
use crate::settings::Settings;

pub(super) const SICONOS: Scheme = Scheme {
    theta: 0.5,
    gamma: 1.0,
};

pub(super) fn stepper<'a>(
    lcs: &Lcs,
    x: DVector<f64>,
    scheme: Scheme,
    stepping: Stepping,
) -> Theta<'a> {
    let lcs = lcs.clone();
    Theta::new(Setup {
        reduce: Box::new(move |_| Ok(lcs.clone())),
        position: vec![],
        thresholds: vec![],
        t: 0.0,
        start: Start::State(x),
        scheme,
        stepping,
        longest: f64::INFINITY,
        settings: Settings::default(),
    })
    .unwrap()
}

pub(super) fn simulate(
    lcs: &Lcs,
    x: DVector<f64>,
    scheme: Scheme,
    stepping: Stepping,
    grid: Grid,
) -> Run {
    let mut theta = stepper(lcs, x, scheme, stepping);
    let frame = Frame {
        title: lcs.title.clone(),
        names: lcs.outputs.names.clone(),
        units: lcs.outputs.units.clone(),
        grid,
        method: "theta".into(),
        plan: vec![],
        notes: vec![],
        progress: None,
    };
    run(
        &mut theta,
        frame,
        Log::new(lcs.outputs.names.len(), 0.0, false),
    )
    .unwrap()
}

fn row(run: &Run, k: usize) -> &[f64] {
    let width = run.waveforms.names.len();
    &run.waveforms.values[k * width..(k + 1) * width]
}

fn close(value: f64, expected: f64, digits: f64) {
    assert!(
        (value - expected).abs() <= digits,
        "{value} is not {expected} within {digits}"
    );
}

/// Half a unit of the tenth significant digit, with which the reference rows are quoted.
fn quoted(value: f64, expected: f64) {
    close(
        value,
        expected,
        6e-10 * 10_f64.powf(expected.abs().log10().ceil()),
    );
}

const MS5: f64 = 5e-3;

#[test]
fn siconos_rows_of_the_half_wave_rectifier() {
    let grid = Grid {
        tstart: 0.0,
        tstep: 1e-5,
        tstop: MS5,
    };
    let start = dvector![10.0, 0.0];
    let run = simulate(
        &fixtures::rlcd(),
        start,
        SICONOS,
        Stepping::Fixed(1e-5),
        grid,
    );
    quoted(row(&run, 1)[0], 9.851851852);
    quoted(row(&run, 1)[1], 9.925925926e-3);
    quoted(row(&run, 499)[0], 2.641438992);
    quoted(row(&run, 499)[1], -0.01406577463);
    close(row(&run, 500)[0], 2.741228, 1e-6);
}

#[test]
fn siconos_rows_of_the_bridge() {
    let grid = Grid {
        tstart: 0.0,
        tstep: 1e-6,
        tstop: MS5,
    };
    let start = dvector![10.0, 0.0];
    let run = simulate(
        &fixtures::bridge(),
        start,
        SICONOS,
        Stepping::Fixed(1e-6),
        grid,
    );
    quoted(row(&run, 1)[0], 9.989510751);
    quoted(row(&run, 1)[1], 9.994755376e-4);
    quoted(row(&run, 1000)[0], -4.97842134);
    quoted(row(&run, 1000)[1], -0.0322822484);
    quoted(row(&run, 4999)[0], 0.7863839107);
    quoted(row(&run, 4999)[1], -2.830718054e-3);
}

#[test]
fn siconos_rows_of_the_bridge_with_capacitor_filter() {
    let grid = Grid {
        tstart: 0.0,
        tstep: 1e-6,
        tstop: MS5,
    };
    let start = dvector![10.0, 0.0, 0.0];
    let lcs = fixtures::bridge_cap_filter();
    let run = simulate(&lcs, start, Scheme::MOREAU, Stepping::Fixed(1e-6), grid);
    quoted(row(&run, 0)[0], 7.692307692);
    quoted(row(&run, 1)[0], 7.685804319);
    quoted(row(&run, 1000)[0], -4.25133218);
    assert_eq!(run.stats.jumps, 1);
    let impulse = run.impulses.iter().find(|i| i.name == "i(df1)").unwrap();
    close(impulse.area, 3e-6 / 1.3, 1e-18);
}
