//! What a table says.

use std::collections::BTreeMap;

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use crate::integrate::Note;

/// Changes of state that cost energy.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Switching {
    /// How many.
    pub count: usize,
    /// Of all together, J.
    pub energy: f64,
}

/// Losses of a device over a span of time, by the tables of its model.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct DeviceLosses {
    /// Of a switch that turns on: E_on(v⁻, i⁺).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub on: Option<Switching>,
    /// Of a switch that turns off: E_off(v⁺, i⁻).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub off: Option<Switching>,
    /// Of a diode whose forward current is interrupted: E_rr(−v⁺, i⁻).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recovery: Option<Switching>,
    /// [`ElementMeans::power`], W.
    pub conduction: f64,
    /// Mean power of the changes of state, W.
    pub switching: f64,
    /// Both, W.
    pub total: f64,
    /// Of the junction at rest, °C: where the heat of the devices leaves as fast as it comes; `None` where nothing is said of it, or it runs away.
    pub temperature: Option<f64>,
}

/// A quantity over a span of time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Mean {
    /// (1/T) ∫ y dt, impulses included.
    pub mean: f64,
    /// √((1/T) ∫ y² dt), without impulses.
    pub rms: f64,
    /// The least value.
    pub min: f64,
    /// The greatest value.
    pub max: f64,
}

/// An element over a span of time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ElementMeans {
    /// Its name.
    #[serde(skip)]
    pub name: String,
    /// The current from its first node through it to the second, A.
    pub i: Mean,
    /// The voltage from its first node to the second, V; of an inductor or a capacitor without its parasitic parts, of a transistor or thyristor that between the terminals of its current.
    pub v: Mean,
    /// Mean power into it and its parts (`m1.body`, `l1.rser`), W.
    pub power: f64,
    /// Where its model has loss tables, or its heat a way out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub losses: Option<DeviceLosses>,
}

/// A signal over a span of time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SignalMeans {
    /// `v(out)`.
    #[serde(skip)]
    pub name: String,
    /// `V` or `A`.
    #[serde(skip)]
    pub unit: &'static str,
    /// Its values.
    #[serde(flatten)]
    pub value: Mean,
    /// Greatest minus least value.
    pub ripple: f64,
    /// √(Y_rms² − mean² − Y₁²)/Y₁ with Y₁ the root mean square of its part at the frequency at which the circuit repeats, over its last
    /// period; none where it does not repeat, has no such part, or has impulses.
    pub thd: Option<f64>,
}

/// What goes in, and what comes out.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Throughput {
    /// Mean power out of `inputs`, W.
    pub input: f64,
    /// Mean power into `outputs`, W.
    pub output: f64,
    /// output/input; none without outputs or input.
    pub efficiency: Option<f64>,
    /// Mean power of changes of state by loss tables, which is no part of the input, W; none without tables.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub switching: Option<f64>,
    /// output/(input + switching); none without one of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub efficiency_with_switching: Option<f64>,
    /// Elements from which power comes.
    pub inputs: Vec<String>,
    /// Elements that take it.
    pub outputs: Vec<String>,
}

/// A span of time, s.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Span {
    /// Its start.
    pub from: f64,
    /// Its end.
    pub to: f64,
}

/// The elements and signals of a circuit over a span of time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// From when to when.
    pub span: Span,
    /// Whether all is in closed form; otherwise it is that of straight lines between steps.
    pub exact: bool,
    /// In file order, without parts of `A` devices.
    pub elements: Vec<ElementMeans>,
    /// The signals that the circuit shows.
    pub signals: Vec<SignalMeans>,
    /// Powers.
    pub power: Throughput,
    /// The frequency of [`SignalMeans::thd`], Hz.
    pub fundamental: Option<f64>,
    /// Of the nodes of the thermal network, at rest, °C.
    pub temperatures: Vec<(String, f64)>,
    /// Things the user should know.
    pub notes: Vec<Note>,
}

impl Table {
    /// The element of this name.
    #[must_use]
    pub fn element(&self, name: &str) -> Option<&ElementMeans> {
        self.elements.iter().find(|element| element.name == name)
    }

    /// The signal of this name.
    #[must_use]
    pub fn signal(&self, name: &str) -> Option<&SignalMeans> {
        self.signals.iter().find(|signal| signal.name == name)
    }
}

/// Elements by name, and beside them `probes`, `power`, `part`: no element's name begins with a p.
impl Serialize for Table {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        struct Signals<'a>(&'a [SignalMeans]);
        impl Serialize for Signals<'_> {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_map(self.0.iter().map(|signal| (&signal.name, signal)))
            }
        }
        #[derive(Serialize)]
        struct Part<'a> {
            #[serde(flatten)]
            span: Span,
            exact: bool,
            fundamental: Option<f64>,
            #[serde(skip_serializing_if = "BTreeMap::is_empty")]
            temperatures: BTreeMap<&'a str, f64>,
            #[serde(skip_serializing_if = "Vec::is_empty")]
            notes: Vec<&'a str>,
        }
        let mut map = serializer.serialize_map(Some(self.elements.len() + 3))?;
        for element in &self.elements {
            map.serialize_entry(&element.name, element)?;
        }
        map.serialize_entry("probes", &Signals(&self.signals))?;
        map.serialize_entry("power", &self.power)?;
        let part = Part {
            span: self.span,
            exact: self.exact,
            fundamental: self.fundamental,
            temperatures: self
                .temperatures
                .iter()
                .map(|(n, t)| (n.as_str(), *t))
                .collect(),
            notes: self.notes.iter().map(|note| note.text.as_str()).collect(),
        };
        map.serialize_entry("part", &part)?;
        map.end()
    }
}
