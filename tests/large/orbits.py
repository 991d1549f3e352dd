#!/usr/bin/env python3
"""Times `circ pss` of circuits that grow, or `circ ac` about their orbits: `tests/large/orbits.py [CIRC] [--ac]`; user time and memory of one process each, with parsing and output."""

import re
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

HEADS = {
    "pulse": ["v1 n0 0 dc 0 ac 1 pulse(0 10 0 1u 1u 0.4m 1m)"],
    "rectifier": ["v1 in 0 dc 0 ac 1 sin(0 10 1k)", "d1 in n0 dm", ".model dm d(ideal)", "rl n0 0 10k"],
}


def ladder(sections, head):
    lines = [f"ladder {sections}", *HEADS[head]]
    for k in range(sections):
        lines += [f"r{k + 1} n{k} n{k + 1} 10", f"c{k + 1} n{k + 1} 0 {1e-5 / sections:g}"]
    return lines + [f"rend n{sections} 0 1k", ".tran 10u 2m", f".save v(n0) v(n{sections})", ".end"]


def bucks(count, load, spread=0.0, phases=False):
    lines = [f"bucks {count}", "vs src 0 dc 48 ac 1", "ls src bus 1u", "cs bus 0 100u", "vc c 0 pulse(0 1 0 10n 10n 4u 10u)"]
    lines += [".model sw sw(vt=0.5 vh=0 ron=10m roff=1meg)", ".model dm d(ideal)"]
    for k in range(count):
        clock, f = "c", 1 + spread * (k / (count - 1) - 0.5)
        if phases:
            clock = f"c{k}"
            lines.append(f"v{clock} {clock} 0 pulse(0 1 {10e-6 * k / count:g} 10n 10n 4u 10u)")
        lines += [f"s{k} bus x{k} {clock} 0 sw", f"d{k} 0 x{k} dm", f"l{k} x{k} o{k} {20e-6 * f:g}"]
        lines += [f"cf{k} o{k} 0 {22e-6 / f:g}", f"ro{k} o{k} 0 {load}"]
    return lines + [".tran 0.1u 10u", ".save v(bus) v(o0)", ".end"]


CIRCUITS = {
    "ladder of 600 sections, pulse": ladder(600, "pulse"),
    "ladder of 2000 sections, pulse": ladder(2000, "pulse"),
    "ladder of 600 sections behind a rectifier": ladder(600, "rectifier"),
    "ladder of 2000 sections behind a rectifier": ladder(2000, "rectifier"),
    "200 bucks, continuous conduction": bucks(200, 5),
    "the same, 200 different filters": bucks(200, 5, 0.4),
    "200 bucks, discontinuous conduction": bucks(200, 100),
    "the same, 200 different filters, each current ends by itself": bucks(200, 100, 0.4),
    "200 bucks, 200 phases of the clock": bucks(200, 5, phases=True),
}


# Events at hundreds of instants of their own, and as many steps in each product.
WITHOUT_RESPONSE = ("the same, 200 different filters, each current ends by itself", "200 bucks, 200 phases of the clock")


def timed(asked):
    """What a command says, and its user time, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    run = subprocess.run(asked, capture_output=True, text=True, check=True)
    return run.stdout + run.stderr, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def orbit(circ, file, lines):
    file.write_text("\n".join(lines) + "\n")
    said, spent = timed([circ, "pss", file, "-o", file.with_suffix(".csv"), "--summary", "text", "-v"])
    work = re.search(r"orbit by products: (\d+) returns of (\d+) steps, (\d+) products", said)
    error = re.search(r"stated error: (\S+) of", said)
    return [*work.groups(), error[1], f"{spent:.2f}"]


def response(circ, file, lines):
    file.write_text("\n".join([*lines[:-1], ".ac dec 20 100 10k", ".end"]) + "\n")
    said, spent = timed([circ, "ac", file, "-o", file.with_suffix(".csv"), "--about", "pss"])
    return [re.search(r"the response by (\S+) of", said)[1], f"{spent:.2f}"]


def main():
    paths = [path for path in sys.argv[1:] if path != "--ac"]
    circ = paths[0] if paths else "target/quick/circ"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "orbit.cir"
        for name, lines in CIRCUITS.items():
            if "--ac" not in sys.argv:
                cells = orbit(circ, file, lines)
            elif name in WITHOUT_RESPONSE:
                continue
            else:
                cells = response(circ, file, lines)
            print(f"| {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
