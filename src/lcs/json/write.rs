//! From a system to its text.

use nalgebra::{DMatrix, DVector};

use super::{
    Document, InputDoc, LawDoc, MatrixDoc, OutputsDoc, PortDoc, SCHEMA, StateDoc, TranDoc,
};
use crate::circuit::Tran;
use crate::circuit::source::Form;
use crate::law::Law;
use crate::lcs::{Csr, Input, Lcs, Port, SparseLcs};

fn rows(m: &DMatrix<f64>) -> MatrixDoc {
    // −0.0 and 0.0 are one number to a reader.
    let row = |i: usize| (0..m.ncols()).map(|j| m[(i, j)] + 0.0).collect();
    MatrixDoc::Rows((0..m.nrows()).map(row).collect())
}

fn compressed(m: &Csr) -> MatrixDoc {
    MatrixDoc::Compressed(m.clone())
}

fn numbers<'v>(values: impl IntoIterator<Item = &'v f64>) -> Vec<f64> {
    values.into_iter().map(|v| v + 0.0).collect()
}

fn input_documents(inputs: &[Input]) -> Vec<InputDoc> {
    let document = |input: &Input| InputDoc {
        name: input.name.clone(),
        unit: input.unit.to_owned(),
        waveform: Form::from(&input.source.wave),
        dc: Some(input.source.dc),
    };
    inputs.iter().map(document).collect()
}

fn port_documents(ports: &[Port]) -> Vec<PortDoc> {
    let document = |p: &Port| PortDoc {
        device: p.device.clone(),
        lambda: p.lambda.clone(),
        y: p.y.clone(),
        law: law_document(&p.law),
    };
    ports.iter().map(document).collect()
}

fn tran_document(t: Tran) -> TranDoc {
    TranDoc {
        tstep: t.tstep,
        tstop: t.tstop,
        tstart: (t.tstart != 0.0).then_some(t.tstart),
        tmax: t.tmax,
        uic: t.uic,
    }
}

fn positions(switches: &[(String, bool)]) -> serde_json::Map<String, serde_json::Value> {
    let position = |on: bool| if on { "on" } else { "off" };
    switches
        .iter()
        .map(|(name, on)| (name.clone(), position(*on).into()))
        .collect()
}

fn law_document(law: &Law) -> LawDoc {
    let kind = law.kind().to_owned();
    match law {
        Law::Diode { vfwd, ron, roff } => LawDoc {
            kind,
            vfwd: (vfwd.f64 != 0.0).then_some(vfwd.f64),
            ron: (ron.f64 != 0.0).then_some(ron.f64),
            roff: roff.map(|r| r.f64),
            ..LawDoc::default()
        },
        Law::Curve(curve) => LawDoc {
            kind,
            vertices: Some(curve.vertices.iter().map(|v| [v.0.f64, v.1.f64]).collect()),
            first: Some([curve.first.0.f64, curve.first.1.f64]),
            last: Some([curve.last.0.f64, curve.last.1.f64]),
            ..LawDoc::default()
        },
        Law::Rounded(diode) => LawDoc {
            kind,
            conductance: Some(diode.g),
            forward: Some([diode.forward.v, diode.forward.g, diode.forward.width]),
            reverse: diode.reverse.map(|c| [c.v, c.g, c.width]),
            ..LawDoc::default()
        },
        Law::Exponential(diode) => LawDoc {
            kind,
            is: Some(diode.is),
            slope: Some(diode.slope),
            rs: (diode.rs != 0.0).then_some(diode.rs),
            leak: (diode.leak != 0.0).then_some(diode.leak),
            bv: diode.breakdown.map(|b| b.bv),
            ibv: diode.breakdown.map(|b| b.ibv),
            breakdown_slope: diode.breakdown.map(|b| b.slope),
            ..LawDoc::default()
        },
    }
}

