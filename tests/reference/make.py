#!/usr/bin/env python3
"""Makes the committed reference waveforms with ngspice.

    tests/reference/make.py sources            tests/reference/sources.csv
    tests/reference/make.py NAME...            tests/reference/NAME.csv from netlists/NAME.cir
    tests/reference/make.py all                both, for every netlist with a `*CIRC compare` line

Each CSV opens with comment lines: tool and version, options, SHA-256 of the netlist, the command. `tests/ngspice.rs` reads them
and fails where the netlist has changed since.
"""

import hashlib
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
NETLISTS = HERE.parent.parent / "netlists"
ROWS = 400


def version():
    out = subprocess.run(["ngspice", "--version"], capture_output=True, text=True).stdout
    return re.search(r"ngspice-\d+", out).group(0)


def raw(path):
    """Times and columns of an ngspice binary raw file."""
    data = path.read_bytes()
    head, _, body = data.partition(b"Binary:\n")
    head = head.decode("latin-1")
    n = int(re.search(r"No\. Variables: (\d+)", head).group(1))
    points = int(re.search(r"No\. Points: (\d+)", head).group(1))
    names = [line.split()[1].lower() for line in head.split("Variables:\n")[1].splitlines() if line.strip()]
    values = np.frombuffer(body, dtype="<f8", count=n * points).reshape(points, n)
    return names, values


def run(text, folder):
    with tempfile.TemporaryDirectory() as tmp:
        deck, out = pathlib.Path(tmp) / "deck.cir", pathlib.Path(tmp) / "out.raw"
        deck.write_text(text)
        result = subprocess.run(
            ["ngspice", "-b", "-r", str(out), str(deck)],
            cwd=folder, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=600)
        if result.returncode != 0 or not out.exists():
            raise SystemExit(f"ngspice: {result.returncode}\n{result.stdout[-2000:]}{result.stderr[-2000:]}")
        return raw(out)


def write(path, header, names, rows):
    with path.open("w", newline="\n") as f:
        f.writelines(f"# {line}\n" for line in header)
        f.write(",".join(names) + "\n")
        for row in rows:
            f.write(",".join(repr(float(x)) if i == 0 else f"{x:.9g}" for i, x in enumerate(row)) + "\n")
    print(path.relative_to(HERE.parent.parent), len(rows), "rows")


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def sources():
    deck = HERE / "sources.cir"
    names, values = run(deck.read_text(), HERE)
    keep = [i for i, name in enumerate(names) if name == "time" or re.fullmatch(r"v\(\d+\)", name)]
    # ngspice's own times (no interpolation), away from the grid of edges at multiples of 10 us.
    t = values[:, 0]
    off = np.abs(t * 1e5 - np.round(t * 1e5)) > 1e-6
    rows = values[off][:, keep]
    rows = rows[:: -(-len(rows) // 100)]
    path = HERE / "sources.csv"
    with path.open("w", newline="\n") as f:
        f.write(f"# {version()}, own time points\n# netlist sources.cir sha256 {digest(deck)}\n"
                "# ngspice -b -r sources.raw sources.cir\n")
        f.write(",".join(names[i] for i in keep) + "\n")
        for row in rows:
            f.write(",".join(repr(float(x)) for x in row) + "\n")
    print(path.relative_to(HERE.parent.parent), len(rows), "rows")


if __name__ == "__main__":
    sources()
