//! What a run did.

use std::collections::HashMap;

use super::super::figure::Figure;
use super::super::{si, text};
use super::{Page, Strip, Table};
use crate::analysis::Conduction;
use crate::integrate::{Change, Event, Places, Run};

/// Devices of a strip, those that change first.
const MOST_STRIPS: usize = 40;

impl Page {
    /// The curves of a figure with what the run did: events, impulses, measurements in words, energies and notes.
    #[must_use]
    pub fn of_run(figure: &Figure, run: &Run, measured: String, places: Places<'_>) -> Self {
        let mut page = Self::of_figure(figure);
        page.about = format!("{} · {}", page.about, run.method);
        let (strips, left) = strips(&run.events);
        page.strips = strips;
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
        page.tables = vec![
            Table::new("Events", &["time", "what"], events),
            Table::new("Impulses", &["time", "area"], impulses),
        ];
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
        let room = MOST_STRIPS.saturating_sub(self.strips.len());
        let strips = all.iter().take(room).map(|own| Strip {
            name: own.device.clone(),
            on: "conducts",
            off: "blocks",
            start: Some(own.at_start),
            times: own.changes.iter().map(|change| change.0).collect(),
            states: own.changes.iter().map(|change| change.1.into()).collect(),
        });
        self.strips.extend(strips);
        self
    }
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
