//! D, and A with a `sidiode` model: models to laws.

use super::builder::Builder;
use super::elaborate::Diodes;
use super::losses::Changing;
use super::model::{ONE, Parameters, ZERO};
use super::passive::Args;
use super::scope::ScopeId;
use super::{Element, Kind};
use crate::algebra::Value;
use crate::diagnostic::Diagnostic;
use crate::law::{Corner, Curve, Law, Rounded, Side};
use crate::netlist::ast::{self, Assign, Expr, Name};
use crate::settings::tolerances::netlists::IDEAL_EMISSION;

/// What an ideal diode of LTspice's is made of.
const PIECEWISE: [&str; 9] = [
    "ron",
    "roff",
    "vfwd",
    "vrev",
    "rrev",
    "ilimit",
    "revilimit",
    "epsilon",
    "revepsilon",
];

impl<'n> Builder<'n, '_> {
    pub(super) fn diode(
        &mut self,
        card: &'n ast::Element,
        name: &'n Name,
        area: Option<&'n Expr>,
        args: &'n [Assign],
        scope: ScopeId,
    ) {
        self.check_args(
            card,
            args,
            &[
                "area", "m", "ic", "off", "on", "pj", "lm", "lp", "wm", "wp", "thermal",
            ],
        );
        let args = Args(args);
        let unknown = self.scopes.model(scope, &name.text).is_none();
        let law = if unknown && self.options.diodes == Diodes::Ideal {
            let message = format!(
                "an ideal diode stands for unknown model `{}` of `{}`",
                name.text, card.name.text
            );
            let warning = Diagnostic::warning("unknown-model", name.span, message);
            let findings = &mut self.scopes.findings;
            findings.miss(&name.text, warning.label("not defined"));
            Some(Law::ideal_diode())
        } else {
            self.model(card, name, scope).and_then(|chain| {
                let kind = if card.name.text.starts_with('a') {
                    "sidiode"
                } else {
                    "d"
                };
                if chain.iter().all(|m| m.kind.text != kind) {
                    self.wrong_model(card, chain[0], name, kind);
                    return None;
                }
                let factor = self.factor(area.or(args.get(&["area"])), args, scope)?;
                let params = Parameters::new(&chain);
                let counts = [&PIECEWISE[..], &["is", "n", "rs", "bv", "ibv"]].concat();
                self.misspelt(('d', name), &params, &counts);
                let device = self.full_name(&card.name, scope);
                let changing = Changing {
                    switch: None,
                    diode: Some(device.clone()),
                };
                self.losses((&device, name), &params, changing, factor, scope);
                self.diode_law(card, name, &params, args, scope)
                    .map(|law| scaled(law, factor))
            })
        };
        // The nodes exist even if the law is at fault, so that one mistake is not reported twice.
        let (p, n) = (
            self.node(&card.nodes[0], scope),
            self.node(&card.nodes[1], scope),
        );
        let kind = Kind::Device(law.unwrap_or(Law::ideal_diode()));
        let name = self.full_name(&card.name, scope);
        self.add(Element {
            name,
            p,
            n,
            kind,
            ic: None,
            span: Some(card.span),
        });
    }

    /// area · m.
    fn factor(&mut self, area: Option<&'n Expr>, args: Args<'n>, scope: ScopeId) -> Option<f64> {
        let area = match area {
            Some(area) => self.scopes.finite(area, scope)?.f64,
            None => 1.0,
        };
        let m = self.arg(args, &["m"], scope)?.map_or(1.0, |m| m.f64);
        Some(if area * m > 0.0 { area * m } else { 1.0 })
    }

    fn diode_law(
        &mut self,
        card: &ast::Element,
        name: &Name,
        params: &Parameters<'n>,
        args: Args<'n>,
        scope: ScopeId,
    ) -> Option<Law> {
        let piecewise = ["ron", "roff", "vfwd", "vrev", "rrev"]
            .iter()
            .any(|p| params.get(p).is_some());
        let emission = self.parameter(params, "n", scope)?;
        let is_exponential = params.get("is").is_some() || emission.is_some();
        let piecewise = piecewise || card.name.text.starts_with('a');
        let near_ideal = emission.is_some_and(|n| n.f64 <= IDEAL_EMISSION)
            || params.flag("ideal")
            || (name.text.contains("ideal") && !is_exponential);
        let exponential = !piecewise && !near_ideal;
        let wanted = match self.options.diodes {
            Diodes::Exp => true,
            Diodes::Auto => exponential,
            Diodes::Ideal => false,
        };
        if wanted {
            return self.exponential_law(card, name, params, args, scope);
        }
        let series = self.parameter(params, "rs", scope)?.unwrap_or(ZERO);
        if exponential {
            if params.get("bv").is_some() {
                self.unused(format!("bv of {}", name.text), name);
            }
            return Some(Law::Diode {
                vfwd: ZERO,
                ron: series,
                roff: None,
            });
        }
        let (vfwd, ron, roff) = if piecewise {
            let vfwd = self.parameter(params, "vfwd", scope)?.unwrap_or(ZERO);
            let ron = self.parameter(params, "ron", scope)?.unwrap_or(ONE);
            let roff = self.off_resistance(params, scope)?;
            if vfwd.f64 < 0.0 {
                let message = format!("diode model `{}` has a negative Vfwd", name.text);
                let written = params.get("vfwd").map(|expr| expr.span);
                self.tell(
                    Diagnostic::warning("negative-value", written, message)
                        .label(format!("it conducts from {} V on", vfwd.f64))
                        .help("Vfwd is the voltage that it drops, 0.7 of silicon: below 0 it delivers power"),
                );
            }
            self.exchanged(name, params, ron, roff);
            (vfwd, ron, roff)
        } else {
            (ZERO, series, None)
        };
        let breakdown = if piecewise { "vrev" } else { "bv" };
        let vrev = self
            .parameter(params, breakdown, scope)?
            .filter(|v| v.f64.is_finite());
        let rrev = if piecewise {
            self.parameter(params, "rrev", scope)?.unwrap_or(ron)
        } else {
            ron
        };
        let widths = if piecewise {
            let mut width = |name| self.parameter(params, name, scope);
            [width("epsilon")?, width("revepsilon")?].map(|w| w.map_or(0.0, |w| w.f64))
        } else {
            [0.0; 2]
        };
        let rounded = widths.iter().any(|w| *w != 0.0) && self.options.diodes != Diodes::Ideal;
        let limits = if piecewise {
            self.limits(name, params, rounded, scope)?
        } else {
            [None; 2]
        };
        if rounded {
            return self.rounded(
                card,
                name,
                [vfwd, ron],
                vrev.map(|v| [v, rrev]),
                roff,
                widths,
            );
        }
        if limits.iter().any(Option::is_some) {
            let side = |v: Value, r: Value, limit: Option<f64>| Side { v, r, limit };
            let forward = side(vfwd, ron, limits[0]);
            let reverse = vrev.map(|v| side(v, rrev, limits[1]));
            return Some(Law::Curve(Curve::limited(forward, reverse, roff)));
        }
        Some(match vrev {
            None => Law::Diode { vfwd, ron, roff },
            Some(vrev) => Law::Curve(Curve::zener((vrev, rrev), (vfwd, ron), roff)),
        })
    }

    /// Ilimit and Revilimit, where they are positive and the corners are sharp.
    fn limits(
        &mut self,
        name: &Name,
        params: &Parameters<'n>,
        rounded: bool,
        scope: ScopeId,
    ) -> Option<[Option<f64>; 2]> {
        let mut limits = [None; 2];
        for (limit, parameter) in limits.iter_mut().zip(["ilimit", "revilimit"]) {
            let Some(expr) = params.get(parameter) else {
                continue;
            };
            // An infinite limit is none.
            let value = self.scopes.number(expr, scope)?;
            *limit = Some(value.f64).filter(|x| x.is_finite() && *x > 0.0 && !rounded);
            if limit.is_none() && value.f64 != f64::INFINITY {
                self.unused(format!("{parameter} of {}", name.text), name);
            }
        }
        Some(limits)
    }

    /// Straight lines with corners of the widths (forward, reverse).
    fn rounded(
        &mut self,
        card: &ast::Element,
        name: &Name,
        [vfwd, ron]: [Value; 2],
        reverse: Option<[Value; 2]>,
        roff: Option<Value>,
        [forward_width, reverse_width]: [f64; 2],
    ) -> Option<Law> {
        let corner = |v: Value, r: Value, width: f64| Corner {
            v: v.f64,
            g: 1.0 / r.f64,
            width,
        };
        let law = Rounded {
            g: roff.map_or(0.0, |r| 1.0 / r.f64),
            forward: corner(vfwd, ron, forward_width),
            reverse: reverse.map(|[v, r]| corner(v, r, reverse_width)),
        };
        if law.is_sound() {
            return Some(Law::Rounded(law));
        }
        let message = format!(
            "model `{}` of `{}` cannot have its corners rounded: Ron and Rrev must be positive and below Roff, the widths not negative and apart",
            name.text, card.name.text
        );
        self.tell(
            Diagnostic::error("bad-value", name.span, message)
                .label("Epsilon and Revepsilon need room")
                .help("`--diodes ideal` keeps the corners sharp"),
        );
        None
    }
}

