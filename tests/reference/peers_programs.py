"""The programs of peers.py: their settings, the command that runs a circuit at one of them, the reader of what it wrote, and the command that starts it for nothing."""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

from make import raw
from precision import LONGER, longer

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
# Realisations of the diode that ngspice is given where no other runs.
SPARE = ("default", "n0.001")
CURVED = ("common-emitter", "exponential-bridge", "exponential-clamp", "exponential-half-wave")
DEBIAN = "/usr/bin/python3"
SUFFIX = {"t": 1e12, "g": 1e9, "meg": 1e6, "k": 1e3, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12, "f": 1e-15}


def number(word):
    found = re.fullmatch(r"([-+]?[\d.]+(?:e[-+]?\d+)?)(t|g|meg|k|m|u|n|p|f)?", word.lower())
    return float(found[1]) * SUFFIX.get(found[2], 1.0)


class Circuit:
    """A netlist of the fourteen, and what is read of it."""

    def __init__(self, name):
        self.name, self.curved = name, name in CURVED
        text = (ROOT / "netlists" / f"{name}.cir").read_text().lower()
        self.text = longer(text, LONGER.get(name, 1))
        self.cards = [line.split() for line in self.text.splitlines()[1:] if line[:1].isalpha()]
        kind = lambda letters: [card for card in self.cards if card[0][0] in letters]
        self.diodes = {card[0]: card[1:3] for card in kind("d")}
        tran = re.search(r"^\.tran (\S+) (\S+)", self.text, re.M)
        self.step, self.stop = number(tran[1]), number(tran[2])
        self.saved = re.search(r"^\.save (.*)$", self.text, re.M)[1].split()
        self.nodes = sorted({node for card in kind("rcldvis") for node in card[1:3]} - {"0"})
        storage = kind("cl")
        self.states = [f"v({c[1]},{c[2]})" if c[0][0] == "c" else f"i({c[0]})" for c in storage]
        sizes = [number(card[3]) for card in storage]
        self.mass = np.diag(sizes)
        at = {card[0]: k for k, card in enumerate(storage)}
        for card in kind("k"):
            i, j = at[card[1]], at[card[2]]
            self.mass[i, j] = self.mass[j, i] = number(card[3]) * np.sqrt(sizes[i] * sizes[j])
        currents = [f"i({card[0]})" for card in kind("ld")]
        self.probes = [f"v({node})" for node in self.nodes] + currents
        extra = [s for s in self.saved if s not in self.probes and "," not in s]
        self.all = re.sub(r"^\.save .*$", ".save " + " ".join(self.probes + extra), self.text, flags=re.M)

    def value(self, data, probe):
        """A column, a difference of two, or nothing where the program has none."""
        if probe in data:
            return data[probe]
        if probe.startswith("v("):
            a, _, b = probe[2:-1].partition(",")
            nodes = [np.zeros_like(data["time"]) if n in ("0", "") else data.get(f"v({n})") for n in (a, b)]
            if all(n is not None for n in nodes):
                return nodes[0] - nodes[1]
        return None


class Failed(Exception):
    """In the words of the program."""


# Every program: its settings, (command, reader of its output) of a circuit at one of them, and the command that starts it for nothing.
TRIVIAL = "trivial\nv1 a 0 1\nr1 a 0 1\n.tran 1 1\n.save v(a)\n"


class Circ:
    def __init__(self, program, method, tolerances):
        self.name, self.program, self.method, self.tolerances = f"circ {method}", program, method, tolerances

    def settings(self, circuit):
        return [["--tol", f"{tol:g}", "--no-estimate"] if tol else [] for tol in self.tolerances]

    def told(self, setting):
        return f"tol {setting[1]}" if setting else ""

    def command(self, circuit, setting, folder, step=None, stop=None):
        step, stop = step or circuit.step, stop or circuit.stop
        text = re.sub(r"^\.tran \S+ \S+", f".tran {step!r} {stop!r}", circuit.all, flags=re.M)
        Path(folder, "circ.cir").write_text(text)
        return [self.program, "sim", "circ.cir", "--method", self.method, "--summary", "json", "-q", "-o", "circ.npz", *setting]

    def idle(self, folder):
        Path(folder, "circ.cir").write_text(TRIVIAL)
        return [self.program, "sim", "circ.cir", "--summary", "json", "-q", "-o", "circ.npz"]

    def read(self, circuit, folder, out, err):
        with np.load(Path(folder, "circ.npz")) as file:
            data = {name: file[name] for name in file.files}
        return data, json.loads(err.splitlines()[-1])["cpu_seconds"]


