//! S and W: models to switches.

use super::builder::{Builder, Pending};
use super::losses::Changing;
use super::model::{ONE, Parameters, ZERO};
use super::scope::ScopeId;
use super::{Affine, Element, Kind, NodeId, Switch, smooth};
use crate::algebra::Value;
use crate::diagnostic::Diagnostic;
use crate::law::Law;
use crate::netlist::ast::{self, Control, Name};

/// Off-resistance of ngspice's switch model where none is given, Ω.
const SWITCH_ROFF: Value = Value::decimal(1e12, 1, 12);
/// Off-resistance of PSpice's switch models where none is given, Ω.
const VSWITCH_ROFF: Value = Value::decimal(1e6, 1, 6);

impl<'n> Builder<'n, '_> {
    pub(super) fn switch(
        &mut self,
        card: &'n ast::Element,
        control: &'n Control,
        name: &'n Name,
        initial: Option<bool>,
        scope: ScopeId,
    ) {
        let (p, n) = (
            self.node(&card.nodes[0], scope),
            self.node(&card.nodes[1], scope),
        );
        let own = match control {
            Control::Nodes(pairs, _) => matches!(&pairs[..], [(a, b)]
                if self.node(a, scope) == p && self.node(b, scope) == n),
            _ => false,
        };
        let Some((mut switch, smooth)) = self.switch_model(card, name, own, scope) else {
            return;
        };
        switch.initial = initial;
        let full = self.full_name(&card.name, scope);
        let part = |name: String, p: NodeId, kind: Kind| Element {
            name,
            p,
            n,
            kind,
            ic: None,
            span: Some(card.span),
        };
        if own && !smooth.is_empty() {
            let (on, off) = (switch.on_above, switch.off_below);
            let levels = (0.5 * (on + off), 0.5 * (on - off));
            let ohms = (switch.ron.f64, switch.roff.map_or(f64::INFINITY, |r| r.f64));
            let law = Law::Curve(smooth::law(levels, ohms, smooth.len()));
            self.add(part(full, p, Kind::Device(law)));
            return;
        }
        if let Some(chain) = self.model(card, name, scope) {
            let changing = Changing {
                switch: smooth.is_empty().then(|| full.clone()),
                diode: None,
            };
            let params = Parameters::new(&chain);
            self.losses((&full, name), &params, changing, 1.0, scope);
        }
        let mut switches = Vec::new();
        if smooth.is_empty() {
            switches.push(part(full, p, Kind::Switch(switch)));
        } else {
            // The current of the switch is that of its first terminal.
            self.name_pins(&full, "pn", &[p, n]);
            let inner = self.new_node(format!("{full}.p"));
            self.add(Element {
                n: inner,
                ..part(full.clone(), p, Kind::Resistor(ZERO))
            });
            if let Some(roff) = switch.roff {
                self.add(part(format!("{full}.off"), inner, Kind::Resistor(roff)));
            }
            for (k, (level, ohms)) in smooth.into_iter().enumerate() {
                let step = Switch {
                    ron: Value::binary(ohms),
                    roff: None,
                    on_above: level,
                    off_below: level,
                    ..switch.clone()
                };
                let name = format!("{full}.{}", k + 1);
                switches.push(part(name, inner, Kind::Switch(step)));
            }
        }
        for switch in switches {
            if let Some(element) = self.add(switch) {
                self.pending.push(Pending {
                    element,
                    scope,
                    control,
                    span: card.span,
                });
            }
        }
    }

    /// The resistances and thresholds of a model, and for a smooth switch the steps of its conductance; `own`: its control is its own voltage.
    fn switch_model(
        &mut self,
        card: &'n ast::Element,
        name: &'n Name,
        own: bool,
        scope: ScopeId,
    ) -> Option<(Switch, Vec<(f64, f64)>)> {
        let chain = self.model(card, name, scope)?;
        let model = chain[0];
        let kind = chain
            .iter()
            .map(|m| m.kind.text.as_str())
            .find(|k| !k.is_empty())
            .unwrap_or("");
        let by_voltage = card.name.text.starts_with('s');
        let (level, other) = if by_voltage {
            ("v", "sw, vswitch")
        } else {
            ("i", "csw, iswitch")
        };
        let fits = if by_voltage {
            ["sw", "vswitch"]
        } else {
            ["csw", "iswitch"]
        };
        let sw_by_current = !by_voltage && kind == "sw";
        if !fits.contains(&kind) && !sw_by_current {
            self.wrong_model(card, model, name, other);
            return None;
        }
        let params = Parameters::new(&chain);
        let counts = [
            "ron", "roff", "vt", "vh", "von", "voff", "it", "ih", "ion", "ioff",
        ];
        self.misspelt(('s', name), &params, &counts);
        for ignored in ["lser", "vser", "ilimit"] {
            if params.get(ignored).is_some() {
                self.unused(format!("{ignored} of {}", name.text), name);
            }
        }
        let ideal = params.flag("ideal");
        let ron = self
            .parameter(&params, "ron", scope)?
            .unwrap_or(if ideal { ZERO } else { ONE });
        let (t, h) = (format!("{level}t"), format!("{level}h"));
        let (on, off) = (format!("{level}on"), format!("{level}off"));
        let with_levels = params.get(&on).is_some() || params.get(&off).is_some();
        let roff = if params.get("roff").is_some() || ideal {
            self.off_resistance(&params, scope)?
        } else {
            Some(if fits[1] == kind {
                VSWITCH_ROFF
            } else {
                SWITCH_ROFF
            })
        };
        for (what, value) in [("Ron", Some(ron)), ("Roff", roff)] {
            if value.is_some_and(|v| v.f64 < 0.0) {
                let message = format!("{what} of switch model `{}` is negative", name.text);
                self.tell(
                    Diagnostic::error("bad-value", model.name.span, message)
                        .label("must not be negative"),
                );
                return None;
            }
        }
        self.exchanged(name, &params, ron, roff);
        if kind == fits[1] || (with_levels && params.get(&t).is_none()) {
            if kind != fits[1] {
                let message = format!(
                    "model `{}` of type `{kind}` has `{on}`/`{off}`: read as in `{}`",
                    name.text, fits[1]
                );
                self.tell(
                    Diagnostic::warning("switch-levels", model.name.span, message)
                        .label(format!("`{t}` and `{h}` belong to `{kind}`")),
                );
            }
            let on = self.parameter(&params, &on, scope)?.map_or(1.0, |v| v.f64);
            let off = self.parameter(&params, &off, scope)?.map_or(0.0, |v| v.f64);
            let switch = Switch {
                control: Affine::default(),
                ron,
                roff,
                on_above: on,
                off_below: off,
                initial: None,
                latch: None,
            };
            return Some((switch, Vec::new()));
        }
        let threshold = self.parameter(&params, &t, scope)?.map_or(0.0, |v| v.f64);
        let hysteresis = self.parameter(&params, &h, scope)?.map_or(0.0, |v| v.f64);
        let width = hysteresis.abs();
        let (on_above, off_below) = (threshold + width, threshold - width);
        let mut steps = Vec::new();
        if hysteresis < 0.0 {
            let stairs = smooth::stairs(threshold, width, ron.f64, roff.map(|r| r.f64));
            // On its own voltage a law, unless that would fall somewhere.
            let rises = !own || threshold >= width;
            steps = stairs.filter(|_| rises).unwrap_or_default();
            let taken = if steps.is_empty() {
                format!("its hysteresis is taken as {width}")
            } else {
                let count = steps.len();
                format!("its conductance changes in {count} steps from {off_below} to {on_above}")
            };
            let message = format!(
                "model `{}` has a negative `{h}` (LTspice's smooth switch): {taken}",
                name.text
            );
            self.tell(
                Diagnostic::warning("smooth-switch", model.name.span, message)
                    .label("approximated"),
            );
        }
        let switch = Switch {
            control: Affine::default(),
            ron,
            roff,
            on_above,
            off_below,
            initial: None,
            latch: None,
        };
        Some((switch, steps))
    }
}

