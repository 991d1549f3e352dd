//! Systems derived by hand.

use super::*;
use crate::mna::StaticMultiport;

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

fn at(text: &str, switches: &[bool], storage: StorageHold) -> Result<Lcs, ReduceError> {
    let behaviour = behaviour(&circuit(text)).unwrap();
    let position = Position {
        storage,
        ..Position::free(&behaviour, switches.to_vec())
    };
    reduce(&behaviour, &position)
}

#[test]
fn a_conflict_names_what_joins_the_sources() {
    let names = |result: Result<Lcs, ReduceError>| match result.unwrap_err() {
        ReduceError::Sources { elements } => elements.join(" "),
        other => panic!("{other}"),
    };
    let dynamic = StorageHold::Dynamic;
    assert_eq!(
        names(at(
            "v1 1 0 5\n s1 1 2 0\n s2 2 0 0\n r1 1 2 1",
            &[true, true],
            dynamic
        )),
        "v1 s1 s2"
    );
    assert!(
        at(
            "v1 1 0 5\n s1 1 2 0\n s2 2 0 0\n r1 1 2 1",
            &[true, false],
            dynamic
        )
        .is_ok()
    );
    assert_eq!(
        names(at("i1 0 1 5\n s1 1 2 0\n r1 2 0 1", &[false], dynamic)),
        "i1 s1"
    );
    // At an operating point the source's value at that instant decides.
    let operating_point = |text: &str| {
        at(text, &[], StorageHold::Static)
            .unwrap()
            .into_parts()
            .held
    };
    let found = operating_point("v1 1 0 5\n l1 1 2 1m\n l2 2 0 1m");
    assert_eq!(found.constrained, [["v1", "l1", "l2"]]);
    assert_matrix("v1 = 0", &found.constraints.u, &[&[1.0]]);
    let found = operating_point("i1 0 1 5\n c1 1 2 1u\n r1 2 0 1");
    assert_eq!(found.constrained, [["i1", "c1"]]);
    let found = held("v1 1 0 5\n d1 1 2\n d2 2 0\n r1 1 2 1", "cc")
        .into_parts()
        .held;
    assert_eq!(found.constrained, [["v1", "d1", "d2"]]);
}

#[test]
fn what_would_need_a_derivative_is_an_error_that_says_so() {
    // The comparator watches the current of a capacitor across a source.
    let text = "v1 1 0 5\n c1 1 0 1u\n h1 2 0 v1 10\n r1 2 0 1k\n rel1 3 0 2 0\n r2 3 0 1";
    let error = at(text, &[], StorageHold::Dynamic).unwrap_err();
    assert_eq!(error.to_string(), "rel1 depends on the derivative of v1");
    // So does a diode, whose voltage and current are not prescribed.
    let text = "v1 1 0 5\n c1 1 0 1u\n h1 2 0 v1 -10\n r1 2 3 1k\n d1 3 0";
    let error = at(text, &[], StorageHold::Dynamic).unwrap_err();
    assert_eq!(error.to_string(), "d1 depends on the derivative of v1");
    // The comparator's output charges a capacitor without any resistance.
    let text = "v1 1 0 5\n r1 1 0 1\n rel1 2 0 1 0\n c1 2 0 1u";
    let error = at(text, &[], StorageHold::Dynamic).unwrap_err();
    assert_eq!(
        error.to_string(),
        "v(c1) follows rel1 without delay, so its current would be a derivative"
    );
}

#[test]
fn only_ideal_pairs_can_be_held() {
    let error = try_held("v1 1 0 5\n r1 1 2 1\n d1 2 0 0.7 0", "c").unwrap_err();
    assert_eq!(
        error,
        ReduceError::NotIdeal {
            device: "d1".into()
        }
    );
    let error = try_held("v1 1 0 5\n r1 1 2 1\n d1 2 0", "").unwrap_err();
    assert_eq!(
        error.to_string(),
        "a position with 0 devices for a circuit with 1"
    );
}

