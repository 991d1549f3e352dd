//! What is shown of a run: signals by name or pattern, `all`, and expressions of them.

use super::formula::Formula;
use super::functions::{self, CallError};
use super::{Circuit, Probe, is_inside, pin};
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{Binary, Expr, ExprKind, Unary};
use crate::netlist::expression;
use crate::netlist::suggest::is_of_pattern;

/// A column of results.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// As it is headed: `v(out)`, `v(a)*i(r1)`.
    pub name: String,
    /// `V`, `A`, `W`, `Ohm`, or nothing.
    pub unit: &'static str,
    /// A function of the time and the signals of [`Circuit::probes`], by index.
    pub formula: Formula,
}

impl Column {
    /// Whether it is a signal as it is.
    #[must_use]
    pub const fn is_signal(&self) -> bool {
        matches!(self.formula, Formula::Signal(_))
    }
}

type Read<T> = Result<T, Box<Diagnostic>>;

impl Circuit {
    /// Shows exactly these: what [`Self::probe`] takes, patterns of them (`v(x1.*)`, `i(d?)`), `all` (what is shown by default), and
    /// expressions in the netlist's grammar, of signals, `time`, numbers and the parameters of the top level that the circuit uses.
    ///
    /// # Errors
    /// What is wrong with one of them, and what was probably meant.
    pub fn show(&mut self, wanted: &[String]) -> Result<(), Box<Diagnostic>> {
        let mut shown = Self {
            probes: Vec::new(),
            columns: Vec::new(),
            ..self.clone()
        };
        for text in wanted {
            if text.trim().is_empty() {
                let missing = Diagnostic::error("unknown-probe", None, "'': a name is missing");
                return Err(Box::new(missing));
            }
            shown.print_text(text).map_err(|mut fault| {
                fault.message = format!("{text}: {}", fault.message);
                fault
            })?;
        }
        shown.settle_columns();
        *self = shown;
        Ok(())
    }

    /// The values that are shown where the probes have these.
    pub fn shown_row(&self, time: f64, probes: &[f64], into: &mut Vec<f64>) {
        let value = |column: &Column| column.formula.value(time, probes, &[]);
        into.extend(self.columns.iter().map(value));
    }

    /// Adds a signal to what is shown.
    pub(super) fn print(&mut self, probe: Probe) {
        let name = probe.name.clone();
        let formula = self.signal(probe);
        self.print_column(name, formula);
    }

    /// Adds what a text means.
    pub(super) fn print_text(&mut self, text: &str) -> Read<()> {
        let text: String = text.to_lowercase().split_whitespace().collect();
        if let Some(probes) = self.matching(&text) {
            if probes.is_empty() {
                return Err(Box::new(self.unknown(&text)));
            }
            probes.into_iter().for_each(|probe| self.print(probe));
            return Ok(());
        }
        if let Some(probe) = self.probe(&text) {
            self.print(probe);
            return Ok(());
        }
        let formula = match expression(&text) {
            Ok(expr) if !is_name(&expr) => {
                let formula = self.shown_formula(&expr)?;
                if pin::shown(self, &expr).is_some() {
                    self.add_column(text, "A", formula);
                    return Ok(());
                }
                formula
            }
            _ if self.is_pin(&text) => {
                let help = format!("write `ix{}` for the current into a pin", &text[1..]);
                return Err(Box::new(self.unknown(&text).help(help)));
            }
            Err(fault) if text.contains(['*', '/', '+', '-']) => return Err(fault),
            _ => return Err(Box::new(self.unknown(&text))),
        };
        self.print_column(text, formula);
        Ok(())
    }

    /// Where what is shown are the probes as they are, there is no more to say of it.
    pub(super) fn settle_columns(&mut self) {
        // One under another name, as a current into a pin, is not.
        let plain = |(k, column): (usize, &Column)| {
            column.formula == Formula::Signal(k) && column.name == self.probes[k].name
        };
        if self.columns.len() == self.probes.len() && self.columns.iter().enumerate().all(plain) {
            self.columns.clear();
        }
    }

    fn print_column(&mut self, name: String, formula: Formula) {
        let unit = self.unit(&formula);
        self.add_column(name, unit, formula);
    }

    fn add_column(&mut self, name: String, unit: &'static str, formula: Formula) {
        let column = Column {
            name,
            unit,
            formula,
        };
        if !self.columns.contains(&column) {
            self.columns.push(column);
        }
    }

    fn signal(&mut self, probe: Probe) -> Formula {
        let known = self.probes.iter().position(|own| *own == probe);
        Formula::Signal(known.unwrap_or_else(|| {
            self.probes.push(probe);
            self.probes.len() - 1
        }))
    }

    /// The signals that a pattern means; `None` for what is no pattern.
    fn matching(&self, text: &str) -> Option<Vec<Probe>> {
        let (function, pattern) = match text {
            "all" | "*" => {
                let plain = Self {
                    probes: Vec::new(),
                    ..self.clone()
                };
                return Some(plain.probes());
            }
            "allv" => ("v", "*"),
            "alli" => ("i", "*"),
            _ => match text.strip_suffix(')').and_then(|t| t.split_once('(')) {
                Some((function @ ("v" | "i"), pattern)) => (function, pattern),
                Some(_) => return None,
                None => ("v", text),
            },
        };
        if !pattern.contains(['*', '?']) || pattern.contains(['(', ')', '+', '-', '/', ',']) {
            return None;
        }
        let fits = |name: &str| !is_inside(name) && is_of_pattern(name, pattern);
        Some(match function {
            "v" => {
                let all = self.nodes.iter().skip(1).filter(|name| fits(name));
                all.filter_map(|name| self.probe(&format!("v({name})")))
                    .collect()
            }
            _ => self.currents_of(|element| fits(&element.name)).collect(),
        })
    }

