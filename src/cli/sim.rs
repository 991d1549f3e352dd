//! `circ sim`.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::ac;
use super::args::{PssArgs, SimArgs};
use super::dc;
use super::destination::{Destination, Wanted};
use super::exit::{Exit, Failure};
use super::files;
use super::forms;
use super::input::{self, Subject};
use super::op;
use super::output::Format;
use super::pss;
use super::request::{Request, Route, no_tran, run_to, with_options};
use super::rows::Columns;
use super::signals::Signals;
use super::steps::Stepping;
use super::streams::Streams;
use super::tabulate;
use crate::analysis::{
    self, Finished, PeriodicOptions, Undefined, WorstOptions, is_measured, shown, shown_values,
};
use crate::check;
use crate::circuit::source::Wave;
use crate::circuit::{Circuit, SteadyState};
use crate::integrate::{
    Aliased, Block, Error, Note, Run, SimOptions, Verified, VerifyOptions, aliased, verify,
    verify_system,
};
use crate::lcs::Input;
use crate::model::Model;
use crate::report::{self, text};

/// Simulates and writes what was asked for; a run that broke off or was interrupted is written as far as it came.
///
/// # Errors
/// See [`Failure`].
pub fn sim(args: &SimArgs, streams: &Streams) -> Result<Exit, Failure> {
    let formats = Format::of(&args.results.outputs, args.results.format, streams)?;
    let request = Request::of(&args.method, args.results.events)?;
    let paths: Vec<&Path> = args.results.outputs.iter().map(PathBuf::as_path).collect();
    if let Some(form) = forms::open(&args.input)? {
        only_one_way(args)?;
        files::spare(&paths, [args.input.file.as_path()])?;
        let run = forms::run(&form, args)?;
        let destination = Destination::of(args.wanted(), &formats, None, None, streams);
        let outputs = destination.open(&Columns::of(&run.waveforms))?;
        let finished = Finished::of(Ok(run));
        return destination.finish(outputs, finished, true, None);
    }
    let subject = input::open(&args.input, &args.results.probes, &paths, streams)?;
    let signals = Signals::watch()?;
    let asked = (&subject, &request);
    if let Some(exit) = other_than_one_transient(args, asked, &formats, &signals, streams)? {
        return Ok(exit);
    }
    if let (true, Subject::System(_)) = (args.from_pss, &subject) {
        let file = args.input.file.display();
        let message = format!("{file}: `--from-pss` takes a netlist, not a system");
        return Err(Failure::told("not-for-system", message));
    }
    if let (true, Subject::System(_)) = (args.table.table, &subject) {
        let file = args.input.file.display();
        let message = format!("{file}: `--table` takes a netlist, not a system");
        return Err(Failure::told("not-for-system", message));
    }
    let destination = Destination::of(
        args.wanted(),
        &formats,
        subject.tran(),
        subject.model(),
        streams,
    );
    let mut outputs = destination.open(&Columns::of_subject(&subject))?;
    let circuit = subject.model().map(Model::circuit);
    let pictures = destination.has_pictures();
    // Then rows are chosen at the end.
    let feeds = circuit.is_some_and(|circuit| pictures || is_measured(circuit));
    let collects = outputs.hold() || destination.plots || feeds || args.verify;
    let mut undefined = Undefined::default();
    let mut take = |block: Block<'_>| match circuit.and_then(|c| shown_values(c, block)) {
        Some(values) => {
            undefined.see(block.time, &values);
            outputs.take(Block {
                values: &values,
                ..block
            })
        }
        None => outputs.take(block),
    };
    let route = Route {
        corners: pictures || args.verify,
        pictures,
        numbers: destination.has_numbers(),
        sink: Some(&mut take),
        discard: !collects,
        cancel: Some(signals.flag()),
        held: None,
        from_orbit: args.from_pss,
    };
    let mut finished = measured_run(&subject, &request, route, streams);
    let more = args.table.table || args.verify || !args.worst.is_empty();
    let busy = more.then(|| streams.busy("looking at the run again"));
    if let (true, Subject::Circuit(model), Some((_, found)), None) = (
        args.table.table,
        &subject,
        &mut finished.run,
        &finished.error,
    ) {
        match tabulate::table(args, model, &request, signals.flag()) {
            Ok(table) => found.table = Some(table),
            Err(error) => finished.error = Some(error),
        }
    }
    if finished.error.is_none() {
        bounds(args, &subject, &request, &mut finished, signals.flag());
    }
    if let (true, Some((run, _)), None) = (args.verify, &mut finished.run, &finished.error) {
        let options = VerifyOptions {
            settings: request.settings(),
            cancel: Some(signals.flag()),
        };
        match second(&subject, run, &options) {
            Ok(verified) => {
                if let Some(until) = verified.until {
                    let text = format!(
                        "verified until t = {until:e} s alone: the rest asks for more steps than a second run takes"
                    );
                    run.notes.push(Note::run("verified-in-part", text));
                }
                run.verified = Some(verified);
            }
            // The rows are whole.
            Err(error) => {
                let text = format!("not verified: {error}");
                run.notes
                    .push(Note::of("not-verified", error.elements, text));
            }
        }
    }
    drop(busy);
    if let Some(circuit) = circuit
        && let Some((mut run, found)) = finished.run.take()
    {
        if !collects {
            run.notes.extend(undefined.note(circuit));
        }
        finished.run = Some((shown(circuit, run), found));
    }
    destination.finish(outputs, finished, feeds, signals.received())
}

