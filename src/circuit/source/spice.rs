//! Waveforms as SPICE writes them: a kind and its arguments in order.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::Wave;

/// A waveform as a kind and its arguments in SPICE's order, as it stands in JSON.
///
/// | kind | arguments |
/// |---|---|
/// | `dc` | value |
/// | `sin` | offset, amplitude, frequency, delay, damping, phase |
/// | `pulse` | v1, v2, delay, rise, fall, width, period, count |
/// | `pwl` | t1, v1, t2, v2, … |
/// | `exp` | v1, v2, rise delay, rise tau, fall delay, fall tau |
/// | `sffm` | offset, amplitude, carrier, index, signal, carrier phase, signal phase |
/// | `am` | amplitude, offset, modulation, carrier, delay |
/// | `arriving` | delay, initial value: what leaves the other port of a transmission line; written only |
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Form {
    /// `dc`, `sin`, `pulse`, `pwl`, `exp`, `sffm` or `am`.
    pub kind: String,
    /// The arguments; trailing ones may be left out.
    pub args: Vec<f64>,
    /// `pwl` only: repeat from this time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeat: Option<f64>,
    /// `pwl` only: shift of all times.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay: Option<f64>,
}

/// What is wrong with a waveform's arguments.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum WaveError {
    /// Not one of the kinds.
    #[error("unknown waveform `{0}`; known are dc, sin, pulse, pwl, exp, sffm, am")]
    Kind(String),
    /// Too few or too many.
    #[error("`{kind}` takes {expected} arguments, found {found}")]
    Count {
        /// The waveform.
        kind: &'static str,
        /// How many it takes, in words.
        expected: &'static str,
        /// How many there are.
        found: usize,
    },
    /// Not finite, or negative where a duration is meant.
    #[error("`{kind}`: {name} cannot be {value}")]
    Argument {
        /// The waveform.
        kind: &'static str,
        /// The argument.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// The wave on a transmission line.
    #[error(
        "`arriving`: the wave on a transmission line follows from the line, which a system of matrices does not hold"
    )]
    Arriving,
    /// Times of a `pwl` that run backwards.
    #[error("`pwl`: time {after} follows {before}; times must not decrease")]
    Order {
        /// The earlier point's time.
        before: f64,
        /// The later point's time.
        after: f64,
    },
}

impl Form {
    fn new(kind: &str, args: Vec<f64>) -> Self {
        Self {
            kind: kind.to_owned(),
            args,
            repeat: None,
            delay: None,
        }
    }

    /// The waveform, with ngspice's defaults for arguments left out: rise and fall take `tstep`, width and period `tstop`,
    /// frequencies 1/tstop, EXP's delays and time constants `tstep`. An explicit 0 stays 0.
    ///
    /// # Errors
    ///
    /// [`WaveError`] for an unknown kind, a wrong number of arguments, a value that is not finite or a negative duration.
    pub fn wave(&self, tstep: f64, tstop: f64) -> Result<Wave, WaveError> {
        let read =
            |kind, expected, least, names| Arguments::new(kind, expected, least, names, &self.args);
        Ok(match self.kind.to_ascii_lowercase().as_str() {
            "dc" => Wave::Dc(read("dc", "1", 1, &["value"])?.get(0, 0.0)?),
            "sin" | "sine" => {
                let names = &[
                    "offset",
                    "amplitude",
                    "frequency",
                    "delay",
                    "damping",
                    "phase",
                    "cycles",
                ];
                let args = read("sin", "2 to 7", 2, names)?;
                let frequency = args.get(2, 1.0 / tstop)?;
                let cycles = args.duration(6, 0.0)?;
                Wave::Sin {
                    offset: args.get(0, 0.0)?,
                    amplitude: args.get(1, 0.0)?,
                    frequency,
                    delay: args.get(3, 0.0)?,
                    damping: args.get(4, 0.0)?,
                    phase: args.get(5, 0.0)?,
                    cycles: Some(cycles).filter(|&n| n > 0.0 && frequency > 0.0),
                }
            }
            "pulse" => {
                let names = &[
                    "v1", "v2", "delay", "rise", "fall", "width", "period", "count",
                ];
                let args = read("pulse", "2 to 8", 2, names)?;
                Wave::Pulse {
                    v1: args.get(0, 0.0)?,
                    v2: args.get(1, 0.0)?,
                    delay: args.get(2, 0.0)?,
                    rise: args.duration(3, tstep)?,
                    fall: args.duration(4, tstep)?,
                    width: args.duration(5, tstop)?,
                    period: args.duration(6, tstop)?,
                    count: Some(args.duration(7, 0.0)?).filter(|&count| count > 0.0),
                }
            }
            "pwl" => self.pwl()?,
            "exp" => {
                let names = &[
                    "v1",
                    "v2",
                    "rise delay",
                    "rise tau",
                    "fall delay",
                    "fall tau",
                ];
                let args = read("exp", "2 to 6", 2, names)?;
                let rise_delay = args.get(2, tstep)?;
                Wave::Exp {
                    v1: args.get(0, 0.0)?,
                    v2: args.get(1, 0.0)?,
                    rise_delay,
                    rise_tau: args.duration(3, tstep)?,
                    fall_delay: args.get(4, rise_delay + tstep)?,
                    fall_tau: args.duration(5, tstep)?,
                }
            }
            "sffm" => {
                let names = &[
                    "offset",
                    "amplitude",
                    "carrier",
                    "index",
                    "signal",
                    "carrier phase",
                    "signal phase",
                ];
                let args = read("sffm", "2 to 7", 2, names)?;
                Wave::Sffm {
                    offset: args.get(0, 0.0)?,
                    amplitude: args.get(1, 0.0)?,
                    carrier: args.get(2, 1.0 / tstop)?,
                    index: args.get(3, 0.0)?,
                    signal: args.get(4, 1.0 / tstop)?,
                    carrier_phase: args.get(5, 0.0)?,
                    signal_phase: args.get(6, 0.0)?,
                }
            }
            "am" => {
                let names = &["amplitude", "offset", "modulation", "carrier", "delay"];
                let args = read("am", "2 to 5", 2, names)?;
                Wave::Am {
                    amplitude: args.get(0, 0.0)?,
                    offset: args.get(1, 0.0)?,
                    modulation: args.get(2, 1.0 / tstop)?,
                    carrier: args.get(3, 1.0 / tstop)?,
                    delay: args.get(4, 0.0)?,
                }
            }
            "arriving" => return Err(WaveError::Arriving),
            _ => return Err(WaveError::Kind(self.kind.clone())),
        })
    }

