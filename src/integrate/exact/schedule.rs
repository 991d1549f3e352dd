//! Switches that sources alone control: their times are known beforehand.

use nalgebra::DMatrix;

use crate::circuit::Source;
use crate::circuit::source::crossings;
use crate::integrate::switching::Threshold;
use crate::lcs::Lcs;

/// Whether a switch's control is a combination of sources alone.
pub(super) fn is_driven(lcs: &Lcs, i: usize) -> bool {
    let rows = &lcs.controls;
    let zero = |m: &DMatrix<f64>| i >= m.nrows() || m.row(i).iter().all(|v| *v == 0.0);
    zero(&rows.x) && zero(&rows.lambda) && zero(&rows.du)
}

/// When source-driven switches move, in order of time.
pub(super) fn schedule(
    lcs: &Lcs,
    thresholds: &[Threshold],
    driven: &[bool],
    sources: &[Source],
    position: &[bool],
    t: f64,
    until: f64,
) -> Vec<(f64, usize, bool)> {
    let mut all = Vec::new();
    for i in (0..thresholds.len()).filter(|&i| driven[i]) {
        let gains: Vec<(f64, &Source)> = sources
            .iter()
            .enumerate()
            .map(|(j, source)| (lcs.controls.u[(i, j)], source))
            .filter(|(gain, _)| *gain != 0.0)
            .collect();
        let constant = lcs.controls.one[i];
        let threshold = &thresholds[i];
        let passages = |level: f64, rising: bool| {
            crossings(&gains, constant, level, t, until)
                .into_iter()
                .filter(move |c| c.rising == rising)
                .map(move |c| (c.time, rising))
        };
        let mut both: Vec<(f64, bool)> = passages(threshold.on_above, true)
            .chain(passages(threshold.off_below, false))
            .collect();
        both.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut on = position[i];
        for (time, rising) in both {
            if rising != on {
                on = rising;
                all.push((time, i, on));
            }
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}
