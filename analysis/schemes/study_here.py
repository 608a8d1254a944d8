"""The points of a study on the cores of this machine; on other machines' it is `cluster`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from railcosim.master.parallel import Task, Workers
from railcosim.master.progress import Progress

from .study_point import ContactCase, Measurement, Point, Subject


def measured(
    subject: Subject, points: Sequence[Point], progress: Progress
) -> Iterator[tuple[Point, Measurement | Exception]]:
    """Give results as they come.

    Parameters
    ----------
    subject : Subject
        What is run.
    points : sequence of Point
        How.
    progress : callable
        Told the number of references done and of all, then of points; may raise to stop everything.

    Raises
    ------
    WorkerLostError
        If a process was killed.
    """
    contacts = {p.contact.label: p.contact for p in points}
    before = [
        Task(name=label, function=_reference, arguments=(subject, contact), cost=1.0)
        for label, contact in contacts.items()
    ]
    n = len(points)
    with Workers(progress, most=len(before) + n) as workers:
        held = dict(workers.completed(before, len(before)))
        for point in points:  # what was not found is said of all points that need it
            if isinstance(held[point.contact.label], Exception):
                yield point, held[point.contact.label]
        tasks = (
            Task(
                name=str(k),
                function=_measure,
                arguments=(subject, point, held[point.contact.label]),
                cost=1.0,
            )
            for k, point in enumerate(points)
            if not isinstance(held[point.contact.label], Exception)
        )
        for name, found in workers.completed(tasks, n):
            yield points[int(name)], found


def _reference(subject: Subject, contact: ContactCase, progress: Progress) -> Any:
    """What runs are held against, or what came in its way."""
    try:
        return subject.reference(contact, progress)
    except InterruptedError:
        raise
    except Exception as error:  # whatever a worker met
        return error


def _measure(
    subject: Subject, point: Point, held: Any, progress: Progress
) -> Measurement | Exception:
    """A measurement, or what came in its way."""
    try:
        return subject.measure(point, held, progress)
    except InterruptedError:
        raise
    except Exception as error:  # whatever a worker met
        return error
