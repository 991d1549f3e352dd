//! The circuit reduced for a mode, switches on their thresholds included.

use std::sync::{Arc, Mutex, PoisonError};

use crate::integrate::error::{Error, Reason};
use crate::integrate::switching::Threshold;
use crate::lcs::{Hold, Lcs, Position, StorageHold, is_coupled, reduce_apart};
use crate::mna::{SourceControl, StandardMultiport, StaticMultiport};

/// A jump of a function block's output at one value of its input: while the first pair conducts and the second does not, the
/// output is between the two levels and the input stays.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Step {
    /// The block.
    pub(crate) device: String,
    /// Number of the first pair.
    pub(crate) pair: usize,
}

/// Where the function blocks of a multiport jump; pairs are those of its [standard form](StaticMultiport::standard).
pub(crate) fn steps_of(original: &StaticMultiport) -> Vec<Step> {
    let mut steps = Vec::new();
    let mut first = 0;
    for pair in &original.pairs {
        let vertices = pair.port.law.curve().map_or_else(Vec::new, |c| c.vertices);
        let jumps = vertices
            .windows(2)
            .enumerate()
            .filter(|(_, w)| w[0].0.f64 == w[1].0.f64);
        if pair.fixed_role {
            steps.extend(jumps.map(|(k, _)| Step {
                device: pair.port.device.clone(),
                pair: first + k,
            }));
        }
        let ideal = !pair.fixed_role && pair.port.law.is_ideal_diode();
        first += if ideal { 1 } else { vertices.len().max(1) };
    }
    steps
}

/// Bytes of systems that are shared: small circuits have all of theirs.
const MOST_SHARED: usize = 1 << 20;

/// The systems of one multiport that were reduced, by position, for all who reduce it: the first ones, as many as [`MOST_SHARED`] bytes hold.
#[derive(Debug, Default)]
pub(crate) struct Reduced(Mutex<Vec<(Position, Lcs)>>);

impl Reduced {
    /// The system of a position if it is known, and none of its states are to stand apart in steps of up to `span`, s.
    fn find(&self, position: &Position, span: f64) -> Option<Lcs> {
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = known.iter().find(|(other, _)| other == position);
        let lcs = found.map(|(_, lcs)| lcs)?;
        (!is_coupled(lcs, span)).then(|| lcs.clone())
    }

    /// Takes in a system, unless some of its states stand apart.
    pub(crate) fn keep(&self, position: Position, lcs: &Lcs) {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let held: usize = known.iter().map(|(_, lcs)| lcs.bytes()).sum();
        if lcs.fast.is_empty() && held + lcs.bytes() <= MOST_SHARED {
            known.push((position, lcs.clone()));
        }
    }
}

/// Reduces one multiport for its modes.
#[derive(Debug)]
pub struct Assembler {
    multiport: Arc<StandardMultiport>,
    /// The multiports with some switches on their thresholds.
    sliding: Vec<(Vec<usize>, StandardMultiport)>,
    steps: Vec<Step>,
    /// The longest step, s.
    span: f64,
    /// The system of one position of the switches, all devices free.
    known: Option<(Vec<bool>, Lcs)>,
    /// Those of all positions so far, where others reduce the multiport too.
    reduced: Option<Arc<Reduced>>,
}

impl Assembler {
    /// For one multiport.
    #[must_use]
    pub fn new(multiport: Arc<StandardMultiport>) -> Self {
        Self {
            multiport,
            sliding: Vec::new(),
            steps: Vec::new(),
            span: f64::INFINITY,
            known: None,
            reduced: None,
        }
    }

    /// Has it share what it reduces with others that reduce the same multiport.
    pub(crate) fn sharing(mut self, reduced: &Arc<Reduced>) -> Self {
        self.reduced = Some(Arc::clone(reduced));
        self
    }

    /// Spares it the reduction of this position with all devices free.
    pub(crate) fn knowing(mut self, switches: &[bool], lcs: &Lcs) -> Self {
        self.known = Some((switches.to_vec(), lcs.clone()));
        self
    }

    /// Has it known how long the longest step is, s.
    #[must_use]
    pub(crate) fn with_span(mut self, span: f64) -> Self {
        self.span = span;
        self
    }

