"""Many variants of one model: grids of values and samples of tolerances."""

from __future__ import annotations

import itertools
import pickle
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from . import Model

#: Seconds that a chunk of variants is to take: often enough for progress and Ctrl-C, long enough that a worker's messages cost little.
_CHUNK_SECONDS = 0.5

#: Variants of the first chunks, whose time is not known yet.
_FIRST_CHUNK = 16

#: A variant: its values, and the number of its sample.
_Point = tuple[list[float], int | None]

#: Is told how many variants are done, of how many.
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Tolerance:
    """How a value is drawn about its nominal one: `kind` "normal" (`rel` is the standard deviation) or "uniform" (`rel` the half width)."""

    kind: str
    rel: float


def normal(rel: float) -> Tolerance:
    """Normally distributed with standard deviation `rel` of the nominal value."""
    return Tolerance("normal", rel)


def uniform(rel: float) -> Tolerance:
    """Evenly distributed within ±`rel` of the nominal value."""
    return Tolerance("uniform", rel)


@dataclass(frozen=True)
class _Question:
    """What is asked of every variant."""

    names: list[str]
    measures: list[str]
    steady: bool
    #: Seed and tolerances (name, kind, rel), where samples are drawn.
    random: tuple[int, list[tuple[str, str, float]]] | None
    #: What is drawn.
    drawn: list[str]

    def ask(self, model: Model, points: Sequence[_Point], serial: bool) -> tuple[np.ndarray, list[str]]:
        """Values, a row a point and a column a measure and what is drawn, and failures."""
        values, failures, _, _ = model._core.sweep(self.names, list(points), self.measures, self.steady, self.random, serial)
        return values, failures


def _timed(packed: bytes, question: _Question, points: Sequence[_Point]) -> tuple[np.ndarray, list[str], float]:
    """A worker's part, in one thread: the cluster decides how many there are."""
    start = time.perf_counter()
    values, failures = question.ask(pickle.loads(packed), points, True)
    return values, failures, time.perf_counter() - start


class _Chunks:
    """The variants in chunks that take about `_CHUNK_SECONDS`, by the time that those before took."""

    def __init__(self, points: Iterator[_Point]):
        self._points, self._seconds = points, 0.0

    def next(self) -> list[_Point]:
        """The next chunk, empty after the last."""
        size = int(_CHUNK_SECONDS / self._seconds) if self._seconds > 0 else _FIRST_CHUNK
        return list(itertools.islice(self._points, max(size, 1)))

    def took(self, count: int, seconds: float) -> None:
        """What a chunk of so many variants took."""
        self._seconds = seconds / count


def _threads(model: Model, question: _Question, points: Iterator[_Point], tell: Callable[[int], None]) -> list[tuple[np.ndarray, list[str]]]:
    chunks, results = _Chunks(points), []
    while chunk := chunks.next():
        start = time.perf_counter()
        results.append(question.ask(model, chunk, False))
        chunks.took(len(chunk), time.perf_counter() - start)
        tell(len(chunk))
    return results


def _dask(
    model: Model, question: _Question, points: Iterator[_Point], tell: Callable[[int], None], client: Any
) -> list[tuple[np.ndarray, list[str]]]:
    from distributed import as_completed

    # With every chunk: what is scattered is lost with the worker that has it.
    packed = pickle.dumps(model)
    chunks, under_way, results = _Chunks(points), as_completed(), {}
    sizes: dict[str, tuple[int, int]] = {}

    def submit() -> None:
        if chunk := chunks.next():
            future = client.submit(_timed, packed, question, chunk, pure=False, retries=3)
            sizes[future.key] = (len(sizes), len(chunk))
            under_way.add(future)

    # Two for each thread of the cluster: it never waits for this side.
    for _ in range(2 * max(sum(client.nthreads().values()), 1)):
        submit()
    for future in under_way:
        place, size = sizes[future.key]
        if future.status == "finished":
            values, failures, seconds = future.result()
            chunks.took(size, seconds)
        else:
            # Its workers were lost again and again: the rest is kept.
            why = future.exception()
            width = len(question.measures) + len(question.drawn)
            values, failures = np.full((size, width), np.nan), [f"lost by the cluster: {type(why).__name__}: {why}"] * size
        results[place] = (values, failures)
        tell(size)
        submit()
    return [results[place] for place in range(len(results))]


