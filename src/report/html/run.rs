//! What a run did, and what those of `.step` did.

use std::collections::HashMap;

use super::super::figure::Figure;
use super::super::steps::Step;
use super::super::{si, text};
use super::{Page, Strip, Table};
use crate::analysis::Conduction;
use crate::integrate::{Change, Event, Places, Run};

/// Devices of a strip, those that change first.
const MOST_STRIPS: usize = 40;
/// Changes in the strips of all runs of `.step`, about 20 bytes of a page each.
const MOST_CHANGES: usize = 1_000_000;

impl Page {
    /// The curves of a figure with what the run did: events, impulses, measurements in words, energies and notes.
    #[must_use]
    pub fn of_run(figure: &Figure, run: &Run, measured: String, places: Places<'_>) -> Self {
        let mut page = Self::of_figure(figure);
        page.about = format!("{} · {}", page.about, run.method);
        let (strips, left) = strips(&run.events);
        page.strips = strips;
        page.tables = tables(run).into();
        page.say("Measurements", measured);
        page.say("Run", text::summary(run, places, false));
        page.say("Plan", run.plan.join("\n"));
        if left > 0 {
            page.say(
                "Left out",
                format!("{left} more devices and switches change; the events name them"),
            );
        }
        page
    }
}

impl Page {
    /// The same with strips for devices that no event tells of.
    #[must_use]
    pub fn with_conduction(mut self, all: &[Conduction]) -> Self {
        conducting(&mut self.strips, all);
        self
    }

    /// The same with strips, events and impulses of each of the runs of `.step`, of which a reader chooses one.
    #[must_use]
    pub fn with_steps(mut self, steps: &[Step]) -> Self {
        let (mut room, mut without) = (MOST_CHANGES, 0);
        for step in steps {
            let mut own = strips(&step.run.events).0;
            conducting(&mut own, &step.found.conduction);
            let changes: usize = own.iter().map(|strip| strip.times.len()).sum();
            if changes > room {
                without += 1;
                continue;
            }
            room -= changes;
            let run = step.label();
            self.strips.extend(own.into_iter().map(|strip| Strip {
                run: run.clone(),
                ..strip
            }));
            self.tables.extend(tables(&step.run).map(|table| Table {
                run: run.clone(),
                ..table
            }));
        }
        if without > 0 {
            self.say(
                "Left out",
                format!("who conducts when, and the events, of {without} of {} runs: a page lists {MOST_CHANGES} changes", steps.len()),
            );
        }
        self
    }
}

/// Adds strips for devices of curved laws.
fn conducting(strips: &mut Vec<Strip>, all: &[Conduction]) {
    let room = MOST_STRIPS.saturating_sub(strips.len());
    strips.extend(all.iter().take(room).map(|own| Strip {
        name: own.device.clone(),
        run: String::new(),
        on: "conducts",
        off: "blocks",
        start: Some(own.at_start),
        times: own.changes.iter().map(|change| change.0).collect(),
        states: own.changes.iter().map(|change| change.1.into()).collect(),
    }));
}

/// Events and impulses of a run.
fn tables(run: &Run) -> [Table; 2] {
    let events = run.events.iter();
    let events = events.map(|event| vec![time(event.t), event.to_string()]);
    let impulses = run.impulses.iter().map(|impulse| {
        let unit = if impulse.name.starts_with("i(") {
            "A·s"
        } else {
            "V·s"
        };
        let area = si::quantity(impulse.area, unit, 5);
        vec![time(impulse.t), format!("{} {area}", impulse.name)]
    });
    [
        Table::new("Events", &["time", "what"], events),
        Table::new("Impulses", &["time", "area"], impulses),
    ]
}

fn time(t: f64) -> String {
    si::quantity(t, "s", 9)
}

