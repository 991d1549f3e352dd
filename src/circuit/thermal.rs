//! Thermal networks: resistances, capacitances and constant sources in which volts stand for °C and amperes for W, apart from the circuit whose
//! heat they lead away.

use std::collections::{BTreeSet, HashSet};
use std::mem;

use super::builder::Builder;
use super::names::Names;
use super::scope::ScopeId;
use super::{Circuit, NodeId};
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{self, Block, Device, Statement};

/// Where the heat of devices goes.
#[derive(Debug, Clone, Default)]
pub struct Thermal {
    /// Its resistances (K/W), capacitances (J/K) and sources (°C, W); none where every case has the temperature of its surroundings.
    pub network: Option<Box<Circuit>>,
    /// Devices, and the node of the network at which their cases stand.
    pub cases: Vec<(String, NodeId)>,
    /// `.temp`: what surrounds all other cases, °C.
    pub ambient: f64,
}

impl<'n> Builder<'n, '_> {
    /// Builds the network of the nodes that `.thermal` names; its cards are no part of the circuit.
    pub(super) fn thermal_network(&mut self, block: &'n Block) {
        self.circuit.thermal.ambient = self.scopes.temperature.f64;
        if self.thermals.is_empty() {
            return;
        }
        let cards = self.thermal_cards(block);
        let electrical = mem::take(&mut self.circuit);
        let names = mem::replace(&mut self.names, Names::new());
        self.circuit.nodes.push("0".into());
        for card in cards {
            self.heat_card(card);
        }
        let nodes: Vec<NodeId> = {
            let thermals = self.thermals.clone().into_iter();
            thermals
                .map(|t| self.node(&t.node, ScopeId::ROOT))
                .collect()
        };
        let network = mem::replace(&mut self.circuit, electrical);
        self.names = names;
        self.thermal_nodes = nodes;
        self.circuit.thermal.network = Some(Box::new(network));
    }

    /// What hangs together with the nodes of `.thermal` by other nodes than ground.
    fn thermal_cards(&mut self, block: &'n Block) -> Vec<&'n ast::Element> {
        let is_ground = |name: &str| matches!(name, "0" | "gnd");
        let nodes = self.thermals.iter().map(|t| t.node.text.as_str());
        let mut nodes: BTreeSet<&str> = nodes.filter(|name| !is_ground(name)).collect();
        let all = block
            .statements
            .iter()
            .filter_map(|statement| match statement {
                Statement::Element(card) => Some(card),
                _ => None,
            });
        let all: Vec<&ast::Element> = all.collect();
        let mut found: HashSet<&str> = HashSet::new();
        loop {
            let before = found.len();
            for card in &all {
                let mut own = card.nodes.iter().map(|node| node.text.as_str());
                if !found.contains(card.name.text.as_str()) && own.any(|node| nodes.contains(node))
                {
                    found.insert(&card.name.text);
                    let own = card.nodes.iter().map(|node| node.text.as_str());
                    nodes.extend(own.filter(|name| !is_ground(name)));
                }
            }
            if found.len() == before {
                break;
            }
        }
        let cards = all
            .into_iter()
            .filter(|card| found.contains(card.name.text.as_str()));
        let cards = cards.collect();
        self.thermal_names = found;
        cards
    }

    fn heat_card(&mut self, card: &'n ast::Element) {
        match &card.device {
            Device::Passive { values, args } if !card.name.text.starts_with('l') => {
                self.passive(card, values, args, ScopeId::ROOT);
            }
            Device::Source {
                dc,
                wave: None,
                args,
                ..
            } => self.source(card, dc.as_ref(), (None, false), args, ScopeId::ROOT),
            _ => self.tell(unfit(
                card.span,
                &format!("`{}` is no part of one", card.name.text),
            )),
        }
    }

    /// The devices whose heat goes to the nodes of the network.
    pub(super) fn cases(&mut self) {
        let nodes = mem::take(&mut self.thermal_nodes);
        for (card, node) in mem::take(&mut self.thermals).into_iter().zip(nodes) {
            for device in &card.devices {
                // What is joined to the network was refused.
                if self.thermal_names.contains(device.text.as_str()) {
                    continue;
                }
                let Some(id) = self.expect_element(device, ScopeId::ROOT, "device") else {
                    continue;
                };
                let name = self.circuit.elements[id.index()].name.clone();
                if self
                    .circuit
                    .thermal
                    .cases
                    .iter()
                    .any(|(own, _)| *own == name)
                {
                    let message = format!("the case of `{name}` stands at a node already");
                    let fault = Diagnostic::error("thermal-network", device.span, message);
                    self.tell(
                        fault
                            .label("named by `.thermal` again")
                            .help("a device has one case; resistances join nodes of the network"),
                    );
                    continue;
                }
                self.circuit.thermal.cases.push((name, node));
            }
        }
    }
}

