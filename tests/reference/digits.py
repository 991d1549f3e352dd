#!/usr/bin/env python3
"""States of a random converter whose laws are lines, in 120 digits, from its cards alone.

    pip install python-flint
    tests/reference/digits.py NETLIST [--ideal EPS] [--shunt OHMS]

For every position of switches, comparators and diodes a tableau of node voltages and branch currents gives w' = A w and what keeps the
position; w moves by matrix exponentials over spans that double from the shortest time constant on, and an event is found between two
of them on values. Cards are those that tests/converters/circuit.rs writes. --ideal replaces 0 and infinite ohms by EPS and 1/EPS;
--shunt puts a resistance across every inductor, where a cut-set of inductors makes the tableau singular. Events go to standard error.
"""

import argparse
import re
import sys

from flint import arb, arb_mat, ctx

ctx.prec = 420
ZERO = arb("1e-60")  # of the sum of the terms of a quantity: it is zero
TIME = arb("1e-45")  # of the time: an event is found
GRID = 48  # looks at a span
ORDERS = 8  # derivatives that decide at rest


class Source:
    """A waveform: corners, and between two of them (t0, value, slope) or ("sin", offset, amplitude, omega, phase, damping)."""

    def __init__(self, text):
        match = re.match(r"(pwl|pulse|sin)\s*\((.*)\)", text.strip())
        self.kind = match.group(1) if match else "dc"
        self.values = [arb(v) for v in (match.group(2).split() if match else [text.strip()])]

    def corners(self, stop):
        if self.kind == "pwl":
            return self.values[0::2]
        if self.kind != "pulse":
            return []
        delay, rise, fall, width, period = self.values[2:7]
        begins = []
        while float(delay + len(begins) * period) <= stop:
            begins.append(delay + len(begins) * period)
        return [b + c for b in begins for c in (arb(0), rise, rise + width, rise + width + fall)]

    def piece(self, t):
        if self.kind == "sin":
            offset, amplitude, hertz = self.values[:3]
            return "sin", offset, amplitude, 2 * arb.pi() * hertz, self.values[5] * arb.pi() / 180, self.values[4]
        flat = arb(0)
        if self.kind == "dc":
            return flat, self.values[0], flat
        if self.kind == "pwl":
            times, levels = self.values[0::2], self.values[1::2]
            if t < times[0]:
                return flat, levels[0], flat
            for a in range(len(times) - 1):
                if times[a] <= t < times[a + 1]:
                    return times[a], levels[a], (levels[a + 1] - levels[a]) / (times[a + 1] - times[a])
            return flat, levels[-1], flat
        low, high, delay, rise, fall, width, period = self.values
        if t < delay:
            return flat, low, flat
        begin = delay + int(float((t - delay) / period)) * period
        begin = begin - period if t < begin else begin + period if t >= begin + period else begin
        into = t - begin
        if into < rise:
            return begin, low, (high - low) / rise
        if into < rise + width:
            return begin, high, flat
        if into < rise + width + fall:
            return begin + rise + width, high, (low - high) / fall
        return begin, low, flat


