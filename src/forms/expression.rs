//! Functions of state and time written as netlist expressions, with their exact derivatives (forward mode).

use std::rc::Rc;

use nalgebra::{DMatrix, DVector};

use super::FormError;
use crate::netlist::ast::{Binary, Expr, ExprKind, Unary};
use crate::netlist::expression;

/// A value and its gradient in the state.
struct Dual {
    value: f64,
    slope: DVector<f64>,
}

impl Dual {
    fn constant(value: f64, n: usize) -> Self {
        Self {
            value,
            slope: DVector::zeros(n),
        }
    }

    /// f(self), where `slope` is f' there.
    fn through(self, value: f64, slope: f64) -> Self {
        Self {
            value,
            slope: self.slope * slope,
        }
    }

    /// f(self, other) with both partial derivatives.
    fn with(self, other: &Self, value: f64, by_self: f64, by_other: f64) -> Self {
        Self {
            value,
            slope: self.slope * by_self + &other.slope * by_other,
        }
    }
}

/// A vector of expressions in named states and `time`.
#[derive(Debug, Clone)]
pub struct Expressions {
    rows: Rc<[Expr]>,
    names: Rc<[String]>,
}

impl Expressions {
    /// Reads one expression per row; `field` is the name of the list in messages.
    ///
    /// # Errors
    /// [`FormError::File`] for what cannot be read, unknown names and functions.
    pub fn read(field: &str, texts: &[String], names: &Rc<[String]>) -> Result<Self, FormError> {
        let read = |text: &String| {
            let bad = |reason: String| FormError::File(format!("`{field}`: {text}: {reason}"));
            let row = expression(text).map_err(|diagnostic| bad(diagnostic.message))?;
            // At a point of no special kind, so that only names and functions are judged.
            let at = DVector::from_fn(names.len(), |i, _| 0.3 + 0.1 * i as f64);
            dual(&row, names, 0.7, &at).map_err(bad)?;
            Ok(row)
        };
        let rows: Result<Vec<Expr>, FormError> = texts.iter().map(read).collect();
        Ok(Self {
            rows: rows?.into(),
            names: names.clone(),
        })
    }

    /// Number of expressions.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    fn duals(&self, t: f64, x: &DVector<f64>) -> impl Iterator<Item = Dual> {
        let undefined = |_| Dual::constant(f64::NAN, x.len());
        self.rows
            .iter()
            .map(move |row| dual(row, &self.names, t, x).unwrap_or_else(undefined))
    }

    /// The values; NaN outside of a function's domain.
    #[must_use]
    pub fn value(&self, t: f64, x: &DVector<f64>) -> DVector<f64> {
        DVector::from_iterator(self.len(), self.duals(t, x).map(|d| d.value))
    }

    /// The Jacobian in x.
    #[must_use]
    pub fn jacobian(&self, t: f64, x: &DVector<f64>) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(self.len(), x.len());
        for (k, row) in self.duals(t, x).enumerate() {
            jacobian.set_row(k, &row.slope.transpose());
        }
        jacobian
    }
}

/// Truth in SPICE: above one half.
fn truth(x: &Dual) -> bool {
    x.value > 0.5
}

fn dual(expr: &Expr, names: &[String], t: f64, x: &DVector<f64>) -> Result<Dual, String> {
    let n = x.len();
    let at = |e: &Expr| dual(e, names, t, x);
    let flag = |yes: bool| Dual::constant(f64::from(u8::from(yes)), n);
    Ok(match &expr.kind {
        ExprKind::Number(value) => Dual::constant(value.f64, n),
        ExprKind::Name(name) => match names.iter().position(|known| known == name) {
            Some(k) => Dual {
                value: x[k],
                slope: DVector::from_fn(n, |i, _| if i == k { 1.0 } else { 0.0 }),
            },
            None => match name.as_str() {
                "time" => Dual::constant(t, n),
                "pi" => Dual::constant(std::f64::consts::PI, n),
                _ => return Err(format!("unknown name `{name}`")),
            },
        },
        ExprKind::Text(_) | ExprKind::Signal(_) => {
            return Err("only states, `time` and `pi` have values here".into());
        }
        ExprKind::Unary(Unary::Minus, a) => {
            let a = at(a)?;
            let value = -a.value;
            a.through(value, -1.0)
        }
        ExprKind::Unary(Unary::Not, a) => flag(!truth(&at(a)?)),
        ExprKind::If(parts) => {
            let [condition, then, otherwise] = &**parts;
            at(if truth(&at(condition)?) {
                then
            } else {
                otherwise
            })?
        }
        ExprKind::Binary(op, a, b) => {
            let (a, b) = (at(a)?, at(b)?);
            let (u, v) = (a.value, b.value);
            match op {
                Binary::Add => a.with(&b, u + v, 1.0, 1.0),
                Binary::Sub => a.with(&b, u - v, 1.0, -1.0),
                Binary::Mul => a.with(&b, u * v, v, u),
                Binary::Div => a.with(&b, u / v, 1.0 / v, -u / (v * v)),
                Binary::Rem => a.with(&b, u % v, 1.0, -(u / v).trunc()),
                Binary::Pow => power(a, &b),
                Binary::Less => flag(u < v),
                Binary::LessEqual => flag(u <= v),
                Binary::Greater => flag(u > v),
                Binary::GreaterEqual => flag(u >= v),
                Binary::Equal => flag(u == v),
                Binary::NotEqual => flag(u != v),
                Binary::And => flag(truth(&a) && truth(&b)),
                Binary::Or => flag(truth(&a) || truth(&b)),
            }
        }
        ExprKind::Call(name, args) => {
            let args: Vec<Dual> = args.iter().map(at).collect::<Result<_, _>>()?;
            call(&name.text.to_lowercase(), args)?
        }
    })
}

