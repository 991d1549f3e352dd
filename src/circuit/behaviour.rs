//! Expressions in voltages, currents and time: piecewise linear in one sum of quantities at a time.
//!
//! max(a, b) = b + max(0, a − b), min(a, b) = a − max(0, a − b), |a| = 2 max(0, a) − a, (a > b) = step(a − b), and every table
//! is a function of one sum; sums of such functions along one direction are one function again. Where a function's argument
//! has several directions, its parts become voltages of auxiliary nodes, and the argument is affine in them.

use super::form::{Form, Ridge, direction, parallel};
use super::model::ONE;
use super::piecewise::Piecewise;
use super::scope::Scopes;
use super::source::Wave;
use super::{NodeId, Quantity};
use crate::algebra::Value;
use crate::law::Curve;
use crate::netlist::ast::Binary;

/// Stands for the time in forms, until [`super::place`] gives it a node.
pub(super) const TIME: Quantity = Quantity::Voltage(NodeId(u32::MAX));

/// The voltage of auxiliary `index` in forms, until [`super::place`] gives it a node.
pub(super) const fn auxiliary(index: usize) -> Quantity {
    Quantity::Voltage(NodeId(u32::MAX - 1 - index as u32))
}

/// A voltage source that an expression needs.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Auxiliary {
    /// A monotone function of a sum of quantities.
    Curve(Vec<(Value, Quantity)>, Box<Curve>),
    /// A function of time.
    Wave(Wave),
}

/// Why an expression is nothing that can be simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unfit {
    /// Not piecewise linear.
    Nonlinear,
    /// Too many pieces.
    TooLarge,
    /// A table whose x run backwards.
    Order,
}

