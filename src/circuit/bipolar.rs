//! Q: the equations of Ebers and Moll in their transport form, with ohmic terminals.
//!
//! ```text
//! I_F = IS (exp(v_be/(NF V_T)) − 1),   I_R = IS (exp(v_bc/(NR V_T)) − 1),
//! i_c = I_F − I_R − I_R/BR,            i_b = I_F/BF + I_R/BR
//! ```
//!
//! as two diodes, which carry the parts of the base current, and one source that follows them (J. J. Ebers, J. L. Moll, "Large-signal
//! behavior of junction transistors", Proc. IRE 42, 1954). Early effect, high injection and charge are left out, with a warning.

use super::builder::Builder;
use super::elaborate::Diodes;
use super::model::{Parameters, ZERO};
use super::passive::Args;
use super::scope::ScopeId;
use super::{Affine, Element, ElementId, Kind, NodeId, Output, Quantity};
use crate::algebra::Value;
use crate::diagnostic::Diagnostic;
use crate::law::{Exponential, Law};
use crate::netlist::ast::{self, Assign, Expr, Name};

/// What counts of a model.
const COUNTS: [&str; 12] = [
    "is", "bf", "br", "nf", "nr", "rb", "rc", "re", "eg", "xti", "xtb", "tnom",
];
/// The current at which an ideal junction has its drop, A.
const RATED: f64 = 1e-3;

/// What a model says.
struct Figures {
    mirrored: bool,
    is: f64,
    forward: (f64, f64),
    reverse: (f64, f64),
    /// RC, RB, RE, Ω.
    ohms: [f64; 3],
    /// kT/q, V.
    thermal: f64,
}

