//! The command `circ` as its users meet it: exit status, standard output, standard error, files.

use std::fs;
use std::io::{BufRead, BufReader, Cursor, Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use circ::waveform::{Waveforms, csv, json, npz, raw};
use insta::assert_snapshot;
use tempfile::TempDir;

const DIVIDER: &str = "\
divider
.param top=10
v1 in 0 dc {top}
r1 in out 1k
r2 out 0 1k
.tran 1m 3m
.end
";

const RECTIFIER: &str = "\
half-wave rectifier
v1 in 0 sin(0 10 50)
d1 in out di
c1 out 0 100u
r1 out 0 100
.model di d(ideal)
.tran 1m 40m
.print tran v(in) v(out) i(d1)
.end
";

const CHOPPER: &str = "\
chopper
v1 in 0 dc 10
vc c 0 pulse(0 5 0 0 0 1m 2m)
s1 in out c 0 sw1
r1 out 0 10
rc c 0 1k
.model sw1 sw(vt=2.5 ron=0 roff=1g)
.tran 0.5m 4m
.print tran v(out)
.end
";

/// From 1 ms on the source drives a current that the diode blocks.
const IMPOSSIBLE: &str = "\
impossible
i1 0 a pwl(0 -1 2m 1)
d1 0 a di
.model di d(ideal)
.tran 0.5m 2m
.end
";

const FAULTY: &str = "\
faulty
c1 in 0
d1 in out d1n4148
r1 out 0 1k
.tran 1m 3m
.end
";

/// A directory with the netlists above.
fn place() -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("divider.cir", DIVIDER),
        ("rectifier.cir", RECTIFIER),
        ("chopper.cir", CHOPPER),
        ("impossible.cir", IMPOSSIBLE),
        ("faulty.cir", FAULTY),
    ] {
        fs::write(directory.path().join(name), text).unwrap();
    }
    directory
}

fn circ(directory: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_circ"));
    command.current_dir(directory).stdin(Stdio::null());
    command
}

struct Ran {
    status: i32,
    out: String,
    err: String,
}

impl std::fmt::Display for Ran {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "status {}\n--- out\n{}--- err\n{}",
            self.status, self.out, self.err
        )
    }
}

