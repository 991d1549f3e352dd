//! Numbers as SPICE writes them: `4.7k`, `10uF`, `1e-6`, `4k7`, kept as exact decimals.

use std::fmt;

use super::suggest::is_unit;
use crate::algebra::Value;

/// Why a text is not a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NumberError {
    /// No digits where a number should start.
    NoDigits,
    /// `1e` or `1e+`.
    Exponent,
    /// Characters that belong neither to a suffix nor to a unit start at this byte.
    Junk(usize),
    /// Larger than any double.
    TooLarge,
    /// Not zero, but smaller than any double.
    TooSmall,
}

impl fmt::Display for NumberError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoDigits => "a number needs digits",
            Self::Exponent => "the exponent has no digits",
            Self::Junk(_) => "this does not belong to the number",
            Self::TooLarge => "the number is too large for a double",
            Self::TooSmall => "the number is too small for a double",
        })
    }
}

/// A number: `[sign] digits [. digits] [e exponent] [suffix] [unit letters]` or `digits suffix digits` (`4k7` = 4.7k).
///
/// Suffixes, any case: `t g meg k mil m u µ n p f a`; `mil` is 25.4·10⁻⁶. Letters after the suffix, or letters that are
/// no suffix (`5ohm`, `10uF`, `5Vdc`), are a unit and change nothing. `a` is a suffix before a unit alone (`5aF`): `5A` and `5amps`
/// are ampere.
///
/// # Errors
/// What keeps the text from being a number, and where.
pub fn parse(text: &str) -> Result<Value, NumberError> {
    let (value, length) = prefix(text)?;
    if length == text.len() {
        Ok(value)
    } else {
        Err(NumberError::Junk(length))
    }
}

/// The number at the start of a text and its length in bytes; takes as many letters and digits as follow.
///
/// # Errors
/// As for [`parse`].
pub fn prefix(text: &str) -> Result<(Value, usize), NumberError> {
    let digits = |from: usize| text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let negative = text.starts_with('-');
    let mut at = usize::from(text.starts_with(['-', '+']));

    let whole = at..at + digits(at);
    at = whole.end;
    let mut fraction = at..at;
    let point = text[at..].starts_with('.');
    if point {
        fraction = at + 1..at + 1 + digits(at + 1);
        at = fraction.end;
    }
    if whole.is_empty() && fraction.is_empty() {
        return Err(NumberError::NoDigits);
    }

    let mut exponent = 0_i64;
    let mut has_exponent = false;
    if text[at..].starts_with(['e', 'E']) {
        let sign = text[at + 1..].starts_with(['-', '+']);
        let start = at + 1 + usize::from(sign);
        let length = digits(start);
        if length > 0 {
            let value: i64 = text[start..start + length]
                .parse()
                .unwrap_or(i64::from(i32::MAX));
            exponent = if text[at + 1..].starts_with('-') {
                -value
            } else {
                value
            };
            has_exponent = true;
            at = start + length;
        } else if sign || !text[start..].starts_with(char::is_alphabetic) {
            return Err(NumberError::Exponent);
        }
    }

    let (suffix, suffix_length) = suffix(&text[at..]);
    let after_suffix = at + suffix_length;
    let rkm_length = digits(after_suffix);
    let mut rkm = after_suffix..after_suffix;
    if suffix_length > 0 && rkm_length > 0 && !point && !has_exponent {
        rkm.end = after_suffix + rkm_length;
        at = rkm.end;
        let unit = letters(&text[at..]);
        if UNITS.contains(&text[at..at + unit].to_lowercase().as_str()) {
            at += unit;
        } else if unit > 0 {
            return Err(NumberError::Junk(at));
        }
    } else {
        at += letters(&text[at..]);
        if digits(at) > 0 {
            return Err(NumberError::Junk(at));
        }
    }

    let places = (fraction.len() + rkm.len()) as i64;
    let (factor, power) = suffix.unwrap_or((1, 0));
    let all: String = [&text[whole], &text[fraction], &text[rkm]].concat();
    decimal(negative, &all, factor, exponent + power - places).map(|value| (value, at))
}

