#!/usr/bin/env python3
"""Variants of an open-loop buck in one process: what a variant costs by circ, by Pulsim and by ngspice, for the same three measures.

    pip install './python[all]' pulsim spicelib && tests/reference/sweep.py [--circ PATH] [--variants 10000]

A transient of 10 ms at 100 kHz from rest, and of its last millisecond the mean of the output and the peak to peak and RMS values of the inductor's current. circ takes all variants;
Pulsim (steps of a 200th of a period) and ngspice (through spicelib, steps of a 200th at most), measured by numpy, take FEW of them, one after the other. CPU is that
of the process and its children, with set-up; the difference is the largest of a measure to circ's, relative to it. Below the table stand the same number of periodic steady states
with the derivatives of all three measures to the values of all elements, by two threads with a model each, and what a second worker process of Dask is worth.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from page import write

FEW = 5
THREADS = 2
PERIOD = 1e-5
LOAD = {"interrupted": 20.0, "not interrupted": 5.0}
DECK = """* buck
.param l=50u
vin in 0 24
vg g 0 pulse(0 1 0 10n 10n 3.99u 10u)
s1 in sw g 0 sw
d1 0 sw d
l1 sw out {l} ic=0
c1 out 0 100u ic=0
rload out 0 LOAD
.model sw sw(vt=0.5 ron=10m roff=10meg)
.model d d(ron=10m roff=10meg)
.tran 1u 10m uic
.meas tran mean avg v(out) from=9m to=10m
.meas tran ripple pp i(l1) from=9m to=10m
.meas tran current rms i(l1) from=9m to=10m
.end
"""
MEASURES = ["mean", "ripple", "current"]
ELEMENTS = ["vin", "l1", "c1", "rload"]


def inductances(count):
    return np.linspace(40e-6, 60e-6, count)


def cpu():
    return sum(os.times()[:4])


def timed(call):
    cpu_before, before = cpu(), time.perf_counter()
    value = call()
    return cpu() - cpu_before, time.perf_counter() - before, value


def table(dataset):
    return np.array([np.asarray(dataset[name]) for name in MEASURES]).T


def by_circ(deck, values):
    import circ

    return table(circ.sweep(circ.parse(deck), {"l": values}, measures=MEASURES))


def by_command(deck, values, command):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "buck.cir")
        path.write_text(deck)
        lin = f"l=lin:{float(values[0])!r}:{float(values[-1])!r}:{len(values)}"
        rows = subprocess.check_output([command, "sweep", path, "--param", lin, "-o", "-"], text=True).splitlines()
    names = rows[0].split(",")
    columns = [names.index(name) for name in MEASURES]
    return np.array([[float(row.split(",")[k]) for k in columns] for row in rows[1:]])


def seen(t, out, current):
    late = t >= 9e-3
    t, out, current = t[late], out[late], current[late]
    mean = lambda y: np.trapezoid(y, t) / (t[-1] - t[0])
    return [mean(out), np.ptp(current), np.sqrt(mean(current**2))]


def by_pulsim(ohms, values):
    import pulsim

    rows = []
    for henries in values:
        b = pulsim.CircuitBuilder()
        b.add_voltage_source("vin", "in", "0", 24.0)
        b.add_switch("s1", "in", "sw", 100.0, 1e-7)
        b.add_diode("d1", "0", "sw", 100.0, 1e-7)
        b.add_inductor("l1", "sw", "out", float(henries))
        b.add_capacitor("c1", "out", "0", 100e-6)
        b.add_resistor("rload", "out", "0", ohms)
        # Without a step its engine of variable ones is chosen, which leaves the switch off.
        found = pulsim.simulate(b, 10e-3, PERIOD / 200, switch_fn=pulsim.make_pwm_switch_fn(1 / PERIOD, 0.4, 0, 2))
        rows.append(seen(np.asarray(found.times), np.asarray(found.v("out")), np.asarray(found.i("l1"))))
    return np.array(rows)


def by_ngspice(deck, values):
    from spicelib import RawRead, SimRunner, SpiceEditor
    from spicelib.simulators.ngspice_simulator import NGspiceSimulator

    rows = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "buck.cir")
        for old, new in ((".tran 1u 10m uic", ".tran 1u 10m 0 50n uic"), ("d(ron=10m roff=10meg)", "d(n=0.01 rs=10m)")):
            deck = deck.replace(old, new)
        # The editor knows elements by their capital letters.
        path.write_text("\n".join(line[:1].upper() + line[1:] for line in deck.split("\n")))
        runner = SimRunner(output_folder=folder, simulator=NGspiceSimulator)
        for henries in values:
            net = SpiceEditor(str(path))
            net.set_parameter("l", float(henries))
            task = runner.run(net, exe_log=True)
            runner.wait_completion()
            raw = RawRead(task.raw_file, dialect="ngspice")
            rows.append(seen(*(np.asarray(raw.get_wave(name)) for name in ("time", "v(out)", "i(l1)"))))
    return np.array(rows)


def steady(deck, values):
    """Measures at the steady state and their derivatives, a thread and a model to each half."""
    import circ

    def half(part):
        model = circ.parse(deck)
        for henries in part:
            model.set("l", float(henries))
            model.sensitivity(of=MEASURES, to=ELEMENTS, steady=True)

    with ThreadPoolExecutor(THREADS) as pool:
        list(pool.map(half, [values[k::THREADS] for k in range(THREADS)]))


def by_dask(deck, values, workers):
    """Wall time on so many worker processes that are there already, s."""
    import circ
    from distributed import Client, LocalCluster

    with LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None) as cluster, Client(cluster) as client:
        model = circ.parse(deck)
        circ.sweep(model, {"l": values[:100]}, measures=MEASURES, engine="dask", client=client)
        begun = time.perf_counter()
        circ.sweep(model, {"l": values}, measures=MEASURES, engine="dask", client=client)
        return time.perf_counter() - begun


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--circ", help="the program, for `circ sweep`")
    parser.add_argument("--variants", type=int, default=10000)
    asked = parser.parse_args()
    values = inductances(asked.variants)
    few = values[:: max(1, len(values) // FEW)][:FEW]
    lines = ["| current | by | variants | CPU a variant | wall time | largest difference |", "|---|---|---|---|---|---|"]
    for name, ohms in LOAD.items():
        deck = DECK.replace("LOAD", f"{ohms:g}")
        own = by_circ(deck, few)
        calls = {"`circ.sweep`": (values, lambda v: by_circ(deck, v))}
        if asked.circ:
            calls["`circ sweep`"] = (values, lambda v: by_command(deck, v, asked.circ))
        calls["Pulsim 2.0"] = (few, lambda v: by_pulsim(ohms, v))
        calls["ngspice through spicelib"] = (few, lambda v: by_ngspice(deck, v))
        for by, (over, call) in calls.items():
            spent, wall, found = timed(lambda: call(over))
            at = found[:: max(1, len(values) // FEW)][:FEW] if len(over) > FEW else found
            off = np.max(np.abs(at / own - 1))
            lines.append(f"| {name} | {by} | {len(over)} | {1e3 * spent / len(over):.3g} ms | {wall:.2f} s | {off:.1g} |")
            print(lines[-1], flush=True)
    deck = DECK.replace("LOAD", f"{LOAD['not interrupted']:g}")
    spent, wall, _ = timed(lambda: steady(deck, values))
    lines += ["", f"{len(values)} steady states with derivatives of three measures to all elements (5 Ω): {wall:.2f} s, {1e3 * spent / len(values):.3g} ms of CPU each."]
    deck = DECK.replace("LOAD", f"{LOAD['interrupted']:g}")
    one, two = by_dask(deck, values, 1), by_dask(deck, values, 2)
    lines.append(f"Dask, one worker process and two (20 Ω): {one:.1f} s and {two:.1f} s, {one / two:.2f} times as fast.")
    print(*lines[-2:], sep="\n")
    write("sweep.py", lines)


if __name__ == "__main__":
    sys.exit(main())
