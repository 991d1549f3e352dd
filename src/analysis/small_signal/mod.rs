//! The small-signal response: what a small sine on the sources with an `AC` value makes of the signals, about the operating point or about the
//! periodic steady state.

mod beside;
mod formula;
mod large;
mod lines;
mod measured;
mod orbit;
mod ratio;
mod rest;

use std::f64::consts::TAU;
use std::sync::atomic::AtomicBool;

use nalgebra::{Complex, DMatrix, DVector, Dyn, LU};

pub use measured::small_signal_measured;
pub use ratio::{Left, Margin, Ratio, margins, ratios, unwrapped};

use super::periodic::{
    Large, PeriodicOptions, Settled, Steady, beyond_dense, settled_linear, steady,
};
use super::variation::times;
use crate::circuit::{Circuit, Kind};
use crate::integrate::{Error, Note, Orbit, OrbitKind, Reason, Tape};
use crate::lcs::Input;
use crate::linalg::decouple::Decoupled;
use crate::model::Model;
use crate::settings::Settings;
use crate::settings::tolerances::periodic::{BETWEEN_COMPARED, COMPARED, LOST, RADIANS_OF_STEP};
use crate::waveform::{Phasors, unit_of};

/// Where a circuit is made linear.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum About {
    /// The operating point.
    Rest,
    /// The periodic steady state.
    Orbit,
}

/// What a small-signal response may be asked for.
#[derive(Debug, Clone, Default)]
pub struct SmallSignalOptions<'a> {
    /// Frequencies, Hz, in place of those of `.ac`.
    pub frequencies: Vec<f64>,
    /// Where the circuit is made linear; by default about the orbit if it switches periodically, else about the operating point.
    pub about: Option<About>,
    /// About an orbit: so many sidebands on either side, f + k/T.
    pub sidebands: u16,
    /// The period, s, in place of the common one of the sources.
    pub period: Option<f64>,
    /// Ends the search for the orbit when set.
    pub cancel: Option<&'a AtomicBool>,
    /// Tolerances.
    pub settings: Settings,
}

/// The response of signals to the `AC` values of the sources.
#[derive(Debug, Clone)]
pub struct Response {
    /// The signals as phasors relative to the unit of `AC`; the sideband at f + k/T is `v(out)@k`.
    pub phasors: Phasors,
    /// Where the circuit was made linear.
    pub about: About,
    /// The orbit about which it was.
    pub orbit: Option<Orbit>,
    /// Things the user should know.
    pub notes: Vec<Note>,
}

impl Response {
    /// Appends a row for every frequency, rad/s, from the values there and what rounding may leave of them; where that is too little a note says
    /// so.
    fn sweep(
        &mut self,
        omegas: &[f64],
        mut respond: impl FnMut(f64) -> Result<(Vec<Complex<f64>>, f64), Error>,
    ) -> Result<(), Error> {
        let mut worst = (0.0, 0.0);
        for &omega in omegas {
            let (values, loss) = respond(omega)?;
            self.phasors.values.extend(values);
            if loss > worst.0 {
                worst = (loss, omega);
            }
        }
        if worst.0 > LOST {
            self.notes.push(lost(worst.0, worst.1));
        }
        Ok(())
    }

    /// Names columns by sideband, and says about which orbit they are.
    fn about_bands(&mut self, orbit: Orbit, sidebands: u16) {
        let bands = bands(sidebands);
        let phasors = &mut self.phasors;
        let of_band = |name: &String, k: i32| {
            if k == 0 {
                name.clone()
            } else {
                format!("{name}@{k}")
            }
        };
        let names = bands
            .iter()
            .flat_map(|k| phasors.names.iter().map(|name| of_band(name, *k)));
        phasors.names = names.collect();
        phasors.units = phasors.units.repeat(bands.len());
        if !orbit.stable && !orbit.multipliers.is_empty() {
            let what =
                "the orbit is unstable: this is the response about it, which no transient shows";
            self.notes.push(Note::run("unstable-orbit", what));
        }
        self.orbit = Some(orbit);
    }

