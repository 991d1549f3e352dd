//! Rows, files and interruption, as users of the command meet them.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use circ::integrate::{Method, Run, SimOptions, VerifyOptions, simulate, verify};
use circ::waveform::{Waveforms, csv, json, npz, raw};
use tempfile::TempDir;

/// `circ` in a folder that also holds `tests/findings/NAME.cir`.
fn circ(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_circ"));
    command.current_dir(folder).stdin(Stdio::null());
    command
}

fn place(netlists: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for name in netlists {
        let to = folder.path().join(name).with_extension("cir");
        fs::copy(super::path(name), to).expect("a copy");
    }
    folder
}

fn ends(folder: &Path, arguments: &str) -> Output {
    let arguments = arguments.split_whitespace();
    circ(folder).args(arguments).output().expect("circ runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The names in a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let name = |entry: fs::DirEntry| entry.file_name().to_string_lossy().into_owned();
    let mut names: Vec<String> = entries
        .map(|entry| name(entry.expect("an entry")))
        .collect();
    names.sort();
    names
}

/// Sends a signal by the shell's `kill`.
fn kill(child: &Child, signal: &str) {
    let command = format!("kill -{signal} {}", child.id());
    let sent = Command::new("sh").args(["-c", &command]).status();
    assert!(sent.expect("a shell").success());
}

/// Asks a program to end more than once within a moment, as `timeout` does.
fn terminate(child: &Child) {
    let id = child.id();
    let command =
        format!("kill -TERM {id} && for _ in 1 2 3 4 5 6 7 8 9; do kill -TERM {id}; done");
    let sent = Command::new("sh").args(["-c", &command]).status();
    sent.expect("a shell");
}

/// Waits until something holds, a minute at most.
fn until(what: &str, holds: impl Fn() -> bool) {
    let begin = Instant::now();
    while !holds() {
        assert!(begin.elapsed() < Duration::from_secs(60), "never {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Bytes in the folder's files.
fn bytes(folder: &Path) -> u64 {
    let sizes = names(folder).into_iter();
    sizes
        .map(|name| fs::metadata(folder.join(name)).map_or(0, |m| m.len()))
        .sum()
}

fn read_csv(path: &Path) -> Waveforms {
    csv::read(fs::File::open(path).expect("a file")).expect("rows")
}

/// Largest memory of a process so far, kB.
#[cfg(target_os = "linux")]
fn peak_memory(child: &Child) -> u64 {
    let status = fs::read_to_string(format!("/proc/{}/status", child.id())).expect("a process");
    let line = status.lines().find(|line| line.starts_with("VmHWM"));
    let words = line.expect("a size").split_whitespace();
    words
        .filter_map(|word| word.parse().ok())
        .next()
        .expect("kB")
}

/// A thousand million rows: none of them waits in memory, and Ctrl-C leaves whole files of those so far that say so.
#[test]
#[cfg(target_os = "linux")]
fn rows_are_written_as_they_come_and_an_interrupted_run_keeps_them() {
    let folder = place(&["rows_1e9"]);
    let arguments = ["sim", "rows_1e9.cir", "-o", "a.csv", "-o", "a.raw"];
    let mut command = circ(folder.path());
    let child = command.args(arguments).stderr(Stdio::piped()).spawn();
    let child = child.expect("circ runs");
    until("a million bytes", || bytes(folder.path()) > 1_000_000);
    let before = peak_memory(&child);
    until("thirty million bytes", || bytes(folder.path()) > 30_000_000);
    // 4e5 rows more would be 10 MB.
    assert!(peak_memory(&child) < before + 2000, "{before} kB");
    assert!(!folder.path().join("a.csv").exists());
    kill(&child, "INT");
    let output = child.wait_with_output().expect("an end");
    assert_eq!(output.status.code(), Some(130));
    let said = said(&output);
    assert!(
        said.contains("interrupted by SIGINT; the rows until "),
        "{said}"
    );
    assert_eq!(names(folder.path()), ["a.csv", "a.raw", "rows_1e9.cir"]);
    let text = read_csv(&folder.path().join("a.csv"));
    let binary = fs::File::open(folder.path().join("a.raw")).expect("a file");
    let binary = raw::read(binary).expect("rows");
    assert!(text.len() > 100_000);
    assert_eq!((&text.time, &text.values), (&binary.time, &binary.values));
    let last = text.time[text.len() - 1];
    assert!(said.contains(&format!("until {last:e} s")), "{said}");
    let title = format!("ten to the nine rows (incomplete: ends at {last:e} s)");
    assert_eq!(binary.title, title);
}

/// What needs all rows at once is refused with their number before anything is done.
#[test]
fn rows_that_do_not_fit_are_refused_with_their_number() {
    let folder = place(&["rows_1e9"]);
    for format in ["npz", "json", "svg", "html"] {
        let output = ends(folder.path(), &format!("sim rows_1e9.cir -o b.{format}"));
        assert_eq!(output.status.code(), Some(2));
        let said = said(&output);
        assert!(
            said.contains("1.000000001e9 rows of 3 values are 24.000 GB, more than the 1.074 GB"),
            "{said}"
        );
    }
    let text = fs::read_to_string(folder.path().join("rows_1e9.cir")).expect("a netlist");
    let measured = text.replace(".end", ".meas tran top max v(a)\n.end");
    let dense = text.replace(".tran 1n 1", ".tran 1e-30 1e30");
    fs::write(folder.path().join("measured.cir"), measured).expect("a netlist");
    fs::write(folder.path().join("dense.cir"), dense).expect("a netlist");
    let output = ends(folder.path(), "sim measured.cir -o b.csv");
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said(&output).contains("e9 rows of 3 values"),
        "{}",
        said(&output)
    );
    let output = ends(folder.path(), "sim dense.cir -o b.csv");
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said(&output).contains("1e60 rows from 0e0 s"),
        "{}",
        said(&output)
    );
    assert_eq!(
        names(folder.path()),
        ["dense.cir", "measured.cir", "rows_1e9.cir"]
    );
}

/// SIGTERM within the first return of a search for an orbit, which takes minutes.
#[test]
#[cfg(unix)]
fn a_search_for_an_orbit_ends_within_a_return() {
    let folder = place(&[]);
    let path = folder.path();
    let slow = "one long period\nv1 a 0 sin(0 1 1k)\nl1 a b 1m\nd1 b c dd\nr1 c 0 1\n.model dd d(ideal)\n.tran 1m 1\n.end\n";
    fs::write(path.join("slow.cir"), slow).expect("a netlist");
    let mut command = circ(path);
    command.args("pss slow.cir --period 20000 -o orbit.csv".split_whitespace());
    let child = command.stderr(Stdio::piped()).spawn().expect("circ runs");
    std::thread::sleep(Duration::from_millis(400));
    let begun = std::time::Instant::now();
    kill(&child, "TERM");
    let output = child.wait_with_output().expect("an end");
    assert!(begun.elapsed() < Duration::from_secs(10));
    assert_eq!(output.status.code(), Some(143), "{}", said(&output));
    assert!(
        said(&output).contains("interrupted by SIGTERM"),
        "{}",
        said(&output)
    );
    assert_eq!(names(path), ["slow.cir"]);
}

/// SIGTERM, more than once, in the middle of one print step of very many steps; the rows before are in the pipe and in each file.
#[test]
#[cfg(unix)]
fn a_run_ends_at_once_and_keeps_its_rows_in_every_format() {
    let folder = place(&[]);
    let path = folder.path();
    let slow = "one long step\nv1 a 0 sin(0 1 1k)\nl1 a b 1m\nd1 b c dd\nr1 c 0 1\n.model dd d(ideal)\n\
        .tran 2000 2000\n.end\n";
    fs::write(path.join("slow.cir"), slow).expect("a netlist");
    for method in ["exact", "theta --step 1u"] {
        for outputs in ["", "-o a.csv -o a.raw -o a.npz -o a.json -o a.html"] {
            let arguments = format!("sim slow.cir --method {method} {outputs}");
            let mut command = circ(path);
            command.args(arguments.split_whitespace());
            let child = command
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn();
            let child = child.expect("circ runs");
            std::thread::sleep(Duration::from_millis(400));
            terminate(&child);
            let output = child.wait_with_output().expect("an end");
            assert_eq!(output.status.code(), Some(143), "{}", said(&output));
            assert!(said(&output).contains("interrupted by SIGTERM"));
            if outputs.is_empty() {
                let rows = String::from_utf8_lossy(&output.stdout).into_owned();
                assert_eq!(rows.lines().count(), 2, "{rows}");
                continue;
            }
            let file = |name: &str| fs::File::open(path.join(name)).expect("a file");
            let rows = read_csv(&path.join("a.csv"));
            let others = [
                raw::read(file("a.raw")).expect("rows"),
                npz::read(file("a.npz")).expect("rows"),
                json::read(file("a.json")).expect("rows"),
            ];
            for other in &others {
                assert_eq!((&other.time, &other.values), (&rows.time, &rows.values));
            }
            let note = "one long step (incomplete: ends at 0e0 s)";
            assert_eq!([&others[0].title, &others[2].title], [note, note]);
            let page = fs::read_to_string(path.join("a.html")).expect("a page");
            assert!(page.contains("incomplete"));
        }
    }
}

/// Whatever it is called, a file that the run reads is not written.
#[test]
#[cfg(unix)]
fn files_that_are_read_are_not_overwritten() {
    use std::os::unix::fs::symlink;
    let folder = place(&[]);
    let path = folder.path();
    let netlist =
        "reads files\n.include part.inc.csv\nv1 a 0 pwl file=stim.csv\n.tran 1m 10m\n.end\n";
    let files = [
        ("net.cir.csv", netlist),
        ("part.inc.csv", "r1 a 0 1k\n"),
        ("stim.csv", "0,0\n10m,1\n"),
    ];
    for (name, text) in files {
        fs::write(path.join(name), text).expect("a file");
    }
    symlink("stim.csv", path.join("link.csv")).expect("a link");
    fs::hard_link(path.join("stim.csv"), path.join("hard.csv")).expect("a link");
    let outputs = [
        "stim.csv",
        "./stim.csv",
        "link.csv",
        "hard.csv",
        "part.inc.csv",
        "net.cir.csv",
    ];
    for output in outputs {
        let ended = ends(path, &format!("sim net.cir.csv -o good.csv -o {output}"));
        assert_eq!(ended.status.code(), Some(2), "{output}");
        assert!(
            said(&ended).contains("would be overwritten"),
            "{}",
            said(&ended)
        );
        let ended = ends(path, &format!("lcs net.cir.csv -o {output}"));
        assert_eq!(ended.status.code(), Some(2), "{output}");
        assert!(!path.join("good.csv").exists());
    }
    for (name, text) in files {
        assert_eq!(fs::read_to_string(path.join(name)).expect("a file"), text);
    }
    let ended = ends(path, "sim net.cir.csv -o good.csv");
    assert_eq!(ended.status.code(), Some(0), "{}", said(&ended));
    assert_eq!(read_csv(&path.join("good.csv")).len(), 11);
}

/// A run that fails keeps an earlier result of the same name until it has something itself, and says that it is not whole.
#[test]
fn a_run_that_fails_says_which_rows_it_leaves() {
    let folder = place(&[]);
    let path = folder.path();
    let netlist =
        "fails\ni1 0 a pwl(0 -1 2m 1)\nd1 0 a di\n.model di d(ideal)\n.tran 0.5m 2m\n.end\n";
    fs::write(path.join("net.cir"), netlist).expect("a netlist");
    fs::write(path.join("out.csv"), "of an earlier run").expect("a file");
    let ended = ends(path, "sim net.cir -o nowhere/out.csv -o out.csv");
    assert_eq!(ended.status.code(), Some(2));
    assert_eq!(
        fs::read_to_string(path.join("out.csv")).expect("a file"),
        "of an earlier run"
    );
    let ended = ends(path, "sim net.cir -o out.csv -o out.json");
    assert_eq!(ended.status.code(), Some(2));
    let rows = read_csv(&path.join("out.csv"));
    assert_eq!(rows.time, [0.0, 0.5e-3, 1e-3]);
    assert!(
        said(&ended).contains("; the rows until 1e-3 s are in out.csv, out.json"),
        "{}",
        said(&ended)
    );
    let rows = json::read(fs::File::open(path.join("out.json")).expect("a file")).expect("rows");
    assert_eq!(rows.title, "fails (incomplete: ends at 1e-3 s)");
    assert_eq!(names(path), ["net.cir", "out.csv", "out.json"]);
}

/// A full disk and a reader that goes away end a run at once; the first is a failure.
#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_and_a_closed_pipe_end_the_run() {
    let folder = place(&["rows_1e9"]);
    let full = fs::OpenOptions::new().write(true).open("/dev/full");
    let mut command = circ(folder.path());
    let arguments = ["sim", "rows_1e9.cir"];
    let output = command
        .args(arguments)
        .stdout(full.expect("a device"))
        .output();
    let output = output.expect("circ runs");
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said(&output).contains("No space left on device"),
        "{}",
        said(&output)
    );
    let mut command = circ(folder.path());
    let child = command
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let mut child = child.expect("circ runs");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("an end");
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert_eq!(said(&output), "");
}

