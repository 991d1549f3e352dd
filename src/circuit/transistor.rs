//! M, J and Z as power switches: a channel that is open or a resistance, and the diodes beside it.
//!
//! A MOSFET, JFET or MESFET becomes a switch between drain and source that is on where its gate is beyond the threshold, an
//! IGBT the same in series with a diode. What the model says of saturation, of charge and of speed is left out, and a
//! warning says so for each model. The resistance is that of the triode region at v(d,s) = 0,
//!
//! ```text
//! Ron = RD + RS + 1 / (β (v(g,s) − VTO)),      β = KP·W/L (MOSFET), KP·mtriode (VDMOS), 2·BETA (JFET, MESFET)
//! ```
//!
//! at the largest v(g,s) that the sources of gate and source allow, or at 10 V where that is not known beforehand.

mod drive;

use super::builder::Builder;
use super::losses::Changing;
use super::model::{Parameters, ZERO};
use super::passive::Args;
use super::scope::ScopeId;
use super::{Affine, Element, Kind, NodeId, Quantity, Switch};
use crate::algebra::Value;
use crate::diagnostic::Diagnostic;
use crate::law::Law;
use crate::netlist::ast::{self, Assign, Expr, Model, Name};
pub(super) use drive::Channel;

/// Drop of an IGBT's collector junction, V.
const JUNCTION: f64 = 0.7;
/// Permittivity of silicon dioxide, F/m.
const OXIDE: f64 = 3.9 * 8.854_214_871e-12;
/// Channel width and length where neither card nor model tells them, m.
const SIDE: f64 = 1e-4;

/// What counts of a model.
const COUNTS: [&str; 13] = [
    "vto", "kp", "rd", "rs", "ron", "roff", "rds", "rb", "vfwd", "w", "l", "beta", "mtriode",
];

/// The sort of a transistor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Sort {
    family: Family,
    /// p-channel: all voltages and currents the other way round.
    mirrored: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Family {
    Mos,
    Vdmos,
    /// JFET and MESFET: no bulk, driven to 0 V.
    Jfet,
    Igbt,
}

/// What a model says of its channel.
struct Figures {
    threshold: f64,
    series: f64,
    beta: Option<f64>,
    /// Whether β is that of a transistor of which nothing is known.
    assumed: bool,
    roff: Option<Value>,
    /// Series resistance of the body diode, Ω, and its drop, V.
    body: (Value, Value),
    /// m times the area factor.
    times: f64,
}

