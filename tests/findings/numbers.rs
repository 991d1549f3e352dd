//! Extreme values: resistances over many decades, equal eigenvalues, long chains.

use circ::integrate::{Method, Reason, Run, SimOptions};
use circ::settings::Settings;

use crate::runs::column;
use crate::{attempt_changed, changed, changed_by, run};

/// The largest difference of a column of two runs on the same grid, relative to its amplitude.
pub(super) fn difference(a: &Run, b: &Run, probe: &str) -> f64 {
    assert_eq!(a.waveforms.time, b.waveforms.time);
    let (a, b) = (column(a, probe), column(b, probe));
    let amplitude = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let pairs = a.iter().zip(&b);
    pairs.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / amplitude
}

/// The exact integrator alone, and no more than so many steps.
#[track_caller]
fn assert_exact(run: &Run, steps: u64) {
    assert!(
        run.notes.iter().all(|note| !note.text.contains("steps")),
        "{:?}",
        run.notes
    );
    assert!(run.stats.steps <= steps, "{} steps", run.stats.steps);
    let residual = run.energy.residual_relative;
    assert!(residual < 1e-10, "energy residual {residual:e}");
}

/// 10 V · sin ωt into L and R, from i₀ at t₀ on.
struct Branch {
    r: f64,
    i0: f64,
    t0: f64,
}

impl Branch {
    const W: f64 = 100.0 * std::f64::consts::PI;
    const L: f64 = 1e-3;

    fn forced(&self, t: f64) -> f64 {
        let z = self.r.hypot(Self::W * Self::L);
        10.0 / z * (Self::W * t - (Self::W * Self::L).atan2(self.r)).sin()
    }

    fn current(&self, t: f64) -> f64 {
        let decay = (-(t - self.t0) * self.r / Self::L).exp();
        self.forced(t) + (self.i0 - self.forced(self.t0)) * decay
    }
}

/// A diode that carries i in Ron = 0 and in Roff: the current changes the branch at each of its zeros.
#[test]
fn a_half_wave_rectifier_is_that_of_its_closed_form_for_any_roff() {
    for roff in ["1e3", "1e6", "1e9", "1e12", "1e14", "1e16", "1e18"] {
        let to = format!("roff={roff}");
        let run = changed("halfwave_roff_1e16", &[("roff=1e16", &to)], Method::Exact);
        assert_exact(&run, 4000);
        let roff: f64 = roff.parse().unwrap();
        let (voltage, forward) = (column(&run, "v(o)"), column(&run, "v(u)"));
        // The diode conducts first.
        let mut conducts = true;
        let mut branch = Branch {
            r: 10.1,
            i0: 0.0,
            t0: 0.0,
        };
        let sign = |conducts: bool| if conducts { 1.0 } else { -1.0 };
        let mut worst = 0.0_f64;
        for (k, &t) in run.waveforms.time.iter().enumerate() {
            if t > branch.t0 && branch.current(t) * sign(conducts) < 0.0 {
                let (mut low, mut high) = (run.waveforms.time[k - 1], t);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if branch.current(middle) * sign(conducts) < 0.0 {
                        high = middle;
                    } else {
                        low = middle;
                    }
                }
                conducts = !conducts;
                let r = if conducts { 10.1 } else { 10.1 + roff };
                branch = Branch {
                    r,
                    i0: 0.0,
                    t0: high,
                };
            }
            let i = branch.current(t);
            let across = if conducts { 0.0 } else { roff * i };
            worst = worst.max((voltage[k] - 10.0 * i).abs());
            worst = worst.max((forward[k] - 10.0 * i - across).abs());
        }
        assert!(worst < 1e-9, "Roff = {roff:e}: {worst:e} V");
    }
}

/// L/Roff = 1e-15 s: the waveform is that of ideal diodes, and the energy balances.
#[test]
fn two_strings_behind_a_large_roff_are_those_of_ideal_diodes() {
    for roff in ["1e10", "1e12", "1e14", "1e16", "1e18"] {
        let law = format!("roff={roff}");
        let run = changed("pvroff_2_1e12", &[("roff=1e12", &law)], Method::Exact);
        assert_exact(&run, 4000);
        let ideal = changed("pvroff_2_1e12", &[("roff=1e12", "")], Method::Exact);
        for probe in ["v(bus)", "i(l0)", "i(l1)"] {
            let apart = difference(&ideal, &run, probe);
            let leak = 100.0 / roff.parse::<f64>().unwrap();
            assert!(
                apart < 1e-10 + leak,
                "Roff = {roff}: {probe} off by {apart:e}"
            );
        }
    }
}

