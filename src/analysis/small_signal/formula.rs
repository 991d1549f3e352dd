//! Formulas over the response: complex numbers at every frequency.
//!
//! `mag`, `ph` (degrees, without jumps from one frequency to the next), `re`, `im`, `db` and `conj` are functions of such a number. Where a real number is
//! needed, as by `MAX` or at a level, one counts by its magnitude.

use nalgebra::Complex;

use super::ratio::unwrapped;
use crate::circuit::{Binary, Formula};

/// What formulas are evaluated over.
pub(super) struct Band<'a> {
    /// Hz.
    pub(super) frequency: &'a [f64],
    /// By signal its values.
    pub(super) signals: &'a [Vec<Complex<f64>>],
    /// The results of measurements.
    pub(super) results: &'a [f64],
}

impl Band<'_> {
    /// The values of a formula as real numbers.
    pub(super) fn real(&self, formula: &Formula) -> Vec<f64> {
        let values = self.values(formula);
        let is_complex = is_complex(formula);
        let real = |value: Complex<f64>| if is_complex { value.norm() } else { value.re };
        values.into_iter().map(real).collect()
    }

    fn values(&self, formula: &Formula) -> Vec<Complex<f64>> {
        let number = |x: f64| vec![Complex::from(x); self.frequency.len()];
        match formula {
            Formula::Number(x) => number(*x),
            Formula::Result(i) => number(self.results.get(*i).copied().unwrap_or(f64::NAN)),
            Formula::Time => self.frequency.iter().map(|f| Complex::from(*f)).collect(),
            Formula::Signal(i) => match self.signals.get(*i) {
                Some(values) => values.clone(),
                None => number(f64::NAN),
            },
            Formula::Minus(x) => self.values(x).into_iter().map(|x| -x).collect(),
            Formula::Binary(op, x, y) => {
                let pairs = self.values(x).into_iter().zip(self.values(y));
                pairs.map(|(x, y)| operation(*op, x, y)).collect()
            }
            Formula::Call(name, args) => self.call(name, args),
            Formula::Not(x) => {
                self.reals(&[&**x], &|x| Formula::Not(Box::new(Formula::Number(x[0]))))
            }
            Formula::If(parts) => {
                let [condition, then, otherwise] = &**parts;
                let conditions = self.real(condition).into_iter();
                let both = self.values(then).into_iter().zip(self.values(otherwise));
                let chosen = conditions.zip(both);
                // Truth in SPICE: above one half.
                chosen
                    .map(|(c, (then, otherwise))| if c > 0.5 { then } else { otherwise })
                    .collect()
            }
        }
    }

    fn call(&self, name: &str, args: &[Formula]) -> Vec<Complex<f64>> {
        let one = |f: &dyn Fn(Complex<f64>) -> Complex<f64>| {
            let values = args.first().map_or_else(Vec::new, |x| self.values(x));
            values.into_iter().map(f).collect()
        };
        match name {
            "mag" | "abs" => one(&|z| z.norm().into()),
            "db" => one(&|z| (20.0 * z.norm().log10()).into()),
            "re" => one(&|z| z.re.into()),
            "im" => one(&|z| z.im.into()),
            "conj" => one(&|z| z.conj()),
            "ph" => {
                let values = args.first().map_or_else(Vec::new, |x| self.values(x));
                let phases = unwrapped(values.into_iter()).into_iter();
                phases.map(Complex::from).collect()
            }
            "sqrt" => one(&|z| z.sqrt()),
            "exp" => one(&|z| z.exp()),
            _ => {
                let call = |x: &[f64]| {
                    let args = x.iter().map(|x| Formula::Number(*x)).collect();
                    Formula::Call(name.to_owned(), args)
                };
                self.reals(&args.iter().collect::<Vec<_>>(), &call)
            }
        }
    }

    /// A function of real numbers, written as a formula of them.
    fn reals(&self, args: &[&Formula], of: &dyn Fn(&[f64]) -> Formula) -> Vec<Complex<f64>> {
        let columns: Vec<Vec<f64>> = args.iter().map(|arg| self.real(arg)).collect();
        let row = |k: usize| columns.iter().map(|column| column[k]).collect::<Vec<f64>>();
        let rows = 0..self.frequency.len();
        rows.map(|k| of(&row(k)).value(f64::NAN, &[], &[]).into())
            .collect()
    }
}

/// Whether the values of a formula are complex numbers, and not real ones.
fn is_complex(formula: &Formula) -> bool {
    match formula {
        Formula::Signal(_) => true,
        Formula::Number(_) | Formula::Time | Formula::Result(_) | Formula::Not(_) => false,
        Formula::Minus(x) => is_complex(x),
        Formula::Binary(op, x, y) => is_arithmetic(*op) && (is_complex(x) || is_complex(y)),
        Formula::If(parts) => parts[1..].iter().any(is_complex),
        Formula::Call(name, args) => {
            matches!(name.as_str(), "conj" | "sqrt" | "exp") && args.iter().any(is_complex)
        }
    }
}

const fn is_arithmetic(op: Binary) -> bool {
    matches!(
        op,
        Binary::Add | Binary::Sub | Binary::Mul | Binary::Div | Binary::Pow
    )
}

fn operation(op: Binary, x: Complex<f64>, y: Complex<f64>) -> Complex<f64> {
    match op {
        Binary::Add => x + y,
        Binary::Sub => x - y,
        Binary::Mul => x * y,
        Binary::Div => x / y,
        Binary::Pow if x.im == 0.0 && y.im == 0.0 => x.re.powf(y.re).into(),
        Binary::Pow if y.im == 0.0 && y.re.fract() == 0.0 => x.powf(y.re),
        Binary::Pow => x.powc(y),
        _ => {
            let [x, y] = [x, y].map(|z| {
                let real = if z.im == 0.0 { z.re } else { z.norm() };
                Box::new(Formula::Number(real))
            });
            Formula::Binary(op, x, y).value(f64::NAN, &[], &[]).into()
        }
    }
}
