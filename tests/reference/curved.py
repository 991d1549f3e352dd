#!/usr/bin/env python3
"""Circuits with exponential diodes and transistors: run time and error of circ and ngspice, the second table of docs/performance.md.

    cargo build --release && tests/reference/curved.py [--circ target/release/circ] [--corpus DIR] [--only NAME] [--print]

Measured are the netlists of netlists/, of tests/reference/curved/ and, with --corpus, of a collection like that of corpus.py whose
laws circ steps because they are curved. What circ leaves out (charges of junctions, Early effect, …) is taken out of the models for both.

The reference is ngspice with reltol=1e-7 and steps of at most a print step / DIVISIONS; twice as long steps tell its own error. An error is the root of
the mean square over the run, relative to the amplitude, of the worst signal, at circ's rows. CPU is user and system time of the
process less that of a trivial netlist, the least of REPEATS runs, over spans so long that ngspice takes at least LONG. ngspice's ladder is `trap` and `gear`, four values of reltol, and largest steps of its
own choice, a print step, and a quarter; circ's is --tol from 1e-2 to 1e-6, without the estimate of its error.
"""

import argparse
import csv
import importlib.util
import math
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from page import write

ROOT = Path(__file__).resolve().parent.parent.parent
TARGET = 1e-3
DIVISIONS = 20
REPEATS = 3
# Spans are lengthened until ngspice takes so long at its defaults, s.
LONG = 0.03
TIMEOUT = 300
TOLERANCES = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6]
LADDER = [(reltol, method, step) for step in (None, 1, 4) for reltol in (1e-3, 1e-4, 1e-5, 1e-6) for method in ("trap", "gear")]
# What circ's diodes and transistors do not have.
LEFT_OUT = "cjo cj0 cj tt vj m fc cjsw mjsw cje cjc cjs tf tr vje vjc vjs mje mjc mjs xcjc xtf vtf itf ptf vaf va var vb ikf ik ikr nk ise isc ne nc irb rbm"

spec = importlib.util.spec_from_file_location("corpus", Path(__file__).with_name("corpus.py"))
corpus = importlib.util.module_from_spec(spec)
spec.loader.exec_module(corpus)


def without_charges(text):
    """The netlist with models of what circ simulates alone."""
    names = "|".join(LEFT_OUT.split())
    parameter = re.compile(rf"(?i)(?<![\w.])(?:{names})\s*=\s*[-+\w.]+")
    out, inside = [], False
    for line in text.splitlines():
        if re.match(r"(?i)\s*\.model\s+\S+\s+(d|npn|pnp)\b", line):
            inside = True
        elif not line.startswith("+"):
            inside = False
        out.append(parameter.sub("", line) if inside else line)
    return "\n".join(out) + "\n"


def longer(text, times):
    """The netlist with so many times its span."""
    stop = re.compile(r"(?im)^(\s*\.tran\s+\S+\s+)(\S+)")
    return stop.sub(lambda found: f"{found[1]}{corpus.number(found[2]) * times:.9g}", text)


