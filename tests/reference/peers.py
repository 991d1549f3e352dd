#!/usr/bin/env python3
"""Circuits of docs/performance.md by circ and by other programs, each as its users start it: the table of peers.

    apt install ngspice gnucap python3-siconos time; pip install numpy scipy pulsim scikit-sundae
    cargo build --release && tests/reference/peers.py [--circ CIRC] [NETLIST...]      CIRC: default target/release/circ

A program is given the netlist (Pulsim its builder's calls, Siconos the script that `circ lcs` writes, SUNDIALS and SciPy the equations of peers_smooth.py) and a ladder of settings. CPU is user and system time of
its process less that of the same program with nothing to do, the least of up to REPEATS runs each, over the spans of precision.py, and no less than the solve; beside it stand what the program, or a clock around its loop, says of the solve
alone, the wall time and the largest memory of the process as they are. A run of more than PATIENCE seconds has failed. Every program writes the signals of
`.save`, all nodes, currents of inductors and of diodes.

Errors are taken at the program's own rows, against circ's exact run with DENSE rows and rows on both sides of every event, which is held to 40 digits
(tests/fourteen.rs): the largest and the RMS error of the worst signal of `.save` that is no current of a diode, relative to its amplitude; the energy norm, the root of the mean of ½ ΔᵀMΔ of the error Δ of
voltages of capacitors and currents of inductors, relative to that of the largest energy; of the currents of all diodes the RMS error relative to the largest of them; and
how far a diode's voltage passes LEVEL of its reach before or after it does in the reference, relative to the run, with the number of such passages where the
program has fewer or more. The first row, which is given, does not count. The exact run itself is measured against the 40 digits of fourteen.csv, at its instants and events. Where
diodes and transistors are exponential the reference is circ's run at a tolerance of TIGHT, and how far SciPy's Radau at its own tightest setting is from it stands below the table.

The cheapest setting with an RMS error of TARGET stands in the table, else *the most accurate one*, else what the program said. All settings that ran are
points of the pictures in docs/precision (NAME.csv, read by precision.py).
"""

import argparse
import csv
import io
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from page import write
from peers_programs import CURVED, HERE, ROOT, Circ, Circuit, Failed, Gnucap, Ngspice, SPARE, Package, Siconos, Smooth

TARGET = 1e-3
PATIENCE = 10
DENSE = 50_000
TIGHT = 1e-9
LEVEL = 0.01
# A run is repeated so often, or for so many seconds.
REPEATS, LONG = 40, 0.5


def run(command, folder):
    """(CPU s, wall s, what it printed, what it said) of a process."""
    limit = lambda: resource.setrlimit(resource.RLIMIT_CPU, (PATIENCE, PATIENCE + 1))
    out, err = Path(folder, "stdout"), Path(folder, "stderr")
    begun = time.perf_counter()
    with open(out, "wb") as told, open(err, "wb") as said:
        child = subprocess.Popen([str(c) for c in command], cwd=folder, stdin=subprocess.DEVNULL, stdout=told, stderr=said, preexec_fn=limit)
        _, status, usage = os.wait4(child.pid, 0)
    wall = time.perf_counter() - begun
    child.returncode = os.waitstatus_to_exitcode(status)
    cpu = usage.ru_utime + usage.ru_stime
    # Of a program that repeats itself without an end the beginning will do.
    heads = [path.open(errors="replace").read(1 << 28) for path in (out, err)]
    if cpu > PATIENCE - 1:
        raise Failed(f"no end within {PATIENCE} s")
    if child.returncode != 0:
        lines = [line.strip() for line in (heads[1] or heads[0]).splitlines() if line.strip()]
        raise Failed(lines[-1][:80] if lines else f"exit status {child.returncode}")
    return cpu, wall, *heads


def repeated(command, folder):
    """(CPU s, wall s, what it printed, what it said), the least of repeated runs."""
    runs = [run(command, folder)]
    while len(runs) < REPEATS and sum(r[1] for r in runs) < LONG:
        runs.append(run(command, folder))
    return *(min(r[k] for r in runs) for k in range(2)), *runs[-1][2:]


