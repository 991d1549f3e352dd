//! Tables of text.

/// Columns as wide as their widest cell, two spaces apart; the first column left-aligned, the others right-aligned.
///
/// # Example
/// ```
/// let rows = vec![vec!["v(out)".into(), "1.5".into()], vec!["v(a)".into(), "-12".into()]];
/// assert_eq!(circ::report::table::aligned(&["signal", "V"], &rows), "signal    V\nv(out)  1.5\nv(a)    -12\n");
/// ```
#[must_use]
pub fn aligned(header: &[&str], rows: &[Vec<String>]) -> String {
    let header: Vec<String> = header.iter().map(|&h| h.to_owned()).collect();
    let lines = || std::iter::once(&header).chain(rows);
    let width = |j: usize| {
        lines()
            .filter_map(|r| r.get(j))
            .map(|c| c.chars().count())
            .max()
            .unwrap_or(0)
    };
    let widths: Vec<usize> = (0..header.len()).map(width).collect();
    let mut text = String::new();
    for line in lines() {
        let cells = line
            .iter()
            .zip(&widths)
            .enumerate()
            .map(|(j, (cell, &width))| {
                if j == 0 {
                    format!("{cell:<width$}")
                } else {
                    format!("{cell:>width$}")
                }
            });
        text.push_str(cells.collect::<Vec<_>>().join("  ").trim_end());
        text.push('\n');
    }
    text
}
