//! Derivatives of formulas to signals, time and results of measurements, by the rules of calculus from the outside in.

use super::formula::Formula;
use super::functions::{self, truth};
use crate::netlist::ast::Binary;
use crate::settings::tolerances::periodic::ARGUMENT_STEP;

/// The derivatives of a formula at one place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Slopes {
    /// 1/s.
    pub(crate) time: f64,
    /// By signal.
    pub(crate) signals: Vec<f64>,
    /// By measurement.
    pub(crate) results: Vec<f64>,
}

impl Formula {
    /// The derivatives where the signals have these values: at a corner those of one side.
    pub(crate) fn slopes(&self, time: f64, signals: &[f64], results: &[f64]) -> Slopes {
        let mut into = Slopes {
            time: 0.0,
            signals: vec![0.0; signals.len()],
            results: vec![0.0; results.len()],
        };
        self.add_slopes((time, signals, results), 1.0, &mut into);
        into
    }

    /// Adds the derivatives times a factor.
    fn add_slopes(&self, at: (f64, &[f64], &[f64]), factor: f64, into: &mut Slopes) {
        if factor == 0.0 {
            return;
        }
        let value = |formula: &Self| formula.value(at.0, at.1, at.2);
        match self {
            Self::Number(_) | Self::Not(_) => {}
            Self::Time => into.time += factor,
            Self::Signal(i) => into.signals[*i] += factor,
            Self::Result(i) => into.results[*i] += factor,
            Self::Minus(x) => x.add_slopes(at, -factor, into),
            Self::Binary(op, x, y) => {
                let (a, b) = (value(x), value(y));
                let (of_x, of_y) = match op {
                    Binary::Add => (1.0, 1.0),
                    Binary::Sub => (1.0, -1.0),
                    Binary::Mul => (b, a),
                    Binary::Div => (1.0 / b, -a / (b * b)),
                    Binary::Rem => (1.0, -(a / b).trunc()),
                    Binary::Pow => powers(a, b),
                    _ => (0.0, 0.0),
                };
                x.add_slopes(at, factor * of_x, into);
                y.add_slopes(at, factor * of_y, into);
            }
            Self::If(parts) => {
                let [condition, then, otherwise] = &**parts;
                let taken = if truth(value(condition)) {
                    then
                } else {
                    otherwise
                };
                taken.add_slopes(at, factor, into);
            }
            Self::Call(name, args) => {
                let values: Vec<f64> = args.iter().map(value).collect();
                for (k, arg) in args.iter().enumerate() {
                    arg.add_slopes(at, factor * of_call(name, &values, k), into);
                }
            }
        }
    }
}

/// The derivatives of x^y; a constant power has no logarithm.
fn powers(x: f64, y: f64) -> (f64, f64) {
    let of_y = if x > 0.0 { x.powf(y) * x.ln() } else { 0.0 };
    (if y == 0.0 { 0.0 } else { y * x.powf(y - 1.0) }, of_y)
}

