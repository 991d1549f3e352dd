//! Devices that turn off into a large resistance, by steps.

use circ::integrate::{Method, Run, SimOptions};

use super::changed_by;
use super::runs::{at, column};
use circ::settings::Settings;

/// The half-wave rectifier with another blocking resistance, by the midpoint rule: with chosen or given steps.
fn half_wave(roff: &str, step: Option<f64>) -> Run {
    let options = SimOptions {
        method: Method::Theta,
        step,
        ..SimOptions::default()
    };
    let roff = format!("roff={roff}");
    changed_by("halfwave_roff_1e16", &[("roff=1e16", &roff)], options)
}

#[test]
fn a_blocking_diode_has_the_voltage_of_the_source_at_once() {
    for roff in ["1e6", "1e9", "1e12"] {
        for step in [None, Some(10e-6)] {
            let run = half_wave(roff, step);
            let [source, anode, current] = ["v(s)", "v(u)", "i(l1)"].map(|name| column(&run, name));
            let resistance: f64 = roff.parse().unwrap();
            let mut blocking = 0;
            for (k, t) in run.waveforms.time.iter().enumerate() {
                // Conduction ends 0.10 ms after the half-wave.
                let phase = t % 20e-3;
                if (10.11e-3..19.99e-3).contains(&phase) {
                    blocking += 1;
                    // L di/dt and the load's share of 10 V, and the step's own error of the slope.
                    assert!(
                        (source[k] - anode[k]).abs() < 2e-5,
                        "{roff} {step:?}: {} V at {t} s",
                        source[k] - anode[k]
                    );
                    let leak = source[k] / resistance;
                    assert!(
                        (current[k] - leak).abs() < 1e-4 * 10.0 / resistance,
                        "{roff} {step:?}: {} A at {t} s",
                        current[k]
                    );
                }
            }
            assert!(blocking > 2900, "{blocking}");
        }
    }
}

#[test]
fn turning_off_dissipates_what_the_resistances_take() {
    // ∫ i² (0.1 Ω + 10 Ω) over three half-waves, from the closed form of the current: Z = √(10.1² + (ωL)²).
    let (r, l, omega) = (10.1_f64, 1e-3, 100.0 * std::f64::consts::PI);
    let (z, phase) = (r.hypot(omega * l), (omega * l / r).atan());
    let current =
        |t: f64| 10.0 / z * ((omega * t - phase).sin() + phase.sin() * (-r * t / l).exp()).max(0.0);
    let n = 200_000;
    let h = 11e-3 / f64::from(n);
    let squares: f64 = (0..n)
        .map(|k| current((f64::from(k) + 0.5) * h).powi(2))
        .sum();
    let heat = 3.0 * r * squares * h;
    for roff in ["1e6", "1e9", "1e12"] {
        for (step, tolerance) in [(None, 1e-5), (Some(10e-6), 1e-4)] {
            let energy = half_wave(roff, step).energy;
            // The blocking resistance takes another 25 V² · 30 ms/roff at most.
            let leak = 1.5 / roff.parse::<f64>().unwrap();
            assert!(
                (energy.dissipated - heat).abs() < tolerance * heat + leak,
                "{roff} {step:?}: {} J in place of {heat} J",
                energy.dissipated
            );
            assert!(energy.residual_relative < 1e-9, "{energy:?}");
        }
    }
}

/// The current of c1 is C dv/dt of the source while both diodes conduct, and d1 turns off when that is more than the load takes: at the
/// end of a step this is known from the slope of the source alone. A step that held the source there saw no current in c1.
#[test]
fn a_source_that_moves_takes_the_current_from_a_diode() {
    let name = "follower_turns_off";
    let exact = changed_by(name, &[], SimOptions::default());
    assert_eq!(exact.method, "exact");
    for step in [100e-9, 10e-9] {
        let options = SimOptions {
            method: Method::Theta,
            step: Some(step),
            ..SimOptions::default()
        };
        let run = changed_by(name, &[], options);
        for (probe, amplitude) in [
            ("v(2)", 6.4),
            ("v(3)", 6.4),
            ("i(d1)", 4.1),
            ("i(d2)", 0.36),
        ] {
            let rows = column(&run, probe).into_iter().zip(column(&exact, probe));
            let off = rows.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // An event is taken at the end of its step.
            let share = 1e-2 * step / 100e-9;
            assert!(off < share * amplitude, "{step:e}: {probe} is {off:e} off");
        }
    }
}

/// Where a diode's λ is its voltage the solver's active set alone decided, and the diode went on with a negative current: 2e-3 of the
/// amplitude off at every tolerance, 3e-5 stated. The value is SciPy's Radau's on the circuit's own equations, rtol 1e-11.
#[test]
fn a_diode_does_not_go_on_with_a_negative_current() {
    for tol in [1e-4, 1e-6] {
        let options = SimOptions {
            method: Method::Theta,
            settings: Settings {
                tol,
                ..Settings::default()
            },
            ..SimOptions::default()
        };
        let run = changed_by("capacitor_follows_a_ramp", &[], options);
        let voltage = at(&run, "v(2)", 3.104e-3);
        let off = (voltage + 0.343_784_75).abs() / 4.28;
        assert!(off < tol, "{off:e} at {tol:e}");
        assert!(off < run.error.max.expect("a stated error").max(1e-8));
    }
}
