//! Why a run ended, as a finding at the element where it shows, with the cause in the circuit's words and what to do.

use super::error::{Error, NoRest, Reason, at};
use crate::circuit::{Circuit, Element, Kind, written};
use crate::diagnostic::explain::explain;
use crate::diagnostic::{Diagnostic, listed};
use crate::law::Law;
use crate::lcs::ReduceError;

impl Error {
    /// The finding for the user of `circuit`: the place is the card of the first element concerned.
    #[must_use]
    pub fn diagnostic(&self, circuit: &Circuit) -> Diagnostic {
        let mut elements: Vec<Element> = Vec::new();
        for element in self
            .concerned()
            .iter()
            .filter_map(|name| whole(circuit, name))
        {
            let name = written(&element.name);
            if !elements.iter().any(|known| known.name == name) {
                elements.push(Element {
                    name: name.into(),
                    ..element.clone()
                });
            }
        }
        self.found(&elements.iter().collect::<Vec<_>>())
    }

    /// The elements where it shows: its own, else those that its reason names.
    pub(super) fn concerned(&self) -> Vec<&str> {
        match &self.elements[..] {
            [] => of_reason(&self.reason),
            own => own.iter().map(String::as_str).collect(),
        }
    }

    /// The finding where there is no circuit to show its place in.
    #[must_use]
    pub fn finding(&self) -> Diagnostic {
        self.found(&[])
    }

    fn found(&self, elements: &[&Element]) -> Diagnostic {
        let Told {
            code,
            message,
            label,
            help,
        } = told(self, elements);
        let place = elements.iter().find_map(|e| e.span);
        let help = help.or_else(|| Some(explain(code)?.help()));
        Diagnostic {
            help,
            ..Diagnostic::error(code, place, at(self.t) + &message).label(label)
        }
    }
}

/// The element of this name, or the one it is a part of: `d3` for the piece `d3.1` of its law.
pub(super) fn whole<'a>(circuit: &'a Circuit, name: &str) -> Option<&'a Element> {
    let mut name = name;
    loop {
        if let Some(id) = circuit.element(name) {
            return Some(&circuit.elements[id.index()]);
        }
        name = name.rsplit_once('.')?.0;
    }
}

fn of_reason(reason: &Reason) -> Vec<&str> {
    match reason {
        Reason::Circuit(error) | Reason::NoOperatingPoint(NoRest::System(error)) => {
            error.elements()
        }
        _ => Vec::new(),
    }
}

struct Told {
    code: &'static str,
    message: String,
    label: String,
    help: Option<String>,
}

const UIC: &str = "`uic` on `.tran` starts from initial conditions instead";
const DEVICE: &str = "a current may have no path but a device that blocks, or a voltage be shorted by one that conducts: a \
                      resistor across the device (`Roff` in its model), or in series with it (`Ron`, `RS`), decides";

const FLOATING: &str = "where the source of a transistor rises as it conducts, a gate that is driven against ground loses its voltage: drive it against the \
                        source (`Vg g s …`), as a bootstrap or an isolated driver does";