class Network:
    """The cards as branches, and the rows of each position over [states, sources, 1]."""

    def __init__(self, path, eps, shunt):
        self.eps = eps
        self.nodes, self.branches, self.devices, self.sources = {"0": 0}, [], [], []
        self.start, self.names, self.rates, self.modes = [], [], [], {}
        inductors, couplings, models = [], [], {}
        lines = self.lines(path)
        for line in lines:
            if match := re.match(r"\.model (\S+) (\w+)\s*\((.*)\)", line):
                models[match.group(1)] = match.group(2, 3)
        for line in lines:
            if line and line[0] not in ".*":
                self.card(line, models, inductors, couplings)
        self.couple(inductors, couplings)
        if shunt is not None:
            for nodes, branch, _ in list(self.branches):
                if branch[0] == "L":
                    self.add(nodes, ("R", shunt), "")
        step, stop = next(line for line in lines if line.startswith(".tran")).split()[1:3]
        self.stop, self.rows = arb(stop), round(float(stop) / float(step))

    def lines(self, path):
        """The cards."""
        return open(path).read().splitlines()[1:]

    def node(self, name):
        return self.nodes.setdefault(name, len(self.nodes))

    def add(self, nodes, branch, name):
        self.branches.append((nodes, branch, name))
        return len(self.branches) - 1

    def on(self, ohms):
        return ohms if self.eps is None else ohms + self.eps

    def off(self, ohms):
        if ohms is None:
            assert self.eps is not None, "infinite resistances: --ideal"
            return 1 / self.eps
        return ohms if self.eps is None else 1 / (1 / ohms + self.eps)

    def diode(self, nodes, vfwd, ron, roff, name, gate=None):
        """Of a thyristor `gate` is the device without which it stays off."""
        current = vfwd / (roff - ron)
        self.devices.append(("diode", len(self.branches), roff * current, current, gate, name))
        self.add(nodes, ("diode", len(self.devices) - 1, vfwd, ron, roff), name)

    def switch(self, nodes, control, levels, ohms, name):
        self.devices.append(("switch", control, *levels, name))
        self.add(nodes, ("switch", len(self.devices) - 1, *ohms), name)

    def card(self, line, models, inductors, couplings):
        parts = line.split()
        name, kind = parts[0], parts[0][0]
        if kind == "k":
            return couplings.append((parts[1], parts[2], arb(parts[3])))
        nodes = (self.node(parts[1]), self.node(parts[2]))

        def value(text, key, default=None):
            found = re.search(key + r"=\s*(\S+)", text)
            if not found:
                return default
            return None if found.group(1) == "inf" else arb(found.group(1))

        if kind == "r":
            self.add(nodes, ("R", arb(parts[3])), name)
        elif kind in "cl":
            self.start.append(arb(parts[4].removeprefix("ic=")))
            branch = self.add(nodes, (kind.upper(), len(self.start) - 1), name)
            if kind == "c":
                self.rates.append([(branch, 1 / arb(parts[3]), True)])
                self.names.append(f"v({parts[1]})" if parts[2] == "0" else f"v({parts[1]},{parts[2]})")
            else:
                self.rates.append(None)
                self.names.append(f"i({name})")
                inductors.append((name, arb(parts[3]), branch, len(self.start) - 1))
        elif kind in "vi":
            self.sources.append(Source(" ".join(parts[3:])))
            self.add(nodes, (kind.upper(), len(self.sources) - 1), name)
        elif kind == "s":
            text = models[parts[5]][1]
            ideal = "ideal" in text
            ohms = self.on(arb(0) if ideal else value(text, "ron")), self.off(None if ideal else value(text, "roff"))
            vt, vh = value(text, "vt"), value(text, "vh", arb(0))
            self.switch(nodes, (self.node(parts[3]), self.node(parts[4])), (vt + vh, vt - vh), ohms, name)
        elif kind == "d":
            text = models[parts[3]][1]
            assert "is=" not in text, "exponential diodes"
            vfwd, ron = value(text, "vfwd", arb(0)), value(text, "ron", arb(0))
            self.diode(nodes, vfwd, self.on(ron), self.off(value(text, "roff")), name)
        elif kind == "x":
            nodes, control = (nodes[0], self.node(parts[3])), (nodes[1], self.node(parts[3]))
            text = models[parts[4]][1]
            ron, roff = self.on(value(text, "ron")), self.off(value(text, "roff"))
            # Roff stands across the whole of it.
            part = roff / (ron + roff)
            self.diode(nodes, value(text, "vfwd") * part, ron * part, roff, name, len(self.devices) + 1)
            level = value(text, "vgt")
            self.devices.append(("switch", control, level, level, name + ".gate"))
        elif kind == "m":
            polarity, text = models[parts[4]]
            drain, gate, source = (self.node(n) for n in parts[1:4])
            control, body, level = (gate, source), (source, drain), value(text, "vto")
            if polarity == "pmos":
                control, body, level = (source, gate), (drain, source), -level
            ohms = self.on(value(text, "ron")), self.off(value(text, "rds"))
            self.switch((drain, source), control, (level, level), ohms, name)
            self.diode(body, arb(0), self.on(value(text, "rb", arb(0))), self.off(None), name + ".body")
        elif kind == "e" and "VALUE" not in line:
            self.add(nodes, ("E", arb(parts[5]), (self.node(parts[3]), self.node(parts[4]))), name)
        else:
            control = tuple(self.node(n) for n in re.search(r"v\((\w+),(\w+)\)", line).groups())
            if match := re.search(r"\? (\S+) : (\S+)$", line) or re.search(r">0,([^,]+),([^)]+)\)", line):
                high, low = map(arb, match.groups())
            else:
                low, rise = map(arb, re.search(r"V=(\S+)\+(\S+?)\*u", line).groups())
                high = low + rise
            self.devices.append(("comparator", control, name))
            self.add(nodes, ("comparator", len(self.devices) - 1, high, low), name)

    def couple(self, inductors, couplings):
        count = len(inductors)
        if not count:
            return
        matrix = arb_mat(count, count)
        for k, (_, henries, _, _) in enumerate(inductors):
            matrix[k, k] = henries
        place = [name for name, *_ in inductors].index
        for one, other, k in couplings:
            i, j = place(one), place(other)
            k = k * (1 - arb("1e-30")) if abs(k) >= 1 else k
            matrix[i, j] = matrix[j, i] = k * (inductors[i][1] * inductors[j][1]).sqrt()
        inverse = matrix.inv()
        for i, (*_, state) in enumerate(inductors):
            self.rates[state] = [(inductors[j][2], inverse[i, j], False) for j in range(count)]

    def mode(self, position):
        """Rates of the states, and what is positive while each device keeps its position."""
        if position in self.modes:
            return self.modes[position]
        free, states = len(self.nodes) - 1, len(self.start)
        size, width = free + len(self.branches), states + len(self.sources) + 1
        a, b = arb_mat(size, size), arb_mat(size, width)
        for k, (nodes, branch, _) in enumerate(self.branches):
            row = free + k
            for node, sign in zip(nodes, (1, -1)):
                if node:
                    a[node - 1, row] += sign

            def volts(pins, factor):
                for node, sign in zip(pins, (factor, -factor)):
                    if node:
                        a[row, node - 1] += sign

            kind, which = branch[0], branch[1]
            if kind in "LI":
                a[row, row] += 1
            else:
                volts(nodes, 1)
            if kind in "CL":
                b[row, which] = 1
            elif kind in "VI":
                b[row, states + which] = 1
            elif kind == "R":
                a[row, row] += -which
            elif kind == "E":
                volts(branch[2], -which)
            elif kind == "comparator":
                b[row, width - 1] = branch[2 if position[which] else 3]
            else:
                a[row, row] += -branch[-2 if position[which] else -1]
                if kind == "diode" and position[which]:
                    b[row, width - 1] = branch[2]
        solved = a.solve(b)

        def quantity(place):
            return [solved[place, j] for j in range(width)]

        def volts_of(pins):
            p, n = (quantity(pin - 1) if pin else [arb(0)] * width for pin in pins)
            return [x - y for x, y in zip(p, n)]

        rates = []
        for parts in self.rates:
            terms = [(quantity(free + k) if current else volts_of(self.branches[k][0]), f) for k, f, current in parts]
            rates.append([sum((row[j] * f for row, f in terms), arb(0)) for j in range(width)])
        guards = []
        for device, on in zip(self.devices, position):
            if device[0] == "switch":
                row, level = volts_of(device[1]), device[3 if on else 2]
            elif device[0] == "comparator":
                row, level = volts_of(device[1]), arb(0)
            elif on:
                row, level = quantity(free + device[1]), device[3]
            elif device[4] is not None and not position[device[4]]:
                row, level = [arb(0)] * width, arb(1)
            else:
                row, level = volts_of(self.branches[device[1]][0]), device[2]
            row[-1] = row[-1] - level
            guards.append(row if on else [-x for x in row])
        self.modes[position] = rates, guards
        return self.modes[position]


