//! Steps of large circuits, on matrices without their zeros: Moreau's scheme and the θ-method with steps of prescribed length, and
//! ARK4(3)6L\[2\]SA-ESDIRK ([`tableau`](crate::integrate::curved::tableau)) with steps chosen by its embedded error.
//!
//! Every stage is one implicit step of [`kernel`] with its complementarity problem, so that a device that changes within a step shows in the error of that step. What happens in
//! no time (edges, switches, inconsistent starts) is an implicit step of next to no length, which takes the state to where charge and flux are conserved and the constraints hold.

mod attempt;
mod back;
mod bend;
mod driven;
mod instant;
mod kernel;
mod march;
mod returns;
mod script;
mod shift;
mod start;
mod system;
mod tape;

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::integrate::Note;
use crate::integrate::control::Control;
use crate::integrate::energy::Balance;
use crate::integrate::error::Error;
use crate::integrate::event::Change;
use crate::integrate::inputs::Inputs;
use crate::integrate::log::Log;
use crate::integrate::reading::Point;
use crate::integrate::run::{Outcome, Stepper};
use crate::integrate::stats::{StatedError, Stats};
use crate::integrate::switching::{Switches, Threshold};
use crate::integrate::theta::Stepping;
use crate::lcs::Role;
use crate::mna::StandardMultiport;
use crate::settings::Settings;
use crate::settings::tolerances::sparse::{AFTER, INSTANT, KEPT};
use crate::settings::tolerances::steps::GRANT_EMBEDDED;
use crate::settings::tolerances::times::SAME_TIME;
use attempt::Trial;
pub(crate) use back::{Drive, Returned, Weighed};
pub(crate) use bend::Bend;
pub(crate) use driven::Sine;
use kernel::Step;
pub(crate) use returns::{Lengths, Passed, Returns};
use script::Script;
use system::{Largest, System};
pub(crate) use tape::{Reads, Stepped, Tape, through_stages};

/// How a step is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Rule {
    /// x⁺ = x + h x'_θ, with λ, y and the sources at t + θh.
    Theta(f64),
    /// Five implicit stages of order 4.
    Stages,
}

/// What a run starts from.
pub(crate) struct Setup {
    /// The circuit, its laws as ideal pairs.
    pub(crate) multiport: Arc<StandardMultiport>,
    /// Start position of every switch.
    pub(crate) position: Vec<bool>,
    /// By ideal pair: conducts; empty where not known.
    pub(crate) conducting: Vec<bool>,
    /// Start time, s.
    pub(crate) t: f64,
    /// All capacitor voltages and inductor currents.
    pub(crate) storage: Vec<f64>,
    /// How steps are made.
    pub(crate) rule: Rule,
    /// How long they are.
    pub(crate) stepping: Stepping,
    /// No step is longer than this, s.
    pub(crate) longest: f64,
    /// The simulated span, s.
    pub(crate) span: f64,
    /// Tolerances.
    pub(crate) settings: Settings,
}

/// See the [module](self).
pub(crate) struct Sparse {
    multiport: Arc<StandardMultiport>,
    systems: Vec<(Vec<bool>, System)>,
    inputs: Inputs,
    switches: Switches,
    rule: Rule,
    stepping: Stepping,
    longest: f64,
    span: f64,
    settings: Settings,
    control: Option<Control>,
    /// The step to try next, s.
    preferred: f64,
    refused: bool,
    /// Steps and time, s, when progress was looked at last.
    progress: (u64, f64),
    now: Now,
    start: Vec<f64>,
    started: bool,
    trial: Trial,
    step: Step,
    /// By storage element: largest |value| so far.
    seen: Vec<f64>,
    /// Its unit, by storage element.
    storage_units: Vec<&'static str>,
    /// The largest sources.
    sources: Largest,
    /// When switches that sources drive move next, as far as that was asked, and which: (asked until, when, which).
    known: Option<(f64, f64, Vec<usize>)>,
    pending: Vec<(f64, Arc<[Change]>)>,
    stats: Stats,
    modes: BTreeSet<(usize, Vec<bool>)>,
    /// Whether energies are added up.
    balanced: bool,
    /// How long steps are where a run is made again.
    script: Option<Script>,
    /// What the derivative of a run is made of, where it is asked for.
    tape: Option<Tape>,
    /// What is written into it of the run besides.
    reads: Option<Reads>,
    /// By storage element: largest |state| since the run was taken up.
    peaks: Vec<f64>,
    /// Factors that a system keeps.
    room: usize,
}

