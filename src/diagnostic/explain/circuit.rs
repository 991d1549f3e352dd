//! Codes of circuits: ground, loops, cut-sets, islands.

use super::Explanation;

pub(super) const CODES: [Explanation; 19] = [
    Explanation::of(
        "capacitor-loop",
        "Capacitors and voltage sources form a loop: their voltages are not independent of each other.",
        "Capacitors in parallel with a source, or in a delta.",
        "Nothing: the loop is solved exactly, and charges that jump are reported. A resistor in the loop gives each its own voltage.",
    )
    .shown_by("check", "loop\nv1 a 0 1\nc1 a 0 1u\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "contradiction",
        "A device has neither its voltage nor its current left to it by the circuit.",
        "A diode or switch in a loop of voltage sources and in a cut-set of current sources at once.",
        "A small resistor in series, or a large one across it, leaves it one of the two.",
    ),
    Explanation::of(
        "current-cutset",
        "The current of a source has no way back.",
        "A current source at an open end, or in series with an inductor, a capacitor, a switch that opens or another current source.",
        "A resistor across the source, or `Roff` in the model of the switch or diode that opens, gives it a path.",
    )
    .shown("no way back\ni1 0 a 1\nr1 b 0 1k\n.tran 1m 5m uic\n"),
    Explanation::of(
        "dangling",
        "A node has one element only, so that no current flows there.",
        "A slip in the name of a node, or an output that nothing loads.",
        "Compare the name with those of its neighbours; an open output needs nothing.",
    )
    .shown("slip\nv1 in 0 1\nr1 in out 1k\nr2 outt 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "feedthrough",
        "A rate of change stands where a value is needed: the circuit is no system of this form.",
        "A controlled source that takes the current of a capacitor, or the voltage of an inductor, back into a device.",
        "A small resistance in series with the capacitor, or a large one across the inductor, separates them.",
    ),
    Explanation::of(
        "gmin",
        "A part of the circuit is connected with the rest by exponential junctions alone; these have a small conductance beside them, as in ngspice.",
        "A bridge behind a floating winding or an inductance, the middle of diodes in series: where all block, rounding would decide the voltage there.",
        "Nothing, or a resistor from that part to the rest; `.options gmin=` sets the conductance, 0 leaves it out.",
    )
    .shown("in series\nv1 a 0 sin(0 1 50)\nd1 a b d\nd2 b c d\nr1 c 0 1k\n.model d d\n.tran 1m 40m\n"),
    Explanation::of(
        "inductor-cutset",
        "Inductors and current sources meet in a node: their currents are not independent of each other.",
        "Inductors in series without anything between them, or in a star.",
        "Nothing: it is solved exactly, and fluxes that jump are reported. A resistor at the node gives each its own current.",
    )
    .shown_by("check", "series\nv1 a 0 sin(0 1 50)\nl1 a b 1m\nl2 b c 1m\nr1 c 0 1\n.tran 1m 40m\n"),
    Explanation::of(
        "island",
        "A part of the circuit has no connection to ground; its potentials count from its first node.",
        "The secondary side of a transformer.",
        "Nothing for a circuit that is meant to be isolated; else connect it to node 0, or by a large resistor.",
    )
    .shown_by("check", "isolated\nv1 a 0 sin(0 1 50)\nl1 a 0 1m\nl2 b c 1m\nr1 b c 1\nk1 l1 l2 0.9\n.tran 1m 40m\n"),
    Explanation::of(
        "never-switches",
        "The sources that control a switch never pass its threshold.",
        "A gate of 0 to 5 V with a threshold of 10, or volts in one place and percents in the other.",
        "Change the levels of the source, or `Vt`, `Von` or `Vto` in the model of the switch.",
    )
    .shown("a gate that is too low\nv1 in 0 1\nvc c 0 pulse(0 5 0 0 0 1m 2m)\ns1 in out c 0 sm\nr1 out 0 1k\n.model sm sw(ron=1 vt=10)\n.tran 1m 4m\n"),
    Explanation::of(
        "no-analysis",
        "The netlist does not say what to simulate.",
        "`.tran` is missing, or stands in a `.control` that does not run it.",
        "Add `.tran tstep tstop`.",
    )
    .shown("no analysis\nv1 a 0 1\nr1 a 0 1k\n.end\n"),
    Explanation::of(
        "no-elements",
        "The netlist has no elements.",
        "All cards stand in subcircuits that nothing calls, or the circuit is in the title line.",
        "Add the `X` card that calls the subcircuit, or a title line.",
    )
    .shown("no elements\n.tran 1m 5m\n"),
    Explanation::of(
        "no-ground",
        "No element is connected to node 0.",
        "The ground symbol was left out of the schematic, or the ground is called otherwise.",
        "Call one node `0` or `gnd`.",
    )
    .shown("no ground\nv1 a b 1\nr1 a b 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "no-system",
        "The circuit has no system of the form that the command needs.",
        "A contradiction that shows only when the equations are put together.",
        "The message says why; `circ check` names the elements.",
    ),
    Explanation::of(
        "on-threshold",
        "A switch rests exactly on its threshold, where it is neither on nor off by rights.",
        "`Vt` equals a level of the control: 0 by default, which is the low level of most controls.",
        "Set `Vt` between the levels, or give a hysteresis `Vh`.",
    )
    .shown("threshold 0\nv1 in 0 1\nvc c 0 pulse(0 5 0 0 0 1m 2m)\ns1 in out c 0 sm\nr1 out 0 1k\nrc c 0 1k\n.model sm sw(ron=1)\n.tran 1m 4m\n"),
    Explanation::of(
        "self-loop",
        "Both ends of an element are at one node.",
        "A slip in a node, or a wire across a part in the schematic.",
        "Correct the node; on purpose it does no harm.",
    )
    .shown("short\nv1 a 0 1\nr1 a a 1k\nr2 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "singular",
        "Some currents or voltages are not determined by the circuit.",
        "Windings coupled with k = 1, a gain of 1 in a loop, or resistances that add up to 0.",
        "A k below 1, a resistor across one of the elements named, or other values decide.",
    ),
    Explanation::of(
        "source-rate",
        "The circuit needs the rate of change of a source that has none at its edges.",
        "A source with edges of no width across a capacitor whose current controls something.",
        "A small resistance in series with the source, or edges with a width.",
    ),
    Explanation::of(
        "thermal-network",
        "A node of `.thermal` is joined to something that leads no heat.",
        "The heat sink and the circuit share a node other than 0, or an element of the circuit is meant to be a thermal resistance.",
        "Give the network nodes of its own, and only R (K/W), C (J/K), constant V (°C) and I (W) between them.",
    )
    .shown("a heat sink at the output\nv1 a 0 10\nd1 a b dx\nr1 b 0 5\n.model dx d(ideal rthjc=1)\nrh b amb 2\nvamb amb 0 25\n.thermal b d1\n.tran 1m 5m\n"),
    Explanation::of(
        "voltage-loop",
        "Voltage sources form a loop and contradict each other, or a source is shorted.",
        "Two sources between the same nodes, or a switch or diode of no resistance that shorts one.",
        "A small resistor in the loop, or `Ron` in the model of the switch or diode, says who gives way.",
    )
    .shown("two sources\nv1 a 0 1\nv2 a 0 2\nr1 a 0 1k\n.tran 1m 5m\n"),
];
