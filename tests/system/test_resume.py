"""The pair of FMUs, killed and resumed in fresh processes: the bits of an uninterrupted run."""

import json
import random
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from railcosim.master.checkpoint import results_of
from railcosim.master.files import load

pytestmark = pytest.mark.slow  # kill -9 in mid-run, and again from the start

JOB = Path(__file__).with_name("killed_pair.py")


def start(**job) -> subprocess.Popen[bytes]:
    text = json.dumps(job | {k: str(v) for k, v in job.items() if isinstance(v, Path)})
    # A point is a page, and the pipe has one: the job is never far ahead of who kills it.
    return subprocess.Popen([sys.executable, JOB, text], stdout=subprocess.PIPE, pipesize=4096)


@pytest.mark.parametrize(
    ("scheme", "owner", "adaptive"),
    [
        ("jacobi", "track", True),
        ("iqn-ils", "track", False),
        ("interface-jacobian", "master", False),
    ],
)
def test_killed_at_random(exported, tmp_path, scheme, owner, adaptive) -> None:
    """Rolling wheels, Hertz, a checkpoint at every point: writing takes most of the time."""
    options = {"folder": exported.folder, "scheme": scheme, "owner": owner, "adaptive": adaptive}
    whole, path = tmp_path / "whole.npy", tmp_path / "run.checkpoint"
    with start(**options, path=path, every=None, results=whole) as job:
        n_points = len(job.stdout.read().split())
    assert job.returncode == 0
    rng = random.Random(scheme)
    results = tmp_path / "resumed.npy"
    killed = 0
    while True:
        with start(**options, path=path, every=1e-9, results=results) as job:
            for _ in range(rng.randrange(n_points // 4, n_points // 2)):
                job.stdout.readline()
            time.sleep(rng.uniform(0.0, 0.005))  # into what follows: some ms of writing
            job.kill()
        if job.returncode == 0:
            break
        killed += 1
        so_far = load(results_of(path))
        rows = np.load(whole)
        assert so_far.time.values.tobytes() == rows[: so_far.sizes["time"], 0].tobytes()
    assert killed >= 2
    assert np.load(results).tobytes() == np.load(whole).tobytes()
    assert np.isfinite(np.load(whole)).all()
