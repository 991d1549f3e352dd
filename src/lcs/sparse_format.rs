//! A system of many states as text: numpy and scipy, MATLAB, Matrix Market.

use std::fmt::Write as _;

use super::sparse::{Csr, SparseLcs};

/// Sizes and how full the matrices are, for people.
#[must_use]
pub fn summary(lcs: &SparseLcs) -> String {
    let mut out = format!(
        "{}\nx' = A x + B λ + E u + e,  y = C x + D λ + G u + F\nn = {} states, m = {} ports, p = {} inputs\n",
        lcs.title,
        lcs.states.len(),
        lcs.ports.len(),
        lcs.inputs.len()
    );
    for (letter, m) in lcs.matrices() {
        let [rows, columns] = m.shape;
        let _ = writeln!(
            out,
            "{letter}: {rows}×{columns}, {} entries that are not zero",
            m.data.len()
        );
    }
    out.push_str("the entries: --format json, numpy, matlab or mtx\n");
    out
}

fn listed<T: std::fmt::Debug>(values: &[T]) -> String {
    let listed: Vec<String> = values.iter().map(|v| format!("{v:?}")).collect();
    listed.join(", ")
}

fn names(lcs: &SparseLcs) -> [(&'static str, Vec<&str>); 4] {
    let ports = || lcs.ports.iter();
    [
        (
            "states",
            lcs.states.iter().map(|s| s.name.as_str()).collect(),
        ),
        (
            "inputs",
            lcs.inputs.iter().map(|s| s.name.as_str()).collect(),
        ),
        ("lambda", ports().map(|p| p.lambda.as_str()).collect()),
        ("y", ports().map(|p| p.y.as_str()).collect()),
    ]
}

/// A Python script that defines `scipy.sparse` matrices under the names of the dense one.
#[must_use]
pub fn numpy(lcs: &SparseLcs) -> String {
    let mut out = format!(
        "# {}\nimport numpy as np\nimport scipy.sparse as sp\n",
        lcs.title
    );
    for (name, list) in names(lcs) {
        let name = if name == "lambda" { "lambda_" } else { name };
        let _ = writeln!(out, "{name} = [{}]", listed(&list));
    }
    for (letter, m) in lcs.matrices() {
        let [rows, columns] = m.shape;
        let _ = writeln!(
            out,
            "{letter} = sp.csr_matrix((np.array([{}], dtype=float), np.array([{}], dtype=int), np.array([{}], dtype=int)), shape=({rows}, {columns}))",
            listed(&m.data),
            listed(&m.indices),
            listed(&m.indptr)
        );
    }
    for (letter, v) in [("e", &lcs.e0), ("F", &lcs.f)] {
        let _ = writeln!(
            out,
            "{letter} = np.array([{}], dtype=float).reshape({}, 1)",
            listed(v),
            v.len()
        );
    }
    out
}

/// A MATLAB or Octave script of `sparse` matrices.
#[must_use]
pub fn matlab(lcs: &SparseLcs) -> String {
    let mut out = format!("% {}\n", lcs.title);
    for (name, list) in names(lcs) {
        let quoted: Vec<String> = list.iter().map(|n| format!("'{n}'")).collect();
        let _ = writeln!(out, "{name} = {{{}}};", quoted.join(", "));
    }
    for (letter, m) in lcs.matrices() {
        let rows: Vec<usize> = m.entries().map(|(i, ..)| i + 1).collect();
        let columns: Vec<usize> = m.indices.iter().map(|j| j + 1).collect();
        let _ = writeln!(
            out,
            "{letter} = sparse([{}], [{}], [{}], {}, {});",
            listed(&rows),
            listed(&columns),
            listed(&m.data),
            m.shape[0],
            m.shape[1]
        );
    }
    for (letter, v) in [("e", &lcs.e0), ("F", &lcs.f)] {
        let _ = writeln!(out, "{letter} = reshape([{}], {}, 1);", listed(v), v.len());
    }
    out
}

/// Each matrix with its letter in the coordinate form of Matrix Market; e and F as matrices of one column.
#[must_use]
pub fn matrix_market(lcs: &SparseLcs) -> Vec<(&'static str, String)> {
    let column = |v: &[f64]| {
        let mut m = Csr::new(1);
        v.iter().for_each(|&v| m.push((v != 0.0).then_some((0, v))));
        m
    };
    let constants = [("e", column(&lcs.e0)), ("F", column(&lcs.f))];
    let matrices = lcs.matrices().into_iter();
    matrices
        .chain(constants.iter().map(|(letter, m)| (*letter, m)))
        .map(|(letter, m)| (letter, coordinates(letter, m)))
        .collect()
}

fn coordinates(letter: &str, m: &Csr) -> String {
    let mut out = format!(
        "%%MatrixMarket matrix coordinate real general\n% {letter} of x' = A x + B lambda + E u + e, y = C x + D lambda + G u + F\n{} {} {}\n",
        m.shape[0],
        m.shape[1],
        m.data.len()
    );
    for (i, j, value) in m.entries() {
        let _ = writeln!(out, "{} {} {value:?}", i + 1, j + 1);
    }
    out
}
