//! Products of sines that sources give: sums of sines again.

use super::behaviour::{Auxiliary, Unfit, auxiliary};
use super::form::Form;
use super::scope::Scopes;
use super::source::{Source, Wave};
use super::{Element, Kind, NodeId, Quantity};

/// Most sines of one product.
const MOST: usize = 64;

/// amplitude · sin(2π frequency t + phase), degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Tone {
    amplitude: f64,
    frequency: f64,
    phase: f64,
}

/// A constant and sines for t ≥ 0.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Known {
    constant: f64,
    tones: Vec<Tone>,
}

impl Known {
    /// What a waveform is from t = 0 on.
    fn of(wave: &Wave) -> Option<Self> {
        match *wave {
            Wave::Dc(constant) => Some(Self {
                constant,
                tones: Vec::new(),
            }),
            Wave::Sin {
                offset,
                amplitude,
                frequency,
                delay,
                damping: 0.0,
                phase,
                cycles: None,
            } if delay <= 0.0 => Some(Self {
                constant: offset,
                tones: vec![Tone {
                    amplitude,
                    frequency,
                    phase: phase - 360.0 * frequency * delay,
                }],
            }),
            _ => None,
        }
    }

    fn plus(mut self, gain: f64, other: &Self) -> Self {
        self.constant += gain * other.constant;
        self.tones.extend(other.tones.iter().map(|tone| Tone {
            amplitude: gain * tone.amplitude,
            ..*tone
        }));
        self
    }
}

/// The node that a source at ground holds at a known voltage, and that voltage.
pub(super) fn at_node(element: &Element) -> Option<(NodeId, Known)> {
    let Kind::VoltageSource(Source { dc, wave }) = &element.kind else {
        return None;
    };
    let known = Known::of(wave).filter(|_| *dc == wave.value(0.0))?;
    match (element.p, element.n) {
        (p, NodeId::GROUND) => Some((p, known)),
        (NodeId::GROUND, n) => Some((n, Known::default().plus(-1.0, &known))),
        _ => None,
    }
}

impl Scopes<'_> {
    /// x y, where both are sums of sines: sin α sin β = ½ cos(α − β) − ½ cos(α + β).
    pub(super) fn product_of_tones(&mut self, x: &Form, y: &Form) -> Result<Form, Unfit> {
        let both = self.known(x).zip(self.known(y));
        let (a, b) = both.ok_or(Unfit::Nonlinear)?;
        if a.tones.len() * b.tones.len() > MOST {
            return Err(Unfit::TooLarge);
        }
        // (a₀ + A)(b₀ + B) = a₀ y + b₀ x − a₀ b₀ + A B.
        let mut sum = (y.clone().scaled(a.constant.into()))
            .plus(x.clone().scaled(b.constant.into()))
            .plus(Form::number(-a.constant * b.constant));
        for s in &a.tones {
            for t in &b.tones {
                let half = 0.5 * s.amplitude * t.amplitude;
                for sign in [1.0, -1.0] {
                    let frequency = s.frequency - sign * t.frequency;
                    let phase = s.phase - sign * t.phase;
                    // A cosine does not mind the sign of its argument.
                    let phase = if frequency < 0.0 { -phase } else { phase };
                    sum = sum.plus(
                        self.cosine(frequency.abs(), phase)
                            .scaled((sign * half).into()),
                    );
                }
            }
        }
        for form in [x, y] {
            let nodes = form
                .terms
                .iter()
                .filter_map(|(_, quantity)| match quantity {
                    Quantity::Voltage(node) if self.tones.contains_key(node) => Some(*node),
                    _ => None,
                });
            self.rails_read.extend(nodes);
        }
        Ok(sum)
    }

    /// cos(2π frequency t + phase), degrees.
    fn cosine(&mut self, frequency: f64, phase: f64) -> Form {
        if frequency == 0.0 {
            return Form::number(phase.to_radians().cos());
        }
        self.demand(Auxiliary::Wave(Wave::Sin {
            offset: 0.0,
            amplitude: 1.0,
            frequency,
            delay: 0.0,
            damping: 0.0,
            phase: phase + 90.0,
            cycles: None,
        }))
    }

    fn known(&self, form: &Form) -> Option<Known> {
        if !form.ridges.is_empty() {
            return None;
        }
        let mut all = Known {
            constant: form.constant.f64,
            tones: Vec::new(),
        };
        for (gain, quantity) in &form.terms {
            let own = (0..self.auxiliaries.len()).find(|k| auxiliary(*k) == *quantity);
            let known = match (own.map(|k| &self.auxiliaries[k]), quantity) {
                (Some(Auxiliary::Wave(wave)), _) => Known::of(wave)?,
                (None, Quantity::Voltage(node)) => self.tones.get(node)?.clone(),
                _ => return None,
            };
            all = all.plus(gain.f64, &known);
        }
        Some(all)
    }
}
