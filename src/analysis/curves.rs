//! The outputs of a run that is exact throughout, as smooth pieces that measurements see.

use nalgebra::DVector;

use super::variation::{Course, Linear, Motion, halvings};
use crate::integrate::Error;
use crate::measure::{Curves, INTERVALS};

/// Halvings of a piece that lead from one of its values to the next.
const LEVELS: u32 = INTERVALS.ilog2();

/// Pieces of these outputs from a time on, of at most so many values; `None` where that takes more.
///
/// Their lengths are halvings of one span, so that few exponentials of a mode are needed whatever happens in it. The last step of a stretch ends beyond it.
///
/// # Errors
/// An exponential does not exist in doubles.
pub(super) fn curves(
    course: &Course,
    outputs: &[usize],
    from: f64,
    most: usize,
) -> Result<Option<Curves>, Error> {
    let columns = outputs.len();
    let seen = course.stretches.iter().filter(|stretch| stretch.to > from);
    let longest = seen.clone().map(|s| s.to - s.from).fold(0.0, f64::max);
    let unit = longest.log2().ceil().exp2();
    let (mut known, mut starts) = (Vec::new(), Vec::new());
    for stretch in seen.clone() {
        starts.push(Linear::of(&mut known, &course.systems, stretch));
    }
    let mut motions: Vec<Motion<'_>> = known.iter().map(|linear| linear.over(unit)).collect();
    let mut found = Curves::of(columns);
    let room = most / (columns * (INTERVALS + 1)).max(1);
    for (stretch, (at, mut w)) in seen.zip(starts) {
        let (length, mut age) = (stretch.to - stretch.from, (from - stretch.from).max(0.0));
        if age > 0.0 {
            w = known[at].over(age).after(0, &w)?;
        }
        let motion = &mut motions[at];
        while age < length {
            if found.len() >= room {
                return Ok(None);
            }
            let left = length - age;
            let level = halvings(&motion.linear.spectrum, unit, (age, left));
            let step = motion.part(level);
            let mut values = vec![[0.0; INTERVALS + 1]; columns];
            for k in 0..=INTERVALS {
                if k > 0 {
                    w = motion.after(level + LEVELS, &w)?;
                }
                let row: DVector<f64> = &motion.linear.rows[0] * &w;
                for (values, output) in values.iter_mut().zip(outputs) {
                    values[k] = row[*output];
                }
            }
            let until = (left / step).min(1.0);
            found.push((stretch.from + age, step, until), &values);
            age += step;
        }
    }
    for leap in course.leaps.iter().filter(|leap| leap.t >= from) {
        found.impulse(leap.t, outputs.iter().map(|k| leap.areas[*k]).collect());
    }
    Ok(Some(found))
}
