#!/usr/bin/env python3
"""The circuits of tests/stability/stiff in 40 digits and more: tests/stability/stiffness.csv.

    pip install python-flint
    tests/reference/stiff.py [NETLIST ...] > tests/stability/stiffness.csv

One element of each netlist is `{x}`. Its line `*STIFF x = 200/ratio` (or `x = 1*ratio`) gives the value at each of RATIOS, the ratio of the load's time
constant to the one that this element makes. Solved from the cards by the tableau of digits.py in 270 digits, which shares nothing with circ: Ron and Roff
are what the cards say. Lines are `netlist,ratio,x,spread,quantity,time,value`: all states at twenty times, in 20 digits. The spread is the largest
magnitude of an eigenvalue over the least, over all positions of switch and diode.
"""

import itertools
import pathlib
import re
import sys
import tempfile

from flint import acb_mat, arb, arb_mat

import fourteen

FOLDER = pathlib.Path(__file__).resolve().parents[1] / "stability" / "stiff"
RATIOS = ["1", "1e3", "1e6", "1e9", "1e12", "1e15", "1e18"]
DIGITS = 20


def value(rule, ratio):
    """The element's value as a word, exact."""
    number, sign = re.fullmatch(r"x = (\S+?)([*/])ratio", rule).groups()
    mantissa, _, exponent = fourteen.plain(number).partition("e")
    tens = len(str(int(float(ratio)))) - 1
    return f"{mantissa}e{int(exponent or 0) + (tens if sign == '*' else -tens)}"


def spread(network):
    """Over the positions of all devices."""
    sizes = []
    for position in itertools.product((False, True), repeat=len(network.devices)):
        rates, _ = network.mode(position)
        n = len(rates)
        matrix = arb_mat(n, n, [rates[i][j] for i in range(n) for j in range(n)])
        sizes += [abs(e).mid() for e in acb_mat(matrix).eig(tol=arb("1e-60"), multiple=True)]
    return float(max(sizes) / min(sizes))


def main():
    names = sys.argv[1:] or sorted(path.stem for path in FOLDER.glob("*.cir"))
    print("netlist,ratio,x,spread,quantity,time,value")
    for name, ratio in itertools.product(names, RATIOS):
        text = (FOLDER / f"{name}.cir").read_text()
        x = value(re.search(r"^\*STIFF (.*)$", text, re.M)[1], ratio)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / f"{name}.cir"
            path.write_text(text.replace("{x}", x))
            network = fourteen.Circuit(path, None, None)
        run = fourteen.Told(network)
        for t, states in run.rows():
            for quantity, state in zip(network.names, states):
                shown = state.mid().str(DIGITS, radius=False)
                print(f'{name},{ratio},{x},{spread(network):.1e},{quantity},{float(t):.12g},{shown}', flush=True)
        changes = sum(len(ons) % 2 for _, at in run.events for ons in at.values())
        print(f"{name} {ratio}: {changes} changes", file=sys.stderr)


if __name__ == "__main__":
    main()
