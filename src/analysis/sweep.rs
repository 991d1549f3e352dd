//! The same question at many values: combinations of them, and samples of random ones.

use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;

#[cfg(feature = "parallel")]
use rayon::prelude::*;

use super::measured::measured;
use super::{PeriodicOptions, periodic_measured};
use crate::circuit::{Circuit, Measured, Sweep, combinations};
use crate::integrate::{Error, Reason, SimOptions};
use crate::model::Model;
use crate::settings::Settings;

/// Variants that are asked before their answers are given away.
const CHUNK: usize = 256;

/// A combination of values and a sample, and the model that it is one of.
#[derive(Debug, Clone)]
pub struct Variant<'m> {
    base: &'m Model,
    sweeps: &'m [Sweep],
    values: Vec<f64>,
    sample: Option<u64>,
}

/// All combinations of the values of these sweeps, those of the first change fastest.
///
/// # Example
/// ```
/// use circ::analysis::{each, variants};
///
/// let text = "filter\nv1 in 0 1\nr1 in out {r}\nc1 out 0 1u\n.param r=1k\n.step param r list 1k 2k\n.end\n";
/// let model = circ::Model::parse(text, "filter.cir")?;
/// let poles = each(&variants(&model, &model.circuit().steps), |variant| Ok(variant.model()?.lcs()?.a[(0, 0)]));
/// let poles: Result<Vec<f64>, Box<dyn std::error::Error + Send + Sync>> = poles.into_iter().collect();
/// assert_eq!(poles.unwrap(), [-1e3, -500.0]);
/// # Ok::<(), circ::Error>(())
/// ```
#[must_use]
pub fn variants<'m>(base: &'m Model, sweeps: &'m [Sweep]) -> Vec<Variant<'m>> {
    let variant = |values| Variant::of(base, sweeps, values, None);
    combinations(sweeps).into_iter().map(variant).collect()
}

/// The runs of `.step`; random functions are drawn anew for each.
#[must_use]
pub fn steps(base: &Model) -> Vec<Variant<'_>> {
    let mut runs = variants(base, &base.circuit().steps);
    if base.circuit().random && runs.len() > 1 && base.options().sample.is_none() {
        for (k, run) in (0..).zip(&mut runs) {
            run.sample = Some(k);
        }
    }
    runs
}

/// So many samples of each variant: of its random functions and of everything with a tolerance. Sample k is the same for all of them.
#[must_use]
pub fn samples<'m>(variants: &[Variant<'m>], count: u64) -> Vec<Variant<'m>> {
    let sampled = |variant: &Variant<'m>| {
        let variant = variant.clone();
        (0..count).map(move |k| Variant {
            sample: Some(k),
            ..variant.clone()
        })
    };
    variants.iter().flat_map(sampled).collect()
}

impl<'m> Variant<'m> {
    /// The model with these values of the sweeps, in their order, and the sample that is drawn, where one is.
    #[must_use]
    pub const fn of(
        base: &'m Model,
        sweeps: &'m [Sweep],
        values: Vec<f64>,
        sample: Option<u64>,
    ) -> Self {
        Self {
            base,
            sweeps,
            values,
            sample,
        }
    }

    /// The values, in the order of the sweeps.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Values with the names of what they are values of.
    #[must_use]
    pub fn named(&self) -> Vec<(String, f64)> {
        let names = self.sweeps.iter().map(|s| s.what.name().to_string());
        names.zip(self.values.iter().copied()).collect()
    }

    /// The number of the sample.
    #[must_use]
    pub const fn sample(&self) -> Option<u64> {
        self.sample
    }

    /// The model with these values.
    ///
    /// # Errors
    /// The netlist is no circuit with them.
    pub fn model(&self) -> Result<Model, Error> {
        self.base.at(self.sweeps, &self.values, self.sample)
    }

    /// The same, which shows what is measured alone.
    fn measured_model(&self) -> Result<Model, Error> {
        self.base
            .measured_at(self.sweeps, &self.values, self.sample)
    }

    /// Its circuit alone.
    pub(super) fn circuit(&self) -> Result<Circuit, Error> {
        let (sweeps, values) = (self.sweeps, &self.values);
        self.base.circuit_at(sweeps, values, self.sample)
    }
}

/// What `ask` says of each variant, in their order; on all threads with the feature `parallel`.
pub fn each<T: Send>(
    variants: &[Variant<'_>],
    ask: impl Fn(&Variant<'_>) -> T + Sync + Send,
) -> Vec<T> {
    #[cfg(feature = "parallel")]
    let all = variants.par_iter();
    #[cfg(not(feature = "parallel"))]
    let all = variants.iter();
    all.map(ask).collect()
}

/// What a sweep measures.
#[derive(Debug, Clone, Default)]
pub struct SweepOptions<'a> {
    /// The names of `.meas` that are wanted; none are all.
    pub of: Vec<String>,
    /// Measure the periodic steady state and not the transient.
    pub steady: bool,
    /// How to integrate.
    pub settings: Settings,
    /// Ends the sweep when it becomes true.
    pub cancel: Option<&'a AtomicBool>,
}

/// What a variant measures.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The number of the variant, from 0.
    pub index: usize,
    /// The values that were drawn, in the order of [`drawn_names`]; none where there is no such circuit.
    pub drawn: Vec<Option<f64>>,
    /// What `.meas` finds, in the order of [`measured_names`]; none where it found nothing.
    pub measured: Vec<Option<f64>>,
    /// Why the variant has no values, or not all of them.
    pub failed: Option<String>,
}

