//! A system as text: for reading, for numpy, MATLAB and LaTeX.

use std::fmt::{self, Write as _};

use nalgebra::{DMatrix, DVector};

use super::Lcs;

/// Text formats of a system besides JSON.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Named rows and columns, for people.
    Text,
    /// A Python script that defines numpy arrays.
    Numpy,
    /// A MATLAB or Octave script.
    Matlab,
    /// The equations in LaTeX.
    Latex,
}

/// Writes the system in a text format.
#[must_use]
pub fn format(lcs: &Lcs, format: Format) -> String {
    match format {
        Format::Text => lcs.to_string(),
        Format::Numpy => numpy(lcs),
        Format::Matlab => matlab(lcs),
        Format::Latex => latex(lcs),
    }
}

/// The matrices with their letters, row and column names. Constants are one-column matrices.
fn parts(lcs: &Lcs) -> Vec<Part> {
    let x: Vec<String> = lcs.states.iter().map(|s| s.name.clone()).collect();
    let u: Vec<String> = lcs.inputs.iter().map(|s| s.name.clone()).collect();
    let y: Vec<String> = lcs.ports.iter().map(|p| p.y.clone()).collect();
    let lambda: Vec<String> = lcs.ports.iter().map(|p| p.lambda.clone()).collect();
    let one = vec!["1".to_owned()];
    let rate: Vec<String> = x.iter().map(|n| format!("{n}'")).collect();
    let column = |v: &DVector<f64>| DMatrix::from_column_slice(v.len(), 1, v.as_slice());
    let part = |letter, rows: &[String], cols: &[String], m: DMatrix<f64>| Part {
        letter,
        rows: rows.to_vec(),
        cols: cols.to_vec(),
        m,
    };
    vec![
        part("A", &rate, &x, lcs.a.clone()),
        part("B", &rate, &lambda, lcs.b.clone()),
        part("E", &rate, &u, lcs.e.clone()),
        part("e", &rate, &one, column(&lcs.e0)),
        part("C", &y, &x, lcs.c.clone()),
        part("D", &y, &lambda, lcs.d.clone()),
        part("G", &y, &u, lcs.g.clone()),
        part("F", &y, &one, column(&lcs.f)),
    ]
}

struct Part {
    letter: &'static str,
    rows: Vec<String>,
    cols: Vec<String>,
    m: DMatrix<f64>,
}

/// What the letters stand for: states and what inputs add to them, the law of each port, units, and the position of the switches.
fn legend(lcs: &Lcs) -> String {
    let mut out = String::from("x' = A x + B λ + E u + e,  y = C x + D λ + G u + F\n");
    let _ = writeln!(
        out,
        "n = {} states, m = {} ports, p = {} inputs",
        lcs.n(),
        lcs.m(),
        lcs.p()
    );
    for (k, s) in lcs.states.iter().enumerate() {
        let terms: Vec<String> = (0..lcs.p())
            .filter(|&j| lcs.shift[(k, j)] != 0.0)
            .map(|j| format!(" + {:e} {}", lcs.shift[(k, j)], lcs.inputs[j].name))
            .collect();
        let shift = if terms.is_empty() {
            String::new()
        } else {
            format!("  ({} = x{}{})", s.name, k + 1, terms.concat())
        };
        let _ = writeln!(out, "x{} = {} [{}]{shift}", k + 1, s.name, s.unit);
    }
    for (k, p) in lcs.ports.iter().enumerate() {
        let (k, law) = (k + 1, p.law.kind());
        let _ = writeln!(out, "λ{k} = {}, y{k} = {}: {law}", p.lambda, p.y);
    }
    for (k, u) in lcs.inputs.iter().enumerate() {
        let _ = writeln!(out, "u{} = {} [{}]", k + 1, u.name, u.unit);
    }
    for (name, on) in &lcs.switches {
        let _ = writeln!(out, "switch {name}: {}", if *on { "on" } else { "off" });
    }
    out
}

/// The title and the legend as comments of a script, which its matrices are not told without.
fn commented(lcs: &Lcs, mark: &str) -> String {
    let legend = legend(lcs);
    let lines = std::iter::once(lcs.title.as_str()).chain(legend.lines());
    lines.map(|line| format!("{mark} {line}\n")).collect()
}

impl fmt::Display for Lcs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.title)?;
        f.write_str(&legend(self))?;
        for part in parts(self).iter().filter(|p| !p.m.is_empty()) {
            writeln!(f, "{}", part.letter)?;
            table(f, part)?;
        }
        Ok(())
    }
}