/// Two rows a period without a print step: the ripple of the current stands in the rows at edges and events.
#[test]
fn what_rows_cannot_show_is_told() {
    let folder = place(&[]);
    let notes = |netlist: &str| {
        fs::write(folder.path().join("t.cir"), netlist).expect("a netlist");
        said(&ends(folder.path(), "sim t.cir -o t.csv"))
    };
    // A switch interrupts the current of an inductor, which its Roff takes: 39 MV for 20 fs.
    let chopped = "chopped\nvin in 0 48\nllk in d 20n\ns1 d sw g 0 sw\nd1 0 sw d\nl1 sw out 22u\nc1 out 0 100u\nr1 out 0 4\nvg g 0 pulse(0 10 0 5n 5n 0.8u 2u)\n\
                   .model sw sw(ron=50m roff=1meg vt=5)\n.model d d(ron=20m roff=1meg vfwd=0.5)\n.tran 10n 100u\n.meas tran a avg v(d)\n.end\n";
    assert!(
        notes(chopped).contains("has fallen before the next row"),
        "{}",
        notes(chopped)
    );
    let clamped = chopped.replace("llk in d 20n", "rlk in d 1m");
    assert!(
        !notes(&clamped).contains("has fallen"),
        "{}",
        notes(&clamped)
    );
    // 16 MHz, of which rows 5 µs apart show nothing.
    let rings = "rings\nv1 in 0 pulse(0 10 0 1n 1n 1 2)\nl1 in a 1u\nc1 a 0 100p\nr1 a 0 10k\n.tran TSTEP 5m\n.meas tran m max v(a)\n.end\n";
    let coarse = notes(&rings.replace("TSTEP", "5u"));
    assert!(coarse.contains("rings at 15.9 MHz"), "{coarse}");
    let fine = notes(&rings.replace("TSTEP 5m", "10n 50u"));
    assert!(!fine.contains("rings at"), "{fine}");
}

