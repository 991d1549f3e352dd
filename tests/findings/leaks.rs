//! Currents that leak through enormous Roff and decay together: once they have, a guard with Roff · i in it is known to the rounding of
//! the voltages that the currents follow. Values are those of `tests/reference/digits.py`, in 120 digits.

use circ::integrate::Method;

use super::changed;
use crate::runs::column;

/// The run is exact to its end, names no device of a wrong sign, and has these values on its row at t, to 1e-9 of the amplitude.
pub(super) fn meets(name: &str, values: &[(&str, f64, f64)]) {
    let run = changed(name, &[], Method::Auto);
    let told = |n: &&circ::integrate::Note| {
        n.text.contains("wrong sign") || n.text.contains("exact integration")
    };
    let told = run.notes.iter().find(told);
    assert!(told.is_none(), "{name}: {told:?}");
    for &(probe, t, expected) in values {
        let column = column(&run, probe);
        let near = |&k: &usize| (run.waveforms.time[k] - t).abs() < 1e-9 * t;
        let row = (0..column.len()).rfind(near).expect("a row");
        let amplitude = column.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let off = (column[row] - expected).abs() / amplitude;
        assert!(off < 1e-9, "{name} {probe} at {t}: {off:e}");
    }
}

#[test]
fn a_rectifier_of_a_push_pull_converter_conducts_in_time() {
    let values = [
        ("i(l3)", 1.379310344827586e-5, -5.165488112583162e-2),
        ("i(l1)", 1.379310344827586e-5, 2.849972924471158),
        ("i(l4)", 2e-4, 2.212483127593251),
        ("v(6)", 2e-4, 4.952327760089881e1),
    ];
    meets("push_pull_leaks", &values);
}

#[test]
fn a_rectifier_of_a_forward_converter_conducts_when_the_magnetising_current_has_ended() {
    let values = [
        ("i(l3)", 8.275862068965517e-6, -2.965711892809283e-7),
        ("i(l3)", 3e-5, -1.556326416021289e-6),
        ("i(l4)", 3e-5, 7.756370124657527e-2),
        ("v(8)", 3e-5, 1.856161931492473),
    ];
    meets("forward_hidden_guard", &values);
}

#[test]
fn diodes_of_a_bridge_change_together() {
    let values = [
        ("i(l1)", 2.162162162162162e-4, 1.348489063559086e-3),
        ("i(l2)", 2.162162162162162e-4, 1.348470962711421e-3),
        ("v(6,5)", 4e-3, 5.962_128_615_698_05),
    ];
    meets("bridge_leaks", &values);
}

#[test]
fn a_forward_converter_with_hardly_any_load_goes_on() {
    let values = [
        ("i(l1)", 1.379310344827586e-4, 1.266564286076764),
        ("i(l4)", 2e-3, 2.870_058_045_860_99),
        ("v(5)", 2e-3, 3.327669711960313e1),
    ];
    meets("forward_leaks", &values);
}