impl<'n> Builder<'n, '_> {
    pub(super) fn transistor(
        &mut self,
        card: &'n ast::Element,
        words: &'n [Name],
        area: Option<&'n Expr>,
        args: &'n [Assign],
        scope: ScopeId,
    ) {
        let known = [
            "w", "l", "m", "area", "ad", "as", "pd", "ps", "nrd", "nrs", "ic", "off", "thermal",
            "geo", "nf",
        ];
        self.check_args(card, args, &known);
        let [drain, gate, source] =
            [0, 1, 2].map(|k| card.nodes.get(k).map(|n| self.node(n, scope)));
        let (Some(drain), Some(gate), Some(source)) = (drain, gate, source) else {
            return;
        };
        let Some((bulk, name, area)) = self.model_word(words, area, scope) else {
            return;
        };
        let bulk = bulk.map_or(source, |bulk| self.node(bulk, scope));
        let Some(chain) = self.model(card, name, scope) else {
            return;
        };
        let Some(sort) = self.sort(card, &chain, name) else {
            return;
        };
        if gate == drain {
            let message = format!(
                "`{}` has gate and drain in one node: a diode of its own, not a switch",
                card.name.text
            );
            self.tell(
                Diagnostic::error("not-a-switch", card.span, message)
                    .label("transistors are simulated as switches")
                    .help("put a diode in its place"),
            );
            return;
        }
        let Some(figures) = self.figures(card, name, &chain, sort, area, Args(args), scope) else {
            return;
        };
        let span = Some(card.span);
        let full = self.full_name(&card.name, scope);
        self.name_pins(&full, "dgs", &[drain, gate, source]);
        let inner = self.new_node(format!("{full}.d"));
        let mut part = |suffix: &str, p: NodeId, n: NodeId, kind: Kind| {
            let name = format!("{full}{suffix}");
            self.add(Element {
                name,
                p,
                n,
                kind,
                ic: None,
                span,
            })
        };
        // The current of the transistor is that of its drain, diodes included.
        let resistance = |ron: Value, vfwd: Value| {
            Kind::Device(Law::Diode {
                vfwd,
                ron,
                roff: None,
            })
        };
        if sort.family == Family::Igbt {
            part("", drain, inner, resistance(ZERO, Value::binary(JUNCTION)));
        } else {
            part("", drain, inner, Kind::Resistor(ZERO));
        }
        let sign = if sort.mirrored { -1.0 } else { 1.0 };
        let control = Affine {
            terms: vec![
                (Value::binary(sign), Quantity::Voltage(gate)),
                (Value::binary(-sign), Quantity::Voltage(source)),
            ],
            constant: 0.0,
        };
        let switch = part(
            ".channel",
            inner,
            source,
            Kind::Switch(Switch {
                control,
                ron: ZERO,
                roff: figures.roff,
                on_above: figures.threshold,
                off_below: figures.threshold,
                initial: None,
                latch: None,
            }),
        );
        let mut diode = |suffix: &str, p: NodeId, n: NodeId| {
            let (p, n) = if sort.mirrored { (n, p) } else { (p, n) };
            part(suffix, p, n, resistance(figures.body.0, figures.body.1));
        };
        let mos = matches!(sort.family, Family::Mos | Family::Vdmos);
        let with_body = mos && (bulk == source || bulk == drain);
        match sort.family {
            _ if with_body => diode(".body", source, inner),
            Family::Mos | Family::Vdmos => {
                diode(".bd", bulk, inner);
                diode(".bs", bulk, source);
            }
            Family::Jfet | Family::Igbt => {}
        }
        let changing = Changing {
            switch: Some(format!("{full}.channel")),
            diode: with_body.then(|| format!("{full}.body")),
        };
        let (names, params) = ((full.as_str(), name), Parameters::new(&chain));
        self.losses(names, &params, changing, figures.times, scope);
        self.channels.extend(switch.map(|switch| Channel {
            switch,
            device: full,
            model: name.text.clone(),
            span: card.span,
            gate,
            source,
            sort,
            series: figures.series,
            beta: figures.beta,
            assumed: figures.assumed,
        }));
    }

    /// The bulk node, the model and the area factor among the words of a card.
    pub(super) fn model_word(
        &self,
        words: &'n [Name],
        area: Option<&'n Expr>,
        scope: ScopeId,
    ) -> Option<(Option<&'n Name>, &'n Name, Option<&'n Expr>)> {
        let is_model = |word: &Name| self.scopes.model(scope, &word.text).is_some();
        let last = words.len().checked_sub(1)?;
        let at = words.iter().position(is_model).unwrap_or(last);
        Some((words[..at].first(), &words[at], area.filter(|_| at < last)))
    }

    fn sort(&mut self, card: &ast::Element, chain: &[&'n Model], name: &Name) -> Option<Sort> {
        let kind = chain.iter().map(|m| m.kind.text.as_str());
        let kind = kind.into_iter().find(|k| !k.is_empty()).unwrap_or("");
        let p_channel = Parameters::new(chain).flag("pchan");
        let letter = card.name.text.chars().next().unwrap_or('m');
        let (family, mirrored) = match (letter, kind) {
            ('m', "nmos") => (Family::Mos, false),
            ('m', "pmos") => (Family::Mos, true),
            ('m', "vdmos" | "vdmosn" | "vdmosp") => (Family::Vdmos, kind == "vdmosp" || p_channel),
            ('j', "njf") | ('z', "nmf") => (Family::Jfet, false),
            ('j', "pjf") | ('z', "pmf") => (Family::Jfet, true),
            ('z', "nigbt") => (Family::Igbt, false),
            _ => {
                let needed = match letter {
                    'm' => "nmos, pmos or vdmos",
                    'j' => "njf or pjf",
                    _ => "nmf, pmf or nigbt",
                };
                self.wrong_model(card, chain[0], name, needed);
                return None;
            }
        };
        Some(Sort { family, mirrored })
    }

    #[expect(clippy::too_many_arguments, reason = "all that a card says")]
    fn figures(
        &mut self,
        card: &ast::Element,
        name: &Name,
        chain: &[&'n Model],
        sort: Sort,
        area: Option<&'n Expr>,
        args: Args<'n>,
        scope: ScopeId,
    ) -> Option<Figures> {
        let params = Parameters::new(chain);
        let level = match (sort.family, card.name.text.starts_with('z')) {
            (Family::Jfet, false) => self.level(card, name, &params, &[1.0, 2.0], scope)?,
            (Family::Jfet, true) => self.level(card, name, &params, &[1.0], scope)?,
            _ => self
                .parameter(&params, "level", scope)?
                .map_or(1.0, |v| v.f64),
        };
        // Models of higher levels have hundreds of parameters, none of which counts.
        if level <= 3.0 {
            self.misspelt(('m', name), &params, &COUNTS);
        }
        let mut number = |names: &[&str], otherwise: f64| -> Option<f64> {
            for one in names {
                if let Some(value) = self.parameter(&params, one, scope)? {
                    return Some(value.f64);
                }
            }
            Some(otherwise)
        };
        let vto = match sort.family {
            Family::Jfet => -2.0,
            Family::Igbt => 4.7,
            Family::Mos | Family::Vdmos => 0.0,
        };
        let vto = number(&["vto", "vth0", "vt0", "vt"], vto)?;
        let series = number(&["rd"], 0.0)? + number(&["rs"], 0.0)?;
        let given = number(&["ron"], f64::NAN)?;
        let is_given = given >= 0.0;
        let rds = number(&["rds"], f64::INFINITY)?;
        let (body, drop) = (number(&["rb"], 0.0)?, number(&["vfwd"], 0.0)?.max(0.0));
        let mobility = 1e-4 * number(&["uo", "u0"], 600.0)?;
        let oxide = number(&["tox"], f64::NAN)?;
        let from_oxide = mobility * OXIDE / oxide;
        let (width, length) = (number(&["w"], SIDE)?, number(&["l"], SIDE)?);
        let beta = match sort.family {
            Family::Mos => {
                let kp = if oxide > 0.0 { from_oxide } else { 2e-5 };
                number(&["kp"], kp)?
            }
            Family::Vdmos => number(&["kp"], 1.0)? * number(&["mtriode"], 1.0)?,
            Family::Jfet => {
                let beta = if card.name.text.starts_with('z') {
                    2.5e-3
                } else {
                    1e-4
                };
                2.0 * number(&["beta"], beta)?
            }
            Family::Igbt => number(&["kp"], 0.38)?,
        };
        let electrical = ["rd", "rs", "kp", "beta", "tox"];
        let assumed = sort.family == Family::Mos
            && !["kp", "tox", "ron"].iter().any(|p| params.get(p).is_some());
        let only_ron = is_given && electrical.iter().all(|p| params.get(p).is_none());
        if sort.family == Family::Mos && level > 3.0 && !is_given {
            let message = format!(
                "`{}` has model `{}` of level {level}, whose parameters tell no on-resistance",
                card.name.text, name.text
            );
            self.tell(
                Diagnostic::error("unsupported-model", name.span, message)
                    .label("levels 1 to 3 and VDMOS are read as switches")
                    .help("add `Ron=` to the model, or use a switch `S` instead"),
            );
            return None;
        }
        let w = self.arg(args, &["w"], scope)?.map_or(width, |v| v.f64);
        let l = self.arg(args, &["l"], scope)?.map_or(length, |v| v.f64);
        let m = self.arg(args, &["m"], scope)?.map_or(1.0, |v| v.f64);
        let area = match area.or(args.get(&["area"])) {
            Some(area) => self.scopes.finite(area, scope)?.f64,
            None => 1.0,
        };
        let times = m * area;
        let aspect = if sort.family == Family::Mos {
            w / l
        } else {
            1.0
        };
        let beta = beta * aspect * times;
        let level_only = level > 3.0 && sort.family == Family::Mos;
        let beta = (!only_ron && !level_only).then_some(beta);
        let series = if beta.is_none() { given } else { series } / times;
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if !positive(times) || beta.is_some_and(|b| !positive(b)) || series < 0.0 {
            let message = format!(
                "`{}` has no positive transconductance or a negative resistance",
                card.name.text
            );
            self.tell(
                Diagnostic::error("bad-value", card.span, message)
                    .label("W, L, KP, m and the area must be positive"),
            );
            return None;
        }
        Some(Figures {
            // A p-channel MOSFET has a negative VTO where a p-channel JFET has the n-channel's.
            threshold: if sort.mirrored && sort.family != Family::Jfet {
                -vto
            } else {
                vto
            },
            series,
            beta,
            assumed,
            roff: rds.is_finite().then(|| Value::binary(rds / times)),
            body: (
                if body > 0.0 {
                    Value::binary(body / times)
                } else {
                    ZERO
                },
                Value::binary(drop),
            ),
            times,
        })
    }
}

#[cfg(test)]
mod tests;
