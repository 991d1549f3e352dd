"""The table of docs/stability.md over stiffness: circuits of `stiff/` with one element over eighteen decades, against stiffness.csv.

`tests/reference/stiff.py` makes the reference. An error is the largest of a state at twenty times, relative to the largest magnitude that the state
has at them. A run is right where its error is within LARGEST; `tests/stiffness.rs` holds circ to that and exact runs to 1e-11.
"""

import csv
import pathlib
import re
import resource
import signal
import subprocess
import tempfile

from make import column, interpolate, raw

HERE = pathlib.Path(__file__).resolve().parent
METHODS = ["exact", "euler", "theta"]
# Errors of circ that are right, relative, where a case does not name them; of ngspice one that a figure would show.
LARGEST = {"exact": 1e-9, "euler": 1e-3, "theta": 1e-3, "ngspice": 0.05}
PATIENCE = 60  # s of CPU time
UNITS = {"r": "Ω", "l": "H", "c": "F"}


def patiently(words, **more):
    """The finished run, or nothing where it took too long."""
    def limit():
        resource.setrlimit(resource.RLIMIT_CPU, (PATIENCE, PATIENCE + 1))

    run = subprocess.run(words, capture_output=True, text=True, preexec_fn=limit, **more)
    return None if run.returncode in (-signal.SIGXCPU, -signal.SIGKILL) else run


def reference():
    """{(netlist, ratio): (x, spread, {quantity: [(time, value)]})}"""
    found = {}
    with (HERE / "stiffness.csv").open() as file:
        for row in csv.DictReader(file):
            case = found.setdefault((row["netlist"], row["ratio"]), (row["x"], row["spread"], {}))
            case[2].setdefault(row["quantity"], []).append((float(row["time"]), float(row["value"])))
    return found


def error(states, value):
    """The largest, and where it is."""
    worst = (0.0, "")
    for quantity, rows in states.items():
        size = max(abs(right) for _, right in rows)
        for t, right in rows:
            found = value(quantity, t)
            off = abs(found - right) / size
            if not off <= worst[0]:
                worst = (off, f"{quantity} = {found:.4g} instead of {right:.4g} at {t:.4g} s")
    return worst


def judged(worst, method):
    off, what = worst
    if off <= LARGEST[method]:
        return f"{off:.0e}"
    return f"**fails: {what if off > 0.05 else f'off by {off:.0e}'}**"


def circ(program, name, x, states, method):
    with tempfile.TemporaryDirectory() as tmp:
        out = pathlib.Path(tmp) / "out.csv"
        words = [program, "sim", str(HERE / "stiff" / f"{name}.cir"), "--param", f"x={x}", "--method", method, "-o", str(out), "-q"]
        words += [word for quantity in states for word in ("--probe", quantity)]
        run = patiently(words)
        if run is None:
            return f"**too slow: no answer within {PATIENCE} s**"
        if run.returncode != 0:
            lines = [line.strip() for line in run.stderr.splitlines() if line.lstrip().startswith(("×", "error"))]
            return f"**fails: refuses: {(lines or run.stderr.splitlines() or ['?'])[0].removeprefix('× ').split('.cir: ')[-1]}**"
        with out.open() as file:
            head, *rows = csv.reader(file)

    def value(quantity, t):
        row = min(rows, key=lambda row: abs(float(row[0]) - t))
        return float(row[head.index(quantity)])

    return judged(error(states, value), method)


def deck(text, x, times):
    """For ngspice: diodes as its code model, and corners of a source of their own where the states are looked at."""
    text = re.sub(r"^\.(save|param).*\n", "", text.replace("{x}", x), flags=re.M)
    text = re.sub(r"^d(?=\w+ .* diode$)", "a", text, flags=re.M).replace(" diode d(", " diode sidiode(")
    corners = " ".join(f"{t:g} {k % 2}" for k, t in enumerate([0, *times]))
    return text.replace(".tran", f"vlook look 0 pwl({corners})\nrlook look 0 1\n.tran")


def ngspice(name, x, states):
    text = (HERE / "stiff" / f"{name}.cir").read_text()
    times = [t for t, _ in next(iter(states.values()))]
    with tempfile.TemporaryDirectory() as tmp:
        path, out = pathlib.Path(tmp) / "deck.cir", pathlib.Path(tmp) / "out.raw"
        path.write_text(deck(text, x, times))
        run = patiently(["ngspice", "-n", "-b", "-r", str(out), str(path)], cwd=tmp, stdin=subprocess.DEVNULL)
        if run is None:
            return f"**too slow: no answer within {PATIENCE} s**"
        said = [line.strip() for line in (run.stdout + run.stderr).splitlines()]
        words = [s for s in said if re.search(r"too small|singular|failed|iterations", s)]
        names, values = raw(out) if out.exists() else ([], [])
        if not values or values[0][-1] < 0.999 * times[-1]:
            at = f" at {values[0][-1]:.4g} s" if values and values[0] else ""
            quote = min(words, key=lambda s: not s.startswith("doAnalyses"), default=f"exit status {run.returncode}")
            return f"**fails: gives up{at}: “{quote.removeprefix('doAnalyses: ')}”**"
    return judged(error(states, lambda quantity, t: interpolate(t, values[0], column(names, values, quantity))), "ngspice")


def element(text):
    """Letter, unit: the card whose value is x."""
    return UNITS["r" if re.search(r"r(on|off)=\{x\}", text) else re.search(r"^(\w)\S* .*\{x\}$", text, re.M)[1]]


def table(program):
    lines = ["| circuit | ratio | element | eigenvalues | exact | Moreau (`euler`) | `theta` | ngspice |", "|---|---|---|---|---|---|---|---|"]
    for (name, ratio), (x, spread, states) in reference().items():
        text = (HERE / "stiff" / f"{name}.cir").read_text()
        of = name.rpartition("-")[2].capitalize()
        cells = [circ(program, name, x, states, method) for method in METHODS] + [ngspice(name, x, states)]
        title = f"[{text.splitlines()[0]}](../tests/stability/stiff/{name}.cir)" if ratio == "1" else ""
        value = f"{of} = {float(x):.3g} {element(text)}"
        lines.append(f"| {title} | {ratio} | {value} | {float(spread):.0e} | " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
        print(f"{name} {value}:", " | ".join(cells), flush=True)
    return "\n".join(lines) + "\n"
