#!/usr/bin/env python3
"""Every netlist of a collection through circ and ngspice, compared over the last quarter of the run.

    python3 tests/reference/corpus.py CORPUS [--circ target/release/circ] [--only NAME] [-o TABLE.md]

CORPUS holds `index.csv` (columns file, set) and the netlists beside it. ngspice runs the netlist as it stands, with
reltol=1e-6 and everything saved: its own `.save`, `.print` and commands are taken out, a `tran` command is kept. Where it
does not come through, looser settings are tried, and named. circ runs with its defaults.

Per output, over the last quarter of the run and relative to the largest |value| of ngspice in the whole run:
  rms    root of the mean square of the difference
  max    largest difference, where an edge may stand up to SHIFT print steps earlier or later
"""

import argparse
import csv
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

SETTINGS = [
    (1e-6, "trap"),
    (1e-6, "gear"),
    (1e-5, "trap"),
    (1e-4, "gear"),
    (1e-3, "gear"),
]
SHIFT = 0.1
TIMEOUT = 120


def read_bytes(path):
    data = path.read_bytes()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def deck(text, reltol, method, raw):
    """The netlist with our options, everything saved, and its results in a binary file."""
    lines, control, command = [], False, None
    for line in text.splitlines():
        word = line.strip().lower()
        if word.startswith(".control"):
            control = True
        elif word.startswith(".endc"):
            control = False
        elif control:
            if re.match(r"tran\b", word):
                command = line.strip()
        elif re.match(r"\.(save|print|plot|probe|end)\b", word) and not word.startswith(".ends"):
            continue
        elif not re.match(r"\.options?\b.*(reltol|method)", word):
            lines.append(line)
    has_tran = any(re.match(r"\s*\.tran\b", line.lower()) for line in lines)
    lines += [
        f".options reltol={reltol:g} method={method} numdgt=15",
        ".control",
        "set filetype=binary",
        command if command and not has_tran else "run",
        f"write {raw} all",
        "quit",
        ".endc",
        ".end",
    ]
    return "\n".join(lines) + "\n"


def read_raw(path):
    """Times and columns of the first transient plot of a binary raw file."""
    data = path.read_bytes()
    while data:
        head, _, body = data.partition(b"Binary:\n")
        text = head.decode("latin-1")
        count = int(re.search(r"No. Variables: *(\d+)", text)[1])
        points = int(re.search(r"No. Points: *(\d+)", text)[1])
        names = [line.split()[1].lower() for line in text.split("Variables:\n")[1].splitlines()[:count]]
        values = np.frombuffer(body[: 8 * count * points], dtype="<f8").reshape(points, count)
        if names[0] == "time":
            return {canonical(name): values[:, k] for k, name in enumerate(names)}
        data = body[8 * count * points :]
    raise ValueError("no transient")


def canonical(name):
    name = name.lower()
    if name.endswith("#branch"):
        name = f"i({name[:-7]})"
    inside = re.fullmatch(r"([vi])\((.*)\)", name)
    if not inside:
        return name if name == "time" else f"v({name})"
    letter, inner = inside.groups()
    # ngspice's `v.x1.vs` is `x1.vs`.
    inner = re.sub(r"^[a-z]\.(?=.*\.)", "", inner) if letter == "i" else inner
    return f"{letter}({inner})"


def ngspice(path):
    """(columns, setting) or (None, why)."""
    text, why = read_bytes(path), ""
    for reltol, method in SETTINGS:
        raw = path.with_suffix(".raw")
        raw.unlink(missing_ok=True)
        copy = path.with_name("deck-" + path.name)
        copy.write_text(deck(text, reltol, method, raw.name), encoding="utf-8")
        try:
            ran = subprocess.run(
                ["ngspice", "-b", copy.name], cwd=path.parent, capture_output=True, timeout=TIMEOUT
            )
        except subprocess.TimeoutExpired:
            why = f"not done in {TIMEOUT} s"
            continue
        messages = (ran.stdout + ran.stderr).decode("latin-1")
        if raw.exists() and "aborted" not in messages and "Timestep too small" not in messages:
            try:
                return read_raw(raw), f"{reltol:g} {method}"
            except (ValueError, TypeError, IndexError):
                why = "no transient in its results"
                continue
        errors = [l for l in messages.splitlines() if re.search("error|fatal|too small|abort", l.lower())]
        why = errors[0].strip() if errors else "no results"
    return None, why


