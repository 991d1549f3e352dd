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
        self.source_controls_beside(self.probes)
    }

    /// By source whether it acts through such controls and nowhere else but in probes.
    pub(crate) fn acting_by_switches(&self) -> Vec<bool> {
        self.source_controls_beside(0).0
    }

    /// See [`Self::source_controls`]; the first `probes` readings are reasons to keep a source.
    fn source_controls_beside(&self, probes: usize) -> (Vec<bool>, Vec<SourceControl>) {
        let reduced = self.ball();
        let equations = &reduced.equations;
        let place = |c: Column| reduced.place[c];
        // By column the readings that hold it.
        let mut readers: Vec<Vec<usize>> = vec![Vec::new(); equations.cols()];
        for (k, row) in reduced.readings.iter().enumerate() {
            row.iter().for_each(|(c, _)| readers[*c].push(k));
        }
        // Columns that an equation of their own holds at zero: the current of a source without a load.
        let mut vanishing = vec![false; equations.cols()];
        for row in 0..equations.rows() {
            if let [(c, _)] = equations.row(row) {
                vanishing[*c] = true;
            }
        }
        let vanishes = |k: usize| reduced.readings[k].iter().all(|(c, _)| vanishing[*c]);
        // By reading: what it is multiplied with to powers, and whether it is the control of a switch.
        let mut factors = vec![Vec::new(); self.observed.len()];
        for power in &self.power {
            factors[power.v].push(power.i);
            factors[power.i].push(power.v);
        }
        let mut controls = vec![Vec::new(); self.observed.len()];
        for (switch, port) in self.switches.iter().enumerate() {
            controls[port.control].push(switch);
        }
        // A reading is no reason to keep a source in the flow: a factor of a product that vanishes, the control of a switch.
        let idle = |k: usize| {
            let read = !controls[k].is_empty() || !factors[k].is_empty() || k < self.probes;
            k >= probes && read && factors[k].iter().all(|&other| vanishes(other))
        };
        let is_straight =
            |wave: &Wave| matches!(wave, Wave::Dc(_) | Wave::Pulse { .. } | Wave::Pwl { .. });
        let straight = |k: usize| is_straight(&self.sources[k].input.source.wave);
        let mut straight_at = vec![None; equations.cols()];
        for (k, source) in self
            .sources
            .iter()
            .enumerate()
            .filter(|(k, _)| straight(*k))
        {
            if let Some(c) = place(source.value) {
                straight_at[c] = Some(k);
            }
        }
        let control = |switch: usize| -> Option<SourceControl> {
            if self.switches[switch].latch.is_some() {
                return None;
            }
            let row = &reduced.readings[self.switches[switch].control];
            let (mut constant, mut terms) = (0.0, Vec::new());
            for (c, x) in row {
                match straight_at[*c] {
                    Some(input) => terms.push((input, x.to_f64())),
                    None if place(StaticMultiport::ONE) == Some(*c) => constant = x.to_f64(),
                    None => return None,
                }
            }
            (!terms.is_empty()).then_some(SourceControl {
                switch,
                constant,
                terms,
            })
        };
        let found: Vec<Option<SourceControl>> = (0..self.switches.len()).map(control).collect();
        let silent = |(k, source): (usize, &SourcePort)| {
            let (value, rate) = (place(source.value), source.rate.and_then(place));
            let loose = |c: Option<usize>| c.is_none_or(|c| equations.holders(c).is_empty());
            let read_by = |c: Option<usize>| c.map_or(&[][..], |c| &readers[c]);
            // Idle where it is read, and by no control that reads something else besides.
            let unread = |&k: &usize| idle(k) && controls[k].iter().all(|&s| found[s].is_some());
            straight(k)
                && loose(value)
                && loose(rate)
                && read_by(rate).is_empty()
                && read_by(value).iter().all(unread)
        };
        let silent = self.sources.iter().enumerate().map(silent).collect();
        (silent, found.into_iter().flatten().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::{SourceControl, StaticMultiport};
    use crate::circuit::{Kind, Quantity};
    use crate::mna::behaviour;
    use crate::mna::fixture::{circuit, value};

    const CIRCUIT: &str = "vg g 0 1\n vd d 0 2\n rd d 0 1k\n s1 a 0 1 1k\n s2 a 0 1 1k\n c1 a 0 1u";

    /// The source controls when s1 and s2 read these nodes with these factors.
    fn found(reads: [&[(&str, &str)]; 2], probe: Option<&str>) -> (Vec<bool>, Vec<SourceControl>) {
        multiport(reads, probe).source_controls()
    }

    fn multiport(reads: [&[(&str, &str)]; 2], probe: Option<&str>) -> StaticMultiport {
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
        behaviour(&circuit).unwrap()
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
        let acting = |reads| multiport(reads, Some("v(g)")).acting_by_switches();
        assert_eq!(acting([&[("g", "1")], &[("a", "1")]]), [true, false]);
        // vd has a load, and a control that reads a state besides is none of sources.
        assert_eq!(
            acting([&[("d", "1")], &[("g", "1"), ("a", "1")]]),
            [false, false]
        );
        // Not where a control adds it to a loaded source.
        let sum = found([&[("g", "1"), ("d", "1")], &[("a", "1")]], None);
        assert_eq!(
            sum,
            (vec![true, false], vec![control(0, &[(0, 1.0), (1, 1.0)])])
        );
    }
}
