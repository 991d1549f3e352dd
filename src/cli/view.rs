//! `circ view`: a page or a picture of any file of waveforms.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::args::{STDIN, ViewArgs};
use super::browser;
use super::exit::{Exit, Failure};
use super::files::{self, STDOUT};
use super::output::{self, Format};
use super::streams::Streams;
use crate::netlist::suggest::{is_of_pattern, nearest};
use crate::report::figure::{Axis, Figure, PANEL_COLUMNS};
use crate::report::html::Page;
use crate::report::{bode, svg};
use crate::waveform::{Phasors, Plot, Waveforms, canonical_name, plots};

/// Shows what a file of waveforms holds.
///
/// # Errors
/// See [`Failure`].
pub(super) fn view(args: &ViewArgs, streams: &Streams) -> Result<Exit, Failure> {
    let formats = Format::of(&args.outputs, args.format, streams)?;
    if let Some((path, _)) = args
        .outputs
        .iter()
        .zip(&formats)
        .find(|o| !o.1.is_picture())
    {
        let known = "svg, png or html";
        return Err(match path.as_path() == Path::new(STDOUT) {
            true => output::unknown_format(known),
            false => output::unknown_ending(path, known),
        });
    }
    let paths: Vec<&Path> = args.outputs.iter().map(PathBuf::as_path).collect();
    files::spare(&paths, [args.file.as_path()])?;
    files::writable(&paths)?;
    let plot = chosen(args, streams)?;
    if let Plot::Time(runs) = &plot
        && let Some(gaps) = gaps(runs.iter().map(|(_, run)| run))
    {
        let file = args.file.display();
        streams.note("gaps", format!("{file}: {gaps}; curves have gaps there"));
    }
    let figure = |pixels| {
        let of_runs = |runs: &[(String, Waveforms)]| {
            let runs: Vec<_> = runs.iter().map(|(label, w)| (label.clone(), w)).collect();
            Figure::of_runs(&runs, pixels)
        };
        let mut figure = match &plot {
            Plot::Time(runs) => of_runs(runs),
            Plot::Swept(name, runs) => Figure {
                axis: Axis::Swept {
                    name: name.clone(),
                    unit: "",
                },
                ..of_runs(runs)
            },
            Plot::Frequency(phasors) => bode::figure(phasors),
        };
        if figure.title.is_empty() {
            figure.title = args.file.display().to_string();
        }
        figure
    };
    let page = || Page::of_figure(&figure(usize::MAX)).html();
    for (path, format) in args.outputs.iter().zip(&formats) {
        match format {
            Format::Html => files::write(path, page()?.as_bytes())?,
            format => {
                let drawing = svg::draw(&figure(PANEL_COLUMNS))?;
                output::picture_to_file(path, *format == Format::Png, &drawing)?;
            }
        }
    }
    if args.outputs.is_empty() {
        browser::show(&browser::keep(page()?.as_bytes())?, streams)?;
    }
    Ok(Exit::Done)
}

/// How many values of runs are no numbers and where the first is, in words.
pub(super) fn gaps<'w>(runs: impl IntoIterator<Item = &'w Waveforms>) -> Option<String> {
    let (mut count, mut first) = (0, None);
    for run in runs {
        if let Some((more, row, column)) = run.gaps() {
            count += more;
            first = first.or(Some((&run.names[column], run.time[row])));
        }
    }
    let (name, t) = first?;
    let values = if count == 1 { "value is" } else { "values are" };
    Some(format!(
        "{count} {values} missing or not finite, the first in `{name}` at t = {t:e} s"
    ))
}

/// Whether a text has an analysis of a netlist.
fn is_netlist(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes).to_lowercase();
    let is_analysis = |line: &str| {
        [".tran", ".ac", ".dc", ".op", ".end"]
            .iter()
            .any(|card| line.starts_with(card))
    };
    text.lines().any(is_analysis) || text.starts_with("version 4")
}