def timed(command, folder):
    """(CPU s, output) of a command, or (None, output) where it fails."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        ran = subprocess.run(command, cwd=folder, capture_output=True, timeout=TIMEOUT)
    except subprocess.TimeoutExpired:
        return None, "timeout"
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    text = (ran.stdout + ran.stderr).decode("latin-1")
    failed = ran.returncode != 0 or "aborted" in text or "Timestep too small" in text
    return (None if failed else spent), text


def least(command, folder):
    runs = [timed(command, folder)]
    while len(runs) < REPEATS and runs[-1][0] is not None and runs[-1][0] < 2:
        runs.append(timed(command, folder))
    if any(spent is None for spent, _ in runs):
        return None, runs[-1][1]
    return min(spent for spent, _ in runs), runs[-1][1]


def start_up(command, text, folder):
    (folder / "trivial.cir").write_text(text)
    return least(command, folder)[0]


class Ngspice:
    def __init__(self, folder, path, text):
        self.folder, self.path, self.text = folder, path, text
        trivial = "trivial\nv1 a 0 1\nr1 a 0 1\n.tran 1 2\n.control\nset filetype=binary\nrun\nwrite t.raw all\nquit\n.endc\n.end\n"
        self.idle = start_up(["ngspice", "-b", "trivial.cir"], trivial, folder)

    def run(self, reltol, method, divisions):
        """(CPU s, columns), or None."""
        raw = self.folder / "ng.raw"
        raw.unlink(missing_ok=True)
        deck = corpus.deck(self.text, reltol, method, raw.name, divisions) if reltol else self.defaults(raw.name)
        (self.folder / "deck.cir").write_text(deck)
        spent, text = least(["ngspice", "-b", "deck.cir"], self.folder)
        if spent is None or not raw.exists():
            return None
        try:
            return max(spent - self.idle, 1e-4), corpus.read_raw(raw)
        except (ValueError, TypeError, IndexError):
            return None

    def defaults(self, raw):
        """As the netlist stands, its own signals saved."""
        deck = corpus.deck(self.text, 1e-3, "trap", raw)
        deck = re.sub(r"(?m)^\.options reltol=0.001 method=trap.*\n", "", deck)
        saved = re.findall(r"(?im)^\s*\.save\s.*$", self.text)
        return deck.replace(".control\n", "\n".join([*saved, ".control\n"]), 1)


class Circ:
    def __init__(self, program, folder, text):
        self.program, self.folder = program, folder
        (folder / "circ.cir").write_text(text)
        trivial = "trivial\nv1 a 0 1\nr1 a 0 1\n.tran 1 2\n.end\n"
        self.idle = start_up([program, "sim", "trivial.cir", "-q", "-o", "t.raw"], trivial, folder)

    def run(self, *options):
        command = [self.program, "sim", "circ.cir", "-q", "-o", "circ.raw", *options]
        spent, text = least(command, self.folder)
        if spent is None:
            return None
        return max(spent - self.idle, 1e-4), corpus.read_raw(self.folder / "circ.raw")

    def is_curved(self):
        _, text = timed([self.program, "sim", "circ.cir", "--no-estimate", "--summary", "json", "-o", "circ.raw"], self.folder)
        return "does not consist of straight pieces" in text


def error(ours, reference, names):
    """The RMS error of the worst signal, relative to its amplitude; and its name."""
    time = ours["time"]
    rows = (time >= reference["time"][0]) & (time <= reference["time"][-1])
    worst = (0.0, "")
    for name in names:
        if name not in ours or name not in reference:
            continue
        other = np.interp(time[rows], reference["time"], reference[name])
        amplitude = np.max(np.abs(reference[name]))
        if amplitude > 0:
            off = np.sqrt(np.mean((ours[name][rows] - other) ** 2)) / amplitude
            worst = max(worst, (off, name))
    return worst


def resampled(columns, times):
    return {"time": times, **{name: np.interp(times, columns["time"], column) for name, column in columns.items() if name != "time"}}


def seconds(value):
    unit, factor = ("ms", 1e3) if value < 1 else ("s", 1)
    digits = max(0, 1 - math.floor(math.log10(value * factor)))
    return f"{value * factor:.{digits}f} {unit}"


def cheapest(points, target):
    """(CPU s, error, setting) of the cheapest point within the target, else of the most accurate; and whether it is within."""
    within = [p for p in points if p[1] <= target]
    if within:
        return min(within), True
    return (min(points, key=lambda p: p[1]), False) if points else (None, False)


def cell(found):
    point, within = found
    if point is None:
        return "fails"
    text = f"{seconds(point[0])} at {point[1]:.0e}"
    return text if within else f"*{text}*"


def measure(program, path, name):
    """A table row and (ratio at equal error, ratio at defaults), or None where no law is curved."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "files"
        shutil.copytree(path.parent, folder, copy_function=shutil.copyfile)
        # Included files lie a folder or two higher.
        for parent in (path.parent.parent.parent / "lib",):
            if parent.is_dir():
                text = corpus.read_bytes(path).replace("../../lib/", "lib/")
                shutil.copytree(parent, folder / "lib", copy_function=shutil.copyfile)
                break
        else:
            text = corpus.read_bytes(path)
        text = without_charges(text)
        circ = Circ(program, folder, text)
        if not circ.is_curved():
            return None
        # Runs of milliseconds are too short to time: the start-up of ngspice is known to a millisecond.
        spice = Ngspice(folder, path, text)
        first = spice.run(None, None, None)
        times = math.ceil(LONG / first[0]) if first and first[0] < LONG else 1
        if times > 1 and longer(text, times) != text:
            text, name = longer(text, times), f"{name}, span × {times}"
            circ = Circ(program, folder, text)
        own = circ.run()
        if own is None:
            return f"| {name} | fails | | | | | |", (None, None)
        spice = Ngspice(folder, path, text)
        fine = spice.run(1e-7, "trap", DIVISIONS) or spice.run(1e-6, "gear", DIVISIONS)
        if fine is None:
            return f"| {name} | {seconds(own[0])} | fails | | | | |", (None, None)
        reference = fine[1]
        names = corpus.wanted(text, [n for n in own[1] if n != "time" and n in reference])
        coarser = spice.run(1e-7, "trap", DIVISIONS / 2) or spice.run(1e-6, "gear", DIVISIONS / 2)
        times = own[1]["time"]
        known = error(resampled(coarser[1], times), reference, names)[0] if coarser else math.nan
        circs = []
        for tol in TOLERANCES:
            found = circ.run("--no-estimate", "--tol", f"{tol:g}")
            if found:
                circs.append((found[0], error(found[1], reference, names)[0], f"tol {tol:g}"))
        default = spice.run(None, None, None)
        default_error = error(resampled(default[1], times), reference, names)[0] if default else math.nan
        spices = []
        for reltol, method, divisions in LADDER:
            found = spice.run(reltol, method, divisions)
            if found:
                off = error(resampled(found[1], times), reference, names)[0]
                step = f", step / {divisions}" if divisions else ""
                spices.append((found[0], off, f"{method}, reltol {reltol:g}{step}"))
        target = max(TARGET, known)
        ours, theirs = cheapest(circs, target), cheapest(spices, target)
        equal = theirs[0][0] / ours[0][0] if ours[1] and theirs[0] else None
        defaults = default[0] / own[0] if default else None
        off = error(own[1], reference, names)[0]
        cells = [
            name,
            f"{seconds(own[0])} at {off:.0e}",
            f"{seconds(default[0])} at {default_error:.0e}" if default else "fails",
            f"{defaults:.2g}" if defaults else "",
            cell(ours),
            cell(theirs) + (f" ({theirs[0][2]})" if theirs[0] else ""),
            f"{equal:.2g}" if equal else "",
            f"{known:.0e}",
        ]
        return "| " + " | ".join(cells) + " |", (equal, defaults)


