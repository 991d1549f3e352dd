#!/usr/bin/env python3
"""Draws docs/bifurcation.svg: the inductor's current at the clock of a boost converter with peak-current control, over the peak.

`python3 docs/bifurcation.py` needs `circ` (`CIRC=path`, else the release build) and matplotlib. For each peak `circ pss` finds the stable orbit, of as many
clock periods as it has, and the orbit of one period, stable or not; where no orbit of up to 32 periods is stable, a transient shows where the current comes.
"""

import csv
import json
import os
import pathlib
import subprocess
import tempfile

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt

ROOT = pathlib.Path(__file__).resolve().parents[1]
NETLIST = ROOT / "netlists" / "small-signal" / "current-mode.cir"
CIRC = os.environ.get("CIRC", str(ROOT / "target" / "release" / "circ"))
COUNT, FIRST, LAST = 181, 0.5, 4.0


def current(command, peak, folder):
    """The current at every clock, and what the summary says of the orbit."""
    rows = pathlib.Path(folder) / "rows.csv"
    line = [CIRC, *command, str(NETLIST), "--param", f"ipk={peak!r}", "--probe", "i(l1)", "--summary", "json", "-q", "-o", str(rows)]
    ran = subprocess.run(line, capture_output=True, text=True)
    if ran.returncode:
        return [], {}
    with open(rows, newline="") as file:
        values = [float(row[1]) for row in list(csv.reader(file))[1:]]
    return values, json.loads(ran.stderr.splitlines()[-1]).get("pss", {})


def main():
    stable, unstable, wandering = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        for k in range(COUNT):
            peak = FIRST + (LAST - FIRST) * k / (COUNT - 1)
            values, orbit = current(["pss"], peak, folder)
            if orbit.get("stable"):
                # A period as long as the print step has rows between.
                clocks = values[:-1] if orbit["order"] > 1 else values[:1]
                stable += [(peak, value) for value in clocks]
            else:
                values, _ = current(["sim"], peak, folder)
                wandering += [(peak, value) for value in values]
            if orbit.get("order") != 1 or not orbit.get("stable"):
                values, _ = current(["pss", "--order", "1"], peak, folder)
                unstable += [(peak, value) for value in values[:1]]
    plt.rcParams.update({"svg.hashsalt": "circ", "font.size": 9})
    figure, axes = plt.subplots(figsize=(7, 4))
    axes.scatter(*zip(*wandering), s=0.4, color="#999999", linewidths=0, label="transient, no stable orbit", rasterized=True)
    axes.scatter(*zip(*stable), s=4, color="#0072b2", linewidths=0, label="stable orbit", rasterized=True)
    axes.scatter(*zip(*unstable), s=3, color="#d55e00", linewidths=0, label="unstable orbit of one period", rasterized=True)
    axes.set(xlabel="peak current, A", ylabel="current at the clock, A", xlim=(FIRST, LAST))
    axes.legend(frameon=False, loc="upper left")
    figure.tight_layout()
    figure.savefig(ROOT / "docs" / "bifurcation.svg", dpi=200, metadata={"Date": None})


if __name__ == "__main__":
    main()
