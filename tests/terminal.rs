//! What a person sees on a terminal: progress and colours, and neither where they are not wanted.
#![cfg(all(unix, feature = "cli"))]
#![allow(missing_docs, reason = "tests")]

use std::fs::File;
use std::io::Read;
use std::process::{Command, Stdio};

use nix::pty::{Winsize, openpty};

const NETLIST: &str = "\
half-wave rectifier
v1 in 0 sin(0 10 50)
d1 in out di
c1 out 0 100u
r1 out 0 1M
.model di d(ideal)
.tran 1m 40m
";

/// What is written to a terminal as standard error of `circ sim` with this environment.
fn seen(netlist: &str, arguments: &[&str], environment: &[(&str, &str)]) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a.cir"), netlist).expect("a file");
    let size = Winsize {
        ws_row: 24,
        ws_col: 100,
        ws_xpixel: 0,
        ws_ypixel: 0,
    };
    let terminal = openpty(&size, None).expect("a terminal");
    let mut command = Command::new(env!("CARGO_BIN_EXE_circ"));
    command
        .current_dir(folder.path())
        .args(["sim", "a.cir"])
        .args(arguments)
        .env_remove("NO_COLOR")
        .env_remove("CLICOLOR")
        .env_remove("CLICOLOR_FORCE")
        .env("TERM", "xterm-256color")
        .envs(environment.iter().copied())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::from(terminal.slave));
    let mut child = command.spawn().expect("circ");
    // Else the terminal is never at its end.
    drop(command);
    let mut text = Vec::new();
    let mut end = File::from(terminal.master);
    let mut buffer = [0; 4096];
    // The end of a terminal is an error on Linux.
    while let Ok(count) = end.read(&mut buffer) {
        if count == 0 {
            break;
        }
        text.extend_from_slice(&buffer[..count]);
    }
    child.wait().expect("circ");
    String::from_utf8_lossy(&text).into_owned()
}

/// Whether there is an escape sequence that sets a colour.
fn has_colour(text: &str) -> bool {
    text.split("\u{1b}[").skip(1).any(|rest| {
        let end = rest.find(|c: char| !(c.is_ascii_digit() || c == ';'));
        end.is_some_and(|end| end > 0 && rest[end..].starts_with('m') && &rest[..end] != "0")
    })
}

#[test]
fn progress_says_what_is_done_and_is_taken_away() {
    let text = seen(NETLIST, &[], &[]);
    for words in ["reading a.cir", "reducing", "setting up", "simulating "] {
        assert!(text.contains(words), "{words}: {text:?}");
    }
    assert!(text.contains(" of 40 ms"), "{text:?}");
    let verified = seen(&NETLIST.replace("1M", "1k"), &["--verify"], &[]);
    assert!(
        verified.contains("looking at the run again"),
        "{verified:?}"
    );
    // The last thing on the terminal are words, the line of the bar was cleared before them.
    let summary = text.rfind("energy:").expect("the summary");
    assert!(!text[summary..].contains("simulating"), "{text:?}");
}

#[test]
fn a_terminal_of_lines_and_silence_have_no_progress() {
    for (arguments, environment) in [(&[][..], &[("TERM", "dumb")][..]), (&["-q"], &[])] {
        let text = seen(NETLIST, arguments, environment);
        assert!(!text.contains("simulating"), "{text:?}");
        assert!(!text.contains("reading"), "{text:?}");
        if !environment.is_empty() {
            assert!(!text.contains('\u{1b}'), "{text:?}");
        }
    }
}

#[test]
fn a_person_is_told_where_there_is_more_on_an_error() {
    let text = seen(&NETLIST.replace(".model", "*"), &[], &[]);
    assert!(text.contains("unknown-model"), "{text:?}");
    assert!(text.contains("`circ explain CODE` tells more"), "{text:?}");
    assert!(!seen(NETLIST, &[], &[]).contains("circ explain"));
}

#[test]
fn colours_are_those_that_are_wanted() {
    // The value of r1 is a warning.
    for (environment, coloured) in [
        (&[][..], true),
        (&[("NO_COLOR", "1")][..], false),
        (&[("NO_COLOR", "")], true),
        (&[("CLICOLOR", "0")], false),
        (&[("CLICOLOR", "1")], true),
        (&[("TERM", "dumb")], false),
        (&[("TERM", "dumb"), ("CLICOLOR_FORCE", "1")], true),
        (&[("NO_COLOR", "1"), ("CLICOLOR_FORCE", "1")], false),
    ] {
        let text = seen(NETLIST, &[], environment);
        assert!(text.contains("suffix-m"), "{text:?}");
        assert_eq!(has_colour(&text), coloured, "{environment:?}: {text:?}");
    }
}