fn told(error: &Error, elements: &[&Element]) -> Told {
    let names: Vec<&str> = elements.iter().map(|e| e.name.as_str()).collect();
    let names = listed(&names);
    let curved = elements
        .iter()
        .any(|e| matches!(&e.kind, Kind::Device(Law::Exponential(_) | Law::Rounded(_))));
    let channel = elements.iter().find(|e| e.name.ends_with(".channel"));
    let ideal = curved.then_some("`--diodes ideal` takes ideal diodes in place of curved ones");
    let or = |help: &str| match ideal {
        Some(ideal) => format!("{help}; {ideal}"),
        None => help.to_string(),
    };
    let plain = |code, help: Option<String>| Told {
        code,
        message: error.reason.to_string(),
        label: names.clone(),
        help,
    };
    match &error.reason {
        Reason::Infeasible => Told {
            code: "no-solution",
            message: "no state of the devices satisfies the circuit equations".into(),
            label: impossible(elements),
            help: Some(or(DEVICE)),
        },
        Reason::NoOperatingPoint(why) => no_rest(why, elements, &or),
        Reason::Circuit(error) => no_system(error, elements),
        Reason::Residual { .. } => plain(
            "not-solved",
            Some(or("a current needs another path than a diode that blocks; a resistance in series with the device (`RS`, `Ron` in its model) or across it eases the problem")),
        ),
        Reason::Cancellation { .. } => plain(
            "cancellation",
            Some(or("by their laws these devices carry currents that no circuit has; a resistance in series (`RS` in the model, or that of the source and of its leads) limits them")),
        ),
        Reason::Singular { .. } => plain(
            "singular",
            Some("another `--step` or another method may pass; a negative resistance or a gain near 1 in a loop causes this".into()),
        ),
        Reason::StepTooSmall { .. } => plain(
            "step-too-small",
            Some(or("a larger `--tol`, or a fixed `--step`, goes on")),
        ),
        Reason::TooManySteps { .. } => plain(
            "too-many-steps",
            Some("a shorter `.tran`, a larger `--tol` or a larger `--step` needs fewer".into()),
        ),
        // A controller that regulates has no state of rest; nothing is wrong with it.
        Reason::SwitchesDoNotSettle if error.t.is_none() => Told {
            code: "switches-do-not-settle",
            message: format!("there is no operating point: in no position of {names} do the controls leave the switches where they are at rest"),
            label: "every position asks for another one".into(),
            help: Some(match channel {
                Some(_) => FLOATING.into(),
                None => format!(
                    "{UIC} (`ic=` of capacitors and inductors, else 0), as a controller that regulates by switching needs; a switch that takes away its \
                     own control at once needs hysteresis too (`Vh` in the model)"
                ),
            }),
        },
        Reason::SwitchesDoNotSettle => Told {
            code: "switches-do-not-settle",
            message: format!("in no position of {names} do the controls leave the switches where they are"),
            label: "every position asks for another one".into(),
            help: Some(channel.map_or(
                "hysteresis (`Vh` in the model), or a resistor and a capacitor in front of the control, lets them settle".into(),
                |_| FLOATING.into(),
            )),
        },
        Reason::EventsAccumulate { .. } | Reason::NoProgress { .. } => plain(
            "events-accumulate",
            Some(
                "hysteresis (`Vh`), or a small resistance or capacitance where it switches, ends the chatter; \
                 `--method theta` steps over it"
                    .into(),
            ),
        ),
        Reason::NotGraded { .. } => plain(
            "not-graded",
            Some("`--method theta` is not concerned; a smaller `Roff`, or none, and a larger `Ron`, or none, leave the decades out".into()),
        ),
        Reason::Overflow => plain(
            "overflow",
            Some(
                "a negative resistance, or a loop with gain of the wrong sign, makes a circuit grow without bound; where an edge of rise time 0 \
                 drives capacitors through exponential diodes without `RS`, give the edge a rise time or the diodes an `RS`"
                    .into(),
            ),
        ),
        Reason::TooManyRows { .. } => plain(
            "too-many-rows",
            Some(
                "csv and raw files are written as rows come, unless the netlist measures; a longer print step, a later start and \
                 fewer signals make less of them"
                    .into(),
            ),
        ),
        Reason::RowsTooDense { .. } => plain("rows-too-dense", Some("`.tran tstep tstop`: a longer tstep".into())),
        Reason::Interrupted => plain("interrupted", None),
        Reason::NotSmooth(_) => plain(
            "no-derivative",
            Some("other values of the elements named, so that the events part, may have one".into()),
        ),
        Reason::NoOrbit(_) => plain(
            "no-orbit",
            Some("`circ sim` shows where the transient goes".into()),
        ),
        Reason::Netlist(_) => plain("netlist", None),
        Reason::Unknown(_) => plain("unknown-name", None),
        Reason::Unsupported(_) => plain("unsupported", None),
        Reason::Internal(_) => plain("internal", None),
    }
}

fn impossible(elements: &[&Element]) -> String {
    match elements {
        [one] if matches!(one.kind, Kind::Device(_)) => {
            format!("{} can neither conduct nor block", one.name)
        }
        _ => {
            let names: Vec<&str> = elements.iter().map(|e| e.name.as_str()).collect();
            listed(&names)
        }
    }
}