def peak(command, folder):
    """The largest memory of the process, bytes. A child of this one begins with as much as this one has, that of a small program does not."""
    *_, err = run(["/usr/bin/time", "-f", "%M", *command], folder)
    return int(err.splitlines()[-1]) * 1024


class Reference:
    """circ's exact run, and the 40 digits that it is held to itself; of exponential diodes its run at a tight tolerance."""

    def __init__(self, circ, circuit, folder):
        program = Circ(circ, "auto", []) if circuit.curved else Circ(circ, "exact", [])
        setting = ["--tol", str(TIGHT), "--no-estimate"] if circuit.curved else []
        rows = max(DENSE * (4 if circuit.curved else 1), 4 * circuit.stop / circuit.step)
        divisions = int(np.ceil(rows * circuit.step / circuit.stop))
        *_, out, err = run(program.command(circuit, ["--events", *setting], folder, circuit.step / divisions), folder)
        self.circuit, self.data = circuit, program.read(circuit, folder, out, err)[0]
        self.size = lambda probe: np.abs(circuit.value(self.data, probe)).max()
        energy = self.energy(np.array([circuit.value(self.data, s) for s in circuit.states]))
        self.largest = energy.max()
        self.passages = {d: self.passed(self.data, d) for d in circuit.diodes}
        with open(HERE / "fourteen.csv", newline="") as file:
            self.digits = [(q, float(t), float(v)) for name, q, t, v in csv.reader(file) if name == circuit.name]

    def energy(self, states):
        return 0.5 * np.einsum("ik,ij,jk->k", states, self.circuit.mass, states)

    def passed(self, data, diode):
        """When its voltage passes the level, from the first print step on."""
        probe = "v({},{})".format(*self.circuit.diodes[diode])
        level = -LEVEL * self.size(probe)
        t, v = data["time"], self.circuit.value(data, probe) - level
        at = np.nonzero((v[:-1] < 0) != (v[1:] < 0))[0]
        part = v[at] / (v[at] - v[at + 1])
        times = t[at] + part * (t[at + 1] - t[at])
        return times[times > self.circuit.step]

    def at(self, t, probe):
        return np.interp(t, self.data["time"], self.circuit.value(self.data, probe))

    def errors(self, data):
        """(maximum, RMS, energy norm, device currents, passages) of a program's rows."""
        value = self.circuit.value
        data = {name: column[1:] for name, column in data.items()}
        t = data["time"]
        if t[-1] < 0.999 * self.circuit.stop or not all(np.isfinite(c).all() for c in data.values()):
            raise Failed(f"ends at {t[-1]:.3g} s")
        width = np.gradient(t)
        mean = lambda squares: float(np.sqrt((width * squares).sum() / width.sum()))
        off = {p: value(data, p) - self.at(t, p) for p in [*self.circuit.saved, *self.circuit.states] if value(data, p) is not None}
        signals = [p for p in self.circuit.saved if p in off and p[2:-1] not in self.circuit.diodes]
        relative = [off[p] / self.size(p) for p in signals]
        states = [off.get(s) for s in self.circuit.states]
        energy = None if any(s is None for s in states) else mean(self.energy(np.array(states)) / self.largest)
        currents = [f"i({d})" for d in self.circuit.diodes if f"i({d})" in data]
        most = max((self.size(p) for p in currents), default=0.0)
        devices = max((mean(((data[p] - self.at(t, p)) / most) ** 2) for p in currents), default=None)
        return float(max(np.abs(r).max() for r in relative)), max(mean(r**2) for r in relative), energy, devices, self.late(data)

    def late(self, data):
        """The largest distance of a passage in the reference from one in the run, relative to the run, and how many there are in both."""
        worst, here, there = 0.0, 0, 0
        for diode, right in self.passages.items():
            if self.circuit.value(data, "v({},{})".format(*self.circuit.diodes[diode])) is None:
                return None
            found = self.passed(data, diode)
            here, there = here + len(right), there + len(found)
            if len(found) and len(right):
                near = np.abs(right[:, None] - found[None, :]).min(axis=1)
                worst = max(worst, near.max() / self.circuit.stop)
        return worst, here, there

    def exact(self, circ, folder):
        """Of the exact run against 40 digits: largest error of states, energy norm at their instants, largest error of times of events, relative, and the number of events."""
        states = [(q, t, v) for q, t, v in self.digits if "(" in q]
        events = {t for q, t, _ in self.digits if "(" not in q}
        times = sorted({t for _, t, _ in states})
        exact = Circ(circ, "exact", [None])
        *_, out, err = run(exact.command(self.circuit, ["--events"], folder, times[0], times[-1]), folder)
        data = exact.read(self.circuit, folder, out, err)[0]
        sizes = {quantity: max(abs(v) for q, _, v in states if q == quantity) for quantity, _, _ in states}
        value = lambda q, t: self.circuit.value(data, q)[np.abs(data["time"] - t).argmin()]
        off = {(q, t): value(q, t) - v for q, t, v in states}
        energies = self.energy(np.array([[off[s.replace(",0)", ")"), t] for t in times] for s in self.circuit.states]))
        late = max((np.abs(data["time"] - t).min() / times[-1] for t in events), default=0.0)
        return max(abs(e) / sizes[q] for (q, _), e in off.items()), float(np.sqrt(energies.mean() / self.largest)), late, len(events)


