#!/usr/bin/env python3
"""Random converters with loss tables: the energies of `--table` against the tables read by this script at the rows before and after each
event, and the losses of `circ pss --table` against those of a long transient. Run by hand; what it found stands in docs/validation.md.

    cargo build && python3 tests/losses.py [--circ target/debug/circ] [--first SEED] [--count N]

Prints every device whose energies differ by more than 1e-9 (losses of the steady state: 1e-6) of themselves, and the largest difference.
"""

import argparse
import bisect
import csv
import json
import pathlib
import random
import subprocess
import tempfile

VALVES = {"s1": "sm", "s2": "sm", "d1": "dm", "d2": "dm"}


def weights(axis, x):
    """Points of an axis and their weights: none has no influence, a single one stands for a proportional quantity."""
    if len(axis) < 2:
        return [(0, x / axis[0] if axis else 1.0)]
    k = min(max(bisect.bisect_right(axis, x) - 1, 0), len(axis) - 2)
    part = (x - axis[k]) / (axis[k + 1] - axis[k])
    return [(k, 1 - part), (k + 1, part)]


def energy(table, name, volts, amperes):
    row = max(1, len(table["iloss"]))
    parts = ((v, i, a * b) for v, a in weights(table["vloss"], volts) for i, b in weights(table["iloss"], amperes))
    return max(0.0, sum(weight * table[name][v * row + i] for v, i, weight in parts))


def tables(draw, names):
    vloss = draw.choice([[], [draw.uniform(50, 500)], [0.0, draw.uniform(20, 60), draw.uniform(80, 300)]])
    iloss = draw.choice([[], [draw.uniform(1, 10)], [0.0, draw.uniform(0.5, 2), draw.uniform(3, 12)]])
    count = max(1, len(vloss)) * max(1, len(iloss))
    return {"vloss": vloss, "iloss": iloss} | {name: [draw.uniform(0, 1e-3) for _ in range(count)] for name in names}


def written(table):
    return " ".join(f"{name}=[{' '.join(map(repr, values))}]" for name, values in table.items() if values)


def converter(draw):
    """A netlist without `.tran`, the period, the nodes and tables of the devices and the gates of the switches."""
    kind = draw.choice(["buck", "boost", "leg"])
    duty, period, volts = draw.uniform(0.15, 0.85), draw.choice([1e-5, 2e-5, 5e-5]), draw.uniform(10, 400)
    henries, ohms = 10 ** draw.uniform(-5.5, -3), 10 ** draw.uniform(0, 2.5)
    ron, roff = draw.choice([0, 10 ** draw.uniform(-4, -1)]), draw.choice(["roff=inf", "roff=1meg"])
    # How a switch and a diode without voltage share a current is not determined.
    vfwd = draw.choice([0, 0.6]) if ron else draw.uniform(0.3, 1)
    models = {"sm": tables(draw, ["eon", "eoff"]), "dm": tables(draw, ["err"])}
    gates = {"s1": "g"}
    gate = f"vg g 0 pulse(0 5 {period * draw.uniform(0.05, 0.1):.9g} 0 0 {duty * period:.9g} {period:.9g})"
    if kind == "buck":
        cards, nodes = [f"l1 a o {henries:.6g}", gate], {"s1": ("in", "a"), "d1": ("0", "a")}
    elif kind == "boost":
        cards, nodes = [f"l1 in a {henries:.6g}", gate], {"s1": ("a", "0"), "d1": ("a", "o")}
    else:
        nodes, gates = {"s1": ("in", "a"), "d1": ("a", "in"), "s2": ("a", "0"), "d2": ("0", "a")}, {"s1": "g", "s2": "h"}
        second = f"vh h 0 pulse(0 5 {0.45 * period:.9g} 0 0 {draw.uniform(0.2, 0.5) * period:.9g} {period:.9g})"
        cards = [f"l1 a o {henries:.6g}", f"vg g 0 pulse(0 5 {0.01 * period:.9g} 0 0 {0.45 * duty * period:.9g} {period:.9g})", second]
    for name, (p, n) in nodes.items():
        cards.append(f"{name} {p} {n} {gates[name]} 0 sm" if name in gates else f"{name} {p} {n} dm")
    if draw.random() < 0.8:
        cards.append(f"c1 o 0 {10 * period / ohms:.6g}")
    cards += [
        f"v1 in 0 {volts:.6g}",
        f"r1 o 0 {ohms:.6g}",
        f".model sm sw(vt=2.5 ron={ron} {roff} {written(models['sm'])})",
        f".model dm d(ron={ron} vfwd={vfwd} {roff} {written(models['dm'])})",
        f".save {' '.join(f'i({name})' for name in nodes)} v(in) v(a) v(o) {' '.join(f'v({gate})' for gate in gates.values())}",
    ]
    return cards, period, nodes, models, gates


