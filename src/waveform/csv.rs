//! Comma-separated values: `time,v(out),…` with 17 significant digits.

mod head;
mod read;

use std::io::Write;

use super::Waveforms;
pub(super) use read::plot;
pub use read::read;

/// Writes rows as they come; names that hold a comma, such as `v(a,b)`, are quoted.
pub struct Writer<W: Write> {
    to: W,
}

impl<W: Write> Writer<W> {
    /// Writes the header `time,` and the names.
    ///
    /// # Errors
    /// Those of `to`.
    pub fn new(to: W, names: &[String]) -> std::io::Result<Self> {
        Self::over(to, "time", names)
    }

    /// The same over another quantity than time, such as a swept voltage.
    ///
    /// # Errors
    /// Those of `to`.
    pub fn over(mut to: W, axis: &str, names: &[String]) -> std::io::Result<Self> {
        header(&mut to, axis, names)?;
        Ok(Self { to })
    }

    /// Writes one row: time (or what stands in its place), then the values.
    ///
    /// # Errors
    /// Those of the target.
    pub fn row(&mut self, time: f64, values: &[f64]) -> std::io::Result<()> {
        row(&mut self.to, time, values)
    }
}

/// Writes the header: the axis, `time` or what stands in its place, then the names.
///
/// # Errors
/// Those of `to`.
pub fn header(to: &mut impl Write, axis: &str, names: &[String]) -> std::io::Result<()> {
    write!(to, "{axis}")?;
    for name in names {
        if name.contains([',', '"', '\n']) {
            write!(to, ",\"{}\"", name.replace('"', "\"\""))?;
        } else {
            write!(to, ",{name}")?;
        }
    }
    to.write_all(b"\n")
}

/// Writes one row: time (or what stands in its place), then the values.
///
/// # Errors
/// Those of `to`.
pub fn row(to: &mut impl Write, time: f64, values: &[f64]) -> std::io::Result<()> {
    let mut line = Vec::with_capacity((values.len() + 1) * LONGEST);
    cell(time, &mut line);
    for &value in values {
        line.push(b',');
        cell(value, &mut line);
    }
    line.push(b'\n');
    to.write_all(&line)
}

/// Significant digits of a cell.
const DIGITS: usize = 17;
/// Bytes of the longest cell and what follows it: a sign, digits with their point, and an exponent of three digits with its sign.
const LONGEST: usize = DIGITS + 8;

/// Appends a number as a cell, `-1.2500000000000000e-3`: the fewest digits that read back to the same double, and zeros up to [`DIGITS`] of
/// them.
pub(crate) fn cell(value: f64, text: &mut Vec<u8>) {
    let mut buffer = zmij::Buffer::new();
    let mut number = buffer.format(value).as_bytes();
    if !value.is_finite() {
        return text.extend_from_slice(number);
    }
    if let [b'-', rest @ ..] = number {
        text.push(b'-');
        number = rest;
    }
    // 12.5, 0.00125 or 1.25e-7; an exponent has three digits and a sign at most.
    let tail = number.len().saturating_sub(5);
    let e = number[tail..].iter().position(|byte| *byte == b'e');
    let (mantissa, exponent) = number.split_at(e.map_or(number.len(), |e| tail + e));
    let point = mantissa.iter().position(|byte| *byte == b'.');
    let (whole, part) = mantissa.split_at(point.unwrap_or(mantissa.len()));
    let part = part.get(1..).unwrap_or_default();
    let zeros = part.iter().take_while(|byte| **byte == b'0').count();
    let (first, rest, power) = match whole {
        [b'0', ..] if zeros == part.len() => (&whole[..1], part, 0),
        [b'0', ..] => {
            let (first, rest) = part[zeros..].split_at(1);
            (first, rest, -(zeros as i32) - 1)
        }
        _ => (whole, part, whole.len() as i32 - 1),
    };
    let from = text.len();
    text.push(first[0]);
    text.push(b'.');
    text.extend_from_slice(&first[1..]);
    text.extend_from_slice(rest);
    text.resize(from + DIGITS + 1, b'0');
    let written = std::str::from_utf8(exponent.get(1..).unwrap_or_default());
    let power = power + written.ok().and_then(|e| e.parse().ok()).unwrap_or(0);
    text.push(b'e');
    if power < 0 {
        text.push(b'-');
    }
    let power = power.unsigned_abs();
    for place in [100, 10, 1] {
        if power >= place || place == 1 {
            text.push(b'0' + (power / place % 10) as u8);
        }
    }
}

/// Writes all rows.
///
/// # Errors
/// Those of `to`.
///
/// # Example
/// ```
/// use circ::waveform::{Waveforms, csv};
/// let waves = Waveforms { names: vec!["v(a)".into()], units: vec!["V"], time: vec![0.5], values: vec![0.1], ..Default::default() };
/// let mut text = Vec::new();
/// csv::write(&mut text, &waves).unwrap();
/// assert_eq!(String::from_utf8(text).unwrap(), "time,v(a)\n5.0000000000000000e-1,1.0000000000000000e-1\n");
/// ```
pub fn write(to: impl Write, waves: &Waveforms) -> std::io::Result<()> {
    let mut writer = Writer::new(to, &waves.names)?;
    for (k, &time) in waves.time.iter().enumerate() {
        writer.row(time, waves.row(k))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::tests::sample;
    use super::*;

    #[test]
    fn what_is_written_reads_back_to_the_same_doubles() {
        let mut text = Vec::new();
        write(&mut text, &sample()).unwrap();
        let back = read(&text[..]).unwrap();
        assert_eq!(
            back,
            Waveforms {
                title: String::new(),
                ..sample()
            }
        );
        assert!(
            String::from_utf8(text)
                .unwrap()
                .starts_with("time,\"v(a,b)\",i(v1)\n0.0000000000000000e0,")
        );
    }

    #[test]
    fn cells_have_seventeen_digits_that_read_back() {
        let of = |value: f64| {
            let mut text = Vec::new();
            cell(value, &mut text);
            String::from_utf8(text).unwrap()
        };
        for (value, text) in [
            (0.0, "0.0000000000000000e0"),
            (-0.0, "-0.0000000000000000e0"),
            (0.1, "1.0000000000000000e-1"),
            (-12.5, "-1.2500000000000000e1"),
            (1e-7, "1.0000000000000000e-7"),
            (1e22, "1.0000000000000000e22"),
            (123_456_789_012_345_680_000.0, "1.2345678901234568e20"),
            (0.000_123_4, "1.2340000000000000e-4"),
            (f64::MAX, "1.7976931348623157e308"),
            (f64::from_bits(1), "5.0000000000000000e-324"),
        ] {
            assert_eq!(of(value), text);
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits());
        }
        assert!(of(f64::NAN).parse::<f64>().unwrap().is_nan());
        assert_eq!(of(f64::NEG_INFINITY), "-inf");
        // Bits without a pattern.
        let mut bits = 0x0123_4567_89ab_cdef_u64;
        for _ in 0..10_000 {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let value = f64::from_bits(bits);
            if value.is_finite() {
                let text = of(value);
                assert_eq!(text.parse::<f64>().unwrap().to_bits(), bits, "{text}");
                let digits = text.split('e').next().unwrap().bytes();
                assert_eq!(digits.filter(u8::is_ascii_digit).count(), DIGITS, "{text}");
            }
        }
    }
}
