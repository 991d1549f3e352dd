//! The steppers against published rows, exact columns and themselves.

use nalgebra::{DMatrix, DVector, dvector};

use crate::integrate::Run;
use crate::integrate::fixtures;
use crate::integrate::grid::Grid;
use crate::integrate::log::Log;
use crate::integrate::run::{Frame, run};
use crate::integrate::step::Scheme;
use crate::integrate::theta::{Setup, Start, Stepping, Theta};
use crate::lcs::{Lcs, PowerKind, PowerTerm, Rows};
use crate::settings::Settings;

pub(super) const SICONOS: Scheme = Scheme {
    theta: 0.5,
    gamma: 1.0,
};

pub(super) fn stepper(lcs: &Lcs, x: DVector<f64>, scheme: Scheme, stepping: Stepping) -> Theta {
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

/// Exact columns of CIRCUITS 1.2 at 1, 2, 3, 4, 5 ms: (system, start, v_C).
fn exact_columns() -> [(&'static str, Lcs, DVector<f64>, [f64; 5]); 3] {
    let bridge = [
        -4.968108636,
        1.418582834,
        0.372171120,
        -0.903722355,
        0.790322820,
    ];
    let rlcd = [
        -6.447263215,
        2.208187416,
        0.911038067,
        -2.470584256,
        2.800403336,
    ];
    let filter = [
        -4.437266965,
        2.419957461,
        -1.216047855,
        0.541524743,
        -0.190911385,
    ];
    [
        ("bridge", fixtures::bridge(), dvector![10.0, 0.0], bridge),
        ("rlcd", fixtures::rlcd(), dvector![10.0, 0.0], rlcd),
        (
            "filter",
            fixtures::bridge_cap_filter(),
            dvector![10.0, 0.0, 0.0],
            filter,
        ),
    ]
}

fn error_against_exact(
    lcs: &Lcs,
    start: &DVector<f64>,
    exact: &[f64; 5],
    scheme: Scheme,
    stepping: Stepping,
) -> (f64, Run) {
    let grid = Grid {
        tstart: 0.0,
        tstep: 1e-3,
        tstop: MS5,
    };
    let run = simulate(lcs, start.clone(), scheme, stepping, grid);
    let worst = (1..=5)
        .map(|k| (row(&run, k)[0] - exact[k - 1]).abs())
        .fold(0.0, f64::max);
    (worst, run)
}

#[test]
fn order_of_convergence() {
    for (name, lcs, start, exact) in exact_columns() {
        // Behind a bridge with a capacitor λ only enforces constraints: γ does not matter there and θ = ½ is second order.
        let siconos = if name == "filter" { 2.0 } else { 1.0 };
        for (scheme, order) in [
            (Scheme::MOREAU, 1.0),
            (SICONOS, siconos),
            (Scheme::MIDPOINT, 2.0),
        ] {
            let error = |h| error_against_exact(&lcs, &start, &exact, scheme, Stepping::Fixed(h)).0;
            let (coarse, fine) = (error(4e-7), error(1e-7));
            let seen = (coarse / fine).log(4.0);
            assert!(
                (seen - order).abs() < 0.05,
                "{name} {scheme:?}: order {seen}"
            );
        }
    }
}

#[test]
fn controlled_steps_meet_the_tolerance() {
    for (name, lcs, start, exact) in exact_columns() {
        for scheme in [Scheme::MIDPOINT, SICONOS] {
            let stepping = Stepping::Controlled {
                span: MS5,
                first: 1e-6,
            };
            let (error, run) = error_against_exact(&lcs, &start, &exact, scheme, stepping);
            assert!(
                error < 10.0 * 1e-4,
                "{name} {scheme:?}: {error:e} V of 10 V"
            );
            assert!(run.stats.steps < 3_000_000);
        }
    }
}

#[test]
fn events_are_those_of_the_circuit() {
    let (_, lcs, start, exact) = exact_columns()[2].clone();
    let run = error_against_exact(
        &lcs,
        &start,
        &exact,
        Scheme::MIDPOINT,
        Stepping::Fixed(1e-7),
    )
    .1;
    // CIRCUITS 1.2, variant B: times in µs; the jump at 0 comes first.
    let exact = [
        32.0421, 211.7642, 357.0594, 536.7816, 682.0768, 861.7989, 1007.0942, 1186.8163,
    ];
    assert_eq!(run.stats.events, 31, "{:?}", &run.events[..8]);
    assert_eq!(run.events[0].to_string(), "jump");
    for (event, exact) in run.events[1..].iter().zip(exact) {
        let (t, names) = (event.t, event.to_string());
        assert!((t * 1e6 - exact).abs() < 0.16, "{t} {exact}");
        assert!(
            ["df", "dr"].iter().any(|d| names.matches(d).count() == 2),
            "{names}"
        );
    }
}

/// A diode across 1 µF charged to 3 V, and a second port whose y sees five times the first current: D + Dᵀ is indefinite.
fn not_passive() -> Lcs {
    fixtures::system(
        &[("v(c1)", "V")],
        &[
            ("d1", crate::lcs::Role::Current),
            ("d2", crate::lcs::Role::Current),
        ],
        [
            nalgebra::dmatrix![-1e3],
            nalgebra::dmatrix![-1e6, 0.0],
            nalgebra::dmatrix![-1.0; 0.0],
            nalgebra::dmatrix![0.0, 0.0; 5.0, 1.0],
        ],
        &[1e-6],
    )
}

#[test]
fn jump_of_a_network_that_is_not_passive_is_the_limit_of_the_step() {
    let lcs = not_passive();
    let grid = Grid {
        tstart: 0.0,
        tstep: 1e-5,
        tstop: 1e-4,
    };
    for scheme in [Scheme::MOREAU, Scheme::MIDPOINT] {
        let run = simulate(&lcs, dvector![3.0], scheme, Stepping::Fixed(1e-5), grid);
        close(row(&run, 0)[0], 0.0, 1e-9);
        assert_eq!(run.stats.jumps, 1);
        let impulse = run.impulses.iter().find(|i| i.name == "i(d1)").unwrap();
        close(impulse.area, 3e-6, 1e-13);
    }
}

/// 1 kA flows into the capacitor: a step of h moves C·3 V + h·1 kA, of which the jump is what is left at h = 0.
#[test]
fn what_flows_during_the_step_is_no_part_of_the_jump() {
    let fed = not_passive().changed(|parts| parts.e0 = dvector![1e9]);
    let lcs = fed.unwrap();
    let grid = Grid {
        tstart: 0.0,
        tstep: 1e-5,
        tstop: 2e-5,
    };
    let run = simulate(
        &lcs,
        dvector![3.0],
        Scheme::MOREAU,
        Stepping::Fixed(1e-5),
        grid,
    );
    let impulse = run.impulses.iter().find(|i| i.name == "i(d1)").unwrap();
    close(impulse.area, 3e-6, 1e-15);
}

/// One step of 1 s in which a diode before 1 Ω begins to conduct: 1 A charges 1 F from −½ V, x⁺ = ½ − λ, and λ = x⁺ = ¼ A. The source brings what
/// it does at the voltage in the middle, −⅛ V, where the diode seems to carry ¼ A against −⅛ − ¼ V.
#[test]
fn the_step_of_an_event_has_the_energies_of_its_middle() {
    let rows = |entries: [(f64, f64, f64); 3]| Rows {
        x: DMatrix::from_iterator(3, 1, entries.map(|e| e.0)),
        lambda: DMatrix::from_iterator(3, 1, entries.map(|e| e.1)),
        u: DMatrix::zeros(3, 0),
        du: DMatrix::zeros(3, 0),
        one: DVector::from_iterator(3, entries.map(|e| e.2)),
    };
    let term = |element: &str, kind| PowerTerm {
        element: element.into(),
        kind,
    };
    let lcs = fixtures::system(
        &[("v(c1)", "V")],
        &[("d1", crate::lcs::Role::Current)],
        [
            nalgebra::dmatrix![0.0],
            nalgebra::dmatrix![-1.0],
            nalgebra::dmatrix![-1.0],
            nalgebra::dmatrix![1.0],
        ],
        &[1.0],
    );
    let lcs = lcs.changed(|parts| {
        parts.e0 = dvector![1.0];
        parts.outputs.power = vec![
            term("i1", PowerKind::Source),
            term("r1", PowerKind::Dissipated),
            term("d1", PowerKind::Dissipated),
        ];
        // The source drives its current out of its positive end.
        parts.outputs.power_v = rows([(-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, -1.0, 0.0)]);
        parts.outputs.power_i = rows([(0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 1.0, 0.0)]);
    });
    let grid = Grid {
        tstart: 0.0,
        tstep: 1.0,
        tstop: 1.0,
    };
    let run = simulate(
        &lcs.unwrap(),
        dvector![-0.5],
        SICONOS,
        Stepping::Fixed(1.0),
        grid,
    );
    let energy = run.energy;
    assert_eq!(row(&run, 1), [0.25]);
    let (source, resistor, diode) = (-0.125, 0.0625, -0.25 * 0.375);
    close(energy.source, source, 1e-15);
    close(energy.dissipated, resistor, 1e-15);
    close(energy.numerical, diode, 1e-15);
    close(energy.residual, 0.0, 1e-15);
}

/// 1 F through 1 Ω and a diode that conducts, beside a capacitor that 1 A charges and a diode clamps at 0 V: it is there 61 µs after the second
/// step of ½ s, before the end of the short step that looks at it. Two half steps of Moreau's scheme come first.
#[test]
fn a_step_right_before_an_event_is_still_that_of_the_midpoint_rule() {
    let lcs = fixtures::system(
        &[("v(c1)", "V"), ("v(c2)", "V")],
        &[
            ("d1", crate::lcs::Role::Current),
            ("d2", crate::lcs::Role::Current),
        ],
        [
            DMatrix::zeros(2, 2),
            nalgebra::dmatrix![-1.0, 0.0; 0.0, -1.0],
            nalgebra::dmatrix![-1.0, 0.0; 0.0, -1.0],
            nalgebra::dmatrix![1.0, 0.0; 0.0, 0.0],
        ],
        &[1.0, 1.0],
    );
    let lcs = lcs.changed(|parts| parts.e0 = dvector![0.0, 1.0]);
    let grid = Grid {
        tstart: 0.0,
        tstep: 1.0,
        tstop: 1.0,
    };
    let start = dvector![1.0, -1.0 - 0.5_f64.powi(14)];
    let run = simulate(
        &lcs.unwrap(),
        start,
        Scheme::MIDPOINT,
        Stepping::Fixed(0.5),
        grid,
    );
    close(row(&run, 1)[0], 0.64 * 0.75 / 1.25, 1e-15);
}