fn no_rest(why: &NoRest, elements: &[&Element], or: &dyn Fn(&str) -> String) -> Told {
    let names: Vec<&str> = elements.iter().map(|e| e.name.as_str()).collect();
    let mut told = Told {
        code: "no-operating-point",
        message: format!("no operating point: {why}"),
        label: listed(&names),
        help: Some(UIC.into()),
    };
    match why {
        NoRest::Network(_) => {}
        NoRest::System(error) => {
            let system = no_system(error, elements);
            told.message = format!("no operating point: {}", system.message);
            told.label = system.label;
            told.help = system.help.map(|help| format!("{help}; {UIC}"));
        }
        NoRest::Devices => {
            told.label = impossible(elements);
            told.help = Some(format!("{}; {UIC}", or(DEVICE)));
        }
        NoRest::Sources => {
            let what = match elements {
                [one] if is_voltage_source(one) => "its voltage lies across inductors alone",
                [one] if is_current_source(one) => "its current flows into capacitors alone",
                _ => "sources across inductors alone, or into capacitors alone",
            };
            told.label = what.into();
            told.help = Some(format!(
                "a resistance in series with the inductors (`Rser`) or across the capacitors (`Rpar`) gives a steady state; {UIC}"
            ));
        }
        NoRest::Held => {
            told.label = "`.ic` holds its two nodes at different voltages".into();
            told.help = Some(format!(
                "{UIC}: `IC=` of the capacitors and inductors, then `.ic`"
            ));
        }
        NoRest::Floating => {
            told.label = "its current ends in capacitors".into();
            told.help = Some(format!("a large resistor to ground takes it up; {UIC}"));
        }
    }
    told
}

fn no_system(error: &ReduceError, elements: &[&Element]) -> Told {
    let names: Vec<&str> = elements.iter().map(|e| e.name.as_str()).collect();
    let names = listed(&names);
    let told = |code, message: String, help: &str| Told {
        code,
        message,
        label: names.clone(),
        help: Some(help.into()),
    };
    match error {
        ReduceError::Sources { .. } => match elements {
            [one] if is_voltage_source(one) => told(
                "voltage-loop",
                format!("{} is shorted", one.name),
                "a resistor in series, or `Ron` in the model of the switch or diode that shorts it, limits its current",
            ),
            [one] if is_current_source(one) => told(
                "current-cutset",
                format!("the current of {} has no way back", one.name),
                "a resistor across it, or `Roff` in the model of the switch or diode that opens, gives it a path",
            ),
            _ if elements.iter().any(|e| is_current_source(e)) => told(
                "current-cutset",
                between(elements, is_current_source, |one, rest| {
                    format!("the current of {one} has no way back but {rest}, and that is open")
                })
                .unwrap_or_else(|| {
                    format!("{names} are a cut-set of current sources and open branches that contradict each other")
                }),
                "a resistor across an open branch (`Roff` in the model of a switch or diode) gives the current a path",
            ),
            _ => told(
                "voltage-loop",
                between(elements, is_voltage_source, |one, rest| format!("{one} is shorted by {rest}"))
                    .unwrap_or_else(|| {
                        format!("{names} form a loop of voltage sources and shorts that contradict each other")
                    }),
                "a resistance in the loop (`Ron` in the model of a switch or diode) limits its current",
            ),
        },
        ReduceError::Port { .. } => told(
            "contradiction",
            error.to_string(),
            "a small resistor in series and a large one in parallel leave it one of the two",
        ),
        ReduceError::Feedthrough { .. } => told(
            "feedthrough",
            error.to_string(),
            "a small resistance in series with the capacitor, or a large one across the inductor, separates them",
        ),
        ReduceError::SourceRate { .. } => told(
            "source-rate",
            error.to_string(),
            "a small resistance in series with the source separates them",
        ),
        ReduceError::Singular { .. } => told(
            "singular",
            error.to_string(),
            "inductors coupled with k = 1 share one flux: a k below 1, or a resistor across one of them, decides",
        ),
        ReduceError::Unfit(_) => told(
            "out-of-range",
            error.to_string(),
            "values that are closer to those of real elements stay within what doubles hold",
        ),
        ReduceError::Position { .. } | ReduceError::NotIdeal { .. } | ReduceError::Internal(_) => {
            Told {
                code: "internal",
                message: error.to_string(),
                label: names,
                help: None,
            }
        }
    }
}

/// What to say of the one source among these elements and of all that is not it.
fn between(
    elements: &[&Element],
    source: fn(&Element) -> bool,
    words: impl Fn(&str, String) -> String,
) -> Option<String> {
    let (sources, rest): (Vec<&Element>, Vec<&Element>) = elements.iter().partition(|e| source(e));
    let names: Vec<&str> = rest.iter().map(|e| e.name.as_str()).collect();
    match (&sources[..], &names[..]) {
        ([one], [_, ..]) => Some(words(&one.name, listed(&names))),
        _ => None,
    }
}

const fn is_voltage_source(element: &Element) -> bool {
    matches!(element.kind, Kind::VoltageSource(_))
}

const fn is_current_source(element: &Element) -> bool {
    matches!(element.kind, Kind::CurrentSource(_))
}
