//! What varies of a multiport where one value is another, and the multiport with a source wherever something varies.
//!
//! Where an equation Σ c z = 0 has coefficients c + δc, it is the one that it was with a source e = Σ δc z in it; and where the metric is P + δP, the flows f = P s' have
//! sources e = δP s' beside them (Tellegen's theorem is the usual way to see it: S. W. Director, R. A. Rohrer, "The generalized adjoint network and network sensitivities", IEEE
//! Trans. Circuit Theory, 1969). So derivatives of all that is reduced from a multiport, to any value, follow from one that is reduced with these sources.

use std::collections::HashMap;

use super::{
    Coefficient, Column, Equation, Observed, Power, SourcePort, StandardMultiport, StaticMultiport,
};
use crate::algebra::{Ball, Field, Value};
use crate::circuit::{Source, source::Wave};
use crate::lcs::{Input, PowerKind};

/// Coefficients of four other multiports beside one.
#[derive(Debug, Clone, Default)]
pub(crate) struct Perturbation {
    /// Equation, column and the coefficient in each.
    pub(crate) coefficients: Vec<(usize, Column, [f64; 4])>,
    /// Row and column of the metric, which is listed whole, and the value in each.
    pub(crate) metric: Vec<(usize, usize, [f64; 4])>,
}

fn number(x: Coefficient) -> f64 {
    x.in_field::<Ball>().to_f64()
}

/// A place that differs.
#[derive(Debug, Clone, Copy)]
enum Place {
    Coefficient(usize, Column),
    Metric(usize, usize),
}

impl Perturbation {
    fn push(&mut self, place: Place, values: [f64; 4]) {
        match place {
            Place::Coefficient(equation, column) => {
                self.coefficients.push((equation, column, values));
            }
            Place::Metric(row, column) => self.metric.push((row, column, values)),
        }
    }
}

/// What a value is in a coefficient.
type Of = fn(f64) -> f64;

/// The value that a coefficient is, or is the inverse of, or the negative of one of them; and which of these.
fn one_value(x: Coefficient) -> Option<(f64, Of)> {
    let (value, of): (Value, Of) = match x {
        Coefficient::Plus(value) => (value, |value| value),
        Coefficient::Minus(value) => (value, |value| -value),
        Coefficient::Inverse(value) => (value, f64::recip),
        Coefficient::MinusInverse(value) => (value, |value| -value.recip()),
        Coefficient::Ratio(..) | Coefficient::Pair(..) => return None,
    };
    Some((value.f64, of))
}

impl StandardMultiport {
    /// Where these differ; `None` where that is not by coefficients, metric and waveforms of sources alone.
    pub(crate) fn perturbation(&self, near: [&Self; 4]) -> Option<Perturbation> {
        let mut found = Perturbation::default();
        self.differing(near, |place, all| {
            found.push(place, all.map(number));
            Some(())
        })?;
        Some(found)
    }

    /// By card the same, from one in which each of them has its mark for a value, where the others have these values; `None` too where a coefficient that differs is not one of the marks or
    /// its inverse, or a mark is there twice.
    pub(crate) fn perturbations_by(
        &self,
        near: &Self,
        cards: &[(f64, [f64; 4])],
    ) -> Option<Vec<Perturbation>> {
        let marks = cards.iter().enumerate();
        let marks: HashMap<u64, usize> = marks.map(|(k, (mark, _))| (mark.to_bits(), k)).collect();
        if marks.len() < cards.len() {
            return None;
        }
        let mut found = vec![Perturbation::default(); cards.len()];
        self.differing([near], |place, [x]| {
            let (mark, of) = one_value(x)?;
            let card = *marks.get(&mark.to_bits())?;
            found[card].push(place, cards[card].1.map(of));
            Some(())
        })?;
        Some(found)
    }

