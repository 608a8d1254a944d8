"""Decay rates by EN 15461 beside rolland's, frequency by frequency, in one run and one table.

    python benchmarks/decay_rates.py [--rolland PYTHON]

PYTHON is an interpreter that has rolland (3.12 or newer); this one if not given. Two tracks that
both can have: the paper's rail on a rigid slab, and UIC60 on pads, blocks of 150 kg and ballast.
Times are those of the mobilities at all 29 places of the standard's grid, one thread.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.table import Table

from railcosim.mechanics.ports import Z
from railcosim.track.decay_rate import distances, rate, responses, slowest
from railcosim.track.files import read_track
from railcosim.track.parameters import Slab, Track

MOUNTS = (160, 320)
FREQUENCY = np.geomspace(100, 3000, 40)


def tracks() -> dict[str, Track]:
    """Tracks that both can have."""
    ballasted = read_track("ballasted")
    blocks = tuple(replace(layer, kind="block") for layer in ballasted.layers)
    return {
        "paper's rail, rigid slab": Track(slab=Slab(present=False)),
        "UIC60, blocks, ballast": replace(ballasted, layers=blocks),
    }


def asked(track: Track, mounts: int) -> str:
    """What rolland is given."""
    rail, pad = track.rail, track.fastening
    block = [[x.mass, x.stiffness, x.damping] for x in track.layers]
    return json.dumps({
        "rail": {
            "E": rail.young_modulus, "G": rail.shear_modulus, "kapz": rail.shear_coefficient,
            "mr": rail.mass_per_length, "Iyr": rail.second_moment, "Ar": rail.area,
            "rho": rail.mass_per_length / rail.area, "etar": 0.0,
        },
        "pad": [pad.stiffness, pad.damping], "block": block[0] if block else None,
        "spacing": pad.spacing, "mounts": mounts, "frequency": FREQUENCY.tolist(),
        "distances": distances(track).tolist(),
    })  # fmt: skip


def main() -> None:
    """Print the table."""
    python = sys.executable
    if "--rolland" in sys.argv:
        python = sys.argv[sys.argv.index("--rolland") + 1]
    script = Path(__file__).with_name("rolland_decay.py")
    omega = 2 * np.pi * FREQUENCY
    table = Table(title=f"Decay rates at {FREQUENCY.size} frequencies, {FREQUENCY[0]:g} to 3000 Hz")
    for heading in ("track", "by", "ms a frequency", "rate differs by, median", "at most", "at Hz"):
        table.add_column(heading)
    for name, track in tracks().items():
        times = []
        for _ in range(3):
            begun = perf_counter()
            ours = rate(np.abs(responses(track, omega, Z)) ** 2, distances(track))
            times.append(perf_counter() - begun)
        table.add_row(name, "endless track", f"{1e3 * min(times) / omega.size:.2f}", "", "", "")
        wave = slowest(track, omega, Z)
        off = np.abs(wave / ours - 1)
        at = int(np.argmax(off))
        table.add_row("", "slowest wave", "", f"{np.median(off):.0%}", f"{off[at]:.0%}",
                      f"{FREQUENCY[at]:.0f}")  # fmt: skip
        for mounts in MOUNTS:
            done = subprocess.run(
                [python, str(script)], input=asked(track, mounts), capture_output=True, text=True,
                check=False,
            )  # fmt: skip
            if done.returncode:
                why = (done.stderr.strip().splitlines() or ["?"])[-1]
                table.add_row("", "rolland: did not run", why[:40], "", "", "")
                break
            found = json.loads(done.stdout)
            theirs = rate(np.array(found["mobility"]) ** 2, distances(track))
            off = np.abs(theirs / ours - 1)
            at = int(np.argmax(off))
            table.add_row(
                "", f"rolland, {mounts} mounts", f"{found['ms']:.2f}", f"{np.median(off):.1e}",
                f"{off[at]:.1e}", f"{FREQUENCY[at]:.0f}",
            )  # fmt: skip
    Console().print(table)


if __name__ == "__main__":
    main()
