"""Sweeps: one dataset over any arguments of a function, point by point, on all cores, resumable."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import xarray as xr

from railcosim.analysis.joined import Point, Value, joined, said
from railcosim.analysis.schemes.grid_run import connected
from railcosim.master.files import load, save
from railcosim.master.parallel import Task, Workers
from railcosim.master.progress import Progress, unheard
from railcosim.parameters import ArgumentError

Measure: TypeAlias = Callable[..., xr.Dataset]
MOST = 100_000  # points


@dataclass(frozen=True)
class Swept:
    """What came of it.

    Attributes
    ----------
    dataset : Dataset or None
        What the function gave, with a dimension for every axis in front; NaN where nothing came.
        None if nothing came at all.
    failed : list of str
        A sentence for each point that failed.
    """

    dataset: xr.Dataset | None
    failed: list[str]


def sweep(
    measure: Measure,
    axes: Mapping[str, Sequence[Value]],
    folder: str | Path,
    *,
    about: Mapping[str, Any] | None = None,
    only: Sequence[str] = (),
    scheduler: str | None = None,
    progress: Progress = unheard,
    tell: Callable[[str], None] = lambda text: None,
) -> Swept:
    """Call a function for every combination of values, and put what it gives into one dataset.

    Parameters
    ----------
    measure : callable
        At a module's top level (other processes call it), with a value for every axis by its name;
        gives a Dataset.
    axes : mapping
        Values, numbers or words, by name.
    folder : str or Path
        Where each point is kept as soon as it is finished; it is not made again.
    about : mapping, optional
        What JSON can hold and points depend on besides their values: points of a folder with
        another are not taken.
    only : sequence of str
        Variables that are kept when points are joined; all if empty.
    scheduler : str, optional
        Address of a dask scheduler; the cores of this machine if not given.
    progress : callable
        Told the number of points done and of all.
    tell : callable
        Told what was finished before, also when the sweep is interrupted, and what is left out.

    Raises
    ------
    ArgumentError
        If an axis has no values, or one twice, or there are too many points, or none of them has a
        variable that is to be kept.
    JoinError
        If points do not fit together; each is kept.
    NoDaskError, ClusterError, WorkerLostError
        If there is a scheduler and no dask or nobody there, or a process was killed.
    """
    points = _points(axes)
    kept = _Folder(Path(folder), list(axes), about or {})
    missing = [point for point in points if not kept.file(point).exists()]
    if len(missing) < len(points):
        tell(f"{kept.path}: {len(points) - len(missing)} of {len(points)} points are finished")
    failed = []
    try:
        for point, result in _measured(measure, list(axes), missing, scheduler, progress):
            if isinstance(result, xr.Dataset):
                save(result, kept.file(point))
            else:
                failed.append(f"{said(axes, point)}: {' '.join(str(result).split())}")
    except (KeyboardInterrupt, OSError):
        finished = sum(kept.file(point).exists() for point in points)
        if finished:
            tell(
                f"{finished} of {len(points)} points are finished and kept in {kept.path}; "
                "the same command goes on from there"
            )
        raise
    found = {p: load(kept.file(p)) for p in points if kept.file(p).exists()}
    return Swept(joined(axes, found, only, tell) if found else None, failed)


def _points(axes: Mapping[str, Sequence[Value]]) -> list[Point]:
    for name, values in axes.items():
        if not values:
            raise ArgumentError(name, None, "has no values")
        if len(set(values)) < len(values):
            raise ArgumentError(name, None, "has a value twice")
    count = int(np.prod([float(len(values)) for values in axes.values()]))
    if count > MOST:
        raise ArgumentError("axes", None, f"{count} points: at most {MOST}; take fewer values")
    return list(itertools.product(*axes.values()))


def _measured(
    measure: Measure,
    names: list[str],
    points: list[Point],
    scheduler: str | None,
    progress: Progress,
) -> Iterator[tuple[Point, xr.Dataset | str | Exception]]:
    """Results as they come, from here or from wherever the scheduler has workers."""
    if not points:
        return
    if scheduler is not None:
        with connected(scheduler) as (client, cluster):
            submitted = {
                client.submit(_attempt, measure, names, point, pure=False): point
                for point in points
            }
            yield from cluster.completed(client, submitted, progress)
        return
    tasks = (
        Task(name=str(k), function=_attempt, arguments=(measure, names, point), cost=1.0)
        for k, point in enumerate(points)
    )
    with Workers(progress, most=len(points)) as workers:
        for name, found in workers.completed(tasks, len(points)):
            yield points[int(name)], found


def _attempt(
    measure: Measure, names: list[str], point: Point, progress: Progress = unheard
) -> xr.Dataset | str:
    """What a point gives, or what came in its way."""
    progress(0.0, 1.0)
    try:
        return measure(**dict(zip(names, point, strict=True)))
    except Exception as error:  # whatever a worker met
        return str(error) or type(error).__name__


class _Folder:
    """Where points are kept, each a file that is named after all that decides it."""

    def __init__(self, path: Path, names: list[str], about: Mapping[str, Any]) -> None:
        self.path, self._names = path, names
        self._about = {"railcosim": version("railcosim"), **about}
        self._contents: dict[str, str] = {}  # of words that name files, as they are now
        path.mkdir(parents=True, exist_ok=True)

    def file(self, point: Point) -> Path:
        contents = [self._content(word) for word in point if isinstance(word, str)]
        what = [self._about, sorted(zip(self._names, point, strict=True)), sorted(contents)]
        digest = hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()
        return self.path / f"{digest[:24]}.nc"

    def _content(self, word: str) -> str:
        if word not in self._contents:
            content = Path(word).read_bytes() if Path(word).is_file() else b""
            self._contents[word] = hashlib.sha256(content).hexdigest()
        return self._contents[word]
