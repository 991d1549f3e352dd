//! From a form to the system file that stands for it.

use nalgebra::DMatrix;
use serde_json::{Value, json};

use super::Affine;
use super::fields::Fields;

/// The system file that stands for a form.
pub(super) fn document(file: &Fields<'_>, affine: &Affine) -> Value {
    let rows = |m: &DMatrix<f64>| -> Value {
        m.row_iter()
            .map(|r| r.iter().copied().collect::<Vec<_>>())
            .collect()
    };
    let (n, m) = (affine.system.n(), affine.system.m());
    let fits = |name: &str, length: usize| {
        file.0
            .get(name)
            .filter(|v| v.as_array().is_some_and(|list| list.len() == length))
            .cloned()
    };
    let states: Vec<Value> = (1..=n)
        .map(|k| json!({"name": format!("x{k}"), "unit": "V"}))
        .collect();
    let port = |k: usize| {
        json!({"device": format!("d{k}"), "lambda": format!("i(d{k})"), "y": format!("-v(d{k})"),
               "law": {"kind": "ideal_diode"}})
    };
    let mut document = json!({
        "schema": "circ-lcs/1",
        "title": file.0.get("title").cloned().unwrap_or_else(|| json!("")),
        "states": fits("states", n).unwrap_or_else(|| states.into()),
        "inputs": file.0.get("inputs").cloned().unwrap_or_else(|| json!([])),
        "ports": fits("ports", m).unwrap_or_else(|| (1..=m).map(port).collect()),
        "A": rows(&affine.system.a),
        "B": rows(&affine.system.b),
        "C": rows(&affine.system.c),
        "D": rows(&affine.system.d),
        "E": rows(&affine.e),
        "G": rows(&affine.g),
        "e": affine.e0.as_slice(),
        "F": affine.f.as_slice(),
    });
    if let Some(p) = &affine.p {
        document["P"] = rows(p);
    }
    // The states are what can be seen of a form that names no outputs.
    let names: Vec<Value> = document["states"]
        .as_array()
        .into_iter()
        .flatten()
        .map(|s| s["name"].clone())
        .collect();
    let units: Vec<Value> = document["states"]
        .as_array()
        .into_iter()
        .flatten()
        .map(|s| s["unit"].clone())
        .collect();
    let inputs = affine.e.ncols();
    document["outputs"] = json!({
        "names": names,
        "units": units,
        "x": rows(&DMatrix::identity(n, n)),
        "lambda": rows(&DMatrix::zeros(n, m)),
        "u": rows(&DMatrix::zeros(n, inputs)),
        "du": rows(&DMatrix::zeros(n, inputs)),
        "one": vec![0.0; n],
    });
    for name in ["x0", "tran", "outputs"] {
        if let Some(value) = file.0.get(name) {
            document[name] = value.clone();
        }
    }
    document
}
