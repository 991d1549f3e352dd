#!/usr/bin/env python3
"""States of a random converter with exponential diodes, from its cards alone, by Radau IIA on their tableau.

    pip install python-flint numpy scipy
    tests/reference/radau.py NETLIST [--tol 1e-9] [--leak 1e-13] [--ideal EPS]

Node voltages, branch currents and states are unknowns of one algebraic system per stage, so that a diode whose current is that of an
inductor needs no shunt. A diode is given by one parameter s that is its voltage below the knee and follows its current above it:
v(s) and i(s) are both smooth, and Newton's method meets neither a huge slope nor a logarithm of nothing. Three stages (order 5) are taken,
two (order 3) tell the error; residuals and states are kept in extended precision. Events are found by steps that end there.
Cards are those that tests/converters/circuit.rs writes, read by digits.py; --ideal replaces 0 and infinite ohms by EPS and 1/EPS.
--leak is a conductance across every diode, S: where all of them block, nothing else ties the nodes between them. Events go to standard error.
"""

import argparse
import re
import sys

import numpy as np
from digits import Network, arb
from scipy.linalg import lu_factor, lu_solve

THERMAL = 1.380649e-23 * 300.15 / 1.602176634e-19  # k·T/q at 27 °C, V
ROOT = np.sqrt(np.longdouble(6))
THREE = (
    np.array([(4 - ROOT) / 10, (4 + ROOT) / 10, 1], dtype=np.longdouble),
    np.array(
        [
            [(88 - 7 * ROOT) / 360, (296 - 169 * ROOT) / 1800, (-2 + 3 * ROOT) / 225],
            [(296 + 169 * ROOT) / 1800, (88 + 7 * ROOT) / 360, (-2 - 3 * ROOT) / 225],
            [(16 - ROOT) / 36, (16 + ROOT) / 36, np.longdouble(1) / 9],
        ],
        dtype=np.longdouble,
    ),
)
THIRD = 1 / np.longdouble(3)
TWO = (np.array([THIRD, 1]), np.array([[5 * THIRD / 4, -THIRD / 4], [3 * THIRD * 3 / 4, THIRD * 3 / 4]]))
LONGEST = 20  # steps between two stops at least: a diode that turns on and off within one is not seen by either method
LONG = np.longdouble


class Failed(Exception):
    """Newton's method does not end."""


class Curved(Network):
    """The cards as branches; exponential diodes are ("curved", Is, n·k·T/q, Rs)."""

    def card(self, line, models, inductors, couplings):
        parts = line.split()
        if parts[0][0] == "d" and "is=" in models[parts[3]][1]:
            found = re.match(r"is=(\S+) n=(\S+) rs=(\S+)", models[parts[3]][1])
            saturation, n, ohms = map(float, found.groups())
            nodes = (self.node(parts[1]), self.node(parts[2]))
            self.add(nodes, ("curved", saturation, n * THERMAL, ohms), parts[0])
        else:
            super().card(line, models, inductors, couplings)

    def couple(self, inductors, couplings):
        """Windings without leakage have one state, Σ ratio·i, and v = ratio · v of the first; others as digits.py has them."""
        whole = {name for a, b, k in couplings if abs(k) >= 1 for name in (a, b)}
        self.groups = []
        if whole:
            assert all(abs(k) >= 1 for *_, k in couplings), "one transformer at a time"
            members = [entry for entry in inductors if entry[0] in whole]
            roots = [float(entry[1]) ** 0.5 for entry in members]
            signs = {members[0][0]: 1.0}
            for a, b, k in couplings:
                for one, other in ((a, b), (b, a)):
                    if one == members[0][0]:
                        signs[other] = float(k) / abs(float(k))
            ratios = [signs[m[0]] * r / roots[0] for m, r in zip(members, roots)]
            self.groups.append([(m[2], ratio, m[3]) for m, ratio in zip(members, ratios)])
            self.magnetising = float(members[0][1])
            couplings = []
            for _, henries, branch, state in members:
                self.rates[state] = []
            inductors = [entry for entry in inductors if entry[0] not in whole]
        super().couple(inductors, couplings)


