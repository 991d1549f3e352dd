//! E, F, G, H, B: controls as functions of voltages and currents; K: couplings.

use super::builder::{Builder, Pending};
use super::form::Form;
use super::names::{current, difference};
use super::passive::Args;
use super::scope::ScopeId;
use super::{Affine, Coupling, Element, ElementId, Kind, Output};
use crate::algebra::Value;
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{self, Assign, Control, Expr};

impl<'n> Builder<'n, '_> {
    pub(super) fn controlled(
        &mut self,
        card: &'n ast::Element,
        voltage: bool,
        control: &'n Control,
        args: &'n [Assign],
        scope: ScopeId,
    ) {
        if let Control::Other(what) = control {
            let message = format!(
                "`{}` of `{}` is recognised but not supported yet",
                what.text, card.name.text
            );
            self.tell(
                Diagnostic::error("unsupported", what.span, message).label("not supported yet"),
            );
            return;
        }
        let warm = self.scopes.temperature.f64 != self.scopes.nominal
            || Args(args).get(&["temp", "dtemp"]).is_some();
        for arg in args {
            match arg.name.text.as_str() {
                "noiseless" => {}
                "tc" | "tc1" | "tc2" | "temp" | "dtemp" if !warm => {}
                name => {
                    let message = format!("`{name}` of `{}` is not supported", card.name.text);
                    self.tell(
                        Diagnostic::warning("ignored", arg.name.span, message).label("ignored"),
                    );
                }
            }
        }
        let (p, n) = (
            self.node(&card.nodes[0], scope),
            self.node(&card.nodes[1], scope),
        );
        let output = if voltage {
            Output::Voltage
        } else {
            Output::Current
        };
        let kind = Kind::Controlled {
            output,
            control: Affine::default(),
        };
        let name = self.full_name(&card.name, scope);
        if let Some(element) = self.add(Element {
            name,
            p,
            n,
            kind,
            ic: None,
            span: Some(card.span),
        }) {
            self.pending.push(Pending {
                element,
                scope,
                control,
                span: card.span,
            });
        }
    }

    /// The function a control means, all elements being known.
    pub(super) fn control(&mut self, pending: &Pending<'n>) -> Option<Form> {
        let scope = pending.scope;
        let form = match pending.control {
            Control::Nodes(pairs, coefficients) => {
                let mut inputs = Vec::with_capacity(pairs.len());
                for (a, b) in pairs {
                    let (a, b) = (self.expect_node(a, scope)?, self.expect_node(b, scope)?);
                    inputs.push(difference(a, b));
                }
                self.polynomial(inputs, coefficients, scope)?
            }
            Control::Currents(sources, coefficients) => {
                let mut inputs = Vec::with_capacity(sources.len());
                for source in sources {
                    inputs.push(current(self.expect_element(
                        source,
                        scope,
                        "voltage source",
                    )?));
                }
                self.polynomial(inputs, coefficients, scope)?
            }
            Control::Expression(expr) => self.expression(expr, scope)?,
            Control::Table(input, points) => self.table(input, points, scope)?,
            Control::Other(_) => return None,
        };
        if !form.is_finite() {
            self.tell(
                Diagnostic::error("bad-value", pending.span, "the control has no finite value")
                    .label("not finite"),
            );
            return None;
        }
        Some(form)
    }

    /// An expression in voltages, currents and time.
    fn expression(&mut self, expr: &'n Expr, scope: ScopeId) -> Option<Form> {
        let names = &self.names;
        self.scopes.form(
            expr,
            scope,
            Some(&|signal, scopes, scope| names.signal(signal, scopes, scope)),
        )
    }

    /// `TABLE {input} = (x,y) …`: constant outside.
    fn table(
        &mut self,
        input: &'n Expr,
        points: &'n [(Expr, Expr)],
        scope: ScopeId,
    ) -> Option<Form> {
        let form = self.expression(input, scope)?;
        let mut numbers = Vec::with_capacity(points.len());
        for (x, y) in points {
            let (x, y) = (self.scopes.finite(x, scope), self.scopes.finite(y, scope));
            numbers.push((x?.f64, y?.f64));
        }
        let form = self
            .scopes
            .table(&form, &numbers)
            .map_err(|why| {
                let at = points
                    .windows(2)
                    .zip(numbers.windows(2))
                    .find(|(_, n)| n[0].0 > n[1].0)
                    .map_or(input, |(p, _)| &p[1].0);
                self.scopes.unfit(at, why)
            })
            .ok()?;
        self.scopes.checked(input, form)
    }

    /// c0 + c1 x1 + … + cn xn; higher coefficients must be zero. A single coefficient for one input is c1 (SPICE2).
    fn polynomial(
        &mut self,
        inputs: Vec<Form>,
        coefficients: &'n [Expr],
        scope: ScopeId,
    ) -> Option<Form> {
        let one = Form::number(Value::decimal(0.0, 0, 0));
        if coefficients.is_empty() {
            // A switch: its single input itself.
            return Some(inputs.into_iter().fold(one, Form::plus));
        }
        let mut values = Vec::with_capacity(coefficients.len());
        for coefficient in coefficients {
            values.push(self.scopes.finite(coefficient, scope)?);
        }
        if values.len() == 1 && inputs.len() == 1 {
            values.insert(0, Value::decimal(0.0, 0, 0));
        }
        if let Some(index) = values
            .iter()
            .skip(inputs.len() + 1)
            .position(|v| v.f64 != 0.0)
        {
            let at = coefficients
                .get(inputs.len() + 1 + index)
                .or(coefficients.last())?;
            let message = "POLY of degree 2 or more is recognised but not supported";
            self.tell(
                Diagnostic::error("not-linear", at.span, message)
                    .label("a coefficient of a product"),
            );
            return None;
        }
        let mut form = Form::number(values[0]);
        for (input, gain) in inputs.into_iter().zip(&values[1..]) {
            form = form.plus(input.scaled(*gain));
        }
        Some(form)
    }

    /// All couplings, pair by pair.
    pub(super) fn couple(&mut self) {
        for card in std::mem::take(&mut self.couplings) {
            let Some(k) = self.scopes.finite(card.k, card.scope) else {
                continue;
            };
            if k.f64.abs() > 1.0 {
                let message = format!(
                    "the coupling coefficient of `{}` is {}, outside −1 … 1",
                    card.name, k.f64
                );
                let help = "k = 1 is an ideal transformer; more would create energy";
                self.tell(
                    Diagnostic::error("coupling", card.k.span, message)
                        .label("too large")
                        .help(help),
                );
                continue;
            }
            let mut ids = Vec::with_capacity(card.inductors.len());
            for name in card.inductors {
                let found = self.names.expect_element(
                    name,
                    &self.scopes,
                    card.scope,
                    "inductor",
                    card.inductors,
                );
                match found {
                    Ok(id)
                        if matches!(self.circuit.elements[id.index()].kind, Kind::Inductor(_)) =>
                    {
                        ids.push(id)
                    }
                    Ok(_) => {
                        let message = format!("`{}` is not an inductor", name.text);
                        self.tell(
                            Diagnostic::error("coupling", name.span, message)
                                .label("only inductors can be coupled"),
                        );
                    }
                    Err(fault) => self.tell(*fault),
                }
            }
            let negative = ids.iter().find(|id| {
                matches!(self.circuit.elements[id.index()].kind, Kind::Inductor(l) if l.f64 < 0.0)
            });
            if let Some(id) = negative {
                let name = self.circuit.elements[id.index()].name.clone();
                let message = format!(
                    "`{}` couples `{name}`, whose inductance is negative",
                    card.name
                );
                self.tell(
                    Diagnostic::error("coupling", card.span, message)
                        .label("no winding has a negative inductance"),
                );
                continue;
            }
            for (i, &a) in ids.iter().enumerate() {
                for &b in &ids[i + 1..] {
                    let twice = self
                        .circuit
                        .couplings
                        .iter()
                        .any(|c| (c.a, c.b) == (a, b) || (c.a, c.b) == (b, a));
                    if a == b || twice {
                        let name = |id: ElementId| self.circuit.elements[id.index()].name.clone();
                        let message = format!(
                            "`{}` couples `{}` and `{}` again",
                            card.name,
                            name(a),
                            name(b)
                        );
                        self.tell(
                            Diagnostic::error("coupling", card.span, message)
                                .label("each pair has one coupling"),
                        );
                    } else {
                        self.circuit.couplings.push(Coupling {
                            name: card.name.clone(),
                            a,
                            b,
                            k,
                            span: Some(card.span),
                        });
                    }
                }
            }
        }
    }
}