/// Where the run stands.
#[derive(Debug, Default)]
struct Now {
    t: f64,
    system: usize,
    x: Vec<f64>,
    /// Right limit.
    u: Vec<f64>,
    lambda: Vec<f64>,
    /// Whether λ is that of this instant.
    lambda_known: bool,
    active: Vec<bool>,
    /// x'.
    slope: Vec<f64>,
    /// The next steps are damped: the state may have jumped.
    settle: bool,
    balance: Balance,
    event_step: f64,
    last_h: f64,
}

impl Sparse {
    /// A stepper at its start, before the jump at t = 0+.
    ///
    /// # Errors
    /// The reduction's for the start position.
    pub(crate) fn new(setup: Setup) -> Result<Self, Error> {
        let Setup {
            multiport,
            position,
            conducting,
            t,
            storage,
            rule,
            stepping,
            longest,
            span,
            settings,
        } = setup;
        let system = System::new(&multiport, &position, &settings)?;
        let inputs = Inputs::new(&system.lcs.inputs);
        let units = system.lcs.inputs.iter().map(|input| input.unit);
        let sources = Largest::of(units.zip(inputs.amplitudes()));
        let storage_units = multiport.storage.iter();
        let storage_units = storage_units.map(|s| if s.capacitor { "V" } else { "A" });
        let storage_units = storage_units.collect();
        let thresholds: Vec<Threshold> = multiport.switches.iter().map(Threshold::of).collect();
        let switches = Switches::new(position.clone(), thresholds, &system);
        let u = inputs.all_before(t);
        let x = system.lcs.state_from(&storage);
        let m = system.m();
        let mut active = vec![false; m];
        for ((active, port), on) in active.iter_mut().zip(&system.lcs.ports).zip(&conducting) {
            *active = *on == (port.role != Role::Voltage);
        }
        let mut balance = Balance::new(0.5 * system.product(&storage, &storage));
        balance.add_jump(instant::taking_over(&system, &storage, &x, &u));
        let order = if rule == Rule::Stages { 3 } else { 1 };
        let control = match stepping {
            Stepping::Fixed(_) => None,
            Stepping::Controlled { span, .. } => {
                Some(Control::new(order, GRANT_EMBEDDED, &settings, span))
            }
        };
        let now = Now {
            t,
            slope: vec![0.0; x.len()],
            x,
            u,
            lambda: vec![0.0; m],
            active,
            settle: true,
            balance,
            ..Now::default()
        };
        Ok(Self {
            seen: vec![0.0; storage.len()],
            systems: vec![(position, system)],
            inputs,
            switches,
            rule,
            stepping,
            longest,
            span,
            settings,
            control,
            preferred: AFTER * INSTANT * span,
            refused: false,
            progress: (0, t),
            now,
            peaks: vec![0.0; storage.len()],
            start: storage,
            started: false,
            trial: Trial::default(),
            step: Step::default(),
            storage_units,
            sources,
            known: None,
            pending: Vec::new(),
            stats: Stats::default(),
            modes: BTreeSet::new(),
            balanced: true,
            script: None,
            tape: None,
            reads: None,
            room: KEPT,
            multiport,
        })
    }

    fn slack(t: f64) -> f64 {
        SAME_TIME * t.abs()
    }

    fn system(&self) -> &System {
        &self.systems[self.now.system].1
    }

    /// Index of the system of a position.
    fn system_of(&mut self, position: &[bool]) -> Result<usize, Error> {
        if let Some(at) = self.systems.iter().position(|(p, _)| p == position) {
            return Ok(at);
        }
        let new = System::new(&self.multiport, position, &self.settings);
        let mut new = new.map_err(|mut error| {
            error.t = Some(self.now.t);
            error
        })?;
        new.kernel.keep(self.room);
        self.systems.push((position.to_vec(), new));
        Ok(self.systems.len() - 1)
    }

    /// Takes note of the sizes of all storage elements.
    fn see(&mut self) {
        let Self {
            systems,
            now,
            seen,
            peaks,
            ..
        } = self;
        let storage_of = systems[now.system].1.storage_of();
        for (x, &at) in now.x.iter().zip(storage_of) {
            seen[at] = seen[at].max(x.abs());
            peaks[at] = peaks[at].max(x.abs());
        }
    }

    fn note_energy(&mut self) {
        let system = &self.systems[self.now.system].1;
        let s = system.storage(&self.now.x, &self.now.u);
        self.now.balance.note(0.5 * system.product(&s, &s));
    }

