//! Piecewise-linear laws as ideal pairs: the pairs and the law say the same.

use super::*;
use crate::law::{Curve, Law};
use crate::mna::fixture::circuit;

/// A device alone with a current source of 1 A/unit: for every combination of conducting and blocking pairs that is
/// consistent the point (v, i) must lie on the law, and together the combinations must cover the given currents.
fn check(law: &Law, currents: &[f64]) {
    let mut c = circuit("i1 0 1 1\n d1 1 0");
    let device = c.element("d1").unwrap();
    c.elements[device.index()].kind = crate::circuit::Kind::Device(law.clone());
    c.probes.clear();
    let behaviour = behaviour(&c).unwrap().standard();
    let pairs = behaviour.pairs.len();
    let curve = law.curve().unwrap();
    for &i in currents {
        let mut found = 0;
        for pattern in 0..1u32 << pairs {
            let hold = |k: usize| {
                if pattern >> k & 1 == 1 {
                    Hold::Closed
                } else {
                    Hold::Open
                }
            };
            let position = Position {
                devices: (0..pairs).map(hold).collect(),
                ..Position::free(&behaviour, Vec::new())
            };
            let Ok(s) = reduce(&behaviour, &position) else {
                continue;
            };
            let value = |rows: &Rows, k: usize| rows.u[(k, 0)] * i + rows.one[k];
            let guards = &s.held.guard;
            let holds = (0..s.held.constraints.one.len())
                .all(|k| value(&s.held.constraints, k).abs() < 1e-12)
                && (0..pairs).all(|k| value(guards, k) >= -1e-12);
            if !holds || s.held.kernel.ncols() > 0 {
                continue;
            }
            found += 1;
            let v = value(&s.outputs.rows, 0);
            assert!(
                curve.contains(v, i, 1.0, 1e-9),
                "{v} V at {i} A is not on {law:?}"
            );
        }
        assert!(found > 0, "no pattern of pairs carries {i} A on {law:?}");
    }
}

#[test]
fn pairs_reproduce_their_law() {
    let currents = [-3.0, -0.5, 0.25, 2.0];
    let zero = || 0.0.into();
    let zener = Curve::zener((5.0.into(), zero()), (0.7.into(), zero()), None);
    check(&Law::Curve(zener), &currents);
    check(
        &Law::Curve(Curve::saturation(
            ((-0.5).into(), (-4.0).into()),
            (0.5.into(), 3.0.into()),
        )),
        &[-3.0, 0.1, 2.0],
    );
    let dead = Curve::dead_zone(
        ((-1.0).into(), 1.0.into()),
        zero(),
        (2.0.into(), 2.0.into()),
    );
    check(&Law::Curve(dead), &[-3.0, 2.0]);
    let diode = |vfwd: f64, ron: f64, roff: Option<f64>| Law::Diode {
        vfwd: vfwd.into(),
        ron: ron.into(),
        roff: roff.map(Into::into),
    };
    check(&diode(0.7, 0.1, Some(1e3)), &currents);
    check(&diode(0.7, 0.0, Some(1e3)), &currents);
    check(&diode(0.0, 0.1, None), &[0.5, 2.0]);
    check(&diode(0.7, 5.0, Some(5.0)), &currents);
    let point = |v: f64, i: f64| (v.into(), i.into());
    let points = vec![
        point(-1.0, -1.0),
        point(0.0, -0.5),
        point(0.5, 1.0),
        point(2.0, 1.5),
    ];
    check(
        &Law::Curve(Curve::table(points, point(1.0, 0.5), point(0.0, 1.0))),
        &currents,
    );
}

#[test]
fn a_rectifier_with_drop_and_resistance() {
    let behaviour = behaviour(&circuit("v1 1 0 5\n d1 1 2 0.7 0.1\n c1 2 0 1u"))
        .unwrap()
        .standard();
    let s = reduce(&behaviour, &Position::free(&behaviour, Vec::new())).unwrap();
    assert_eq!(s.ports.len(), 1);
    assert_eq!(s.ports[0].device, "d1");
    // λ = a: v = 0.7 − a + 0.1 t, t = (u − x − 0.7 + a)/0.1.
    assert_matrix("D", &s.d, &[&[10.0]]);
    assert_matrix("C", &s.c, &[&[-10.0]]);
    assert_matrix("G", &s.g, &[&[10.0]]);
    assert!(close(s.f[0], -7.0));
    assert_matrix("B", &s.b, &[&[1e7]]);
}

#[test]
fn zeners_keep_a_passive_circuit_passive() {
    let text = "v1 1 0 5\n r1 1 2 10\n z1 2 3 -5 1\n d1 3 0\n c1 2 0 1u\n l1 3 0 1m";
    let behaviour = behaviour(&circuit(text)).unwrap().standard();
    let s = reduce(&behaviour, &Position::free(&behaviour, Vec::new())).unwrap();
    assert_eq!(s.m(), 3);
    let symmetric = &s.d + s.d.transpose();
    assert!(
        symmetric.symmetric_eigenvalues().min() > -1e-12,
        "{symmetric}"
    );
    let names: Vec<&str> = s.ports.iter().map(|p| p.device.as_str()).collect();
    assert_eq!(names, ["z1.1", "z1.2", "d1"]);
}
