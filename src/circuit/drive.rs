//! V and I: waveforms with the defaults that ngspice gives to omitted parameters.

use super::builder::Builder;
use super::passive::Args;
use super::scope::ScopeId;
use super::source::{Form, Source, Wave};
use super::{Element, Kind};
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{self, Assign, Expr, WaveCall};
use crate::settings::tolerances::netlists::STANDS_STILL;
use crate::settings::tolerances::times::SAME_TIME;

#[cfg(test)]
mod tests;

/// LTspice's `startup`: supplies reach their value after this time, s.
const STARTUP: f64 = 20e-6;

impl Wave {
    /// A supply of LTspice's `startup`.
    fn ramp(value: f64) -> Self {
        Self::Pwl {
            points: vec![(0.0, 0.0), (STARTUP, value)],
            repeat: None,
            delay: 0.0,
        }
    }

    /// The value that a supply of LTspice's `startup` ramps up to.
    pub(crate) fn risen(&self) -> Option<f64> {
        let Self::Pwl { points, .. } = self else {
            return None;
        };
        let value = points.last()?.1;
        (*self == Self::ramp(value)).then_some(value)
    }
}

/// Most points of a PWL that repeats so many times.
const MAX_POINTS: usize = 1_000_000;

impl<'n> Builder<'n, '_> {
    pub(super) fn source(
        &mut self,
        card: &'n ast::Element,
        dc: Option<&'n Expr>,
        (wave, small): (Option<&'n WaveCall>, bool),
        args: &'n [Assign],
        scope: ScopeId,
    ) {
        let known = [
            "rser",
            "cpar",
            "rpar",
            "r",
            "td",
            "repeat",
            "distof1",
            "distof2",
            "tfall",
            "dc",
            "file",
            "value_scale_factor",
            "time_scale_factor",
        ];
        if let Some(load) = args.iter().find(|a| a.name.text == "load") {
            let message = format!(
                "`load` of `{}` is ignored: the source also delivers power",
                card.name.text
            );
            self.tell(
                Diagnostic::warning("ignored", load.name.span, message).label("not supported yet"),
            );
        }
        self.check_args(card, args, &[known.as_slice(), &["load"]].concat());
        let args = Args(args);
        let dc = dc.or(args.get(&["dc"]));
        let dc_value = match dc {
            Some(dc) => match self.scopes.finite(dc, scope) {
                Some(value) => Some(value),
                None => return,
            },
            None => None,
        };
        let dc_value = match scope {
            ScopeId::ROOT => self.settled(&card.name.text, dc_value, None),
            _ => dc_value,
        };
        let dc_value = dc_value.map(|value| value.f64);
        let wave = match wave {
            Some(call) => match self.wave(card, call, args, scope) {
                Some(wave) => wave,
                None => return,
            },
            None => {
                if dc_value.is_none() && !small {
                    let message = format!("`{}` has no value: 0 is assumed", card.name.text);
                    self.tell(
                        Diagnostic::note("no-value", card.span, message)
                            .label("an ammeter, if it is a voltage source"),
                    );
                }
                self.constant(dc_value.unwrap_or(0.0))
            }
        };
        let source = Source::new(dc_value, wave);
        let (p, n) = (
            self.node(&card.nodes[0], scope),
            self.node(&card.nodes[1], scope),
        );
        let voltage = card.name.text.starts_with('v');
        let kind = if voltage {
            Kind::VoltageSource(source)
        } else {
            Kind::CurrentSource(source)
        };
        let name = self.full_name(&card.name, scope);
        self.with_parasitics(
            Element {
                name,
                p,
                n,
                kind,
                ic: None,
                span: Some(card.span),
            },
            args,
            scope,
        );
    }

    /// A DC source, which ramps up under LTspice's `startup`.
    fn constant(&self, value: f64) -> Wave {
        if self.startup() && value != 0.0 {
            Wave::ramp(value)
        } else {
            Wave::Dc(value)
        }
    }

    fn wave(
        &mut self,
        card: &'n ast::Element,
        call: &'n WaveCall,
        args: Args<'n>,
        scope: ScopeId,
    ) -> Option<Wave> {
        let mut x = Vec::with_capacity(call.args.len());
        for arg in &call.args {
            x.push(self.scopes.finite(&arg.value, scope)?.f64);
        }
        let most = match call.name.text.as_str() {
            "sin" | "sine" => 7,
            "pulse" => 8,
            "exp" => 6,
            _ => usize::MAX,
        };
        if let Some(extra) = call.args.get(most) {
            let message = format!(
                "{} takes at most {most} values",
                call.name.text.to_uppercase()
            );
            self.tell(
                Diagnostic::error("unexpected", extra.value.span, message).label("one too many"),
            );
            return None;
        }
        match call.name.text.as_str() {
            "sin" | "sine" => {
                self.warn_of_millihertz(call, 2, &x);
                Some(self.sine(&x))
            }
            "pulse" => self.pulse(call, &x),
            "exp" => Some(self.exponential(&x)),
            "pwl" => self.pwl(call, &x, args, scope),
            "sffm" | "am" => self.modulated(call, x),
            name => {
                let why = match name {
                    "trnoise" | "trrandom" => {
                        "a random source, which no exact or repeatable run can follow"
                    }
                    _ => "recognised only",
                };
                let message = format!(
                    "{} of `{}` is not supported",
                    name.to_uppercase(),
                    card.name.text
                );
                let fault = Diagnostic::error("unsupported", call.name.span, message).label(why);
                self.tell(fault.help("supported waveforms are SIN, PULSE, PWL, EXP, SFFM, AM"));
                None
            }
        }
    }

    /// Print step and stop time, from which ngspice takes defaults.
    fn defaults(&self) -> (f64, f64) {
        self.circuit.tran.map_or((0.0, 1.0), |t| (t.tstep, t.tstop))
    }

    /// Warns of a frequency, the k-th value, in mHz of which the run sees next to nothing: `10M` was probably meant as 10 MHz.
    fn warn_of_millihertz(&mut self, call: &WaveCall, k: usize, x: &[f64]) {
        let (Some(tran), Some(written), Some(&frequency)) =
            (self.circuit.tran, call.args.get(k), x.get(k))
        else {
            return;
        };
        if !(1e-3..1.0).contains(&frequency) || frequency * tran.tstop > STANDS_STILL {
            return;
        }
        let milli = (1e6 * frequency).round() * 1e-3;
        let name = call.name.text.to_uppercase();
        let message =
            format!("{name} has a frequency of {milli} mHz, of which the run sees next to nothing");
        self.tell(
            Diagnostic::warning("suffix-m", written.value.span, message)
                .label("`m` and `M` are milli")
                .help(format!("write `{milli}Meg` for {milli} MHz")),
        );
    }

    fn sine(&self, x: &[f64]) -> Wave {
        let at = |k: usize| x.get(k).copied().unwrap_or(0.0);
        let frequency = x.get(2).copied().unwrap_or(1.0 / self.defaults().1);
        Wave::Sin {
            offset: at(0),
            amplitude: at(1),
            frequency,
            delay: at(3),
            damping: at(4),
            phase: at(5),
            cycles: Some(at(6)).filter(|&n| n > 0.0 && frequency > 0.0),
        }
    }

    fn pulse(&mut self, call: &WaveCall, x: &[f64]) -> Option<Wave> {
        let (tstep, tstop) = self.defaults();
        let at = |k: usize| x.get(k).copied().unwrap_or(0.0);
        let or = |k: usize, default: f64| x.get(k).copied().unwrap_or(default);
        let (rise, fall, width) = (or(3, tstep), or(4, tstep), or(5, tstop));
        // Without a period it comes once: what ngspice has begin again at the end of the run would be an edge on the last row.
        let period = or(6, 0.0);
        for (k, value) in [(3, rise), (4, fall), (5, width), (6, period)] {
            if value < 0.0 {
                let message = format!(
                    "PULSE has a negative {}",
                    ["rise time", "fall time", "width", "period"][k - 3]
                );
                let span = call.args.get(k).map_or(call.name.span, |a| a.value.span);
                self.tell(
                    Diagnostic::error("bad-value", span, message).label("must not be negative"),
                );
                return None;
            }
        }
        // Defaults of omitted values may overlap; only what was written is worth a warning.
        if period > 0.0 && rise + width + fall > period * (1.0 + SAME_TIME) {
            let message = "rise time, width and fall time add up to more than the period";
            self.tell(
                Diagnostic::warning("pulse-overfull", call.name.span, message)
                    .label("cut off by the next period")
                    .help("shorten the width, so that TR + PW + TF ≤ PER, or lengthen the period"),
            );
        }
        if x.get(5) == Some(&0.0) && at(0) != at(1) {
            let message = "PULSE with a width of 0 has no top: it falls as soon as it has risen";
            self.tell(
                Diagnostic::note("pulse-width-zero", call.args[5].value.span, message)
                    .label("some versions of ngspice take the stop time instead")
                    .help("leave the last two values out for a single step"),
            );
        }
        let count = x.get(7).copied().filter(|n| *n > 0.0);
        Some(Wave::Pulse {
            v1: at(0),
            v2: at(1),
            delay: at(2),
            rise,
            fall,
            width,
            period,
            count,
        })
    }

    /// SFFM and AM; AM's phases must be zero.
    fn modulated(&mut self, call: &WaveCall, mut x: Vec<f64>) -> Option<Wave> {
        let (tstep, tstop) = self.defaults();
        let (plain, carrier) = if call.name.text == "am" {
            (5, 3)
        } else {
            (7, 2)
        };
        self.warn_of_millihertz(call, carrier, &x);
        if x.iter().skip(plain).all(|phase| *phase == 0.0) {
            x.truncate(plain);
        }
        let form = Form {
            kind: call.name.text.clone(),
            args: x,
            repeat: None,
            delay: None,
        };
        let wave = form.wave(tstep, tstop);
        wave.map_err(|fault| {
            let fault = Diagnostic::error("bad-value", call.name.span, fault.to_string());
            self.tell(fault.label("its values are no such waveform"));
        })
        .ok()
    }

    fn exponential(&self, x: &[f64]) -> Wave {
        let (tstep, _) = self.defaults();
        let at = |k: usize| x.get(k).copied().unwrap_or(0.0);
        let or =
            |k: usize, default: f64| x.get(k).copied().filter(|v| *v != 0.0).unwrap_or(default);
        let rise_delay = at(2);
        Wave::Exp {
            v1: at(0),
            v2: at(1),
            rise_delay,
            rise_tau: or(3, tstep),
            fall_delay: x.get(4).copied().unwrap_or(rise_delay + tstep),
            fall_tau: or(5, tstep),
        }
    }

    fn pwl(
        &mut self,
        call: &'n WaveCall,
        x: &[f64],
        args: Args<'n>,
        scope: ScopeId,
    ) -> Option<Wave> {
        if x.is_empty() || x.len() % 2 == 1 {
            let message = format!(
                "PWL needs pairs of time and value, this one has {} numbers",
                x.len()
            );
            let span = call.args.last().map_or(call.name.span, |a| a.value.span);
            self.tell(Diagnostic::error("pwl-odd", span, message).label("without a partner"));
            return None;
        }
        let mut scale = |name| self.arg(args, &[name], scope);
        let (times, values) = (scale("time_scale_factor")?, scale("value_scale_factor")?);
        let (times, values) = (times.map_or(1.0, |v| v.f64), values.map_or(1.0, |v| v.f64));
        let mut points: Vec<(f64, f64)> = Vec::with_capacity(x.len() / 2);
        for (k, pair) in x.chunks_exact(2).enumerate() {
            let written = &call.args[2 * k];
            let before = points.last().map_or(0.0, |p| p.0);
            let time = if written.plus {
                before + times * pair[0]
            } else {
                times * pair[0]
            };
            if k > 0 && time < before {
                let message = format!("PWL goes back in time, from {before} s to {time} s");
                self.tell(
                    Diagnostic::error("pwl-backwards", written.value.span, message)
                        .label("earlier than the point before")
                        .help("put the points in order of time; two of equal time make a jump"),
                );
                return None;
            }
            points.push((time, values * pair[1]));
        }
        let repeat = args
            .0
            .iter()
            .find(|a| matches!(a.name.text.as_str(), "repeat" | "r"));
        let repeat = match repeat {
            None => None,
            Some(Assign { name, value: None }) if name.text == "repeat" => Some(0.0),
            Some(Assign {
                name,
                value: Some(value),
            }) if name.text == "repeat" => {
                let times = self.scopes.finite(value, scope)?.f64;
                points = self.repeated(&points, times, value)?;
                None
            }
            Some(Assign {
                value: Some(value), ..
            }) => Some(self.scopes.finite(value, scope)?.f64).filter(|r| *r >= 0.0),
            Some(Assign { value: None, .. }) => None,
        };
        let last = points.last().map_or(0.0, |p| p.0);
        if let Some(from) = repeat.filter(|from| *from >= last) {
            let message =
                format!("PWL repeats from {from} s, which is not before its end at {last} s");
            self.tell(
                Diagnostic::error("bad-value", call.name.span, message).label("nothing to repeat"),
            );
            return None;
        }
        let delay = self.arg(args, &["td"], scope)?.map_or(0.0, |v| v.f64);
        Some(Wave::Pwl {
            points,
            repeat,
            delay,
        })
    }

    /// The points `times` over, each round beginning where the last one ended.
    fn repeated(
        &mut self,
        points: &[(f64, f64)],
        times: f64,
        written: &Expr,
    ) -> Option<Vec<(f64, f64)>> {
        let most = MAX_POINTS / points.len().max(1);
        if times.fract() != 0.0 || times < 1.0 || times > most as f64 {
            let message = format!("PWL cannot be repeated {times} times");
            let label = format!("a whole number from 1 to {most}");
            self.tell(Diagnostic::error("bad-value", written.span, message).label(label));
            return None;
        }
        let round = points.last().map_or(0.0, |p| p.0);
        let mut all = Vec::with_capacity(points.len() * times as usize);
        for k in 0..times as usize {
            all.extend(points.iter().map(|(t, v)| (k as f64 * round + t, *v)));
        }
        Some(all)
    }
}
