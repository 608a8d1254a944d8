"""Work against precision while wheels roll: error of the contact forces, and cost, as a table.

250 km/h over german-low, Hertz. The error is RMS over that of the forces' deviation from rest. The
reference is the pair with the contact in the track, steps of 0.01 and 0.02 ms extrapolated to none;
it shares nothing with schemes that have the contact in the master but the bodies. Cost is that of a
simulated second, by the least of many short blocks of steps, over the first scheme's at its first
step.

    OPENBLAS_NUM_THREADS=1 python benchmarks/rolling.py [FOLDER_WITH_FMUS]
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.table import Table

from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.fmus.export import export
from railcosim.master.cosimulation import cosimulate
from railcosim.master.schemes import Scheme
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.interface_jacobian import interface_jacobian
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.variants import HERMITE, RADAU_2
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.track.irregularity import synthesise
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

FORCES = Layout().names(FORCE)

SPEED, STOP, SAMPLE = 250 / 3.6, 0.1, 1e-3  # m/s, s, s
STEPS = (1e-4, 5e-5)  # s
BLOCK = 8  # steps
SCHEMES: dict[str, tuple[Owner, Scheme]] = {
    "jacobi, linear": (Owner.TRACK, jacobi(degree=1)),
    "jacobi, quadratic": (Owner.TRACK, jacobi(degree=2)),
    "gauss-seidel, linear, vehicle first": (Owner.TRACK, gauss_seidel(first="vehicle", degree=1)),
    "gauss-seidel, quadratic, vehicle first": (
        Owner.TRACK,
        gauss_seidel(first="vehicle", degree=2),
    ),
    "interface-jacobian-radau-2": (Owner.MASTER, interface_jacobian(variant=RADAU_2)),
    "interface-jacobian-hermite": (Owner.MASTER, interface_jacobian(variant=HERMITE)),
}
Row = tuple[np.ndarray, float]  # contact forces at the samples, and seconds a simulated second


def run(folder: Path, owner: Owner, scheme: Scheme, step: float) -> Row:
    """Couple the pair."""
    vehicle, track = (folder / f"{name}.fmu" for name in FMUS[owner])
    profile = synthesise("german-low", SPEED * STOP)
    journey = Journey(speed=SPEED, held=False, profile=profile)
    every, forces, block, least = round(SAMPLE / step), [], perf_counter(), np.inf
    with open_pair(vehicle, track, {}, journey) as pair:
        names = pair.system.names
        wanted = [next(i for i, n in enumerate(names) if n.endswith(f".{f}")) for f in FORCES]
        for k, point in enumerate(cosimulate(pair.system, scheme, step, STOP)):
            if k % every == 0:
                forces.append(point.outputs[wanted])
            if k % BLOCK == 0:
                now = perf_counter()
                least, block = min(least, now - block), now
    return np.array(forces), least / (BLOCK * step)


def main() -> None:
    """Print the table."""
    with TemporaryDirectory() as made:
        folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(made)
        if len(sys.argv) == 1:
            export(Vehicle(), Track(), folder)
        fine, coarse = (
            run(folder, Owner.TRACK, gauss_seidel(first="vehicle", degree=2), step)[0]
            for step in (1e-5, 2e-5)
        )
        exact = fine + (fine - coarse) / 3  # of second order: so is the contact in the track
        size = np.sqrt(np.mean((exact - exact[0]) ** 2))
        title = f"Wheels roll; the reference's last halving: {_rms(fine - coarse) / size:.0e}"
        table = Table("scheme", "contact in", title=title)
        for step in STEPS:
            table.add_column(f"error, {1e3 * step:g} ms", justify="right")
            table.add_column("cost of a second", justify="right")
        unit = None
        for name, (owner, scheme) in SCHEMES.items():
            cells = []
            for step in STEPS:
                forces, cost = run(folder, owner, scheme, step)
                unit = unit or cost
                cells += [f"{_rms(forces - exact) / size:.1e}", f"{cost / unit:.2f}"]
            table.add_row(name, owner, *cells)
    Console(width=110).print(table)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


if __name__ == "__main__":
    main()
