//! "Did you mean": the nearest known name.

use super::ast::{Expr, ExprKind};

/// The candidate nearest to a name by edit distance, if it is near enough to be a slip of the pen.
pub(crate) fn nearest<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    let limit = (name.chars().count() / 3).clamp(1, 3);
    /// More candidates are not looked at: many unknown names among many known ones would take for ever.
    const MOST: usize = 2000;
    candidates
        .into_iter()
        .take(MOST)
        .map(|candidate| (strsim::damerau_levenshtein(name, candidate), candidate))
        .filter(|&(distance, candidate)| distance > 0 && distance <= limit && candidate.len() > 1)
        .filter(|&(_, candidate)| !is_another(name, candidate))
        .min()
        .map(|(_, candidate)| candidate.to_string())
}

/// Whether two names of one length are told apart by the letters that differ: by digits alone (`r1`, `r2`), or, of two letters, by one of them
/// (`in`, `on`). Letters that changed places are a slip of the pen.
fn is_another(name: &str, candidate: &str) -> bool {
    let (own, other): (Vec<char>, Vec<char>) =
        (name.chars().collect(), candidate.chars().collect());
    let sorted = |letters: &[char]| {
        let mut letters = letters.to_vec();
        letters.sort_unstable();
        letters
    };
    let mut differing = own.iter().zip(&other).filter(|(a, b)| a != b);
    own.len() == other.len()
        && sorted(&own) != sorted(&other)
        && (own.len() < 3 || differing.all(|(a, b)| a.is_ascii_digit() && b.is_ascii_digit()))
}

/// The word for the spacing of a sweep (`list`) that a first value in its place (`lst`) was probably meant as.
pub(crate) fn spacing_meant(value: &Expr) -> Option<String> {
    match &value.kind {
        ExprKind::Name(name) => nearest(name, ["lin", "dec", "oct", "list"]),
        _ => None,
    }
}

/// The directive that a word is without its dot: `.meas` for `meas`.
pub(crate) fn directive(word: &str) -> Option<&'static str> {
    let mut all = super::dot::DIRECTIVES.into_iter();
    all.find(|directive| directive.strip_prefix('.') == Some(word))
}

/// Whether a word is a unit, with or without a prefix: `ohm`, `kohm`, `uF`, `Meg`.
pub(crate) fn is_unit(word: &str) -> bool {
    const PREFIXES: [&str; 11] = ["", "t", "g", "meg", "k", "m", "u", "µ", "n", "p", "f"];
    const UNITS: [&str; 40] = [
        "", "ohm", "ohms", "Ω", "r", "f", "farad", "farads", "fd", "h", "henry", "henries",
        "henrys", "hy", "v", "volt", "volts", "vdc", "vac", "vp", "vpk", "vpp", "vrms", "a", "amp",
        "amps", "ampere", "amperes", "adc", "aac", "s", "sec", "second", "seconds", "hz", "hertz",
        "w", "watts", "deg", "°c",
    ];
    let word = word.to_lowercase().replace('ω', "Ω");
    let rest = |prefix: &&str| word.strip_prefix(*prefix).filter(|_| !word.is_empty());
    let mut rests = PREFIXES.iter().filter_map(rest);
    rests.any(|rest| UNITS.contains(&rest))
}

/// Whether a name is one of a pattern's: `*` stands for any characters, `?` for one.
#[must_use]
pub(crate) fn is_of_pattern(name: &str, pattern: &str) -> bool {
    let (name, pattern) = (name.as_bytes(), pattern.as_bytes());
    let (mut p, mut n, mut star) = (0, 0, None);
    while n < name.len() {
        match pattern.get(p) {
            Some(b'*') => {
                star = Some((p, n));
                p += 1;
            }
            Some(&c) if c == b'?' || c == name[n] => (p, n) = (p + 1, n + 1),
            // The last star takes one character more.
            _ => match &mut star {
                Some((at, taken)) => {
                    *taken += 1;
                    (p, n) = (*at + 1, *taken);
                }
                None => return false,
            },
        }
    }
    pattern[p..].iter().all(|c| *c == b'*')
}

#[cfg(test)]
mod tests {
    use super::{is_of_pattern, is_unit, nearest};

    #[test]
    fn units_have_prefixes() {
        for unit in ["ohm", "kOhm", "uF", "Meg", "megohm", "kΩ", "ms", "V", "k"] {
            assert!(is_unit(unit), "{unit}");
        }
        for other in ["", "dc", "ideal", "ic", "out"] {
            assert!(!is_unit(other), "{other}");
        }
    }

    #[test]
    fn only_what_is_near() {
        assert_eq!(
            nearest("d1n4148", ["d1n4148a", "d1n4007"]).as_deref(),
            Some("d1n4148a")
        );
        assert_eq!(nearest("zz", ["resistance", "gain"]), None);
        assert_eq!(nearest("a", ["a"]), None);
        // Other names, and slips of the pen.
        for other in ["r2", "q1", "n12"] {
            assert_eq!(nearest("r1", [other]), None, "{other}");
        }
        assert_eq!(nearest("n001", ["n003"]), None);
        assert_eq!(nearest("r", ["r1"]).as_deref(), Some("r1"));
        assert_eq!(nearest("1n4184", ["1n4148"]).as_deref(), Some("1n4148"));
        assert_eq!(nearest("ou", ["out", "uo"]).as_deref(), Some("out"));
    }

    #[test]
    fn patterns_fit_what_they_should() {
        let fits = |pattern, name| is_of_pattern(name, pattern);
        for (pattern, name) in [
            ("*", ""),
            ("d*", "d1"),
            ("x1.*", "x1.a.b"),
            ("*out", "x.outout"),
            ("d?", "d1"),
            ("a*b*c", "abbcbc"),
        ] {
            assert!(fits(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in [
            ("d*", "r1"),
            ("d?", "d"),
            ("d?", "d12"),
            ("a*b", "abc"),
            ("x1.*", "x1"),
        ] {
            assert!(!fits(pattern, name), "{pattern} {name}");
        }
    }
}
