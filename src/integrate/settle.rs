//! Switches that drive switches: a position settles before anything flows.
//!
//! Where one switch drives another through a resistor, the position right after the first has moved is none that the circuit
//! stays in, and a current that has a path in the position at the end need not have one on the way. So controls fix the position
//! first, and only then does the state jump into it.

use nalgebra::{DMatrix, DVector};

use crate::integrate::reading::{self, Point};
use crate::integrate::run::SimError;
use crate::integrate::switching::{Threshold, fire};
use crate::lcs::Lcs;

/// A control beyond its threshold by less than this part of its terms decides nothing here, and storage that moves by less than
/// this part of its energy's square root stays.
const DECISIVE: f64 = 1e-9;

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
    mut asking: impl FnMut(&[bool]) -> Result<Vec<usize>, SimError>,
) -> Result<bool, SimError> {
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
    let x = &storage.inject * s + &storage.inject_one;
    let change = &storage.x * &x + &storage.u * u + &storage.one - s;
    let energy = |s: &DVector<f64>| s.dot(&(&storage.metric * s));
    let keeps = energy(&change) <= DECISIVE * DECISIVE * energy(s);
    let rows = &lcs.controls;
    let zero = |block: &DMatrix<f64>, i: usize| {
        i >= block.nrows() || block.row(i).iter().all(|v| *v == 0.0)
    };
    let at = Point {
        x: x.as_slice(),
        lambda: &[],
        u: u.as_slice(),
        du: &[],
    };
    let asks = |&i: &usize| {
        let decided = zero(&rows.lambda, i) && zero(&rows.du, i) && (keeps || zero(&rows.x, i));
        let noise = || DECISIVE * reading::magnitude(rows, i, at);
        let excess = || thresholds[i].excess(position[i], reading::value(rows, i, at));
        decided && thresholds[i].latch.is_none() && excess() > noise()
    };
    (0..position.len()).filter(asks).collect()
}