#[test]
fn pictures_follow_curves_between_rows() {
    // At corners and events the output of a buck is at its mean: rows there alone hide its ripple, rows of the grid miss most periods.
    let buck = "buck\nv1 in 0 24\nvg g 0 pulse(0 10 0 10n 10n 2.49u 10u)\ns1 in sw g 0 sw\nd1 0 sw d\nl1 sw out 47u\nc1 out 0 47u\nr1 out 0 3\n\
                .model sw sw(ron=10m roff=1meg vt=5)\n.model d d(ron=10m vfwd=0.4)\n.tran 20m\n.end\n";
    let model = circ::Model::parse(buck, "buck.cir").expect("a circuit");
    let asked = || SimOptions {
        events: true,
        corners: true,
        ..SimOptions::default()
    };
    let ripple = |run: &Run| {
        let out = run.waveforms.find("v(out)").expect("a signal");
        let rows = run.waveforms.time.iter().zip(run.waveforms.column(out));
        let late = rows.filter(|(t, _)| **t > 19e-3).map(|(_, v)| v);
        let (low, high) = late.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        high - low
    };
    let finished = circ::analysis::pictured(&model, asked());
    let (run, _) = finished.run.expect("a run");
    // T² V_out (1 − D)/(8 L C), and what losses add.
    let right = 1e-10 * 5.9 * 0.75 / (8.0 * 47e-6 * 47e-6);
    assert!(
        (ripple(&run) / right - 1.0).abs() < 0.1,
        "{} of {right}",
        ripple(&run)
    );
    // It does where something is measured, too.
    let measured = buck.replace(".end", ".meas tran m pp v(out) from=19m\n.end");
    let measured = circ::Model::parse(&measured, "buck.cir").expect("a circuit");
    let finished = circ::analysis::pictured(&measured, asked());
    let (pictured, found) = finished.run.expect("a run");
    let value = found.measured[0].result.as_ref().expect("a value").value;
    for ripple in [ripple(&pictured), value] {
        assert!((ripple / right - 1.0).abs() < 0.1, "{ripple} of {right}");
    }
    let rows = model.transient(asked()).expect("a run");
    assert!(ripple(&rows) < 0.1 * right, "{}", ripple(&rows));
    // Files have the rows that they have without a picture.
    let kept = |run: &Run| -> Vec<f64> {
        let rows = run.waveforms.time.iter().zip(&run.kinds);
        let rows = rows.filter(|(_, kind)| **kind != circ::integrate::RowKind::Between);
        rows.map(|(t, _)| *t).collect()
    };
    let (with, without) = (kept(&run), kept(&rows));
    assert_eq!(with.len(), without.len());
    let near = with
        .iter()
        .zip(&without)
        .all(|(a, b)| (a - b).abs() < 1e-15);
    assert!(near && with.len() < run.waveforms.len());
}