    fn pwl(&self) -> Result<Wave, WaveError> {
        let found = self.args.len();
        if found < 2 || !found.is_multiple_of(2) {
            return Err(WaveError::Count {
                kind: "pwl",
                expected: "pairs of time and value as",
                found,
            });
        }
        let finite = |name, value: f64| {
            if value.is_finite() {
                Ok(value)
            } else {
                Err(WaveError::Argument {
                    kind: "pwl",
                    name,
                    value,
                })
            }
        };
        let mut points: Vec<(f64, f64)> = Vec::with_capacity(found / 2);
        for pair in self.args.chunks_exact(2) {
            let point = (finite("time", pair[0])?, finite("value", pair[1])?);
            if let Some(&(before, _)) = points.last().filter(|last| last.0 > point.0) {
                return Err(WaveError::Order {
                    before,
                    after: point.0,
                });
            }
            points.push(point);
        }
        let repeat = self
            .repeat
            .map(|repeat| finite("repeat", repeat))
            .transpose()?;
        Ok(Wave::Pwl {
            points,
            repeat,
            delay: finite("delay", self.delay.unwrap_or(0.0))?,
        })
    }
}

impl From<&Wave> for Form {
    fn from(wave: &Wave) -> Self {
        match *wave {
            Wave::Dc(value) => Self::new("dc", vec![value]),
            Wave::Sin {
                offset,
                amplitude,
                frequency,
                delay,
                damping,
                phase,
                cycles,
            } => {
                let args = [offset, amplitude, frequency, delay, damping, phase];
                Self::new("sin", args.into_iter().chain(cycles).collect())
            }
            Wave::Pulse {
                v1,
                v2,
                delay,
                rise,
                fall,
                width,
                period,
                count,
            } => {
                let args = [v1, v2, delay, rise, fall, width, period];
                Self::new("pulse", args.into_iter().chain(count).collect())
            }
            Wave::Pwl {
                ref points,
                repeat,
                delay,
            } => Self {
                repeat,
                delay: Some(delay).filter(|&delay| delay != 0.0),
                ..Self::new("pwl", points.iter().flat_map(|&(t, v)| [t, v]).collect())
            },
            Wave::Exp {
                v1,
                v2,
                rise_delay,
                rise_tau,
                fall_delay,
                fall_tau,
            } => Self::new(
                "exp",
                vec![v1, v2, rise_delay, rise_tau, fall_delay, fall_tau],
            ),
            Wave::Sffm {
                offset,
                amplitude,
                carrier,
                index,
                signal,
                carrier_phase,
                signal_phase,
            } => Self::new(
                "sffm",
                vec![
                    offset,
                    amplitude,
                    carrier,
                    index,
                    signal,
                    carrier_phase,
                    signal_phase,
                ],
            ),
            Wave::Am {
                amplitude,
                offset,
                modulation,
                carrier,
                delay,
            } => Self::new("am", vec![amplitude, offset, modulation, carrier, delay]),
            Wave::Arriving { delay, initial } => Self::new("arriving", vec![delay, initial]),
        }
    }
}

/// Arguments of one waveform with their names.
struct Arguments<'a> {
    kind: &'static str,
    names: &'static [&'static str],
    values: &'a [f64],
}

impl<'a> Arguments<'a> {
    fn new(
        kind: &'static str,
        expected: &'static str,
        least: usize,
        names: &'static [&'static str],
        values: &'a [f64],
    ) -> Result<Self, WaveError> {
        if values.len() < least || values.len() > names.len() {
            return Err(WaveError::Count {
                kind,
                expected,
                found: values.len(),
            });
        }
        Ok(Self {
            kind,
            names,
            values,
        })
    }

    fn get(&self, index: usize, default: f64) -> Result<f64, WaveError> {
        let value = self.values.get(index).copied().unwrap_or(default);
        if value.is_finite() {
            Ok(value)
        } else {
            Err(self.refuse(index, value))
        }
    }

    fn duration(&self, index: usize, default: f64) -> Result<f64, WaveError> {
        let value = self.get(index, default)?;
        if value >= 0.0 {
            Ok(value)
        } else {
            Err(self.refuse(index, value))
        }
    }

    fn refuse(&self, index: usize, value: f64) -> WaveError {
        WaveError::Argument {
            kind: self.kind,
            name: self.names[index],
            value,
        }
    }
}
