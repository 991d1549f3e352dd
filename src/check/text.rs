//! The report in words, for a terminal.

use std::fmt;

use super::{Convergence, Report};
use crate::circuit::is_inside;
use crate::diagnostic::Severity;

fn answer(value: Option<bool>) -> &'static str {
    match value {
        Some(true) => "yes",
        Some(false) => "no",
        None => "not decided",
    }
}

/// `converges to  v(c1) = 0 (statement)`.
fn in_the_long_run(long_run: &Convergence, names: &[String]) -> String {
    let by = long_run.by;
    if let Some(x) = &long_run.to {
        let values: Vec<String> = names
            .iter()
            .zip(x)
            .map(|(name, x)| format!("{name} = {x:.6e}"))
            .collect();
        return format!(
            "converges to  {} from every start ({by})",
            values.join(", ")
        );
    }
    if long_run.moving.is_empty() {
        return format!(
            "converges to  one of the equilibria, in {} dimensions, that the start decides ({by})",
            long_run.dimension
        );
    }
    let frequencies: Vec<String> = long_run
        .frequencies_hz
        .iter()
        .map(|f| format!("{f:.6e} Hz"))
        .collect();
    let at = if frequencies.is_empty() {
        String::new()
    } else {
        format!(" at {}", frequencies.join(", "))
    };
    format!(
        "may keep on   {}{at}: nothing certified damps it ({by})",
        long_run.moving.join(" ")
    )
}

impl Report {
    /// Whether there is something to repair.
    fn verdict(&self) -> String {
        let count = |severity| {
            self.faults
                .iter()
                .filter(|f| f.severity == severity)
                .count()
        };
        let words = |n: usize, what| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
        match (count(Severity::Error), count(Severity::Warning)) {
            (0, 0) => "nothing to repair".into(),
            (0, n) => format!("can run; {} above", words(n, "warning")),
            (n, _) => format!("no run starts: {} above", words(n, "error")),
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.title.is_empty() {
            writeln!(f, "{}", self.title)?;
        }
        for fault in &self.faults {
            let place = match (&fault.file, fault.line, fault.column) {
                (Some(file), Some(line), Some(column)) => format!("{file}:{line}:{column}: "),
                _ => String::new(),
            };
            writeln!(f, "{place}{:?}: {}", fault.severity, fault.message)?;
        }
        self.write_judgement(f)
    }
}

/// See [`Report::judgement`].
struct Judgement<'a>(&'a Report);

impl fmt::Display for Judgement<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.write_judgement(f)
    }
}