/// Carries out what the cards of a circuit ask for if that is no single transient, and tells what is left out for one; then nothing is returned.
///
/// # Errors
/// See [`Failure`].
fn other_than_one_transient(
    args: &SimArgs,
    (subject, request): (&Subject, &Request),
    formats: &[Format],
    signals: &Signals,
    streams: &Streams,
) -> Result<Option<Exit>, Failure> {
    let Subject::Circuit(model) = subject else {
        return Ok(None);
    };
    let circuit = model.circuit();
    let transient = circuit.tran.is_some() && circuit.steady != Some(SteadyState::Orbit);
    // What is carried out, where there is more than one analysis.
    let done = match circuit.steady {
        Some(SteadyState::Orbit) => "`.pss`",
        _ => "`.tran`",
    };
    if !transient && !circuit.ac.is_empty() {
        only_one_way(args)?;
        if circuit.tran.is_some() {
            let file = args.input.file.display();
            let text = "`.pss` is left out, as there is an `.ac`";
            streams.note(
                "left-out",
                format!("{text}; `circ pss {file}` carries it out"),
            );
        }
        return ac::sim(args, model, formats, streams).map(Some);
    }
    if !circuit.ac.is_empty() {
        let file = args.input.file.display();
        streams.note(
            "left-out",
            format!("`.ac` is left out, as there is a {done}; `circ ac {file}` carries it out"),
        );
    }
    if let (true, Some(told)) = (transient, left_out(circuit)) {
        streams.note(
            "left-out",
            format!(
                "{told}; `circ ac {}` measures that",
                args.input.file.display()
            ),
        );
    }
    if circuit.tran.is_none() && !circuit.dc.is_empty() {
        only_one_way(args)?;
        return dc::sim(args, model, formats, streams).map(Some);
    }
    let file = args.input.file.display();
    if circuit.tran.is_none() && circuit.op {
        only_one_way(args)?;
        let outputs = (&args.results.outputs[..], formats);
        return op::of_model(&args.input, model, outputs, false, streams).map(Some);
    }
    if circuit.op {
        streams.note(
            "left-out",
            format!("`.op` is left out, as there is a {done}; `circ op {file}` carries it out"),
        );
    }
    if circuit.tran.is_none() {
        let message = "nothing to simulate: the netlist asks for no .tran analysis";
        return Err(Failure::told("no-analysis", format!("{file}: {message}")));
    }
    if circuit.steady == Some(SteadyState::Orbit) {
        if !args.worst.is_empty() || args.verify {
            only_one_way(args)?;
        }
        let asked = PssArgs {
            input: args.input.clone(),
            results: args.results.clone(),
            period: None,
            order: None,
            tol: None,
            table: args.table.clone(),
        };
        return pss::orbit(&asked, subject, formats, signals, streams).map(Some);
    }
    let unknown = args.worst.iter().find_map(|of| circuit.no_measurement(of));
    if let Some(what) = unknown {
        return Err(Failure::told(
            "unknown-measurement",
            format!("--worst: {what}"),
        ));
    }
    tabulate::known(&args.table, &args.input, model)?;
    if circuit.steady == Some(SteadyState::Start) && args.verify {
        let file = args.input.file.display();
        let message = "`--verify` takes a run from its usual start, without `steady`";
        return Err(Failure::told(
            "option-conflict",
            format!("{file}: {message}"),
        ));
    }
    if !circuit.steps.is_empty() {
        only_once(args)?;
        let stepping = Stepping {
            args,
            model,
            request: request.clone(),
            signals,
        };
        return stepping.sim(formats, streams).map(Some);
    }
    for of in &args.worst {
        let options = worst_options(args, request, signals.flag());
        analysis::toleranced(model, &of.to_lowercase(), &options)
            .map_err(|error| Failure::of_run("--worst: ", &error))?;
    }
    Ok(None)
}

