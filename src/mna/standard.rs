//! Piecewise-linear laws as ideal complementarity pairs, stated on the behaviour itself.

use super::{Behaviour, Coefficient, Column, Equation, Pair};
use crate::algebra::Value;
use crate::law::Law;

impl Behaviour {
    /// The same behaviour with every piecewise-linear law replaced by ideal pairs 0 ≤ p ⟂ q ≥ 0.
    ///
    /// A curve with corners V_1…V_K, a first ray d_0, segments d_k = V_{k+1} − V_k and a last ray d_K is
    /// (v, i) = V_1 − d_0 a + Σ d_k t_k with the pairs (a, t_1), (1 − t_1, t_2), …, (1 − t_{K−1}, t_K).
    #[must_use]
    pub fn standard(&self) -> Self {
        let mut out = Self {
            ball: std::sync::OnceLock::new(),
            rational: std::sync::OnceLock::new(),
            pairs: Vec::new(),
            ..self.clone()
        };
        for pair in &self.pairs {
            if is_ideal(pair) {
                out.pairs.push(pair.clone());
            } else {
                expand(&mut out, pair);
            }
        }
        out
    }
}

fn is_ideal(pair: &Pair) -> bool {
    !pair.fixed_role
        && matches!(&pair.port.law, Law::Diode { vfwd, ron, roff: None } if vfwd.f64 == 0.0 && ron.f64 == 0.0)
}

/// A curve with exact coefficients.
struct Shape {
    vertices: Vec<(Value, Value)>,
    first: (Coefficient, Coefficient),
    last: (Coefficient, Coefficient),
}

fn shape(law: &Law) -> Shape {
    let zero = Coefficient::Plus(Value::decimal(0.0, 0, 0));
    match law {
        Law::Diode { vfwd, ron, roff } => {
            // The two lines i = v/roff and i = (v − vfwd)/ron meet at v = vfwd·roff/(roff − ron).
            let corner = match roff {
                Some(r) if vfwd.f64 != 0.0 => {
                    let v = vfwd.f64 * r.f64 / (r.f64 - ron.f64);
                    (Value::binary(v), Value::binary(v / r.f64))
                }
                _ => (*vfwd, Value::decimal(0.0, 0, 0)),
            };
            Shape {
                vertices: vec![corner],
                first: (Coefficient::ONE, roff.map_or(zero, Coefficient::Inverse)),
                last: (Coefficient::Plus(*ron), Coefficient::ONE),
            }
        }
        Law::Curve(curve) => Shape {
            vertices: curve.vertices.clone(),
            first: (
                Coefficient::Plus(curve.first.0),
                Coefficient::Plus(curve.first.1),
            ),
            last: (
                Coefficient::Plus(curve.last.0),
                Coefficient::Plus(curve.last.1),
            ),
        },
    }
}

fn expand(out: &mut Behaviour, pair: &Pair) {
    let Shape {
        vertices,
        first,
        last,
    } = shape(&pair.port.law);
    let count = vertices.len();
    let device = &pair.port.device;
    out.internal.push(pair.reverse);
    out.internal.push(pair.forward);
    // Two equations: x = V_1 − d_0 a + Σ d_k t_k for each coordinate. Devices carry −v in their reverse column.
    let along_v = if pair.fixed_role {
        Coefficient::MINUS_ONE
    } else {
        Coefficient::ONE
    };
    let mut v: Equation = vec![(along_v, pair.reverse)];
    let mut i: Equation = vec![(Coefficient::MINUS_ONE, pair.forward)];
    let mut add = |dv: Coefficient, di: Coefficient, column: Column| {
        v.push((dv, column));
        i.push((di, column));
    };
    add(
        Coefficient::Plus(vertices[0].0),
        Coefficient::Plus(vertices[0].1),
        Behaviour::ONE,
    );
    let mut slack = out.column(format!("{device}.a"));
    add(first.0.negated(), first.1.negated(), slack);
    let mut pairs = Vec::new();
    for k in 0..count {
        let t = out.column(format!("{device}.t{}", k + 1));
        pairs.push((slack, t));
        if k + 1 == count {
            add(last.0, last.1, t);
        } else {
            add(
                Coefficient::Plus(vertices[k + 1].0),
                Coefficient::Plus(vertices[k + 1].1),
                t,
            );
            add(
                Coefficient::Minus(vertices[k].0),
                Coefficient::Minus(vertices[k].1),
                t,
            );
            slack = out.column(format!("{device}.s{}", k + 1));
            // s + t = 1
            let one = Coefficient::Plus(Value::decimal(1.0, 1, 0));
            out.equations.push(vec![
                (one, slack),
                (one, t),
                (Coefficient::MINUS_ONE, Behaviour::ONE),
            ]);
        }
    }
    out.equations.push(v);
    out.equations.push(i);
    for (k, (reverse, forward)) in pairs.into_iter().enumerate() {
        let mut port = pair.port.clone();
        port.law = Law::ideal_diode();
        if count > 1 {
            port.device = format!("{device}.{}", k + 1);
        }
        out.pairs.push(Pair {
            port,
            reverse,
            forward,
            fixed_role: false,
            reverse_name: out.columns[reverse].clone(),
            forward_name: out.columns[forward].clone(),
            units: pair.units,
        });
    }
}
