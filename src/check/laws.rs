//! Device laws as the theorems see them.

use crate::law::Law;
use crate::lcs::Role;

/// A closed interval, possibly unbounded.
pub(super) type Interval = (f64, f64);

/// What a theorem needs of a port's law −λ ∈ ∂φ(y).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PortLaw {
    /// The device, for messages.
    pub(super) device: String,
    /// 0 ≤ λ ⟂ y ≥ 0 after the offsets of the normal form: φ is the indicator of [0, ∞).
    pub(super) half_line: bool,
    /// Closure of dom φ^{*,−}: the values of λ.
    pub(super) lambda: Interval,
    /// Closure of dom φ: the values of y.
    pub(super) y: Interval,
    /// φ^{*,−}(z) ≥ φ^{*,−}(0): the law passes through λ = 0, y = 0.
    pub(super) through_origin: bool,
    /// φ^{*,−}(z) > φ^{*,−}(0) for z ≠ 0: y = 0 only at λ = 0.
    pub(super) strictly: bool,
    /// The same with λ and y exchanged: λ = 0 only at y = 0.
    pub(super) strictly_swapped: bool,
}

impl PortLaw {
    /// The law with λ and y exchanged.
    pub(super) fn swapped(&self) -> Self {
        Self {
            lambda: self.y,
            y: self.lambda,
            strictly: self.strictly_swapped,
            strictly_swapped: self.strictly,
            ..self.clone()
        }
    }
}

/// The corner points and rays of a law in the (v, i) plane.
struct Graph {
    first: (f64, f64),
    vertices: Vec<(f64, f64)>,
    last: (f64, f64),
}

impl Graph {
    fn of(law: &Law) -> Self {
        match law {
            Law::Diode { vfwd, ron, roff } => {
                let g = roff.map_or(0.0, |r| 1.0 / r.f64);
                let last = if ron.f64 == 0.0 {
                    (0.0, 1.0)
                } else {
                    (ron.f64, 1.0)
                };
                Self {
                    first: (1.0, g),
                    vertices: vec![(vfwd.f64, vfwd.f64 * g)],
                    last,
                }
            }
            Law::Curve(curve) => Self {
                first: (curve.first.0.f64, curve.first.1.f64),
                vertices: curve.vertices.iter().map(|(v, i)| (v.f64, i.f64)).collect(),
                last: (curve.last.0.f64, curve.last.1.f64),
            },
            Law::Rounded(diode) => Self {
                first: match diode.reverse {
                    Some(corner) => (1.0, corner.g),
                    None => (1.0, diode.g),
                },
                vertices: (diode.reverse.iter().map(|c| -c.v))
                    .chain([diode.forward.v])
                    .map(|v| (v, diode.g * v))
                    .collect(),
                last: (1.0, diode.forward.g),
            },
            // The hull that has the same bounds and the same zero.
            Law::Exponential(diode) => Self {
                first: if diode.breakdown.is_some() {
                    (1.0, 1.0)
                } else {
                    (1.0, 0.0)
                },
                vertices: vec![(-diode.slope, -diode.is), (0.0, 0.0)],
                last: (1.0, 1.0),
            },
        }
    }

    fn v(&self) -> Interval {
        let low = if self.first.0 > 0.0 {
            f64::NEG_INFINITY
        } else {
            self.vertices[0].0
        };
        let high = if self.last.0 > 0.0 {
            f64::INFINITY
        } else {
            self.vertices[self.vertices.len() - 1].0
        };
        (low, high)
    }

    fn i(&self) -> Interval {
        let low = if self.first.1 > 0.0 {
            f64::NEG_INFINITY
        } else {
            self.vertices[0].1
        };
        let high = if self.last.1 > 0.0 {
            f64::INFINITY
        } else {
            self.vertices[self.vertices.len() - 1].1
        };
        (low, high)
    }

    /// The pieces as pairs of end points, rays cut far out.
    fn pieces(&self) -> Vec<((f64, f64), (f64, f64))> {
        let far = 1e3
            * self
                .vertices
                .iter()
                .map(|p| p.0.abs().max(p.1.abs()))
                .fold(1.0, f64::max);
        let unit = |d: (f64, f64)| {
            let size = d.0.abs().max(d.1.abs()).max(f64::MIN_POSITIVE);
            (d.0 / size * far, d.1 / size * far)
        };
        let (first, last) = (unit(self.first), unit(self.last));
        let (start, end) = (self.vertices[0], self.vertices[self.vertices.len() - 1]);
        let mut points = vec![(start.0 - first.0, start.1 - first.1)];
        points.extend(&self.vertices);
        points.push((end.0 + last.0, end.1 + last.1));
        points.windows(2).map(|w| (w[0], w[1])).collect()
    }