    /// The row of probes now.
    fn row(&mut self) -> Vec<f64> {
        let mut row = vec![0.0; self.system().lcs.outputs.len()];
        self.read(&mut row);
        row
    }

    fn log_row(&mut self, log: &mut Log) {
        let row = self.row();
        log.row(self.now.t, &row);
    }

    /// Moves pending changes of devices into the log, with their rows.
    fn report(&mut self, log: &mut Log) {
        for (t, what) in std::mem::take(&mut self.pending) {
            self.stats.events += 1;
            log.event(t, what, false);
            if log.wants_rows() && t == self.now.t {
                self.log_row(log);
            }
        }
    }

    /// When controls that depend on sources alone pass their thresholds next in (now, limit + slack], and which do.
    fn next_known(&mut self, limit: f64) -> (f64, Vec<usize>) {
        let (now, slack) = (self.now.t, Self::slack(limit));
        let asked = |known: &Option<(f64, f64, Vec<usize>)>| match known {
            Some((until, first, which)) if *until >= limit || *first <= limit => {
                Some(if *first <= limit + slack {
                    (*first, which.clone())
                } else {
                    (f64::INFINITY, Vec::new())
                })
            }
            _ => None,
        };
        if let Some(found) = asked(&self.known) {
            return found;
        }
        let until = limit.max(now + self.span / crate::settings::tolerances::times::SPAN_PARTS);
        let (first, which) =
            self.switches
                .next_known(self.system(), &self.inputs, now, until, slack);
        self.known = Some((until, first, which));
        asked(&self.known).unwrap_or((f64::INFINITY, Vec::new()))
    }
}

impl Stepper for Sparse {
    fn time(&self) -> f64 {
        self.now.t
    }

    fn advance(&mut self, t: f64, log: &mut Log) -> Result<(), Error> {
        if !self.started {
            self.begin(log)?;
        }
        while self.now.t < t {
            let breakpoint = self.inputs.next_corner(self.now.t);
            let merged = (t - breakpoint).abs() <= Self::slack(t);
            let limit = if merged {
                breakpoint.max(t)
            } else {
                breakpoint.min(t)
            };
            let (known, mut moving) = self.next_known(limit);
            let mut stop = if merged { t } else { limit };
            let early = known < stop - Self::slack(stop);
            if early {
                stop = known;
            }
            self.interval(stop, log)?;
            if !early && (breakpoint - stop).abs() <= Self::slack(stop) {
                self.edge(breakpoint.max(stop), log)?;
                let here = (self.now.t, Self::slack(self.now.t));
                (self.switches).add_late(self.system(), &self.inputs, here, &mut moving);
            }
            if !moving.is_empty() {
                self.switch(&moving, log)?;
            }
        }
        self.note_energy();
        Ok(())
    }

    fn read(&mut self, row: &mut [f64]) {
        // A λ that cannot be read is that of the step before.
        let _ = self.know_lambda();
        let mut du = vec![0.0; self.now.u.len()];
        self.inputs.slopes_behind(self.now.t, &mut du);
        let at = Point {
            x: &self.now.x,
            lambda: &self.now.lambda,
            u: &self.now.u,
            du: &du,
        };
        self.system().read(at, row);
    }

    fn finish(&mut self) -> Outcome {
        self.note_energy();
        self.stats.modes = self.modes.len().max(1) as u64;
        self.stats.positions = self.systems.len() as u64;
        let systems = self.systems.iter().map(|(_, system)| system);
        self.stats.systems = systems.clone().filter(|s| s.m() > 0).count() as u64;
        self.stats.factorisations = systems.clone().map(|s| s.kernel.factorisations).sum();
        self.stats.pivotings = systems.clone().map(|s| s.kernel.pivotings).sum();
        let shared = systems.flat_map(|s| {
            let ports = s.kernel.shared.iter();
            ports.map(|&port| s.lcs.ports[port].device.clone())
        });
        let shared: BTreeSet<String> = shared.collect();
        let shared: Vec<String> = shared.into_iter().collect();
        let notes = if shared.is_empty() {
            Vec::new()
        } else {
            let text = format!(
                "voltages or currents of {} are not determined by the ideal model; one choice of many is shown",
                shared.join(", ")
            );
            vec![Note::of("not-determined", &shared, text)]
        };
        Outcome {
            error: StatedError {
                event_time: Some(self.now.event_step),
                ..StatedError::default()
            },
            common: 0.0,
            stats: self.stats.clone(),
            energy: self.now.balance.energy(),
            notes,
            storage: Vec::new(),
        }
    }
}
