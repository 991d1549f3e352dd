//! Switches whose controls are straight sources alone.

use super::{Column, SourcePort, StaticMultiport};
use crate::algebra::Field;
use crate::circuit::source::Wave;

/// A control that is a constant plus multiples of piecewise straight sources, whatever the position.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SourceControl {
    /// The switch.
    pub(crate) switch: usize,
    /// V or A.
    pub(crate) constant: f64,
    /// Sources with their factors.
    pub(crate) terms: Vec<(usize, f64)>,
}

impl StaticMultiport {
    /// The controls of switches that are straight sources alone, and by source whether it acts through such controls and nowhere else.
    pub(crate) fn source_controls(&self) -> (Vec<bool>, Vec<SourceControl>) {
        let reduced = self.ball();
        let matrix = &reduced.matrix;
        let nonzero =
            |row: usize| (0..matrix.cols()).filter(move |&c| !matrix.at(row, c).is_zero());
        let place = |c: Column| reduced.place[c];
        let reads = |row: usize, c: Option<usize>| c.is_some_and(|c| !matrix.at(row, c).is_zero());
        let reading = |k: usize| reduced.equations + k;
        let readings = reading(0)..matrix.rows();
        // Columns that an equation of their own holds at zero: the current of a source without a load.
        let vanishing: Vec<usize> = (0..reduced.equations)
            .filter_map(|row| {
                let mut columns = nonzero(row);
                columns.next().filter(|_| columns.next().is_none())
            })
            .collect();
        let vanishes = |k: usize| nonzero(reading(k)).all(|c| vanishing.contains(&c));
        // A reading is no reason to keep a source in the flow: a factor of a product that vanishes, the control of a switch.
        let idle = |row: usize| {
            let k = row - reduced.equations;
            let power = self.power.iter().filter(|p| p.v == k || p.i == k);
            let mut power = power.map(|p| vanishes(if p.v == k { p.i } else { p.v }));
            let controls = self.switches.iter().any(|s| s.control == k);
            k >= self.probes && power.all(|vanishes| vanishes) && (controls || self.is_power(k))
        };
        let is_straight =
            |wave: &Wave| matches!(wave, Wave::Dc(_) | Wave::Pulse { .. } | Wave::Pwl { .. });
        let straight = |k: usize| is_straight(&self.sources[k].input.source.wave);
        let control = |switch: usize| -> Option<SourceControl> {
            if self.switches[switch].latch.is_some() {
                return None;
            }
            let row = reading(self.switches[switch].control);
            let (mut constant, mut terms) = (0.0, Vec::new());
            for c in nonzero(row) {
                let is = |&k: &usize| straight(k) && place(self.sources[k].value) == Some(c);
                match (0..self.sources.len()).find(is) {
                    Some(input) => terms.push((input, matrix.at(row, c).to_f64())),
                    None if place(StaticMultiport::ONE) == Some(c) => {
                        constant = matrix.at(row, c).to_f64();
                    }
                    None => return None,
                }
            }
            (!terms.is_empty()).then_some(SourceControl {
                switch,
                constant,
                terms,
            })
        };
        let switches = 0..self.switches.len();
        let controls: Vec<SourceControl> = switches.clone().filter_map(control).collect();
        let silent = |(k, source): (usize, &SourcePort)| {
            let (value, rate) = (place(source.value), source.rate.and_then(place));
            let guarded = switches.clone().any(|switch| {
                reads(reading(self.switches[switch].control), value)
                    && controls.iter().all(|control| control.switch != switch)
            });
            straight(k)
                && !guarded
                && (0..reduced.equations).all(|row| !reads(row, value) && !reads(row, rate))
                && readings.clone().all(|row| !reads(row, rate))
                && readings.clone().all(|row| !reads(row, value) || idle(row))
        };
        let silent = self.sources.iter().enumerate().map(silent).collect();
        (silent, controls)
    }

    fn is_power(&self, k: usize) -> bool {
        self.power.iter().any(|p| p.v == k || p.i == k)
    }
}

#[cfg(test)]
mod tests {
    use super::SourceControl;
    use crate::circuit::{Kind, Quantity};
    use crate::mna::behaviour;
    use crate::mna::fixture::{circuit, value};

    const CIRCUIT: &str = "vg g 0 1\n vd d 0 2\n rd d 0 1k\n s1 a 0 1 1k\n s2 a 0 1 1k\n c1 a 0 1u";

    /// The source controls when s1 and s2 read these nodes with these factors.
    fn found(reads: [&[(&str, &str)]; 2], probe: Option<&str>) -> (Vec<bool>, Vec<SourceControl>) {
        let mut circuit = circuit(CIRCUIT);
        for (name, reads) in ["s1", "s2"].into_iter().zip(reads) {
            let terms = reads
                .iter()
                .map(|(node, factor)| {
                    let node = circuit.node(node).unwrap();
                    (value(factor), Quantity::Voltage(node))
                })
                .collect();
            let element = circuit.elements.iter_mut().find(|e| e.name == name);
            if let Some(Kind::Switch(switch)) = element.map(|e| &mut e.kind) {
                switch.control.terms = terms;
            }
        }
        let probes = ["v(a)"].into_iter().chain(probe);
        circuit.probes = probes.map(|p| circuit.probe(p).unwrap()).collect();
        behaviour(&circuit).unwrap().source_controls()
    }

    #[test]
    fn a_gate_without_a_load_is_a_clock() {
        let (silent, controls) = found([&[("g", "2")], &[("d", "1")]], None);
        // vd has a load.
        assert_eq!(silent, [true, false]);
        assert_eq!(controls, [control(0, &[(0, 2.0)]), control(1, &[(1, 1.0)])]);
    }

    fn control(switch: usize, terms: &[(usize, f64)]) -> SourceControl {
        SourceControl {
            switch,
            constant: 0.0,
            terms: terms.to_vec(),
        }
    }

    #[test]
    fn a_gate_that_is_seen_elsewhere_is_part_of_the_flow() {
        let gate = control(0, &[(0, 1.0)]);
        // By a control that also reads a state.
        let both = found([&[("g", "1")], &[("g", "1"), ("a", "1")]], None);
        assert_eq!(both, (vec![false, false], vec![gate.clone()]));
        // By a probe.
        let probed = found([&[("g", "1")], &[("a", "1")]], Some("v(g)"));
        assert_eq!(probed, (vec![false, false], vec![gate]));
        // Not where a control adds it to a loaded source.
        let sum = found([&[("g", "1"), ("d", "1")], &[("a", "1")]], None);
        assert_eq!(
            sum,
            (vec![true, false], vec![control(0, &[(0, 1.0), (1, 1.0)])])
        );
    }
}