/// A law for `factor` devices in parallel.
fn scaled(law: Law, factor: f64) -> Law {
    if factor == 1.0 {
        return law;
    }
    let less = |r: Value| Value::binary(r.f64 / factor);
    match law {
        Law::Exponential(diode) => Law::Exponential(diode.times(factor)),
        Law::Rounded(diode) => Law::Rounded(diode.times(factor)),
        Law::Diode { vfwd, ron, roff } => Law::Diode {
            vfwd,
            ron: less(ron),
            roff: roff.map(less),
        },
        Law::Curve(curve) => Law::Curve(Curve {
            vertices: curve
                .vertices
                .iter()
                .map(|&(v, i)| (v, Value::binary(i.f64 * factor)))
                .collect(),
            first: (less(curve.first.0), curve.first.1),
            last: (less(curve.last.0), curve.last.1),
            ..curve
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture;
    use super::*;

    fn law(card: &str, model: &str, diodes: Diodes) -> Option<Law> {
        let text = format!("V1 a 0 5\nR1 a b 1\n{card}\n.model {model}");
        match fixture::read(&text, diodes).0?.elements.pop()?.kind {
            Kind::Device(law) => Some(law),
            other => panic!("{other:?}"),
        }
    }

    /// vfwd, ron, roff.
    fn diode(card: &str, model: &str, diodes: Diodes) -> Option<(f64, f64, Option<f64>)> {
        match law(card, model, diodes)? {
            Law::Diode { vfwd, ron, roff } => Some((vfwd.f64, ron.f64, roff.map(|r| r.f64))),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn models_to_laws() {
        let d = "D1 b 0 m";
        for (card, model, expected) in [
            (
                d,
                "m D(Ron=1m Roff=1Meg Vfwd=0.7)",
                Some((0.7, 1e-3, Some(1e6))),
            ),
            (d, "m D(Vfwd=0.7)", Some((0.7, 1.0, None))),
            (d, "m D(N=0.01 RS=5m)", Some((0.0, 5e-3, None))),
            (d, "m D(ideal)", Some((0.0, 0.0, None))),
            ("D1 b 0 ideal", "ideal D", Some((0.0, 0.0, None))),
            (
                "D1 b 0 m 2",
                "m D(Ron=1 Roff=1k)",
                Some((0.0, 0.5, Some(500.0))),
            ),
            ("D1 b 0 m m=4", "m D(Ron=1)", Some((0.0, 0.25, None))),
        ] {
            assert_eq!(
                diode(card, model, Diodes::Auto),
                expected,
                "{card}, {model}"
            );
        }
    }

    #[test]
    fn ideal_on_demand() {
        assert_eq!(
            diode("D1 b 0 m", "m D(IS=1e-14 RS=0.6 BV=100)", Diodes::Ideal),
            Some((0.0, 0.6, None))
        );
        assert_eq!(
            diode("D1 b 0 m", "m D(Ron=1m Vfwd=0.7)", Diodes::Ideal),
            Some((0.7, 1e-3, None))
        );
        assert_eq!(
            diode("D1 b 0 other", "m D", Diodes::Ideal),
            Some((0.0, 0.0, None))
        );
    }

    #[test]
    fn the_code_model_of_ngspice_is_a_diode_of_straight_lines() {
        let model = "m sidiode(Ron=0.5 Roff=10 Vfwd=1)";
        let found = diode("A1 b 0 m", model, Diodes::Auto);
        assert_eq!(found, Some((1.0, 0.5, Some(10.0))));
        assert_eq!(
            diode("A1 b 0 m", "m sidiode", Diodes::Auto),
            Some((0.0, 1.0, None))
        );
        assert_eq!(law("D1 b 0 m", model, Diodes::Auto), None);
        assert_eq!(law("A1 b 0 m", "m D(Ron=1)", Diodes::Auto), None);
    }

    #[test]
    fn an_epsilon_rounds_the_corner() {
        let model = "m D(Ron=0.5 Roff=10 Vfwd=1 Epsilon=0.4 Vrev=2 Rrev=0.25)";
        let Some(Law::Rounded(law)) = law("D1 b 0 m 2", model, Diodes::Auto) else {
            panic!("no rounded law")
        };
        // Twice the current of one: 0.1 at 1 V on the line, and 1.9·0.2²/0.8 of the parabola.
        assert!((law.current(1.0) - 2.0 * (0.1 + 1.9 * 0.05)).abs() < 1e-15);
        assert!((law.current(-2.5) + 2.0 * (0.2 + 4.0 * 0.5)).abs() < 1e-15);
        assert!(matches!(
            self::law("D1 b 0 m", model, Diodes::Ideal),
            Some(Law::Curve(_))
        ));
        assert_eq!(
            self::law("D1 b 0 m", "m D(Ron=0 Epsilon=0.4)", Diodes::Auto),
            None
        );
        assert_eq!(
            self::law("D1 b 0 m", "m D(Ron=1 Vrev=0.1 Epsilon=0.4)", Diodes::Auto),
            None
        );
    }

    #[test]
    fn currents_are_limited() {
        let Some(Law::Curve(curve)) = law(
            "D1 b 0 m 2",
            "m D(Ron=1 Vfwd=1 Ilimit=3 Vrev=10 Rrev=2)",
            Diodes::Auto,
        ) else {
            panic!("no curve")
        };
        // Two in parallel carry 6 A at most; the breakdown has no limit.
        let last = curve.vertices.last().map(|(_, i)| i.f64);
        assert_eq!((last, curve.last.1.f64), (Some(6.0), 0.0));
        assert_eq!((curve.first.0.f64, curve.first.1.f64), (1.0, 1.0));
        assert!(curve.contains(1.5, 1.0, 1.0, 1e-12));
        // With rounded corners, or where it is no limit, the parameter has no effect.
        for model in [
            "m D(Ron=1 Ilimit=3 Epsilon=0.1)",
            "m D(Ron=1 Ilimit=inf)",
            "m D(Ron=1 Ilimit=0)",
        ] {
            let found = law("D1 b 0 m", model, Diodes::Auto);
            assert!(
                matches!(found, Some(Law::Rounded(_) | Law::Diode { .. })),
                "{model}"
            );
        }
    }

    #[test]
    fn a_reverse_voltage_makes_a_zener() {
        let Some(Law::Curve(curve)) = law(
            "D1 b 0 m",
            "m D(Ron=1 Roff=1k Vfwd=1 Vrev=10 Rrev=2)",
            Diodes::Auto,
        ) else {
            panic!("no curve")
        };
        let points: Vec<(f64, f64)> = curve.vertices.iter().map(|(v, i)| (v.f64, i.f64)).collect();
        assert_eq!(points, [(-10.0, -0.01), (1.0, 0.001)]);
        assert_eq!(
            (curve.first.0.f64, curve.last.0.f64, curve.kind),
            (2.0, 1.0, "zener")
        );
    }
}
