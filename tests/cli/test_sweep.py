"""`railcosim sweep` as a user meets it: killed and gone on with, here and on a scheduler."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from railcosim.master.files import load
from railcosim.track.parameters import Fastening, Track
from railcosim.track.receptance import Point, infinite_receptance

pytestmark = pytest.mark.slow  # worker processes that load all there is, a minute

COMMAND = [sys.executable, "-c", "from railcosim.cli.main import run; run()", "sweep"]
ENVIRONMENT = {**os.environ, "COLUMNS": "120", "OPENBLAS_NUM_THREADS": "1"}
ARGUMENTS = [
    "track-receptance", "--frequencies", "20:400:1", "--load", "single",
    "--set", "fastening.stiffness=2e7:6e7:5", "--set", "position=railseat,midspan",
]  # fmt: skip


def started(folder, *more):
    return subprocess.Popen(
        [*COMMAND, *ARGUMENTS, "--out", "s.nc", *more], cwd=folder, env=ENVIRONMENT, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip


def killed_with_some_finished(folder, *more):
    """Every process of it, without a word; what is finished by then."""
    process, deadline = started(folder, *more), time.monotonic() + 120
    points = folder / "s.nc.points"
    while len(list(points.glob("[0-9a-f]*.nc"))) < 2:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    kept = {p: p.stat().st_mtime_ns for p in points.glob("[0-9a-f]*.nc")}
    assert 2 <= len(kept) < 10
    return kept


def gone_on(folder, kept, *more):
    process = started(folder, *more)
    told, said = process.communicate(timeout=100)
    assert process.returncode == 0, said
    assert f"{len(kept)} of 10 points are finished" in told
    assert {p: p.stat().st_mtime_ns for p in kept} == kept
    return load(folder / "s.nc")


def test_goes_on_after_a_kill_here_and_then_on_a_scheduler(tmp_path):
    distributed = pytest.importorskip("distributed")
    kept = killed_with_some_finished(tmp_path)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
        silence_logs="CRITICAL",
    ) as cluster:  # fmt: skip
        scheduler = ["--scheduler", cluster.scheduler_address]
        found = gone_on(tmp_path, kept, *scheduler, "--plot", "s.png")
    assert (tmp_path / "s.png").stat().st_size > 0
    H = found["receptance"]
    assert H.dims == ("fastening.stiffness", "position", "frequency")
    assert np.isfinite(H).all()
    assert found["fastening.stiffness"].attrs == {"units": "N/m"}
    # And each is what the library gives, with a track made by hand.
    omega, at = 2 * np.pi * H["frequency"].values, [Point(x=2.8125)]  # a seat is like the others
    for k in (3e7, 6e7):
        exact = infinite_receptance(Track(fastening=Fastening(stiffness=k)), omega, at, at)[:, 0, 0]
        one = H.sel({"fastening.stiffness": k, "position": "railseat"}).values
        assert np.abs(one / exact - 1).max() < 1e-9
