//! Energy along a mode: ∫ v·i dt of sources and of what dissipates, exactly.
//!
//! Power is Σ (v·w)(i·w) with rows v, i over w. Where a row has large entries that nearly cancel along the solution (an
//! amplifier's inputs, a node behind a small resistance), a quadratic form of w would lose the square of that factor. So the
//! forms are taken over y = T w, where T comes from the pivoted QR factorisation of the rows themselves: what the rows see
//! is then a coordinate and no difference.

use nalgebra::DMatrix;

use crate::linalg::dense::Dense;
use crate::linalg::expm;
use crate::linalg::gauss::{NODES, POINTS, WEIGHTS};
use crate::linalg::gramian::Gramians;
use crate::linalg::kernel::Kernel;
use crate::linalg::powers::{halved, two_to};
use crate::linalg::quadratic::Quadratics;
use crate::linalg::refill::raise;
use crate::linalg::series::Series;
use crate::linalg::whole::transposed;
use crate::settings::tolerances::exponentials::{
    HARMLESS_POWER, OUTGROWN, POWER_ROW, SMALLEST_AMPLITUDE,
};

/// Matrices that the forms need besides those over steps.
const OF_FORMS: usize = 16;

/// How large things are in a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sizes<'a> {
    /// |w|.
    pub(crate) amplitude: &'a [f64],
    /// Energy of the run over its duration, W; zero where not known.
    pub(crate) power: f64,
}

/// One product of a voltage and a current.
#[derive(Debug, Clone)]
pub(crate) struct Term {
    /// v over w, the entries that are not zero.
    pub(crate) v: Vec<(usize, f64)>,
    /// i over w.
    pub(crate) i: Vec<(usize, f64)>,
    /// Counts as delivered by a source (with the opposite sign) rather than as dissipated.
    pub(crate) source: bool,
}

/// What a run goes along in one step, besides Taylor's series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stretch {
    /// A step of the table: h/2^level.
    Table(u32),
    /// A span that recurs, by its place.
    Span(usize),
}

/// Energy from sources and energy dissipated along w' = 𝒜 w.
#[derive(Debug, Clone)]
pub(crate) struct EnergyIntegral {
    terms: Vec<Term>,
    /// The states that are coupled with none but each other.
    fast: Vec<usize>,
    /// The components of w that they see.
    seen: Vec<usize>,
    /// For each of these where its entries end, of the v and i of all terms in turn: (which, entry).
    ends: Vec<usize>,
    factors: Vec<(usize, f64)>,
    /// Their values at the points of a quadrature.
    at_nodes: Vec<f64>,
    /// ‖𝒜‖ is that of the mode; unit of time: h/2^bottom, s.
    unit: f64,
    bottom: u32,
    forms: Option<Forms>,
}

/// The forms over y = T w, made when first needed.
#[derive(Debug, Clone)]
struct Forms {
    to_y: Kernel,
    /// y, with zeros behind it.
    y: Vec<f64>,
    /// The amplitudes they were made for, the largest so far.
    amplitude: Vec<f64>,
    /// The integrals of power out of sources and power dissipated over 2^k units.
    over: Vec<Quadratics>,
    /// The same over spans that recur, by place, made when first needed.
    spans: Vec<Option<Quadratics>>,
    /// 𝒜 and the powers (out of sources, dissipated) over y.
    generator: DMatrix<f64>,
    powers: [Dense; 2],
    /// Where `over` ends.
    latest: Gramians,
}

impl EnergyIntegral {
    /// For a mode whose table of steps ends at h/2^`bottom`. `None` where nothing takes or gives power.
    pub(crate) fn new(terms: Vec<Term>, fast: &[usize], h: f64, bottom: u32) -> Option<Self> {
        let terms: Vec<Term> = terms
            .into_iter()
            .filter(|t| !t.v.is_empty() && !t.i.is_empty())
            .collect();
        terms.first()?;
        let rows = terms.iter().flat_map(|term| [&term.v, &term.i]);
        let mut entries: Vec<(usize, usize, f64)> = (rows.enumerate())
            .flat_map(|(which, row)| row.iter().map(move |&(j, x)| (j, which, x)))
            .collect();
        entries.sort_unstable_by_key(|&(j, which, _)| (j, which));
        let (mut seen, mut ends) = (Vec::new(), Vec::new());
        for (k, (j, ..)) in entries.iter().enumerate() {
            if seen.last() != Some(j) {
                seen.push(*j);
                ends.push(k);
            }
            if let Some(end) = ends.last_mut() {
                *end = k + 1;
            }
        }
        Some(Self {
            factors: entries
                .into_iter()
                .map(|(_, which, x)| (which, x))
                .collect(),
            ends,
            seen,
            at_nodes: Vec::new(),
            fast: fast.to_vec(),
            terms,
            unit: halved(h, bottom),
            bottom,
            forms: None,
        })
    }

