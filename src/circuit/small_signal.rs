//! `.ac`, and `AC` values of sources.

use super::builder::Builder;
use super::scope::ScopeId;
use super::{Stimulus, sweep};
use crate::diagnostic::Diagnostic;
use crate::netlist::ast::{self, Expr, Spacing};

impl<'n> Builder<'n, '_> {
    /// Takes in `AC magnitude phase` of a source: 1 and 0 where they are not given. What is wrong with them is a warning, as it does not concern
    /// other analyses.
    pub(super) fn stimulus(
        &mut self,
        card: &'n ast::Element,
        values: Option<&'n [Expr]>,
        scope: ScopeId,
    ) {
        let Some(values) = values else { return };
        let name = self.full_name(&card.name, scope);
        let Some(source) = self.circuit.element(&name) else {
            return;
        };
        let mut given = [1.0, 0.0];
        let known = self.scopes.findings.len();
        for (place, value) in given.iter_mut().zip(values) {
            match self.scopes.finite(value, scope) {
                Some(value) => *place = value.f64,
                None => {
                    let what = "; the source has no `AC` value";
                    return self.scopes.findings.soften(known, what);
                }
            }
        }
        let [magnitude, phase] = given;
        self.circuit.stimuli.push(Stimulus {
            source,
            magnitude,
            phase,
        });
    }

    /// Takes in the frequencies of `.ac`; of several cards the last counts. What is wrong with it is a warning.
    pub(super) fn frequencies(&mut self) {
        if let Some(card) = self.ac_card.take() {
            let known = self.scopes.findings.len();
            self.frequencies_of(card);
            self.scopes
                .findings
                .soften(known, "; this `.ac` is left out");
        }
    }

    fn frequencies_of(&mut self, card: &'n ast::Frequencies) {
        let mut values = Vec::with_capacity(card.values.len());
        for value in &card.values {
            match self.scopes.finite(value, ScopeId::ROOT) {
                Some(value) => values.push(value.f64),
                None => return,
            }
        }
        if let (Spacing::Linear | Spacing::Logarithmic(_), &[_, first, last]) =
            (card.spacing, &values[..])
            && last < first
        {
            let message = format!("`.ac` goes down, from {first:e} Hz to {last:e} Hz");
            let fault = Diagnostic::warning("bad-ac", card.values[2].span, message);
            self.tell(
                fault
                    .label("below the first frequency")
                    .help("`M` is milli as `m` is: write `1Meg` for 1e6"),
            );
        }
        let found = match (card.spacing, &values[..]) {
            (Spacing::List, _) => Ok(values),
            (Spacing::Linear, &[count, first, last]) => linear(count, first, last),
            (Spacing::Logarithmic(base), &[per, first, last]) => {
                sweep::logarithmic(first, last, (f64::from(base), per))
            }
            _ => Err(("`.ac` takes three values", "no such sweep")),
        };
        let sound = found.and_then(|all| {
            if all.iter().all(|f| *f >= 0.0 && f.is_finite()) {
                Ok(all)
            } else {
                Err(("a frequency of `.ac` is negative", "no such frequency"))
            }
        });
        match sound {
            Ok(all) => self.circuit.ac = all,
            Err((fault, label)) => {
                self.tell(Diagnostic::error("bad-ac", card.span, fault).label(label));
            }
        }
    }
}

/// So many frequencies with equal distances.
fn linear(count: f64, first: f64, last: f64) -> Result<Vec<f64>, (&'static str, &'static str)> {
    if count.is_nan() || count < 1.0 {
        return Err(("`.ac lin` needs at least one frequency", "no such sweep"));
    }
    if count > sweep::MOST as f64 {
        return Err(("`.ac` has too many frequencies", "far too many"));
    }
    let count = count.round() as usize;
    let steps = count.saturating_sub(1).max(1) as f64;
    let value = |k: usize| first + (last - first) * (k as f64 / steps);
    Ok((0..count).map(value).collect())
}