impl Switch {
    /// Sets the control; a switch that is on below its levels (`Von < Voff`) follows the negated control.
    pub(super) fn follow(&mut self, control: Affine) {
        self.control = control;
        if self.on_above < self.off_below {
            for (gain, _) in &mut self.control.terms {
                *gain = gain.negated();
            }
            self.control.constant = -self.control.constant;
            self.on_above = -self.on_above;
            self.off_below = -self.off_below;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ElaborateOptions, Quantity, elaborate};
    use super::*;
    use crate::diagnostic::SourceMap;
    use crate::netlist::parse;

    fn switch(model: &str) -> Switch {
        let mut sources = SourceMap::default();
        let text =
            format!("title\nV1 a 0 5\nS1 a b c 0 ms\nR1 b 0 1\nR2 c 0 1\n.model ms {model}\n");
        let root = sources.add("test.cir", text);
        let (netlist, _) = parse(&mut sources, root, &|_| {
            Err(std::io::ErrorKind::NotFound.into())
        });
        let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
        let circuit = circuit.unwrap_or_else(|| panic!("{findings:?}"));
        match &circuit.elements[1].kind {
            Kind::Switch(switch) => switch.clone(),
            other => panic!("{other:?}"),
        }
    }

    /// on_above, off_below, ron, roff and the gain of the control, which is v(c), node 3.
    fn numbers(model: &str) -> (f64, f64, f64, Option<f64>, f64) {
        let s = switch(model);
        let [(gain, Quantity::Voltage(NodeId(3)))] = s.control.terms[..] else {
            panic!("{:?}", s.control)
        };
        (
            s.on_above,
            s.off_below,
            s.ron.f64,
            s.roff.map(|r| r.f64),
            gain.f64,
        )
    }

    #[test]
    fn a_smooth_switch_is_a_staircase_or_a_law() {
        let read = |text: &str| {
            let mut sources = SourceMap::default();
            let text = format!("title\nV1 a 0 5\nV2 c 0 1\nR1 b 0 1\n{text}\n");
            let root = sources.add("test.cir", text);
            let (netlist, _) = parse(&mut sources, root, &|_| {
                Err(std::io::ErrorKind::NotFound.into())
            });
            let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
            assert!(findings.iter().any(|f| f.code == "smooth-switch"));
            circuit.unwrap_or_else(|| panic!("{findings:?}")).elements
        };
        let stairs = read("S1 a b c 0 ms\n.model ms SW(Ron=1 Roff=1Meg Vt=2 Vh=-1)");
        let names: Vec<&str> = stairs[3..].iter().map(|e| e.name.as_str()).collect();
        assert_eq!(names[..3], ["s1", "s1.off", "s1.1"]);
        assert_eq!(
            (names.len(), stairs[4].p, stairs[4].n),
            (8, stairs[3].n, stairs[10].n)
        );
        let own = read("S1 a b a b ms\n.model ms SW(Ron=1 Roff=1Meg Vt=2 Vh=-1)");
        assert!(own.len() == 4 && matches!(own[3].kind, Kind::Device(Law::Curve(_))));
        let falling = read("S1 a b a b ms\n.model ms SW(Ron=1 Roff=1Meg Vt=0 Vh=-1)");
        let Kind::Switch(switch) = &falling[3].kind else {
            panic!("no switch")
        };
        assert_eq!((switch.on_above, switch.off_below), (1.0, -1.0));
    }

    #[test]
    fn models() {
        for (model, expected) in [
            ("SW", (0.0, 0.0, 1.0, Some(1e12), 1.0)),
            (
                "SW(Vt=5 Vh=0.5 Ron=5m Roff=1Meg)",
                (5.5, 4.5, 5e-3, Some(1e6), 1.0),
            ),
            ("SW(ideal Vt=5 Vh=-0.5)", (5.5, 4.5, 0.0, None, 1.0)),
            ("SW(Vt=1 Ron=0 Roff=inf)", (1.0, 1.0, 0.0, None, 1.0)),
            ("SW(ideal Vt=1)", (1.0, 1.0, 0.0, None, 1.0)),
            ("VSWITCH(Von=4 Voff=1)", (4.0, 1.0, 1.0, Some(1e6), 1.0)),
            // On below its levels: −v(c) above −1, off below −4.
            ("VSWITCH(Von=1 Voff=4)", (-1.0, -4.0, 1.0, Some(1e6), -1.0)),
            ("SW(Von=4 Voff=1 Roff=1k)", (4.0, 1.0, 1.0, Some(1e3), 1.0)),
        ] {
            assert_eq!(numbers(model), expected, "{model}");
        }
    }
}