def ladder(program, circuit, reference, idle):
    """A measurement for every setting; of a realisation of the diodes until three failed in a row, or one had no end, and of SPARE where no other ran."""
    found, failures = [], {}
    for setting in program.settings(circuit):
        family = setting[0] if isinstance(setting, tuple) else ""
        done = any("failed" not in point for point in found)
        if failures.get(family) == 3 or (family in SPARE and done and not circuit.curved):
            continue
        point = {"program": program.name, "setting": program.told(setting)}
        with tempfile.TemporaryDirectory() as folder:
            try:
                command = program.command(circuit, setting, folder)
                cpu, wall, out, err = repeated(command, folder)
                data, solve = program.read(circuit, folder, out, err)
                maximum, rms, energy, devices, events = reference.errors(data)
                point |= {"cpu": max(cpu - idle, solve or 0.0), "solve": solve, "wall": wall, "peak": peak(command, folder), "max": maximum, "rms": rms}
                point |= {"energy": energy, "devices": devices, "events": events, "steps": len(data["time"]) - 1}
                failures[family] = 0
            except (Failed, subprocess.TimeoutExpired, ValueError, IndexError, KeyError) as failure:
                point["failed"] = str(failure) or type(failure).__name__
                failures[family] = failures.get(family, 0) + 1 if "no end" not in point["failed"] else 3
        found.append(point)
    return found


def starting(program):
    """CPU s of the program for nothing."""
    with tempfile.TemporaryDirectory() as folder:
        return repeated(program.idle(folder), folder)[0]


def seconds(value):
    """Two digits and a unit."""
    if value is None:
        return ""
    unit, factor = ("s", 1) if value >= 1 else ("ms", 1e3)
    return f"{float(f'{value * factor:.2g}'):g} {unit}"