fn table(f: &mut fmt::Formatter<'_>, part: &Part) -> fmt::Result {
    let cell = |v: f64| {
        if v == 0.0 {
            "0".to_owned()
        } else {
            format!("{v:e}")
        }
    };
    let head = part
        .rows
        .iter()
        .map(|r| r.chars().count())
        .max()
        .unwrap_or(0);
    let widths: Vec<usize> = (0..part.m.ncols())
        .map(|j| {
            let entries = (0..part.m.nrows()).map(|i| cell(part.m[(i, j)]).len());
            entries
                .chain([part.cols[j].chars().count()])
                .max()
                .unwrap_or(0)
        })
        .collect();
    write!(f, "  {:head$}", "")?;
    for (name, width) in part.cols.iter().zip(&widths) {
        write!(f, "  {name:>width$}")?;
    }
    writeln!(f)?;
    for (i, row) in part.rows.iter().enumerate() {
        write!(f, "  {row:head$}")?;
        for (j, width) in widths.iter().enumerate() {
            write!(f, "  {:>width$}", cell(part.m[(i, j)]))?;
        }
        writeln!(f)?;
    }
    Ok(())
}

fn names(lcs: &Lcs) -> [(&'static str, Vec<String>); 4] {
    [
        (
            "states",
            lcs.states.iter().map(|s| s.name.clone()).collect(),
        ),
        (
            "inputs",
            lcs.inputs.iter().map(|s| s.name.clone()).collect(),
        ),
        (
            "lambda",
            lcs.ports.iter().map(|s| s.lambda.clone()).collect(),
        ),
        ("y", lcs.ports.iter().map(|s| s.y.clone()).collect()),
    ]
}

fn numpy(lcs: &Lcs) -> String {
    let mut out = commented(lcs, "#") + "import numpy as np\n";
    for (name, list) in names(lcs) {
        let quoted: Vec<String> = list.iter().map(|n| format!("{n:?}")).collect();
        let name = if name == "lambda" { "lambda_" } else { name };
        let _ = writeln!(out, "{name} = [{}]", quoted.join(", "));
    }
    for Part { letter, m, .. } in parts(lcs) {
        // Python is case sensitive, so e and E, f and F do not collide.
        let rows: Vec<String> = (0..m.nrows())
            .map(|i| {
                let row: Vec<String> = (0..m.ncols()).map(|j| format!("{:?}", m[(i, j)])).collect();
                format!("[{}]", row.join(", "))
            })
            .collect();
        let shape = format!("({}, {})", m.nrows(), m.ncols());
        let _ = writeln!(
            out,
            "{letter} = np.array([{}], dtype=float).reshape{shape}",
            rows.join(", ")
        );
    }
    out
}

fn matlab(lcs: &Lcs) -> String {
    let mut out = commented(lcs, "%");
    for (name, list) in names(lcs) {
        let quoted: Vec<String> = list.iter().map(|n| format!("'{n}'")).collect();
        let _ = writeln!(out, "{name} = {{{}}};", quoted.join(", "));
    }
    for Part { letter, m, .. } in parts(lcs) {
        let rows: Vec<String> = (0..m.nrows())
            .map(|i| {
                let row: Vec<String> = (0..m.ncols()).map(|j| format!("{:?}", m[(i, j)])).collect();
                row.join(", ")
            })
            .collect();
        let body = if m.is_empty() {
            format!("zeros({}, {})", m.nrows(), m.ncols())
        } else {
            format!("[{}]", rows.join("; "))
        };
        let _ = writeln!(out, "{letter} = {body};");
    }
    out
}

fn latex(lcs: &Lcs) -> String {
    let mut out = commented(lcs, "%");
    out.push_str(
        "\\begin{aligned}\n\\dot x &= A x + B \\lambda + E u + e\\\\\ny &= C x + D \\lambda + G u + F\\\\\n",
    );
    let texts = |list: Vec<String>| {
        let shown: Vec<String> = list
            .iter()
            .map(|n| format!("\\mathrm{{{}}}", n.replace('_', "\\_")))
            .collect();
        shown.join(",\\ ")
    };
    for (name, list) in names(lcs) {
        let letter = match name {
            "states" => "x",
            "inputs" => "u",
            "lambda" => "\\lambda",
            other => other,
        };
        if !list.is_empty() {
            let _ = writeln!(out, "{letter} &= ({})\\\\", texts(list));
        }
    }
    for Part { letter, m, .. } in parts(lcs).iter().filter(|p| !p.m.is_empty()) {
        let rows: Vec<String> = (0..m.nrows())
            .map(|i| {
                let row: Vec<String> = (0..m.ncols()).map(|j| tex_number(m[(i, j)])).collect();
                row.join(" & ")
            })
            .collect();
        let _ = writeln!(
            out,
            "{letter} &= \\begin{{pmatrix}} {} \\end{{pmatrix}}\\\\",
            rows.join(" \\\\ ")
        );
    }
    out.push_str("\\end{aligned}\n");
    out
}

/// `1.5e-6` as `1.5 \cdot 10^{-6}`.
fn tex_number(v: f64) -> String {
    if v == 0.0 || (1e-3..1e4).contains(&v.abs()) {
        return format!("{v}");
    }
    let text = format!("{v:e}");
    match text.split_once('e') {
        Some(("1", exponent)) => format!("10^{{{exponent}}}"),
        Some(("-1", exponent)) => format!("-10^{{{exponent}}}"),
        Some((mantissa, exponent)) => format!("{mantissa} \\cdot 10^{{{exponent}}}"),
        None => text,
    }
}
