//! The sources of a system, evaluated together.

use crate::circuit::Source;
use crate::circuit::source::{Crossing, Piece, Rest, Wave, first_crossing, side_after};
use crate::integrate::line::{Line, Lines};
use crate::lcs::Input;
use crate::settings::tolerances::steps::STEPS_PER_PERIOD;
use crate::settings::tolerances::times::SAME_TIME;

/// All inputs u(t) with their one-sided limits and breakpoints.
#[derive(Debug, Clone)]
pub struct Inputs {
    sources: Vec<Source>,
    varying: Vec<usize>,
    /// Inputs that vary and act through controls of switches alone, whose corners are no breakpoints.
    silent: Vec<usize>,
    /// By input: the line and the port at which it arrives.
    arriving: Vec<Option<(usize, usize)>>,
    lines: Lines,
}

/// The closed forms of the varying inputs around the time at which they were evaluated last.
#[derive(Debug, Default)]
pub(crate) struct Pieces(Vec<Option<Piece>>);

impl Inputs {
    /// The inputs of a system.
    #[must_use]
    pub fn new(inputs: &[Input]) -> Self {
        let sources: Vec<_> = inputs.iter().map(|i| i.source.clone()).collect();
        let varying = (0..sources.len())
            .filter(|&j| !is_constant(&sources[j].wave))
            .collect();
        Self {
            arriving: vec![None; sources.len()],
            lines: Lines::default(),
            sources,
            varying,
            silent: Vec::new(),
        }
    }

    /// Has corners of these inputs be no breakpoints: they act through controls of switches alone, whose passages are looked for by themselves.
    pub(crate) fn silence(&mut self, silent: &[bool]) {
        let is_silent = |j: &usize| silent.get(*j) == Some(&true);
        self.silent = self.varying.iter().copied().filter(is_silent).collect();
    }

    /// Writes right limits of the inputs whose corners are no breakpoints.
    pub(crate) fn right_of_silent(&self, t: f64, u: &mut [f64]) {
        for &j in &self.silent {
            u[j] = self.value(j, t);
        }
    }

    /// Has the inputs of these names be the waves that arrive at the ports of lines.
    pub(crate) fn attach(&mut self, inputs: &[Input], lines: &[Line]) {
        self.lines = Lines::new(lines);
        for (arriving, input) in self.arriving.iter_mut().zip(inputs) {
            let port = |line: &Line| line.sources.iter().position(|s| *s == input.name);
            let mut found = lines.iter().enumerate();
            *arriving = found.find_map(|(k, line)| Some((k, port(line)?)));
        }
    }

    /// What travels on lines.
    pub(crate) const fn lines(&self) -> &Lines {
        &self.lines
    }

    /// What travels on lines.
    pub(crate) const fn lines_mut(&mut self) -> &mut Lines {
        &mut self.lines
    }

    fn value(&self, j: usize, t: f64) -> f64 {
        self.arriving[j].map_or_else(|| self.sources[j].value(t), |at| self.lines.right(at, t))
    }

    /// The number of inputs.
    pub(crate) fn len(&self) -> usize {
        self.sources.len()
    }

    /// Indices of the inputs that are not constant.
    #[must_use]
    pub fn varying(&self) -> &[usize] {
        &self.varying
    }

    /// Right limits u(t⁺) of all inputs.
    #[must_use]
    pub fn all(&self, t: f64) -> Vec<f64> {
        (0..self.sources.len()).map(|j| self.value(j, t)).collect()
    }

    /// Left limits u(t⁻) of all inputs.
    #[must_use]
    pub fn all_before(&self, t: f64) -> Vec<f64> {
        let mut u = self.all(t);
        self.left(t, &mut u);
        u
    }

    /// Writes right limits of the varying inputs.
    pub fn right(&self, t: f64, u: &mut [f64]) {
        for &j in &self.varying {
            u[j] = self.value(j, t);
        }
    }

    /// Writes right limits of the varying inputs behind all edges that are at `t` to the rounding of times, as is [`Self::next_corner`].
    pub(crate) fn behind(&self, t: f64, u: &mut [f64]) {
        self.right(self.end_of_instant(t), u);
    }

    /// Writes the varying inputs, one after the other, at a time without breakpoint, by the closed forms found last where they hold there.
    pub(crate) fn varying_at(&self, t: f64, pieces: &mut Pieces, values: &mut [f64]) {
        pieces.0.resize(self.varying.len(), None);
        let known = pieces.0.iter_mut().zip(&self.varying);
        for (value, (piece, &j)) in values.iter_mut().zip(known) {
            if piece.is_none_or(|piece| t < piece.start || t >= piece.end) {
                *piece = match self.arriving[j] {
                    Some(_) => None,
                    None => self.sources[j].piece(t),
                };
            }
            *value = piece.map_or_else(|| self.value(j, t), |piece| piece.value(t));
        }
    }

    /// Writes left limits of the varying inputs.
    pub fn left(&self, t: f64, u: &mut [f64]) {
        for &j in &self.varying {
            u[j] = match self.arriving[j] {
                Some(at) => self.lines.left(at, t),
                None => self.sources[j].value_left(t),
            };
        }
    }

    /// Writes right-hand slopes of all inputs.
    pub fn slopes(&self, t: f64, du: &mut [f64]) {
        du.fill(0.0);
        for &j in &self.varying {
            du[j] = match self.arriving[j] {
                Some(at) => self.lines.slope(at, t),
                None => self.sources[j].derivative(t),
            };
        }
    }