/// Ten equal strings have nine equal eigenvalues.
#[test]
fn ten_equal_strings_take_no_more_steps_than_rows_and_events() {
    let run = run("equal_strings", Method::Exact);
    assert_exact(&run, 3000);
    let run = changed("equal_strings", &[], Method::Exact);
    let ideal = changed("equal_strings", &[("roff=1e12", "")], Method::Exact);
    for probe in ["v(bus)", "i(l0)", "i(l7)"] {
        let apart = difference(&ideal, &run, probe);
        assert!(apart < 1e-9, "{probe} off by {apart:e}");
    }
}

#[test]
fn ten_strings_of_ordinary_values_take_no_more_steps_than_rows_and_events() {
    let exact = changed("pv10_ordinary_values", &[], Method::Exact);
    assert_exact(&exact, 3000);
    let steps = changed("pv10_ordinary_values", &[], Method::Theta);
    for probe in ["v(bus)", "i(l0)", "i(l7)"] {
        let apart = difference(&exact, &steps, probe);
        assert!(apart < 1e-3, "{probe} off by {apart:e}");
    }
}

#[test]
fn eight_equal_phases_take_no_more_steps_than_rows_and_events() {
    let exact = changed("multiphase_buck_8", &[], Method::Exact);
    assert_exact(&exact, 5000);
    let steps = changed("multiphase_buck_8", &[], Method::Theta);
    for probe in ["v(o)", "i(l0)", "i(l5)"] {
        let apart = difference(&exact, &steps, probe);
        assert!(apart < 1e-3, "{probe} off by {apart:e}");
    }
}

#[test]
fn a_mesh_of_equal_sections_takes_no_more_steps_than_rows() {
    let exact = changed("mesh_rc_49", &[], Method::Exact);
    assert!(exact.stats.steps <= 1500, "{} steps", exact.stats.steps);
    let residual = exact.energy.residual_relative;
    assert!(residual < 1e-7, "energy residual {residual:e}");
}

/// The forward drop is reached by an impulse, and Roff then discharges the capacitor.
#[test]
fn a_zener_diode_across_a_charged_capacitor_makes_it_jump() {
    let run = run("zener_cap", Method::Exact);
    let across = column(&run, "v(2)");
    let tau = 66.51e6 * 59.81e-9;
    assert!(run.waveforms.time.len() > 400);
    for (t, v) in run.waveforms.time.iter().zip(&across) {
        let expected = -0.3 * (-t / tau).exp();
        assert!((v - expected).abs() < 1e-12, "{v} at {t}");
    }
    let jump = &run.impulses[..];
    assert!(jump.len() == 1 && jump[0].name == "i(d3)", "{jump:?}");
    assert!((jump[0].area / (59.81e-9 * 4.7) - 1.0).abs() < 1e-12);
    for scale in ["-5e125", "-5e-125"] {
        let run = changed(
            "zener_cap",
            &[("ic=-5.0", &format!("ic={scale}"))],
            Method::Exact,
        );
        let before: f64 = scale.parse().unwrap();
        // To rounding of what it was before.
        let after = column(&run, "v(2)")[0];
        let expected = if before.abs() < 0.3 { before } else { -0.3 };
        assert!(
            (after - expected).abs() < 1e-15 * before.abs().max(0.3),
            "{scale}: {after}"
        );
    }
}

/// C Δv = 1 µF · 4.7 V is a charge, whatever Rrev.
#[test]
fn the_impulse_of_a_zener_diode_is_a_charge() {
    for rrev in ["rrev=66.51", "rrev=1"] {
        let run = changed("zener_impulse", &[("rrev=66.51", rrev)], Method::Exact);
        let [impulse] = &run.impulses[..] else {
            panic!("{:?}", run.impulses)
        };
        assert_eq!(impulse.name, "i(d3)");
        assert!((impulse.area / 4.7e-6 - 1.0).abs() < 1e-9, "{impulse:?}");
    }
}

