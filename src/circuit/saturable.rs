//! L with `Flux=` and C with `Q=`: storage whose flux φ(x) of its current x, or charge q(x) of its voltage x, is piecewise linear.
//!
//! The state is u = φ/L₀ with the largest slope L₀ of φ, in amperes: the current of an inductance L₀ that has the voltage of the
//! card, L₀ u̇ = v. The inductor itself is the current i = φ⁻¹(L₀ u), a nondecreasing function of u, so that the co-energy ∫ φ di is
//! convex. A capacitor is the same with voltage and current exchanged: C₀ u̇ = i and v = q⁻¹(C₀ u).

use super::builder::Builder;
use super::form::{Form, Ridge};
use super::model::ONE;
use super::passive::Args;
use super::piecewise::Piecewise;
use super::scope::ScopeId;
use super::{Affine, Element, ElementId, Kind, NodeId, Output, Quantity};
use crate::algebra::Value;
use crate::diagnostic::Diagnostic;
use crate::law::{Curve, Law};
use crate::netlist::ast::{self, Assign, Expr};

/// What `x` is while the expression is read: no element has this number.
const X: Quantity = Quantity::Current(ElementId(u32::MAX));
/// Parameters of LTspice's core with hysteresis.
const CORE: [&str; 3] = ["hc", "bs", "br"];

impl<'n> Builder<'n, '_> {
    /// Adds storage with a characteristic, if the card has one; whether it has.
    pub(super) fn saturable(
        &mut self,
        card: &'n ast::Element,
        args: &'n [Assign],
        scope: ScopeId,
    ) -> bool {
        let inductor = card.name.text.starts_with('l');
        let core = args.iter().find(|a| CORE.contains(&a.name.text.as_str()));
        if let Some(core) = core.filter(|_| inductor) {
            let message = format!(
                "`{}` is LTspice's core with hysteresis (Hc Bs Br A Lm Lg N), which is not simulated",
                card.name.text
            );
            self.tell(
                Diagnostic::error("unsupported", core.name.span, message)
                    .label("a loop, not a curve")
                    .help("without hysteresis write `Flux=table(x, i1, flux1, i2, flux2, …)`, with x the current"),
            );
            return true;
        }
        let name = if inductor { "flux" } else { "q" };
        let Some(expr) = Args(args).get(&[name]) else {
            return false;
        };
        let own = [name, "ic", "rser", "lser", "rpar", "cpar", "rlshunt"];
        let beside = args.iter().find(|a| {
            let text = a.name.text.as_str();
            ["l", "c", "value", "m", "scale"].contains(&text)
        });
        if let Some(beside) = beside {
            let message = format!("`{}` beside `{name}=` is not simulated", beside.name.text);
            self.tell(
                Diagnostic::error("unsupported", beside.name.span, message).label("not supported"),
            );
            return true;
        }
        self.check_args(card, args, &own);
        if let Some(curve) = self.characteristic(expr, scope)
            && let Some(ic) = self.arg(Args(args), &["ic"], scope)
        {
            let ic = ic.map(|ic| ic.f64);
            self.store(card, &curve, ic, Args(args), scope);
        }
        true
    }

    /// The characteristic as vertices (x, φ) and the directions of its rays: continuous, and rising everywhere.
    fn characteristic(&mut self, expr: &'n Expr, scope: ScopeId) -> Option<Curve> {
        let Form {
            constant,
            terms,
            ridges,
        } = self.scopes.form_of(expr, scope, ("x", X))?;
        let slope: f64 = terms.iter().map(|(gain, _)| gain.f64).sum();
        let mut whole = Piecewise::line(slope, constant.f64);
        let mut alone = true;
        for Ridge { along, curve } in &ridges {
            alone &= matches!(along[..], [(_, X)]);
            let gain = along.first().map_or(1.0, |(gain, _)| gain.f64);
            let part = Piecewise::line(gain, 0.0).then(curve);
            match part {
                Some(part) => whole = whole.plus(&part),
                None => alone = false,
            }
        }
        let curve = match whole.as_line() {
            Some((slope, constant)) => Some(Curve {
                kind: "table",
                vertices: vec![(Value::binary(0.0), Value::binary(constant))],
                first: (ONE, Value::binary(slope)),
                last: (ONE, Value::binary(slope)),
            }),
            None => match whole.monotone() {
                (linear, parts) if linear == 0.0 && parts.len() == 1 && parts[0].sign > 0.0 => {
                    parts.into_iter().next().map(|part| part.curve)
                }
                _ => None,
            },
        };
        let rising = curve.filter(|curve| alone && rises(curve));
        if rising.is_none() {
            let message =
                format!("`{expr}` is no function of x alone that rises everywhere, without jumps");
            self.tell(
                Diagnostic::error("not-linear", expr.span, message)
                    .label("needs an inverse")
                    .help("a slope above 0 on either side of every corner, as in `table`'s place `pwl(x, -2, -1.2m, -1, -1m, 1, 1m, 2, 1.2m)`"),
            );
        }
        rising
    }

    fn store(
        &mut self,
        card: &'n ast::Element,
        curve: &Curve,
        ic: Option<f64>,
        args: Args<'n>,
        scope: ScopeId,
    ) {
        let inductor = card.name.text.starts_with('l');
        let [p, n] = [0, 1].map(|k| self.node(&card.nodes[k], scope));
        let full = self.full_name(&card.name, scope);
        let (state, rate) = if inductor {
            (format!("{full}.flux"), format!("{full}.rate"))
        } else {
            (format!("{full}.charge"), format!("{full}.rate"))
        };
        let node = self.new_node(state.clone());
        let largest = slopes(curve).fold(0.0, f64::max);
        let part = |name: String, p: NodeId, n: NodeId, kind: Kind| Element {
            name,
            p,
            n,
            kind,
            ic: None,
            span: Some(card.span),
        };
        let output = if inductor {
            Output::Current
        } else {
            Output::Voltage
        };
        let [node_id, ground] = [node, NodeId::GROUND];
        // The state before the function of it, whose number it needs.
        let storage = Kind::Inductor(Value::binary(largest));
        let Some(state) = self.add(Element {
            ic: ic.map(|x| at(curve, x) / largest),
            ..part(state, node_id, ground, storage)
        }) else {
            return;
        };
        let own = Kind::Function {
            output,
            input: follows(Quantity::Current(state)),
            law: Law::Curve(inverse(curve, largest)),
        };
        self.with_parasitics(part(full.clone(), p, n, own), args, scope);
        let Some(&id) = self.names.elements.get(&full) else {
            return;
        };
        let end = self.circuit.elements[id.index()].n;
        let mut control = follows(Quantity::Current(id));
        if inductor {
            control = follows(Quantity::Voltage(p));
            control.terms.push((ONE.negated(), Quantity::Voltage(end)));
        }
        let rate_of_change = Kind::Controlled {
            output: Output::Voltage,
            control,
        };
        self.add(part(rate, node_id, ground, rate_of_change));
    }
}

