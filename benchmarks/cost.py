"""What everything costs on this machine, as one table: wall-clock times, but of steps.

    OPENBLAS_NUM_THREADS=1 python benchmarks/cost.py [--skip-demo] [--keep WHY]

Beside each cost stands what it was when `cost.csv` was last written, by --keep; WHY is what has
changed.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from typing import Any

import numpy as np
from kept import Memory
from rich.console import Console
from rich.table import Table

from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.analysis.response.frequency import coupled
from railcosim.analysis.response.models import linear_models
from railcosim.compiling.compilers import compiler_for
from railcosim.compiling.platforms import local_platform
from railcosim.fmus.export import WITH_STATES, export
from railcosim.master.cosimulation import cosimulate
from railcosim.master.recording import Recorder
from railcosim.master.schemes import Scheme
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi
from railcosim.mechanics.law import LinearContact
from railcosim.reference.contacts import Pressing
from railcosim.reference.frequency import frequency_response, linearised
from railcosim.reference.monolithic import assemble
from railcosim.track.irregularity import synthesise
from railcosim.track.parameters import Track
from railcosim.track.receptance import Point, direct_receptance
from railcosim.vehicle.parameters import Vehicle

SPEED, K_H = 250 / 3.6, 1e9
REPEATS = 5
BLOCKS, STEPS = 60, 50
Rows = list[tuple[str, float]]  # what, and seconds
# Owner of the contact, the FMUs, and a scheme and a communication step (s) that suit them.
PAIRS: dict[str, tuple[str, str, Scheme, float]] = {
    "track": ("Vehicle", "TrackWithContact", gauss_seidel(first="vehicle"), 1e-4),
    "vehicle": ("VehicleWithContact", "Track", jacobi(), 2e-5),
}


class Hollow:
    """In place of an FMU's library: every function comes back at once, and says OK."""

    def __init__(self, folder: Path) -> None:
        platform = local_platform()
        source, library = folder / "ok.c", folder / f"ok{platform.suffix}"
        if not library.exists():
            source.write_text("int ok(void) { return 0; }\n")
            compiler = compiler_for(platform).command
            subprocess.run(
                [*compiler, "-shared", "-fPIC", "-o", str(library), str(source)], check=True
            )
        self._ok = ctypes.CDLL(str(library))["ok"]

    def __getattr__(self, name: str) -> Any:
        """Look up any function, of any arguments."""
        return self._ok

    __getitem__ = __getattr__

    @contextmanager
    def inside(self, *fmus: Any) -> Iterator[None]:
        """Make the FMUs hollow: what is left of the cost of a step is all but theirs."""
        libraries = []
        for instance in (fmu._calls for fmu in fmus):
            libraries.append((instance._library, instance._library._dll))
            instance._library._dll = self
            for name in instance._functions:
                instance._functions[name] = self._ok
            for call in instance._prepared:
                call.function = self._ok
                call.row.function = ctypes.cast(self._ok, ctypes.c_void_p).value  # of C's list
        try:
            yield
        finally:
            for library, dll in libraries:  # which frees the instance
                library._dll = dll


def seconds(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Median time of some work."""
    times = []
    for _ in range(repeats):
        begun = perf_counter()
        work()
        times.append(perf_counter() - begun)
    return median(times)


def coupled_steps(folder: Path, owner: str, *, held: bool) -> Rows:
    """Time a communication step, and what of it is not the FMUs'.

    Processor time, and the least of many blocks: other work on the machine only adds.
    """
    vehicle, track, scheme, step = PAIRS[owner]
    profile = synthesise("german-low", SPEED * step * STEPS * (2 * BLOCKS + 2))
    journey = Journey(speed=SPEED, held=held, profile=profile)
    files = (folder / f"{vehicle}.fmu", folder / f"{track}.fmu")
    with open_pair(*files, {"contact.nonlinear": True}, journey) as pair:
        recorder = Recorder(pair.system)
        points = cosimulate(pair.system, scheme, step, step * STEPS * (2 * BLOCKS + 1))
        recorder.add(next(points))

        def least() -> float:
            found = []
            for _ in range(BLOCKS):
                begun = process_time()
                for point in islice(points, STEPS):
                    recorder.add(point)
                found.append(process_time() - begun)
            return min(found) / STEPS

        whole = least()
        with Hollow(folder).inside(pair.vehicle, pair.track):
            master = least()
    about = (
        f"step of {1e3 * step:g} ms, contact in the {owner}, {scheme}, "
        f"wheels {'held' if held else 'roll'}"
    )
    return [
        (about, whole),
        (f"  {vehicle}.fmu and {track}.fmu", whole - master),
        ("  master, irregularity, recording", master),
    ]


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
    springs = linearised(mono, Pressing(LinearContact(k_H=K_H)), models.positions)
    load, few = mono.wheels[[3]].toarray().T, omega[::32]
    coupling = seconds(lambda: coupled(models, omega, K_H))
    direct = seconds(lambda: direct_receptance(Track(), omega, rails, rails[:1]))
    solving = seconds(lambda: frequency_response(mono, few, springs, load))
    return [
        ("linearise Vehicle.fmu", vehicle),
        ("linearise Track.fmu", whole - vehicle),
        ("coupled FRF, a frequency", coupling / omega.size),
        ("rail receptance from finite elements, a frequency", direct / omega.size),
        (f"monolithic solve of {mono.K.shape[0]} unknowns, a frequency", solving / few.size),
    ]


def main() -> None:
    """Print the table."""
    memory = Memory(Path(__file__).with_suffix(".csv"))
    with TemporaryDirectory(prefix="railcosim_") as name:
        folder = Path(name)
        rows = [
            (
                "export of four FMUs",
                seconds(lambda: export(Vehicle(), Track(), folder, runtime=WITH_STATES), 3),
            )
        ]
        for owner in PAIRS:
            for held in (False, True):
                rows += coupled_steps(folder, owner, held=held)
        rows += frequency_domain(folder)
        if "--skip-demo" not in sys.argv:
            demo = [Path(sys.executable).with_name("railcosim"), "demo", "--out", folder / "demo"]
            rows.append(("railcosim demo", seconds(lambda: subprocess.run(demo, check=True), 1)))
    threads = os.environ.get("OPENBLAS_NUM_THREADS", "not set")
    table = Table("what", title=f"Cost; {os.cpu_count()} cores, OPENBLAS_NUM_THREADS {threads}")
    for heading in ("time", "was"):
        table.add_column(heading, justify="right")
    step = ""
    for what, time in rows:
        part = what.startswith("  ")
        step = step if part else what
        was = memory.beside(f"{step}:{what[1:]}" if part else what, time)
        table.add_row(what, f"{time:.3g} s" if time >= 0.1 else f"{1e6 * time:.0f} µs", was)
    Console().print(table)
    if "--keep" in sys.argv:
        memory.keep(sys.argv[sys.argv.index("--keep") + 1])


if __name__ == "__main__":
    main()
