//! The functions and operators of expressions, on numbers.

use super::draw::Spread;
use crate::netlist::ast::Binary;
use crate::netlist::suggest::nearest;

/// Why a call has no value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CallError {
    /// No such function.
    Unknown,
    /// It takes so many arguments, in words.
    Arity(&'static str),
    /// The arguments are outside its domain.
    Domain,
}

/// Truth in SPICE: above one half.
pub(super) const fn truth(x: f64) -> bool {
    x > 0.5
}

/// All function names, for "did you mean".
pub(super) const NAMES: [&str; 51] = [
    "abs", "acos", "acosh", "agauss", "arccos", "arcsin", "arctan", "asin", "asinh", "atan",
    "atan2", "atanh", "aunif", "buf", "ceil", "cos", "cosh", "db", "exp", "flat", "floor", "gauss",
    "hypot", "if", "int", "inv", "limit", "ln", "log", "log10", "max", "mc", "min", "nint", "pow",
    "pwl", "pwr", "pwrs", "round", "sgn", "sign", "sin", "sinh", "sqrt", "table", "tan", "tanh",
    "u", "unif", "uramp", "ustep",
];

/// What to do about a name that is no function: the one that was probably meant, or how a circuit has what it asks for.
pub(super) fn meant(name: &str) -> Option<String> {
    match name {
        "idt" | "sdt" | "idtmod" => Some(
            "integrals are no expressions: `B1 0 x I=…` into `C1 x 0 1` has the integral as `V(x)`".into(),
        ),
        "ddt" => Some(
            "derivatives are no expressions: `E1 x 0 VALUE={…}` across `C1 x 0 1` has the derivative as `I(C1)`".into(),
        ),
        "rms" | "avg" | "mean" | "pp" | "integ" => Some(format!(
            "it is of a whole run: `.meas tran NAME {}` measures it, `--table` shows means, rms and extrema of every element",
            if name == "mean" { "AVG V(out)".into() } else { format!("{} V(out)", name.to_uppercase()) }
        )),
        _ => nearest(name, NAMES).map(|near| format!("did you mean `{near}`?")),
    }
}

/// The distribution, mean and width of a random function: those of LTspice and ngspice, `gauss` of both.
pub(super) fn spread(name: &str, args: &[f64]) -> Option<Result<(Spread, f64, f64), CallError>> {
    use Spread::{Extreme, Normal, Uniform};
    let spread = match (name, args) {
        ("mc" | "unif", [x, relative]) => (Uniform, *x, x * relative),
        ("aunif", [x, width]) => (Uniform, *x, *width),
        ("flat", [width]) => (Uniform, 0.0, *width),
        ("gauss", [sigma]) => (Normal, 0.0, *sigma),
        ("gauss", [x, relative, sigmas]) => (Normal, *x, x * relative / sigmas),
        ("agauss", [x, width, sigmas]) => (Normal, *x, width / sigmas),
        ("limit", [x, width]) => (Extreme, *x, *width),
        ("mc" | "unif" | "aunif", _) => return Some(Err(CallError::Arity("two arguments"))),
        ("flat", _) => return Some(Err(CallError::Arity("one argument"))),
        ("gauss", _) => return Some(Err(CallError::Arity("one or three arguments"))),
        ("agauss", _) => return Some(Err(CallError::Arity("three arguments"))),
        _ => return None,
    };
    let finite = spread.1.is_finite() && spread.2.is_finite();
    Some(finite.then_some(spread).ok_or(CallError::Domain))
}

