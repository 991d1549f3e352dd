//! Derivatives of measurements to the values of elements and parameters.

mod base;
mod beside;
mod costs;
mod course;
mod differences;
mod exact;
mod gradients;
mod stepped;
mod survey;

use std::sync::atomic::AtomicBool;

use self::beside::Beside;
pub use self::gradients::{Gradient, Sensitivity};
use super::periodic::beyond_dense;
use super::table::{Entries, TABLE, entries};
use crate::circuit::{Kind, SteadyState, source::Wave};
use crate::integrate::{Error, Note, Reason};
use crate::model::Model;
use crate::settings::Settings;

/// Which way the derivatives of an exact run are computed: both have the same result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SensitivityMethod {
    /// Backward where there are more values than measurements, else forward.
    #[default]
    Automatic,
    /// Each value's change is carried along the run.
    Forward,
    /// What each measurement weighs is carried back along the run, once for all values. Values that move waveforms of sources otherwise than by a constant
    /// or with their edges, measurements of expressions that jump by themselves, and runs in which events coincide by chance still go forward.
    Adjoint,
}

/// How often derivatives have gone along the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Passes {
    /// Values whose change was carried along it.
    pub forward: usize,
    /// Measurements that were carried back along it.
    pub backward: usize,
}

/// What derivatives may be asked for.
#[derive(Debug, Clone, Default)]
pub struct SensitivityOptions<'a> {
    /// Names of `.meas`, and of entries of the table; by default all.
    pub of: Vec<String>,
    /// Names of elements and parameters; by default all resistances, capacitances, inductances and constant sources of the top level and all
    /// parameters that something uses, unless they are 0.
    pub to: Vec<String>,
    /// Of the periodic steady state instead of the transient; `.tran … steady` asks for it too.
    pub steady: bool,
    /// The period of it, s, in place of the common one of the sources.
    pub period: Option<f64>,
    /// Of the entries of the [table](super::table()) too, by their names in `--summary json` with dots between: `table.l1.i.rms`, `table.probes.v(out).ripple`,
    /// `table.power.efficiency`.
    pub table: bool,
    /// Elements from which the input power of the table comes, as in [`TableOptions`](super::TableOptions).
    pub inputs: Vec<String>,
    /// Elements that take its output power.
    pub outputs: Vec<String>,
    /// Which way they are computed.
    pub method: SensitivityMethod,
    /// Ends the runs when set.
    pub cancel: Option<&'a AtomicBool>,
    /// Tolerances.
    pub settings: Settings,
}

impl SensitivityOptions<'_> {
    fn asks_for(&self, measurement: &str) -> bool {
        let mut of = self.of.iter();
        let is_named = of.any(|name| name.to_lowercase() == measurement);
        is_named || self.of.is_empty() && !measurement.starts_with('.')
    }
}

/// The derivatives of what `.meas` finds to the values of elements and to parameters.
///
/// What happens between events moves with a value p as the variational equation says: its values by ∂y/∂p, its ends in time too. What `.meas` finds weighs these
/// changes: dJ = Σ ∂J/∂y δy + ∂J/∂t δt over the values of the smooth pieces that it sees and their ends. In the steady state
/// ∂s₀/∂p = (I − M)⁻¹ φ_p with the monodromy M and what a period makes of the change alone. With few values each change is carried along the run; with more values than
/// measurements what each measurement weighs is carried back along it instead, which costs the same for any number of values ([`SensitivityMethod`]). Large circuits, whose runs
/// are made in sparse steps, have the derivatives of these in the same way, and a note states what they may be off by. Where other steps are made,
/// differences of runs with p (1 ± h) and p (1 ± 2h) stand for it, and a note says so; they do as well where impulses are measured.
///
/// # Errors
/// A name that is not there; [`Reason::NotSmooth`] where the derivative does not exist; the errors of the run.
///
/// # Example
/// A capacitor is charged over RC: v = 1 − e^{−t/RC}, and R ∂v/∂R = −(t/RC) e^{−t/RC}.
/// ```
/// use circ::analysis::{SensitivityOptions, sensitivity};
///
/// let text = "rc\nv1 1 0 1\nr1 1 2 1k\nc1 2 0 1u\n.tran 10u 2m uic\n.meas tran v find v(2) at=1m\n.end\n";
/// let model = circ::Model::parse(text, "rc.cir")?;
/// let found = sensitivity(&model, &SensitivityOptions::default())?;
/// let truth = -(-1.0_f64).exp();
/// assert!((1e3 * found.derivative("v", "r1").unwrap() - truth).abs() < 1e-9);
/// assert!((1e-6 * found.derivative("v", "c1").unwrap() - truth).abs() < 1e-9);
/// # Ok::<(), circ::Error>(())
/// ```
pub fn sensitivity(model: &Model, options: &SensitivityOptions<'_>) -> Result<Sensitivity, Error> {
    let circuit = model.circuit();
    let options = &SensitivityOptions {
        steady: options.steady || circuit.steady == Some(SteadyState::Start),
        ..options.clone()
    };
    let to = values(model, &options.to)?;
    let groups = if options.table {
        let ends = (&options.inputs[..], &options.outputs[..]);
        entries(circuit, ends, options.steady)?
    } else {
        vec![]
    };
    let is_entry = |of: &&String| {
        let mut names = groups.iter().flat_map(Entries::names);
        names.any(|name| name.to_lowercase() == of.to_lowercase())
    };
    let others: Vec<&String> = options.of.iter().filter(|of| !is_entry(of)).collect();
    let is_cost = |of: &&String| options.table && of.to_lowercase().starts_with(TABLE);
    let (costs, cards): (Vec<&String>, Vec<&String>) = others.into_iter().partition(is_cost);
    if let Some(what) = cards.iter().find_map(|of| circuit.no_measurement(of)) {
        return Err(unsupported(what));
    }
    if circuit.measurements.is_empty() && !options.table {
        return Err(unsupported(
            "the netlist has no `.meas` to differentiate: `.meas tran vout avg v(out)`".into(),
        ));
    }
    let mut found = Sensitivity {
        exact: true,
        ..Sensitivity::default()
    };
    let cards = circuit.measurements.iter().map(|m| m.name.as_str());
    let all = std::iter::once((None, cards.collect()));
    let names = groups.iter().enumerate();
    let names = names.map(|(k, group)| (Some(k), group.names().collect::<Vec<&str>>()));
    let asked = all.chain(names).filter(|(_, names)| {
        let mut names = names.iter();
        names.any(|name| options.asks_for(name))
    });
    let beside = |entries: Option<usize>| Beside {
        model,
        options,
        entries,
    };
    for (entries, _) in asked {
        found.extend(beside(entries).found(&to)?);
    }
    if options.table && !circuit.losses.is_empty() && (options.of.is_empty() || !costs.is_empty()) {
        // Values on which the period depends are left out before.
        let to = if found.of.is_empty() {
            to
        } else {
            found.at.clone()
        };
        let mut more = beside(None).costs(&to)?;
        more.of.retain(|gradient| options.asks_for(&gradient.name));
        found.extend(more);
    }
    let mut known = found.of.iter().map(|gradient| &gradient.name);
    if let Some(of) = costs
        .iter()
        .find(|of| !known.any(|name| *name == of.to_lowercase()))
    {
        let what = "is no entry of the table: `circ sim --table --summary json` has all of them";
        return Err(unsupported(format!("`{of}` {what}")));
    }
    Ok(found)
}

