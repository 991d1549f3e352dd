//! D, S and W: models to laws and switches.

use super::builder::{Builder, Pending};
use super::elaborate::Diodes;
use super::passive::Args;
use super::scope::ScopeId;
use super::{Affine, Element, Kind, Quantity, Switch};
use crate::algebra::Value;
use crate::diagnostic::Diagnostic;
use crate::law::{Curve, Law};
use crate::netlist::ast::{self, Assign, Control, Expr, ExprKind, Model, Name};

/// A diode whose emission coefficient is this small is taken as ideal.
const IDEAL_EMISSION: f64 = 0.05;
/// Off-resistance of ngspice's switch model where none is given, Ω.
const SWITCH_ROFF: Value = Value::decimal(1e12, 1, 12);
/// Off-resistance of PSpice's switch models where none is given, Ω.
const VSWITCH_ROFF: Value = Value::decimal(1e6, 1, 6);

const ZERO: Value = Value::decimal(0.0, 0, 0);
const ONE: Value = Value::decimal(1.0, 1, 0);

impl<'n> Builder<'n, '_> {
    /// The model a card names, with those it extends, the nearest first.
    fn model(
        &mut self,
        card: &ast::Element,
        name: &Name,
        scope: ScopeId,
    ) -> Option<Vec<&'n Model>> {
        let mut chain: Vec<&'n Model> = Vec::new();
        let mut wanted = name.clone();
        loop {
            let Some(model) = self.scopes.model(scope, &wanted.text) else {
                let message = format!("`{}` uses unknown model `{}`", card.name.text, wanted.text);
                let fault =
                    Diagnostic::error("unknown-model", wanted.span, message).label("not defined");
                let near = self
                    .scopes
                    .near(scope, &wanted.text, |s| s.models.keys().copied());
                self.tell(match near {
                    Some(near) => fault.help(format!("did you mean `{near}`?")),
                    None => fault.help(format!(
                        "add `.model {} …`, or include the file that defines it",
                        wanted.text
                    )),
                });
                return None;
            };
            if chain.iter().any(|m| std::ptr::eq(*m, model)) {
                let message = format!("model `{}` extends itself", model.name.text);
                self.tell(
                    Diagnostic::error("circular", model.name.span, message)
                        .label("comes back to itself"),
                );
                return None;
            }
            chain.push(model);
            match &model.base {
                Some(base) => wanted = base.clone(),
                None => return Some(chain),
            }
        }
    }

    fn wrong_model(&mut self, card: &ast::Element, model: &Model, name: &Name, needed: &str) {
        let message = format!(
            "`{}` uses model `{}`, which is of type `{}`",
            card.name.text, model.name.text, model.kind.text
        );
        let fault = Diagnostic::error("wrong-model", name.span, message)
            .label("the model is of another kind");
        self.tell(fault.help(format!(
            "{} needs a model of type {needed}",
            crate::netlist::card::describe(card.name.text.chars().next().unwrap_or(' '))
        )));
    }

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
                "`{}` uses unknown model `{}`: an ideal diode stands for it",
                card.name.text, name.text
            );
            self.tell(
                Diagnostic::warning("unknown-model", name.span, message).label("not defined"),
            );
            Some(Law::ideal_diode())
        } else {
            self.model(card, name, scope).and_then(|chain| {
                if chain.iter().all(|m| m.kind.text != "d") {
                    self.wrong_model(card, chain[0], name, "D");
                    return None;
                }
                let factor = self.factor(area.or(args.get(&["area"])), args, scope)?;
                self.diode_law(card, name, &Parameters::new(&chain), scope)
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
        scope: ScopeId,
    ) -> Option<Law> {
        let piecewise = ["ron", "roff", "vfwd", "vrev", "rrev"]
            .iter()
            .any(|p| params.get(p).is_some());
        let emission = self.parameter(params, "n", scope)?;
        let is_exponential = params.get("is").is_some() || emission.is_some();
        let near_ideal = emission.is_some_and(|n| n.f64 <= IDEAL_EMISSION)
            || params.flag("ideal")
            || (name.text.contains("ideal") && !is_exponential);
        let series = self.parameter(params, "rs", scope)?.unwrap_or(ZERO);
        let exponential = !piecewise && !near_ideal;

        if self.options.diodes == Diodes::Exp
            || (exponential && self.options.diodes == Diodes::Auto)
        {
            let message = format!(
                "`{}` has the exponential model `{}`, which is not supported yet",
                card.name.text, name.text
            );
            self.tell(
                Diagnostic::error("exponential-diode", name.span, message)
                    .label("an exponential diode")
                    .help("`--diodes ideal` simulates it as an ideal diode in series with its RS"),
            );
            return None;
        }
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
            for ignored in ["epsilon", "revepsilon", "ilimit", "revilimit"] {
                if params.get(ignored).is_some() {
                    self.unused(format!("{ignored} of {}", name.text), name);
                }
            }
            let vfwd = self.parameter(params, "vfwd", scope)?.unwrap_or(ZERO);
            let ron = self.parameter(params, "ron", scope)?.unwrap_or(ONE);
            (vfwd, ron, self.off_resistance(params, scope)?)
        } else {
            (ZERO, series, None)
        };
        let breakdown = if piecewise { "vrev" } else { "bv" };
        let Some(vrev) = self
            .parameter(params, breakdown, scope)?
            .filter(|v| v.f64.is_finite())
        else {
            return Some(Law::Diode { vfwd, ron, roff });
        };
        let rrev = if piecewise {
            self.parameter(params, "rrev", scope)?.unwrap_or(ron)
        } else {
            ron
        };
        let leak = |v: f64| roff.map_or(ZERO, |r| Value::binary(v / r.f64));
        let minus = Value {
            f64: -vrev.f64,
            decimal: vrev.decimal.map(|(m, e)| (-m, e)),
        };
        Some(Law::Curve(Curve {
            kind: "zener",
            vertices: vec![(minus, leak(-vrev.f64)), (vfwd, leak(vfwd.f64))],
            first: (rrev, ONE),
            last: (ron, ONE),
        }))
    }

    /// `Roff`; infinite or absent is open. `None` after a reported fault.
    #[expect(clippy::option_option, reason = "open and faulty are different")]
    fn off_resistance(&mut self, params: &Parameters<'n>, scope: ScopeId) -> Option<Option<Value>> {
        let Some(roff) = params.get("roff") else {
            return Some(None);
        };
        let value = self.scopes.number(roff, scope)?;
        Some(Some(value).filter(|v| v.f64.is_finite()))
    }

    fn unused(&mut self, what: String, name: &Name) {
        if !self
            .unused_parameters
            .iter()
            .any(|(known, _)| *known == what)
        {
            self.unused_parameters.push((what, name.span));
        }
    }

    /// A parameter of a model as a finite number; `Some(None)` if it is not given.
    #[expect(clippy::option_option, reason = "absent and faulty are different")]
    fn parameter(
        &mut self,
        params: &Parameters<'n>,
        name: &str,
        scope: ScopeId,
    ) -> Option<Option<Value>> {
        match params.get(name) {
            None => Some(None),
            Some(expr) => self.scopes.finite(expr, scope).map(Some),
        }
    }

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
        let Some(mut switch) = self.switch_model(card, name, scope) else {
            return;
        };
        switch.initial = initial;
        let full = self.full_name(&card.name, scope);
        let element = Element {
            name: full,
            p,
            n,
            kind: Kind::Switch(switch),
            ic: None,
            span: Some(card.span),
        };
        if let Some(element) = self.add(element) {
            self.pending.push(Pending {
                element,
                scope,
                control,
                span: card.span,
            });
        }
    }

    /// The resistances and thresholds of a model; a negative `control` gain marks a switch that is on below.
    fn switch_model(
        &mut self,
        card: &'n ast::Element,
        name: &'n Name,
        scope: ScopeId,
    ) -> Option<Switch> {
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
        if !fits.contains(&kind) && !(kind == "sw" && !by_voltage) {
            self.wrong_model(card, model, name, other);
            return None;
        }
        let params = Parameters::new(&chain);
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
            return Some(Switch {
                control: Affine::default(),
                ron,
                roff,
                on_above: on,
                off_below: off,
                initial: None,
            });
        }
        let threshold = self.parameter(&params, &t, scope)?.map_or(0.0, |v| v.f64);
        let hysteresis = self.parameter(&params, &h, scope)?.map_or(0.0, |v| v.f64);
        if hysteresis < 0.0 {
            let message = format!(
                "model `{}` has a negative `{h}` (LTspice's smooth switch): its hysteresis is taken as {}",
                name.text, -hysteresis
            );
            self.tell(
                Diagnostic::warning("smooth-switch", model.name.span, message)
                    .label("approximated"),
            );
        }
        let width = hysteresis.abs();
        let (on_above, off_below) = (threshold + width, threshold - width);
        Some(Switch {
            control: Affine::default(),
            ron,
            roff,
            on_above,
            off_below,
            initial: None,
        })
    }
}