/// The decimal rational ± digits · factor · 10^exponent and its nearest double.
fn decimal(
    negative: bool,
    digits: &str,
    factor: i128,
    exponent: i64,
) -> Result<Value, NumberError> {
    let trimmed = digits.trim_start_matches('0');
    let kept = trimmed.trim_end_matches('0');
    let exponent = exponent + (trimmed.len() - kept.len()) as i64;
    let sign = if negative { "-" } else { "" };
    let mantissa = if kept.is_empty() {
        Some(0)
    } else {
        kept.parse::<i128>().ok()
    };
    let mantissa = mantissa
        .and_then(|m| m.checked_mul(factor))
        .map(|m| if negative { -m } else { m });

    let nearest = match mantissa {
        Some(0) => 0.0,
        Some(m) => format!("{m}e{exponent}").parse().unwrap_or(f64::NAN),
        // More digits than an i128 holds: the nearest double alone (times the factor of `mil`).
        None => {
            format!("{sign}{kept}e{exponent}")
                .parse()
                .unwrap_or(f64::NAN)
                * factor as f64
        }
    };
    if !nearest.is_finite() {
        Err(NumberError::TooLarge)
    } else if nearest == 0.0 && mantissa != Some(0) {
        Err(NumberError::TooSmall)
    } else {
        Ok(match (mantissa, i32::try_from(exponent)) {
            (Some(0), _) => Value::decimal(0.0, 0, 0),
            (Some(mantissa), Ok(exponent)) => Value::decimal(nearest, mantissa, exponent),
            _ => Value::binary(nearest),
        })
    }
}

/// Units that may follow the digits of `4k7ohm`.
const UNITS: [&str; 10] = ["", "ohm", "ohms", "ω", "f", "h", "v", "a", "s", "hz"];

/// The letters behind a number that are no unit: the `O` of `22O`, the `u` of `33uu`.
pub(super) fn no_unit(text: &str) -> Option<&str> {
    let ending = text.trim_start_matches(|c: char| !c.is_alphabetic() && c != '°');
    let (_, length) = suffix(ending);
    let unit = &ending[length..];
    let is_odd = !unit.is_empty() && letters(ending) == ending.len() && !is_unit(ending);
    is_odd.then_some(unit)
}

/// The factor, power of ten and length of a suffix; `r` (as in `4r7`) counts as a decimal point before digits.
fn suffix(text: &str) -> (Option<(i128, i64)>, usize) {
    let lower = |n: usize| text.get(..n).map(str::to_ascii_lowercase);
    if lower(3).as_deref() == Some("meg") {
        return (Some((1, 6)), 3);
    }
    if lower(3).as_deref() == Some("mil") {
        return (Some((254, -7)), 3);
    }
    let Some(first) = text.chars().next() else {
        return (None, 0);
    };
    let power = match first.to_ascii_lowercase() {
        't' => 12,
        'g' => 9,
        'k' => 3,
        'm' => -3,
        'u' | 'µ' | 'μ' => -6,
        'n' => -9,
        'p' => -12,
        'f' => -15,
        'a' if !is_ampere(text) => -18,
        'r' if text[1..].starts_with(|c: char| c.is_ascii_digit()) => 0,
        _ => return (None, 0),
    };
    (Some((1, power)), first.len_utf8())
}

/// Whether these letters are the unit A.
fn is_ampere(text: &str) -> bool {
    let unit = &text[..letters(text)];
    matches!(
        unit.to_ascii_lowercase().as_str(),
        "a" | "amp" | "amps" | "ampere" | "amperes"
    )
}

