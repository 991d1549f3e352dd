//! Behavioural elements: affine, a function of one input, a waveform, or a sum over auxiliary nodes.

use super::behaviour::{Auxiliary, TIME, auxiliary, is_time};
use super::builder::Builder;
use super::form::{Form, Ridge};
use super::piecewise::Piecewise;
use super::source::{Source, Wave};
use super::tones::at_node;
use super::{Affine, Element, ElementId, Kind, NodeId, Output, Quantity};
use crate::algebra::Value;
use crate::law::{Curve, Law};

impl<'n> Builder<'n, '_> {
    /// Notes the nodes that a DC source holds against ground.
    pub(super) fn find_rails(&mut self) {
        if let Some(tran) = self.circuit.tran {
            self.scopes.tstop = tran.tstop;
        }
        self.scopes.tones = self.circuit.elements.iter().filter_map(at_node).collect();
        for element in &self.circuit.elements {
            let Kind::VoltageSource(Source {
                dc,
                wave: Wave::Dc(volts),
            }) = element.kind
            else {
                continue;
            };
            let (node, volts) = match (element.p, element.n) {
                (p, NodeId::GROUND) => (p, volts),
                (NodeId::GROUND, n) => (n, -volts),
                _ => continue,
            };
            if dc.abs() == volts.abs() {
                self.scopes.rails.insert(node, volts);
            }
        }
    }

    /// Gives a controlled element or switch what it follows.
    pub(super) fn place(&mut self, id: ElementId, form: Form) {
        let kind = match &self.circuit.elements[id.index()].kind {
            Kind::Controlled { output, .. } => {
                let output = *output;
                self.kind_of(output, form)
            }
            Kind::Switch(switch) => {
                let mut switch = switch.clone();
                switch.follow(self.scopes.affine(form).into_affine());
                Kind::Switch(switch)
            }
            _ => return,
        };
        self.circuit.elements[id.index()].kind = kind;
        self.add_auxiliaries(id);
        let own = self.circuit.elements[id.index()].kind.clone();
        self.circuit.elements[id.index()].kind = self.with_nodes(id, own);
    }

    fn kind_of(&mut self, output: Output, form: Form) -> Kind {
        if let Some(wave) = self.waveform(&form) {
            let source = Source::new(None, wave);
            return match output {
                Output::Voltage => Kind::VoltageSource(source),
                Output::Current => Kind::CurrentSource(source),
            };
        }
        if let ([], [ridge]) = (&form.terms[..], &form.ridges[..])
            && let Some((input, curve)) = one_curve(ridge)
        {
            return Kind::Function {
                output,
                input: Affine {
                    terms: input,
                    constant: 0.0,
                },
                law: Law::Curve(shifted(curve, form.constant)),
            };
        }
        Kind::Controlled {
            output,
            control: self.scopes.affine(form).into_affine(),
        }
    }

    /// The waveform that a form of time alone is.
    fn waveform(&self, form: &Form) -> Option<Wave> {
        let constant = form.constant.f64;
        match (&form.terms[..], &form.ridges[..]) {
            ([], [Ridge { along, curve }]) if is_time(along) => {
                let points = curve.points(0.0, self.scopes.tstop);
                Some(Wave::Pwl {
                    points: points.into_iter().map(|(t, v)| (t, v + constant)).collect(),
                    repeat: None,
                    delay: 0.0,
                })
            }
            ([(gain, quantity)], []) if *quantity == TIME => {
                let end = self.scopes.tstop;
                Some(Wave::Pwl {
                    points: vec![(0.0, constant), (end, constant + gain.f64 * end)],
                    repeat: None,
                    delay: 0.0,
                })
            }
            ([(gain, quantity)], []) => {
                let waves = self.scopes.auxiliaries.iter().enumerate();
                let mut own = waves.filter(|(k, _)| auxiliary(*k) == *quantity);
                match own.next() {
                    Some((_, Auxiliary::Wave(wave))) => scaled(wave, gain.f64, constant),
                    _ => None,
                }
            }
            _ => None,
        }
    }

    /// The auxiliary sources that this element was the first to need.
    fn add_auxiliaries(&mut self, owner: ElementId) {
        let name = self.circuit.elements[owner.index()].name.clone();
        let span = self.circuit.elements[owner.index()].span;
        let used = |kind: &Kind, index: usize| {
            let wanted = auxiliary(index);
            inputs(kind).is_some_and(|a| a.terms.iter().any(|(_, q)| *q == wanted))
        };
        let first = self.auxiliary_nodes.len();
        let count = self.scopes.auxiliaries.len();
        let mut needed = vec![false; count];
        for k in (0..count).rev() {
            let by_later = (k + 1..count).any(|later| {
                needed[later]
                    && matches!(&self.scopes.auxiliaries[later], Auxiliary::Curve(along, _)
                        if along.iter().any(|(_, q)| *q == auxiliary(k)))
            });
            needed[k] = by_later || used(&self.circuit.elements[owner.index()].kind, k);
        }
        self.auxiliary_nodes.resize(count.max(first), None);
        for (k, _) in needed.iter().enumerate().filter(|(_, needed)| **needed) {
            if self.auxiliary_nodes[k].is_some() {
                continue;
            }
            let part = format!("{name}.{}", k + 1);
            let node = self.new_node(part.clone());
            self.auxiliary_nodes[k] = Some(node);
            let kind = match self.scopes.auxiliaries[k].clone() {
                Auxiliary::Curve(terms, curve) => Kind::Function {
                    output: Output::Voltage,
                    input: Affine {
                        terms,
                        constant: 0.0,
                    },
                    law: Law::Curve(*curve),
                },
                Auxiliary::Wave(wave) => Kind::VoltageSource(Source::new(None, wave)),
            };
            let kind = self.with_nodes(owner, kind);
            self.add(Element {
                name: part,
                p: node,
                n: NodeId::GROUND,
                kind,
                ic: None,
                span,
            });
        }
    }

    /// The same element with nodes in place of [`TIME`] and [`auxiliary`].
    fn with_nodes(&mut self, owner: ElementId, mut kind: Kind) -> Kind {
        let by_time = inputs(&kind).is_some_and(|a| a.terms.iter().any(|(_, q)| *q == TIME));
        let time = if by_time {
            Some(self.time_node(owner))
        } else {
            None
        };
        let nodes = &self.auxiliary_nodes;
        let own = match &mut kind {
            Kind::Controlled { control, .. } => control,
            Kind::Function { input, .. } => input,
            Kind::Switch(switch) => &mut switch.control,
            _ => return kind,
        };
        for (_, quantity) in &mut own.terms {
            if *quantity == TIME {
                *quantity = time.map_or(TIME, Quantity::Voltage);
            } else if let Some(node) = (0..nodes.len())
                .find(|k| *quantity == auxiliary(*k))
                .and_then(|k| nodes[k])
            {
                *quantity = Quantity::Voltage(node);
            }
        }
        kind
    }

    /// A node whose voltage is the time in seconds.
    fn time_node(&mut self, owner: ElementId) -> NodeId {
        if let Some(node) = self.clock {
            return node;
        }
        let name = format!("{}.time", self.circuit.elements[owner.index()].name);
        let node = self.new_node(name.clone());
        self.clock = Some(node);
        let end = self.scopes.tstop;
        let wave = Wave::Pwl {
            points: vec![(0.0, 0.0), (end, end)],
            repeat: None,
            delay: 0.0,
        };
        self.add(Element {
            name,
            p: node,
            n: NodeId::GROUND,
            kind: Kind::VoltageSource(Source { dc: 0.0, wave }),
            ic: None,
            span: self.circuit.elements[owner.index()].span,
        });
        node
    }
}

