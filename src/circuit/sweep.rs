//! `.step` and `.dc`: quantities and the values they take.

use super::builder::Builder;
use super::scope::{Param, ScopeId};
use crate::algebra::Value;
use crate::diagnostic::{Diagnostic, Span};
use crate::netlist::ast::{self, Alter, ExprKind, Name, Points, Target};
use crate::netlist::suggest::spacing_meant;
use crate::settings::tolerances::times::WHOLE;

/// Most runs or operating points of all sweeps together.
pub(super) const MOST: usize = 100_000;

/// A quantity and the values it takes.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// What changes.
    pub what: Swept,
    /// At least one value.
    pub values: Vec<f64>,
}

/// What a sweep changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Swept {
    /// A parameter of the top level.
    Param(String),
    /// The DC value of a source, V or A, or a resistance, Ω.
    Element(String),
    /// The temperature, °C.
    Temperature,
}

impl Swept {
    /// As a column is called: `rload`, `v1`, `temp`.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Param(name) | Self::Element(name) => name,
            Self::Temperature => "temp",
        }
    }
}

/// All combinations of the values of sweeps, the first sweep innermost.
#[must_use]
pub fn combinations(sweeps: &[Sweep]) -> Vec<Vec<f64>> {
    let mut all = vec![Vec::new()];
    for sweep in sweeps.iter().rev() {
        all = all
            .iter()
            .flat_map(|outer: &Vec<f64>| {
                let with = |value: &f64| [&[*value], outer.as_slice()].concat();
                sweep.values.iter().map(with)
            })
            .collect();
    }
    all
}