def run(circ, folder, cards, command, *options):
    """The rows and the summary of a run."""
    (folder / "t.cir").write_text("\n".join(["converter", *cards, ".end", ""]))
    done = subprocess.run([circ, command, "t.cir", "-o", "t.csv", "--table", "--summary", "json", *options], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr[-300:])
    text = done.stdout + done.stderr
    with open(folder / "t.csv", newline="") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    return rows, json.loads(text[text.index("{") : text.rindex("}") + 1])


def instants(rows):
    """The rows before and after each instant at which there are several."""
    same, k = 1e-12 * rows[-1]["time"], 0
    while k < len(rows):
        last = k
        while last + 1 < len(rows) and rows[last + 1]["time"] - rows[k]["time"] <= same:
            last += 1
        if last > k and rows[last]["time"] > 0:
            yield rows[k], rows[last]
        k = last + 1


def expected(rows, nodes, models, gates):
    """Counts and energies by device and parameter."""

    def volts(name, row):
        a, b = (0.0 if node == "0" else row[f"v({node})"] for node in nodes[name])
        return a - b

    found = {}
    for name in nodes:
        table, current = models[VALVES[name]], f"i({name})"
        count = {"on": [0, 0.0], "off": [0, 0.0]} if name in gates else {"recovery": [0, 0.0]}
        most, least = max(row[current] for row in rows), min(volts(name, row) for row in rows)
        for before, after in instants(rows):
            if name in gates:
                was, is_on = (row[f"v({gates[name]})"] > 2.5 for row in (before, after))
                if was == is_on:
                    continue
                blocking, carrying = (before, after) if is_on else (after, before)
                v = volts(name, blocking)
                i = max(0.0, carrying[current] if v > 0 else -carrying[current])
                key = "on" if is_on else "off"
                cost = energy(table, f"e{key}", abs(v), i)
            elif before[current] > 1e-3 * most >= after[current] and volts(name, after) < 1e-3 * least:
                key, cost = "recovery", energy(table, "err", -volts(name, after), before[current])
            else:
                continue
            count[key] = [count[key][0] + 1, count[key][1] + cost]
        found[name] = count
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--circ", default="target/debug/circ")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=200)
    asked = parser.parse_args()
    circ = str(pathlib.Path(asked.circ).resolve())
    worst, steady, devices = 0.0, 0.0, 0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for seed in range(asked.first, asked.first + asked.count):
            cards, period, *circuit = converter(random.Random(seed))
            rows, summary = run(circ, folder, [*cards, f".tran {30.37 * period:.9g} uic"], "sim")
            for name, count in expected(rows, *circuit).items():
                for key, (times, joules) in count.items():
                    told = summary["table"][name]["losses"][key]
                    difference = abs(told["energy"] - joules) / max(joules, 1e-6) if told["count"] == times else 1.0
                    worst, devices = max(worst, difference), devices + 1
                    if difference > 1e-9:
                        print(f"seed {seed}: {name} {key}: {told}, rows say {times} and {joules} J")
            if seed % 5:
                continue
            late = f".tran {period / 10:.9g} {4000 * period:.9g} {3990 * period:.9g} uic"
            orbit, long = (run(circ, folder, [*cards, late], command)[1] for command in ("pss", "sim"))
            # Others are not there yet.
            if max(abs(complex(*multiplier)) for multiplier in orbit["pss"]["multipliers"]) > 0.99:
                continue
            for name in expected(rows, *circuit):
                there, here = (summary["table"][name]["losses"]["switching"] for summary in (long, orbit))
                difference = abs(there - here) / max(there, 1e-9)
                steady = max(steady, difference)
                if difference > 1e-6:
                    print(f"seed {seed}: {name}: {here} W in the steady state, {there} W in ten late periods")
    print(f"{asked.count} converters, {devices} energies: at most {worst:.1e} of themselves from rows, losses of steady states {steady:.1e} from late periods")


if __name__ == "__main__":
    main()
