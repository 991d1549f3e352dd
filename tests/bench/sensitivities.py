#!/usr/bin/env python3
"""How much longer `circ sens` takes than `circ sim` of the same netlist, as a user starts them.

    python3 tests/bench/sensitivities.py target/release/circ

Buck converters with ladders behind them: all derivatives of two measurements. Time is that of the processor, user and system, the least of 15 runs in turn; the table stands
in docs/performance.md.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "reference"))
from page import write  # noqa: E402

RUNS = 15

CONVERTER = """buck with a ladder
vin in 0 24
s1 in sw gate 0 gated
d1 0 sw ideal
l1 sw o0 47u
c1 o0 0 100u
{ladder}rload o0 0 5
vg gate 0 pulse(0 1 0 10n 10n 3.99u 10u)
.model gated sw(vt=0.5 vh=0 ron=5m roff=10meg)
.model ideal d(n=0.001)
.tran 1u 2m uic
.meas tran vo avg v(o0) from=1.8m to=2m
.meas tran im max i(l1) from=1.8m to=2m
.save v(o0) i(l1)
.end
"""


def sections(count):
    """Capacitors behind resistances, with a load on each: three values a section."""
    of = "r1{k} o{k} o{n} {r}m\nc1{k} o{n} 0 1u\nrl{k} o{k} 0 {load}\n"
    return "".join(of.format(k=k, n=k + 1, r=10 + k, load=500 + k) for k in range(count))


def damped(count):
    """Capacitors with their own resistances, and two loads on each: six values a section."""
    of = (
        "r1{k} o{k} o{n} {r}m\nr2{k} o{k} o{n} 2\nre{k} o{n} e{k} {e}m\nc1{k} e{k} 0 {c}u\n"
        "rl{k} o{n} 0 {load}\nrm{k} o{n} 0 1k\n"
    )
    return "".join(
        of.format(k=k, n=k + 1, r=10 + k, e=5 + k, c=10 + k, load=500 + k) for k in range(count)
    )


CIRCUITS = {
    "2 states, 4 values": "",
    "5 states, 13 values": sections(3),
    "10 states, 52 values": damped(8),
    "17 states, 49 values": sections(15),
}


def seconds(command):
    """Of the processor for one run."""
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
        _, status, used = os.wait4(run.pid, 0)
        run.returncode = os.waitstatus_to_exitcode(status)
    if run.returncode:
        sys.exit(f"{' '.join(command)} ends with {run.returncode}")
    return used.ru_utime + used.ru_stime


def main():
    circ = sys.argv[1]
    lines = ["| circuit | `circ sim` | `circ sens` | ratio |", "|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as folder:
        for name, ladder in CIRCUITS.items():
            netlist = os.path.join(folder, "buck.cir")
            with open(netlist, "w", encoding="utf-8") as file:
                file.write(CONVERTER.format(ladder=ladder))
            least = {"sim": float("inf"), "sens": float("inf")}
            for _ in range(RUNS):
                for what in least:
                    least[what] = min(least[what], seconds([circ, what, netlist]))
            ratio = least["sens"] / least["sim"]
            times = " | ".join(f"{1e3 * least[what]:.1f} ms" for what in least)
            lines.append(f"| {name} | {times} | {ratio:.1f} |")
            print(lines[-1], flush=True)
    write("sensitivities.py", lines)


if __name__ == "__main__":
    main()