#[test]
fn windings_of_two_fluxes_and_of_one() {
    // k = 0.5: L = [[1, 1], [1, 4]] mH.
    let s = free("v1 1 0 1\n r0 1 2 5\n l1 2 0 1m\n l2 3 0 4m\n k1 l1 l2 0.5\n r1 3 0 40");
    assert_matrix("P", &s.energy, &[&[1e-3, 1e-3], &[1e-3, 4e-3]]);
    // Three windings on one core with a fourth turns ratio: k = 1 throughout, one state.
    let text = "v1 1 0 1\n r0 1 2 5\n l1 2 0 1m\n l2 3 0 4m\n l3 4 0 9m\n r1 3 0 40\n r2 4 0 90\n";
    let s = free(&format!("{text} k1 l1 l2 1\n k2 l1 l3 1\n k3 l2 l3 1"));
    assert_eq!(s.n(), 1);
    // Both loads are 10 Ω on the primary: 5 ∥ 5 = 2.5 Ω.
    assert_matrix("A", &s.a, &[&[-2.5 / 1e-3]]);
    // k23 = −1 with the others 1 is impossible.
    let impossible = circuit(&format!("{text} k1 l1 l2 1\n k2 l1 l3 1\n k3 l2 l3 -1"));
    assert!(behaviour(&impossible).is_err());
}

#[test]
fn tight_coupling_keeps_all_its_digits() {
    // 1 − k² = 2·10⁻¹²: the leakage decides the fast eigenvalue.
    let s = free("l1 1 0 1m\n l2 2 0 1m\n k1 l1 l2 0.999999999999\n r1 1 0 1\n r2 2 0 1");
    let k = 1.0 - 1e-12;
    let leakage = 1e-3 * 1.999_999_999_999e-12;
    // L⁻¹ = [[1, −k], [−k, 1]]/(L (1 − k²))
    assert_matrix(
        "A",
        &s.a,
        &[
            &[-1.0 / leakage, k / leakage],
            &[k / leakage, -1.0 / leakage],
        ],
    );
}

#[test]
fn floating_parts_have_a_reference_of_their_own() {
    let c =
        circuit("v1 1 0 1\n r0 1 0 5\n l1 1 0 1m\n l2 a b 4m\n k1 l1 l2 0.5\n d1 a c\n c1 c b 1u");
    let behaviour = behaviour(&c).unwrap();
    assert_eq!(behaviour.notes.len(), 1);
    let s = reduce(&behaviour, &Position::free(&behaviour, Vec::new())).unwrap();
    let row = |n: &str| s.outputs.names.iter().position(|m| m == n).unwrap();
    // a is the reference.
    let a = row("v(a)");
    assert_eq!(
        (
            s.outputs.rows.x.row(a).amax(),
            s.outputs.rows.lambda.row(a).amax()
        ),
        (0.0, 0.0)
    );
    // v(c) − v(b) is the capacitor.
    let difference = s.outputs.rows.x.row(row("v(c)")) - s.outputs.rows.x.row(row("v(b)"));
    let k = s.states.iter().position(|x| x.name == "v(c1)").unwrap();
    assert!(close(difference[k], 1.0) && close(difference.sum(), 1.0));
}