/// The plot asked for, with the signals asked for.
fn chosen(args: &ViewArgs, streams: &Streams) -> Result<Plot, Failure> {
    let fail = |error| Failure::file(&args.file, error);
    let mut bytes = Vec::new();
    if args.file == Path::new(STDIN) {
        std::io::stdin().read_to_end(&mut bytes).map_err(fail)?;
    } else {
        bytes = fs::read(&args.file).map_err(fail)?;
    }
    let mut all = plots(&bytes).map_err(|error| match is_netlist(&bytes) {
        true => {
            let file = args.file.display();
            Failure::told("waveforms", format!(
                "{file}: a netlist, not a file of waveforms; `circ {file} -o out.html` runs it and makes a page"
            ))
        }
        false => Failure::Waveforms {
            path: args.file.clone(),
            error,
        },
    })?;
    let (number, file) = (usize::from(args.plot), args.file.display());
    if number > all.len() {
        return Err(match all.len() {
            0 => Failure::told(
                "waveforms",
                format!("{file}: holds nothing over time, frequency or what was swept"),
            ),
            count => Failure::told("no-such-plot", format!("{file}: holds {count} plots")),
        });
    }
    if all.len() > 1 {
        let count = all.len();
        let text = format!("{file}: plot {number} of {count}; `--plot N` takes another");
        streams.note("several-plots", text);
    }
    let mut plot = all.swap_remove(number - 1);
    let is_empty = match &plot {
        Plot::Time(runs) | Plot::Swept(_, runs) => runs.iter().all(|(_, run)| run.is_empty()),
        Plot::Frequency(phasors) => phasors.frequency.is_empty(),
    };
    if is_empty {
        let text = format!("{file}: has names of signals, and no rows");
        streams.note("waveforms", text);
    }
    let unknown = |probe: &str, names: &[String]| {
        let own: Vec<String> = names.iter().map(|name| canonical_name(name)).collect();
        let near = nearest(&canonical_name(probe), own.iter().map(String::as_str));
        Failure::told(
            "unknown-signal",
            match near {
                Some(near) => {
                    format!("--probe {probe}: the file has no `{probe}`; did you mean `{near}`?")
                }
                None => format!("--probe {probe}: the file has {}", names.join(" ")),
            },
        )
    };
    match &mut plot {
        Plot::Time(runs) | Plot::Swept(_, runs) => {
            for (_, run) in runs {
                let kept = kept(&run.names, &args.probes);
                *run = columns(run, &kept.map_err(|probe| unknown(probe, &run.names))?);
            }
        }
        Plot::Frequency(phasors) => {
            let kept = kept(&phasors.names, &args.probes);
            let kept = kept.map_err(|probe| unknown(probe, &phasors.names))?;
            *phasors = Phasors {
                title: phasors.title.clone(),
                names: kept.iter().map(|&j| phasors.names[j].clone()).collect(),
                units: kept.iter().map(|&j| phasors.units[j]).collect(),
                values: (0..phasors.frequency.len())
                    .flat_map(|k| kept.iter().map(move |&j| (k, j)))
                    .map(|(k, j)| phasors.values[k * phasors.names.len() + j])
                    .collect(),
                frequency: phasors.frequency.clone(),
            };
        }
    }
    Ok(plot)
}

/// The columns that probes mean, all without any.
///
/// # Errors
/// A probe that means none.
fn kept<'p>(names: &[String], probes: &'p [String]) -> Result<Vec<usize>, &'p str> {
    if probes.is_empty() {
        return Ok((0..names.len()).collect());
    }
    let mut kept = Vec::new();
    for probe in probes {
        let pattern = canonical_name(probe);
        let means = |j: &usize| is_of_pattern(&canonical_name(&names[*j]), &pattern);
        let before = kept.len();
        kept.extend((0..names.len()).filter(means));
        if kept.len() == before {
            return Err(probe);
        }
    }
    Ok(kept)
}

fn columns(waves: &Waveforms, kept: &[usize]) -> Waveforms {
    Waveforms {
        title: waves.title.clone(),
        names: kept.iter().map(|&j| waves.names[j].clone()).collect(),
        units: kept.iter().map(|&j| waves.units[j]).collect(),
        time: waves.time.clone(),
        values: (0..waves.len())
            .flat_map(|k| kept.iter().map(move |&j| waves.row(k)[j]))
            .collect(),
    }
}
