//! One measurement, as `.meas tran` describes it, over expressions of any kind `E`.

use super::{Edge, MeasureError, Over, Trace, Which};

/// What is measured.
#[derive(Debug, Clone, PartialEq)]
pub enum Measurement<E> {
    /// `AVG expr FROM=a TO=b`, also between `TRIG … TARG …`.
    Over(Over, E, Window<E>),
    /// `FIND expr AT=t`, `FIND expr WHEN a=b`; the slope for `DERIV`.
    Find {
        /// What is looked up.
        of: E,
        /// Its derivative instead of its value.
        slope: bool,
        /// When.
        when: Instant<E>,
    },
    /// `WHEN a=b`.
    When(Instant<E>),
    /// `TRIG … TARG …`: the time from the first to the second.
    Delay(Instant<E>, Instant<E>),
    /// `PARAM expr`: of other measurements and parameters.
    Param(E),
}

/// A part of the run; its ends where absent.
#[derive(Debug, Clone, PartialEq)]
pub struct Window<E> {
    /// `FROM=t`, `TD=t`, or `TRIG …`.
    pub from: Option<Instant<E>>,
    /// `TO=t`, or `TARG …`.
    pub to: Option<Instant<E>>,
}

/// An instant of the run.
#[derive(Debug, Clone, PartialEq)]
pub enum Instant<E> {
    /// `AT=t`.
    At(E),
    /// `left=right`, `left VAL=right`: when two quantities meet.
    Crossing {
        /// One of them.
        left: E,
        /// The other.
        right: E,
        /// Which way the first passes.
        edge: Edge,
        /// Which of the crossings, from 1; `None` for the last.
        number: Option<E>,
        /// Not before: `TD=t` or `FROM=t`.
        from: Option<E>,
        /// Not after: `TO=t`.
        to: Option<E>,
    },
}

/// How an expression is used in a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Use {
    /// As a function of time.
    Trace,
    /// As one number.
    Number,
}

impl<E> Measurement<E> {
    /// The time before which it needs to see nothing, s, where `number` gives that of an expression; −∞ where that is not known.
    pub(crate) fn begins(&self, number: &dyn Fn(&E) -> f64) -> f64 {
        let at = |t: Option<&E>| {
            let t = t.map(number).filter(|t| t.is_finite());
            t.unwrap_or(f64::NEG_INFINITY)
        };
        let of = |instant: &Instant<E>| match instant {
            Instant::At(t) => at(Some(t)),
            Instant::Crossing { from, .. } => at(from.as_ref()),
        };
        match self {
            Self::Over(_, _, Window { from, .. }) => from.as_ref().map_or(f64::NEG_INFINITY, of),
            Self::Find { when, .. } | Self::When(when) => of(when),
            Self::Delay(trig, targ) => of(trig).min(of(targ)),
            Self::Param(_) => f64::INFINITY,
        }
    }

    /// The same measurement over other expressions; `None` as soon as `f` gives none.
    pub fn map<'a, F>(
        &'a self,
        f: &mut dyn FnMut(&'a E, Use) -> Option<F>,
    ) -> Option<Measurement<F>> {
        Some(match self {
            Self::Over(over, of, window) => {
                let mut end = |end: &'a Option<Instant<E>>| match end {
                    None => Some(None),
                    Some(instant) => instant.map(f).map(Some),
                };
                let (from, to) = (end(&window.from)?, end(&window.to)?);
                Measurement::Over(*over, f(of, Use::Trace)?, Window { from, to })
            }
            Self::Find { of, slope, when } => Measurement::Find {
                of: f(of, Use::Trace)?,
                slope: *slope,
                when: when.map(f)?,
            },
            Self::When(when) => Measurement::When(when.map(f)?),
            Self::Delay(trig, targ) => Measurement::Delay(trig.map(f)?, targ.map(f)?),
            Self::Param(e) => Measurement::Param(f(e, Use::Number)?),
        })
    }
}