/// The value of a function; `log` is natural, as in ngspice and LTspice.
pub(super) fn call(name: &str, args: &[f64]) -> Result<f64, CallError> {
    let value = match (name, args) {
        ("abs", [x]) => x.abs(),
        ("sqrt", [x]) => x.sqrt(),
        ("exp", [x]) => x.exp(),
        ("ln" | "log", [x]) => x.ln(),
        ("log10", [x]) => x.log10(),
        ("db", [x]) => 20.0 * x.abs().log10(),
        ("sin", [x]) => x.sin(),
        ("cos", [x]) => x.cos(),
        ("tan", [x]) => x.tan(),
        ("asin" | "arcsin", [x]) => x.asin(),
        ("acos" | "arccos", [x]) => x.acos(),
        ("atan" | "arctan", [x]) => x.atan(),
        ("sinh", [x]) => x.sinh(),
        ("cosh", [x]) => x.cosh(),
        ("tanh", [x]) => x.tanh(),
        ("asinh", [x]) => x.asinh(),
        ("acosh", [x]) => x.acosh(),
        ("atanh", [x]) => x.atanh(),
        ("int", [x]) => x.trunc(),
        ("floor", [x]) => x.floor(),
        ("ceil", [x]) => x.ceil(),
        ("round" | "nint", [x]) => x.round(),
        ("sgn", [x]) => sign(*x),
        ("sign", [x]) => sign(*x),
        ("sign", [x, y]) => x.abs() * if *y < 0.0 { -1.0 } else { 1.0 },
        ("u" | "ustep", [x]) => f64::from(*x > 0.0),
        ("uramp", [x]) => x.max(0.0),
        ("buf", [x]) => f64::from(truth(*x)),
        ("inv", [x]) => f64::from(!truth(*x)),
        ("atan2", [y, x]) => y.atan2(*x),
        ("hypot", [x, y]) => x.hypot(*y),
        ("pow", [x, y]) => x.powf(*y),
        ("pwr" | "pwrs", [x, y]) => sign(*x) * x.abs().powf(*y),
        ("limit", [x, a, b]) => x.clamp(a.min(*b), a.max(*b)),
        ("if", [condition, a, b]) => {
            if truth(*condition) {
                *a
            } else {
                *b
            }
        }
        ("min", [first, rest @ ..]) => rest.iter().fold(*first, |a, b| a.min(*b)),
        ("max", [first, rest @ ..]) => rest.iter().fold(*first, |a, b| a.max(*b)),
        ("table", [x, points @ ..]) if points.len() >= 2 && points.len() % 2 == 0 => {
            table(*x, points)
        }
        ("pwl", [x, points @ ..]) if points.len() >= 2 && points.len() % 2 == 0 => {
            extrapolated(*x, points)
        }
        ("atan2" | "hypot" | "pow" | "pwr" | "pwrs", _) => {
            return Err(CallError::Arity("two arguments"));
        }
        ("limit", _) => return Err(CallError::Arity("two or three arguments")),
        ("if", _) => return Err(CallError::Arity("three arguments")),
        ("min" | "max", _) => return Err(CallError::Arity("at least one argument")),
        ("table" | "pwl", _) => return Err(CallError::Arity("x and pairs of numbers")),
        (name, _) if NAMES.contains(&name) => return Err(CallError::Arity("one argument")),
        _ => return Err(CallError::Unknown),
    };
    if value.is_finite() {
        Ok(value)
    } else {
        Err(CallError::Domain)
    }
}

/// The value of an operator.
pub(super) fn operation(op: Binary, x: f64, y: f64) -> f64 {
    match op {
        Binary::Add => x + y,
        Binary::Sub => x - y,
        Binary::Mul => x * y,
        Binary::Div => x / y,
        Binary::Rem => x % y,
        Binary::Pow => x.powf(y),
        Binary::Less => f64::from(x < y),
        Binary::LessEqual => f64::from(x <= y),
        Binary::Greater => f64::from(x > y),
        Binary::GreaterEqual => f64::from(x >= y),
        Binary::Equal => f64::from(x == y),
        Binary::NotEqual => f64::from(x != y),
        Binary::And => f64::from(truth(x) && truth(y)),
        Binary::Or => f64::from(truth(x) || truth(y)),
    }
}

fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// Linear between the points (x, y), constant outside.
fn table(x: f64, points: &[f64]) -> f64 {
    let mut before = (points[0], points[1]);
    if x <= before.0 {
        return before.1;
    }
    for pair in points.chunks_exact(2).skip(1) {
        if x <= pair[0] {
            return before.1 + (pair[1] - before.1) * ((x - before.0) / (pair[0] - before.0));
        }
        before = (pair[0], pair[1]);
    }
    before.1
}

/// The same, going on with the outermost slopes as ngspice's `pwl` does.
fn extrapolated(x: f64, points: &[f64]) -> f64 {
    let n = points.len();
    let along = |p: &[f64]| p[1] + (p[3] - p[1]) * ((x - p[0]) / (p[2] - p[0]));
    if n < 4 {
        points[1]
    } else if x < points[0] {
        along(&points[..4])
    } else if x > points[n - 2] {
        along(&points[n - 4..])
    } else {
        table(x, points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values() {
        for (name, args, expected) in [
            ("limit", vec![5.0, 2.0, -2.0], 2.0),
            ("table", vec![1.5, 0.0, 0.0, 1.0, 10.0, 2.0, 20.0], 15.0),
            ("table", vec![9.0, 0.0, 0.0, 1.0, 10.0], 10.0),
            ("sgn", vec![0.0], 0.0),
            ("pwr", vec![-2.0, 2.0], -4.0),
            ("int", vec![-1.5], -1.0),
            ("max", vec![1.0, 3.0, 2.0], 3.0),
            ("if", vec![1.0, 2.0, 3.0], 2.0),
            ("log", vec![std::f64::consts::E], 1.0),
            ("u", vec![0.0], 0.0),
        ] {
            assert_eq!(call(name, &args), Ok(expected), "{name}{args:?}");
        }
        assert_eq!(call("sqrt", &[-1.0]), Err(CallError::Domain));
        assert_eq!(call("ln", &[0.0]), Err(CallError::Domain));
        assert_eq!(call("sqrt", &[]), Err(CallError::Arity("one argument")));
        assert_eq!(call("nosuch", &[1.0]), Err(CallError::Unknown));
    }

    #[test]
    fn every_name_is_a_function() {
        for name in NAMES {
            assert_ne!(call(name, &[]), Err(CallError::Unknown), "{name}");
        }
    }
}
