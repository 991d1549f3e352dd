"""Circuits with ideal diodes and switches: netlist to complementarity system to exact waveforms.

    >>> import circ
    >>> model = circ.parse("filter\\nv1 in 0 1\\nr1 in out 1k\\nc1 out 0 1u\\n.tran 0.1m 5m uic\\n.end\\n")
    >>> waves = model.tran()
    >>> waves.time.shape, float(waves["v(out)"][-1].round(4))
    ((51,), 0.9933)
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from . import _circ
from ._circ import NetlistError, SimulationError
from ._display import diagnostics_html, system_html, waveforms_html
from ._sweep import monte_carlo, normal, sweep, uniform

__version__ = "0.1.0"
__all__ = [
    "Checkpoint",
    "Model",
    "NetlistError",
    "Response",
    "Simulation",
    "SimulationError",
    "Stop",
    "System",
    "Waveforms",
    "load",
    "monte_carlo",
    "normal",
    "parse",
    "sweep",
    "uniform",
]

Checkpoint = _circ.Place


def _diagnostics(error: NetlistError) -> list[dict[str, Any]]:
    """What is wrong, each with `code`, `severity`, `message`, `file`, `line`, `column`, `help`."""
    return json.loads(getattr(error, "_diagnostics", "[]"))


NetlistError.diagnostics = property(_diagnostics)  # type: ignore[assignment]
NetlistError._repr_html_ = lambda error: diagnostics_html(_diagnostics(error))  # type: ignore[attr-defined]


def load(path: str | os.PathLike[str], *, diodes: str = "auto", params: Mapping[str, float] | None = None) -> Model:
    """Reads a netlist file and what it includes.

    `diodes` is "auto", "ideal" or "exp"; `params` replaces values of `.param`. Raises `NetlistError`.
    """
    return Model(_circ.Core.load(os.fspath(path), diodes, list((params or {}).items())), diodes, dict(params or {}), [])


def parse(text: str, name: str = "netlist.cir", *, diodes: str = "auto", params: Mapping[str, float] | None = None) -> Model:
    """Reads a netlist from text; files it includes are read beside `name`. Raises `NetlistError`."""
    return _read([(name, text)], diodes, dict(params or {}), [])


def _read(files: list[tuple[str, str]], diodes: str, params: dict[str, float], changes: list[tuple[str, float]]) -> Model:
    core = _circ.Core.of_files(files, diodes, list(params.items()))
    for name, value in changes:
        core = core.set(name, value)
    return Model(core, diodes, params, changes)


class Model:
    """A circuit with the netlist behind it. Travels (pickle) as its text, parameters and values that were set."""

    def __init__(self, core: _circ.Core, diodes: str, params: dict[str, float], changes: list[tuple[str, float]]):
        self._core, self._diodes, self._params, self._changes = core, diodes, params, changes

    def __reduce__(self) -> tuple[Any, ...]:
        return _read, (self._core.files(), self._diodes, self._params, self._changes)

    def copy(self) -> Model:
        """A model of its own with the same values; nothing is parsed again."""
        return Model(self._core, self._diodes, self._params, list(self._changes))

    @property
    def title(self) -> str:
        """The first line of the netlist."""
        return self._core.title

    @property
    def findings(self) -> list[dict[str, Any]]:
        """Warnings and notes of the netlist, as `NetlistError.diagnostics` has them."""
        return json.loads(self._core.findings())

    def set(self, name: str, value: float) -> None:
        """Gives an element of the top level (R, C, L, the DC value of a source) or a `.param` another value, in SI units.

        Everything that depends on it follows; the text is not parsed again. Raises `NetlistError`, and the model stays as it was.
        """
        self._core = self._core.set(name, float(value))
        self._changes = [change for change in self._changes if change[0] != name.lower()] + [(name.lower(), float(value))]

    def value(self, name: str) -> float:
        """The value of an element (Ω, F, H; V or A of a constant source) or a parameter. Raises `KeyError`."""
        return self._core.value(name)

    def tran(
        self,
        stop: float | None = None,
        step: float | None = None,
        method: str = "auto",
        probes: Sequence[str] | None = None,
        *,
        fixed: float | None = None,
    ) -> Waveforms:
        """The transient, to `stop` s with rows `step` s apart (by default what `.tran` says).

        `method` is "auto", "exact", "euler" or "theta", `fixed` a fixed step of the latter two, s; `probes` names the columns: signals, patterns `v(x1.*)`, expressions `v(a)*i(r1)`. Raises
        `SimulationError`, `KeyError` for a probe that is none. Ctrl-C ends it.
        """
        return Waveforms(self.title, *self._core.tran(stop, step, fixed, method, list(probes or [])))

    def pss(self, period: float | None = None, order: int | None = None, probes: Sequence[str] | None = None) -> Waveforms:
        """The periodic steady state, one period from 0 on; `.pss` has period, residual, multipliers, stability. Raises `SimulationError`."""
        return Waveforms(self.title, *self._core.pss(period, order, list(probes or [])))

    def ac(self, f: Iterable[float] = (), sidebands: int = 0, probes: Sequence[str] | None = None) -> Response:
        """The response to the `AC` values of the sources at the frequencies `f`, Hz (by default those of `.ac`)."""
        return Response(*self._core.ac([float(v) for v in f], sidebands, list(probes or [])))

    def sensitivity(
        self,
        of: Sequence[str] = (),
        to: Sequence[str] = (),
        *,
        steady: bool = False,
        table: bool = False,
        inputs: Sequence[str] = (),
        outputs: Sequence[str] = (),
    ) -> dict[str, Any]:
        """Derivatives of `.meas` results to element values and parameters: `{"of": {measure: {"value": …, "to": {name: …}}}}`.

        `steady` takes those of the periodic steady state, `table` those of the entries of `table()` too, by names like
        `table.power.efficiency`, `table.l1.i.rms`, `table.probes.v(out).ripple`.
        """
        ends = (list(inputs), list(outputs)) if table else None
        return json.loads(self._core.sensitivity(list(of), list(to), steady, ends))

    def table(self, *, steady: bool = False, inputs: Sequence[str] = (), outputs: Sequence[str] = ()) -> dict[str, Any]:
        """Per element mean, rms, extrema of current and voltage, mean power and losses; efficiency, of the transient or the steady state.

        `["d1"]["losses"]` where the model has loss tables or `.thermal` names the device: W, J and °C; what to know is in `["part"]["notes"]`.
        """
        return json.loads(self._core.table(steady, list(inputs), list(outputs)))

    def op(self) -> dict[str, Any]:
        """The operating point: `nodes` in V, `currents` in A, `switches`, `notes`."""
        return json.loads(self._core.op())

    def check(self) -> dict[str, Any]:
        """What is known before a run, as `circ check --json`: topology, passivity, theorems."""
        return json.loads(self._core.check())

    def lcs(self) -> System:
        """The complementarity system x' = A x + B λ + E u + e, y = C x + D λ + G u + F."""
        return System(self.title, *self._core.lcs())

    def simulation(self, method: str = "auto", *, step: float | None = None, until: float | None = None) -> Simulation:
        """A transient whose caller drives it, standing at t = 0⁺."""
        return Simulation(self._core.simulation(method, step, until))

    def __repr__(self) -> str:
        return f"<circ.Model {self.title!r}>"


