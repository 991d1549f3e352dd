//! The guards of a mode, as rows over its w = [x; z].

use nalgebra::DMatrix;

use super::SwitchFacts;
use crate::integrate::exact::exosystem::Exosystem;
use crate::integrate::exact::key::Key;
use crate::lcs::{Lcs, Rows};
use crate::linalg::rays;
use crate::linalg::whole::{magnitudes, sizes};
use crate::settings::tolerances::exponentials::EQUAL;

/// Rows over [x | u | u' | 1] as rows over w, with u = H z and u' = H S z.
pub(crate) fn over_w(rows: &Rows, n: usize, exosystem: &Exosystem) -> DMatrix<f64> {
    let rates = || exosystem.output() * exosystem.generator();
    over(rows, n, exosystem.output(), rates)
}

/// What the entries of [`over_w`] were summed from: of sources that add up to nothing the rounding of each is left.
pub(super) fn sizes_over_w(rows: &Rows, n: usize, exosystem: &Exosystem) -> DMatrix<f64> {
    let h = magnitudes(exosystem.output());
    let rates = || &h * magnitudes(exosystem.generator());
    let rows = Rows {
        x: magnitudes(&rows.x),
        lambda: DMatrix::default(),
        u: magnitudes(&rows.u),
        du: magnitudes(&rows.du),
        one: sizes(&rows.one),
    };
    over(&rows, n, &h, rates)
}

/// The same with this H, and H S where it is asked for.
fn over(
    rows: &Rows,
    n: usize,
    h: &DMatrix<f64>,
    rates: impl FnOnce() -> DMatrix<f64>,
) -> DMatrix<f64> {
    let count = rows.one.len();
    let mut out = DMatrix::zeros(count, n + h.ncols());
    if rows.x.nrows() == count && rows.x.ncols() == n {
        out.columns_mut(0, n).copy_from(&rows.x);
    }
    let mut z = out.columns_mut(n, h.ncols());
    if rows.u.nrows() == count && rows.u.ncols() == h.nrows() {
        z += &rows.u * h;
    }
    let moves = rows.du.iter().any(|du| *du != 0.0);
    if moves && rows.du.nrows() == count && rows.du.ncols() == h.nrows() {
        z += &rows.du * rates();
    }
    for i in 0..count {
        out[(i, n)] += rows.one[i];
    }
    out
}

/// The guards of a mode.
pub(super) struct Guards {
    pub(super) rows: DMatrix<f64>,
    /// What their entries were summed from.
    pub(super) sizes: DMatrix<f64>,
    /// See [`Mode::guarded_switches`].
    pub(super) switches: Vec<usize>,
    pub(super) controlled_by_sources: Vec<bool>,
}

