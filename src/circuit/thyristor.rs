//! Thyristors and triacs: `X1 anode gate cathode model` with a `.model` of type `scr`, `thyristor` or `triac`.
//!
//! A thyristor is an ideal diode in series with a switch that latches: on while its gate is above VGT, afterwards as long as the
//! diode conducts more than IH. It therefore takes up its current when it is gated and forward biased, and blocks from the zero
//! of that current on. A triac is two of them back to back, which both a positive and a negative gate turns on. The gate is a
//! resistance VGT/IGT to the cathode (of a triac: to MT1), so that it is above VGT when it draws IGT.

use super::builder::Builder;
use super::model::{ONE, Parameters, ZERO};
use super::scope::ScopeId;
use super::{Affine, Element, ElementId, Kind, Latch, NodeId, Quantity, Switch};
use crate::algebra::Value;
use crate::diagnostic::{Diagnostic, Span};
use crate::law::Law;
use crate::netlist::ast::{self, Assign, Name};

/// Gate voltage that triggers where the model names none, V.
const VGT: Value = Value::decimal(0.7, 7, -1);
/// Gate resistance where the model names no gate current, Ω: the off-resistance of SPICE's switches.
const OPEN: Value = Value::decimal(1e12, 1, 12);
/// −1, exactly.
const MINUS_ONE: Value = Value::decimal(-1.0, -1, 0);
/// Drop of the junctions where the model names an on-state voltage VTM at a current ITM, V.
const JUNCTIONS: f64 = 0.7;

/// Parameters of vendors' macros that a latching switch has no use for.
const UNUSED: [&str; 9] = [
    "vdrm", "vrrm", "idrm", "irrm", "dvdt", "didt", "ton", "toff", "tq",
];

/// What a model says.
struct Figures {
    triac: bool,
    vgt: Value,
    gate: Value,
    holding: f64,
    vfwd: Value,
    ron: Value,
    roff: Option<Value>,
}

