//! What is read at an instant: at the start, at rows beside thresholds and corners, and where steps have left a constraint.

use circ::integrate::{Method, Run};

use super::changed_at;
use super::runs::{at, column};

/// A run at a tolerance, without rows at events.
fn stepped(name: &str, method: Method, tol: f64) -> Run {
    changed_at(name, &[], method, tol)
}

/// The passage was a rounding behind the row, and from there the control had passed its threshold: the switch moved at the end of the edge, and the
/// current was off by 1.4 %.
#[test]
fn a_switch_moves_at_its_threshold_where_a_row_is() {
    let exact = stepped("row_on_a_threshold", Method::Exact, 1e-4);
    let expected = column(&exact, "i(l1)").last().copied().unwrap();
    for (method, allowed) in [(Method::Theta, 1e-4), (Method::Euler, 1e-3)] {
        let run = stepped("row_on_a_threshold", method, 1e-4);
        let i = column(&run, "i(l1)").last().copied().unwrap();
        assert!((i - expected).abs() < allowed * expected, "{method:?}: {i}");
    }
}

/// The same where steps look ahead up to the passage: 1.3 % of the currents. With rows at other times the search ends elsewhere.
#[test]
fn a_switch_moves_at_its_threshold_where_the_look_ahead_ends() {
    let name = "passage_at_the_end_of_a_search";
    let i = at(&stepped(name, Method::Auto, 1e-8), "i(l1)", 2e-4);
    let rows = ("3.976143141153082e-7 2e-4", "4e-7 2.004e-4");
    let other = changed_at(name, &[rows], Method::Auto, 1e-8);
    let expected = at(&other, "i(l1)", 2e-4);
    assert!(
        (i - expected).abs() < 1e-6 * expected.abs(),
        "{i} {expected}"
    );
}

/// What a junction leaks is off by what steps err, and its voltage by the law was 13 V off in the row at 3 µs.
#[test]
fn a_row_at_a_corner_goes_on_where_a_junction_blocks() {
    let run = stepped("corner_beside_a_leak", Method::Auto, 1e-8);
    let rows = run.waveforms.time.iter().zip(column(&run, "v(2)"));
    let near = rows.filter(|(t, _)| (2.99e-6..3.01e-6).contains(*t));
    let volts: Vec<f64> = near.map(|(_, v)| v).collect();
    assert!(volts.len() >= 3);
    for pair in volts.windows(2) {
        assert!((pair[0] - pair[1]).abs() < 1e-3, "{volts:?}");
    }
}

/// The row at 30 µs had 65 A through a diode that carries 0.66 mA.
#[test]
fn a_capacitor_that_steps_left_beside_its_constraint_is_not_led_back_by_a_current() {
    let exact = stepped("leads_back_a_capacitor", Method::Exact, 1e-4);
    let stepped = stepped("leads_back_a_capacitor", Method::Theta, 1e-4);
    for (a, b) in column(&exact, "i(d1)")
        .into_iter()
        .zip(column(&stepped, "i(d1)"))
    {
        assert!((a - b).abs() < 1e-2, "{a} {b}");
    }
}

/// The first row had −11 mA through diodes that block, as λ after a step is no λ of the start.
#[test]
fn diodes_that_block_carry_nothing_at_the_start() {
    let run = stepped("blocked_at_the_start", Method::Theta, 1e-4);
    for j in 1..=6 {
        let i = column(&run, &format!("i(d{j})"))[0];
        assert!(i.abs() < 1e-12, "d{j}: {i} A");
    }
}

/// The second thyristor held on to a current of nothing when its gate fell, and conducted 0.26 ms later, as the first one ended.
#[test]
fn a_thyristor_that_carries_nothing_when_its_gate_falls_blocks() {
    let name = "fired_while_the_other_conducts";
    let exact = column(&stepped(name, Method::Exact, 1e-4), "i(l1)");
    for method in [Method::Theta, Method::Euler] {
        let run = stepped(name, method, 1e-4);
        for (a, b) in exact.iter().zip(column(&run, "i(l1)")) {
            assert!((a - b).abs() < 2e-3, "{method:?}: {a} {b}");
        }
    }
}

/// Of 201 rows every fifth was compared with the coarser run, and the rows behind the gate's edges were none of them: 2.8e-5 was stated of 3e-2.
#[test]
fn the_row_after_an_edge_has_a_part_in_the_stated_error() {
    let name = "row_after_a_gate";
    let exact = column(&stepped(name, Method::Exact, 1e-4), "v(4)");
    let run = stepped(name, Method::Theta, 1e-4);
    let size = exact.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let errors = exact.iter().zip(column(&run, "v(4)"));
    let error = errors.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / size;
    let stated = run.error.max.unwrap();
    assert!(error > 1e-3 && stated >= error, "{stated} of {error}");
}

/// Read after a short step it was −8.83 V, the logarithm of what that lets flow, and 2.6 % was stated. Nothing flows.
#[test]
fn a_junction_beside_an_ideal_switch_has_no_voltage_where_nothing_flows() {
    let run = stepped("flyback_at_start", Method::Auto, 1e-4);
    let first = |probe| column(&run, probe)[0];
    assert_eq!(first("i(d1)"), 0.0);
    assert!((first("v(2)") - first("v(3)")).abs() < 1e-9);
    assert!(run.error.max.unwrap() < 1e-3, "{:?}", run.error);
}

/// The corner is a rounding behind the row, and what flowed there had the slope of the piece before it: 13 mA where nothing flows.
#[test]
fn the_row_at_a_corner_has_the_slopes_behind_it() {
    for method in [Method::Theta, Method::Euler] {
        let run = stepped("corner_behind_a_row", method, 1e-4);
        let flows = |probe| column(&run, probe).iter().any(|i| *i > 1e-9);
        assert!(
            !["i(d0)", "i(d3)", "i(d5)"].into_iter().any(flows),
            "{method:?}"
        );
    }
}

/// Rounding put the control above its threshold for some last places of the time, and the way back was before the row at which the switch moved: it stayed on.
#[test]
fn a_control_that_touches_its_threshold_moves_no_switch() {
    for method in [Method::Theta, Method::Euler, Method::Exact] {
        let run = stepped("touches_its_threshold", method, 1e-4);
        assert!(at(&run, "v(3)", 4.125e-6) < 1e-5, "{method:?}");
    }
}

/// Currents through blocking resistances end within 0.4 ps of the gate's edge, faster than any step that reads λ: 8 % of the amplitude, at any tolerance.
#[test]
fn a_row_at_a_gate_is_of_that_instant() {
    let name = "gate_beside_blocking_inductors";
    let [exact, stepped] =
        [Method::Exact, Method::Theta].map(|method| at(&stepped(name, method, 1e-6), "v(4)", 2e-5));
    assert!((exact - stepped).abs() < 1e-6 * 24.0, "{exact} {stepped}");
}