impl Switch {
    /// Sets the control; a switch that is on below its levels (`Von < Voff`) follows the negated control.
    pub(super) fn follow(&mut self, control: Affine) {
        self.control = control;
        if self.on_above < self.off_below {
            for (gain, _) in &mut self.control.terms {
                *gain = Value {
                    f64: -gain.f64,
                    decimal: gain.decimal.map(|(m, e)| (-m, e)),
                };
            }
            self.control.constant = -self.control.constant;
            self.on_above = -self.on_above;
            self.off_below = -self.off_below;
        }
    }

    /// Whether the switch follows the voltage across its own terminals: the idiom for an ideal diode.
    #[must_use]
    pub fn is_self_controlled(&self, p: super::NodeId, n: super::NodeId) -> bool {
        let across = super::names::difference(p, n);
        !across.terms.is_empty()
            && self.control.terms.iter().all(|t| across.terms.contains(t))
            && self.control.terms.len() == across.terms.len()
            && self
                .control
                .terms
                .iter()
                .all(|(_, q)| matches!(q, Quantity::Voltage(_)))
    }
}

/// The parameters of a model and of those it extends.
struct Parameters<'n>(Vec<&'n Assign>);

impl<'n> Parameters<'n> {
    fn new(chain: &[&'n Model]) -> Self {
        // Within a card the last of two equal names counts.
        Self(
            chain
                .iter()
                .flat_map(|model| model.params.iter().rev())
                .collect(),
        )
    }

    fn get(&self, name: &str) -> Option<&'n Expr> {
        self.0
            .iter()
            .find(|a| a.name.text == name)
            .and_then(|a| a.value.as_ref())
    }

    /// `ideal`, or `ideal=1`.
    fn flag(&self, name: &str) -> bool {
        self.0
            .iter()
            .find(|a| a.name.text == name)
            .is_some_and(|a| match &a.value {
                None => true,
                Some(Expr {
                    kind: ExprKind::Number(value),
                    ..
                }) => value.f64 != 0.0,
                Some(_) => true,
            })
    }
}

/// A law for `factor` devices in parallel.
fn scaled(law: Law, factor: f64) -> Law {
    if factor == 1.0 {
        return law;
    }
    let less = |r: Value| Value::binary(r.f64 / factor);
    match law {
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
