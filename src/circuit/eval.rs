//! Evaluation of expressions: numbers, and piecewise-linear forms in the circuit's voltages and currents.

use super::Quantity;
use super::behaviour::{TIME, Unfit, is_time};
use super::form::Form;
use super::functions::{self, CallError, truth};
use super::scope::{Param, ScopeId, Scopes};
use crate::algebra::Value;
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{Binary, Expr, ExprKind, Name, Signal, Unary};
use crate::netlist::suggest::is_unit;

/// Deepest nesting of one evaluation, through parameters and functions.
const MAX_DEPTH: usize = 128;
/// Most operations of all evaluations of a netlist.
const MAX_STEPS: usize = 20_000_000;
/// Most corners of a function of voltages and currents: each becomes a complementarity pair, and the work of a run grows
/// with their third to fourth power (200 of them: seconds).
const MAX_CORNERS: usize = 200;

/// Finds the quantity that `v(…)` or `i(…)` means; `None` where only numbers are allowed.
pub(super) type Resolve<'r, 'n> =
    Option<&'r dyn Fn(&Signal, &Scopes<'n>, ScopeId) -> Result<Form, Box<Diagnostic>>>;

impl<'n> Scopes<'n> {
    /// The number an expression stands for; `None` after a reported fault.
    pub(super) fn number(&mut self, expr: &'n Expr, scope: ScopeId) -> Option<Value> {
        self.form(expr, scope, None).map(|form| form.constant)
    }

    /// The same, where infinity makes no sense.
    pub(super) fn finite(&mut self, expr: &'n Expr, scope: ScopeId) -> Option<Value> {
        let value = self.number(expr, scope)?;
        if value.f64.is_finite() {
            return Some(value);
        }
        self.fault(
            "bad-value",
            expr,
            format!("`{expr}` is not finite"),
            "a finite number is needed here",
        )
    }

    /// `[1 2 3]`, `1,2,3` where a list is known, or one number.
    pub(super) fn numbers(&mut self, expr: &'n Expr, scope: ScopeId) -> Option<Vec<f64>> {
        let list = match &expr.kind {
            ExprKind::Call(name, list) if name.text == "[]" => list.as_slice(),
            _ => std::slice::from_ref(expr),
        };
        let numbers = list.iter().map(|expr| Some(self.finite(expr, scope)?.f64));
        numbers.collect()
    }

    /// The form an expression stands for; `None` after a reported fault.
    pub(super) fn form(
        &mut self,
        expr: &'n Expr,
        scope: ScopeId,
        resolve: Resolve<'_, 'n>,
    ) -> Option<Form> {
        self.evaluate(expr, scope, resolve, &[])
    }

