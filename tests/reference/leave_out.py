#!/usr/bin/env python3
"""What leaving out saves: pairs of runs of which one has a thing that the other has not, and the answer is the same; the table of docs/performance.md.

    cargo build --release && tests/reference/leave_out.py [--circ target/release/circ] [--runs 41]

circ has no switch by which it would build what is not needed, so each pair is what a user can write: a netlist of netlists/ with the cards and options below, and the same with more. Both run in turn;
times are the CPU seconds of the solve (`--summary json`), the least of so many runs each, fewer where they are long. The pair without a difference shows what is noise. Counters
are those of the same summary and of the line `built:` of `-v`. The difference is the largest of a signal that both have, at the rows of the one without, relative to its largest value.
"""

import argparse
import csv
import json
import pathlib
import re
import subprocess
import tempfile

from page import write

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
COUNTERS = "steps events jumps modes lcp_solves pivotings factorisations".split()
BUILT = re.compile(r"complementarity systems (\d+) \(with jump logic (\d+)\)")
# Seconds of CPU that a pair may take, five runs of each at least.
ENOUGH = 8.0


def clamp(nodes, ron):
    """A diode that never conducts; where it has no resistance jumps need logic."""
    return {"dx": f"dx {nodes} clamp\n.model clamp d(vfwd=100 ron={ron})"}


def probes(names):
    return [word for name in names.split() for word in ("--probe", name)]


ONE_RUN = ["--no-estimate"]
NEVER = "complementarity problem and its guards (a diode that never conducts)"
ALONE = NEVER.replace("(", "(switches alone, ")
BODY = {"d2": "d2 0 sw body\n.model body d(vfwd=100 ron=10m)"}
# What differs from circuit to circuit: the cards of both, the diode that never conducts, and where a like one has jumps; a fixed step; `.tran` of all rows and of the last tenth; what is
# recorded of little, of much, and of a source that without that acts on nothing or through controls of switches alone, with its card.
LINEAR = {
    "netlist": "linear: rlc", "what": NEVER, "both": {}, "never": clamp("2 3", "10m"), "jumps": "2 3", "step": "10u", "tran": "10u 10m", "late": "10u 10m 9m",
    "few": "i(l1)", "many": "all i(*)", "source": ("a pulsed source that acts on nothing (its voltage recorded)", {"vx": "vx x 0 pulse(0 1 0 10n 10n 3.99u 10u)"}, "v(x)"),
}  # fmt: skip
PASSIVE = {
    "netlist": "passive: bridge-resistor", "what": "one more pair (a diode that never conducts)", "both": {}, "never": clamp("0 1", "10m"), "jumps": "0 1", "step": "1u",
    "tran": "1u 5m uic", "late": "1u 5m 4.5m uic", "few": "v(1)", "many": "all i(*)", "source": None,
}  # fmt: skip
CLOCKED = {
    "netlist": "clocked: buck-open-loop", "what": ALONE, "never": BODY, "jumps": "0 out", "step": "20n", "tran": "1u 10m uic", "late": "1u 10m 9m uic", "few": "v(out)",
    "both": {"d1": "s2 sw 0 0 gate low\n.model low sw(vt=-0.5 vh=0 ron=5m roff=10meg)", "rload": "rload out 0 5"},
    "many": "v(out) v(in) v(sw) i(vin) i(s1) i(d1) i(l1) i(c1) i(rload)", "source": ("the gate source in the flow (its voltage recorded)", {}, "v(gate)"),
}  # fmt: skip
FEEDBACK = {
    "netlist": "feedback: peak-current", "what": ALONE, "never": BODY, "jumps": "0 out", "step": "20n", "tran": "0.1u 2m uic", "late": "0.1u 2m 1.8m uic", "few": "v(out)",
    "both": {"d1": "S2 0 sw 0 g low\n.model low SW(ideal Vt=-5)"},
    "many": "v(out) v(vin) v(sw) i(vin) i(s1) i(d1) i(l1) i(c1) i(rl)", "source": ("the clock in the flow (its voltage recorded)", {}, "v(clk)"),
}  # fmt: skip


def pairs(c):
    """What is left out, cards and options of both, cards and options of the one that has it besides."""
    steps = ["--method", "theta", "--step", c["step"], *ONE_RUN]
    few, resistive = probes(c["few"]), clamp(c["jumps"], "10m")
    yield "nothing", {}, [], {}, []
    yield c["what"], c["both"], [], c["never"], []
    yield f"the same in steps of {c['step'].replace('u', ' µ').replace('n', ' n')}s", c["both"], steps, c["never"], []
    yield "jump logic (a diode that never conducts, without resistance)", resistive, [], clamp(c["jumps"], "0"), []
    yield "readings (one signal, many)", {}, few, {}, probes(c["many"])
    yield "rows (of the last tenth, all)", {".tran": ".tran " + c["late"]}, [], {".tran": ".tran " + c["tran"]}, []
    if c["source"]:
        what, cards, voltage = c["source"]
        yield what, cards, few, {}, probes(voltage)
    if c is CLOCKED:
        at_once = {"vg": "vg gate 0 pulse(0 1 0 0 0 4u 10u)"}
        yield "the same where its edges take no time", at_once, few, {}, probes("v(gate)")
        # A control that no clock foretells, as it feels the output.
        felt = {"s1": "eg g 0 vol = {v(gate)+1e-9*v(out)}\ns1 in sw g 0 gated"}
        yield "the search for its edges too (a control that feels v(out) by 1e-9)", {}, [], felt, []
        yield "the same where its edges take no time", at_once, [], felt, []
    if c in (LINEAR, PASSIVE):
        yield "energy balance (the system of `circ lcs`, the circuit)", None, [], {}, []
    if c is FEEDBACK:
        yield "steps (exact, `--method theta`)", {}, [], {}, ["--method", "theta"]
    yield "stated error of steps (`--no-estimate`)", {}, steps[:4] if c is CLOCKED else steps[:2], {}, ONE_RUN