#[test]
fn rows_stand_at_events_and_corners_where_no_print_step_is_named() {
    let right = 4.1417;
    let folder = place(&["aliased_rows"]);
    for method in ["exact", "theta"] {
        let arguments = format!("sim aliased_rows.cir -o a.csv --method {method}");
        let ended = ends(folder.path(), &arguments);
        assert_eq!(ended.status.code(), Some(0), "{}", said(&ended));
        let rows = read_csv(&folder.path().join("a.csv"));
        let current = rows.find("i(l1)").expect("a current");
        let late = rows
            .time
            .iter()
            .zip(rows.column(current))
            .filter(|(t, _)| **t >= 4.9e-3);
        let (low, high) = late.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, i)| {
            (low.min(i), high.max(i))
        });
        assert!(
            (high - low - right).abs() < 1e-3,
            "{method}: {}",
            high - low
        );
        assert!(
            said(&ended).contains("ipp                 =  4.14169"),
            "{}",
            said(&ended)
        );
        // The grid of 1,000 steps is among them.
        for k in 0..=1000 {
            let t = f64::from(k) * 5e-6;
            assert!(rows.time.iter().any(|row| (row - t).abs() < 1e-15), "{t}");
        }
    }
}

/// A print step of half a period or more is a warning that names what repeats: a source or, without one, a switch. A run without states
/// does not claim to know its error.
#[test]
fn a_print_step_that_shows_nothing_is_a_warning() {
    let folder = place(&["print_step", "aliased_rows"]);
    let path = folder.path();
    let warned = |netlist: &str, text: &str| {
        fs::write(path.join("net.cir"), text).expect("a netlist");
        let ended = ends(path, "sim net.cir -o a.csv");
        assert_eq!(ended.status.code(), Some(0), "{netlist}: {}", said(&ended));
        let warned = said(&ended);
        let line = warned
            .lines()
            .find(|line| line.contains("is half or more of"));
        line.map(str::to_string)
    };
    let text = |name: &str| fs::read_to_string(super::path(name)).expect("a netlist");
    let rectifier = text("print_step");
    let found = warned("print_step", &rectifier).expect("a warning");
    assert!(
        found.starts_with(
            "warning[rows-apart]: net.cir:4:1: the print step, 10 ms, is half or more of the period of v1, 20 ms"
        ),
        "{found}"
    );
    assert_eq!(
        warned("fine", &rectifier.replace(".tran 10m", ".tran 1m")),
        None
    );
    let buck = text("aliased_rows");
    let found = warned("its own rows", &buck).expect("a warning");
    assert!(
        found.starts_with("note[") && found.contains("also where they ripple"),
        "{found}"
    );
    let found = warned("coarse", &buck.replace(".tran 5m", ".tran 7u 5m")).expect("a warning");
    assert!(
        found.contains("7 µs, is half or more of the period of vg, 10 µs"),
        "{found}"
    );
    // 100 kHz without corners between 1,000 rows.
    let tone = "tone\nv1 a 0 sin(0 1 100k)\nr1 a 0 1\n.tran 10m\n.end\n";
    let found = warned("tone", tone).expect("a warning");
    assert!(
        found.contains("1,000 rows") && found.contains("of v1, 10 µs"),
        "{found}"
    );
    // Charges through 1 kΩ from 1 V to 3 V of 4 V and is discharged at once: 1.1 ms.
    let oscillator = "oscillator\nv1 a 0 4\nr1 a b 1k\nc1 b 0 1u\ns1 b 0 b 0 sw\n\
        .model sw sw(vt=2 vh=1 ron=1 roff=1g)\n.tran 5m 100m uic\n.end\n";
    let found = warned("oscillator", oscillator).expect("a warning");
    assert!(
        found.contains("the period in which events repeat at s1, 1.1 ms"),
        "{found}"
    );
    assert_eq!(
        warned("fine", &oscillator.replace(".tran 5m", ".tran 0.1m")),
        None
    );
    fs::write(path.join("net.cir"), &rectifier).expect("a netlist");
    let ended = ends(path, "sim net.cir -q -o a.csv --summary text");
    assert!(!said(&ended).contains("error: 0"), "{}", said(&ended));
}

