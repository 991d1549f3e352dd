//! The systems of the papers and of CIRCUITS.md, from the netlists that ship, up to the roles of ports.

use std::path::Path;

use super::*;
use crate::circuit::load::load;
use crate::circuit::{Circuit, ElaborateOptions};
use crate::lcs::LcsParts;
use crate::lcs::format::{Format, format};

pub(super) fn netlist(name: &str) -> Circuit {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("netlists")
        .join(name);
    let loaded = load(&path, &ElaborateOptions::default());
    loaded
        .circuit
        .unwrap_or_else(|| panic!("{name}: {:?}", loaded.diagnostics))
}

fn system(name: &str) -> Lcs {
    let behaviour = behaviour(&netlist(&format!("{name}.cir")))
        .unwrap()
        .standard();
    let off = vec![false; behaviour.switches.len()];
    reduce(&behaviour, &Position::free(&behaviour, off)).unwrap()
}

/// Exchanges λ and y of one port: a principal pivot.
fn exchange(s: &mut LcsParts, j: usize) {
    let pivot = s.d[(j, j)];
    let (row_c, row_d, row_g, f) = (
        s.c.row(j).into_owned(),
        s.d.row(j).into_owned(),
        s.g.row(j).into_owned(),
        s.f[j],
    );
    // λ_j = (y_j − C_j x − D_jR λ_R − G_j u − F_j)/D_jj
    let replace = |c: &mut DMatrix<f64>,
                   d: &mut DMatrix<f64>,
                   g: &mut DMatrix<f64>,
                   one: &mut DVector<f64>,
                   r: usize| {
        let factor = d[(r, j)] / pivot;
        let update = |m: &mut DMatrix<f64>, row: &nalgebra::RowDVector<f64>| {
            for k in 0..m.ncols() {
                m[(r, k)] -= factor * row[k];
            }
        };
        update(c, &row_c);
        update(d, &row_d);
        update(g, &row_g);
        one[r] -= factor * f;
        d[(r, j)] = factor;
    };
    for r in 0..s.n() {
        replace(&mut s.a, &mut s.b, &mut s.e, &mut s.e0, r);
    }
    for r in (0..s.m()).filter(|&r| r != j) {
        replace(&mut s.c, &mut s.d, &mut s.g, &mut s.f, r);
    }
    for k in 0..s.n() {
        s.c[(j, k)] = -row_c[k] / pivot;
    }
    for k in 0..s.m() {
        s.d[(j, k)] = -row_d[k] / pivot;
    }
    s.d[(j, j)] = 1.0 / pivot;
    for k in 0..s.p() {
        s.g[(j, k)] = -row_g[k] / pivot;
    }
    s.f[j] = -f / pivot;
    let port = &mut s.ports[j];
    std::mem::swap(&mut port.lambda, &mut port.y);
}

/// Exchanges λ and y of two ports at once, where each alone has a zero pivot.
fn exchange_both(s: &mut LcsParts, j: usize, k: usize) {
    // A mixing of the two rows makes both pivots nonzero: pivot on (j, k) and (k, j), then swap the names.
    let (djk, dkj) = (s.d[(j, k)], s.d[(k, j)]);
    assert!(djk != 0.0 && dkj != 0.0, "no pivot");
    let m = s.m();
    let block = DMatrix::from_row_slice(2, 2, &[s.d[(j, j)], djk, dkj, s.d[(k, k)]]);
    let inverse = block.try_inverse().unwrap();
    let set = [j, k];
    let rest: Vec<usize> = (0..m).filter(|r| !set.contains(r)).collect();
    let rows = |m: &DMatrix<f64>| m.select_rows(&set);
    let (c, d, g) = (rows(&s.c), rows(&s.d), rows(&s.g));
    let f = DVector::from_column_slice(&[s.f[j], s.f[k]]);
    // λ_S = W (y_S − C_S x − D_SR λ_R − G_S u − F_S)
    let coupling = s.b.select_columns(&set);
    s.a -= &coupling * &inverse * &c;
    s.e -= &coupling * &inverse * &g;
    s.e0 -= &coupling * &inverse * &f;
    for &r in &rest {
        let column = &coupling * &inverse * d.column(r);
        for i in 0..s.n() {
            s.b[(i, r)] -= column[i];
        }
    }
    let new = &coupling * &inverse;
    for i in 0..s.n() {
        s.b[(i, j)] = new[(i, 0)];
        s.b[(i, k)] = new[(i, 1)];
    }
    let old = s.d.clone();
    for &r in &rest {
        let factor = nalgebra::RowDVector::from_row_slice(&[old[(r, j)], old[(r, k)]]) * &inverse;
        for i in 0..s.n() {
            s.c[(r, i)] -= (&factor * c.column(i))[0];
        }
        for i in 0..s.p() {
            s.g[(r, i)] -= (&factor * g.column(i))[0];
        }
        s.f[r] -= (&factor * &f)[0];
        for &q in &rest {
            s.d[(r, q)] -= (&factor * d.column(q))[0];
        }
        s.d[(r, j)] = factor[0];
        s.d[(r, k)] = factor[1];
    }
    for (row, &r) in set.iter().enumerate() {
        let w = inverse.row(row).into_owned();
        for i in 0..s.n() {
            s.c[(r, i)] = -(&w * c.column(i))[0];
        }
        for i in 0..s.p() {
            s.g[(r, i)] = -(&w * g.column(i))[0];
        }
        s.f[r] = -(&w * &f)[0];
        for &q in &rest {
            s.d[(r, q)] = -(&w * d.column(q))[0];
        }
        s.d[(r, j)] = w[0];
        s.d[(r, k)] = w[1];
        let port = &mut s.ports[r];
        std::mem::swap(&mut port.lambda, &mut port.y);
    }
}

