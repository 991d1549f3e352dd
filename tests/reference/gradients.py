#!/usr/bin/env python3
"""Derivatives of the states of twelve of the fourteen circuits to their elements, from differences in 270 digits: tests/reference/gradients.csv.

    pip install python-flint
    tests/reference/gradients.py [NETLIST ...] > tests/reference/gradients.csv

The runs are those of fourteen.py, which share nothing with circ, with one value at a time PART larger and smaller; what the difference of the two
leaves is PART² of the derivative. `cockcroft-walton` has no derivatives, as with equal capacitors diodes rest at their thresholds; circ knows none of
`peak-detector`. Lines are `circuit,element,quantity,time,derivative`, at four times of each run.
"""

import re
import sys

from flint import arb

import fourteen

PART = arb("1e-25")
TIMES = (5, 10, 15, 20)


class Moved(fourteen.Circuit):
    def __init__(self, path, name, factor):
        self.moved = name, factor
        super().__init__(path, fourteen.EPS, None)

    def lines(self, path):
        """With one value times the factor."""
        name, factor = self.moved
        found = super().lines(path)
        for k, line in enumerate(found):
            words = line.split()
            if words and words[0] == name:
                words[3] = (arb(words[3]) * factor).str(200, radius=False)
                found[k] = " ".join(words)
        return found


def elements(path):
    """Resistors, capacitors, inductors and constant sources, and their values."""
    for line in fourteen.Circuit(path, fourteen.EPS, None).lines(path):
        words = line.split()
        if words and words[0][0] in "rlcv" and re.fullmatch(r"[-+.\de]+", words[3]):
            yield words[0], arb(words[3])


def rows(path, name, factor):
    run = fourteen.Told(Moved(path, name, factor))
    return [(t, list(states)) for t, states in run.rows()], run.network.names


def main():
    smooth = (path.stem for path in (fourteen.ROOT / "docs/precision").glob("*.svg") if path.stem not in ("cockcroft-walton", "peak-detector"))
    chosen = sys.argv[1:] or sorted(smooth)
    print("circuit,element,quantity,time,derivative")
    for circuit in chosen:
        path = fourteen.ROOT / "netlists" / f"{circuit}.cir"
        for name, value in elements(path):
            (more, names), (less, _) = (rows(path, name, 1 + sign * PART) for sign in (1, -1))
            for k in TIMES:
                (t, high), (_, low) = more[k - 1], less[k - 1]
                for quantity, a, b in zip(names, high, low):
                    slope = (a - b) / (2 * PART * value)
                    print(f'{circuit},{name},"{quantity}",{float(t):.17g},{slope.mid().str(25, radius=False)}', flush=True)


if __name__ == "__main__":
    main()