#[test]
fn measured_matrices_reduce_like_the_circuit_they_came_from() {
    // The skew bridge written as doubles: its modes need D's exact rank, which thirds do not have as doubles.
    let text = "c1 1 0 3u\n l1 1 0 7m\n d1 1 2\n d2 0 2\n d3 3 1\n d4 3 0\n cf 2 3 300n\n r1 2 3 3\n r2 2 4 7\n r3 4 3 11";
    let circuit_behaviour = behaviour(&circuit(text)).unwrap();
    let s = reduce(
        &circuit_behaviour,
        &Position::free(&circuit_behaviour, Vec::new()),
    )
    .unwrap();
    let matrices = StaticMultiport::from_lcs(&s);
    let again = reduce(&matrices, &Position::free(&matrices, Vec::new())).unwrap();
    assert_eq!(
        (&again.a, &again.b, &again.c, &again.d),
        (&s.a, &s.b, &s.c, &s.d)
    );
    for pattern in 0..16u32 {
        let devices = (0..4)
            .map(|k| {
                if pattern >> k & 1 == 1 {
                    Hold::Closed
                } else {
                    Hold::Open
                }
            })
            .collect::<Vec<_>>();
        let position = Position {
            devices,
            ..Position::free(&matrices, Vec::new())
        };
        let mode = reduce(&matrices, &position).unwrap();
        let truth = reduce(&circuit_behaviour, &position).unwrap();
        assert_eq!(
            (mode.n(), mode.held.kernel.ncols()),
            (truth.n(), truth.held.kernel.ncols()),
            "{pattern:b}"
        );
        // The same eigenvalues, whatever states represent the mode.
        let trace = |m: &DMatrix<f64>| m.trace();
        assert!(
            (trace(&mode.a) - trace(&truth.a)).abs() <= 1e-9 * trace(&truth.a).abs(),
            "{pattern:b}"
        );
    }
}

#[test]
fn pivots_are_exchanged_before_a_sound_active_circuit_is_accused() {
    // The diode hangs on 1.4 v(l1), and l1 carries no current: greedy order makes v(l1) follow the diode.
    let text = "d1 0 4\n l1 2 0 88u\n e1 4 0 3 2 1.4";
    let behaviour = behaviour(&circuit(text)).unwrap();
    let position = Position::free(&behaviour, Vec::new());
    assert!(!crate::lcs::reduce::oracle::standard_order_suffices(
        &behaviour, &position
    ));
    let s = reduce(&behaviour, &position).unwrap();
    assert_eq!((s.n(), s.m()), (0, 1));
    assert_eq!(s.ports[0].y, "-v(d1)");
    assert_matrix("D", &s.d, &[&[0.0]]);
}

#[test]
fn a_junction_in_parallel_with_a_diode_changes_roles() {
    // f1 carries 100 i(d2): with y = i(d1), i(d2) the voltage of both would be asked for, and d3 would be left without y.
    let s = free("r1 1 0 1k\n d1 1 0\n d2 1 0\n r2 2 0 1k\n d3 1 2\n f1 2 0 d2 100");
    let lambdas: Vec<&str> = s.ports.iter().map(|p| p.lambda.as_str()).collect();
    assert_eq!(lambdas, ["i(d1)", "-v(d2)", "i(d3)"]);
    // v1 = −λ2, i2 = −v1/R1 − λ1 − λ3, y3 = −v(d3) = R2 (λ3 − 100 i2) − v1.
    assert_matrix(
        "D",
        &s.d,
        &[
            &[0.0, 1.0, 0.0],
            &[-1.0, 1e-3, -1.0],
            &[1e5, 1.0 - 1e2, 1e3 + 1e5],
        ],
    );
}

#[test]
fn a_junction_that_no_other_one_hides_keeps_its_role() {
    // Both are in one loop with two capacitors, so that λ are −v of one and i of the other, whichever is which; 1 MΩ alone is beside them.
    let s = free("r1 1 0 1meg\n j1 1 2 1e-18\n j2 1 3 1e-18\n c1 2 0 1u\n c2 3 0 1u");
    let lambdas: Vec<&str> = s.ports.iter().map(|p| p.lambda.as_str()).collect();
    assert_eq!(lambdas, ["-v(j1)", "i(j2)"]);
}

#[test]
fn a_junction_hidden_by_another_one_beside_a_small_resistance_changes_roles() {
    // With −v of both D = 10³ S [1, 1; 1, 1], beside which neither leaks anything.
    let s = free("j1 0 1 10f\n j2 1 2 10f\n i1 0 1 1\n r1 2 3 1m\n c1 3 0 1u");
    let lambdas: Vec<&str> = s.ports.iter().map(|p| p.lambda.as_str()).collect();
    assert_eq!(lambdas, ["-v(j1)", "i(j2)"]);
    assert_matrix("D", &s.d, &[&[0.0, 1.0], &[-1.0, 1e-3]]);
}