impl SimArgs {
    pub(super) fn wanted(&self) -> Wanted<'_> {
        Wanted {
            input: &self.input,
            results: &self.results,
            fixed_step: self.method.step.is_some(),
            verify: self.verify,
        }
    }
}

fn worst_options<'a>(
    args: &SimArgs,
    request: &Request,
    cancel: &'a AtomicBool,
) -> WorstOptions<'a> {
    WorstOptions {
        tolerances: args.input.random.tolerances.clone(),
        cancel: Some(cancel),
        settings: request.settings(),
    }
}

/// Adds the ranges of measurements.
fn bounds(
    args: &SimArgs,
    subject: &Subject,
    request: &Request,
    finished: &mut Finished,
    cancel: &AtomicBool,
) {
    let (Subject::Circuit(model), Some((_, found))) = (subject, &mut finished.run) else {
        return;
    };
    let options = worst_options(args, request, cancel);
    for of in &args.worst {
        match analysis::worst(model, of, &options) {
            Ok(worst) => found.worst.push(worst),
            Err(error) => {
                finished.error = Some(error);
                return;
            }
        }
    }
}

/// The measurements that a transient leaves out.
fn left_out(circuit: &Circuit) -> Option<String> {
    let names: Vec<&str> = circuit.responses.iter().map(|m| &m.name[..]).collect();
    let card = if circuit.ac.is_empty() {
        ", with an `.ac` card"
    } else {
        ""
    };
    (!names.is_empty()).then(|| {
        format!(
            "`.meas ac` ({}) is left out, as a transient has no response to small sines{card}",
            names.join(", ")
        )
    })
}

/// # Errors
/// [`Failure::Told`] where a second run or a table is asked for of what is no transient.
fn only_one_way(args: &SimArgs) -> Result<(), Failure> {
    only_once(args)?;
    if args.table.table {
        let file = args.input.file.display();
        let message = "`--table` takes a transient of a circuit (`.tran`)";
        return Err(Failure::told(
            "option-conflict",
            format!("{file}: {message}"),
        ));
    }
    Ok(())
}

/// # Errors
/// [`Failure::Told`] where a second run is asked for of what is no single transient run.
fn only_once(args: &SimArgs) -> Result<(), Failure> {
    let message = if !args.worst.is_empty() {
        "`--worst` takes one transient run of a circuit, without `.step`"
    } else if args.verify {
        "`--verify` takes one transient run of a circuit or system, without `.step`"
    } else {
        return Ok(());
    };
    let file = args.input.file.display();
    Err(Failure::told(
        "option-conflict",
        format!("{file}: {message}"),
    ))
}

