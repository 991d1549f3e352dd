//! Relays that slide and accumulate: circuits in `netlists/`.

use circ::integrate::{Run, SimOptions};

use super::runs::{at, column, exact, fixed, run};

const MS: f64 = 1e-3;

/// x₁' = −s₁ + 2 s₂, x₂' = −2 s₁ − s₂ from (1, 0.3), in milliseconds: x₂ = 0 at 0.1, then x₁ = 0 after 1.1/3, and every interval
/// is a third of the last.
#[test]
fn two_relays_pass_their_accumulation_point_and_stay() {
    let found = exact("two-relays");
    let grid = run("two-relays", SimOptions::default());
    let events: Vec<f64> = found.events.iter().map(|e| e.t / MS).collect();
    let (mut t, mut interval) = (0.1, 1.1 / 3.0);
    for found in &events[..20] {
        assert!((found - t).abs() < 1e-12, "{found} {t}");
        t += interval;
        interval /= 3.0;
    }
    assert!(events.iter().all(|t| *t <= 0.65 + 1e-12), "{events:?}");
    // Straight pieces before, the origin after.
    assert!((at(&grid, "v(1)", 0.1 * MS) - 1.1).abs() < 1e-12);
    assert!((at(&grid, "v(2)", 0.05 * MS) - 0.15).abs() < 1e-12);
    for node in ["v(1)", "v(2)"] {
        let values = column(&grid, node);
        let rest = grid.waveforms.time.iter().zip(&values);
        for (t, v) in rest.filter(|(t, _)| **t > 0.6501 * MS) {
            assert!(v.abs() < 1e-12, "{node} = {v} at {t}");
        }
    }
    assert!(found.notes.iter().any(|n| n.text.contains("accumulate")));
    for relay in ["bs1", "bs2"] {
        let note = format!("{relay} slides");
        assert!(
            found.notes.iter().any(|n| n.text.starts_with(&note)),
            "{:?}",
            found.notes
        );
    }
    // Moreau's scheme passes the point as well, at first order.
    let error = |h: f64| distance(&grid, &fixed("two-relays", 1.0, 1.0, h), "v(2)");
    let (coarse, fine) = (error(4e-6), error(1e-6));
    assert!(fine < 0.01 && coarse > 2.0 * fine, "{coarse} {fine}");
}

fn distance(a: &Run, b: &Run, probe: &str) -> f64 {
    let (a, b) = (column(a, probe), column(b, probe));
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(&b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

#[test]
fn parallel_inverters_slide() {
    let grid = run("parallel-inverters", SimOptions::default());
    assert_eq!(grid.method, "exact");
    // From 0.3 ms on all three hold 0.8 v + 3 i at the reference.
    let v = column(&grid, "v(o)");
    for probe in ["i(l1)", "i(l2)", "i(l3)"] {
        let current = column(&grid, probe);
        for (k, &t) in grid.waveforms.time.iter().enumerate() {
            let reference = 55.0 * (100.0 * std::f64::consts::PI * t).sin();
            let y = 0.8 * v[k] + 3.0 * current[k];
            assert!(
                t < 0.3 * MS || (y - reference).abs() < 1e-9,
                "{probe} {t}: {y}"
            );
        }
    }
    // With the same currents, C v' = 3 i − v/R is C v' + v = reference: one lag of 60 µs.
    let sliding = |t: f64, v0: f64, t0: f64| {
        let (w, tau) = (100.0 * std::f64::consts::PI, 60e-6);
        let forced =
            |t: f64| 55.0 * ((w * t).sin() - w * tau * (w * t).cos()) / (1.0 + (w * tau).powi(2));
        forced(t) + (v0 - forced(t0)) * (-(t - t0) / tau).exp()
    };
    let start = 0.3 * MS;
    let v0 = at(&grid, "v(o)", start);
    for t in [0.4, 1.0, 5.0, 12.0, 20.0] {
        let expected = sliding(t * MS, v0, start);
        assert!((at(&grid, "v(o)", t * MS) - expected).abs() < 1e-9, "{t}");
    }
    assert!(grid.events.len() < 12, "{:?}", grid.events);
    let slides = grid.notes.iter().filter(|n| n.text.contains("slides"));
    assert_eq!(slides.count(), 3, "{:?}", grid.notes);
    // Moreau's scheme is of first order.
    for probe in ["v(o)", "i(l1)", "i(l2)", "i(l3)"] {
        let error = |h: f64| distance(&grid, &fixed("parallel-inverters", 1.0, 1.0, h), probe);
        let (coarse, fine) = (error(2e-6), error(0.5e-6));
        let order = (coarse / fine).log2() / 2.0;
        assert!(
            fine < 0.5 && (0.75..1.4).contains(&order),
            "{probe}: {coarse} {fine}"
        );
    }
}
