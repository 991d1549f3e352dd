//! What is controlled and what is read: affine functions of potentials and currents.

use super::assemble::Assembly;
use super::{Coefficient, Equation, Observed, Power, StaticMultiport};
use crate::algebra::Value;
use crate::circuit::{Affine, ElementId, Kind, Output, Probed, Quantity};
use crate::lcs::PowerKind;

impl Assembly<'_> {
    fn affine(&self, affine: &Affine) -> Equation {
        let mut equation = Equation::new();
        let scaled = |gain: Value, c: Coefficient| match c {
            Coefficient::MINUS_ONE => Coefficient::Minus(gain),
            _ => Coefficient::Plus(gain),
        };
        for &(gain, quantity) in &affine.terms {
            match quantity {
                Quantity::Voltage(node) => {
                    equation
                        .extend(self.potential[node.index()].map(|c| (Coefficient::Plus(gain), c)));
                }
                Quantity::Current(element) => {
                    for (c, column) in self.current(element) {
                        equation.push((scaled(gain, c), column));
                    }
                }
            }
        }
        if affine.constant != 0.0 {
            equation.push((
                Coefficient::Plus(Value::binary(affine.constant)),
                StaticMultiport::ONE,
            ));
        }
        equation
    }

    /// The current of an element as ±1 combination of columns (a resistor's gets its own column in `outputs`).
    fn current(&self, element: ElementId) -> Equation {
        self.branches[element.index()].current.clone()
    }

    /// Gives every resistor whose current controls something a column of its own, then states controlled outputs.
    pub(super) fn outputs(&mut self) {
        let circuit = self.circuit;
        let affines = circuit.elements.iter().filter_map(|e| match &e.kind {
            Kind::Controlled { control, .. } => Some(control),
            Kind::Function { input, .. } => Some(input),
            Kind::Switch(s) => Some(&s.control),
            _ => None,
        });
        let controls: Vec<ElementId> = affines
            .flat_map(|a| a.terms.iter())
            .filter_map(|(_, q)| match q {
                Quantity::Current(e) => Some(*e),
                Quantity::Voltage(_) => None,
            })
            .collect();
        for element in controls {
            let k = element.index();
            if matches!(circuit.elements[k].kind, Kind::Resistor(v) if v.f64 != 0.0)
                && self.branches[k].current.len() != 1
                || self.branches[k]
                    .current
                    .iter()
                    .any(|(c, _)| !matches!(*c, Coefficient::ONE))
            {
                let column = self.internal(format!("i({})", circuit.elements[k].name));
                let mut equation = self.branches[k].current.clone();
                equation.push((Coefficient::MINUS_ONE, column));
                self.out.equations.push(equation);
                self.branches[k].current = vec![(Coefficient::ONE, column)];
            }
        }
        for (k, element) in circuit.elements.iter().enumerate() {
            match &element.kind {
                Kind::Controlled { output, control } => {
                    let mut equation = match output {
                        Output::Voltage => self.voltage(element.p, element.n),
                        Output::Current => self.branches[k].current.clone(),
                    };
                    equation.extend(
                        self.affine(control)
                            .into_iter()
                            .map(|(c, col)| (c.negated(), col)),
                    );
                    self.out.equations.push(equation);
                }
                Kind::Function { input, .. } => {
                    let y = self
                        .out
                        .pairs
                        .iter()
                        .find(|p| p.port.device == element.name)
                        .map(|p| p.reverse);
                    if let Some(y) = y {
                        let mut equation = self.affine(input);
                        equation.push((Coefficient::MINUS_ONE, y));
                        self.out.equations.push(equation);
                    }
                }
                _ => {}
            }
        }
    }

    fn observed(&mut self, name: String, unit: &'static str, mut equation: Equation) -> usize {
        let column = self.out.column(name.clone());
        equation.reserve_exact(1);
        equation.push((Coefficient::MINUS_ONE, column));
        self.out.equations.push(equation);
        self.out.observed.push(Observed { name, unit, column });
        self.out.observed.len() - 1
    }

    /// Probes, switch controls and the two factors of every power.
    pub(super) fn observe(&mut self) {
        let circuit = self.circuit;
        for probe in circuit.probes() {
            let (unit, equation) = match probe.what {
                Probed::Voltage(a, b) => ("V", self.voltage(a, b)),
                Probed::Current(e) => ("A", self.current(e)),
            };
            self.observed(probe.name, unit, equation);
        }
        self.out.probes = self.out.observed.len();
        // The switches stand in the order of their elements.
        let switches = circuit.elements.iter().filter_map(|e| match &e.kind {
            Kind::Switch(switch) => Some((&e.name, &switch.control)),
            _ => None,
        });
        for (k, (name, control)) in switches.enumerate() {
            let equation = self.affine(control);
            self.out.switches[k].control = self.observed(format!("{name}.control"), "V", equation);
        }
        let ports = circuit.lines.iter().flat_map(|line| &line.ports);
        let of_lines: Vec<usize> = ports
            .flat_map(|port| [port.impedance.index(), port.wave.index()])
            .collect();
        let logic = circuit.logic();
        for (k, element) in circuit.elements.iter().enumerate() {
            let kind = match &element.kind {
                Kind::Capacitor(_) | Kind::Inductor(_) => continue,
                _ if logic[k] => PowerKind::Logic,
                _ if of_lines.contains(&k) => PowerKind::Line,
                Kind::VoltageSource(_)
                | Kind::CurrentSource(_)
                | Kind::Controlled { .. }
                | Kind::Function { .. } => PowerKind::Source,
                Kind::Resistor(_) | Kind::Device(_) | Kind::Switch(_) => PowerKind::Dissipated,
            };
            let v = self.observed(
                format!("v({})", element.name),
                "V",
                self.voltage(element.p, element.n),
            );
            let i = self.observed(
                format!("i({})", element.name),
                "A",
                self.branches[k].current.clone(),
            );
            self.out.power.push(Power {
                element: element.name.clone(),
                kind,
                v,
                i,
            });
        }
    }
}
