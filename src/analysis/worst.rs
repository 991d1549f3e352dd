//! What tolerances may make of a measurement.

use std::sync::atomic::AtomicBool;

use serde::Serialize;

use super::measured::measured;
use super::sensitivity::{SensitivityOptions, sensitivity, values};
use crate::integrate::{Error, Note, Reason, SimOptions};
use crate::model::Model;
use crate::settings::Settings;
use crate::settings::tolerances::periodic::NOT_STRAIGHT;

/// What bounds may be asked for.
#[derive(Debug, Clone, Default)]
pub struct WorstOptions<'a> {
    /// Elements and parameters with their tolerances, 0.05 for ±5 %, besides those of `tol=` on cards, which they replace.
    pub tolerances: Vec<(String, f64)>,
    /// Ends the runs when set.
    pub cancel: Option<&'a AtomicBool>,
    /// Tolerances of the runs.
    pub settings: Settings,
}

/// An end of the range of a measurement.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Bound {
    /// As its derivatives let expect.
    pub estimate: f64,
    /// What a run with these values finds.
    pub value: f64,
    /// The values there: each at an end of its tolerance, or all as they stand.
    pub at: Vec<(String, f64)>,
}

/// The range of a measurement.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Worst {
    /// The name of the measurement.
    pub measurement: String,
    /// With the values as they stand.
    pub nominal: f64,
    /// The least.
    pub least: Bound,
    /// The greatest.
    pub greatest: Bound,
    /// What each value contributes to either side, by its derivative.
    pub contributions: Vec<(String, f64)>,
    /// Things the user should know.
    #[serde(skip)]
    pub notes: Vec<Note>,
}

/// The values with a tolerance, each of which can be varied, for a measurement that there is: all that [`worst`] can know before its runs.
///
/// # Errors
/// No such measurement, no tolerances, a value that is not there or cannot be varied.
pub(crate) fn toleranced(
    model: &Model,
    of: &str,
    options: &WorstOptions<'_>,
) -> Result<Vec<(String, f64)>, Error> {
    if let Some(what) = model.circuit().no_measurement(of) {
        return Err(Error::before(Reason::Unsupported(what)));
    }
    let mut tolerances = options.tolerances.clone();
    let named = |name: &String| options.tolerances.iter().any(|(own, _)| own == name);
    let cards = model.circuit().tolerances.iter();
    tolerances.extend(cards.filter(|(name, _)| !named(name)).cloned());
    if tolerances.is_empty() {
        let what = "no value has a tolerance: `tol=5` on a card, or `--tol-of r1=5%`";
        return Err(Error::before(Reason::Unsupported(what.into())));
    }
    let names: Vec<String> = tolerances.iter().map(|(name, _)| name.clone()).collect();
    values(model, &names)?;
    Ok(tolerances)
}

/// The range of what a `.meas` finds while values vary within their tolerances: each value goes to the end to which the derivative points, and a run
/// with all of them there finds the value; the range holds what the values themselves give, too. Where the runs differ from the derivatives by more than a tenth of the range, another corner may be worse, and
/// a note says so.
///
/// # Errors
/// No such measurement, or none with a value; no tolerances; else as [`sensitivity`](super::sensitivity()).
///
/// # Example
/// A divider of two resistors of ±1 %.
/// ```
/// use circ::analysis::{WorstOptions, worst};
///
/// let text = "divider\nv1 1 0 10\nr1 1 2 1k tol=1\nr2 2 0 1k tol=1\n.tran 1m 10m\n.meas tran out avg v(2)\n.end\n";
/// let model = circ::Model::parse(text, "divider.cir")?;
/// let range = worst(&model, "out", &WorstOptions::default())?;
/// assert!((range.greatest.value - 10.0 * 1.01 / 2.0).abs() < 1e-9);
/// assert!((range.least.value - 10.0 * 0.99 / 2.0).abs() < 1e-9);
/// # Ok::<(), circ::Error>(())
/// ```
pub fn worst(model: &Model, of: &str, options: &WorstOptions<'_>) -> Result<Worst, Error> {
    let of = of.to_lowercase();
    let tolerances = toleranced(model, &of, options)?;
    let asked = SensitivityOptions {
        of: vec![of.clone()],
        to: tolerances.iter().map(|(name, _)| name.clone()).collect(),
        cancel: options.cancel,
        settings: options.settings.clone(),
        ..SensitivityOptions::default()
    };
    let found = sensitivity(model, &asked)?;
    let none =
        |why: &str| Error::before(Reason::Unsupported(format!("`{of}` has no range: {why}")));
    let gradient = found.of.first().ok_or_else(|| none("it has no value"))?;
    let nominal = gradient.value.clone().map_err(|why| none(&why))?;
    let mut contributions = Vec::new();
    for ((name, derivative), ((_, value), (_, tolerance))) in
        gradient.to.iter().zip(found.at.iter().zip(&tolerances))
    {
        let derivative = derivative.ok_or_else(|| none("a derivative is not known"))?;
        contributions.push((name.clone(), derivative * value * tolerance));
    }
    let reach: f64 = contributions.iter().map(|(_, part)| part.abs()).sum();
    let bound = |side: f64| {
        let mut corner = model.clone();
        let mut at = Vec::new();
        let parts = contributions.iter().zip(found.at.iter().zip(&tolerances));
        for ((name, part), ((_, value), (_, tolerance))) in parts {
            let end = value * (1.0 + side * part.signum() * tolerance);
            corner.set(name, end)?;
            at.push((name.clone(), end));
        }
        Ok::<_, Error>(Bound {
            estimate: nominal + side * reach,
            value: value(&corner, &of, options)?,
            at,
        })
    };
    let (down, up) = (bound(-1.0)?, bound(1.0)?);
    let mut notes = found.notes;
    let bent = |bound: &Bound| (bound.value - bound.estimate).abs() > NOT_STRAIGHT * 2.0 * reach;
    if bent(&down) || bent(&up) {
        let text = format!(
            "`{of}` is no straight function of the values within their tolerances: another corner, or a place between, may be worse"
        );
        notes.push(Note::run("not-straight", text));
    }
    // About an extremum the values themselves lie outside of both ends.
    let middle = Bound {
        estimate: nominal,
        value: nominal,
        at: found.at,
    };
    let beyond = |first: &Bound, others: [&Bound; 2], side: f64| {
        let further = |a: &Bound, b: &Bound| side * (b.value - a.value) > 0.0;
        let found = others
            .into_iter()
            .fold(first, |a, b| if further(a, b) { b } else { a });
        found.clone()
    };
    let least = beyond(&down, [&up, &middle], -1.0);
    let greatest = beyond(&up, [&down, &middle], 1.0);
    Ok(Worst {
        measurement: of.clone(),
        nominal,
        least,
        greatest,
        contributions,
        notes,
    })
}

/// What `.meas` finds in a run.
fn value(model: &Model, of: &str, options: &WorstOptions<'_>) -> Result<f64, Error> {
    let asked = SimOptions {
        cancel: options.cancel,
        settings: options.settings.clone(),
        unestimated: true,
        ..SimOptions::default()
    };
    let found = measured(model, asked, true)?;
    let found = found.iter().find(|measured| measured.name == of);
    let result = found.map(|measured| &measured.result);
    match result {
        Some(Ok(found)) => Ok(found.value),
        Some(Err(why)) => Err(Error::before(Reason::Unsupported(format!(
            "`{of}` has no value at the end of the tolerances: {why}"
        )))),
        None => Err(Error::before(Reason::Unsupported(format!(
            "no measurement `{of}`"
        )))),
    }
}
