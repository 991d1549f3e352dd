"""Many variants of one model: grids of values and samples of tolerances."""

from __future__ import annotations

import itertools
import os
import pickle
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from . import Model

#: Variants that travel to a worker together.
_CHUNK = 64


@dataclass(frozen=True)
class Tolerance:
    """How a value is drawn about its nominal one: `kind` "normal" (`rel` is the standard deviation) or "uniform" (`rel` the half width)."""

    kind: str
    rel: float

    def factor(self, generator: np.random.Generator) -> float:
        """What the nominal value is multiplied with."""
        draw = generator.standard_normal() if self.kind == "normal" else generator.uniform(-1.0, 1.0)
        return 1.0 + self.rel * float(draw)


def normal(rel: float) -> Tolerance:
    """Normally distributed with standard deviation `rel` of the nominal value."""
    return Tolerance("normal", rel)


def uniform(rel: float) -> Tolerance:
    """Evenly distributed within ±`rel` of the nominal value."""
    return Tolerance("uniform", rel)


def _one(model: Model, values: Mapping[str, float], measures: Sequence[str], of: str) -> tuple[list[float], str]:
    """The measures with these values, and what failed; nothing is raised but for a mistake in the call."""
    from . import NetlistError, SimulationError

    try:
        variant = model.copy()
        for name, value in values.items():
            variant.set(name, value)
        found = (variant.pss() if of == "pss" else variant.tran()).measures
    except (NetlistError, SimulationError) as error:
        return [float("nan")] * len(measures), str(error)
    missing = [name for name in measures if name not in found]
    if missing:
        raise KeyError(f"no .meas {', '.join(missing)}; there are {', '.join(found) or 'none'}")
    values_found = [found[name] for name in measures]
    return [float("nan") if value is None else value for value in values_found], ""


def _many(packed: bytes, variants: Sequence[Mapping[str, float]], measures: Sequence[str], of: str) -> list[tuple[list[float], str]]:
    model = pickle.loads(packed)
    return [_one(model, values, measures, of) for values in variants]


def _run(
    model: Model, variants: list[dict[str, float]], measures: Sequence[str], of: str, engine: str, client: Any
) -> list[tuple[list[float], str]]:
    if of not in ("tran", "pss"):
        raise ValueError(f"of={of!r}: tran or pss")
    if engine == "threads":
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return list(pool.map(lambda values: _one(model, values, measures, of), variants))
    if engine == "dask":
        if client is None:
            raise ValueError("engine='dask' needs client=, a dask.distributed Client")
        packed = pickle.dumps(model)
        chunks = [variants[k : k + _CHUNK] for k in range(0, len(variants), _CHUNK)]
        futures = [client.submit(_many, packed, chunk, list(measures), of, pure=False, retries=3) for chunk in chunks]
        return list(itertools.chain.from_iterable(client.gather(futures)))
    raise ValueError(f"engine={engine!r}: threads or dask")


def _dataset(results: list[tuple[list[float], str]], measures: Sequence[str], dims: list[str], coords: dict[str, Any], shape: tuple[int, ...]) -> Any:
    from . import _optional

    xarray = _optional("xarray")
    columns = {name: (dims, np.array([row[k] for row, _ in results]).reshape(shape)) for k, name in enumerate(measures)}
    columns["error"] = (dims, np.array([error for _, error in results], dtype=object).reshape(shape))
    return xarray.Dataset(columns, coords=coords)


def sweep(
    model: Model,
    values: Mapping[str, Sequence[float]],
    measures: Sequence[str],
    of: str = "tran",
    engine: str = "threads",
    client: Any = None,
) -> Any:
    """`.meas` results over all combinations of values of elements and parameters.

    An `xarray.Dataset` whose dimensions are the names of `values`, with a variable for each of `measures` and `error`: why a variant has no
    values (NaN), empty where it has. `of` is "tran" or "pss", `engine` "threads" or "dask" (with a `dask.distributed` `client`).
    """
    names, axes = list(values), [[float(v) for v in axis] for axis in values.values()]
    variants = [dict(zip(names, point)) for point in itertools.product(*axes)]
    results = _run(model, variants, measures, of, engine, client)
    return _dataset(results, measures, names, dict(zip(names, axes)), tuple(len(axis) for axis in axes))


def monte_carlo(
    model: Model,
    tolerances: Mapping[str, Tolerance],
    n: int,
    seed: int,
    measures: Sequence[str],
    nominal: Mapping[str, float] | None = None,
    of: str = "tran",
    engine: str = "threads",
    client: Any = None,
) -> Any:
    """`.meas` results of `n` samples, an `xarray.Dataset` over `sample` with the values that were drawn.

    Sample k depends on `seed` and k alone, not on the engine or its workers. Values are drawn about those of the model; `nominal` names others.
    """
    nominal = {name: model.value(name) for name in tolerances} | dict(nominal or {})
    variants = []
    for k in range(n):
        generator = np.random.Generator(np.random.Philox(key=[seed, k]))
        variants.append({name: nominal[name] * tolerance.factor(generator) for name, tolerance in tolerances.items()})
    results = _run(model, variants, measures, of, engine, client)
    found = _dataset(results, measures, ["sample"], {"sample": np.arange(n)}, (n,))
    return found.assign({f"value of {name}": ("sample", np.array([v[name] for v in variants])) for name in tolerances})
