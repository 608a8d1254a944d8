"""A study: what is not finished is run, on all cores or a dask cluster, and put in one table."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import xarray as xr

from railcosim.analysis.pair.owner import Owner
from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.standing import Position, start_positions
from railcosim.analysis.schemes.pairs_at_rest import Fmus
from railcosim.analysis.schemes.study import EVERY, STEPS, Folder, Grid, settings_of
from railcosim.analysis.schemes.study_here import measured
from railcosim.analysis.schemes.study_point import ContactCase, Measurement, Point
from railcosim.analysis.schemes.study_table import table_of
from railcosim.master.progress import Progress, unheard
from railcosim.track.irregularity import Profile
from railcosim.track.irregularity.defects import Defect
from railcosim.track.irregularity.named import irregularity as named
from railcosim.track.irregularity.named_defects import defects_of


class NoDaskError(ImportError):
    """Dask, an extra, is not installed."""


@dataclass(frozen=True)
class Studied:
    """What came of it.

    Attributes
    ----------
    table : Dataset or None
        Over scheme, owner, contact and step; see `table_of`. None if nothing is finished.
    failed : list of str
        A sentence for each point that failed.
    """

    table: xr.Dataset | None
    failed: list[str]


def study(
    fmus: Mapping[str, Path],
    folder: str | Path,
    schemes: Sequence[str] = EVERY,
    owners: Sequence[Owner | str] = tuple(Owner),
    contacts: Sequence[float | ContactCase] = (1e9,),
    steps: Sequence[float] = STEPS,
    *,
    time: float = 0.05,
    speed: float = 250 / 3.6,
    irregularity: Profile | str | Path = "german-low",
    defects: Iterable[str | Defect] = (),
    position: Position = None,
    scheduler: str | None = None,
    progress: Progress = unheard,
    tell: Callable[[str], None] = lambda text: None,
) -> Studied:
    """Compare schemes with owners, contacts and steps, wheels held; what is finished is not rerun.

    Parameters
    ----------
    fmus : mapping of str to Path
        Our four, or others under their names.
    folder : str or Path
        Where each point is kept as soon as it is finished.
    schemes, owners, contacts, steps
        What is compared; see `Grid.of`.
    time : float
        How long each run is, s.
    speed : float
        m/s.
    irregularity : Profile, str or Path
        Or the name of a class, or a CSV file.
    defects : iterable of Defect or str
        See `railcosim.run`.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands, m; as the FMU has it if None.
    scheduler : str, optional
        Address of a dask scheduler; the cores of this machine if not given.
    progress : callable
        Told the number of points done and of all.
    tell : callable
        Told what was finished before, also when the study is interrupted.

    Raises
    ------
    StudyError
        If the folder holds points of another study.
    ArgumentError
        If there is no such scheme or owner, or nothing stands at such a position.
    ParameterError
        If the irregularity ends before the runs do.
    NoDaskError
        If there is a scheduler, and dask is not installed.
    """
    grid = Grid.of(schemes, owners, contacts, steps)
    grid.check(time)
    if not isinstance(irregularity, Profile):
        irregularity = named(irregularity, speed * time)
    irregularity.check_covers(speed * time)
    start_positions(fmus["Vehicle"], position)  # refused now, and not by every point
    journey = Journey(
        speed=speed, held=True, profile=irregularity, position=position,
        defects=defects_of(defects),
    )  # fmt: skip
    settings = settings_of(journey, time, fmus)
    kept = Folder(Path(folder), settings)
    points = grid.points()
    found = [(p, m) for p in points if (m := kept.find(p)) is not None]
    if found:
        tell(f"{kept.path}: {len(found)} of {len(points)} points are finished already")
    known = {str(p) for p, _ in found}
    missing = [p for p in points if str(p) not in known]
    failed: list[str] = []
    try:
        if missing:
            _run(missing, journey, time, fmus, kept, scheduler, progress, found, failed)
    except (KeyboardInterrupt, OSError):
        finished = sum(kept.find(p) is not None for p in points)  # one may just have been written
        if finished:
            tell(
                f"{finished} of {len(points)} points are finished and kept in {kept.path}; "
                "the same command goes on from there"
            )
        raise
    turn = {str(p): k for k, p in enumerate(points)}
    found.sort(key=lambda result: turn[str(result[0])])
    return Studied(table_of(found, settings) if found else None, failed)


def _run(
    missing: list[Point],
    journey: Journey,
    stop: float,
    fmus: Mapping[str, Path],
    folder: Folder,
    scheduler: str | None,
    progress: Progress,
    found: list[tuple[Point, Measurement]],
    failed: list[str],
) -> None:
    """Run points; what each gives is kept, and added to `found` or `failed` at once."""
    contents = {name: path.read_bytes() for name, path in fmus.items()}
    for point, result in _measured(missing, journey, stop, contents, scheduler, progress):
        if isinstance(result, Measurement):
            folder.keep(point, result)
            found.append((point, result))
        else:
            failed.append(f"{point}: {' '.join(str(result).split())}")


def _measured(
    points: list[Point],
    journey: Journey,
    stop: float,
    fmus: Fmus,
    scheduler: str | None,
    progress: Progress,
) -> Iterator[tuple[Point, Measurement | Exception]]:
    """Results as they come, from here or from wherever the scheduler has workers."""
    if scheduler is None:
        yield from measured(journey, stop, points, fmus, progress)
        return
    with connected(scheduler) as (client, cluster):
        yield from cluster.measured(client, journey, stop, points, fmus, progress)


@contextmanager
def connected(scheduler: str) -> Iterator[tuple[Any, ModuleType]]:
    """A client of a dask scheduler, and what works with one, `cluster`.

    Raises
    ------
    NoDaskError, ClusterError
        If dask is not installed, or nobody is there.
    """
    try:
        from railcosim.analysis.schemes import cluster  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise NoDaskError(
            f'--scheduler needs dask: pip install "railcosim[study]" ({error})'
        ) from error
    with cluster.connect(scheduler) as client:
        yield client, cluster