fn unsupported(what: String) -> Error {
    Error::before(Reason::Unsupported(what))
}

fn left_out(name: &str) -> Note {
    let text = format!(
        "`{name}` is left out: it changes the period, on which the steady state depends otherwise"
    );
    Note::run("left-out", text)
}

/// What is asked for, with its value.
pub(super) fn values(model: &Model, asked: &[String]) -> Result<Vec<(String, f64)>, Error> {
    let circuit = model.circuit();
    let elements = circuit.elements.iter().filter(|e| !e.name.contains('.'));
    let elements = elements.filter_map(|e| Some((e.name.clone(), value_of(&e.kind)?)));
    let all: Vec<(String, f64)> = elements.chain(circuit.params.iter().cloned()).collect();
    if asked.is_empty() {
        let some = all.into_iter().filter(|(_, value)| *value != 0.0);
        return as_written(model, some.collect());
    }
    let find = |name: &String| {
        let own = all.iter().find(|(own, _)| *own == name.to_lowercase());
        let own = own.cloned().ok_or_else(|| {
            let what = "is no resistance, capacitance, inductance or constant source of the top level, nor a parameter that something uses";
            unsupported(format!("`{name}` {what}"))
        })?;
        if own.1 == 0.0 {
            return Err(unsupported(format!(
                "`{name}` is 0: a small part of it is no change"
            )));
        }
        model.swept(name).map(|_| own)
    };
    as_written(model, asked.iter().map(find).collect::<Result<_, _>>()?)
}

/// These values as their cards have them: a card's value may be multiplied (`m=2`).
fn as_written(model: &Model, mut all: Vec<(String, f64)>) -> Result<Vec<(String, f64)>, Error> {
    let elements = all
        .iter()
        .filter(|(name, _)| model.circuit().element(name).is_some());
    let (set, _) = model.circuit_with(&elements.cloned().collect::<Vec<_>>())?;
    for (name, value) in &mut all {
        let id = set.element(name);
        let again = id.and_then(|id| value_of(&set.elements[id.index()].kind));
        *value /= again.map_or(1.0, |again| again / *value);
    }
    Ok(all)
}

/// The value that a card gives to an element.
fn value_of(kind: &Kind) -> Option<f64> {
    match kind {
        Kind::Resistor(value) | Kind::Capacitor(value) | Kind::Inductor(value) => Some(value.f64),
        Kind::VoltageSource(source) | Kind::CurrentSource(source) => match source.wave {
            Wave::Dc(value) => Some(value),
            _ => None,
        },
        _ => None,
    }
}

impl Beside<'_> {
    fn found(&self, to: &[(String, f64)]) -> Result<Sensitivity, Error> {
        let found = match self.stepped(to)? {
            None if self.options.steady && beyond_dense(self.model) => {
                Some(self.few_differences(to)?)
            }
            None => self.exact(to)?,
            found => found,
        };
        let mut found = match found {
            Some(found) => found,
            None => self.differences(to)?,
        };
        found.of.retain(|gradient| {
            // What a table leaves out is told where it is asked for.
            let is_told = self.entries.is_none() || !self.options.of.is_empty();
            (is_told || gradient.value.is_ok()) && self.options.asks_for(&gradient.name)
        });
        Ok(found)
    }
}
