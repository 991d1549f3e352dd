#!/usr/bin/env python3
"""Event-driven solutions of the bridges and of the half-wave circuit in 40 digits: tests/reference/exact.csv.

Between events each circuit is a linear system solved by its matrix exponential; events are bracketed on a 2 us grid and
bisected. Written from the circuits' equations alone, not from the library.

    tests/reference/exact.py > tests/reference/exact.csv
"""

import mpmath as mp

mp.mp.dps = 40
C, L, R, CF = mp.mpf("1e-6"), mp.mpf("1e-2"), mp.mpf(1000), mp.mpf("300e-9")
STOP, GRID = mp.mpf("5e-3"), mp.mpf("2e-6")
VALUES = [mp.mpf(k) / 10000 for k in (1, 2, 5, 10, 20, 30, 40, 50)]


class Mode:
    """x' = A x, left when guard(x) falls below 0 for the mode `to`."""

    def __init__(self, a, guards):
        self.a, self.guards = mp.matrix(a), guards
        self.grid = mp.expm(self.a * GRID, method="taylor")

    def after(self, x, s):
        return mp.expm(self.a * s, method="taylor") * x


def solve(modes, mode, x, signals):
    """Events and values; `modes[mode].guards` is a list of (guard, next mode)."""
    t, events, values = mp.mpf(0), [], []
    wanted = list(VALUES)
    while t < STOP:
        m = modes[mode]
        # March from the event until a guard turns negative.
        left, state, k = t, x, 0
        while True:
            ahead = m.grid * state
            gone = [(guard, to) for guard, to in m.guards if guard(ahead) < 0]
            if gone or t + (k + 1) * GRID > STOP:
                break
            state, k = ahead, k + 1
        end, to = STOP, None
        if gone:
            base = t + k * GRID
            best = None
            for guard, target in gone:
                a, b = mp.mpf(0), GRID
                for _ in range(110):
                    c = (a + b) / 2
                    a, b = (a, c) if guard(m.after(state, c)) < 0 else (c, b)
                if best is None or b < best[0]:
                    best = (b, target)
            end, to = base + best[0], best[1]
        while wanted and wanted[0] <= end:
            at = wanted.pop(0)
            y = m.after(x, at - left)
            values += [(name, at, of(y)) for name, of in signals]
        if to is None or end >= STOP:
            break
        x, t, mode = m.after(x, end - t), end, to
        # The guard of the new mode starts at zero: put the state a hair past it.
        events.append((t, mode))
    return events, values


def show(name, events, values):
    for t, mode in events:
        print(f"{name},event,{mp.nstr(t, 17)},{mode}")
    for signal, t, value in values:
        print(f"{name},{signal},{mp.nstr(t, 17)},{mp.nstr(value, 17)}")


def oscillator(capacitance, conductance):
    return [[-conductance / capacitance, -1 / capacitance], [1 / L, 0]]


def main():
    print("circuit,signal,time,value")
    v_i = [("v(1)", lambda x: x[0]), ("i(l1)", lambda x: x[1])]

    # Half wave: R across the oscillator while v > 0.
    modes = {
        "on": Mode(oscillator(C, 1 / R), [(lambda x: x[0], "off")]),
        "off": Mode(oscillator(C, 0), [(lambda x: -x[0], "on")]),
    }
    show("rlcd", *solve(modes, "on", mp.matrix([10, 0]), v_i))

    # Bridge with resistor: R across the oscillator always.
    modes = {
        "plus": Mode(oscillator(C, 1 / R), [(lambda x: x[0], "minus")]),
        "minus": Mode(oscillator(C, 1 / R), [(lambda x: -x[0], "plus")]),
    }
    show("bridge-resistor", *solve(modes, "plus", mp.matrix([10, 0]), v_i))

    # Bridge with capacitor filter, state (v, i, vf): conducting, vf = ±v and the capacitances add.
    def conducting(sign):
        a = oscillator(C + CF, 1 / R)
        a = [[*a[0], 0], [*a[1], 0], [sign * a[0][0], sign * a[0][1], 0]]
        # The bridge's current, sign·(−i − C v') ≥ 0.
        def current(x):
            return sign * (-x[1] - C * (a[0][0] * x[0] + a[0][1] * x[1]))
        return Mode(a, [(current, "blocked")])

    blocked = Mode(
        [[0, -1 / C, 0], [1 / L, 0, 0], [0, 0, -1 / (R * CF)]],
        [(lambda x: x[2] - x[0], "plus"), (lambda x: x[2] + x[0], "minus")],
    )
    modes = {"plus": conducting(1), "minus": conducting(-1), "blocked": blocked}
    v0 = 10 * C / (C + CF)
    show("bridge-capacitor-filter",
         *solve(modes, "plus", mp.matrix([v0, 0, v0]), [*v_i, ("v(2,3)", lambda x: x[2])]))

    # Bridge on a cosine source with threshold, state (vf, cos, sin, 1).
    w, drop = mp.mpf(10) ** 4, mp.mpf("0.42")
    turn = [[0, 0, -w, 0], [0, w, 0, 0]]

    def driven(sign):
        # vf = sign·10 cos − drop
        a = [[0, 0, -sign * 10 * w, 0], [0, 0, -w, 0], [0, w, 0, 0], [0, 0, 0, 0]]
        return Mode(a, [(lambda x: CF * (-sign * 10 * w * x[2]) + x[0] / R, "blocked")])

    blocked = Mode(
        [[-1 / (R * CF), 0, 0, 0], turn[0], turn[1], [0, 0, 0, 0]],
        [(lambda x: x[0] + drop - 10 * x[1], "plus"), (lambda x: x[0] + drop + 10 * x[1], "minus")],
    )
    modes = {"plus": driven(1), "minus": driven(-1), "blocked": blocked}
    start = mp.matrix([10 - drop, 1, 0, 1])
    show("bridge-source", *solve(modes, "plus", start, [("v(2,3)", lambda x: x[0])]))


main()
