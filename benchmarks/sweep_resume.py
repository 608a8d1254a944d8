"""A sweep of 200 points that is killed in the middle and goes on, here and on a dask cluster.

    python benchmarks/sweep_resume.py

Killed is every process of it, by SIGKILL; counted are the points that were kept, that none of them
was made again, and by how much the end differs from receptances computed one by one.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import nullcontext
from pathlib import Path

import numpy as np
from distributed import LocalCluster

from railcosim import changed, open_result, read_track, track_receptance

COMMAND = [sys.executable, "-c", "from railcosim.cli.main import run; run()", "sweep"]
STIFFNESS, DAMPING = np.linspace(2e7, 6e7, 20), np.linspace(5e3, 5e4, 10)
ARGUMENTS = [
    "track-receptance", "--track", "booted", "--frequencies", "20:400:40@log", "--load", "single",
    "--set", "fastening.stiffness=2e7:6e7:20", "--set", "fastening.damping=5e3:5e4:10",
    "--out", "s.nc",
]  # fmt: skip
POINTS = STIFFNESS.size * DAMPING.size


def swept(folder: Path, scheduler: list[str]) -> None:
    """Start, kill at half, go on, compare."""
    began = time.monotonic()
    process = subprocess.Popen(
        [*COMMAND, *ARGUMENTS, *scheduler], cwd=folder, start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    points = folder / "s.nc.points"
    while len(list(points.glob("[0-9a-f]*.nc"))) < POINTS // 2:
        if process.poll() is not None:
            sys.exit(f"it ended by itself: {process.communicate()[1]}")
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    kept = {p: p.stat().st_mtime_ns for p in points.glob("[0-9a-f]*.nc")}
    killed = time.monotonic() - began
    done = subprocess.run(
        [*COMMAND, *ARGUMENTS, *scheduler], cwd=folder, capture_output=True, text=True, check=True
    )
    same = {p: p.stat().st_mtime_ns for p in kept} == kept
    told = next(line for line in done.stdout.splitlines() if "are finished" in line)
    H = open_result(folder / "s.nc")["receptance"]
    worst = 0.0
    for i, j in ((0, 0), (9, 4), (19, 9)):
        new = {"fastening.stiffness": STIFFNESS[i], "fastening.damping": DAMPING[j]}
        track = changed(read_track("booted"), {k: float(v) for k, v in new.items()})
        alone = track_receptance(track, H["frequency"].values, both_rails=False)["receptance"]
        worst = max(worst, float(np.abs(H.values[i, j] / alone.values - 1).max()))
    print(f"  killed after {killed:.0f} s with {len(kept)} of {POINTS} points; {told}")
    print(f"  kept ones untouched: {same}; all there: {bool(np.isfinite(H).all())}, {H.shape}")
    print(f"  against single calls: {worst:.1e}; {time.monotonic() - began:.0f} s in all")


if __name__ == "__main__":
    for name in ("on this machine", "on a LocalCluster"):
        print(name)
        on_cluster = name != "on this machine"
        cluster = (
            LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None,
                         silence_logs="CRITICAL")
            if on_cluster else nullcontext()
        )  # fmt: skip
        with tempfile.TemporaryDirectory() as scratch, cluster as found:
            swept(Path(scratch), ["--scheduler", found.scheduler_address] if on_cluster else [])
