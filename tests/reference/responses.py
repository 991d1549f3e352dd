#!/usr/bin/env python3
"""Responses of random converters about their orbits, against orbits of several periods that have a small sine in a source.

    pip install './python[all]'
    CIRC_CONVERTERS_DECKS=FOLDER cargo test --test converters decks
    tests/reference/responses.py FOLDER/*.cir [--seed 1] [--rows 6000]

Of each netlist with a constant source, that source gets V (1 + ε sin 2πft) with f = m/(kT), T the period of the orbit, and the other sign; half the
difference of the two orbits of k periods, over εV, has the response at f as its Fourier coefficient, off by ε². Signals are voltages of capacitors and
currents of inductors that are not coupled: what jumps, as the currents of windings do, has pulses narrower than rows at edges that move. Where the two
are further apart than TOLERANCE of the whole response, sidebands included, a smaller ε has to bring them closer, and more rows. Where several orbits
exist (peak-current control beyond half of the period) the sine may lead to another one; that is told, and not compared.
"""

import argparse
import random
import sys
from pathlib import Path

import numpy as np

import circ

TOLERANCE = 3e-3
EPSILON = 1e-4
SMALLER = 2.5e-5
FINER = 4
BRANCH = 3.0  # what two orbits are apart grows beside ε: they are none of one family
LEFT_OUT = (".meas", ".end", ".save", ".print")


def read(path):
    """Title and cards, without what is measured and shown."""
    title, *cards = Path(path).read_text().splitlines()
    return title, [card for card in cards if card.split() and not card.lower().startswith(LEFT_OUT)]


def signals(cards):
    words = [card.lower().split() for card in cards]
    coupled = any(card[0][0] == "k" for card in words)
    inductors = [] if coupled else [card for card in words if card[0][0] == "l"][:3]
    capacitors = [card for card in words if card[0][0] == "c"][:2]
    across = [f"v({c[1]},{c[2]})" if c[2] != "0" else f"v({c[1]})" for c in capacitors]
    return [f"i({inductor[0]})" for inductor in inductors] + across


def constant_sources(cards):
    def is_constant(card):
        words = card.split()
        return words[0][0].lower() == "v" and len(words) == 4 and "(" not in card

    return [at for at, card in enumerate(cards) if is_constant(card)]


def model(title, cards, source, value, *more):
    at, words = source, cards[source].split()
    changed = [*cards[:at], " ".join([*words[:3], value]), *cards[at + 1 :]]
    return circ.parse("\n".join([title, *changed, *more, ".end", ""]))


def perturbed(title, cards, source, probes, frequency, span, rows, part):
    """The response by two orbits with a sine of this part of the source's value, and how large all of it is."""
    value = float(cards[source].split()[3])
    size, uic = part * abs(value), " uic" if any("uic" in card.lower() for card in cards) else ""
    cards = [f".tran {span / rows!r} {span!r}{uic}" if card.lower().startswith(".tran") else card for card in cards]
    grid = np.arange(rows) * span / rows
    sides = []
    for sign in (1, -1):
        own = model(title, cards, source, f"sin({value!r} {sign * size!r} {frequency!r})", ".save " + " ".join(probes))
        orbit = own.pss(period=span, probes=probes)
        sides.append([np.interp(grid, np.asarray(orbit.time), np.asarray(orbit[probe])) for probe in probes])
    apart = (np.array(sides[0]) - np.array(sides[1])) / (2 * size)
    turned = np.exp(-2j * np.pi * frequency * grid)
    return 2j * (apart * turned).mean(axis=1), np.sqrt((apart**2).mean(axis=1))


def compared(path, draw, rows):
    """By signal: its name, the response, that of the orbits, and whether they agree. `None` where there is nothing to compare."""
    title, cards = read(path)
    sources, probes = constant_sources(cards), signals(cards)
    if not sources or not probes:
        return None
    source = draw.choice(sources)
    orbit = circ.parse("\n".join([title, *cards, ".end", ""])).pss()
    k = draw.choice([3, 5])
    m = draw.choice([m for m in range(1, 4 * k) if m % k])
    period = float(orbit.pss["period"])
    frequency, span = m / (k * period), k * period
    value = cards[source].split()[3]
    response = model(title, cards, source, f"dc {value} ac 1").ac([frequency], probes=probes)
    own = np.array([complex(np.asarray(response[probe]).ravel()[0]) for probe in probes])
    asked = (title, cards, source, probes, frequency, span)

    def off(found, size):
        return np.abs(found - own) / np.maximum(np.maximum(size, np.abs(own)), 1e-9)

    found, size = perturbed(*asked, rows, EPSILON)
    agree = off(found, size) <= TOLERANCE
    if not agree.all():
        apart = off(found, size)
        found, finer = perturbed(*asked, FINER * rows, SMALLER)
        if (finer > BRANCH * size).any():
            print(f"{path}: the sine leads to another orbit")
            return None
        agree |= off(found, finer) <= np.maximum(TOLERANCE, apart / FINER)
    return list(zip(probes, own, found, agree))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("netlists", nargs="+")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rows", type=int, default=6000)
    asked = parser.parse_args()
    draw, responses, circuits, wrong = random.Random(asked.seed), 0, 0, 0
    for path in asked.netlists:
        try:
            found = compared(path, draw, asked.rows)
        except circ.SimulationError as error:
            print(f"{path}: {error}")
            continue
        circuits += found is not None
        for probe, own, other, agree in found or []:
            responses += 1
            if not agree:
                wrong += 1
                print(f"{path} {probe}: {own:.6g}, by orbits {other:.6g}")
    print(f"{responses} responses of {circuits} circuits, {wrong} do not agree")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
