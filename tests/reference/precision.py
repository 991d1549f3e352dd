#!/usr/bin/env python3
"""Error against run time of circ and ngspice: the pictures of docs/precision and the tables of docs/performance.md.

    cargo build --release && tests/reference/precision.py [CIRC] [NETLIST...]     CIRC: default target/release/circ

Each netlist is measured by `circ bench FILE --against ngspice`. ngspice's best setting is the cheapest of its ladder (largest
steps, `reltol`, `gear` and `trap`, four realisations of the diode) with an RMS error of at most 1e-4; where none gets there, its most
accurate one, marked so. It has a row for each of its steps; where they are ten print steps long circ's exact run has its rows there too. Times are user CPU seconds: of circ the solve with its set-up and energy balance, of ngspice the process
less its start-up. Runs of milliseconds are too short to time: those netlists are simulated over several times their span. With the PyPI package `pulsim` installed its fixed-step solver runs on two of the circuits too.
"""

import csv
import importlib.util
import json
import math
import pathlib
import platform
import re
import resource
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
CIRCUITS = """bridge-resistor bridge-capacitor-filter buck rectifier rlcd clamp peak-detector voltage-doubler
three-phase-rectifier isolated-rectifier cockcroft-walton buck-open-loop boost flyback""".split()
# Their spans, in those of the netlist, where ngspice's run would take less than some 50 ms: its start-up of about 10 ms is subtracted,
# and is not known better than to a millisecond.
LONGER = {
    "bridge-resistor": 5,
    "bridge-capacitor-filter": 5,
    "rectifier": 20,
    "rlcd": 5,
    "clamp": 30,
    "peak-detector": 10,
    "voltage-doubler": 40,
    "three-phase-rectifier": 5,
    "cockcroft-walton": 3,
}
TARGET = 1e-4
# What the mean of repeated runs tells from the start-up, s.
SHORTEST = 5e-4
PAGE = ROOT / "docs" / "performance.md"


def longer(netlist, times):
    """The netlist with so many times its span."""
    stop = re.compile(r"(?im)^(\.tran\s+\S+\s+)([\d.]+)")
    return stop.sub(lambda found: f"{found[1]}{float(found[2]) * times:g}", netlist)


def bench(circ, name):
    """The measurements of one netlist; its picture goes into docs/precision."""
    with tempfile.TemporaryDirectory() as folder:
        data = pathlib.Path(folder) / "bench.json"
        picture = ROOT / "docs" / "precision" / f"{name}.svg"
        picture.parent.mkdir(exist_ok=True)
        netlist = pathlib.Path(folder) / f"{name}.cir"
        netlist.write_text(longer((ROOT / "netlists" / f"{name}.cir").read_text(), LONGER.get(name, 1)))
        command = [circ, "bench", netlist, "--against", "ngspice", "--quiet", "-o", data, "-o", picture]
        subprocess.run(command, check=True, cwd=ROOT)
        return json.loads(data.read_text())["measurements"]


def cheapest(points, error):
    """The cheapest measurement within an RMS error, or the most accurate one; and whether it is within."""
    good = [p for p in points if p["rms_error"] is not None]
    within = [p for p in good if p["rms_error"] <= error]
    if within:
        return min(within, key=lambda p: p["cpu_seconds"]), True
    return (min(good, key=lambda p: p["rms_error"]), False) if good else (None, False)


def seconds(value):
    """A time with two digits and a unit."""
    unit, factor = ("ms", 1e3) if value < 1 else ("s", 1)
    digits = max(0, 1 - math.floor(math.log10(value * factor))) if value > 0 else 0
    return f"{value * factor:.{digits}f} {unit}"


def point(found):
    """A measurement as a table cell."""
    measured, within = found
    if measured is None:
        return "fails"
    text = f"{seconds(measured['cpu_seconds'])} at {measured['rms_error']:.0e}"
    return text if within else f"*{text}*"


def setting(found):
    """ngspice's setting in short."""
    measured, _ = found
    if measured is None:
        return ""
    parts = dict(p.split("=") for p in measured["parameter"].split(";"))
    tolerance = measured["method"].split("=")[1]
    return f"`{parts['diodes']}`, {parts['method']}, reltol {tolerance}, max step {float(parts['maxstep']):.2g}"


def with_rows(exact, spice):
    """The exact run that has no more rows than ngspice's: at the print step, or fewer."""
    row = lambda p: float(p["parameter"].partition("rows=")[2] or 0)
    longest = float(spice["parameter"].split("maxstep=")[1].split(";")[0]) if spice else 0
    return max((p for p in exact if row(p) <= longest), key=row)


def row(name, measurements):
    """A table row and the ratio of ngspice's time to circ's."""
    by = lambda start: [m for m in measurements if m["series"].startswith(start)]
    moreau, theta = cheapest(by("euler"), 1e-3), cheapest(by("theta"), TARGET)
    spice = cheapest(by("ngspice"), TARGET)
    failures = [m for m in by("ngspice") if m["failure"]]
    exact = with_rows(by("exact"), spice[0])
    timed = spice[0] and spice[0]["cpu_seconds"] > SHORTEST
    ratio = spice[0]["cpu_seconds"] / exact["cpu_seconds"] if timed else None
    cells = [
        f"[{name}](precision/{name}.svg)" + (f", span × {LONGER[name]}" if name in LONGER else ""),
        seconds(exact["cpu_seconds"]),
        point(moreau),
        point(theta),
        point(spice),
        setting(spice),
        f"{len(failures)} of {len(by('ngspice'))}",
        f"{ratio:.0f}" if ratio else "",
    ]
    return "| " + " | ".join(cells) + " |", ratio


