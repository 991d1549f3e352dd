//! Named columns over time, and the files they are written to.
//!
//! Every format has a writer on [`std::io::Write`]; CSV, raw, NPZ and JSON also read back to the same doubles, each by its own reader or by [`plots`],
//! which takes any of them.
//! [`compare`] measures how far two sets of waveforms are apart, on whatever grids they stand.

pub mod compare;
pub mod csv;
pub mod json;
pub mod npz;
mod phasors;
mod plot;
pub mod raw;
pub(crate) mod thin;

pub use phasors::Phasors;
pub use plot::{Plot, plots};

/// Results of a run: one time column and one column per probe.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Waveforms {
    /// The netlist's title.
    pub title: String,
    /// Column names, `v(out)`, without time.
    pub names: Vec<String>,
    /// Column units, `V` or `A`.
    pub units: Vec<&'static str>,
    /// Times, s, nondecreasing.
    pub time: Vec<f64>,
    /// Row-major values: `values[k * names.len() + j]` is column j at `time[k]`.
    pub values: Vec<f64>,
}

/// Why a waveform file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum WaveformError {
    /// Reading or writing itself failed.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The file is not what its format asks for.
    #[error("not a {format} file of waveforms: {reason}")]
    Malformed {
        /// `csv`, `raw`, `npz` or `json`.
        format: &'static str,
        /// What was expected and what was found.
        reason: String,
    },
}

impl WaveformError {
    fn malformed(format: &'static str, reason: impl Into<String>) -> Self {
        Self::Malformed {
            format,
            reason: reason.into(),
        }
    }
}

impl Waveforms {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// Number of columns without time.
    #[must_use]
    pub fn width(&self) -> usize {
        self.names.len()
    }

    /// The values at `time[k]`.
    #[must_use]
    pub fn row(&self, k: usize) -> &[f64] {
        &self.values[k * self.width()..(k + 1) * self.width()]
    }

    /// Column j over time.
    pub fn column(&self, j: usize) -> impl ExactSizeIterator<Item = f64> + Clone + '_ {
        let width = self.width();
        (0..self.len()).map(move |k| self.values[k * width + j])
    }

    /// How many values are no numbers (NaN), as in a file of another program, and row and column of the first; `None` where all are numbers.
    #[must_use]
    pub fn gaps(&self) -> Option<(usize, usize, usize)> {
        let first = self.values.iter().position(|v| v.is_nan())?;
        let count = self.values[first..].iter().filter(|v| v.is_nan()).count();
        Some((count, first / self.width(), first % self.width()))
    }

    /// The column with this name, however it is spelt (see [`canonical_name`]).
    #[must_use]
    pub fn find(&self, name: &str) -> Option<usize> {
        let wanted = canonical_name(name);
        self.names.iter().position(|n| canonical_name(n) == wanted)
    }

    /// The points of column j for a picture `pixels` wide: of each pixel's rows the first, lowest, highest and last.
    #[must_use]
    pub fn thinned(&self, j: usize, pixels: usize) -> Vec<(f64, f64)> {
        let points = self.time.iter().copied().zip(self.column(j));
        thin::thinned(points.collect(), pixels)
    }

    /// Puts columns that were read in any order and spelling together; units follow from the names.
    fn from_columns(
        title: String,
        names: Vec<String>,
        time: Vec<f64>,
        columns: &[Vec<f64>],
    ) -> Self {
        let units = names.iter().map(|n| unit_of(n)).collect();
        let values = (0..time.len())
            .flat_map(|k| columns.iter().map(move |c| c[k]))
            .collect();
        Self {
            title,
            names,
            units,
            time,
            values,
        }
    }
}

