//! A problem as those of its parts.

use std::sync::Arc;

use nalgebra::DVector;

use super::{Modal, Parts};
use crate::circuit::Tran;
use crate::integrate::error::Error;
use crate::integrate::exact::{Exact, Place, Step};
use crate::integrate::handover::Handover;
use crate::integrate::problem::{Problem, Systems};
use crate::integrate::step::Scheme;
use crate::lcs::Lcs;
use crate::mna::Part;
use crate::plan::not_exact;
use crate::settings::Settings;

/// A part that is ready to run.
pub(crate) struct Ready {
    problem: Problem,
    /// The system of its start position.
    lcs: Lcs,
    /// By probe of its own the column of the whole.
    pub(super) columns: Vec<usize>,
}

impl Problem {
    /// Its parts, none where it is one, small (see [`Settings::apart`]) or has a part without exact integration: each is solved by itself.
    pub(crate) fn parts(&self, tran: &Tran, settings: &Settings) -> Vec<Ready> {
        let multiport = &self.systems.multiport;
        let size = multiport.storage.len() + multiport.pairs.len() + multiport.switches.len();
        if size < settings.apart || self.has_lines() {
            return Vec::new();
        }
        let parts = multiport.parts();
        let ready = parts.into_iter().map(|part| {
            let columns = part.probes.clone();
            let mut problem = self.part(part);
            if problem.is_large(Scheme::MIDPOINT, settings) {
                return None;
            }
            // What keeps a part from running is told of the whole.
            let lcs = problem.prepare(tran, settings).ok()?;
            not_exact(&lcs).is_none().then_some(Ready {
                problem,
                lcs,
                columns,
            })
        });
        ready.collect::<Option<_>>().unwrap_or_default()
    }

    fn part(&self, part: Part) -> Self {
        let Part {
            multiport,
            storage,
            pairs,
            switches,
            ..
        } = part;
        let picked = |values: &[bool], places: &[usize]| -> Vec<bool> {
            places
                .iter()
                .filter_map(|&k| values.get(k).copied())
                .collect()
        };
        let steps = self.steps.iter().filter_map(|step| {
            let pair = pairs.binary_search(&step.pair).ok()?;
            Some(Step {
                pair,
                ..step.clone()
            })
        });
        Self {
            steps: steps.collect(),
            lines: Vec::new(),
            start: Place {
                t: self.start.t,
                storage: DVector::from_iterator(
                    storage.len(),
                    storage.iter().map(|&k| self.start.storage[k]),
                ),
                switches: picked(&self.start.switches, &switches),
            },
            conducting: picked(&self.conducting, &pairs),
            // Parts are integrated exactly, or not at all.
            at_rest: None,
            settle: picked(&self.settle, &switches),
            notes: Vec::new(),
            systems: Systems::of(multiport),
            free_sources: self.free_sources,
            after_edges: self.after_edges,
            known_comparators: self.known_comparators,
            rows_at_corners: self.rows_at_corners,
            balanced: self.balanced,
        }
    }
}

/// Parts of a run, and what they are made from.
#[derive(Clone)]
pub(crate) struct Cut {
    parts: Arc<[Ready]>,
    is_volts: Vec<bool>,
    tran: Tran,
    at_events: bool,
    settings: Settings,
}

impl Cut {
    /// For rows of these columns, voltages or not, at events too where they are wanted.
    pub(crate) fn new(
        parts: Vec<Ready>,
        is_volts: Vec<bool>,
        tran: Tran,
        at_events: bool,
        settings: &Settings,
    ) -> Self {
        Self {
            parts: parts.into(),
            is_volts,
            tran,
            at_events,
            settings: settings.clone(),
        }
    }

    /// By part the system of its start position.
    pub(crate) fn systems(&self) -> impl Iterator<Item = &Lcs> {
        self.parts.iter().map(|part| &part.lcs)
    }

    /// Exact integration of every part.
    ///
    /// # Errors
    /// As of the whole.
    pub(crate) fn exact(&self) -> Result<Parts<Exact>, Error> {
        self.made(|part| part.problem.exact(&self.tran, &part.lcs, &self.settings))
    }

    /// The same with Moreau's steps, so many between rows, where a part cannot go on.
    ///
    /// # Errors
    /// As of the whole.
    pub(crate) fn handover(&self, steps: f64) -> Result<Parts<Handover>, Error> {
        self.made(|part| {
            part.problem
                .handover(&self.tran, &part.lcs, &self.settings, steps)
        })
    }

    fn made<S: Modal>(&self, make: impl Fn(&Ready) -> Result<S, Error>) -> Result<Parts<S>, Error> {
        let span = (self.tran.tstep, self.tran.tstop);
        let most = self.settings.max_kept;
        Parts::new(
            &self.parts,
            make,
            self.is_volts.clone(),
            span,
            self.at_events,
            most,
        )
    }
}
