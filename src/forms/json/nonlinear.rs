//! The nonlinear forms as files: functions are lists of expressions in the states and `time`, with exact derivatives.
//!
//! ```text
//! {"schema":"circ-form/1","form":"nonlinear_complementarity","states":[{"name":"x1","unit":"V"}],
//!  "f":["-x1 - x1^3"],"B":[[1]],"c":["x1"],"g":["-sin(2*pi*time)"],"hessian":[["1"]],
//!  "x0":[1],"tran":{"tstep":0.01,"tstop":2}}
//! ```
//!
//! | form | data | system |
//! |---|---|---|
//! | `nonlinear_complementarity` | f, B, c, g, hessian | x' = f(x, t) + Bζ, 0 ≤ ζ ⟂ c(x) + g(t) ≥ 0 (34), c' = BᵀV'' (35) |
//! | `projected`, `gradient_complementarity` | f, h | x' = −f(x) + h'(x)ᵀλ, 0 ≤ λ ⟂ h(x) ≥ 0 |
//! | `unilateral_inclusion`, `complementarity_dynamics` | f, g, h | −x' = f(x) + g(t) + h'(x)ᵀλ, 0 ≥ h(x) ⟂ λ ≥ 0 |
//!
//! They are stepped by Moreau's scheme ([`step`](crate::forms::step())), the step halved until the result stands still.

use std::rc::Rc;

use nalgebra::{DMatrix, DVector};
use serde_json::Value;

use super::SCHEMA;
use super::fields::Fields;
use crate::forms::expression::Expressions;
use crate::forms::nonlinear::NonlinearComplementarity;
use crate::forms::projected::{Map, ProjectedSystem};
use crate::forms::unilateral::Unilateral;
use crate::forms::{Complementarity, FormError, Trajectory, integrate};
use crate::settings::tolerances::times::WHOLE;

/// Halvings of the step after which the error that is left is reported as it is.
const HALVINGS: usize = 12;

/// A nonlinear form with its start and span.
#[derive(Debug, Clone)]
pub struct NonlinearFile {
    /// The title.
    pub title: String,
    /// Names of the states.
    pub states: Vec<String>,
    /// Their units, `A` where the file says so, else `V`.
    pub units: Vec<&'static str>,
    /// Distance of the output times, s.
    pub tstep: f64,
    /// End, s.
    pub tstop: f64,
    x0: DVector<f64>,
    system: System,
}

#[derive(Debug, Clone)]
enum System {
    Complementarity(NonlinearComplementarity),
    Projected(ProjectedSystem),
    Unilateral(Unilateral),
}

/// A result on the output grid.
#[derive(Debug, Clone, PartialEq)]
pub struct NonlinearRun {
    /// Output times with x, λ and y of the step that ended there.
    pub trajectory: Trajectory,
    /// Steps between output times.
    pub steps_per_row: usize,
    /// Steps of the last run.
    pub steps: usize,
    /// Largest change of x by the last halving of the step, relative to the largest |x|: the error of a method of order one.
    pub error: Option<f64>,
}

/// Reads a nonlinear form; `None` for every other file, linear forms included.
///
/// # Errors
/// [`FormError::File`] for what cannot be read, the failed hypothesis at the start otherwise.
pub fn read(text: &str) -> Result<Option<NonlinearFile>, FormError> {
    let Ok(Value::Object(fields)) = serde_json::from_str(text) else {
        return Ok(None);
    };
    let file = Fields(&fields);
    if fields.get("schema").and_then(Value::as_str) != Some(SCHEMA) || !fields.contains_key("f") {
        return Ok(None);
    }
    let texts = |name: &'static str| -> Result<Option<Vec<String>>, FormError> {
        let Some(value) = fields.get(name) else {
            return Ok(None);
        };
        serde_json::from_value(value.clone())
            .map(Some)
            .map_err(|_| FormError::File(format!("`{name}` is no list of expressions")))
    };
    let needed = |name: &'static str| {
        texts(name)?.ok_or_else(|| FormError::File(format!("`{name}` is missing")))
    };
    let f = needed("f")?;
    let n = f.len();
    let states: Vec<String> = match fields.get("states").and_then(Value::as_array) {
        Some(list) if list.len() == n => list
            .iter()
            .map(|s| s.get("name").and_then(Value::as_str).map(str::to_lowercase))
            .collect::<Option<_>>()
            .ok_or_else(|| FormError::File("`states` is no list of names".into()))?,
        Some(list) => {
            return Err(FormError::Shape {
                what: "states",
                rows: list.len(),
                columns: 1,
            });
        }
        None => (1..=n).map(|k| format!("x{k}")).collect(),
    };
    let unit = |k: usize| {
        let given = fields.get("states").and_then(|list| list[k].get("unit"));
        if given.and_then(Value::as_str) == Some("A") {
            "A"
        } else {
            "V"
        }
    };
    let units = (0..n).map(unit).collect();
    let names: Rc<[String]> = states.clone().into();
    let read = |field: &'static str, texts: &[String]| Expressions::read(field, texts, &names);
    let f = read("f", &f)?;
    let signal = |g: Expressions| -> crate::forms::Signal {
        Rc::new(move |t| g.value(t, &DVector::zeros(n)))
    };
    let zeros = |count: usize| vec!["0".to_string(); count];
    let x0 = file.vector("x0", n)?;
    let form = fields.get("form").and_then(Value::as_str).unwrap_or("");
    let system = match form {
        "nonlinear_complementarity" => {
            let c = read("c", &needed("c")?)?;
            let m = c.len();
            let g = read("g", &texts("g")?.unwrap_or_else(|| zeros(m)))?;
            let system = NonlinearComplementarity {
                field: {
                    let f = f.clone();
                    Rc::new(move |t, x| f.value(t, x))
                },
                field_jacobian: Rc::new(move |t, x| f.jacobian(t, x)),
                b: file.shaped("B", (n, m))?,
                c: map(&c),
                g: signal(sized("g", g, m)?),
                hessian: hessian(fields.get("hessian"), n, &names)?,
            };
            system.check_storage(std::slice::from_ref(&x0))?;
            System::Complementarity(system)
        }
        "projected" | "gradient_complementarity" => {
            let h = read("h", &needed("h")?)?;
            let system = ProjectedSystem::new(map(&f), map(&h), n)?;
            system.qualified(&x0)?;
            System::Projected(system)
        }
        "unilateral_inclusion" | "complementarity_dynamics" => {
            let h = read("h", &needed("h")?)?;
            let g = read("g", &texts("g")?.unwrap_or_else(|| zeros(n)))?;
            let system = Unilateral::new(map(&f), signal(sized("g", g, n)?), &map(&h), n)?;
            system.qualified(&x0)?;
            System::Unilateral(system)
        }
        other => {
            return Err(FormError::File(format!("`{other}` is no nonlinear form")));
        }
    };
    let tran = fields.get("tran").unwrap_or(&Value::Null);
    let time = |name: &str| {
        tran.get(name)
            .and_then(Value::as_f64)
            .filter(|v| v.is_finite() && *v > 0.0)
            .ok_or_else(|| FormError::File(format!("`tran` has no positive `{name}`")))
    };
    Ok(Some(NonlinearFile {
        title: fields
            .get("title")
            .and_then(Value::as_str)
            .unwrap_or("")
            .to_string(),
        states,
        units,
        tstep: time("tstep")?,
        tstop: time("tstop")?,
        x0,
        system,
    }))
}