    /// Matrices of the size of w that are kept.
    pub(crate) fn kept(&self) -> usize {
        let forms = self.forms.as_ref();
        forms.map_or(0, |forms| forms.over.len() + forms.spans.len() + OF_FORMS)
    }

    /// Gives up the forms: they are made again when asked for.
    pub(crate) fn forget(&mut self) {
        self.forms = None;
    }

    /// The integrals over steps and spans in which things are so large.
    pub(crate) fn integrals(
        &mut self,
        generator: &DMatrix<f64>,
        sizes: Sizes<'_>,
    ) -> Integrals<'_> {
        let (terms, fast) = (&self.terms, &self.fast);
        let (unit, bottom) = (self.unit, self.bottom);
        let outgrown = self
            .forms
            .take_if(|forms| forms.are_outgrown(sizes.amplitude));
        let forms = self.forms.get_or_insert_with(|| {
            // What was large comes back: stretches that take turns share their forms.
            let mut amplitude = sizes.amplitude.to_vec();
            if let Some(forms) = outgrown {
                raise(&mut amplitude, &forms.amplitude);
            }
            let power = sizes.power;
            Forms::new(terms, fast, generator, (amplitude, power), (unit, bottom))
        });
        Integrals {
            forms,
            fast,
            bottom,
        }
    }

    /// Σ v·i at w (from sources, dissipated), W.
    pub(crate) fn power(&self, w: &[f64]) -> [f64; 2] {
        let mut power = [0.0; 2];
        for term in &self.terms {
            let [v, i] = [&term.v, &term.i].map(|row| {
                row.iter()
                    .fold(0.0, |sum, (j, factor)| sum + factor * w[*j])
            });
            power[usize::from(!term.source)] += v * i;
        }
        [-power[0], power[1]]
    }

    /// ∫ v·i dt along the first `t` seconds of a Taylor series, `part` of its step.
    pub(crate) fn along_series(&mut self, series: &Series, part: f64, t: f64) -> [f64; 2] {
        let s = NODES.map(|node| node * part);
        self.at_nodes.clear();
        self.at_nodes.resize(POINTS * 2 * self.terms.len(), 0.0);
        let (values, _) = self.at_nodes.as_chunks_mut::<POINTS>();
        let mut begin = 0;
        for (&j, &end) in self.seen.iter().zip(&self.ends) {
            // w_j at the nodes, then its part of the factors.
            let w = series.component(j, s);
            for (which, factor) in &self.factors[begin..end] {
                let value = &mut values[*which];
                for p in 0..POINTS {
                    value[p] += factor * w[p];
                }
            }
            begin = end;
        }
        let mut energy = [0.0; 2];
        let (pairs, _) = values.as_chunks::<2>();
        for (term, [v, i]) in self.terms.iter().zip(pairs) {
            let power = (0..POINTS).map(|p| WEIGHTS[p] * v[p] * i[p]);
            energy[usize::from(!term.source)] += power.sum::<f64>();
        }
        [-t * energy[0], t * energy[1]]
    }
}

/// An amplitude as a unit: one where there was nothing.
fn sized(amplitude: f64) -> f64 {
    if amplitude > 0.0 { amplitude } else { 1.0 }
}

/// See [`EnergyIntegral::integrals`].
pub(crate) struct Integrals<'a> {
    forms: &'a mut Forms,
    fast: &'a [usize],
    bottom: u32,
}