/// Writes a system, one matrix row per array, doubles so that they read back to the same bits.
#[must_use]
pub fn write(lcs: &Lcs, x0: &DVector<f64>, tran: Option<Tran>) -> String {
    let named = |values: &[f64]| -> serde_json::Map<String, serde_json::Value> {
        lcs.inputs
            .iter()
            .zip(values)
            .filter(|(_, v)| **v != 0.0)
            .map(|(input, v)| (input.name.clone(), (*v).into()))
            .collect()
    };
    let out = &lcs.outputs;
    let document = Document {
        schema: SCHEMA.to_owned(),
        title: lcs.title.clone(),
        states: lcs
            .states
            .iter()
            .enumerate()
            .map(|(k, s)| StateDoc {
                name: s.name.clone(),
                unit: s.unit.to_owned(),
                shift: named(&lcs.shift.row(k).iter().copied().collect::<Vec<_>>()),
            })
            .collect(),
        inputs: input_documents(&lcs.inputs),
        ports: port_documents(&lcs.ports),
        a: rows(&lcs.a),
        b: rows(&lcs.b),
        c: rows(&lcs.c),
        d: rows(&lcs.d),
        e: rows(&lcs.e),
        g: rows(&lcs.g),
        e0: numbers(&lcs.e0),
        f: numbers(&lcs.f),
        x0: numbers(x0),
        p: rows(&lcs.energy),
        outputs: OutputsDoc {
            names: out.names.clone(),
            units: out.units.iter().map(|u| (*u).to_owned()).collect(),
            x: rows(&out.rows.x),
            lambda: rows(&out.rows.lambda),
            u: rows(&out.rows.u),
            du: rows(&out.rows.du),
            one: numbers(&out.rows.one),
        },
        tran: tran.map(tran_document),
        switches: positions(&lcs.switches),
    };
    lines(&document)
}

/// As [`write()`], each matrix in compressed rows.
#[must_use]
pub fn write_sparse(lcs: &SparseLcs, x0: &[f64], tran: Option<Tran>) -> String {
    let mut shift = vec![serde_json::Map::new(); lcs.states.len()];
    for (k, j, value) in lcs.shift.entries() {
        shift[k].insert(lcs.inputs[j].name.clone(), value.into());
    }
    let states = lcs.states.iter().zip(shift);
    let document = Document {
        schema: SCHEMA.to_owned(),
        title: lcs.title.clone(),
        states: states
            .map(|(s, shift)| StateDoc {
                name: s.name.clone(),
                unit: s.unit.to_owned(),
                shift,
            })
            .collect(),
        inputs: input_documents(&lcs.inputs),
        ports: port_documents(&lcs.ports),
        a: compressed(&lcs.a),
        b: compressed(&lcs.b),
        c: compressed(&lcs.c),
        d: compressed(&lcs.d),
        e: compressed(&lcs.e),
        g: compressed(&lcs.g),
        e0: numbers(&lcs.e0),
        f: numbers(&lcs.f),
        x0: numbers(x0),
        p: compressed(&lcs.energy),
        outputs: OutputsDoc {
            names: lcs.outputs.iter().map(|(name, _)| name.clone()).collect(),
            units: (lcs.outputs.iter())
                .map(|(_, unit)| (*unit).to_owned())
                .collect(),
            x: compressed(&lcs.output_rows.x),
            lambda: compressed(&lcs.output_rows.lambda),
            u: compressed(&lcs.output_rows.u),
            du: compressed(&lcs.output_rows.du),
            one: numbers(&lcs.output_rows.one),
        },
        tran: tran.map(tran_document),
        switches: positions(&lcs.switches),
    };
    lines(&document)
}

/// JSON with one line per top-level key and per matrix row.
fn lines(document: &Document) -> String {
    let Ok(serde_json::Value::Object(map)) = serde_json::to_value(document) else {
        return String::new();
    };
    let order = [
        "schema", "title", "states", "inputs", "ports", "A", "B", "C", "D", "E", "G", "e", "F",
        "x0", "P", "outputs", "tran", "switches",
    ];
    let entries: Vec<String> = order
        .iter()
        .filter_map(|key| map.get(*key).map(|value| (key, value)))
        .map(|(key, value)| {
            let text = match value {
                serde_json::Value::Array(items)
                    if items.iter().any(|i| i.is_array() || i.is_object()) =>
                {
                    let rows: Vec<String> = items.iter().map(|i| format!("    {i}")).collect();
                    format!("[\n{}\n  ]", rows.join(",\n"))
                }
                other => other.to_string(),
            };
            format!("  \"{key}\": {text}")
        })
        .collect();
    format!("{{\n{}\n}}\n", entries.join(",\n"))
}
