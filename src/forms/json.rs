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
//! `inputs`, `tran`, `x0`, `states` and `ports` are as in a system file; names not given are x1, x2, … and d1, d2, …

use nalgebra::{DMatrix, DVector};
use serde_json::{Map, Value, json};

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

/// Access to the fields of a form file.
struct Fields<'a>(&'a Map<String, Value>);

impl Fields<'_> {
    fn bad(name: &str) -> FormError {
        FormError::File(format!(
            "`{name}` is not a matrix or vector of finite numbers"
        ))
    }

    fn numbers(name: &str, value: &Value) -> Result<Vec<f64>, FormError> {
        let list = value.as_array().ok_or_else(|| Self::bad(name))?;
        list.iter()
            .map(|v| {
                v.as_f64()
                    .filter(|v| v.is_finite())
                    .ok_or_else(|| Self::bad(name))
            })
            .collect()
    }

    /// A matrix of the given number of columns; `None` if absent.
    fn matrix(
        &self,
        name: &'static str,
        columns: Option<usize>,
    ) -> Result<Option<DMatrix<f64>>, FormError> {
        let Some(value) = self.0.get(name) else {
            return Ok(None);
        };
        let rows = value.as_array().ok_or_else(|| Self::bad(name))?;
        let rows: Vec<Vec<f64>> = rows
            .iter()
            .map(|row| Self::numbers(name, row))
            .collect::<Result<_, _>>()?;
        let width = columns.or_else(|| rows.first().map(Vec::len)).unwrap_or(0);
        if rows.iter().any(|row| row.len() != width) {
            return Err(FormError::Shape {
                what: name,
                rows: rows.len(),
                columns: rows.first().map_or(0, Vec::len),
            });
        }
        Ok(Some(DMatrix::from_fn(rows.len(), width, |i, j| rows[i][j])))
    }

    /// A matrix of the given shape, zero if absent.
    fn shaped(
        &self,
        name: &'static str,
        (rows, columns): (usize, usize),
    ) -> Result<DMatrix<f64>, FormError> {
        match self.matrix(name, Some(columns))? {
            Some(m) if m.nrows() == rows => Ok(m),
            Some(m) => Err(FormError::Shape {
                what: name,
                rows: m.nrows(),
                columns: m.ncols(),
            }),
            None => Ok(DMatrix::zeros(rows, columns)),
        }
    }

    fn needed(&self, name: &'static str) -> Result<DMatrix<f64>, FormError> {
        self.matrix(name, None)?
            .ok_or_else(|| FormError::File(format!("`{name}` is missing")))
    }

    fn vector(&self, name: &'static str, length: usize) -> Result<DVector<f64>, FormError> {
        let Some(value) = self.0.get(name) else {
            return Ok(DVector::zeros(length));
        };
        let numbers = Self::numbers(name, value)?;
        if numbers.len() != length {
            return Err(FormError::Shape {
                what: name,
                rows: numbers.len(),
                columns: 1,
            });
        }
        Ok(DVector::from_vec(numbers))
    }

    fn number(&self, name: &str) -> f64 {
        self.0.get(name).and_then(Value::as_f64).unwrap_or(0.0)
    }

    fn phi(&self, count: usize) -> Result<Vec<Phi>, FormError> {
        let list: Vec<Phi> = self
            .0
            .get("phi")
            .cloned()
            .map_or_else(|| Ok(vec![Phi::HalfLine; count]), serde_json::from_value)
            .map_err(|e| FormError::File(format!("`phi`: {e}")))?;
        if list.len() == count {
            Ok(list)
        } else {
            Err(FormError::Shape {
                what: "phi",
                rows: list.len(),
                columns: 1,
            })
        }
    }

    fn inputs(&self) -> usize {
        self.0
            .get("inputs")
            .and_then(Value::as_array)
            .map_or(0, Vec::len)
    }

    /// A, B, C, D, E, G, e, F, P under their own names; B, C may be given by H instead (B = Hᵀ, C = H).
    fn plant(&self) -> Result<Affine, FormError> {
        let a = self.needed("A")?;
        let n = a.nrows();
        let (b, c) = match self.matrix("H", Some(n))? {
            Some(h) => (h.transpose(), h),
            None => {
                let c = self
                    .matrix("C", Some(n))?
                    .unwrap_or_else(|| DMatrix::zeros(0, n));
                (self.shaped("B", (n, c.nrows()))?, c)
            }
        };
        let (m, p) = (c.nrows(), self.inputs());
        Ok(Affine {
            e: self.shaped("E", (n, p))?,
            g: self.shaped("G", (m, p))?,
            e0: self.vector("e", n)?,
            f: self.vector("F", m)?,
            p: if self.0.contains_key("P") {
                Some(self.shaped("P", (n, n))?)
            } else {
                None
            },
            system: System {
                a,
                b,
                c,
                d: self.shaped("D", (m, m))?,
            },
        })
    }

    /// (sign) M, c on {Hx + k ≷ 0} as a system with B = Cᵀ.
    fn on_a_set(&self, sign: f64) -> Result<Affine, FormError> {
        let m = self.needed("M")?;
        let n = m.nrows();
        let h = self.shaped("H", (self.needed("H")?.nrows(), n))? * sign;
        let (ports, p) = (h.nrows(), self.inputs());
        Ok(Affine {
            e: self.shaped("E", (n, p))?,
            g: self.shaped("G", (ports, p))? * sign,
            e0: -self.vector("c", n)?,
            f: self.vector("k", ports)? * sign,
            p: Some(DMatrix::identity(n, n)),
            system: System {
                a: -m,
                b: h.transpose(),
                c: h,
                d: DMatrix::zeros(ports, ports),
            },
        })
    }
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