    /// Writes slopes of all inputs behind all edges that are at `t` to the rounding of times, as [`Self::behind`] does values.
    pub(crate) fn slopes_behind(&self, t: f64, du: &mut [f64]) {
        self.slopes(self.end_of_instant(t), du);
    }

    /// The first time after `t` at which an input has an edge or a kink; infinite if none.
    #[must_use]
    pub fn next_breakpoint(&self, t: f64) -> f64 {
        self.varying
            .iter()
            .filter(|j| !self.silent.contains(j))
            .filter_map(|&j| self.sources[j].next_breakpoint(t))
            .fold(self.lines.next_breakpoint(t), f64::min)
    }

    /// The first edge or kink that lies after `t` by more than the rounding of times; infinite if none.
    #[must_use]
    pub(crate) fn next_corner(&self, t: f64) -> f64 {
        self.next_breakpoint(self.end_of_instant(t))
    }

    /// The last edge or kink that is at `t` to the rounding of times, or `t`.
    pub(crate) fn end_of_instant(&self, t: f64) -> f64 {
        let mut end = t;
        loop {
            let next = self.next_breakpoint(end);
            if next - t > SAME_TIME * next.abs() || !next.is_finite() {
                return end;
            }
            end = next;
        }
    }

    /// The first time in (from, to] at which `constant + gains·u` passes `level` upwards (`rising`) or downwards and is not back within `instant`, s.
    #[must_use]
    pub(crate) fn passage(
        &self,
        (gains, constant): (Vec<f64>, f64),
        (level, rest, rising): (f64, Rest, bool),
        span: (f64, f64),
        instant: f64,
    ) -> Option<f64> {
        let terms = self.terms(gains);
        let levels = (constant, level);
        let wanted = |c: Crossing| c.rising == rising;
        first_crossing(&terms, (levels, rest), span, instant, wanted).map(|c| c.time)
    }

    /// Behind all edges that are at `t` to the rounding of times `constant + gains·u` is above `level` (1), below it (−1), or rests on it (0).
    pub(crate) fn side_behind(&self, (gains, constant): (Vec<f64>, f64), level: f64, t: f64) -> i8 {
        side_after(
            &self.terms(gains),
            (constant, level),
            self.end_of_instant(t),
        )
    }

    fn terms(&self, gains: Vec<f64>) -> Vec<(f64, &Source)> {
        let terms = gains.into_iter().zip(&self.sources);
        terms.filter(|(gain, _)| *gain != 0.0).collect()
    }

    /// The largest value each input takes (a bound, for sinusoids), in the order of u.
    #[must_use]
    pub fn amplitudes(&self) -> Vec<f64> {
        self.sources.iter().map(|s| amplitude(&s.wave)).collect()
    }

    /// Largest step that does not alias the fastest sine, s.
    #[must_use]
    pub fn largest_step(&self) -> f64 {
        self.sources
            .iter()
            .filter_map(|s| match s.wave {
                Wave::Sin { frequency, .. } if frequency > 0.0 => {
                    Some(1.0 / (STEPS_PER_PERIOD * frequency))
                }
                // The instantaneous frequency of an FM source swings by index · signal.
                Wave::Sffm {
                    carrier,
                    index,
                    signal,
                    ..
                } => Some(1.0 / (STEPS_PER_PERIOD * (carrier.abs() + (index * signal).abs()))),
                Wave::Am {
                    modulation,
                    carrier,
                    ..
                } => Some(1.0 / (STEPS_PER_PERIOD * (carrier.abs() + modulation.abs()))),
                _ => None,
            })
            .fold(f64::INFINITY, f64::min)
    }
}

fn is_constant(wave: &Wave) -> bool {
    match wave {
        Wave::Arriving { .. } => false,
        Wave::Dc(_) => true,
        Wave::Sin { amplitude, .. } => *amplitude == 0.0,
        Wave::Pulse { v1, v2, .. } | Wave::Exp { v1, v2, .. } => v1 == v2,
        Wave::Pwl { points, .. } => points.windows(2).all(|w| w[0].1 == w[1].1),
        Wave::Sffm { amplitude, .. } | Wave::Am { amplitude, .. } => *amplitude == 0.0,
    }
}

fn amplitude(wave: &Wave) -> f64 {
    match wave {
        Wave::Dc(value) => value.abs(),
        Wave::Arriving { initial, .. } => initial.abs(),
        Wave::Sin {
            offset, amplitude, ..
        }
        | Wave::Sffm {
            offset, amplitude, ..
        } => offset.abs() + amplitude.abs(),
        Wave::Am {
            offset, amplitude, ..
        } => amplitude.abs() * (offset.abs() + 1.0),
        Wave::Pulse { v1, v2, .. } | Wave::Exp { v1, v2, .. } => v1.abs().max(v2.abs()),
        Wave::Pwl { points, .. } => points.iter().fold(0.0, |a, p| a.max(p.1.abs())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A·(o + sin ω_m t)·sin ω_c t reaches A(|o| + 1) where both sines turn.
    #[test]
    fn a_modulated_source_stays_within_its_amplitude_and_reaches_it() {
        let source = Source {
            dc: 0.0,
            wave: Wave::Am {
                amplitude: 2.0,
                offset: 0.5,
                modulation: 1.0,
                carrier: 101.0,
                delay: 0.0,
            },
        };
        let bound = amplitude(&source.wave);
        let values = (0..100_000).map(|k| source.value(1e-5 * f64::from(k)).abs());
        let largest = values.fold(0.0, f64::max);
        assert!(
            0.999 * bound < largest && largest <= bound,
            "{largest} {bound}"
        );
    }
}
