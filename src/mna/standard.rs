//! Piecewise-linear laws as ideal complementarity pairs, stated on the multiport itself.

use std::ops::Deref;

use super::{Coefficient, Equation, Pair, StaticMultiport};
use crate::algebra::Value;
use crate::law::{Curve, Law};
use crate::lcs::Role;
use crate::settings::tolerances::ranks::ON_RAY;

/// A static multiport whose piecewise-linear laws are ideal pairs: what the reductions of modes, the steppers and the exact integrator take.
/// [`StaticMultiport::standard`] alone makes one, so that no other multiport is mistaken for it.
#[derive(Debug, Clone)]
pub struct StandardMultiport(pub(super) StaticMultiport);

impl Deref for StandardMultiport {
    type Target = StaticMultiport;

    fn deref(&self) -> &StaticMultiport {
        &self.0
    }
}

impl StandardMultiport {
    /// The same with ideal diodes in place of curved laws, so that these can be held open.
    pub(crate) fn with_ideal_diodes(&self) -> Self {
        let mut other = self.0.clone();
        let curved = other.pairs.iter_mut();
        for pair in curved.filter(|pair| !pair.port.law.is_piecewise_linear()) {
            pair.port.law = Law::ideal_diode();
        }
        Self(other)
    }
}

impl StaticMultiport {
    /// The same multiport with every piecewise-linear law replaced by ideal pairs 0 ≤ p ⟂ q ≥ 0; other laws stay as they are.
    ///
    /// A curve with corners V_1 … V_K, a first ray d_0, segments V_{k+1} − V_k = T_k d_k and a last ray d_K is
    ///
    /// ```text
    /// (v, i) = V_1 − d_0 a + Σ d_k t_k,    0 ≤ a ⟂ t_1 ≥ 0,  0 ≤ T_k − t_k ⟂ t_{k+1} ≥ 0
    /// ```
    ///
    /// The lengths T_k are chosen so that consecutive directions satisfy dv_{k−1} di_k + di_{k−1} dv_k = 1: then the power
    /// into the rest of the circuit is Σ λ_k y_k up to what the curve's own slopes dissipate and terms linear in λ, and a
    /// passive circuit with one corner a device keeps D + Dᵀ ⪰ 0.
    ///
    /// A device whose conductance only grows on both sides of one segment (a zener diode) is that segment's resistor with a
    /// diode, a source and a resistor in parallel for every corner: a circuit, so that λ_k y_k is power and D + Dᵀ ⪰ 0 for any
    /// number of corners.
    #[must_use]
    pub fn standard(&self) -> StandardMultiport {
        self.clone().into_standard()
    }

    /// As [`Self::standard`], in place.
    #[must_use]
    pub fn into_standard(self) -> StandardMultiport {
        let mut out = self;
        (out.ball, out.rational) = Default::default();
        for pair in std::mem::take(&mut out.pairs) {
            match pair.port.law.curve() {
                Some(curve) if pair.fixed_role || !pair.port.law.is_ideal_diode() => {
                    match middle(&curve).filter(|_| !pair.fixed_role) {
                        Some(middle) => branches(&mut out, &pair, &curve, middle),
                        None => expand(&mut out, &pair, curve),
                    }
                }
                _ => out.pairs.push(pair),
            }
        }
        StandardMultiport(out)
    }
}

impl StaticMultiport {
    /// How many pairs [`Self::standard`] has at most: one by corner of a piecewise-linear law.
    pub(crate) fn ideal_pairs(&self) -> usize {
        let corners = |law: &Law| law.curve().map_or(1, |curve| curve.vertices.len().max(1));
        let laws = self.pairs.iter().map(|pair| &pair.port.law);
        laws.map(corners).sum()
    }
}

impl StandardMultiport {
    /// The same multiport with the other quantity of every device preferred as λ.
    #[must_use]
    pub fn in_other_roles(&self) -> Self {
        let mut out = self.clone();
        for pair in out.0.pairs.iter_mut().filter(|pair| !pair.fixed_role) {
            pair.port.role = match pair.port.role {
                Role::Voltage => Role::Current,
                Role::Current => Role::Voltage,
                Role::Function => Role::Function,
            };
        }
        out
    }
}

/// A direction or point with exact coefficients; segments are differences of two points.
type Term = (Coefficient, Coefficient);

