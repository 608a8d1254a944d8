"""Work in other processes: results, failures, and an orderly end."""

import importlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from railcosim.master.parallel import Task, WorkerLostError, Workers


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
    assert time.perf_counter() - begun < 300  # not for ever; workers take seconds to start


PARENT = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import parallel_tasks
from railcosim.master.parallel import Task, Workers
if __name__ == "__main__":
    files = [Path(name) for name in sys.argv[2:]]
    work = [Task(name=f.name, function=parallel_tasks.nap, arguments=(f,), cost=1.0) for f in files]
    with Workers(lambda done, total: None) as workers:
        list(workers.completed(work, total=2.0))
"""


def wait_for(condition) -> bool:
    end = time.monotonic() + 300
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return condition()


def is_alive(pid: str) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks /proc who is alive")
def test_no_worker_outlives_its_parent(tmp_path) -> None:
    """A parent that is killed can tell nobody."""
    script, said = tmp_path / "parent.py", [tmp_path / "0", tmp_path / "1"]
    script.write_text(PARENT)
    command = [sys.executable, script, str(Path(__file__).parent), *said]
    with subprocess.Popen(command) as parent:
        assert wait_for(lambda: any(f.exists() and f.read_text() for f in said))
        parent.kill()
    workers = [f.read_text() for f in said if f.exists()]
    assert workers
    assert wait_for(lambda: not any(is_alive(pid) for pid in workers))


def test_a_worker_that_is_killed(tasks, tmp_path) -> None:
    """An error that says so, and not a wait for ever."""
    file = tmp_path / "pid"
    task = Task(name="f", function=tasks.nap, arguments=(file,), cost=1.0)

    def kill(done, total):
        if file.exists() and file.read_text():
            os.kill(int(file.read_text()), signal.SIGKILL)
            file.unlink()

    with Workers(kill) as workers, pytest.raises(WorkerLostError, match="was killed"):
        list(workers.completed([task], total=1.0))
