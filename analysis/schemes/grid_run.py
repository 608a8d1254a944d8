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
from railcosim.analysis.schemes.study import EVERY, STEPS, Folder, Grid, settings_of
from railcosim.analysis.schemes.study_here import measured
from railcosim.analysis.schemes.study_point import (
    ContactCase,
    Measurement,
    PairStudied,
    Point,
    Subject,
)
from railcosim.analysis.schemes.study_table import table_of
from railcosim.analysis.schemes.system_study import planned
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
    points : int
        How many there are.
    """

    table: xr.Dataset | None
    failed: list[str]
    points: int


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
    contents = {name: path.read_bytes() for name, path in fmus.items()}
    return kept_study(
        PairStudied(journey=journey, stop=time, fmus=contents), grid.points(),
        settings_of(journey, time, fmus), folder, scheduler, progress, tell,
    )  # fmt: skip


def study_system(
    path: str | Path,
    folder: str | Path,
    schemes: Sequence[str] = EVERY,
    steps: Sequence[float] = (),
    *,
    law: str | Path | None = None,
    time: float | None = None,
    scheduler: str | None = None,
    progress: Progress = unheard,
    tell: Callable[[str], None] = lambda text: None,
) -> Studied:
    """Compare schemes and steps on any system of FMUs; see `study`.

    Errors are of all that is exchanged, against an extrapolation (`extrapolated`), whose own error
    is estimated and told.

    Parameters
    ----------
    path : str or Path
        An SSP file. The code in it is run.
    folder, scheduler, progress, tell
        See `study`.
    schemes : sequence of str
        Names of the catalogue, with the system's FMUs for vehicle and track, or patterns.
    steps : sequence of float, optional
        s; the file's, its half and its quarter if not given.
    law : str or Path, optional
        Between its FMUs, in the master.
    time : float, optional
        How long each run is, s; the file's experiment if not given.

    Raises
    ------
    StudyError, ArgumentError, NoDaskError
        See `study`.
    FmuError, CouplingError
        If the file or the law is refused.
    """
    plan = planned(Path(path), None if law is None else Path(law), schemes, steps, time)
    for name, why in plan.refused.items():
        tell(f"{name}: left out: {why}")
    return kept_study(plan.subject, plan.points, plan.settings, folder, scheduler, progress, tell)


def kept_study(
    subject: Subject,
    points: list[Point],
    settings: Mapping[str, Any],
    folder: str | Path,
    scheduler: str | None,
    progress: Progress,
    tell: Callable[[str], None],
) -> Studied:
    """Run what is not kept in a folder yet, and put all in a table; see `study`."""
    kept = Folder(Path(folder), settings)
    found = [(p, m) for p in points if (m := kept.find(p)) is not None]
    if found:
        tell(f"{kept.path}: {len(found)} of {len(points)} points are finished already")
    known = {str(p) for p, _ in found}
    missing = [p for p in points if str(p) not in known]
    failed: list[str] = []
    try:
        if missing:
            _run(missing, subject, kept, scheduler, progress, found, failed)
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
    about = {**settings, "compared": subject.compared, "held_to": subject.held_to}
    return Studied(table_of(found, about) if found else None, failed, len(points))


def _run(
    missing: list[Point],
    subject: Subject,
    folder: Folder,
    scheduler: str | None,
    progress: Progress,
    found: list[tuple[Point, Measurement]],
    failed: list[str],
) -> None:
    """Run points; what each gives is kept, and added to `found` or `failed` at once."""
    for point, result in _measured(missing, subject, scheduler, progress):
        if isinstance(result, Measurement):
            folder.keep(point, result)
            found.append((point, result))
        else:
            failed.append(f"{point}: {' '.join(str(result).split())}")


def _measured(
    points: list[Point], subject: Subject, scheduler: str | None, progress: Progress
) -> Iterator[tuple[Point, Measurement | Exception]]:
    """Results as they come, from here or from wherever the scheduler has workers."""
    if scheduler is None:
        yield from measured(subject, points, progress)
        return
    with connected(scheduler) as (client, cluster):
        yield from cluster.measured(client, subject, points, progress)


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
