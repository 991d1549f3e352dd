#!/usr/bin/env python3
"""CPU seconds of the solve by two builds of circ, run in turn: the least of so many runs each, and their ratio.

    python3 tests/bench/revisions.py NEW OLD [--runs 15] [NETLIST ...]

Without netlists the fourteen of docs/performance.md. Below a millisecond the first touch of one huge page (2 MB, 0.2 ms) decides whether
a ratio is 0.6 or 1.6: on Linux look at both, with `never` and with `madvise` in /sys/kernel/mm/transparent_hugepage/enabled.
"""
import argparse
import json
import math
import pathlib
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def solve(program, netlist, out):
    run = subprocess.run([program, "sim", netlist, "-o", out, "--summary", "json", "-q"], stderr=subprocess.PIPE, check=True)
    return json.loads(run.stderr.decode().strip().splitlines()[-1])["cpu_seconds"]


def main():
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("new")
    asked.add_argument("old")
    asked.add_argument("netlists", nargs="*")
    asked.add_argument("--runs", type=int, default=15)
    args = asked.parse_intermixed_args()
    pictures = sorted((ROOT / "docs/precision").glob("*.svg"))
    netlists = args.netlists or [ROOT / "netlists" / (picture.stem + ".cir") for picture in pictures]
    logarithms = []
    with tempfile.TemporaryDirectory() as folder:
        out = str(pathlib.Path(folder) / "x.raw")
        for netlist in netlists:
            pairs = [(solve(args.new, netlist, out), solve(args.old, netlist, out)) for _ in range(args.runs)]
            new, old = (min(times) for times in zip(*pairs))
            logarithms.append(math.log(new / old))
            print(f"{pathlib.Path(netlist).stem:28} {new * 1e3:9.3f} ms {old * 1e3:9.3f} ms   {new / old:5.2f}", flush=True)
    print(f"geometric mean {math.exp(sum(logarithms) / len(logarithms)):.3f}")


if __name__ == "__main__":
    main()
