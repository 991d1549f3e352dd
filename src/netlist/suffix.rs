//! Parameters that end in a capital `M`, which is milli, and give a resistance its value: a resistor's own card warns as it is read.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::ast::{Assign, Block, Device, Element, Expr, ExprKind, Netlist, Statement, Subckt};
use crate::diagnostic::{Diagnostic, SourceMap, Span};

/// Names that stand for names, one after the other, which are followed.
const MOST: usize = 16;
/// Subcircuits within subcircuits through which a parameter is handed on.
const DEEPEST: usize = 8;

/// Parameters of a level with what they are, and of a subcircuit those of its calls.
#[derive(Default)]
struct Level<'n> {
    own: HashMap<&'n str, &'n Expr>,
    /// The subcircuit whose calls may give the parameters other values.
    called: Option<&'n Subckt>,
}

/// What is found on the way.
struct Search<'n, 's> {
    sources: &'s SourceMap,
    /// Parameters of subcircuits that give a resistance its value: subcircuit, parameter.
    resistances: BTreeSet<(&'n str, &'n str)>,
    /// Values in milli, with the name that they have.
    milli: BTreeMap<(u32, usize), (Span, &'n str)>,
}

/// A warning at every number that a parameter hands to a resistance and that ends in `M`.
pub(super) fn of_parameters(netlist: &Netlist, sources: &SourceMap) -> Vec<Diagnostic> {
    let mut search = Search {
        sources,
        resistances: BTreeSet::new(),
        milli: BTreeMap::new(),
    };
    for _ in 0..DEEPEST {
        let known = search.resistances.len();
        search.block(&netlist.body, &mut vec![Level::default()]);
        if search.resistances.len() == known {
            break;
        }
    }
    let warning = |(span, name): &(Span, &str)| {
        let written = number(sources.text(*span));
        let digits = written.trim_end_matches('M');
        let message = format!("`{written}` is {digits} milli, and `{name}` is a resistance");
        Diagnostic::warning("suffix-m", *span, message)
            .label("SPICE suffixes know no capitals")
            .help(format!(
                "write `{digits}Meg` for {digits} MΩ, `{digits}m` for {digits} mΩ"
            ))
    };
    search.milli.values().map(warning).collect()
}

/// Text without what may stand around it.
fn number(text: &str) -> &str {
    text.trim_matches(['{', '}', '\'', ' '])
}

/// The cards of a block, those in `.if` too.
fn cards<'n>(block: &'n Block, to: &mut dyn FnMut(&'n Statement)) {
    for statement in &block.statements {
        match statement {
            Statement::If(branches) => branches.iter().for_each(|b| cards(&b.body, to)),
            other => to(other),
        }
    }
}

impl<'n> Search<'n, '_> {
    fn block(&mut self, block: &'n Block, levels: &mut Vec<Level<'n>>) {
        let (mut subckts, mut elements) = (Vec::new(), Vec::new());
        let mut own = Vec::new();
        cards(block, &mut |statement| match statement {
            Statement::Param(all) => own.extend(all),
            Statement::Subckt(subckt) => subckts.push(subckt),
            Statement::Element(element) => elements.push(element),
            _ => {}
        });
        if let Some(level) = levels.last_mut() {
            let own = own.into_iter();
            let named = own.filter_map(|a| Some((a.name.text.as_str(), a.value.as_ref()?)));
            level.own.extend(named);
        }
        for subckt in subckts {
            let params = subckt.params.iter();
            let named = params.filter_map(|a| Some((a.name.text.as_str(), a.value.as_ref()?)));
            levels.push(Level {
                own: named.collect(),
                called: Some(subckt),
            });
            self.block(&subckt.body, levels);
            levels.pop();
        }
        for element in elements {
            self.element(element, levels);
        }
    }

    fn element(&mut self, element: &'n Element, levels: &[Level<'n>]) {
        match &element.device {
            Device::Passive { values, args } if element.name.text.starts_with('r') => {
                let named = |a: &&Assign| matches!(a.name.text.as_str(), "r" | "value");
                let given = args.iter().filter(named).filter_map(|a| a.value.as_ref());
                for value in values.iter().chain(given) {
                    self.follow(value, None, levels);
                }
            }
            Device::Call { subckt, args } => {
                for arg in args {
                    let (name, value) = (arg.name.text.as_str(), arg.value.as_ref());
                    if let Some(value) = value
                        && self.resistances.contains(&(subckt.text.as_str(), name))
                    {
                        self.follow(value, Some(name), levels);
                    }
                }
            }
            _ => {}
        }
    }

    /// Follows a value through names to the number that it stands for; one on a resistor's own card has no name.
    fn follow(&mut self, value: &'n Expr, name: Option<&'n str>, levels: &[Level<'n>]) {
        let (mut value, mut name, mut depth) = (value, name, levels.len());
        for _ in 0..MOST {
            match &value.kind {
                ExprKind::Name(next) => {
                    let found = levels[..depth].iter().enumerate().rev();
                    let mut found = found.filter_map(|(k, level)| {
                        let (own, value) = level.own.get_key_value(next.as_str())?;
                        Some((k, *own, *value))
                    });
                    let Some((k, own, defined)) = found.next() else {
                        return;
                    };
                    if let Some(subckt) = levels[k].called
                        && subckt.params.iter().any(|a| a.name.text == own)
                    {
                        self.resistances.insert((&subckt.name.text, own));
                    }
                    (value, name, depth) = (defined, Some(own), k + 1);
                }
                ExprKind::Number(_) => {
                    let text = number(self.sources.text(value.span));
                    let digits = text.strip_suffix('M').unwrap_or_default();
                    let is_milli = digits.ends_with(|c: char| c.is_ascii_digit() || c == '.');
                    if let (true, Some(name)) = (is_milli, name) {
                        let place = (value.span.file.0, value.span.start);
                        self.milli.insert(place, (value.span, name));
                    }
                    return;
                }
                _ => return,
            }
        }
    }
}
