"""Independent work on all cores, with one progress bar, and an orderly end on Ctrl-C."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

Progress: TypeAlias = Callable[[float, float], None]

TICK = 0.2  # s between looks at the progress
CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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


def completed(
    tasks: Iterable[Task], progress: Progress, *, total: float, most: int = 64
) -> Iterator[tuple[str, Any]]:
    """Run tasks in other processes, one a core, and yield names and results as they come.

    Parameters
    ----------
    tasks : iterable of Task
        The longest first; a generator makes them while earlier ones run.
    progress : callable
        Told the seconds' worth done and `total`; may raise to stop everything.
    total : float
        Cost of all tasks.
    most : int
        No more tasks than that.

    Raises
    ------
    concurrent.futures.process.BrokenProcessPool
        If a worker was killed.
    """
    # Started afresh: a forked copy of a process that has run numerical threads can hang.
    context = multiprocessing.get_context("spawn")
    shared = context.Array("d", most + 1, lock=False)
    with ProcessPoolExecutor(
        CORES, mp_context=context, initializer=_begin, initargs=(shared,)
    ) as pool:
        running: dict[Future[Any], str] = {}
        costs: list[float] = []
        try:
            for k, task in enumerate(tasks):
                running[pool.submit(_work, k, task.function, task.arguments)] = task.name
                costs.append(task.cost)
                progress(float(np.dot(costs, shared[: len(costs)])), total)
            while running:
                done, _ = wait(running, timeout=TICK, return_when=FIRST_COMPLETED)
                progress(float(np.dot(costs, shared[: len(costs)])), total)
                for future in done:
                    yield running.pop(future), future.result()
        finally:
            shared[most] = 1.0
            pool.shutdown(cancel_futures=True)


def _begin(shared: Any) -> None:
    """Set up a worker. Ctrl-C reaches every process; the parent alone decides what it means."""
    global _shared  # noqa: PLW0603 - how a pool hands something to its workers
    _shared = shared
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _work(k: int, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    def update(done: float, total: float) -> None:
        if _shared[-1]:
            raise InterruptedError("stopped")
        _shared[k] = done / total

    result = function(*arguments, update)
    _shared[k] = 1.0
    return result
