//! The system as JSON, schema `circ-lcs/1`, written and read.

mod read;
mod write;

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

pub use read::read;
pub use write::{write, write_sparse};

use super::{Csr, Lcs, LcsError};
use crate::circuit::Tran;
use crate::circuit::source::{Form, WaveError};
use crate::law::CurveError;

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
    /// Parts that make no system.
    #[error(transparent)]
    Unfit(#[from] LcsError),
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

/// A matrix, row by row or in compressed rows.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum MatrixDoc {
    Rows(Vec<Vec<f64>>),
    Compressed(Csr),
}

impl Default for MatrixDoc {
    fn default() -> Self {
        Self::Rows(Vec::new())
    }
}

impl MatrixDoc {
    fn is_empty(&self) -> bool {
        matches!(self, Self::Rows(rows) if rows.is_empty())
    }
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
    a: MatrixDoc,
    #[serde(rename = "B", default)]
    b: MatrixDoc,
    #[serde(rename = "C", default)]
    c: MatrixDoc,
    #[serde(rename = "D", default)]
    d: MatrixDoc,
    #[serde(rename = "E", default)]
    e: MatrixDoc,
    #[serde(rename = "G", default)]
    g: MatrixDoc,
    #[serde(rename = "e", default)]
    e0: Vec<f64>,
    #[serde(rename = "F", default)]
    f: Vec<f64>,
    #[serde(default)]
    x0: Vec<f64>,
    /// Stored energy ½ xᵀ P x.
    #[serde(rename = "P", default, skip_serializing_if = "MatrixDoc::is_empty")]
    p: MatrixDoc,
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
    /// Of an exponential diode: Is, A; N k T/q, V; RS, Ω; BV, V; Ibv, A; NBV k T/q, V.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    is: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    slope: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rs: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    leak: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    bv: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ibv: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    breakdown_slope: Option<f64>,
    /// Of straight lines with rounded corners: conductance between them, S; (V, S, width in V) of each.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    conductance: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    forward: Option<[f64; 3]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reverse: Option<[f64; 3]>,
}

#[derive(Serialize, Deserialize, Default)]
#[serde(default)]
struct OutputsDoc {
    names: Vec<String>,
    units: Vec<String>,
    x: MatrixDoc,
    lambda: MatrixDoc,
    u: MatrixDoc,
    du: MatrixDoc,
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
