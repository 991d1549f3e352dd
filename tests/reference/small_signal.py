#!/usr/bin/env python3
"""Makes tests/reference/small-signal/NAME.csv with ngspice's `.ac` from NAME.cir beside it.

    tests/reference/small_signal.py [NAME ...]

Lines are `frequency,signal,re,im`. ngspice's gmin is no part of the circuits, nor is what its operating point leaves: both are far below what the tests ask for.
"""

import pathlib
import re
import struct
import subprocess
import sys
import tempfile

import make

FOLDER = make.HERE / "small-signal"
OPTIONS = "reltol=1e-12 abstol=1e-21 vntol=1e-15 gmin=1e-21 itl1=1000"


def response(path):
    """Names and rows of complex numbers of an ngspice run, the frequency first."""
    text = path.read_text()
    text = re.sub(r"^\.end$", f".options {OPTIONS}\n.end", text, flags=re.M)
    with tempfile.TemporaryDirectory() as folder:
        deck, out = pathlib.Path(folder) / "t.cir", pathlib.Path(folder) / "t.raw"
        deck.write_text(text)
        subprocess.run(["ngspice", "-b", "-r", out, deck], check=True, capture_output=True, timeout=make.TIMEOUT)
        head, _, body = out.read_bytes().partition(b"Binary:\n")
    head = head.decode("latin-1")
    count = int(re.search(r"No\. Variables: (\d+)", head).group(1))
    names = [line.split()[1].lower() for line in head.split("Variables:\n")[1].splitlines() if line.strip()]
    for row in struct.iter_unpack(f"<{2 * count}d", body[: len(body) // (16 * count) * 16 * count]):
        yield row[0], dict(zip(names, zip(row[::2], row[1::2])))


def main():
    for name in sys.argv[1:] or sorted(path.stem for path in FOLDER.glob("*.cir")):
        path = FOLDER / f"{name}.cir"
        asked = re.search(r"^\.save (.*)$", path.read_text(), re.M).group(1).split()
        lines = [f"# {make.version()} {OPTIONS}", "frequency,signal,re,im"]
        for frequency, values in response(path):
            lines += [f"{frequency!r},{signal},{values[signal][0]!r},{values[signal][1]!r}" for signal in asked]
        path.with_suffix(".csv").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
