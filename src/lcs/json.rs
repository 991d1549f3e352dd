//! The system as JSON, schema `circ-lcs/1`, written and read.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::{Input, Lcs, Outputs, Port, Role, Rows, State, Storage};
use crate::algebra::Value;
use crate::circuit::Tran;
use crate::circuit::source::{Form, Source, WaveError};
use crate::law::{Curve, CurveError, Law};

/// The name of the schema.
pub const SCHEMA: &str = "circ-lcs/1";

/// A system with what a simulation of it needs.
#[derive(Debug, Clone)]
pub struct SystemFile {
    /// The system.
    pub lcs: Lcs,
    /// The (shifted) state at the start.
    pub x0: DVector<f64>,
    /// The transient analysis, if the file names one.
    pub tran: Option<Tran>,
}

/// What is wrong with a system file.
#[derive(Debug, thiserror::Error)]
pub enum JsonError {
    /// Not JSON, or not of the schema's form.
    #[error("not a circ system: {0}")]
    Syntax(#[from] serde_json::Error),
    /// Another schema.
    #[error("the schema is `{0}`, not `circ-lcs/1`")]
    Schema(String),
    /// A matrix of the wrong shape.
    #[error("{name} must be {rows}×{cols}")]
    Shape {
        /// The matrix.
        name: &'static str,
        /// Rows it should have.
        rows: usize,
        /// Columns it should have.
        cols: usize,
    },
    /// An entry that is not finite.
    #[error("{0} has an entry that is not finite")]
    NotFinite(&'static str),
    /// A port whose two names fit no role.
    #[error("port `{0}`: λ must be `i(NAME)` or `-v(NAME)` with y the other, or a block's output")]
    Role(String),
    /// An unknown law.
    #[error("port `{device}`: unknown law `{kind}`")]
    Law {
        /// The device.
        device: String,
        /// What the file says.
        kind: String,
    },
    /// A law that is not monotone.
    #[error("port `{device}`: {reason}")]
    Curve {
        /// The device.
        device: String,
        /// What is wrong with its curve.
        reason: CurveError,
    },
    /// A waveform.
    #[error("input `{name}`: {source}")]
    Wave {
        /// The input.
        name: String,
        /// What is wrong.
        source: WaveError,
    },
    /// A time span that cannot be simulated.
    #[error("tran: tstep and tstop must be positive")]
    Tran,
}

#[derive(Serialize, Deserialize)]
struct Document {
    schema: String,
    #[serde(default)]
    title: String,
    states: Vec<StateDoc>,
    #[serde(default)]
    inputs: Vec<InputDoc>,
    #[serde(default)]
    ports: Vec<PortDoc>,
    #[serde(rename = "A")]
    a: Vec<Vec<f64>>,
    #[serde(rename = "B", default)]
    b: Vec<Vec<f64>>,
    #[serde(rename = "C", default)]
    c: Vec<Vec<f64>>,
    #[serde(rename = "D", default)]
    d: Vec<Vec<f64>>,
    #[serde(rename = "E", default)]
    e: Vec<Vec<f64>>,
    #[serde(rename = "G", default)]
    g: Vec<Vec<f64>>,
    #[serde(rename = "e", default)]
    e0: Vec<f64>,
    #[serde(rename = "F", default)]
    f: Vec<f64>,
    #[serde(default)]
    x0: Vec<f64>,
    /// Stored energy ½ xᵀ P x.
    #[serde(rename = "P", default, skip_serializing_if = "Vec::is_empty")]
    p: Vec<Vec<f64>>,
    #[serde(default)]
    outputs: OutputsDoc,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    tran: Option<TranDoc>,
    #[serde(default, skip_serializing_if = "serde_json::Map::is_empty")]
    switches: serde_json::Map<String, serde_json::Value>,
}

#[derive(Serialize, Deserialize)]
struct StateDoc {
    name: String,
    #[serde(default)]
    unit: String,
    #[serde(default, skip_serializing_if = "serde_json::Map::is_empty")]
    shift: serde_json::Map<String, serde_json::Value>,
}

#[derive(Serialize, Deserialize)]
struct InputDoc {
    name: String,
    #[serde(default)]
    unit: String,
    waveform: Form,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    dc: Option<f64>,
}

#[derive(Serialize, Deserialize)]
struct PortDoc {
    device: String,
    lambda: String,
    y: String,
    law: LawDoc,
}

#[derive(Serialize, Deserialize, Default)]
struct LawDoc {
    kind: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    vfwd: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ron: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    roff: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    vertices: Option<Vec<[f64; 2]>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    first: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    last: Option<[f64; 2]>,
}

#[derive(Serialize, Deserialize, Default)]
#[serde(default)]
struct OutputsDoc {
    names: Vec<String>,
    units: Vec<String>,
    x: Vec<Vec<f64>>,
    lambda: Vec<Vec<f64>>,
    u: Vec<Vec<f64>>,
    du: Vec<Vec<f64>>,
    one: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
struct TranDoc {
    tstep: f64,
    tstop: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    tstart: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    tmax: Option<f64>,
    #[serde(default)]
    uic: bool,
}

fn rows(m: &DMatrix<f64>) -> Vec<Vec<f64>> {
    // −0.0 and 0.0 are one number to a reader.
    (0..m.nrows())
        .map(|i| (0..m.ncols()).map(|j| m[(i, j)] + 0.0).collect())
        .collect()
}

fn unit(text: &str) -> &'static str {
    match text {
        "A" => "A",
        _ => "V",
    }
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
        inputs: lcs
            .inputs
            .iter()
            .map(|input| InputDoc {
                name: input.name.clone(),
                unit: input.unit.to_owned(),
                waveform: Form::from(&input.source.wave),
                dc: Some(input.source.dc),
            })
            .collect(),
        ports: lcs
            .ports
            .iter()
            .map(|p| PortDoc {
                device: p.device.clone(),
                lambda: p.lambda.clone(),
                y: p.y.clone(),
                law: law_document(&p.law),
            })
            .collect(),
        a: rows(&lcs.a),
        b: rows(&lcs.b),
        c: rows(&lcs.c),
        d: rows(&lcs.d),
        e: rows(&lcs.e),
        g: rows(&lcs.g),
        e0: lcs.e0.iter().map(|v| v + 0.0).collect(),
        f: lcs.f.iter().map(|v| v + 0.0).collect(),
        x0: x0.iter().map(|v| v + 0.0).collect(),
        p: rows(&lcs.energy),
        outputs: OutputsDoc {
            names: out.names.clone(),
            units: out.units.iter().map(|u| (*u).to_owned()).collect(),
            x: rows(&out.rows.x),
            lambda: rows(&out.rows.lambda),
            u: rows(&out.rows.u),
            du: rows(&out.rows.du),
            one: out.rows.one.iter().map(|v| v + 0.0).collect(),
        },
        tran: tran.map(|t| TranDoc {
            tstep: t.tstep,
            tstop: t.tstop,
            tstart: (t.tstart != 0.0).then_some(t.tstart),
            tmax: t.tmax,
            uic: t.uic,
        }),
        switches: lcs
            .switches
            .iter()
            .map(|(name, on)| (name.clone(), if *on { "on" } else { "off" }.into()))
            .collect(),
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

fn matrix(
    name: &'static str,
    rows: &[Vec<f64>],
    (n, m): (usize, usize),
) -> Result<DMatrix<f64>, JsonError> {
    if rows.is_empty() && n * m == 0 || rows.is_empty() && name != "A" && m == 0 {
        return Ok(DMatrix::zeros(n, m));
    }
    if rows.len() != n || rows.iter().any(|r| r.len() != m) {
        return Err(JsonError::Shape {
            name,
            rows: n,
            cols: m,
        });
    }
    if rows.iter().flatten().any(|v| !v.is_finite()) {
        return Err(JsonError::NotFinite(name));
    }
    Ok(DMatrix::from_fn(n, m, |i, j| rows[i][j]))
}

fn vector(name: &'static str, values: &[f64], n: usize) -> Result<DVector<f64>, JsonError> {
    if values.is_empty() {
        return Ok(DVector::zeros(n));
    }
    if values.len() != n {
        return Err(JsonError::Shape {
            name,
            rows: n,
            cols: 1,
        });
    }
    if values.iter().any(|v| !v.is_finite()) {
        return Err(JsonError::NotFinite(name));
    }
    Ok(DVector::from_column_slice(values))
}

/// A matrix that may be left out (all zeros).
fn optional(
    name: &'static str,
    rows: &[Vec<f64>],
    (n, m): (usize, usize),
) -> Result<DMatrix<f64>, JsonError> {
    if rows.is_empty() {
        Ok(DMatrix::zeros(n, m))
    } else {
        matrix(name, rows, (n, m))
    }
}

fn law(doc: &LawDoc, device: &str) -> Result<Law, JsonError> {
    let value = Value::binary;
    if doc.kind == "ideal_diode" || doc.kind == "diode" {
        return Ok(Law::Diode {
            vfwd: value(doc.vfwd.unwrap_or(0.0)),
            ron: value(doc.ron.unwrap_or(0.0)),
            roff: doc.roff.map(value),
        });
    }
    let kind = ["zener", "table", "relay", "saturation", "dead_zone"]
        .into_iter()
        .find(|k| *k == doc.kind);
    match (kind, &doc.vertices, doc.first, doc.last) {
        (Some(kind), Some(vertices), Some(first), Some(last)) => {
            let curve = Curve {
                kind,
                vertices: vertices
                    .iter()
                    .map(|v| (value(v[0]), value(v[1])))
                    .collect(),
                first: (value(first[0]), value(first[1])),
                last: (value(last[0]), value(last[1])),
            };
            let wrong = |reason| JsonError::Curve {
                device: device.to_owned(),
                reason,
            };
            curve.check().map_err(wrong)?;
            Ok(Law::Curve(curve))
        }
        _ => Err(JsonError::Law {
            device: device.to_owned(),
            kind: doc.kind.clone(),
        }),
    }
}

fn role(doc: &PortDoc) -> Result<Role, JsonError> {
    let (current, voltage) = (format!("i({})", doc.device), format!("-v({})", doc.device));
    if doc.lambda == current && doc.y == voltage {
        Ok(Role::Current)
    } else if doc.lambda == voltage && doc.y == current {
        Ok(Role::Voltage)
    } else if doc.lambda.ends_with(".out") {
        Ok(Role::Function)
    } else {
        Err(JsonError::Role(doc.device.clone()))
    }
}

/// Reads a system.
///
/// # Errors
///
/// See [`JsonError`].
pub fn read(text: &str) -> Result<SystemFile, JsonError> {
    let doc: Document = serde_json::from_str(text)?;
    if doc.schema != SCHEMA {
        return Err(JsonError::Schema(doc.schema));
    }
    let (n, m, p) = (doc.states.len(), doc.ports.len(), doc.inputs.len());
    let tran = match &doc.tran {
        Some(t) if t.tstep > 0.0 && t.tstop > 0.0 && t.tstep.is_finite() && t.tstop.is_finite() => {
            Some(Tran {
                tstep: t.tstep,
                tstop: t.tstop,
                tstart: t.tstart.unwrap_or(0.0),
                tmax: t.tmax,
                uic: t.uic,
            })
        }
        Some(_) => return Err(JsonError::Tran),
        None => None,
    };
    let (tstep, tstop) = tran.map_or((1e-3, 1.0), |t| (t.tstep, t.tstop));
    let inputs = doc
        .inputs
        .iter()
        .map(|input| {
            let wave = input
                .waveform
                .wave(tstep, tstop)
                .map_err(|source| JsonError::Wave {
                    name: input.name.clone(),
                    source,
                })?;
            let source = Source {
                dc: input.dc.unwrap_or_else(|| wave.value(0.0)),
                wave,
            };
            Ok(Input {
                name: input.name.clone(),
                unit: unit(&input.unit),
                source,
            })
        })
        .collect::<Result<Vec<_>, JsonError>>()?;
    let ports = doc
        .ports
        .iter()
        .map(|port| {
            Ok(Port {
                device: port.device.clone(),
                role: role(port)?,
                lambda: port.lambda.clone(),
                y: port.y.clone(),
                law: law(&port.law, &port.device)?,
            })
        })
        .collect::<Result<Vec<_>, JsonError>>()?;
    let mut shift = DMatrix::zeros(n, p);
    for (k, state) in doc.states.iter().enumerate() {
        for (j, input) in doc.inputs.iter().enumerate() {
            shift[(k, j)] = state
                .shift
                .get(&input.name)
                .and_then(serde_json::Value::as_f64)
                .unwrap_or(0.0);
        }
    }
    let energy = if doc.p.is_empty() {
        DMatrix::identity(n, n)
    } else {
        matrix("P", &doc.p, (n, n))?
    };
    let states: Vec<State> = doc
        .states
        .iter()
        .map(|s| State {
            name: s.name.clone(),
            unit: unit(&s.unit),
        })
        .collect();
    let outputs = if doc.outputs.names.is_empty() {
        Outputs {
            names: states.iter().map(|s| s.name.clone()).collect(),
            units: states.iter().map(|s| s.unit).collect(),
            rows: Rows {
                x: DMatrix::identity(n, n),
                lambda: DMatrix::zeros(n, m),
                u: shift.clone(),
                du: DMatrix::zeros(n, p),
                one: DVector::zeros(n),
            },
            ..Outputs::default()
        }
    } else {
        let count = doc.outputs.names.len();
        Outputs {
            names: doc.outputs.names.clone(),
            units: (0..count)
                .map(|k| unit(doc.outputs.units.get(k).map_or("V", String::as_str)))
                .collect(),
            rows: Rows {
                x: optional("outputs.x", &doc.outputs.x, (count, n))?,
                lambda: optional("outputs.lambda", &doc.outputs.lambda, (count, m))?,
                u: optional("outputs.u", &doc.outputs.u, (count, p))?,
                du: optional("outputs.du", &doc.outputs.du, (count, p))?,
                one: vector("outputs.one", &doc.outputs.one, count)?,
            },
            ..Outputs::default()
        }
    };
    let x0 = vector("x0", &doc.x0, n)?;
    let lcs = Lcs {
        title: doc.title.clone(),
        a: matrix("A", &doc.a, (n, n))?,
        b: optional("B", &doc.b, (n, m))?,
        c: optional("C", &doc.c, (m, n))?,
        d: optional("D", &doc.d, (m, m))?,
        e: optional("E", &doc.e, (n, p))?,
        g: optional("G", &doc.g, (m, p))?,
        e0: vector("e", &doc.e0, n)?,
        f: vector("F", &doc.f, m)?,
        storage: Storage {
            names: states.iter().map(|s| s.name.clone()).collect(),
            x: DMatrix::identity(n, n),
            lambda: DMatrix::zeros(n, m),
            u: DMatrix::zeros(n, p),
            one: DVector::zeros(n),
            metric: energy.clone(),
            inject: DMatrix::identity(n, n),
            inject_one: DVector::zeros(n),
            initial: x0.clone(),
        },
        states,
        inputs,
        ports,
        shift,
        energy,
        outputs,
        ..Lcs::default()
    };
    Ok(SystemFile { lcs, x0, tran })
}