/// A second run by steps agrees with the exact one, and an exact one with steps; a curve that is off in one row, an edge that is late
/// and one that is missing are found, with their signal and time.
#[test]
fn a_second_run_verifies_the_first() {
    let netlist = "clocked\nv1 a 0 24\ns1 a b g 0 sw\nd1 0 b di\nl1 b c 40u\nc1 c 0 20u\nr1 c 0 4\n\
        vg g 0 pulse(0 1 3.3u 0 0 4.7u 10u)\n.model di d(ideal)\n.model sw sw(vt=0.5 ron=10m roff=1meg)\n\
        .save v(b) v(c) i(l1)\n.tran 1u 300u uic\n.end\n";
    let folder = place(&[]);
    fs::write(folder.path().join("net.cir"), netlist).expect("a netlist");
    for (method, other) in [("exact", "theta"), ("theta", "exact")] {
        let arguments = format!("sim net.cir -o a.csv --verify --summary json --method {method}");
        let ended = ends(folder.path(), &arguments);
        let line = said(&ended);
        let line = line.lines().next().expect("a summary");
        let summary: serde_json::Value = serde_json::from_str(line).expect("JSON");
        let verified = &summary["verified"];
        let by = verified["method"].as_str().expect("a method");
        assert!(by.starts_with(other), "{by}");
        let number = |key: &str| verified[key].as_f64().expect("a number");
        let (difference, tolerance) = (number("max_difference"), number("tolerance"));
        // The estimate of a run of steps may fall short of its error by a little, and that is said.
        let status = i32::from(difference > tolerance);
        assert_eq!(ended.status.code(), Some(status), "{}", said(&ended));
        assert!(difference < 1e-4 && tolerance < 1e-3, "{line}");
        assert!(method == "theta" || status == 0, "{line}");
        // The rows are those of the run without it.
        assert_eq!(read_csv(&folder.path().join("a.csv")).len(), 301);
    }
    let loaded = circ::netlist::load(
        &folder.path().join("net.cir"),
        &circ::circuit::ElaborateOptions::default(),
    );
    let circuit = loaded.circuit.expect("a circuit");
    let behaviour = circ::mna::behaviour(&circuit).expect("a sound circuit");
    let options = SimOptions {
        method: Method::Exact,
        corners: true,
        ..SimOptions::default()
    };
    let run = simulate(&circuit, &behaviour, options).expect("a run");
    let judged_by = |run: &Run, options: &VerifyOptions<'_>| {
        verify(&circuit, &behaviour, run, options).expect("a second run")
    };
    let judged = |run: &Run| judged_by(run, &VerifyOptions::default());
    let whole = judged(&run);
    assert!(whole.holds() && whole.until.is_none(), "{whole:?}");
    let column = |name: &str| run.waveforms.find(name).expect("a signal");
    let width = run.waveforms.width();
    let at = |t: f64| {
        let mut rows = run.waveforms.time.iter();
        rows.position(|row| (row - t).abs() < 1e-12).expect("a row")
    };
    // One row off by a thousandth of the amplitude.
    let mut wrong = run.clone();
    wrong.waveforms.values[at(150e-6) * width + column("v(c)")] *= 1.001;
    let found = judged(&wrong);
    assert!(!found.holds() && found.signal == "v(c)", "{found:?}");
    assert!((found.time - 150e-6).abs() < 1e-12, "{found:?}");
    // With fewer steps than that asks for the beginning is verified, and how far is said.
    let mut few = VerifyOptions::default();
    few.settings.max_steps = 1000;
    let found = judged_by(&wrong, &few);
    let until = found.until.expect("an end");
    assert!(
        found.holds() && (20e-6..149e-6).contains(&until),
        "{found:?}"
    );
    wrong.waveforms.values[at(15e-6) * width + column("v(c)")] *= 1.001;
    let found = judged_by(&wrong, &few);
    assert!(
        !found.holds() && (found.time - 15e-6).abs() < 1e-12,
        "{found:?}"
    );
    // The pulse from 203.3 to 208 us left out: in rows, and in events.
    let mut wrong = run.clone();
    for (k, t) in run.waveforms.time.iter().enumerate() {
        if (203.25e-6..208.05e-6).contains(t) {
            wrong.waveforms.values[k * width + column("v(b)")] = 0.0;
        }
    }
    wrong.events.retain(|e| !(203e-6..209e-6).contains(&e.t));
    let found = judged(&wrong);
    assert!(!found.holds() && found.signal == "v(b)", "{found:?}");
    assert!((203.2e-6..208.1e-6).contains(&found.time), "{found:?}");
}

