//! The common period of all sources, and sources that do not repeat.

use num_bigint::BigInt;
use num_integer::Integer;
use num_rational::BigRational;
use num_traits::{One, Signed, ToPrimitive, Zero};

use crate::algebra::rational;
use crate::circuit::source::Wave;
use crate::circuit::{Circuit, Kind, Source};
use crate::settings::tolerances::times::SAME_PERIOD;

/// The longest common period, in periods of the fastest source.
const MOST_CYCLES: u32 = 10_000;

/// When the sources of a circuit repeat.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Period {
    /// s; `None` where no source varies for good.
    pub(super) seconds: Option<f64>,
    /// From here on, a multiple of the period, s.
    pub(super) from: f64,
    /// The last delay after which a source repeats, s.
    latest: f64,
}

impl Period {
    /// Another period in place of this one.
    pub(super) fn of(self, seconds: f64) -> Self {
        let latest = self.latest;
        Self {
            seconds: Some(seconds),
            from: (latest / seconds).ceil() * seconds,
            latest,
        }
    }
}

/// A circuit whose sources that do not repeat stay at their values at 0⁻, and the names of these; supplies that ramp up at the start have done so.
pub(super) fn repeating(circuit: &Circuit) -> (Circuit, Vec<String>) {
    let (mut held, mut names) = (circuit.clone(), Vec::new());
    let span = circuit.tran.map_or(f64::INFINITY, |tran| tran.tstop);
    for element in &mut held.elements {
        let (Kind::VoltageSource(source) | Kind::CurrentSource(source)) = &mut element.kind else {
            continue;
        };
        if let Some(value) = source.wave.risen() {
            source.wave = Wave::Dc(value);
        } else if source.wave.is_once(span) {
            *source = Source {
                dc: source.dc,
                wave: Wave::Dc(source.wave.value_left(0.0)),
            };
            names.push(element.name.clone());
        }
    }
    (held, names)
}

/// The source that repeats least well after so many seconds, and which part of its own period it is off by then.
pub(super) fn off(circuit: &Circuit, seconds: f64) -> Option<(&str, f64, f64)> {
    let sources = circuit.elements.iter().filter_map(|element| {
        let (Kind::VoltageSource(source) | Kind::CurrentSource(source)) = &element.kind else {
            return None;
        };
        Some((element.name.as_str(), periods(&source.wave).0))
    });
    let all = sources.flat_map(|(name, own)| {
        let own = own.into_iter().filter_map(|period| period.to_f64());
        own.map(move |period| {
            let laps = seconds / period;
            (name, period, (laps - laps.round().max(1.0)).abs())
        })
    });
    all.max_by(|one, other| one.2.total_cmp(&other.2))
}

/// The common period of the sources that vary.
///
/// # Errors
/// In words: two sources without a common period of at most [`MOST_CYCLES`] periods of the fastest.
pub(super) fn common(circuit: &Circuit) -> Result<Period, String> {
    let mut all: Option<(BigRational, &str)> = None;
    let (mut fastest, mut latest) = (None::<BigRational>, 0.0_f64);
    for element in &circuit.elements {
        let (Kind::VoltageSource(source) | Kind::CurrentSource(source)) = &element.kind else {
            continue;
        };
        let (own, delay) = periods(&source.wave);
        for period in own {
            latest = latest.max(delay);
            let common = match &all {
                None => period.clone(),
                Some((known, _)) => least_common(known, &period),
            };
            let least = fastest.map_or_else(|| period.clone(), |f| f.min(period.clone()));
            if common > &least * BigInt::from(MOST_CYCLES) {
                let other = all.map_or("", |(_, name)| name);
                return Err(format!(
                    "{other} and {} have no common period of at most {MOST_CYCLES} cycles; `--period` names one",
                    element.name
                ));
            }
            fastest = Some(least);
            all = Some((common, &element.name));
        }
    }
    let seconds = all.and_then(|(period, _)| period.to_f64());
    let laps = seconds.map_or(0.0, |period| (latest / period).ceil());
    Ok(Period {
        seconds,
        from: laps * seconds.unwrap_or(0.0),
        latest,
    })
}