class Tableau:
    """F z + G x + (u) = 0 with what diodes add; z = [node voltages, branch currents, parameters of diodes]."""

    def __init__(self, network, leak):
        self.network, self.leak = network, LONG(leak)
        self.free = len(network.nodes) - 1
        self.branches = [b for b in network.branches]
        self.curved = [k for k, (_, b, _) in enumerate(self.branches) if b[0] == "curved"]
        self.count = self.free + len(self.branches)
        self.size = self.count + len(self.curved)
        self.states = len(network.start)
        self.modes = {}
        laws = [self.branches[k][1] for k in self.curved]
        self.saturation = np.array([b[1] for b in laws], dtype=LONG)
        self.thermal = np.array([b[2] for b in laws], dtype=LONG)
        self.knee = self.thermal * np.log(self.thermal / self.saturation * LONG(0.1))

    def law(self, s):
        """v, i and their derivatives; above the knee s grows with the current, 0.1 S of slope each."""
        high = s > self.knee
        low = np.where(high, 0, s)
        below = self.saturation * np.expm1(low / self.thermal)
        g = LONG(0.1)
        at_knee = self.saturation * np.expm1(self.knee / self.thermal)
        over = at_knee + g * np.where(high, s - self.knee, 0)
        i = np.where(high, over, below)
        v = np.where(high, self.thermal * np.log1p(np.where(high, over, 0) / self.saturation), s)
        di = np.where(high, g, (below + self.saturation) / self.thermal)
        dv = np.where(high, self.thermal * g / (np.where(high, over, 0) + self.saturation), 1)
        return v, i + self.leak * v, dv, di + self.leak * dv

    def mode(self, position):
        if position in self.modes:
            return self.modes[position]
        network, free = self.network, self.free
        a = np.zeros((self.size, self.size), dtype=LONG)
        g = np.zeros((self.size, self.states), dtype=LONG)
        u = np.zeros((self.size, len(network.sources) + 1), dtype=LONG)
        group = {branch: (place, part) for part in network.groups for place, (branch, *_) in enumerate(part)}

        def volts(row, pins, factor):
            for node, sign in zip(pins, (factor, -factor)):
                if node:
                    a[row, node - 1] += sign

        for k, (nodes, branch, _) in enumerate(self.branches):
            row, kind, which = free + k, branch[0], branch[1]
            for node, sign in zip(nodes, (1, -1)):
                if node:
                    a[node - 1, row] += sign
            if k in group:
                place, part = group[k]
                if place == 0:
                    for other, ratio, _ in part:
                        a[row, free + other] += ratio
                    g[row, which] = -1
                else:
                    volts(row, nodes, 1)
                    volts(row, self.branches[part[0][0]][0], -part[place][1])
                continue
            if kind in "LI":
                a[row, row] += 1
            else:
                volts(row, nodes, 1)
            if kind in "CL":
                g[row, which] = -1
            elif kind in "VI":
                u[row, which] = -1
            elif kind == "R":
                a[row, row] -= LONG(float(which))
            elif kind == "E":
                volts(row, branch[2], -float(which))
            elif kind == "comparator":
                u[row, -1] = -float(branch[2 if position[which] else 3])
            elif kind == "curved":
                a[row, row] -= branch[3]
            else:
                a[row, row] -= LONG(float(branch[-2 if position[which] else -1]))
                if kind == "diode" and position[which]:
                    u[row, -1] = -float(branch[2])
        for k, place in enumerate(self.curved):
            a[self.count + k, free + place] = 1
        rates = np.zeros((self.states, self.size), dtype=LONG)
        for state, parts in enumerate(network.rates):
            for branch, factor, is_current in parts or []:
                self.rate(rates, state, branch, float(factor), is_current)
        for part in network.groups:
            self.rate(rates, part[0][2], part[0][0], 1 / network.magnetising, False)
        guards = np.zeros((len(network.devices), self.size), dtype=LONG)
        levels = np.zeros(len(network.devices), dtype=LONG)
        for k, (device, on) in enumerate(zip(network.devices, position)):
            if device[0] == "diode" and on:
                guards[k, free + device[1]] = 1
                levels[k] = float(device[3])
            else:
                pins = self.branches[device[1]][0] if device[0] == "diode" else device[1]
                for node, sign in zip(pins, (1, -1)):
                    if node:
                        guards[k, node - 1] += sign
                levels[k] = 0 if device[0] == "comparator" else float(device[2] if device[0] == "diode" else device[3 if on else 2])
            if not on:
                guards[k], levels[k] = -guards[k], -levels[k]
            if device[0] == "diode" and not on and device[4] is not None and not position[device[4]]:
                guards[k], levels[k] = 0, -1
        self.modes[position] = a, g, u, rates, guards, levels
        return self.modes[position]

    def rate(self, rates, state, branch, factor, is_current):
        if is_current:
            rates[state, self.free + branch] += factor
            return
        for node, sign in zip(self.branches[branch][0], (factor, -factor)):
            if node:
                rates[state, node - 1] += sign

    def residual(self, mode, z, x, u):
        a, g, of_u = mode[:3]
        r = a @ z + g @ x + of_u @ u
        v, i, dv, di = self.law(z[self.count :])
        for k, place in enumerate(self.curved):
            r[self.free + place] -= v[k]
            r[self.count + k] -= i[k]
        return r, dv, di

    def jacobian(self, mode, dv, di):
        j = mode[0].astype(float).copy()
        for k, place in enumerate(self.curved):
            j[self.free + place, self.count + k] -= float(dv[k])
            j[self.count + k, self.count + k] -= float(di[k])
        return j


