//! Waveforms of any file as a page, pages in the browser, and pages that follow their netlist.
#![cfg(all(unix, feature = "cli"))]
#![allow(missing_docs, reason = "tests")]

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

const DIVIDER: &str = "\
divider
v1 in 0 dc {top}
r1 in out 1k
r2 out 0 1k
.include top.inc
.tran 1m 3m
.end
";

/// What a page of a failed run begins with.
const ALERT: &str = "<pre role=\"alert\"";

fn circ(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_circ"));
    command.current_dir(folder).args(arguments);
    command
}

fn ran(folder: &Path, arguments: &[&str]) -> Output {
    circ(folder, arguments).output().expect("circ")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A folder with a netlist and a browser that writes down what it is to show.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("a.cir"), DIVIDER).expect("a file");
    fs::write(folder.path().join("top.inc"), ".param top=10\n").expect("a file");
    let browser = folder.path().join("xdg-open");
    let script = "#!/bin/sh\nprintf '%s\\n' \"$1\" > \"$(dirname \"$0\")/shown\"\n";
    fs::write(&browser, script).expect("a file");
    fs::set_permissions(&browser, fs::Permissions::from_mode(0o755)).expect("permissions");
    folder
}

/// What the browser of [`folder`] was asked to show by a command.
fn shown(folder: &Path, arguments: &[&str]) -> String {
    let path = format!("{}:/usr/bin:/bin", folder.display());
    let output = circ(folder, arguments).env("PATH", path).output();
    let output = output.expect("circ");
    assert!(output.status.success(), "{}", said(&output));
    until(|| {
        fs::read_to_string(folder.join("shown"))
            .ok()
            .filter(|s| s.ends_with('\n'))
    })
    .trim_end()
    .to_owned()
}

/// What there is before long.
fn until<T>(mut look: impl FnMut() -> Option<T>) -> T {
    let begin = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(begin.elapsed() < Duration::from_secs(60), "it never came");
        thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn what_is_no_number_in_a_file_is_a_gap_of_its_curve_and_is_counted() {
    let folder = folder();
    let text = "time,v(a),v(b)\n0,1,2\n1,nan,3\n2,2,\n3,1,inf\n4,2,4\n";
    fs::write(folder.path().join("gaps.csv"), text).expect("a file");
    let output = ran(
        folder.path(),
        &["view", "gaps.csv", "-o", "a.html", "-o", "a.svg"],
    );
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(
        said(&output),
        "note[gaps]: gaps.csv: 3 values are missing or not finite, the first in `v(a)` at t = 1e0 s; curves have gaps there\n"
    );
    let svg = fs::read_to_string(folder.path().join("a.svg")).expect("a picture");
    assert!(!svg.contains("NaN"), "{svg}");
    // Of each curve a line of two rows and a row alone.
    assert_eq!(
        svg.matches("<path fill=\"none\" stroke-linejoin").count(),
        2
    );
    assert_eq!(svg.matches("<circle").count(), 2);
    // What a comparison would pass over in silence it refuses.
    let output = ran(
        folder.path(),
        &["compare", "a.cir", "--against", "gaps.csv"],
    );
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said(&output).contains("3 values are missing"),
        "{}",
        said(&output)
    );
}

#[test]
fn waveforms_of_every_format_are_the_same_page() {
    let folder = folder();
    let at = folder.path();
    let files = ["a.csv", "a.raw", "a.npz", "a.json"];
    for file in files {
        assert!(ran(at, &["a.cir", "-o", file]).status.success());
    }
    let page = |file: &str| {
        let output = ran(at, &["view", file, "-o", "-", "--format", "html"]);
        assert!(output.status.success(), "{}", said(&output));
        let page = String::from_utf8(output.stdout).expect("text");
        // Titles are not in every format.
        page[page.find("\"axis\"").expect("data")..].to_owned()
    };
    let pages: Vec<String> = files.map(page).into();
    assert!(pages[0].contains("v(out)"));
    assert!(pages.iter().all(|page| *page == pages[0]));
    let output = ran(
        at,
        &[
            "view", "a.csv", "--probe", "v(*t)", "-o", "-", "--format", "svg",
        ],
    );
    let drawing = String::from_utf8(output.stdout).expect("text");
    assert!(drawing.contains("v(out)") && !drawing.contains("v(in)"));
}