impl Guards {
    /// Those of devices, and below them those of switches.
    pub(super) fn of_switches(
        (devices, device_sizes): (DMatrix<f64>, DMatrix<f64>),
        key: &Key,
        lcs: &Lcs,
        exosystem: &Exosystem,
        facts: &SwitchFacts<'_>,
    ) -> Option<Self> {
        let SwitchFacts {
            thresholds,
            limits,
            clocks,
        } = *facts;
        let (n, slides) = (lcs.n(), key.sliding_switches());
        let dim = n + exosystem.dim();
        let published: Vec<usize> = (0..thresholds.len())
            .filter(|i| !slides.contains(i))
            .collect();
        let mut controls = DMatrix::zeros(thresholds.len(), dim);
        let mut control_sizes = controls.clone();
        for (all, rows) in [
            (&mut controls, over_w(&lcs.controls, n, exosystem)),
            (
                &mut control_sizes,
                sizes_over_w(&lcs.controls, n, exosystem),
            ),
        ] {
            for (k, row) in rows.row_iter().enumerate() {
                all.set_row(published[k], &row);
            }
        }
        let clocked = |i: usize| clocks.iter().any(|clock| clock.switch == i);
        let guarded = |i: &usize| {
            let threshold = &thresholds[*i];
            match threshold.latch {
                None => !clocked(*i),
                // Without a holding current the valve's guard is that of its current.
                Some(_) => {
                    threshold.off_below > 0.0 && threshold.holds(key.switches[*i], &key.switches)
                }
            }
        };
        let guarded_switches: Vec<usize> = published.iter().copied().filter(guarded).collect();
        let mut guards = DMatrix::zeros(
            devices.nrows() + guarded_switches.len() + 2 * slides.len(),
            dim,
        );
        let mut sizes = guards.clone();
        guards.rows_mut(0, devices.nrows()).copy_from(&devices);
        sizes.rows_mut(0, devices.nrows()).copy_from(&device_sizes);
        for (k, &i) in guarded_switches.iter().enumerate() {
            let (sign, level) = if key.switches[i] {
                (1.0, thresholds[i].off_below)
            } else {
                (-1.0, thresholds[i].on_above)
            };
            let mut row = guards.row_mut(devices.nrows() + k);
            row += controls.row(i) * sign;
            row[n] -= sign * level;
            let mut row = sizes.row_mut(devices.nrows() + k);
            row += control_sizes.row(i);
            row[n] += level.abs();
        }
        let after = devices.nrows() + guarded_switches.len();
        for (k, &(switch, positive)) in key.sliding.iter().enumerate() {
            // Between on and off: v − Ron i ≥ 0 and i − v/Roff ≥ 0, or both ≤ 0.
            let term = lcs
                .outputs
                .power
                .iter()
                .position(|p| p.element == thresholds[switch].name)?;
            let v = over_w(&lcs.outputs.power_v, n, exosystem)
                .row(term)
                .into_owned();
            let i = over_w(&lcs.outputs.power_i, n, exosystem)
                .row(term)
                .into_owned();
            let sign = if positive { 1.0 } else { -1.0 };
            let (ron, goff) = limits[k];
            guards.set_row(after + 2 * k, &((&v - &i * ron) * sign));
            guards.set_row(after + 2 * k + 1, &((&i - &v * goff) * sign));
        }
        sizes
            .rows_mut(after, 2 * slides.len())
            .copy_from(&magnitudes(
                &guards.rows(after, 2 * slides.len()).into_owned(),
            ));
        let by_sources = |&i: &usize| controls.row(i).columns(0, n).iter().all(|v| *v == 0.0);
        Some(Self {
            rows: guards,
            sizes,
            controlled_by_sources: guarded_switches.iter().map(by_sources).collect(),
            switches: guarded_switches,
        })
    }
}

/// The pairs that share currents or voltages in a proportion that this kernel leaves open, guards for the sums of which the `held` are that are certain, and
/// the first pair of each.
pub(super) fn guards_of_sums(
    kernel: &DMatrix<f64>,
    held: DMatrix<f64>,
) -> Option<(Vec<usize>, DMatrix<f64>, Vec<usize>)> {
    let in_kernel = |&pair: &usize| kernel.row(pair).iter().any(|v| *v != 0.0);
    let shared = (0..kernel.nrows()).filter(in_kernel).collect();
    let rays = rays::extreme_rays(kernel)?;
    let devices = &rays * held;
    let kept = distinct(&devices);
    let first = |&ray: &usize| rays.row(ray).iter().position(|r| *r != 0.0);
    let first = kept.iter().map(|ray| first(ray).unwrap_or(0)).collect();
    Some((shared, devices.select_rows(&kept), first))
}

/// The rows that are no positive multiple of an earlier one: equal guards fall together.
pub(super) fn distinct(rows: &DMatrix<f64>) -> Vec<usize> {
    let mut kept: Vec<(usize, f64)> = Vec::new();
    for i in 0..rows.nrows() {
        let size = rows.row(i).amax();
        let same = |&(j, other): &(usize, f64)| {
            rows.row(i).iter().zip(rows.row(j).iter()).all(|(a, b)| {
                let (a, b) = (a / size, b / other);
                (a - b).abs() <= EQUAL * a.abs().max(b.abs())
            })
        };
        if size > 0.0 && !kept.iter().any(same) {
            kept.push((i, size));
        }
    }
    kept.into_iter().map(|(i, _)| i).collect()
}