def _bar(done: int, total: int) -> None:
    end = "\n" if done == total else ""
    print(f"\r{done} of {total} variants", end=end, file=sys.stderr, flush=True)


def _run(
    model: Model, question: _Question, points: Iterator[_Point], total: int, engine: str, client: Any, progress: Progress | bool
) -> tuple[np.ndarray, np.ndarray]:
    """Values and failures."""
    done = 0
    report = _bar if progress is True else progress

    def tell(count: int) -> None:
        nonlocal done
        done += count
        if report:
            report(done, total)

    if engine == "threads":
        results = _threads(model, question, points, tell)
    elif engine != "dask":
        raise ValueError(f"engine={engine!r}: threads or dask")
    elif client is None:
        raise ValueError("engine='dask' needs client=, a dask.distributed Client")
    else:
        results = _dask(model, question, points, tell, client)
    width = len(question.measures) + len(question.drawn)
    values = np.concatenate([np.empty((0, width)), *(values for values, _ in results)])
    failures = list(itertools.chain.from_iterable(failures for _, failures in results))
    return values, np.array(failures, dtype=object)


def _question(model: Model, names: Sequence[str], measures: Sequence[str], of: str, tolerances: Mapping[str, Tolerance], seed: int | None) -> _Question:
    """Mistakes in a call are raised here; failures of a variant are not."""
    if of not in ("tran", "pss"):
        raise ValueError(f"of={of!r}: tran or pss")
    for name in [*names, *tolerances]:
        model.value(name)
    random = None if seed is None else (seed, [(name, tolerance.kind, float(tolerance.rel)) for name, tolerance in tolerances.items()])
    _, _, measured, drawn = model._core.sweep(list(names), [], list(measures), of == "pss", random, True)
    return _Question(list(names), measured, of == "pss", random, drawn if random else [])


def sweep(
    model: Model,
    values: Mapping[str, Sequence[float]],
    measures: Sequence[str],
    of: str = "tran",
    engine: str = "threads",
    client: Any = None,
    *,
    progress: Progress | bool = False,
) -> Any:
    """`.meas` results over all combinations of values of elements and parameters.

    An `xarray.Dataset` whose dimensions are the names of `values`, with a variable for each of `measures` and `error`: why a variant has no
    values (NaN), empty where it has. `of` is "tran" or "pss", `engine` "threads" or "dask" (with a `dask.distributed` `client`); `progress`
    is told how many variants are done, of how many, or writes it to stderr (`True`). Raises `KeyError` for what has no value or is no `.meas`.
    """
    from . import _optional

    xarray = _optional("xarray")
    axes = {name: [float(v) for v in axis] for name, axis in values.items()}
    shape = tuple(len(axis) for axis in axes.values())
    question = _question(model, list(axes), measures, of, {}, None)
    points = ((list(point), None) for point in itertools.product(*axes.values()))
    found, failures = _run(model, question, points, int(np.prod(shape)), engine, client, progress)
    columns = {name: (list(axes), found[:, k].reshape(shape)) for k, name in enumerate(question.measures)}
    columns["error"] = (list(axes), failures.reshape(shape))
    return xarray.Dataset(columns, coords=axes)


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
    *,
    progress: Progress | bool = False,
) -> Any:
    """`.meas` results of `n` samples, an `xarray.Dataset` over `sample` with the values that were drawn, as `value of NAME`.

    Values are drawn about those of the model; `nominal` sets others. Cards with `tol=` and random functions (`mc`, `gauss`, …) of the netlist
    are drawn too. Sample k depends on `seed` and k alone, not on the engine or its workers: it is `circ sim --sample k --seed seed`. The rest
    is as in `sweep`.
    """
    from . import _optional

    xarray = _optional("xarray")
    if nominal:
        model = model.copy()
        for name, value in nominal.items():
            model.set(name, value)
    question = _question(model, [], measures, of, tolerances, seed)
    points: Iterator[_Point] = (([], k) for k in range(n))
    found, failures = _run(model, question, points, n, engine, client, progress)
    names = [*question.measures, *(f"value of {name}" for name in question.drawn)]
    columns: dict[str, Any] = {name: ("sample", found[:, k]) for k, name in enumerate(names)}
    columns["error"] = ("sample", failures)
    return xarray.Dataset(columns, coords={"sample": np.arange(n)})
