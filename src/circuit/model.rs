//! `.model` cards: looking them up, and their parameters.

use super::builder::Builder;
use super::parameters::is_known;
use super::scope::{ScopeId, Scopes};
use crate::algebra::Value;
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{self, Assign, Expr, ExprKind, Model, Name};
use crate::netlist::card::describe;
use crate::netlist::suggest::{directive, nearest};

/// Zero, exactly.
pub(super) const ZERO: Value = Value::decimal(0.0, 0, 0);
/// One, exactly.
pub(super) const ONE: Value = Value::decimal(1.0, 1, 0);

/// What other programs and data sheets call parameters, and what they are here.
const MEANT: [(&str, &str); 16] = [
    ("vth", "vt"),
    ("vth", "vto"),
    ("vthresh", "vt"),
    ("threshold", "vt"),
    ("vthreshold", "vt"),
    ("vthreshold", "vto"),
    ("vgsth", "vto"),
    ("vf", "vfwd"),
    ("vd", "vfwd"),
    ("vdrop", "vfwd"),
    ("vforward", "vfwd"),
    ("vbr", "vrev"),
    ("rdson", "ron"),
    ("rds_on", "ron"),
    ("hfe", "bf"),
    ("beta", "bf"),
];

/// What levels are called, by the letter of their elements.
const LEVELS: [(char, f64, &str); 8] = [
    ('q', 4.0, "VBIC"),
    ('q', 6.0, "MEXTRAM"),
    ('q', 8.0, "HICUM"),
    ('q', 9.0, "VBIC"),
    ('q', 504.0, "MEXTRAM"),
    ('d', 2.0, "Fowler and Nordheim"),
    ('z', 5.0, "HFET1"),
    ('z', 6.0, "HFET2"),
];

