//! Scopes: the parameters, functions, models and subcircuits that a name may mean at a place.
//!
//! A subcircuit instance sees its own definitions, then those of the instance that calls it, up to the top level.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use super::NodeId;
use super::behaviour::Auxiliary;
use super::draw::{Draw, Tolerance};
use super::tones::Known;
use crate::algebra::Value;
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{Expr, Func, Model, Name, Subckt};
use crate::netlist::suggest::nearest;

/// The temperature of circuits without `.temp`, and that at which values and models hold where no TNOM says, °C.
pub(super) const NOMINAL: f64 = 27.0;

/// Everything found so far, each finding once.
#[derive(Debug, Default)]
pub(super) struct Findings {
    list: Vec<Diagnostic>,
    seen: HashSet<(&'static str, Option<crate::diagnostic::Span>, String)>,
    /// Of missing names: the place of the finding in the list, and how often it was met.
    missing: HashMap<(&'static str, String), (usize, usize)>,
}

impl Findings {
    pub(super) fn tell(&mut self, finding: Diagnostic) {
        if self
            .seen
            .insert((finding.code, finding.span, finding.message.clone()))
        {
            self.list.push(finding);
        }
    }

    /// Tells that a name is not defined: once, with the count of its uses.
    pub(super) fn miss(&mut self, name: &str, finding: Diagnostic) {
        let place = self.list.len();
        let key = (finding.code, name.to_owned());
        self.missing.entry(key).or_insert((place, 0)).1 += 1;
        if self.missing[&(finding.code, name.to_owned())].1 == 1 {
            self.list.push(finding);
        }
    }

    pub(super) fn any_error(&self) -> bool {
        self.list
            .iter()
            .any(|d| d.severity == crate::diagnostic::Severity::Error)
    }

    /// Number of findings so far.
    pub(super) fn len(&self) -> usize {
        self.list.len()
    }

    /// Makes warnings of the errors found since there were `from` findings, and says what follows from them.
    pub(super) fn soften(&mut self, from: usize, consequence: &str) {
        for finding in &mut self.list[from..] {
            if finding.severity == crate::diagnostic::Severity::Error {
                finding.severity = crate::diagnostic::Severity::Warning;
                finding.message.push_str(consequence);
            }
        }
    }

    pub(super) fn into_list(mut self) -> Vec<Diagnostic> {
        let missing: BTreeMap<_, _> = self.missing.into_iter().collect();
        for (place, uses) in missing.into_values().filter(|(_, uses)| *uses > 1) {
            let message = &mut self.list[place].message;
            message.push_str(&format!(", the first of {uses} that do"));
        }
        self.list
    }
}

/// A scope, as an index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ScopeId(usize);

impl ScopeId {
    /// The top level.
    pub(super) const ROOT: Self = Self(0);
}

/// A parameter.
#[derive(Debug, Clone, Copy)]
pub(super) enum Param<'n> {
    /// Not needed so far.
    Unevaluated(&'n Expr),
    /// Being evaluated: meeting it again is a circle.
    Busy,
    /// Its value.
    Known(Value),
    /// Reported already.
    Failed,
}

/// What is defined at one level.
#[derive(Debug, Default)]
pub(super) struct Scope<'n> {
    parent: Option<ScopeId>,
    /// `x1.` in front of names.
    pub(super) prefix: String,
    /// Nodes of the caller by the names they have here.
    pub(super) ports: HashMap<&'n str, NodeId>,
    params: HashMap<String, Param<'n>>,
    /// Parameters that definitions here may not replace: `--param` and those of a call; and whether something asked for them.
    fixed: HashMap<String, Cell<bool>>,
    /// Parameters that `.param` or `.subckt` define here.
    pub(super) declared: HashSet<&'n str>,
    pub(super) funcs: HashMap<&'n str, &'n Func>,
    pub(super) models: HashMap<&'n str, &'n Model>,
    pub(super) subckts: HashMap<&'n str, &'n Subckt>,
}

/// All scopes and what was found while evaluating in them.
#[derive(Debug)]
pub(super) struct Scopes<'n> {
    list: Vec<Scope<'n>>,
    pub(super) findings: Findings,
    /// Parameters being evaluated, for messages about circles.
    pub(super) evaluating: Vec<String>,
    /// Depth of the evaluation.
    pub(super) depth: usize,
    /// Operations evaluated so far.
    pub(super) steps: usize,
    /// Whether an evaluation without end was reported.
    pub(super) gave_up: bool,
    /// What piecewise-linear expressions need besides their own element.
    pub(super) auxiliaries: Vec<Auxiliary>,
    /// Nodes that a DC source holds, with their voltages.
    pub(super) rails: HashMap<NodeId, f64>,
    /// Nodes at which a source holds a sum of a constant and sines against ground.
    pub(super) tones: HashMap<NodeId, Known>,
    /// Those of them whose voltage an expression took as a number.
    pub(super) rails_read: BTreeSet<NodeId>,
    /// The end of the run, s.
    pub(super) tstop: f64,
    /// °C.
    pub(super) temperature: Value,
    /// That at which values and models without a TNOM of their own hold, °C.
    pub(super) nominal: f64,
    /// The sample of random values, where one is drawn.
    pub(super) draw: Option<Draw>,
    /// The tolerances given beside the netlist.
    pub(super) tolerances: Vec<Tolerance>,
    /// Where in the netlist the evaluation is.
    pub(super) place: u64,
    /// Whether a random function was met.
    pub(super) random: bool,
}

