//! Modes that rounding finds are not left at the instant at which they are entered, without end: exact integration goes on.

use circ::integrate::{Method, Run, SimOptions};
use circ::settings::Settings;

use super::numbers::difference;
use super::{changed, changed_by};

/// By the midpoint rule to 1e-6, from which 1e-8 differs by 1e-9.
fn steps(name: &str) -> Run {
    let options = SimOptions {
        method: Method::Theta,
        settings: Settings {
            tol: 1e-6,
            ..Settings::default()
        },
        ..SimOptions::default()
    };
    changed_by(name, &[], options)
}

/// The run is exact to its end, and what it gives is that of another run.
fn goes_on(name: &str, probes: &[&str], other: &Run) {
    let exact = changed(name, &[], Method::Auto);
    let mut notes = exact.notes.iter();
    let gave_way = notes.find(|n| n.text.contains("exact integration"));
    assert!(gave_way.is_none(), "{name}: {gave_way:?}");
    for probe in probes {
        let distance = difference(&exact, other, probe);
        assert!(distance < 1e-6, "{name} {probe}: {distance:e}");
    }
}

#[test]
fn where_a_guard_dips_by_less_than_its_rounding() {
    let name = "guard_dips_in_rounding";
    goes_on(name, &["i(l4)", "v(8)"], &steps(name));
}

#[test]
fn where_devices_turn_on_together_and_rounding_tells_which() {
    let name = "pair_in_rounding";
    // Less blocking resistance, of which 1e-7 of the amplitude leaks.
    let plain = changed(name, &[("roff=1e15", "roff=1e8")], Method::Exact);
    goes_on(name, &["i(l1)", "v(3,4)"], &plain);
}

#[test]
fn where_a_guard_falls_before_its_transient_has_ended() {
    let name = "event_before_followers";
    goes_on(name, &["i(l5)", "v(6)"], &steps(name));
}

#[test]
fn where_a_first_charge_is_rounding_of_the_leaks() {
    let name = "bridge_starts";
    let plain = changed(name, &[("roff=1e9", "roff=1e7")], Method::Exact);
    goes_on(name, &["i(l1)", "i(l2)"], &plain);
}

/// Where the line's current reverses both diodes of a half-controlled bridge conduct, and a thyristor fires with nothing but ideal devices
/// around it: it has its share of the current, and holds itself by that when its gate's pulse of 1 µs ends. It was left without, and the bridge never
/// commutated again. From 120 digits (`tests/reference/digits.py --ideal`), extrapolated from 1e-6 Ω and 1e-8 Ω.
#[test]
fn a_thyristor_that_fires_across_a_short_has_its_share() {
    let found = super::run("thyristor_shares", Method::Exact);
    let current = super::runs::at(&found, "i(l1)", 32.0 * 1.081_081_081_081_081_1e-4);
    assert!((current - 1.738_595_265).abs() < 1e-7, "{current} A");
}

/// In steps a current far below their tolerance was none, and the thyristor let go. From `tests/reference/radau.py --tol 1e-9`.
#[test]
fn a_leak_far_below_the_tolerance_holds_a_thyristor() {
    let found = super::run("held_by_a_leak", Method::Auto);
    let voltage = super::runs::at(&found, "v(3,4)", 16.0 * 1.739_130_434_782_608_8e-6);
    assert!((voltage - 94.046_499_8).abs() < 1e-2, "{voltage} V");
}