/// A strip for each switch and device that changes, in order of their first changes, and how many were left out.
fn strips(events: &[Event]) -> (Vec<Strip>, usize) {
    let mut strips: Vec<Strip> = Vec::new();
    let mut places = HashMap::new();
    for event in events {
        for change in event.changes.iter() {
            let (on, words) = match change {
                Change::Switch { on, .. } => (*on, ["on", "off"]),
                Change::Device { conducts, .. } => (*conducts, ["conducts", "blocks"]),
                Change::Slides(_) => continue,
            };
            // A corner of a function, `b1.1`, is no device.
            let last = change.name().rsplit('.').next().unwrap_or_default();
            if last.bytes().all(|byte| byte.is_ascii_digit()) {
                continue;
            }
            let place = *places.entry(change.name()).or_insert_with(|| {
                strips.push(Strip {
                    name: change.name().to_owned(),
                    run: String::new(),
                    on: words[0],
                    off: words[1],
                    start: Some(!on),
                    times: Vec::new(),
                    states: Vec::new(),
                });
                strips.len() - 1
            });
            strips[place].times.push(event.t);
            strips[place].states.push(on.into());
        }
    }
    let left = strips.len().saturating_sub(MOST_STRIPS);
    strips.truncate(MOST_STRIPS);
    (strips, left)
}

#[cfg(test)]
mod tests {
    use base64::Engine;
    use base64::prelude::BASE64_STANDARD;

    use super::*;
    use crate::integrate::Impulse;
    use crate::integrate::event::conducts;
    use crate::waveform::Waveforms;

    fn page(title: &str) -> Page {
        let run = Run {
            waveforms: Waveforms {
                title: title.into(),
                names: vec!["v(out)".into(), "v(in)".into(), "i(r1)".into()],
                units: vec!["V", "V", "A"],
                time: vec![0.0, 0.1],
                values: vec![0.1, 0.2, 0.3, 0.4, 0.5, 0.6],
            },
            events: vec![conducts("d1", 0.05)],
            impulses: vec![Impulse {
                t: 0.05,
                name: "i(d1)".into(),
                area: 1e-6,
            }],
            ..Run::default()
        };
        let figure = Figure::of_waveforms(&run.waveforms, usize::MAX);
        Page::of_run(&figure, &run, String::new(), Places::default())
    }

    #[test]
    fn the_page_stands_alone_and_its_title_is_text() {
        let html = page("</script><script>alert(1)</script>").html().unwrap();
        assert_eq!(html.matches("</script>").count(), 2);
        assert!(html.contains("<title>&lt;/script&gt;"));
        assert!(!html.contains("src=") && !html.contains("<link rel=\"stylesheet\""));
        assert!(!html.contains("{{"));
        let html = page("<!--<script>").html().unwrap();
        assert!(!html.contains("<!--") && html.matches("<script").count() == 2);
    }

    #[test]
    fn columns_are_the_numbers_and_times_stand_once() {
        let page = page("x");
        assert_eq!(page.columns.len(), 4);
        let [volts, amperes] = &page.panels[..] else {
            panic!("{:?}", page.panels)
        };
        assert!(volts.curves.iter().chain(&amperes.curves).all(|c| c.x == 0));
        let column = &page.columns[amperes.curves[0].y];
        let json = serde_json::to_string(column).unwrap();
        let bytes = BASE64_STANDARD.decode(json.trim_matches('"')).unwrap();
        let (doubles, _) = bytes.as_chunks::<8>();
        let numbers: Vec<f64> = doubles.iter().map(|b| f64::from_le_bytes(*b)).collect();
        assert_eq!(numbers, [0.3, 0.6]);
    }

    #[test]
    fn strips_and_events_of_runs_say_which() {
        let step = |r: f64| Step {
            values: vec![("r".into(), r)],
            run: Run {
                events: vec![conducts("d1", 0.01 * r)],
                ..Run::default()
            },
            found: crate::analysis::Measurements::default(),
        };
        let page = page("x").with_steps(&[step(1.0), step(2.0)]);
        let strips = page.strips[1..].iter();
        let strips = strips.map(|s| (s.run.as_str(), s.name.as_str(), &s.times[..]));
        assert!(strips.eq([("r=1", "d1", &[0.01][..]), ("r=2", "d1", &[0.02])]));
        let tables = page.tables.iter().filter(|table| table.run == "r=2");
        assert_eq!(tables.map(|t| t.rows.len()).collect::<Vec<_>>(), [1, 0]);
    }

    #[test]
    fn a_strip_begins_with_the_other_state() {
        let page = page("x");
        let strip = &page.strips[0];
        assert_eq!((strip.name.as_str(), strip.start), ("d1", Some(false)));
        assert_eq!(
            (&strip.times[..], &strip.states[..]),
            (&[0.05][..], &[1][..])
        );
        assert_eq!(
            page.tables[1].rows,
            [["50 ms".to_owned(), "i(d1) 1 µA·s".to_owned()]]
        );
    }
}
