//! Codes of runs: why one ended, and of the program itself.

use super::Explanation;

pub(super) const CODES: [Explanation; 19] = [
    Explanation::of(
        "events-accumulate",
        "Switching follows switching ever faster, and time does not go on.",
        "A comparator or relay without hysteresis that undoes its own cause at once.",
        "Hysteresis (`Vh`), or a small resistance or capacitance where it switches; `--method theta` steps over it.",
    ),
    Explanation::of(
        "failure",
        "The command could not be carried out.",
        "A file that cannot be written, or an option that does not fit the netlist.",
        "The message says which.",
    )
    .shown_by("sim --probe v(nowhere)", "no such node\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m\n"),
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
        "no-derivative",
        "A measurement has no derivative at these values.",
        "Two events happen at one instant, or a diode just touches conduction: to either side the derivative is another one.",
        "Take other values of the elements named, so that the events part.",
    ),
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
        "`circ sim` shows where the transient goes; `--period` names the period if the sources do not tell it.",
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
        "overflow",
        "The solution grows beyond the numbers of the computer.",
        "A negative resistance, or a feedback loop of the wrong sign.",
        "Look at the sign of controlled sources; the rows until then show what grows.",
    )
    .shown("it grows\ng1 0 a a 0 1\nc1 a 0 1n ic=1\n.tran 1u 1m uic\n"),
    Explanation::of(
        "rows-too-dense",
        "The print step is so short that two times are one number.",
        "A print step in the wrong unit.",
        "A longer `tstep` on `.tran`.",
    )
    .shown("femto\nv1 a 0 1\nr1 a 0 1\n.tran 1f 1000\n"),
    Explanation::of(
        "run",
        "A note or a warning of a run that was made.",
        "A print step too long for what happens, charge that is lost in a jump, exact integration that had to end.",
        "The message says what it means for the results; `-v` tells more of the run.",
    )
    .shown("a print step of half a period\nv1 a 0 sin(0 1 50)\nr1 a 0 1k\n.tran 10m 100m\n"),
    Explanation::of(
        "step-too-small",
        "The error cannot be kept within the tolerance however short the step.",
        "A curve that is as good as a corner, or a tolerance below what numbers hold.",
        "A larger `--tol`, a fixed `--step`, or `--diodes ideal`.",
    ),
    Explanation::of(
        "switches-do-not-settle",
        "Every position of the switches asks for another one.",
        "A controller that regulates by switching has no operating point from which to start; or a switch takes away its own control, without hysteresis.",
        "`uic` on `.tran` starts from initial values; hysteresis (`Vh` in the model), or a resistor and a capacitor in front of the control, lets a switch settle.",
    )
    .shown("takes away its control\nv1 in 0 1\ns1 in out 0 out sm\nr1 out 0 1k\n.model sm sw(vt=-0.5)\n.tran 1u 1m\n"),
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
];