/// Two rectifiers whose lower diodes alone conduct commutate at one instant. Their capacitors are left to their resistors then.
#[test]
fn rectifiers_that_commutate_at_one_instant_find_their_mode() {
    let exact = run("rect4", Method::Exact);
    assert_exact(&exact, 2000);
    // Neighbours of one proposal at each of four commutations of 24 diodes; a search among all neighbours made 744.
    assert!(exact.stats.modes <= 4 * 24, "{} modes", exact.stats.modes);
    assert_eq!(exact.waveforms.time.last(), Some(&6e-3));
    let at = |t: f64| crate::runs::at(&exact, "v(p0,n0)", t);
    let left = at(6e-3) / at(5.4e-3) / (-0.6e-3_f64 / (30.0 * 1e-3)).exp();
    assert!((left - 1.0).abs() < 1e-9, "{left}");
}

/// Over longer spans more of what the rectifiers share decays at once, in fractions of thousands of digits: what runs see is the same, in as
/// few modes.
#[test]
fn rectifiers_have_the_same_course_whatever_the_print_step() {
    let fine = run("rect4", Method::Exact);
    let coarse = changed("rect4", &[(".tran 20u", ".tran 150u")], Method::Exact);
    assert_exact(&coarse, 2000);
    for probe in ["v(p0,n0)", "v(ba)"] {
        for k in 1..=10 {
            let t = 0.6e-3 * f64::from(k);
            let [a, b] = [&fine, &coarse].map(|run| crate::runs::at(run, probe, t));
            assert!((a - b).abs() < 1e-9, "{probe} at {t}: {a} {b}");
        }
    }
}

/// The largest difference of all columns of two runs in the rows that both have, relative to the amplitude of each.
fn apart(a: &Run, b: &Run) -> f64 {
    let row = |run: &Run, t: f64| {
        let times = &run.waveforms.time;
        let k = times.partition_point(|time| *time < t);
        let alone = times.get(k) == Some(&t) && times.get(k + 1) != Some(&t);
        alone.then_some(k)
    };
    let rows: Vec<[usize; 2]> = (a.waveforms.time.iter())
        .filter_map(|&t| Some([row(a, t)?, row(b, t)?]))
        .collect();
    assert!(rows.len() > 30, "{} common rows", rows.len());
    let probes = a.waveforms.names.iter().map(|probe| {
        let (a, b) = (column(a, probe), column(b, probe));
        let amplitude = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let errors = rows.iter().map(|&[i, j]| (a[i] - b[j]).abs() / amplitude);
        errors.fold(0.0, f64::max)
    });
    probes.fold(0.0, f64::max)
}

/// What Roff makes fast is a sum of inductor currents, in none of which it is a digit: exact integration throughout, the same for any
/// Roff but for the leakage.
#[test]
fn inductors_that_share_a_diode_do_not_see_how_large_its_roff_is() {
    let of = |name: &str, old: &str, roff: &str| {
        changed(name, &[(old, &format!("roff={roff}"))], Method::Exact)
    };
    for (name, old) in [
        ("star_of_inductors", "roff=1e16"),
        ("llc_large_roff", "roff=1e15"),
        ("cuk_large_roff", "roff=1e15"),
        ("bridge_large_roff", "roff=1e15"),
        ("six_pulse_large_roff", "roff=1e15"),
    ] {
        let [coarse, fine] = ["1e9", "1e12"].map(|roff| of(name, old, roff));
        let leakage = apart(&coarse, &fine);
        assert!(leakage < 1e-5, "{name}: {leakage:e}");
        for roff in ["1e15", "1e18"] {
            let run = of(name, old, roff);
            assert!(run.notes.is_empty(), "{name}, {roff}: {:?}", run.notes);
            let residual = run.energy.residual_relative;
            assert!(
                residual < 1e-9,
                "{name}, {roff}: energy residual {residual:e}"
            );
            // The leakage falls with Roff, and 1e-10 of the amplitude is what events at other instants leave.
            let error = apart(&run, &fine);
            assert!(error < 1e-3 * leakage + 1e-10, "{name}, {roff}: {error:e}");
        }
    }
}

/// What ideal diodes say of a star.
#[test]
fn a_star_behind_a_large_roff_is_that_of_ideal_diodes() {
    let ideal = changed("star_of_inductors", &[("roff=1e16", "")], Method::Exact);
    let run = run("star_of_inductors", Method::Exact);
    assert!(apart(&run, &ideal) < 1e-10, "{:e}", apart(&run, &ideal));
}

