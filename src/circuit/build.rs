//! Circuits made by a program, element by element.

use super::{
    Affine, Circuit, Coupling, Element, ElementId, Kind, NodeId, Probe, Probed, Quantity, Source,
    Switch, Tran,
};
use crate::algebra::Value;
use crate::law::Law;

/// Nodes are named where they first occur; `"0"` is ground. Values are in SI units, and an element's current flows from its first node
/// to its second.
impl Circuit {
    /// A circuit of nothing but ground.
    #[must_use]
    pub fn named(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            nodes: vec!["0".into()],
            ..Self::default()
        }
    }

    /// The node of this name, made if there is none.
    pub fn node_or_new(&mut self, name: &str) -> NodeId {
        self.node(name).unwrap_or_else(|| {
            self.nodes.push(name.into());
            NodeId(self.nodes.len() as u32 - 1)
        })
    }

    /// An element of any kind between two nodes.
    pub fn element_between(&mut self, name: &str, nodes: [&str; 2], kind: Kind) -> &mut Self {
        let [p, n] = nodes.map(|node| self.node_or_new(node));
        self.elements.push(Element {
            name: name.into(),
            p,
            n,
            kind,
            ic: None,
            span: None,
        });
        self
    }

    /// A resistance, Ω; zero is a short.
    pub fn resistor(&mut self, name: &str, nodes: [&str; 2], ohms: f64) -> &mut Self {
        self.element_between(name, nodes, Kind::Resistor(Value::binary(ohms)))
    }

    /// A capacitance, F.
    pub fn capacitor(&mut self, name: &str, nodes: [&str; 2], farads: f64) -> &mut Self {
        self.element_between(name, nodes, Kind::Capacitor(Value::binary(farads)))
    }

    /// An inductance, H.
    pub fn inductor(&mut self, name: &str, nodes: [&str; 2], henries: f64) -> &mut Self {
        self.element_between(name, nodes, Kind::Inductor(Value::binary(henries)))
    }

    /// Two inductors, of these names, with a coupling −1 ≤ k ≤ 1; nothing where one of them is not there.
    pub fn coupling(&mut self, name: &str, inductors: [&str; 2], k: f64) -> &mut Self {
        if let [Some(a), Some(b)] = inductors.map(|inductor| self.element(inductor)) {
            self.couplings.push(Coupling {
                name: name.into(),
                a,
                b,
                k: Value::binary(k),
                span: None,
            });
        }
        self
    }

    /// A voltage source, V from its first node to its second.
    pub fn voltage_source(&mut self, name: &str, nodes: [&str; 2], source: Source) -> &mut Self {
        self.element_between(name, nodes, Kind::VoltageSource(source))
    }

    /// A current source, A through it from its first node to its second.
    pub fn current_source(&mut self, name: &str, nodes: [&str; 2], source: Source) -> &mut Self {
        self.element_between(name, nodes, Kind::CurrentSource(source))
    }

    /// An ideal diode from anode to cathode.
    pub fn diode(&mut self, name: &str, nodes: [&str; 2]) -> &mut Self {
        self.element_between(name, nodes, Kind::Device(Law::ideal_diode()))
    }

    /// An ideal switch, on while the voltage between the nodes of its control is above a threshold, V.
    pub fn switch(
        &mut self,
        name: &str,
        nodes: [&str; 2],
        control: [&str; 2],
        threshold: f64,
    ) -> &mut Self {
        let [a, b] = control.map(|node| self.node_or_new(node));
        let one = Value::decimal(1.0, 1, 0);
        let switch = Switch {
            control: Affine {
                terms: vec![
                    (one, Quantity::Voltage(a)),
                    (one.negated(), Quantity::Voltage(b)),
                ],
                constant: 0.0,
            },
            ron: Value::decimal(0.0, 0, 0),
            roff: None,
            on_above: threshold,
            off_below: threshold,
            initial: None,
            latch: None,
        };
        self.element_between(name, nodes, Kind::Switch(switch))
    }

    /// The initial value of the last element: V of a capacitor, A of an inductor.
    pub fn initially(&mut self, value: f64) -> &mut Self {
        if let Some(last) = self.elements.last_mut() {
            last.ic = Some(value);
        }
        self
    }

    /// Shows a node's voltage.
    pub fn show_voltage(&mut self, node: &str) -> &mut Self {
        let node = self.node_or_new(node);
        let name = format!("v({})", self.nodes[node.index()]);
        let what = Probed::Voltage(node, NodeId::GROUND);
        self.probes.push(Probe { name, what });
        self
    }

    /// Shows the current of an element; nothing where it is not there.
    pub fn show_current(&mut self, element: &str) -> &mut Self {
        if let Some(id) = self.element(element) {
            let name = format!("i({element})");
            let what = Probed::Current(ElementId(id.0));
            self.probes.push(Probe { name, what });
        }
        self
    }

    /// Has it simulated from its initial values to `until` with rows `step` apart, s.
    pub fn transient(&mut self, step: f64, until: f64) -> &mut Self {
        self.tran = Some(Tran {
            tstep: step,
            prints: true,
            tstop: until,
            tstart: 0.0,
            tmax: None,
            uic: true,
        });
        self
    }
}

impl Circuit {
    /// The value of an element (Ω, F, H; V or A of a source at rest), else of a parameter that something uses.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<f64> {
        let Some(id) = self.element(name) else {
            let own = self.params.iter().find(|(own, _)| own == name);
            return own.map(|(_, value)| *value);
        };
        match &self.elements[id.index()].kind {
            Kind::Resistor(v) | Kind::Capacitor(v) | Kind::Inductor(v) => Some(v.f64),
            Kind::VoltageSource(source) | Kind::CurrentSource(source) => Some(source.dc),
            _ => None,
        }
    }
}

impl Kind {
    /// Gives a resistor, capacitor, inductor or constant source another value; nothing else has one.
    pub(crate) fn set_value(&mut self, to: f64) {
        match self {
            Self::Resistor(value) | Self::Capacitor(value) | Self::Inductor(value) => {
                *value = Value::binary(to);
            }
            Self::VoltageSource(source) | Self::CurrentSource(source) => {
                *source = Source::constant(to);
            }
            _ => {}
        }
    }
}