impl<'n> Builder<'n, '_> {
    /// The model a card names, with those it extends, the nearest first.
    pub(super) fn model(
        &mut self,
        card: &ast::Element,
        name: &Name,
        scope: ScopeId,
    ) -> Option<Vec<&'n Model>> {
        let mut chain: Vec<&'n Model> = Vec::new();
        let mut wanted = name.clone();
        loop {
            let Some(model) = self.scopes.model(scope, &wanted.text) else {
                if card.nodes.iter().any(|node| node.text == wanted.text) {
                    let message = format!("`{}` names no model", card.name.text);
                    let fault = Diagnostic::error("unknown-model", wanted.span, message)
                        .label("a node of it")
                        .help("write the name of a model behind the nodes");
                    self.tell(fault);
                    return None;
                }
                let message = format!("`{}` uses unknown model `{}`", card.name.text, wanted.text);
                let fault =
                    Diagnostic::error("unknown-model", wanted.span, message).label("not defined");
                let near = self
                    .scopes
                    .near(scope, &wanted.text, |s| s.models.keys().copied());
                let near = near.or_else(|| directive(&card.name.text).map(str::to_owned));
                let help = match near {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => format!(
                        "add `.model {} …`, or include the file that defines it; `--lib DIR` names a folder of such files",
                        wanted.text
                    ),
                };
                let help = if card.name.text.starts_with('d') {
                    format!("{help}\n`--diodes ideal` takes an ideal diode in its place")
                } else {
                    help
                };
                self.scopes.findings.miss(&wanted.text, fault.help(help));
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
                None => {
                    self.idle_losses(card, name, &chain);
                    return Some(chain);
                }
            }
        }
    }

    pub(super) fn wrong_model(
        &mut self,
        card: &ast::Element,
        model: &Model,
        name: &Name,
        needed: &str,
    ) {
        let message = format!(
            "`{}` uses model `{}`, which is of type `{}`",
            card.name.text, model.name.text, model.kind.text
        );
        let fault = Diagnostic::error("wrong-model", name.span, message)
            .label("the model is of another kind");
        self.tell(fault.help(format!(
            "{} needs a model of type {needed}",
            describe(card.name.text.chars().next().unwrap_or(' '))
        )));
    }

    /// `Roff`; infinite or absent is open. `None` after a reported fault.
    #[expect(clippy::option_option, reason = "open and faulty are different")]
    pub(super) fn off_resistance(
        &mut self,
        params: &Parameters<'n>,
        scope: ScopeId,
    ) -> Option<Option<Value>> {
        let Some(roff) = params.get("roff") else {
            return Some(None);
        };
        let number = |scopes: &mut Scopes<'n>| scopes.number(roff, scope);
        let value = self.scopes.alone("", number)?;
        Some(Some(value).filter(|v| v.f64.is_finite()))
    }

    /// The level of a model, which must be one of those that are `simulated`: parameters of another one mean something else.
    pub(super) fn level(
        &mut self,
        card: &ast::Element,
        name: &Name,
        params: &Parameters<'n>,
        simulated: &[f64],
        scope: ScopeId,
    ) -> Option<f64> {
        let level = self
            .parameter(params, "level", scope)?
            .map_or(1.0, |v| v.f64);
        if simulated.contains(&level) {
            return Some(level);
        }
        let letter = card.name.text.chars().next().unwrap_or(' ');
        let called = LEVELS
            .iter()
            .find(|(l, number, _)| *l == letter && *number == level);
        let called = called.map_or(String::new(), |(_, _, name)| format!(" ({name})"));
        let known: Vec<String> = simulated.iter().map(f64::to_string).collect();
        let message = format!(
            "`{}` has model `{}` of level {level}{called}, whose equations are not simulated",
            card.name.text, name.text
        );
        self.tell(
            Diagnostic::error("unsupported-model", name.span, message)
                .label(format!("level {} is simulated", known.join(" or ")))
                .help("its parameters mean something else there: a model of the level that is simulated has to take its place"),
        );
        None
    }

    pub(super) fn unused(&mut self, what: String, name: &Name) {
        if !self
            .unused_parameters
            .iter()
            .any(|(known, _)| *known == what)
        {
            self.unused_parameters.push((what, name.span));
        }
    }

    /// Warns of a parameter that no dialect has: it would be read as if it were not there. Those that `counts` may be meant.
    pub(super) fn misspelt(
        &mut self,
        (letter, model): (char, &Name),
        params: &Parameters<'n>,
        counts: &[&str],
    ) {
        for Assign { name, .. } in &params.0 {
            let text = name.text.as_str();
            if counts.contains(&text) || is_known(letter, text) {
                continue;
            }
            let told = format!("{} {text}", model.text);
            let meant = |(slip, meant): &&(&str, &str)| *slip == text && counts.contains(meant);
            let near = MEANT
                .iter()
                .find(meant)
                .map(|(_, meant)| (*meant).to_owned());
            let like = || nearest(text, counts.iter().copied()).filter(|_| text.len() > 2);
            let near = near.or_else(like);
            if self.told_models.contains(&told) {
                continue;
            }
            self.told_models.push(told);
            let message = format!("model `{}` has no parameter `{text}`", model.text);
            let fault = Diagnostic::warning("unknown-parameter", name.span, message)
                .label("without effect");
            self.tell(match near {
                Some(near) => fault.help(format!("did you mean `{near}`?")),
                None => fault.help(format!("those that count are {}", counts.join(" "))),
            });
        }
    }

    /// Warns of a model that conducts better off than on.
    pub(super) fn exchanged(
        &mut self,
        model: &Name,
        params: &Parameters<'n>,
        ron: Value,
        roff: Option<Value>,
    ) {
        let Some(roff) = roff.filter(|roff| ron.f64 > roff.f64) else {
            return;
        };
        let written = params.get("ron").or(params.get("roff"));
        let message = format!(
            "model `{}` has Ron = {:e} above Roff = {:e}",
            model.text, ron.f64, roff.f64
        );
        self.tell(
            Diagnostic::warning("ron-above-roff", written.map(|expr| expr.span), message)
                .label("conducts better off than on")
                .help("exchange the two, unless that is meant"),
        );
    }

    /// A parameter of a model as a finite number; `Some(None)` if it is not given.
    #[expect(clippy::option_option, reason = "absent and faulty are different")]
    pub(super) fn parameter(
        &mut self,
        params: &Parameters<'n>,
        name: &str,
        scope: ScopeId,
    ) -> Option<Option<Value>> {
        match params.get(name) {
            None => Some(None),
            // All devices of a model have the same values.
            Some(expr) => {
                let value = |scopes: &mut Scopes<'n>| scopes.finite(expr, scope);
                self.scopes.alone("", value).map(Some)
            }
        }
    }
}

/// The parameters of a model and of those it extends.
pub(super) struct Parameters<'n>(Vec<&'n Assign>);

impl<'n> Parameters<'n> {
    pub(super) fn new(chain: &[&'n Model]) -> Self {
        // Within a card the last of two equal names counts.
        Self(
            chain
                .iter()
                .flat_map(|model| model.params.iter().rev())
                .collect(),
        )
    }

    pub(super) fn get(&self, name: &str) -> Option<&'n Expr> {
        self.0
            .iter()
            .find(|a| a.name.text == name)
            .and_then(|a| a.value.as_ref())
    }

    /// `ideal`, or `ideal=1`.
    pub(super) fn flag(&self, name: &str) -> bool {
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
