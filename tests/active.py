#!/usr/bin/env python3
"""Random networks with controlled sources, diodes, switches and loops of capacitors: each run is made a second time by an independent method,
and its energies must add up. Run by hand; what it found stands in docs/validation.md.

    cargo build && python3 tests/active.py [--circ target/debug/circ] [--first SEED] [--count N]

Such networks need not be passive: many have no solution, several, or one that grows without bound, so that a refusal is no fault. Prints
every circuit whose two runs differ by more than is tolerated or whose energies leave more than RESIDUAL, and a count of each outcome.
"""

import argparse
import collections
import json
import pathlib
import random
import subprocess
import tempfile

RESIDUAL = 1e-8
TIMEOUT = 60
SOURCES = ["sin(0 5 1k)", "pulse(0 5 0.1m 1u 1u 0.2m 0.5m)", "dc 5", "pulse(-3 4 0 0 0 0.25m 0.5m)"]
END = """vclk clk 0 pulse(0 1 0.13m 1n 1n 0.17m 0.41m)
.model di d(ideal)
.model dr d(ron=0.1 roff=1meg vfwd=0.4)
.model sw sw(vt=0.5)
.model swr sw(vt=0.5 ron=0.01 roff=1meg)
.tran 5u 2m uic
.end
"""


def network(seed):
    """A netlist: a tree of resistors, then what closes loops."""
    draw = random.Random(seed)
    nodes = [f"n{k}" for k in range(draw.randint(3, 6))]
    everywhere = [*nodes, "0"]

    def value(low, high):
        return f"{low * (high / low) ** draw.random():.4g}"

    def pair():
        return " ".join(draw.sample(everywhere, 2))

    cards = [f"active {seed}", f"v1 {nodes[0]} 0 {draw.choice(SOURCES)}"]
    for node in nodes[1:]:
        cards.append(f"rt{node} {node} {draw.choice([*everywhere[: everywhere.index(node)], '0'])} {value(10, 1e4)}")
    for k in range(draw.randint(1, 3)):
        cards.append(f"c{k} {pair()} {value(1e-8, 1e-6)} ic={draw.choice([0, 0, 1, -2])}")
    for k in range(draw.randint(0, 1)):
        cards.append(f"l{k} {pair()} {value(1e-4, 1e-2)}")
    for k in range(draw.randint(1, 3)):
        cards.append(f"d{k} {pair()} {draw.choice(['di', 'di', 'dr'])}")
    for k in range(draw.randint(1, 2)):
        (a, b), control = pair().split(), pair()
        if draw.random() < 0.5:
            cards.append(f"g{k} {a} {b} {control} {draw.choice(['-', ''])}{value(1e-5, 1e-2)}")
            continue
        cards.append(f"e{k} m{k} {a} {control} {draw.choice([-2, -1, 0.5, 1, 2, 0.9])}")
        behind = [f"ce{k} m{k} {b} {value(1e-8, 1e-6)}", f"de{k} m{k} {b} di", f"re{k} m{k} {b} {value(10, 1e4)}", f"se{k} m{k} {b} clk 0 sw"]
        cards += [draw.choice(behind), f"rm{k} m{k} 0 {value(100, 1e5)}"]
    for k in range(draw.randint(0, 2)):
        cards.append(f"s{k} {pair()} clk 0 {draw.choice(['sw', 'swr'])}")
    return "\n".join(cards) + "\n" + END


def outcome(circ, folder, seed):
    """What became of a network, in a word, and what is to be told of it."""
    file = folder / f"a{seed}.cir"
    file.write_text(network(seed))
    command = [circ, "sim", file, "--verify", "--summary", "json", "-o", file.with_suffix(".csv")]
    try:
        ran = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT)
    except subprocess.TimeoutExpired:
        return "no end", f"more than {TIMEOUT} s"
    if "internal" in ran.stderr or ran.returncode not in (0, 1, 2):
        return "internal error", ran.stderr.strip().splitlines()[-1]
    summaries = [json.loads(line) for line in ran.stderr.splitlines() if line.startswith("{")]
    if not summaries:
        return "no circuit", None
    residual, verified = summaries[-1]["energy"]["residual_relative"], summaries[-1].get("verified")
    if residual is not None and residual > RESIDUAL:
        return "energies", f"{residual:.1e} of the largest is missing"
    if verified is None:
        return "ended early", None
    if verified["max_difference"] > verified["tolerance"]:
        return "differs", f"{verified['signal']} by {verified['max_difference']:.1e} at {verified['time']:.6g} s"
    return "agrees", None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--circ", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent / "target/debug/circ")
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--count", type=int, default=100)
    asked = parser.parse_args()
    counts = collections.Counter()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(asked.first, asked.first + asked.count):
            word, told = outcome(asked.circ, pathlib.Path(folder), seed)
            counts[word] += 1
            if told:
                print(f"seed {seed}: {word}: {told}", flush=True)
    print(", ".join(f"{count} {word}" for word, count in counts.most_common()))


if __name__ == "__main__":
    main()
