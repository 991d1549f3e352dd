//! What is known about a circuit before it runs: faults, certificates, and which theorem says what.

mod convergence;
mod equilibria;
mod excitation;
mod facts;
mod feedthrough;
mod jumps;
mod laws;
mod limit;
pub mod program;
mod stiffness;
mod text;
mod theorems;

pub use convergence::Convergence;
pub use equilibria::Equilibrium;
pub use excitation::Excitation;
pub use feedthrough::Feedthrough;
pub use jumps::Jumps;
pub use stiffness::{Conditioning, Stiffness};

pub use theorems::Theorem;

use nalgebra::DMatrix;

use crate::circuit::Circuit;
use crate::diagnostic::{Diagnostic, Severity, SourceMap};
use crate::lcs::{Lcs, SparseLcs};
use crate::mna::topology;
use crate::passivity::{Residuals, System, Verdict};
use facts::Facts;

/// The answer of `circ check`, in the order of its JSON.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Report {
    /// The title of the circuit.
    pub title: String,
    /// No fault is an error.
    pub ok: bool,
    /// What is wrong or worth knowing, with its place.
    pub faults: Vec<Fault>,
    /// Parts without a path to ground: their nodes, the reference first.
    pub islands: Vec<Vec<String>>,
    /// The elements of the normal tree and the others.
    pub normal_tree: NormalTree,
    /// Numbers of states, ports and inputs.
    pub size: Size,
    /// What kind of matrix D is; `null` where there is no system.
    pub feedthrough: Option<Feedthrough>,
    /// `true`, `false` with a verified witness, or `null`: not decided.
    pub passive: Option<bool>,
    /// Why it is not passive, or why that is not decided.
    pub passive_because: Option<String>,
    /// `true` if (46) holds with ε > 0; `null` where not decided.
    pub strictly_passive: Option<bool>,
    /// α = ε/2 of (46), 1/s: the largest one certified.
    pub decay_rate: f64,
    /// √(‖P‖/λ_min(P)).
    pub bound: Option<f64>,
    /// The storage matrix.
    #[serde(rename = "P")]
    pub p: Option<Vec<Vec<f64>>>,
    /// `stored energy` or `lmi`.
    #[serde(rename = "P_from")]
    pub p_from: Option<&'static str>,
    /// How well P fulfils (45).
    pub residuals: Option<Residuals>,
    /// Statement by statement.
    pub theorems: Vec<Theorem>,
    /// States of rest of an autonomous circuit, an empty list if it has none; `null` where that is not known.
    pub equilibria: Option<Vec<Equilibrium>>,
    /// Where all motions end, as far as that is certified; `null` where nothing is.
    pub convergence: Option<Convergence>,
    /// Where states can jump.
    pub jumps: Jumps,
    /// Time constants over the modes.
    pub stiffness: Option<Stiffness>,
    /// Condition numbers over the modes, and the digits that they cost.
    pub conditioning: Option<Conditioning>,
    /// Names of the states, the rows of P.
    pub states: Vec<String>,
    /// Names of the ports' λ.
    pub lambdas: Vec<String>,
    /// The switch positions that everything above is said for, `{"s1":"off"}`.
    #[serde(serialize_with = "positions")]
    pub switches: Vec<(String, bool)>,
}

/// A finding with its place in the file.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Fault {
    /// A stable kebab-case name.
    pub code: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// The headline.
    pub message: String,
    /// The file, where there is one.
    pub file: Option<String>,
    /// 1-based.
    pub line: Option<usize>,
    /// 1-based, in characters.
    pub column: Option<usize>,
    /// What would be right.
    pub help: Option<String>,
}

impl Fault {
    /// A diagnostic with its place resolved.
    #[must_use]
    pub fn of(diagnostic: &Diagnostic, sources: &SourceMap) -> Self {
        let place = diagnostic.span.map(|span| sources.line_column(span));
        Self {
            code: diagnostic.code,
            severity: diagnostic.severity,
            message: sources.message(diagnostic),
            file: diagnostic
                .span
                .and_then(|s| sources.files.get(s.file.0 as usize))
                .map(|f| f.path.clone()),
            line: place.map(|p| p.0),
            column: place.map(|p| p.1),
            help: diagnostic.remedy(),
        }
    }
}

/// The normal tree by element names.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize)]
pub struct NormalTree {
    /// Elements of the tree.
    pub tree: Vec<String>,
    /// Elements that close loops.
    pub links: Vec<String>,
}

/// Numbers of states, ports and inputs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct Size {
    /// States.
    pub n: usize,
    /// Ports.
    pub m: usize,
    /// Inputs.
    pub p: usize,
}

/// The report of a circuit with the system it was reduced to.
#[must_use]
pub fn circuit(circuit: &Circuit, lcs: &Lcs) -> Report {
    in_circuit(circuit, system(lcs))
}