fn inputs(kind: &Kind) -> Option<&Affine> {
    match kind {
        Kind::Controlled { control, .. } => Some(control),
        Kind::Function { input, .. } => Some(input),
        Kind::Switch(switch) => Some(&switch.control),
        _ => None,
    }
}

/// A ridge as one nondecreasing function of a sum; a falling one of the negated sum.
fn one_curve(ridge: &Ridge) -> Option<(Vec<(Value, Quantity)>, Curve)> {
    let (linear, mut parts) = ridge.curve.monotone();
    let part = parts.pop()?;
    if linear != 0.0 || !parts.is_empty() {
        return None;
    }
    if part.sign > 0.0 {
        return Some((ridge.along.clone(), part.curve));
    }
    let mirrored = Piecewise::line(-1.0, 0.0).then(&ridge.curve)?;
    let along = ridge.along.iter().map(|&(gain, q)| (gain.negated(), q));
    let (_, mut parts) = mirrored.monotone();
    Some((along.collect(), parts.pop()?.curve))
}

/// The curve with a constant added to its output.
fn shifted(mut curve: Curve, by: Value) -> Curve {
    if by.f64 != 0.0 {
        for (_, output) in &mut curve.vertices {
            *output = Value::binary(output.f64 + by.f64);
        }
    }
    curve
}

/// gain·wave + constant, for the waves that expressions make.
fn scaled(wave: &Wave, gain: f64, constant: f64) -> Option<Wave> {
    let mut wave = wave.clone();
    match &mut wave {
        Wave::Sin {
            offset, amplitude, ..
        } => {
            *offset = *offset * gain + constant;
            *amplitude *= gain;
        }
        Wave::Exp { v1, v2, .. } => {
            *v1 = *v1 * gain + constant;
            *v2 = *v2 * gain + constant;
        }
        Wave::Pwl { points, .. } => {
            for (_, value) in points {
                *value = *value * gain + constant;
            }
        }
        _ => return None,
    }
    Some(wave)
}

#[cfg(test)]
mod tests;
