"""Independent work on all cores, with one progress bar, and an orderly end on Ctrl-C."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import connection
from typing import Any

import numpy as np

from railcosim.master.progress import Progress

MOST = 256  # tasks of one set of workers, if nobody says
TICK = 0.2  # s between looks at the progress
CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class WorkerLostError(OSError):
    """A worker process was killed."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """One piece of work.

    Attributes
    ----------
    name : str
        What its result is called.
    function : callable
        At a module's top level; called with `arguments` and a progress callable last.
    arguments : tuple
        What pickle can carry.
    cost : float
        Roughly, s, for the progress bar.
    """

    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    cost: float


_shared: Any = None  # in a worker: what is done of each task, and last whether to stop


class Workers:
    """Processes, one a core, that stop when the block ends; more than one round of tasks may run.

    Parameters
    ----------
    progress : callable
        Told the seconds' worth done and the total; may raise to stop everything.
    most : int, optional
        How many tasks there may be.
    """

    def __init__(self, progress: Progress, most: int = MOST) -> None:
        # Started afresh: a forked copy of a process that has run numerical threads can hang.
        context = multiprocessing.get_context("spawn")
        self._progress = progress
        self._most = most
        self._shared = context.Array("d", most + 1, lock=False)
        self._costs: list[float] = []
        self._pool = ProcessPoolExecutor(
            CORES, mp_context=context, initializer=_begin, initargs=(self._shared,)
        )

    def __enter__(self) -> Workers:
        """Begin at once, so that they are ready when there is work."""
        for _ in range(CORES):
            self._pool.submit(_ready)
        return self

    def __exit__(self, *error: object) -> None:
        """Let running tasks stop at their next word of progress."""
        self._shared[self._most] = 1.0
        self._pool.shutdown(cancel_futures=True)

    def completed(self, tasks: Iterable[Task], total: float) -> Iterator[tuple[str, Any]]:
        """Run tasks and yield names and results as they come.

        Parameters
        ----------
        tasks : iterable of Task
            The longest first; a generator makes them while earlier ones run.
        total : float
            Cost of all of them.

        Raises
        ------
        WorkerLostError
            If a worker was killed.
        """
        try:
            yield from self._completed(tasks, total)
        except BrokenProcessPool as error:
            self._tell(0, total)  # who stops all processes stops this one, too
            raise WorkerLostError(
                "a process that did part of the work was killed; perhaps memory ran out"
            ) from error

    def _completed(self, tasks: Iterable[Task], total: float) -> Iterator[tuple[str, Any]]:
        """Do what `completed` says."""
        running: dict[Future[Any], str] = {}
        begin = len(self._costs)
        for task in tasks:
            k = len(self._costs)
            if k == self._most:
                raise ValueError(f"at most {self._most} tasks")
            self._costs.append(task.cost)
            running[self._pool.submit(_work, k, task.function, task.arguments)] = task.name
            self._tell(begin, total)
        while running:
            done, _ = wait(running, timeout=TICK, return_when=FIRST_COMPLETED)
            self._tell(begin, total)
            for future in done:
                yield running.pop(future), future.result()

    def _tell(self, begin: int, total: float) -> None:
        parts = self._shared[begin : len(self._costs)]
        self._progress(float(np.dot(self._costs[begin:], parts)), total)


def _begin(shared: Any) -> None:
    """Set up a worker. Ctrl-C reaches every process; the parent alone decides what it means."""
    global _shared  # noqa: PLW0603 - how a pool hands something to its workers
    _shared = shared
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Wait until the parent is gone, however it ended, and go too, whatever is being worked on."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    connection.wait([parent.sentinel])
    os._exit(1)


def _ready() -> None:
    """Nothing: a worker that answers has been started."""


def _work(k: int, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    def update(done: float, total: float) -> None:
        if _shared[-1]:
            raise InterruptedError("stopped")
        _shared[k] = done / total

    result = function(*arguments, update)
    _shared[k] = 1.0
    return result
