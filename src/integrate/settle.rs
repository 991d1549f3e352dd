//! Switches that drive switches: a position settles before anything flows.
//!
//! Where one switch drives another through a resistor, the position right after the first has moved is none that the circuit
//! stays in, and a current that has a path in the position at the end need not have one on the way. So controls fix the position
//! first, and only then does the state jump into it.

use nalgebra::{DMatrix, DVector};

use crate::integrate::error::Error;
use crate::integrate::reading::{self, Point};
use crate::integrate::switching::{Part, Threshold, Watched, fire};
use crate::lcs::Lcs;
use crate::settings::tolerances::events::DECISIVE;

/// Moves the switches whose controls ask for it in the `position` reached, until none does; whether one moved. `left` is the
/// position before this instant: a switch that has moved at this instant stays. `asking` says which switches a position's
/// controls ask to move, see [`asking`].
///
/// # Errors
/// Those of `asking` for the position reached.
pub(crate) fn settle(
    thresholds: &[Threshold],
    left: &[bool],
    position: &mut [bool],
    mut asking: impl FnMut(&[bool]) -> Result<Vec<usize>, Error>,
) -> Result<bool, Error> {
    let flip = |position: &mut [bool], which: &[usize]| {
        for &i in which {
            position[i] = !position[i];
        }
        fire(thresholds, position);
    };
    let mut settled = false;
    loop {
        let moved: Vec<usize> = (0..left.len())
            .filter(|&i| position[i] != left[i])
            .collect();
        let unmoved = |asking: Vec<usize>| -> Vec<usize> {
            let all = asking.into_iter();
            all.filter(|i| !moved.contains(i)).collect()
        };
        let next = match asking(position) {
            Ok(next) => unmoved(next),
            // Shorts and open branches that contradict each other on the way: with one of the switches that have moved still in its
            // place there is a circuit, and the controls that do not hang on it decide.
            Err(error) => moved
                .iter()
                .find_map(|&i| {
                    let mut without = position.to_vec();
                    flip(&mut without, &[i]);
                    let next = unmoved(asking(&without).ok()?);
                    (!next.is_empty()).then_some(next)
                })
                .ok_or(error)?,
        };
        if next.is_empty() {
            return Ok(settled);
        }
        flip(position, &next);
        settled = true;
    }
}

/// The switches whose controls ask for another position in the system of `position`, taken over from storage s under inputs u.
/// Controls that currents of devices decide, or storage that the position forces to jump, are asked when those are known.
pub(crate) fn asking(
    lcs: &Lcs,
    thresholds: &[Threshold],
    position: &[bool],
    s: &DVector<f64>,
    u: &DVector<f64>,
) -> Vec<usize> {
    let storage = &lcs.storage;
    let controls = Controls::of(lcs, s, u);
    let change = &storage.x * &controls.x + &storage.u * u + &storage.one - s;
    let energy = |s: &DVector<f64>| s.dot(&(&storage.metric * s));
    let keeps = energy(&change) <= DECISIVE * DECISIVE * energy(s);
    let asks = |&i: &usize| {
        let decided = controls.known(i) && (keeps || zero(&lcs.controls.x, i));
        let excess = || thresholds[i].excess(position[i], controls.value(i));
        decided && thresholds[i].latch.is_none() && excess() > controls.noise(i)
    };
    (0..position.len()).filter(asks).collect()
}

/// What sources alone make of control i, by source, and its constant; nothing where states, devices or slopes have a part in it. Where that
/// is the same before and after a change of position the switch moves at times of its own: on a threshold its control is rounding.
pub(crate) fn of_sources(lcs: &Lcs, i: usize) -> Option<(Vec<f64>, f64)> {
    let parts = [Part::States, Part::Devices, Part::Slopes];
    let alone = parts.iter().all(|&part| lcs.control_is_free_of(i, part));
    alone.then(|| lcs.control_of_sources(i))
}

/// Whether sources alone drive a control, `now` as in the position that was `left`; see [`of_sources`].
pub(crate) fn is_driven_alike(left: Option<(Vec<f64>, f64)>, now: Option<(Vec<f64>, f64)>) -> bool {
    now.is_some() && now == left
}

/// The part of a jump from storage `before` to `after` at which the first of the switches `leaving` pass their thresholds, and which
/// these are; `None` where none does on the way, or where the storage does not decide their controls. `left` is the system that
/// the jump leaves, `entered` that of `position`, in which the switches leave once the jump is done.
///
/// Where a position leaves a current no path, or joins capacitors, the limit of resistances takes the storage to where it may stay
/// along a line, in no time. A switch that is controlled by it moves on the way, and the rest has its path again: a converter
/// that interrupts its inductor while a current control watches loses what is between the thresholds, not all.
pub(crate) fn interruption(
    (left, entered): (&Lcs, &Lcs),
    thresholds: &[Threshold],
    (position, leaving): (&[bool], &[usize]),
    (before, after): (&DVector<f64>, &DVector<f64>),
    u: &DVector<f64>,
) -> Option<(f64, Vec<usize>)> {
    let [start, end] = [before, after].map(|s| Controls::of(left, s, u));
    let reached = Controls::of(entered, after, u);
    let part = |i: usize| {
        let known = [&start, &end, &reached].iter().all(|c| c.known(i));
        let same = || (end.value(i) - reached.value(i)).abs() <= end.noise(i) + reached.noise(i);
        if !known || !same() || thresholds[i].latch.is_some() {
            return None;
        }
        let [waits, passed] = [&start, &end].map(|c| thresholds[i].excess(position[i], c.value(i)));
        (waits < -start.noise(i) && passed > 0.0).then(|| (i, waits / (waits - passed)))
    };
    let parts: Vec<(usize, f64)> = leaving.iter().filter_map(|&i| part(i)).collect();
    let first = parts.iter().map(|(_, part)| *part).reduce(f64::min)?;
    let together = parts.iter().filter(|(_, part)| *part <= first + DECISIVE);
    Some((first, together.map(|(i, _)| *i).collect()))
}

fn zero(block: &DMatrix<f64>, i: usize) -> bool {
    i >= block.nrows() || block.row(i).iter().all(|v| *v == 0.0)
}

/// The controls of a system at storage s under inputs u.
struct Controls<'a> {
    lcs: &'a Lcs,
    x: DVector<f64>,
    u: &'a DVector<f64>,
}

impl<'a> Controls<'a> {
    fn of(lcs: &'a Lcs, s: &DVector<f64>, u: &'a DVector<f64>) -> Self {
        let x = &lcs.storage.inject * s + &lcs.storage.inject_one;
        Self { lcs, x, u }
    }

    fn at(&self) -> Point<'_> {
        Point {
            x: self.x.as_slice(),
            lambda: &[],
            u: self.u.as_slice(),
            du: &[],
        }
    }

    /// Whether neither currents of devices nor slopes of sources have a part in control i.
    fn known(&self, i: usize) -> bool {
        zero(&self.lcs.controls.lambda, i) && zero(&self.lcs.controls.du, i)
    }

    fn value(&self, i: usize) -> f64 {
        reading::value(&self.lcs.controls, i, self.at())
    }

    fn noise(&self, i: usize) -> f64 {
        DECISIVE * reading::magnitude(&self.lcs.controls, i, self.at())
    }
}