def value(piece, t):
    if piece[0] == "sin":
        _, offset, amplitude, omega, phase = piece
        return LONG(offset) + LONG(amplitude) * np.sin(LONG(omega) * LONG(t) + LONG(phase))
    t0, level, slope = piece
    return LONG(level) + LONG(slope) * (LONG(t) - LONG(t0))


def number(x):
    return x if isinstance(x, str) else LONG(x.mid().str(25, radius=False))


def newton(step, start, enough):
    """Until corrections are rounding, or `enough`."""
    z, last = start.copy(), np.inf
    for _ in range(80):
        change = step(z)
        if not np.all(np.isfinite(change)):
            raise Failed
        largest = float(np.max(np.abs(change) / (1e-9 + np.abs(z))))
        z = z + change
        if largest < enough or (largest < 1e-9 and largest >= 0.3 * last):
            return z
        last = largest
    if last < 1e-8:
        return z
    raise Failed


def solved(matrix, right):
    scale = np.max(np.abs(matrix), axis=1)
    factors = lu_factor(matrix / scale[:, None], check_finite=False)
    return lu_solve(factors, np.asarray(right, dtype=float) / scale, check_finite=False)


class March:
    def __init__(self, network, tolerance, leak):
        self.network, self.tableau, self.tolerance = network, Tableau(network, leak), tolerance
        self.x = np.array([float(x) for x in network.start], dtype=LONG)
        self.amplitudes = np.abs(self.x).astype(float)
        self.position = tuple(False for _ in network.devices)
        self.z = np.zeros(self.tableau.size, dtype=LONG)
        self.t = LONG(0)
        self.steps = 0

    def sources(self, t):
        return np.array([value(p, t) for p in self.pieces] + [LONG(1)], dtype=LONG)

    def guards(self, z):
        *_, rows, levels = self.tableau.mode(self.position)
        size = np.abs(rows) @ np.abs(z) + np.abs(levels)
        return (rows @ z - levels) / np.where(size > 0, size, 1)

    def settle(self, crossed=()):
        before, devices = self.position, self.network.devices
        self.move(crossed)
        diodes = [k for k, d in enumerate(devices) if d[0] == "diode"]
        for _ in range(60):
            for turn in range(400):
                # After a moment: what rests on a threshold has left it, and what the states leave open while a current is blocked is known.
                self.z = self.step(self.near, TWO)[0][-1]
                wrong = [k for k, guard in enumerate(self.guards(self.z)) if guard < 0]
                if not any(k in diodes for k in wrong):
                    break
                wrong = [k for k in wrong if k in diodes]
                self.move(wrong if turn < 8 else wrong[:1])
            if not wrong:
                break
            self.move(wrong)
        else:
            sys.exit(f"switches do not settle at {self.t}")
        moved = [k for k, on in enumerate(self.position) if on != before[k]]
        if moved:
            names = [f"{devices[k][-1]} {'on' if self.position[k] else 'off'}" for k in moved]
            print(f"{self.t:.17e}: {', '.join(names)}", file=sys.stderr)

    def move(self, devices):
        self.position = tuple(on != (k in devices) for k, on in enumerate(self.position))

    def step(self, h, method, start=None, enough=1e-15):
        """Stages and the states after h; `start` is where Newton's method begins."""
        tableau, mode = self.tableau, self.tableau.mode(self.position)
        nodes, weights = method
        stages, size, rates, g = len(nodes), tableau.size, mode[3], mode[1]
        u = [self.sources(self.t + c * h) for c in nodes]
        gr = (g @ rates).astype(float)

        def step(z):
            z = z.reshape(stages, size)
            f = z @ rates.T
            x = self.x + h * (weights @ f)
            matrix = np.kron(np.asarray(h * weights, dtype=float), gr)
            right = np.empty(stages * size, dtype=LONG)
            for i in range(stages):
                r, dv, di = tableau.residual(mode, z[i], x[i], u[i])
                part = slice(i * size, (i + 1) * size)
                right[part] = r
                matrix[part, part] += tableau.jacobian(mode, dv, di)
            return -solved(matrix, right)

        start = np.tile(self.z, stages) if start is None else start
        z = newton(step, start, enough).reshape(stages, size)
        return z, self.x + h * (weights @ (z @ rates.T))[-1]

    def travel(self, stop):
        h, longest = min(self.near * 10, stop - self.t), (stop - self.t) / LONGEST
        while self.t < stop:
            h = min(h, longest, stop - self.t)
            if h < 1e-18 * stop:
                sys.exit(f"a step too small at {self.t}")
            try:
                z, x = self.step(h, THREE)
                # At a third of the step between the first two stages.
                part = (THIRD - THREE[0][0]) / (THREE[0][1] - THREE[0][0])
                start = np.concatenate([z[0] + part * (z[1] - z[0]), z[2]])
                _, other = self.step(h, TWO, start, 1e-9)
            except Failed:
                h = h / 4
                continue
            scale = np.maximum(self.amplitudes, np.abs(x).astype(float))
            scale = np.maximum(scale, 1e-4 * max(np.max(scale), 1e-12))
            error = float(np.max(np.abs(x - other).astype(float) / (self.tolerance * scale)))
            if error > 1:
                h = h * LONG(max(0.1, 0.9 * error**-0.25))
                continue
            larger = LONG(min(6.0, 0.9 * max(error, 1e-8) ** -0.25))
            if self.network.devices and (found := self.event(z, x, h)):
                (z, x), h, crossed = found
                self.take(z, x, h)
                self.settle(crossed)
                h = self.near * 10
                continue
            self.take(z, x, h)
            if stop - self.t < 1e-16 * stop:
                self.t = LONG(stop)
            h = h * larger

    def take(self, z, x, h):
        self.x, self.z, self.t = x, z[-1], self.t + h
        self.amplitudes = np.maximum(self.amplitudes, np.abs(x).astype(float))
        self.steps += 1

    def event(self, z, x, h):
        """The step that ends where the first guard is passed."""
        if not any(np.any(self.guards(stage) < -1e-13) for stage in z):
            return None
        low, high, best = LONG(0), h, None
        if not np.any(self.guards(z[-1]) < 0):
            for c, stage in zip(THREE[0], z):
                if np.any(self.guards(stage) < -1e-13):
                    high = c * h
                    break
            trial = self.step(high, THREE)
            if not np.any(self.guards(trial[0][-1]) < 0):
                return None
            z, x = trial
        best = (z, x), high
        at_high, at_low, turn = self.guards(z[-1]), self.guards(self.z), 0
        while high - low > 1e-18 * (self.t + high):
            parts = [max(a, LONG(0)) / (max(a, LONG(0)) - b) for a, b in zip(at_low, at_high) if b < 0]
            part = min(parts) if turn % 3 < 2 else LONG(0.5)
            part = part * (1 + LONG(1e-6)) if turn % 3 == 0 else part * (1 - LONG(1e-6))
            middle = low + (high - low) * min(max(part, LONG(1e-12)), 1 - LONG(1e-12))
            trial = self.step(middle, THREE)
            guards = self.guards(trial[0][-1])
            if np.any(guards < 0):
                high, at_high, best = middle, guards, (trial, middle)
            else:
                low, at_low = middle, guards
            turn += 1
            if turn > 120:
                break
        crossed = [k for k, guard in enumerate(at_high) if guard < 0]
        return *best, crossed

    def rows(self):
        network = self.network
        end = float(network.stop)
        corners = [(c, False) for s in network.sources for c in s.corners(end)]
        corners += [(network.stop * k / network.rows, True) for k in range(1, network.rows + 1)]
        stops = []
        for t, is_row in sorted(corners, key=lambda c: float(c[0])):
            if not 0 < float(t) <= end * (1 + 1e-12):
                continue
            if stops and abs(float(t - stops[-1][0])) < 1e-14 * end:
                stops[-1][1] |= is_row
            else:
                stops.append([t, is_row])
        begin = arb(0)
        for stop, is_row in stops:
            self.pieces = [tuple(number(p) for p in s.piece((begin + stop) / 2)) for s in network.sources]
            self.near = LONG(1e-7) * number(stop - begin)
            self.t = number(begin)
            self.settle()
            self.travel(number(stop))
            begin = stop
            if is_row:
                yield float(stop), self.x


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("netlist")
    parser.add_argument("--tol", type=float, default=1e-9)
    parser.add_argument("--leak", type=float, default=1e-13)
    parser.add_argument("--ideal", type=arb)
    asked = parser.parse_args()
    network = Curved(asked.netlist, asked.ideal, None)
    march = March(network, asked.tol, asked.leak)
    print(",".join(["time", *(f'"{name}"' for name in network.names)]))
    for t, states in march.rows():
        print(",".join(f"{float(x):.16e}" for x in (t, *states)), flush=True)
    print(f"{march.steps} steps", file=sys.stderr)


if __name__ == "__main__":
    main()
