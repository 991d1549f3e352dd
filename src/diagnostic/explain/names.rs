//! Codes of names: unknown, taken, of another kind.

use super::Explanation;

pub(super) const CODES: [Explanation; 25] = [
    Explanation::of(
        "circular",
        "Something is defined by itself.",
        "Two parameters or models that are each defined by the other.",
        "Give one of them a value of its own.",
    )
    .shown("a circle\n.param a={b} b={a}\nv1 n 0 {a}\nr1 n 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "duplicate-element",
        "Two elements have one name.",
        "A card was copied and not renamed; `R1` and `r1` are one name.",
        "Rename one of them.",
    )
    .shown("twice r1\nv1 a 0 1\nr1 a 0 1k\nR1 a 0 2k\n.tran 1m 5m\n"),
    Explanation::of(
        "duplicate-measurement",
        "Two `.meas` have one name; both are carried out, and the name means the first in expressions.",
        "A card was copied and not renamed.",
        "Rename one of them.",
    )
    .shown("twice m\nv1 a 0 1\nr1 a 0 1k\n.meas tran m avg v(a)\n.meas tran m rms v(a)\n.tran 1m 5m\n"),
    Explanation::of(
        "duplicate-model",
        "A model is defined twice; the first counts, as in ngspice.",
        "A library is included twice, or brings a model that the netlist has too.",
        "Take one of them out.",
    )
    .shown("twice di\nv1 a 0 1\nd1 a 0 di\n.model di d(ron=1)\n.model di d(ron=2)\n.tran 1m 5m\n"),
    Explanation::of(
        "duplicate-parameter",
        "A parameter is defined twice; the last counts.",
        "A default further up is replaced further down, perhaps by accident.",
        "Take one of them out; `--param NAME=VALUE` replaces a value without a second card.",
    )
    .shown("twice x\n.param x=1\n.param x=2\nv1 a 0 {x}\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "duplicate-subcircuit",
        "A subcircuit is defined twice; the first counts.",
        "A library is included twice.",
        "Take one of them out.",
    )
    .shown("twice part\nv1 a 0 1\nx1 a 0 part\n.subckt part p n\nr1 p n 1\n.ends\n.subckt part p n\nr1 p n 2\n.ends\n.tran 1m 5m\n"),
    Explanation::of(
        "duplicate-tran",
        "There are several `.tran`; the last counts.",
        "A card of an earlier run was left in the netlist.",
        "Take the others out, or begin them with `*`.",
    )
    .shown("twice .tran\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m\n.tran 1m 9m\n"),
    Explanation::of(
        "idle-step",
        "`.step` goes through the values of a parameter that nothing uses: all runs are the same.",
        "The value is written as a number where the parameter is meant, or the name is misspelt.",
        "Write `{name}` in the card whose value is to change.",
    )
    .shown("the same twice\nv1 a 0 1\nr1 a 0 1k\n.param load=1k\n.step param load list 1k 2k\n.tran 1m 5m\n"),
    Explanation::of(
        "not-a-switch",
        "A transistor whose gate is tied to its drain is a diode, and circ simulates transistors as switches.",
        "Diode-connected transistors of integrated circuits.",
        "Put a diode in its place.",
    )
    .shown("diode-connected\nv1 a 0 1\nm1 a a 0 0 nm\n.model nm nmos(vto=1 kp=1)\n.tran 1m 5m\n"),
    Explanation::of(
        "recursive-subcircuit",
        "A subcircuit contains itself, or subcircuits are nested without end.",
        "An `X` card inside a subcircuit calls that subcircuit, directly or through others.",
        "Correct the name of the subcircuit on that card.",
    )
    .shown("itself\nv1 a 0 1\nx1 a 0 part\n.subckt part p n\nx1 p n part\n.ends\n.tran 1m 5m\n"),
    Explanation::of(
        "set",
        "A value cannot be set from a program.",
        "The element has no single value (a diode, a switch), or the value is no number.",
        "Write the value as `{name}` in the netlist and set that parameter.",
    ),
    Explanation::of(
        "sweep",
        "A circuit that was built without a netlist has no `.step`.",
        "A sweep was asked of a circuit made by calls of the library.",
        "Set the values in a loop.",
    ),
    Explanation::of(
        "unknown-element",
        "A card names an element that the circuit does not have, or begins with a letter that is no element's.",
        "A slip of the pen, or a name inside a subcircuit (`x1.r1`).",
        "Correct the name; comments begin with `*`.",
    )
    .shown("no v9\nv1 a 0 1\nf1 0 b v9 2\nr1 a 0 1k\nr2 b 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "unknown-function",
        "An expression calls a function that there is not.",
        "A slip of the pen, or a function of another simulator.",
        "Correct it, or define it with `.func`; docs/netlist.md lists the functions.",
    )
    .shown("sqr\nv1 a 0 {sqr(2)}\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "unknown-model",
        "An element names a model that is nowhere defined.",
        "The library of the part is not included, or its file was not found (a warning above says so).",
        "Add `.model`, or `.include` the file of the part's maker; `--diodes ideal` takes ideal diodes in place of unknown ones.",
    )
    .shown("no model\nv1 a 0 1\nd1 a b d1n4148\nr1 b 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "unknown-name",
        "An analysis was asked for something that the circuit does not have.",
        "A slip in a name on the command line or in a call.",
        "`circ op FILE` lists nodes and elements.",
    ),
    Explanation::of(
        "unknown-node",
        "A card names a node to which nothing is connected.",
        "A slip of the pen, or a node inside a subcircuit (`x1.out`).",
        "Correct the name, or connect something to the node.",
    )
    .shown("no node b\nv1 a 0 1\nr1 a 0 1k\n.ic v(b)=1\n.tran 1m 5m\n"),
    Explanation::of(
        "unknown-parameter",
        "A name in an expression, or of `--param`, is no parameter.",
        "A slip of the pen, a `.param` in a file that was not found, or one inside another subcircuit.",
        "Define it with `.param`, or correct the name.",
    )
    .shown("no parameter\nv1 a 0 {vim}\nr1 a 0 1k\n.param vin=5\n.tran 1m 5m\n"),
    Explanation::of(
        "unknown-probe",
        "`.save`, `.print` or `--probe` names a signal that the circuit does not have.",
        "A slip of the pen, or a signal inside a subcircuit (`v(x1.out)`).",
        "Correct the name; `all` and patterns such as `v(x1.*)` take what there is.",
    )
    .shown("no signal\nv1 a 0 1\nr1 a 0 1k\n.print tran v(aa)\n.tran 1m 5m\n"),
    Explanation::of(
        "unknown-subcircuit",
        "An `X` card names a subcircuit that is nowhere defined.",
        "The library of the part is not included, or its file was not found (a warning above says so).",
        "Add the `.subckt`, or `.include` the file that has it; `--lib DIR` names a folder of such files.",
    )
    .shown("no subcircuit\nv1 a 0 1\nx1 a 0 part\n.tran 1m 5m\n"),
    Explanation::of(
        "unknown-waveform",
        "A source has a waveform that there is not.",
        "A slip of the pen, or a waveform of another simulator.",
        "Waveforms are SIN, PULSE, PWL, EXP, SFFM and AM.",
    )
    .shown("sawtooth\nv1 a 0 saw(0 1 1k)\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "unsupported",
        "Something is recognised and cannot be simulated, or cannot be done with this circuit.",
        "A waveform, multiplier or option that circ does not have.",
        "Take what the message names in its place; docs/netlist.md lists what there is.",
    )
    .shown("noise\nv1 a 0 trnoise(1m 1u 0 0)\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "unused-parameters",
        "Parameters of a model or card have no effect in circ.",
        "Inductances of wires, limits and slopes of a full model, which an ideal device does not have.",
        "Nothing, if what they describe does not matter; docs/netlist.md says what is left out.",
    )
    .shown("wires\nv1 a 0 5\ns1 a b a 0 ms\nr1 b 0 1k\n.model ms sw(vt=2 ron=1 lser=1n)\n.tran 1m 5m\n"),
    Explanation::of(
        "wrong-arity",
        "A subcircuit or device is connected to too many or too few nodes.",
        "A node was forgotten, or the part has another order of pins.",
        "Connect the nodes that the message lists, in that order.",
    )
    .shown("three of two\nv1 a 0 1\nx1 a b 0 part\nr1 b 0 1\n.subckt part p n\nr1 p n 1k\n.ends\n.tran 1m 5m\n"),
    Explanation::of(
        "wrong-model",
        "An element names a model of another kind.",
        "A diode with the model of a switch, or two models of similar names.",
        "Name a model of the kind that the message asks for.",
    )
    .shown("a switch's\nv1 a 0 1\nr1 a b 1k\nd1 b 0 sm\n.model sm sw(vt=1)\n.tran 1m 5m\n"),
];
