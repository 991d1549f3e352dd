//! From the circuit to the equations of its static multiport.

use std::collections::BTreeMap;

use super::couple::{self, Winding};
use super::{
    Coefficient, Column, Equation, LatchPort, Pair, SourcePort, StaticMultiport, StoragePort,
    SwitchPort, topology,
};
use crate::circuit::{Circuit, ElementId, Kind, Latch, NodeId, Output, Quantity};
use crate::diagnostic::{Diagnostic, Severity};
use crate::lcs::{Input, Port, Role};

/// What is known of an element's two quantities while assembling.
#[derive(Clone)]
pub(super) struct Branch {
    /// Its current as a combination of columns.
    pub(super) current: Equation,
}

pub(super) struct Assembly<'a> {
    pub(super) circuit: &'a Circuit,
    pub(super) out: StaticMultiport,
    pub(super) potential: Vec<Option<Column>>,
    pub(super) branches: Vec<Branch>,
    kcl: Vec<Equation>,
}

/// The behaviour of a circuit's static multiport.
///
/// # Errors
///
/// Every fault of the circuit that needs no reduction to see: no ground, impossible couplings.
pub fn behaviour(circuit: &Circuit) -> Result<StaticMultiport, Vec<Diagnostic>> {
    let mut faults = Vec::new();
    let mut out = StaticMultiport {
        title: circuit.title.clone(),
        graph: topology::edges(circuit),
        ..StaticMultiport::default()
    };
    out.column("1");
    let reference = references(circuit, &mut out.notes);
    let potential: Vec<Option<Column>> = circuit
        .nodes
        .iter()
        .enumerate()
        .map(|(n, name)| {
            (!reference[n]).then(|| {
                let column = out.column(format!("v({name})"));
                out.internal.push(column);
                column
            })
        })
        .collect();
    let mut assembly = Assembly {
        circuit,
        out,
        potential,
        branches: Vec::new(),
        kcl: vec![Vec::new(); circuit.nodes.len()],
    };
    let windings = match couple::couple(circuit) {
        Ok(windings) => windings,
        Err(found) => {
            faults.extend(found);
            Vec::new()
        }
    };
    if faults
        .iter()
        .any(|f: &Diagnostic| f.severity == Severity::Error)
    {
        return Err(faults);
    }
    assembly.branches(&windings);
    assembly.outputs();
    for (n, mut equation) in std::mem::take(&mut assembly.kcl).into_iter().enumerate() {
        if assembly.potential[n].is_some() && !equation.is_empty() {
            equation.shrink_to_fit();
            assembly.out.equations.push(equation);
        }
    }
    assembly.observe();
    Ok(assembly.out)
}

/// Which nodes are references: ground and the first node of each island.
fn references(circuit: &Circuit, notes: &mut Vec<Diagnostic>) -> Vec<bool> {
    let mut reference = vec![false; circuit.nodes.len()];
    if let Some(ground) = reference.first_mut() {
        *ground = true;
    }
    for island in topology::islands(circuit) {
        reference[island[0]] = true;
        let members: Vec<&str> = island.iter().map(|&k| circuit.nodes[k].as_str()).collect();
        notes.push(Diagnostic::note(
            "island",
            None,
            format!(
                "no path from ground to {}: potentials there are relative to node `{}`",
                list("node", &members),
                members[0]
            ),
        ));
    }
    reference
}

fn list(noun: &str, names: &[&str]) -> String {
    let shown: Vec<String> = names.iter().take(4).map(|n| format!("`{n}`")).collect();
    let more = names.len().saturating_sub(4);
    let plural = if names.len() == 1 { "" } else { "s" };
    let tail = if more > 0 {
        format!(" and {more} more")
    } else {
        String::new()
    };
    format!("{noun}{plural} {}{tail}", shown.join(", "))
}

