//! Energies of the stages of a step as quadratic forms over w = [x | λ | u | u' | 1], and readings as sparse rows over it. Of the inputs u those
//! that vary have columns; the others are part of the last one.

use nalgebra::DMatrix;

use crate::integrate::energy::storage_map;
use crate::integrate::step::Columns;
use crate::lcs::{Lcs, PowerKind, Rows};
use crate::settings::tolerances::steps::FAINT;

/// Powers of a system and what a method loses in it; the equations stand in [`energy`](crate::integrate::energy).
#[derive(Debug)]
pub(crate) struct Forms {
    width: usize,
    /// Power from sources and into resistors and devices, W: upper triangles, row by row; empty where there is none.
    source: Vec<f64>,
    dissipated: Vec<f64>,
    /// K = [X U]ᵀ M [X U k], row by row: [dx; du]ᵀ K [x; u; 1] is sᵀ M ds.
    stored: Vec<f64>,
    n: usize,
    p: usize,
}

impl Forms {
    pub(super) fn of(lcs: &Lcs, columns: &Columns) -> Self {
        let (n, p) = (lcs.n(), columns.varying.len());
        let terms = &lcs.outputs.power;
        let (v, i) = (
            table(lcs, &lcs.outputs.power_v, columns),
            table(lcs, &lcs.outputs.power_i, columns),
        );
        let width = v.ncols();
        let form = |kind: PowerKind, sign: f64| {
            let rows: Vec<usize> = (0..terms.len())
                .filter(|&k| terms[k].kind == kind)
                .collect();
            let q = v.select_rows(&rows).tr_mul(&i.select_rows(&rows)) * sign;
            packed(&q)
        };
        let (map, mut one, metric) = storage_map(lcs);
        let states = map.columns(0, n);
        let mut moving = DMatrix::zeros(map.nrows(), n + p);
        moving.columns_mut(0, n).copy_from(&states);
        for j in 0..lcs.p() {
            match columns.varying.iter().position(|&v| v == j) {
                Some(k) => moving.set_column(n + k, &map.column(n + j)),
                None => one += map.column(n + j) * columns.constant[j],
            }
        }
        let mut with_one = DMatrix::zeros(map.nrows(), n + p + 1);
        with_one.columns_mut(0, n + p).copy_from(&moving);
        with_one.set_column(n + p, &one);
        let k = moving.tr_mul(&(metric * with_one));
        Self {
            width,
            source: form(PowerKind::Source, -1.0),
            dissipated: form(PowerKind::Dissipated, 1.0),
            stored: (k.row_iter())
                .flat_map(|row| row.iter().copied().collect::<Vec<_>>())
                .collect(),
            n,
            p,
        }
    }

    /// Length of w = [x | λ | u | u' | 1].
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// (from sources, dissipated) at w, W.
    #[inline]
    pub(super) fn power(&self, w: &[f64]) -> (f64, f64) {
        (value(&self.source, w), value(&self.dissipated, w))
    }

    /// sᵀ M ds at (x, u) for a change (dx, du), J.
    #[inline]
    pub(super) fn taken_up(&self, dx: &[f64], du: &[f64], x: &[f64], u: &[f64]) -> f64 {
        let width = self.n + self.p + 1;
        let rows = self.stored.chunks_exact(width);
        let weighted = rows.zip(dx.iter().chain(du)).map(|(row, change)| {
            if *change == 0.0 {
                return 0.0;
            }
            let (of_x, rest) = row.split_at(self.n);
            let (of_u, one) = rest.split_at(self.p);
            change * (dot(of_x, x) + dot(of_u, u) + one[0])
        });
        weighted.sum()
    }
}

/// Rows over w, without their zeros.
#[derive(Debug, Default)]
pub(crate) struct Readings {
    /// By row: where its entries begin, and the end.
    starts: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
    /// By row: V or A.
    pub(super) units: Vec<&'static str>,
    /// The ports that some row reads.
    pub(super) ports: Vec<usize>,
    /// Whether a row reads a slope of a source.
    pub(super) slopes: bool,
}