def deck(c, *changes):
    """The netlist in which these elements have other cards, or which has them besides."""
    lines = (ROOT / "netlists" / (c["netlist"].split()[1] + ".cir")).read_text().splitlines()
    for name, card in [item for change in changes for item in change.items()]:
        at = [k for k, line in enumerate(lines) if line.lower().split()[:1] == [name]]
        # Before `.end` where there is none of this name.
        place = slice(at[0], at[0] + 1) if at else slice(-1, -1)
        lines[place] = [card]
    return "\n".join(lines) + "\n"


class Side:
    """One run of a pair."""

    def __init__(self, circ, folder, name, text, options):
        self.circ, self.folder, self.options, self.times = circ, folder, options, []
        self.file = folder / f"{name}.cir"
        self.file.write_text(text)

    def as_system(self):
        """The same from the matrices that `circ lcs` writes."""
        system = self.file.with_suffix(".json")
        subprocess.run([self.circ, "lcs", self.file, "-o", system], check=True, stderr=subprocess.DEVNULL)
        self.file = system

    def run(self, *more, out="x.raw"):
        command = [self.circ, "sim", self.file, *self.options, "-o", self.folder / out, *more]
        return subprocess.run(command, stderr=subprocess.PIPE, check=True, text=True).stderr

    def time(self):
        self.summary = json.loads(self.run("--summary", "json", "-q").strip().splitlines()[-1])
        self.times.append(self.summary["cpu_seconds"])

    def look(self):
        """Counters and signals."""
        systems, impulsive = BUILT.search(self.run("-v", out="x.csv")).groups()
        names, *rows = csv.reader((self.folder / "x.csv").open())
        self.signals = dict(zip(names, zip(*[map(float, row) for row in rows])))
        energy = self.summary["energy"]["source"] is not None
        found = {name.replace("_", " "): self.summary[name] for name in COUNTERS}
        return found | {"systems": int(systems), "jump logic": int(impulsive), "signals": len(names) - 1, "rows": len(rows), "energies": int(energy)}


def difference(one, other):
    """At the rows of the first, each of which the other has too."""
    worst, at = 0.0, {f"{t:.9g}": k for k, t in enumerate(other["time"])}
    for name in (one.keys() & other.keys()) - {"time"}:
        apart = max(abs(x - other[name][at[f"{t:.9g}"]]) for t, x in zip(one["time"], one[name]))
        worst = max(worst, apart / max(max(map(abs, one[name])), 1e-300))
    return f"{worst:.0e}" if worst else "0"


def row(circ, runs, folder, c, pair):
    what, cards, options, more, others = pair
    # The option that leaves out is the shorter run's.
    exchanged = others == ONE_RUN
    without = Side(circ, folder, "without", deck(c, cards or {}), options + (others if exchanged else []))
    having = Side(circ, folder, "with", deck(c, cards or {}, more), options + ([] if exchanged else others))
    if cards is None:
        without.as_system()
    while len(having.times) < runs and (sum(without.times + having.times) < ENOUGH or len(having.times) < 5):
        without.time()
        having.time()
    less, full = without.look(), having.look()
    changed = ", ".join(f"{name} {less[name]} → {full[name]}" for name in less if less[name] != full[name])
    apart = difference(without.signals, having.signals)
    a, b = min(without.times), min(having.times)
    cells = [c["netlist"], what, f"{a * 1e3:.3g} ms", f"{b * 1e3:.3g} ms", f"{b / a:.{2 if b < 10 * a else 0}f}", changed or "none differs", apart]
    return "| " + " | ".join(cells) + " |"


def modes(circ, folder, c):
    """How many of its modes a circuit visits."""
    side = Side(circ, folder, "modes", deck(c), [])
    side.time()
    system = json.loads(subprocess.check_output([circ, "lcs", side.file, "--format", "json"], stderr=subprocess.DEVNULL))
    pairs, switches = len(system["ports"]), len(system.get("switches") or {})
    return f"{c['netlist']}, {side.summary['modes']} of {2 ** (pairs + switches)} ({pairs} pairs, {switches} switches)"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--circ", default=ROOT / "target" / "release" / "circ")
    parser.add_argument("--runs", type=int, default=41)
    asked = parser.parse_args()
    lines = ["| circuit | left out (and what has it) | without | with | ratio | counters, without → with | difference |", "|---|---|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        circuits = (LINEAR, PASSIVE, CLOCKED, FEEDBACK)
        for c, pair in [(c, pair) for c in circuits for pair in pairs(c)]:
            lines.append(row(asked.circ, asked.runs, folder, c, pair))
            print(lines[-1], flush=True)
        visited = [modes(asked.circ, folder, c) for c in circuits]
    lines += ["", f"Modes made, of those there might be: {'; '.join(visited)}."]
    write("leave_out.py", lines)


if __name__ == "__main__":
    main()