class Ngspice:
    name = "ngspice"

    def __init__(self, circ):
        self.circ = circ

    def settings(self, circuit):
        diodes = ["default"] if circuit.curved else ["n0.01", "sidiode", *SPARE]
        return [(d, m, r, s) for d in diodes for m in ("gear", "trap") for r in ("1e-3", "1e-5") for s in (1, 8)]

    def told(self, setting):
        diodes, method, reltol, divisor = setting
        return f"`{diodes}`, {method}, reltol {reltol}, step / {divisor}"

    def command(self, circuit, setting, folder):
        diodes, method, reltol, divisor = setting
        kept = Path(folder, f"{diodes}.cir")
        if not kept.exists():
            Path(folder, "circ.cir").write_text(circuit.all)
            subprocess.run([self.circ, "compare", "circ.cir", "--realisation", diodes, "--keep", kept, "-q"], cwd=folder, capture_output=True)
        deck = re.sub(r"reltol=\S+ method=\S+", f"reltol={reltol} method={method}", kept.read_text())
        deck = re.sub(r"^(\.tran \S+ \S+ \S+) \S+", rf"\1 {circuit.step / divisor:g}", deck, flags=re.M)
        Path(folder, "deck.cir").write_text(deck + "\n")
        Path(folder, "out.raw").unlink(missing_ok=True)
        return ["ngspice", "-n", "-b", "-r", "out.raw", "deck.cir"]

    def idle(self, folder):
        Path(folder, "deck.cir").write_text(TRIVIAL + ".end\n")
        return ["ngspice", "-n", "-b", "-r", "out.raw", "deck.cir"]

    def read(self, circuit, folder, out, err):
        if not Path(folder, "out.raw").exists():
            raise Failed("no rows")
        names, columns = raw(Path(folder, "out.raw"))
        data = {re.sub(r"i\(v\.(\w+)_sense\)", r"i(\1)", name): np.array(column) for name, column in zip(names, columns)}
        solve = re.search(r"Total analysis time \(seconds\) = (\S+)", out + err)
        return data, float(solve[1]) if solve else None


class Gnucap:
    name = "gnucap"

    def settings(self, circuit):
        return [(n, m, r, s) for n in (("",) if circuit.curved else ("0.01", "0.1")) for m in ("gear", "trap") for r in ("1e-3", "1e-5") for s in (1, 8)]

    def told(self, setting):
        emission, method, reltol, divisor = setting
        return f"{f'n = {emission}, ' if emission else ''}{method}, reltol {reltol}, step / {divisor}"

    def command(self, circuit, setting, folder):
        emission, method, reltol, divisor = setting
        deck = re.sub(r"^\.(save|tran|end|ic).*\n", "", circuit.text, flags=re.M)
        deck = re.sub(r"^\*.*\n", "", deck, flags=re.M).replace("d(n=0.001)", f"d(n={emission})")
        names = [f"i({c[0]})" for c in circuit.cards if c[0][0] == "v"]
        probes = circuit.probes + [name for name in names if name in circuit.saved]
        uic = "uic" if "uic" in circuit.text else ""
        deck += f".options reltol={reltol} method={method} numdgt=12\n.print tran {' '.join(probes)}\n"
        Path(folder, "gnucap.ckt").write_text(deck + f".tran {circuit.step / divisor:g} {circuit.stop:g} 0 {uic}\n.end\n")
        return ["gnucap", "-b", "gnucap.ckt"]

    def idle(self, folder):
        Path(folder, "gnucap.ckt").write_text("trivial\nv1 a 0 1\nr1 a 0 1\n.print tran v(a)\n.tran 1 1 0\n.end\n")
        return ["gnucap", "-b", "gnucap.ckt"]

    def read(self, circuit, folder, out, err):
        head = re.search(r"^#Time (.*)$", out, re.M)
        if not head:
            raise Failed("no rows")
        value = lambda word: number(word.lower().replace("infinity", "nan"))
        rows = [line.split() for line in out[head.end():].splitlines() if re.match(r" [-\d.]", line)]
        names = ["time", *head[1].lower().split()]
        rows = [[value(word) for word in row] for row in rows if len(row) == len(names)]
        return dict(zip(names, np.array(rows).T)), None