    /// Looks at each number that differs; `None` where something else does.
    fn differing<const N: usize>(
        &self,
        near: [&Self; N],
        mut see: impl FnMut(Place, [Coefficient; N]) -> Option<()>,
    ) -> Option<()> {
        for other in near {
            let same = self.columns == other.columns
                && self.internal == other.internal
                && self.pairs == other.pairs
                && self.switches == other.switches
                && self.observed == other.observed
                && self.equations.len() == other.equations.len()
                && self.metric.len() == other.metric.len()
                && self.sources.len() == other.sources.len()
                && self.inexact == other.inexact;
            if !same {
                return None;
            }
        }
        let differ =
            |own: Coefficient, others: &[Coefficient; N]| others.iter().any(|other| *other != own);
        for (k, equation) in self.equations.iter().enumerate() {
            let others = near.map(|near| &near.equations[k]);
            if others.iter().all(|other| *other == equation) {
                continue;
            }
            let same = |other: &&Equation| {
                other.len() == equation.len() && other.iter().zip(equation).all(|(a, b)| a.1 == b.1)
            };
            if !others.iter().all(same) {
                return None;
            }
            for (at, (own, column)) in equation.iter().enumerate() {
                let all = others.map(|other| other[at].0);
                if differ(*own, &all) {
                    see(Place::Coefficient(k, *column), all)?;
                }
            }
        }
        for (k, (row, column, own)) in self.metric.iter().enumerate() {
            let others = near.map(|near| &near.metric[k]);
            let place = |other: &(usize, usize, Coefficient)| (other.0, other.1);
            if others.iter().any(|other| place(other) != (*row, *column)) {
                return None;
            }
            let all = others.map(|other| other.2);
            if differ(*own, &all) {
                see(Place::Metric(*row, *column), all)?;
            }
        }
        Some(())
    }

    /// With a source of value 0 in each of these equations, then one beside the flow of each of these storage elements, after those that there are, and with readings of these
    /// columns after all terms of power.
    pub(crate) fn perturbed(
        &self,
        equations: &[usize],
        storage: &[usize],
        read: &[Column],
    ) -> Self {
        let mut out = StaticMultiport {
            ball: std::sync::OnceLock::new(),
            rational: std::sync::OnceLock::new(),
            rough: true,
            ..self.0.clone()
        };
        for &k in equations {
            let value = source(&mut out);
            out.equations[k].push((Coefficient::ONE, value));
        }
        for &k in storage {
            // What the rest of the circuit sees is the flow and the source.
            let flow = out.storage[k].flow;
            let whole = out.column(format!("flow.{}", out.storage[k].name));
            let terms = out.equations.iter_mut().flatten();
            for term in terms.filter(|term| term.1 == flow) {
                term.1 = whole;
            }
            let value = source(&mut out);
            out.internal.push(whole);
            out.equations.push(vec![
                (Coefficient::ONE, whole),
                (Coefficient::MINUS_ONE, flow),
                (Coefficient::MINUS_ONE, value),
            ]);
        }
        for &column in read {
            let name = format!("read.{}", out.columns[column]);
            let own = out.column(name.clone());
            out.equations.push(vec![
                (Coefficient::ONE, column),
                (Coefficient::MINUS_ONE, own),
            ]);
            let at = out.observed.len();
            out.observed.push(Observed {
                name,
                unit: "V",
                column: own,
            });
            out.power.push(Power {
                element: String::new(),
                kind: PowerKind::Dissipated,
                v: at,
                i: at,
            });
        }
        Self(out)
    }
}

/// A new source of value 0, whose other quantity nothing has to do with; its column.
fn source(out: &mut StaticMultiport) -> Column {
    let name = format!("change.{}", out.sources.len());
    let (value, other) = (
        out.column(name.clone()),
        out.column(format!("{name}.other")),
    );
    out.equations.push(vec![(Coefficient::ONE, other)]);
    out.sources.push(SourcePort {
        input: Input {
            name,
            unit: "V",
            source: Source {
                dc: 0.0,
                wave: Wave::Dc(0.0),
            },
        },
        value,
        other,
        rate: None,
    });
    value
}
