#!/usr/bin/env python3
"""A circuit of exponential diodes and transistors by a stiff solver of smooth equations, for peers.py.

    peers_smooth.py NETLIST SETTING(JSON) OUT.npz      prints the CPU seconds of the solver, its steps and evaluations

Unknowns are the voltages x of capacitors (there are no inductors), z = (voltages of nodes, currents of voltage sources and capacitors), in the equations
C x' = i_C and F(x, z, t) = 0: Kirchhoff's laws with i = Is (exp(v/a) − 1) − Ibv exp(−(v + BV)/a) of every junction, Ebers and Moll's for transistors. SUNDIALS IDA solves both together, SciPy's
Radau x' = f(x, t) with Newton's method for z in every evaluation. Both are given the exact matrix of derivatives. Without arguments it is what starting costs.
"""

import json
import math
import re
import sys
import time

import numpy as np
from scipy.integrate import solve_ivp
from sksundae.ida import IDA

THERMAL = 1.380649e-23 * 300.15 / 1.602176634e-19  # k·T/q at 27 °C, V
STEEPEST = 80.0  # exponents beyond are continued by a line: Newton's method comes by


class Network:
    """z = (nodes, inner nodes, currents of sources, currents of capacitors): F = M z + W f(P z) − B x − s(t)."""

    def __init__(self, circuit, number):
        models = {c[1]: (c[2], dict(re.findall(r"(\w+)=([\w.+-]+)", " ".join(c[2:])))) for c in (line.split() for line in circuit.text.splitlines()) if c[:1] == [".model"]}
        self.names, self.lines, self.junctions, self.follows = [], [], [], []
        self.at = lambda node: None if node == "0" else self.names.index(node) if node in self.names else self.names.append(node) or len(self.names) - 1
        ports = []
        for card in circuit.cards:
            name, pins = card[0], [self.at(node) for node in card[1:3]]
            if name[0] == "r":
                self.lines.append((*pins, 1 / number(card[3])))
            elif name[0] in "vc":
                ports.append((name, pins, card))
            elif name[0] == "d":
                self.diode(name, pins, models[card[3]][1], number)
            elif name[0] == "q":
                self.transistor(name, card, models[card[4]][1], number)
        nodes = len(self.names)
        size = nodes + len(ports)
        self.matrix = np.zeros((size, size))
        for a, b, siemens in self.lines:
            self.stamp(self.matrix, a, b, siemens)
        storage = [p for p in ports if p[0][0] == "c"]
        self.farads = np.array([number(card[3]) for *_, card in storage])
        self.drives, self.b = [], np.zeros((size, len(storage)))
        for k, (name, pins, card) in enumerate(ports):
            row = nodes + k
            for pin, sign in zip(pins, (1.0, -1.0)):
                if pin is not None:
                    self.matrix[pin, row] += sign
                    self.matrix[row, pin] += sign
            if name[0] == "c":
                self.b[row, [p[0] for p in storage].index(name)] = 1.0
            else:
                self.drives.append((row, self.wave(" ".join(card[3:]), number)))
        self.capacitors = np.array([nodes + k for k, p in enumerate(ports) if p[0][0] == "c"])
        self.currents = {f"i({name})": nodes + k for k, (name, *_) in enumerate(ports)}
        self.pins, self.weights = np.zeros((len(self.junctions), size)), np.zeros((size, len(self.junctions)))
        for k, (a, b, *_) in enumerate(self.junctions):
            for pin, sign in ((a, 1.0), (b, -1.0)):
                if pin is not None:
                    self.pins[k, pin] = sign
                    self.weights[pin, k] += sign
        for a, b, k, factor in self.follows:
            for pin, sign in ((a, factor), (b, -factor)):
                if pin is not None:
                    self.weights[pin, k] += sign
        column = lambda j: np.array([junction[j] for junction in self.junctions])
        self.saturation, self.slope, self.bv, self.ibv = (column(j) for j in range(2, 6))

    @staticmethod
    def stamp(matrix, a, b, siemens):
        for i, j, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
            if i is not None and j is not None:
                matrix[i, j] += sign * siemens

    def behind(self, name, pin, ohms):
        """The node behind a resistance."""
        if ohms == 0:
            return pin
        inner = self.at(name)
        self.lines.append((pin, inner, 1 / ohms))
        return inner

    def diode(self, name, pins, model, number):
        value = lambda key, default: number(model.get(key, default))
        inner = self.behind(f"{name}.inner", pins[0], value("rs", "0"))
        slope, ibv = value("n", "1") * THERMAL, value("ibv", "1m") if "bv" in model else 0.0
        self.junctions.append((inner, pins[1], value("is", "1e-14"), slope, value("bv", "0"), ibv))

    def transistor(self, name, card, model, number):
        value = lambda key, default: number(model.get(key, default))
        c, b, e = (self.behind(f"{name}.{key}", self.at(node), value(key, "0")) for key, node in zip(("rc", "rb", "re"), card[1:4]))
        saturation = value("is", "1e-16")
        for pin, gain, sign in ((e, value("bf", "100"), 1), (c, value("br", "1"), -1)):
            # The transport current leaves the collector towards the emitter: gain times what the junction carries.
            self.follows.append((c, e, len(self.junctions), sign * gain))
            self.junctions.append((b, pin, saturation / gain, THERMAL, 0.0, 0.0))

    @staticmethod
    def wave(text, number):
        found = re.match(r"(?:sin\()?([^)]*)", text)
        values = [number(word) for word in found[1].split()]
        offset, amplitude, hertz = values if len(values) == 3 else (values[0], 0.0, 0.0)
        return lambda t: offset + amplitude * math.sin(2 * math.pi * hertz * t), 2 * math.pi * hertz * amplitude

    def exponential(self, u):
        steep = np.exp(np.minimum(u, STEEPEST))
        return steep * (1 + np.maximum(u - STEEPEST, 0)), steep

    def laws(self, z):
        """Currents of the junctions and their slopes."""
        v = self.pins @ z
        forward, slope = self.exponential(v / self.slope)
        back, steep = self.exponential(-(v + self.bv) / self.slope)
        current = self.saturation * (forward - 1) - self.ibv * back
        return current, (self.saturation * slope + self.ibv * steep) / self.slope

    def residual(self, z, x, t):
        current, slope = self.laws(z)
        out = self.matrix @ z + self.weights @ current - self.b @ x
        for row, (wave, _) in self.drives:
            out[row] -= wave(t)
        return out, slope

    def jacobian(self, slope):
        return self.matrix + self.weights @ (slope[:, None] * self.pins)

    def solve(self, z, x, t):
        """z where F = 0 to rounding, by Newton's method from z, with steps of at most a volt; and the matrix there."""
        before = math.inf
        for _ in range(400):
            out, slope = self.residual(z, x, t)
            matrix = self.jacobian(slope)
            change = np.linalg.solve(matrix, -out)
            nodes = np.abs(change[: len(self.names)]).max()
            z = z + change / max(1.0, nodes)
            if nodes <= 1e-9 and nodes >= before / 4:
                break
            before = nodes
        return z, matrix

    def start(self):
        """The operating point: capacitors that carry nothing."""
        size, states = len(self.matrix), len(self.farads)
        # x is unknown, and the currents of capacitors are 0.
        y = np.zeros(size + states)
        for _ in range(2000):
            out, slope = self.residual(y[:size], y[size:], 0.0)
            rest = np.concatenate([out, y[self.capacitors]])
            matrix = np.zeros((size + states, size + states))
            matrix[:size, :size] = self.jacobian(slope)
            matrix[:size, size:] = -self.b
            matrix[size + np.arange(states), self.capacitors] = 1.0
            change = np.linalg.solve(matrix, -rest)
            largest = np.abs(change).max()
            y = y + change / max(1.0, largest / 0.2)
            if largest < 1e-14:
                break
        return y[:size], y[size:]


