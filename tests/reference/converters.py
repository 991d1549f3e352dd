#!/usr/bin/env python3
"""Makes tests/reference/converters.json: random converters by ngspice with converged steps.

    CIRC_CONVERTERS_DECKS=DIR cargo test --test converters decks
    tests/reference/converters.py DIR [COUNT]

Each deck runs with steps of at most 1/STEPS of the run and once more with steps and corners four times finer. The finer values are
kept; what they change by is the error. A deck that ngspice does not finish, or whose error is above WORST, is left out and named.
"""

import json
import pathlib
import subprocess
import sys

import make

STEPS = 1500
CORNER = 1e-3  # V, the width of a diode's corner in the coarser run
WORST = 1e-3
make.TIMEOUT = 25
OPTIONS = "reltol=1e-6 abstol=1e-12 vntol=1e-9 gmin=1e-15 method=gear"


def values(deck, signals, times, finer):
    stop = times[-1]
    text = deck.replace("@TMAX", repr(stop / (STEPS * finer))).replace("@EPS", repr(CORNER / finer))
    text = text.replace("\n.end\n", f"\n.options {OPTIONS}\n.end\n")
    names, columns = make.run(text, ".")
    wanted = [make.column(names, columns, signal) for signal in signals]
    return [[make.interpolate(t, columns[0], column) for column in wanted] for t in times]


def main():
    folder, count = pathlib.Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 112
    cases = []
    for path in sorted(folder.glob("*.cir")):
        if len(cases) == count:
            break
        netlist, deck = path.read_text(), path.with_suffix(".deck").read_text()
        signals = path.with_suffix(".signals").read_text().split()
        step, stop = (float(x) for x in [line for line in netlist.splitlines() if line.startswith(".tran")][0].split()[1:3])
        times = [stop * k / round(stop / step) for k in range(1, round(stop / step) + 1)]
        name = f"{path.stem} {netlist.splitlines()[0]}"
        try:
            coarse, fine = (values(deck, signals, times, finer) for finer in (1, 4))
        except (make.Failed, subprocess.TimeoutExpired) as failure:
            print(f"{name}: ngspice gives up: {failure}", flush=True)
            continue
        largest = max(abs(x) for row in fine for x in row) or 1.0
        error = 0.0
        for j in range(len(signals)):
            amplitude = max(max(abs(row[j]) for row in fine), 1e-3 * largest)
            error = max(error, max(abs(a[j] - b[j]) for a, b in zip(coarse, fine)) / amplitude)
        if not error <= WORST:
            print(f"{name}: not converged ({error:.1e})", flush=True)
            continue
        rounded = [[float(f"{x:.8g}") for x in row] for row in fine]
        print(f"{name}: {error:.1e}", flush=True)
        cases.append({"name": name, "netlist": netlist, "signals": signals, "times": times, "values": rounded, "error": float(f"{error:.2g}")})
    out = pathlib.Path(__file__).with_name("converters.json")
    head = {"made by": "tests/reference/converters.py", "tool": make.version(), "options": OPTIONS,
            "steps": f"at most 1/{4 * STEPS} of the run", "corners of diodes, V": CORNER / 4}
    rows = ",\n".join(json.dumps(case) for case in cases)
    out.write_text(json.dumps(head)[:-1] + ', "cases": [\n' + rows + "\n]}\n")
    print(f"{len(cases)} cases, {make.version()}")


if __name__ == "__main__":
    main()