/// A curve as V_1, d_0, and for each further piece its direction (a sum of terms) and length T.
struct Shape {
    corner: Term,
    first: Term,
    pieces: Vec<(Vec<Term>, f64)>,
}

fn shape(curve: Curve) -> Shape {
    let Curve {
        vertices,
        first,
        last,
        ..
    } = curve;
    let origin = (Value::decimal(0.0, 0, 0), Value::decimal(0.0, 0, 0));
    let plus =
        |(v, i): (Value, Value), t: f64| (Coefficient::Ratio(v, t), Coefficient::Ratio(i, t));
    let minus = |(v, i), t| {
        let (v, i) = plus((v, i), t);
        (v.negated(), i.negated())
    };
    // The first direction has length 1 in its larger coordinate.
    let larger = first.0.f64.max(first.1.f64);
    let unit = if larger > 0.0 { larger } else { 1.0 };
    let mut before = (first.0.f64 / unit, first.1.f64 / unit);
    let mut pieces = Vec::new();
    let segments = vertices.windows(2).map(|w| (w[1], Some(w[0])));
    for (to, from) in segments.chain(std::iter::once((last, None))) {
        let from_f64 = from.map_or((0.0, 0.0), |(v, i)| (v.f64, i.f64));
        let along = (to.0.f64 - from_f64.0, to.1.f64 - from_f64.1);
        let product = before.0 * along.1 + before.1 * along.0;
        let length = if product > 0.0 { product } else { 1.0 };
        before = (along.0 / length, along.1 / length);
        let mut terms = vec![plus(to, length)];
        terms.extend(from.map(|from| minus(from, length)));
        pieces.push((terms, length));
    }
    let (v, i) = vertices.first().copied().unwrap_or(origin);
    let corner = on_ray((v, i), first).map_or_else(
        || (Coefficient::Plus(v), Coefficient::Plus(i)),
        |part| plus(first, part),
    );
    Shape {
        corner,
        first: plus(first, unit),
        pieces,
    }
}

/// The part of a ray from zero that reaches to a corner on it: a diode that blocks leaks nothing at 0 V, while the products of rounded
/// numbers leave a current of their rounding there.
fn on_ray((v, i): (Value, Value), (dv, di): (Value, Value)) -> Option<f64> {
    let (along, across) = (v.f64 * di.f64, i.f64 * dv.f64);
    let is_on = along != 0.0 && (along - across).abs() <= ON_RAY * along.abs();
    is_on.then(|| di.f64 / i.f64)
}

/// Conductances of the pieces, infinite where they are vertical.
fn conductances(curve: &Curve) -> Vec<f64> {
    let segments = curve.vertices.windows(2).map(|w| {
        let [(v0, i0), (v1, i1)] = [w[0], w[1]].map(|(v, i)| (v.f64, i.f64));
        (v1 - v0, i1 - i0)
    });
    let ray = |(v, i): (Value, Value)| std::iter::once((v.f64, i.f64));
    let along = ray(curve.first).chain(segments).chain(ray(curve.last));
    along.map(|(v, i)| i / v).collect()
}

/// The segment, 1 being that from the first corner to the second, from which the conductance grows to both sides.
fn middle(curve: &Curve) -> Option<usize> {
    let g = conductances(curve);
    let segments = 1..g.len() - 1;
    let middle = segments.min_by(|&a, &b| g[a].total_cmp(&g[b]))?;
    let grows = |w: &[f64]| w[0] <= w[1];
    let falls = |w: &[f64]| w[0] >= w[1];
    let outward = g[..=middle].windows(2).all(falls) && g[middle..].windows(2).all(grows);
    (outward && g[middle].is_finite()).then_some(middle)
}

