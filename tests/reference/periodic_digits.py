#!/usr/bin/env python3
"""Makes tests/reference/periodic.csv: the periodic steady state and the small-signal response of an open-loop buck in 40 digits.

    pip install mpmath && tests/reference/periodic_digits.py

The buck is `netlists/buck-open-loop.cir` with a load of 5 ohms, whose current is not interrupted, and 1 V of AC in its input. Between the edges of the gate it is
linear: the orbit and the response are exponentials of its matrices. Lines are `what,frequency,re,im`: storage at t = 0 (`i`, `v`), a multiplier (`m`), and the
output over the input (`y`), up to ten times the switching frequency.
"""

import pathlib

from mpmath import eig, expm, eye, lu_solve, matrix, mp, mpc, mpf, nstr, pi

mp.dps = 40
L, C, R, RON, V = mpf("47e-6"), mpf("100e-6"), mpf(5), mpf("5e-3"), mpf(24)
T, ON, OFF = mpf("1e-5"), mpf("5e-9"), mpf("4.005e-6")
FREQUENCIES = [10, 1000, 3300, 20000, 49000, 100000, 130000, 270000, 700000, 1000000]


def conducting(resistance):
    return matrix([[-resistance / L, -1 / L], [1 / C, -1 / (R * C)]])


# Of each mode its matrix, what the input does, and how long it lasts.
MODES = [
    (conducting(mpf(0)), matrix([0, 0]), ON),
    (conducting(RON), matrix([1 / L, 0]), OFF - ON),
    (conducting(mpf(0)), matrix([0, 0]), T - OFF),
]


def through(modes, start, factor=mpf(1)):
    """Where y' = A y + b goes in a period, and the integral of y."""
    y, total = start, matrix([0, 0])
    for a, b, seconds in modes:
        e = expm(a * seconds)
        after = e * y + lu_solve(a, (e - eye(2)) * (b * factor))
        total += lu_solve(a, after - y - b * factor * seconds)
        y = after
    return y, total


def closed(modes, factor=mpf(1)):
    """The start that comes back."""
    forced, _ = through(modes, matrix([0, 0]), factor)
    m = eye(2)
    for a, _, seconds in modes:
        m = expm(a * seconds) * m
    return lu_solve(eye(2) - m, forced), m


def main():
    start, m = closed(MODES, V)
    multiplier = max(eig(m)[0], key=lambda mu: mu.imag)
    lines = [("i", 0, start[0]), ("v", 0, start[1]), ("m", 0, multiplier)]
    for f in FREQUENCIES:
        # y = x exp(-j w t) repeats after a period.
        turned = [(a - mpc(0, 2 * pi * f) * eye(2), b, seconds) for a, b, seconds in MODES]
        _, total = through(turned, closed(turned)[0])
        lines.append(("y", f, total[1] / T))
    text = [",".join([what, str(f), nstr(mpc(value).real, 30), nstr(mpc(value).imag, 30)]) for what, f, value in lines]
    path = pathlib.Path(__file__).with_name("periodic.csv")
    path.write_text("what,frequency,re,im\n" + "\n".join(text) + "\n")


if __name__ == "__main__":
    main()
