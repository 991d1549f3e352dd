//! The sources of a run: the exosystem on its present pieces, the switches that sources alone control, and what is known to happen.

use nalgebra::DVector;

use super::clock::Clock;
use super::exosystem::Exosystem;
use super::key::Key;
use super::rounding::resolution;
use crate::circuit::Source;
use crate::circuit::source::Wave;
use crate::integrate::error::{Error, Reason};
use crate::integrate::switching::Threshold;
use crate::mna::SourceControl;
use crate::settings::tolerances::times::SAME_TIME;

/// All sources, and where they stand.
pub(super) struct Sources {
    all: Vec<Source>,
    pub(super) exosystem: Exosystem,
    /// z at the last change or breakpoint.
    pub(super) z: Vec<f64>,
    /// u before a jump: at the end of the mode that is left, or before the start.
    pub(super) before: DVector<f64>,
    /// Switches that straight sources alone control.
    pub(super) clocks: Vec<Clock>,
    /// When the next piece of a source ends, s.
    next_piece: f64,
    /// The next time at which something is known to happen, s.
    pub(super) next_stop: f64,
    /// Whether the run stops at corners of sources too that act through controls alone.
    pub(super) at_all_corners: bool,
}

fn without_form() -> Reason {
    Reason::Unsupported("a source has no closed form as a linear system".into())
}

impl Sources {
    /// Over a run from `from` to `until`; those that are `silent` act through `controls` alone, and where they are `free` each may be
    /// given another value at any time.
    ///
    /// # Errors
    /// A source that no finite linear system generates.
    pub(super) fn new(
        all: Vec<Source>,
        (silent, controls): (Vec<bool>, Vec<SourceControl>),
        (from, until): (f64, f64),
        free: bool,
    ) -> Result<Self, Error> {
        let before = all.iter().zip(&silent);
        let before = before.map(|(s, silent)| if *silent { 0.0 } else { s.value_left(from) });
        let before = DVector::from_iterator(all.len(), before);
        let unsupported = || Error::before(without_form());
        let exosystem = Exosystem::of(&all, silent, (from, until), free).ok_or_else(unsupported)?;
        let clocks = controls.into_iter();
        let clocks = clocks.map(|control| Clock::new(control, &all, from));
        let mut sources = Self {
            clocks: clocks.collect::<Option<_>>().ok_or_else(unsupported)?,
            z: vec![0.0; exosystem.dim()],
            all,
            exosystem,
            before,
            next_piece: f64::NEG_INFINITY,
            next_stop: f64::NEG_INFINITY,
            at_all_corners: false,
        };
        sources.stand(from);
        Ok(sources)
    }

    /// Whether modes see no difference to other sources.
    pub(super) fn is_alike(&self, other: &Self) -> bool {
        let clocks = |sources: &Self| -> Vec<usize> {
            sources.clocks.iter().map(|clock| clock.switch).collect()
        };
        self.exosystem.is_alike(&other.exosystem) && clocks(self) == clocks(other)
    }

    /// Reads z at t on the present pieces.
    pub(super) fn stand(&mut self, t: f64) {
        self.exosystem.write(t, &mut self.z);
    }

    /// u at t on the present pieces.
    pub(super) fn inputs(&self, t: f64) -> DVector<f64> {
        let mut z = DVector::zeros(self.exosystem.dim());
        self.exosystem.write(t, z.as_mut_slice());
        self.exosystem.output() * z
    }

    /// u before a jump is that of w = [x; z] with n states.
    pub(super) fn leave(&mut self, n: usize, w: &[f64]) {
        let z = &w[n..n + self.exosystem.dim()];
        self.before = self.exosystem.output() * DVector::from_column_slice(z);
    }

    /// Whether sources alone control this switch.
    pub(super) fn control(&self, switch: usize) -> bool {
        self.clocks.iter().any(|clock| clock.switch == switch)
    }

    /// Whether a piece ends before `near`, and whether anything is known to happen.
    pub(super) fn due(&self, near: f64) -> (bool, bool) {
        (self.next_piece <= near, self.next_stop <= near)
    }

    /// Sources whose pieces end before `near` go on from t along the next ones; returns whether one of them jumps.
    pub(super) fn take_pieces(&mut self, t: f64, near: f64) -> Result<bool, Error> {
        let mut edge = false;
        for (i, source) in self.all.iter().enumerate() {
            let old = self.exosystem.piece(i);
            let end = old.end;
            if end <= near {
                let last = old.value(end);
                let piece = source.piece(end.max(t));
                let piece = piece.ok_or_else(|| Error::at(t, without_form()))?;
                edge |= last != piece.value(end);
                self.exosystem.set_piece(i, piece);
            }
        }
        Ok(edge)
    }