fn map(e: &Expressions) -> Map {
    let (value, jacobian) = (e.clone(), e.clone());
    Map::new(
        move |x| value.value(0.0, x),
        move |x| jacobian.jacobian(0.0, x),
    )
}

fn sized(what: &'static str, e: Expressions, count: usize) -> Result<Expressions, FormError> {
    if e.len() == count {
        Ok(e)
    } else {
        Err(FormError::Shape {
            what,
            rows: e.len(),
            columns: 1,
        })
    }
}

/// V''; the identity if absent.
fn hessian(
    value: Option<&Value>,
    n: usize,
    names: &Rc<[String]>,
) -> Result<crate::forms::projected::MatrixField, FormError> {
    let Some(value) = value else {
        return Ok(Rc::new(|x: &DVector<f64>| {
            DMatrix::identity(x.len(), x.len())
        }));
    };
    let rows: Vec<Vec<String>> = serde_json::from_value(value.clone())
        .map_err(|_| FormError::File("`hessian` is no matrix of expressions".into()))?;
    if rows.len() != n || rows.iter().any(|row| row.len() != n) {
        return Err(FormError::Shape {
            what: "hessian",
            rows: rows.len(),
            columns: rows.first().map_or(0, Vec::len),
        });
    }
    let entries = Expressions::read("hessian", &rows.concat(), names)?;
    Ok(Rc::new(move |x| {
        DMatrix::from_row_slice(n, n, entries.value(0.0, x).as_slice())
    }))
}

impl NonlinearFile {
    /// Runs from x₀ over the span: with the given step, or halving the step until a halving changes x by less than `tol`
    /// of its size.
    ///
    /// # Errors
    /// [`FormError::Step`].
    pub fn run(&self, step: Option<f64>, tol: f64) -> Result<NonlinearRun, FormError> {
        match &self.system {
            System::Complementarity(system) => self.solve(system, step, tol),
            System::Projected(system) => self.solve(system, step, tol),
            System::Unilateral(system) => self.solve(system, step, tol),
        }
    }

    fn solve(
        &self,
        system: &impl Complementarity,
        step: Option<f64>,
        tol: f64,
    ) -> Result<NonlinearRun, FormError> {
        let rows = (self.tstop / self.tstep * (1.0 - WHOLE)).ceil().max(1.0) as usize;
        let run = |per_row: usize| -> Result<NonlinearRun, FormError> {
            let whole = integrate(system, (0.0, self.tstop), &self.x0, rows * per_row)?;
            let every = |list: &[DVector<f64>]| list.iter().step_by(per_row).cloned().collect();
            Ok(NonlinearRun {
                trajectory: Trajectory {
                    t: whole.t.iter().step_by(per_row).copied().collect(),
                    x: every(&whole.x),
                    lambda: every(&whole.lambda),
                    y: every(&whole.y),
                },
                steps_per_row: per_row,
                steps: rows * per_row,
                error: None,
            })
        };
        if let Some(h) = step {
            let row = self.tstop / rows as f64;
            return run((row / h * (1.0 - WHOLE)).ceil().max(1.0) as usize);
        }
        let mut coarse = run(1)?;
        for k in 1..=HALVINGS {
            let mut fine = run(1 << k)?;
            let states = || coarse.trajectory.x.iter().zip(&fine.trajectory.x);
            let change = states().map(|(a, b)| (a - b).amax()).fold(0.0, f64::max);
            let size = states()
                .map(|(_, b)| b.amax())
                .fold(f64::MIN_POSITIVE, f64::max);
            fine.error = Some(change / size);
            coarse = fine;
            if change <= tol * size {
                break;
            }
        }
        Ok(coarse)
    }

    /// Numbers of states and of pairs (λ, y).
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        match &self.system {
            System::Complementarity(system) => system.size(),
            System::Projected(system) => system.size(),
            System::Unilateral(system) => system.size(),
        }
    }
}
