#!/usr/bin/env python3
"""Makes what docs/stability.md shows: every case of tests/stability with circ and with ngspice, drift (drift.py), damping (damping.py), stiffness (stiffness.py).

    pip install matplotlib
    tests/stability/table.py [CIRC [PART...]]     CIRC is the program, default target/debug/circ; PART cases, drift, damping or stiffness, default all

The reference of the last, stiffness.csv, is made by tests/reference/stiff.py. A case is a netlist; its comments say what is right:

    *CHECK PROBE at=T is=VALUE [of=SCALE] exact=R euler=R theta=R    |found - VALUE| <= R * SCALE (default |VALUE|)
    *EITHER PROBE at=T is=VALUE or=OTHER ...                         the same with two right answers
    *REFUSES METHOD...                                               there is no solution, and the method must say so
    *STEP H                                                          fixed step of euler and theta

`tests/stability.rs` holds the methods to it; this script only reports. Every method is run on every case, and its cell is one of

    6e-05                              right: the largest error of its checks, each within what the case holds the method to
    refuses: REASON                    rightly
    **fails: ...**                     wrong, or refused, or run where there is no solution; for a run that says how far it may be off, that
    **too slow: ...**                  no answer in time

Where a case says nothing of a method, its error may be ten times the tolerance of its steps, that of exact integration 1e-9.
"""

import bisect
import csv
import json
import pathlib
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(HERE.parent / "reference"))
import damping  # noqa: E402
import drift  # noqa: E402
import stiffness  # noqa: E402
from make import column, interpolate, raw, seconds, version  # noqa: E402
from stiffness import LARGEST, METHODS, PATIENCE, patiently  # noqa: E402

SLOW = f"**too slow: no answer within {PATIENCE} s**"
# What ngspice is given for what only exists here: ideal switches, and edges that take no time (it would take a print step).
SUBSTITUTED = [(r"sw\(ideal", "sw(ron=1u roff=1g"), (r"(pulse\(\S+ \S+ \S+) 0 0 ", r"\1 1n 1n ")]


class Case:
    def __init__(self, path):
        self.name, self.text = path.stem, path.read_text()
        self.title = self.text.splitlines()[0]
        self.checks = [
            (kind, probe, dict(word.split("=") for word in rest.split()))
            for kind, probe, rest in re.findall(r"^\*(CHECK|EITHER) (\S+) (.*)$", self.text, re.M)
        ]
        refuses = re.search(r"^\*REFUSES (.*)$", self.text, re.M)
        self.refuses = refuses[1].split() if refuses else []
        step = re.search(r"^\*STEP (\S+)$", self.text, re.M)
        self.step = step[1] if step else None

    def errors(self, value, method):
        """(relative error, what it may be, what was wrong) per check."""
        for _, probe, words in self.checks:
            if method not in METHODS and probe.startswith("i(d"):
                continue  # ngspice does not write the currents of devices
            right = [float(words[key]) for key in ("is", "or") if key in words]
            scale = seconds(words["of"]) if "of" in words else max(map(abs, right))
            found = value(probe, seconds(words["at"]))
            error = min(abs(found - r) for r in right) / scale
            yield error, float(words.get(method, LARGEST[method])), f"{probe} = {found:.4g} instead of {right[0]:.4g}"


def judged(errors, stated=None):
    found = list(errors)
    if not found:
        return "nothing to compare"
    wrong = [check for check in found if not check[0] <= check[1]]
    if not wrong:
        return f"{max(found)[0]:.0e}"
    error, may, what = max(wrong)
    told = "" if stated is None else f"; it states an error of {stated:.0e}"
    return f"**fails: {what if error > 0.05 else f'off by {error:.0e}, {may:.0e} allowed'}**{told}"