/// Corners of a source, jumps and events: rows without a print step, in pictures with one, and not in files with one.
#[test]
fn corners_jumps_and_events_have_rows() {
    let netlist = "corners\nv1 a 0 pwl(0 0 1.2345m 1 2.3456m 1 2.3456m -1 3m -1)\nr1 a b 1k\nd1 b 0 di\n\
        .model di d(ideal)\n.save v(a) i(d1)\nTRAN\n.end\n";
    let folder = place(&[]);
    let path = folder.path();
    let rows_of = |tran: &str, options: &str| {
        fs::write(path.join("net.cir"), netlist.replace("TRAN", tran)).expect("a netlist");
        let ended = ends(path, &format!("sim net.cir -o a.csv -o a.svg {options}"));
        assert_eq!(ended.status.code(), Some(0), "{}", said(&ended));
        (
            read_csv(&path.join("a.csv")),
            fs::read_to_string(path.join("a.svg")).expect("a picture"),
        )
    };
    for method in ["exact", "theta"] {
        let method = format!("--method {method}");
        let (own, _) = rows_of(".tran 3m", &method);
        assert_eq!(own.time.len(), 1001 + 1 + 2, "{method}");
        let at = |t: f64| -> Vec<f64> {
            let rows = own.time.iter().zip(own.column(0));
            rows.filter(|(row, _)| **row == t).map(|(_, v)| v).collect()
        };
        assert_eq!(at(1.2345e-3), [1.0], "{method}");
        assert_eq!(at(2.3456e-3), [1.0, -1.0], "{method}");
        let (coarse, drawn) = rows_of(".tran 1m 3m", &method);
        assert_eq!(coarse.time, [0.0, 1e-3, 2e-3, 3e-3]);
        // Four rows of the grid, the corner, two at the jump; the row on the straight line between the last two corners is no point.
        let curves = drawn.split("stroke-linejoin").skip(1);
        let points = curves.map(|curve| {
            let (_, path) = curve.split_once(" d=\"").expect("a path");
            let (path, _) = path.split_once('"').expect("a path");
            path.matches(['M', 'l', 'h', 'v']).count()
        });
        // Exact runs are made again with closer rows where they bend between these.
        let points = points.max().unwrap_or(0);
        assert!(
            points == 6 || points > 6 && method.ends_with("exact"),
            "{method}: {points}"
        );
        let (events, _) = rows_of(".tran 1m 3m", &format!("{method} --events"));
        assert_eq!(
            events.time,
            [0.0, 1e-3, 2e-3, 2.3456e-3, 2.3456e-3, 3e-3],
            "{method}"
        );
    }
}