/// What has a tolerance, in the order of the options, then of the cards: elements and parameters.
#[must_use]
pub fn drawn_names(model: &Model) -> Vec<String> {
    let given = model.options().tolerances.iter().map(|t| &t.name);
    let mut names: Vec<String> = vec![];
    for name in given.chain(model.circuit().tolerances.iter().map(|(name, _)| name)) {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    names
}

/// The measurements that a sweep of a model gives.
///
/// # Errors
/// [`Reason::Unknown`] for what is no `.meas` of the circuit, and where it has none.
pub fn measured_names(model: &Model, of: &[String]) -> Result<Vec<String>, Error> {
    let measurements = model.circuit().measurements.iter();
    let there: Vec<String> = measurements.map(|m| m.name.clone()).collect();
    let unknown = |why: String| Err(Error::before(Reason::Unknown(why)));
    if there.is_empty() {
        return unknown(
            "the netlist measures nothing: add `.meas` cards, which say what a sweep is to find"
                .into(),
        );
    }
    let of: Vec<String> = of.iter().map(|name| name.to_lowercase()).collect();
    match of.iter().find(|name| !there.contains(name)) {
        Some(missing) => unknown(format!(
            "there is no `.meas` `{missing}`; there are: {}",
            there.join(", ")
        )),
        None if of.is_empty() => Ok(there),
        None => Ok(of),
    }
}

/// Measures every variant, on all threads with the feature `parallel`, and gives away its row, in the order of the variants.
///
/// A variant that fails is a row with its reason. The rows depend on the variants alone, and not on the number of threads.
///
/// # Example
/// The mean current through a resistance with a tolerance of 5 %, evenly distributed, seven times.
/// ```
/// use std::ops::ControlFlow;
/// use circ::analysis::{SweepOptions, samples, sweep, variants};
///
/// let text = "load\nv1 a 0 10\nr1 a 0 100 tol=5\n.tran 1m 10m\n.meas tran i avg i(r1)\n.end\n";
/// let model = circ::Model::parse(text, "load.cir")?;
/// let mut currents = vec![];
/// sweep(&samples(&variants(&model, &[]), 7), &SweepOptions::default(), |row| {
///     currents.extend(row.measured[0]);
///     ControlFlow::Continue(())
/// })?;
/// assert_eq!(currents.len(), 7);
/// assert!(currents.iter().all(|i| (0.095..0.106).contains(i)));
/// # Ok::<(), circ::Error>(())
/// ```
///
/// # Errors
/// [`Reason::Interrupted`], and those of [`measured_names`].
pub fn sweep(
    variants: &[Variant<'_>],
    options: &SweepOptions<'_>,
    mut take: impl FnMut(Row) -> ControlFlow<()>,
) -> Result<(), Error> {
    let Some(first) = variants.first() else {
        return Ok(());
    };
    let wanted = Wanted {
        measured: measured_names(first.base, &options.of)?,
        drawn: drawn_names(first.base),
        options,
    };
    for (start, chunk) in (0..).step_by(CHUNK).zip(variants.chunks(CHUNK)) {
        let rows = each(chunk, |variant| wanted.measure(variant));
        for (index, row) in (start..).zip(rows) {
            let row = row?;
            if take(Row { index, ..row }).is_break() {
                return Ok(());
            }
        }
    }
    Ok(())
}

/// What is asked of every variant.
struct Wanted<'a> {
    measured: Vec<String>,
    drawn: Vec<String>,
    options: &'a SweepOptions<'a>,
}

impl Wanted<'_> {
    /// The row of one variant; an error where the sweep is interrupted.
    fn measure(&self, variant: &Variant<'_>) -> Result<Row, Error> {
        let mut row = Row {
            index: 0,
            drawn: vec![None; self.drawn.len()],
            measured: vec![None; self.measured.len()],
            failed: None,
        };
        let found = variant.measured_model().and_then(|model| {
            let drawn = self.drawn.iter().map(|name| model.circuit().value(name));
            row.drawn = drawn.collect();
            self.found(&model)
        });
        match found {
            Ok(found) => {
                let of = |name: &String| found.iter().find(|m| m.name == *name);
                let value = |m: &Measured| Some(m.result.as_ref().ok()?.value);
                let measured = self.measured.iter().map(|name| value(of(name)?));
                row.measured = measured.collect();
            }
            Err(error) if error.reason == Reason::Interrupted => return Err(error),
            Err(error) => row.failed = Some(error.to_string()),
        }
        Ok(row)
    }

    /// What the measurements of a model find; a run that breaks off measures nothing.
    fn found(&self, model: &Model) -> Result<Vec<Measured>, Error> {
        let (settings, cancel) = (self.options.settings.clone(), self.options.cancel);
        if self.options.steady {
            let options = PeriodicOptions {
                cancel,
                settings,
                ..PeriodicOptions::default()
            };
            return Ok(periodic_measured(model, &options)?.2.measured);
        }
        let options = SimOptions {
            cancel,
            settings,
            ..SimOptions::default()
        };
        measured(model, options, true)
    }
}
