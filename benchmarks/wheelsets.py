"""How the cost of a step grows with the wheelsets and the ring, and where it goes.

    OPENBLAS_NUM_THREADS=1 python benchmarks/wheelsets.py [--keep WHY]

Cars of four wheelsets, 25 m apart, roll over the ring. A step is what a master asks for: inputs
set, outputs read, derivatives of inputs given, a step of 0.1 ms; one thread, least processor time.
Beside it stand the megabytes that it must move at least, whatever the arithmetic: the table of
shapes where wheels are; their shapes, written once and read once or, with contacts inside, two and
three times; exponentials, poles and states. The last columns say how fast they went by, what part
that is of how fast this processor reads as much over and over (a sum of products of numpy's), and
what the cost was when `wheelsets.csv` was last written, by --keep. Below stand the FMUs of the
built-in pair, vertical and spatial.
"""

from __future__ import annotations

import sys
import warnings
import zipfile
from functools import cache
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from xml.etree import ElementTree

import numpy as np
from kept import Memory, seconds
from rich.console import Console
from rich.table import Table

from railcosim.fmus.export import Start, export, export_track
from railcosim.fmus.start import contact_defaults
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.mechanics.ports import DIMENSIONS, Layout
from railcosim.track.decay import RingWarning
from railcosim.track.parameters import Mesh, Track
from railcosim.track.reduced import ReducedTrack, reduce_track
from railcosim.vehicle.parameters import Vehicle

SPEED, STEP, LOAD = 250 / 3.6, 1e-4, 7e4  # m/s, s, N
CAR, PLACES = 25.0, (20.0, 17.5, 2.5, 0.0)  # m
CASES = (
    (1, 20),
    (2, 20),
    (4, 20),
    (4, 100),
    (8, 20),
    (8, 40),
    (16, 60),
    (32, 100),
)  # wheelsets, cells
BLOCK, SECONDS = 7, 1.5  # steps whose time is taken together; how long one case is measured


def positions(wheelsets: int) -> list[float]:
    """From the front, m."""
    cars = -(-wheelsets // len(PLACES))
    every = (CAR * car + place for car in reversed(range(cars)) for place in PLACES)
    return [0.3 + x for x in islice(every, wheelsets)]


def modes_of(path: Path) -> int:
    """How many complex modes a vehicle has: half its continuous states."""
    with zipfile.ZipFile(path) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    return len(root.findall("ModelStructure/Derivatives/Unknown")) // 2


def a_step(path: Path) -> float:
    """Least time of a step of a rolling track, s."""
    with FmuComponent.load(path) as fmu:
        quantity = np.array([v.name.rpartition(".")[2] for v in fmu.inputs])
        start = np.array([v.start for v in fmu.inputs])
        run = np.where(quantity == "position", SPEED, 0.0)
        forces = ("force_x", "force_y", "force_z", "moment_x", "moment_z")
        size = np.select([np.isin(quantity, forces), quantity == "wheel_z"], [1e3, 1e-5], 0.0)
        start += np.where(quantity == "wheel_z", 1e-3, 0.0)
        shift = np.arange(start.size)
        fmu.enter_initialization(0.0)
        fmu.set_inputs(start)
        fmu.exit_initialization()
        least, first, begun = np.inf, 0, process_time()
        while process_time() - begun < SECONDS or first < 3 * BLOCK:
            block = process_time()
            for step in range(first, first + BLOCK):
                t = step * STEP
                fmu.set_inputs(start + run * t + size * np.sin(300 * t + shift))
                fmu.read_outputs()
                fmu.set_input_derivatives((run + 300 * size * np.cos(300 * t + shift))[None])
                fmu.do_step(t, STEP)
            first += BLOCK
            least = min(least, (process_time() - block) / BLOCK)
    return float(least)


def rows_of(track: ReducedTrack, wheelsets: int) -> float:
    """Shapes of a mode that forces meet, on average: of directions in which it moves."""
    moving = np.abs(track.table[:, ::2]).max(axis=0) > 0
    blocks = -(-wheelsets * moving.sum(axis=0) // 4)  # in whole blocks of four
    return 4.0 * float(blocks.mean())


def megabytes(modes: int, rows: float, *, contact: bool) -> float:
    """What a step must move, MB: complex numbers of a mode."""
    shapes = (1 + 1) + (1 + 2) if contact else 1 + 1  # in the middle and at the end; at the end
    table = 2  # shape and slope at two nodes, in single precision
    exponentials = 8 if contact else 4  # of half the modes, for partners have the same
    return 16e-6 * modes * (rows * (table + shapes) + exponentials / 2 + 1 + 6)


@cache
def reading(size: int) -> float:
    """How fast this processor reads so many MB again and again, GB/s."""
    x = np.ones(size * 125_000)
    return size / 1e3 / seconds(lambda: x @ x, 30)


def moved(megabytes: float, cost: float) -> tuple[str, str, str]:
    """Cells of the table: what a step moves, how fast, and what part of the fastest that is."""
    speed, fastest = megabytes / 1e3 / cost, reading(max(1, round(megabytes)))
    return f"{megabytes:.1f} MB", f"{speed:.0f} GB/s", f"{speed / fastest:.0%}"


def main() -> None:
    """Print the table."""
    warnings.simplefilter("ignore", RingWarning)  # of rings that are short on purpose
    memory = Memory(Path(__file__).with_suffix(".csv"))
    table = Table("track", title=f"Rolling tracks, step of {1e3 * STEP:g} ms, one thread")
    for heading in ("modes", "step", "real time", "moves", "at", "of reading", "cost was"):
        table.add_column(heading, justify="right")
    for wheelsets, cells in CASES:
        track = Track(mesh=Mesh(cells=cells))
        ports = len(Layout(wheelsets).ports)
        start = Start(
            loads=[LOAD] * ports,
            positions=positions(wheelsets),
            contact=contact_defaults(Vehicle()),
        )
        with TemporaryDirectory(prefix="railcosim_") as name:
            files = export_track(track, start, Path(name))
            reduced = reduce_track(track)
            modes, rows = reduced.poles.size, rows_of(reduced, wheelsets)
            for fmu, path in files.items():
                what = f"{fmu}, {wheelsets} wheelsets, {cells} cells"
                cost = a_step(path)
                size = megabytes(modes, rows, contact="Contact" in fmu)
                table.add_row(
                    what, str(modes), f"{1e6 * cost:.0f} µs", f"{cost / STEP:.2f}",
                    *moved(size, cost), memory.beside(what, cost),
                )  # fmt: skip
    for dimension, directions in DIMENSIONS.items():
        reduced = reduce_track(Track(), directions)
        rows = rows_of(reduced, len(PLACES))
        with TemporaryDirectory(prefix="railcosim_") as name:
            files = export(Vehicle(), Track(), Path(name), dimension=dimension)
            for fmu, path in files.items():
                cost, what = a_step(path), f"{fmu}, built in, {dimension}"
                modes = reduced.poles.size if "Track" in fmu else modes_of(path)
                size = megabytes(modes, rows, contact="Contact" in fmu)
                bytes_moved = moved(size, cost) if "Track" in fmu else ("", "", "")
                table.add_row(
                    what, str(modes), f"{1e6 * cost:.0f} µs", f"{cost / STEP:.2f}",
                    *bytes_moved, memory.beside(what, cost),
                )  # fmt: skip
    Console().print(table)
    if "--keep" in sys.argv:
        memory.keep(sys.argv[sys.argv.index("--keep") + 1])


if __name__ == "__main__":
    main()
