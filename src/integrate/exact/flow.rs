//! The linear flow of one mode, w' = 𝒜 w with w = [x; z] (state and exosystem), and its guards.

mod guards;

use nalgebra::DMatrix;

use super::energy_integral::{EnergyIntegral, Sizes, Stretch, Term};
use super::map::Sizes as RowSizes;
use super::recurring::Recurring;
use super::spectrum::{Rate, Spectrum};
use crate::linalg::dense::Dense;
use crate::linalg::expm::Ladders;
use crate::linalg::kernel::{Kernel, SparseKernel};
use crate::linalg::powers::{halved, halvings, two_to};
use crate::linalg::series::Series;
use crate::settings::tolerances::exponentials::SQUARED;

/// The longest step is 2^LONG output steps.
pub(crate) const LONG: u32 = 4;

/// 2^[`LONG`] output steps, s.
pub(crate) fn longest_step(output_step: f64) -> f64 {
    output_step * two_to(LONG as i32)
}

/// Halvings of the longest step that a table may hold: steps are counted in units of the shortest, in 128 bits, and a run may take 2²⁴ of
/// the longest between two rows. A mode that is faster has no flow: over a step longer than its time constant Taylor's series is not its
/// solution.
const DEEPEST: u32 = 100 + LONG;

/// exp(𝒜 h/2^k) for the levels k that were needed, h the longest step, Taylor's series below, and guard rows with their
/// derivative. Level [`LONG`] is the output step.
///
/// Vectors are laid out as `[w | g | g']` with `g = 𝒢 w`, `g' = 𝒢 𝒜 w`; `g ≥ 0` keeps the mode.
#[derive(Debug, Clone)]
pub(crate) struct Flow {
    dim: usize,
    states: usize,
    /// States that are coupled with none but each other.
    fast: Vec<usize>,
    guards: usize,
    generator: DMatrix<f64>,
    generator_kernel: SparseKernel,
    /// |𝒜|.
    generator_sizes: SparseKernel,
    /// [𝒢; 𝒢𝒜].
    rows: SparseKernel,
    /// |[𝒢; 𝒢𝒜]|.
    row_sizes: SparseKernel,
    /// 𝒢 row by row.
    guard_rows: Vec<f64>,
    h: f64,
    bottom: u32,
    /// h/2^level.
    steps: Vec<f64>,
    ladder: Ladders,
    levels: Vec<Option<Kernel>>,
    /// How many levels there are by now.
    tabulated: usize,
    recurring: Recurring,
    /// Work space: w' at the end of a span.
    rates: Vec<f64>,
    spectrum: Spectrum,
    work: Option<EnergyIntegral>,
    sizes: RowSizes,
    /// Largest loss that an exponential reported.
    pub(crate) loss: f64,
}

impl Flow {
    /// `generator` = [[A, EH],[0, S]] with `n` rows of A first, of which `fast` are not coupled with the others, `guards` its rows over w, `output_step` in s, `sources`
    /// the rates of S. `None` if the entries are not finite or too fast for steps to be counted.
    pub(crate) fn new(
        generator: DMatrix<f64>,
        n: usize,
        fast: &[usize],
        guards: &DMatrix<f64>,
        output_step: f64,
        sources: &[Rate],
    ) -> Option<Self> {
        let h = longest_step(output_step);
        if !generator.iter().chain(guards.iter()).all(|v| v.is_finite()) {
            return None;
        }
        let dim = generator.nrows();
        let m = guards.nrows();
        let first = guards * &generator;
        let mut rows = DMatrix::zeros(2 * m, dim);
        rows.rows_mut(0, m).copy_from(guards);
        rows.rows_mut(m, m).copy_from(&first);
        let rows = SparseKernel::new(&rows);
        let ladder = Ladders::new(&generator, fast, h, SQUARED, LONG);
        let bottom = halvings(ladder.norm()).max(LONG);
        if bottom > DEEPEST {
            return None;
        }
        let spectrum = Spectrum::new(&generator.view((0, 0), (n, n)).into_owned(), sources);
        Some(Self {
            dim,
            states: n,
            fast: fast.to_vec(),
            guards: m,
            generator_kernel: SparseKernel::new(&generator),
            generator_sizes: SparseKernel::new(&generator.abs()),
            generator,
            row_sizes: rows.map(f64::abs),
            guard_rows: guards.transpose().as_slice().to_vec(),
            rows,
            h,
            bottom,
            steps: (0..=bottom).map(|level| halved(h, level)).collect(),
            ladder,
            levels: vec![None; bottom as usize + 1],
            tabulated: 0,
            recurring: Recurring::default(),
            rates: Vec::new(),
            spectrum,
            work: None,
            sizes: RowSizes::default(),
            loss: 0.0,
        })
    }