impl<'n> Builder<'n, '_> {
    /// The value of an element of the top level with what a sweep, an `alter` and its tolerance make of it.
    pub(super) fn settled(
        &self,
        name: &str,
        value: Option<Value>,
        tolerance: Option<f64>,
    ) -> Option<Value> {
        let value = self.swept(name).or(value)?;
        Some(self.scopes.toleranced(value, name, tolerance))
    }

    /// The value that a sweep, else an `alter`, gives to an element.
    fn swept(&self, name: &str) -> Option<Value> {
        let values = &self.options.values;
        let altered = || self.altered.iter().rev().find(|(own, _)| own.text == name);
        values
            .iter()
            .find(|(own, _)| own == name)
            .map(|(_, value)| Value::binary(*value))
            .or_else(|| altered().map(|(_, value)| *value))
    }

    /// Takes in an `alter`, where it sets the value of a source or a passive element.
    pub(super) fn alter(&mut self, alter: &'n Alter) {
        let letter = alter.name.text.chars().next().unwrap_or(' ');
        let known: &[&str] = match letter {
            'v' | 'i' => &["dc"],
            'r' => &["resistance", "r"],
            'c' => &["capacitance", "c"],
            'l' => &["inductance", "l"],
            _ => &[],
        };
        let quantity = alter.quantity.as_deref().or(known.first().copied());
        if quantity.is_some_and(|q| known.contains(&q)) {
            self.altered.push((&alter.name, alter.value));
        } else {
            self.not_altered(&alter.name);
        }
    }

    /// Altered elements exist.
    pub(super) fn check_altered(&mut self) {
        let (known, unknown): (Vec<_>, Vec<_>) = std::mem::take(&mut self.altered)
            .into_iter()
            .partition(|(name, _)| self.root_elements.contains(name.text.as_str()));
        self.altered = known;
        for (name, _) in unknown {
            self.not_altered(name);
        }
    }

    fn not_altered(&mut self, name: &Name) {
        let message = format!("`alter` of `{}` is not carried out", name.text);
        self.tell(
            Diagnostic::warning("control-left-out", name.span, message)
                .label("the result is without it")
                .help("`alter` sets the DC value of a source, or a resistance, capacitance or inductance of the top level"),
        );
    }

    /// Takes in the sweeps of `.step`; a parameter that nothing else defines has its first value.
    pub(super) fn steps(&mut self) {
        let cards = std::mem::take(&mut self.step_cards);
        for card in cards {
            let Some(sweep) = self.sweep(card) else {
                continue;
            };
            if (self.circuit.steps.iter()).any(|other| other.what == sweep.what) {
                let message = format!("`{}` is stepped by another card already", sweep.what.name());
                let fault = Diagnostic::error("bad-sweep", card.span, message);
                let help = "take one of the cards out, or write all values into one: `list 1 2 5`";
                self.tell(fault.label("the same once more").help(help));
                continue;
            }
            if let Swept::Param(name) = &sweep.what {
                if self
                    .options
                    .params
                    .iter()
                    .any(|(own, _)| own.eq_ignore_ascii_case(name))
                {
                    // The value from outside is the one that counts.
                    self.declare(&card.target);
                    continue;
                }
                if self.scopes.param(ScopeId::ROOT, name).is_none()
                    && let Some(first) = card.points.first()
                {
                    self.scopes
                        .set(ScopeId::ROOT, name, Param::Unevaluated(first));
                }
                self.declare(&card.target);
                self.stepped.extend(card.target.name());
            }
            self.circuit.steps.push(sweep);
        }
        self.limit_sweeps();
    }

    /// Takes in `.dc`; of several the last counts.
    pub(super) fn dc_sweeps(&mut self) {
        let Some(cards) = self.dc_cards.take() else {
            return;
        };
        let sweeps: Option<Vec<Sweep>> = cards.iter().map(|card| self.sweep(card)).collect();
        self.circuit.dc = sweeps.unwrap_or_default();
        if let (Some(_), Some(first)) = (self.circuit.tran, cards.first()) {
            let done = match self.pss_card {
                Some(_) if self.trans.is_empty() => "`.pss`",
                _ => "`.tran`",
            };
            let message = format!("`.dc` is left out, as there is a {done}");
            let note = Diagnostic::note("skipped", first.span, message);
            self.tell(note.label("carried out by `circ sim` where it stands alone"));
        }
        self.limit_sweeps();
    }

    fn declare(&mut self, target: &'n Target) {
        if let Some(name) = target.name() {
            let root = self.scopes.get_mut(ScopeId::ROOT);
            root.declared.insert(&name.text);
        }
    }

    /// A run for each value of a parameter that nothing asked for is the same run many times.
    pub(super) fn warn_of_idle_steps(&mut self) {
        for name in std::mem::take(&mut self.stepped) {
            let param = self.scopes.param(ScopeId::ROOT, &name.text);
            if !matches!(param, Some((_, Param::Unevaluated(_)))) {
                continue;
            }
            let message = format!("`.step` of `{}` changes nothing", name.text);
            self.tell(
                Diagnostic::warning("idle-step", name.span, message)
                    .label("no value that the runs need depends on it")
                    .help(format!(
                        "write `{{{}}}` where its value is meant",
                        name.text
                    )),
            );
        }
    }

    fn limit_sweeps(&mut self) {
        let too_many = |sweeps: &[Sweep]| {
            sweeps
                .iter()
                .try_fold(1_usize, |all, sweep| all.checked_mul(sweep.values.len()))
                .is_none_or(|all| all > MOST)
        };
        if too_many(&self.circuit.steps) || too_many(&self.circuit.dc) {
            let message = format!("the sweeps have more than {MOST} combinations");
            self.tell(Diagnostic::error("too-large", None, message));
        }
    }

    fn sweep(&mut self, card: &'n ast::Sweep) -> Option<Sweep> {
        if let Points::Linear([first, ..]) = &card.points
            && let ExprKind::Name(name) = &first.kind
            && self.scopes.param(ScopeId::ROOT, name).is_none()
            && let Some(meant) = spacing_meant(first)
        {
            let message = format!("`{name}` is neither a value nor a spacing of values");
            let fault = Diagnostic::error("bad-sweep", first.span, message).label("not known here");
            self.tell(fault.help(format!("did you mean `{meant}`?")));
            return None;
        }
        let values = self.sweep_values(&card.points, card.span)?;
        let what = match &card.target {
            Target::Temperature(_) => Swept::Temperature,
            Target::Param(name) => Swept::Param(name.text.clone()),
            Target::Element(name) if self.root_elements.contains(name.text.as_str()) => {
                if !name.text.starts_with(['v', 'i', 'r']) {
                    let message = format!("`{}` has no value that a sweep can set", name.text);
                    let fault = Diagnostic::error("bad-sweep", name.span, message);
                    self.tell(
                        fault
                            .label("neither a source nor a resistor")
                            .help("write its value as `{name}` and sweep that parameter"),
                    );
                    return None;
                }
                Swept::Element(name.text.clone())
            }
            Target::Model(model, parameter) => {
                let message = format!("there is no model `{}` to sweep", model.text);
                let fault = Diagnostic::error("unknown-model", model.span, message);
                let help = format!(
                    "write the value of `{}` as `{{name}}` in the model and sweep that parameter",
                    parameter.text
                );
                self.tell(fault.label("not a model of the top level").help(help));
                return None;
            }
            // LTspice lets a parameter stand without `param`.
            Target::Element(name) => {
                if self.scopes.param(ScopeId::ROOT, &name.text).is_none() {
                    let message =
                        format!("there is neither a source nor a parameter `{}`", name.text);
                    let fault = Diagnostic::error("unknown-element", name.span, message);
                    self.tell(fault.label("nothing to sweep"));
                    return None;
                }
                Swept::Param(name.text.clone())
            }
        };
        Some(Sweep { what, values })
    }

    fn sweep_values(&mut self, points: &'n Points, span: Span) -> Option<Vec<f64>> {
        let mut number = |e| self.scopes.finite(e, ScopeId::ROOT).map(|v| v.f64);
        let (fault, label) = match points {
            Points::List(list) => return list.iter().map(number).collect(),
            Points::Linear([start, stop, increment]) => {
                let (start, stop, increment) = (number(start)?, number(stop)?, number(increment)?);
                // LTspice and ngspice both go from the first to the last value, whatever the sign.
                let count = ((stop - start) / increment).abs() + WHOLE;
                if start == stop {
                    return Some(vec![start]);
                } else if increment == 0.0 {
                    ("the increment of the sweep is zero", "never ends")
                } else if count >= MOST as f64 {
                    ("the sweep has too many values", "far too many values")
                } else {
                    let increment = increment.abs().copysign(stop - start);
                    let value = |k: usize| start + k as f64 * increment;
                    return Some((0..=count as usize).map(value).collect());
                }
            }
            Points::Logarithmic { base, range } => {
                let [start, stop, per] = range;
                let (start, stop, per) = (number(start)?, number(stop)?, number(per)?);
                match logarithmic(start, stop, (f64::from(*base), per)) {
                    Ok(values) => return Some(values),
                    Err(fault) => fault,
                }
            }
        };
        self.tell(Diagnostic::error("bad-sweep", span, fault).label(label));
        None
    }
}

/// So many values per factor of `base` from the first on, the last included if it is one of them; or what is wrong, and its label.
pub(super) fn logarithmic(
    start: f64,
    stop: f64,
    (base, per): (f64, f64),
) -> Result<Vec<f64>, (&'static str, &'static str)> {
    let count = (stop / start).log(base).abs() * per + WHOLE;
    if !(start * stop > 0.0 && per >= 1.0) {
        let what =
            "a logarithmic sweep needs values of one sign, and at least one per decade or octave";
        Err((what, "no such sweep"))
    } else if count >= MOST as f64 {
        Err(("the sweep has too many values", "far too many values"))
    } else {
        let sign = (stop.abs() - start.abs()).signum();
        let value = |k: usize| start * base.powf(sign * k as f64 / per);
        Ok((0..=count as usize).map(value).collect())
    }
}
