#!/usr/bin/env python3
"""Makes the committed reference waveforms with ngspice.

    tests/reference/make.py sources            tests/reference/sources.csv
    tests/reference/make.py NAME...            tests/reference/NAME.csv from netlists/NAME.cir
    tests/reference/make.py all                both, for every netlist with a `*CIRC compare` line
    tests/reference/make.py --into DIR ...     into another folder

Each CSV opens with comment lines: tool and version, options, hash of the netlist (64-bit FNV-1a of its lines that are not
comments), the command. `tests/ngspice.rs` reads them and fails where the netlist has changed since.
"""

import bisect
import pathlib
import re
import struct
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
NETLISTS = HERE.parent.parent / "netlists"
INTO = HERE
ROWS = 400
TIMEOUT = 600  # s, for one run
OPTIONS = "reltol=1e-4 abstol=1n vntol=1u"
# Where OPTIONS will not do: ngspice gives up ("timestep too small"), or its trapezoidal rule at reltol=1e-4 is wrong by 7 %
# (boost: 12.27 V at 1.416 ms against 13.178 V at reltol=1e-6 and 13.178 V with Gear; sepic: 8.71 V against 9.115 V).
OTHER_OPTIONS = {
    "three-phase-rectifier": "method=gear",
    "boost": "reltol=1e-6",
    "sepic": "reltol=1e-4 method=gear",
    # ngspice's gmin of 1e-12 S across every junction is no part of the circuit.
    "exponential-half-wave": "reltol=1e-7 abstol=1e-15 vntol=1e-9 gmin=1e-15",
    "exponential-bridge": "reltol=1e-7 abstol=1e-12 vntol=1e-8",
    "common-emitter": "reltol=1e-7 abstol=1e-15 vntol=1e-9 gmin=1e-15",
    "exponential-clamp": "reltol=1e-7 abstol=1e-15 vntol=1e-9 gmin=1e-15",
}
# ngspice's largest step where a twentieth of the print step is not small enough, or needlessly small.
LARGEST_STEP = {"flyback": "10n", "cuk": "100n", "sepic": "100n", "buck-open-loop": "100n", "isolated-rectifier": "10u", "exponential-half-wave": "1u", "exponential-bridge": "1u", "exponential-clamp": "50n", "common-emitter": "100n", "line-mismatch": "2p", "line-rectifier": "0.1n"}


def version():
    out = subprocess.run(["ngspice", "--version"], capture_output=True, text=True).stdout
    return re.search(r"ngspice-\d+", out).group(0)


def raw(path):
    """Names and columns of an ngspice binary raw file, time first."""
    data = path.read_bytes()
    head, _, body = data.partition(b"Binary:\n")
    head = head.decode("latin-1")
    n = int(re.search(r"No\. Variables: (\d+)", head).group(1))
    points = int(re.search(r"No\. Points: (\d+)", head).group(1))
    names = [line.split()[1].lower() for line in head.split("Variables:\n")[1].splitlines() if line.strip()]
    rows = struct.iter_unpack(f"<{n}d", body[: 8 * n * points])
    return names, list(zip(*rows))


def interpolate(t, times, values):
    """On the straight line between rows."""
    k = min(max(bisect.bisect_right(times, t), 1), len(times) - 1)
    a, b = times[k - 1], times[k]
    part = min(max((t - a) / (b - a), 0.0), 1.0) if b > a else 1.0
    return values[k - 1] + (values[k] - values[k - 1]) * part


class Failed(Exception):
    """ngspice gave up."""


def run(text, folder):
    with tempfile.TemporaryDirectory() as tmp:
        deck, out = pathlib.Path(tmp) / "deck.cir", pathlib.Path(tmp) / "out.raw"
        deck.write_text(text)
        result = subprocess.run(
            ["ngspice", "-n", "-b", "-r", str(out), str(deck)],
            cwd=folder, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=TIMEOUT)
        if result.returncode != 0 or not out.exists():
            lines = [line for line in (result.stdout + result.stderr).splitlines() if "too small" in line or "rror" in line]
            raise Failed(lines[0] if lines else f"exit status {result.returncode}")
        return raw(out)


def digest(path):
    hashed = 0xCBF29CE484222325
    for line in path.read_bytes().splitlines(keepends=True):
        for byte in b"" if line.startswith(b"*") else line:
            hashed = (hashed ^ byte) * 0x100000001B3 % 2**64
    return f"{hashed:016x}"