impl<'n> Builder<'n, '_> {
    pub(super) fn thyristor(
        &mut self,
        card: &'n ast::Element,
        name: &'n Name,
        args: &'n [Assign],
        scope: ScopeId,
    ) {
        self.check_args(card, args, &[]);
        let Some(figures) = self.thyristor_model(card, name, scope) else {
            return;
        };
        let [anode, gate, cathode] = card.nodes.as_slice() else {
            let message = format!(
                "`{}` connects {} nodes, a thyristor has 3",
                card.name.text,
                card.nodes.len()
            );
            self.tell(
                Diagnostic::error("wrong-arity", card.span, message)
                    .label("wrong number of nodes")
                    .help(if figures.triac {
                        "the nodes of a triac are: mt2 gate mt1"
                    } else {
                        "the nodes of a thyristor are: anode gate cathode"
                    }),
            );
            return;
        };
        let [anode, gate, cathode] = [anode, gate, cathode].map(|n| self.node(n, scope));
        let full = self.full_name(&card.name, scope);
        self.name_pins(&full, "agk", &[anode, gate, cathode]);
        let inner = self.new_node(format!("{full}.a"));
        let parts = Parts {
            name: full,
            span: card.span,
            figures,
        };
        // The current of the thyristor is that of its anode, whatever flows inside.
        self.part(&parts, "", anode, inner, Kind::Resistor(ZERO));
        if let Some(roff) = parts.figures.roff {
            self.part(&parts, ".off", inner, cathode, Kind::Resistor(roff));
        }
        if parts.figures.triac {
            let gates = [(".gate", gate, cathode), (".gate-", cathode, gate)];
            let gates: Vec<ElementId> = gates
                .into_iter()
                .filter_map(|(suffix, p, n)| self.gate(&parts, suffix, p, n))
                .collect();
            self.valve(&parts, ".p", inner, cathode, &gates);
            self.valve(&parts, ".n", cathode, inner, &gates);
        } else if let Some(gate) = self.gate(&parts, ".gate", gate, cathode) {
            self.valve(&parts, "", inner, cathode, &[gate]);
        }
    }

    fn part(
        &mut self,
        parts: &Parts,
        suffix: &str,
        p: NodeId,
        n: NodeId,
        kind: Kind,
    ) -> Option<ElementId> {
        self.add(Element {
            name: format!("{}{suffix}", parts.name),
            p,
            n,
            kind,
            ic: None,
            span: Some(parts.span),
        })
    }

    /// A resistance that knows whether its voltage is above VGT.
    fn gate(&mut self, parts: &Parts, suffix: &str, p: NodeId, n: NodeId) -> Option<ElementId> {
        let Figures { vgt, gate, .. } = parts.figures;
        let control = Affine {
            terms: vec![
                (ONE, Quantity::Voltage(p)),
                (MINUS_ONE, Quantity::Voltage(n)),
            ],
            constant: 0.0,
        };
        let switch = Switch {
            control,
            ron: gate,
            roff: Some(gate),
            on_above: vgt.f64,
            off_below: vgt.f64,
            initial: None,
            latch: None,
        };
        self.part(parts, suffix, p, n, Kind::Switch(switch))
    }

    /// The latching switch and the diode in series; while the switch is off a resistance holds the diode at 0 V.
    fn valve(
        &mut self,
        parts: &Parts,
        suffix: &str,
        p: NodeId,
        n: NodeId,
        gates: &[ElementId],
    ) -> Option<ElementId> {
        let Figures {
            holding, vfwd, ron, ..
        } = parts.figures;
        let middle = self.new_node(format!("{}{suffix}.m", parts.name));
        let diode = Kind::Device(Law::Diode {
            vfwd,
            ron,
            roff: None,
        });
        let valve = self.part(parts, &format!("{suffix}.diode"), middle, n, diode)?;
        let own = ElementId(valve.0 + 1);
        let switch = Switch {
            control: Affine {
                terms: vec![(ONE, Quantity::Current(own))],
                constant: 0.0,
            },
            ron: ZERO,
            roff: None,
            on_above: f64::INFINITY,
            off_below: holding,
            initial: None,
            latch: Some(Latch::Hold {
                gates: gates.to_vec(),
                valve,
            }),
        };
        let name = format!("{suffix}.latch");
        let latch = self.part(parts, &name, p, middle, Kind::Switch(switch))?;
        let switch = Switch {
            control: Affine::default(),
            ron: ONE,
            roff: None,
            on_above: f64::INFINITY,
            off_below: f64::NEG_INFINITY,
            initial: None,
            latch: Some(Latch::Rest(latch)),
        };
        let name = format!("{suffix}.rest");
        self.part(parts, &name, middle, n, Kind::Switch(switch))
    }

    fn thyristor_model(
        &mut self,
        card: &'n ast::Element,
        name: &'n Name,
        scope: ScopeId,
    ) -> Option<Figures> {
        let chain = self.model(card, name, scope)?;
        let kinds = chain.iter().map(|m| m.kind.text.as_str());
        let triac = match kinds.into_iter().find(|k| !k.is_empty()) {
            Some("scr" | "thyristor") => false,
            Some("triac") => true,
            _ => {
                self.wrong_model(card, chain[0], name, "scr, thyristor or triac");
                return None;
            }
        };
        let params = Parameters::new(&chain);
        for unused in UNUSED {
            if params.get(unused).is_some() {
                self.unused(format!("{unused} of {}", name.text), name);
            }
        }
        let vgt = self.parameter(&params, "vgt", scope)?.unwrap_or(VGT);
        let igt = self.parameter(&params, "igt", scope)?;
        let holding = self.parameter(&params, "ih", scope)?.unwrap_or(ZERO);
        let on_state = self
            .parameter(&params, "vtm", scope)?
            .zip(self.parameter(&params, "itm", scope)?);
        let (mut vfwd, mut ron) = (ZERO, ZERO);
        if let Some((vtm, itm)) = on_state {
            vfwd = Value::binary(JUNCTIONS.min(vtm.f64));
            ron = Value::binary((vtm.f64 - vfwd.f64) / itm.f64);
        }
        let vfwd = self.parameter(&params, "vfwd", scope)?.unwrap_or(vfwd);
        let ron = self.parameter(&params, "ron", scope)?.unwrap_or(ron);
        let roff = self.off_resistance(&params, scope)?;
        let positive = |v: Value| v.f64 > 0.0;
        let least_zero = |v: Value| v.f64 >= 0.0 && v.f64.is_finite();
        let sound = [
            ("Vgt", positive(vgt)),
            ("Igt", igt.is_none_or(positive)),
            ("Ih", least_zero(holding)),
            ("Vfwd", least_zero(vfwd)),
            ("Ron", least_zero(ron)),
            ("Roff", roff.is_none_or(positive)),
        ];
        if let Some((what, _)) = sound.iter().find(|(_, good)| !good) {
            let message = format!("{what} of thyristor model `{}` is out of range", name.text);
            let label = "Vgt, Igt, Itm and Roff must be positive, Ih, Vfwd and Ron not negative";
            self.tell(Diagnostic::error("bad-value", chain[0].name.span, message).label(label));
            return None;
        }
        // A triac's two gates are in parallel.
        let parallel = if triac { 2.0 } else { 1.0 };
        Some(Figures {
            triac,
            vgt,
            gate: igt.map_or(OPEN, |igt| Value::binary(parallel * vgt.f64 / igt.f64)),
            holding: holding.f64,
            vfwd,
            ron,
            roff,
        })
    }
}

/// What the parts of a thyristor share.
struct Parts {
    name: String,
    span: Span,
    figures: Figures,
}
