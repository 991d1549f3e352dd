//! Notes and warnings of a run stand at the place in the netlist of what they name.

use std::fs;
use std::process::Command;

use circ::integrate::{Method, SimOptions};
use circ::settings::Settings;

use super::runs::column;
use super::{changed, changed_by, path};

/// What `circ` says of a netlist with this text: notes and warnings, with # for times and other numbers of many digits.
fn told(command: &str, text: &str) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("a.cir"), text).expect("a netlist");
    let output = Command::new(env!("CARGO_BIN_EXE_circ"))
        .current_dir(folder.path())
        .args(command.split_whitespace())
        .arg("a.cir")
        .output()
        .expect("circ runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let lines = said
        .lines()
        .filter(|line| line.starts_with("note[") || line.starts_with("warning["));
    let number = |word: &&str| word.parse::<f64>().is_ok_and(|x| x.to_string().len() > 3);
    let plain = |line: &str| {
        let words = line.split(' ');
        let words = words.map(|word| if number(&word) { "#" } else { word });
        words.collect::<Vec<_>>().join(" ")
    };
    lines.map(plain).collect::<Vec<_>>().join("\n")
}

/// The text of `tests/findings/NAME.cir`.
fn text(name: &str) -> String {
    fs::read_to_string(path(name)).expect("a netlist")
}

#[test]
fn what_an_operating_point_notes_has_a_place() {
    let text = "a capacitor with a value of its own, and one that nothing else holds\n\
        V1 1 0 5\n\
        C1 1 2 1u IC=3\n\
        C2 2 0 1u\n\
        .ic v(1)=4\n\
        .tran 1m 2m\n";
    insta::assert_snapshot!(told("sim", text));
    insta::assert_snapshot!(told("op", text));
}

#[test]
fn a_switch_that_slides_has_a_place() {
    insta::assert_snapshot!(told("sim", &text("hysteretic_switch_slides")));
}

#[test]
fn diodes_that_compete_have_a_place() {
    insta::assert_snapshot!(told("sim", &text("rival_diodes")));
}

#[test]
fn a_device_that_steps_take_over_has_a_place() {
    insta::assert_snapshot!(told(
        "sim",
        "a two-point controller with next to no hysteresis\nV1 1 0 10\nS1 1 2 ref out sw OFF\nR1 2 out 1k\nC1 out 0 1u IC=0\nR2 out 0 10k\n\
         Vref ref 0 PWL(0 5 1m 5 1.1m 8)\n.model sw SW(ideal Vt=0 Vh=1e-11)\n.tran 10u 2m uic\n.save v(out)\n"
    ));
}

#[test]
fn destroyed_currents_and_rows_too_far_apart_have_a_place() {
    insta::assert_snapshot!(told(
        "sim",
        "an inductor that a switch leaves without a path\nV1 1 0 1\n\
         L1 1 2 1m\nR1 2 3 1\nS1 3 0 g 0 sw\nVg g 0 PULSE(1 0 1m 0 0 2 4)\n.model sw SW(ideal Vt=0.5)\n.tran 1u 2m\n"
    ));
    insta::assert_snapshot!(told("sim", &text("print_step")));
}

/// Steps of a tank that rests need not be as short as its period; exact integration takes no other ones.
#[test]
fn a_run_made_in_steps_in_the_place_of_exact_integration_says_so() {
    let options = |method, max_steps| SimOptions {
        method,
        settings: Settings {
            max_steps,
            ..Settings::default()
        },
        ..SimOptions::default()
    };
    let name = "tank_at_rest";
    let run = changed_by(name, &[], options(Method::Auto, 100_000));
    let told: Vec<&str> = run.notes.iter().map(|n| n.text.as_str()).collect();
    assert!(
        told.iter().any(|n| n
            .starts_with("exact integration ended, and the whole run was made in steps instead")
            && n.contains("more than 100000 steps")),
        "{told:?}"
    );
    assert_eq!(run.method, "theta");
    // Without the tank, by exact integration.
    let text = [("L2 3 0 1p IC=0", "R2 3 0 1"), ("C2 3 0 1n IC=0", "")];
    let exact = changed(name, &text, Method::Exact);
    let stated = run.error.max.expect("steps state an error");
    let (a, b) = (column(&run, "v(2)"), column(&exact, "v(2)"));
    let distance = a
        .iter()
        .zip(&b)
        .fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    assert!(
        distance < 10.0 * stated && stated < 1e-3,
        "{distance:e} {stated:e}"
    );
}

/// Two windings with k = 1 lie beside a diode: what it shares with the other one is not determined, and is the least-norm choice by
/// every method; a symmetric pair of diodes shares equally, whatever the rest of the circuit makes of them.
#[test]
fn what_devices_share_is_the_least_norm_choice_by_every_method_and_is_said() {
    let [exact, theta] =
        [Method::Exact, Method::Theta].map(|method| changed("windings_share", &[], method));
    for run in [&exact, &theta] {
        let said = run
            .notes
            .iter()
            .any(|note| note.elements == ["d1", "d3"] && note.text.contains("least-norm choice"));
        assert!(said, "{:?}", run.notes);
    }
    let [by_events, by_steps] = [&exact, &theta].map(|run| column(run, "i(l5)"));
    let largest = by_events.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    assert!(largest > 2.0, "{largest}");
    for (a, b) in by_events.iter().zip(&by_steps) {
        assert!((a - b).abs() < 1e-5 * largest, "{a} {b}");
    }

    for method in [Method::Exact, Method::Theta, Method::Euler] {
        let run = changed("diodes_share", &[], method);
        let [d1, d2, d3, d4] =
            ["i(d1)", "i(d2)", "i(d3)", "i(d4)"].map(|probe| column(&run, probe));
        for k in 0..d1.len() {
            assert!(
                (d1[k] - d2[k]).abs() < 1e-6 && (d3[k] - d4[k]).abs() < 1e-12,
                "{method:?} {k}"
            );
            assert!((d3[k] - 0.5).abs() < 1e-12, "{method:?} {k}");
        }
        assert!(d1[2] > 0.1, "{method:?} {}", d1[2]);
    }
}

/// With 1e17 Ω a diode of the bridge blocks with more than its threshold: what leaks through it has no digit left.
#[test]
fn a_device_that_rounding_holds_on_the_wrong_side_is_named() {
    let hidden = |run: &circ::integrate::Run| {
        let named = |note: &circ::integrate::Note| !note.elements.is_empty();
        let told = |note: &circ::integrate::Note| note.text.contains("of the wrong sign");
        run.notes.iter().any(|note| named(note) && told(note))
    };
    let roff = [("roff=1e9", "roff=1e17")];
    let large = changed("bridge_leaks", &roff, Method::Auto);
    assert!(hidden(&large), "{:?}", large.notes);
    let ordinary = changed("bridge_leaks", &[], Method::Auto);
    assert!(!hidden(&ordinary), "{:?}", ordinary.notes);
}

/// Node 2 stands between two open switches and a diode that blocks: no current tells its voltage. The diode's own voltage beyond its
/// threshold is the least there is, by every method; the switches would have it at a third of that.
#[test]
fn a_node_that_floats_beside_a_blocking_diode_is_the_same_by_every_method() {
    for method in [Method::Exact, Method::Theta, Method::Euler] {
        let run = changed("floating_between_switches", &[], method);
        for volts in column(&run, "v(2)") {
            assert!((volts - 0.7).abs() < 1e-9 * 5.0, "{method:?}: {volts} V");
        }
    }
}