    /// Length of w.
    pub(crate) fn dim(&self) -> usize {
        self.dim
    }

    /// Length of x.
    pub(crate) fn states(&self) -> usize {
        self.states
    }

    /// The shortest step of the table, s: below the fastest time constant.
    pub(crate) fn shortest(&self) -> f64 {
        self.step(self.bottom())
    }

    /// 𝒜.
    pub(crate) fn generator(&self) -> &DMatrix<f64> {
        &self.generator
    }

    /// The deepest level K; Taylor's series converges at once over h/2^K.
    pub(crate) fn bottom(&self) -> u32 {
        self.bottom
    }

    /// h/2^level, s.
    pub(crate) fn step(&self, level: u32) -> f64 {
        self.steps[level as usize]
    }

    /// The first level from this one on whose step is at most so long, s, among those longer than the output step.
    #[inline(never)]
    pub(crate) fn level_within(&self, from: u32, longest: f64) -> Option<u32> {
        (from..LONG).find(|&level| self.step(level) <= longest)
    }

    /// See [`Spectrum::step_limit`]; without guards nothing can hide, and only growth counts.
    pub(crate) fn step_limit(&self, age: f64) -> f64 {
        if self.guards == 0 {
            self.spectrum.growth_limit()
        } else {
            self.spectrum.step_limit(age)
        }
    }

    /// `next = [w | g | g']` at h/2^level after `w`; `false` if the exponential does not exist in doubles.
    #[inline]
    pub(crate) fn leap(&mut self, level: u32, w: &[f64], next: &mut [f64]) -> bool {
        if self.levels[level as usize].is_none() && !self.tabulate(level) {
            return false;
        }
        if let Some(kernel) = &self.levels[level as usize] {
            kernel.apply(w, next);
            for (next, w) in next[..self.dim].iter_mut().zip(w) {
                *next += w;
            }
        }
        true
    }

    #[cold]
    fn tabulate(&mut self, level: u32) -> bool {
        let ladder = &mut self.ladder;
        let (Some(increment), Some(loss)) = (ladder.increment(level), ladder.loss(level)) else {
            return false;
        };
        self.loss = self.loss.max(loss);
        // exp(𝒜h) − I and below it [𝒢; 𝒢𝒜] exp(𝒜h)
        let mut column = vec![0.0; self.dim];
        let below = |j: usize, stacked: &mut [f64]| {
            let (own, guards) = stacked.split_at_mut(self.dim);
            own.copy_from_slice(increment.column(j));
            column.copy_from_slice(own);
            column[j] += 1.0;
            self.rows.apply_first(&column, guards);
        };
        let rows = self.dim + self.rows.rows();
        self.levels[level as usize] = Some(Kernel::of_columns(rows, self.dim, below));
        self.tabulated += 1;
        true
    }

    /// How many bytes the exponentials and the forms of energy that were made so far take, about.
    pub(crate) fn kept(&self) -> usize {
        let (guarded, work) = (
            self.dim + 2 * self.guards,
            self.work.as_ref().map_or(0, EnergyIntegral::kept),
        );
        let rows =
            self.tabulated * (self.dim + guarded) + (self.recurring.kept() + work) * self.dim;
        rows * self.dim * size_of::<f64>()
    }

    /// Gives them up: they are made again when asked for.
    pub(crate) fn forget(&mut self) {
        self.levels.fill(None);
        self.tabulated = 0;
        self.ladder.forget();
        self.recurring.forget();
        if let Some(work) = &mut self.work {
            work.forget();
        }
    }

    /// Whether a span of `time` seconds recurs: its place. Spans within `same` are one where the second order of what they differ by is
    /// rounding.
    #[inline]
    pub(crate) fn recurs(&mut self, time: f64, same: f64) -> Option<usize> {
        let most = f64::EPSILON.sqrt() * self.shortest();
        self.recurring.find(time, same.min(most))
    }