class Siconos:
    """The script of `circ lcs`, with θ and steps of the setting and a clock around its loop."""

    name = "Siconos"

    def settings(self, circuit):
        return [(theta, divisor) for theta in ("1.0", "0.5") for divisor in (1, 4, 16)]

    def told(self, setting):
        return f"θ = {setting[0]}, step / {setting[1]}"

    def __init__(self, circ):
        self.circ = circ

    def command(self, circuit, setting, folder):
        if any(card[0][0] == "s" for card in circuit.cards):
            raise Failed("switches move: no system of constant matrices")
        theta, divisor = setting
        script = Path(folder, "model.py")
        Path(folder, "circ.cir").write_text(circuit.all)
        made = [self.circ, "lcs", "circ.cir", "--diodes", "ideal", "--format", "siconos", "-o", script, "-q"]
        ran = subprocess.run(made, cwd=folder, capture_output=True, text=True)
        if ran.returncode != 0:
            raise Failed(next(line for line in ran.stderr.splitlines() if "×" in line).strip(" ×")[:80])
        text = re.sub(r"^step, end, theta = \S+ (\S+) \S+$", rf"step, end, theta = {circuit.step / divisor!r}, \1 {theta}", script.read_text(), flags=re.M)
        text = text.replace("table = csv.writer", "import time\nbegun = time.process_time()\ntable = csv.writer")
        script.write_text(text + "print(time.process_time() - begun, file=sys.stderr)\n")
        return [DEBIAN, script]

    def idle(self, folder):
        return [DEBIAN, "-c", "import csv, numpy; from siconos import kernel"]

    def read(self, circuit, folder, out, err):
        lines = out[out.index("time,"):].splitlines()
        rows = list(csv.reader(lines))
        columns = np.array([[float(cell) for cell in row] for row in rows[1:] if len(row) == len(rows[0])]).T
        return dict(zip(rows[0], columns)), float(err.splitlines()[-1])


class Package:
    """A package of Python, by a script of its own: SCRIPT NETLIST SETTING OUT.npz, and SCRIPT alone for nothing."""

    def __init__(self, name, script):
        self.name, self.script = name, HERE / script

    def settings(self, circuit):
        fixed = [{"dt": circuit.step / divisor} for divisor in (1, 4, 16)]
        return fixed + [{}, {"engine": "trbdf2", "rtol": 1e-6}, {"engine": "trbdf2", "rtol": 1e-8}]

    def told(self, setting):
        return ", ".join(f"{key} {value:g}" if key != "engine" else f"{key} {value}" for key, value in setting.items()) or "default"

    def command(self, circuit, setting, folder):
        return [sys.executable, self.script, circuit.name, json.dumps(setting), Path(folder, "out.npz")]

    def idle(self, folder):
        return [sys.executable, self.script]

    def read(self, circuit, folder, out, err):
        with np.load(Path(folder, "out.npz")) as file:
            data = {name: file[name] for name in file.files}
        return data, float(out.splitlines()[-1].split()[0])


class Smooth(Package):
    """A stiff solver of smooth equations."""

    def __init__(self, name, solver):
        super().__init__(name, "peers_smooth.py")
        self.solver = solver

    def settings(self, circuit):
        return [{"solver": self.solver, "rtol": rtol} for rtol in (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)]

    def told(self, setting):
        return f"rtol {setting['rtol']:g}"
