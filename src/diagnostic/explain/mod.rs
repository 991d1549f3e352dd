//! What every code of a finding means, what usually causes it, and what to do: one table.

mod circuit;
mod command;
mod names;
mod run;
mod text;
mod values;

/// What stands behind a code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Explanation {
    /// The code, `unknown-model`.
    pub code: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// What usually causes it.
    pub cause: &'static str,
    /// What to do.
    pub remedy: &'static str,
    /// A netlist that shows it, where a few lines can.
    pub example: Option<Example>,
}

/// A netlist of a few lines with the command that shows the finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Example {
    /// The netlist, its title first.
    pub netlist: &'static str,
    /// The command line without the file: `sim`, `pss`, `sim --param x=1`.
    pub command: &'static str,
}

impl Explanation {
    /// What to do, as a help of a finding says it: in lower case, without a full stop.
    #[must_use]
    pub fn help(&self) -> String {
        let text = self.remedy.trim_end_matches('.');
        let mut letters = text.chars();
        match (letters.next(), letters.clone().next()) {
            (Some(first), Some(second)) if second.is_lowercase() || second == ' ' => {
                first.to_lowercase().chain(letters).collect()
            }
            _ => text.to_owned(),
        }
    }

    const fn of(
        code: &'static str,
        meaning: &'static str,
        cause: &'static str,
        remedy: &'static str,
    ) -> Self {
        Self {
            code,
            meaning,
            cause,
            remedy,
            example: None,
        }
    }

    const fn shown(self, netlist: &'static str) -> Self {
        self.shown_by("sim", netlist)
    }

    const fn shown_by(mut self, command: &'static str, netlist: &'static str) -> Self {
        self.example = Some(Example { netlist, command });
        self
    }
}

/// Where the codes of a kind are explained.
#[derive(Debug, Clone, Copy)]
pub struct Area {
    /// What they concern.
    pub title: &'static str,
    /// Its codes, in alphabetical order.
    pub codes: &'static [Explanation],
}

/// All codes, by what they concern.
pub const AREAS: [Area; 6] = [
    Area {
        title: "text",
        codes: &text::CODES,
    },
    Area {
        title: "names",
        codes: &names::CODES,
    },
    Area {
        title: "values",
        codes: &values::CODES,
    },
    Area {
        title: "circuit",
        codes: &circuit::CODES,
    },
    Area {
        title: "run",
        codes: &run::CODES,
    },
    Area {
        title: "command line",
        codes: &command::CODES,
    },
];

/// What stands behind a code; `None` where there is no such code.
#[must_use]
pub fn explain(code: &str) -> Option<&'static Explanation> {
    let mut all = AREAS.iter().flat_map(|area| area.codes);
    all.find(|explanation| explanation.code == code)
}
