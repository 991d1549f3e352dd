"""The pictures of docs/stability/: what steps take from a tank, and how they ring after an edge and after a jump, over their length."""

import csv
import math
import pathlib
import re
import subprocess
import tempfile

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt

from make import column, interpolate, raw
from stiffness import HERE, patiently

PICTURES = HERE.parent.parent / "docs" / "stability"
SWINGS = 10
PERIOD = 6.2832e-3
# A θ beside ½ is taken as asked for: the midpoint rule without damped steps.
BARE = ["--method", "theta", "--theta", "0.5000000001", "--gamma", "0.5000000001"]
STEPPERS = [
    ("euler", ["--method", "euler"], "#d55e00", "s"),
    ("theta, θ = ½ as it is, without damped steps", BARE, "#999999", "v"),
    ("theta", ["--method", "theta"], "#0072b2", "o"),
]
RATIOS = [10 ** (k / 3) for k in range(-3, 19)]
FIRST = 10  # s, of the edge


def rows(program, netlist, *words):
    with tempfile.TemporaryDirectory() as tmp:
        out = pathlib.Path(tmp) / "out.csv"
        subprocess.run([program, "sim", str(HERE / netlist), *words, "--no-estimate", "-q", "-o", str(out)], check=True)
        with out.open() as file:
            return list(csv.DictReader(file))


def figure(panels):
    plt.rcParams.update({"svg.hashsalt": "circ", "svg.fonttype": "none", "font.size": 9, "font.family": "sans-serif"})
    return plt.subplots(1, panels, figsize=(4.5 * panels + 0.5, 3.4))


def save(drawn, name):
    drawn.tight_layout()
    PICTURES.mkdir(exist_ok=True)
    drawn.savefig(PICTURES / f"{name}.svg", metadata={"Date": None})
    plt.close(drawn)


def swing(row):
    return math.hypot(float(row["v(a)"]), float(row["i(l1)"]))


def ngspice(method, step):
    """The amplitude after SWINGS with steps of one length, which nothing but the largest step limits."""
    text = re.sub(r"^\.(save|param).*\n", "", (HERE / "drift" / "tank.cir").read_text(), flags=re.M)
    stop = SWINGS * PERIOD
    text = re.sub(r"^\.tran.*", f".options method={method} reltol=0.1 trtol=1e9\n.tran {step:.9g} {stop:.9g} 0 {step:.9g} uic", text, flags=re.M)
    with tempfile.TemporaryDirectory() as tmp:
        path, out = pathlib.Path(tmp) / "deck.cir", pathlib.Path(tmp) / "out.raw"
        path.write_text(text)
        patiently(["ngspice", "-n", "-b", "-r", str(out), str(path)], cwd=tmp, stdin=subprocess.DEVNULL)
        names, values = raw(out)
    found = [interpolate(stop, values[0], column(names, values, probe)) for probe in ("v(a)", "i(l1)")]
    return math.hypot(*found)


def tank(program):
    """Amplitude after SWINGS over steps a swing."""
    # Of a print step of a tenth of a swing, which circ divides evenly.
    per = [10, 20, 30, 40, 50, 70, 100, 150, 200, 300, 500, 700, 1000]
    lengths = [1 / n for n in per]
    drawn, axes = figure(1)
    words = ["--param", f"periods={SWINGS}"]
    exact = swing(rows(program, "drift/tank.cir", *words, "--method", "exact")[-1])
    axes.plot([lengths[-1], lengths[0]], [exact, exact], color="black", label="exact")
    for label, method, colour, mark in STEPPERS[0], STEPPERS[2]:
        found = [swing(rows(program, "drift/tank.cir", *words, *method, "--step", repr(PERIOD * h))[-1]) for h in lengths]
        axes.plot(lengths, found, mark, color=colour, label=label, markersize=4)
        print("tank", label, *(f"{n}:{a:.6g}" for n, a in zip(per, found)))
    closed = [10 ** (math.log10(lengths[-1]) + 2 * k / 200) for k in range(201)]
    axes.plot(closed, [(1 + (2 * math.pi * h) ** 2) ** (-SWINGS / (2 * h)) for h in closed], "-", color="#d55e00", linewidth=0.7,
              label="(1 + h²ω²) to the −steps/2")
    for method, colour, mark in (("trap", "#009e73", "+"), ("gear", "#cc79a7", "x")):
        found = [ngspice(method, PERIOD * h) for h in lengths]
        axes.plot(lengths, found, mark, color=colour, label=f"ngspice, {method}", markersize=5)
        print("tank ngspice", method, *(f"{n}:{a:.6g}" for n, a in zip(per, found)))
    axes.set(xscale="log", xlabel="step, part of a swing", ylabel=f"amplitude after {SWINGS} swings", ylim=(-0.03, 1.08))
    axes.legend(frameon=False, loc="lower left", fontsize=8)
    save(drawn, "tank")


def after(program, name, probe, right):
    """The course at a thousand time constants a step, and the largest error from a step after the edge on, over time constants a step."""
    drawn, (course, axes) = figure(2)

    def run(method, ratio):
        found = rows(program, f"damping/{name}.cir", *method, "--step", "1", "--param", f"ratio={ratio!r}")
        found = [(float(row["time"]), float(row[probe])) for row in found]
        return [(t - FIRST, v) for t, v in found if t > FIRST + 0.5]

    for label, method, colour, mark in STEPPERS:
        times, values = zip(*run(method, 1000.0))
        course.plot(times[:12], values[:12], "-" + mark, color=colour, linewidth=0.7, markersize=4, label=label)
        errors = [max(abs(v - right(t * ratio)) for t, v in run(method, ratio)) for ratio in RATIOS]
        axes.plot(RATIOS, errors, "-" + mark, color=colour, linewidth=0.7, markersize=3)
        print(name, label, *(f"{ratio:.3g}:{error:.2g}" for ratio, error in list(zip(RATIOS, errors))[::3]))
    axes.plot(RATIOS[7:], [4 / ratio**2 for ratio in RATIOS[7:]], ":", color="black", linewidth=1, label="4 (τ/h)²")
    course.set(xlabel="steps after it", ylabel=f"{probe}, h = 1000 τ")
    course.set_ylim(top=course.get_ylim()[1] + 0.45 * (course.get_ylim()[1] - course.get_ylim()[0]))
    course.legend(frameon=False, loc="upper right", fontsize=8)
    axes.set(xscale="log", yscale="log", xlabel="h/τ", ylabel="largest error, part of the step", ylim=(1e-13, 10))
    axes.legend(frameon=False, loc="lower left", fontsize=8)
    save(drawn, name)


def draw(program):
    tank(program)
    after(program, "edge", "v(out)", lambda x: 1 - math.exp(-x))
    after(program, "jump", "v(b)", lambda x: math.exp(-x))
