//! Systems derived by hand.

use super::*;

const C: f64 = 1e-6;
const L: f64 = 10e-3;
const R: f64 = 1e3;

#[test]
fn half_wave_rectifier() {
    let s = free("c1 1 0 1u\n l1 1 0 10m\n r1 1 2 1k\n d1 2 0");
    assert_matrix("A", &s.a, &[&[-1.0 / (R * C), -1.0 / C], &[1.0 / L, 0.0]]);
    // λ = −v(d1): i = (v_C + λ)/R.
    assert_eq!(s.ports[0].lambda, "-v(d1)");
    assert_matrix("B", &s.b, &[&[-1.0 / (R * C)], &[0.0]]);
    assert_matrix("C", &s.c, &[&[1.0 / R, 0.0]]);
    assert_matrix("D", &s.d, &[&[1.0 / R]]);
    assert_matrix("P", &s.energy, &[&[C, 0.0], &[0.0, L]]);
    assert_eq!(s.states[0].name, "v(c1)");
    assert_eq!(s.states[1].name, "i(l1)");
}

#[test]
fn bridge_with_resistor() {
    let s = free("c1 1 0 1u\n l1 1 0 10m\n d1 1 2\n d2 0 2\n d3 3 1\n d4 3 0\n r1 2 3 1k");
    eprintln!("{} {} {} {} {:?}", s.a, s.b, s.c, s.d, s.ports);
    assert_eq!((s.n(), s.m(), s.p()), (2, 4, 0));
    let sym = &s.d + s.d.transpose();
    assert_eq!(sym.rank(1e-12), 1);
}

const BRIDGE_C: &str =
    "c1 1 0 1u\n l1 1 0 10m\n d1 1 2\n d2 0 2\n d3 3 1\n d4 3 0\n cf 2 3 300n\n r1 2 3 1k";

#[test]
fn closing_a_bridge_on_its_filter_shares_the_charge() {
    // d1 and d4 conduct: c1 ∥ cf. q = 10 µC over 1.3 µF.
    let s = held(BRIDGE_C, "cooc");
    assert_eq!(s.n(), 2);
    let k = s.storage.names.iter().position(|n| n == "v(c1)").unwrap();
    let mut before = DVector::zeros(3);
    before[k] = 10.0;
    let x = &s.storage.inject * &before + &s.storage.inject_one;
    let after = &s.storage.x * &x;
    assert!(close(after[k], 10.0 / 1.3), "{after}");
    let f = s.storage.names.iter().position(|n| n == "v(cf)").unwrap();
    assert!(close(after[f], 10.0 / 1.3));
    // The impulse through d1 is the charge that reached cf.
    let impulse = &s.held.impulse * (before - after);
    assert!(close(impulse[0], 300e-9 * 10.0 / 1.3), "{impulse}");
    assert!(close(impulse[3], 300e-9 * 10.0 / 1.3), "{impulse}");
    // Blocked: three states, nothing shared.
    let open = held(BRIDGE_C, "oooo");
    assert_eq!(open.n(), 3);
    assert_matrix(
        "J",
        &open.storage.inject,
        &[&[1.0, 0.0, 0.0], &[0.0, 1.0, 0.0], &[0.0, 0.0, 1.0]],
    );
}

#[test]
fn a_capacitor_loop_with_a_source_shifts_the_state() {
    // V across c1 and c2 in series, r over c2: C2 v2' = i − v2/R, i = C1 (V' − v2').
    let s = free("v1 1 0 5\n c1 1 2 3u\n c2 2 0 1u\n r1 2 0 1k");
    assert_eq!(s.n(), 1);
    assert_eq!(s.states[0].name, "v(c1)");
    assert_matrix("A", &s.a, &[&[-1.0 / (1e3 * 4e-6)]]);
    // v1 = V − v2 and v2 = x₂ + ¾V would shift by ¾; the state here is v(c1) = x + ¼V.
    assert_matrix("shift", &s.shift, &[&[0.25]]);
    // v1' phys = −v2'…: (C1+C2) v1' = (V − v1)/R + C2 V'.
    assert_matrix("E", &s.e, &[&[0.75 / (1e3 * 4e-6)]]);
    // The source current contains u': i = −C1 v1' = −(…) − C1/4 V' … and at a step the charge 0.75 µC/V·V.
    let row = s.outputs.names.iter().position(|n| n == "i(v1)").unwrap();
    assert!(
        close(s.outputs.rows.du[(row, 0)], -0.75e-6),
        "{}",
        s.outputs.rows.du
    );
}