/// A system of matrices says nothing of the powers of its sources and losses.
#[test]
fn a_system_without_a_circuit_reports_no_energies() {
    let folder = place(&[]);
    let system = r#"{"schema":"circ-lcs/1","states":[{"name":"v(c1)","unit":"V"}],"A":[[-1]],"x0":[1],
        "tran":{"tstep":0.1,"tstop":1,"uic":true}}"#;
    fs::write(folder.path().join("a.json"), system).expect("a system");
    let json = ends(folder.path(), "sim a.json -o a.csv --summary json");
    let summary: serde_json::Value = serde_json::from_slice(&json.stderr).expect("JSON");
    let energy = summary["energy"].as_object().expect("keys");
    assert!(energy.contains_key("residual_relative"));
    assert!(energy.values().all(serde_json::Value::is_null), "{summary}");
    let words = said(&ends(folder.path(), "sim a.json -o a.csv --summary text"));
    assert!(!words.contains("energy: "), "{words}");
    assert!(words.contains("no powers to balance"), "{words}");
}

/// A jump whose impulse passes a source that other devices move has no energy that is known: that the energies do not add up is said.
#[test]
fn energies_that_do_not_add_up_are_a_warning() {
    let folder = place(&[]);
    let text = "a source across two diodes\nv1 n0 0 pulse(-3 4 0 0 0 0.25m 0.5m)\nr1 n1 n0 628.5\nr2 n2 n0 55.63\nr3 n3 n0 56.68
r4 n4 n3 391.2\nr5 n5 0 412.9\nc1 0 n2 0.44u ic=0\nc2 n1 n3 0.28u ic=1\nd0 n4 n5 di\nd1 n3 n2 di\ne0 m0 n3 n2 n4 1\nde0 m0 n1 di
rm0 m0 0 6554\n.model di d(ideal)\n.tran 5u 2m uic\n.end\n";
    fs::write(folder.path().join("a.cir"), text).expect("a netlist");
    let words = said(&ends(folder.path(), "sim a.cir -o a.csv"));
    assert!(
        words.contains("the energies of this run do not add up"),
        "{words}"
    );
}

/// A solution that grows so far is unstable, or wrong: nothing checks it.
#[test]
fn energies_beyond_doubles_are_a_warning() {
    let folder = place(&["grows_beyond_energy"]);
    let run = ends(folder.path(), "sim grows_beyond_energy.cir -o a.csv");
    assert!(said(&run).contains("beyond the range of numbers, so that nothing checks it"));
}
