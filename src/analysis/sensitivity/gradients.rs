//! The derivatives that were found.

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use super::Passes;
use crate::circuit::Measured;
use crate::integrate::Note;

/// The derivatives of one measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradient {
    /// Its name.
    pub name: String,
    /// What it found, or why it found nothing.
    pub value: Result<f64, String>,
    /// By element or parameter, in SI units; none where the measurement has no value there.
    pub to: Vec<(String, Option<f64>)>,
    /// By the same, along an exact run: the absolute values of the terms whose sum is p ∂J/∂p, together; rounding is relative to them. 0 where it was carried forward; empty along other
    /// runs.
    pub terms: Vec<f64>,
}

/// The derivatives of measurements.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sensitivity {
    /// In file order.
    pub of: Vec<Gradient>,
    /// What they are derivatives to, and its value.
    pub at: Vec<(String, f64)>,
    /// Whether they are those of the variational equation of a run that is exact throughout; otherwise they are those of its steps, or differences of runs, of which notes tell.
    pub exact: bool,
    /// How often they went along the run; not at all where they are differences.
    pub passes: Passes,
    /// Things the user should know.
    pub notes: Vec<Note>,
}

impl Sensitivity {
    /// The derivative of a measurement to an element's value or a parameter.
    #[must_use]
    pub fn derivative(&self, of: &str, to: &str) -> Option<f64> {
        let gradient = self.of.iter().find(|gradient| gradient.name == of)?;
        gradient.to.iter().find(|(name, _)| name == to)?.1
    }
}

impl Sensitivity {
    /// Takes in derivatives of the same measurements to other values.
    pub(super) fn join(&mut self, other: Self) {
        for (own, other) in self.of.iter_mut().zip(other.of) {
            own.to.extend(other.to);
        }
        self.notes.extend(other.notes);
    }

    /// Takes in derivatives of other measurements to the same values.
    pub(super) fn extend(&mut self, other: Self) {
        self.of.extend(other.of);
        self.at = other.at;
        self.exact &= other.exact;
        self.passes.forward += other.passes.forward;
        self.passes.backward += other.passes.backward;
        for note in other.notes {
            if !self.notes.contains(&note) {
                self.notes.push(note);
            }
        }
    }

    /// Puts values into this order.
    pub(super) fn sort(&mut self, order: &[(String, f64)]) {
        let place = |name: &String| order.iter().position(|(own, _)| own == name);
        for gradient in &mut self.of {
            gradient.to.sort_by_cached_key(|(name, _)| place(name));
        }
        let known = |name: &String| self.of.iter().any(|g| g.to.iter().any(|(n, _)| n == name));
        self.at = order
            .iter()
            .filter(|(name, _)| known(name))
            .cloned()
            .collect();
    }
}

/// `{"of":{"vout":{"value":…,"to":{"l1":…}}},"exact":…,"notes":[…]}`.
impl Serialize for Sensitivity {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        struct To<'a>(&'a [(String, Option<f64>)]);
        impl Serialize for To<'_> {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
            }
        }
        #[derive(Serialize)]
        struct One<'a> {
            value: Option<f64>,
            #[serde(skip_serializing_if = "Option::is_none")]
            error: Option<&'a str>,
            to: To<'a>,
        }
        struct Of<'a>(&'a [Gradient]);
        impl Serialize for Of<'_> {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_map(self.0.iter().map(|gradient| {
                    let one = One {
                        value: gradient.value.as_ref().ok().copied(),
                        error: gradient.value.as_ref().err().map(String::as_str),
                        to: To(&gradient.to),
                    };
                    (&gradient.name, one)
                }))
            }
        }
        let mut map = serializer.serialize_map(Some(3))?;
        map.serialize_entry("of", &Of(&self.of))?;
        map.serialize_entry("exact", &self.exact)?;
        let notes: Vec<&String> = self.notes.iter().map(|note| &note.text).collect();
        map.serialize_entry("notes", &notes)?;
        map.end()
    }
}

/// Gradients without derivatives yet.
pub(super) fn started(measured: &[Measured]) -> Vec<Gradient> {
    let of = |measured: &Measured| Gradient {
        name: measured.name.clone(),
        value: match &measured.result {
            Ok(found) => Ok(found.value),
            Err(why) => Err(why.to_string()),
        },
        to: vec![],
        terms: vec![],
    };
    measured.iter().map(of).collect()
}
