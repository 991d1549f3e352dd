//! Many cases from one seed on. What became of each goes into a file, from which a run that was ended goes on.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::changes::KINDS;
use crate::compare::{Base, Outcome, base, judge, refused, resumed, unchanged};
use crate::random::Random;
use crate::topologies::{Case, case};

/// What became of one comparison of a case.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Record {
    seed: u64,
    stage: String,
    style: String,
    /// With the oracle, else with the case after a change.
    with_oracle: bool,
    class: Class,
    /// The method of what agrees; the reason of anything else, without its numbers.
    kind: String,
    difference: f64,
    /// Of `circ` and of the comparison, s.
    seconds: [f64; 2],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Class {
    Agrees,
    /// The oracle has no answer.
    Declined,
    /// A difference whose cause `circ` names itself.
    Explained,
    /// Refused by `circ`, where the oracle has an answer.
    Refused,
    Failed,
}

const CLASSES: [(&str, Class); 5] = [
    ("agrees", Class::Agrees),
    ("declined", Class::Declined),
    ("explained", Class::Explained),
    ("refused", Class::Refused),
    ("failed", Class::Failed),
];

/// What ended without an outcome: the process, while this case ran.
const DIED: &str = "the process ended in the middle";

/// Digits are left out, so that messages that differ in numbers alone are one kind; so is what separates columns.
fn kind(text: &str) -> String {
    let letters = text
        .chars()
        .filter(|c| !c.is_ascii_digit() && !".-;\n".contains(*c));
    letters.take(110).collect()
}

/// The class, the kind and the difference of an outcome.
fn classify(outcome: &Outcome) -> (Class, String, f64) {
    match outcome {
        Outcome::Agrees {
            difference, method, ..
        } => (Class::Agrees, method.clone(), *difference),
        Outcome::Declined(why) => (Class::Declined, kind(why), f64::NAN),
        Outcome::Explained(why) => (Class::Explained, kind(why), f64::NAN),
        Outcome::Refused(why) => (Class::Refused, kind(why), f64::NAN),
        Outcome::Panicked(why) => (Class::Failed, kind(why), f64::NAN),
        Outcome::Differs { what, difference } => {
            let name = what.split(" in row ").next().unwrap_or(what);
            let name = if what.contains("stated") && !what.contains("(exact, ") {
                "differs by more than the stated error".to_string()
            } else {
                kind(name)
            };
            (Class::Failed, name, *difference)
        }
    }
}

impl Record {
    fn line(&self) -> String {
        let class = CLASSES.iter().find(|c| c.1 == self.class);
        format!(
            "{};{};{};{};{};{};{:.2e};{:.3};{:.3}\n",
            self.seed,
            self.stage,
            self.style,
            if self.with_oracle {
                "oracle"
            } else {
                "changed"
            },
            class.expect("all are listed").0,
            self.kind,
            self.difference,
            self.seconds[0],
            self.seconds[1],
        )
    }

    /// Reads what [`Self::line`] writes.
    fn of(line: &str) -> Option<Self> {
        let parts: Vec<&str> = line.split(';').collect();
        let [seed, stage, style, what, class, kind, difference, one, two] = parts[..] else {
            return None;
        };
        Some(Self {
            seed: seed.parse().ok()?,
            stage: stage.into(),
            style: style.into(),
            with_oracle: what == "oracle",
            class: CLASSES.iter().find(|c| c.0 == class)?.1,
            kind: kind.into(),
            difference: difference.parse().ok()?,
            seconds: [one.parse().ok()?, two.parse().ok()?],
        })
    }
}

/// What became of many cases.
#[derive(Debug, Default)]
pub(crate) struct Summary(Vec<Record>);

/// So many of the longest runs are told, and so many seeds of each kind.
const SLOWEST: usize = 20;
const SEEDS: usize = 12;

impl Summary {
    /// Nothing failed and nothing was refused.
    pub(crate) fn is_clean(&self) -> bool {
        self.0
            .iter()
            .all(|r| !matches!(r.class, Class::Refused | Class::Failed))
    }

