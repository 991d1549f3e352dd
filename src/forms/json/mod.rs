//! The linear forms as files: each is turned into the complementarity system that `circ sim` and `circ check` work on.
//!
//! ```text
//! {"schema":"circ-form/1","form":"sweeping_process","title":"…",
//!  "A":[[…]],"H":[[…]],"E":[[…]],"G":[[…]],"e":[…],"F":[…],"inputs":[…],"x0":[…],"tran":{…}}
//! ```
//!
//! | form | data | becomes (A, B, C, D; P) |
//! |---|---|---|
//! | `linear_complementarity` | A, B, C, D, E, G, e, F, P | itself |
//! | `multivalued_lure` | the same and `phi`: one of `half_line`, `interval`, `relay`, `quadratic` per port | its [expansion](super::lure) |
//! | `cone_complementarity` | A, B, C and V, D_bar of Lemma 3.8 (B, C of the original pairs) | (A, B, C, V D̄ Vᵀ) |
//! | `sweeping_process` | −z' ∈ N(S; z) − (Az + Eu + e), S = {Hz + Gu + F ≥ 0} | (A, Hᵀ, H, 0; I) |
//! | `variational_inequality` | the same with `phi`: Ξ(z) = Σ φⱼ(Hz + Gu + F)ⱼ | expansion of (A, Hᵀ, H, 0) |
//! | `projected`, `gradient_complementarity` | F(x) = Mx + c on K = {Hx + k ≥ 0} | (−M, Hᵀ, H, 0; I) |
//! | `unilateral_inclusion`, `complementarity_dynamics` | f(x) = Mx + c on C = {Hx + k ≤ 0}, E for −g | (−M, −Hᵀ, −H, 0; I) |
//! | `observer` | a plant and measurement `Z`, `Y` (z = Zx + Yλ), `rate` | plant and observer together |
//! | `output_feedback` | a plant and `E_control`, `F_control`, `rate` | the closed loop |
//!
//! The same names with expressions in place of matrices are [nonlinear] forms.
//!
//! `inputs`, `tran`, `x0`, `states` and `ports` are as in a system file; names not given are x1, x2, … and d1, d2, …

mod document;
mod fields;
pub mod nonlinear;

use nalgebra::{DMatrix, DVector};
use serde_json::Value;

use document::document;
use fields::Fields;

use super::feedback::{self, Feedback};
use super::lure::{Lure, Phi};
use super::observer::Observer;
use super::{FormError, Linear, constant};
use crate::lcs::json::SystemFile;
use crate::passivity::System;

/// The schema of form files.
pub const SCHEMA: &str = "circ-form/1";

/// A form brought to x' = Ax + Bλ + Eu + e, y = Cx + Dλ + Gu + F with its metric P, if it brings one.
struct Affine {
    system: System,
    e: DMatrix<f64>,
    g: DMatrix<f64>,
    e0: DVector<f64>,
    f: DVector<f64>,
    p: Option<DMatrix<f64>>,
}

/// Reads a form or a system file.
///
/// # Errors
/// [`FormError::File`] for what cannot be read, and the failed hypothesis where a gain has to be designed.
pub fn read(text: &str) -> Result<SystemFile, FormError> {
    let value: Value = serde_json::from_str(text).map_err(|e| FormError::File(e.to_string()))?;
    let system =
        |text: &str| crate::lcs::json::read(text).map_err(|e| FormError::File(e.to_string()));
    if value.get("schema").and_then(Value::as_str) != Some(SCHEMA) {
        return system(text);
    }
    let file = Fields(
        value
            .as_object()
            .ok_or_else(|| FormError::File("not an object".into()))?,
    );
    let affine = affine(&file)?;
    system(&document(&file, &affine).to_string())
}

fn affine(file: &Fields<'_>) -> Result<Affine, FormError> {
    let form = file.0.get("form").and_then(Value::as_str).unwrap_or("");
    match form {
        "linear_complementarity" => file.plant(),
        "multivalued_lure" | "variational_inequality" => {
            let plant = file.plant()?;
            expand(&plant, &file.phi(plant.system.m())?)
        }
        "cone_complementarity" => {
            let mut plant = file.plant()?;
            let m = plant.system.m();
            let v = file.shaped("V", (m, m))?;
            plant.system.d = &v * file.shaped("D_bar", (m, m))? * v.transpose();
            Ok(plant)
        }
        "sweeping_process" => {
            let mut plant = file.plant()?;
            let n = plant.system.n();
            plant.p.get_or_insert_with(|| DMatrix::identity(n, n));
            Ok(plant)
        }
        "projected" | "gradient_complementarity" => file.on_a_set(1.0),
        "unilateral_inclusion" | "complementarity_dynamics" => file.on_a_set(-1.0),
        "observer" => observed(file),
        "output_feedback" => closed(file),
        other => Err(FormError::File(format!("unknown form `{other}`"))),
    }
}

/// The expansion of piecewise linear φ, the driven columns by linearity.
fn expand(plant: &Affine, phi: &[Phi]) -> Result<Affine, FormError> {
    let at = |e: DVector<f64>,
              f: DVector<f64>|
     -> Result<(System, DVector<f64>, DVector<f64>), FormError> {
        let linear = Linear::new(plant.system.clone(), constant(e), constant(f))?;
        let expanded = Lure::new(linear, phi.to_vec())?.expand()?.linear;
        Ok((
            expanded.system.clone(),
            (expanded.e)(0.0),
            (expanded.f)(0.0),
        ))
    };
    let (system, e0, f) = at(plant.e0.clone(), plant.f.clone())?;
    let (_, zero_e, zero_f) = at(plant.e0.clone() * 0.0, plant.f.clone() * 0.0)?;
    let p = plant.e.ncols();
    let (mut e, mut g) = (DMatrix::zeros(e0.len(), p), DMatrix::zeros(f.len(), p));
    for k in 0..p {
        let (_, column_e, column_f) = at(
            plant.e.column(k).into_owned(),
            plant.g.column(k).into_owned(),
        )?;
        e.set_column(k, &(column_e - &zero_e));
        g.set_column(k, &(column_f - &zero_f));
    }
    Ok(Affine {
        system,
        e,
        g,
        e0,
        f,
        p: plant.p.clone(),
    })
}

/// [m; m].
fn twice(m: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(2 * m.nrows(), m.ncols(), |i, j| m[(i % m.nrows(), j)])
}

fn observed(file: &Fields<'_>) -> Result<Affine, FormError> {
    let plant = file.plant()?;
    let z = file.needed("Z")?;
    let y = file.shaped("Y", (z.nrows(), plant.system.m()))?;
    let observer = Observer::design(&plant.system, &z, &y, file.number("rate"))?;
    let joint = observer.with_plant(&Linear::autonomous(plant.system.clone())?, &z, &y)?;
    let column = |v: &DVector<f64>| DVector::from_fn(2 * v.len(), |i, _| v[i % v.len()]);
    Ok(Affine {
        system: joint.system,
        e: twice(&plant.e),
        g: twice(&plant.g),
        e0: column(&plant.e0),
        f: column(&plant.f),
        p: None,
    })
}

fn closed(file: &Fields<'_>) -> Result<Affine, FormError> {
    let mut plant = file.plant()?;
    let e = file.needed("E_control")?;
    let f = file.shaped("F_control", (plant.system.m(), e.ncols()))?;
    let found = Feedback::design(&plant.system, &e, &f, file.number("rate"))?;
    plant.system = feedback::close(&plant.system, &e, &f, &found.s, &found.g);
    plant.p = Some(found.p);
    Ok(plant)
}

#[cfg(test)]
mod tests;