class Waveforms:
    """Signals over time. `time` in s, shape (rows,); `values`, shape (rows, signals), in the `units` of `names`."""

    def __init__(self, title: str, names: list[str], units: list[str], time: np.ndarray, values: np.ndarray, summary: str, events: str):
        self.title, self.names, self.units = title, names, units
        self.time, self.values = time, values
        self._summary, self._events = summary, events

    @cached_property
    def summary(self) -> dict[str, Any]:
        """What `circ sim --summary json` tells."""
        return json.loads(self._summary)

    @cached_property
    def events(self) -> list[dict[str, Any]]:
        """Events: `t` in s, `changes` in words, `jump`."""
        return json.loads(self._events)

    def __getitem__(self, name: str) -> np.ndarray:
        """The column of a signal, float64, without a copy."""
        try:
            return self.values[:, self.names.index(name.lower())]
        except ValueError:
            raise KeyError(f"no signal {name!r}; there are {', '.join(self.names)}") from None

    def __contains__(self, name: str) -> bool:
        return name.lower() in self.names

    @property
    def energy(self) -> dict[str, float]:
        """The energy balance, J: source = stored + dissipated + jumps + numerical + residual."""
        return self.summary["energy"]

    @property
    def notes(self) -> list[str]:
        """What the user should know."""
        return self.summary["notes"] + self.summary["warnings"]

    @property
    def measures(self) -> dict[str, float | None]:
        """Results of `.meas` by name; None where a measurement found nothing."""
        return {m["name"]: m.get("value") for m in self.summary.get("measurements", [])}

    @property
    def pss(self) -> dict[str, Any] | None:
        """Of a steady state: `period`, `residual`, `multipliers`, `stable`, `kind`, `order`."""
        return self.summary.get("pss")

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` over `time` with the unit of each signal in its attributes."""
        xarray = _optional("xarray")
        columns = {n: ("time", self.values[:, k], {"units": self.units[k]}) for k, n in enumerate(self.names)}
        return xarray.Dataset(columns, coords={"time": ("time", self.time, {"units": "s"})}, attrs={"title": self.title})

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` with the time as its index."""
        pandas = _optional("pandas")
        return pandas.DataFrame(self.values, index=pandas.Index(self.time, name="time"), columns=self.names)

    def plot(self, *names: str, ax: Any = None) -> Any:
        """Draws these signals (by default all) with matplotlib; returns the axes."""
        if ax is None:
            ax = _optional("matplotlib.pyplot").gca()
        for name in names or self.names:
            ax.plot(self.time, self[name], label=name)
        ax.set_xlabel("time, s")
        ax.legend()
        return ax

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        return f"<circ.Waveforms {self.title!r}: {len(self.time)} rows of {', '.join(self.names)}>"

    def _repr_html_(self) -> str:
        return waveforms_html(self)


class Response:
    """Small-signal responses: `frequency` in Hz, shape (rows,); complex columns by name."""

    def __init__(self, names: list[str], frequency: np.ndarray, re: np.ndarray, im: np.ndarray, notes: list[str]):
        self.names, self.frequency, self.values, self.notes = names, frequency, re + 1j * im, notes

    def __getitem__(self, name: str) -> np.ndarray:
        """A column, complex128; the sideband at f + k/T is `v(out)@k`."""
        try:
            return self.values[:, self.names.index(name.lower())]
        except ValueError:
            raise KeyError(f"no signal {name!r}; there are {', '.join(self.names)}") from None

    def to_control(self, name: str) -> Any:
        """A column as a `control.FrequencyResponseData` of python-control: for Bode plots, margins, and loops with a controller."""
        control = _optional("control")
        return control.frd(self[name], 2 * np.pi * self.frequency)


class System:
    """x' = A x + B λ + E u + e, y = C x + D λ + G u + F with −λ_j ∈ ∂φ_j(y_j).

    n states, m ports, p inputs: A n×n, B n×m, C m×n, D m×m, E n×p, G m×p, e (n,), F (m,), P n×n (stored energy ½ xᵀ P x), all float64 and
    C-contiguous; `states` and `inputs` have `name` and `unit`, `ports` `device`, `lambda`, `y`, `law`.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    E: np.ndarray
    G: np.ndarray
    e: np.ndarray
    F: np.ndarray
    P: np.ndarray

    def __init__(self, title: str, arrays: dict[str, np.ndarray], rest: str):
        self.title = title
        for letter, values in arrays.items():
            setattr(self, letter, values)
        described = json.loads(rest)
        self.states, self.inputs, self.ports = described["states"], described["inputs"], described["ports"]
        self.switches = {name: "on" if on else "off" for name, on in described["switches"]}

    def to_scipy(self) -> Any:
        """The linear part as a `scipy.signal.StateSpace`: inputs (λ, u), outputs y; the constants e and F are not in it."""
        signal = _optional("scipy.signal")
        return signal.StateSpace(self.A, np.hstack([self.B, self.E]), self.C, np.hstack([self.D, self.G]))

    def to_control(self) -> Any:
        """The same as a `control.StateSpace` of python-control, with the names of states, ports and sources."""
        control = _optional("control")
        return control.ss(
            self.A,
            np.hstack([self.B, self.E]),
            self.C,
            np.hstack([self.D, self.G]),
            states=[state["name"] for state in self.states],
            inputs=[port["lambda"] for port in self.ports] + [source["name"] for source in self.inputs],
            outputs=[port["y"] for port in self.ports],
        )

    def _repr_html_(self) -> str:
        return system_html(self)