    /// The same by a method of order 2 in halves of parts and in whole ones, extrapolated; a note says how far the two are apart, and at least
    /// `unknown`, and how well the orbit is known.
    fn extrapolate(
        &mut self,
        omegas: &[f64],
        (unknown, orbit): (f64, Option<f64>),
        respond: impl Fn(usize, f64) -> Result<(Vec<Complex<f64>>, f64), Error>,
    ) -> Result<(), Error> {
        let mut worst = (unknown, omegas.first().copied().unwrap_or_default());
        for &omega in omegas {
            let ((halves, _), (whole, _)) = (respond(0, omega)?, respond(1, omega)?);
            let size = halves
                .iter()
                .fold(f64::MIN_POSITIVE, |m, v| m.max(v.norm()));
            for (half, whole) in halves.iter().zip(whole) {
                let correction = (half - whole) / 3.0;
                self.phasors.values.push(half + correction);
                if correction.norm() > worst.0 * size {
                    worst = (correction.norm() / size, omega);
                }
            }
        }
        let what = "curved laws are taken for their tangents, which changes";
        self.notes.push(in_parts(worst, orbit, what));
        Ok(())
    }
}

/// The small-signal response of a circuit.
///
/// About the operating point, with x' = A x + E u and y = C x + G u there, it is Y(ω) = C (jωI − A)⁻¹ E û + G û. About the periodic steady state of
/// period T
///
/// ```text
/// Y_k(ω) = (1/T) [∫ δy e^{−jΩt} dt + Σ (y⁻ − y⁺) δt e^{−jΩt}],   Ω = ω + 2πk/T,
/// ```
///
/// where δ is the solution of the variational equation that the sources drive and that repeats but for the factor e^{jωT}, and the sum is over the
/// events that it shifts (N. M. Wereley, Analysis and Control of Linear Periodically Time Varying Systems, 1991). k = 0 is the transfer function.
///
/// # Errors
/// No source has an `AC` value, no frequency is asked for; the operating point's or [`periodic`](super::periodic()) errors;
/// [`Reason::NotSmooth`] where the circuit has no derivative.
///
/// # Example
/// A low-pass filter at its corner frequency.
/// ```
/// use circ::analysis::{SmallSignalOptions, small_signal};
///
/// let text = "rc\nv1 1 0 dc 2 ac 1\nr1 1 2 1k\nc1 2 0 1u\n.ac list 159.15494309189535\n.end\n";
/// let model = circ::Model::parse(text, "rc.cir")?;
/// let response = small_signal(&model, &SmallSignalOptions::default())?;
/// let out = response.phasors.column(1).next().unwrap();
/// assert!((out.re - 0.5).abs() < 1e-14 && (out.im + 0.5).abs() < 1e-14);
/// # Ok::<(), circ::Error>(())
/// ```
pub fn small_signal(model: &Model, options: &SmallSignalOptions<'_>) -> Result<Response, Error> {
    let circuit = model.circuit();
    let asked = if options.frequencies.is_empty() {
        &circuit.ac
    } else {
        &options.frequencies
    };
    if asked.is_empty() {
        return Err(unsupported(
            "the netlist has no `.ac` card: `.ac dec 20 10 1meg`",
        ));
    }
    if circuit.stimuli.is_empty() {
        return Err(unsupported(
            "no source has an `AC` value: `v1 in 0 dc 5 ac 1`",
        ));
    }
    if let Some(stimulus) = circuit.stimuli.iter().find(|s| circuit.is_known(s.source)) {
        let what =
            "what its AC value does is not known: an expression took its voltage as a number";
        let name = circuit.elements[stimulus.source.index()].name.clone();
        return Err(unsupported(what).device(name));
    }
    let about = match options.about {
        Some(about) => about,
        None if may_switch(circuit, has_sides) => About::Orbit,
        None => About::Rest,
    };
    let omegas: Vec<f64> = asked.iter().map(|f| f * std::f64::consts::TAU).collect();
    let (names, units) = columns(circuit);
    let mut response = Response {
        phasors: Phasors {
            title: circuit.title.clone(),
            names,
            units,
            frequency: asked.clone(),
            values: Vec::new(),
        },
        about,
        orbit: None,
        notes: Vec::new(),
    };
    let is_device = |kind: &Kind| matches!(kind, Kind::Device(_));
    if options.about.is_none() && about == About::Rest && may_switch(circuit, is_device) {
        let text = "no switch moves and laws are smooth: this is the response about the operating point; `--about pss` has the one about the periodic steady state";
        response.notes.push(Note::run("about-rest", text));
    }
    if about == About::Orbit {
        let asked = PeriodicOptions {
            period: options.period,
            cancel: options.cancel,
            settings: options.settings.clone(),
            ..PeriodicOptions::default()
        };
        let found = settled_linear(model, &asked)?;
        let orbit = found.orbit();
        if orbit.kind != OrbitKind::Equilibrium {
            let asked_of = (&omegas[..], options.sidebands);
            match found {
                Settled::Whole(steady) => about_orbit(*steady, &asked, asked_of, &mut response)?,
                Settled::Large(large, ..) => {
                    match about_large(*large, &asked, asked_of, &mut response) {
                        // Dense matrices tell what their steps leave open.
                        Err(Error {
                            reason: Reason::NotSmooth(_),
                            ..
                        }) if !beyond_dense(model) => {
                            response.phasors.values.clear();
                            let steady = steady(model, &asked)?;
                            about_orbit(steady, &asked, asked_of, &mut response)?;
                        }
                        made => made?,
                    }
                }
            }
            response.about_bands(orbit, options.sidebands);
            return Ok(response);
        }
        if options.about.is_some() {
            let text = "the circuit comes to rest: this is the response about its operating point";
            response.notes.push(Note::run("at-rest", text));
        }
        response.about = About::Rest;
    }
    let probing = match circuit.lines.is_empty() {
        true => None,
        false => Some(model.with_circuit(lines::probing(circuit))?),
    };
    let probing = probing.as_ref().unwrap_or(model);
    let mut linear = rest::linear(
        probing.circuit(),
        probing.multiport(),
        &options.settings,
        &mut response.notes,
    )?;
    let drive = drive(circuit, &linear.inputs);
    let ports = lines::ports(probing.circuit(), &linear);
    response.sweep(&omegas, |omega| match &ports[..] {
        [] => linear.response(omega, &drive),
        ports => lines::response(&mut linear, ports, omega, &drive),
    })?;
    Ok(response)
}

