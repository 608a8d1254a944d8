"""What everything costs on this machine, as one table: wall-clock times.

OPENBLAS_NUM_THREADS=1 python benchmarks/cost.py [--skip-demo]
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from railcosim.analysis.frequency import coupled, linear_models
from railcosim.analysis.pair import Journey, open_pair
from railcosim.fmus.export import export
from railcosim.master.cosimulation import cosimulate
from railcosim.master.recording import Recorder
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.system import System
from railcosim.reference.monolithic import assemble, frequency_response
from railcosim.track.irregularity import synthesise
from railcosim.track.parameters import Track
from railcosim.track.receptance import Point, direct_receptance
from railcosim.vehicle.parameters import Vehicle

SPEED, K_H = 250 / 3.6, 1e9
REPEATS, STEPS = 5, 400
Rows = list[tuple[str, float]]  # what, and seconds
# Owner of the contact, the FMUs, and a communication step (s) that is stable with them.
PAIRS = {
    "track": ("Vehicle", "TrackWithContact", 1e-4),
    "vehicle": ("VehicleWithContact", "Track", 2e-5),
}


class Timed:
    """A component that adds up the time spent inside it."""

    def __init__(self, component: Any) -> None:
        self.component, self.spent = component, 0.0
        for name in ("do_step", "set_inputs", "get_outputs"):
            setattr(self, name, partial(self._timed, getattr(component, name)))

    def __getattr__(self, name: str) -> Any:
        """Hand everything else on."""
        return getattr(self.component, name)

    def _timed(self, call: Callable[..., Any], *arguments: Any) -> Any:
        begun = perf_counter()
        result = call(*arguments)
        self.spent += perf_counter() - begun
        return result


def seconds(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Median time of some work."""
    times = []
    for _ in range(repeats):
        begun = perf_counter()
        work()
        times.append(perf_counter() - begun)
    return median(times)


def coupled_steps(folder: Path, owner: str, *, held: bool) -> Rows:
    """Time a communication step of the demo's kind, and what its parts take of it."""
    vehicle, track, step = PAIRS[owner]
    profile = synthesise("german-low", SPEED * step * STEPS * (REPEATS + 1))
    journey = Journey(speed=SPEED, held=held, profile=profile)
    files = (folder / f"{vehicle}.fmu", folder / f"{track}.fmu")
    with open_pair(*files, {"contact.nonlinear": True}, journey) as pair:
        parts = [Timed(component) for component in pair.system.components]
        system = System(parts, pair.system.connections)
        recorder = Recorder(system)
        points = cosimulate(system, jacobi(), step, step * STEPS * (REPEATS + 1))
        blocks = []
        for _ in range(REPEATS + 1):  # the first one warms up
            before, begun = [part.spent for part in parts], perf_counter()
            for _ in range(STEPS):
                recorder.add(next(points))
            inside = [part.spent - b for part, b in zip(parts, before, strict=True)]
            whole = perf_counter() - begun
            blocks.append([whole, *inside, whole - sum(inside)])
    times = np.median(blocks[1:], axis=0) / STEPS
    about = (
        f"step of {1e3 * step:g} ms, contact in the {owner}, wheels {'held' if held else 'roll'}"
    )
    names = ("irregularity", f"{vehicle}.fmu", f"{track}.fmu", "master and recording")
    return [(about, times[0]), *((f"  {n}", t) for n, t in zip(names, times[1:], strict=True))]


def frequency_domain(folder: Path) -> Rows:
    """Linearising once, then the cost of one frequency."""
    ticks: list[tuple[float, float]] = []
    begun = perf_counter()
    models = linear_models(
        folder / "Vehicle.fmu",
        folder / "Track.fmu",
        lambda done, total: ticks.append((done / total, perf_counter() - begun)),
    )
    whole = perf_counter() - begun
    vehicle = next(t for part, t in ticks if part > 0.3)  # what linear_models gives the vehicle
    omega = 2 * np.pi * np.geomspace(1, 1500, 320)
    rails = [Point(x=0.3125), Point(x=0.3125, side=1)]
    mono = assemble(Vehicle(), Track(), models.positions)
    load, few = mono.wheels[[3]].toarray().T, omega[::32]
    coupling = seconds(lambda: coupled(models, omega, K_H))
    direct = seconds(lambda: direct_receptance(Track(), omega, rails, rails[:1]))
    solving = seconds(lambda: frequency_response(mono, few, K_H, models.positions, load))
    return [
        ("linearise Vehicle.fmu", vehicle),
        ("linearise Track.fmu", whole - vehicle),
        ("coupled FRF, a frequency", coupling / omega.size),
        ("rail receptance from finite elements, a frequency", direct / omega.size),
        (f"monolithic solve of {mono.K.shape[0]} unknowns, a frequency", solving / few.size),
    ]


def main() -> None:
    """Print the table."""
    with TemporaryDirectory(prefix="railcosim_") as name:
        folder = Path(name)
        rows = [("export of four FMUs", seconds(lambda: export(Vehicle(), Track(), folder), 3))]
        for owner in PAIRS:
            for held in (False, True):
                rows += coupled_steps(folder, owner, held=held)
        rows += frequency_domain(folder)
        if "--skip-demo" not in sys.argv:
            demo = [Path(sys.executable).with_name("railcosim"), "demo", "--out", folder / "demo"]
            rows.append(("railcosim demo", seconds(lambda: subprocess.run(demo, check=True), 1)))
    threads = os.environ.get("OPENBLAS_NUM_THREADS", "not set")
    table = Table("what", title=f"Cost; {os.cpu_count()} cores, OPENBLAS_NUM_THREADS {threads}")
    table.add_column("time", justify="right")
    for what, time in rows:
        table.add_row(what, f"{time:.3g} s" if time >= 0.1 else f"{1e6 * time:.0f} µs")
    Console().print(table)


if __name__ == "__main__":
    main()