/// v = −(1/9)(e^{λt} − 1) with λ = 9e6 1/s; in long steps the stiff exponentials would take e^{λh} to 0.
#[test]
fn what_grows_is_followed_or_overflows() {
    let name = "grows";
    let v = crate::runs::at(&run(name, Method::Exact), "v(a)", 50e-6);
    let expected = -((9e6_f64 * 50e-6).exp_m1()) / 9.0;
    assert!(
        (v.abs() / expected.abs() - 1.0).abs() < 1e-11,
        "{v:e} {expected:e}"
    );
    let options = SimOptions {
        method: Method::Exact,
        ..SimOptions::default()
    };
    let long = attempt_changed(name, &[(".tran 10u 50u", ".tran 1m 10m")], options);
    let error = long.expect_err("no number is as large");
    assert_eq!(error.reason, Reason::Overflow);
}

/// Where everything is zero, the second derivative of a guard that rises with its third is rounding, and turns nothing around.
#[test]
fn a_chain_of_pumps_starts_from_rest() {
    let name = "multiplier_at_rest";
    let exact = changed(name, &[], Method::Auto);
    assert_exact(&exact, 4000);
    let options = SimOptions {
        method: Method::Theta,
        settings: Settings {
            tol: 1e-8,
            ..Settings::default()
        },
        ..SimOptions::default()
    };
    // Rows from the start on: a first step must not hide what happens in it.
    let from_rest = (".tran 50n 2u", ".tran 1n 200n");
    let steps = changed_by(name, &[from_rest], options);
    let exact = changed(name, &[from_rest], Method::Auto);
    for probe in ["i(l1)", "v(0,5)"] {
        let distance = difference(&exact, &steps, probe);
        assert!(distance < 1e-6, "{probe}: {distance:e}");
    }
}

/// Rounding of 10 V and more in the voltages of diodes of 1e15 Ω: whatever it does to the modes, the work is bounded.
#[test]
fn a_mode_without_progress_ends() {
    let run = changed("series_resonant_roff_1e15", &[], Method::Auto);
    assert!(run.stats.steps < 1_000_000, "{} steps", run.stats.steps);
    let plain = [("roff=1e15", "roff=1e8"), ("roff=1e12", "roff=1e8")];
    let plain = changed("series_resonant_roff_1e15", &plain, Method::Exact);
    let stated = run.error.max.unwrap_or(0.0);
    for probe in ["i(l1)", "v(8,9)"] {
        let distance = difference(&plain, &run, probe);
        assert!(
            distance < stated + 1e-5,
            "{probe}: {distance:e}, {stated:e} stated"
        );
    }
}

/// Diodes begin to conduct between the middle and the end of the last step before a row, where the capacitor's voltage would differ by 0.7 V; while
/// they block, no current flows in their small resistances, of which the step that reads it would make 2 % of the amplitude.
#[test]
fn steps_see_a_diode_at_their_end_and_read_its_current_at_the_instant() {
    let exact = run("diodes_before_a_row", Method::Exact);
    let steps = run("diodes_before_a_row", Method::Theta);
    let at = |run: &Run, probe: &str, t: f64| {
        let row = run
            .waveforms
            .time
            .iter()
            .position(|s| (s - t).abs() < 1e-12);
        column(run, probe)[row.expect("a row")]
    };
    let volts = at(&steps, "v(2)", 2.664e-5) - at(&exact, "v(2)", 2.664e-5);
    assert!(volts.abs() < 1e-4 * 25.0, "{volts:e}");
    let current = at(&steps, "i(d0)", 2.5752e-5);
    assert!(current.abs() < 1e-4, "{current:e}");
}

/// Time constants to 1e-32 s, 110 doublings below the distance of rows: what blocks is as good as open, and a leak of 1 GΩ takes 3e-11 V.
#[test]
fn a_current_is_blocked_however_fast_it_ends() {
    for l in ["1e-10", "1e-11", "1e-14"] {
        let of = |roff: &str| {
            let to = [format!("param l={l}"), format!("roff={roff}")];
            let changes = [
                ("param l=1e-11", to[0].as_str()),
                ("roff=1e15", to[1].as_str()),
            ];
            changed("blocking_1e26", &changes, Method::Exact)
        };
        let leaky = of("1e9");
        for roff in ["1e15", "1e18"] {
            let run = of(roff);
            assert_exact(&run, 20_000);
            let distance = difference(&run, &leaky, "v(4)");
            assert!(distance < 1e-10, "{l} H, {roff} ohm: {distance:e}");
        }
    }
}