    /// The form of an expression in which one name stands for a quantity.
    pub(super) fn form_of(
        &mut self,
        expr: &'n Expr,
        scope: ScopeId,
        (name, quantity): (&'n str, Quantity),
    ) -> Option<Form> {
        self.evaluate(expr, scope, None, &[(name, Form::quantity(quantity))])
    }

    fn fault<T>(
        &mut self,
        code: &'static str,
        at: &Expr,
        message: String,
        label: &str,
    ) -> Option<T> {
        self.findings
            .tell(Diagnostic::error(code, at.span, message).label(label));
        None
    }

    fn evaluate(
        &mut self,
        expr: &'n Expr,
        scope: ScopeId,
        resolve: Resolve<'_, 'n>,
        locals: &[(&'n str, Form)],
    ) -> Option<Form> {
        self.steps += 1;
        if self.depth >= MAX_DEPTH || self.steps > MAX_STEPS {
            // Every other term of the same circle would say the same.
            if !std::mem::replace(&mut self.gave_up, true) {
                let message = "this expression never ends, or is far too large".to_string();
                let label = "parameters or functions go in circles";
                self.fault::<()>("too-deep", expr, message, label);
            }
            return None;
        }
        self.depth += 1;
        let form = self.kind(expr, scope, resolve, locals);
        self.depth -= 1;
        form
    }

    fn kind(
        &mut self,
        expr: &'n Expr,
        scope: ScopeId,
        resolve: Resolve<'_, 'n>,
        locals: &[(&'n str, Form)],
    ) -> Option<Form> {
        match &expr.kind {
            ExprKind::Number(value) => Some(Form::number(*value)),
            ExprKind::Name(name) => match locals.iter().find(|(local, _)| local == name) {
                Some((_, form)) => Some(form.clone()),
                None if name == "time"
                    && resolve.is_some()
                    && self.param(scope, name).is_none() =>
                {
                    Some(Form::quantity(TIME))
                }
                None => self.named(expr, name, scope).map(Form::number),
            },
            ExprKind::Text(text) => self.fault(
                "bad-number",
                expr,
                format!("`{text}` is not a number"),
                "expected a number",
            ),
            ExprKind::Signal(signal) => match resolve.map(|resolve| resolve(signal, self, scope)) {
                Some(Ok(form)) => Some(form),
                Some(Err(fault)) => {
                    self.findings.tell(*fault);
                    None
                }
                None => {
                    let message = format!("`{signal}` is not known here");
                    let fault = Diagnostic::error("bad-expression", expr.span, message);
                    let help = "a value is one number all through a run: a current that follows its own voltage is `G1 a b TABLE {V(a,b)} = (0,0) (1,1m) (2,4m)`, \
                                one that follows others `B1 a b I=…`, and `.step` makes a run for each of several values";
                    self.findings
                        .tell(fault.label("a number is needed").help(help));
                    None
                }
            },
            ExprKind::Unary(Unary::Minus, x) => {
                Some(self.evaluate(x, scope, resolve, locals)?.negated())
            }
            ExprKind::Unary(Unary::Not, x) => {
                let x = self.evaluate(x, scope, resolve, locals)?;
                if x.is_constant() {
                    return Some(Form::number(f64::from(!truth(x.constant.f64))));
                }
                self.behaviour("inv", &[x])
                    .map_err(|why| self.unfit(expr, why))
                    .ok()
            }
            ExprKind::If(parts) => {
                let [condition, then, otherwise] = &**parts;
                self.conditional(expr, [condition, then, otherwise], scope, resolve, locals)
            }
            ExprKind::Binary(..) => self.chain_of_operators(expr, scope, resolve, locals),
            ExprKind::Call(name, args) => self.call(expr, name, args, scope, resolve, locals),
        }
    }

    /// a + b + c + …: from the left without recursion, as such sums may be long.
    fn chain_of_operators(
        &mut self,
        expr: &'n Expr,
        scope: ScopeId,
        resolve: Resolve<'_, 'n>,
        locals: &[(&'n str, Form)],
    ) -> Option<Form> {
        let mut pending = Vec::new();
        let mut first = expr;
        while let ExprKind::Binary(op, x, y) = &first.kind {
            pending.push((first, *op, &**y));
            first = x;
        }
        let mut left = self.evaluate(first, scope, resolve, locals);
        for (whole, op, y) in pending.into_iter().rev() {
            let right = self.evaluate(y, scope, resolve, locals);
            left = left
                .zip(right)
                .and_then(|(x, y)| self.binary(whole, op, x, y));
        }
        left
    }

    /// `condition ? then : otherwise`; a number as condition leaves the other branch unread.
    fn conditional(
        &mut self,
        whole: &'n Expr,
        [condition, then, otherwise]: [&'n Expr; 3],
        scope: ScopeId,
        resolve: Resolve<'_, 'n>,
        locals: &[(&'n str, Form)],
    ) -> Option<Form> {
        let condition = self.evaluate(condition, scope, resolve, locals)?;
        if condition.is_constant() {
            let taken = if truth(condition.constant.f64) {
                then
            } else {
                otherwise
            };
            return self.evaluate(taken, scope, resolve, locals);
        }
        let then = self.evaluate(then, scope, resolve, locals);
        let otherwise = self.evaluate(otherwise, scope, resolve, locals)?;
        self.choice(&condition, then?, otherwise)
            .map_err(|why| self.unfit(whole, why))
            .ok()
    }

    /// Reports why an expression cannot be simulated.
    pub(super) fn unfit(&mut self, expr: &Expr, why: Unfit) {
        let fault = match why {
            Unfit::Nonlinear => {
                let message =
                    format!("`{expr}` is not piecewise linear in the voltages and currents");
                Diagnostic::error("not-linear", expr.span, message)
                    .label("recognised, but cannot be simulated")
                    .help(
                        "sums with constant factors, max min abs limit if u uramp sgn table pwl are supported, and \
                         products of comparisons or of the sines of sources at ground; what is only looked at needs no \
                         element: `--probe 'v(a)*i(r1)'` and `.meas` take any expression",
                    )
            }
            Unfit::TooLarge => {
                let message = "this piecewise-linear function has too many pieces";
                Diagnostic::error("too-large", expr.span, message).label("far too many corners")
            }
            Unfit::Order => {
                let message = "the x values of a table must not decrease";
                Diagnostic::error("bad-table", expr.span, message).label("out of order")
            }
        };
        self.findings.tell(fault);
    }

    fn binary(&mut self, expr: &Expr, op: Binary, x: Form, y: Form) -> Option<Form> {
        match op {
            Binary::Add => return self.checked(expr, x.plus(y)),
            Binary::Sub => return self.checked(expr, x.plus(y.negated())),
            Binary::Mul if x.is_constant() => return self.checked(expr, y.scaled(x.constant)),
            Binary::Mul if y.is_constant() => return self.checked(expr, x.scaled(y.constant)),
            Binary::Div if y.is_constant() => {
                if y.constant.f64 == 0.0 {
                    let message = format!("`{expr}` divides by zero");
                    let fault = Diagnostic::error("bad-value", expr.span, message);
                    self.findings
                        .tell(fault.label("division by zero").help(match &expr.kind {
                            ExprKind::Binary(_, _, divisor) => {
                                format!("`{divisor}` is 0 here: give it another value")
                            }
                            _ => "give the divisor a value other than 0".into(),
                        }));
                    return None;
                }
                if y.constant.f64 == 1.0 {
                    return Some(x);
                }
                let quotient = |a: Value| Value::binary(a.f64 / y.constant.f64);
                let mut form = x;
                form.constant = quotient(form.constant);
                for (gain, _) in &mut form.terms {
                    *gain = quotient(*gain);
                }
                for ridge in &mut form.ridges {
                    ridge.curve = ridge.curve.clone().scaled(1.0 / y.constant.f64);
                }
                return self.checked(expr, form);
            }
            _ => {}
        }
        if !(x.is_constant() && y.is_constant()) {
            let form = self
                .operation(op, x, y)
                .map_err(|why| self.unfit(expr, why))
                .ok()?;
            return self.checked(expr, form);
        }
        let value = functions::operation(op, x.constant.f64, y.constant.f64);
        self.checked(expr, Form::number(value))
    }

    /// The form, if its numbers are finite and its corners few enough.
    pub(super) fn checked(&mut self, expr: &Expr, form: Form) -> Option<Form> {
        let of_quantities = form.ridges.iter().filter(|r| !is_time(&r.along));
        let corners = of_quantities.map(|r| r.curve.corners()).max().unwrap_or(0);
        if corners > MAX_CORNERS {
            let message = format!(
                "this piecewise-linear function has {corners} corners; at most {MAX_CORNERS} are supported"
            );
            self.findings.tell(
                Diagnostic::error("too-large", expr.span, message)
                    .label("too many corners up to here")
                    .help("every corner is an ideal device: use fewer points or less nesting"),
            );
            return None;
        }
        let sound =
            !form.constant.f64.is_nan() && form.terms.iter().all(|(gain, _)| gain.f64.is_finite());
        if sound && (form.constant.f64.is_finite() || mentions_infinity(expr)) {
            return Some(form);
        }
        self.fault(
            "bad-value",
            expr,
            format!("`{expr}` has no finite value"),
            "overflow, or outside the domain",
        )
    }

    fn call(
        &mut self,
        expr: &'n Expr,
        name: &'n Name,
        args: &'n [Expr],
        scope: ScopeId,
        resolve: Resolve<'_, 'n>,
        locals: &[(&'n str, Form)],
    ) -> Option<Form> {
        if let Some(func) = self.func(scope, &name.text) {
            if func.args.len() != args.len() {
                let message = format!(
                    "`{}` takes {} arguments, not {}",
                    name.text,
                    func.args.len(),
                    args.len()
                );
                return self.fault("bad-call", expr, message, "wrong number of arguments");
            }
            let mut inner = Vec::with_capacity(args.len());
            for (formal, arg) in func.args.iter().zip(args) {
                inner.push((
                    formal.text.as_str(),
                    self.evaluate(arg, scope, resolve, locals)?,
                ));
            }
            let place = self.beneath(expr.span);
            let outer = std::mem::replace(&mut self.place, place);
            let value = self.evaluate(&func.body, scope, resolve, &inner);
            self.place = outer;
            return value;
        }
        if let ("if", [condition, then, otherwise]) = (name.text.as_str(), args) {
            return self.conditional(expr, [condition, then, otherwise], scope, resolve, locals);
        }
        let mut values = Vec::with_capacity(args.len());
        for arg in args {
            values.push(self.evaluate(arg, scope, resolve, locals)?);
        }
        let constant = values.iter().all(Form::is_constant);
        let numbers: Vec<f64> = values.iter().map(|form| form.constant.f64).collect();
        let found = match functions::spread(&name.text, &numbers) {
            Some(_) if !constant => {
                let message = format!("`{}` is drawn once, from numbers", name.text);
                return self.fault("bad-call", expr, message, "its arguments change in time");
            }
            Some(spread) => spread.map(|spread| self.random(expr.span, spread)),
            None => functions::call(&name.text, &numbers),
        };
        match found {
            // A function of quantities: the numbers were for its name and arity only.
            Ok(_) | Err(CallError::Domain) if !constant => {
                let form = self.behaviour(&name.text, &values);
                let form = form.map_err(|why| self.unfit(expr, why)).ok()?;
                self.checked(expr, form)
            }
            Ok(value) => Some(Form::number(value)),
            Err(CallError::Arity(what)) => self.fault(
                "bad-call",
                expr,
                format!("`{}` takes {what}", name.text),
                "wrong number of arguments",
            ),
            Err(CallError::Domain) => self.fault(
                "bad-value",
                expr,
                format!("`{expr}` has no finite value"),
                "outside the domain of the function",
            ),
            Err(CallError::Unknown) => {
                let fault = Diagnostic::error(
                    "unknown-function",
                    name.span,
                    format!("unknown function `{}`", name.text),
                )
                .label("not a function");
                self.findings.tell(match functions::meant(&name.text) {
                    Some(help) => fault.help(help),
                    None => fault,
                });
                None
            }
        }
    }

    /// Whether a word is made of parameters or numbers by operators, as `duty*t` is.
    fn is_expression(&self, word: &str, scope: ScopeId) -> bool {
        let parts: Vec<&str> = word.split(['+', '-', '*', '/', '^']).collect();
        let is_known = |part: &&str| {
            self.param(scope, part).is_some() || part.starts_with(|c: char| c.is_ascii_digit())
        };
        parts.len() > 1 && parts.iter().all(|part| !part.is_empty()) && parts.iter().any(is_known)
    }

    /// The value of a parameter or constant.
    fn named(&mut self, expr: &Expr, name: &str, scope: ScopeId) -> Option<Value> {
        match self.param(scope, name) {
            Some((_, Param::Known(value))) => Some(value),
            Some((_, Param::Failed)) => None,
            Some((_, Param::Busy)) => {
                let from = self.evaluating.iter().position(|n| n == name).unwrap_or(0);
                let circle = self.evaluating[from..].join(" → ");
                self.fault(
                    "circular",
                    expr,
                    format!("circular parameters: {circle} → {name}"),
                    "comes back to itself here",
                )
            }
            Some((home, Param::Unevaluated(definition))) => {
                self.set(home, name, Param::Busy);
                self.evaluating.push(name.to_string());
                let full_name = format!("{}{name}", self.get(home).prefix);
                let value = self.alone(&full_name, |scopes| scopes.number(definition, home));
                let value = value.map(|value| match home {
                    ScopeId::ROOT => self.toleranced(value, name, None),
                    _ => value,
                });
                self.evaluating.pop();
                self.set(home, name, value.map_or(Param::Failed, Param::Known));
                value
            }
            None => match name {
                "pi" => Some(Value::binary(std::f64::consts::PI)),
                "e" => Some(Value::binary(std::f64::consts::E)),
                "true" => Some(Value::decimal(1.0, 1, 0)),
                "false" => Some(Value::decimal(0.0, 0, 0)),
                "inf" | "infinity" | "infinite" => Some(Value::binary(f64::INFINITY)),
                "temp" | "temper" => Some(self.temperature),
                "boltz" => Some(Value::decimal(1.380_649e-23, 1_380_649, -29)),
                "echarge" => Some(Value::decimal(1.602_176_634e-19, 1_602_176_634, -28)),
                "kelvin" => Some(Value::decimal(-273.15, -27315, -2)),
                "time" => self.fault(
                    "time",
                    expr,
                    "functions of `time` are not supported yet".into(),
                    "recognised only",
                ),
                _ if self.is_expression(name, scope) => {
                    let message = format!("`{name}` is an expression without braces");
                    self.findings.tell(
                        Diagnostic::error("bad-expression", expr.span, message)
                            .label("read as one name")
                            .help(format!("put an expression into braces: `{{{name}}}`")),
                    );
                    None
                }
                _ => {
                    let fault = Diagnostic::error(
                        "unknown-parameter",
                        expr.span,
                        format!("unknown parameter `{name}`"),
                    )
                    .label("not defined");
                    let near = self.near_param(scope, name);
                    self.findings.tell(match near {
                        Some(near) => fault.help(format!("did you mean `{near}`?")),
                        // A single letter is a parameter as well as a unit.
                        None if name.chars().nth(1).is_some() && is_unit(name) => fault.help(format!(
                            "a unit stands directly after its number, `1{name}`; a parameter is defined with `.param {name}=…`"
                        )),
                        None if is_unit(name) => fault.help(format!(
                            "define it with `.param {name}=…`; a prefix or unit stands directly after its number, `1{name}`"
                        )),
                        None => fault.help(format!("define it with `.param {name}=…`")),
                    });
                    None
                }
            },
        }
    }
}

/// Whether `inf` stands in the expression itself.
fn mentions_infinity(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Name(name) => name.starts_with("inf"),
        ExprKind::Unary(_, x) => mentions_infinity(x),
        ExprKind::Binary(_, x, y) => mentions_infinity(x) || mentions_infinity(y),
        _ => false,
    }
}
