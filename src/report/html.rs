//! One self-contained page: the picture, what the run did, events, impulses, notes.

use super::figure::Figure;
use super::sheet::escaped;
use super::{PictureError, si, svg, text};
use crate::integrate::{Places, Run};

const STYLE: &str = "body{font-family:sans-serif;margin:2em auto;max-width:70em;color:#282828}\
svg{max-width:100%;height:auto}pre{background:#f4f4f4;padding:1em;overflow:auto}\
table{border-collapse:collapse}td,th{padding:.2em 1em;border-bottom:1px solid #ddd;text-align:right}";

/// The page of a run and a picture of it, without references to anything outside itself.
///
/// # Errors
/// Those of [`svg::draw`].
pub fn page(run: &Run, places: Places<'_>, figure: &Figure) -> Result<String, PictureError> {
    let summary = escaped(&text::summary(run, places, false));
    let plan: String = run
        .plan
        .iter()
        .map(|reason| format!("<li>{}</li>", escaped(reason)))
        .collect();
    let events = run
        .events
        .iter()
        .map(|event| [si::quantity(event.t, "s", 9), event.to_string()]);
    let impulses = run.impulses.iter().map(|i| {
        let unit = if i.name.starts_with("i(") {
            "A·s"
        } else {
            "V·s"
        };
        [
            si::quantity(i.t, "s", 9),
            format!("{} {}", i.name, si::quantity(i.area, unit, 5)),
        ]
    });
    let rest = format!(
        "<h2>Run</h2>\n<pre>{summary}</pre>\n<ul>{plan}</ul>\n{}{}",
        table("Events", ["time", "what"], events),
        table("Impulses", ["time", "area"], impulses),
    );
    sheet(figure, &rest)
}

/// A page with a picture and what follows it, in HTML.
///
/// # Errors
/// Those of [`svg::draw`].
pub fn sheet(figure: &Figure, rest: &str) -> Result<String, PictureError> {
    let (title, picture) = (escaped(&figure.title), svg::draw(figure)?);
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title><style>{STYLE}</style></head>\n\
         <body><h1>{title}</h1>\n{picture}\n{rest}</body></html>\n",
    ))
}

fn table(heading: &str, header: [&str; 2], rows: impl Iterator<Item = [String; 2]>) -> String {
    let rows: String = rows
        .map(|[a, b]| {
            format!(
                "<tr><td>{}</td><td>{}</td></tr>\n",
                escaped(&a),
                escaped(&b)
            )
        })
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    let [a, b] = header;
    format!("<h2>{heading}</h2>\n<table><tr><th>{a}</th><th>{b}</th></tr>\n{rows}</table>\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::Impulse;
    use crate::integrate::event::conducts;
    use crate::waveform::Waveforms;

    #[test]
    fn the_page_stands_alone_and_escapes_the_title() {
        let run = Run {
            waveforms: Waveforms {
                title: "<script>alert(1)</script>".into(),
                names: vec!["v(out)".into()],
                units: vec!["V"],
                time: vec![0.0, 1.0],
                values: vec![0.0, 1.0],
            },
            events: vec![conducts("d1", 0.5)],
            impulses: vec![Impulse {
                t: 0.5,
                name: "i(d1)".into(),
                area: 1e-6,
            }],
            ..Run::default()
        };
        let page = page(
            &run,
            Places::default(),
            &Figure::of_waveforms(&run.waveforms),
        )
        .unwrap();
        assert!(
            page.contains("<svg ") && page.contains("d1 conducts") && page.contains("i(d1) 1 µA·s")
        );
        assert!(!page.contains("<script") && !page.contains("src=") && !page.contains("href="));
    }
}