    /// Whether it is `i(x1:pin)`, which is meant to be the current into a pin.
    fn is_pin(&self, text: &str) -> bool {
        let inside = text.strip_prefix("i(").and_then(|t| t.strip_suffix(')'));
        let pin = inside.and_then(|inside| self.pin_current("ix", inside, ""));
        pin.is_some_and(|found| found.is_ok())
    }

    fn unknown(&self, text: &str) -> Diagnostic {
        if self.element(text).is_some() {
            let message = format!("`{text}` is an element, and no node");
            return Diagnostic::error("unknown-probe", None, message)
                .help(format!("write `i({text})` for its current"));
        }
        let message = format!("there is no node or element `{text}`");
        Diagnostic::error("unknown-probe", None, message).help(self.what_there_is(text))
    }

    fn shown_formula(&mut self, expr: &Expr) -> Read<Formula> {
        let mut part = |expr: &Expr| self.shown_formula(expr).map(Box::new);
        Ok(match &expr.kind {
            ExprKind::Number(value) => Formula::Number(value.f64),
            ExprKind::Unary(Unary::Minus, x) => Formula::Minus(part(x)?),
            ExprKind::Unary(Unary::Not, x) => Formula::Not(part(x)?),
            ExprKind::Binary(op, x, y) => Formula::Binary(*op, part(x)?, part(y)?),
            ExprKind::If(parts) => {
                let [condition, then, otherwise] = &**parts;
                let parts = [part(condition)?, part(then)?, part(otherwise)?];
                Formula::If(Box::new(parts.map(|part| *part)))
            }
            ExprKind::Name(name) if name == "time" => Formula::Time,
            ExprKind::Name(name) => {
                if let Some((_, value)) = self.params.iter().find(|(own, _)| own == name) {
                    return Ok(Formula::Number(*value));
                }
                let probe = self.probe(name).ok_or_else(|| self.unknown(name))?;
                self.signal(probe)
            }
            ExprKind::Signal(signal) => {
                let text = signal.to_string();
                let probe = self.probe(&text).ok_or_else(|| self.unknown(&text))?;
                self.signal(probe)
            }
            ExprKind::Call(name, args) => {
                // A transistor's current as LTspice calls it.
                if let [
                    Expr {
                        kind: ExprKind::Name(own),
                        ..
                    },
                ] = &args[..]
                    && let Some(probe) = self.probe(&format!("{}({own})", name.text))
                {
                    return Ok(self.signal(probe));
                }
                if let Some(terms) = pin::shown(self, expr) {
                    let terms = terms?.into_iter();
                    let signals: Vec<_> = terms
                        .map(|(probe, positive)| (self.signal(probe), positive))
                        .collect();
                    return Ok(pin::sum(signals.into_iter()));
                }
                check_call(&name.text, args.len())?;
                let values = args.iter().map(|arg| self.shown_formula(arg));
                Formula::Call(name.text.clone(), values.collect::<Read<_>>()?)
            }
            ExprKind::Text(text) => {
                let message = format!("`{text}` is not a number");
                return Err(Box::new(Diagnostic::error("bad-number", None, message)));
            }
        })
    }

    /// The unit of a formula, as far as volts, amperes and their products and quotients go.
    fn unit(&self, formula: &Formula) -> &'static str {
        match formula {
            Formula::Signal(index) => match self
                .probes
                .get(*index)
                .map(|probe| probe.name.starts_with('i'))
            {
                Some(true) => "A",
                _ => "V",
            },
            Formula::Minus(x) => self.unit(x),
            Formula::Binary(op, x, y) => {
                let number = |formula: &Formula| matches!(formula, Formula::Number(_));
                match (op, self.unit(x), self.unit(y)) {
                    (Binary::Add | Binary::Sub, a, b) if a == b => a,
                    (Binary::Mul, "V", "A") | (Binary::Mul, "A", "V") => "W",
                    (Binary::Div, "W", "A") => "V",
                    (Binary::Div, "W", "V") => "A",
                    (Binary::Div, "V", "A") => "Ohm",
                    (Binary::Mul | Binary::Div, a, _) if number(y) => a,
                    (Binary::Mul, _, b) if number(x) => b,
                    _ => "",
                }
            }
            Formula::Call(name, args) => match (name.as_str(), &args[..]) {
                ("abs", [x]) => self.unit(x),
                ("max" | "min", [x, y]) if self.unit(x) == self.unit(y) => self.unit(x),
                _ => "",
            },
            _ => "",
        }
    }
}

fn is_name(expr: &Expr) -> bool {
    matches!(expr.kind, ExprKind::Name(_) | ExprKind::Signal(_))
}

/// That there is such a function of so many arguments.
fn check_call(name: &str, arguments: usize) -> Read<()> {
    let fault = match functions::call(name, &vec![1.0; arguments]) {
        Ok(_) | Err(CallError::Domain) => return Ok(()),
        Err(CallError::Arity(what)) => {
            Diagnostic::error("bad-call", None, format!("`{name}` takes {what}"))
        }
        Err(CallError::Unknown) => {
            let message = format!("unknown function `{name}`");
            let fault = Diagnostic::error("unknown-function", None, message);
            match functions::meant(name) {
                Some(help) => fault.help(help),
                None => fault,
            }
        }
    };
    Err(Box::new(fault))
}
