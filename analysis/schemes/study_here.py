"""The points of a study on the cores of this machine; on other machines' it is `cluster`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey
from railcosim.master.parallel import Task, Workers
from railcosim.master.progress import Progress

from .coupled_reference import ContactForces
from .pairs_at_rest import Fmus
from .study_point import ContactCase, Measurement, Point, measure, reference


def measured(
    journey: Journey, stop: float, points: Sequence[Point], fmus: Fmus, progress: Progress
) -> Iterator[tuple[Point, Measurement | Exception]]:
    """Give results as they come.

    Parameters
    ----------
    journey, stop, points, fmus
        What to run.
    progress : callable
        Told the number of points done and of all; may raise to stop everything.

    Raises
    ------
    WorkerLostError
        If a process was killed.
    """
    contacts = {p.contact.label: p.contact for p in points}
    bodies = [fmus[name] for name in FMUS[Owner.MASTER]]
    before = [
        Task(name=label, function=_reference, arguments=(journey, stop, contact, *bodies), cost=0.0)
        for label, contact in contacts.items()
    ]
    n = len(points)
    with Workers(progress, most=len(before) + n) as workers:
        forces = dict(workers.completed(before, n))
        for point in points:  # what was not found is said of all points that need it
            if isinstance(forces[point.contact.label], Exception):
                yield point, forces[point.contact.label]
        tasks = (
            Task(
                name=str(k),
                function=_measure,
                arguments=(
                    journey, stop, point, *(fmus[name] for name in FMUS[point.owner]),
                    forces[point.contact.label],
                ),
                cost=1.0,
            )
            for k, point in enumerate(points)
            if not isinstance(forces[point.contact.label], Exception)
        )  # fmt: skip
        for name, found in workers.completed(tasks, n):
            yield points[int(name)], found


def _reference(
    journey: Journey,
    stop: float,
    contact: ContactCase,
    vehicle: bytes,
    track: bytes,
    progress: Progress,
) -> ContactForces | Exception:
    """The converged forces, or what came in their way."""
    try:
        return reference(journey, stop, contact, vehicle, track, progress)
    except InterruptedError:
        raise
    except Exception as error:  # whatever a worker met
        return error


def _measure(
    journey: Journey,
    stop: float,
    point: Point,
    vehicle: bytes,
    track: bytes,
    forces: ContactForces,
    progress: Progress,
) -> Measurement | Exception:
    """A measurement, or what came in its way."""
    try:
        return measure(journey, stop, point, vehicle, track, forces, progress)
    except InterruptedError:
        raise
    except Exception as error:  # whatever a worker met
        return error