/// The system file that stands for a form.
fn document(file: &Fields<'_>, affine: &Affine) -> Value {
    let rows = |m: &DMatrix<f64>| -> Value {
        m.row_iter()
            .map(|r| r.iter().copied().collect::<Vec<_>>())
            .collect()
    };
    let (n, m) = (affine.system.n(), affine.system.m());
    let fits = |name: &str, length: usize| {
        file.0
            .get(name)
            .filter(|v| v.as_array().is_some_and(|list| list.len() == length))
            .cloned()
    };
    let states: Vec<Value> = (1..=n)
        .map(|k| json!({"name": format!("x{k}"), "unit": "V"}))
        .collect();
    let port = |k: usize| {
        json!({"device": format!("d{k}"), "lambda": format!("i(d{k})"), "y": format!("-v(d{k})"),
               "law": {"kind": "ideal_diode"}})
    };
    let mut document = json!({
        "schema": "circ-lcs/1",
        "title": file.0.get("title").cloned().unwrap_or_else(|| json!("")),
        "states": fits("states", n).unwrap_or_else(|| states.into()),
        "inputs": file.0.get("inputs").cloned().unwrap_or_else(|| json!([])),
        "ports": fits("ports", m).unwrap_or_else(|| (1..=m).map(port).collect()),
        "A": rows(&affine.system.a),
        "B": rows(&affine.system.b),
        "C": rows(&affine.system.c),
        "D": rows(&affine.system.d),
        "E": rows(&affine.e),
        "G": rows(&affine.g),
        "e": affine.e0.as_slice(),
        "F": affine.f.as_slice(),
    });
    if let Some(p) = &affine.p {
        document["P"] = rows(p);
    }
    // The states are what can be seen of a form that names no outputs.
    let names: Vec<Value> = document["states"]
        .as_array()
        .into_iter()
        .flatten()
        .map(|s| s["name"].clone())
        .collect();
    let units: Vec<Value> = document["states"]
        .as_array()
        .into_iter()
        .flatten()
        .map(|s| s["unit"].clone())
        .collect();
    let inputs = affine.e.ncols();
    document["outputs"] = json!({
        "names": names,
        "units": units,
        "x": rows(&DMatrix::identity(n, n)),
        "lambda": rows(&DMatrix::zeros(n, m)),
        "u": rows(&DMatrix::zeros(n, inputs)),
        "du": rows(&DMatrix::zeros(n, inputs)),
        "one": vec![0.0; n],
    });
    for name in ["x0", "tran", "outputs"] {
        if let Some(value) = file.0.get(name) {
            document[name] = value.clone();
        }
    }
    document
}

#[cfg(test)]
mod tests {
    use super::*;

    const INPUT: &str =
        r#""inputs":[{"name":"u1","unit":"V","waveform":{"kind":"sin","args":[0,1,1]}}]"#;

