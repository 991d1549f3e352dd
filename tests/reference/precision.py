#!/usr/bin/env python3
"""Error against run time of circ and ngspice: the pictures of docs/precision and the tables of docs/performance.md.

    cargo build --release && tests/reference/precision.py [CIRC] [NETLIST...]     CIRC: default target/release/circ

Each netlist is measured by `circ bench FILE --against ngspice`. ngspice's best setting is the cheapest of its ladder (largest
steps, `reltol`, `gear` and `trap`, four realisations of the diode) with an RMS error of at most 1e-4; where none gets there, its most
accurate one, marked so. It has a row for each of its steps; where they are ten print steps long circ's exact run has its rows there too. Times are user CPU seconds: of circ the solve with its set-up and energy balance, of ngspice the process
less its start-up. Runs of milliseconds are too short to time: those netlists are simulated over several times their span. Points of other programs are those that peers.py found over the
same spans (docs/precision/NAME.csv).
"""

import json
import math
import pathlib
import platform
import re
import subprocess
import sys
import tempfile

from page import write

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
        points = picture.with_suffix(".csv")
        others = ["--against", points] if points.exists() else []
        command = [circ, "bench", netlist, "--against", "ngspice", *others, "--quiet", "-o", data, "-o", picture]
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
    table += "\n\n" + "\n".join(pictures)
    write("precision.py", [table])


if __name__ == "__main__":
    main()