/// The report of a circuit of so many states and ports that certificates, which are dense, are left out: topology, sizes, and that a
/// system exists.
#[must_use]
pub fn large(circuit: &Circuit, lcs: &SparseLcs) -> Report {
    let size = Size {
        n: lcs.states.len(),
        m: lcs.ports.len(),
        p: lcs.inputs.len(),
    };
    let report = Report {
        ok: true,
        size,
        passive_because: Some(format!(
            "{} states and {} ports are too many for a dense certificate",
            size.n, size.m
        )),
        states: lcs.states.iter().map(|s| s.name.clone()).collect(),
        lambdas: lcs.ports.iter().map(|port| port.lambda.clone()).collect(),
        switches: lcs.switches.clone(),
        ..faulty(&lcs.title, Vec::new())
    };
    in_circuit(circuit, report)
}

/// With what the circuit's graph tells.
fn in_circuit(circuit: &Circuit, report: Report) -> Report {
    let (tree, links) = topology::normal_tree(circuit);
    let name = |&node: &usize| circuit.nodes[node].clone();
    Report {
        islands: topology::islands(circuit)
            .iter()
            .map(|part| part.iter().map(name).collect())
            .collect(),
        normal_tree: NormalTree { tree, links },
        ..report
    }
}

/// Everything that can be said about a complementarity system without its circuit.
#[must_use]
pub fn system(lcs: &Lcs) -> Report {
    let facts = Facts::collect(lcs);
    let certificate = facts.certificate();
    let passive_because = match &facts.verdict {
        Verdict::Passive(_) => None,
        Verdict::NotPassive(witness) => Some(witness.describe()),
        Verdict::NotDecided { reason } => Some(reason.clone()),
    };
    let mut equilibria = equilibria::all(&facts);
    let known = equilibria.as_deref().unwrap_or(&[]);
    let convergence = convergence::find(&facts, known);
    let theorems = theorems::all(&facts, known);
    for equilibrium in equilibria.iter_mut().flatten() {
        if convergence.as_ref().is_some_and(|c| c.to.is_some()) {
            equilibrium.unique = Some(true);
        }
        for (lambda, offset) in equilibrium.lambda.iter_mut().zip(&facts.offsets) {
            *lambda -= offset;
        }
    }
    let rate = facts.strict.as_ref().map_or(0.0, |s| s.decay_rate);
    let (stiffness, conditioning) = stiffness::over_modes(&facts.system);
    Report {
        title: lcs.title.clone(),
        ok: true,
        faults: Vec::new(),
        islands: Vec::new(),
        normal_tree: NormalTree::default(),
        size: Size {
            n: lcs.n(),
            m: lcs.m(),
            p: lcs.p(),
        },
        feedthrough: Some(facts.feedthrough.clone()),
        passive: facts.verdict.answer(),
        passive_because,
        strictly_passive: facts.verdict.answer().map(|yes| yes && rate > 0.0),
        decay_rate: rate,
        bound: facts.strict.as_ref().map(|s| s.bound),
        p: certificate.map(|c| rows(&c.p)),
        p_from: certificate.map(|c| c.from.name()),
        residuals: certificate.map(|c| c.residuals),
        theorems,
        equilibria,
        convergence,
        jumps: jumps::find(&facts),
        stiffness: Some(stiffness),
        conditioning: Some(conditioning),
        states: facts.state_names.clone(),
        lambdas: lcs.ports.iter().map(|port| port.lambda.clone()).collect(),
        switches: lcs.switches.clone(),
    }
}

/// Condition numbers over the modes of a system, see [`Report::conditioning`].
#[must_use]
pub fn conditioning(lcs: &Lcs) -> Conditioning {
    stiffness::over_modes(&System::of(lcs)).1
}

/// The report of a circuit that could not be built: its faults alone.
#[must_use]
pub fn faulty(title: &str, faults: Vec<Fault>) -> Report {
    Report {
        title: title.to_string(),
        ok: !faults.iter().any(|f| f.severity == Severity::Error),
        faults,
        islands: Vec::new(),
        normal_tree: NormalTree::default(),
        size: Size::default(),
        feedthrough: None,
        passive: None,
        passive_because: Some("there is no system to judge".into()),
        strictly_passive: None,
        decay_rate: 0.0,
        bound: None,
        p: None,
        p_from: None,
        residuals: None,
        theorems: Vec::new(),
        equilibria: None,
        convergence: None,
        jumps: Jumps::default(),
        stiffness: None,
        conditioning: None,
        states: Vec::new(),
        lambdas: Vec::new(),
        switches: Vec::new(),
    }
}

fn positions<S: serde::Serializer>(switches: &[(String, bool)], out: S) -> Result<S::Ok, S::Error> {
    out.collect_map(
        switches
            .iter()
            .map(|(name, on)| (name, if *on { "on" } else { "off" })),
    )
}

fn rows(m: &DMatrix<f64>) -> Vec<Vec<f64>> {
    m.row_iter()
        .map(|row| row.iter().copied().collect())
        .collect()
}

#[cfg(test)]
mod tests;