    fn with_oracle(&self) -> impl Iterator<Item = &Record> {
        self.0.iter().filter(|r| r.with_oracle)
    }

    pub(crate) fn text(&self) -> String {
        let (mut stages, mut times) = (BTreeMap::new(), BTreeMap::new());
        let mut largest = 0.0_f64;
        for r in self.with_oracle() {
            for group in [&r.stage, &r.style] {
                *stages.entry(group.as_str()).or_insert(0_u32) += 1;
            }
            let of_style: &mut [f64; 2] = times.entry(r.style.as_str()).or_default();
            of_style[0] += r.seconds[0];
            of_style[1] += r.seconds[1];
            if r.class == Class::Agrees {
                largest = largest.max(r.difference);
            }
        }
        let mut text = format!(
            "{} cases, largest difference of what agrees {largest:.1e}\n",
            self.with_oracle().count()
        );
        let mut groups: BTreeMap<(Class, bool, &str), Vec<&Record>> = BTreeMap::new();
        for r in &self.0 {
            let group = (r.class, r.with_oracle, r.kind.as_str());
            groups.entry(group).or_default().push(r);
        }
        for ((class, with_oracle, kind), records) in groups {
            let name = CLASSES.iter().find(|c| c.1 == class);
            let name = name.expect("all are listed").0;
            let what = if with_oracle { "" } else { " after a change" };
            text += &format!("{name}{what} {}: {kind}", records.len());
            if class == Class::Declined {
                let mut counts: BTreeMap<&str, u32> = BTreeMap::new();
                for group in records.iter().flat_map(|r| [&r.stage, &r.style]) {
                    *counts.entry(group).or_default() += 1;
                }
                let parts = counts.iter().map(|(k, n)| format!("{k} {n}/{}", stages[k]));
                text += &format!(" ({})", parts.collect::<Vec<_>>().join(", "));
            } else if class != Class::Agrees {
                let seeds = records.iter().take(SEEDS).map(|r| r.seed.to_string());
                let more = if records.len() > SEEDS { " …" } else { "" };
                text += &format!(" (seeds {}{more})", seeds.collect::<Vec<_>>().join(" "));
            }
            text += "\n";
        }
        let times = times.iter();
        let times =
            times.map(|(style, [circ, oracle])| format!("{style} {circ:.0} s and {oracle:.0} s"));
        let times: Vec<String> = times.collect();
        text += &format!("times of circ and the oracle: {}\n", times.join(", "));
        let mut slowest: Vec<&Record> = self.with_oracle().collect();
        slowest.sort_by(|a, b| b.seconds[0].total_cmp(&a.seconds[0]));
        let slowest = slowest.iter().take(SLOWEST);
        let slowest = slowest.map(|r| format!("{} {} {:.1} s", r.seed, r.stage, r.seconds[0]));
        let slowest: Vec<String> = slowest.collect();
        text + &format!("slowest: {}\n", slowest.join(", "))
    }
}

/// The files of a long run.
struct Files {
    folder: PathBuf,
    records: fs::File,
}

impl Files {
    /// The files in a folder, with what stands in them already. A case that was begun and has no record ended the process.
    fn open(folder: &Path) -> (Self, Summary) {
        fs::create_dir_all(folder).expect("a folder");
        let path = folder.join("cases.csv");
        let known = fs::read_to_string(&path).unwrap_or_default();
        let mut summary = Summary(known.lines().filter_map(Record::of).collect());
        let file = fs::OpenOptions::new().create(true).append(true).open(&path);
        let mut files = Self {
            folder: folder.to_path_buf(),
            records: file.expect("a file"),
        };
        let begun = fs::read_to_string(files.running()).unwrap_or_default();
        let begun = begun.split_whitespace().next_back();
        let begun = begun.and_then(|seed| seed.parse::<u64>().ok());
        if let Some(seed) = begun.filter(|seed| !summary.0.iter().any(|r| r.seed == *seed)) {
            let record = Record {
                seed,
                stage: case(seed).stage.into(),
                style: format!("{:?}", case(seed).style),
                with_oracle: true,
                class: Class::Failed,
                kind: DIED.into(),
                difference: f64::NAN,
                seconds: [0.0; 2],
            };
            files.write(&record);
            summary.0.push(record);
        }
        (files, summary)
    }

