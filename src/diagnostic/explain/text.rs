//! Codes of what is read: files, lines, cards, numbers.

use super::Explanation;

pub(super) const CODES: [Explanation; 36] = [
    Explanation::of(
        "after-end",
        "Cards stand after `.end`, which ends the netlist: they are not read.",
        "Cards were added at the end of a file, below its last line.",
        "Move `.end` behind them, or take it out: the end of the file ends the netlist as well.",
    )
    .shown("below the end\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m\n.end\nr2 a 0 1\n"),
    Explanation::of(
        "bad-card",
        "A line is neither an element nor a directive.",
        "A comment without `*` or `;`, or a continuation line without its `+`.",
        "Begin comments with `*`, continuation lines with `+`.",
    )
    .shown("a line of signs\nv1 a 0 1\n= 5\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "bad-expression",
        "An expression breaks off, or goes on with what does not belong to it.",
        "An operator is missing between two parts, or a blank separates what belongs together outside of braces.",
        "Write the operator; put expressions in braces, `{2*r}`.",
    )
    .shown("no operator\nv1 a 0 1\nr1 a 0 {2 3}\n.tran 1m 5m\n"),
    Explanation::of(
        "bad-name",
        "A name is needed where a number or an expression stands.",
        "`K1 L1 0.9 L2`: the coefficient of a coupling stands last, names of inductors before it.",
        "Write `K1 L1 L2 0.9`.",
    )
    .shown("coefficient first\nv1 a 0 1\nl1 a 0 1m\nl2 a 0 1m\nk1 l1 0.9 l2\n.tran 1m 5m\n"),
    Explanation::of(
        "bad-number",
        "What should be a number is none.",
        "Letters in the middle of a number, an expression without braces, or a word where a value belongs.",
        "Numbers are `4.7k`, `10u`, `1e-3`; what is computed stands in braces, `{2*r}`.",
    )
    .shown("a number with an accident\nv1 a 0 1\nr1 a 0 1.2.3\n.tran 1m 5m\n"),
    Explanation::of(
        "bad-sheet",
        "A line of an LTspice schematic is none that LTspice writes, or has a coordinate or orientation that is none.",
        "The file was edited by hand, cut off, or written by another program.",
        "Open the schematic in LTspice and save it again, or correct the line.",
    )
    .shown("Version 4\nSHEET 1 880 680\nWIRE 0 0 16\n"),
    Explanation::of(
        "bad-symbol",
        "A symbol of a schematic has no name, so that it has no card.",
        "The attribute `InstName` is missing or empty.",
        "Name the symbol in LTspice, or add the line `SYMATTR InstName R1` below it.",
    )
    .shown("Version 4\nSHEET 1 880 680\nSYMBOL res 0 0 R0\nSYMATTR Value 1k\n"),
    Explanation::of(
        "control-left-out",
        "A command of `.control` that changes the circuit or the run is not carried out; the result is without it.",
        "Scripts of ngspice: loops, `stop`, `alter` of model parameters.",
        "Write the change into the cards; loops over a value are `.step`, and `--param NAME=VALUE` sets a parameter.",
    )
    .shown("a script\nv1 a 0 1\nr1 a 0 1k\n.control\nalter @d1[is] = 1\ntran 1m 5m\n.endc\n"),
    Explanation::of(
        "decimal-comma",
        "A number has a comma where SPICE takes a point.",
        "The file was written, or edited, where numbers have decimal commas.",
        "Write a point.",
    )
    .shown("comma\nv1 a 0 1\nr1 a 0 4,7k\n.tran 1m 5m\n"),
    Explanation::of(
        "empty",
        "The file holds nothing.",
        "The export of the netlist failed, or the file is another one than meant.",
        "Write or export the netlist again.",
    )
    .shown("\n"),
    Explanation::of(
        "ends-mismatch",
        "The name behind `.ends` is not that of the subcircuit it closes.",
        "A subcircuit was renamed in one of two places, or the `.ends` of an inner one is missing.",
        "Give both the same name; the `.ends` is taken as the end of the innermost open subcircuit.",
    )
    .shown("two names\nv1 a 0 1\nx1 a 0 part\n.subckt part p n\nr1 p n 1k\n.ends other\n.tran 1m 5m\n"),
    Explanation::of(
        "found-elsewhere",
        "A file of `.include` or `.lib` is not where its path says; one of that name was found elsewhere and is read.",
        "A netlist from another computer, with that computer's folders.",
        "Nothing, if the file named in the message is the right one; else name it in the card, or its folder with `--lib`.",
    ),
    Explanation::of(
        "ignored",
        "A part of a card is read and has no effect.",
        "An option of another simulator that circ does not have.",
        "Leave it out, or write in another way what it stands for; docs/netlist.md says what is supported.",
    )
    .shown("start\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m nodiscard\n"),
    Explanation::of(
        "include-loop",
        "A file includes itself, directly or through others.",
        "Two libraries that include one another.",
        "Take one of the `.include` cards out.",
    ),
    Explanation::of(
        "missing",
        "A card ends before what it needs.",
        "A value was forgotten, or a node: then the value was read as a node.",
        "Complete the card as the message says; docs/netlist.md has the form of every card.",
    )
    .shown("a node too few\nv1 a 0 1\nr1 a 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "missing-file",
        "A file of `.include`, `.lib` or of a PWL source is not found; what it defines is missing.",
        "Paths count from the folder of the file that names them; a library may be on another computer only.",
        "Correct the path, or name the folder of the libraries with `--lib DIR` or the environment's CIRC_LIB.",
    )
    .shown("no such library\nv1 a 0 1\nr1 a 0 1k\n.include parts/none.lib\n.tran 1m 5m\n"),
    Explanation::of(
        "missing-section",
        "`.lib FILE SECTION` names a section that the file does not have.",
        "A slip in the name, or a library of another version.",
        "Look for the cards `.lib NAME` in the file; without a section, the whole file is read.",
    ),
    Explanation::of(
        "no-unit",
        "Letters behind a number are neither a suffix nor a unit.",
        "A slip: the letter O in place of a zero, a suffix typed twice. SPICE passes over such letters, so that `22O` is 22.",
        "Write the number that is meant, a suffix (t g meg k m u n p f) and a unit, or none.",
    )
    .shown("a letter for a zero\nv1 a 0 1\nr1 a 0 22O\n.tran 1m 5m\n"),
    Explanation::of(
        "not-a-netlist",
        "The file is of another kind: a schematic, a board, a page.",
        "The schematic was given in place of the netlist that is exported from it.",
        "Export a SPICE netlist; the message says how where the kind is known.",
    )
    .shown("(kicad_sch (version 20230121)\n"),
    Explanation::of(
        "one-net",
        "Two labels of a schematic name one net, which has the first name in results.",
        "Wires join what was meant to be apart, or a net has two names on purpose.",
        "Nothing if it is meant; use the name that the note gives in probes.",
    )
    .shown("Version 4\nSHEET 1 880 680\nWIRE 0 16 96 16\nFLAG 0 16 a\nFLAG 96 16 b\nFLAG 0 96 0\nSYMBOL voltage 0 0 R0\nSYMATTR InstName V1\nSYMATTR Value 1\nTEXT 0 200 Left 2 !.tran 1m 5m\n"),
    Explanation::of(
        "open-pin",
        "A pin of a part on a schematic touches no wire, label or other pin.",
        "A wire that ends beside the pin; a part that was moved without its wires.",
        "Draw the wire to the pin; an open end that is meant does no harm.",
    )
    .shown("Version 4\nSHEET 1 880 680\nWIRE 96 16 0 16\nFLAG 0 96 0\nSYMBOL voltage 0 0 R0\nSYMATTR InstName V1\nSYMATTR Value 1\nSYMBOL res 96 16 R0\nSYMATTR InstName R1\nSYMATTR Value 1k\nTEXT 0 200 Left 2 !.tran 1m 5m\n"),
    Explanation::of(
        "skipped",
        "Directives that do not concern the analysis are left out.",
        "`.noise`, `.temp` and others of a netlist that was written for another simulator.",
        "Nothing, unless one of them matters: docs/netlist.md says which analyses there are.",
    )
    .shown("noise\nv1 a 0 1\nr1 a 0 1k\n.noise v(a) v1 dec 10 1 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "suffix-a",
        "The `a` behind a number is the unit ampere, not the prefix atto.",
        "SPICE knows no atto; `5a` is 5.",
        "Write `5e-18`.",
    )
    .shown("atto\nv1 a 0 1\nc1 a 0 5a\n.tran 1m 5m\n"),
    Explanation::of(
        "suffix-f",
        "The `F` behind a capacitance is the prefix femto, not the unit farad.",
        "`1F` was meant as one farad; it is 1 fF.",
        "Leave the unit out: `1` is one farad.",
    )
    .shown("farad\nv1 a 0 1\nc1 a 0 1F\n.tran 1m 5m\n"),
    Explanation::of(
        "suffix-m",
        "The `M` behind a resistance or a frequency is the prefix milli, not mega.",
        "SPICE does not tell capitals from small letters; mega is `Meg`.",
        "Write `1Meg` for a million ohms, `1m` for a thousandth of one.",
    )
    .shown("mega\nv1 a 0 1\nr1 a 0 1M\n.tran 1m 5m\n"),
    Explanation::of(
        "title",
        "The first line looks like a card, but the first line of a netlist is its title and not part of the circuit.",
        "The netlist has no title line.",
        "Put a line above it: the title, or `*`.",
    )
    .shown("v1 a 0 1\nr1 a 0 1k\nc1 a 0 1u\n.tran 1m 5m\n"),
    Explanation::of(
        "too-deep",
        "Expressions, blocks or files are nested too deep, or without end.",
        "Parameters or functions that call one another in a circle.",
        "Look for the circle at the place of the message, and cut it.",
    )
    .shown("a function in circles\n.func f(x) {f(x)+1}\nv1 a 0 1\nr1 a 0 {f(1)}\n.tran 1m 5m\n"),
    Explanation::of(
        "too-large",
        "A table, a sweep or the circuit has more parts than circ takes.",
        "A sweep over several values multiplies their numbers; a table of measured points has too many corners.",
        "Take fewer points: every corner of a table is an ideal device.",
    ),
    Explanation::of(
        "too-long",
        "An expression has too many operators.",
        "A sum that a program wrote.",
        "Cut it into parameters.",
    ),
    Explanation::of(
        "unbalanced",
        "A parenthesis, brace or quotation mark is never closed, or closed twice.",
        "A closing sign was forgotten, or the card goes on in a line without `+`.",
        "Close it on the same card; continuation lines begin with `+`.",
    )
    .shown("open brace\nv1 a 0 1\nr1 a 0 {2*3\n.tran 1m 5m\n"),
    Explanation::of(
        "unexpected",
        "Something stands where nothing should.",
        "A unit apart from its number (`10 ohm`), a second value, or `.ends` and `.endif` of nothing.",
        "Take it out.",
    )
    .shown("a unit apart\nv1 a 0 1\nr1 a 0 10 ohm\n.tran 1m 5m\n"),
    Explanation::of(
        "unknown-directive",
        "A card with a dot that circ does not know.",
        "A slip of the pen, or a directive of another simulator.",
        "Correct it; a directive that does not concern the circuit may be left out.",
    )
    .shown("slip\nv1 a 0 1\nr1 a 0 1k\n.trann 1m 5m\n"),
    Explanation::of(
        "unknown-symbol",
        "A symbol of a schematic is neither one of LTspice's that circ has a model of nor a file.",
        "A vendor's part of LTspice's library, or a symbol of one's own whose file was not copied along.",
        "Put its `.asy` file, and the library or the `.asc` that it names, beside the schematic or into a folder of `--lib DIR`; or export the netlist with LTspice.",
    )
    .shown("Version 4\nSHEET 1 880 680\nSYMBOL Opamps\\\\LT1001 0 0 R0\nSYMATTR InstName U1\n"),
    Explanation::of(
        "unreadable",
        "A file cannot be read.",
        "It does not exist, is a folder, or may not be read.",
        "Check its name and permissions.",
    ),
    Explanation::of(
        "unterminated",
        "A subcircuit, an `.if` or a `.control` is never closed.",
        "`.ends`, `.endif` or `.endc` was forgotten.",
        "Write it where the block ends.",
    )
    .shown("no ends\nv1 a 0 1\nr1 a 0 1k\n.subckt part p n\nr1 p n 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "unused-subcircuit",
        "A subcircuit that nothing calls has faults; they do no harm.",
        "A library with parts that circ cannot read, next to the one that is used.",
        "Nothing, as long as it is not used.",
    )
    .shown("unused\nv1 a 0 1\nr1 a 0 1k\n.subckt part p n\n?1 p n\n.ends\n.tran 1m 5m\n"),
];