    /// Moves the switches that sources alone control and that are due before `near`; whether one moved.
    pub(super) fn move_clocked(&self, key: &mut Key, near: f64) -> bool {
        let mut moved = false;
        for clock in self.clocks.iter().filter(|clock| clock.next <= near) {
            key.switches[clock.switch] = !key.switches[clock.switch];
            moved = true;
        }
        moved
    }

    /// Finds what is known to happen first after t in a run until `until`.
    pub(super) fn look_ahead(
        &mut self,
        thresholds: &[Threshold],
        switches: &[bool],
        span: (f64, f64),
    ) {
        self.next_piece = self.exosystem.next_breakpoint();
        self.next_stop = self.next_piece;
        for clock in &mut self.clocks {
            let i = clock.switch;
            clock.look_ahead(&thresholds[i], switches[i], span, &self.all);
            self.next_stop = self.next_stop.min(clock.next);
        }
        if self.at_all_corners {
            self.next_stop = self.next_stop.min(self.next_corner(span.0));
        }
    }

    /// The period after which the switches that sources alone control move as before, s; `None` where they need not.
    pub(super) fn period(&self) -> Option<f64> {
        let inputs = self.clocks.iter().flat_map(Clock::inputs);
        let waves = inputs.map(|input| &self.all[input].wave);
        let mut periods = Vec::new();
        for wave in waves {
            match wave {
                Wave::Dc(_) => {}
                Wave::Pulse { count: None, .. } => periods.extend(wave.period()),
                // Its first lap is like the others.
                Wave::Pwl {
                    points,
                    repeat: Some(repeat),
                    ..
                } if points.first().is_some_and(|first| *repeat <= first.0) => {
                    periods.extend(wave.period());
                }
                _ => return None,
            }
        }
        let longest = periods.iter().copied().reduce(f64::max)?;
        let divides = |own: &f64| {
            let count = longest / own;
            (count - count.round()).abs() <= SAME_TIME * count
        };
        periods.iter().all(divides).then_some(longest)
    }

    /// When the next piece of a source ends that is followed, or a clock first moves its switch at a time that does not recur, s.
    pub(super) fn next_other(&self, recurs: impl Fn(f64) -> bool) -> f64 {
        let clocks = self.clocks.iter().map(|clock| clock.next);
        let others = clocks.filter(|next| !recurs(*next));
        others.fold(self.next_piece, f64::min)
    }

    /// All stands at t, so many seconds `ahead` of what is known to happen first; `false`, and nothing is moved, where that is not so.
    pub(super) fn skip(
        &mut self,
        (thresholds, switches): (&[Threshold], &[bool]),
        (t, ahead): (f64, f64),
        until: f64,
    ) -> bool {
        let before = (self.clocks.clone(), self.next_piece, self.next_stop);
        let between = t + 0.5 * ahead;
        for clock in &mut self.clocks {
            clock.stand_at(&self.all, between);
        }
        self.look_ahead(thresholds, switches, (between, until));
        let found = (self.next_stop - (t + ahead)).abs() <= SAME_TIME * self.next_stop;
        if !found {
            (self.clocks, self.next_piece, self.next_stop) = before;
        }
        found
    }

    /// The first corner of all sources after t.
    #[cold]
    #[inline(never)]
    fn next_corner(&self, t: f64) -> f64 {
        // A corner that rounding puts right behind this instant is taken with it.
        let near = t + resolution(t);
        let ends = self.all.iter().filter_map(|source| source.piece(near));
        let ends = ends.map(|piece| piece.end).filter(|end| *end > near);
        ends.fold(f64::INFINITY, f64::min)
    }

    /// Gives a source another waveform; what that makes happen is left to [`Self::resume`].
    pub(super) fn replace(&mut self, input: usize, source: Source) {
        self.all[input] = source;
    }

    /// One source goes on from t along the piece that it has there.
    pub(super) fn take_piece(&mut self, input: usize, t: f64) -> Result<(), Error> {
        let piece = self.all[input].piece(t);
        let piece = piece.ok_or_else(|| Error::at(t, without_form()))?;
        self.exosystem.set_piece(input, piece);
        self.stand(t);
        Ok(())
    }

    /// All sources go on from t.
    pub(super) fn resume(&mut self, t: f64) -> Result<(), Error> {
        (0..self.all.len()).try_for_each(|input| self.take_piece(input, t))
    }

    /// Has the switches that sources alone control stand as they do right after t.
    pub(super) fn position(&mut self, thresholds: &[Threshold], switches: &mut [bool], t: f64) {
        for clock in &mut self.clocks {
            let i = clock.switch;
            clock.stand_at(&self.all, t);
            switches[i] ^= clock.leaves(&thresholds[i], switches[i], t);
        }
    }
}
