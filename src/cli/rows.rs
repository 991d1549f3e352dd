//! Rows of a run on their way to files and standard output, written as they come.

use std::io::{self, Write};

use super::exit::Failure;
use super::files::Written;
use super::input::Subject;
use crate::circuit::Circuit;
use crate::integrate::{Block, RowKind};
use crate::waveform::{Waveforms, csv, raw, unit_of};

/// Which rows a result shows besides those of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shown {
    /// Those at events.
    pub events: bool,
    /// Those at corners of sources.
    pub corners: bool,
}

impl Shown {
    fn has(self, kind: RowKind) -> bool {
        match kind {
            RowKind::Grid | RowKind::Both => true,
            RowKind::Event => self.events,
            RowKind::Corner => self.corners,
            RowKind::Between => false,
        }
    }

    /// The rows that are shown.
    pub(super) fn of(self, waves: &Waveforms, kinds: &[RowKind]) -> Waveforms {
        let mut shown = Waveforms {
            title: waves.title.clone(),
            names: waves.names.clone(),
            units: waves.units.clone(),
            ..Waveforms::default()
        };
        for (t, values, kind) in Block::of(waves, kinds).rows() {
            if self.has(kind) {
                shown.time.push(t);
                shown.values.extend_from_slice(values);
            }
        }
        shown
    }
}

/// What the columns are.
#[derive(Debug, Clone)]
pub(super) struct Columns {
    /// The netlist's title.
    pub title: String,
    /// Names without time.
    pub names: Vec<String>,
    /// `V`, `A`.
    pub units: Vec<&'static str>,
}

impl Columns {
    /// Those of these rows.
    pub(super) fn of(waves: &Waveforms) -> Self {
        Self {
            title: waves.title.clone(),
            names: waves.names.clone(),
            units: waves.units.clone(),
        }
    }

    /// Those that a run of this circuit will have.
    pub(super) fn of_circuit(circuit: &Circuit) -> Self {
        if !circuit.columns.is_empty() {
            return Self {
                title: circuit.title.clone(),
                names: circuit.columns.iter().map(|c| c.name.clone()).collect(),
                units: circuit.columns.iter().map(|c| c.unit).collect(),
            };
        }
        let names: Vec<String> = circuit.probes().into_iter().map(|p| p.name).collect();
        Self {
            title: circuit.title.clone(),
            units: names.iter().map(|name| unit_of(name)).collect(),
            names,
        }
    }

    /// Those that a run will have.
    pub(super) fn of_subject(subject: &Subject) -> Self {
        match subject {
            Subject::Circuit(model) => Self::of_circuit(model.circuit()),
            Subject::System(system) => {
                let lcs = &system.lcs;
                Self {
                    title: lcs.title.clone(),
                    names: lcs.outputs.names.clone(),
                    units: lcs.outputs.units.clone(),
                }
            }
        }
    }
}

/// Formats that are written as rows come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// Comma-separated values.
    Csv,
    /// ngspice's binary format.
    Raw,
}

/// Rows on their way to one place.
#[derive(Debug)]
pub(super) struct Stream {
    form: Form,
    /// Standard output without.
    file: Option<Written>,
    shown: Shown,
    columns: Columns,
    begun: bool,
    /// Rows written.
    rows: u64,
    /// Time of the last, s.
    last: Option<f64>,
    text: Vec<u8>,
    failure: Option<Failure>,
}

impl Stream {
    /// To a file, or to standard output without one. Raw needs a file that can be changed at its start.
    pub(super) fn new(form: Form, file: Option<Written>, shown: Shown, columns: Columns) -> Self {
        Self {
            form,
            file,
            shown,
            columns,
            begun: false,
            rows: 0,
            last: None,
            text: Vec::new(),
            failure: None,
        }
    }

    /// Time of the last row written, s.
    pub(super) fn last(&self) -> Option<f64> {
        self.last
    }

    /// The first failure to write; nothing is written after it.
    pub(super) fn failure(&mut self) -> Option<Failure> {
        self.failure.take()
    }

    /// Writes the rows that are shown; whether that worked.
    pub(super) fn take(&mut self, block: Block<'_>) -> bool {
        if self.failure.is_some() {
            return false;
        }
        self.text.clear();
        if !self.begun {
            self.text = self.header(None);
            self.begun = true;
        }
        let (rows, last) = (self.rows, self.last);
        for (t, values, kind) in block.rows() {
            if self.shown.has(kind) {
                // Writing to memory does not fail.
                let _ = match self.form {
                    Form::Csv => csv::row(&mut self.text, t, values),
                    Form::Raw => raw::row(&mut self.text, t, values),
                };
                self.rows += 1;
                self.last = Some(t);
            }
        }
        let done = match &mut self.file {
            Some(file) => file.append(&self.text).map_err(|e| file.failure(e)),
            None => to_stdout(&self.text).map_err(Failure::from),
        };
        if let Err(failure) = done {
            (self.rows, self.last) = (rows, last);
            self.failure = Some(failure);
        }
        self.failure.is_none()
    }

    fn header(&self, incomplete: Option<&str>) -> Vec<u8> {
        let Columns {
            title,
            names,
            units,
        } = &self.columns;
        let mut text = Vec::new();
        let _ = match self.form {
            Form::Csv => csv::header(&mut text, "time", names),
            Form::Raw => raw::header(&mut text, title, (names, units), self.rows, incomplete),
        };
        text
    }

    /// The file takes its name; says that it is not whole where it can.
    ///
    /// # Errors
    /// The first failure to write, unless there was one before.
    pub(super) fn finish(mut self, incomplete: Option<&str>) -> Result<(), Failure> {
        if !self.begun && self.failure.is_none() {
            self.take(Block {
                time: &[],
                values: &[],
                kinds: &[],
            });
        }
        if let Some(failure) = self.failure.take() {
            return Err(failure);
        }
        let header = (self.form == Form::Raw).then(|| self.header(incomplete));
        let Some(mut file) = self.file else {
            return Ok(());
        };
        if let Some(header) = header {
            file.replace_start(&header).map_err(|e| file.failure(e))?;
        }
        file.finish()
    }
}

fn to_stdout(bytes: &[u8]) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(bytes)?;
    out.flush()
}
