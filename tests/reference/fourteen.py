#!/usr/bin/env python3
"""The fourteen circuits of docs/performance.md in 40 digits: tests/reference/fourteen.csv.

    pip install python-flint
    tests/reference/fourteen.py [NETLIST ...] > tests/reference/fourteen.csv

Made from the cards by the tableau of digits.py, which shares nothing with circ: ideal diodes are 1e-50 and 1e50 ohms in 270 digits, so that what
these leave is beyond the fortieth. Jumps are fast motions there, of 1e-50 s: what happens within 1e-30 s counts as one event. Lines are
`circuit,quantity,time,value`: states at twenty times over the run (converters: over their first periods), and `d1` with 1 or 0 where a device begins to
conduct or ends.
"""

import pathlib
import re
import sys

from flint import arb, ctx

import digits

ctx.prec = 900
digits.ZERO, digits.TIME = arb("1e-150"), arb("1e-62")
EPS, SAME, ROWS = arb("1e-50"), 1e-30, 20
ROOT = pathlib.Path(__file__).resolve().parents[2]
# Dozens of periods are as good as hundreds for this purpose.
STOP = {"buck-open-loop": "0.2e-3", "flyback": "0.4e-3", "boost": "0.6e-3", "buck": "1e-3"}
SUFFIX = {"meg": "e6", "g": "e9", "k": "e3", "m": "e-3", "u": "e-6", "n": "e-9"}


def plain(word):
    """A number without its suffix."""
    match = re.fullmatch(r"([-+]?[\d.]+(?:e[-+]?\d+)?)(meg|g|k|m|u|n)?", word)
    return match.group(1) + SUFFIX.get(match.group(2), "") if match else word


class Circuit(digits.Network):
    def lines(self, path):
        """Cards as digits.py knows them."""
        found = []
        for line in open(path).read().lower().splitlines()[1:]:
            line = re.sub(r"[\w.+-]+", lambda word: plain(word.group()), line)
            if line.startswith("v"):
                name, plus, minus, wave = line.split(None, 3)
                if wave.startswith("sin"):
                    values = wave[4:-1].split()
                    wave = f"sin({' '.join(values + ['0'] * (6 - len(values)))})"
                line = f"{name} {plus} {minus} {wave}"
            elif line[:1] in ("c", "l") and "ic=" not in line:
                line += " ic=0"
            elif line.startswith(".tran"):
                stop = STOP.get(path.stem, line.split()[2])
                line = f".tran {float(stop) / ROWS} {stop}"
            found.append(line)
        return found


class Told(digits.Run):
    """A run that keeps its events."""

    def __init__(self, network):
        super().__init__(network)
        self.events = []

    def tell(self, t, changes):
        if not self.events or float(t - self.events[-1][0]) > SAME:
            self.events.append((t, {}))
        for name, on in changes:
            self.events[-1][1].setdefault(name, []).append(on)


def solve(path):
    run = Told(Circuit(path, EPS, None))
    for t, states in run.rows():
        for name, value in zip(run.network.names, states):
            yield name, t, value
    for t, changes in run.events:
        for name, ons in changes.items():
            # On and off again within the instant is no change.
            if len(ons) % 2 == 1:
                yield name, t, arb(int(ons[-1]))


def shown(number):
    """Forty digits, without zeros at the end."""
    text = number.mid().str(40, radius=False)
    return text.rstrip("0").rstrip(".") if "." in text and "e" not in text else text


def main():
    chosen = sys.argv[1:] or sorted(path.stem for path in (ROOT / "docs/precision").glob("*.svg"))
    print("circuit,quantity,time,value")
    for name in chosen:
        for quantity, t, value in solve(ROOT / "netlists" / f"{name}.cir"):
            print(f'{name},"{quantity}",{shown(t)},{shown(value)}', flush=True)


if __name__ == "__main__":
    main()