def circ(program, path):
    """(columns, notes) or (None, why)."""
    out = path.with_suffix(".circ.csv")
    try:
        ran = subprocess.run(
            [program, "sim", path.name, "-o", out.name], cwd=path.parent, capture_output=True, timeout=TIMEOUT
        )
    except subprocess.TimeoutExpired:
        return None, f"not done in {TIMEOUT} s"
    messages = ran.stderr.decode("utf-8", "replace")
    if ran.returncode != 0:
        lines = [l.strip() for l in messages.splitlines() if "error" in l or "×" in l]
        return None, " / ".join(lines[:2]) or f"status {ran.returncode}"
    with open(out, newline="") as file:
        rows = csv.reader(file)
        names = [canonical(name) for name in next(rows)]
        values = np.array([[float(cell) for cell in row] for row in rows])
    return {name: values[:, k] for k, name in enumerate(names)}, messages


def differences(ours, theirs):
    """{output: (rms, max, at, amplitude)} over the last quarter."""
    time = ours["time"]
    start, stop = time[0], min(time[-1], theirs["time"][-1])
    rows = (time >= start + 0.75 * (stop - start)) & (time <= stop)
    t = time[rows]
    shift = SHIFT * np.median(np.diff(time))
    found = {}
    for name, column in ours.items():
        if name == "time" or name not in theirs:
            continue
        reference = theirs[name]
        amplitude = np.max(np.abs(reference))
        if amplitude < 1e-12:
            amplitude = max(np.max(np.abs(column)), 1e-12)
        mine, other = column[rows], np.interp(t, theirs["time"], reference)
        error = mine - other
        # An edge a little earlier or later: inside the range that the other has nearby.
        near = distance(t, mine, theirs["time"], reference, shift)
        worst = int(np.argmax(near))
        rms = np.sqrt(np.mean(error**2)) / amplitude
        found[name] = (rms, near[worst] / amplitude, t[worst], amplitude)
    return found


def distance(t, mine, time, reference, shift):
    """How far each value is from the range of the reference within ± shift."""
    first = np.searchsorted(time, t - shift)
    last = np.searchsorted(time, t + shift, side="right")
    ends = [np.interp(t + d, time, reference) for d in (-shift, 0.0, shift)]
    low, high = np.min(ends, axis=0), np.max(ends, axis=0)
    for k in range(len(t)):
        inside = reference[first[k] : last[k]]
        if inside.size:
            low[k], high[k] = min(low[k], inside.min()), max(high[k], inside.max())
    return np.maximum(0.0, np.maximum(low - mine, mine - high))


def percent(x):
    return f"{100 * x:.3g} %"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--circ", default="target/release/circ")
    parser.add_argument("--only", help="netlists whose name contains this")
    parser.add_argument("--all", action="store_true", help="every output, not the worst alone")
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    program = str(Path(args.circ).resolve())
    with open(args.corpus / "index.csv", newline="") as file:
        index = [row for row in csv.DictReader(file) if not args.only or args.only in row["file"]]
    lines = ["| netlist | ngspice reltol, method | output | rms | max |", "|---|---|---|---|---|"]
    simulated, compared, close = 0, 0, 0
    with tempfile.TemporaryDirectory() as place:
        copy = Path(place) / "corpus"
        shutil.copytree(args.corpus, copy, copy_function=shutil.copyfile)
        for folder in [copy, *(p for p in copy.rglob("*") if p.is_dir())]:
            folder.chmod(0o755)
        for row in index:
            path, name = copy / row["file"], row["file"]
            ours, why = circ(program, path)
            if ours is None:
                lines.append(f"| {name} | | circ: {why} | | |")
                print(lines[-1], flush=True)
                continue
            simulated += 1
            theirs, setting = ngspice(path)
            if theirs is None:
                lines.append(f"| {name} | ngspice: {setting} | | | |")
                print(lines[-1], flush=True)
                continue
            found = differences(ours, theirs)
            compared += 1
            ranked = sorted(found.items(), key=lambda item: -item[1][1])
            if not ranked:
                lines.append(f"| {name} | {setting} | nothing in common | | |")
            close += bool(ranked) and ranked[0][1][1] <= 0.01
            for output, (rms, most, at, _) in ranked if args.all else ranked[:1]:
                lines.append(f"| {name} | {setting} | {output} at {at:.6g} s | {percent(rms)} | {percent(most)} |")
            print(lines[-1], flush=True)
    total = f"{simulated} of {len(index)} simulate, {compared} compared, {close} of these within 1 % in every output"
    print(total)
    if args.output:
        args.output.write_text("\n".join([*lines, "", total]) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
