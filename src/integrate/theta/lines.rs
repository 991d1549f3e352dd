//! The ports of transmission lines: what leaves them after every step.

use super::*;
use crate::integrate::line::Line;

/// One end of a transmission line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Port {
    /// The line and its end.
    at: (usize, usize),
    /// The power term whose current enters the line.
    current: usize,
    /// The input that is the wave that arrives.
    input: usize,
}

impl Theta {
    /// Connects the ports of transmission lines, before the run begins.
    pub(crate) fn attach(&mut self, lines: &[Line]) {
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        self.inputs.attach(&lcs.inputs, lines);
        let input = |name: &String| lcs.inputs.iter().position(|i| i.name == *name);
        let power = &lcs.outputs.power;
        let term = |name: &String| power.iter().position(|p| p.element == *name);
        self.ports = (lines.iter().enumerate())
            .flat_map(|(k, line)| {
                [0, 1].map(|port| {
                    Some(Port {
                        at: (k, port),
                        current: term(&line.impedances[port])?,
                        input: input(&line.sources[port])?,
                    })
                })
            })
            .flatten()
            .collect();
        self.now.u = self.inputs.all_before(self.now.t);
        self.u_next.clone_from(&self.now.u);
        let waves = self.inputs.lines().stored(self.now.t);
        self.now.balance.hold(waves);
        self.kept.copy_from(&self.now);
        self.longest = self.longest.min(self.inputs.lines().longest_step());
    }

    /// Has the waves leave the ports of lines as they are now.
    pub(super) fn send_waves(&mut self) -> Result<(), Error> {
        if self.ports.is_empty() {
            return Ok(());
        }
        self.read_lambda()?;
        let lcs = &self.plant.systems[self.now.system].1.lcs;
        let at = self.now.point(&self.lambda, &self.du);
        for port in &self.ports {
            let i = reading::value(&lcs.outputs.power_i, port.current, at);
            let e = self.now.u[port.input];
            (self.inputs.lines_mut()).depart(port.at, self.now.t, i, e);
        }
        Ok(())
    }

    /// Something happens now that may break the waves that leave: as they are after it.
    pub(super) fn break_waves(&mut self) -> Result<(), Error> {
        self.inputs.lines_mut().note_break(self.now.t);
        self.send_waves()
    }
}
