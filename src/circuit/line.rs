//! T: ideal transmission lines.

use super::builder::Builder;
use super::model::ONE;
use super::passive::Args;
use super::scope::ScopeId;
use super::source::{Source, Wave};
use super::{Affine, Circuit, Element, ElementId, Kind, Line, LinePort, NodeId, Quantity};
use crate::algebra::Value;
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{self, Assign, Expr};

/// Wavelengths at the frequency `F` where the card names no `NL`.
const QUARTER: f64 = 0.25;

impl Line {
    /// The wave a = v + Z i that leaves a port.
    #[must_use]
    pub fn leaving(&self, port: usize, circuit: &Circuit) -> Affine {
        let LinePort { impedance, wave } = self.ports[port];
        let (p, n) = (
            circuit.elements[impedance.index()].p,
            circuit.elements[wave.index()].n,
        );
        Affine {
            terms: vec![
                (ONE, Quantity::Voltage(p)),
                (Value::binary(-1.0), Quantity::Voltage(n)),
                (self.impedance, Quantity::Current(impedance)),
            ],
            constant: 0.0,
        }
    }
}

impl<'n> Builder<'n, '_> {
    pub(super) fn line(
        &mut self,
        card: &'n ast::Element,
        args: &'n [Assign],
        ic: &'n [Expr],
        scope: ScopeId,
    ) {
        self.check_args(card, args, &["z0", "zo", "td", "f", "nl", "rel", "abs"]);
        let nodes: Vec<NodeId> = card.nodes.iter().map(|n| self.node(n, scope)).collect();
        let Some((impedance, delay)) = self.line_values(card, Args(args), scope) else {
            return;
        };
        let mut initial = [0.0; 4];
        for (value, written) in initial.iter_mut().zip(ic) {
            match self.scopes.finite(written, scope) {
                Some(found) => *value = found.f64,
                None => return,
            }
        }
        let [v1, i1, v2, i2] = initial;
        let full = self.full_name(&card.name, scope);
        let z = impedance.f64;
        let first = self.line_port(
            card,
            &full,
            "1",
            [nodes[0], nodes[1]],
            impedance,
            (delay, v2 + z * i2),
        );
        let second = self.line_port(
            card,
            &full,
            "2",
            [nodes[2], nodes[3]],
            impedance,
            (delay, v1 + z * i1),
        );
        if let (Some(first), Some(second)) = (first, second) {
            self.circuit.lines.push(Line {
                name: full,
                impedance,
                delay,
                ports: [first, second],
            });
        }
    }

    /// `t1.z1` and `t1.e1` in series; `wave` is the delay and what arrives before anything has.
    fn line_port(
        &mut self,
        card: &ast::Element,
        name: &str,
        end: &str,
        [p, n]: [NodeId; 2],
        impedance: Value,
        wave: (f64, f64),
    ) -> Option<LinePort> {
        let inner = self.new_node(format!("{name}.{end}"));
        let (delay, initial) = wave;
        let source = Source {
            dc: initial,
            wave: Wave::Arriving { delay, initial },
        };
        let mut part = |letter: &str, p: NodeId, n: NodeId, kind: Kind| -> Option<ElementId> {
            self.add(Element {
                name: format!("{name}.{letter}{end}"),
                p,
                n,
                kind,
                ic: None,
                span: Some(card.span),
            })
        };
        Some(LinePort {
            impedance: part("z", p, inner, Kind::Resistor(impedance))?,
            wave: part("e", inner, n, Kind::VoltageSource(source))?,
        })
    }

    /// Z and the delay.
    fn line_values(
        &mut self,
        card: &'n ast::Element,
        args: Args<'n>,
        scope: ScopeId,
    ) -> Option<(Value, f64)> {
        let z = self.arg(args, &["z0", "zo"], scope)?;
        let td = self.arg(args, &["td"], scope)?.map(|v| v.f64);
        let f = self.arg(args, &["f"], scope)?.map(|v| v.f64);
        let nl = self.arg(args, &["nl"], scope)?.map_or(QUARTER, |v| v.f64);
        let delay = td.or(f.map(|f| nl / f));
        let fault = match (z, delay) {
            (None, _) => "names no impedance `Z0`",
            (_, None) => "names neither a delay `TD` nor a frequency `F`",
            (Some(z), Some(delay)) if z.f64 > 0.0 && delay > 0.0 && delay.is_finite() => {
                return Some((z, delay));
            }
            _ => "has an impedance or a delay that is not positive",
        };
        let message = format!("`{}` {fault}", card.name.text);
        self.tell(
            Diagnostic::error("bad-value", card.span, message)
                .label("a line needs both")
                .help("write `T1 a b c d Z0=50 TD=10n`, or `F=… NL=…` in place of `TD`"),
        );
        None
    }
}
