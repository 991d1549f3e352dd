//! Definitions of a block: parameters, functions, models, subcircuits, and the branches of `.if` that count.

use super::builder::Builder;
use super::functions::truth;
use super::scope::ScopeId;
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{Assign, Block, Statement};
use crate::netlist::suggest::nearest;

impl<'n> Builder<'n, '_> {
    /// Takes in the definitions of a block and of the branches of its conditionals.
    pub(super) fn define(&mut self, block: &'n Block, scope: ScopeId) {
        for statement in &block.statements {
            self.define_one(statement, scope);
        }
        if scope == ScopeId::ROOT {
            self.set_temperature();
            self.steps();
        }
        for statement in &block.statements {
            let Statement::If(branches) = statement else {
                continue;
            };
            let taken = branches.iter().position(|branch| match &branch.condition {
                None => true,
                Some(condition) => self
                    .scopes
                    .number(condition, scope)
                    .is_some_and(|v| truth(v.f64)),
            });
            self.choices.push_back(taken);
            if let Some(index) = taken {
                self.tell_all(&branches[index].body.faults);
                self.define(&branches[index].body, scope);
            }
        }
    }

    fn define_one(&mut self, statement: &'n Statement, scope: ScopeId) {
        match statement {
            Statement::Param(params) => {
                for Assign { name, value } in params {
                    if let Some(value) = value
                        && !self.scopes.define(scope, name, value)
                    {
                        let message = format!("parameter `{}` is defined again", name.text);
                        self.tell(
                            Diagnostic::warning("duplicate-parameter", name.span, message)
                                .label("this one counts"),
                        );
                    }
                }
            }
            Statement::Func(func) => {
                self.scopes
                    .get_mut(scope)
                    .funcs
                    .insert(&func.name.text, func);
            }
            Statement::Model(model) => {
                let models = &mut self.scopes.get_mut(scope).models;
                if let Some(first) = models
                    .get(model.name.text.as_str())
                    .map(|first| first.name.span)
                {
                    let message = format!("model `{}` is defined again", model.name.text);
                    self.tell(
                        Diagnostic::warning("duplicate-model", model.name.span, message)
                            .first_at(first)
                            .label("ignored: the first one counts"),
                    );
                } else {
                    models.insert(&model.name.text, model);
                }
            }
            Statement::Subckt(subckt) => {
                let subckts = &mut self.scopes.get_mut(scope).subckts;
                if let Some(first) = subckts
                    .get(subckt.name.text.as_str())
                    .map(|first| first.name.span)
                {
                    let message = format!("subcircuit `{}` is defined again", subckt.name.text);
                    self.tell(
                        Diagnostic::warning("duplicate-subcircuit", subckt.name.span, message)
                            .first_at(first)
                            .label("ignored: the first one counts"),
                    );
                } else {
                    subckts.insert(&subckt.name.text, subckt);
                }
            }
            Statement::Global(names) => self
                .names
                .globals
                .extend(names.iter().map(|n| n.text.as_str())),
            Statement::Tran(tran) => self.trans.push(tran),
            Statement::Analysis(_) => {
                self.other_analysis = true;
                self.circuit.op = true;
            }
            Statement::Ic(list) => self.ics.push((scope, list)),
            Statement::Nodeset(list) => self.nodesets.push((scope, list)),
            Statement::Temperature(value) => self.temperature = Some(value),
            Statement::Nominal(value) => self.nominal = Some(value),
            Statement::Gmin(value) => self.gmin = Some(value),
            Statement::Thermal(card) if scope == ScopeId::ROOT => self.thermals.push(card),
            Statement::Thermal(card) => {
                let message = "`.thermal` inside a subcircuit is not supported yet";
                let fault = Diagnostic::error("unsupported", card.node.span, message);
                let help = "write it at the top level, with full names of devices (`x1.m1`)";
                self.tell(fault.label("recognised only").help(help));
            }
            Statement::Save(list) => {
                self.saves.push((scope, list));
                self.dc_saves.push((scope, list));
            }
            Statement::SaveTran(list) => self.saves.push((scope, list)),
            Statement::SaveDc(list) => self.dc_saves.push((scope, list)),
            Statement::Meas(meas) => self.measurements.push((scope, meas)),
            Statement::Four(four) => self.fours.push((scope, four)),
            Statement::Alter(alter) => self.alter(alter),
            Statement::Step(sweep) => self.step_cards.push(sweep),
            Statement::Ac(card) => {
                self.other_analysis = true;
                self.ac_card = Some(card);
            }
            Statement::Pss(card) => {
                self.other_analysis = true;
                self.pss_card = Some(card);
            }
            Statement::Dc(sweeps) => {
                self.other_analysis = true;
                self.dc_cards = Some(sweeps);
            }
            Statement::Element(element) if scope == ScopeId::ROOT => {
                self.root_elements.insert(&element.name.text);
            }
            Statement::Element(_) | Statement::If(_) => {}
        }
    }

    /// What is toleranced is there, where a sample is drawn.
    fn check_tolerances(&mut self) {
        let sampled = self.options.sample.is_some();
        for tolerance in self.options.tolerances.iter().filter(|_| sampled) {
            let name = tolerance.name.as_str();
            let declared = self.scopes.get(ScopeId::ROOT).declared.contains(name);
            let valued = name.starts_with(['r', 'c', 'l', 'v', 'i']);
            let known = declared || valued && self.root_elements.contains(name);
            if !known {
                let message = format!("there is no element or parameter `{name}` with a tolerance");
                let fault = Diagnostic::error("unknown-parameter", None, message);
                self.tell(fault.help(
                    "tolerances are those of R, C, L and sources of the top level, and of its parameters",
                ));
            }
        }
    }

    pub(super) fn check_overrides(&mut self) {
        self.check_tolerances();
        for (name, _) in &self.options.params {
            let name = name.to_lowercase();
            let declared = &self.scopes.get(ScopeId::ROOT).declared;
            if !declared.contains(name.as_str()) {
                let fault = Diagnostic::error(
                    "unknown-parameter",
                    None,
                    format!("the netlist has no parameter `{name}` to set"),
                );
                let near = nearest(&name, declared.iter().copied());
                let mut names: Vec<&str> = declared.iter().copied().collect();
                names.sort_unstable();
                let help = match (near, &names[..]) {
                    (Some(near), _) => format!("did you mean `{near}`?"),
                    (None, []) => format!("define it, `.param {name}=1`, and use it, `{{{name}}}`"),
                    (None, names) => format!("there are {}", names.join(", ")),
                };
                self.tell(fault.help(help));
            }
        }
    }
}