    /// The interval of `value` where `zero` vanishes, over all pieces; `None` if it never does.
    fn zeros(
        &self,
        zero: impl Fn((f64, f64)) -> f64,
        value: impl Fn((f64, f64)) -> f64,
    ) -> Option<Interval> {
        let mut found: Option<Interval> = None;
        for (a, b) in self.pieces() {
            let (za, zb) = (zero(a), zero(b));
            let at = |s: f64| value(a) + s * (value(b) - value(a));
            let hits: Vec<f64> = match (za == 0.0, zb == 0.0) {
                (true, true) => vec![value(a), value(b)],
                (true, false) => vec![value(a)],
                (false, true) => vec![value(b)],
                _ if za < 0.0 && zb > 0.0 => vec![at(za / (za - zb))],
                _ => vec![],
            };
            for hit in hits {
                let (low, high) = found.unwrap_or((hit, hit));
                found = Some((low.min(hit), high.max(hit)));
            }
        }
        found
    }
}

/// What the theorems need of a device's law.
pub(super) fn port_law(device: &str, role: Role, law: &Law) -> PortLaw {
    let graph = Graph::of(law);
    let contains_zero =
        |interval: Option<Interval>| interval.is_some_and(|(low, high)| low <= 0.0 && high >= 0.0);
    let only_zero = |interval: Option<Interval>| interval == Some((0.0, 0.0));
    let negated = |(low, high): Interval| (-high, -low);
    // Current: λ = i, y = −v. Voltage: λ = −v, y = i. A function block's output grows with its input: the normal form takes
    // λ = −output, so that −λ ∈ ∂φ(y).
    let i_where_v_vanishes = graph.zeros(|p| p.0, |p| p.1);
    let v_where_i_vanishes = graph.zeros(|p| p.1, |p| p.0);
    let (lambda, y, zero_set, swapped) = match role {
        Role::Current => (
            graph.i(),
            negated(graph.v()),
            i_where_v_vanishes,
            v_where_i_vanishes,
        ),
        Role::Voltage => (
            negated(graph.v()),
            graph.i(),
            v_where_i_vanishes,
            i_where_v_vanishes,
        ),
        Role::Function => (
            negated(graph.i()),
            graph.v(),
            i_where_v_vanishes,
            v_where_i_vanishes,
        ),
    };
    PortLaw {
        device: device.to_string(),
        half_line: false,
        lambda,
        y,
        through_origin: contains_zero(zero_set),
        strictly: only_zero(zero_set),
        strictly_swapped: only_zero(swapped),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::{Corner, Rounded};

    #[test]
    fn the_corners_of_a_rounded_diode_lie_on_its_leakage() {
        let corner = |v, g| Corner { v, g, width: 0.1 };
        let law = Law::Rounded(Rounded {
            g: 1e-3,
            forward: corner(0.7, 10.0),
            reverse: Some(corner(5.0, 2.0)),
        });
        let graph = Graph::of(&law);
        assert_eq!(graph.vertices, [(-5.0, -5e-3), (0.7, 0.7 * 1e-3)]);
        assert_eq!((graph.first, graph.last), ((1.0, 2.0), (1.0, 10.0)));
    }

    /// A conductance of 1 S behind a source of 1 MA: the only corner lies at −1 MA, and no current flows at 1 MV.
    #[test]
    fn a_ray_reaches_beyond_the_largest_coordinate_of_either_sign() {
        for sign in [-1.0, 1.0] {
            let graph = Graph {
                first: (1.0, 1.0),
                vertices: vec![(0.0, sign * 1e6)],
                last: (1.0, 1.0),
            };
            let open = graph.zeros(|p| p.1, |p| p.0).expect("it crosses");
            for end in [open.0, open.1] {
                assert!((end + sign * 1e6).abs() < 1e-3, "{open:?}");
            }
        }
    }
}
