//! Many cases from one seed on, with what became of them counted.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use crate::changes::KINDS;
use crate::compare::{Base, Outcome, base, judge, refused, resumed, unchanged};
use crate::random::Random;
use crate::topologies::{Case, case};

/// What became of many cases.
#[derive(Debug, Default)]
pub(crate) struct Summary {
    pub(crate) cases: u64,
    /// Comparisons with the oracle and with changed circuits that agree.
    pub(crate) agree: [u64; 2],
    /// The oracle has no answer: why, and how often by stage and by style.
    pub(crate) declined: BTreeMap<String, BTreeMap<String, u64>>,
    /// Cases by stage and by style.
    pub(crate) kinds: BTreeMap<String, u64>,
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
    /// Times of the runs of `circ` without changes and of the oracle, by style.
    pub(crate) times: BTreeMap<String, [Duration; 2]>,
    /// The longest runs of `circ`, longest first.
    pub(crate) slowest: Vec<(Duration, u64, String)>,
}

/// So many of the longest runs are told.
const SLOWEST: usize = 20;

/// Digits are left out, so that messages that differ in numbers alone are one kind.
fn kind(text: &str) -> String {
    let letters = text
        .chars()
        .filter(|c| !c.is_ascii_digit() && *c != '.' && *c != '-');
    letters.take(110).collect()
}

/// Stage and style.
fn kinds(case: &Case) -> [String; 2] {
    [case.stage.into(), format!("{:?}", case.style)]
}

impl Summary {
    fn time(&mut self, [time, oracle]: [Duration; 2], seed: u64, case: &Case) {
        let of_style = self.times.entry(format!("{:?}", case.style)).or_default();
        of_style[0] += time;
        of_style[1] += oracle;
        let place = self.slowest.partition_point(|s| s.0 > time);
        if place < SLOWEST {
            let name = format!("{} {:?}", case.stage, case.style);
            self.slowest.insert(place, (time, seed, name));
            self.slowest.truncate(SLOWEST);
        }
        for kind in kinds(case) {
            *self.kinds.entry(kind).or_default() += 1;
        }
    }

    fn count(&mut self, seed: u64, case: &Case, what: usize, outcome: &Outcome) {
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
            Outcome::Declined(why) => {
                let of_why = self.declined.entry(kind(why)).or_default();
                for kind in kinds(case) {
                    *of_why.entry(kind).or_default() += 1;
                }
            }
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
            "{} cases: {} agree with the oracle ({:?}), {} with a changed circuit, explained {:?}; largest difference allowed {:.1e}\n",
            self.cases, self.agree[0], self.methods, self.agree[1], self.explained, self.largest
        );
        let times = self.times.iter();
        let times = times.map(|(style, [circ, oracle])| {
            format!(
                "{style} {:.0} s and {:.0} s",
                circ.as_secs_f64(),
                oracle.as_secs_f64()
            )
        });
        text += &format!(
            "times of circ and the oracle: {}\n",
            times.collect::<Vec<_>>().join(", ")
        );
        for (why, of_why) in &self.declined {
            // Each case stands under its stage and under its style.
            let count = of_why.values().sum::<u64>() / 2;
            let parts = of_why
                .iter()
                .map(|(k, n)| format!("{k} {n}/{}", self.kinds[k]));
            let parts: Vec<String> = parts.collect();
            text += &format!("the oracle declines {count}, {why}: {}\n", parts.join(", "));
        }
        let slowest = self.slowest.iter();
        let slowest =
            slowest.map(|(t, seed, what)| format!("{seed} {what} {:.1} s", t.as_secs_f64()));
        text += &format!("slowest: {}\n", slowest.collect::<Vec<_>>().join(", "));
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

/// Multiplications that the oracle may spend on a case of the fixed seeds, and of the free ones that [`THOROUGH`] divides: seconds.
const BUDGET: u64 = 1_000_000_000;
const THOROUGH: u64 = 64;
/// On the other free seeds: most need less.
const SMALL: u64 = 30_000_000;
/// Among free seeds those that this divides are run after a change, too.
const CHANGED: u64 = 8;

/// One case against the oracle and after one change.
pub(crate) fn both(case: &Case, seed: u64) -> [Option<Outcome>; 2] {
    match base(case) {
        Ok(base) => [Some(judge(case, &base, BUDGET)), changed(case, &base, seed)],
        Err(Outcome::Refused(why)) => [Some(refused(case, why, BUDGET)), None],
        Err(outcome) => [Some(outcome), None],
    }
}

fn changed(case: &Case, base: &Base, seed: u64) -> Option<Outcome> {
    let mut random = Random::new(!seed);
    let kind = random.below(KINDS.len() + 2);
    if kind == KINDS.len() + 1 {
        return Some(resumed(case, base, seed));
    }
    unchanged(case, base, kind, &mut random)
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
        let start = Instant::now();
        let base = base(&case);
        let mut times = [start.elapsed(), Duration::ZERO];
        let budget = if seed % THOROUGH == 0 { BUDGET } else { SMALL };
        let outcomes = match base {
            Ok(base) => {
                let start = Instant::now();
                let first = judge(&case, &base, budget);
                times[1] = start.elapsed();
                let second = (seed % CHANGED == 0).then(|| changed(&case, &base, seed));
                [Some(first), second.flatten()]
            }
            Err(Outcome::Refused(why)) => [Some(refused(&case, why, budget)), None],
            Err(outcome) => [Some(outcome), None],
        };
        summary.time(times, seed, &case);
        for (what, outcome) in outcomes.into_iter().enumerate() {
            let Some(outcome) = outcome else { continue };
            summary.count(seed, &case, what, &outcome);
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
        if summary.cases % 1000 == 0 {
            tell(&summary.text());
        }
    }
    summary
}