impl Readings {
    /// Of the recorded quantities.
    pub(super) fn of(lcs: &Lcs, columns: &Columns) -> Self {
        let table = table(lcs, &lcs.outputs.rows, columns);
        let units = lcs.outputs.units.clone();
        let mut found = Self {
            starts: vec![0],
            ..Self::default()
        };
        for i in 0..units.len() {
            for (j, &value) in table.row(i).iter().enumerate() {
                if value != 0.0 {
                    found.columns.push(j);
                    found.values.push(value);
                }
            }
            found.starts.push(found.columns.len());
        }
        let (n, m, p) = (lcs.n(), lcs.m(), columns.varying.len());
        let reads = |column: usize| found.columns.contains(&column);
        found.ports = (0..m).filter(|j| reads(n + j)).collect();
        found.slopes = (0..p).any(|j| reads(n + m + p + j));
        found.units = units;
        found
    }

    /// Whether no row at w is larger than a part of what it has reached; one that is small beside others of its unit is judged by these.
    pub(super) fn are_within(&self, w: &[f64], reached: &[f64], part: f64) -> bool {
        let largest = |unit: &str| {
            let same = reached.iter().zip(&self.units).filter(|(_, u)| **u == unit);
            same.fold(0.0_f64, |m, (r, _)| m.max(*r))
        };
        let (volts, amperes) = (largest("V"), largest("A"));
        (0..self.units.len()).all(|i| {
            let of_unit = if self.units[i] == "V" { volts } else { amperes };
            self.value(i, w).abs() <= part * reached[i].max(FAINT * of_unit)
        })
    }

    /// Row i at w.
    #[inline]
    pub(super) fn value(&self, i: usize, w: &[f64]) -> f64 {
        let range = self.starts[i]..self.starts[i + 1];
        let entries = self.columns[range.clone()].iter().zip(&self.values[range]);
        entries.map(|(&j, value)| value * w[j]).sum()
    }
}

/// Rows as a dense table over w; blocks without columns count as zero.
fn table(lcs: &Lcs, rows: &Rows, columns: &Columns) -> DMatrix<f64> {
    let (n, m, p) = (lcs.n(), lcs.m(), columns.varying.len());
    let count = rows.one.len();
    let mut table = DMatrix::zeros(count, n + m + 2 * p + 1);
    for (block, at, width) in [(&rows.x, 0, n), (&rows.lambda, n, m)] {
        if block.nrows() == count && block.ncols() == width {
            table.columns_mut(at, width).copy_from(block);
        }
    }
    let mut one = rows.one.clone();
    for (block, at) in [(&rows.u, n + m), (&rows.du, n + m + p)] {
        if block.nrows() != count || block.ncols() != lcs.p() {
            continue;
        }
        for (k, &j) in columns.varying.iter().enumerate() {
            table.set_column(at + k, &block.column(j));
        }
    }
    if rows.u.nrows() == count {
        for j in (0..rows.u.ncols()).filter(|j| !columns.varying.contains(j)) {
            one += rows.u.column(j) * columns.constant[j];
        }
    }
    table.set_column(n + m + 2 * p, &one);
    table
}

/// The upper triangle of Q + Qᵀ, the diagonal of Q.
fn packed(q: &DMatrix<f64>) -> Vec<f64> {
    if q.is_empty() || q.amax() == 0.0 {
        return Vec::new();
    }
    let mut packed = Vec::with_capacity(q.nrows() * (q.nrows() + 1) / 2);
    for i in 0..q.nrows() {
        packed.push(q[(i, i)]);
        packed.extend((i + 1..q.nrows()).map(|j| q[(i, j)] + q[(j, i)]));
    }
    packed
}

#[inline]
fn value(packed: &[f64], w: &[f64]) -> f64 {
    let mut rest = packed;
    let mut sum = 0.0;
    for i in 0..w.len() {
        if rest.is_empty() {
            break;
        }
        let (row, tail) = rest.split_at(w.len() - i);
        sum += w[i] * dot(row, &w[i..]);
        rest = tail;
    }
    sum
}

#[inline]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