/// The length of the letters at the start of a text (a unit: `Hz`, `Ω`, `°C`).
fn letters(text: &str) -> usize {
    text.chars()
        .take_while(|c| c.is_alphabetic() || *c == '°' || *c == '_')
        .map(char::len_utf8)
        .sum()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn letters_that_are_no_unit() {
        let odd = ["22O", "33uu", "33x", "1pk", "-4.7kk"].map(|text| no_unit(text));
        assert_eq!(odd, [Some("O"), Some("u"), Some("x"), Some("k"), Some("k")]);
        let usual = "4.7 10k 4k7 4k7ohm 10uF 1fF 5F 5H 3mH 1Meg 1MegOhm 5Vdc 10R 5amps 5A 1mil 25°C 50Hz 1ms 10Ω 1e3 1e-6s";
        for text in usual.split(' ') {
            assert_eq!(no_unit(text), None, "{text}");
        }
    }

    #[test]
    fn suffixes_and_units() {
        for (text, expected, exact) in [
            ("4.7k", 4700.0, (47, 2)),
            ("10uF", 1e-5, (1, -5)),
            ("10µ", 1e-5, (1, -5)),
            ("10μF", 1e-5, (1, -5)),
            ("1Meg", 1e6, (1, 6)),
            ("1MegOhm", 1e6, (1, 6)),
            ("1mil", 25.4e-6, (254, -7)),
            ("1M", 1e-3, (1, -3)),
            ("1F", 1e-15, (1, -15)),
            ("2aF", 2e-18, (2, -18)),
            ("2a", 2.0, (2, 0)),
            ("2A", 2.0, (2, 0)),
            ("2mA", 2e-3, (2, -3)),
            ("2amps", 2.0, (2, 0)),
            ("5Vdc", 5.0, (5, 0)),
            ("5ohm", 5.0, (5, 0)),
            ("50Hz", 50.0, (5, 1)),
            ("1e-6", 1e-6, (1, -6)),
            ("1E3k", 1e6, (1, 6)),
            ("-.5", -0.5, (-5, -1)),
            ("+3.", 3.0, (3, 0)),
            ("3t", 3e12, (3, 12)),
            ("3g", 3e9, (3, 9)),
            ("100n", 1e-7, (1, -7)),
            ("1ms", 1e-3, (1, -3)),
        ] {
            let value = parse(text).unwrap();
            assert_eq!(value, Value::decimal(expected, exact.0, exact.1), "{text}");
        }
        assert_eq!(parse("0.000"), Ok(Value::decimal(0.0, 0, 0)));
    }

    #[test]
    fn suffix_as_the_decimal_point() {
        for (text, expected) in [
            ("4k7", 4700.0),
            ("1m01", 1.01e-3),
            ("2R2", 2.2),
            ("1Meg5", 1.5e6),
            ("-3u3", -3.3e-6),
            ("4k7ohm", 4700.0),
        ] {
            assert_eq!(parse(text).unwrap().f64, expected, "{text}");
        }
    }

    #[test]
    fn faults() {
        assert_eq!(parse(""), Err(NumberError::NoDigits));
        assert_eq!(parse("-"), Err(NumberError::NoDigits));
        assert_eq!(parse("."), Err(NumberError::NoDigits));
        assert_eq!(parse("1,5k"), Err(NumberError::Junk(1)));
        assert_eq!(parse("1k5x"), Err(NumberError::Junk(3)));
        assert_eq!(parse("10uF50"), Err(NumberError::Junk(4)));
        assert_eq!(parse("2*3"), Err(NumberError::Junk(1)));
        assert_eq!(parse("1e400"), Err(NumberError::TooLarge));
        assert_eq!(parse("1e99999999999"), Err(NumberError::TooLarge));
        assert_eq!(parse("1e-400"), Err(NumberError::TooSmall));
        assert_eq!(parse("1e"), Err(NumberError::Exponent));
        assert_eq!(parse("1e+"), Err(NumberError::Exponent));
    }

    #[test]
    fn more_digits_than_an_integer_holds() {
        let text = "3.14159265358979323846264338327950288419716939937510";
        assert_eq!(parse(text).unwrap(), Value::binary(std::f64::consts::PI));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), ..ProptestConfig::default() })]

        #[test]
        fn agrees_with_the_standard_library(text in r"[-+]?([0-9]{1,25}(\.[0-9]{0,25})?|\.[0-9]{1,25})([eE][-+]?[0-9]{1,2})?") {
            let ours = parse(&text).unwrap();
            prop_assert_eq!(ours.f64, text.parse::<f64>().unwrap());
        }

        #[test]
        fn the_decimal_is_the_number(text in r"[-+]?[0-9]{1,12}(\.[0-9]{0,9})?(t|g|meg|k|m|u|n|p|f|a)?(ohm|V|Hz)?") {
            let value = parse(&text).unwrap();
            let (mantissa, exponent) = value.as_decimal().unwrap();
            prop_assert_eq!(format!("{mantissa}e{exponent}").parse::<f64>().unwrap(), value.f64);
        }

        #[test]
        fn never_panics(text in r"\PC{0,12}") {
            let _ = parse(&text);
        }

        #[test]
        fn never_panics_near_numbers(text in r"[-+.0-9eEkKmMuµnrRxX,Ω ]{0,10}") {
            if let Ok((_, length)) = prefix(&text) {
                prop_assert!(text.is_char_boundary(length));
            }
        }
    }
}
