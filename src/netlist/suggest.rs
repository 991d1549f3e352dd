//! "Did you mean": the nearest known name.

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
        .min()
        .map(|(_, candidate)| candidate.to_string())
}

/// Whether a word is a unit, with or without a prefix: `ohm`, `kohm`, `uF`, `Meg`.
pub(crate) fn is_unit(word: &str) -> bool {
    const PREFIXES: [&str; 11] = ["", "t", "g", "meg", "k", "m", "u", "µ", "n", "p", "f"];
    const UNITS: [&str; 14] = [
        "", "ohm", "ohms", "Ω", "f", "farad", "h", "henry", "v", "volt", "a", "s", "hz", "w",
    ];
    let word = word.to_lowercase().replace('ω', "Ω");
    let rest = |prefix: &&str| word.strip_prefix(*prefix).filter(|_| !word.is_empty());
    let mut rests = PREFIXES.iter().filter_map(rest);
    rests.any(|rest| UNITS.contains(&rest))
}

#[cfg(test)]
mod tests {
    use super::{is_unit, nearest};

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
    }
}
