//! The same question at many values.

#[cfg(feature = "parallel")]
use rayon::prelude::*;

use crate::circuit::{Circuit, Sweep, combinations};
use crate::integrate::Error;
use crate::model::Model;

/// A combination of values, and the model that it is one of.
#[derive(Debug, Clone)]
pub struct Variant<'m> {
    base: &'m Model,
    sweeps: &'m [Sweep],
    values: Vec<f64>,
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
    let variant = |values| Variant {
        base,
        sweeps,
        values,
    };
    combinations(sweeps).into_iter().map(variant).collect()
}

impl Variant<'_> {
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

    /// The model with these values.
    ///
    /// # Errors
    /// The netlist is no circuit with them.
    pub fn model(&self) -> Result<Model, Error> {
        self.base.at(self.sweeps, &self.values)
    }

    /// Its circuit alone.
    pub(super) fn circuit(&self) -> Result<Circuit, Error> {
        self.base.circuit_at(self.sweeps, &self.values)
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