def netlists(collection):
    for path in sorted((ROOT / "netlists").glob("*.cir")):
        yield path, path.stem
    for path in sorted((ROOT / "tests" / "reference" / "curved").glob("*.cir")):
        yield path, path.stem
    if collection:
        with open(collection / "index.csv", newline="") as file:
            for row in csv.DictReader(file):
                if row["file"].split("/")[0] in ("run", "hard", "dialect"):
                    yield collection / row["file"], row["file"]


def mean(ratios):
    known = [ratio for ratio in ratios if ratio]
    return math.exp(sum(map(math.log, known)) / len(known)) if known else math.nan


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--circ", default=str(ROOT / "target" / "release" / "circ"))
    parser.add_argument("--corpus", type=Path)
    parser.add_argument("--only", help="netlists whose name contains this")
    parser.add_argument("--print", action="store_true", help="to the terminal alone")
    args = parser.parse_args()
    lines = [
        "| netlist | circ, defaults | ngspice, defaults | ratio | circ for 1e-3 | ngspice for 1e-3 | ratio | reference |",
        "|---|---|---|---|---|---|---|---|",
    ]
    equal, defaults = [], []
    for path, name in netlists(args.corpus):
        if args.only and args.only not in name:
            continue
        found = measure(str(Path(args.circ).resolve()), path, name)
        if found is None:
            continue
        lines.append(found[0])
        print(found[0], flush=True)
        equal.append(found[1][0])
        defaults.append(found[1][1])
    slower = [sum(1 for r in ratios if r and r < 1) for ratios in (equal, defaults)]
    counts = [sum(1 for r in ratios if r) for ratios in (equal, defaults)]
    lines += [
        "",
        f"Geometric mean of ngspice's time over circ's: {mean(equal):.2g} at equal error (circ slower on {slower[0]} of {counts[0]}), "
        f"{mean(defaults):.2g} at both programs' defaults (slower on {slower[1]} of {counts[1]}).",
    ]
    print(lines[-1])
    if not args.print and not args.only:
        write("curved.py", lines)
    return 0


if __name__ == "__main__":
    sys.exit(main())