#[test]
fn an_inductor_cut_set_keeps_one_state() {
    let s = free("v1 1 0 1\n r0 1 2 2\n l1 2 3 1m\n l2 3 0 3m");
    assert_eq!(s.n(), 1);
    assert_matrix("A", &s.a, &[&[-2.0 / 4e-3]]);
    // Opening: 1 mH at 1 A and 3 mH at 0 A end at 0.25 A.
    assert_matrix("J", &s.storage.inject, &[&[0.25, 0.75]]);
}

#[test]
fn parallel_conducting_diodes_share_by_least_norm() {
    let s = held("i1 0 1 2\n d1 1 0\n d2 1 0", "cc");
    assert_matrix("guard", &s.held.guard.u, &[&[0.5], &[0.5]]);
    assert_eq!(s.held.kernel.ncols(), 1);
    assert!(close(s.held.kernel[(0, 0)], -s.held.kernel[(1, 0)]));
    assert_eq!(s.notes.len(), 1);
}

#[test]
fn a_node_between_blocking_diodes_is_in_the_middle() {
    let s = held("v1 1 0 -5\n d1 1 2\n d2 2 0", "oo");
    // −v(d1) and −v(d2) are both 2.5 V.
    assert_matrix("guard", &s.held.guard.u, &[&[-0.5], &[-0.5]]);
}

#[test]
fn a_conducting_diode_across_a_source_is_a_constraint() {
    let s = held("v1 1 0 5\n d1 1 0\n r1 1 0 1k", "c");
    assert_eq!(s.held.constraints.u.nrows(), 1);
    assert_matrix("constraint", &s.held.constraints.u, &[&[1.0]]);
}

#[test]
fn sources_against_each_other_are_an_error_unless_they_agree() {
    let position = |text: &str| try_held(text, "");
    assert_eq!(
        position("v1 1 0 5\n v2 1 0 6\n r1 1 0 1").unwrap_err(),
        ReduceError::Sources {
            elements: vec!["v1".into(), "v2".into()]
        }
    );
    let s = position("v1 1 0 5\n v2 1 0 5\n r1 1 0 1").unwrap();
    let k = |n: &str| s.outputs.names.iter().position(|m| m == n).unwrap();
    let row = |n: &str| s.outputs.rows.u.row(k(n)).sum();
    assert!(close(row("i(v1)") + row("i(v2)"), -1.0));
}

#[test]
fn a_diode_across_a_capacitor_pins_it() {
    let s = held("i1 0 1 1\n c1 1 0 1u\n d1 1 0", "c");
    assert_eq!(s.n(), 0);
    assert_matrix("guard", &s.held.guard.u, &[&[1.0]]);
    assert_eq!(s.storage.x.shape(), (1, 0));
    // A charge on the capacitor flows off as an impulse.
    assert_matrix("impulse", &s.held.impulse, &[&[1e-6]]);
}

#[test]
fn an_operating_point_has_open_capacitors_and_shorted_inductors() {
    let behaviour = behaviour(&circuit(
        "v1 1 0 5\n r1 1 2 1k\n l1 2 3 1m\n r2 3 0 1k\n c1 3 0 1u\n c2 3 4 1u\n c3 4 0 1u",
    ))
    .unwrap();
    let position = Position {
        storage: StorageHold::Static,
        ..Position::free(&behaviour, Vec::new())
    };
    let s = reduce(&behaviour, &position).unwrap();
    assert_eq!(s.n(), 0);
    let value = |n: &str| {
        let k = s.storage.names.iter().position(|m| m == n).unwrap();
        s.storage.u[(k, 0)]
    };
    assert!(close(value("i(l1)"), 0.5e-3));
    assert!(close(value("v(c1)"), 0.5));
    // Node 4 is held by capacitors alone: it stays at 0.
    assert_eq!(value("v(c3)"), 0.0);
    assert!(close(value("v(c2)"), 0.5));
}

#[test]
fn an_ideal_transformer_of_coupled_inductors() {
    // k = 1, 1 mH : 4 mH, load 40 Ω on the secondary is 10 Ω on the primary.
    let s = free("v1 1 0 1\n r0 1 2 5\n l1 2 0 1m\n l2 3 0 4m\n k1 l1 l2 1\n r1 3 0 40");
    assert_eq!(s.n(), 1);
    assert_eq!(s.states[0].name, "im(l1)");
    // v1 = V·(10/15) − (5∥10) i_m: A = −(50/15)/1e-3.
    assert_matrix("A", &s.a, &[&[-(10.0 / 3.0) / 1e-3]]);
    assert_matrix("E", &s.e, &[&[(2.0 / 3.0) / 1e-3]]);
    let k = s.outputs.names.iter().position(|n| n == "v(3)").unwrap();
    assert!(close(s.outputs.rows.u[(k, 0)], 4.0 / 3.0));
}
