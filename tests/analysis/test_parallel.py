"""Work in other processes: results, failures, and an orderly end."""

import importlib
import os
import time
from pathlib import Path

import pytest

from railcosim.analysis.parallel import Task, Workers


@pytest.fixture(autouse=True)
def tasks(monkeypatch):
    """The module of tasks; worker processes are given the same path."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    return importlib.import_module("parallel_tasks")


def test_results_come_from_other_processes_under_their_names(tasks) -> None:
    told = []
    work = [
        Task(name=f"t{k}", function=tasks.square, arguments=(k,), cost=k + 1.0) for k in range(5)
    ]
    with Workers(lambda done, total: told.append((done, total))) as workers:
        found = dict(workers.completed(iter(work), total=15.0))
        again = dict(workers.completed(work[:1], total=1.0))  # a second round
    assert {name: value for name, (value, _) in found.items()} == {f"t{k}": k * k for k in range(5)}
    assert os.getpid() not in {pid for _, pid in found.values()}
    assert again["t0"][0] == 0
    assert all(0 <= done <= total for done, total in told)
    assert told[-1][1] == 1.0


def test_an_error_is_the_tasks_own(tasks) -> None:
    with Workers(lambda done, total: None) as workers, pytest.raises(ValueError, match="no such"):
        list(
            workers.completed(
                [Task(name="f", function=tasks.fail, arguments=(), cost=1.0)], total=1.0
            )
        )


def test_stopping_stops_the_workers(tasks) -> None:
    """Progress that raises (Ctrl-C) ends also what would run for ever."""

    def stop(done, total):
        raise KeyboardInterrupt

    task = Task(name="f", function=tasks.for_ever, arguments=(), cost=1.0)
    begun = time.perf_counter()
    with pytest.raises(KeyboardInterrupt), Workers(stop) as workers:
        list(workers.completed([task, task], total=2.0))
    assert time.perf_counter() - begun < 30  # not for ever; workers take seconds to start
