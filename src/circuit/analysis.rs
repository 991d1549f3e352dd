//! `.tran` and `.ic`.

use super::builder::Builder;
use super::scope::ScopeId;
use super::{Kind, NodeId, SteadyState, Tran};
use crate::algebra::Value;
use crate::diagnostic::{Diagnostic, Severity};
use crate::netlist::ast::{self, Expr, Signal};
use crate::settings::tolerances::times::{MOST_PARTS, SPAN_PARTS};

impl<'n> Builder<'n, '_> {
    /// The transient analysis: the last card, or else the command inside `.control`.
    pub(super) fn transient(&mut self) -> Option<Tran> {
        let cards: Vec<&ast::Tran> = self.trans.iter().copied().filter(|t| !t.command).collect();
        let tran = *cards.last().or(self.trans.last())?;
        if cards.len() > 1 {
            self.tell(
                Diagnostic::warning("duplicate-tran", tran.span, "more than one `.tran`")
                    .label("this one counts"),
            );
        }
        let mut times = Vec::with_capacity(4);
        for arg in &tran.args {
            times.push(self.scopes.finite(arg, ScopeId::ROOT)?.f64);
        }
        let (step, tstop) = if times.len() == 1 {
            (0.0, times[0])
        } else {
            (times[0], times[1])
        };
        let tstart = times.get(2).copied().unwrap_or(0.0);
        if times.iter().any(|t| *t < 0.0) {
            self.tell(
                Diagnostic::error("bad-tran", tran.span, "`.tran` has a negative time")
                    .label("times must not be negative"),
            );
            return None;
        }
        if tstop <= tstart {
            let message = format!("`.tran` ends at {tstop} s, not after its start at {tstart} s");
            let fault =
                Diagnostic::error("bad-tran", tran.span, message).label("nothing to simulate");
            self.tell(fault.help("write `.tran tstep tstop`"));
            return None;
        }
        if step > tstop - tstart {
            let message = "the print step of `.tran` is longer than the run";
            self.tell(
                Diagnostic::warning("bad-tran", tran.span, message)
                    .label("only the first and last point will be written")
                    .help("the print step comes first, then the end of the run: `.tran 1u 5m`"),
            );
        }
        let tmax = times.get(3).copied().filter(|t| *t > 0.0);
        let span = tstop - tstart;
        let tstep = if step > 0.0 {
            step
        } else {
            // Who names a largest step alone wants to see what happens within it.
            let most = tmax.map_or(span, |tmax| tmax.max(span / MOST_PARTS));
            most.min(span / SPAN_PARTS)
        };
        Some(Tran {
            tstep,
            prints: step > 0.0,
            tstop,
            tstart,
            tmax,
            uic: tran.uic,
        })
    }

    /// `.tran … steady`, and `.pss` where there is no `.tran`.
    pub(super) fn steady(&mut self) {
        if !self.trans.is_empty() {
            let begins = self.trans.iter().any(|t| t.steady);
            self.circuit.steady = begins.then_some(SteadyState::Start);
            if let Some(card) = self.pss_card {
                let message = "skipped, as there is a `.tran`: .pss";
                let note = Diagnostic::note("skipped", card.span, message);
                self.tell(note.help("`circ pss FILE` finds the periodic steady state"));
            }
        } else if let Some(card) = self.pss_card {
            self.circuit.tran = self.orbit(card);
            self.circuit.steady = self.circuit.tran.map(|_| SteadyState::Orbit);
        }
    }

    /// The rows of a period, and how long an orbit without sources is looked for.
    fn orbit(&mut self, card: &'n ast::Pss) -> Option<Tran> {
        let mut number = |e| self.scopes.finite(e, ScopeId::ROOT).map(|v| v.f64);
        let (frequency, settling) = (number(&card.frequency)?, number(&card.settling)?);
        let points = number(&card.points)?;
        let (period, rows) = (frequency.recip(), points.round());
        let found = Tran {
            tstep: period / rows,
            prints: true,
            tstop: settling + period,
            tstart: 0.0,
            tmax: None,
            uic: card.uic,
        };
        if period > 0.0 && rows >= 1.0 && settling >= 0.0 && found.tstep > 0.0 {
            return Some(found);
        }
        let message = "`.pss` needs a frequency and a number of points above zero";
        let fault = Diagnostic::error("bad-tran", card.span, message).label("no such period");
        self.tell(fault.help(
            "write `.pss 1k 10m out 100 10`: frequency, time to settle, node, points, harmonics",
        ));
        None
    }

    /// Whether `.tran … startup` asks for supplies that ramp up.
    pub(super) fn startup(&self) -> bool {
        self.trans.iter().any(|t| t.startup)
    }

    /// The temperature of expressions: of a sweep, else of `.temp`; and the nominal one, of `.options tnom=`.
    pub(super) fn set_temperature(&mut self) {
        let swept = self.options.temperature.map(Value::binary);
        let written = self.temperature.take();
        let written = written.and_then(|e| self.scopes.finite(e, ScopeId::ROOT));
        if let Some(temperature) = swept.or(written) {
            self.scopes.temperature = temperature;
        }
        let nominal = self.nominal.take();
        if let Some(nominal) = nominal.and_then(|e| self.scopes.finite(e, ScopeId::ROOT)) {
            self.scopes.nominal = nominal.f64;
        }
    }

    /// `.nodeset`: node voltages from which the operating point is looked for.
    pub(super) fn nodeset(&mut self, list: &'n [(Signal, Expr)], scope: ScopeId) {
        for (signal, value) in list {
            let Some(value) = self.scopes.finite(value, scope).map(|v| v.f64) else {
                continue;
            };
            let node = |name| self.names.expect_node(name, &self.scopes, scope);
            let pair = match signal {
                Signal::Voltage(a, b) => node(a).and_then(|a| {
                    let b = b.as_ref().map_or(Ok(NodeId::GROUND), node)?;
                    Ok((a, b))
                }),
                Signal::Current(name) => {
                    let fault = Diagnostic::error("ignored", name.span, "a current");
                    Err(Box::new(fault.label("node voltages only")))
                }
            };
            match pair {
                Ok((a, b)) => self.circuit.nodesets.push((a, b, value)),
                Err(fault) => {
                    let message = format!("{}: `.nodeset` is ignored", fault.message);
                    self.tell(Diagnostic {
                        severity: Severity::Warning,
                        message,
                        ..*fault
                    });
                }
            }
        }
    }

    /// `.ic`: what it cannot set is ignored with a warning.
    pub(super) fn initial(&mut self, list: &'n [(Signal, Expr)], scope: ScopeId) {
        for (signal, value) in list {
            let Some(value) = self.scopes.finite(value, scope).map(|v| v.f64) else {
                continue;
            };
            if let Err(fault) = self.initial_one(signal, value, scope) {
                let message = format!("{}: `.ic` is ignored", fault.message);
                self.tell(Diagnostic {
                    severity: Severity::Warning,
                    message,
                    ..*fault
                });
            }
        }
    }

    fn initial_one(
        &mut self,
        signal: &Signal,
        value: f64,
        scope: ScopeId,
    ) -> Result<(), Box<Diagnostic>> {
        let node = |name| self.names.expect_node(name, &self.scopes, scope);
        match signal {
            Signal::Voltage(a, b) => {
                let a = node(a)?;
                let b = b.as_ref().map_or(Ok(NodeId::GROUND), node)?;
                self.circuit.initial_voltages.push((a, b, value));
            }
            Signal::Current(name) => {
                let id = self
                    .names
                    .expect_element(name, &self.scopes, scope, "inductor", &[])?;
                let element = &mut self.circuit.elements[id.index()];
                if !matches!(element.kind, Kind::Inductor(_)) {
                    let message = format!("`{}` is not an inductor", name.text);
                    return Err(Box::new(
                        Diagnostic::error("ignored", name.span, message).label("has no state"),
                    ));
                }
                element.ic = Some(value);
                self.circuit.initial_currents.push((id, value));
            }
        }
        Ok(())
    }
}
