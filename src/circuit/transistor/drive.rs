//! The gate drive that the circuit allows a transistor, and the on-resistance that follows.

use super::{Family, Sort};
use crate::algebra::Value;
use crate::circuit::builder::Builder;
use crate::circuit::source::Wave;
use crate::circuit::{Element, ElementId, Kind, NodeId};
use crate::diagnostic::{Diagnostic, Span};

/// Gate drive assumed where the circuit does not tell it: that of the data sheets of power transistors, V.
const DRIVE: f64 = 10.0;
/// A channel whose on-resistance waits for the gate drive.
pub(in crate::circuit) struct Channel {
    /// Its switch.
    pub(super) switch: ElementId,
    /// Name of the transistor.
    pub(super) device: String,
    /// Name of its model.
    pub(super) model: String,
    pub(super) span: Span,
    pub(super) gate: NodeId,
    pub(super) source: NodeId,
    pub(super) sort: Sort,
    /// RD + RS, or all of Ron where β is not given, Ω.
    pub(super) series: f64,
    /// Transconductance, A/V²; `None` where Ron is given.
    pub(super) beta: Option<f64>,
    /// Whether β is that of a transistor of which nothing is known.
    pub(super) assumed: bool,
}

impl Builder<'_, '_> {
    /// Gives the channels their on-resistances, and says what was left out.
    pub(in crate::circuit) fn open_channels(&mut self) {
        let mut told: Vec<String> = Vec::new();
        for channel in std::mem::take(&mut self.channels) {
            let Kind::Switch(switch) = &self.circuit.elements[channel.switch.index()].kind else {
                continue;
            };
            let threshold = switch.on_above;
            let drive = self.drive(&channel).filter(|drive| *drive > threshold);
            let usual = if channel.sort.family == Family::Jfet {
                0.0
            } else {
                DRIVE.max(2.0 * threshold)
            };
            let gate = drive.unwrap_or(usual);
            let ron = match channel.beta {
                Some(beta) if gate > threshold => {
                    channel.series + 1.0 / (beta * (gate - threshold))
                }
                _ => channel.series,
            };
            if let Kind::Switch(switch) = &mut self.circuit.elements[channel.switch.index()].kind {
                switch.ron = Value::binary(ron);
            }
            let sign = if channel.sort.mirrored { "-" } else { "" };
            let at = match (channel.beta, drive) {
                (None, _) => "the Ron of the model".to_string(),
                (Some(_), Some(_)) => {
                    format!(
                        "RD, RS and the triode region at {sign}v(g,s) = {}",
                        short(gate)
                    )
                }
                (Some(_), None) => {
                    format!(
                        "RD, RS and the triode region at {sign}v(g,s) = {}, a gate drive assumed here",
                        short(gate)
                    )
                }
            };
            let rest = match channel.sort.family {
                Family::Mos | Family::Vdmos => "with an ideal body diode; ",
                Family::Igbt => "in series with a diode of 0.7 V; ",
                Family::Jfet => "",
            };
            let text = format!(
                "on above {sign}v(g,s) = {} V with {} Ω ({at}), {rest}",
                short(threshold),
                short(ron)
            );
            let key = format!("{} {text}", channel.model);
            if told.contains(&key) {
                continue;
            }
            told.push(key);
            let message = format!(
                "`{}` is simulated as a switch: {text}saturation, charge and speed of model `{}` are left out",
                channel.device, channel.model
            );
            let warning = Diagnostic::warning("transistor-as-switch", channel.span, message)
                .label("approximated");
            self.tell(if channel.assumed {
                let help = "without KP a transistor has 2e-5 A/V², as everywhere in SPICE: give the model of a power transistor `Ron`, or its `KP` (1 to 100)";
                warning.help(help)
            } else {
                warning
            });
        }
    }

    /// The largest control voltage that the sources of gate and source allow, if they tell it.
    fn drive(&self, channel: &Channel) -> Option<f64> {
        let between = self.sources().find_map(|(p, n, wave)| {
            let forward = (p, n) == (channel.gate, channel.source);
            let reverse = (n, p) == (channel.gate, channel.source);
            let (low, high) = extremes(wave)?;
            match (forward, reverse) {
                (true, _) => Some((low, high)),
                (_, true) => Some((-high, -low)),
                _ => None,
            }
        });
        let (low, high) = between.or_else(|| {
            let (gate, source) = (
                self.range(channel.gate, true)?,
                self.range(channel.source, false)?,
            );
            Some((gate.0 - source.1, gate.1 - source.0))
        })?;
        Some(if channel.sort.mirrored { -low } else { high })
    }

    fn sources(&self) -> impl Iterator<Item = (NodeId, NodeId, &Wave)> {
        self.circuit.elements.iter().filter_map(|e| match &e.kind {
            Kind::VoltageSource(source) => Some((e.p, e.n, &source.wave)),
            _ => None,
        })
    }

    /// Least and largest voltage of a node that a source ties to ground, if wanted through one resistor.
    fn range(&self, node: NodeId, through_resistor: bool) -> Option<(f64, f64)> {
        if node == NodeId::GROUND {
            return Some((0.0, 0.0));
        }
        let tied = self.sources().find_map(|(p, n, wave)| {
            let (low, high) = extremes(wave)?;
            match (p, n) {
                (p, NodeId::GROUND) if p == node => Some((low, high)),
                (NodeId::GROUND, n) if n == node => Some((-high, -low)),
                _ => None,
            }
        });
        tied.or_else(|| {
            let beyond = |e: &Element| match e.kind {
                Kind::Resistor(_) if e.p == node => Some(e.n),
                Kind::Resistor(_) if e.n == node => Some(e.p),
                _ => None,
            };
            let ends = self.circuit.elements.iter().filter_map(beyond);
            // A pull-down to ground says nothing of the drive.
            let mut ends = ends.filter(|end| through_resistor && *end != NodeId::GROUND);
            ends.find_map(|end| self.range(end, false))
        })
    }
}

/// Four significant digits.
fn short(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}

/// Least and largest value of a waveform; `None` where they are not evident.
fn extremes(wave: &Wave) -> Option<(f64, f64)> {
    match wave {
        Wave::Dc(v) => Some((*v, *v)),
        Wave::Pulse { v1, v2, .. } | Wave::Exp { v1, v2, .. } => Some((v1.min(*v2), v1.max(*v2))),
        Wave::Pwl { points, .. } => {
            let values = points.iter().map(|p| p.1);
            Some((
                values.clone().fold(f64::INFINITY, f64::min),
                values.fold(f64::NEG_INFINITY, f64::max),
            ))
        }
        Wave::Sin {
            offset, amplitude, ..
        } => Some((offset - amplitude.abs(), offset + amplitude.abs())),
        _ => None,
    }
}