def middle(matrix):
    return arb_mat(matrix.nrows(), matrix.ncols(), [x.mid() for x in matrix.entries()])


class Run:
    """w = [states, 1, time since the last stop, sine and cosine of each sine]."""

    def __init__(self, network):
        self.network, self.t = network, arb(0)
        self.states = list(network.start)
        self.position = tuple(False for _ in network.devices)

    def begin(self, pieces):
        self.pieces, self.systems, self.t0 = pieces, {}, self.t
        self.n = len(self.states)
        self.sines = [k for k, p in enumerate(pieces) if p[0] == "sin"]
        w = [*self.states, arb(1), arb(0)]
        for k in self.sines:
            omega, phase, damping = pieces[k][3:]
            angle, size = omega * self.t + phase, (-damping * self.t).exp()
            w += [size * angle.sin(), size * angle.cos()]
        self.w = arb_mat(len(w), 1, w)

    def over_w(self, row):
        n = self.n
        out = row[:n] + [row[-1], arb(0)] + [arb(0)] * (2 * len(self.sines))
        for k, piece in enumerate(self.pieces):
            c = row[n + k]
            if piece[0] == "sin":
                out[n] += c * piece[1]
                out[n + 2 + 2 * self.sines.index(k)] += c * piece[2]
            else:
                out[n] += c * (piece[1] + piece[2] * (self.t0 - piece[0]))
                out[n + 1] += c * piece[2]
        return out

    def system(self):
        """The generator and the guards of the present position."""
        if self.position not in self.systems:
            rates, guards = self.network.mode(self.position)
            dim = self.w.nrows()
            generator = arb_mat(dim, dim)
            for i, row in enumerate(rates):
                for j, x in enumerate(self.over_w(row)):
                    generator[i, j] = x
            generator[self.n + 1, self.n] = 1
            for q, k in enumerate(self.sines):
                i, (omega, _, damping) = self.n + 2 + 2 * q, self.pieces[k][3:]
                generator[i, i + 1], generator[i + 1, i] = omega, -omega
                generator[i, i] = generator[i + 1, i + 1] = -damping
            self.systems[self.position] = generator, [arb_mat([self.over_w(g)]) for g in guards]
        return self.systems[self.position]

    def leaves(self, k):
        """Whether device k leaves its position now: the first derivative of its guard that is not zero decides."""
        generator, guards = self.system()
        row, sizes = guards[k], arb_mat(self.w.nrows(), 1, [abs(x) for x in self.w.entries()])
        for _ in range(ORDERS):
            value = (row * self.w)[0, 0]
            size = (arb_mat([[abs(x) for x in row.entries()]]) * sizes)[0, 0]
            if abs(value).mid() > (size * ZERO).mid():
                return value < 0
            row = row * generator
        device = self.network.devices[k]
        return self.position[k] and device[0] == "switch" and bool(device[2] == device[3])

    def move(self, devices):
        self.position = tuple(on != (k in devices) for k, on in enumerate(self.position))

    def settle(self):
        """Diodes until all agree (all at once, then one by one), then all switches whose control has passed."""
        before = self.position
        diodes = [k for k, d in enumerate(self.network.devices) if d[0] == "diode"]
        others = [k for k in range(len(self.network.devices)) if k not in diodes]
        for _ in range(60):
            for turn in range(400):
                wrong = [k for k in diodes if self.leaves(k)]
                if not wrong:
                    break
                self.move(wrong if turn < 8 else wrong[:1])
            else:
                sys.exit("diodes do not settle")
            wrong = [k for k in others if self.leaves(k)]
            if not wrong:
                break
            self.move(wrong)
        else:
            sys.exit("switches do not settle")
        moved = [k for k, on in enumerate(self.position) if on != before[k]]
        if moved:
            self.tell(self.t, [(self.network.devices[k][-1], self.position[k]) for k in moved])

    def tell(self, t, changes):
        """What devices change at t, to which position."""
        names = [f"{name} {'on' if on else 'off'}" for name, on in changes]
        print(f"{float(t):.17e}: {', '.join(names)}", file=sys.stderr)

    def travel(self, stop):
        while True:
            generator, guards = self.system()
            span = stop - self.t
            found = self.first_event(generator, guards, span) if guards else None
            if found is None:
                self.w, self.t = middle((generator * span).exp() * self.w), stop
                return
            self.w, after = found
            self.t = (self.t + after).mid()
            self.settle()
            if not span - after > 0:
                return

    def first_event(self, generator, guards, span):
        norm = max(abs(float(x)) for x in generator.entries())
        step = arb(min(float(span) / GRID, 0.25 / max(norm, 1e-300)))
        doubled, w, t = middle((generator * step).exp()), self.w, arb(0)
        while step * GRID < span:
            after = middle(doubled * self.w)
            if found := self.crossed(generator, guards, (w, t), (after, step)):
                return found
            w, t = after, step
            doubled, step = middle(doubled * doubled), 2 * step
        step = (span - t) / GRID
        one = middle((generator * step).exp())
        for _ in range(GRID):
            after = middle(one * w)
            if found := self.crossed(generator, guards, (w, t), (after, t + step)):
                return found
            w, t = after, t + step
        return None

    def crossed(self, generator, guards, start, end):
        (w0, t0), (w1, t1) = start, end
        value = lambda g, w: (g * w)[0, 0]
        if all(not value(g, w1) < 0 for g in guards):
            for g in guards:
                third = (t1 - t0) / 3
                slopes = value(g, generator * w0), value(g, generator * w1)
                if not (slopes[0] < 0 and slopes[1] > 0) or float(third) < 1e-30:
                    continue
                if min(float(value(g, w0) + slopes[0] * third), float(value(g, w1) - slopes[1] * third)) < 0:
                    half = (t0 + t1) / 2
                    between = middle((generator * (half - t0)).exp() * w0), half
                    first = self.crossed(generator, guards, start, between)
                    return first or self.crossed(generator, guards, between, end)
            return None
        turn = 0
        while t1 - t0 > TIME * (self.t + t1):
            part = arb("0.5")
            if turn % 3 < 2:
                ends = [(value(g, w0), value(g, w1)) for g in guards]
                chords = [a / (a - b) if a > 0 else arb(0) for a, b in ends if b < 0]
                part = min(chords, key=float)
                # A little to either side in turn, so that both ends come closer.
                part = part * (1 + arb("1e-9")) if turn % 3 == 0 else part * (1 - arb("1e-9"))
            t = (t0 + (t1 - t0) * part).mid()
            if not t0 < t < t1:
                t = ((t0 + t1) / 2).mid()
            w = middle((generator * (t - t0)).exp() * w0)
            if any(value(g, w) < 0 for g in guards):
                w1, t1 = w, t
            else:
                w0, t0 = w, t
            turn += 1
        return w1, t1.mid()

    def rows(self):
        network = self.network
        corners = [(c, False) for s in network.sources for c in s.corners(float(network.stop))]
        corners += [(network.stop * k / network.rows, True) for k in range(1, network.rows + 1)]
        stops = []
        for t, is_row in sorted(corners, key=lambda c: float(c[0])):
            if not 0 < float(t) <= float(network.stop) * (1 + 1e-12):
                continue
            if stops and abs(float(t - stops[-1][0])) < 1e-14 * float(network.stop):
                stops[-1][1] |= is_row
            else:
                stops.append([t, is_row])
        for stop, is_row in stops:
            self.begin([s.piece((self.t + stop) / 2) for s in network.sources])
            self.settle()
            self.travel(stop)
            self.states, self.t = [self.w[i, 0] for i in range(self.n)], stop
            if is_row:
                yield stop, self.states


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("netlist")
    parser.add_argument("--ideal", type=arb)
    parser.add_argument("--shunt", type=arb)
    asked = parser.parse_args()
    network = Network(asked.netlist, asked.ideal, asked.shunt)
    print(",".join(["time", *(f'"{name}"' for name in network.names)]))
    for t, states in Run(network).rows():
        print(",".join(f"{float(x):.16e}" for x in (t, *states)))


if __name__ == "__main__":
    main()