    /// The case that runs: its netlist and, last, its seed.
    fn running(&self) -> PathBuf {
        self.folder.join("running.cir")
    }

    fn begin(&self, seed: u64, case: &Case) {
        let text = format!("{}* {seed}\n", case.circuit.text());
        fs::write(self.running(), text).expect("a file");
    }

    fn write(&mut self, record: &Record) {
        let line = record.line();
        self.records.write_all(line.as_bytes()).expect("a file");
    }

    /// The netlist of a case that fails.
    fn keep(&self, seed: u64, case: &Case, why: &str) {
        let path = self.folder.join(format!("{seed}.cir"));
        fs::write(path, format!("{}* {why}\n", case.circuit.text())).expect("a file");
    }
}

/// Multiplications that the oracle may spend on a case of the fixed seeds, and of the free ones that [`THOROUGH`] divides: seconds.
const BUDGET: u64 = 1_000_000_000;
const THOROUGH: u64 = 64;
/// On the other free seeds: most need less.
const SMALL: u64 = 300_000_000;
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

/// One free seed, with the seconds of `circ` and of the comparison.
fn free(case: &Case, seed: u64) -> ([Option<Outcome>; 2], [f64; 2]) {
    let budget = if seed.is_multiple_of(THOROUGH) {
        BUDGET
    } else {
        SMALL
    };
    let start = Instant::now();
    let base = base(case);
    let of_circ = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let first = match &base {
        Ok(base) => judge(case, base, budget),
        Err(Outcome::Refused(why)) => refused(case, why.clone(), budget),
        Err(outcome) => outcome.clone(),
    };
    let of_oracle = start.elapsed().as_secs_f64();
    let base = base.ok().filter(|_| seed.is_multiple_of(CHANGED));
    let second = base.and_then(|base| changed(case, &base, seed));
    ([Some(first), second], [of_circ, of_oracle])
}

/// Runs so many cases, those without a record in the folder. Each failure is told at once; its netlist goes into the folder, as
/// does a record of every case.
pub(crate) fn run(
    first: u64,
    count: u64,
    folder: Option<&PathBuf>,
    tell: &dyn Fn(&str),
) -> Summary {
    let (mut files, mut summary) = match folder {
        Some(folder) => {
            let (files, summary) = Files::open(folder);
            (Some(files), summary)
        }
        None => (None, Summary::default()),
    };
    let known: std::collections::BTreeSet<u64> = summary.0.iter().map(|r| r.seed).collect();
    for seed in (first..first + count).filter(|seed| !known.contains(seed)) {
        let case = case(seed);
        if let Some(files) = &files {
            files.begin(seed, &case);
        }
        let (outcomes, seconds) = free(&case, seed);
        for (what, outcome) in outcomes.into_iter().enumerate() {
            let Some(outcome) = outcome else { continue };
            let (class, kind, difference) = classify(&outcome);
            let record = Record {
                seed,
                stage: case.stage.into(),
                style: format!("{:?}", case.style),
                with_oracle: what == 0,
                class,
                kind,
                difference,
                seconds,
            };
            if matches!(class, Class::Refused | Class::Failed) {
                let text = format!("{outcome:?}");
                let short: String = text.chars().take(240).collect();
                tell(&format!("{seed} {} {:?}: {short}", case.stage, case.style));
                if let Some(files) = &files {
                    files.keep(seed, &case, &text);
                }
            }
            if let Some(files) = &mut files {
                files.write(&record);
            }
            summary.0.push(record);
        }
        if (seed + 1 - first).is_multiple_of(1000) {
            tell(&summary.text());
        }
    }
    summary
}