def sources():
    deck = HERE / "sources.cir"
    names, values = run(deck.read_text(), HERE)
    keep = [i for i, name in enumerate(names) if name == "time" or re.fullmatch(r"v\(\d+\)", name)]
    # ngspice's own times (no interpolation), away from the grid of edges at multiples of 10 us.
    rows = [[row[i] for i in keep] for row in zip(*values) if abs(row[0] * 1e5 - round(row[0] * 1e5)) > 1e-6]
    rows = rows[:: -(-len(rows) // 100)]
    path = INTO / "sources.csv"
    with path.open("w", newline="\n") as f:
        f.write(f"# {version()}, own time points\n# netlist sources.cir fnv1a {digest(deck)}\n"
                "# ngspice -b -r sources.raw sources.cir\n")
        f.write(",".join(names[i] for i in keep) + "\n")
        for row in rows:
            f.write(",".join(repr(x) for x in row) + "\n")
    print(f"{path.name}: {len(rows)} rows")


def seconds(word):
    """A SPICE number."""
    number, suffix = re.fullmatch(r"([-+0-9.e]+?)(meg|[tgkmunpf])?", word.lower()).groups()
    return float(number) * {None: 1, "t": 1e12, "g": 1e9, "meg": 1e6, "k": 1e3, "m": 1e-3, "u": 1e-6, "n": 1e-9,
                            "p": 1e-12, "f": 1e-15}[suffix]


def column(names, values, probe):
    """`v(a)`, `v(a,b)` or `i(l1)` from ngspice's columns."""
    def one(name):
        if name == "v(0)":
            return [0.0] * len(values[0])
        branch = f"{name[2:-1]}#branch"
        return values[names.index(name if name in names else branch if branch in names else f"i({branch})")]

    pair = re.fullmatch(r"v\((.*),(.*)\)", probe)
    return [a - b for a, b in zip(one(f"v({pair[1]})"), one(f"v({pair[2]})"))] if pair else one(probe)


def netlist(name):
    path = NETLISTS / f"{name}.cir"
    text = path.read_text()
    probes = re.findall(r"^\*CIRC compare (\S+)", text, re.M)
    words = re.search(r"^\.tran (.*)$", text, re.M)[1].split()
    step, stop = seconds(words[0]), seconds(words[1])
    count = round(stop / step)
    stride = -(-count // ROWS)
    grid = [k * step for k in range(0, count + 1, stride)]
    options = OTHER_OPTIONS.get(name, OPTIONS)
    deck = re.sub(r"^\.save.*\n", "", text, flags=re.M)
    tmax = LARGEST_STEP.get(name, f"{step / 20:g}")
    deck = re.sub(r"^\.tran (\S+) (\S+)", rf".tran \1 \2 0 {tmax}", deck, flags=re.M)
    deck = re.sub(r"^\.end$", f".options {options}\n.end", deck, flags=re.M)
    names, values = run(deck, NETLISTS)
    times = values[0]
    columns = [column(names, values, probe) for probe in probes]
    columns = [[interpolate(t, times, values) for t in grid] for values in columns]
    out = INTO / f"{name}.csv"
    with out.open("w", newline="\n") as f:
        f.write(f"# {version()}, .options {options}, tmax={tmax}, {len(times)} points, every {stride} print steps by straight lines\n")
        f.write(f"# netlist {name}.cir fnv1a {digest(path)}\n")
        f.write(f"# tests/reference/make.py {name}\n")
        f.write("time," + ",".join(f'"{p}"' if "," in p else p for p in probes) + "\n")
        for k, row in enumerate(zip(*columns)):
            f.write(f"{grid[k]:.12g}," + ",".join(f"{x:.7g}" for x in row) + "\n")
    print(f"{out.name}: {len(grid)} rows of {len(times)} points")


def comparable():
    return [p.stem for p in sorted(NETLISTS.glob("*.cir")) if "*CIRC compare" in p.read_text()]


if __name__ == "__main__":
    wanted = sys.argv[1:] or sys.exit(__doc__)
    failed = False
    if wanted[0] == "--into":
        INTO, wanted = pathlib.Path(wanted[1]), wanted[2:]
    for what in ["sources", *comparable()] if wanted == ["all"] else wanted:
        try:
            sources() if what == "sources" else netlist(what)
        except Failed as reason:
            failed = True
            print(f"{what}: ngspice gives up: {reason}")
    sys.exit(failed)