def by_ida(network, stop, rtol):
    size, states = len(network.matrix), len(network.farads)
    calls = [0]

    def residual(t, y, yp, res):
        calls[0] += 1
        out, _ = network.residual(y[:size], y[size:], t)
        res[:size] = out
        res[size:] = network.farads * yp[size:] - y[network.capacitors]

    def jacobian(t, y, yp, res, cj, matrix):
        _, slope = network.laws(y[:size])
        matrix[:, :] = 0.0
        matrix[:size, :size] = network.jacobian(slope)
        matrix[:size, size:] = -network.b
        matrix[size + np.arange(states), network.capacitors] = -1.0
        matrix[size + np.arange(states), size + np.arange(states)] = cj * network.farads

    z, x = network.start()
    y = np.concatenate([z, x])
    yp = np.zeros_like(y)
    yp[size:] = z[network.capacitors] / network.farads
    forced = network.b @ yp[size:]
    for row, (_, slope) in network.drives:
        forced[row] += slope
    yp[:size] = np.linalg.solve(network.jacobian(network.laws(z)[1]), forced)
    scale = rtol * 1e-3
    solver = IDA(residual, rtol=rtol, atol=scale, algebraic_idx=list(range(size)), jacfn=jacobian, max_num_steps=10**7, max_step=stop / 50)
    found = solver.solve(np.array([0.0, stop]), y, yp)
    if not found.success:
        raise SystemExit(f"IDA: {found.message}")
    return found.t, found.y.T, calls[0]


def by_radau(network, stop, rtol):
    z, x = network.start()
    last = [z]

    def rate(t, x):
        last[0], _ = network.solve(last[0], x, t)
        return last[0][network.capacitors] / network.farads

    def jacobian(t, x):
        z, matrix = network.solve(last[0], x, t)
        return np.linalg.solve(matrix, network.b)[network.capacitors] / network.farads[:, None]

    found = solve_ivp(rate, (0.0, stop), x, method="Radau", rtol=rtol, atol=rtol * 1e-3, jac=jacobian, max_step=stop / 50)
    if not found.success:
        raise SystemExit(f"Radau: {found.message}")
    last[0] = z
    rows = []
    for t, x in zip(found.t, found.y.T):
        last[0], _ = network.solve(last[0], x, t)
        rows.append(np.concatenate([last[0], x]))
    return found.t, np.array(rows).T, found.nfev


def main():
    from peers_programs import Circuit, number

    circuit, setting = Circuit(sys.argv[1]), json.loads(sys.argv[2])
    network = Network(circuit, number)
    begun = time.process_time()
    if setting["solver"] == "IDA":
        t, y, evaluations = by_ida(network, circuit.stop, setting["rtol"])
    else:
        t, y, evaluations = by_radau(network, circuit.stop, setting["rtol"])
    print(time.process_time() - begun, len(t) - 1, evaluations)
    data = {"time": t} | {f"v({name})": y[k] for k, name in enumerate(network.names) if "." not in name}
    data |= {name: y[k] for name, k in network.currents.items() if name[2] == "v"}
    laws = [network.laws(column)[0] for column in y[: len(network.matrix)].T]
    data |= {f"i({name})": np.array([law[k] for law in laws]) for k, name in enumerate(circuit.diodes)}
    np.savez(sys.argv[3], **data)


if __name__ == "__main__" and len(sys.argv) > 1:
    main()
