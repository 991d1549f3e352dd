//! R, C and L with LTspice's parasitics, and the `name=value` arguments of all elements.

use super::builder::Builder;
use super::scope::ScopeId;
use super::{Affine, Element, Kind, NodeId, Output};
use crate::algebra::Value;
use crate::diagnostic::{Diagnostic, Span};
use crate::netlist::ast::{self, Assign, Expr, ExprKind};
use crate::netlist::suggest::is_unit;

/// Ratings, and the temperature of devices.
const WITHOUT_EFFECT: [&str; 21] = [
    "v",
    "irms",
    "vrms",
    "ipk",
    "mfg",
    "type",
    "pn",
    "tol",
    "pwr",
    "trise",
    "noisy",
    "noiseless",
    "ac",
    "lot",
    "dev",
    "description",
    "bv_max",
    "vpk",
    "off",
    "iave",
    "rating",
];

/// The temperature and the coefficients of R, C and L: SPICE's TC1 and TC2.
const THERMAL: [&str; 6] = ["tc", "tc1", "tc2", "tce", "temp", "dtemp"];
/// The base of `tce`, in percent for each kelvin.
const PERCENT: f64 = 1.01;

/// Parts that LTspice adds to an element: in series and across.
pub(super) const PARASITICS: [&str; 5] = ["rser", "lser", "rpar", "cpar", "rlshunt"];

/// The arguments of a card.
#[derive(Clone, Copy)]
pub(super) struct Args<'n>(pub(super) &'n [Assign]);

impl<'n> Args<'n> {
    /// The value of the first argument with one of these names.
    pub(super) fn get(self, names: &[&str]) -> Option<&'n Expr> {
        self.0
            .iter()
            .find(|a| names.contains(&a.name.text.as_str()))
            .and_then(|a| a.value.as_ref())
    }
}