/// uᵛ; a constant exponent asks for no logarithm.
fn power(a: Dual, b: &Dual) -> Dual {
    let (u, v) = (a.value, b.value);
    let value = u.powf(v);
    let by_exponent = if b.slope.iter().all(|s| *s == 0.0) {
        0.0
    } else {
        value * u.ln()
    };
    let by_base = if v == 0.0 { 0.0 } else { v * u.powf(v - 1.0) };
    a.with(b, value, by_base, by_exponent)
}

fn call(name: &str, args: Vec<Dual>) -> Result<Dual, String> {
    let count = args.len();
    let mut args = args.into_iter();
    let (first, second) = (args.next(), args.next());
    let arity = || Err(format!("`{name}` does not take {count} arguments"));
    let Some(a) = first else { return arity() };
    let x = a.value;
    if let Some(b) = second {
        let y = b.value;
        return match (name, count) {
            ("pow", 2) => Ok(power(a, &b)),
            ("min", 2) => Ok(if x <= y { a } else { b }),
            ("max", 2) => Ok(if x >= y { a } else { b }),
            ("hypot", 2) => {
                let r = x.hypot(y);
                Ok(a.with(&b, r, x / r, y / r))
            }
            ("atan2", 2) => {
                let square = x * x + y * y;
                Ok(a.with(&b, x.atan2(y), y / square, -x / square))
            }
            _ => arity(),
        };
    }
    let sign = if x == 0.0 { 0.0 } else { x.signum() };
    let (value, slope) = match name {
        "abs" => (x.abs(), sign),
        "sqrt" => (x.sqrt(), 0.5 / x.sqrt()),
        "exp" => (x.exp(), x.exp()),
        "ln" | "log" => (x.ln(), 1.0 / x),
        "log10" => (x.log10(), 1.0 / (x * std::f64::consts::LN_10)),
        "sin" => (x.sin(), x.cos()),
        "cos" => (x.cos(), -x.sin()),
        "tan" => (x.tan(), 1.0 + x.tan().powi(2)),
        "asin" => (x.asin(), 1.0 / (1.0 - x * x).sqrt()),
        "acos" => (x.acos(), -1.0 / (1.0 - x * x).sqrt()),
        "atan" => (x.atan(), 1.0 / (1.0 + x * x)),
        "sinh" => (x.sinh(), x.cosh()),
        "cosh" => (x.cosh(), x.sinh()),
        "tanh" => (x.tanh(), 1.0 - x.tanh().powi(2)),
        "asinh" => (x.asinh(), 1.0 / (1.0 + x * x).sqrt()),
        "sgn" | "sign" => (sign, 0.0),
        "u" | "ustep" => (f64::from(u8::from(x > 0.0)), 0.0),
        "uramp" => (x.max(0.0), if x > 0.0 { 1.0 } else { 0.0 }),
        "min" | "max" => (x, 1.0),
        _ => return Err(format!("`{name}` is no function with a derivative here")),
    };
    Ok(a.through(value, slope))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::dvector;

    fn read(text: &str) -> Result<Expressions, FormError> {
        let names: Rc<[String]> = ["x".to_string(), "y".to_string()].into();
        Expressions::read("f", &[text.to_string()], &names)
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let at = dvector![0.4, 0.7];
        for text in [
            "x*y - 2/x + y^3",
            "x^y",
            "-sin(x)*cos(y) + tan(x*y)",
            "exp(x) + ln(y) + log10(y) + sqrt(x)",
            "asin(x) + acos(y) + atan(x) + sinh(x) + cosh(y) + tanh(x) + asinh(y)",
            "abs(x - y) + min(x, y) + max(2*x, y) + uramp(y - x) + u(x)",
            "x > y ? x^2 : y^2*x",
            "hypot(x, y) + atan2(x, y) + pow(y, x)",
            "5*x % 1.5",
        ] {
            let f = read(text).unwrap();
            let exact = f.jacobian(0.0, &at);
            for k in 0..2 {
                let h = 1e-6;
                let mut moved = at.clone();
                moved[k] += h;
                let above = f.value(0.0, &moved)[0];
                moved[k] -= 2.0 * h;
                let below = f.value(0.0, &moved)[0];
                let difference = (above - below) / (2.0 * h);
                assert!(
                    (difference - exact[(0, k)]).abs() < 1e-8,
                    "{text}: {difference} {exact}"
                );
            }
        }
    }

    #[test]
    fn mistakes_are_named() {
        let message = |text: &str| read(text).unwrap_err().to_string();
        assert!(message("x + z").contains("unknown name `z`"));
        assert!(message("gamma(x)").contains("`gamma`"));
        assert!(message("x +").contains("missing"));
        assert!(message("x y").contains("continue"));
        assert!(message("sin(x, y)").contains("2 arguments"));
        assert!(message("v(x)").contains("only states"));
        assert!(read("sqrt(x)").unwrap().value(0.0, &dvector![-1.0, 0.0])[0].is_nan());
    }
}
