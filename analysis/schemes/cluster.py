"""Processes that work on a study wherever a dask scheduler has some; here it is `study_here`.

Needs dask.distributed, the extra ``railcosim[study]``.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from typing import Any, TypeAlias, TypeVar

import distributed

from railcosim.master.parallel import TICK
from railcosim.master.progress import Progress

from .study_point import Measurement, Point, Subject

PATIENCE = 10.0
"""How long (s) a scheduler may take to answer, and to have a worker."""

T = TypeVar("T")
# dask has types in part only.
Client: TypeAlias = Any
Future: TypeAlias = Any
_Client: Any = distributed.Client


class ClusterError(OSError):
    """No scheduler, no workers, or not the right ones; the message says what to do."""


@contextmanager
def connect(address: str) -> Iterator[Client]:
    """Connect to a scheduler.

    Parameters
    ----------
    address : str
        Such as ``tcp://host:8786``; whoever listens there can run any code on its workers.

    Raises
    ------
    ClusterError
        If nobody answers, nobody works, or workers have another version of railcosim.
    """
    # What goes wrong is said in one line, and not in dask's log of tracebacks as well.
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        client = _Client(address, timeout=PATIENCE)
    except (OSError, ValueError) as error:
        raise ClusterError(
            f"--scheduler {address}: no dask scheduler answers there ({_line(error)}); "
            "start one with: dask scheduler"
        ) from error
    with client:
        _check(client, address)
        yield client


def _check(client: Client, address: str) -> None:
    """Raise ClusterError if there are no workers, or of another version."""
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError as error:
        raise ClusterError(
            f"--scheduler {address}: has no workers; start some with: "
            f"dask worker {address} --nthreads 1"
        ) from error
    here = version("railcosim")
    for worker, there in client.run(_version).items():
        if there != here:
            raise ClusterError(
                f"--scheduler {address}: worker {worker} has railcosim {there}, here it is "
                f"{here}; install the same everywhere"
            )


def _version() -> str:
    """Of railcosim, on a worker that may have none."""
    from importlib.metadata import PackageNotFoundError, version  # noqa: PLC0415 - travels alone

    try:
        return version("railcosim")
    except PackageNotFoundError:
        return "not installed"


def measured(
    client: Client, subject: Subject, points: Sequence[Point], progress: Progress
) -> Iterator[tuple[Point, Measurement | Exception]]:
    """Give results as they come.

    What many runs need is a task too, and so is made again if the worker that holds it dies.

    Parameters
    ----------
    client : Client
        From `connect`.
    subject, points
        What to run. FMUs travel to the workers, which need not share a disk with anybody.
    progress : callable
        Told the number of points done and of all; may raise to stop everything.

    Raises
    ------
    ClusterError
        If the scheduler is lost.
    """
    common, kind = client.submit(_same, subject, pure=False), type(subject)
    held = {
        label: client.submit(kind.reference, common, contact, pure=False)
        for label, contact in {p.contact.label: p.contact for p in points}.items()
    }
    pending: dict[Future, Point] = {
        client.submit(kind.measure, common, p, held[p.contact.label], pure=False): p for p in points
    }
    yield from completed(client, pending, progress)


def completed(
    client: Client, pending: dict[Future, T], progress: Progress
) -> Iterator[tuple[T, Any]]:
    """Give what was submitted under a name, with its result or what came in its way.

    Parameters
    ----------
    client : Client
        From `connect`.
    pending : dict
        Name by future; it empties.
    progress : callable
        Told how many are done and of all; may raise to stop everything.

    Raises
    ------
    ClusterError
        If the scheduler is lost.
    """
    count = len(pending)
    while pending:
        progress(count - len(pending), count)
        if client.status != "running" or any(f.cancelled() for f in pending):
            raise ClusterError("the scheduler is lost, and with it the runs not finished")
        # Not `done`: a result lost with its worker is so, too, until it is made again.
        for future in [f for f in pending if f.status in {"finished", "error"}]:
            yield pending.pop(future), _outcome(future)
        time.sleep(TICK)
    progress(count, count)


def _same(value: T) -> T:
    """Put something on the cluster that can be put there again."""
    return value


def _outcome(future: Future) -> Any:
    """Fetch a result, or what came in its way."""
    try:
        return future.result()
    except Exception as error:  # whatever a worker met
        return error


def _line(error: Exception) -> str:
    return " ".join(str(error).split())