    /// Something happens on a span that recurs.
    pub(crate) fn refuse(&mut self, span: usize) {
        self.recurring.refuse(span);
    }

    /// As [`Self::leap`] over `time` seconds, for which the span at this place stands; returns how many seconds it is too short, `None` if
    /// its exponential does not exist in doubles. What is missing is moved along w'.
    pub(crate) fn leap_span(
        &mut self,
        span: usize,
        time: f64,
        w: &[f64],
        next: &mut [f64],
    ) -> Option<f64> {
        let off = self.go_span(span, time, w, next)?;
        self.read_guards(next);
        Some(off)
    }

    /// The same but for the guards.
    pub(crate) fn go_span(
        &mut self,
        span: usize,
        time: f64,
        w: &[f64],
        next: &mut [f64],
    ) -> Option<f64> {
        let (generator, fast, loss) = (&self.generator, &self.fast, &mut self.loss);
        let increment = self.recurring.increment(span, |time| {
            let mut ladder = Ladders::new(generator, fast, time, SQUARED, 0);
            let increment = ladder.increment(0)?;
            *loss = loss.max(ladder.loss(0)?);
            Some(Kernel::of(&increment))
        })?;
        increment.apply(w, &mut next[..self.dim]);
        for (next, w) in next[..self.dim].iter_mut().zip(w) {
            *next += w;
        }
        let off = time - self.recurring.time(span);
        if off != 0.0 {
            let mut rates = std::mem::take(&mut self.rates);
            self.rates_of(&next[..self.dim], &mut rates);
            for (next, rate) in next.iter_mut().zip(&rates) {
                *next += off * rate;
            }
            self.rates = rates;
        }
        Some(off)
    }

    /// w' at w.
    pub(crate) fn rates_of(&self, w: &[f64], rates: &mut Vec<f64>) {
        applied(&self.generator_kernel, w, rates);
    }

    /// How large the terms of w' add up to where |w| ≤ `sizes`.
    pub(crate) fn sizes_of_rates(&self, sizes: &[f64], largest: &mut Vec<f64>) {
        applied(&self.generator_sizes, sizes, largest);
    }

    /// exp(𝒜h) − I for the output step h; `None` beyond doubles.
    pub(crate) fn increment(&mut self) -> Option<Dense> {
        self.ladder.increment(LONG)
    }

    /// Has the energy of these products integrated along the flow.
    pub(crate) fn set_work(&mut self, terms: Vec<Term>) {
        self.work = EnergyIntegral::new(terms, &self.fast, self.h, self.bottom);
    }

    /// Has it known what the entries of 𝒢 and 𝒜 were summed from.
    pub(crate) fn set_sizes(&mut self, sizes: RowSizes) {
        self.sizes = sizes;
    }

    /// See [`Self::set_sizes`].
    pub(crate) fn sizes(&self) -> &RowSizes {
        &self.sizes
    }

    /// Whether there is energy to integrate.
    #[inline]
    pub(crate) fn works(&self) -> bool {
        self.work.is_some()
    }

    /// (from sources, dissipated) over steps of the table and spans that recur, each from its w, J.
    pub(crate) fn energy<'w>(
        &mut self,
        stretches: impl Iterator<Item = (Stretch, &'w [f64])>,
        sizes: Sizes<'_>,
    ) -> [f64; 2] {
        let Some(work) = &mut self.work else {
            return [0.0; 2];
        };
        let mut integrals = work.integrals(&self.generator, sizes);
        stretches.fold([0.0; 2], |[source, dissipated], (stretch, w)| {
            let over = integrals.along(stretch, |span| self.recurring.time(span), w);
            [source + over[0], dissipated + over[1]]
        })
    }

    /// (from sources, dissipated) at w, W.
    pub(crate) fn power(&self, w: &[f64]) -> [f64; 2] {
        let work = self.work.as_ref();
        work.map_or([0.0; 2], |work| work.power(w))
    }

    /// (from sources, dissipated) along the first `t` seconds of a Taylor series, `part` of its step, J.
    pub(crate) fn energy_of_series(&mut self, series: &Series, part: f64, t: f64) -> [f64; 2] {
        let work = self.work.as_mut();
        work.map_or([0.0; 2], |work| work.along_series(series, part, t))
    }