impl Integrals<'_> {
    /// (from sources, dissipated) from w along a stretch, J; a span at a place is `time` seconds long.
    #[inline]
    pub(crate) fn along(
        &mut self,
        stretch: Stretch,
        time: impl Fn(usize) -> f64,
        w: &[f64],
    ) -> [f64; 2] {
        let forms = &mut *self.forms;
        let form = match stretch {
            Stretch::Table(level) => {
                let k = (self.bottom - level) as usize;
                if forms.over.len() <= k {
                    forms.double_to(k, self.fast);
                }
                &forms.over[k]
            }
            Stretch::Span(place) => {
                if forms.spans.get(place).is_none_or(Option::is_none) {
                    forms.take_span(place, time(place), self.fast);
                }
                match &forms.spans[place] {
                    Some(form) => form,
                    None => return [f64::NAN; 2],
                }
            }
        };
        // In whole blocks: fetched as they were put, and zeros behind the last.
        forms.to_y.apply_first(forms.y.len(), w, &mut forms.y);
        form.at(&forms.y)
    }
}

impl Forms {
    #[cold]
    #[inline(never)]
    fn new(
        terms: &[Term],
        fast: &[usize],
        generator: &DMatrix<f64>,
        (amplitude, power): (Vec<f64>, f64),
        (unit, bottom): (f64, u32),
    ) -> Self {
        let dim = generator.nrows();
        // At the start of a long chain amplitudes are so small that their products vanish.
        let least = SMALLEST_AMPLITUDE * amplitude.iter().fold(0.0, |m: f64, a| m.max(*a));
        let size: Vec<f64> = amplitude.iter().map(|&a| sized(a).max(least)).collect();
        // Voltages and currents in the sizes that w takes, of one magnitude each.
        let count = 2 * terms.len();
        let mut rows = DMatrix::zeros(count, dim);
        for (k, term) in terms.iter().enumerate() {
            let norm = |row: &[(usize, f64)]| {
                let sizes = row.iter().map(|&(j, r)| (r * size[j]).abs());
                sizes.sum::<f64>()
            };
            let alpha = (norm(&term.i) / norm(&term.v)).sqrt();
            for &(j, v) in &term.v {
                rows[(2 * k, j)] = alpha * v * size[j];
            }
            for &(j, i) in &term.i {
                rows[(2 * k + 1, j)] = i / alpha * size[j];
            }
        }
        // Where rounding does no harm the coordinates stay those of w, in which the flow of a graded circuit is accurate.
        let least = (power > 0.0).then(|| (HARMLESS_POWER * power / f64::EPSILON).sqrt());
        let (mut to_y, mut from_y) = (DMatrix::zeros(dim, dim), DMatrix::zeros(dim, dim));
        let slow: Vec<usize> = (0..dim).filter(|j| !fast.contains(j)).collect();
        let parts = [&slow[..], fast].into_iter();
        for part in parts.filter(|part| !part.is_empty()) {
            let (to, from) = coordinates(&rows.select_columns(part), least);
            for (i, &row) in part.iter().enumerate() {
                for (j, &column) in part.iter().enumerate() {
                    (to_y[(row, column)], from_y[(row, column)]) = (to[(i, j)], from[(i, j)]);
                }
            }
        }
        let mut seen = rows * &from_y;
        for (j, &size) in size.iter().enumerate() {
            to_y.column_mut(j).unscale_mut(size);
            from_y.row_mut(j).scale_mut(size);
        }
        let moved = &to_y * generator * from_y;
        let d = expm::balance(&moved, unit);
        for (j, &d) in d.iter().enumerate() {
            to_y.row_mut(j).unscale_mut(d);
            seen.column_mut(j).scale_mut(d);
        }
        let moved = DMatrix::from_fn(dim, dim, |i, j| moved[(i, j)] * d[j] / d[i]);
        let mut powers = [DMatrix::zeros(dim, dim), DMatrix::zeros(dim, dim)];
        for (k, term) in terms.iter().enumerate() {
            let (v, i) = (seen.row(2 * k), seen.row(2 * k + 1));
            let sign = if term.source { -0.5 } else { 0.5 };
            let power = &mut powers[usize::from(!term.source)];
            for column in 0..dim {
                for row in 0..dim {
                    power[(row, column)] += sign * i[column] * v[row];
                    power[(row, column)] += sign * v[column] * i[row];
                }
            }
        }
        let powers = powers.each_ref().map(Dense::of);
        let latest = Gramians::new(
            (&moved, fast),
            &powers,
            unit * two_to(bottom as i32),
            bottom,
        );
        Self {
            to_y: Kernel::new(&to_y),
            y: vec![0.0; Quadratics::padded(dim)],
            amplitude,
            over: vec![latest.forms()],
            spans: Vec::new(),
            generator: moved,
            powers,
            latest,
        }
    }