/// One quantity as it is.
fn follows(quantity: Quantity) -> Affine {
    Affine {
        terms: vec![(ONE, quantity)],
        constant: 0.0,
    }
}

/// The slopes of all pieces, from left to right.
fn slopes(curve: &Curve) -> impl Iterator<Item = f64> {
    let inner = curve.vertices.windows(2);
    let inner = inner.map(|w| (w[1].1.f64 - w[0].1.f64) / (w[1].0.f64 - w[0].0.f64));
    let ray = |(dx, dy): (Value, Value)| dy.f64 / dx.f64;
    std::iter::once(ray(curve.first))
        .chain(inner)
        .chain([ray(curve.last)])
}

fn rises(curve: &Curve) -> bool {
    slopes(curve).all(|slope| slope.is_finite() && slope > 0.0)
}

/// The value at x.
fn at(curve: &Curve, x: f64) -> f64 {
    let k = curve.vertices.partition_point(|(u, _)| u.f64 <= x);
    let slope = slopes(curve).nth(k).unwrap_or(0.0);
    let (u, y) = curve.vertices[k.saturating_sub(1)];
    y.f64 + slope * (x - u.f64)
}

/// x over φ/L₀.
fn inverse(curve: &Curve, largest: f64) -> Curve {
    let swap = |&(x, y): &(Value, Value)| (Value::binary(y.f64 / largest), x);
    Curve {
        kind: "table",
        vertices: curve.vertices.iter().map(swap).collect(),
        first: swap(&curve.first),
        last: swap(&curve.last),
    }
}