/// The periods of which a waveform's is a multiple, as the simplest fractions, and the time from which on it repeats, s.
fn periods(wave: &Wave) -> (Vec<BigRational>, f64) {
    let of = |frequency: f64| {
        let frequency = simplest(frequency);
        (!frequency.is_zero()).then(|| frequency.recip())
    };
    match *wave {
        Wave::Sin {
            amplitude,
            frequency,
            delay,
            ..
        } if amplitude != 0.0 => (of(frequency).into_iter().collect(), delay),
        Wave::Pulse {
            v1,
            v2,
            delay,
            period,
            ..
        } if v1 != v2 && period > 0.0 => (vec![simplest(period)], delay),
        Wave::Pwl {
            ref points,
            repeat: Some(from),
            delay,
        } => match points.last() {
            Some(&(last, _)) if last > from => {
                (vec![simplest(last) - simplest(from)], delay + from)
            }
            _ => (vec![], 0.0),
        },
        Wave::Sffm {
            amplitude,
            carrier,
            signal,
            ..
        } if amplitude != 0.0 => {
            let both = [carrier, signal].into_iter().filter_map(of);
            (both.collect(), 0.0)
        }
        Wave::Am {
            amplitude,
            modulation,
            carrier,
            delay,
            ..
        } if amplitude != 0.0 => {
            let both = [carrier, modulation].into_iter().filter_map(of);
            (both.collect(), delay)
        }
        _ => (vec![], 0.0),
    }
}

/// The simplest fraction that a positive double may stand for: 1e-5 is 1/100000, and so is what 1/(100 kHz) rounds to.
fn simplest(x: f64) -> BigRational {
    let (exact, slack) = (rational(x.abs()), rational(SAME_PERIOD));
    let whole = exact.denom() * slack.denom();
    let low = exact.numer() * (slack.denom() - slack.numer());
    let high = exact.numer() * (slack.denom() + slack.numer());
    let (numerator, denominator) = between((&low, &whole), (&high, &whole));
    BigRational::new(numerator, denominator)
}

/// The fraction of the least denominator in an interval of positive fractions, by continued fractions.
fn between(low: (&BigInt, &BigInt), high: (&BigInt, &BigInt)) -> (BigInt, BigInt) {
    let (floor, rest) = low.0.div_rem(low.1);
    if rest.is_zero() {
        return (floor, BigInt::one());
    }
    if (&floor + 1_u8) * high.1 <= *high.0 {
        return (floor + 1_u8, BigInt::one());
    }
    let beyond = high.0 - &floor * high.1;
    let (numerator, denominator) = between((high.1, &beyond), (low.1, &rest));
    (floor * &numerator + denominator, numerator)
}

/// The least common multiple of two positive numbers.
fn least_common(a: &BigRational, b: &BigRational) -> BigRational {
    let numerator = a.numer().lcm(b.numer());
    BigRational::new(numerator.abs(), a.denom().gcd(b.denom()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Model;

    fn period(cards: &str) -> Result<Period, String> {
        let text = format!("* t\n{cards}\n.tran 1u 10m\n.end\n");
        let model = Model::parse(&text, "t.cir").expect("a netlist");
        common(&repeating(model.circuit()).0)
    }

    #[test]
    fn periods_are_those_that_were_meant() {
        let seconds = |cards: &str| period(cards).expect("a period").seconds;
        let pulse = "v1 1 0 pulse(0 1 0 0 0 3u 10u)\nr1 1 0 1";
        assert_eq!(seconds(pulse), Some(1e-5));
        let three = format!("{pulse}\nv2 2 0 sin(0 1 50)\nr2 2 0 1\nv3 3 0 sin(0 1 60)\nr3 3 0 1");
        assert_eq!(seconds(&three), Some(0.1));
        assert_eq!(seconds("v1 1 0 3\nr1 1 0 1"), None);
        // 1/65000 s has no end in decimals, and none in binary.
        let carrier = "v1 1 0 pulse(0 1 0 {1/65k/2} {1/65k/2} 0 {1/65k})\nr1 1 0 1";
        let line = format!("{carrier}\nv2 2 0 sin(0 1 50)\nr2 2 0 1");
        assert_eq!(seconds(&line), Some(0.02));
        assert_eq!(seconds("v1 1 0 sin(0 1 0.3)\nr1 1 0 1"), Some(1.0 / 0.3));
    }

    #[test]
    fn what_does_not_repeat_is_held() {
        let text = "* t\nv1 1 0 pulse(2 5 1m)\nr1 1 0 1\nv2 2 0 pwl(0 1 1m 3)\nr2 2 0 1\n\
                    v3 3 0 pulse(0 1 2.5u 0 0 3u 10u)\nr3 3 0 1\n\
                    v4 4 0 pulse(0 1 1m 0 0 1 2)\nr4 4 0 1\n.tran 1u 10m\n.end\n";
        let model = Model::parse(text, "t.cir").expect("a netlist");
        let (held, names) = repeating(model.circuit());
        assert_eq!(names, ["v1", "v2", "v4"]);
        let found = common(&held).expect("a period");
        assert_eq!((found.seconds, found.from), (Some(1e-5), 1e-5));
    }

    #[test]
    fn frequencies_without_a_common_period_are_named() {
        let error = period("v1 1 0 sin(0 1 50)\nr1 1 0 1\nv2 2 0 sin(0 1 50.0001)\nr2 2 0 1");
        let error = error.expect_err("half a million cycles");
        assert!(error.contains("v1 and v2"), "{error}");
    }
}