fn about_orbit(
    mut found: Steady,
    asked: &PeriodicOptions<'_>,
    (omegas, sidebands): (&[f64], u16),
    response: &mut Response,
) -> Result<(), Error> {
    let orbit = found.orbit();
    let (trajectories, unknown, origin) = match found.linearised(asked.cancel)? {
        Some((run, origin)) => (Vec::from(run.trajectories), run.unknown, origin),
        None => {
            let stimuli = found.circuit.stimuli.iter();
            let names = stimuli.map(|s| found.circuit.elements[s.source.index()].name.clone());
            let names: Vec<String> = names.collect();
            let (trajectory, origin) = found.trajectory(&names, asked.cancel)?;
            (vec![trajectory], 0.0, origin)
        }
    };
    let systems = trajectories.iter().flat_map(|all| &all.systems);
    let inputs = systems.map(|system| &system.lcs.inputs[..]).next();
    let inputs = inputs.unwrap_or_default();
    let drive = drive(&found.circuit, inputs);
    let linear = |trajectory| orbit::Linear::of(trajectory, orbit.period, origin);
    let linear: Vec<orbit::Linear<'_>> = trajectories.iter().map(linear).collect();
    let bands = bands(sidebands);
    match &linear[..] {
        [exact] => response.sweep(omegas, |omega| exact.response(omega, &drive, &bands))?,
        all => {
            let confirmed = beside::confirmed(&found, &all[0], (inputs, &drive), asked)?;
            let respond = |k: usize, omega| all[k].response(omega, &drive, &bands);
            let unknown = (unknown / orbit.period).max(confirmed.unwrap_or(0.0));
            let known = (unknown, found.apart);
            response.extrapolate(omegas, known, respond)?;
        }
    }
    Ok(())
}

