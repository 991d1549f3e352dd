//! `A` devices: XSPICE's code models and LTspice's special functions, written as subcircuits of switches, sources and storage.
//!
//! Every sort of device is a subcircuit in the language of netlists, made once for each number of pins; an `A` card becomes a call of
//! it. What it consists of is `a1.…` in results; findings about its parts are shown at the card.

mod ltspice;
mod xspice;

use super::ast::{Assign, Block, Device, Element, Expr, ExprKind, Model, Name, Statement, Subckt};
use super::read::parse;
use crate::diagnostic::{Diagnostic, SourceMap};

/// A device as a subcircuit, with what is to be said of it.
struct Built {
    /// What it is called where its parts are spoken of.
    title: String,
    /// Its cards between `.subckt` and `.ends`.
    cards: String,
    /// Its pins, and the nodes of the card at them.
    pins: Vec<(String, Name)>,
    /// Parameters with defaults, as `a=1 b=2`.
    defaults: String,
    /// Parameters of this card.
    args: Vec<Assign>,
    /// Parameters that have no effect here.
    left_out: Vec<Name>,
}

/// What the names of such subcircuits and of their files begin with; no card can name one, as there is a blank.
pub(crate) const BUILT_IN: &str = "built-in ";

/// A fault of a card.
type Refused = Box<Diagnostic>;

/// Replaces the `A` devices of a netlist by calls of subcircuits, which are added to it.
pub(super) fn expand(body: &mut Block, sources: &mut SourceMap) {
    let mut library = Library {
        sources,
        made: Vec::new(),
    };
    library.block(body, &[]);
    let made = library.made.into_iter();
    let subckts = made.map(|(_, subckt)| Statement::Subckt(subckt));
    body.statements.extend(subckts);
}

/// The subcircuits made so far, by what they consist of.
struct Library<'s> {
    sources: &'s mut SourceMap,
    made: Vec<(String, Subckt)>,
}

impl Library<'_> {
    fn block(&mut self, block: &mut Block, outer: &[Model]) {
        let mut models = Vec::new();
        collect(block, &mut models);
        models.extend_from_slice(outer);
        self.statements(block, &models);
    }

    fn statements(&mut self, block: &mut Block, models: &[Model]) {
        let mut left_out: Vec<(String, Vec<Name>)> = Vec::new();
        for statement in &mut block.statements {
            match statement {
                Statement::Element(element) => match self.element(element, models) {
                    Ok(names) if names.is_empty() => {}
                    Ok(names) => left_out.push((element.name.text.clone(), names)),
                    Err(fault) => block.faults.push(*fault),
                },
                Statement::Subckt(subckt) => self.block(&mut subckt.body, models),
                Statement::If(branches) => {
                    for branch in branches {
                        self.statements(&mut branch.body, models);
                    }
                }
                _ => {}
            }
        }
        block.faults.extend(told(&left_out));
    }

    /// Makes a call of an `A` card; gives the parameters that have no effect.
    fn element(&mut self, card: &mut Element, models: &[Model]) -> Result<Vec<Name>, Refused> {
        let Device::Code { ports, model, args } = &card.device else {
            return Ok(Vec::new());
        };
        let of_model = models.iter().find(|m| m.name.text == model.text);
        let built = match of_model {
            Some(of) if of.kind.text == "sidiode" => None,
            Some(of) => Some(xspice::build(card, ports, of)?),
            None if ltspice::is_known(&model.text) => {
                Some(ltspice::build(card, ports, model, args)?)
            }
            None => None,
        };
        let Some(built) = built else {
            // ngspice's `sidiode`, or a model that is not there.
            let area = None;
            let (model, args) = (model.clone(), args.clone());
            if card.nodes.len() != 2 {
                return Err(unknown(card, &model));
            }
            card.device = Device::Diode { model, area, args };
            return Ok(Vec::new());
        };
        let subckt = Name {
            text: self.subcircuit(&built)?,
            span: model.span,
        };
        card.nodes = built.pins.into_iter().map(|(_, node)| node).collect();
        card.device = Device::Call {
            subckt,
            args: built.args,
        };
        Ok(built.left_out)
    }

    /// The name of the subcircuit of a device.
    fn subcircuit(&mut self, built: &Built) -> Result<String, Refused> {
        let pins: Vec<&str> = built.pins.iter().map(|(pin, _)| pin.as_str()).collect();
        let text = format!(
            "{}\n.subckt part {} {}\n{}.ends\n",
            built.title,
            pins.join(" "),
            built.defaults,
            built.cards
        );
        if let Some((_, subckt)) = self.made.iter().find(|(own, _)| *own == text) {
            return Ok(subckt.name.text.clone());
        }
        let file = self
            .sources
            .add(format!("{BUILT_IN}{}", built.title), text.clone());
        let (mut netlist, _) = parse(self.sources, file, &|_| {
            Err(std::io::ErrorKind::NotFound.into())
        });
        let found = netlist.body.statements.pop();
        let Some(Statement::Subckt(mut subckt)) = found else {
            let message = format!("`{}` cannot be made", built.title);
            return Err(Box::new(Diagnostic::error(
                "unsupported-element",
                None,
                message,
            )));
        };
        subckt.name.text = format!("{BUILT_IN}{}", self.made.len());
        let name = subckt.name.text.clone();
        self.made.push((text, subckt));
        Ok(name)
    }
}

/// The models of a block and of the branches in it, the first ones first.
fn collect(block: &Block, models: &mut Vec<Model>) {
    for statement in &block.statements {
        match statement {
            Statement::Model(model) => models.push(model.clone()),
            Statement::If(branches) => branches.iter().for_each(|b| collect(&b.body, models)),
            _ => {}
        }
    }
}

/// One warning of all parameters without effect.
fn told(left_out: &[(String, Vec<Name>)]) -> Option<Diagnostic> {
    let (_, first) = left_out.first()?;
    let cards = left_out.iter().map(|(card, names)| {
        let names: Vec<&str> = names.iter().map(|n| n.text.as_str()).collect();
        format!("{} of {card}", names.join(" "))
    });
    let cards: Vec<String> = cards.collect();
    let message = format!(
        "`A` devices act at once: without effect are {}",
        cards.join(", ")
    );
    Some(
        Diagnostic::warning("device-at-once", first.first()?.span, message)
            .label("taken as 0")
            .help("where a delay or a slope matters, write it with R and C at the output"),
    )
}

fn unknown(card: &Element, model: &Name) -> Refused {
    let message = format!(
        "`{}` uses `{}`, which is no device that is simulated",
        card.name.text, model.text
    );
    let help = format!(
        "simulated are sidiode {} of XSPICE and {} of LTspice",
        xspice::KNOWN.join(" "),
        ltspice::KNOWN.join(" ").to_uppercase()
    );
    Box::new(
        Diagnostic::error("unsupported-element", model.span, message)
            .label("neither a model nor a function")
            .help(help),
    )
}

fn refused(at: &Name, message: String, label: &str) -> Refused {
    Box::new(Diagnostic::error("unsupported-element", at.span, message).label(label))
}

/// The values of a vector, or the one value.
fn values(value: &Expr) -> Vec<Expr> {
    match &value.kind {
        ExprKind::Call(name, list) if name.text == "[]" => list.clone(),
        _ => vec![value.clone()],
    }
}
