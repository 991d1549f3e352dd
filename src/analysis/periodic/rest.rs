//! What states count as where sources let a circuit rest, and leakage and rounding are all that is left of them.

use crate::circuit::{Circuit, Kind};
use crate::settings::tolerances::periodic::NEXT_TO_SOURCES;

/// Points at which a source is read between its breakpoints, and breakpoints that are looked at.
const SAMPLES: u32 = 16;
const CORNERS: usize = 64;

/// The largest values of voltage sources, V, and current sources, A, over so many seconds; where there are none of one kind those of the other,
/// as an ampere and a volt are as good as each other then.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sources {
    volts: f64,
    amperes: f64,
}

impl Sources {
    pub(super) fn of(circuit: &Circuit, from: f64, seconds: f64) -> Self {
        let (mut volts, mut amperes) = (0.0_f64, 0.0_f64);
        for element in &circuit.elements {
            let (source, largest) = match &element.kind {
                Kind::VoltageSource(source) => (source, &mut volts),
                Kind::CurrentSource(source) => (source, &mut amperes),
                _ => continue,
            };
            let mut see = |value: f64| *largest = largest.max(value.abs());
            for k in 0..=SAMPLES {
                see(source.value(from + seconds * f64::from(k) / f64::from(SAMPLES)));
            }
            let mut t = from;
            for _ in 0..CORNERS {
                let Some(next) = source.next_breakpoint(t).filter(|t| *t <= from + seconds) else {
                    break;
                };
                t = next;
                see(source.value_left(t));
                see(source.value(t));
            }
        }
        Self { volts, amperes }.whole()
    }

    /// Whether none has a value.
    pub(super) fn are_none(self) -> bool {
        self.volts == 0.0 && self.amperes == 0.0
    }

    /// The largest states that were seen, where no source has a value.
    pub(super) fn or_seen(self, seen: &[f64], units: &[&str]) -> Self {
        if !self.are_none() {
            return self;
        }
        let of = |unit: &str| {
            let own = seen.iter().zip(units).filter(|(_, u)| **u == unit);
            own.fold(0.0_f64, |m, (seen, _)| m.max(*seen))
        };
        let (volts, amperes) = (of("V"), of("A"));
        Self { volts, amperes }.whole()
    }

    fn whole(self) -> Self {
        let Self { volts, amperes } = self;
        Self {
            volts: if volts > 0.0 { volts } else { amperes },
            amperes: if amperes > 0.0 { amperes } else { volts },
        }
    }

    fn of_unit(self, unit: &str) -> f64 {
        if unit == "A" {
            self.amperes
        } else {
            self.volts
        }
    }

    /// What each state counts as where all of them are next to nothing beside the sources.
    pub(super) fn beside(self, amplitudes: &[f64], units: &[&str]) -> Option<Vec<f64>> {
        let sizes: Vec<f64> = units.iter().map(|unit| self.of_unit(unit)).collect();
        let small = |(amplitude, size): (&f64, &f64)| *amplitude <= NEXT_TO_SOURCES * size;
        let all = !sizes.is_empty() && self.volts > 0.0;
        (all && amplitudes.iter().zip(&sizes).all(small)).then_some(sizes)
    }
}