impl<'n> Scopes<'n> {
    pub(super) fn new() -> Self {
        Self {
            list: vec![Scope::default()],
            findings: Findings::default(),
            evaluating: Vec::new(),
            depth: 0,
            steps: 0,
            gave_up: false,
            auxiliaries: Vec::new(),
            rails: HashMap::new(),
            tones: HashMap::new(),
            rails_read: BTreeSet::new(),
            tstop: 1.0,
            temperature: Value::decimal(NOMINAL, 27, 0),
            nominal: NOMINAL,
            draw: None,
            tolerances: Vec::new(),
            place: 0,
            random: false,
        }
    }

    pub(super) fn open(&mut self, parent: ScopeId, name: &str) -> ScopeId {
        let prefix = format!("{}{name}.", self.get(parent).prefix);
        self.list.push(Scope {
            parent: Some(parent),
            prefix,
            ..Scope::default()
        });
        ScopeId(self.list.len() - 1)
    }

    pub(super) fn get(&self, id: ScopeId) -> &Scope<'n> {
        &self.list[id.0]
    }

    pub(super) fn get_mut(&mut self, id: ScopeId) -> &mut Scope<'n> {
        &mut self.list[id.0]
    }

    pub(super) fn all(&self) -> impl Iterator<Item = &Scope<'n>> {
        self.list.iter()
    }

    /// The node at a pin of a subcircuit: `x1:out`.
    pub(super) fn port(&self, text: &str) -> Option<NodeId> {
        let (device, pin) = text.rsplit_once(':')?;
        let prefix = format!("{}.", device.replace(':', "."));
        let scope = self.list.iter().find(|scope| scope.prefix == prefix)?;
        scope.ports.get(pin).copied()
    }

    /// A scope and those around it.
    pub(super) fn chain(&self, id: ScopeId) -> impl Iterator<Item = (ScopeId, &Scope<'n>)> {
        std::iter::successors(Some(id), |id| self.get(*id).parent).map(|id| (id, self.get(id)))
    }

    /// Gives a parameter a value that definitions in the scope do not replace.
    pub(super) fn fix(&mut self, id: ScopeId, name: &str, value: Option<Value>) {
        let scope = self.get_mut(id);
        scope.fixed.insert(name.to_string(), Cell::default());
        scope
            .params
            .insert(name.to_string(), value.map_or(Param::Failed, Param::Known));
    }

    /// Defines a parameter here; false if this scope had a definition of its own already.
    pub(super) fn define(&mut self, id: ScopeId, name: &'n Name, value: &'n Expr) -> bool {
        let scope = self.get_mut(id);
        if !scope.fixed.contains_key(&name.text) {
            scope
                .params
                .insert(name.text.clone(), Param::Unevaluated(value));
        }
        scope.declared.insert(&name.text)
    }

    pub(super) fn set(&mut self, id: ScopeId, name: &str, param: Param<'n>) {
        self.get_mut(id).params.insert(name.to_string(), param);
    }

    /// The parameters declared here that have been evaluated, by name.
    pub(super) fn evaluated(&self, id: ScopeId) -> Vec<(String, f64)> {
        let scope = self.get(id);
        let value = |name: &&str| match scope.params.get(*name) {
            Some(Param::Known(value)) => Some((name.to_string(), value.f64)),
            _ => None,
        };
        let names: BTreeSet<&str> = scope.declared.iter().copied().map(AsRef::as_ref).collect();
        names.iter().filter_map(value).collect()
    }

    /// The parameter a name means, and where it is defined.
    pub(super) fn param(&self, id: ScopeId, name: &str) -> Option<(ScopeId, Param<'n>)> {
        let (id, scope, found) = self
            .chain(id)
            .find_map(|(id, scope)| scope.params.get(name).map(|p| (id, scope, *p)))?;
        if let Some(asked) = scope.fixed.get(name) {
            asked.set(true);
        }
        Some((id, found))
    }

    /// Whether something asked for a fixed parameter of a scope.
    pub(super) fn is_asked(&self, id: ScopeId, name: &str) -> bool {
        self.get(id).fixed.get(name).is_some_and(Cell::get)
    }

    pub(super) fn func(&self, id: ScopeId, name: &str) -> Option<&'n Func> {
        self.chain(id)
            .find_map(|(_, scope)| scope.funcs.get(name).copied())
    }

    pub(super) fn model(&self, id: ScopeId, name: &str) -> Option<&'n Model> {
        self.chain(id)
            .find_map(|(_, scope)| scope.models.get(name).copied())
    }

    pub(super) fn subckt(&self, id: ScopeId, name: &str) -> Option<&'n Subckt> {
        self.chain(id)
            .find_map(|(_, scope)| scope.subckts.get(name).copied())
    }

    /// A visible name like this one.
    pub(super) fn near<'s, I>(
        &'s self,
        id: ScopeId,
        name: &str,
        names: impl Fn(&'s Scope<'n>) -> I,
    ) -> Option<String>
    where
        I: Iterator<Item = &'s str>,
    {
        nearest(name, self.chain(id).flat_map(|(_, scope)| names(scope)))
    }

    /// A visible parameter with a similar name.
    pub(super) fn near_param(&self, id: ScopeId, name: &str) -> Option<String> {
        self.near(id, name, |scope| scope.params.keys().map(String::as_str))
    }
}
