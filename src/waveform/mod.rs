//! Named columns over time, and the files they are written to.

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
