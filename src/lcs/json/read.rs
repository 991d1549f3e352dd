//! From the text of a system to the system.

use nalgebra::{DMatrix, DVector};

use super::{Document, JsonError, LawDoc, MatrixDoc, PortDoc, SCHEMA, SystemFile};
use crate::algebra::Value;
use crate::circuit::Tran;
use crate::circuit::source::Source;
use crate::law::{Breakdown, Corner, Curve, Exponential, Law, Rounded};
use crate::lcs::{Input, Lcs, LcsParts, Outputs, Port, Role, Rows, State, Storage};

fn unit(text: &str) -> &'static str {
    match text {
        "A" => "A",
        _ => "V",
    }
}

fn matrix(
    name: &'static str,
    matrix: &MatrixDoc,
    (n, m): (usize, usize),
) -> Result<DMatrix<f64>, JsonError> {
    let rows = match matrix {
        MatrixDoc::Rows(rows) => rows,
        MatrixDoc::Compressed(csr) if csr.shape == [n, m] && csr.is_sound() => {
            let mut whole = DMatrix::zeros(n, m);
            csr.entries().for_each(|(i, j, v)| whole[(i, j)] = v);
            return if csr.data.iter().all(|v| v.is_finite()) {
                Ok(whole)
            } else {
                Err(JsonError::NotFinite(name))
            };
        }
        MatrixDoc::Compressed(_) => {
            return Err(JsonError::Shape {
                name,
                rows: n,
                cols: m,
            });
        }
    };
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
    rows: &MatrixDoc,
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
    if doc.kind == "exponential" || doc.kind == "rounded" {
        let law = if doc.kind == "rounded" {
            rounded(doc)
        } else {
            exponential(doc)
        };
        return law.ok_or_else(|| JsonError::Law {
            device: device.to_owned(),
            kind: doc.kind.clone(),
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

/// `None` where a parameter is missing or out of range.
fn rounded(doc: &LawDoc) -> Option<Law> {
    let corner = |[v, g, width]: [f64; 3]| Corner { v, g, width };
    let diode = Rounded {
        g: doc.conductance?,
        forward: corner(doc.forward?),
        reverse: doc.reverse.map(corner),
    };
    diode.is_sound().then_some(Law::Rounded(diode))
}

/// `None` where a parameter is missing or out of range.
fn exponential(doc: &LawDoc) -> Option<Law> {
    let breakdown = match (doc.bv, doc.ibv, doc.breakdown_slope) {
        (None, None, None) => None,
        (bv, ibv, slope) => Some(Breakdown {
            bv: bv?,
            ibv: ibv?,
            slope: slope?,
        }),
    };
    let diode = Exponential {
        is: doc.is?,
        slope: doc.slope?,
        rs: doc.rs.unwrap_or(0.0),
        leak: doc.leak.unwrap_or(0.0),
        breakdown,
    };
    diode.is_sound().then_some(Law::Exponential(diode))
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
                prints: true,
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
            Ok(Input {
                name: input.name.clone(),
                unit: unit(&input.unit),
                source: Source::new(input.dc, wave),
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
    let lcs = Lcs::new(LcsParts {
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
            elements: states.iter().map(|s| s.name.clone()).collect(),
            units: states.iter().map(|s| s.unit).collect(),
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
        fast: Vec::new(),
        inputs,
        ports,
        shift,
        energy,
        outputs,
        controls: Rows {
            x: DMatrix::zeros(doc.switches.len(), n),
            lambda: DMatrix::zeros(doc.switches.len(), m),
            u: DMatrix::zeros(doc.switches.len(), p),
            du: DMatrix::zeros(doc.switches.len(), p),
            one: DVector::zeros(doc.switches.len()),
        },
        switches: (doc.switches.iter())
            .map(|(name, position)| (name.clone(), position == "on"))
            .collect(),
        ..LcsParts::default()
    })?;
    Ok(SystemFile { lcs, x0, tran })
}