    /// Whether they were made for amplitudes at the start of a run that say nothing of what came: T may mix what is apart.
    fn are_outgrown(&self, amplitude: &[f64]) -> bool {
        let mut pairs = self.amplitude.iter().zip(amplitude);
        pairs.any(|(then, now)| *now > OUTGROWN * sized(*then))
    }

    /// Has the integrals up to 2^k units.
    #[cold]
    fn double_to(&mut self, k: usize, fast: &[usize]) {
        while self.over.len() <= k {
            self.latest.double((&self.generator, fast));
            self.over.push(self.latest.forms());
        }
    }

    /// Has that over the span at a place, so many seconds long.
    #[cold]
    fn take_span(&mut self, place: usize, time: f64, fast: &[usize]) {
        if self.spans.len() <= place {
            self.spans.resize(place + 1, None);
        }
        let span = Gramians::new((&self.generator, fast), &self.powers, time, 0);
        self.spans[place] = Some(span.forms());
    }
}

/// T and T⁻¹ for these rows over amplitudes: triangular factors of unit diagonal in the order of their pivots, the unit vector where
/// a pivot is below `least` (rounding of the largest if that is not known).
fn coordinates(rows: &DMatrix<f64>, least: Option<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let dim = rows.ncols();
    let filled = rows.clone().resize_vertically(rows.nrows().max(dim), 0.0);
    let qr = filled.col_piv_qr();
    let mut triangle = qr.r();
    let one = DMatrix::identity(dim, dim);
    let mut order = one.clone();
    qr.p().permute_columns(&mut order);
    // What is rounding of a column couples nothing: sizes that were taken at the start of a run may be far from what comes.
    for mut column in triangle.column_iter_mut() {
        let rounding = dim as f64 * f64::EPSILON * column.norm();
        column.apply(|r| *r = if r.abs() <= rounding { 0.0 } else { *r });
    }
    // Unit rows: the coordinates are scaled by the caller.
    for j in 0..dim {
        let least = least.unwrap_or_else(|| POWER_ROW * triangle[(0, 0)].abs());
        let pivot = triangle[(j, j)];
        let mut row = triangle.row_mut(j);
        if pivot.abs() > least {
            row /= pivot;
        } else {
            row.fill(0.0);
            row[j] = 1.0;
        }
    }
    let back = triangle.solve_upper_triangular(&one).unwrap_or(one);
    (&triangle * transposed(&order), order * back)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::kernel::SparseKernel;

    fn sizes(amplitude: &[f64]) -> Sizes<'_> {
        Sizes {
            amplitude,
            power: 0.0,
        }
    }

    fn over(integrals: &mut Integrals<'_>, level: u32, w: &[f64]) -> [f64; 2] {
        integrals.along(Stretch::Table(level), |_| 0.0, w)
    }

    fn term(v: &[f64], i: &[f64], source: bool) -> Term {
        Term {
            v: entries(v),
            i: entries(i),
            source,
        }
    }

    fn entries(row: &[f64]) -> Vec<(usize, f64)> {
        let entries = row.iter().copied().enumerate();
        entries.filter(|(_, x)| *x != 0.0).collect()
    }

    /// x' = −x/τ: ∫₀ʰ x² dt = x₀² τ/2 (1 − e^{−2h/τ}).
    #[test]
    fn both_integrals_of_a_decay() {
        let tau = 2e-3;
        let a = DMatrix::from_element(1, 1, -1.0 / tau);
        let exact = |h: f64| -9.0 * tau / 2.0 * (-2.0 * h / tau).exp_m1();
        let h = 1.5e-3;
        let terms = vec![term(&[1.0], &[1.0], true), term(&[2.0], &[1.0], false)];
        let mut work = EnergyIntegral::new(terms, &[], 32.0 * h, 5).unwrap();
        for k in 0..6 {
            let [source, dissipated] = over(&mut work.integrals(&a, sizes(&[3.0])), 5 - k, &[3.0]);
            let expected = exact(h * f64::from(1 << k));
            assert!((source / expected + 1.0).abs() < 1e-15, "{k}");
            assert!((dissipated / expected - 2.0).abs() < 1e-15, "{k}");
        }
        for (dt, part) in [
            (h, 0.4),
            (h, 1.0),
            (0.2 * h, 1.0),
            (0.02 * h, 1.0),
            (2e-4 * h, 0.7),
        ] {
            let mut series = Series::default();
            series.expand(&SparseKernel::new(&a), &[3.0], dt);
            let (degree, t) = (series.degree(), part * dt);
            let [source, dissipated] = work.along_series(&series, part, t);
            assert!((source / exact(t) + 1.0).abs() < 1e-14, "{degree}");
            assert!((dissipated / exact(t) - 2.0).abs() < 1e-14, "{degree}");
        }
    }

    /// What a source does in its edge is large there and nothing between two edges.
    #[test]
    fn stretches_that_take_turns_share_their_forms() {
        let a = DMatrix::from_row_slice(2, 2, &[-1.0, 1.0, 0.0, -2.0]);
        let terms = vec![term(&[1.0, 0.0], &[0.0, 1.0], true)];
        let mut work = EnergyIntegral::new(terms, &[], 1.0, 5).unwrap();
        let (edge, rest) = ([1e-4, 1e8], [1.0, 0.0]);
        let found = [&edge, &rest].map(|w| over(&mut work.integrals(&a, sizes(w)), 5, w));
        let made = [&edge, &rest].map(|w| {
            let mut integrals = work.integrals(&a, sizes(w));
            let (made, again) = (integrals.forms.over.len(), over(&mut integrals, 2, w));
            assert!(again[0].is_finite());
            made
        });
        assert_eq!(made, [1, 4]);
        let again = [&edge, &rest].map(|w| over(&mut work.integrals(&a, sizes(w)), 5, w));
        for (found, again) in found.iter().zip(&again) {
            assert!((found[0] - again[0]).abs() <= 1e-14 * found[0].abs());
        }
    }

    /// An amplifier: x₂ follows −10⁶ x₁ within 10⁻⁹ s, and v = x₂ + 10⁶ x₁ is the small difference that drives it.
    #[test]
    fn differences_of_large_rows_are_exact() {
        let (gain, fast, slow) = (1e6, 1e9, 1.0);
        // x₁' = −slow x₁, v' = −fast v + …: in x₂ = v − gain x₁.
        let a = DMatrix::from_row_slice(2, 2, &[-slow, 0.0, gain * (slow - fast), -fast]);
        let terms = vec![term(&[gain, 1.0], &[gain, 1.0], false)];
        let mut work = EnergyIntegral::new(terms, &[], 1e-3, 20).unwrap();
        // v = x₂ + gain x₁ obeys v' = −fast v exactly: ∫ v² = v₀²/(2 fast).
        let w = [1.0, 1e-3 - gain];
        let v = w[1] + gain;
        let [_, found] = over(&mut work.integrals(&a, sizes(&[1.0, gain])), 0, &w);
        assert!(
            (found / (v * v / (2.0 * fast)) - 1.0).abs() < 1e-6,
            "{found}"
        );
        // The explicit form over w would be off by gain²·ε·1e-3 s ≫ v²/fast.
    }

    /// x₂' = x₁ at rest so far, of which nothing but rounding has been seen: x₂ = t, ∫ x₂² dt = t³/3.
    #[test]
    fn an_amplitude_that_was_next_to_nothing_spoils_no_energy() {
        let a = DMatrix::from_row_slice(2, 2, &[0.0, 0.0, 1.0, 0.0]);
        for amplitude in [1.0, 1e-150, 1e-200, 1e-310] {
            let terms = vec![term(&[0.0, 1.0], &[0.0, 1.0], false)];
            let mut work = EnergyIntegral::new(terms, &[], 1.0, 5).unwrap();
            let amplitudes = [1.0, amplitude];
            let mut integrals = work.integrals(&a, sizes(&amplitudes));
            let [_, found] = over(&mut integrals, 0, &[1.0, 0.0]);
            assert!((3.0 * found - 1.0).abs() < 1e-14, "{amplitude:e}: {found}");
        }
    }
}