impl Report {
    /// The report without its title and its faults.
    #[must_use]
    pub fn judgement(&self) -> impl fmt::Display + '_ {
        Judgement(self)
    }

    fn write_judgement(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "verdict       {}", self.verdict())?;
        let Some(class) = &self.feedthrough else {
            return Ok(());
        };
        writeln!(
            f,
            "size          {} states, {} ports, {} inputs",
            self.size.n, self.size.m, self.size.p
        )?;
        let positions: Vec<String> = self
            .switches
            .iter()
            .filter(|(name, _)| !is_inside(name))
            .map(|(name, on)| format!("{name} {}", if *on { "on" } else { "off" }))
            .collect();
        if !positions.is_empty() {
            writeln!(
                f,
                "position      {} (what follows is said for it)",
                positions.join(", ")
            )?;
        }
        for island in &self.islands {
            writeln!(
                f,
                "island        {} (reference {})",
                island.join(" "),
                island.first().map_or("", |s| s)
            )?;
        }
        if !self.normal_tree.tree.is_empty() {
            let written = |names: &[String]| {
                let written = names
                    .iter()
                    .map(String::as_str)
                    .filter(|name| !is_inside(name));
                written.collect::<Vec<_>>().join(" ")
            };
            writeln!(f, "normal tree   {}", written(&self.normal_tree.tree))?;
            writeln!(f, "links         {}", written(&self.normal_tree.links))?;
        }
        let kind = if class.zero {
            "zero"
        } else if class.skew {
            "skew-symmetric"
        } else if class.pd {
            "positive definite"
        } else if class.psd {
            "positive semidefinite"
        } else {
            "indefinite"
        };
        writeln!(
            f,
            "feedthrough   D {kind}, rank {}; P-matrix: {}, P0: {}",
            class.rank,
            answer(class.p_matrix),
            answer(class.p0_matrix)
        )?;
        writeln!(
            f,
            "passive       {}{}",
            answer(self.passive),
            match (self.p_from, &self.passive_because) {
                (Some(from), _) => format!(", P from the {from}"),
                (None, Some(because)) => format!(": {because}"),
                _ => String::new(),
            }
        )?;
        if let Some(r) = &self.residuals {
            writeln!(
                f,
                "              largest eigenvalue {:.1e}, P B - C' {:.1e} on the lossless ports",
                r.lmi_max_eigenvalue, r.pb_minus_ct
            )?;
        }
        if self.passive == Some(true) {
            match self.strictly_passive {
                Some(true) => writeln!(
                    f,
                    "strictly      yes, decay rate {:.6e} 1/s",
                    self.decay_rate
                )?,
                _ => writeln!(f, "strictly      not certified")?,
            }
        }
        for theorem in &self.theorems {
            let mark = match theorem.holds {
                Some(true) => "applies",
                // No fault of the circuit: a hypothesis is not fulfilled, and nothing is said.
                Some(false) => "not met",
                None => "open   ",
            };
            writeln!(f, "{mark}  {}: {}", theorem.statement, theorem.because)?;
            if theorem.holds == Some(true) {
                writeln!(f, "         gives {}", theorem.gives)?;
            }
        }
        let equilibria = self.equilibria.as_deref().unwrap_or(&[]);
        if self.equilibria.as_ref().is_some_and(Vec::is_empty) {
            writeln!(
                f,
                "equilibrium   none: the static complementarity problem has no solution"
            )?;
        }
        for equilibrium in equilibria {
            // Several, or none of x to show: λ tells them apart.
            let lambda = if equilibria.len() > 1 || self.states.is_empty() {
                equilibrium.lambda.as_slice()
            } else {
                &[]
            };
            let names = self.states.iter().chain(&self.lambdas);
            let values: Vec<String> = names
                .zip(equilibrium.x.iter().chain(lambda))
                .map(|(name, value)| format!("{name} = {value:.6e}"))
                .collect();
            let only = if equilibrium.unique == Some(true) {
                " (the only one)"
            } else {
                ""
            };
            if !values.is_empty() {
                writeln!(f, "equilibrium   {}{only}", values.join(", "))?;
            }
        }
        if let Some(long_run) = &self.convergence {
            writeln!(f, "{}", in_the_long_run(long_run, &self.states))?;
        }
        if self.jumps.states.is_empty() {
            writeln!(
                f,
                "jumps         {}",
                if self.jumps.analysed {
                    "none possible"
                } else {
                    "not analysed"
                }
            )?;
        } else {
            writeln!(
                f,
                "jumps         {} through {} (metric: {}; edges of: {})",
                self.jumps.states.join(" "),
                self.jumps.devices.join(" "),
                self.jumps.metric,
                if self.jumps.sources.is_empty() {
                    "none".into()
                } else {
                    self.jumps.sources.join(" ")
                }
            )?;
        }
        if let Some(s) = &self.stiffness
            && let (Some(fast), Some(slow)) = (s.fastest_s, s.slowest_s)
        {
            writeln!(
                f,
                "time scales   {fast:.3e} s to {slow:.3e} s over {} modes",
                s.modes
            )?;
        }
        if let Some(c) = &self.conditioning {
            writeln!(f, "conditioning  {c}")?;
        }
        Ok(())
    }
}