def bridge(ps):
    """netlists/bridge-resistor.cir."""
    b = ps.CircuitBuilder()
    b.add_capacitor("c1", "1", "0", 1e-6, 10.0)
    b.add_inductor("l1", "1", "0", 1e-2)
    for name, anode, cathode in [("df1", "1", "2"), ("dr1", "0", "2"), ("dr2", "3", "1"), ("df2", "3", "0")]:
        b.add_diode(name, anode, cathode, 1e6, 1e-9)
    b.add_resistor("rload", "2", "3", 1e3)
    return b, 5e-3, "v(1)", lambda r: r.v("1")


def three_phase(ps):
    """netlists/three-phase-rectifier.cir."""
    b = ps.CircuitBuilder()
    for phase, shift in [("a", 0.0), ("b", -120.0), ("c", 120.0)]:
        b.add_sine_voltage_source(f"v{phase}", phase, "0", 0.0, 325.0, 50.0, math.radians(shift))
        b.add_inductor(f"l{phase}", phase, f"{phase}1", 1e-3)
        b.add_diode(f"dp{phase}", f"{phase}1", "p", 1e6, 1e-9)
        b.add_diode(f"dn{phase}", "n", f"{phase}1", 1e6, 1e-9)
    b.add_capacitor("cd", "p", "n", 1e-3, 500.0)
    b.add_resistor("rload", "p", "n", 50.0)
    b.add_resistor("rg", "n", "0", 1e6)
    return b, 60e-3, "v(p,n)", lambda r: [p - n for p, n in zip(r.v("p"), r.v("n"))]


def pulsim(circ):
    """Lines of the table of Pulsim's engines: user CPU of the simulation and error of one voltage, relative to its amplitude."""
    import numpy as np
    import pulsim as ps

    used = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_utime
    settings = [{"dt": 1e-6}, {"dt": 1e-7}, {}, {"engine": "trbdf2", "rtol": 1e-6}, {"engine": "trbdf2", "rtol": 1e-8}]
    for name, build in [("bridge-resistor", bridge), ("three-phase-rectifier", three_phase)]:
        for setting in settings:
            builder, stop, probe, read = build(ps)
            words = ", ".join(f"{k} {v}" for k, v in setting.items()) or "default"
            try:
                result = ps.simulate(builder, t_end=stop, **setting)
                spent, runs = 0.0, 0
                while spent < 0.2:
                    again, start = build(ps)[0], used()
                    ps.simulate(again, t_end=stop, **setting)
                    spent, runs = spent + used() - start, runs + 1
                with tempfile.TemporaryDirectory() as folder:
                    data = pathlib.Path(folder) / "exact.csv"
                    netlist = ROOT / "netlists" / f"{name}.cir"
                    command = [circ, "sim", netlist, "--method", "exact", "--quiet", "-o", data]
                    subprocess.run(command, check=True)
                    names = data.read_text().split("\n", 1)[0]
                    exact = np.loadtxt(data, delimiter=",", skiprows=1)
                column = exact[:, next(csv.reader([names])).index(probe)]
                error = np.abs(np.interp(exact[:, 0], result.times, read(result)) - column)[1:].max()
                yield f"| {name} | {words} | {seconds(spent / runs)} | {error / np.abs(column).max():.0e} |"
            except Exception as failure:  # whatever it says is the result
                yield f"| {name} | {words} | fails | {str(failure)[:80]} |"


def main():
    circ, *names = sys.argv[1:] or [ROOT / "target" / "release" / "circ"]
    lines, ratios = [], []
    for name in names or CIRCUITS:
        line, ratio = row(name, bench(circ, name))
        lines.append(line)
        ratios += [ratio] if ratio else []
        print(line, flush=True)
    version = subprocess.run(["ngspice", "--version"], capture_output=True, text=True).stdout
    version = next(word for word in version.split() if word.startswith("ngspice-"))
    mean = math.exp(sum(map(math.log, ratios)) / len(ratios))
    table = "\n".join(
        [
            "| netlist | circ exact | Moreau for 1e-3 | θ for 1e-4 | ngspice for 1e-4 | its setting | failed | ratio |",
            "|---|---|---|---|---|---|---|---|",
            *lines,
            "",
            f"Geometric mean of the ratios: {mean:.0f}, smallest {min(ratios):.0f} ({version}, {platform.machine()}).",
        ]
    )
    pictures = [f"![{name}: error against run time](precision/{name}.svg)" for name in names or CIRCUITS]
    if importlib.util.find_spec("pulsim"):
        head = ["", "| netlist | Pulsim 2.0 | CPU | error |", "|---|---|---|---|"]
        table += "\n".join(["", *head, *pulsim(circ)])
    table += "\n\n" + "\n".join(pictures)
    begin, end = "<!-- precision.py begins -->", "<!-- precision.py ends -->"
    text = PAGE.read_text()
    before, after = text.split(begin)[0], text.split(end)[1]
    PAGE.write_text(f"{before}{begin}\n{table}\n{end}{after}")


if __name__ == "__main__":
    main()
