#!/usr/bin/env python3
"""Random converters and rectifiers of exponential diodes beside comparators, switches that depend on the state, and ideal diodes: a run at the
default tolerance against one at 1e-8, and that one by `--verify`. Run by hand; what it found stands in docs/validation.md.

    cargo build && python3 tests/guards.py [--circ target/debug/circ] [--first SEED] [--count N]

Prints every circuit that is refused, takes too long, differs by more than 1e-3 of an amplitude (the fiftieth of the rows that differ most left
out: events shift), or states less than its error, and a count of each outcome.
"""

import argparse
import collections
import csv
import json
import pathlib
import random
import subprocess
import tempfile

TIMEOUT = 60
WRONG = 1e-3


class Draw(random.Random):
    """Draws values by their logarithm."""

    def value(self, low, high):
        return low * (high / low) ** self.random()


def converter(draw, kind):
    """Cards of a converter, its period and the signals to compare."""
    period, volts, ohms = 1 / draw.value(1e4, 2e5), draw.value(5, 50), draw.value(1, 20)
    henries, farads = draw.value(0.6, 9) * ohms * period, draw.value(3, 30) * period / ohms
    saw = f"vs saw 0 pulse(0 1 {0.1 * period:.4g} {0.9 * period:.4g} {0.05 * period:.4g} {0.02 * period:.4g} {period:.4g})"
    stage = [f"v1 in 0 {volts:.4g}", "s1 in a g 0 sw", "d1 0 a dx", f"l1 a o {henries:.4g}", f"c1 o 0 {farads:.4g}", f"r1 o 0 {ohms:.4g}"]
    modulator = "bc g 0 v= v(c) > v(saw) ? 5 : 0"
    if kind == "modulator":
        cards = [*stage, saw, modulator, f"vc c 0 {draw.uniform(0.1, 0.8):.4g}"]
    elif kind == "regulator":
        error = f"be e 0 v= {draw.value(0.6, 6) / volts:.4g}*({draw.uniform(0.2, 0.7) * volts:.4g}-v(o))+0.4"
        cards = [*stage, saw, modulator, error, "rf e c 1k", f"cf c 0 {period * draw.value(0.3, 5) / 1e3:.4g}"]
    elif kind == "hysteresis":
        level = draw.uniform(0.2, 0.7) * volts
        stage[1] = "s1 in a rf o sh"
        cards = [*stage, f"vr rf 0 {level:.4g}", f".model sh sw(ron=10m roff=1meg vt=0 vh={level * draw.uniform(0.01, 0.1):.4g})"]
    elif kind == "complementary":
        stage[2:3] = ["s2 a 0 h 0 sw", "d1 0 a dx", "d2 a in dx"]
        cards = [*stage, saw, "bc g 0 v= v(m) > v(saw) ? 5 : 0", "bh h 0 v= v(m) > v(saw) ? 0 : 5", f"vm m 0 sin(0.5 0.3 {1 / (9 * period):.4g})"]
    elif kind == "peak current":
        clock = f"vk k 0 pulse(0 1 0 {0.01 * period:.4g} {0.01 * period:.4g} {0.05 * period:.4g} {period:.4g})"
        limit = f"bc rs 0 v= i(vl) > {volts / ohms * draw.uniform(0.5, 2):.4g} ? 1 : 0"
        power = ["s1 a 0 g 0 sw", f"l1 in x {henries:.4g}", "vl x a 0", "d1 a o dx", f"c1 o 0 {2 * farads:.4g}", f"r1 o 0 {3 * ohms:.4g}"]
        cards = [f"v1 in 0 {volts:.4g}", clock, limit, "a1 k rs 0 0 0 0 g 0 srflop vhigh=5", *power]
    else:
        diode = lambda: draw.choice(["di", "dx"])  # noqa: E731
        source = f"v1 in 0 sin(0 {volts:.4g} {1 / (5 * period):.4g})"
        chain = ["d1 in x dx", f"l1 x y {henries:.4g}", f"d2 y o {diode()}", f"d4 0 x {diode()}", f"d3 o b {diode()}", f"vb b 0 {volts / 3:.4g}"]
        cards = [source, *chain, f"c1 o 0 {farads:.4g}", f"r1 o 0 {ohms:.4g}"]
    return cards, period, "v(o) i(l1)"


