#!/usr/bin/env python3
"""All tables and pictures of docs/performance.md anew, on a machine of two cores that has nothing else to do for an hour.

    apt install ngspice gnucap python3-siconos time
    pip install pulsim scikit-sundae spicelib './python[all]'
    tests/reference/performance.py [--corpus DIR] [--only SCRIPT]...

DIR is a collection of netlists as corpus.py has it; without one the table of curved laws stands as it is. Each script's head says what it measures. What runs one process after the other has a core
to itself beside what else does; what has two threads runs alone.
"""

import argparse
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from page import write

ROOT = Path(__file__).resolve().parents[2]
CIRC = ROOT / "target" / "release" / "circ"


def benches():
    """The lines of the benches as they are."""
    lines = ["```text"]
    for bench in ("step", "exact"):
        ran = subprocess.run(["cargo", "bench", "--bench", bench], cwd=ROOT, check=True, capture_output=True, text=True)
        lines += [line for line in ran.stdout.splitlines() if re.search(r"\d (ns/step|ms)", line)]
    write("performance.py", [*lines, "```"])


def run(core, scripts):
    """Scripts one after the other on a core, or on all of them."""
    for script, *words in scripts:
        pin = None if core is None else lambda: os.sched_setaffinity(0, {core})
        subprocess.run([sys.executable, ROOT / "tests" / script, *words], cwd=ROOT, check=True, preexec_fn=pin)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--corpus")
    parser.add_argument("--only", action="append", default=[], metavar="SCRIPT")
    asked = parser.parse_args()
    subprocess.run(["cargo", "build", "--release"], cwd=ROOT, check=True)
    # By core, in order: the pictures of precision.py show what peers.py measured.
    beside = [
        [["reference/peers.py", "--circ", CIRC], ["reference/precision.py", CIRC]],
        [["reference/curved.py", "--circ", CIRC, "--corpus", asked.corpus], ["reference/leave_out.py", "--circ", CIRC], ["bench/sensitivities.py", CIRC]],
    ]
    alone = [["reference/sweep.py", "--circ", CIRC]]
    wanted = lambda script: Path(script[0]).name in (asked.only or [Path(script[0]).name]) and None not in script
    if not asked.only:
        benches()
    run(None, filter(wanted, alone))
    cores = sorted(os.sched_getaffinity(0))[:2]
    with ThreadPoolExecutor(len(cores)) as threads:
        done = [threads.submit(run, core, filter(wanted, scripts)) for core, scripts in zip(cores[:1] + cores[-1:], beside)]
        for each in done:
            each.result()


if __name__ == "__main__":
    main()