    /// How long the longest step is, s.
    pub(crate) const fn span(&self) -> f64 {
        self.span
    }

    /// Has it known where function blocks jump, so that a run can tell when they slide.
    #[must_use]
    pub(crate) fn with_steps(mut self, steps: Vec<Step>) -> Self {
        self.steps = steps;
        self
    }

    /// See [`Self::with_steps`].
    pub(crate) fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// See [`StaticMultiport::source_controls`].
    pub(crate) fn controls(&self) -> (Vec<bool>, Vec<SourceControl>) {
        self.multiport.source_controls()
    }

    /// See [`StandardMultiport::is_alike`].
    pub(crate) fn is_alike(&self, other: &Self) -> bool {
        let devices = |steps: &[Step]| -> Vec<usize> { steps.iter().map(|s| s.pair).collect() };
        devices(&self.steps) == devices(&other.steps) && self.multiport.is_alike(&other.multiport)
    }

    /// What it reduces.
    pub(crate) fn multiport(&self) -> &StandardMultiport {
        &self.multiport
    }

    /// Number of device pairs.
    pub(crate) fn pairs(&self) -> usize {
        self.multiport.pairs.len()
    }

    /// The device of a pair.
    pub(crate) fn device(&self, pair: usize) -> Option<&str> {
        let pair = self.multiport.pairs.get(pair)?;
        Some(&pair.port.device)
    }

    /// The switches' thresholds.
    pub(crate) fn thresholds(&self) -> Vec<Threshold> {
        self.multiport.switches.iter().map(Threshold::of).collect()
    }

    /// Ron and 1/Roff of a switch.
    pub(crate) fn limits(&self, switch: usize) -> (f64, f64) {
        let switch = &self.multiport.switches[switch];
        (switch.ron.f64, switch.roff.map_or(0.0, |r| 1.0 / r.f64))
    }

    /// The system with these devices and switches; the switches in `sliding` (in order) are on their thresholds.
    pub(crate) fn assemble(
        &mut self,
        devices: &[Hold],
        switches: &[bool],
        sliding: &[usize],
    ) -> Result<Lcs, Error> {
        if sliding.is_empty() {
            if let Some((_, lcs)) = self.known.take_if(|(known, lcs)| {
                known == switches
                    && !is_coupled(lcs, self.span)
                    && devices.iter().all(|d| *d == Hold::Free)
            }) {
                return Ok(lcs);
            }
            let position = Position {
                devices: devices.to_vec(),
                switches: switches.to_vec(),
                storage: StorageHold::Dynamic,
            };
            let shared = self.reduced.as_ref();
            if let Some(known) = shared.and_then(|shared| shared.find(&position, self.span)) {
                return Ok(known);
            }
            let lcs = reduce_apart(&self.multiport, &position, self.span);
            let lcs = lcs.map_err(|e| Error::before(e.into()))?;
            if let Some(shared) = shared {
                shared.keep(position, &lcs);
            }
            return Ok(lcs);
        }
        let at = match self.sliding.iter().position(|(s, _)| s == sliding) {
            Some(at) => at,
            None => {
                let mut multiport = StandardMultiport::clone(&self.multiport);
                // From the last on, so that the indices before stay.
                for &k in sliding.iter().rev() {
                    let switch = &self.multiport.switches[k];
                    let level = 0.5 * (switch.on_above + switch.off_below);
                    multiport = multiport.sliding(k, level).ok_or_else(|| {
                        let what = format!("{} cannot slide", switch.name);
                        Error::before(Reason::internal("integrate::exact", what))
                    })?;
                }
                self.sliding.push((sliding.to_vec(), multiport));
                self.sliding.len() - 1
            }
        };
        let mut devices = devices.to_vec();
        devices.resize(devices.len() + sliding.len(), Hold::Closed);
        let left = (0..switches.len()).filter(|k| !sliding.contains(k));
        let position = Position {
            devices,
            switches: left.map(|k| switches[k]).collect(),
            storage: StorageHold::Dynamic,
        };
        reduce_apart(&self.sliding[at].1, &position, self.span).map_err(|e| Error::before(e.into()))
    }
}
