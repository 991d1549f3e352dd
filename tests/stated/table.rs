//! The table: a row for each setting.

use std::fmt::{Display, Formatter};

use circ::integrate::Method;

use crate::measure::{Found, ROUNDING, Setting, many};

const TOL: f64 = 1e-4;

pub(crate) const SETTINGS: [Setting; 7] = [
    Setting {
        name: "`euler`, fixed steps",
        method: Method::Euler,
        steps: Some((300.0, 30_000.0)),
        tol: TOL,
        curved: false,
    },
    Setting {
        name: "`theta`, fixed steps",
        method: Method::Theta,
        steps: Some((300.0, 30_000.0)),
        tol: TOL,
        curved: false,
    },
    Setting {
        name: "`euler`, tolerance 1e-4",
        method: Method::Euler,
        steps: None,
        tol: TOL,
        curved: false,
    },
    Setting {
        name: "`theta`, tolerance 1e-4",
        method: Method::Theta,
        steps: None,
        tol: TOL,
        curved: false,
    },
    Setting {
        name: "`theta`, tolerance 1e-7",
        method: Method::Theta,
        steps: None,
        tol: 1e-7,
        curved: false,
    },
    Setting {
        name: "exponential diodes, fixed steps",
        method: Method::Theta,
        steps: Some((300.0, 10_000.0)),
        tol: TOL,
        curved: true,
    },
    Setting {
        name: "exponential diodes, default",
        method: Method::Auto,
        steps: None,
        tol: TOL,
        curved: true,
    },
];

/// What was found of one setting.
#[derive(Debug, Clone, Default)]
pub(crate) struct Row {
    name: &'static str,
    /// Circuits that told something.
    pub(crate) told: usize,
    /// Of these, the error is not known.
    pub(crate) unknown: usize,
    /// Of the others, the stated error bounds the true one.
    pub(crate) bounded: usize,
    /// Stated over true error, sorted.
    pub(crate) ratios: Vec<f64>,
    /// No reference, or not determined.
    left_out: usize,
    refused: usize,
    /// Seconds with and without an estimate, and how much longer each run takes.
    seconds: (f64, f64),
}

impl Row {
    pub(crate) const HEAD: &'static str = "| setting | circuits | bounded | stated / true: median | 1 % | 90 % | not known | time | left out | refused |\n|---|---|---|---|---|---|---|---|---|---|";

    pub(crate) fn of(setting: &Setting, first: u64, count: u64) -> Self {
        let mut row = Self {
            name: setting.name,
            ..Self::default()
        };
        for (seed, found) in many(setting, first, count) {
            let beyond = matches!(&found, Found::Error { stated: Some(stated), truth, .. } if stated < truth && *truth >= ROUNDING);
            if beyond || std::env::var_os("CIRC_STATED_ALL").is_some() {
                println!("{}: seed {seed} {found:?}", setting.name);
            }
            row.add(found);
        }
        row.ratios.sort_by(f64::total_cmp);
        row
    }

    fn add(&mut self, found: Found) {
        match found {
            Found::Error {
                stated,
                truth,
                cost,
                ..
            } => {
                self.told += 1;
                self.seconds.0 += cost.0;
                self.seconds.1 += cost.1;
                let Some(stated) = stated else {
                    self.unknown += 1;
                    return;
                };
                self.bounded += usize::from(stated >= truth || truth < ROUNDING);
                if truth >= ROUNDING {
                    self.ratios.push(stated / truth);
                }
            }
            Found::Nothing(_) => self.left_out += 1,
            Found::Refused(_) => self.refused += 1,
        }
    }

    /// The ratio below which this part of them is.
    pub(crate) fn quantile(&self, part: f64) -> f64 {
        let at = (part * self.ratios.len() as f64) as usize;
        self.ratios.get(at).copied().unwrap_or(f64::NAN)
    }
}

impl Display for Row {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let part = |n: usize, of: usize| 100.0 * n as f64 / of.max(1) as f64;
        write!(
            f,
            "| {} | {} | {:.1} % | {:.2} | {:.2} | {:.1} | {:.1} % | {:.2} | {} | {} |",
            self.name,
            self.told,
            part(self.bounded, self.told - self.unknown),
            self.quantile(0.5),
            self.quantile(0.01),
            self.quantile(0.9),
            part(self.unknown, self.told),
            self.seconds.0 / self.seconds.1,
            self.left_out,
            self.refused
        )
    }
}
