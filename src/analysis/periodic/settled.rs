//! A periodic steady state however it was found: with dense matrices, or of a large circuit by products.

use super::large::Large;
use super::{Asked, PeriodicOptions, Steady, asked, linearised, size, whole};
use crate::circuit::Tran;
use crate::integrate::{Error, Note, Orbit, Reason, Run, Standing};
use crate::model::Model;
use crate::settings::tolerances::periodic::MOST_LINEARISED;
use crate::settings::tolerances::sparse::MOST_DENSE_STATES;

/// A circuit in its periodic steady state, as it was found.
pub(in crate::analysis) enum Settled {
    /// By dense matrices.
    Whole(Box<Steady>),
    /// In steps on matrices without their zeros; its sources that do not repeat, and what is to be told of the period.
    Large(Box<Large>, Vec<String>, Vec<Note>),
}

impl Settled {
    /// The orbit.
    pub(in crate::analysis) fn orbit(&self) -> Orbit {
        match self {
            Self::Whole(steady) => steady.orbit(),
            Self::Large(large, ..) => large.orbit().clone(),
        }
    }

    /// Where the orbit begins, with what conducts there.
    pub(super) fn standing(&mut self) -> Result<Standing, Error> {
        match self {
            Self::Whole(steady) => steady.standing(),
            Self::Large(large, ..) => Ok(large.standing()),
        }
    }

    /// How far the orbit may be off, relative to the amplitudes, and what of it concerns what begins on it.
    pub(super) fn of_start(&self) -> (f64, Vec<Note>) {
        match self {
            Self::Whole(steady) => (steady.off(), steady.notes_of_start()),
            Self::Large(large, _, said) => {
                let notes = said.iter().cloned().chain(large.notes_of_start());
                (large.off(), notes.collect())
            }
        }
    }

    /// The orbit, and one period of it on the grid that `grid` makes of that of the period.
    pub(in crate::analysis) fn on_grid(
        self,
        options: &PeriodicOptions<'_>,
        grid: impl FnOnce(Tran) -> Tran,
    ) -> Result<(Orbit, Run), Error> {
        match self {
            Self::Whole(steady) => steady.on_grid(options, grid),
            Self::Large(large, held, said) => large.on_grid((&held, said), options, grid),
        }
    }

    /// With dense matrices, on which curves between events and tables in closed form stand.
    pub(in crate::analysis) fn whole(&mut self) -> Option<&mut Steady> {
        match self {
            Self::Whole(steady) => Some(steady),
            Self::Large(..) => None,
        }
    }
}

/// The same for what follows from the derivative of an orbit: of a driven circuit of many elements by products, else with dense matrices, of not too many elements.
///
/// # Errors
/// As [`periodic`](super::periodic()).
pub(in crate::analysis) fn settled_linear(
    model: &Model,
    options: &PeriodicOptions<'_>,
) -> Result<Settled, Error> {
    let asked = asked(model, options)?;
    match Large::of(&asked, options) {
        Ok(Some(large)) => return Ok(Settled::Large(Box::new(large), asked.held, asked.said)),
        Err(error) if is_final(&error, &asked, MOST_LINEARISED) => return Err(error),
        Ok(None) | Err(_) => {}
    }
    Ok(Settled::Whole(Box::new(linearised(asked, options)?)))
}

/// The orbit of a driven circuit of many elements, in steps on matrices without their zeros; nothing of another, or where they do not find it.
///
/// # Errors
/// It was interrupted.
pub(in crate::analysis) fn settled_large(
    model: &Model,
    options: &PeriodicOptions<'_>,
) -> Result<Option<Large>, Error> {
    match Large::of(&asked(model, options)?, options) {
        Err(error) if error.reason != Reason::Interrupted => Ok(None),
        found => found,
    }
}

/// Finds the periodic steady state, of a large driven circuit by products.
///
/// # Errors
/// As [`periodic`].
pub(in crate::analysis) fn settled(
    model: &Model,
    options: &PeriodicOptions<'_>,
) -> Result<Settled, Error> {
    let mut asked = asked(model, options)?;
    match Large::of(&asked, options) {
        Ok(Some(large)) => {
            return Ok(Settled::Large(Box::new(large), asked.held, asked.said));
        }
        Ok(None) => {}
        Err(error) => {
            if is_final(&error, &asked, MOST_DENSE_STATES) {
                return Err(error);
            }
            let text = format!(
                "the orbit was looked for with dense matrices instead of products in sparse steps: {error}"
            );
            let concerned = error.elements.clone();
            asked.said.push(Note::of("steps-instead", concerned, text));
        }
    }
    Ok(Settled::Whole(Box::new(whole(asked, options)?)))
}

/// Whether dense matrices, of `most` elements, have no other answer.
fn is_final(error: &Error, asked: &Asked, most: usize) -> bool {
    size(&asked.multiport) > most
        || matches!(error.reason, Reason::NoOrbit(_) | Reason::Interrupted)
}
