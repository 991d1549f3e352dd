//! What stands above the numbers of a file, and between them, as other programs write it.

use std::num::ParseFloatError;

const TIME: [&str; 4] = ["seconds", "second", "sec", "s"];
const ELECTRIC: [&str; 6] = ["Volts", "Volt", "V", "Amps", "Amp", "A"];

/// Whether a column is time in seconds, perhaps with its unit, as oscilloscopes write it.
pub(super) fn is_time(axis: &str) -> bool {
    let lower = axis.to_ascii_lowercase();
    let unit = |unit: &&str| lower.strip_suffix(*unit);
    let name = ["(s)", "[s]"].iter().find_map(unit);
    let name = name.unwrap_or(&lower).trim_end();
    matches!(name, "time" | "t" | "second" | "seconds")
}

/// What stands between cells: a tab where the line of names has one, as LTspice exports, else a semicolon or a comma; a comma of a name
/// like `V(a,b)` is none.
pub(super) fn delimiter(start: &[u8]) -> u8 {
    let mut lines = start.split(|&b| b == b'\n');
    let header = lines
        .find(|line| !line.starts_with(b"#"))
        .unwrap_or_default();
    let has = |b: &u8| header.contains(b);
    [b'\t', b';', b','].into_iter().find(has).unwrap_or(b',')
}

/// Lines above the names, in which oscilloscopes tell of themselves: those before the last line that is no numbers, where numbers follow. None
/// where the first line has a time or frequency for its first name, or no line of the beginning is of numbers.
pub(super) fn above(start: &[u8]) -> u64 {
    let text = String::from_utf8_lossy(start);
    let lines: Vec<&str> = text.lines().collect();
    let cells = |line: &str| split(line).count();
    let is_numbers = |line: &str| split(line).all(|cell| cell.parse::<f64>().is_ok());
    let first = lines.iter().position(|line| !line.starts_with('#'));
    let is_named = first.is_some_and(|k| {
        let name = split(lines[k]).next().unwrap_or_default();
        is_time(name) || name.eq_ignore_ascii_case("frequency")
    });
    let numbers = |pair: &[&str]| {
        !is_numbers(pair[0])
            && is_numbers(pair[1])
            && cells(pair[1]) > 1
            && cells(pair[0]) == cells(pair[1])
    };
    let Some(k) = lines.windows(2).position(numbers) else {
        return 0;
    };
    if is_named || first.is_none_or(|first| k <= first) {
        return 0;
    }
    // Names may have a line of units below them.
    let [names, own] = [lines[k - 1], lines[k]].map(|line| split(line).collect::<Vec<_>>());
    let is_below =
        names.len() == own.len() && is_time(names[0]) && units(own.into_iter()).is_some();
    k as u64 - u64::from(is_below)
}

/// A number, with a decimal comma too: where cells stand between commas none has one.
pub(super) fn number(cell: &str) -> Result<f64, ParseFloatError> {
    cell.parse().or_else(|_| cell.replacen(',', ".", 1).parse())
}

/// What numbers are multiplied by whose unit is one of these with a prefix, perhaps in brackets: `(ms)`, `[mV]`, `A`.
fn factor(unit: &str, known: &[&str]) -> Option<f64> {
    let unit = unit.trim_matches(['(', ')', '[', ']']);
    let is = |text: &str, base: &str| text.eq_ignore_ascii_case(base);
    if known.iter().any(|base| is(unit, base)) {
        return Some(1.0);
    }
    let (at, _) = unit.char_indices().nth(1)?;
    let (prefix, rest) = unit.split_at(at);
    let thousands = match prefix {
        "p" => -4,
        "n" => -3,
        "u" | "µ" | "μ" => -2,
        "m" => -1,
        "k" => 1,
        _ => return None,
    };
    let is_known = known.iter().any(|base| is(rest, base));
    is_known.then(|| 1000f64.powi(thousands))
}

/// What the columns are multiplied by, where a line is of units: the first is one of time, and none of the others a number.
pub(super) fn units<'c>(mut cells: impl Iterator<Item = &'c str>) -> Option<Vec<f64>> {
    let mut all = vec![factor(cells.next()?, &TIME)?];
    for cell in cells {
        if number(cell).is_ok() {
            return None;
        }
        all.push(factor(cell, &ELECTRIC).unwrap_or(1.0));
    }
    Some(all)
}

/// What tells a run of LTspice's `.step` from the others, `R=1K` of `Step Information: R=1K  (Run: 1/3)`.
pub(super) fn step(cell: &str) -> Option<&str> {
    let text = cell.strip_prefix("Step Information:")?;
    Some(text.split("(Run:").next().unwrap_or(text).trim())
}

fn split(line: &str) -> impl Iterator<Item = &str> {
    line.split(['\t', ';', ',']).map(str::trim)
}
