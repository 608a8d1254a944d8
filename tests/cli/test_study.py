"""`railcosim study` as a user meets it: on a scheduler, interrupted, and with mistakes."""

import os
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pytest

from railcosim.cli.main import run
from railcosim.master.files import load
from railcosim.parameters import write_toml

pytestmark = pytest.mark.slow  # grids of runs on workers, a minute and more

distributed = pytest.importorskip("distributed")

COMMAND = [sys.executable, "-c", "from railcosim.cli.main import run; run()"]
ENVIRONMENT = {**os.environ, "COLUMNS": "120", "OPENBLAS_NUM_THREADS": "1"}
SMALL = ["--track", "track.toml", "--time", "0.02", "--owners", "track"]


def study(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*COMMAND, "study", *arguments], cwd=folder, env=ENVIRONMENT, capture_output=True,
        text=True, timeout=1800, check=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory, short_track):
    path = tmp_path_factory.mktemp("study")
    (path / "track.toml").write_text(write_toml(short_track, "short"))
    return path


@pytest.fixture(scope="module")
def scheduler():
    """Address of a scheduler with two worker processes."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
        silence_logs="CRITICAL",
    ) as cluster:  # fmt: skip
        yield cluster.scheduler_address


def test_study_on_a_scheduler_and_then_here(folder, scheduler) -> None:
    """The same call with and without --scheduler; what is finished is not run again."""
    common = [*SMALL, "--schemes", "jacobi-*", "--out", "grid"]
    done = study(*common, "--steps", "1e-4,5e-5", "--scheduler", scheduler, folder=folder)
    assert done.returncode == 0, done.stderr
    assert "jacobi-quadratic, track" in done.stdout
    points = {path: path.stat().st_mtime_ns for path in (folder / "grid/points").iterdir()}
    assert len(points) == 6
    first = load(folder / "grid/study.nc")
    # Inputs held over 0.1 ms, the worst of them, leave a fifth over so short a ride.
    assert (first["error"] < 0.3).all()

    more = study(
        *common, "--steps", "2e-4,1e-4,5e-5", "--plot", "orders.svg", folder=folder
    )  # on processes of its own
    assert more.returncode == 0, more.stderr
    assert "6 of 9 points are finished already" in more.stdout
    assert {path: path.stat().st_mtime_ns for path in points} == points
    table = load(folder / "grid/study.nc")
    assert table.sizes["step"] == 3
    assert (table["error"].sel(step=first["step"]) == first["error"]).all()
    orders = table["observed_order"].isel(owner=0, contact=0).values
    # Steps from 0.2 ms on are too long for held inputs to show their order: none is told then.
    assert np.isnan(orders[0])
    # Nor is the rest all asymptotic yet (measured 2.96).
    assert orders[1:] == pytest.approx([2, 3], abs=0.15)
    assert "relative error of contact forces" in (folder / "orders.svg").read_text()


def test_interrupted_study_goes_on(folder, scheduler) -> None:
    """Ctrl-C keeps what is finished and says how to go on; the second run makes the rest."""
    arguments = [
        *SMALL, "--schemes", "gauss-seidel-*", "--steps", "5e-5,4e-5,2e-5", "--out", "broken",
        "--scheduler", scheduler,
    ]  # fmt: skip
    points = folder / "broken/points"
    process = subprocess.Popen(
        [*COMMAND, "study", *arguments], cwd=folder, env=ENVIRONMENT, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    deadline = time.monotonic() + 600
    while not (points.is_dir() and any(points.glob("[0-9a-f]*.json"))):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    told, said = process.communicate(timeout=1800)
    assert process.returncode == 1
    assert "the same command goes on from there" in told
    assert "Traceback" not in said
    kept = {path: path.stat().st_mtime_ns for path in points.glob("[0-9a-f]*.json")}
    assert 0 < len(kept) < 18
    done = study(*arguments, folder=folder)
    assert done.returncode == 0, done.stderr
    assert f"{len(kept)} of 18 points are finished already" in done.stdout
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    table = load(folder / "broken/study.nc")
    assert np.isfinite(table["error"]).sum() == 18


@pytest.mark.parametrize(
    ("arguments", "status", "says"),
    [
        (["--schemes", "jacobi-linaer"], 2, "did you mean jacobi-linear"),
        (["--schemes", ","], 2, "names nothing"),
        (["--steps", "1e-4,-1"], 2, "--steps -1: must be > 0 s"),
        (["--steps", "short"], 2, "must be numbers > 0"),
        (["--steps", "1"], 2, "longer than the run of 0.05 s"),
        (["--owners", "rail"], 2, "vehicle, track, master"),
        (["--contact-stiffness", "1e9,soft"], 2, "--contact-stiffness soft"),
        (["--schemes", "interface-jacobian", "--owners", "track"], 2, "none of the schemes"),
        (["--plot", "x.txt"], 2, ".png"),
        (["--position", "1e9", *SMALL], 2, "--position 1e+09: must be from -1e+06 to 1e+06 m"),
        (["--scheduler", "tcp://127.0.0.1:9", *SMALL], 1, "dask scheduler"),
        (["--out", "other", *SMALL], 2, "points of another study: time was 1.0"),
    ],
)
def test_mistakes_in_one_line(folder, arguments, status, says, monkeypatch, capfd) -> None:
    """What is wrong, what is allowed, and no traceback."""
    (folder / "other").mkdir(exist_ok=True)
    (folder / "other/study.json").write_text('{"time": 1.0}')
    monkeypatch.chdir(folder)
    monkeypatch.setattr("warnings.showwarning", warnings.showwarning)  # `run` sets its own
    monkeypatch.setattr("sys.argv", ["railcosim", "study", *arguments])
    monkeypatch.setattr(
        "railcosim.analysis.schemes.cluster.PATIENCE", 0.5
    )  # s; nobody will ever answer
    with pytest.raises(SystemExit) as stopped:
        run()
    assert stopped.value.code == status
    assert says in " ".join(capfd.readouterr().err.split())
