//! What the values of options are read by.

use std::path::PathBuf;

use super::Assigned;

/// A number with SPICE's suffixes: `1u`, `4k7`, `2.2e-6`.
pub(super) fn number(text: &str) -> Result<f64, String> {
    crate::netlist::value::parse(text)
        .map(|v| v.f64)
        .map_err(|e| e.to_string())
}

/// `ngspice`, or a csv file of what was measured of other programs.
pub(super) fn program_or_points(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_csv = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("csv"));
    if text == "ngspice" || is_csv {
        return Ok(path);
    }
    Err("must be `ngspice`, or a csv file in the columns of `circ bench`".into())
}

/// A name, of a signal or a pattern.
pub(super) fn named(text: &str) -> Result<String, String> {
    if text.trim().is_empty() {
        return Err("a name is missing".into());
    }
    Ok(text.to_owned())
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(|x| {
        if x > 0.0 {
            Ok(x)
        } else {
            Err("must be positive".into())
        }
    })
}

pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    number(text).and_then(|x| {
        if x >= 0.0 {
            Ok(x)
        } else {
            Err("must not be negative".into())
        }
    })
}

pub(super) fn implicitness(text: &str) -> Result<f64, String> {
    number(text).and_then(|x| {
        if (0.5..=1.0).contains(&x) {
            Ok(x)
        } else {
            Err("must be in [0.5, 1]".into())
        }
    })
}

/// `r1=5%`, or the part itself, `r1=0.05`.
pub(super) fn tolerance(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=5%")?;
    let value = match value.trim().strip_suffix('%') {
        Some(percent) => 0.01 * not_negative(percent)?,
        None => match not_negative(value.trim())? {
            part if part < 1.0 => part,
            part => {
                return Err(format!(
                    "{part} is {} %: write `{part}%` for {part} %, or a part below 1",
                    100.0 * part
                ));
            }
        },
    };
    Ok((name.trim().to_lowercase(), value))
}

/// `r=1k`, `r=1k,2k`, `r=lin:1k:2k:11`, `r=log:1:100:7`.
pub(super) fn assignment(text: &str) -> Result<Assigned, String> {
    let (name, values) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    let parts: Vec<&str> = values.split(':').collect();
    let values = match parts[..] {
        [kind @ ("lin" | "log"), first, last, count] => {
            let (first, last) = (number(first.trim())?, number(last.trim())?);
            let count = count.trim().parse::<usize>().ok().filter(|n| (2..=MOST_VALUES).contains(n));
            let count = count.ok_or(format!("expected a number of values from 2 to {MOST_VALUES}"))?;
            spaced(kind == "log", (first, last), count)?
        }
        [list] => {
            let values = list.split(',').map(|value| number(value.trim()));
            values.collect::<Result<_, _>>()?
        }
        _ => return Err("expected a value, or several as `1k,2k`, `lin:FIRST:LAST:COUNT` or `log:FIRST:LAST:COUNT`".into()),
    };
    let milli = parts.iter().flat_map(|part| part.split(',')).map(str::trim);
    let milli = milli.filter_map(|part| Some((part, part.strip_suffix('M')?)));
    let mut milli =
        milli.filter(|(_, digits)| digits.ends_with(|c: char| c.is_ascii_digit() || c == '.'));
    let milli = milli.next().map(|(part, _)| part.to_owned());
    let name = name.trim().to_lowercase();
    Ok(Assigned {
        name,
        values,
        milli,
    })
}

/// Most values of one name in a sweep.
const MOST_VALUES: usize = 1_000_000;

/// So many values, the first and the last among them exactly.
fn spaced(by_ratio: bool, (first, last): (f64, f64), count: usize) -> Result<Vec<f64>, String> {
    if by_ratio && first * last <= 0.0 {
        return Err("a logarithmic sweep needs values of one sign".into());
    }
    let value = |k: usize| {
        let part = k as f64 / (count - 1) as f64;
        match k {
            0 => first,
            k if k + 1 == count => last,
            _ if by_ratio => first * (last / first).powf(part),
            _ => first + (last - first) * part,
        }
    };
    Ok((0..count).map(value).collect())
}

/// The name of standard input in messages.
pub const STDIN: &str = "<stdin>";

pub(super) fn readable(text: &str) -> Result<PathBuf, String> {
    Ok(PathBuf::from(if text == "-" { STDIN } else { text }))
}

pub(super) fn folder(text: &str) -> Result<PathBuf, String> {
    let folder = PathBuf::from(text);
    if folder.is_dir() {
        Ok(folder)
    } else {
        Err("there is no such folder".into())
    }
}

pub(super) fn position(text: &str) -> Result<(String, bool), String> {
    let (name, position) = text.split_once('=').ok_or("expected NAME=on or NAME=off")?;
    let on = match position.trim().to_ascii_lowercase().as_str() {
        "on" | "1" | "closed" => true,
        "off" | "0" | "open" => false,
        other => return Err(format!("`{other}` is neither on nor off")),
    };
    Ok((name.trim().to_lowercase(), on))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_take_suffixes_and_ranges_hold() {
        assert_eq!(positive("1u"), Ok(1e-6));
        let assigned = |text| assignment(text).map(|a| (a.name, a.values));
        assert_eq!(assigned("R=4k7"), Ok(("r".into(), vec![4700.0])));
        assert_eq!(assigned("r=lin:1:2:3").unwrap().1, [1.0, 1.5, 2.0]);
        assert_eq!(assigned("r=log:1:4:3").unwrap().1, [1.0, 2.0, 4.0]);
        assert_eq!(position("S1=ON"), Ok(("s1".into(), true)));
        for refused in ["0", "-1u", "x", ""] {
            assert!(positive(refused).is_err(), "{refused}");
        }
        assert!(named(" ").is_err() && named("v(a)").is_ok());
        assert!(implicitness("0.4").is_err() && implicitness("1").is_ok());
        assert!(assignment("r").is_err() && position("s1=half").is_err());
    }
}