/// The same in the steps of a large orbit, which are no longer than each frequency allows, with what halves of them change at some of the frequencies.
fn about_large(
    mut found: Large,
    asked: &PeriodicOptions<'_>,
    (omegas, sidebands): (&[f64], u16),
    response: &mut Response,
) -> Result<(), Error> {
    let (period, apart, from) = (found.orbit().period, found.apart(), found.from());
    let drive = drive(&found.circuit().clone(), found.returns().inputs());
    let (bands, beyond) = (bands(sidebands), f64::from(sidebands) * TAU / period);
    let (own, longest) = found.in_steps(f64::INFINITY, false, asked.cancel)?;
    let mut stepped = large::Stepped::of(found.returns(), &own, (period, from));
    let mut finer: Option<(f64, Tape)> = None;
    let every = omegas.len().div_ceil(COMPARED);
    let mut worst = (0.0, omegas.first().copied().unwrap_or_default());
    for (k, &omega) in omegas.iter().enumerate() {
        let set = |cancel: &AtomicBool| cancel.load(std::sync::atomic::Ordering::Relaxed);
        if asked.cancel.is_some_and(set) {
            return Err(Error::before(Reason::Interrupted));
        }
        let most = RADIANS_OF_STEP / (omega + beyond);
        // Steps serve frequencies up to an octave above the one that they were made for.
        let serve = |(of, _): &(f64, Tape)| *of <= most && 8.0 * of > most;
        if longest > most && !finer.as_ref().is_some_and(serve) {
            let of = 0.5 * most;
            finer = Some((of, found.in_steps(of, false, asked.cancel)?.0));
        }
        let (of, tape) = match &finer {
            Some((of, tape)) if longest > most => (*of, tape),
            _ => (f64::INFINITY, &own),
        };
        let drive = (drive.as_slice(), &bands[..]);
        let values = stepped.response(found.returns(), (tape, omega), drive)?;
        if (k + 1) % every == 0 || k + 1 == omegas.len() {
            let (halves, _) = found.in_steps(of, true, asked.cancel)?;
            let halves = stepped.response(found.returns(), (&halves, omega), drive)?;
            let size = halves
                .iter()
                .fold(f64::MIN_POSITIVE, |m, v| m.max(v.norm()));
            let apart = values.iter().zip(&halves);
            let apart = apart.fold(0.0_f64, |m, (a, b)| m.max((a - b).norm()));
            if apart > worst.0 * size {
                worst = (apart / size, omega);
            }
        }
        response.phasors.values.extend(values);
    }
    let mut what = "halves of them change".to_string();
    if every > 1 {
        let compared = omegas.len().div_ceil(every);
        what = format!(
            "these, compared with halves of them at {compared} of the frequencies, may change"
        );
        worst.0 *= BETWEEN_COMPARED;
    }
    response.notes.push(in_parts(worst, apart, &what));
    Ok(())
}

fn bands(sidebands: u16) -> Vec<i32> {
    (-i32::from(sidebands)..=i32::from(sidebands)).collect()
}

/// Whether the circuit has what changes sides, and a source that repeats; or a state that moves a switch, in a transient that shows whether it does so
/// for good.
fn may_switch(circuit: &Circuit, changes: impl Fn(&Kind) -> bool) -> bool {
    let varies = |kind: &Kind| match kind {
        Kind::VoltageSource(source) | Kind::CurrentSource(source) => source.wave.period().is_some(),
        _ => false,
    };
    let (mut changing, mut varying, mut switched) = (false, false, false);
    for element in &circuit.elements {
        changing |= changes(&element.kind);
        varying |= varies(&element.kind);
        switched |= matches!(element.kind, Kind::Switch(_) | Kind::Function { .. });
    }
    changing && (varying || (switched && circuit.tran.is_some()))
}

/// Whether an element conducts or blocks, and not a little more or less: what curved laws do is smooth, and an amplifier does not switch.
fn has_sides(kind: &Kind) -> bool {
    match kind {
        Kind::Switch(_) => true,
        Kind::Device(law) | Kind::Function { law, .. } => law.is_piecewise_linear(),
        _ => false,
    }
}

fn unsupported(what: &str) -> Error {
    Error::before(Reason::Unsupported(what.into()))
}

/// The signals, and their units.
fn columns(circuit: &Circuit) -> (Vec<String>, Vec<&'static str>) {
    let names: Vec<String> = circuit
        .probes()
        .into_iter()
        .map(|probe| probe.name)
        .collect();
    let units = names.iter().map(|name| unit_of(name)).collect();
    (names, units)
}

