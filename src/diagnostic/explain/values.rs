//! Codes of values: of elements, sources, models, analyses.

use super::Explanation;

pub(super) const CODES: [Explanation; 30] = [
    Explanation::of(
        "bad-ac",
        "The frequencies of `.ac`, or an AC value of a source, make no analysis.",
        "The kind (`dec`, `oct`, `lin`), the number of points or a frequency is missing, or a frequency is not positive.",
        "Write `.ac dec 20 10 1meg`.",
    )
    .shown("no stop\nv1 a 0 dc 1 ac 1\nr1 a 0 1k\n.ac dec 20 10\n.tran 1m 5m\n"),
    Explanation::of(
        "bad-call",
        "A function has too many or too few arguments.",
        "A function of another simulator with the same name, or a comma too many.",
        "Give as many as the message says.",
    )
    .shown("one of two\nv1 a 0 {pow(2)}\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "bad-four",
        "The frequency of `.four`, or its number of harmonics, is out of range.",
        "The frequency is 0 or negative: it is the first number on the card.",
        "Write `.four 50 v(out)`.",
    )
    .shown("no frequency\nv1 a 0 sin(0 1 50)\nr1 a 0 1k\n.four 0 v(a)\n.tran 1m 40m\n"),
    Explanation::of(
        "bad-meas",
        "A `.meas` card asks for what cannot be measured; the run goes on without it.",
        "An unknown kind of measurement, or a signal where a number is needed.",
        "Kinds are AVG, RMS, MIN, MAX, PP, INTEG, FIND, DERIV, WHEN, TRIG … TARG and PARAM; docs/netlist.md has their forms.",
    )
    .shown("average\nv1 a 0 1\nr1 a 0 1k\n.meas tran m average v(a)\n.tran 1m 5m\n"),
    Explanation::of(
        "bad-poly",
        "POLY of a controlled source names no whole number of dimensions.",
        "POLY without its number, `POLY a 0 …`.",
        "Write `E1 b 0 POLY(1) a 0 0 1`.",
    )
    .shown("half a dimension\nv1 a 0 1\ne1 b 0 poly(0.5) a 0 0 1\nr1 b 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "bad-sweep",
        "The values of `.step` or `.dc` make no sweep, or their target has no value.",
        "A step of 0 or of the wrong sign, or a logarithmic sweep from 0.",
        "Write `.step param r 1k 5k 1k`, or `.step param r list 1k 2k 5k`.",
    )
    .shown("step 0\n.param r=1k\nv1 a 0 1\nr1 a 0 {r}\n.step param r 1k 5k 0\n.tran 1m 5m\n"),
    Explanation::of(
        "bad-table",
        "A table has no pairs of numbers, or its x values decrease.",
        "A number was forgotten, or two points are in the wrong order.",
        "Write `(x,y)` pairs with x not decreasing; equal x make a jump.",
    )
    .shown("backwards\nv1 a 0 1\nb1 b 0 v={table(v(a),1,0,0,1)}\nr1 b 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "bad-tran",
        "The times of `.tran` make no run.",
        "The stop time is not after the start time, or a time is negative: the order is `tstep tstop tstart tmax`.",
        "Write `.tran tstep tstop`.",
    )
    .shown("nothing to simulate\nv1 a 0 1\nr1 a 0 1k\n.tran 1m 5m 9m\n"),
    Explanation::of(
        "bad-value",
        "A value is outside what it can be, or is no number.",
        "A negative resistance of a switch, a division by zero in an expression, a waveform with negative times.",
        "Correct the value at the place of the message; of an expression, look at the parameters in it.",
    )
    .shown("division by zero\n.param x=0\nv1 a 0 {1/x}\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "coupling",
        "A coupling names what is no inductor, is larger than 1, or contradicts another.",
        "The coefficient in percent, a pair that is coupled twice, or three windings whose coefficients exclude one another.",
        "Keep |k| at or below 1 and couple each pair once; k = 1 throughout is an ideal transformer.",
    )
    .shown("percent\nv1 a 0 1\nr1 a b 1\nl1 b 0 1m\nl2 c 0 1m\nr2 c 0 1\nk1 l1 l2 99\n.tran 1m 5m\n"),
    Explanation::of(
        "device-at-once",
        "Delays, rise times and capacitances of `A` devices are taken as 0: they act at the exact time of the event.",
        "`Td`, `Trise`, `Tfall`, `Tau` and `Cout` of LTspice's gates and flip-flops.",
        "Nothing, where edges may be steep; else a resistor and a capacitor at the output make the slope.",
    )
    .shown("a gate\nv1 a 0 pulse(0 1 0 1u 1u 1m 2m)\na1 a 0 0 0 0 0 q 0 buf td=10n\nr1 q 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "diode-curve",
        "Parameters of a diode model that bend its curve are left out.",
        "IKF (high injection) or ISR (recombination) of a full model.",
        "Nothing, at ordinary currents; `circ compare` shows the difference to ngspice.",
    )
    .shown("high injection\nv1 a 0 1\nr1 a b 1k\nd1 b 0 m\n.model m d(is=1e-12 ikf=20m)\n.tran 1m 5m\n"),
    Explanation::of(
        "ic-without-uic",
        "`IC=` of an element has no effect, as the run starts from the operating point.",
        "`uic` is missing on `.tran`.",
        "Add `uic`, or set node voltages and inductor currents with `.ic`.",
    )
    .shown("ic\nv1 a 0 1\nr1 a b 1k\nc1 b 0 1u ic=5\n.tran 1m 5m\n"),
    Explanation::of(
        "negative-value",
        "A capacitance, an inductance or the forward voltage of a diode is negative.",
        "A sign that does not belong there. What such an element stores or drops is below nothing: a circuit around it may run away.",
        "Take the sign out, unless the element is one of an equivalent circuit that needs it.",
    )
    .shown("below nothing\nv1 a 0 1\nr1 a b 1k\nc1 b 0 -1u\n.tran 10u 1m\n"),
    Explanation::of(
        "no-value",
        "A source has no value, and is 0.",
        "An ammeter, which is a voltage source of 0, or a forgotten value.",
        "Write `dc 0` to say that it is meant.",
    )
    .shown("ammeter\nv1 a 0 1\nvm a b\nr1 b 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "not-linear",
        "An expression is not piecewise linear in voltages and currents.",
        "A product of two voltages, a power, a sine of a voltage.",
        "Sums with constant factors, max, min, abs, limit, table and comparisons are simulated: approximate the rest by `table(x, x1,y1, …)`.",
    )
    .shown("a square\nv1 a 0 1\nr1 a b 1k\nc1 b 0 1u\nb1 c 0 v={v(b)*v(b)}\nr2 c 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "out-of-range",
        "The values of the circuit are too far apart for the numbers of the computer.",
        "A unit forgotten or written twice: `1e-200`, or picofarads across megavolts.",
        "Correct the values, or leave out what is as good as a short or an open branch.",
    )
    .shown("far apart\nv1 a 0 1\nr1 a b 1e-200\nc1 b 0 1e-200\n.tran 1u 1m\n"),
    Explanation::of(
        "pulse-overfull",
        "Rise, width and fall of a PULSE are together longer than its period; the next period cuts it off.",
        "A width that was meant to include the edges, or a period in the wrong unit.",
        "Make the width shorter: TR + PW + TF ≤ PER.",
    )
    .shown("overfull\nv1 a 0 pulse(0 1 0 1m 1m 5m 5m)\nr1 a 0 1k\n.tran 1m 20m\n"),
    Explanation::of(
        "pulse-width-zero",
        "A PULSE with a width of 0 falls as soon as it has risen.",
        "0 was written for \"not given\"; some versions of ngspice then take the stop time.",
        "Leave the last two values out for a single step.",
    )
    .shown("no width\nv1 a 0 pulse(0 1 0 1u 1u 0 5m)\nr1 a 0 1k\n.tran 1m 20m\n"),
    Explanation::of(
        "pwl-backwards",
        "The times of a PWL decrease.",
        "A point in the wrong place, or a unit forgotten (`1 0 2m 1`).",
        "Put the points in order of time; two of equal time make a jump.",
    )
    .shown("backwards\nv1 a 0 pwl(0 0 2m 1 1m 0)\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "pwl-odd",
        "A PWL has a time without a value.",
        "A number was forgotten.",
        "Write pairs of time and value.",
    )
    .shown("odd\nv1 a 0 pwl(0 0 1m 1 2m)\nr1 a 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "random",
        "A function that draws random values, `mc flat gauss agauss unif aunif limit`, gives its mean.",
        "The command makes one run, of the nominal circuit.",
        "`circ sweep FILE --mc 1000` draws 1000 samples, `--sample 3` one of them; every run of a `.step` draws anew.",
    )
    .shown("a spread of 5 %\nv1 a 0 1\nr1 a 0 {mc(1k, 0.05)}\n.tran 1m 5m\n"),
    Explanation::of(
        "ron-above-roff",
        "A switch or diode of this model conducts better off than on.",
        "Ron and Roff are exchanged, or one of them has the wrong suffix: `1M` is a thousandth.",
        "Exchange the two. A switch that opens when its control rises is better made by a negated control.",
    )
    .shown("exchanged\nv1 a 0 1\nvg g 0 pulse(0 1 0 1u 1u 5u 10u)\ns1 a b g 0 m\nr1 b 0 1k\n.model m sw(ron=1meg roff=1m vt=0.5)\n.tran 1u 50u\n"),
    Explanation::of(
        "smooth-switch",
        "A negative Vh is LTspice's switch with a smooth transition; here its conductance changes in steps.",
        "A model of a switch written for LTspice.",
        "Nothing, if what happens within the transition does not matter; a positive Vh is a hysteresis.",
    )
    .shown("smooth\nv1 a 0 5\ns1 a b a 0 ms\nr1 b 0 1k\n.model ms sw(vt=2 vh=-0.5 ron=1m roff=1meg)\n.tran 1m 5m\n"),
    Explanation::of(
        "switch-levels",
        "A model of a switch of one kind has the levels of the other and is read as that.",
        "PSpice's switches have Von and Voff, others Vt and Vh.",
        "Name the kind that the parameters belong to: `vswitch` for Von and Voff.",
    )
    .shown("levels\nv1 a 0 5\ns1 a b a 0 ms\nr1 b 0 1k\n.model ms sw(von=3 voff=2 ron=1 roff=1meg)\n.tran 1m 5m\n"),
    Explanation::of(
        "time",
        "An expression that is a value of the circuit uses the time.",
        "Elements that change with time, `r1 a 0 {1k+time}`, or a source written as a function of `time`.",
        "Write a source as SIN, PULSE, PWL or EXP; a resistance that changes is a switch.",
    )
    .shown("a resistance in time\nv1 a 0 1\nr1 a 0 {1k*time}\n.tran 1m 5m\n"),
    Explanation::of(
        "transistor-as-switch",
        "A MOSFET, JFET or IGBT is simulated as a switch with an on-resistance and its body diode.",
        "circ simulates switching circuits: saturation, charge and speed of the transistor are left out.",
        "Nothing for converters whose transistors are on or off, but for their losses: reverse current flows in the body diode, without drop unless the model says `Vfwd=0.7`. Elsewhere another simulator is the right one.",
    )
    .shown("switch\nv1 d 0 10\nv2 g 0 5\nr1 d a 10\nm1 a g 0 0 nm\n.model nm nmos(vto=1 kp=1)\n.tran 1m 5m\n"),
    Explanation::of(
        "transistor-ebers-moll",
        "A bipolar transistor is simulated by the equations of Ebers and Moll.",
        "Early effect, high injection and charge of the full model are left out.",
        "Nothing, where these do not matter; `circ compare` shows the difference to ngspice.",
    )
    .shown("npn\nv1 c 0 10\nv2 b 0 0.6\nr1 c a 1k\nq1 a b 0 nq\n.model nq npn(is=1e-15 bf=100)\n.tran 1m 5m\n"),
    Explanation::of(
        "unsupported-element",
        "An element of SPICE that circ does not simulate.",
        "Uniform RC lines, coupled lines and the like.",
        "Put elements in its place that docs/netlist.md lists.",
    )
    .shown("rc line\nv1 a 0 1\nu1 a b 0 um l=1\nr1 b 0 1k\n.tran 1m 5m\n"),
    Explanation::of(
        "unsupported-model",
        "A model has a level whose equations are not simulated.",
        "BSIM and other models of integrated circuits, HICUM and VBIC of bipolar ones.",
        "Add `Ron=` to a MOSFET's model, put a switch in its place, or find a model of level 1.",
    )
    .shown("bsim\nv1 a 0 1\nr1 a b 1\nm1 b a 0 0 nm\n.model nm nmos(level=14)\n.tran 1m 5m\n"),
];
