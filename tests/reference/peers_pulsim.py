#!/usr/bin/env python3
"""A circuit of peers.py by the package `pulsim`: peers_pulsim.py NETLIST SETTING(JSON) OUT.npz prints the CPU seconds of `simulate`.

Without arguments it is what starting costs. Diodes and switches are its resistive ones of 1 µΩ (or `ron`) and 1 GΩ (or `roff`), its finest sensible ideal.
"""

import json
import math
import re
import sys
import time

import numpy as np
import pulsim as ps

ON, OFF = 1e6, 1e-9


def build(circuit, number):
    """Its builder, and the schedule of its switch where it has one."""
    b = ps.CircuitBuilder()
    models = {c[1]: dict(re.findall(r"(\w+)=([\w.]+)", " ".join(c[2:]))) for c in (line.split() for line in circuit.text.splitlines()) if c[:1] == [".model"]}
    gates, schedule = {}, None
    devices = [c for c in circuit.cards if c[0][0] in "ds"]
    for card in circuit.cards:
        name, plus, minus = card[:3]
        start = {key: number(value) for key, value in (word.split("=") for word in card[4:] if "=" in word)}.get("ic", 0.0)
        if name[0] == "r":
            b.add_resistor(name, plus, minus, number(card[3]))
        elif name[0] == "c":
            b.add_capacitor(name, plus, minus, number(card[3]), start)
        elif name[0] == "l":
            b.add_inductor(name, plus, minus, number(card[3]), start)
        elif name[0] == "k":
            b.add_inductor_coupling(card[1], card[2], number(card[3]))
        elif name[0] == "d":
            b.add_diode(name, plus, minus, ON, OFF)
        elif name[0] == "s":
            model = models[card[5]]
            b.add_switch(name, plus, minus, 1 / number(model["ron"]), 1 / number(model["roff"]))
        else:
            wave = re.match(r"(?:(sin|pulse)\()?([^)]*)", " ".join(card[3:]))
            values = [number(word) for word in wave[2].split()]
            if wave[1] == "pulse":
                gates[plus] = values
            elif wave[1] == "sin":
                offset, amplitude, hertz, delay, damping, degrees = values + [0.0] * (6 - len(values))
                if delay or damping:
                    sys.exit("no sine with delay or damping")
                phase = math.radians(degrees)
                b.add_sine_voltage_source(name, plus, minus, offset, amplitude, hertz, phase)
            else:
                b.add_voltage_source(name, plus, minus, values[0])
    for k, card in enumerate(devices):
        if card[0][0] == "s":
            _, _, delay, rise, fall, width, period = gates[card[3]]
            on = rise / 2 + width + fall / 2
            if delay:
                sys.exit("no schedule with delay")
            schedule = ps.make_pwm_switch_fn(1 / period, on / period, k, len(devices), rise / 2)
    return b, schedule


def main():
    from peers_programs import Circuit, number

    circuit, setting = Circuit(sys.argv[1]), json.loads(sys.argv[2])
    builder, schedule = build(circuit, number)
    begun = time.process_time()
    more = {"switch_fn": schedule} if schedule else {}
    result = ps.simulate(builder, t_end=circuit.stop, **setting, **more)
    print(time.process_time() - begun)
    data = {"time": np.asarray(result.times)}
    for probe in circuit.probes:
        try:
            data[probe] = np.asarray(result.v(probe[2:-1]) if probe[0] == "v" else result.i(probe[2:-1]))
        except Exception:  # it keeps neither the gates nor the currents of all devices
            pass
    np.savez(sys.argv[3], **data)


if __name__ == "__main__" and len(sys.argv) > 1:
    main()