def circ(program, case, method):
    with tempfile.TemporaryDirectory() as tmp:
        out = pathlib.Path(tmp) / "out.csv"
        words = [program, "sim", str(HERE / f"{case.name}.cir"), "--method", method, "-o", str(out), "--summary", "json"]
        if case.step and method != "exact":
            words += ["--step", case.step]
        run = patiently(words)
        if run is None:
            return SLOW
        if run.returncode != 0:
            lines = [line.strip() for line in run.stderr.splitlines() if line.lstrip().startswith(("×", "error"))]
            reason = (lines or run.stderr.splitlines() or ["?"])[0].removeprefix("× ").split(".cir: ")[-1]
            return f"refuses: {reason}" if method in case.refuses else f"**fails: refuses: {reason}**"
        if method in case.refuses:
            return "**fails: runs where there is no solution**"
        rows = list(csv.reader(out.open()))
        times = [float(row[0]) for row in rows[1:]]

        def value(probe, t):
            j = rows[0].index(probe)
            k = min(range(len(times)), key=lambda k: abs(times[k] - t))
            return float(rows[k + 1][j])

        summary = next(line for line in (run.stdout + run.stderr).splitlines() if line.startswith("{"))
        stated = (json.loads(summary).get("error") or {}).get("max")
        return judged(case.errors(value, method), stated)


def gives_up(case, reason):
    return f"gives up: {reason}" if case.refuses else f"**fails: gives up: {reason}**"


def ngspice(case):
    deck = re.sub(r"^\.save.*\n", "", case.text, flags=re.M)
    for pattern, other in SUBSTITUTED:
        deck = re.sub(pattern, other, deck)
    with tempfile.TemporaryDirectory() as tmp:
        path, out = pathlib.Path(tmp) / "deck.cir", pathlib.Path(tmp) / "out.raw"
        path.write_text(deck)
        run = patiently(["ngspice", "-n", "-b", "-r", str(out), str(path)], cwd=tmp, stdin=subprocess.DEVNULL)
        if run is None:
            return SLOW
        said = [line.strip() for line in (run.stdout + run.stderr).splitlines()]
        words = [s for s in said if re.search(r"too small|singular|[Ee]rror|failed|iterations", s)]
        words.sort(key=lambda s: not s.startswith("doAnalyses"))
        quote = f"“{words[0].removeprefix('doAnalyses: ')}”" if words else ""
        if run.returncode != 0 or not out.exists():
            return gives_up(case, quote or f"exit status {run.returncode}")
        names, values = raw(out)
        if not values or not values[0]:
            return gives_up(case, quote or "no rows")
        times = values[0]
        if case.refuses:
            probe = re.search(r"^\.save (\S+)", case.text, re.M)[1]
            return f"**fails: runs where there is no solution**: {probe} = {column(names, values, probe)[-1]:.4g} at the end"

        def value(probe, t):
            return interpolate(t, times, column(names, values, probe))

        short = "" if times[-1] > 0.999 * max(seconds(w["at"]) for _, _, w in case.checks) else ", stops early"
        return judged(case.errors(value, "ngspice")) + short + (f"; {quote}" if short else "")


def cases():
    return [Case(path) for path in sorted(HERE.glob("*.cir"))]


def table(program):
    lines = ["| case | exact | Moreau (`euler`) | `theta` | ngspice |", "|---|---|---|---|---|"]
    for case in cases():
        cells = [circ(program, case, method) for method in METHODS] + [ngspice(case)]
        cells = ["the same" if k in (1, 2) and cell[:8] == cells[0][:8] == "refuses:" else cell.replace("|", "\\|")
                 for k, cell in enumerate(cells)]
        lines.append(f"| [{case.title}](../tests/stability/{case.name}.cir) | " + " | ".join(cells) + " |")
        print(case.name, *cells, sep="\n    ")
    return "\n".join(lines) + "\n"


def put(part, made):
    """Into the page, between the marks of the part."""
    page = ROOT / "docs/stability.md"
    text, end = page.read_text(), "<!-- end -->\n"
    start = text.index(f"<!-- tests/stability/{part}.py")
    stop = text.index(end, start)
    page.write_text(text[:start] + f"<!-- tests/stability/{part}.py, {version()} -->\n" + made + text[stop:])


if __name__ == "__main__":
    program = str(pathlib.Path(sys.argv[1]).resolve()) if len(sys.argv) > 1 else str(ROOT / "target/debug/circ")
    parts = sys.argv[2:] or ["damping", "stiffness", "drift", "cases"]
    if "damping" in parts:
        damping.draw(program)
    if "stiffness" in parts:
        put("stiffness", stiffness.table(program))
    if "drift" in parts:
        put("drift", drift.table(program))
    if "cases" in parts:
        put("table", table(program))