/// The spelling used throughout: lower case, `v(out)`, `v(a,b)`, `i(v1)`.
///
/// `V1#branch`, `@D1[i]`, `@d1[id]` and `i(@d1[id])` are the current `i(...)` of that element,
/// inside subcircuits `d.x1.d1` is `x1.d1`; a bare word is a node voltage.
///
/// # Example
/// ```
/// use circ::waveform::canonical_name;
/// assert_eq!(canonical_name("V1#branch"), "i(v1)");
/// assert_eq!(canonical_name("i(@d1[id])"), "i(d1)");
/// assert_eq!(canonical_name("V( a , b )"), "v(a,b)");
/// assert_eq!(canonical_name("out"), "v(out)");
/// ```
#[must_use]
pub fn canonical_name(name: &str) -> String {
    let name: String = name
        .chars()
        .filter(|c| !c.is_whitespace())
        .flat_map(char::to_lowercase)
        .collect();
    let inner = name
        .strip_prefix("i(")
        .and_then(|n| n.strip_suffix(')'))
        .unwrap_or(&name);
    if let Some((device, quantity)) = inner.strip_prefix('@').and_then(|n| n.split_once('['))
        && matches!(quantity, "i]" | "id]" | "current]")
    {
        return format!("i({})", without_letter(device));
    }
    if let Some(element) = inner.strip_suffix("#branch") {
        return format!("i({})", without_letter(element));
    }
    if inner.len() < name.len() {
        return format!("i({})", without_letter(inner));
    }
    if name.contains('(') {
        name
    } else {
        format!("v({name})")
    }
}

/// `x1.d1` for ngspice's `d.x1.d1`.
fn without_letter(element: &str) -> &str {
    let Some((letter, path)) = element.split_once('.') else {
        return element;
    };
    let last = path.rsplit('.').next().unwrap_or(path);
    if letter.len() == 1 && path.starts_with('x') && path != last && last.starts_with(letter) {
        path
    } else {
        element
    }
}

/// `A` for currents, `V` for everything else, by the canonical name.
#[must_use]
pub fn unit_of(name: &str) -> &'static str {
    if canonical_name(name).starts_with("i(") {
        "A"
    } else {
        "V"
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Two columns with a jump at t = 1, awkward numbers and a name that needs quoting in CSV.
    pub(crate) fn sample() -> Waveforms {
        Waveforms {
            title: "a jump & <awkward> numbers".into(),
            names: vec!["v(a,b)".into(), "i(v1)".into()],
            units: vec!["V", "A"],
            time: vec![0.0, 0.1, 1.0, 1.0, 1.0 + f64::EPSILON],
            values: vec![
                0.1,
                -1e-300,
                1.0 / 3.0,
                f64::MIN_POSITIVE,
                -0.0,
                1e300,
                5e-324,
                f64::MAX,
                -2.0f64.sqrt(),
                1e-15,
            ],
        }
    }

    #[test]
    fn columns_rows_and_names_address_the_same_numbers() {
        let w = sample();
        assert_eq!(
            w.column(1).collect::<Vec<_>>(),
            [-1e-300, f64::MIN_POSITIVE, 1e300, f64::MAX, 1e-15]
        );
        assert_eq!(w.row(1), [1.0 / 3.0, f64::MIN_POSITIVE]);
        assert_eq!(w.find("V1#BRANCH"), Some(1));
        assert_eq!(w.find("v(a)"), None);
    }

    #[test]
    fn other_programs_spellings_are_understood() {
        for (given, canonical) in [
            ("v(OUT)", "v(out)"),
            ("OUT", "v(out)"),
            ("l1#branch", "i(l1)"),
            ("i(v1)", "i(v1)"),
            ("@d1[i]", "i(d1)"),
            ("@d.x1.d1[id]", "i(x1.d1)"),
            ("V.X1.XA.V2#branch", "i(x1.xa.v2)"),
            ("i(d.x1.r1)", "i(d.x1.r1)"),
            ("@d1[vd]", "v(@d1[vd])"),
            ("I(L1)", "i(l1)"),
        ] {
            assert_eq!(canonical_name(given), canonical);
        }
    }
}
