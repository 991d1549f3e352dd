//! Codes of the command line: what could not be carried out, and what was passed over.

use super::Explanation;

pub(super) const CODES: [Explanation; 32] = [
    Explanation::of(
        "bad-option",
        "An option has a value that it cannot have.",
        "A negative step, an unknown word, a number with a unit that is none.",
        "`circ COMMAND --help` lists what each option takes; numbers have suffixes as in netlists (`10u`).",
    )
    .shown_by("sim --step 0", "r\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "broken-system",
        "The JSON file is no system, or its matrices do not fit together.",
        "A file edited by hand, or of another program.",
        "Write one with `circ lcs NETLIST -o system.json` and compare; docs/for-researchers.md has the format.",
    ),
    Explanation::of(
        "browser",
        "No browser could be opened.",
        "A machine without a screen, or no program for pages.",
        "Open the file or address that is named yourself; `-o out.html` writes it to a place of your own.",
    ),
    Explanation::of(
        "failed-runs",
        "Of several runs some failed.",
        "A value of `.step` or of a sweep with which the circuit is contradictory.",
        "Look at the finding of each above; the others are written.",
    )
    .shown("one of two\ni1 0 a pwl(0 -1 2m {x})\nd1 0 a di\n.model di d(ideal)\n.step param x list -1 1\n.tran 0.5m 2m\n"),
    Explanation::of(
        "file",
        "A file could not be read or written.",
        "A folder that does not exist, a missing right, a full disk.",
        "Check the path and the rights; the message has what the system says.",
    )
    .shown_by("sim -o /nowhere/out.csv", "r\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "gaps",
        "Values of the file are missing or not finite; curves have gaps there.",
        "Another program writes empty cells, NaN or inf where it has no value.",
        "Nothing if gaps are what is meant; else write the file anew with all values.",
    ),
    Explanation::of(
        "missing-argument",
        "The command line lacks something that the command needs.",
        "A command without its netlist, or an option without its value.",
        "`circ COMMAND --help` shows what belongs there.",
    ),
    Explanation::of(
        "ngspice",
        "ngspice could not be run, or a circuit has no deck for it.",
        "It is not installed, or the circuit has what ngspice does not know.",
        "Install ngspice (Debian: `apt install ngspice`), or compare with a file: `--against FILE`.",
    ),
    Explanation::of(
        "no-address",
        "`circ watch` cannot listen where it should.",
        "Another program has the port.",
        "Take another `--port`, or leave it out.",
    ),
    Explanation::of(
        "no-picture",
        "There is nothing to draw, or a picture could not be made.",
        "No signal has a row.",
        "Ask for a signal (`--probe`), and look whether the run has rows.",
    ),
    Explanation::of(
        "no-reference",
        "A reference run that is accurate enough could not be made.",
        "The circuit does not come through with a very small tolerance.",
        "`circ sim FILE --method theta --tol 1e-10` shows why.",
    ),
    Explanation::of(
        "no-shell",
        "Nothing says for which shell completions are to be written.",
        "The variable SHELL is not set.",
        "Name it: `circ completions bash`.",
    ),
    Explanation::of(
        "no-such-plot",
        "The file has no plot of that number.",
        "`--plot N` beyond the plots of the file.",
        "Take a smaller N.",
    ),
    Explanation::of(
        "not-for-system",
        "The command needs a netlist, and was given a system or form in JSON.",
        "Systems have matrices, but no circuit: no elements, no drawing, no ngspice deck.",
        "Give the netlist that the system was made of.",
    ),
    Explanation::of(
        "not-watched",
        "`circ watch` follows the file of `sim`, `pss` and `ac` alone.",
        "Another command, or standard input.",
        "Name a netlist: `circ watch FILE`.",
    ),
    Explanation::of(
        "nothing-in-common",
        "Two sets of waveforms cannot be compared.",
        "They have no signal, or no span of time, in common.",
        "Look at the names of the signals, and at the spans of both.",
    ),
    Explanation::of(
        "nothing-random",
        "`--mc` asks for samples of a netlist in which nothing is random.",
        "No tolerance is named.",
        "Write `tol=5` on a card, `--tol-of r1=5%`, or `{mc(1k, 0.05)}`.",
    )
    .shown_by("sweep --mc 3", "r\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m\n.meas tran m avg v(a)\n"),
    Explanation::of(
        "option-conflict",
        "Options exclude each other, or an option does not go with what the netlist asks for.",
        "`--verify` of a run with `.step`, `--theta` with another method.",
        "Leave one of the two out.",
    )
    .shown_by("sim --method exact --theta 0.6", "r\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "output-format",
        "A result cannot be written in the format asked for.",
        "An ending that names no format, bytes for a terminal, or a format that the command does not have.",
        "Give the file one of the endings that the message lists, or name it with `--format`.",
    )
    .shown_by("sim -o out.xyz", "r\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "overwritten",
        "A file that is read for the run would be overwritten by its results.",
        "The same name behind `-o` as the netlist or a file that it includes.",
        "Choose another name.",
    )
    .shown_by("lcs -o example.cir", "r\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "points",
        "The file is not one of measurements.",
        "`circ bench --against FILE.csv` reads what `circ bench -o FILE.csv` writes: a line for each run of a program, in its columns.",
        "Write the columns that the message names; a run that failed has no errors, and `failed: ` with its words in place of the reference.",
    ),
    Explanation::of(
        "several-plots",
        "The file holds several plots, of which one is shown.",
        "A raw file of several analyses.",
        "`--plot N` takes another.",
    ),
    Explanation::of(
        "stream",
        "Standard output or standard error broke.",
        "The program that reads them ended, or the disk behind them is full.",
        "Write to a file with `-o`, and check the space there.",
    ),
    Explanation::of(
        "too-many-runs",
        "A sweep asks for more runs than are made at once.",
        "Many values of many parameters, whose numbers multiply.",
        "Take fewer values, or sample them: `--mc N`.",
    ),
    Explanation::of(
        "unknown-code",
        "There is no such code.",
        "A slip in its letters.",
        "`circ explain` lists all.",
    ),
    Explanation::of(
        "unknown-command",
        "The first word is neither a command nor a file.",
        "A slip in a letter, or a file in another folder.",
        "`circ help` lists the commands; a netlist is named with its path.",
    ),
    Explanation::of(
        "unknown-measurement",
        "The netlist has no measurement of that name.",
        "`--worst` or `--of` name what `.meas` does not have.",
        "Name one that the message lists.",
    )
    .shown_by("sim --worst m", "r\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "unknown-option",
        "The command has no such option.",
        "An option of another program, or of another command.",
        "`circ COMMAND --help` lists its options.",
    ),
    Explanation::of(
        "unknown-signal",
        "What `--probe` asks for is no signal of the circuit or file.",
        "A slip in a name, or a node that a subcircuit has (`v(x1.a)`).",
        "Name one that the message lists, or leave `--probe` out, which shows all.",
    )
    .shown_by("sim --probe v(nowhere)", "r\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "unknown-switch",
        "The circuit has no switch of that name.",
        "A slip in a name.",
        "Name one that the message lists.",
    )
    .shown_by("lcs --switch s9=on", "r\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "unused-option",
        "An option is of no use here, and was passed over.",
        "`--step` where integration is exact and has no steps.",
        "Leave it out, or ask for steps with `--method theta`.",
    )
    .shown_by("sim --step 1u", "r\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "waveforms",
        "The file is not one of waveforms, or is damaged.",
        "Another kind of file, such as a netlist, or cells that are no numbers.",
        "`circ view` and `--against` take csv, npz, json and raw; the message has the line.",
    ),
];
