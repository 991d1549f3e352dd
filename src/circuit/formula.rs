//! Expressions over waveforms, as `.meas` writes them: any function of signals, time and other measurements.

use super::builder::Builder;
use super::functions::{self, CallError, truth};
use super::scope::ScopeId;
use super::{NodeId, Probe, Probed, pin, response};
use crate::diagnostic::{Diagnostic, Span};
use crate::measure::Use;
use crate::netlist::ast::{Binary, Expr, ExprKind, Name, Signal, Unary};
use crate::netlist::suggest::nearest;

/// Most parts of one formula, functions written out.
const MAX_PARTS: usize = 10_000;
/// Deepest nesting of functions.
const MAX_DEPTH: usize = 64;

/// A function of the signals, the time and the results of measurements.
#[derive(Debug, Clone, PartialEq)]
pub enum Formula {
    /// A number.
    Number(f64),
    /// The time, s; of `.meas ac` the frequency, Hz.
    Time,
    /// A signal, as an index into [`super::Circuit::measured`], of `.meas ac` into [`super::Circuit::responded`].
    Signal(usize),
    /// The result of a measurement, as an index into [`super::Circuit::measurements`], of `.meas ac` into [`super::Circuit::responses`].
    Result(usize),
    /// −x.
    Minus(Box<Formula>),
    /// 1 where x is not above one half.
    Not(Box<Formula>),
    /// An operator.
    Binary(Binary, Box<Formula>, Box<Formula>),
    /// `condition ? then : otherwise`.
    If(Box<[Formula; 3]>),
    /// A function by its name.
    Call(String, Vec<Formula>),
}

impl Formula {
    /// The value where the signals have these values; NaN outside its domain.
    #[must_use]
    pub fn value(&self, time: f64, signals: &[f64], results: &[f64]) -> f64 {
        let value = |formula: &Self| formula.value(time, signals, results);
        match self {
            Self::Number(x) => *x,
            Self::Time => time,
            Self::Signal(i) => signals.get(*i).copied().unwrap_or(f64::NAN),
            Self::Result(i) => results.get(*i).copied().unwrap_or(f64::NAN),
            Self::Minus(x) => -value(x),
            Self::Not(x) => f64::from(!truth(value(x))),
            Self::Binary(op, x, y) => functions::operation(*op, value(x), value(y)),
            Self::If(parts) => {
                let [condition, then, otherwise] = &**parts;
                value(if truth(value(condition)) {
                    then
                } else {
                    otherwise
                })
            }
            Self::Call(name, args) => {
                let args: Vec<f64> = args.iter().map(value).collect();
                functions::call(name, &args).unwrap_or(f64::NAN)
            }
        }
    }

    /// Whether it is an affine function of the signals, with numbers and results as coefficients.
    pub(super) fn is_affine(&self) -> bool {
        match self {
            Self::Number(_) | Self::Time | Self::Signal(_) | Self::Result(_) => true,
            Self::Not(_) | Self::If(_) | Self::Call(..) => false,
            Self::Minus(x) => x.is_affine(),
            Self::Binary(op, x, y) => match op {
                Binary::Add | Binary::Sub => x.is_affine() && y.is_affine(),
                Binary::Mul => x.is_affine() && y.is_affine() && (x.is_number() || y.is_number()),
                Binary::Div => x.is_affine() && y.is_number(),
                _ => false,
            },
        }
    }

    fn is_number(&self) -> bool {
        match self {
            Self::Number(_) | Self::Result(_) => true,
            Self::Time | Self::Signal(_) | Self::If(_) | Self::Call(..) => false,
            Self::Minus(x) | Self::Not(x) => x.is_number(),
            Self::Binary(_, x, y) => x.is_number() && y.is_number(),
        }
    }

    /// Whether the time is in it.
    pub(super) fn is_timed(&self) -> bool {
        match self {
            Self::Time => true,
            Self::Number(_) | Self::Signal(_) | Self::Result(_) => false,
            Self::Minus(x) | Self::Not(x) => x.is_timed(),
            Self::Binary(_, x, y) => x.is_timed() || y.is_timed(),
            Self::If(parts) => parts.iter().any(Self::is_timed),
            Self::Call(_, args) => args.iter().any(Self::is_timed),
        }
    }

    /// The measurements it needs.
    pub(super) fn needs(&self, all: &mut Vec<usize>) {
        match self {
            Self::Number(_) | Self::Time | Self::Signal(_) => {}
            Self::Result(i) => all.push(*i),
            Self::Minus(x) | Self::Not(x) => x.needs(all),
            Self::Binary(_, x, y) => {
                x.needs(all);
                y.needs(all);
            }
            Self::If(parts) => parts.iter().for_each(|part| part.needs(all)),
            Self::Call(_, args) => args.iter().for_each(|arg| arg.needs(all)),
        }
    }
}

