#!/usr/bin/env python3
"""The periodic steady state and the small-signal response of an open-loop buck by circ and by Pulsim, in one process: CPU time of a call with its set-up.

    pip install ./python pulsim && tests/reference/periodic.py

A call begins with the text of the netlist (circ) or an empty circuit (Pulsim) and ends with arrays; the least and the median of RUNS calls in turn. The first
call of a fresh process, which finds neither code nor data in the caches, stands beside it, its package loaded before. The load is 5 ohms, as Pulsim finds no
orbit for the 20 ohms of the netlist, with which the current is interrupted.
"""

import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

RUNS = 100
# Of shorter steps Pulsim says that the orbit drifts.
PERIOD, STEP = 1e-5, 5e-8
LIGHT = (Path(__file__).resolve().parents[2] / "netlists" / "buck-open-loop.cir").read_text()
LOADED = LIGHT.replace("rload out 0 20", "rload out 0 5")
AC = LOADED.replace("vin in 0 24", "vin in 0 dc 24 ac 1")
MANY, FEW = np.logspace(1, 6, 200), np.logspace(1, 4.6, 60)


def circ_orbit(text=LOADED):
    import circ

    return float(np.hypot(*circ.parse(text).pss().pss["multipliers"][0]))


def circ_response():
    import circ

    return abs(circ.parse(AC).ac(MANY)["v(out)"][0])


def buck():
    import pulsim

    b = pulsim.CircuitBuilder()
    b.add_voltage_source("vin", "in", "0", 24.0)
    b.add_switch("s1", "in", "sw", 200.0, 1e-7)
    b.add_diode("d1", "0", "sw", 1e6, 1e-9)
    b.add_inductor("l1", "sw", "out", 47e-6)
    b.add_capacitor("c1", "out", "0", 100e-6)
    b.add_resistor("rload", "out", "0", 5.0)
    return b


def gate(duty):
    import pulsim

    return pulsim.make_pwm_switch_fn(1 / PERIOD, duty, 0, 2)


def pulsim_orbit():
    import pulsim

    b = buck()
    return pulsim.steady_state(b, period=PERIOD, dt=STEP, switch_fn=gate(0.4)).floquet_radius


def pulsim_response():
    import pulsim

    found = pulsim.frequency_response(buck(), period=PERIOD, dt=STEP, switch_fn_of=gate, output="out", frequencies=FEW, u0=0.4)
    return abs(found.H[0])


CALLS = {
    "circ: orbit, 20 ohms": lambda: circ_orbit(LIGHT),
    "circ: orbit": circ_orbit,
    f"circ: orbit and {len(MANY)} frequencies": circ_response,
    "Pulsim: orbit (`steady_state`, 200 steps a period)": pulsim_orbit,
    f"Pulsim: orbit and {len(FEW)} frequencies (`frequency_response`)": pulsim_response,
}


def seconds(call):
    begin = time.process_time()
    value = call()
    return time.process_time() - begin, value


def main():
    if len(sys.argv) > 1:
        __import__("circ" if sys.argv[1].startswith("circ") else "pulsim")
        print(seconds(CALLS[sys.argv[1]])[0])
        return
    print("| call | least | median | first | largest multiplier, or gain at 10 Hz |\n|---|---|---|---|---|")
    times, results = {name: [] for name in CALLS}, {}
    for run in range(RUNS):
        for name, call in CALLS.items():
            # Of what takes so long a tenth of the calls will do.
            if name.startswith("circ") or run % 10 == 0:
                spent, results[name] = seconds(call)
                times[name].append(spent)
    for name, all_times in times.items():
        first = [float(subprocess.check_output([sys.executable, __file__, name])) for _ in range(5)]
        shown = [f"{1e3 * t:.2f} ms" for t in (min(all_times), statistics.median(all_times), statistics.median(first))]
        print(f"| {name} | {' | '.join(shown)} | {results[name]:.6g} |")


if __name__ == "__main__":
    main()