/// The derivative of a function to argument k: in closed form, or by a difference where that is nothing but choices and straight lines.
fn of_call(name: &str, args: &[f64], k: usize) -> f64 {
    match (name, args) {
        ("abs", [x]) => x.signum(),
        ("sqrt", [x]) => 0.5 / x.sqrt(),
        ("exp", [x]) => x.exp(),
        ("ln" | "log", [x]) => 1.0 / x,
        ("log10", [x]) => std::f64::consts::LOG10_E / x,
        ("db", [x]) => 20.0 * std::f64::consts::LOG10_E / x,
        ("sin", [x]) => x.cos(),
        ("cos", [x]) => -x.sin(),
        ("tan", [x]) => 1.0 + x.tan().powi(2),
        ("asin" | "arcsin", [x]) => 1.0 / (1.0 - x * x).sqrt(),
        ("acos" | "arccos", [x]) => -1.0 / (1.0 - x * x).sqrt(),
        ("atan" | "arctan", [x]) => 1.0 / (1.0 + x * x),
        ("sinh", [x]) => x.cosh(),
        ("cosh", [x]) => x.sinh(),
        ("tanh", [x]) => 1.0 - x.tanh().powi(2),
        ("asinh", [x]) => 1.0 / (x * x + 1.0).sqrt(),
        ("acosh", [x]) => 1.0 / (x * x - 1.0).sqrt(),
        ("atanh", [x]) => 1.0 / (1.0 - x * x),
        ("atan2", [y, x]) => [x, &-y][k] / (x * x + y * y),
        ("hypot", [x, y]) => args[k] / x.hypot(*y),
        ("pow", [x, y]) => <[f64; 2]>::from(powers(*x, *y))[k],
        ("pwr", [x, y]) => {
            let (of_x, of_y) = powers(x.abs(), *y);
            [of_x, x.signum() * of_y][k]
        }
        // Steps have no slope beside their edges.
        (
            "int" | "floor" | "ceil" | "round" | "nint" | "sgn" | "u" | "ustep" | "buf" | "inv",
            _,
        ) => 0.0,
        _ => {
            let step = ARGUMENT_STEP * args[k].abs().max(f64::MIN_POSITIVE);
            let at = |x: f64| {
                let mut moved = args.to_vec();
                moved[k] = x;
                functions::call(name, &moved).unwrap_or(f64::NAN)
            };
            let (low, high) = (args[k] - step, args[k] + step);
            (at(high) - at(low)) / (high - low)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signal(k: usize) -> Box<Formula> {
        Box::new(Formula::Signal(k))
    }

    /// Differences of values agree with the rules, function by function.
    #[test]
    fn slopes_are_those_of_the_values() {
        let call = |name: &str, n: usize| {
            Formula::Call(name.into(), (0..n).map(Formula::Signal).collect())
        };
        let one = [
            "abs", "sqrt", "exp", "ln", "log10", "db", "sin", "cos", "tan", "asin", "acos", "atan",
            "sinh", "cosh", "tanh", "asinh", "atanh", "uramp", "u", "floor",
        ];
        let two = ["atan2", "hypot", "pow", "pwr", "pwrs", "min", "max", "sign"];
        let mut all: Vec<Formula> = one.iter().map(|name| call(name, 1)).collect();
        all.extend(two.iter().map(|name| call(name, 2)));
        for op in [
            Binary::Add,
            Binary::Sub,
            Binary::Mul,
            Binary::Div,
            Binary::Rem,
            Binary::Pow,
            Binary::Less,
        ] {
            all.push(Formula::Binary(op, signal(0), signal(1)));
        }
        let parts = [
            Formula::Binary(Binary::Less, signal(0), signal(1)),
            Formula::Minus(signal(0)),
            Formula::Binary(Binary::Mul, Box::new(Formula::Time), signal(1)),
        ];
        all.push(Formula::If(Box::new(parts)));
        for formula in all {
            for point in [[0.7, 0.3], [0.4, 0.9]] {
                let found = formula.slopes(2.0, &point, &[]);
                let at = |k: usize, h: f64| {
                    let mut moved = point;
                    moved[k] += h;
                    formula.value(2.0, &moved, &[])
                };
                for k in 0..2 {
                    let slope = (at(k, 1e-6) - at(k, -1e-6)) / 2e-6;
                    let own = found.signals[k];
                    assert!((own - slope).abs() < 1e-8, "{formula:?}: {own} {slope}");
                }
                let later = formula.value(2.0 + 1e-6, &point, &[]);
                let sooner = formula.value(2.0 - 1e-6, &point, &[]);
                assert!((found.time - (later - sooner) / 2e-6).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn results_have_slopes() {
        let product = Formula::Binary(
            Binary::Mul,
            Box::new(Formula::Result(1)),
            Box::new(Formula::Result(0)),
        );
        assert_eq!(product.slopes(0.0, &[], &[3.0, 5.0]).results, [5.0, 3.0]);
    }
}