impl<E> Instant<E> {
    fn map<'a, F>(&'a self, f: &mut dyn FnMut(&'a E, Use) -> Option<F>) -> Option<Instant<F>> {
        let mut number = |e: &'a Option<E>| match e {
            None => Some(None),
            Some(e) => f(e, Use::Number).map(Some),
        };
        Some(match self {
            Self::At(t) => Instant::At(f(t, Use::Number)?),
            Self::Crossing {
                left,
                right,
                edge,
                number: n,
                from,
                to,
            } => {
                let (n, from, to) = (number(n)?, number(from)?, number(to)?);
                Instant::Crossing {
                    left: f(left, Use::Trace)?,
                    right: f(right, Use::Trace)?,
                    edge: *edge,
                    number: n,
                    from,
                    to,
                }
            }
        })
    }
}

/// What a measurement found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The value.
    pub value: f64,
    /// Where it was found: `from`, `to`, `at`, `trig`, `targ` in s.
    pub at: Vec<(&'static str, f64)>,
}

/// The waveform of an expression, less that of another one.
type Waveform<'a, E> = dyn Fn(&E, Option<&E>) -> Result<Trace<'a>, MeasureError> + 'a;

/// A run as measurements see it.
pub struct Scene<'a, E> {
    /// Where it begins and ends, s.
    pub span: (f64, f64),
    /// The waveform of an expression, less that of another one.
    pub trace: &'a Waveform<'a, E>,
    /// The value of an expression without signals.
    pub number: &'a dyn Fn(&E) -> Result<f64, MeasureError>,
}

impl<E> Scene<'_, E> {
    /// Carries out a measurement.
    ///
    /// # Errors
    /// See [`MeasureError`].
    pub fn measure(&self, what: &Measurement<E>) -> Result<Found, MeasureError> {
        let found = match what {
            Measurement::Over(over, of, window) => {
                let trace = (self.trace)(of, None)?;
                let (start, stop) = self.span;
                let end = |end: &Option<Instant<E>>, or: f64| {
                    end.as_ref().map_or(Ok(or), |instant| self.when(instant))
                };
                let from = end(&window.from, start)?.max(start);
                let to = end(&window.to, stop)?.min(stop);
                Found {
                    value: trace.over(*over, from, to)?,
                    at: vec![("from", from), ("to", to)],
                }
            }
            Measurement::Find { of, slope, when } => {
                let trace = (self.trace)(of, None)?;
                let t = self.when(when)?;
                Found {
                    value: if *slope { trace.slope(t) } else { trace.at(t) }?,
                    at: vec![("at", t)],
                }
            }
            Measurement::When(when) => Found {
                value: self.when(when)?,
                at: vec![],
            },
            Measurement::Delay(trig, targ) => {
                let (trig, targ) = (self.when(trig)?, self.when(targ)?);
                Found {
                    value: targ - trig,
                    at: vec![("trig", trig), ("targ", targ)],
                }
            }
            Measurement::Param(e) => Found {
                value: (self.number)(e)?,
                at: vec![],
            },
        };
        if found.value.is_finite() {
            Ok(found)
        } else {
            Err(MeasureError::NotFinite)
        }
    }

    pub(crate) fn when(&self, instant: &Instant<E>) -> Result<f64, MeasureError> {
        match instant {
            Instant::At(t) => (self.number)(t),
            Instant::Crossing {
                left,
                right,
                edge,
                number,
                from,
                to,
            } => {
                let fixed = (self.trace)(right, None)?.constant();
                let moving = Some(right).filter(|_| fixed.is_none());
                let trace = (self.trace)(left, moving)?;
                let bound = |e: &Option<E>, or: f64| e.as_ref().map_or(Ok(or), self.number);
                let which = match number {
                    None => Which::Last,
                    Some(e) => Which::Number(count((self.number)(e)?)?),
                };
                let (start, stop) = self.span;
                let within = (bound(from, start)?.max(start), bound(to, stop)?.min(stop));
                trace.crossing(fixed.unwrap_or(0.0), *edge, which, within)
            }
        }
    }
}

