"""The table of docs/stability.md over what steppers lose in ten thousand periods: circuits of `drift/` against their closed forms."""

import cmath
import csv
import json
import math
import pathlib
import tempfile

from stiffness import HERE, LARGEST, patiently

PERIODS = (100, 1000, 10000)
OMEGA = 2 * math.pi * 1000


def tank(row, t):
    """Where the swing is, over where it should be."""
    return complex(float(row["v(a)"]), float(row["i(l1)"])) * cmath.exp(-1j * 1000 * t)


def rlc(row, t):
    """Of the rotating phasor of the current i is the imaginary part, and -w C v(b) the real one."""
    current = 10 / complex(10, OMEGA * 10e-3 - 1 / (OMEGA * 1e-6))
    found = complex(-OMEGA * 1e-6 * float(row["v(b)"]), float(row["i(l1)"]))
    return found / (current * cmath.exp(1j * OMEGA * t))


def rectifier(row, t):
    return complex(float(row["v(out)"]) / 0.47836186833069603)


# Circuit, what its states are over what they should be, and a thousandth of its period.
CIRCUITS = [("tank", tank, "6.2832u"), ("rlc", rlc, "1u"), ("rectifier", rectifier, "1u")]
HUNDREDTH = {"6.2832u": "62.832u", "1u": "10u"}


def steppers(thousandth):
    yield "exact", ["--method", "exact"]
    for name in ("euler", "theta"):
        yield f"`{name}`, 100 steps a period", ["--method", name, "--step", HUNDREDTH[thousandth]]
        yield f"`{name}`, 1000 steps a period", ["--method", name, "--step", thousandth]
        yield f"`{name}`, chosen steps", ["--method", name]


def run(program, name, over, words, periods):
    """Amplitude drift, phase drift in (-1/2, 1/2] (none where nothing is left) and residual."""
    with tempfile.TemporaryDirectory() as tmp:
        out = pathlib.Path(tmp) / "out.csv"
        ran = patiently([program, "sim", str(HERE / "drift" / f"{name}.cir"), *words, "--param", f"periods={periods}", "--no-estimate", "-q",
                         "--summary", "json", "-o", str(out)])
        if ran is None:
            return None
        summary = json.loads(next(line for line in ran.stderr.splitlines() if line.startswith("{")))
        with out.open() as file:
            row = list(csv.DictReader(file))[-1]
    found = over(row, float(row["time"]))
    if abs(found) < 1e-290:
        return abs(found) - 1, None, abs(summary["energy"]["residual_relative"])
    return abs(found) - 1, cmath.phase(found) / (2 * math.pi), abs(summary["energy"]["residual_relative"])


def told(name, stepper, runs):
    """Their cells. The phase of a tank is counted on: ten times as many periods turn it about ten times as far."""
    before, phases = 0.0, []
    for found in runs:
        if found is None or found[1] is None:
            phases.append("too slow" if found is None else "–")
            continue
        # A steady state is no further off for being older.
        turns = round(10 * before - found[1]) if name == "tank" else 0
        before = found[1] + turns
        phases.append(bold(before, stepper))
    slow = "too slow"
    cells = [slow if found is None else bold(found[0], stepper) for found in runs]
    cells += ["–" for _ in phases] if name == "rectifier" else phases
    return cells + [slow if found is None else f"{found[2]:.0e}" for found in runs]


def bold(drift, stepper):
    """Exact integration is wrong where it drifts."""
    return f"**fails: {drift:+.0e}**" if stepper == "exact" and not abs(drift) <= LARGEST["exact"] else f"{drift:+.0e}"


def table(program):
    heads = [f"{what}, 1e{len(str(n)) - 1}" for what in ("amplitude", "phase", "energy") for n in PERIODS]
    lines = ["| circuit | stepper | " + " | ".join(heads) + " |", "|---" * (2 + len(heads)) + "|"]
    for name, over, thousandth in CIRCUITS:
        title = (HERE / "drift" / f"{name}.cir").read_text().splitlines()[0]
        for k, (stepper, words) in enumerate(steppers(thousandth)):
            runs = []
            for periods in PERIODS:
                # A longer run takes longer.
                runs.append(None if runs and runs[-1] is None else run(program, name, over, words, periods))
            cells = told(name, stepper, runs)
            first = f"[{title}](../tests/stability/drift/{name}.cir)" if k == 0 else ""
            lines.append(f"| {first} | {stepper} | " + " | ".join(cells) + " |")
            print(name, stepper, *cells, flush=True)
    return "\n".join(lines) + "\n"