@dataclass(frozen=True)
class Stop:
    """Where a simulation stands after an advance: `time` in s, `reason` "time" or "event", `events` since the last stop."""

    time: float
    reason: str
    events: list[dict[str, Any]]


class Simulation:
    """A circuit in the course of a transient. It stands at right limits: after everything that happens at its time."""

    def __init__(self, course: _circ.Course):
        self._course = course

    @property
    def time(self) -> float:
        """s."""
        return self._course.time

    def advance(self, t: float, *, to_event: bool = False) -> Stop:
        """Advances to `t` s, or to the next event before it. Raises `SimulationError`; the simulation stays where it came to."""
        time, reason, events = self._course.advance(float(t), to_event)
        return Stop(time, reason, json.loads(events))

    @property
    def state(self) -> np.ndarray:
        """All capacitor voltages, V, and inductor currents, A, in the order of `state_names`."""
        return self._course.state()

    @property
    def state_names(self) -> list[str]:
        """`v(c1)`, `i(l1)`, …"""
        return self._course.state_names()

    def __getitem__(self, probe: str) -> float:
        """A probe's value now, V or A."""
        return self._course.value(probe)

    def set_source(self, name: str, value: float) -> None:
        """Holds a source at a value, V or A, from now on: an edge, with the jumps it makes."""
        self._course.set_source(name, float(value))

    def set_switch(self, name: str, on: bool) -> None:
        """Holds a switch in a position from now on, whatever its control says."""
        self._course.set_switch(name, bool(on))

    def checkpoint(self) -> Checkpoint:
        """A state to return to."""
        return self._course.checkpoint()

    def restore(self, checkpoint: Checkpoint) -> None:
        """Goes back to a checkpoint of this simulation."""
        self._course.restore(checkpoint)


def _optional(module: str) -> Any:
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.split(".")[0]
        raise ImportError(f"this needs {package}: pip install {package}") from error