#[test]
fn what_cannot_be_viewed_is_said() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("x.csv"), "a,b\n1,2\n").expect("a file");
    fs::write(at.join("no-rows.csv"), "time,v(in)\n").expect("a file");
    let empty = ran(at, &["view", "no-rows.csv", "-o", "x.html"]);
    assert!(
        empty.status.success()
            && said(&empty).contains("no-rows.csv: has names of signals, and no rows")
    );
    fs::write(at.join("w.csv"), "time,v(in),v(out)\n0,1,2\n1,1,2\n").expect("a file");
    for (arguments, words) in [
        (
            &["view", "x.csv"][..],
            "not a csv file of waveforms: the first column must be `time` or `frequency`, found `a`",
        ),
        (&["view", "none.raw"], "none.raw: No such file"),
        (
            &["view", "a.cir", "-o", "a.csv"],
            "a.csv: the ending chooses the format and must be svg, png or html",
        ),
        (
            &["view", "w.csv", "-o", "-"],
            "must be svg, png or html, as in `--format html`",
        ),
        (
            &["view", "w.csv", "--probe", "V(oot)", "-o", "w.svg"],
            "--probe V(oot): the file has no `V(oot)`; did you mean `v(out)`?",
        ),
        (
            &["view", "w.csv", "--probe", "x", "-o", "w.svg"],
            "--probe x: the file has v(in) v(out)",
        ),
        (
            &["watch", "check", "a.cir"],
            "`circ watch` takes sim, pss or ac",
        ),
        (&["watch", "-"], "standard input does not change"),
        (&["watch", "a.cir", "--stpe", "1"], "--stpe"),
    ] {
        let output = ran(at, arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(
            said(&output).contains(words),
            "{arguments:?}: {}",
            said(&output)
        );
    }
}

#[test]
fn pages_are_opened_in_the_browser() {
    let folder = folder();
    let at = folder.path();
    let page = shown(at, &["sim", "a.cir", "--open"]);
    assert!(
        fs::read_to_string(&page)
            .expect("a page")
            .contains("v(out)")
    );
    fs::remove_file(&page).expect("a page");
    assert_eq!(
        shown(at, &["a.cir", "-o", "own.html", "-o", "a.raw", "--open"]),
        "own.html"
    );
    fs::remove_file(at.join("shown")).expect("what was shown");
    let page = shown(at, &["view", "a.raw"]);
    assert!(
        fs::read_to_string(&page)
            .expect("a page")
            .contains("v(out)")
    );
    fs::remove_file(page).expect("a page");
}

/// A watching process, which ends with its test.
struct Watching(Child, String);

impl Drop for Watching {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Watching {
    fn begin(folder: &Path, arguments: &[&str]) -> Self {
        let mut child = circ(folder, &[&["watch", "--no-open"], arguments].concat())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("circ");
        let mut address = String::new();
        let out = child.stdout.as_mut().expect("standard output");
        BufReader::new(out)
            .read_line(&mut address)
            .expect("an address");
        let host = address
            .trim()
            .trim_start_matches("http://")
            .trim_end_matches('/');
        Self(child, host.to_owned())
    }

    fn get(&self, place: &str, host: &str) -> String {
        let mut stream = TcpStream::connect(&self.1).expect("a server");
        write!(
            stream,
            "GET {place} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"
        )
        .expect("a request");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("an answer");
        answer
    }

    /// The page, as soon as it holds these words.
    fn until_it_says(&self, words: &str) -> String {
        until(|| Some(self.get("/", &self.1)).filter(|page| page.contains(words)))
    }
}

#[test]
fn a_watched_page_follows_its_netlist_and_what_that_includes() {
    let folder = folder();
    let at = folder.path();
    let watching = Watching::begin(at, &["a.cir", "--probe", "v(out)"]);
    assert!(watching.1.starts_with("127.0.0.1:"));
    let first = watching.until_it_says("v(out)");
    assert!(!first.contains(ALERT));
    fs::write(at.join("top.inc"), ".param top=1k0x\n").expect("a file");
    assert!(watching.until_it_says("top.inc").contains(ALERT));
    fs::write(at.join("top.inc"), ".param top=20\n").expect("a file");
    let third = until(|| {
        let page = watching.get("/", &watching.1);
        (page.contains("v(out)") && !page.contains(ALERT)).then_some(page)
    });
    assert_ne!(first, third);
    assert!(watching.get("/version", &watching.1).contains("200 OK"));
    assert!(watching.get("/other", &watching.1).contains("404"));
    // A page elsewhere whose name leads here gets nothing.
    assert!(watching.get("/", "example.org").contains("403"));
}

#[test]
fn a_run_that_is_under_way_ends_when_its_netlist_changes() {
    let folder = folder();
    let at = folder.path();
    let long = "long\nv1 in 0 sin(0 1 1meg)\nr1 in out 1k\nc1 out 0 1n\n.tran 1n 1000\n";
    fs::write(at.join("b.cir"), long).expect("a file");
    let watching = Watching::begin(
        at,
        &[
            "b.cir", "--method", "euler", "--step", "1n", "--probe", "v(out)",
        ],
    );
    thread::sleep(Duration::from_millis(300));
    fs::write(at.join("b.cir"), long.replace("1000", "10n")).expect("a file");
    watching.until_it_says("v(out)");
}
