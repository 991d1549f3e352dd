//! The mistakes.

pub(crate) struct Case {
    pub(crate) title: &'static str,
    pub(crate) file: &'static str,
    pub(crate) netlist: &'static str,
    /// Without `circ`.
    pub(crate) command: &'static str,
    pub(crate) status: i32,
    /// What is named, where there is no place in a file.
    pub(crate) named: Option<&'static str>,
    /// Words of what is to do.
    pub(crate) remedy: &'static str,
}

const fn case(
    title: &'static str,
    (file, netlist): (&'static str, &'static str),
    (command, status): (&'static str, i32),
    remedy: &'static str,
) -> Case {
    Case {
        title,
        file,
        netlist,
        command,
        status,
        named: None,
        remedy,
    }
}

const fn naming(named: &'static str, mut case: Case) -> Case {
    case.named = Some(named);
    case
}

pub(crate) const NETLIST: [Case; 15] = [
    case(
        "A value with a decimal comma",
        (
            "rc.cir",
            "low-pass\nv1 in 0 1\nr1 in out 4,7k\nc1 out 0 1u\n.tran 1m 20m\n",
        ),
        ("rc.cir", 2),
        "write `4.7k`",
    ),
    case(
        "A forgotten value",
        (
            "rc.cir",
            "low-pass\nv1 in 0 1\nr1 in out\nc1 out 0 1u\n.tran 1m 20m\n",
        ),
        ("rc.cir", 2),
        "write `r1 in out VALUE`",
    ),
    case(
        "A unit apart from its number",
        (
            "rc.cir",
            "low-pass\nv1 in 0 1\nr1 in out 10 kohm\nc1 out 0 1u\n.tran 1m 20m\n",
        ),
        ("rc.cir", 2),
        "directly after the number",
    ),
    case(
        "Megohms written as M",
        (
            "rc.cir",
            "low-pass\nv1 in 0 1\nr1 in out 1M\nc1 out 0 1u\n.tran 1m 20m\n",
        ),
        ("rc.cir -o out.csv", 0),
        "write `1Meg`",
    ),
    case(
        "A farad written as F",
        (
            "rc.cir",
            "low-pass\nv1 in 0 1\nr1 in out 1k\nc1 out 0 1F\n.tran 1m 20m\n",
        ),
        ("rc.cir -o out.csv", 0),
        "write `1`",
    ),
    case(
        "No title line",
        (
            "rc.cir",
            "v1 in 0 1\nr1 in out 1k\nc1 out 0 1u\n.tran 1m 20m\n",
        ),
        ("check rc.cir", 0),
        "put a title line above it",
    ),
    case(
        "A model that is nowhere defined",
        (
            "clamp.cir",
            "clamp\nv1 in 0 sin(0 5 50)\nr1 in out 1k\nd1 out 0 1n4148\n.tran 1m 20m\n",
        ),
        ("clamp.cir", 2),
        "add `.model 1n4148",
    ),
    case(
        "A slip in the name of a model",
        (
            "clamp.cir",
            "clamp\nv1 in 0 sin(0 5 50)\nr1 in out 1k\nd1 out 0 idael\n.model ideal d(ideal)\n.tran 1m 20m\n",
        ),
        ("clamp.cir", 2),
        "did you mean `ideal`?",
    ),
    case(
        "A library that is not there",
        (
            "buck.cir",
            "driver\n.include parts/driver.lib\nv1 in 0 12\nx1 in out driver\nr1 out 0 10\n.tran 1u 1m\n",
        ),
        ("buck.cir", 2),
        "--lib DIR",
    ),
    case(
        "Too few nodes at a subcircuit",
        (
            "half.cir",
            "divider\nv1 in 0 10\nx1 in 0 half\n.subckt half a b c\nr1 a b 1k\nr2 b c 1k\n.ends\n.tran 1m 5m\n",
        ),
        ("half.cir", 2),
        "the nodes of `half` are: a b c",
    ),
    case(
        "Two elements of one name",
        (
            "rc.cir",
            "low-pass\nv1 in 0 1\nr1 in out 1k\nr1 out 0 1k\n.tran 1m 20m\n",
        ),
        ("rc.cir", 2),
        "rename",
    ),
    case(
        "A parameter that is not defined",
        (
            "rc.cir",
            "low-pass\n.param rload=1k\nv1 in 0 1\nr1 in 0 {rlaod}\n.tran 1m 20m\n",
        ),
        ("rc.cir", 2),
        "did you mean `rload`?",
    ),
    case(
        "A parenthesis that is never closed",
        (
            "rc.cir",
            "low-pass\nv1 in 0 sin(0 1 50\nr1 in 0 {2*(1k+1)\n.tran 1m 20m\n",
        ),
        ("rc.cir", 2),
        "close it on this card",
    ),
    case(
        "Times of a PWL that go back",
        (
            "pwl.cir",
            "steps\nv1 in 0 pwl(0 0 2m 1 1m 2)\nr1 in 0 1k\n.tran 1m 20m\n",
        ),
        ("pwl.cir", 2),
        "order",
    ),
    case(
        "A product of two voltages",
        (
            "mul.cir",
            "multiplier\nv1 a 0 1\nr1 a b 1k\nc1 b 0 1u\nb1 out 0 v={v(b)*v(b)}\nr2 out 0 1k\n.tran 1m 5m\n",
        ),
        ("mul.cir", 2),
        "are supported",
    ),
];

pub(crate) const CIRCUIT: [Case; 8] = [
    case(
        "No ground",
        (
            "rc.cir",
            "floating\nv1 in com 1\nr1 in out 1k\nc1 out com 1u\n.tran 1m 20m\n",
        ),
        ("rc.cir", 2),
        "call one node `0`",
    ),
    case(
        "Two voltage sources in parallel",
        (
            "pair.cir",
            "two batteries\nv1 a 0 12\nv2 a 0 12.6\nr1 a 0 10\n.tran 1m 20m\n",
        ),
        ("pair.cir", 2),
        "resist",
    ),
    case(
        "A current source without a way back",
        (
            "open.cir",
            "open\ni1 0 a 1\nr1 b 0 1k\nv1 b 0 1\n.tran 1m 20m\n",
        ),
        ("open.cir", 2),
        "gives it a",
    ),
    case(
        "A switch that shorts a source",
        (
            "short.cir",
            "crowbar\nv1 a 0 12\nvg g 0 pulse(0 5 1m 0 0 1m 2m)\ns1 a 0 g 0 sw1\nrg g 0 1k\n.model sw1 sw(vt=2.5 ron=0)\n.tran 0.5m 4m\n",
        ),
        ("short.cir", 2),
        "limits its current",
    ),
    case(
        "An inductor across a voltage source",
        ("coil.cir", "coil\nv1 a 0 1\nl1 a 0 1m\n.tran 1m 5m\n"),
        ("coil.cir", 2),
        "`uic` on `.tran`",
    ),
    case(
        "A current that meets a blocking diode",
        (
            "block.cir",
            "blocked\ni1 0 a pwl(0 -1 2m 1)\nd1 0 a di\n.model di d(ideal)\n.tran 0.5m 2m\n",
        ),
        ("block.cir -o out.csv", 2),
        "a resistor across the device",
    ),
    case(
        "A switch at its threshold",
        (
            "rest.cir",
            "chopper\nv1 in 0 12\nvg g 0 pulse(0 5 0 0 0 1m 2m)\ns1 in out g 0 sw1\nr1 out 0 10\nrg g 0 1k\n.model sw1 sw(ron=1m)\n.tran 0.5m 4m\n",
        ),
        ("rest.cir -o out.csv", 0),
        "a threshold between the levels",
    ),
    case(
        "A slip in the name of a node",
        (
            "rc.cir",
            "low-pass\nv1 in 0 1\nr1 in out 1k\nc1 outt 0 1u\nr2 out 0 1k\n.tran 1m 20m\n",
        ),
        ("rc.cir -o out.csv", 0),
        "did you mean node `out`?",
    ),
];

pub(crate) const RUN: [Case; 8] = [
    case(
        "No analysis",
        ("rc.cir", "low-pass\nv1 in 0 1\nr1 in 0 1k\n"),
        ("rc.cir", 2),
        "add `.tran tstep tstop`",
    ),
    naming(
        "v(ot)",
        case(
            "A probe that is not in the circuit",
            (
                "rc.cir",
                "low-pass\nv1 in 0 1\nr1 in out 1k\nc1 out 0 1u\n.tran 1m 20m\n",
            ),
            ("rc.cir --probe v(ot)", 2),
            "did you mean `v(out)`?",
        ),
    ),
    naming(
        "out.xlsx",
        case(
            "An ending that is no format",
            (
                "rc.cir",
                "low-pass\nv1 in 0 1\nr1 in out 1k\nc1 out 0 1u\n.tran 1m 20m\n",
            ),
            ("rc.cir -o out.xlsx", 2),
            "csv, raw, npz, json, svg, png or html",
        ),
    ),
    naming(
        "rlaod",
        case(
            "A parameter that the netlist does not have",
            (
                "rc.cir",
                "low-pass\n.param rload=1k\nv1 in 0 1\nr1 in 0 {rload}\n.tran 1m 20m\n",
            ),
            ("rc.cir --param rlaod=2k", 2),
            "did you mean `rload`?",
        ),
    ),
    case(
        "Initial conditions without uic",
        (
            "rc.cir",
            "low-pass\nv1 in 0 1\nr1 in out 1k\nc1 out 0 1u ic=5\n.tran 1m 20m\n",
        ),
        ("rc.cir -o out.csv", 0),
        "add `uic` to `.tran`",
    ),
    case(
        "A current that is interrupted",
        (
            "coil.cir",
            "coil without a freewheeling diode\nv1 in 0 12\nl1 in a 1m\nr1 a b 10\ns1 b 0 g 0 sw1\nvg g 0 pulse(5 0 1m 0 0 1m 2m)\n.model sw1 sw(ideal vt=2.5)\n.tran 0.1m 4m\n",
        ),
        ("coil.cir -o out.csv", 0),
        "a freewheeling diode",
    ),
    case(
        "A print step longer than a period",
        (
            "sine.cir",
            "sine\nv1 in 0 sin(0 1 10k)\nr1 in 0 1k\n.tran 1m 20m\n",
        ),
        ("sine.cir -o out.csv", 0),
        "in `.tran` does",
    ),
    naming(
        "cr.cir",
        case(
            "A file that is not there",
            ("rc.cir", "low-pass\nv1 in 0 1\nr1 in 0 1k\n.tran 1m 20m\n"),
            ("sim cr.cir", 2),
            "did you mean `rc.cir`?",
        ),
    ),
];