impl<'n> Builder<'n, '_> {
    pub(super) fn bipolar(
        &mut self,
        card: &'n ast::Element,
        words: &'n [Name],
        area: Option<&'n Expr>,
        args: &'n [Assign],
        scope: ScopeId,
    ) {
        self.check_args(
            card,
            args,
            &["area", "areab", "areac", "m", "ic", "off", "thermal"],
        );
        let Some((_, name, area)) = self.model_word(words, area, scope) else {
            return;
        };
        let pins: Vec<NodeId> = card.nodes.iter().map(|n| self.node(n, scope)).collect();
        let Some(figures) = self.bipolar_figures(card, name, area, Args(args), scope) else {
            return;
        };
        let full = self.full_name(&card.name, scope);
        self.name_pins(&full, "cbe", &pins);
        let span = Some(card.span);
        // The current of the transistor is that of its collector.
        let mut inner = [NodeId::GROUND; 3];
        for (k, (suffix, node)) in [("", "c"), (".rb", "b"), (".re", "e")]
            .into_iter()
            .enumerate()
        {
            let Some(&pin) = pins.get(k) else { return };
            let ohms = figures.ohms[k];
            if ohms == 0.0 && k > 0 {
                inner[k] = pin;
                continue;
            }
            inner[k] = self.new_node(format!("{full}.{node}"));
            let ohms = if ohms == 0.0 {
                ZERO
            } else {
                Value::binary(ohms)
            };
            let name = format!("{full}{suffix}");
            self.add(Element {
                name,
                p: pin,
                n: inner[k],
                kind: Kind::Resistor(ohms),
                ic: None,
                span,
            });
        }
        let [c, b, e] = inner;
        let ideal = self.options.diodes == Diodes::Ideal;
        let junction = |(beta, emission): (f64, f64)| {
            let slope = emission * figures.thermal;
            let is = figures.is / beta;
            Kind::Device(if ideal {
                Law::Diode {
                    vfwd: Value::binary(slope * (RATED / figures.is).ln_1p()),
                    ron: ZERO,
                    roff: None,
                }
            } else {
                Law::Exponential(Exponential {
                    is,
                    slope,
                    rs: 0.0,
                    leak: 0.0,
                    breakdown: None,
                })
            })
        };
        let mut diode = |suffix: &str, n: NodeId, figures_of: (f64, f64)| -> Option<ElementId> {
            let (p, n) = if figures.mirrored { (n, b) } else { (b, n) };
            let name = format!("{full}{suffix}");
            self.add(Element {
                name,
                p,
                n,
                kind: junction(figures_of),
                ic: None,
                span,
            })
        };
        let emitter = diode(".be", e, figures.forward);
        let collector = diode(".bc", c, figures.reverse);
        let (Some(emitter), Some(collector)) = (emitter, collector) else {
            return;
        };
        let sign = if figures.mirrored { -1.0 } else { 1.0 };
        let control = Affine {
            terms: vec![
                (
                    Value::binary(sign * figures.forward.0),
                    Quantity::Current(emitter),
                ),
                (
                    Value::binary(-sign * figures.reverse.0),
                    Quantity::Current(collector),
                ),
            ],
            constant: 0.0,
        };
        self.add(Element {
            name: format!("{full}.transport"),
            p: c,
            n: e,
            kind: Kind::Controlled {
                output: Output::Current,
                control,
            },
            ic: None,
            span,
        });
        self.note_bipolar(card, name);
    }

    /// Says once for each model what is left out.
    fn note_bipolar(&mut self, card: &ast::Element, name: &Name) {
        if self.told_models.contains(&name.text) {
            return;
        }
        self.told_models.push(name.text.clone());
        let message = format!(
            "`{}` is simulated by the equations of Ebers and Moll: Early effect, high injection and charge of model `{}` are left out",
            card.name.text, name.text
        );
        self.tell(
            Diagnostic::warning("transistor-ebers-moll", card.span, message).label("approximated"),
        );
    }

    fn bipolar_figures(
        &mut self,
        card: &ast::Element,
        name: &Name,
        area: Option<&'n Expr>,
        args: Args<'n>,
        scope: ScopeId,
    ) -> Option<Figures> {
        let chain = self.model(card, name, scope)?;
        let kind = chain.iter().map(|m| m.kind.text.as_str());
        let mirrored = match kind.into_iter().find(|k| !k.is_empty()).unwrap_or("") {
            "npn" => false,
            "pnp" => true,
            _ => {
                self.wrong_model(card, chain[0], name, "npn or pnp");
                return None;
            }
        };
        let params = Parameters::new(&chain);
        // Level 2 was a name of level 1 with a substrate.
        self.level(card, name, &params, &[1.0, 2.0], scope)?;
        self.misspelt(('q', name), &params, &COUNTS);
        let thermal = Exponential::thermal_voltage(self.scopes.temperature.f64);
        let nominal = self.scopes.nominal;
        let mut number = |name: &str, otherwise: f64| -> Option<f64> {
            Some(
                self.parameter(&params, name, scope)?
                    .map_or(otherwise, |v| v.f64),
            )
        };
        // IS(T) = IS (T/Tnom)^XTI exp((T/Tnom − 1) EG q/kT), β(T) = β (T/Tnom)^XTB.
        let ratio = thermal / Exponential::thermal_voltage(number("tnom", nominal)?);
        let (eg, xti) = (number("eg", 1.11)?, number("xti", 3.0)?);
        let gain = ratio.powf(number("xtb", 0.0)?);
        let is = number("is", 1e-16)? * ratio.powf(xti) * ((ratio - 1.0) * eg / thermal).exp();
        let forward = (number("bf", 100.0)? * gain, number("nf", 1.0)?);
        let reverse = (number("br", 1.0)? * gain, number("nr", 1.0)?);
        let ohms = [number("rc", 0.0)?, number("rb", 0.0)?, number("re", 0.0)?];
        let m = self.arg(args, &["m"], scope)?.map_or(1.0, |v| v.f64);
        let area = match area.or(args.get(&["area"])) {
            Some(area) => self.scopes.finite(area, scope)?.f64,
            None => 1.0,
        };
        let times = m * area;
        let positive = [is, forward.0, forward.1, reverse.0, reverse.1, times];
        if positive.iter().any(|x| !x.is_finite() || *x <= 0.0) || ohms.iter().any(|x| *x < 0.0) {
            let message = format!(
                "model `{}` of `{}` is no transistor: IS, BF, BR, NF, NR and the area must be positive, RB, RC and RE not negative",
                name.text, card.name.text
            );
            self.tell(Diagnostic::error("bad-value", name.span, message).label("out of range"));
            return None;
        }
        Some(Figures {
            mirrored,
            is: is * times,
            forward,
            reverse,
            ohms: ohms.map(|r| r / times),
            thermal,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Circuit, fixture};
    use super::*;

    fn read(text: &str, diodes: Diodes) -> (Option<Circuit>, Vec<Diagnostic>) {
        fixture::read(&format!("V1 c 0 5\nR1 c b 1k\nR2 e 0 1\n{text}"), diodes)
    }

    /// IS(T) and β(T) by hand at 77 °C: (T/Tnom)³ exp(EG (1/VT(Tnom) − 1/VT(T))) and (T/Tnom)^XTB.
    #[test]
    fn transistors_take_the_temperature_of_the_circuit() {
        let (circuit, _) = read(
            "Q1 c b e m\n.model m NPN(IS=1e-14 BF=200 BR=4 XTB=1.5)\n.temp 77",
            Diodes::Auto,
        );
        let elements = circuit.unwrap().elements;
        let Kind::Device(Law::Exponential(junction)) = elements[4].kind else {
            panic!("no junction")
        };
        let boltzmann = 8.617_333_262e-5;
        let (t, nominal): (f64, f64) = (350.15, 300.15);
        let is =
            1e-14 * (t / nominal).powi(3) * (1.11 / boltzmann * (1.0 / nominal - 1.0 / t)).exp();
        let beta = 200.0 * (t / nominal).powf(1.5);
        assert!((junction.slope / (boltzmann * t) - 1.0).abs() < 1e-9);
        assert!(
            (junction.is / (is / beta) - 1.0).abs() < 1e-7,
            "{junction:?}"
        );
    }

    #[test]
    fn the_parts_of_a_transistor() {
        for (text, mirrored) in [
            (
                "Q1 c b e 2n3904 2\n.model 2n3904 NPN(IS=1e-14 BF=200 BR=4 RB=10)",
                false,
            ),
            (
                "Q1 c b e 0 2n3904 2\n.model 2n3904 PNP(IS=1e-14 BF=200 BR=4 RB=10)",
                true,
            ),
        ] {
            let (circuit, findings) = read(text, Diodes::Auto);
            let circuit = circuit.unwrap_or_else(|| panic!("{findings:?}"));
            let parts: Vec<(&str, &str, &str)> = circuit.elements[3..]
                .iter()
                .map(|e| {
                    let node = |n: NodeId| circuit.nodes[n.index()].as_str();
                    (e.name.as_str(), node(e.p), node(e.n))
                })
                .collect();
            let (be, bc) = if mirrored {
                (("q1.be", "e", "q1.b"), ("q1.bc", "q1.c", "q1.b"))
            } else {
                (("q1.be", "q1.b", "e"), ("q1.bc", "q1.b", "q1.c"))
            };
            let expected = [
                ("q1", "c", "q1.c"),
                ("q1.rb", "b", "q1.b"),
                be,
                bc,
                ("q1.transport", "q1.c", "e"),
            ];
            assert_eq!(parts, expected);
            // IS of two, split by BF and BR; RB of two.
            let is = |k: usize| match circuit.elements[k].kind {
                Kind::Device(Law::Exponential(d)) => d.is,
                ref other => panic!("{other:?}"),
            };
            assert_eq!((is(5), is(6)), (1e-16, 5e-15));
            let Kind::Resistor(rb) = circuit.elements[4].kind else {
                panic!("no RB")
            };
            assert_eq!(rb.f64, 5.0);
            let Kind::Controlled { control, .. } = &circuit.elements[7].kind else {
                panic!("no source")
            };
            let sign = if mirrored { -1.0 } else { 1.0 };
            let gains: Vec<f64> = control.terms.iter().map(|t| t.0.f64).collect();
            assert_eq!(gains, [200.0 * sign, -4.0 * sign]);
            assert_eq!(
                findings
                    .iter()
                    .filter(|d| d.code == "transistor-ebers-moll")
                    .count(),
                1
            );
        }
    }

    #[test]
    fn ideal_junctions_have_the_drop_of_a_milliampere() {
        let (circuit, _) = read("Q1 c b e m\n.model m NPN(IS=1e-14)", Diodes::Ideal);
        let Kind::Device(Law::Diode { vfwd, .. }) = circuit.unwrap().elements[4].kind else {
            panic!("no junction")
        };
        assert!((vfwd.f64 - 0.025_864_926 * 1e11_f64.ln()).abs() < 1e-6);
    }

    #[test]
    fn wrong_models_are_refused() {
        let codes = |text: &str| -> Vec<&'static str> {
            let (circuit, findings) = read(text, Diodes::Auto);
            assert!(circuit.is_none());
            findings
                .iter()
                .map(|d| d.code)
                .filter(|c| *c != "no-analysis")
                .collect()
        };
        assert_eq!(codes("Q1 c b e m\n.model m NMOS"), ["wrong-model"]);
        assert_eq!(codes("Q1 c b e m\n.model m NPN(BF=0)"), ["bad-value"]);
        assert_eq!(codes("Q1 c b e m"), ["unknown-model"]);
    }
}