/// The middle segment as a resistor, and for every corner V_k, with the growth G_k of the conductance beyond it,
/// 0 ≤ i_k ⟂ V_k + i_k/G_k − v ≥ 0 above and 0 ≤ i_k ⟂ v − V_k + i_k/G_k ≥ 0 below; i is the sum.
fn branches(out: &mut StaticMultiport, pair: &Pair, curve: &Curve, middle: usize) {
    let device = &pair.port.device;
    out.internal.push(pair.reverse);
    out.internal.push(pair.forward);
    let along = out.column(format!("{device}.s"));
    out.internal.push(along);
    // v = v₀ + (v₁ − v₀) s, i = i₀ + (i₁ − i₀) s + Σ ± i_k
    let [(v0, i0), (v1, i1)] = [curve.vertices[middle - 1], curve.vertices[middle]];
    let mut v: Equation = vec![(Coefficient::ONE, pair.reverse)];
    let mut i: Equation = vec![(Coefficient::MINUS_ONE, pair.forward)];
    for (equation, from, to) in [(&mut v, v0, v1), (&mut i, i0, i1)] {
        equation.push((Coefficient::Plus(from), StaticMultiport::ONE));
        equation.push((Coefficient::Plus(to), along));
        equation.push((Coefficient::Minus(from), along));
    }
    let g = conductances(curve);
    for (k, &(corner, _)) in curve.vertices.iter().enumerate() {
        let growth = (g[k + 1] - g[k]).abs();
        if growth == 0.0 {
            continue;
        }
        let above = k >= middle;
        let name = format!("{device}.{}", k + 1);
        let (reverse, forward) = (
            out.column(format!("-v({name})")),
            out.column(format!("i({name})")),
        );
        let mut branch: Equation = vec![(Coefficient::MINUS_ONE, reverse)];
        if growth.is_finite() {
            branch.push((Coefficient::Plus(Value::binary(growth.recip())), forward));
        }
        if above {
            branch.push((Coefficient::Plus(corner), StaticMultiport::ONE));
            branch.push((Coefficient::ONE, pair.reverse));
            i.push((Coefficient::ONE, forward));
        } else {
            branch.push((Coefficient::Minus(corner), StaticMultiport::ONE));
            branch.push((Coefficient::MINUS_ONE, pair.reverse));
            i.push((Coefficient::MINUS_ONE, forward));
        }
        out.equations.push(branch);
        push_ideal(out, pair, name, (reverse, forward));
    }
    out.equations.push(v);
    out.equations.push(i);
}

/// Adds an ideal pair between these columns to the law of `pair`, which it is a part of.
fn push_ideal(
    out: &mut StaticMultiport,
    pair: &Pair,
    name: String,
    (reverse, forward): (usize, usize),
) {
    let mut port = pair.port.clone();
    port.law = Law::ideal_diode();
    port.role = Role::Voltage;
    port.device = name;
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

fn expand(out: &mut StaticMultiport, pair: &Pair, curve: Curve) {
    let shape = shape(curve);
    let count = shape.pieces.len();
    let device = &pair.port.device;
    out.internal.push(pair.reverse);
    out.internal.push(pair.forward);
    // One equation a coordinate; devices carry −v in their reverse column.
    let along_v = if pair.fixed_role {
        Coefficient::MINUS_ONE
    } else {
        Coefficient::ONE
    };
    let mut v: Equation = vec![
        (along_v, pair.reverse),
        (shape.corner.0, StaticMultiport::ONE),
    ];
    let mut i: Equation = vec![
        (Coefficient::MINUS_ONE, pair.forward),
        (shape.corner.1, StaticMultiport::ONE),
    ];
    let mut slack = out.column(format!("{device}.a"));
    v.push((shape.first.0.negated(), slack));
    i.push((shape.first.1.negated(), slack));
    let mut pairs = Vec::new();
    for (k, (terms, length)) in shape.pieces.into_iter().enumerate() {
        let t = out.column(format!("{device}.t{}", k + 1));
        pairs.push((slack, t));
        for (dv, di) in terms {
            v.push((dv, t));
            i.push((di, t));
        }
        if k + 1 < count {
            // s + t = T
            slack = out.column(format!("{device}.s{}", k + 1));
            out.equations.push(vec![
                (Coefficient::ONE, slack),
                (Coefficient::ONE, t),
                (
                    Coefficient::Minus(Value::binary(length)),
                    StaticMultiport::ONE,
                ),
            ]);
        }
    }
    out.equations.push(v);
    out.equations.push(i);
    for (k, (reverse, forward)) in pairs.into_iter().enumerate() {
        let name = if count > 1 {
            format!("{device}.{}", k + 1)
        } else {
            device.clone()
        };
        push_ideal(out, pair, name, (reverse, forward));
    }
}