/// Brings the ports into the order and roles that `lambda` names.
fn arranged(s: Lcs, lambda: &[&str]) -> Lcs {
    let mut s = s.into_parts();
    loop {
        let wrong: Vec<usize> = (0..s.m())
            .filter(|&j| !lambda.contains(&s.ports[j].lambda.as_str()))
            .collect();
        if wrong.is_empty() {
            break;
        }
        if let Some(&j) = wrong.iter().find(|&&j| s.d[(j, j)] != 0.0) {
            exchange(&mut s, j);
            continue;
        }
        let pair = wrong.iter().enumerate().find_map(|(a, &j)| {
            wrong[a + 1..]
                .iter()
                .find(|&&k| s.d[(j, k)] * s.d[(k, j)] != 0.0)
                .map(|&k| (j, k))
        });
        let (j, k) = pair.unwrap_or_else(|| panic!("no exchange leads to {lambda:?}"));
        exchange_both(&mut s, j, k);
    }
    let order: Vec<usize> = lambda
        .iter()
        .map(|l| s.ports.iter().position(|p| p.lambda == **l).unwrap())
        .collect();
    s.b = s.b.select_columns(&order);
    s.c = s.c.select_rows(&order);
    s.d = s.d.select_rows(&order).select_columns(&order);
    s.g = s.g.select_rows(&order);
    s.f = DVector::from_iterator(order.len(), order.iter().map(|&j| s.f[j]));
    s.ports = order.iter().map(|&j| s.ports[j].clone()).collect();
    Lcs::new(s).unwrap()
}

const C: f64 = 1e-6;
const L: f64 = 10e-3;
const R: f64 = 1e3;
const CF: f64 = 300e-9;

#[test]
fn brogliato_thibault_equation_7() {
    let s = system("bt-fig-2-1");
    let (r, c) = (100.0, 10e-6);
    // In charge z = C v: z' = u/R − z/(RC) + ζ/R = w, the sign of u as the circuit has it.
    assert_eq!(
        (s.ports[0].lambda.as_str(), s.ports[0].y.as_str()),
        ("-v(d1)", "i(d1)")
    );
    assert_matrix("A", &s.a, &[&[-1.0 / (r * c)]]);
    assert_matrix("B", &s.b, &[&[1.0 / (r * c)]]);
    assert_matrix("E", &s.e, &[&[1.0 / (r * c)]]);
    assert_matrix("C", &s.c, &[&[-1.0 / r]]);
    assert_matrix("D", &s.d, &[&[1.0 / r]]);
    assert_matrix("G", &s.g, &[&[1.0 / r]]);
}

#[test]
fn brogliato_thibault_equation_8() {
    let s = system("bt-fig-2-2");
    assert_eq!(
        (s.ports[0].lambda.as_str(), s.ports[0].y.as_str()),
        ("-v(d1)", "i(d1)")
    );
    assert_matrix("A", &s.a, &[&[0.0]]);
    assert_matrix("B", &s.b, &[&[1.0 / 10e-3]]);
    assert_matrix("C", &s.c, &[&[1.0]]);
    assert_matrix("D", &s.d, &[&[0.0]]);
    assert_matrix("G", &s.g, &[&[-1.0]]);
}

#[test]
fn rr_7158_figure_2() {
    // i1 = (λ1 − v_c1 − v_cs)/R, i2 = (v_cs − v_c2 − v_c3)/R; (33) has misprints.
    let s = arranged(system("rr7158-fig-2"), &["-v(d1)", "i(d2)"]);
    let g = 1.0 / (R * C);
    assert_matrix(
        "A",
        &s.a,
        &[
            &[-g, -g, 0.0, 0.0],
            &[-g, -2.0 * g, g, g],
            &[0.0, g, -g, -g],
            &[0.0, g, -g, -g],
        ],
    );
    assert_matrix(
        "B",
        &s.b,
        &[&[g, 0.0], &[g, 0.0], &[0.0, 0.0], &[0.0, 1.0 / C]],
    );
    assert_matrix(
        "C",
        &s.c,
        &[&[-1.0 / R, -1.0 / R, 0.0, 0.0], &[0.0, 0.0, 0.0, 1.0]],
    );
    assert_matrix("D", &s.d, &[&[1.0 / R, 0.0], &[0.0, 0.0]]);
}

