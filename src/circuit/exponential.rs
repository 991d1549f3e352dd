//! D models with Shockley's parameters, at their temperature.

use super::builder::Builder;
use super::model::Parameters;
use super::passive::Args;
use super::scope::ScopeId;
use crate::diagnostic::Diagnostic;
use crate::law::{Breakdown, Exponential, Law};
use crate::netlist::ast::{self, Name};

/// Parameters of charge and of noise.
const LEFT_OUT: [&str; 13] = [
    "cjo", "cj0", "cj", "tt", "vj", "pb", "m", "fc", "kf", "af", "nr", "cjsw", "cjp",
];
/// Parameters that bend the curve at rest: high injection, recombination, side walls.
const BENDING: [&str; 4] = ["ikf", "ikr", "isr", "jsw"];

impl<'n> Builder<'n, '_> {
    /// The exponential law of a model: `IS N RS BV IBV NBV EG XTI TNOM`, and the temperature of the card (`temp`, `dtemp`), else
    /// of the circuit.
    ///
    /// IS(T) = IS (T/Tnom)^(XTI/N) exp((T/Tnom − 1) EG q/(N k T)).
    pub(super) fn exponential_law(
        &mut self,
        card: &ast::Element,
        name: &Name,
        params: &Parameters<'n>,
        args: Args<'n>,
        scope: ScopeId,
    ) -> Option<Law> {
        // Level 3 scales the same equations with the geometry.
        self.level(card, name, params, &[1.0, 3.0], scope)?;
        for left_out in LEFT_OUT {
            if params.get(left_out).is_some() {
                self.unused(format!("{left_out} of {}", name.text), name);
            }
        }
        let (circuit, nominal) = (self.scopes.temperature.f64, self.scopes.nominal);
        let mut number = |names: &[&str], otherwise: f64| -> Option<f64> {
            for one in names {
                if let Some(expr) = params.get(one) {
                    // An infinite BV is none.
                    return self.scopes.number(expr, scope).map(|v| v.f64);
                }
            }
            Some(otherwise)
        };
        let mut bending = Vec::new();
        for parameter in BENDING {
            // Zero and infinite ones are none.
            let value = number(&[parameter], 0.0)?;
            if value != 0.0 && value.is_finite() {
                bending.push(parameter);
            }
        }
        let is = number(&["is", "js"], 1e-14)?;
        let n = number(&["n"], 1.0)?;
        let rs = number(&["rs"], 0.0)?;
        let bv = number(&["bv", "vb"], f64::INFINITY)?;
        let ibv = number(&["ibv"], 1e-3)?;
        let nbv = number(&["nbv"], n)?;
        let nominal = number(&["tnom", "t_measured"], nominal)?;
        let (eg, xti) = (number(&["eg"], 1.11)?, number(&["xti"], 3.0)?);
        let model = number(&["temp", "t_abs"], circuit)?;
        let shift = self.arg(args, &["dtemp"], scope)?.map_or(0.0, |t| t.f64);
        let celsius = self
            .arg(args, &["temp"], scope)?
            .map_or(model + shift, |t| t.f64);

        let thermal = Exponential::thermal_voltage(celsius);
        let ratio = thermal / Exponential::thermal_voltage(nominal);
        let is = is * ratio.powf(xti / n) * ((ratio - 1.0) * eg / (n * thermal)).exp();
        let diode = Exponential {
            is,
            slope: n * thermal,
            rs,
            leak: 0.0,
            breakdown: bv.is_finite().then_some(Breakdown {
                bv: bv.abs(),
                ibv: ibv.abs(),
                slope: nbv * thermal,
            }),
        };
        if !diode.is_sound() {
            let no_breakdown = |x: f64| x == f64::INFINITY;
            let (what, value) = [("N", n), ("IS", is), ("BV", bv), ("IBV", ibv), ("NBV", nbv)]
                .into_iter()
                .find(|(what, x)| {
                    !(*x > 0.0 && (x.is_finite() || *what == "BV" && no_breakdown(*x)))
                })
                .unwrap_or(("RS", rs));
            let message = format!(
                "model `{}` of `{}` is no diode: {what} is {value}",
                name.text, card.name.text
            );
            self.tell(
                Diagnostic::error("bad-value", name.span, message)
                    .label("out of range")
                    .help("IS, N, BV, IBV and NBV must be positive, RS not negative; `--diodes ideal` needs none of them"),
            );
            return None;
        }
        self.warn_of_bends(card, name, &bending);
        Some(Law::Exponential(diode))
    }

    /// Warns once a model of parameters that would bend its curve.
    fn warn_of_bends(&mut self, card: &ast::Element, name: &Name, given: &[&str]) {
        if given.is_empty() || self.told_models.contains(&name.text) {
            return;
        }
        self.told_models.push(name.text.clone());
        let message = format!(
            "the curve of `{}` is simulated without {} of model `{}`",
            card.name.text,
            given.join(", "),
            name.text
        );
        self.tell(Diagnostic::warning("diode-curve", name.span, message).label("approximated"));
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Diodes, Kind, fixture};
    use super::*;

    fn diode(card: &str, model: &str, diodes: Diodes) -> Option<Exponential> {
        let text = format!("V1 a 0 5\nR1 a b 1\n{card}\n.model {model}");
        match fixture::read(&text, diodes).0?.elements.pop()?.kind {
            Kind::Device(Law::Exponential(diode)) => Some(diode),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn models() {
        let vt = Exponential::thermal_voltage(27.0);
        let found = diode(
            "D1 b 0 m 2",
            "m D(IS=1e-12 N=1.5 RS=4 BV=50 IBV=1u)",
            Diodes::Auto,
        );
        let expected = Exponential {
            is: 2e-12,
            slope: 1.5 * vt,
            rs: 2.0,
            leak: 0.0,
            breakdown: Some(Breakdown {
                bv: 50.0,
                ibv: 2e-6,
                slope: 1.5 * vt,
            }),
        };
        assert_eq!(found, Some(expected));
        let bare = diode("D1 b 0 ideal", "ideal D(IS=1e-14)", Diodes::Auto);
        assert_eq!(bare, diode("D1 b 0 m", "m D", Diodes::Auto));
        // Everything is exponential when asked for.
        assert_eq!(bare, diode("D1 b 0 m", "m D(Ron=1m)", Diodes::Exp));
        assert_eq!(diode("D1 b 0 m", "m D(IS=0)", Diodes::Auto), None);
        assert_eq!(diode("D1 b 0 m", "m D(RS=-1)", Diodes::Auto), None);
    }

    #[test]
    fn the_circuit_has_a_temperature_too() {
        let card = diode("D1 b 0 m temp=77", "m D(IS=1e-14)", Diodes::Auto);
        for all in ["temp 77", "options temp=77"] {
            let text = format!("m D(IS=1e-14)\n.{all}");
            assert_eq!(diode("D1 b 0 m", &text, Diodes::Auto), card, "{all}");
        }
        let warmer = diode("D1 b 0 m dtemp=50", "m D(IS=1e-14)", Diodes::Auto);
        assert_eq!(warmer, card);
    }

    #[test]
    fn saturation_current_grows_with_temperature() {
        let cold = diode("D1 b 0 m", "m D(IS=1e-14)", Diodes::Auto).unwrap();
        let hot = diode("D1 b 0 m temp=77", "m D(IS=1e-14)", Diodes::Auto).unwrap();
        let (t, tnom): (f64, f64) = (350.15, 300.15);
        // Tabulated by hand: (T/Tnom)³ exp(1.11 (1/VT(Tnom) − 1/VT(T))).
        let factor = (t / tnom).powi(3) * (1.11 * (1.0 / cold.slope - 1.0 / hot.slope)).exp();
        assert!((hot.is / cold.is / factor - 1.0).abs() < 1e-12);
        assert!((hot.slope / cold.slope - t / tnom).abs() < 1e-12);
    }
}
