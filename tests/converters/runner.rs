//! Many cases from one seed on, with what became of them counted.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::changes::KINDS;
use crate::compare::{Outcome, base, judge, unchanged};
use crate::random::Random;
use crate::topologies::{Case, case};

/// What became of many cases.
#[derive(Debug, Default)]
pub(crate) struct Summary {
    pub(crate) cases: u64,
    /// Comparisons with the oracle and with changed circuits that agree.
    pub(crate) agree: [u64; 2],
    /// The oracle has no answer.
    pub(crate) declined: u64,
    /// Differences whose cause `circ` names itself.
    pub(crate) explained: BTreeMap<String, u64>,
    /// Refused by `circ`, with the oracle's word on whether there is an answer.
    pub(crate) refused: BTreeMap<String, Vec<u64>>,
    /// Everything else, by kind.
    pub(crate) failed: BTreeMap<String, Vec<u64>>,
    /// The largest difference of those that agree.
    pub(crate) largest: f64,
    /// By method.
    pub(crate) methods: BTreeMap<String, u64>,
}

/// Digits are left out, so that messages that differ in numbers alone are one kind.
fn kind(text: &str) -> String {
    let letters = text
        .chars()
        .filter(|c| !c.is_ascii_digit() && *c != '.' && *c != '-');
    letters.take(110).collect()
}

impl Summary {
    fn count(&mut self, seed: u64, what: usize, outcome: &Outcome) {
        match outcome {
            Outcome::Agrees {
                difference, method, ..
            } => {
                self.agree[what] += 1;
                self.largest = self.largest.max(*difference);
                if what == 0 {
                    *self.methods.entry(method.clone()).or_default() += 1;
                }
            }
            Outcome::Declined(_) => self.declined += 1,
            Outcome::Explained(why) => *self.explained.entry(why.clone()).or_default() += 1,
            Outcome::Refused(why) => self.refused.entry(kind(why)).or_default().push(seed),
            Outcome::Panicked(why) => self.failed.entry(kind(why)).or_default().push(seed),
            Outcome::Differs { what, .. } => {
                let name = what.split(" in row ").next().unwrap_or(what);
                let name = if what.contains("stated") && !what.contains("(exact, ") {
                    "differs by more than the stated error".to_string()
                } else {
                    kind(name)
                };
                self.failed.entry(name).or_default().push(seed);
            }
        }
    }

    pub(crate) fn text(&self) -> String {
        let mut text = format!(
            "{} cases: {} agree with the oracle ({:?}), {} with a changed circuit, the oracle declines {}, explained {:?}; largest difference allowed {:.1e}\n",
            self.cases,
            self.agree[0],
            self.methods,
            self.agree[1],
            self.declined,
            self.explained,
            self.largest
        );
        for (title, kinds) in [("refused", &self.refused), ("failed", &self.failed)] {
            for (kind, seeds) in kinds {
                let shown: Vec<String> = seeds.iter().take(8).map(u64::to_string).collect();
                text += &format!(
                    "{title} {}: {kind} (seeds {} …)\n",
                    seeds.len(),
                    shown.join(" ")
                );
            }
        }
        text
    }
}

/// One case against the oracle and after one change.
pub(crate) fn both(case: &Case, seed: u64) -> [Option<Outcome>; 2] {
    let base = match base(case) {
        Ok(base) => base,
        Err(outcome) => return [Some(outcome), None],
    };
    let mut random = Random::new(!seed);
    let kind = random.below(KINDS.len() + 1);
    let first = judge(case, &base);
    [Some(first), unchanged(case, &base, kind, &mut random)]
}

/// Runs so many cases; each failure is told at once, and its netlist goes into the folder.
pub(crate) fn run(
    first: u64,
    count: u64,
    folder: Option<&PathBuf>,
    tell: &dyn Fn(&str),
) -> Summary {
    let mut summary = Summary::default();
    for seed in first..first + count {
        let case = case(seed);
        summary.cases += 1;
        for (what, outcome) in both(&case, seed).into_iter().enumerate() {
            let Some(outcome) = outcome else { continue };
            summary.count(seed, what, &outcome);
            let is_bad = !matches!(
                outcome,
                Outcome::Agrees { .. } | Outcome::Declined(_) | Outcome::Explained(_)
            );
            if is_bad {
                let text = format!("{outcome:?}");
                let short: String = text.chars().take(240).collect();
                tell(&format!("{seed} {} {:?}: {short}", case.stage, case.style));
                if let Some(folder) = folder {
                    let path = folder.join(format!("{seed}.cir"));
                    std::fs::write(path, format!("{}* {text}\n", case.circuit.text()))
                        .expect("a file");
                }
            }
        }
        if summary.cases % 250 == 0 {
            tell(&summary.text());
        }
    }
    summary
}