macro_rules! operators {
    ($($of:ident, $name:ident;)*) => {$(
        impl std::ops::$of for Formula {
            type Output = Self;

            fn $name(self, other: Self) -> Self {
                self.with(Binary::$of, other)
            }
        }
    )*};
}

operators! {
    Add, add;
    Sub, sub;
    Mul, mul;
    Div, div;
}

impl std::ops::Neg for Formula {
    type Output = Self;

    fn neg(self) -> Self {
        Self::Minus(Box::new(self))
    }
}

impl Formula {
    fn with(self, op: Binary, other: Self) -> Self {
        Self::Binary(op, Box::new(self), Box::new(other))
    }

    /// This where one formula is greater than another; else nothing.
    pub(crate) fn known_where(self, greater: Self, other: Self) -> Self {
        let condition = greater.with(Binary::Greater, other);
        Self::If(Box::new([condition, self, Self::Number(f64::NAN)]))
    }
}

/// A formula being read.
pub(super) struct Reading<'r> {
    pub(super) scope: ScopeId,
    used: Use,
    /// Names of all measurements, in order.
    measurements: &'r [String],
    /// Of the response to small sines, whose signals are complex numbers over frequency.
    of_response: bool,
    parts: usize,
    depth: usize,
}

impl<'n> Builder<'n, '_> {
    /// The formula of an expression; `None` after a reported fault.
    pub(super) fn formula(
        &mut self,
        expr: &'n Expr,
        used: Use,
        scope: ScopeId,
        (measurements, of_response): (&[String], bool),
    ) -> Option<Formula> {
        let mut reading = Reading {
            scope,
            used,
            measurements,
            of_response,
            parts: 0,
            depth: 0,
        };
        self.formula_part(expr, &mut reading, &[])
    }

    /// The formula of a signal alone.
    pub(super) fn signal_formula(&mut self, signal: &'n Signal, scope: ScopeId) -> Option<Formula> {
        let reading = Reading {
            scope,
            used: Use::Trace,
            measurements: &[],
            of_response: false,
            parts: 0,
            depth: 0,
        };
        self.formula_signal(signal, &reading)
    }

    fn formula_part(
        &mut self,
        expr: &'n Expr,
        reading: &mut Reading<'_>,
        locals: &[(&'n str, Formula)],
    ) -> Option<Formula> {
        reading.parts += 1;
        if reading.parts > MAX_PARTS || reading.depth > MAX_DEPTH {
            let message = "this expression never ends, or is far too large";
            let fault = Diagnostic::error("too-deep", expr.span, message);
            self.tell(fault.label("functions go in circles"));
            return None;
        }
        let mut part = |e: &'n Expr| self.formula_part(e, reading, locals).map(Box::new);
        Some(match &expr.kind {
            ExprKind::Number(value) => Formula::Number(value.f64),
            ExprKind::Unary(Unary::Minus, x) => Formula::Minus(part(x)?),
            ExprKind::Unary(Unary::Not, x) => Formula::Not(part(x)?),
            ExprKind::Binary(op, x, y) => Formula::Binary(*op, part(x)?, part(y)?),
            ExprKind::If(parts) => {
                let [condition, then, otherwise] = &**parts;
                let parts = [part(condition)?, part(then)?, part(otherwise)?];
                Formula::If(Box::new(parts.map(|part| *part)))
            }
            ExprKind::Name(name) => match locals.iter().find(|(local, _)| local == name) {
                Some((_, formula)) => formula.clone(),
                None => self.formula_name(expr, name, reading)?,
            },
            ExprKind::Signal(signal) => self.formula_signal(signal, reading)?,
            ExprKind::Call(name, args) => self.formula_call(expr, name, args, reading, locals)?,
            ExprKind::Text(text) => {
                let message = format!("`{text}` is not a number");
                self.tell(
                    Diagnostic::error("bad-number", expr.span, message).label("expected a number"),
                );
                return None;
            }
        })
    }

    fn formula_name(
        &mut self,
        expr: &'n Expr,
        name: &'n str,
        reading: &Reading<'_>,
    ) -> Option<Formula> {
        let prefix = &self.scopes.get(reading.scope).prefix;
        let here = |own: &String| own.strip_prefix(prefix.as_str()) == Some(name) || own == name;
        if let Some(index) = reading.measurements.iter().position(here) {
            return Some(Formula::Result(index));
        }
        if self.scopes.param(reading.scope, name).is_none() {
            let axis = if reading.of_response {
                matches!(name, "frequency" | "freq")
            } else {
                name == "time"
            };
            let probe = (!axis).then(|| self.circuit.probe(name)).flatten();
            match probe {
                Some(probe) => return self.measured(probe, expr.span, reading),
                None if axis && reading.used == Use::Trace => return Some(Formula::Time),
                None => {}
            }
        }
        let value = self.scopes.number(expr, reading.scope)?;
        Some(Formula::Number(value.f64))
    }

    pub(super) fn formula_signal(
        &mut self,
        signal: &Signal,
        reading: &Reading<'_>,
    ) -> Option<Formula> {
        let what = match signal {
            Signal::Voltage(a, b) => {
                let a = self.expect_node(a, reading.scope)?;
                let b = match b {
                    Some(b) => self.expect_node(b, reading.scope)?,
                    None => NodeId::GROUND,
                };
                Probed::Voltage(a, b)
            }
            Signal::Current(name) => {
                Probed::Current(self.expect_element(name, reading.scope, "element")?)
            }
        };
        let probe = self.circuit.probe_of(what);
        self.measured(probe, signal.span(), reading)
    }

    /// A signal of a formula; refused where a number is needed.
    fn measured(&mut self, probe: Probe, span: Span, reading: &Reading<'_>) -> Option<Formula> {
        if reading.used == Use::Number {
            let axis = if reading.of_response {
                "frequency"
            } else {
                "time"
            };
            let message = format!(
                "`{}` changes with {axis}; a number is needed here",
                probe.name
            );
            let fault = Diagnostic::error("bad-meas", span, message);
            self.tell(fault.label("no number").help(
                "measure it first (`FIND … AT=…`, `AVG …`) and use the name of that measurement",
            ));
            return None;
        }
        let all = if reading.of_response {
            &mut self.circuit.responded
        } else {
            &mut self.circuit.measured
        };
        let index = all.iter().position(|own| *own == probe);
        Some(Formula::Signal(index.unwrap_or_else(|| {
            all.push(probe);
            all.len() - 1
        })))
    }

    fn formula_pin(
        &mut self,
        terms: Vec<(Probe, bool)>,
        span: Span,
        reading: &Reading<'_>,
    ) -> Option<Formula> {
        let signals = terms.into_iter().map(|(probe, positive)| {
            let signal = self.measured(probe, span, reading)?;
            Some((signal, positive))
        });
        let signals: Vec<_> = signals.collect::<Option<_>>()?;
        Some(pin::sum(signals.into_iter()))
    }

    fn formula_call(
        &mut self,
        expr: &'n Expr,
        name: &'n Name,
        args: &'n [Expr],
        reading: &mut Reading<'_>,
        locals: &[(&'n str, Formula)],
    ) -> Option<Formula> {
        let is_function = self.scopes.func(reading.scope, &name.text).is_some();
        let pin = (!is_function).then(|| self.pin_current(name, args, reading.scope));
        match pin.flatten() {
            Some(Ok(terms)) => return self.formula_pin(terms, expr.span, reading),
            Some(Err(fault)) => {
                self.tell(*fault);
                return None;
            }
            None => {}
        }
        if reading.of_response
            && !is_function
            && let Some(part) = self.part_of_signal(name, args, reading)
        {
            return part;
        }
        let mut values = Vec::with_capacity(args.len());
        for arg in args {
            values.push(self.formula_part(arg, reading, locals)?);
        }
        if let Some(func) = self.scopes.func(reading.scope, &name.text) {
            if func.args.len() == values.len() {
                let formals = func.args.iter().map(|formal| formal.text.as_str());
                let inner: Vec<_> = formals.zip(values).collect();
                reading.depth += 1;
                let body = self.formula_part(&func.body, reading, &inner);
                reading.depth -= 1;
                return body;
            }
            let message = format!("`{}` takes {} arguments", name.text, func.args.len());
            self.tell(
                Diagnostic::error("bad-call", expr.span, message)
                    .label("wrong number of arguments"),
            );
            return None;
        }
        if name.text == "par" && values.len() == 1 {
            return values.pop();
        }
        if let (true, Some(part), [_]) =
            (reading.of_response, response::part(&name.text), &values[..])
        {
            return Some(Formula::Call(part.to_owned(), values));
        }
        // Only whether there is such a function of so many arguments.
        let fault = match functions::call(&name.text, &vec![1.0; values.len()]) {
            Ok(_) | Err(CallError::Domain) => {
                return Some(Formula::Call(name.text.clone(), values));
            }
            Err(CallError::Arity(what)) => {
                let message = format!("`{}` takes {what}", name.text);
                Diagnostic::error("bad-call", expr.span, message).label("wrong number of arguments")
            }
            Err(CallError::Unknown) => {
                let message = format!("unknown function `{}`", name.text);
                let fault = Diagnostic::error("unknown-function", name.span, message)
                    .label("not a function");
                let known = functions::NAMES.into_iter();
                let parts = response::names().filter(|_| reading.of_response);
                match nearest(&name.text, known.chain(parts)) {
                    _ if !reading.of_response && response::part(&name.text).is_some() => {
                        let help = "it is of a response to small sines: `.meas ac`, which `circ ac` carries out";
                        fault.help(help)
                    }
                    _ if matches!(&*name.text, "idt" | "sdt") => {
                        fault.help("`.meas … INTEG` measures an integral")
                    }
                    Some(near) => fault.help(format!("did you mean `{near}`?")),
                    None => fault,
                }
            }
        };
        self.tell(fault);
        None
    }
}