    fn form(body: &str) -> Result<SystemFile, FormError> {
        read(&format!(r#"{{"schema":"circ-form/1",{body}}}"#))
    }

    #[test]
    fn sweeping_process_becomes_a_gradient_system() {
        let file = form(&format!(
            r#""form":"sweeping_process","A":[[-1]],"H":[[2]],"G":[[-1]],"F":[0.5],"x0":[1],{INPUT}"#
        ))
        .unwrap();
        assert_eq!(
            (file.lcs.b[(0, 0)], file.lcs.c[(0, 0)], file.lcs.d[(0, 0)]),
            (2.0, 2.0, 0.0)
        );
        assert_eq!(
            (file.lcs.g[(0, 0)], file.lcs.f[0], file.x0[0]),
            (-1.0, 0.5, 1.0)
        );
        let report = crate::check::system(&file.lcs);
        let sweeping = report
            .theorems
            .iter()
            .find(|t| t.statement.contains("Theorem 3.5"))
            .unwrap();
        assert_eq!(sweeping.holds, Some(true), "{report}");
    }

    #[test]
    fn projected_and_unilateral_forms_differ_by_the_sign_of_their_set() {
        let projected = form(r#""form":"projected","M":[[1]],"c":[2],"H":[[1]],"k":[3]"#)
            .unwrap()
            .lcs;
        let unilateral =
            form(r#""form":"complementarity_dynamics","M":[[1]],"c":[2],"H":[[-1]],"k":[-3]"#)
                .unwrap()
                .lcs;
        assert_eq!(
            (&projected.a, &projected.b, &projected.c),
            (&unilateral.a, &unilateral.b, &unilateral.c)
        );
        assert_eq!((projected.e0[0], projected.f[0]), (-2.0, 3.0));
        assert_eq!((unilateral.e0[0], unilateral.f[0]), (-2.0, 3.0));
    }

    #[test]
    fn lure_system_expands_relays_with_their_driven_terms() {
        let lcs = form(&format!(
            r#""form":"multivalued_lure","A":[[0]],"B":[[1]],"C":[[1]],"E":[[0.5]],"G":[[0.25]],
               "phi":[{{"kind":"relay","gain":2}}],{INPUT}"#
        ))
        .unwrap()
        .lcs;
        assert_eq!(lcs.m(), 2);
        assert_eq!(lcs.e[(0, 0)], 0.5);
        assert_eq!((lcs.g[(0, 0)], lcs.g[(1, 0)]), (0.25, 0.0));
        // λ = μ₁ − g: the constant drift is −g.
        assert_eq!((lcs.e0[0], lcs.f[0], lcs.f[1]), (-2.0, 0.0, 4.0));
    }

    #[test]
    fn cone_observer_and_feedback_forms_are_systems() {
        let cone = form(
            r#""form":"cone_complementarity","A":[[-1]],"B":[[1,0]],"C":[[1],[0]],"V":[[1,1],[0,1]],"D_bar":[[1,0],[0,0]]"#,
        )
        .unwrap()
        .lcs;
        assert_eq!(
            (cone.d[(0, 0)], cone.d[(0, 1)], cone.d[(1, 1)]),
            (1.0, 0.0, 0.0)
        );
        let plant = r#""A":[[-0.2,-1],[1,-0.1]],"B":[[-1],[0]],"C":[[-1,0]],"D":[[0.5]]"#;
        let observer = form(&format!(
            r#""form":"observer",{plant},"Z":[[0,1]],"Y":[[0.3]],"rate":0.25"#
        ))
        .unwrap()
        .lcs;
        assert_eq!((observer.n(), observer.m()), (4, 2));
        let active = r#""A":[[0.5,-1],[1,-0.2]],"B":[[1],[0]],"C":[[0.4,0.3]],"D":[[0]]"#;
        let closed = form(&format!(
            r#""form":"output_feedback",{active},"E_control":[[1],[0.2]]"#
        ))
        .unwrap()
        .lcs;
        assert_eq!(crate::check::system(&closed).passive, Some(true));
    }

    #[test]
    fn mistakes_are_named() {
        let message = |body: &str| form(body).unwrap_err().to_string();
        assert!(message(r#""form":"nothing""#).contains("unknown form"));
        assert!(message(r#""form":"sweeping_process""#).contains("`A` is missing"));
        assert!(message(r#""form":"sweeping_process","A":[[1]],"H":[[1,2]]"#).contains("H is 1×2"));
        assert!(message(r#""form":"projected","M":[[1]],"H":[[1]],"k":["x"]"#).contains("`k`"));
        assert!(read("{").is_err());
    }
}