/// The number of a crossing.
fn count(x: f64) -> Result<usize, MeasureError> {
    if x >= 1.0 && x.fract() == 0.0 {
        Ok(x as usize)
    } else {
        Err(MeasureError::Count(x))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp 0 → 4 over 4 s, and a triangle 0 → 2 → 0.
    fn measure(what: &Measurement<&'static str>) -> Result<Found, MeasureError> {
        let time = [0.0, 1.0, 2.0, 3.0, 4.0];
        let values = |e: &str| match e {
            "ramp" => Ok(time.to_vec()),
            "triangle" => Ok(vec![0.0, 1.0, 2.0, 1.0, 0.0]),
            level => {
                let level = level.parse().map(|x| vec![x; 5]);
                level.map_err(|_| MeasureError::NotFinite)
            }
        };
        let trace = |e: &&str, less: Option<&&str>| {
            let less = values(less.copied().unwrap_or("0"))?;
            let own = values(e)?.into_iter().zip(less).map(|(a, b)| a - b);
            Ok(Trace::lines(&time, own.collect::<Vec<_>>()))
        };
        let number = |e: &&str| e.parse().map_err(|_| MeasureError::NotFinite);
        Scene {
            span: (0.0, 4.0),
            trace: &trace,
            number: &number,
        }
        .measure(what)
    }

    fn meets(
        left: &'static str,
        right: &'static str,
        edge: Edge,
        number: Option<&'static str>,
    ) -> Instant<&'static str> {
        Instant::Crossing {
            left,
            right,
            edge,
            number,
            from: None,
            to: None,
        }
    }

    #[test]
    fn windows_are_cut_to_the_run() {
        let window = |from, to| Window { from, to };
        let average = |w| measure(&Measurement::Over(Over::Average, "ramp", w));
        let whole = average(window(None, Some(Instant::At("9")))).unwrap();
        assert_eq!((whole.value, whole.at[1]), (2.0, ("to", 4.0)));
        let begins =
            |w| Measurement::Over(Over::Average, "ramp", w).begins(&|e| e.parse().unwrap());
        assert_eq!(begins(window(Some(Instant::At("2")), None)), 2.0);
        assert_eq!(
            begins(window(None, Some(Instant::At("2")))),
            f64::NEG_INFINITY
        );
        // From the triangle's 1.5 on the way up (t = 1.5) to the one on the way down (t = 2.5).
        let from = Some(meets("triangle", "1.5", Edge::Rise, Some("1")));
        let to = Some(meets("triangle", "1.5", Edge::Fall, None));
        assert_eq!(average(window(from, to)).unwrap().value, 2.0);
        assert!(average(window(Some(Instant::At("5")), None)).is_err());
    }

    #[test]
    fn instants() {
        let found = |what| measure(&what).map(|f| f.value);
        let falls = || meets("triangle", "0.5", Edge::Fall, Some("1"));
        assert_eq!(found(Measurement::When(falls())), Ok(3.5));
        let find = |slope| Measurement::Find {
            of: "triangle",
            slope,
            when: Instant::At("2.5"),
        };
        assert_eq!((found(find(false)), found(find(true))), (Ok(1.5), Ok(-1.0)));
        // The two curves are one up to t = 2, where the triangle leaves the ramp.
        let meet = meets("ramp", "triangle", Edge::Cross, Some("1"));
        assert!(found(Measurement::When(meet)).is_err());
        let meet = meets("1.5", "triangle", Edge::Rise, Some("1"));
        assert_eq!(found(Measurement::When(meet)), Ok(2.5));
        let delay = Measurement::Delay(Instant::At("1"), falls());
        assert_eq!(found(delay), Ok(2.5));
        let half = meets("triangle", "1", Edge::Cross, Some("0.5"));
        assert_eq!(
            found(Measurement::When(half)),
            Err(MeasureError::Count(0.5))
        );
    }
}
