"""Observed order of the coupling schemes on the real pair, as a table.

Contact in the track, k_H = 1 GN/m, wheels held, a sinusoidal irregularity of 2 m at 250 km/h. The
reference is the same pair coupled with steps 10 times shorter than the shortest one; the FMUs' own
internal steps are short enough everywhere not to matter.

    python benchmarks/convergence.py [FOLDER_WITH_FMUS]
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console
from rich.table import Table

from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.time_run import run_pair
from railcosim.fmus.export import WITH_STATES, export
from railcosim.master.course import Course
from railcosim.master.schemes import Scheme
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.track.irregularity import Profile
from railcosim.track.irregularity.usual import FADE_IN
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

FORCES = Layout().names(FORCE)

K_H, SPEED, STOP = 1e9, 250 / 3.6, 0.04
STEPS = (2e-4, 1e-4, 5e-5)
FINEST = 5e-6  # of order 2: an error of a hundredth of that with the shortest step
SCHEMES: dict[str, tuple[Scheme, int]] = {
    "Jacobi, constant": (jacobi(degree=0), 1),
    "Jacobi, linear": (jacobi(degree=1), 2),
    "Gauss-Seidel, vehicle first, constant": (gauss_seidel(first="vehicle", degree=0), 1),
    "Gauss-Seidel, vehicle first, linear": (gauss_seidel(first="vehicle", degree=1), 2),
    "Gauss-Seidel, track first, constant": (gauss_seidel(first="track", degree=0), 1),
    "Gauss-Seidel, track first, linear": (gauss_seidel(first="track", degree=1), 2),
}


def sine(wavelength: float, amplitude: float, length: float) -> Profile:
    """A sinusoidal irregularity on both rails."""
    x = np.linspace(0, length, int(length / wavelength * 200))
    z = amplitude * np.sin(2 * np.pi * x / wavelength)
    return Profile(name=f"sine {wavelength:g} m", x=x, left=z, right=z, fade=FADE_IN)


def contact_forces(folder: Path, scheme: Scheme, step: float) -> np.ndarray:
    """Contact forces at all multiples of the longest step, shape (n, 8), N."""
    run, stopped = run_pair(
        folder / "Vehicle.fmu",
        folder / "TrackWithContact.fmu",
        {"contact.nonlinear": False, "contact.stiffness": K_H, "internal_step": 2 * FINEST},
        Journey(speed=SPEED, held=True, profile=sine(2.0, 1e-4, SPEED * STOP + 20)),
        Course(scheme=scheme, step=step, stop=STOP),
        lambda done, total: None,
    )
    if stopped is not None:
        raise stopped
    every = round(STEPS[0] / step)
    return np.stack([run[name].values[::every] for name in FORCES], axis=1)


def observed_orders(folder: Path) -> dict[str, tuple[list[float], float]]:
    """Relative RMS errors for `STEPS` and the order of the last halving, by scheme."""
    reference = contact_forces(folder, gauss_seidel(first="vehicle", degree=1), FINEST)
    dynamic = reference - reference[0]
    found = {}
    for name, (scheme, _) in SCHEMES.items():
        errors = []
        for step in STEPS:
            difference = contact_forces(folder, scheme, step) - reference
            errors.append(float(np.sqrt((difference**2).mean() / (dynamic**2).mean())))
        found[name] = (errors, float(np.log2(errors[-2] / errors[-1])))
    return found


def main() -> None:
    """Print the table."""
    table = Table(title="Contact force: relative RMS error of its dynamic part, and order")
    for column in ("scheme", *(f"{1e3 * h:g} ms" for h in STEPS), "order", "expected"):
        table.add_column(column, justify="left" if column == "scheme" else "right")
    with TemporaryDirectory() as folder:
        place = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(folder)
        if len(sys.argv) == 1:
            export(Vehicle(), Track(), place, runtime=WITH_STATES)
        for name, (errors, order) in observed_orders(place).items():
            cells = [f"{e:.2e}" for e in errors]
            table.add_row(name, *cells, f"{order:.2f}", str(SCHEMES[name][1]))
    Console().print(table)


if __name__ == "__main__":
    main()
