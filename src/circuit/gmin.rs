//! Junctions that alone connect a part of the circuit with the rest.
//!
//! Where all of them block, the voltage of such a part, a bridge behind a floating winding or the middle of two diodes in series, is decided by what their reverse
//! currents −IS (1 − e^(v/a)) differ by: e^(v/a) is below the rounding of 1, and in doubles nothing decides it. ngspice and LTspice have a conductance `gmin`
//! beside every junction. Here these junctions have it in their law ([`Exponential::leak`]), and no others.

use petgraph::unionfind::UnionFind;

use super::builder::Builder;
use super::scope::ScopeId;
use super::{Kind, Output};
use crate::diagnostic::{Diagnostic, listed};
use crate::law::{Exponential, Law};
use crate::settings::tolerances::exponentials::GMIN;

/// Whether an element holds two nodes together whatever it does: not a junction, an open switch or a source of current.
fn connects(kind: &Kind) -> bool {
    match kind {
        Kind::Device(law) => !matches!(law, Law::Exponential(_)),
        Kind::Switch(switch) => switch.roff.is_some(),
        Kind::CurrentSource(_) => false,
        Kind::Controlled { output, .. } | Kind::Function { output, .. } => {
            *output == Output::Voltage
        }
        _ => true,
    }
}

impl Builder<'_, '_> {
    /// Sets the conductances, of `.options gmin=`, S, or of [`GMIN`]; 0 adds none.
    pub(super) fn set_gmin(&mut self) {
        let gmin = match self.gmin {
            None => GMIN,
            Some(expr) => match self.scopes.finite(expr, ScopeId::ROOT) {
                Some(gmin) if gmin.f64 >= 0.0 => gmin.f64,
                Some(gmin) => {
                    let message = format!("gmin is {:e} S", gmin.f64);
                    self.tell(
                        Diagnostic::error("bad-value", expr.span, message)
                            .label("negative")
                            .help("a conductance beside junctions is positive, or 0 for none"),
                    );
                    return;
                }
                None => return,
            },
        };
        if gmin == 0.0 {
            return;
        }
        let mut parts = UnionFind::<usize>::new(self.circuit.nodes.len());
        for element in &self.circuit.elements {
            if connects(&element.kind) {
                parts.union(element.p.index(), element.n.index());
            }
        }
        let (mut names, mut first) = (Vec::new(), None);
        for element in &mut self.circuit.elements {
            let apart = !parts.equiv(element.p.index(), element.n.index());
            if let Kind::Device(Law::Exponential(Exponential { leak, .. })) = &mut element.kind
                && apart
            {
                *leak = gmin;
                first = first.or(element.span);
                names.push(element.name.as_str());
            }
        }
        if names.is_empty() {
            return;
        }
        let message = format!(
            "a part of the circuit hangs on junctions alone, and where they block on their leakage: {gmin:e} S beside {} decide its voltage",
            listed(&names)
        );
        self.tell(
            Diagnostic::note("gmin", first, message)
                .label("one of them")
                .help("`.options gmin=` sets the conductance, 0 leaves it out; a resistor from that part to the rest makes it needless"),
        );
    }
}