/// û: the `AC` values of the sources.
fn drive(circuit: &Circuit, inputs: &[Input]) -> DVector<Complex<f64>> {
    let of = |input: &Input| {
        let own = circuit
            .stimuli
            .iter()
            .filter(|stimulus| circuit.elements[stimulus.source.index()].name == input.name);
        let phasors = own.map(|s| Complex::from_polar(s.magnitude, s.phase.to_radians()));
        phasors.sum()
    };
    DVector::from_iterator(inputs.len(), inputs.iter().map(of))
}

/// jωI − A, factored in the basis in which fast states owe nothing to the others; its rows are levelled, as those of different resistances are
/// decades apart.
struct Resolvent<'a> {
    /// None of a circuit without states.
    factors: Option<LU<Complex<f64>, Dyn, Dyn>>,
    /// 1 over the largest entry of each row.
    levels: DVector<f64>,
    basis: Option<&'a Decoupled>,
}

impl<'a> Resolvent<'a> {
    fn of(a: &DMatrix<f64>, basis: Option<&'a Decoupled>, omega: f64) -> Self {
        let (a, n) = (basis.map_or(a, |basis| &basis.generator), a.nrows());
        let mut shifted = DMatrix::from_fn(n, n, |i, j| {
            Complex::new(-a[(i, j)], if i == j { omega } else { 0.0 })
        });
        let mut levels = DVector::zeros(n);
        for (mut row, level) in shifted.row_iter_mut().zip(levels.iter_mut()) {
            *level = 1.0 / row.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.norm()));
            row *= Complex::from(*level);
        }
        Self {
            factors: (n > 0).then(|| shifted.lu()),
            levels,
            basis,
        }
    }

    /// (jωI − A)⁻¹ b.
    fn solve(&self, b: DVector<Complex<f64>>) -> Option<DVector<Complex<f64>>> {
        let Some(factors) = &self.factors else {
            return Some(b);
        };
        let b = self
            .basis
            .map_or_else(|| b.clone(), |basis| times(&basis.from, &b));
        let solved = factors.solve(&b.zip_map(&self.levels, |b, level| b * level))?;
        let solved = self
            .basis
            .map_or_else(|| solved.clone(), |basis| times(&basis.to, &solved));
        solved.iter().all(|v| v.is_finite()).then_some(solved)
    }

    /// What rounding may leave of a solution, relative to it: ε ‖(jωI − A)⁻¹‖ of the levelled matrix.
    fn loss(&self) -> f64 {
        let inverse = self.factors.as_ref().and_then(LU::try_inverse);
        let sizes = inverse.iter().flat_map(|inverse| {
            let rows = inverse.row_iter();
            rows.map(|row| row.iter().map(|v| v.norm()).sum::<f64>())
                .collect::<Vec<_>>()
        });
        f64::EPSILON * sizes.fold(0.0, f64::max)
    }
}

/// A response in which rounding may leave too little, at a frequency.
fn lost(loss: f64, omega: f64) -> Note {
    let f = omega / std::f64::consts::TAU;
    let text = format!(
        "at {f:e} Hz rounding may change the response by {loss:.0e}: the frequency is decades below the rates of the circuit, or at a resonance"
    );
    Note::run("rounding", text)
}

/// A response about an orbit made of steps, with its error at a frequency, and that of the orbit.
fn in_parts((error, omega): (f64, f64), orbit: Option<f64>, what: &str) -> Note {
    // As it was asked for, without what 2π rounds off.
    let f = omega / std::f64::consts::TAU;
    let f: f64 = format!("{f:.12e}").parse().unwrap_or(f);
    let known = match orbit {
        Some(apart) => format!("which are known to {apart:.0e} of the amplitudes"),
        None => "whose error is not known".into(),
    };
    let text = format!(
        "the orbit is made of steps, {known}; {what} the response by {error:.0e} of its size, most at {f:e} Hz"
    );
    Note::run("tangents", text)
}

/// A frequency at which nothing finite responds.
fn resonance(omega: f64) -> Error {
    let f = omega / std::f64::consts::TAU;
    let what = format!(
        "at {f:e} Hz the circuit resonates without damping; another frequency has a response"
    );
    Error::before(Reason::NotSmooth(what))
}