fn unfit(span: crate::diagnostic::Span, why: &str) -> Diagnostic {
    let message = format!("a thermal network consists of R, C and constant sources: {why}");
    Diagnostic::error("thermal-network", span, message)
        .label("joined to a node of `.thermal`")
        .help("volts stand for °C there, amperes for W; the circuit and its thermal networks have node 0 in common and no other")
}

#[cfg(test)]
mod tests {
    use crate::Model;

    const HEATED: &str = "heat\nv1 a 0 10\ns1 a b g 0 sm\nr1 b 0 5\nvg g 0 pulse(0 5 0 0 0 5u 10u)\n.model sm sw(vt=2.5 ron=0)\n\
        .param k=0.5\nrh hs amb {k}\nch hs 0 100\nvamb amb 0 40\n.thermal hs s1 r1\n.tran 1u 20u\n";

    #[test]
    fn a_network_is_no_part_of_the_circuit() {
        let model = Model::parse(HEATED, "t.cir").expect("a circuit");
        let circuit = model.circuit();
        let names = |c: &crate::circuit::Circuit| {
            let names = c.elements.iter().map(|e| e.name.clone());
            names.collect::<Vec<_>>()
        };
        assert_eq!(names(circuit), ["v1", "s1", "r1", "vg"]);
        assert!(circuit.node("hs").is_none());
        let thermal = &circuit.thermal;
        let network = thermal.network.as_ref().expect("a network");
        assert_eq!(names(network), ["rh", "ch", "vamb"]);
        let hs = network.node("hs").expect("a node");
        let cases = [("s1".to_owned(), hs), ("r1".to_owned(), hs)];
        assert_eq!((&thermal.cases[..], thermal.ambient), (&cases[..], 27.0));
    }

    #[test]
    fn what_does_not_belong_there_is_refused() {
        for (from, to, said) in [
            ("ch hs 0 100", "lh hs 0 1", "`lh` is no part of one"),
            ("ch hs 0 100", "ch hs b 100", "`s1` is no part of one"),
            (
                "vamb amb 0 40",
                "vamb amb 0 sin(0 1 50)",
                "`vamb` is no part of one",
            ),
            (
                ".thermal hs s1 r1",
                ".thermal hs s1 s1",
                "the case of `s1` stands at a node already",
            ),
            (
                ".thermal hs s1 r1",
                ".thermal hs s2",
                "there is no device `s2`",
            ),
            (
                ".thermal hs s1 r1",
                ".thermal hs",
                "the devices whose heat goes there",
            ),
            (
                "rh hs amb {k}",
                "rh hs amb r={1+v(a)}",
                "`v(a)` is not known here",
            ),
        ] {
            let text = HEATED.replace(from, to);
            assert_ne!(text, HEATED);
            let error = Model::parse(&text, "t.cir").expect_err(to).to_string();
            assert!(error.contains(said), "{to}: {error}");
        }
    }
}
