//! Codes of runs: why one ended, and of the program itself.

use super::Explanation;

pub(super) const CODES: [Explanation; 63] = [
    Explanation::of(
        "about-rest",
        "The response is that about the operating point, as laws are smooth and no switch moves.",
        "A source that repeats, such as a sine, beside exponential diodes or transistors.",
        "Nothing for an amplifier; `--about pss` for a rectifier, whose diodes conduct in turn.",
    ),
    Explanation::of(
        "at-rest",
        "The circuit does not switch periodically: the response is that about its operating point.",
        "`--about pss` of a circuit that comes to rest.",
        "Nothing; `--about op` says the same without a search.",
    ),
    Explanation::of(
        "beyond-tables",
        "A device left the range of its loss tables, which are continued in straight lines.",
        "A voltage, current or temperature beyond those that the data sheet lists.",
        "Add the missing points to the tables of its `.model`, or read its losses as an estimate.",
    ),
    Explanation::of(
        "cancellation",
        "Currents of diodes are subtracted from each other that are so large that nothing is left of their difference.",
        "Diodes without a resistance in series across a source: by their laws they carry currents that no circuit has.",
        "A series resistance: `RS` in the model of the diodes, or that of the source and of its leads.",
    )
    .shown("two diodes across a source\nv1 a 0 sin(0 16 10k)\nd1 a b dm\nd2 b 0 dm\nc1 a b 10n\n.model dm d(is=1n)\n.tran 1u 100u uic\n"),
    Explanation::of(
        "destroyed",
        "A current or charge jumped to another value, and its energy was lost at once.",
        "A switch that opens an inductor's only path, or connects capacitors of different voltages, without a resistance.",
        "Give the current a path (a freewheeling diode, a snubber, `Roff` of the switch), or the charge a resistance (`Ron`), unless the ideal jump is what is meant.",
    )
    .shown("an inductor without a path\nv1 a 0 10\nl1 a b 1m\nr1 b c 10\ns1 c 0 g 0 sm\nvg g 0 pulse(1 0 1m 1n 1n 1 2)\n.model sm sw(ideal vt=0.5)\n.tran 10u 2m\n"),
    Explanation::of(
        "energy",
        "The energies of the run do not add up, or are beyond the range of numbers, so that nothing checks it.",
        "A circuit that grows without bound, or an impulse through a controlled source.",
        "Run it once more with `--verify`, and look at the signs of controlled sources.",
    ),
    Explanation::of(
        "events-accumulate",
        "Switching follows switching ever faster, and time does not go on.",
        "A comparator or relay without hysteresis that undoes its own cause at once.",
        "Hysteresis (`Vh`), or a small resistance or capacitance where it switches; `--method theta` steps over it.",
    ),
    Explanation::of(
        "expression",
        "An analysis that shows signals alone shows those in the expression asked for.",
        "`.save` or `.print` of an expression beside `.ac`, `.dc` or `.op`.",
        "Nothing, or name the signals.",
    )
    .shown("of signals alone\nv1 a 0 dc 1 ac 1\nr1 a b 1k\nr2 b 0 1k\n.save v(a)*2\n.ac dec 1 1 10\n"),
    Explanation::of(
        "floating-start",
        "Nothing says at which voltage a node starts, and 0 V is taken.",
        "A node to which only capacitors lead, so that no direct current fixes its voltage.",
        "Set it with `.ic v(node)=…`, or lead a large resistor from it to ground.",
    )
    .shown("between capacitors\nv1 a 0 1\nc1 a b 1u\nc2 b 0 1u\n.tran 1u 1m\n"),
    Explanation::of(
        "form",
        "What is worth knowing of the run of a nonlinear form, or why it ended.",
        "Such a form is stepped with a step that is halved until the states no longer change.",
        "A smaller `--tol` or a shorter `--step`, if the change named is too large.",
    ),
    Explanation::of(
        "held-source",
        "A source that does not repeat stands still while the periodic steady state is looked for.",
        "A step, a `PWL` without repetition, or a pulse with a period longer than the run.",
        "Nothing if it is a start-up; else give the source a period (`PULSE`, `PWL repeat`).",
    ),
    Explanation::of(
        "ic-not-held",
        "A value of `.ic` is not kept at the start: a source decides it, or no operating point has it.",
        "`.ic` of a node that a voltage source drives, or of a current that the circuit does not allow at rest.",
        "Take the value out, or start from initial conditions alone with `uic` on `.tran`.",
    )
    .shown("a source decides\nv1 a 0 5\nr1 a b 1k\nc1 b 0 1u\n.ic v(a)=3\n.tran 10u 1m\n"),
    Explanation::of(
        "imprecise",
        "The error that the run states for itself is a good part of the amplitudes, in single rows or for good.",
        "Steps that are too long (`--step`, or a large `--tol`), or a transient that no step follows, such as a transistor that interrupts the current of an inductor; of single rows: a diode that turns off between them, a little earlier or later.",
        "A smaller `--step` or `--tol`, and `--verify`; where that changes nothing, a path for the current (a freewheeling diode, a capacitance).",
    ),
    Explanation::of(
        "incomplete",
        "The files hold the rows until the run ended early.",
        "A run that broke off, or a file that could not be written further.",
        "Mend what the error names and run again.",
    ),
    Explanation::of(
        "internal",
        "Something does not hold in circ that always should.",
        "A fault of circ, not of the circuit.",
        "Please report it with the netlist.",
    ),
    Explanation::of(
        "interrupted",
        "The run was ended from outside.",
        "Ctrl-C, or a signal; the rows so far are kept.",
        "Nothing.",
    ),
    Explanation::of(
        "last-periods",
        "Measurements of the periodic steady state see the last periods of `.tran` alone.",
        "A `.tran` that is very long beside the period.",
        "Nothing: all periods of the steady state are the same; or a shorter `.tran`.",
    ),
    Explanation::of(
        "leading-multipliers",
        "Of the multipliers of the orbit the leading ones alone are given, which decide whether it is stable.",
        "The circuit is large: its orbit is found by products with the derivative of a period, which is never written down.",
        "Nothing; a circuit of fewer than 600 capacitors, inductors and ideal pairs has all of them.",
    ),
    Explanation::of(
        "left-out",
        "An analysis, a `.step` or a value was left out.",
        "A netlist asks for more than one command carries out.",
        "Run the command that the message names, or take the card out.",
    )
    .shown("both\nv1 a 0 dc 1 ac 1\nr1 a 0 1k\n.tran 1m 5m\n.op\n"),
    Explanation::of(
        "measured-between-events",
        "Derivatives and values are of what happens between events, where `circ sim` measures the same run on its rows.",
        "A run of many states or very many periods, whose rows cost less than what lies between them.",
        "Nothing; a smaller print step brings the rows of `circ sim` closer to these values.",
    ),
    Explanation::of(
        "measured-on-rows",
        "Measurements see straight lines between the rows of a run that is exact at them.",
        "Steps in it, very many events or periods, or many states: what is between the events would take too long, or too much room.",
        "Measure from later on (`FROM=`), or take a smaller print step, where the part that is told is too large.",
    ),
    Explanation::of(
        "more",
        "There are more findings than are shown.",
        "One fault that shows at every card, such as a missing library.",
        "Mend the first ones and run again.",
    ),
    Explanation::of(
        "netlist",
        "The netlist is no circuit with the values asked for.",
        "A value of a sweep or of `--param` for which a card makes no sense.",
        "The findings above say where.",
    ),
    Explanation::of(
        "next-to-nothing",
        "The steady state is rest but for leakage and rounding, of which no error is stated.",
        "A reference that is held at 0, the value it has before it steps; a circuit whose energy has gone.",
        "Nothing if the rest is meant; for the steady state in operation the reference needs the value that it has there from the start.",
    ),
    Explanation::of(
        "no-derivative",
        "A measurement has no derivative at these values.",
        "Two events happen at one instant, or a diode just touches conduction: to either side the derivative is another one.",
        "Take other values of the elements named, so that the events part.",
    ),
    Explanation::of(
        "no-multipliers",
        "The multipliers of the orbit are not known.",
        "The orbit is made of steps, and differences of runs beside it are noise: they say that disturbances grow in a circuit in which none does.",
        "A smaller `--tol`, or diodes of straight pieces (`ron`, `vfwd`), whose derivatives need no differences.",
    ),
    Explanation::of(
        "no-number",
        "An expression has no value in some rows.",
        "A division by zero, or the root or logarithm of a negative number.",
        "Keep the divisor away from 0, as in `v(a)/max(v(b),1u)`.",
    )
    .shown("a division by zero\nv1 a 0 sin(0 1 1k)\nr1 a 0 1\n.tran 0.1m 1m\n.save 1/v(a)\n"),
    Explanation::of(
        "no-operating-point",
        "The circuit has no state of rest from which the run could start.",
        "A voltage source across inductors alone, a current source into capacitors alone, or devices that exclude each other.",
        "A resistance in series with the inductor or across the capacitor; or `uic` on `.tran`, which starts from initial conditions.",
    )
    .shown("no rest\nv1 a 0 1\nl1 a 0 1m\n.tran 1u 1m\n"),
    Explanation::of(
        "no-orbit",
        "No periodic steady state was found.",
        "The circuit has none (something is charged further every period), or takes too many periods to come to it.",
        "`circ sim` shows where the transient goes; `--period` names the period if the sources do not tell it; `circ op` solves for rest.",
    )
    .shown_by("pss", "a charge that grows\ni1 0 b sin(1 1 1k)\nc1 b 0 1u\n.tran 1u 1m uic\n"),
    Explanation::of(
        "no-solution",
        "No state of the diodes and switches satisfies the circuit: a true contradiction from that instant on.",
        "A current that has no path but through a diode that blocks, or a voltage shorted by one that conducts.",
        "A resistor across the device (`Roff` in its model), or in series with it (`Ron`, `RS`), decides.",
    )
    .shown("impossible\ni1 0 a pwl(0 -1 2m 1)\nd1 0 a di\n.model di d(ideal)\n.tran 0.5m 2m\n"),
    Explanation::of(
        "no-temperatures",
        "The temperatures of the devices were not found; losses are those at ambient temperature.",
        "A thermal network without a path to a fixed temperature.",
        "Lead the heat somewhere: a resistor from the thermal node to a source of the ambient temperature.",
    ),
    Explanation::of(
        "not-balanced",
        "Energies are not computed.",
        "A system or form without a circuit has no powers.",
        "Nothing; run the netlist itself for a balance.",
    ),
    Explanation::of(
        "not-determined",
        "Several devices share a current or voltage in a proportion that the ideal model leaves open.",
        "Ideal diodes or switches in parallel, or in series while they block.",
        "Give them `Ron` (in parallel) or `Roff` (in series) if the share matters.",
    )
    .shown("two in parallel\nv1 a 0 1\nr1 a b 1\nd1 b 0 di\nd2 b 0 di\n.model di d(ideal)\n.tran 0.1m 1m\n"),
    Explanation::of(
        "not-exact",
        "What was asked for is computed from rows or from differences, and not exact.",
        "A run that is made in steps, or signals with impulses.",
        "Piecewise-linear devices (`--diodes ideal`) or a smaller `--tol`.",
    ),
    Explanation::of(
        "not-graded",
        "The exact integrator cannot separate the time constants of the circuit to the accuracy it promises.",
        "Resistances many decades apart, such as `Roff=1e15` beside `Ron=1e-9`.",
        "Leave `Roff` or `Ron` out, which makes the device ideal; or `--method theta`.",
    ),
    Explanation::of(
        "not-solved",
        "The state of the devices at a step was not found to the accuracy required.",
        "Curved diodes in a circuit of very different resistances.",
        "A resistance in series with the device or across it; `--diodes ideal` takes ideal diodes.",
    ),
    Explanation::of(
        "not-straight",
        "The measurement is no straight function of the values within their tolerances.",
        "Tolerances that move an event past another, or a resonance.",
        "Sample with `circ sweep --mc N`, which finds places between the corners.",
    ),
    Explanation::of(
        "not-verified",
        "The second run that `--verify` asks for could not be made; the rows are those of the first.",
        "The other method does not come through the circuit.",
        "Compare with `--method theta --tol 1e-8` of your own, or verify a shorter `.tran`.",
    ),
    Explanation::of(
        "one-sided",
        "An extremum is reached at two times with the same value, and moves otherwise with a value at each: it has no derivative to that value, only one to either side.",
        "Symmetry, such as the peaks of a three-phase rectifier with equal phases.",
        "Measure each peak with `from=` and `to=`; of a maximum the larger of their derivatives holds upwards and the smaller one downwards, of a minimum the other way round.",
    ),
    Explanation::of(
        "orbit-not-unique",
        "The circuit has a family of periodic steady states, of which one is shown.",
        "A charge or current that nothing drives nor damps, such as that of a floating loop of capacitors.",
        "Set it by `.ic`, or add the large resistance that a real circuit has.",
    ),
    Explanation::of(
        "overflow",
        "The solution grows beyond the numbers of the computer.",
        "A negative resistance, or a feedback loop of the wrong sign.",
        "Look at the sign of controlled sources; the rows until then show what grows.",
    )
    .shown("it grows\ng1 0 a a 0 1\nc1 a 0 1n ic=1\n.tran 1u 1m uic\n"),
    Explanation::of(
        "period-off",
        "The period asked for is not quite a multiple of the period of a source.",
        "A period with too few digits, such as `--period 16.67m` for 60 Hz.",
        "Write the period as the source has it, `{1/60}`, or leave `--period` out.",
    ),
    Explanation::of(
        "rests-on-threshold",
        "The steady state is rest, and a switch or a device stands on its threshold in it: a disturbance of one sign is another thing than one of the other sign, and no multiplier says what becomes of both.",
        "A reference that is held at 0, the value it has before it steps, so that a comparator compares equal voltages.",
        "For the steady state in operation the reference needs the value that it has there from the start; of a rest that is meant nothing more is known.",
    ),
    Explanation::of(
        "rival-impulses",
        "Several devices take an impulse at once, and how they share it depends on resistances that the ideal model leaves out.",
        "A switch that connects capacitors while ideal diodes are about to conduct.",
        "Small resistances in series with the devices named decide.",
    ),
    Explanation::of(
        "rounding",
        "Digits are lost to rounding beside values that are decades apart.",
        "An `Roff` or `Ron` far from all other resistances, or a frequency far below the rates of the circuit.",
        "Leave `Roff` or `Ron` out (an ideal device has neither), or take one that is a thousand times closer; `--verify` tells.",
    ),
    Explanation::of(
        "rows-apart",
        "Rows are too far apart for what happens between them.",
        "A print step near the period of a source or of the switching, or ringing between two rows.",
        "Take a print step of a tenth of the period that is named, as in `.tran 10n 1m`.",
    )
    .shown("a print step of half a period\nv1 a 0 sin(0 1 50)\nr1 a 0 1k\n.tran 10m 100m\n"),
    Explanation::of(
        "rows-too-dense",
        "The print step is so short that two times are one number.",
        "A print step in the wrong unit.",
        "A longer `tstep` on `.tran`.",
    )
    .shown("femto\nv1 a 0 1\nr1 a 0 1\n.tran 1f 1000\n"),
    Explanation::of(
        "slides",
        "A switch neither opens nor closes for good: what is shown is the mean of ever faster switching.",
        "A comparator whose output acts on its own input at once.",
        "Give it what a real one has: a delay, or a capacitance in front of it; without these the mean is a choice.",
    ),
    Explanation::of(
        "spike",
        "A signal has a peak of next to no duration.",
        "A switch interrupts an inductor's current, or connects a capacitor, and only `Roff` or `Ron` limits it.",
        "Add the diode, clamp or snubber that the real circuit has; measure means with `.meas` or `--table`.",
    ),
    Explanation::of(
        "squares-of-impulses",
        "A signal of a table has impulses: they are part of its mean, but a root mean square and a distortion of them do not exist.",
        "A capacitor that an ideal switch connects to a source or another capacitor, or an inductor whose current is interrupted.",
        "A resistance in the way (`Ron` in the model) makes a pulse of the impulse.",
    ),
    Explanation::of(
        "steady-start",
        "The run begins at its periodic steady state, or could not.",
        "`steady` on `.tran`.",
        "Nothing; where it was left out `circ pss` says why.",
    )
    .shown("begins there\nv1 a 0 sin(0 1 1k)\nr1 a b 1k\nc1 b 0 1u\n.tran 10u 2m steady\n"),
    Explanation::of(
        "step-too-small",
        "The error cannot be kept within the tolerance however short the step.",
        "A curve that is as good as a corner, or a tolerance below what numbers hold.",
        "A larger `--tol`, a fixed `--step`, or `--diodes ideal`.",
    ),
    Explanation::of(
        "steps-instead",
        "Exact integration could not go on, and steps with a tolerance were made in its place.",
        "A contradiction of ideal devices at an instant, or values that are decades apart.",
        "Look at the devices named: a small `Ron` or a large `Roff` mostly lets exact integration go on; `--method theta` asks for steps from the start.",
    ),
    Explanation::of(
        "stored-energy",
        "A part of the input went into capacitors and inductors, or came out of them, so that the efficiency is that of this span alone.",
        "A table of a transient that has not settled.",
        "`circ pss --table` has the efficiency of the periodic steady state.",
    ),
    Explanation::of(
        "switches-do-not-settle",
        "Every position of the switches asks for another one.",
        "A controller that regulates by switching has no operating point from which to start; or a switch takes away its own control, without hysteresis.",
        "`uic` on `.tran` starts from initial values; hysteresis (`Vh` in the model), or a resistor and a capacitor in front of the control, lets a switch settle.",
    )
    .shown("takes away its control\nv1 in 0 1\ns1 in out 0 out sm\nr1 out 0 1k\n.model sm sw(vt=-0.5)\n.tran 1u 1m\n"),
    Explanation::of(
        "switches-stay",
        "The switches of the circuit that a system was made of do not move in this run.",
        "A system has the matrices of one position of the switches, of which `circ lcs --switch NAME=on` chooses another.",
        "Run the netlist itself where switches are to move.",
    ),
    Explanation::of(
        "tangents",
        "The response is one about an orbit that is made of steps, along which curved laws are taken for their tangents: it is accurate, not exact.",
        "Exponential diodes or transistors in a circuit that switches periodically, or one of 600 capacitors, inductors and ideal pairs and more.",
        "Nothing, if the error told will do; diodes with `Ron` and `Vfwd` in place of `Is` and `N` have responses that are exact.",
    ),
    Explanation::of(
        "thermal-runaway",
        "The losses rise faster with temperature than heat flows away: no temperature is a steady one.",
        "Too large a thermal resistance, or losses that rise steeply with temperature.",
        "A better heat sink (a smaller resistance in the thermal network), or fewer losses.",
    ),
    Explanation::of(
        "too-many-rows",
        "The run would hold more rows than memory is meant for.",
        "A very short print step, with output that needs all rows at once (pictures, npz, `.meas`).",
        "A longer print step, a later start or fewer signals; csv and raw files are written as rows come.",
    )
    .shown("a thousand million rows\nv1 a 0 sin(0 1 50)\nr1 a 0 1\n.tran 1n 100\n.meas tran m avg v(a)\n"),
    Explanation::of(
        "too-many-steps",
        "The run would take more steps than are made.",
        "A fixed step that is tiny beside the run, or a run much longer than its fastest time constant.",
        "A shorter `.tran`, a larger `--tol` or a larger `--step`.",
    ),
    Explanation::of(
        "unstable-orbit",
        "The periodic steady state that is shown is unstable: transients leave it.",
        "A controller past its stability limit, such as peak-current control above half duty without a slope.",
        "`circ sim` shows where it goes; `--order 2` looks for the doubled period; a compensating slope or less gain mends it.",
    ),
    Explanation::of(
        "verified-in-part",
        "The second run that `--verify` asks for was made of the beginning alone.",
        "Oscillations that are short beside the run, which its steps follow one by one.",
        "Verify a shorter `.tran` that begins where it matters (`--from-pss`), or compare with `--method theta --tol 1e-6` of your own.",
    ),
    Explanation::of(
        "wrong-sign",
        "A device conducts or blocks with the wrong sign, by an amount that rounding hides.",
        "An enormous `Roff` or a tiny `Ron` beside it.",
        "Take an `Roff` a thousand times smaller, or leave it out, and compare.",
    ),
];