    /// Taylor's series for `dt` ≤ h/2^K from w on.
    pub(crate) fn expand(&self, series: &mut Series, w: &[f64], dt: f64) {
        series.expand(&self.generator_kernel, &w[..self.dim], dt);
    }
}

/// A matrix times w.
fn applied(matrix: &SparseKernel, w: &[f64], values: &mut Vec<f64>) {
    values.resize(matrix.rows(), 0.0);
    matrix.apply_first(w, values);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_span_that_recurs_is_travelled_to_rounding_whatever_its_time() {
        let mut flow = oscillator(1e-3);
        flow.set_work(vec![Term {
            v: vec![(0, 1.0)],
            i: vec![(0, 1.0)],
            source: false,
        }]);
        let t: f64 = 3e-4;
        let span = (0..100)
            .find_map(|_| flow.recurs(t, 1e-15))
            .expect("a span that recurs");
        let (mut next, amplitude) = (vec![0.0; 4], [1.0, 1.0]);
        let sizes = Sizes {
            amplitude: &amplitude,
            power: 0.0,
        };
        for t in [t, t - 1e-13, t + 1e-13] {
            let off = flow
                .leap_span(span, t, &[1.0, 0.0], &mut next)
                .expect("finite");
            let angle = 1e4 * t;
            let (s, c) = angle.sin_cos();
            for (a, b) in next.iter().zip([c, s, c, -1e4 * s]) {
                assert!((a - b).abs() < 4e-15 * b.abs().max(1.0), "{a} {b}");
            }
            let stretch = (Stretch::Span(span), &[1.0, 0.0][..]);
            let [_, over] = flow.energy(std::iter::once(stretch), sizes);
            let [_, power] = flow.power(&next);
            let dissipated = over + off * power;
            // ∫ cos² = (t + sin cos/ω)/2
            let exact = 0.5 * (t + s * c * 1e-4);
            assert!(
                (dissipated - exact).abs() < 4e-15 * exact,
                "{dissipated:e} {exact:e}"
            );
        }
    }

    fn oscillator(h: f64) -> Flow {
        // x1' = −ω x2, x2' = ω x1 with ω = 1e4, guard x1
        let generator = DMatrix::from_row_slice(2, 2, &[0.0, -1e4, 1e4, 0.0]);
        Flow::new(
            generator,
            2,
            &[],
            &DMatrix::from_row_slice(1, 2, &[1.0, 0.0]),
            h,
            &[],
        )
        .unwrap()
    }

    #[test]
    fn levels_and_taylor_give_the_same_flow() {
        let mut flow = oscillator(1e-3);
        assert_eq!(flow.bottom(), 4 + LONG);
        let mut next = vec![0.0; 4];
        for level in 0..=flow.bottom() {
            assert!(flow.leap(level, &[1.0, 0.0], &mut next));
            let angle = 1e4 * flow.step(level);
            let (s, c) = angle.sin_cos();
            let expected = [c, s, c, -1e4 * s];
            for (a, b) in next.iter().zip(expected) {
                let error = (a - b).abs() / b.abs().max(1.0);
                assert!(error <= 5e-16 * (6.0 + angle), "{level}: {error:e}");
            }
        }
        let mut series = Series::default();
        flow.expand(&mut series, &[1.0, 0.0], flow.step(4 + LONG));
        let mut w = vec![0.0; 2];
        series.at(1.0, &mut w);
        assert!(
            (w[0] - next[0]).abs() < 4e-16 && (w[1] - next[1]).abs() < 4e-16,
            "{w:?} {next:?}"
        );
        let polynomial = flow.guard_polynomial(0, &series);
        assert_eq!(polynomial[0], 1.0);
        assert!((polynomial[2] + 0.5 * 0.625 * 0.625).abs() < 1e-15);
        let (mut rest, mut values) = (Vec::new(), Vec::new());
        flow.guard_cubics(&series, &mut rest, &mut values);
        assert_eq!(values[..2], polynomial[2..4]);
        let rest = polynomial[4..].iter().map(|c| c.abs()).sum::<f64>();
        assert!((values[2] - rest).abs() < 1e-15);
    }
}
