"""What a step of the spatial pair costs, whoever owns the contact, and the parts of it alone.

    OPENBLAS_NUM_THREADS=1 python benchmarks/spatial.py [--keep WHY]

250 km/h over german-low, cones, one core. Processor time, the least of many blocks of steps: other
work on the machine only adds. Real time is what a step costs over what it is long. Beside each cost
stands what it was when `spatial.csv` was last written, by --keep. What a step of an FMU alone costs
says `wheelsets.py`, but for the last rows: the vehicle on rigid rails, with contacts of its own, by
internal steps of 0.1 ms, which is 1e-5 off, and by one of 1 ms, which is some per cent off.
"""

from __future__ import annotations

import sys
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
from kept import Memory
from rich.console import Console
from rich.table import Table

from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.fmus.export import export
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.schemes import Scheme
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.interface_jacobian import interface_jacobian
from railcosim.track.irregularity import synthesise
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

SPEED = 250 / 3.6  # m/s
BLOCKS, STEPS = 150, 2
ALONE, WAVE = 1e-3, 20.0  # step of the vehicle on rigid rails, s; length of their waves, m
CASES: tuple[tuple[Owner, Scheme, float], ...] = (
    (Owner.TRACK, gauss_seidel(first="vehicle"), 1e-4),
    (Owner.VEHICLE, gauss_seidel(first="track"), 1e-5),
    (Owner.MASTER, interface_jacobian(), 1e-4),
    (Owner.MASTER, interface_jacobian(), 1e-3),
)
"""Who owns the contact, with a scheme and a communication step (s) that suit them."""


def a_step(folder: Path, owner: Owner, scheme: Scheme, step: float) -> tuple[float, float]:
    """Least cost of a step, s, and how often components were stepped in it."""
    vehicle, track = (folder / f"{name}.fmu" for name in FMUS[owner])
    stop = step * STEPS * (BLOCKS + 1)
    journey = Journey(speed=SPEED, held=False, profile=synthesise("german-low", SPEED * stop))
    with open_pair(vehicle, track, {}, journey) as pair:
        points = cosimulate(pair.system, scheme, step, stop)
        next(points)
        least, evaluations = float("inf"), 0
        for _ in range(BLOCKS):
            begun = process_time()
            for point in islice(points, STEPS):
                evaluations += point.report.evaluations
            least = min(least, process_time() - begun)
    return least / STEPS, evaluations / (BLOCKS * STEPS)


def on_rigid_rails(path: Path, internal: float, step: float) -> float:
    """Least cost of a step of a vehicle alone on uneven rigid rails: inputs, outputs, a step."""
    with FmuComponent.load(path) as fmu:
        fmu.set_parameters({"internal_step": internal})
        quantity = np.array([v.name.rpartition(".")[2] for v in fmu.inputs])
        size = np.select(
            [quantity == "irregularity_z", quantity == "irregularity_y"], [2e-5, 3e-4], 0.0
        )
        steady = np.where(quantity == "speed", SPEED, 0.0)
        omega, shift = 2 * np.pi * SPEED / WAVE, np.arange(size.size)
        fmu.enter_initialization(0.0)
        fmu.set_inputs(steady)
        fmu.exit_initialization()
        least = float("inf")
        for first in range(0, BLOCKS * STEPS, STEPS):
            begun = process_time()
            for k in range(first, first + STEPS):
                fmu.set_inputs(steady + size * np.sin(omega * k * step + shift))
                fmu.do_step(k * step, step)
                fmu.read_outputs()
            least = min(least, process_time() - begun)
    return least / STEPS


def main() -> None:
    """Print the table."""
    memory = Memory(Path(__file__).with_suffix(".csv"))
    table = Table("contact, scheme, step", title="Spatial pair, wheels roll, one core")
    for heading in ("evaluations", "step", "real time", "was"):
        table.add_column(heading, justify="right")
    with TemporaryDirectory(prefix="railcosim_") as made:
        given = [a for a in sys.argv[1:] if Path(a).is_dir()]
        folder = Path(given[0]) if given else Path(made)
        if not given:
            export(Vehicle(), Track(), folder, dimension="spatial")
        for owner, scheme, step in CASES:
            cost, evaluations = a_step(folder, owner, scheme, step)
            what = f"contact in the {owner}, {scheme}, {1e3 * step:g} ms"
            table.add_row(
                what, f"{evaluations:.2f}", f"{1e6 * cost:.0f} µs", f"{cost / step:.2f}",
                memory.beside(what, cost),
            )  # fmt: skip
        for internal in (1e-4, 1e-3):
            cost = on_rigid_rails(folder / "VehicleWithContact.fmu", internal, ALONE)
            what = f"vehicle on rigid rails, internal steps of {1e3 * internal:g} ms, 1 ms"
            table.add_row(
                what, "", f"{1e6 * cost:.0f} µs", f"{cost / ALONE:.2f}", memory.beside(what, cost)
            )
    Console(width=130).print(table)
    if "--keep" in sys.argv:
        memory.keep(sys.argv[sys.argv.index("--keep") + 1])


if __name__ == "__main__":
    main()
