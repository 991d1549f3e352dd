#!/usr/bin/env python3
"""All tables and pictures of docs/performance.md anew, one after the other, on a machine that has nothing else to do for two hours.

    apt install ngspice gnucap python3-siconos time
    pip install numpy scipy pulsim scikit-sundae spicelib distributed ./python
    tests/reference/performance.py [--corpus DIR] [--only SCRIPT]...

DIR is a collection of netlists as corpus.py has it; without one the table of curved laws stays as it is. Each script's head says what it measures.
"""

import argparse
import re
import subprocess
import sys
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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--corpus")
    parser.add_argument("--only", action="append", default=[], metavar="SCRIPT")
    asked = parser.parse_args()
    subprocess.run(["cargo", "build", "--release"], cwd=ROOT, check=True)
    scripts = {
        "peers.py": ["reference/peers.py", "--circ", CIRC],
        "precision.py": ["reference/precision.py", CIRC],
        "curved.py": ["reference/curved.py", "--circ", CIRC, "--corpus", asked.corpus],
        "leave_out.py": ["reference/leave_out.py", "--circ", CIRC],
        "sensitivities.py": ["bench/sensitivities.py", CIRC],
        "sweep.py": ["reference/sweep.py", "--circ", CIRC],
    }
    if not asked.corpus:
        del scripts["curved.py"]
    if not asked.only:
        benches()
    for name, (script, *words) in scripts.items():
        if not asked.only or name in asked.only:
            subprocess.run([sys.executable, ROOT / "tests" / script, *words], cwd=ROOT, check=True)


if __name__ == "__main__":
    main()
