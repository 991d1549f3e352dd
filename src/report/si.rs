//! Numbers with SI prefixes.

const PREFIXES: [(i32, &str); 11] = [
    (-18, "a"),
    (-15, "f"),
    (-12, "p"),
    (-9, "n"),
    (-6, "µ"),
    (-3, "m"),
    (0, ""),
    (3, "k"),
    (6, "M"),
    (9, "G"),
    (12, "T"),
];

/// The prefix in which `magnitude` reads as 1 to 999, and the power of ten it stands for.
#[must_use]
pub fn prefix(magnitude: f64) -> (f64, &'static str) {
    let exponent = if magnitude == 0.0 {
        0.0
    } else {
        (magnitude.abs().log10() + 1e-12).floor()
    };
    let chosen = PREFIXES
        .iter()
        .rev()
        .find(|(e, _)| f64::from(*e) <= exponent)
        .unwrap_or(&PREFIXES[0]);
    (10f64.powi(chosen.0), chosen.1)
}

/// A value with prefix and unit, `digits` significant digits: `12.5 µs`.
///
/// # Example
/// ```
/// use circ::report::si::quantity;
/// assert_eq!(quantity(1.25e-5, "s", 4), "12.5 µs");
/// assert_eq!(quantity(-0.0, "V", 3), "0 V");
/// ```
#[must_use]
pub fn quantity(value: f64, unit: &str, digits: usize) -> String {
    let rounded = format!("{value:.*e}", digits.saturating_sub(1))
        .parse()
        .unwrap_or(value);
    let (factor, prefix) = prefix(rounded);
    format!("{} {prefix}{unit}", plain(value / factor, digits))
}

/// A number with so many significant digits, without trailing zeros; exponents only outside 1e-4 … 1e6.
#[must_use]
pub fn plain(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let exponent = value.abs().log10().floor() as i32;
    if !(-4..6).contains(&exponent) {
        let text = format!("{:.*e}", digits.saturating_sub(1), value);
        return match text.split_once('e') {
            Some((mantissa, exponent)) => format!("{}e{exponent}", trimmed(mantissa)),
            None => text,
        };
    }
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    trimmed(&format!("{value:.decimals$}")).to_owned()
}

fn trimmed(number: &str) -> &str {
    if number.contains('.') {
        number.trim_end_matches('0').trim_end_matches('.')
    } else {
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn engineers_read_these() {
        for (value, text) in [
            (0.0, "0 V"),
            (1.0, "1 V"),
            (999.96, "1 kV"),
            (1e3, "1 kV"),
            (-4.7e-6, "-4.7 µV"),
            (1e-3, "1 mV"),
            (1e-18, "1 aV"),
            (2e-24, "2e-6 aV"),
            (1e15, "1000 TV"),
            (7.692_307_692, "7.692 V"),
        ] {
            assert_eq!(quantity(value, "V", 4), text, "{value:e}");
        }
    }

    #[test]
    fn digits_are_significant_ones() {
        assert_eq!(plain(1234.5678, 6), "1234.57");
        assert_eq!(plain(1.5e-9, 3), "1.5e-9");
        assert_eq!(plain(0.1 + 0.2, 5), "0.3");
    }
}