#[test]
fn rr_7158_equations_36_and_37() {
    let s = arranged(
        system("bridge-resistor"),
        &["-v(dr1)", "-v(df2)", "i(df1)", "i(dr2)"],
    );
    assert_matrix("A", &s.a, &[&[0.0, -1.0 / C], &[1.0 / L, 0.0]]);
    assert_matrix("B", &s.b, &[&[0.0, 0.0, -1.0 / C, 1.0 / C], &[0.0; 4]]);
    assert_matrix(
        "C",
        &s.c,
        &[&[0.0, 0.0], &[0.0, 0.0], &[-1.0, 0.0], &[1.0, 0.0]],
    );
    let g = 1.0 / R;
    assert_matrix(
        "D",
        &s.d,
        &[
            &[g, g, -1.0, 0.0],
            &[g, g, 0.0, -1.0],
            &[1.0, 0.0, 0.0, 0.0],
            &[0.0, 1.0, 0.0, 0.0],
        ],
    );
    assert_matrix("P", &s.energy, &[&[C, 0.0], &[0.0, L]]);
}

const SKEW: [&[f64]; 4] = [
    &[0.0, -1.0, 0.0, 0.0],
    &[1.0, 0.0, 1.0, -1.0],
    &[0.0, -1.0, 0.0, 0.0],
    &[0.0, 1.0, 0.0, 0.0],
];
const LAMBDA: [&str; 4] = ["i(dr1)", "-v(df2)", "i(df1)", "i(dr2)"];

#[test]
fn rr_7158_equation_38() {
    let s = arranged(system("rr7158-eq-38"), &LAMBDA);
    assert_matrix("A", &s.a, &[&[-1.0 / (R * CF)]]);
    assert_matrix("B", &s.b, &[&[1.0 / CF, 0.0, 1.0 / CF, 0.0]]);
    assert_matrix("C", &s.c, &[&[1.0], &[0.0], &[1.0], &[0.0]]);
    assert_matrix("D", &s.d, &SKEW);
}

#[test]
fn bridge_with_capacitor_filter() {
    let s = arranged(system("bridge-capacitor-filter"), &LAMBDA);
    let names: Vec<&str> = s.states.iter().map(|x| x.name.as_str()).collect();
    assert_eq!(names, ["v(c1)", "v(cf)", "i(l1)"]);
    assert_matrix(
        "A",
        &s.a,
        &[
            &[0.0, 0.0, -1.0 / C],
            &[0.0, -1.0 / (R * CF), 0.0],
            &[1.0 / L, 0.0, 0.0],
        ],
    );
    assert_matrix(
        "B",
        &s.b,
        &[
            &[0.0, 0.0, -1.0 / C, 1.0 / C],
            &[1.0 / CF, 0.0, 1.0 / CF, 0.0],
            &[0.0; 4],
        ],
    );
    assert_matrix(
        "C",
        &s.c,
        &[
            &[0.0, 1.0, 0.0],
            &[0.0, 0.0, 0.0],
            &[-1.0, 1.0, 0.0],
            &[1.0, 0.0, 0.0],
        ],
    );
    assert_matrix("D", &s.d, &SKEW);
}

#[test]
fn bridge_on_a_source_with_threshold() {
    // The pairs are named after their slack: y = 0.21 V − v.
    let s = system("bridge-source");
    let role =
        |device: &str, current: bool| format!("{device}.{}", if current { "t1" } else { "a" });
    let names = [
        role("dr1", true),
        role("df2", false),
        role("df1", true),
        role("dr2", true),
    ];
    let s = arranged(s, &names.each_ref().map(String::as_str));
    assert_matrix("A", &s.a, &[&[-1.0 / (R * CF)]]);
    assert_matrix("B", &s.b, &[&[1.0 / CF, 0.0, 1.0 / CF, 0.0]]);
    assert_matrix("C", &s.c, &[&[1.0], &[0.0], &[1.0], &[0.0]]);
    assert_matrix("D", &s.d, &SKEW);
    assert_matrix("G", &s.g, &[&[0.0], &[0.0], &[-1.0], &[1.0]]);
    assert!(close(s.f[0], 0.42) && close(s.f[2], 0.42));
    assert_eq!((s.f[1], s.f[3]), (0.0, 0.0));
}

#[test]
fn the_text_form_names_every_row() {
    for name in [
        "bt-fig-2-1",
        "rr7158-fig-2",
        "bridge-resistor",
        "capacitor-loop",
    ] {
        insta::with_settings!({ prepend_module_to_snapshot => false, omit_expression => true }, {
            insta::assert_snapshot!(name, format(&system(name), Format::Text));
        });
    }
}