def cells(points, exact):
    """The row of a program: its cheapest setting within the target, or its most accurate one, or its failure."""
    good = [p for p in points if "failed" not in p and np.isfinite(p["rms"])]
    name = points[0]["program"]
    if not good:
        return [name, f"fails: {points[0]['failed']}"] + [""] * 9
    within = [p for p in good if p["rms"] <= TARGET]
    p = min(within, key=lambda p: p["cpu"]) if within else min(good, key=lambda p: p["rms"])
    failed = sum("failed" in p for p in points)
    small = lambda x: "" if x is None else f"{x:.0e}"
    late = ""
    if p["events"]:
        off, here, there = p["events"]
        late = small(off) if here == there else f"{small(off)} ({there} of {here})"
    if exact:
        error, energy, off, count = exact
        norms = [f"{error:.0e}", "", f"{energy:.0e}", "", f"{off:.0e} of {count}"]
    else:
        norms = [small(p["max"]), small(p["rms"]) if within else f"*{small(p['rms'])}*", small(p["energy"]), small(p["devices"]), late]
    told = p["setting"] + (f" ({failed} of {len(points)} settings fail)" if failed else "")
    return [name, told, seconds(p["cpu"]), seconds(p["solve"]), seconds(p["wall"]), f"{p['peak'] / 2**20:.0f} MB", *norms]


def points_csv(circuit, points):
    """Points of the pictures, in the columns of `circ bench`."""
    out = io.StringIO()
    write = csv.writer(out, lineterminator="\n").writerow
    write(["circuit", "method", "parameter", "steps", "cpu_seconds", "max_error", "rms_error", "reference"])
    for p in points:
        if "failed" not in p and p["program"] in ("gnucap", "Siconos", "Pulsim"):
            family, _, rung = p["setting"].rpartition(", ")
            write([circuit.name, f"{p['program']}:{family or rung.split()[0]}", p["setting"], p["steps"], f"{p['cpu']:.4g}", f"{p['max']:.4g}", f"{p['rms']:.4g}", "exact"])
    return out.getvalue()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--circ", default=ROOT / "target" / "release" / "circ")
    parser.add_argument("--only", metavar="PROGRAM", help="the rows of this one, to standard output alone")
    parser.add_argument("netlists", nargs="*")
    args = parser.parse_args()
    circ = Path(args.circ).resolve()
    fourteen = dict.fromkeys(row[0] for row in csv.reader(open(HERE / "fourteen.csv", newline="")) if row[0] != "circuit")
    tolerances = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6]
    exact, curved = Circ(circ, "exact", [None]), Circ(circ, "auto", tolerances)
    shared = [Ngspice(circ), Gnucap()]
    ideal = [exact, Circ(circ, "euler", tolerances[:4]), Circ(circ, "theta", tolerances), *shared, Siconos(circ), Package("Pulsim", "peers_pulsim.py")]
    smooth = [curved, *shared, Smooth("SUNDIALS IDA", "IDA"), Smooth("SciPy Radau", "Radau")]
    idle = {}
    lines = [
        "| netlist | program | setting | CPU | solve | wall | memory | max | RMS | energy norm | device currents | events |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    apart = []
    for name in args.netlists or [*fourteen, *CURVED]:
        circuit = Circuit(name)
        with tempfile.TemporaryDirectory() as folder:
            reference = Reference(circ, circuit, folder)
            digits = None if circuit.curved else reference.exact(circ, folder)
        every = []
        for program in [p for p in (smooth if circuit.curved else ideal) if args.only in (None, p.name)]:
            idle.setdefault(program.name, []).append(starting(program))
            points = ladder(program, circuit, reference, idle[program.name][-1])
            every += points
            lines.append("| " + " | ".join([name, *cells(points, digits if program is exact else None)]) + " |")
            print(lines[-1], flush=True)
        if circuit.curved and not args.only:
            apart.append(f"{name} {every[-1].get('rms', np.nan):.0e}")
        elif not args.only:
            (ROOT / "docs" / "precision" / f"{name}.csv").write_text(points_csv(circuit, every))
    start = ", ".join(f"{name} {seconds(statistics.median(times))}" for name, times in idle.items() if name not in ("circ euler", "circ theta", "circ auto"))
    told = f"Start-up taken off, measured before each ladder (medians): {start}."
    if apart:
        told += f" RMS error of SciPy's Radau at rtol 1e-7 against the reference: {', '.join(apart)}."
    lines += ["", told]
    if not args.only:
        write("peers.py", lines)


if __name__ == "__main__":
    main()