def netlist(seed):
    draw = Draw(seed)
    kind = draw.choice(["modulator", "regulator", "hysteresis", "complementary", "peak current", "rectifier"])
    cards, period, signals = converter(draw, kind)
    stop = period * draw.randint(8, 20)
    diode = f".model dx d(is={draw.value(1e-14, 1e-6):.4g} n={draw.uniform(1, 2):.4g} rs={draw.value(1e-3, 1e-1):.4g})"
    switch = f".model sw sw(ron={draw.choice(['1m', '10m', '50m'])} roff={draw.choice(['1meg', '1e9'])} vt=2.5)"
    end = [diode, ".model di d(ideal)", switch, f".tran {stop / 400:.6g} {stop:.6g} uic", f".save {signals}", ".end", ""]
    return kind, "\n".join([f"{kind} {seed}", *cards, *end])


def run(circ, path, *arguments):
    """The rows by time, the summary, and what was said."""
    out = path.with_suffix(".csv")
    out.unlink(missing_ok=True)
    command = [circ, "sim", path, "-q", "-o", out, "--summary", "json", *arguments]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    except subprocess.TimeoutExpired:
        return None, None, "takes too long"
    if '"method"' not in done.stderr or not out.exists():
        return None, None, " ".join(done.stderr.split("\n", 1)[-1].split())[:200]
    summary = next((json.loads(line) for line in done.stderr.splitlines() if line.startswith("{")), None)
    said = " ".join(line for line in done.stderr.splitlines() if not line.startswith("{"))
    rows = {}
    with out.open() as lines:
        for row in csv.reader(lines):
            if row[0] != "time":
                rows[float(row[0])] = [float(value) for value in row[1:]]
    return rows, summary, said.strip()[:200] if done.returncode else ""


def apart(rows, reference):
    """The largest difference of a column relative to its amplitude, but for the fiftieth of the rows that are worst: events shift."""
    times = [t for t in rows if t in reference]
    columns = range(len(next(iter(reference.values()))))
    sizes = [max(abs(reference[t][j]) for t in times) or 1 for j in columns]
    off = sorted(max(abs(rows[t][j] - reference[t][j]) / sizes[j] for j in columns) for t in times)
    return off[int(0.98 * (len(off) - 1))]


def examine(circ, path):
    rows, summary, said = run(circ, path)
    if not rows or summary is None or said:
        return "refused", said
    close, verified, said = run(circ, path, "--tol", "1e-8", "--verify")
    if not close or verified is None:
        return "refused at 1e-8", said
    if said:
        return "not verified" if "second run failed" in said else "fails at 1e-8", said
    off, stated = apart(rows, close), summary["error"]["max"]
    if off > WRONG:
        return "wrong", f"{off:.1e}"
    if stated is None:
        return "error not known", f"{off:.1e}"
    if stated < off and off > 1e-8:
        return "states less", f"{stated:.1e} of {off:.1e}"
    return "agrees", ""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--circ", default="target/debug/circ")
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--count", type=int, default=200)
    options = parser.parse_args()
    outcomes = collections.Counter()
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "guards.cir"
        for seed in range(options.first, options.first + options.count):
            kind, text = netlist(seed)
            path.write_text(text)
            outcome, what = examine(options.circ, path)
            outcomes[outcome] += 1
            if outcome != "agrees":
                print(f"{seed} ({kind}): {outcome}: {what}", flush=True)
    print(", ".join(f"{count} {outcome}" for outcome, count in outcomes.most_common()))


if __name__ == "__main__":
    main()