impl<'n> Builder<'n, '_> {
    /// An argument as a finite number; `Some(None)` if it is not given.
    #[expect(clippy::option_option, reason = "absent and faulty are different")]
    pub(super) fn arg(
        &mut self,
        args: Args<'n>,
        names: &[&str],
        scope: ScopeId,
    ) -> Option<Option<Value>> {
        match args.get(names) {
            None => Some(None),
            Some(expr) => self.scopes.finite(expr, scope).map(Some),
        }
    }

    /// Reports arguments that the card does not know.
    pub(super) fn check_args(&mut self, card: &ast::Element, args: &[Assign], known: &[&str]) {
        for Assign { name, value } in args {
            if known.contains(&name.text.as_str()) || WITHOUT_EFFECT.contains(&name.text.as_str()) {
                continue;
            }
            self.tell(match value {
                Some(_) => {
                    let message = format!(
                        "`{}` of `{}` is not known and ignored",
                        name.text, card.name.text
                    );
                    Diagnostic::warning("ignored", name.span, message).label("ignored")
                }
                None => Diagnostic::error(
                    "unexpected",
                    name.span,
                    format!("unexpected `{}`", name.text),
                )
                .label("nothing should stand here"),
            });
        }
    }

    pub(super) fn passive(
        &mut self,
        card: &'n ast::Element,
        values: &'n [Expr],
        args: &'n [Assign],
        scope: ScopeId,
    ) {
        let letter = card.name.text.chars().next().unwrap_or('r');
        if letter != 'r' && self.saturable(card, args, scope) {
            return;
        }
        let own = letter.to_string();
        let mut known = vec![own.as_str(), "value", "m", "scale", "ic"];
        known.extend(THERMAL);
        if letter != 'r' {
            known.extend(PARASITICS);
        }
        self.check_args(card, args, &known);
        let args = Args(args);

        let Some((mut value, factor)) = self.passive_value(card, values, args, letter, scope)
        else {
            return;
        };
        if scope == ScopeId::ROOT {
            let percent = args.get(&["tol"]);
            let percent = percent.and_then(|percent| self.scopes.finite(percent, scope));
            let own = percent.map(|percent| 0.01 * percent.f64.abs());
            let tolerance = own.map(|own| (card.name.text.clone(), own));
            self.circuit.tolerances.extend(tolerance);
            value = self
                .settled(&card.name.text, Some(value), own)
                .unwrap_or(value);
        } else if args.get(&["tol"]).is_some() {
            let message = format!(
                "`tol` of `{}` in a subcircuit does not count",
                card.name.text
            );
            self.tell(
                Diagnostic::note("ignored", card.span, message)
                    .label("tolerances are those of the top level")
                    .help("samples draw the value where it is written as `{mc(10k, 0.05)}`; `--worst` sees a parameter of the top level that has a tolerance by `--tol-of`"),
            );
        }
        let value = match factor {
            Some(factor) if factor.f64 != 1.0 => Value::binary(value.f64 * factor.f64),
            _ => value,
        };
        let Some(value) = self.at_temperature(value, values, args, scope) else {
            return;
        };
        let multiplier = match (
            self.arg(args, &["m"], scope),
            self.arg(args, &["scale"], scope),
        ) {
            (Some(m), Some(scale)) => m.map_or(1.0, |m| m.f64) * scale.map_or(1.0, |s| s.f64),
            _ => return,
        };
        let value = if multiplier == 1.0 {
            value
        } else if letter == 'c' {
            Value::binary(value.f64 * multiplier)
        } else {
            Value::binary(value.f64 / multiplier)
        };
        if value.f64 < 0.0 && letter != 'r' {
            let what = match letter {
                'c' => "capacitance",
                _ => "inductance",
            };
            let message = format!("`{}` has a negative {what}", card.name.text);
            self.tell(
                Diagnostic::warning("negative-value", card.span, message)
                    .label(format!("it is {:e}", value.f64))
                    .help("what it stores is below nothing, and a circuit around it may run away: take the sign out if it is not meant"),
            );
        }
        let Some(ic) = self.arg(args, &["ic"], scope) else {
            return;
        };
        let zero_current = Affine {
            terms: Vec::new(),
            constant: 0.0,
        };
        let kind = match letter {
            'r' => Kind::Resistor(value),
            'c' if value.f64 == 0.0 => Kind::Controlled {
                output: Output::Current,
                control: zero_current,
            },
            'c' => Kind::Capacitor(value),
            _ if value.f64 == 0.0 => Kind::Resistor(value),
            _ => Kind::Inductor(value),
        };
        let (p, n) = (
            self.node(&card.nodes[0], scope),
            self.node(&card.nodes[1], scope),
        );
        let name = self.full_name(&card.name, scope);
        let ic = ic.map(|v| v.f64).filter(|_| letter != 'r');
        self.with_parasitics(
            Element {
                name,
                p,
                n,
                kind,
                ic,
                span: Some(card.span),
            },
            args,
            scope,
        );
    }

    /// The value of a card, from `R=`, a number or an expression, else its model's; and what its model multiplies it by.
    fn passive_value(
        &mut self,
        card: &'n ast::Element,
        values: &'n [Expr],
        args: Args<'n>,
        letter: char,
        scope: ScopeId,
    ) -> Option<(Value, Option<Value>)> {
        let mut value = args.get(&[letter.to_string().as_str(), "value"]);
        let mut model = None;
        for given in values {
            match &given.kind {
                ExprKind::Name(name)
                    if self.scopes.param(scope, name).is_none()
                        && self.scopes.model(scope, name).is_some() =>
                {
                    model = self.scopes.model(scope, name);
                }
                ExprKind::Name(name) if value.is_some() => {
                    let fault =
                        Diagnostic::error("unexpected", given.span, format!("unexpected `{name}`"))
                            .label("neither a model nor part of the value");
                    self.tell(fault.help(if is_unit(name) {
                        format!("write the unit directly after the number, as in `10{name}`")
                    } else {
                        format!("take it out, or define it by `.model {name}`")
                    }));
                    return None;
                }
                _ if value.is_some() => {
                    let message = format!("`{}` has a second value", card.name.text);
                    let fault =
                        Diagnostic::error("unexpected", given.span, message).label("unexpected");
                    let help = match value.map(|value| &value.kind) {
                        Some(ExprKind::Name(name)) => {
                            format!("it has two nodes: `{name}` was read as its value")
                        }
                        _ => "leave one of the two".into(),
                    };
                    self.tell(fault.help(help));
                    return None;
                }
                _ => value = Some(given),
            }
        }
        let factor = match model {
            None => None,
            Some(model) => {
                let keys: [&str; 2] = match letter {
                    'r' => ["r", "res"],
                    'c' => ["c", "cap"],
                    _ => ["l", "ind"],
                };
                if !keys.contains(&model.kind.text.as_str()) {
                    let message = format!(
                        "`{}` uses model `{}` of type `{}`",
                        card.name.text, model.name.text, model.kind.text
                    );
                    let fault = Diagnostic::error("wrong-model", card.span, message)
                        .label("the model is of another kind");
                    self.tell(fault.help(format!("a model of type `{}` is needed", keys[0])));
                    return None;
                }
                Args(&model.params).get(&[keys[0]])
            }
        };
        match (value, factor, model) {
            (Some(value), None, _) => Some((self.scopes.finite(value, scope)?, None)),
            (Some(value), Some(factor), _) => {
                let value = self.scopes.finite(value, scope)?;
                let factor = self.scopes.finite(factor, scope)?;
                Some((value, Some(factor)))
            }
            (None, Some(own), _) => Some((self.scopes.finite(own, scope)?, None)),
            (None, None, Some(model)) => {
                let message = format!(
                    "`{}` has no value: models by geometry (`{}`) are not supported",
                    card.name.text, model.name.text
                );
                self.tell(
                    Diagnostic::error("unsupported", card.span, message)
                        .label("give the value on the card"),
                );
                None
            }
            (None, None, None) => {
                let message = format!("`{}` has no value", card.name.text);
                let fault =
                    Diagnostic::error("missing", card.span, message).label("a value is missing");
                self.tell(fault);
                None
            }
        }
    }

    /// The value at the temperature of the element, value (1 + TC1 ΔT + TC2 ΔT²) with ΔT from TNOM on, of the card's own coefficients or its
    /// model's.
    fn at_temperature(
        &mut self,
        value: Value,
        values: &'n [Expr],
        args: Args<'n>,
        scope: ScopeId,
    ) -> Option<Value> {
        let mut models = values.iter().filter_map(|given| match &given.kind {
            ExprKind::Name(name) if self.scopes.param(scope, name).is_none() => {
                self.scopes.model(scope, name)
            }
            _ => None,
        });
        let model = models.next().map(|model| Args(&model.params));
        let both = args.get(&["tc"]).or_else(|| model?.get(&["tc"]));
        let both = both.map_or(Some(Vec::new()), |both| self.scopes.numbers(both, scope))?;
        let otherwise = self.scopes.nominal;
        let mut number = |own: &[&str], otherwise: f64| -> Option<f64> {
            let found = args.get(own).or_else(|| model?.get(own));
            let value = found.map(|expr| self.scopes.finite(expr, scope));
            value.map_or(Some(otherwise), |value| value.map(|v| v.f64))
        };
        let coefficient = |k: usize| both.get(k).copied().unwrap_or(0.0);
        let tc1 = number(&["tc1"], coefficient(0))?;
        let tc2 = number(&["tc2"], coefficient(1))?;
        let tce = number(&["tce"], 0.0)?;
        if tc1 == 0.0 && tc2 == 0.0 && tce == 0.0 {
            return Some(value);
        }
        let (own, nominal) = (number(&["temp"], f64::NAN)?, number(&["tnom"], otherwise)?);
        let warmer = number(&["dtemp"], 0.0)?;
        let ambient = self.scopes.temperature.f64 + warmer;
        let above = if own.is_nan() { ambient } else { own } - nominal;
        let factor = if tce == 0.0 {
            1.0 + above * (tc1 + above * tc2)
        } else {
            PERCENT.powf(tce * above)
        };
        Some(if factor == 1.0 {
            value
        } else {
            Value::binary(value.f64 * factor)
        })
    }

    /// Adds an element with LTspice's `Rser Lser` in series and `Rpar Cpar` across the whole.
    pub(super) fn with_parasitics(&mut self, mut element: Element, args: Args<'n>, scope: ScopeId) {
        let (p, n, span) = (element.p, element.n, element.span);
        let base = element.name.clone();
        let mut parts: Vec<(&str, Value)> = Vec::new();
        for part in PARASITICS {
            match self.arg(args, &[part], scope) {
                Some(Some(value)) if value.f64 != 0.0 => parts.push((part, value)),
                Some(_) => {}
                None => return,
            }
        }
        let mut inner = n;
        let mut series: Vec<Element> = Vec::new();
        for &(part, value) in parts
            .iter()
            .filter(|(part, _)| matches!(*part, "rser" | "lser"))
        {
            let from = self.new_node(format!("{base}.{part}"));
            let kind = if part == "rser" {
                Kind::Resistor(value)
            } else {
                Kind::Inductor(value)
            };
            series.push(part_of(&base, part, from, inner, kind, span));
            inner = from;
        }
        element.n = inner;
        if self.add(element).is_none() {
            return;
        }
        for &(part, value) in &parts {
            let across = match part {
                "rpar" => Some((p, n, Kind::Resistor(value))),
                "cpar" => Some((p, n, Kind::Capacitor(value))),
                "rlshunt" => series
                    .iter()
                    .find(|e| matches!(e.kind, Kind::Inductor(_)))
                    .map(|e| (e.p, e.n, Kind::Resistor(value))),
                _ => None,
            };
            if let Some((p, n, kind)) = across {
                series.push(part_of(&base, part, p, n, kind, span));
            }
        }
        for part in series {
            self.add(part);
        }
    }
}

/// A parasitic part of an element: `c1.rser`.
fn part_of(
    base: &str,
    part: &str,
    p: NodeId,
    n: NodeId,
    kind: Kind,
    span: Option<Span>,
) -> Element {
    Element {
        name: format!("{base}.{part}"),
        p,
        n,
        kind,
        ic: None,
        span,
    }
}