impl Assembly<'_> {
    pub(super) fn voltage(&self, p: NodeId, n: NodeId) -> Equation {
        let mut terms = Vec::with_capacity(2);
        if p != n {
            terms.extend(self.potential[p.index()].map(|c| (Coefficient::ONE, c)));
            terms.extend(self.potential[n.index()].map(|c| (Coefficient::MINUS_ONE, c)));
        }
        terms
    }

    pub(super) fn internal(&mut self, name: String) -> Column {
        let column = self.out.column(name);
        self.out.internal.push(column);
        column
    }

    /// The current enters the element at `p` and leaves it at `n`.
    fn through(&mut self, p: NodeId, n: NodeId, current: &Equation) {
        for &(coefficient, column) in current {
            self.kcl[p.index()].push((coefficient, column));
            self.kcl[n.index()].push((coefficient.negated(), column));
        }
    }

    /// States `column = v(p) − v(n)`.
    fn branch_voltage(&mut self, column: Column, p: NodeId, n: NodeId) {
        let mut equation = self.voltage(p, n);
        equation.push((Coefficient::MINUS_ONE, column));
        self.out.equations.push(equation);
    }

    fn branches(&mut self, windings: &[Winding]) {
        for index in 0..self.circuit.elements.len() {
            let circuit = self.circuit;
            let element = &circuit.elements[index];
            let (name, p, n) = (&element.name, element.p, element.n);
            let current: Equation = match &element.kind {
                Kind::Resistor(ohms) if ohms.f64 == 0.0 => {
                    let i = self.internal(format!("i({name})"));
                    let short = self.voltage(p, n);
                    if short.is_empty() {
                        self.out.equations.push(vec![(Coefficient::ONE, i)]);
                    } else {
                        self.out.equations.push(short);
                    }
                    vec![(Coefficient::ONE, i)]
                }
                Kind::Resistor(ohms) => self
                    .voltage(p, n)
                    .into_iter()
                    .map(|(c, col)| {
                        let minus = c == Coefficient::MINUS_ONE;
                        (
                            if minus {
                                Coefficient::MinusInverse(*ohms)
                            } else {
                                Coefficient::Inverse(*ohms)
                            },
                            col,
                        )
                    })
                    .collect(),
                Kind::Capacitor(farads) => {
                    let (v, i) = (
                        self.out.column(format!("v({name})")),
                        self.out.column(format!("i({name})")),
                    );
                    self.branch_voltage(v, p, n);
                    if farads.f64 == 0.0 {
                        self.out.internal.push(v);
                        self.out.internal.push(i);
                        self.out.equations.push(vec![(Coefficient::ONE, i)]);
                    } else {
                        let k = self.out.storage.len();
                        self.out.metric.push((k, k, Coefficient::Plus(*farads)));
                        self.out.storage.push(StoragePort {
                            name: format!("v({name})"),
                            element: name.clone(),
                            capacitor: true,
                            state: v,
                            flow: i,
                            initial: element.ic,
                        });
                    }
                    vec![(Coefficient::ONE, i)]
                }
                Kind::Inductor(henries) => {
                    let i = self.internal(format!("i({name})"));
                    if henries.f64 == 0.0 {
                        let short = self.voltage(p, n);
                        self.out.equations.push(if short.is_empty() {
                            vec![(Coefficient::ONE, i)]
                        } else {
                            short
                        });
                    }
                    vec![(Coefficient::ONE, i)]
                }
                Kind::VoltageSource(source) | Kind::CurrentSource(source) => {
                    let (v, i) = (
                        self.out.column(format!("v({name})")),
                        self.out.column(format!("i({name})")),
                    );
                    self.branch_voltage(v, p, n);
                    let is_voltage = matches!(element.kind, Kind::VoltageSource(_));
                    self.out.sources.push(SourcePort {
                        input: Input {
                            name: name.clone(),
                            unit: if is_voltage { "V" } else { "A" },
                            source: source.clone(),
                        },
                        value: if is_voltage { v } else { i },
                        other: if is_voltage { i } else { v },
                        rate: None,
                    });
                    vec![(Coefficient::ONE, i)]
                }
                Kind::Device(law) => {
                    // The reverse voltage −v and the forward current i.
                    let reverse = self.out.column(format!("-v({name})"));
                    let i = self.out.column(format!("i({name})"));
                    self.branch_voltage(reverse, n, p);
                    self.out.pairs.push(Pair {
                        port: Port {
                            device: name.clone(),
                            role: Role::Voltage,
                            lambda: format!("i({name})"),
                            y: format!("-v({name})"),
                            law: law.clone(),
                        },
                        reverse,
                        forward: i,
                        fixed_role: false,
                        reverse_name: format!("-v({name})"),
                        forward_name: format!("i({name})"),
                        units: ("V", "A"),
                    });
                    vec![(Coefficient::ONE, i)]
                }
                Kind::Switch(switch) => {
                    let (v, i) = (
                        self.out.column(format!("v({name})")),
                        self.out.column(format!("i({name})")),
                    );
                    self.branch_voltage(v, p, n);
                    self.out.switches.push(SwitchPort {
                        name: name.clone(),
                        v,
                        i,
                        ron: switch.ron,
                        roff: switch.roff,
                        on_above: switch.on_above,
                        off_below: switch.off_below,
                        initial: switch.initial,
                        control: usize::MAX,
                        latch: switch.latch.as_ref().map(|latch| self.latch(latch)),
                    });
                    vec![(Coefficient::ONE, i)]
                }
                Kind::Controlled { .. } => {
                    let i = self.internal(format!("i({name})"));
                    vec![(Coefficient::ONE, i)]
                }
                Kind::Function { output, .. } => {
                    let (y, out) = (
                        self.out.column(format!("{name}.in")),
                        self.out.column(format!("{name}.out")),
                    );
                    self.out.pairs.push(Pair {
                        port: Port {
                            device: name.clone(),
                            role: Role::Function,
                            lambda: format!("{name}.out"),
                            y: self.input_name(element),
                            law: self.law(element),
                        },
                        reverse: y,
                        forward: out,
                        fixed_role: true,
                        reverse_name: self.input_name(element),
                        forward_name: format!("{name}.out"),
                        units: ("V", if *output == Output::Voltage { "V" } else { "A" }),
                    });
                    let current = match output {
                        Output::Voltage => {
                            self.branch_voltage(out, p, n);
                            self.internal(format!("i({name})"))
                        }
                        Output::Current => out,
                    };
                    vec![(Coefficient::ONE, current)]
                }
            };
            self.through(p, n, &current);
            self.branches.push(Branch { current });
        }
        self.windings(windings);
    }

    /// Inductor ports: for the basis windings of a coupled group the flux-state current, for the dependent ones an
    /// ideal transformer.
    fn windings(&mut self, windings: &[Winding]) {
        for winding in windings {
            let element = &self.circuit.elements[winding.element.index()];
            let own: Equation = self.branches[winding.element.index()].current.clone();
            if let Some(ratios) = &winding.transformer {
                // v_d − Σ t_dj v_j = 0
                let mut equation = self.voltage(element.p, element.n);
                for &(ratio, j) in ratios {
                    let other = &self.circuit.elements[windings[j].element.index()];
                    for (c, column) in self.voltage(other.p, other.n) {
                        equation.push((
                            if c == Coefficient::ONE {
                                ratio.negated()
                            } else {
                                ratio
                            },
                            column,
                        ));
                    }
                }
                self.out.equations.push(equation);
                continue;
            }
            let name = &element.name;
            let (v, i) = (
                self.out.column(format!("v({name})")),
                self.out.column(format!("i({name}).flux")),
            );
            self.branch_voltage(v, element.p, element.n);
            // i_m = i + Σ_d t_dj i_d
            let mut equation = own;
            for &(ratio, d) in &winding.carries {
                for &(_, column) in &self.branches[windings[d].element.index()].current {
                    equation.push((ratio, column));
                }
            }
            equation.push((Coefficient::MINUS_ONE, i));
            self.out.equations.push(equation);
            self.out.storage.push(StoragePort {
                // With windings at k = 1 the state is their magnetising current, not the current of this one.
                name: if winding.carries.is_empty() {
                    format!("i({name})")
                } else {
                    format!("im({name})")
                },
                element: name.clone(),
                capacitor: false,
                state: i,
                flow: v,
                initial: winding.initial,
            });
        }
        // The metric of the inductors, in the order in which the basis windings were pushed.
        let first =
            self.out.storage.len() - windings.iter().filter(|w| w.transformer.is_none()).count();
        let is_basis = |winding: &&Winding| winding.transformer.is_none();
        let place: BTreeMap<ElementId, usize> = (windings.iter().filter(is_basis).enumerate())
            .map(|(k, winding)| (winding.element, k))
            .collect();
        for (a, winding) in windings.iter().filter(is_basis).enumerate() {
            for &(value, j) in &winding.inductance {
                let b = place.get(&windings[j].element).copied().unwrap_or(a);
                self.out.metric.push((first + a, first + b, value));
            }
        }
    }

    /// The switches of a latch by their numbers among the switches.
    fn latch(&self, latch: &Latch) -> LatchPort {
        let elements = &self.circuit.elements;
        let number = |gate: &ElementId| {
            let before = elements[..gate.index()].iter();
            before.filter(|e| matches!(e.kind, Kind::Switch(_))).count()
        };
        match latch {
            Latch::Hold { gates, valve } => LatchPort::Hold {
                gates: gates.iter().map(number).collect(),
                valve: elements[valve.index()].name.clone(),
            },
            Latch::Rest(latch) => LatchPort::Rest(number(latch)),
        }
    }

    fn input_name(&self, element: &crate::circuit::Element) -> String {
        match &element.kind {
            Kind::Function { input, .. } => match input.terms.as_slice() {
                [(g, Quantity::Voltage(a))] if g.f64 == 1.0 => {
                    format!("v({})", self.circuit.nodes[a.index()])
                }
                [(g, Quantity::Voltage(a)), (h, Quantity::Voltage(b))]
                    if g.f64 == 1.0 && h.f64 == -1.0 =>
                {
                    format!(
                        "v({},{})",
                        self.circuit.nodes[a.index()],
                        self.circuit.nodes[b.index()]
                    )
                }
                _ => format!("{}.in", element.name),
            },
            _ => String::new(),
        }
    }

    fn law(&self, element: &crate::circuit::Element) -> crate::law::Law {
        match &element.kind {
            Kind::Function { law, .. } | Kind::Device(law) => law.clone(),
            _ => crate::law::Law::ideal_diode(),
        }
    }
}
