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

#[cfg(test)]
mod tests {
    use super::nearest;

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