/// Makes a run a second time.
fn second(subject: &Subject, run: &Run, options: &VerifyOptions<'_>) -> Result<Verified, Error> {
    match subject {
        Subject::Circuit(model) => verify(model.circuit(), model.multiport(), run, options),
        Subject::System(system) => match system.tran {
            Some(tran) => verify_system((&system.lcs, &system.x0), tran, run, options),
            None => Err(no_tran()),
        },
    }
}

/// Simulates, and measures where the circuit asks for it; then [`Route::sink`] gets no rows.
fn measured_run(
    subject: &Subject,
    request: &Request,
    route: Route<'_>,
    streams: &Streams,
) -> Finished {
    let system = match subject {
        Subject::Circuit(model) => {
            let mut finished = transient(model, request, route, streams);
            if streams.verbose
                && !input::is_large(model.multiport())
                && let (Some((run, _)), Ok(lcs)) = (&mut finished.run, model.lcs())
            {
                run.plan.push(format!(
                    "conditioning in the start position of the switches: {}",
                    check::conditioning(&lcs)
                ));
            }
            return finished;
        }
        Subject::System(system) => system,
    };
    let mut finished = Finished::of(run_to(subject, request, None, route, streams));
    if let (Some((run, _)), Some(tran)) = (&mut finished.run, system.tran) {
        say_aliased(run, aliased(&tran, waves(&system.lcs.inputs), run));
    }
    finished
}

/// The same of a circuit.
pub(super) fn transient(
    model: &Model,
    request: &Request,
    route: Route<'_>,
    streams: &Streams,
) -> Finished {
    let tran = model.circuit().tran;
    let start = if route.from_orbit {
        let asked = PeriodicOptions {
            cancel: route.cancel,
            settings: request.settings(),
            ..PeriodicOptions::default()
        };
        match analysis::orbit_start(model, &asked) {
            Ok((orbit, start)) => {
                streams.say(format!("starts at the {}", report::text::orbit(&orbit)));
                Some(start)
            }
            Err(error) => return Finished::of(Err(error)),
        }
    } else {
        None
    };
    let Route {
        pictures, numbers, ..
    } = route;
    let run = |options: SimOptions<'_>| {
        let options = SimOptions { start, ..options };
        if pictures {
            analysis::pictured(model, options)
        } else {
            analysis::transient(model, options)
        }
    };
    let mut finished = with_options(tran, request, route, streams, run);
    // Pictures have rows enough, unless the step is the user's.
    let told = numbers || request.step.is_some();
    if let (Some((run, _)), Some(tran)) = (&mut finished.run, tran)
        && !input::is_large(model.multiport())
        && let Some(frequency) = analysis::ringing(model, tran.tstep)
    {
        run.notes.push(text::ringing(frequency, tran.tstep));
    }
    if let (true, Some((run, _)), Some(tran)) = (told, &mut finished.run, tran) {
        let inputs = model.multiport().sources.iter().map(|s| &s.input);
        say_aliased(run, aliased(&tran, waves(inputs), run));
    }
    finished
}

/// A warning where rows hide what repeats, a note where they show its corners alone.
fn say_aliased(run: &mut Run, found: Option<Aliased>) {
    match found {
        Some(found) if found.corners => run.notes.push(text::aliasing(&found)),
        found => run.aliased = found,
    }
}

/// Names and waveforms of sources.
fn waves<'a>(
    inputs: impl IntoIterator<Item = &'a Input>,
) -> impl Iterator<Item = (&'a str, &'a Wave)> {
    let named = |input: &'a Input| (input.name.as_str(), &input.source.wave);
    inputs.into_iter().map(named)
}