fn run_in(directory: &Path, arguments: &str) -> Ran {
    let output = circ(directory)
        .args(arguments.split_whitespace())
        .output()
        .unwrap();
    Ran {
        status: output.status.code().unwrap(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

/// In a fresh directory with the netlists.
fn run(arguments: &str) -> Ran {
    run_in(place().path(), arguments)
}

fn waves(text: &str) -> Waveforms {
    csv::read(text.as_bytes()).unwrap()
}

#[test]
fn a_word_that_is_neither_a_file_nor_a_command_is_told_so() {
    let said = |arguments: &str| {
        let ran = run(arguments);
        assert_eq!((ran.status, ran.out.as_str()), (2, ""), "{ran}");
        ran.err
    };
    for arguments in ["divider.cri", "divider.cri -o out.csv", "missing/buck.cir"] {
        let word = arguments.split(' ').next().unwrap();
        let expected = format!("`{word}` is neither a file nor a command");
        assert!(said(arguments).contains(&expected), "{arguments}");
    }
    // A misspelt command is none of a file's, with a file behind it too.
    assert!(said("smi divider.cir").contains("did you mean `sim`?"));
    for arguments in ["chek", "chek divider.cir"] {
        let err = said(arguments);
        assert!(err.contains("'chek'") && err.contains("'check'"), "{err}");
    }
    assert!(said("..").contains("`..` is a folder"));
    assert!(said("dividre.cir").contains("did you mean `divider.cir`?"));
    // Options as other programs have them.
    for (arguments, remedy) in [
        ("sim divider.cir --out x.csv", "a file with `-o FILE`"),
        ("sim divider.cir --tran 1m", "`.tran 10u 5m`"),
        ("sim divider.cir -probe v(out)", "`--probe`"),
    ] {
        let err = said(arguments);
        assert!(err.contains(remedy), "{err}");
    }
    // Files of waveforms have commands of their own.
    let folder = place();
    run_in(folder.path(), "sim divider.cir -o w.raw -o w.csv");
    for file in ["w.raw", "w.csv"] {
        let ran = run_in(folder.path(), file);
        assert!(ran.err.contains("`circ view FILE` shows it"), "{ran}");
    }
    let ran = run_in(folder.path(), "compare divider.cir w.csv");
    assert!(ran.err.contains("`--against w.csv`"), "{ran}");
    fs::create_dir(folder.path().join("netlists")).unwrap();
    fs::copy(
        folder.path().join("divider.cir"),
        folder.path().join("netlists/buck.cir"),
    )
    .unwrap();
    let ran = run_in(folder.path(), "check netlist/buck.cir");
    assert!(
        ran.err.contains("did you mean `netlists/buck.cir`?"),
        "{ran}"
    );
    // Options before the file are as good as behind it.
    let ran = run("-q divider.cir");
    assert_eq!(ran.status, 0, "{ran}");
}

#[test]
fn help_names_every_command_and_flag() {
    assert_snapshot!(run("--help"));
    for command in [
        "sim",
        "pss",
        "ac",
        "sens",
        "sweep",
        "lcs",
        "check",
        "op",
        "bench",
        "compare",
        "graph",
        "view",
        "watch",
        "explain",
        "completions",
        "man",
    ] {
        let ran = run(&format!("{command} --help"));
        assert_eq!((ran.status, ran.err.as_str()), (0, ""));
        assert_snapshot!(format!("help_{command}"), ran.out);
    }
}

#[test]
fn shells_and_manuals_know_every_command_and_flag() {
    for (shell, flag) in [
        ("bash", "--message-format"),
        ("zsh", "--message-format"),
        ("fish", "-l message-format"),
        ("powershell", "--message-format"),
    ] {
        let ran = run(&format!("completions {shell}"));
        assert_eq!((ran.status, ran.err.as_str()), (0, ""));
        for text in [flag, "explain", "compare"] {
            assert!(ran.out.contains(text), "{shell}: {text}");
        }
    }
    // `circ FILE --pro<TAB>`.
    let bash = run("completions bash").out;
    let own = bash
        .split("        circ)")
        .nth(1)
        .and_then(|text| text.lines().nth(1));
    assert!(
        own.is_some_and(|opts| opts.contains("--probe") && opts.contains("explain")),
        "{own:?}"
    );
    let directory = place();
    let ran = run_in(directory.path(), "man .");
    assert_eq!((ran.status, ran.out.as_str()), (0, ""), "{ran}");
    let page = fs::read_to_string(directory.path().join("circ-sim.1")).unwrap();
    for text in [".TH circ-sim 1", "from\\-pss", "Examples:"] {
        assert!(page.contains(text), "{text}: {page}");
    }
    let whole = fs::read_to_string(directory.path().join("circ.1")).unwrap();
    assert!(whole.contains("circ\\-explain(1)"), "{whole}");
    assert_eq!(run("man").out, whole);
    assert_eq!(run("man no-such-folder").status, 2);
}

#[test]
fn netlists_come_from_standard_input_and_results_go_to_standard_output() {
    let directory = place();
    fs::write(directory.path().join("part.lib"), ".param top=4\n").unwrap();
    let piped = |arguments: &str, text: &str| {
        let mut child = circ(directory.path())
            .args(arguments.split_whitespace())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        child
            .stdin
            .take()
            .unwrap()
            .write_all(text.as_bytes())
            .unwrap();
        child.wait_with_output().unwrap()
    };
    let csv = run("sim divider.cir").out;
    for arguments in ["sim -", "-", "sim - -o -", "- -o - --format csv"] {
        let ran = piped(arguments, DIVIDER);
        assert!(ran.status.success(), "{arguments}");
        assert_eq!(String::from_utf8(ran.stdout).unwrap(), csv, "{arguments}");
    }
    // Every command that reads a netlist; files that it includes are beside the current folder.
    let including = DIVIDER.replace(".param top=10", ".include part.lib");
    for command in ["op", "check", "lcs", "graph"] {
        let ran = piped(&format!("{command} -"), &including);
        assert!(ran.status.success() && !ran.stdout.is_empty(), "{command}");
    }
    let system = run("lcs divider.cir --format json").out;
    assert_eq!(piped("sim -", &system).stdout, csv.as_bytes());
    let faulty = piped("sim - --message-format short", FAULTY);
    let said = String::from_utf8(faulty.stderr).unwrap();
    assert!(said.starts_with("<stdin>:2:"), "{said}");
    // Every format, the same as in a file.
    for format in ["csv", "raw", "npz", "json", "svg", "png", "html"] {
        let file = run_in(directory.path(), &format!("sim divider.cir -o a.{format}"));
        assert_eq!(file.status, 0, "{file}");
        let kept = fs::read(directory.path().join(format!("a.{format}"))).unwrap();
        for arguments in [
            format!("sim - --format {format}"),
            format!("sim - -o - --format {format}"),
        ] {
            let ran = piped(&arguments, DIVIDER);
            assert!(ran.status.success(), "{arguments}");
            // A page says how long the run took.
            let same = ran.stdout == kept;
            let page = format == "html" && ran.stdout.starts_with(b"<!");
            assert!(same || page, "{arguments}");
        }
    }
    let both = piped("sim - -o b.csv -o - --format json", DIVIDER);
    let waves = json::read(both.stdout.as_slice()).unwrap();
    assert_eq!(waves.len(), 4);
    assert_eq!(
        fs::read_to_string(directory.path().join("b.csv")).unwrap(),
        csv
    );
    let svg = run("graph divider.cir --format svg").out;
    assert!(svg.contains("<svg "), "{svg}");
}

#[test]
fn outputs_that_cannot_be_are_refused_before_the_run() {
    let long = DIVIDER.replace(".tran 1m 3m", ".tran 1n 1000");
    for (arguments, words) in [
        ("sim long.cir -o none/a.csv", "none/a.csv: No such file"),
        ("sim long.cir -o a.xls", "the ending chooses the format"),
        ("sim long.cir -o a.csv/", "a.csv/: is a directory"),
        (
            "sim long.cir --table --in r3",
            "no element `r3`, which is to be an input or output",
        ),
        (
            "pss long.cir --table --out r3",
            "no element `r3`, which is to be an input or output",
        ),
        ("sim long.cir -o - -o -", "given twice"),
        (
            "sim long.cir -o a.csv --format raw",
            "--format raw: the endings of all outputs name another",
        ),
        ("ac divider.cir -o none/a.csv", "none/a.csv: No such file"),
        ("compare long.cir -o a.pdf", "must be svg, png or html"),
        ("compare long.cir -o none/a.svg", "none/a.svg: No such file"),
        ("bench long.cir -o none/a.csv", "none/a.csv: No such file"),
        ("graph long.cir -o none/a.dot", "none/a.dot: No such file"),
        ("lcs long.cir -o none/a.json", "none/a.json: No such file"),
    ] {
        let directory = place();
        fs::write(directory.path().join("long.cir"), &long).unwrap();
        let ran = run_in(directory.path(), arguments);
        assert_eq!(
            (ran.status, ran.out.as_str()),
            (2, ""),
            "{arguments}: {ran}"
        );
        assert!(ran.err.contains(words), "{arguments}: {ran}");
    }
}

#[test]
fn usage_errors_end_with_2() {
    for arguments in [
        "",
        "sim",
        "simulate divider.cir",
        "sim divider.cir --method rk4",
        "sim divider.cir --step 0",
        "sim divider.cir --step x1",
        "sim divider.cir --theta 0.3",
        "sim divider.cir --param top",
        "sim divider.cir -q -v",
        "sim divider.cir --summary yaml",
        "lcs divider.cir --format yaml",
        "bench divider.cir --methods rk4",
        "bench divider.cir --against spectre",
    ] {
        let ran = run(arguments);
        assert_eq!(ran.status, 2, "{arguments}: {ran}");
        assert_eq!(ran.out, "", "{arguments}");
        assert!(!ran.err.is_empty(), "{arguments}");
    }
}

#[test]
fn values_that_cannot_be_are_named() {
    for (arguments, words) in [
        ("divider.cir --step -1", "'--step <H>': must be positive"),
        (
            "divider.cir --theta -1",
            "'--theta <X>': must be in [0.5, 1]",
        ),
        (
            "compare divider.cir --tol -1",
            "'--tol <R>': must be positive",
        ),
        (
            "graph divider.cir --at -1m",
            "'--at <TIME>': must be positive",
        ),
        (
            "divider.cir --probe=",
            "'--probe <NAME>': a name is missing",
        ),
        (
            "divider.cir --worst nope",
            "no measurement `nope`: the netlist has no `.meas`",
        ),
        (
            "view w.csv --format csv",
            "[possible values: html, svg, png]",
        ),
        (
            "graph divider.cir --at 1 --format svg",
            "--at 1e0: the run of .tran ends at",
        ),
        (
            "watch nope.cir --no-open",
            "`nope.cir` is neither a file nor a command",
        ),
        (
            "watch divider.cir --no-open --port many",
            "`--port many`: expected a number from 0 to 65535",
        ),
    ] {
        let ran = run(arguments);
        assert_eq!((ran.status, ran.out.as_str()), (2, ""), "{ran}");
        assert!(ran.err.contains(words), "{ran}");
    }
    // Of measurements, before tolerances are missed.
    let directory = place();
    let measured = DIVIDER.replace(".end", ".meas tran top avg v(out)\n.end");
    fs::write(directory.path().join("measured.cir"), measured).unwrap();
    for (arguments, words) in [
        (
            "measured.cir --worst tpo",
            "no measurement `tpo`: did you mean `top`?",
        ),
        (
            "measured.cir --worst nope",
            "no measurement `nope`: there are top",
        ),
        (
            "sens measured.cir --of nope",
            "no measurement `nope`: there are top",
        ),
        ("measured.cir --worst top", "no value has a tolerance"),
        (
            "measured.cir --worst top --tol-of r3=5%",
            "`r3` is no resistance",
        ),
    ] {
        let ran = run_in(directory.path(), arguments);
        assert!(ran.status == 2 && ran.err.contains(words), "{ran}");
        assert_eq!(ran.out, "", "before the run: {ran}");
    }
}

#[test]
fn sim_into_a_pipe_is_csv() {
    assert_snapshot!(run("sim divider.cir"));
}

#[test]
fn a_file_without_a_command_is_simulated() {
    let simulated = run("sim divider.cir");
    for arguments in [
        "divider.cir",
        "-q divider.cir",
        "--method exact divider.cir",
    ] {
        let ran = run(arguments);
        assert_eq!((ran.status, &ran.out), (0, &simulated.out), "{arguments}");
    }
    // What is no file is no command either.
    let ran = run("divide.cir");
    assert_eq!(ran.status, 2);
    assert!(ran.err.contains("divide.cir"), "{}", ran.err);
}

#[test]
fn large_systems_are_written_without_their_zeros() {
    let directory = place();
    let sections: String = (0..1200)
        .map(|k| format!("r{k} n{k} n{} 10\nc{k} n{} 0 10n\n", k + 1, k + 1))
        .collect();
    let netlist = format!("ladder\nv1 n0 0 sin(0 1 1k)\n{sections}.tran 1u 1m uic\n.end\n");
    fs::write(directory.path().join("ladder.cir"), netlist).unwrap();
    let json = run_in(directory.path(), "lcs ladder.cir --format json");
    assert_eq!(json.status, 0, "{}", json.err);
    let system: serde_json::Value = serde_json::from_str(&json.out).unwrap();
    assert_eq!(system["A"]["shape"], serde_json::json!([1200, 1200]));
    assert_eq!(system["A"]["data"].as_array().unwrap().len(), 3 * 1200 - 2);
    let numpy = run_in(directory.path(), "lcs ladder.cir --format numpy").out;
    assert!(
        numpy.contains("A = sp.csr_matrix((np.array([-"),
        "{}",
        &numpy[..200]
    );
    let matlab = run_in(directory.path(), "lcs ladder.cir --format matlab").out;
    assert!(
        matlab.contains("A = sparse([1, 1, 2, 2, 2, 3"),
        "{}",
        &matlab[..200]
    );
    let text = run_in(directory.path(), "lcs ladder.cir").out;
    assert!(text.contains("A: 1200×1200, 3598 entries"), "{text}");
    let latex = run_in(directory.path(), "lcs ladder.cir --format latex");
    assert_eq!((latex.status, latex.out.as_str()), (2, ""));
    let market = run_in(directory.path(), "lcs ladder.cir --format mtx -o l.mtx");
    assert_eq!(market.status, 0, "{}", market.err);
    let a = fs::read_to_string(directory.path().join("l.A.mtx")).unwrap();
    assert_eq!(a.lines().count(), 3 + 3598);
    let check = run_in(directory.path(), "check ladder.cir --json");
    let report: serde_json::Value = serde_json::from_str(&check.out).unwrap();
    assert_eq!(
        (check.status, &report["size"]["n"]),
        (0, &serde_json::json!(1200))
    );
    assert!(report["passive"].is_null());
    assert!(
        report["passive_because"]
            .as_str()
            .unwrap()
            .contains("too many")
    );
}

#[test]
fn findings_are_lines_or_objects_where_that_is_asked_for() {
    let short = run("sim faulty.cir --message-format short");
    assert_eq!(short.status, 2);
    let first = short.err.lines().next().unwrap();
    assert!(first.starts_with("faulty.cir:2:"), "{first}");
    assert!(first.contains(": error["), "{first}");
    let json = run("sim faulty.cir --message-format json");
    let objects: Vec<serde_json::Value> = (json.err.lines())
        .map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{line}: {e}")))
        .collect();
    assert_eq!(objects.len(), short.err.lines().count() - 1);
    let first = &objects[0];
    assert_eq!(
        (&first["file"], &first["line"]),
        (&"faulty.cir".into(), &2.into())
    );
    for key in ["code", "severity", "message", "column", "help"] {
        assert!(first.get(key).is_some(), "{key}");
    }
    // What is said of a run, with and without a place.
    let warned = "slow\nv1 a 0 sin(0 1 50)\nr1 a 0 1k\n.tran 10m 100m\n.end\n";
    let directory = place();
    fs::write(directory.path().join("slow.cir"), warned).unwrap();
    let ran = run_in(
        directory.path(),
        "sim slow.cir --message-format short --step 1m",
    );
    let lines: Vec<&str> = ran.err.lines().collect();
    assert!(
        lines[0].starts_with("note[unused-option]: --step is of no use"),
        "{ran}"
    );
    assert!(
        lines[1].starts_with("slow.cir:2:1: warning[rows-apart]: the print step")
            && lines[1].ends_with("as in `.tran 10n 1m`)"),
        "{ran}"
    );
    let person = run_in(directory.path(), "sim slow.cir -o slow.csv");
    assert!(
        person
            .err
            .starts_with("warning[rows-apart]: slow.cir:2:1: ")
            && person.err.contains("\n  help: take a print step of"),
        "{person}"
    );
    let ran = run_in(directory.path(), "sim slow.cir --message-format json");
    let warning: serde_json::Value = serde_json::from_str(&ran.err).unwrap();
    assert_eq!(
        (&warning["code"], &warning["severity"], &warning["line"]),
        (&"rows-apart".into(), &"warning".into(), &2.into())
    );
    assert!(
        warning["help"]
            .as_str()
            .unwrap()
            .starts_with("take a print step")
    );
    let quiet = run_in(directory.path(), "sim slow.cir --message-format json -q");
    assert_eq!((quiet.status, quiet.err.as_str()), (0, ""));
    let missing = run("sim divider.cir --probe v(x) --message-format short");
    assert!(
        missing
            .err
            .starts_with("error[unknown-signal]: --probe v(x): "),
        "{missing}"
    );
    let missing = run("sim missing.cir --message-format json");
    let failure: serde_json::Value =
        serde_json::from_str(missing.err.lines().next().unwrap()).unwrap();
    assert_eq!((missing.status, &failure["severity"]), (2, &"error".into()));
    // Faults of the command line, whatever the place of the option.
    for (arguments, code) in [
        ("missing.cir --message-format json", "unknown-command"),
        ("--message-format=json missing.cir", "unknown-command"),
        ("divider.cir --step 0 --message-format json", "bad-option"),
        ("sim --message-format json", "missing-argument"),
        (
            "sim divider.cir --stepp 1 --message-format json",
            "unknown-option",
        ),
        (
            "sim divider.cir --verify --worst m --message-format json",
            "unknown-measurement",
        ),
        (
            "sim divider.cir -o divider.cir --message-format json",
            "output-format",
        ),
        (
            "lcs divider.cir -o divider.cir --message-format json",
            "overwritten",
        ),
    ] {
        let ran = run(arguments);
        let failure: serde_json::Value = serde_json::from_str(&ran.err).unwrap();
        assert_eq!(
            (ran.status, &failure["code"]),
            (2, &code.into()),
            "{arguments}"
        );
        assert!(
            failure["help"].as_str().is_some_and(|help| help.len() > 9),
            "{arguments}"
        );
    }
    assert!(
        run("divider.cir --step 0 --message-format short")
            .err
            .starts_with(
                "error[bad-option]: invalid value '0' for '--step <H>': must be positive ("
            )
    );
    assert!(
        run("divider.cir --step 0")
            .err
            .starts_with("error[bad-option]: invalid value '0' for '--step <H>'")
    );
}

/// As users of LTspice ask for the current out of a source.
#[test]
fn a_probe_may_begin_with_a_minus() {
    let last = |probe: &str| {
        let (names, row) = last_row("", &format!("--probe {probe}"));
        assert_eq!(names.len(), 1, "{names:?}");
        row[0]
    };
    assert_eq!(last("-v(a)"), -last("v(a)"));
    assert_ne!(last("v(a)"), 0.0);
}

/// Of a value on the command line it is not known what it is for.
#[test]
fn a_capital_m_of_a_parameter_is_told_to_be_milli() {
    let said = |arguments: &str| run(arguments).err.contains("`2M` is milli");
    assert!(said("sim divider.cir --param top=2M"));
    assert!(said("sweep divider.cir --param top=1,2M"));
    for value in ["2m", "2Meg", "2k", "2"] {
        let ran = run(&format!("sim divider.cir --param top={value}"));
        assert!(!ran.err.contains("milli"), "{}", ran.err);
    }
}

#[test]
fn parameters_and_probes_are_replaced() {
    assert_snapshot!(run(
        "sim divider.cir --param TOP=4k7 --probe i(r1) --probe v(in,out) --probe V1#branch --probe @r2[i] --probe out"
    ));
    assert_snapshot!(run("sim divider.cir --probe v(nowhere)"), @r"
    status 2
    --- out
    --- err
    error[unknown-signal]: --probe v(nowhere): there is no node or element `v(nowhere)`
      help: there are v(in), v(out)
    ");
}

const HALVES: &str = "\
halves
.param gain=2
.subckt half in out
r1 in out 1k
r2 out 0 1k
.ends
v1 a 0 dc {3*gain}
x1 a mid half
.tran 1m 1m
";

/// The columns and the last row of a run of `HALVES` with these cards and arguments.
fn last_row(cards: &str, arguments: &str) -> (Vec<String>, Vec<f64>) {
    let directory = place();
    let netlist = format!("{HALVES}{cards}\n.end\n");
    fs::write(directory.path().join("halves.cir"), netlist).unwrap();
    let ran = run_in(directory.path(), &format!("sim halves.cir {arguments}"));
    assert!(ran.status == 0 && !ran.err.contains("probe"), "{ran}");
    // Several runs of `.step` follow each other: no waveforms of one time axis.
    let read = |line: Option<&str>| {
        let mut fields = fields_of(line.unwrap());
        fields.remove(0);
        fields
    };
    let row = read(ran.out.lines().last());
    let row = row.iter().map(|field| field.parse().unwrap()).collect();
    (read(ran.out.lines().next()), row)
}

/// The fields of a line, quoted or not.
fn fields_of(line: &str) -> Vec<String> {
    let quoted = line.split('"').enumerate();
    let fields = quoted.flat_map(|(k, part)| match k % 2 {
        1 => vec![part.to_owned()],
        _ => part
            .split(',')
            .filter(|f| !f.is_empty())
            .map(str::to_owned)
            .collect(),
    });
    fields.collect()
}

#[test]
fn probes_are_patterns_and_expressions_on_the_command_line_and_on_cards() {
    for (probe, columns) in [
        ("v(*)", &[("v(a)", 6.0), ("v(mid)", 3.0)][..]),
        ("v(m?d)", &[("v(mid)", 3.0)]),
        ("i(x1.*)", &[("i(x1.r1)", 3e-3), ("i(x1.r2)", 3e-3)]),
        ("all", &[("v(a)", 6.0), ("v(mid)", 3.0), ("i(v1)", -3e-3)]),
        ("v(a)*i(x1.r1)", &[("v(a)*i(x1.r1)", 18e-3)]),
        ("max(v(mid),v(a)/gain)", &[("max(v(mid),v(a)/gain)", 3.0)]),
        ("v(a)-v(mid)", &[("v(a)-v(mid)", 3.0)]),
    ] {
        let (names, values): (Vec<String>, Vec<f64>) =
            columns.iter().map(|(n, v)| ((*n).to_owned(), *v)).unzip();
        for (cards, arguments) in [
            (String::new(), format!("--probe {probe}")),
            (format!(".save {probe}"), String::new()),
            (format!(".print tran {probe}"), String::new()),
        ] {
            let found = last_row(&cards, &arguments);
            assert_eq!(found.0, names, "{cards} {arguments}");
            for (own, known) in found.1.iter().zip(&values) {
                assert!((own - known).abs() < 1e-12, "{cards} {arguments}: {own}");
            }
        }
    }
    // In the order of the command line; parameters are those of the run, those of a sweep too.
    let (names, row) = last_row("", "--probe v(mid)/gain --probe v(a) --param gain=4");
    assert_eq!(
        (names, row),
        (vec!["v(mid)/gain".into(), "v(a)".into()], vec![1.5, 12.0])
    );
    let (_, row) = last_row(".step param gain list 2 5", "--probe v(a)*gain");
    assert_eq!(row, [75.0, 5.0]);
    // Measured, verified and in periods as in a transient.
    let (_, row) = last_row(".save v(a)*2\n.meas tran m avg v(mid)", "-q --verify");
    assert_eq!(row, [12.0]);
}

#[test]
fn an_unknown_probe_says_what_was_probably_meant() {
    for (probe, words) in [
        ("v(ot)", "did you mean `v(out)`?"),
        ("ot", "did you mean `v(out)`?"),
        ("i(r3)", "there are i(v1), i(r1), i(r2)"),
        ("i(r11)", "did you mean `i(r1)`?"),
        ("v(r1)", "the voltage across it is `v(in,out)`"),
        ("2*v(ot)", "did you mean `v(out)`?"),
        ("v(z*)", "there are v(in), v(out)"),
        ("sqr(v(in))", "help: did you mean `sqrt`?"),
        ("rms(v(in))", "`.meas tran NAME RMS V(out)` measures it"),
        ("v(in)*i(", "help: put a `)` where"),
        ("v(in)*", "a value is missing"),
    ] {
        let ran = run(&format!("sim divider.cir --probe {probe}"));
        assert_eq!(ran.status, 2, "{ran}");
        assert!(ran.err.contains(&format!("--probe {probe}: ")), "{ran}");
        assert!(ran.err.contains(words), "{ran}");
    }
    let directory = place();
    let swept = DIVIDER.replace(".tran 1m 3m", ".dc v1 0 2 1\n.save v(in)*2");
    fs::write(directory.path().join("swept.cir"), swept).unwrap();
    let ran = run_in(directory.path(), "sim swept.cir");
    assert!(
        ran.err
            .contains("note[expression]: `v(in)*2` is an expression"),
        "{ran}"
    );
    assert_eq!(ran.out.lines().next(), Some("v1,v(in)"));
    let ran = run("ac divider.cir --probe 2*v(in)");
    assert!(ran.err.contains("signals and ratios of two"), "{ran}");
}

/// A name of an element is no signal, and a transistor's current has LTspice's name in expressions too.
#[test]
fn probes_may_name_what_an_element_carries() {
    let ran = run("sim divider.cir --probe R1");
    assert_eq!(ran.status, 2, "{ran}");
    assert!(ran.err.contains("write `i(r1)` for its current"), "{ran}");
    let mos = "vh h 0 10\nm1 a h 0 0 mn\n.model mn nmos(ron=1 vto=2)";
    let (names, values) = last_row(mos, "--probe v(a)*Id(M1) --probe i(m1) -q");
    assert_eq!(names.len(), 2, "{names:?}");
    // The source of HALVES drives it: 6 V across 1 Ω.
    assert!((values[0] - 36.0).abs() < 1e-9, "{values:?}");
    assert!((values[1] - 6.0).abs() < 1e-9, "{values:?}");
}

/// LTspice's names of currents into pins; what cannot be had says what to use.
#[test]
fn probes_may_be_currents_into_pins() {
    let mos = "vh h 0 10\nm1 a h 0 0 mn\n.model mn nmos(ron=1 vto=2)\nr9 a g 1k\nx2 a g half2\n.subckt half2 p n\nrh p n 2\n.ends\nx3 a 0 half2";
    // 6 V across 1 Ω, and across 1 kΩ beside 2 Ω.
    for (probe, name, value) in [
        ("Is(M1)", "is(m1)", -6.0),
        ("Ig(M1)", "ig(m1)", 0.0),
        ("Id(M1)", "i(m1)", 6.0),
        ("2*Is(m1)", "2*is(m1)", -12.0),
        ("Ix(x2:p)", "ix(x2:p)", 0.0),
        ("Ix(x1:in)", "ix(x1:in)", 3e-3),
    ] {
        for (cards, arguments) in [
            (mos.to_owned(), format!("--probe {probe} -q")),
            (format!("{mos}\n.save {probe}"), "-q".to_owned()),
        ] {
            let (names, values) = last_row(&cards, &arguments);
            assert_eq!(names, [name]);
            assert!((values[0] - value).abs() < 1e-9, "{name} {values:?}");
        }
    }
    let directory = place();
    fs::write(
        directory.path().join("pins.cir"),
        format!("{HALVES}{mos}\n.end\n"),
    )
    .unwrap();
    for (probe, words) in [
        (
            "Is(M2)",
            "there is no transistor `m2`\n  help: there are m1",
        ),
        (
            "Is(r9)",
            "there is no transistor `r9`\n  help: `i(r9)` is the current through it",
        ),
        (
            "Ib(m1)",
            "`m1` has no pin `b`\n  help: its pins are d, g, s",
        ),
        ("Ix(x2:q)", "`x2` has no pin `q`\n  help: its pins are n, p"),
        ("Ix(x2)", "write `Ix(x1:pin)`"),
        ("I(x2:p)", "write `ix(x2:p)` for the current into a pin"),
        ("Ix(x3:n)", "put a source of 0 V into the lead"),
    ] {
        let ran = run_in(directory.path(), &format!("sim pins.cir --probe {probe}"));
        assert_eq!(ran.status, 2, "{ran}");
        assert!(ran.err.contains(&format!("--probe {probe}: ")), "{ran}");
        assert!(ran.err.contains(words), "{ran}");
    }
}

/// A current that a switch interrupts meets its `Roff` in a row at the event alone: rows that are written as they come are looked at too.
#[test]
fn a_spike_is_told_of_in_rows_that_pass_by() {
    let place = place();
    let interrupted = "interrupted\nv1 in 0 12\nl1 in sw 100u\ns1 sw 0 g 0 sm\nvg g 0 pulse(0 1 10u 1n 1n 40u 100u)\n\
        .model sm sw(ron=10m roff=1meg vt=.5)\n.tran 0 200u 0 3u\n.end\n";
    fs::write(place.path().join("interrupted.cir"), interrupted).unwrap();
    let ran = run_in(place.path(), "sim interrupted.cir -o rows.csv");
    assert!(
        ran.err.contains("has fallen before the next row"),
        "{}",
        ran.err
    );
}

/// Where the switch opens on an output time and the current is gone before the next, rows of the grid alone show megavolts; a voltage that another edge ends, and
/// one that lasts, are none.
#[test]
fn a_spike_on_an_output_time_is_told_of() {
    let place = place();
    let told = |cards: &str| {
        let text = format!(
            "switched\nvin in 0 12\n{cards}\nvg g 0 pulse(0 1 0 0 0 5u 10u)\n.model sm sw(ron=10m roff=1meg vt=.5)\n.end\n"
        );
        fs::write(place.path().join("switched.cir"), text).unwrap();
        let mut told = ["csv", "html"].map(|ending| {
            let ran = run_in(place.path(), &format!("sim switched.cir -o rows.{ending}"));
            assert_eq!(ran.status, 0, "{ran}");
            ran.err.contains("has fallen before the next row")
        });
        told.sort_unstable();
        assert_eq!(told[0], told[1], "{cards}");
        told[0]
    };
    let coil = "l1 in sw 47u\ns1 sw 0 g 0 sm\n.save v(sw) v(in) i(l1)";
    assert!(told(&format!("{coil}\n.tran 1u 50u")));
    assert!(told(&format!("{coil}\n.tran 50u")));
    // Rows of one instant may be an ulp apart.
    let coil_of_relay =
        "vh h 0 pulse(0 1 0 0 0 5m 10m)\nsh in sx h 0 sm\nlx sx 0 10m rser=10\n.save v(sx) v(in)";
    assert!(told(&format!("{coil_of_relay}\n.tran 50m")));
    // A clamp takes the current.
    assert!(!told(&format!(
        "{coil}\nd1 sw cl dm\nvcl cl 0 24\n.model dm d(n=0.001)\n.tran 1u 50u"
    )));
    // A chopped voltage, a row at each edge.
    let chopper = "s1 in sw g 0 sm\nr1 sw 0 1k\n.save v(sw)";
    assert!(!told(&format!("{chopper}\n.tran 5u 100u")));
    assert!(!told(&format!("{chopper}\n.tran 2.5u 100u")));
}

/// Nobody wrote the parts of a gate: they are not among what is listed.
#[test]
fn lists_of_elements_have_no_parts_of_gates() {
    let place = place();
    let text = "gate\nvref ref 0 1\nvs s 0 pulse(0 2 0 1m 1m 0 2m)\na1 s ref 0 0 0 0 q 0 schmitt vt=0 vh=10m\nr1 q 0 1k\n.tran 10u 4m\n.end\n";
    fs::write(place.path().join("gate.cir"), text).unwrap();
    for command in [
        "op",
        "check",
        "sim --table -o a.csv",
        "pss --table -o a.csv",
    ] {
        let ran = run_in(place.path(), &format!("{command} gate.cir"));
        assert_eq!(ran.status, 0, "{ran}");
        let said = ran.out.clone() + &ran.err;
        assert!(said.contains("r1") && !said.contains("a1."), "{ran}");
    }
    let ran = run_in(place.path(), "sim gate.cir --table -o a.csv");
    assert!(ran.err.contains("input 0 W (vref, vs)"), "{ran}");
    let ran = run_in(place.path(), "op gate.cir -o a.csv");
    let rows = fs::read_to_string(place.path().join("a.csv")).unwrap();
    assert!(ran.status == 0 && !rows.contains("a1."), "{ran}{rows}");
}

/// What an `.ac` is asked for is the same by `circ sim` as by `circ ac`.
#[test]
fn ratios_are_shown_by_either_command() {
    let place = place();
    let text = "rc\nv1 in 0 ac 2\nr1 in out 1k\nc1 out 0 1u\n.ac dec 2 10 1k\n.end\n";
    fs::write(place.path().join("ac.cir"), text).unwrap();
    for probes in [
        "--probe v(out)/v(in)",
        "--probe -V(out)/I(R1) --probe v(in)",
    ] {
        let [sim, ac] =
            ["sim", "ac"].map(|c| run_in(place.path(), &format!("{c} ac.cir {probes}")));
        assert!(
            sim.status == 0 && sim.err.is_empty() && sim.out.contains('/'),
            "{sim}"
        );
        assert_eq!(sim.out, ac.out);
    }
    // Of other expressions the signals are shown, with a note.
    let ran = run_in(place.path(), "sim ac.cir --probe v(out)*v(in)");
    assert!(
        ran.status == 0 && ran.err.contains("is an expression"),
        "{ran}"
    );
}

/// An operating point is printed where nothing else is asked for, and left out with a note where there is a transient.
#[test]
fn a_netlist_may_ask_for_its_operating_point() {
    let place = place();
    let text = DIVIDER.replace(".tran", ".op\n*.tran");
    fs::write(place.path().join("op.cir"), &text).unwrap();
    let ran = run_in(place.path(), "op.cir");
    let asked = run_in(place.path(), "op op.cir");
    assert_eq!((ran.status, &ran.out), (0, &asked.out), "{ran}");
    assert!(ran.out.contains("v(out)"), "{ran}");
    let in_json = run_in(place.path(), "op op.cir --json");
    for command in ["op.cir", "op op.cir"] {
        let ran = run_in(place.path(), &format!("{command} -o a.csv -o a.json"));
        assert_eq!(
            (ran.status, ran.out.as_str(), ran.err.as_str()),
            (0, "", ""),
            "{ran}"
        );
        let read = |name: &str| fs::read_to_string(place.path().join(name)).unwrap();
        let rows = read("a.csv");
        let (names, values) = rows.trim_end().split_once('\n').unwrap();
        assert_eq!(names, "v(in),v(out),i(v1),i(r1),i(r2)");
        let values: Vec<f64> = values
            .split(',')
            .map(|cell| cell.parse().unwrap())
            .collect();
        assert_eq!(values, [10.0, 5.0, -5e-3, 5e-3, 5e-3]);
        assert_eq!(read("a.json"), in_json.out);
        let ran = run_in(place.path(), &format!("{command} -o a.svg"));
        assert!(
            ran.status == 2 && ran.err.contains("written as csv or json"),
            "{ran}"
        );
    }
    let both = DIVIDER.replace(".tran", ".op\n.dc v1 0 1 1\n.tran");
    fs::write(place.path().join("both.cir"), both).unwrap();
    let ran = run_in(place.path(), "both.cir -o a.csv");
    assert!(
        ran.status == 0
            && ran.err.contains("`.op` is left out, as there is a `.tran`")
            && ran
                .err
                .matches("`.dc` is left out, as there is a `.tran`")
                .count()
                == 1,
        "{ran}"
    );
    // Where `.pss` is carried out it is the one that is named.
    let text = "rc\nv1 a 0 sin(0 1 1k) ac 1\nr1 a b 1k\nc1 b 0 1u\n.pss 1k 1m b 10 5\n.op\n.dc v1 0 1 1\n.end\n";
    fs::write(place.path().join("pss.cir"), text).unwrap();
    let ran = run_in(place.path(), "pss.cir -o a.csv");
    assert!(
        ran.status == 0
            && ran.err.contains("`.op` is left out, as there is a `.pss`")
            && ran.err.contains("`.dc` is left out, as there is a `.pss`")
            && !ran.err.contains("`.tran`"),
        "{ran}"
    );
    let rows = fs::read_to_string(place.path().join("a.csv")).unwrap();
    assert_eq!((rows.lines().count(), &rows[..5]), (12, "time,"));
    fs::write(
        place.path().join("pss.cir"),
        text.replace(".op", ".ac lin 1 1 1"),
    )
    .unwrap();
    let ran = run_in(place.path(), "pss.cir -o b.csv");
    assert!(
        ran.status == 0 && ran.err.contains("`.pss` is left out, as there is an `.ac`"),
        "{ran}"
    );
}

/// Whoever gets a page is told what was found in its netlist.
#[test]
fn pages_have_the_findings_of_the_netlist() {
    let place = place();
    let text = "a transistor\nv1 a 0 5\nm1 a g b b nm\nr1 b 0 1k\nvg g 0 10\n.model nm nmos(vto=2 kp=1)\n.tran 1u 1m\n.end\n";
    fs::write(place.path().join("m.cir"), text).unwrap();
    let ran = run_in(place.path(), "m.cir -o m.html");
    assert_eq!(ran.status, 0, "{ran}");
    let html = fs::read_to_string(place.path().join("m.html")).unwrap();
    assert!(
        html.contains(r#"{"heading":"Netlist","text":"m.cir:3:1: "#)
            && html.contains("simulated as a switch")
    );
}

/// A characteristic is a picture over what is swept innermost, with a curve for each value of the other.
#[test]
fn a_sweep_of_operating_points_is_drawn() {
    let place = place();
    let text = "diode\nv1 a 0 1\nr1 a b 1k\nd1 b 0 dm\n.model dm d(ron=1 vfwd=0.7)\n.dc v1 2 -2 -0.1 r1 1k 2k 1k\n.save v(b) i(d1)\n.end\n";
    fs::write(place.path().join("dc.cir"), text).unwrap();
    let ran = run_in(
        place.path(),
        "dc.cir -o dc.svg -o dc.png -o dc.html -o dc.csv",
    );
    assert_eq!((ran.status, ran.err.as_str()), (0, ""), "{ran}");
    let read = |name: &str| fs::read_to_string(place.path().join(name)).unwrap();
    let svg = read("dc.svg");
    assert!(svg.contains("v1 (V)") || svg.contains("v1 / V"), "{svg}");
    assert_eq!(svg.matches("r1=2000").count(), 2, "{svg}");
    let html = read("dc.html");
    assert!(html.contains(r#""axis":{"name":"v1","unit":"V","log":false}"#));
    assert_eq!(read("dc.csv").lines().count(), 83);
    // Its rows are shown as it is.
    let ran = run_in(place.path(), "view dc.csv -o again.svg");
    assert_eq!((ran.status, ran.err.as_str()), (0, ""), "{ran}");
    let again = read("again.svg");
    assert!(
        again.contains(">v1<") && again.matches("r1=2000").count() == 2,
        "{again}"
    );
    let curves = |svg: &str| {
        let paths = svg
            .split(" d=\"")
            .skip(1)
            .map(|path| path.split('"').next().unwrap().to_owned());
        let mut paths: Vec<String> = paths.filter(|path| path.len() > 60).collect();
        paths.sort();
        paths
    };
    assert_eq!(curves(&again), curves(&svg));
    let ran = run_in(place.path(), "dc.cir -o dc.raw");
    assert!(
        ran.status == 2 && ran.err.contains("csv, svg, png or html"),
        "{ran}"
    );
}

/// 1/0 and the logarithm of what is not positive are told, with the number of rows, wherever rows go.
#[test]
fn expressions_without_a_value_are_told_of() {
    let place = place();
    for ending in ["csv", "svg", "npz"] {
        let ran = run_in(
            place.path(),
            &format!(
                "rectifier.cir --probe v(out)/0 --probe v(in) --probe ln(v(in)) -o a.{ending}"
            ),
        );
        assert!(
            ran.status == 0 && ran.err.contains("no number everywhere"),
            "{ran}"
        );
        assert!(
            ran.err.contains("v(out)/0 (")
                && ran.err.contains("ln(v(in)) (")
                && !ran.err.contains(" v(in) ("),
            "{ran}"
        );
    }
}

/// What is measured is a result, which `-q` does not hide, of several runs as of one.
#[test]
fn quiet_runs_tell_what_they_measured() {
    let place = place();
    for step in ["", ".step param top list 2 10\n"] {
        let text = DIVIDER.replace(".end", &format!("{step}.meas tran most max v(out)\n.end"));
        fs::write(place.path().join("measured.cir"), text).unwrap();
        let ran = run_in(place.path(), "sim measured.cir -q -o rows.csv");
        assert!(ran.err.contains("most"), "{step}: {ran}");
    }
}

#[test]
fn all_files_of_a_run_hold_the_same_numbers() {
    let directory = place();
    let at = |name: &str| directory.path().join(name);
    let ran = run_in(
        directory.path(),
        "sim rectifier.cir --method theta -o a.csv -o a.raw -o a.npz -o a.json -o a.svg -o a.png --output a.html",
    );
    assert_eq!((ran.status, ran.out.as_str()), (0, ""), "{ran}");
    let open = |name: &str| fs::File::open(at(name)).unwrap();
    let from_csv = csv::read(open("a.csv")).unwrap();
    assert_eq!(from_csv.names, ["v(in)", "v(out)", "i(d1)"]);
    assert_eq!(from_csv.len(), 41);
    assert_eq!((from_csv.time[0], from_csv.time[40]), (0.0, 40e-3));
    let same = |other: Waveforms| {
        assert_eq!(
            Waveforms {
                title: String::new(),
                ..other
            },
            from_csv
        );
    };
    same(raw::read(open("a.raw")).unwrap());
    same(npz::read(open("a.npz")).unwrap());
    same(json::read(open("a.json")).unwrap());
    let svg = fs::read_to_string(at("a.svg")).unwrap();
    for text in [
        "half-wave rectifier",
        "time (ms)",
        "voltage (V)",
        "current (",
        "i(d1)",
    ] {
        assert!(svg.contains(text), "{text}");
    }
    assert_eq!(&fs::read(at("a.png")).unwrap()[..8], b"\x89PNG\r\n\x1a\n");
    assert!(fs::read_to_string(at("a.html")).unwrap().contains("<svg "));
    // The same bytes again, and the same numbers on standard output.
    let before: Vec<_> = ["a.csv", "a.raw", "a.npz", "a.json", "a.png"]
        .map(|n| fs::read(at(n)).unwrap())
        .into();
    run_in(
        directory.path(),
        "sim rectifier.cir --method theta -o a.csv -o a.raw -o a.npz -o a.json -o a.png",
    );
    let after: Vec<_> = ["a.csv", "a.raw", "a.npz", "a.json", "a.png"]
        .map(|n| fs::read(at(n)).unwrap())
        .into();
    assert!(before == after);
    assert_eq!(
        run_in(directory.path(), "sim rectifier.cir --method theta")
            .out
            .as_bytes(),
        before[0]
    );
}

#[test]
fn files_that_cannot_be_written_are_named_before_or_after_the_run() {
    assert_snapshot!(run("sim divider.cir -o out.xls"), @r"
    status 2
    --- out
    --- err
    error[output-format]: out.xls: the ending chooses the format and must be csv, raw, npz, json, svg, png or html
      help: give the file one of the endings that the message lists, or name it with `--format`
    ");
    assert_snapshot!(run("sim divider.cir -o nowhere/out.csv"), @r"
    status 2
    --- out
    --- err
    error[file]: nowhere/out.csv: No such file or directory (os error 2); there is no folder `nowhere`
      help: check the path and the rights; the message has what the system says
    ");
}

#[test]
fn the_summary_is_one_json_object_on_standard_error() {
    let ran = run("sim rectifier.cir --method euler --step 10u --summary json -q");
    assert_eq!(ran.status, 0);
    let summary: serde_json::Value = serde_json::from_str(&ran.err).unwrap();
    assert_eq!(summary["method"], "euler");
    assert_eq!(summary["steps"], 4000);
    for key in [
        "plan",
        "events",
        "jumps",
        "modes",
        "lcp_solves",
        "cpu_seconds",
        "energy",
        "notes",
        "impulses",
    ] {
        assert!(!summary[key].is_null(), "{key} in {summary}");
    }
    for key in ["source", "dissipated", "stored", "residual_relative"] {
        assert!(summary["energy"][key].is_f64(), "{key} in {summary}");
    }
}

#[test]
fn verbose_explains_and_quiet_is_silent() {
    let ran = run("sim rectifier.cir --method theta -v -o a.csv");
    for words in ["plan: ", "energy: source", "event: ", "theta: "] {
        assert!(ran.err.contains(words), "{words} in {ran}");
    }
    assert_eq!(run("sim rectifier.cir --method theta -q -o a.csv").err, "");
    assert!(
        run("sim rectifier.cir --method theta --summary text")
            .err
            .contains("energy: source")
    );
}

#[test]
fn methods_agree_and_rows_do_not_depend_on_the_step() {
    let fine = waves(&run("sim rectifier.cir --method theta --tol 1e-8").out);
    for arguments in [
        "--method euler --step 0.5u",
        "--method theta --step 3.3u",
        "--method theta --theta 0.5 --gamma 1 --step 2u",
        "--theta 0.7",
        "--method euler --tol 1e-5",
    ] {
        let ran = run(&format!("sim rectifier.cir {arguments}"));
        assert_eq!(ran.status, 0, "{arguments}: {ran}");
        let waves = waves(&ran.out);
        assert_eq!(waves.time, fine.time, "{arguments}");
        let out = waves.find("v(out)").unwrap();
        for (a, b) in waves.column(out).zip(fine.column(out)) {
            assert!((a - b).abs() < 5e-3, "{arguments}: {a} for {b}");
        }
    }
}

#[test]
fn contradicting_methods_are_refused() {
    assert_snapshot!(run("sim rectifier.cir --method euler --theta 0.5"), @r"
    status 2
    --- out
    --- err
    error[option-conflict]: --theta and --gamma belong to `--method theta`
      help: leave one of the two out
    ");
}

#[test]
fn event_rows_stand_in_pairs_at_jumps() {
    let plain = waves(&run("sim chopper.cir --method theta").out);
    assert_eq!(plain.len(), 9);
    let with_events = waves(&run("sim chopper.cir --method theta --events").out);
    let at_1ms: Vec<f64> = (0..with_events.len())
        .filter(|&k| with_events.time[k] == 1e-3)
        .map(|k| with_events.row(k)[0].round())
        .collect();
    assert_eq!(at_1ms, [10.0, 0.0]);
}

#[test]
fn a_run_that_breaks_off_is_written_as_far_as_it_came() {
    assert_snapshot!(run("sim impossible.cir --method theta"));
    let directory = place();
    let ran = run_in(
        directory.path(),
        "sim impossible.cir --method theta -o a.csv -o a.png",
    );
    assert_eq!(ran.status, 2);
    assert_eq!(
        csv::read(fs::File::open(directory.path().join("a.csv")).unwrap())
            .unwrap()
            .len(),
        3
    );
    assert!(directory.path().join("a.png").exists());
}

#[test]
fn faults_are_shown_where_they_are() {
    let ran = run("sim faulty.cir");
    assert_eq!((ran.status, ran.out.as_str()), (2, ""));
    for words in [
        "faulty.cir:2:",
        "faulty.cir:3:",
        "unknown-model",
        "error: faulty.cir: 2 errors",
    ] {
        assert!(ran.err.contains(words), "{words} in {ran}");
    }
    assert!(!ran.err.contains('\u{1b}'), "colour in a pipe: {ran}");
    let missing = run("sim missing.cir");
    assert_eq!(missing.status, 2);
    assert!(
        missing.err.contains("cannot read `missing.cir`"),
        "{missing}"
    );
}

#[test]
fn check_lists_faults_with_status_1_and_certificates_with_0() {
    let ran = run("check faulty.cir --json");
    assert_eq!(ran.status, 1, "{ran}");
    let report: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!(report["ok"], false);
    let faults = report["faults"].as_array().unwrap();
    assert_eq!(
        faults.iter().filter(|f| f["severity"] == "error").count(),
        2,
        "{ran}"
    );
    assert_eq!(
        (&faults[0]["file"], &faults[0]["line"]),
        (&"faulty.cir".into(), &2.into())
    );

    let ran = run("check rectifier.cir --json");
    assert_eq!(ran.status, 0, "{ran}");
    let report: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!(
        (&report["ok"], &report["passive"], &report["size"]["n"]),
        (&true.into(), &true.into(), &1.into())
    );
    let words = run("check rectifier.cir");
    assert!(
        words.out.contains("passive") && words.status == 0,
        "{words}"
    );
    let directory = place();
    // A loop that both the topology and the start find is one fault.
    let twice = "two sources\nv1 a 0 10\nv2 a 0 12\nr1 a 0 1k\n.tran 1u 1m\n";
    fs::write(directory.path().join("twice.cir"), twice).unwrap();
    let ran = run_in(directory.path(), "check twice.cir");
    assert_eq!(ran.out.matches("form a loop").count(), 1, "{ran}");
    assert!(
        ran.status == 1 && ran.out.contains("1 error above"),
        "{ran}"
    );
    // A position without a system is a fault at its element, for every command.
    let loops = "two sources\nv1 a 0 5\nv2 b 0 6\ns1 a b c 0 sw\nvc c 0 1\n.model sw sw(ideal vt=0.5)\n.tran 1u 1m\n";
    fs::write(directory.path().join("loop.cir"), loops).unwrap();
    let ran = run_in(directory.path(), "check loop.cir --json");
    let report: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    let fault = &report["faults"][0];
    assert_eq!(
        (
            ran.status,
            &fault["code"],
            &fault["file"],
            &fault["line"],
            &fault["column"]
        ),
        (
            1,
            &"voltage-loop".into(),
            &"loop.cir".into(),
            &2.into(),
            &1.into()
        )
    );
    for command in ["sim loop.cir", "op loop.cir", "lcs loop.cir --switch s1=on"] {
        let ran = run_in(directory.path(), command);
        assert_eq!(ran.status, 2, "{ran}");
        assert!(ran.err.contains("loop.cir:2:1"), "{ran}");
    }
    let unknown = run("check chopper.cir --switch s9=on");
    assert_eq!(unknown.status, 2, "{unknown}");
    assert!(unknown.err.contains("the circuit has s1"), "{unknown}");
    let missing = run("check missing.cir");
    assert_eq!(missing.status, 2);
    assert_eq!(
        missing.err.matches("check its name").count(),
        1,
        "{missing}"
    );
}

/// A hundred of them, errors first, and how many more there are.
#[test]
fn a_flood_of_findings_is_cut() {
    let directory = place();
    let lines: String = (0..300).map(|k| format!("v{k} a{k} b\nr{k} a\n")).collect();
    fs::write(
        directory.path().join("flood.cir"),
        format!("flood\n{lines}"),
    )
    .unwrap();
    let ran = run_in(directory.path(), "sim flood.cir");
    assert_eq!(ran.status, 2);
    assert_eq!(ran.err.matches("flood.cir:").count(), 101);
    assert!(
        ran.err.contains("findings more") && ran.err.contains("flood.cir: 300 errors"),
        "{ran}"
    );
    let ran = run_in(directory.path(), "check flood.cir --json");
    let report: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!(
        (ran.status, report["faults"].as_array().unwrap().len()),
        (1, 101)
    );
}

/// The ending of the output says the form, where no option does.
#[test]
fn a_system_is_written_in_the_form_of_its_ending() {
    for (output, begins) in [
        ("q.json", "{"),
        ("q.m", "%"),
        ("q.py", "#"),
        ("q.txt", "divider"),
    ] {
        let directory = place();
        let ran = run_in(directory.path(), &format!("lcs divider.cir -o {output}"));
        assert_eq!(ran.status, 0, "{ran}");
        let text = fs::read_to_string(directory.path().join(output)).unwrap();
        assert!(text.to_lowercase().starts_with(begins), "{output}: {text}");
    }
    let ran = run("lcs divider.cir -o q.foo");
    assert!(
        ran.status == 2 && ran.err.contains("the ending chooses the format"),
        "{ran}"
    );
    // A part of one or more is meant in per cent.
    let ran = run("sim divider.cir --worst m --tol-of r1=5");
    assert!(
        ran.status == 2 && ran.err.contains("write `5%` for 5 %"),
        "{ran}"
    );
}

/// Sweeps that are probably not meant: from 1 kHz down to a millihertz, and without the spacing; suffixes behind which a unit stands.
#[test]
fn what_is_read_otherwise_than_meant_is_told() {
    for (card, words) in [
        (
            ".ac dec 10 1k 1M",
            "`.ac` goes down, from 1e3 Hz to 1e-3 Hz",
        ),
        (".ac 10 1k 1meg", "does not say how its points are spaced"),
        ("r9 a 0 1MOhm", "`1MOhm` is 1 milli"),
        ("c9 a 0 1Farad", "`1Farad` is 1 femto"),
    ] {
        let directory = place();
        let text = format!("meant\nv1 a 0 dc 1 ac 1\nr1 a 0 1k\n{card}\n.tran 1m 5m\n.end\n");
        fs::write(directory.path().join("a.cir"), text).unwrap();
        let ran = run_in(directory.path(), "sim a.cir -o a.csv");
        assert!(ran.status == 0 && ran.err.contains(words), "{card}: {ran}");
    }
    // Energies that are rounding of what a capacitor swings through are no fault.
    let directory = place();
    fs::write(
        directory.path().join("a.cir"),
        "lossless\nv1 a 0 sin(0 5 1k) ac 1\nc1 a 0 1u\n.tran 1m\n",
    )
    .unwrap();
    let ran = run_in(directory.path(), "sim a.cir -o a.csv");
    assert_eq!((ran.status, ran.err.as_str()), (0, ""), "{ran}");
}

/// Once, where the report says what follows from them; apart from it for programs that read them.
#[test]
fn check_shows_a_finding_in_its_line_and_once() {
    let directory = place();
    let twice = "twice\nv1 a 0 1\nr1 a 0 1k\n.model d1 d(n=1)\n.model d1 d(n=2)\n.tran 1u 1m\n";
    fs::write(directory.path().join("twice.cir"), twice).unwrap();
    let ran = run_in(directory.path(), "check twice.cir");
    assert_eq!(ran.out.matches("is defined again").count(), 1, "{ran}");
    assert!(
        ran.out.contains("first here") && ran.err.is_empty(),
        "{ran}"
    );
    let ran = run_in(directory.path(), "check twice.cir --message-format short");
    let line = "twice.cir:5:8: warning[duplicate-model]: model `d1` is defined again; first in line 4 (take one of them out)\n";
    assert_eq!(ran.err, line, "{ran}");
    assert!(!ran.out.contains("defined again"), "{ran}");
}

#[test]
fn lcs_prints_every_format_and_reads_its_json() {
    assert_snapshot!(run("lcs rectifier.cir"));
    for (format, words) in [
        ("json", "\"schema\":\"circ-lcs/1\""),
        ("numpy", "np.array"),
        ("matlab", "];"),
        ("latex", "\\begin{"),
    ] {
        let ran = run(&format!("lcs rectifier.cir --format {format}"));
        assert_eq!(ran.status, 0, "{ran}");
        assert!(ran.out.replace(' ', "").contains(words), "{words} in {ran}");
    }
    let directory = place();
    let at = directory.path();
    assert_eq!(
        run_in(at, "lcs rectifier.cir --format json -o system.json").out,
        ""
    );
    let from_netlist = waves(&run_in(at, "sim rectifier.cir --method theta --step 10u").out);
    let from_system = waves(&run_in(at, "sim system.json --method theta --step 10u").out);
    assert_eq!(from_system.names, from_netlist.names);
    for (a, b) in from_system.values.iter().zip(&from_netlist.values) {
        assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{a} for {b}");
    }
    assert_eq!(
        waves(&run_in(at, "sim system.json --method theta --probe out").out).names,
        ["v(out)"]
    );
    assert_eq!(run_in(at, "check system.json").status, 0);
    assert_eq!(run_in(at, "op system.json").status, 2);
    run_in(
        at,
        "lcs chopper.cir --switch s1=on --format json -o held.json",
    );
    let held = run_in(at, "sim held.json -o held.csv").err;
    assert!(
        held.contains("note[switches-stay]") && held.contains("s1=on"),
        "{held}"
    );
    fs::write(at.join("broken.json"), "{\"schema\":\"circ-lcs/9\"}").unwrap();
    assert_eq!(run_in(at, "sim broken.json").status, 2);
}

#[test]
fn lcs_takes_switches_in_the_position_asked_for() {
    let on = run("lcs chopper.cir --format json --switch s1=on");
    let off = run("lcs chopper.cir --format json --switch S1=off");
    let position = |ran: &Ran| {
        serde_json::from_str::<serde_json::Value>(&ran.out).unwrap()["switches"]["s1"].clone()
    };
    assert_eq!((position(&on), position(&off)), ("on".into(), "off".into()));
    assert_snapshot!(run("lcs chopper.cir --switch s9=on"), @r"
    status 2
    --- out
    --- err
    error[unknown-switch]: --switch s9: the circuit has s1
      help: name one that the message lists
    ");
}

#[test]
fn op_prints_voltages_and_currents() {
    assert_snapshot!(run("op divider.cir"));
    assert_snapshot!(run("op divider.cir --json --param top=4"));
}

#[test]
fn graph_writes_graphviz_and_pictures() {
    assert_snapshot!(run("graph rectifier.cir"));
    let directory = place();
    let ran = run_in(directory.path(), "graph rectifier.cir -o g.svg");
    assert_eq!((ran.status, ran.out.as_str()), (0, ""), "{ran}");
    assert!(
        fs::read_to_string(directory.path().join("g.svg"))
            .unwrap()
            .contains(">d1")
    );
    let at = |t: &str| {
        run_in(
            directory.path(),
            &format!("graph rectifier.cir --at {t} -o at.svg"),
        )
    };
    assert_eq!(at("2.5m").status, 0);
    let svg = fs::read_to_string(directory.path().join("at.svg")).unwrap();
    assert!(
        svg.contains("#d55e00"),
        "the diodes of a half-wave conduct: {svg}"
    );
    assert_eq!(at("-1").status, 2);
    let still = RECTIFIER.replace(".tran 1m 40m\n", ".op\n");
    fs::write(directory.path().join("still.cir"), still).unwrap();
    let ran = run_in(directory.path(), "graph still.cir --at 1m -o at.svg");
    assert!(
        ran.status == 2 && ran.err.contains("asks for no .tran analysis"),
        "{ran}"
    );
    assert_eq!(
        run_in(directory.path(), "graph rectifier.cir -o g.dot -o h.svg").status,
        0
    );
    assert!(directory.path().join("h.svg").is_file());
    assert!(
        fs::read_to_string(directory.path().join("g.dot"))
            .unwrap()
            .starts_with("graph {")
    );
    assert_eq!(run("graph rectifier.cir -o g.pdf").status, 2);
}

#[test]
fn compare_with_a_file_says_yes_or_no() {
    let directory = place();
    let at = directory.path();
    run_in(
        at,
        "sim rectifier.cir --method theta --tol 1e-6 -o ref.csv -o ref.raw",
    );
    for reference in ["ref.csv", "ref.raw"] {
        let ran = run_in(
            at,
            &format!("compare rectifier.cir --method theta --against {reference} --tol 1e-3"),
        );
        assert_eq!(ran.status, 0, "{ran}");
        assert!(
            ran.out.starts_with("signal") && ran.err.contains("within the tolerance"),
            "{ran}"
        );
    }
    let mut wrong = csv::read(fs::File::open(at.join("ref.csv")).unwrap()).unwrap();
    let width = wrong.width();
    wrong.values[20 * width + 1] += 1.0;
    let mut text = Cursor::new(Vec::new());
    csv::write(&mut text, &wrong).unwrap();
    fs::write(at.join("wrong.csv"), text.into_inner()).unwrap();
    let ran = run_in(
        at,
        "compare rectifier.cir --method theta --against wrong.csv --tol 1e-3 --json -o diff.svg",
    );
    assert_eq!(ran.status, 1, "{ran}");
    let found: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!(found["within"], false);
    let signal = &found["signals"][1];
    assert_eq!(
        (&signal["name"], &signal["max_time"]),
        (&"v(out)".into(), &0.02.into())
    );
    let error = signal["max"].as_f64().unwrap() * signal["amplitude"].as_f64().unwrap();
    assert!((error - 1.0).abs() < 1e-3, "{ran}");
    assert!(
        fs::read_to_string(at.join("diff.svg"))
            .unwrap()
            .contains("v(out) difference")
    );
    assert_eq!(
        run_in(
            at,
            "compare rectifier.cir --method theta --against missing.csv"
        )
        .status,
        2
    );
    assert_eq!(
        run_in(
            at,
            "compare rectifier.cir --method theta --against rectifier.cir"
        )
        .status,
        2
    );
}

#[test]
fn compare_says_plainly_that_ngspice_is_missing() {
    let directory = place();
    let output = circ(directory.path())
        .args(["compare", "divider.cir", "--against", "ngspice"])
        .env("PATH", directory.path())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.starts_with(
            "error[ngspice]: ngspice is not installed (no program `ngspice` on the search path)\n  help: install ngspice"
        ),
        "{said}"
    );
}

/// Live comparison where ngspice is installed; elsewhere the test above is what counts.
#[test]
fn compare_agrees_with_ngspice_and_keeps_the_deck() {
    if Command::new("ngspice").arg("--version").output().is_err() {
        return;
    }
    let directory = place();
    let ran = run_in(
        directory.path(),
        "compare rectifier.cir --method theta --keep deck.cir --realisation n0.001 --shift 10u --tol 0.5 --json",
    );
    assert_eq!(ran.status, 0, "{ran}");
    let found: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert!(
        found["against"].as_str().unwrap().starts_with("ngspice-"),
        "{ran}"
    );
    let voltage = &found["signals"][1];
    assert_eq!(voltage["name"], "v(out)");
    assert!(voltage["shifted"].as_f64().unwrap() < 5e-3, "{ran}");
    assert!(
        fs::read_to_string(directory.path().join("deck.cir"))
            .unwrap()
            .contains(".model m.d1 d(")
    );
}

#[test]
fn bench_measures_ladders_in_the_promised_columns() {
    let directory = place();
    let ran = run_in(directory.path(), "bench divider.cir --methods euler");
    assert_eq!(ran.status, 0, "{ran}");
    let mut lines = ran.out.lines();
    let header = "circuit,method,parameter,steps,cpu_seconds,max_error,rms_error,reference";
    assert_eq!(lines.next(), Some(header));
    assert!(lines.clone().count() > 8, "{ran}");
    assert!(lines.all(|l| l.starts_with("divider,euler,")), "{ran}");
    let ran = run_in(
        directory.path(),
        "bench divider.cir --methods theta -o b.csv -o b.json -o b.svg -o b.png --signals s.csv",
    );
    assert_eq!((ran.status, ran.out.as_str()), (0, ""), "{ran}");
    assert!(
        fs::read_to_string(directory.path().join("b.csv"))
            .unwrap()
            .starts_with(header)
    );
    assert!(
        fs::read_to_string(directory.path().join("b.svg"))
            .unwrap()
            .contains("error against run time")
    );
    let document: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(directory.path().join("b.json")).unwrap())
            .unwrap();
    let first = &document["measurements"][0];
    assert_eq!(first["method"], "theta");
    assert!(first["energy_residual"].as_f64().unwrap() < 1e-9, "{first}");
    let signals = first["signals"].as_array().unwrap();
    let worst = |error: &str| {
        let errors = signals.iter().map(|s| s[error].as_f64().unwrap());
        errors.fold(0.0, f64::max)
    };
    for error in ["max_error", "rms_error"] {
        assert_eq!(first[error], worst(error), "{first}");
    }
    let lines = fs::read_to_string(directory.path().join("s.csv")).unwrap();
    let runs = document["measurements"].as_array().unwrap().len();
    assert!(signals.len() > 1 && lines.lines().count() == 1 + runs * signals.len());
    // What a file says of another program stands beside ours, in the table and in the picture.
    let points = format!(
        "{header}\ndivider,gnucap:trap,step=1e-6,7,2e-3,1e-5,3e-6,exact\ndivider,gnucap:trap,step=1e-7,0,0e0,,,failed: no end\n"
    );
    fs::write(directory.path().join("points.csv"), &points).unwrap();
    let arguments = "bench divider.cir --methods exact --against points.csv -o c.csv -o c.svg";
    let ran = run_in(directory.path(), arguments);
    assert_eq!(ran.status, 0, "{ran}");
    assert!(ran.err.contains("gnucap:trap step=1e-7: no end"), "{ran}");
    let read = |name: &str| fs::read_to_string(directory.path().join(name)).unwrap();
    assert!(read("c.csv").ends_with(points.split_once('\n').unwrap().1));
    assert!(read("c.svg").contains(">gnucap<"));
    for (from, to, told) in [
        (
            "2e-3",
            "soon",
            "points.csv: line 2: `soon` is no cpu_seconds",
        ),
        (
            "steps",
            "stairs",
            "points.csv: the columns must be circuit,method",
        ),
    ] {
        fs::write(
            directory.path().join("points.csv"),
            points.replace(from, to),
        )
        .unwrap();
        let ran = run_in(directory.path(), arguments);
        assert_eq!(ran.status, 2, "{ran}");
        assert!(ran.err.contains(told), "{ran}");
    }
    let over = "bench divider.cir --against points.csv -o points.csv";
    assert_eq!(run_in(directory.path(), over).status, 2);
    assert_eq!(run("bench divider.cir -o b.xls").status, 2);
    assert_eq!(run("bench divider.cir --signals b.json").status, 2);
}

#[test]
fn what_works_on_matrices_says_so_of_a_nonlinear_form() {
    let directory = place();
    let form = include_str!("forms/cubic.json");
    fs::write(directory.path().join("cubic.json"), form).unwrap();
    for command in ["check", "lcs", "bench"] {
        let ran = run_in(directory.path(), &format!("{command} cubic.json"));
        assert_eq!(ran.status, 2, "{ran}");
        assert!(
            ran.err.starts_with(
                "error[not-for-system]: cubic.json: a nonlinear form, sound at its start"
            ),
            "{ran}"
        );
    }
    let broken = form.replace("[[1]]", "[[2]]");
    assert_ne!(form, broken);
    fs::write(directory.path().join("cubic.json"), broken).unwrap();
    let ran = run_in(directory.path(), "check cubic.json");
    assert!(
        ran.status == 2 && ran.err.contains("Assumption 4.1"),
        "{ran}"
    );
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let directory = place();
    let long = DIVIDER.replace(".tran 1m 3m", ".tran 1u 100m");
    fs::write(directory.path().join("long.cir"), long).unwrap();
    let mut child = circ(directory.path())
        .args(["sim", "long.cir", "--method", "theta", "--step", "1m"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut reader = BufReader::new(child.stdout.take().unwrap());
    let mut line = String::new();
    reader.read_line(&mut line).unwrap();
    assert!(line.starts_with("time,"));
    drop(reader);
    let mut said = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut said)
        .unwrap();
    assert_eq!((child.wait().unwrap().code(), said.as_str()), (Some(0), ""));
}

/// One period from 0 to T exactly, and the summary of INTERFACE's keys.
#[test]
fn pss_writes_one_period_and_its_summary() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("a.csv");
    let netlists = concat!(env!("CARGO_MANIFEST_DIR"), "/netlists");
    let ran = run(&format!(
        "pss {netlists}/buck-open-loop.cir -o {} --summary json",
        out.display()
    ));
    assert_eq!(ran.status, 0, "{}", ran.err);
    let summary: serde_json::Value = serde_json::from_str(ran.err.trim()).expect("one object");
    let pss = &summary["pss"];
    assert_eq!(pss["period"], 1e-5);
    assert_eq!(
        (pss["kind"].as_str(), pss["order"].as_u64()),
        (Some("driven"), Some(1))
    );
    assert_eq!(pss["stable"], true);
    assert!(pss["residual"].as_f64().is_some_and(|r| r <= 1e-12));
    assert!(pss["iterations"].is_u64() && pss["multipliers"][0][1].is_f64());
    let rows = std::fs::read_to_string(&out).expect("rows");
    let times: Vec<f64> = (rows.lines().skip(1))
        .map(|row| {
            row.split(',')
                .next()
                .and_then(|t| t.parse().ok())
                .expect("a time")
        })
        .collect();
    assert_eq!((times[0], times[times.len() - 1]), (0.0, 1e-5));
    assert_eq!(times.len(), 11);
    let none = run(&format!("pss {netlists}/line-mismatch.cir"));
    assert_eq!(none.status, 2);
    assert!(
        none.err.contains("no periodic steady state"),
        "{}",
        none.err
    );
}

/// `.pss` alone is one period, `.tran … steady` begins on the orbit, and where there is none begins as usual, with a warning. The capacitor swings
/// between 5 V ∓ 5 V tanh ¼.
#[test]
fn cards_ask_for_the_steady_state() {
    let folder = tempfile::tempdir().expect("a folder");
    let netlist = folder.path().join("a.cir");
    let rows = |cards: &str, card: &str, command: &str| {
        let text = format!("title\n{cards}\nc1 2 0 1u\n{card}\n.save v(2)\n.end\n");
        std::fs::write(&netlist, text).expect("a netlist");
        let ran = run(&format!("{command} {}", netlist.display()));
        assert_eq!(ran.status, 0, "{card}: {}", ran.err);
        let rows: Vec<(f64, f64)> = (ran.out.lines().skip(1))
            .map(|row| {
                let (t, v) = row.split_once(',').expect("two columns");
                (t.parse().expect("a time"), v.parse().expect("a value"))
            })
            .collect();
        (rows, ran.err)
    };
    let square = "v1 1 0 pulse(0 10 0 0 0 0.5m 1m)\nr1 1 2 1k";
    let least = 5.0 - 5.0 * 0.25_f64.tanh();
    for command in ["sim", "pss"] {
        for card in [".pss 1k 5m 2 100 10", ".pss 1k 0 out 100 10 50 1e-3 uic"] {
            let (rows, _) = rows(square, card, command);
            assert_eq!((rows.len(), rows[100].0), (101, 1e-3), "{card}");
            for row in [rows[0], rows[100]] {
                assert!((row.1 - least).abs() < 1e-12, "{card}: {row:?}");
            }
        }
    }
    let (steady, said) = rows(square, ".tran 0.5m 2m 0 steady", "sim");
    let found: Vec<f64> = steady.iter().map(|row| row.1).collect();
    let swing = [least, 10.0 - least, least, 10.0 - least, least];
    assert!(
        found.iter().zip(swing).all(|(a, b)| (a - b).abs() < 1e-12),
        "{found:?}"
    );
    assert!(
        said.contains("the run begins at its periodic steady state"),
        "{said}"
    );
    // A capacitor that is charged without end does not repeat: the run begins as usual.
    let (usual, said) = rows("i1 0 2 1m", ".tran 0.5m 2m uic steady", "sim");
    assert!((usual[4].1 - 2.0).abs() < 1e-12, "{usual:?}");
    assert!(said.contains("`steady` of `.tran` is left out: "), "{said}");
}

/// Complex columns, sidebands and ratios in the forms of INTERFACE; margins in words; `circ sim` of a netlist that asks for `.ac` alone.
#[test]
fn ac_writes_every_format_and_tells_the_margins_of_ratios() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    let netlist = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/netlists/small-signal/buck-loop.cir"
    );
    let files = ["csv", "raw", "npz", "json", "svg", "png", "html"].map(|e| at(&format!("a.{e}")));
    let ran = run(&format!(
        "ac {netlist} --probe -v(out)/v(x) --probe v(out) -o {}",
        files.join(" -o ")
    ));
    assert_eq!((ran.status, ran.out.as_str()), (0, ""), "{}", ran.err);
    assert!(ran.err.contains("-v(out)/v(x): margin 87."), "{}", ran.err);
    assert!(ran.err.contains("dB at 2.3"), "{}", ran.err);
    let text = fs::read_to_string(at("a.csv")).expect("rows");
    let mut lines = text.lines();
    assert_eq!(
        lines.next(),
        Some("frequency,re(-v(out)/v(x)),im(-v(out)/v(x)),re(v(out)),im(v(out))")
    );
    assert_eq!(lines.count(), 148);
    let raw = fs::read(at("a.raw")).expect("a file");
    assert!(raw.windows(24).any(|w| w == b"Plotname: AC Analysis\nFl"));
    let svg = fs::read_to_string(at("a.svg")).expect("a picture");
    assert!(svg.contains("gain (dB)") && svg.contains("phase (°)") && svg.contains("10 kHz"));
    let sidebands = run(&format!("ac {netlist} --probe v(out) --sidebands 1 -q"));
    assert!(
        (sidebands.out).starts_with(
            "frequency,re(v(out)@-1),im(v(out)@-1),re(v(out)),im(v(out)),re(v(out)@1)"
        ),
        "{}",
        &sidebands.out[..120]
    );

    fs::write(
        folder.path().join("rc.cir"),
        "rc\nv1 1 0 ac 1\nr1 1 2 1k\nc1 2 0 1u\n.ac lin 3 100 300\n.end\n",
    )
    .expect("a netlist");
    let plain = run_in(folder.path(), "sim rc.cir -q");
    assert_eq!(plain.status, 0, "{}", plain.err);
    assert_eq!(plain.out, run_in(folder.path(), "ac rc.cir -q").out);
    assert_eq!(plain.out.lines().count(), 4);
    let both = run(&format!("sim {netlist} -o {}", at("t.csv")));
    assert!(
        both.err.contains("circ ac") && both.status != 1,
        "{}",
        both.err
    );
}

/// The keys of INTERFACE; a table that is asked for is told under `-q` too.
#[test]
fn tables_derivatives_and_ranges_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("buck.cir");
    let text = "buck\nv1 1 0 10\ns1 1 2 g 0 sw\nd1 0 2 dd\nvg g 0 pulse(0 1 0 0 0 {d*10u} 10u)\nl1 2 3 100u\nc1 3 0 10u\nr1 3 0 5 tol=5\n\
        .model sw sw(vt=0.5 vh=0 ron=10m roff=1meg)\n.model dd d(vfwd=0.5 ron=10m)\n.param d=0.4\n.save v(3)\n.tran 1u 200u\n\
        .meas tran out avg v(3) from=100u\n.end\n";
    std::fs::write(&file, text).expect("a netlist");
    let (file, out) = (file.display(), folder.path().join("a.csv"));
    let out = out.display();
    let json =
        |text: &str| -> serde_json::Value { serde_json::from_str(text.trim()).expect("JSON") };
    for command in ["sim", "pss"] {
        let ran = run(&format!(
            "{command} {file} --table --in v1 --out r1 -o {out} --summary json"
        ));
        assert_eq!(ran.status, 0, "{}", ran.err);
        let table = &json(&ran.err)["table"];
        for key in ["mean", "rms", "min", "max"] {
            assert!(table["l1"]["i"][key].is_f64() && table["l1"]["v"][key].is_f64());
        }
        assert!(table["l1"]["power"].is_f64() && table["probes"]["v(3)"]["ripple"].is_f64());
        assert_eq!(table["power"]["inputs"][0], "v1");
        if command == "pss" {
            let efficiency = table["power"]["efficiency"]
                .as_f64()
                .expect("an efficiency");
            assert!((0.8..1.0).contains(&efficiency), "{efficiency}");
        }
        let ran = run(&format!("-q {command} {file} --table -o {out}"));
        assert!(
            ran.err.contains("power: input") && ran.err.contains("out  "),
            "{}",
            ran.err
        );
    }
    for steady in ["", "--pss"] {
        let ran = run(&format!(
            "sens {file} {steady} --of out --to l1 --to d --json"
        ));
        assert_eq!(ran.status, 0, "{}", ran.err);
        let out = &json(&ran.out)["of"]["out"];
        assert!(out["value"].is_f64() && out["to"]["l1"].is_f64() && out["to"]["d"].is_f64());
    }
    let ran = run(&format!(
        "sim {file} --worst out --tol-of d=2% -o {out} --summary json"
    ));
    assert_eq!(ran.status, 0, "{}", ran.err);
    let worst = &json(&ran.err)["worst"][0];
    let [least, nominal, greatest] = [
        &worst["least"]["value"],
        &worst["nominal"],
        &worst["greatest"]["value"],
    ];
    assert!(least.as_f64() < nominal.as_f64() && nominal.as_f64() < greatest.as_f64());
    assert_eq!(worst["contributions"][1][0], "r1");
    assert_eq!(run(&format!("sens {file} --to nothing")).status, 2);
}

/// A table for each run, under its values; the last row of each is the element's power there.
#[test]
fn every_run_of_a_sweep_has_a_table() {
    let folder = place();
    let text = "divider\nv1 a 0 10\nr1 a b {r}\nr2 b 0 {s}\n.param r=1 s=4\n.step param r list 1 6\n.step param s list 4 9\n.tran 1u 10u\n.save v(b)\n.end\n";
    fs::write(folder.path().join("steps.cir"), text).unwrap();
    let ran = run_in(folder.path(), "-q sim steps.cir --table -o a.csv");
    assert_eq!(ran.status, 0, "{ran}");
    let labels = ["s=4 r=1", "s=4 r=6", "s=9 r=1", "s=9 r=6"];
    let places = labels.map(|label| {
        let swapped: Vec<&str> = label.split(' ').rev().collect();
        let swapped = swapped.join(" ");
        let found = ran
            .err
            .lines()
            .position(|line| line == label || line == swapped);
        found.unwrap_or_else(|| panic!("no {label}: {ran}"))
    });
    assert_eq!(ran.err.matches("power: input").count(), 4, "{ran}");
    let lines: Vec<&str> = ran.err.lines().collect();
    assert!(
        places.iter().all(|at| lines[at + 1].contains("0 s to ")),
        "{ran}"
    );
    let ran = run_in(
        folder.path(),
        "sim steps.cir --table -o a.csv --summary json",
    );
    let json: serde_json::Value = serde_json::from_str(ran.err.trim()).expect("JSON");
    let runs = json["runs"].as_array().expect("runs");
    assert_eq!(runs.len(), 4);
    for run in runs {
        let [r, s] = ["r", "s"].map(|name| run["values"][name].as_f64().expect("a value"));
        let power = run["table"]["r2"]["power"].as_f64().expect("a power");
        let truth = 100.0 * s / (r + s).powi(2);
        assert!((power - truth).abs() < 1e-12 * truth, "{run}");
    }
    // What is no transient has none.
    let ac = text
        .replace(".tran 1u 10u", ".ac dec 5 1 1k")
        .replace("10\n", "10 ac 1\n");
    fs::write(folder.path().join("ac.cir"), ac).unwrap();
    let ran = run_in(folder.path(), "sim ac.cir --table");
    assert!(
        ran.status == 2 && ran.err.contains("`--table` takes a transient"),
        "{ran}"
    );
}

/// Measurements of a response are told by `ac`, also under `-q`, and a transient says where they are.
#[test]
fn a_response_is_measured_where_it_is_found() {
    let folder = place();
    let text = "rc\nv1 in 0 ac 1\nr1 in out 1k\nc1 out 0 1u\n.ac dec 10 1 100k\n.meas ac corner when vdb(out)=-3\n.end\n";
    let file = folder.path().join("rc.cir");
    fs::write(&file, text).unwrap();
    for command in ["-q ac rc.cir -o a.csv", "-q sim rc.cir -o a.html"] {
        let ran = run_in(folder.path(), command);
        assert!(
            ran.status == 0 && ran.err.starts_with("corner              =  1.5"),
            "{ran}"
        );
    }
    let page = fs::read_to_string(folder.path().join("a.html")).unwrap();
    assert!(page.contains("Measurements") && page.contains("corner   "));
    fs::write(&file, text.replace(".end", ".tran 1u 1m")).unwrap();
    let ran = run_in(folder.path(), "sim rc.cir -o a.csv");
    assert_eq!(ran.status, 0, "{ran}");
    let note = "note[left-out]: `.meas ac` (corner) is left out, as a transient has no response to small sines; `circ ac rc.cir` measures that";
    assert!(
        ran.err.contains(note) && !ran.err.contains("skipped"),
        "{ran}"
    );
    let ran = run_in(folder.path(), "ac rc.cir -o a.csv");
    assert!(ran.err.contains("corner   "), "{ran}");
    fs::write(&file, text.replace(".ac dec 10 1 100k", ".tran 1u 1m")).unwrap();
    let ran = run_in(folder.path(), "sim rc.cir -o a.csv");
    assert!(
        ran.status == 0 && ran.err.contains("with an `.ac` card"),
        "{ran}"
    );
}