impl Scopes<'_> {
    /// A function of quantities whose arguments are not all numbers.
    pub(super) fn behaviour(&mut self, name: &str, args: &[Form]) -> Result<Form, Unfit> {
        let ramp = Piecewise::ramp;
        match (name, args) {
            ("abs", [x]) => {
                let twice = self.apply(&ramp().scaled(2.0), x)?;
                Ok(twice.plus(x.clone().negated()))
            }
            ("uramp", [x]) => self.apply(&ramp(), x),
            ("u" | "ustep", [x]) => self.apply(&Piecewise::step(0.0), x),
            ("buf", [x]) => self.truth(x),
            ("inv", [x]) => Ok(Form::number(ONE).plus(self.truth(x)?.negated())),
            ("sgn" | "sign", [x]) => {
                let sign = [(0.0, -1.0), (0.0, 1.0)];
                self.apply(&Piecewise::through(&sign, 0.0, 0.0), x)
            }
            ("max", [first, rest @ ..]) => rest
                .iter()
                .try_fold(first.clone(), |a, b| self.larger(a, b)),
            ("min", [first, rest @ ..]) => rest
                .iter()
                .try_fold(first.clone(), |a, b| self.smaller(a, b)),
            ("limit", [x, a, b]) => self.limit(x, a, b),
            ("table", [x, points @ ..]) => {
                let points = pairs(points)?;
                self.apply(&Piecewise::through(&points, 0.0, 0.0), x)
            }
            ("pwl", [x, points @ ..]) => {
                // ngspice goes on with the slopes of the outermost segments.
                let points = pairs(points)?;
                let slope = |a: (f64, f64), b: (f64, f64)| (b.1 - a.1) / (b.0 - a.0);
                let outer = match points[..] {
                    [] | [_] => (0.0, 0.0),
                    [a, b, ..] => {
                        let end = points.len();
                        (slope(a, b), slope(points[end - 2], points[end - 1]))
                    }
                };
                if !(outer.0.is_finite() && outer.1.is_finite()) {
                    return Err(Unfit::Order);
                }
                self.apply(&Piecewise::through(&points, outer.0, outer.1), x)
            }
            ("sin" | "cos" | "exp", [x]) => {
                let (factor, wave) = self.of_time(name, x).ok_or(Unfit::Nonlinear)?;
                Ok(self.demand(Auxiliary::Wave(wave)).scaled(factor.into()))
            }
            _ => Err(Unfit::Nonlinear),
        }
    }

    /// An operation on quantities that is no sum, difference or multiple.
    pub(super) fn operation(&mut self, op: Binary, x: Form, y: Form) -> Result<Form, Unfit> {
        let one = Form::number(ONE);
        match op {
            Binary::Greater => self.greater(x, y),
            Binary::Less => self.greater(y, x),
            Binary::GreaterEqual => Ok(one.plus(self.greater(y, x)?.negated())),
            Binary::LessEqual => Ok(one.plus(self.greater(x, y)?.negated())),
            Binary::And => {
                let both = self.truth(&x)?.plus(self.truth(&y)?);
                self.apply(&Piecewise::ramp(), &both.plus(one.negated()))
            }
            Binary::Or => {
                let either = self.truth(&x)?.plus(self.truth(&y)?);
                self.smaller(either, &one)
            }
            Binary::Mul => self.product(x, y),
            _ => Err(Unfit::Nonlinear),
        }
    }

    /// `condition ? then : otherwise` = otherwise + truth(condition)·(then − otherwise).
    pub(super) fn choice(
        &mut self,
        condition: &Form,
        then: Form,
        otherwise: Form,
    ) -> Result<Form, Unfit> {
        let truth = self.truth(condition)?;
        let gain = then.plus(otherwise.clone().negated());
        Ok(otherwise.plus(self.product(truth, gain)?))
    }

    /// A table given as x and y values.
    pub(super) fn table(&mut self, x: &Form, points: &[(f64, f64)]) -> Result<Form, Unfit> {
        ordered(points)?;
        self.apply(&Piecewise::through(points, 0.0, 0.0), x)
    }

    /// 1 where the form is above one half, else 0.
    fn truth(&mut self, x: &Form) -> Result<Form, Unfit> {
        self.apply(&Piecewise::step(0.5), x)
    }

    fn greater(&mut self, x: Form, y: Form) -> Result<Form, Unfit> {
        self.apply(&Piecewise::step(0.0), &x.plus(y.negated()))
    }

    fn larger(&mut self, x: Form, y: &Form) -> Result<Form, Unfit> {
        let excess = x.plus(y.clone().negated());
        Ok(y.clone().plus(self.apply(&Piecewise::ramp(), &excess)?))
    }

    fn smaller(&mut self, x: Form, y: &Form) -> Result<Form, Unfit> {
        let excess = x.clone().plus(y.clone().negated());
        Ok(x.plus(self.apply(&Piecewise::ramp(), &excess)?.negated()))
    }

    /// The middle one of x, a and b; bounds on rails count as numbers.
    fn limit(&mut self, x: &Form, a: &Form, b: &Form) -> Result<Form, Unfit> {
        let (a, b) = (self.on_rails(a), self.on_rails(b));
        let width = b.clone().plus(a.clone().negated());
        let (low, high) = match width.is_constant() {
            true if width.constant.f64 >= 0.0 => (a, b),
            true => (b, a),
            false => (self.smaller(a.clone(), &b)?, self.larger(a, &b)?),
        };
        if low.is_constant() && high.is_constant() {
            let (low, high) = (low.constant.f64, high.constant.f64);
            let clamp = match (low.is_finite(), high.is_finite()) {
                (true, true) => Piecewise::through(&[(low, low), (high, high)], 0.0, 0.0),
                (true, false) => Piecewise::through(&[(low, low)], 0.0, 1.0),
                (false, true) => Piecewise::through(&[(high, high)], 1.0, 0.0),
                (false, false) => return Ok(x.clone()),
            };
            return self.apply(&clamp, x);
        }
        let raised = self.larger(x.clone(), &low)?;
        self.smaller(raised, &high)
    }

    /// f(form).
    fn apply(&mut self, f: &Piecewise, form: &Form) -> Result<Form, Unfit> {
        if form.is_constant() {
            return Ok(Form::number(f.value(form.constant.f64)));
        }
        let Some(Ridge { along, curve }) = self.along_one(form) else {
            return Err(Unfit::Nonlinear);
        };
        let curve = curve.then(f).ok_or(Unfit::TooLarge)?;
        Ok(Form::number(0.0).plus_ridge(Ridge { along, curve }))
    }

    fn product(&mut self, x: Form, y: Form) -> Result<Form, Unfit> {
        for (factor, other) in [(&x, &y), (&y, &x)] {
            let factor = self.on_rails(factor);
            if factor.is_constant() {
                return Ok(other.clone().scaled(factor.constant));
            }
        }
        if let (Some(a), Some(b)) = (x.one_dimensional(), y.one_dimensional())
            && parallel(&a.along, &b.along)
            && let Some(curve) = a.curve.times(&b.curve)
        {
            return Ok(Form::number(0.0).plus_ridge(Ridge {
                along: a.along,
                curve,
            }));
        }
        for (factor, sum) in [(&x, &y), (&y, &x)] {
            if sum.terms.is_empty() && sum.ridges.len() > 1 {
                let first = factor.clone().scaled(sum.constant);
                return sum.ridges.iter().try_fold(first, |all, ridge| {
                    let part = Form::number(0.0).plus_ridge(ridge.clone());
                    Ok(all.plus(self.product(factor.clone(), part)?))
                });
            }
        }
        self.product_of_levels(&x, &y)
            .or_else(|_| self.product_of_tones(&x, &y))
    }

    /// The product of two forms that take two values each: with s, t ∈ {0, 1} for which one, st = max(0, s + t − 1).
    fn product_of_levels(&mut self, x: &Form, y: &Form) -> Result<Form, Unfit> {
        let levels = self.levels(x).zip(self.levels(y));
        let ((x0, x1), (y0, y1)) = levels.ok_or(Unfit::Nonlinear)?;
        let s = self.apply(&Piecewise::step(0.5 * (x0 + x1)), x)?;
        let t = self.apply(&Piecewise::step(0.5 * (y0 + y1)), y)?;
        let excess = s.clone().plus(t.clone()).plus(Form::number(-1.0));
        let both = self.apply(&Piecewise::ramp(), &excess)?;
        let (dx, dy) = (x1 - x0, y1 - y0);
        Ok(Form::number(x0 * y0)
            .plus(s.scaled((dx * y0).into()))
            .plus(t.scaled((x0 * dy).into()))
            .plus(both.scaled((dx * dy).into())))
    }

    /// The smaller and the larger of the two values that a form takes: a comparison, or a function of comparators' outputs.
    fn levels(&self, form: &Form) -> Option<(f64, f64)> {
        /// Comparators in one sum.
        const MOST: usize = 8;
        let Ridge { along, curve } = form.one_dimensional()?;
        let mut values = match curve.steps() {
            Some(values) => values,
            None if along.len() <= MOST => {
                let mut sums = vec![0.0];
                for (gain, quantity) in &along {
                    let (low, high) = self.outputs(*quantity)?;
                    let with = |sum: &f64| [sum + gain.f64 * low, sum + gain.f64 * high];
                    sums = sums.iter().flat_map(with).collect();
                }
                sums.into_iter().map(|u| curve.value(u)).collect()
            }
            None => return None,
        };
        values.sort_by(f64::total_cmp);
        values.dedup();
        match values[..] {
            [low, high] => Some((low, high)),
            _ => None,
        }
    }

    /// The two outputs of an auxiliary comparator.
    fn outputs(&self, quantity: Quantity) -> Option<(f64, f64)> {
        let is_it = |index: &usize| auxiliary(*index) == quantity;
        let index = (0..self.auxiliaries.len()).find(is_it)?;
        let Auxiliary::Curve(_, curve) = &self.auxiliaries[index] else {
            return None;
        };
        curve.step().map(|(_, low, high)| (low, high))
    }

    /// The form as a function of one sum: as it stands, with rails as numbers, or with auxiliary voltages.
    fn along_one(&mut self, form: &Form) -> Option<Ridge> {
        form.one_dimensional()
            .or_else(|| self.on_rails(form).one_dimensional())
            .or_else(|| self.affine(form.clone()).one_dimensional())
    }

    /// The form with the voltages that DC sources hold as numbers, if that leaves a number or one direction only.
    fn on_rails(&mut self, form: &Form) -> Form {
        let mut fixed = Form {
            terms: Vec::new(),
            ..form.clone()
        };
        for &(gain, quantity) in &form.terms {
            let term = Form::quantity(quantity).scaled(gain);
            let held = match quantity {
                Quantity::Voltage(node) => self.rails.get(&node),
                Quantity::Current(_) => None,
            };
            fixed = fixed.plus(match held {
                Some(&volts) => Form::number(gain.f64 * volts),
                None => term,
            });
        }
        if fixed.is_constant() || fixed.one_dimensional().is_some() {
            let nodes = form
                .terms
                .iter()
                .filter_map(|(_, quantity)| match quantity {
                    Quantity::Voltage(node) if self.rails.contains_key(node) => Some(*node),
                    _ => None,
                });
            self.rails_read.extend(nodes);
            fixed
        } else {
            form.clone()
        }
    }

    /// The form with its ridges replaced by auxiliary voltages.
    pub(super) fn affine(&mut self, form: Form) -> Form {
        let mut affine = Form {
            ridges: Vec::new(),
            ..form
        };
        for Ridge { along, curve } in form.ridges {
            if is_time(&along) {
                let points = curve.points(0.0, self.tstop);
                let wave = Wave::Pwl {
                    points,
                    repeat: None,
                    delay: 0.0,
                };
                affine = affine.plus(self.demand(Auxiliary::Wave(wave)));
                continue;
            }
            let (linear, parts) = curve.monotone();
            let sum = Form {
                terms: along.clone(),
                ..Form::number(0.0)
            };
            if linear != 0.0 {
                affine = affine.plus(sum.scaled(linear.into()));
            }
            for part in parts {
                let voltage = self.demand(Auxiliary::Curve(along.clone(), Box::new(part.curve)));
                affine = affine.plus(voltage.scaled(part.sign.into()));
            }
        }
        affine
    }

    /// The voltage of an auxiliary source, the same one for the same demand.
    pub(super) fn demand(&mut self, wanted: Auxiliary) -> Form {
        let known = self.auxiliaries.iter().position(|a| *a == wanted);
        let index = known.unwrap_or_else(|| {
            self.auxiliaries.push(wanted);
            self.auxiliaries.len() - 1
        });
        Form::quantity(auxiliary(index))
    }

    /// sin, cos or a decaying exp of an affine function of time, as a factor and a waveform.
    fn of_time(&self, name: &str, x: &Form) -> Option<(f64, Wave)> {
        let (along, rate) = direction(&x.terms).filter(|_| x.ridges.is_empty())?;
        let constant = x.constant.f64;
        if !is_time(&along) {
            return None;
        }
        if name == "exp" {
            return (rate < 0.0).then_some((
                constant.exp(),
                Wave::Exp {
                    v1: 1.0,
                    v2: 0.0,
                    rise_delay: 0.0,
                    rise_tau: -1.0 / rate,
                    // Not before the run is over.
                    fall_delay: 2.0 * self.tstop,
                    fall_tau: -1.0 / rate,
                },
            ));
        }
        // sin(−x) = −sin(x), cos(−x) = cos(x), cos(x) = sin(x + 90°).
        let (sign, quarter) = match (name, rate < 0.0) {
            ("cos", _) => (1.0, 90.0),
            (_, true) => (-1.0, 0.0),
            (_, false) => (1.0, 0.0),
        };
        Some((
            sign,
            Wave::Sin {
                offset: 0.0,
                amplitude: 1.0,
                frequency: rate.abs() / std::f64::consts::TAU,
                delay: 0.0,
                damping: 0.0,
                phase: (constant * rate.signum()).to_degrees() + quarter,
                cycles: None,
            },
        ))
    }
}

pub(super) fn is_time(along: &[(Value, Quantity)]) -> bool {
    matches!(along, [(_, quantity)] if *quantity == TIME)
}

/// x y x y … as points.
fn pairs(values: &[Form]) -> Result<Vec<(f64, f64)>, Unfit> {
    if values.len() < 2 || values.len() % 2 == 1 || !values.iter().all(Form::is_constant) {
        return Err(Unfit::Nonlinear);
    }
    let points: Vec<(f64, f64)> = values
        .chunks_exact(2)
        .map(|pair| (pair[0].constant.f64, pair[1].constant.f64))
        .collect();
    ordered(&points)?;
    Ok(points)
}

fn ordered(points: &[(f64, f64)]) -> Result<(), Unfit> {
    if points.windows(2).all(|w| w[0].0 <= w[1].0) {
        Ok(())
    } else {
        Err(Unfit::Order)
    }
}
