"""What the variants of the interface-Jacobian scheme reach on the pair of FMUs, as two tables.

Orders: wheels held, linear contacts of 1 GN/m in the master; errors of the contact forces against
both linear models and the contacts solved as one system. The orders are those of the last halving
that is well above the reference's own error and rounding.

Long steps: eight wheels that roll over dips deep enough to leave the rail, Hertz, steps of 1 ms.
"Late" is what is left of the forces' deviation 0.2 s after the last dip: the passing fastenings'
part is 2 to 5 %.

    OPENBLAS_NUM_THREADS=1 python benchmarks/schemes.py [FOLDER_WITH_FMUS]
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console
from rich.table import Table

from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.analysis.schemes.coupled_reference import (
    ContactForces,
    compression_model,
    converged_forces,
)
from railcosim.fmus.export import WITH_STATES, export
from railcosim.master.cosimulation import cosimulate
from railcosim.master.schemes.interface_jacobian import interface_jacobian
from railcosim.master.schemes.variants import VARIANTS, Variant
from railcosim.mechanics.law import LinearContact, coefficient_for
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.track.irregularity import Dip, Profile, flat, synthesise
from railcosim.track.irregularity.usual import FADE_IN
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

FORCES = Layout().names(FORCE)
WHEELSETS = Layout().axles

SPEED = 250 / 3.6  # m/s
K_H = 1e9  # N/m
STOP = 0.04  # s
STEPS = (2e-4, 1e-4, 5e-5, 2.5e-5, 1.25e-5, 6.25e-6)  # s
ABOVE = 2  # times the reference's estimate, which is of intervals twice as long as its last; and
CLEAR = 5e-10  # ten times what rounding in the FMUs leaves: errors that an order is read from
LONG, UNTIL, LATE = 1e-3, 1.0, 100  # s, s, steps
STIFFNESSES = (1e8, 1e9, 8e9)  # N/m at the static load

console = Console(width=130)


@dataclass(frozen=True)
class Run:
    """Contact forces, shape (n, 8), and how often each component was stepped in each step."""

    forces: np.ndarray
    evaluations: np.ndarray


def run(
    folder: Path, variant: Variant, step: float, stop: float, journey: Journey,
    parameters: dict[str, float | bool],
) -> Run:  # fmt: skip
    """Couple the pair, the master owning the contact."""
    files = folder / "Vehicle.fmu", folder / "Track.fmu"
    with open_pair(*files, parameters, journey) as pair:
        wanted = [pair.system.names.index(f"contact.{name}") for name in FORCES]
        points = list(cosimulate(pair.system, interface_jacobian(variant=variant), step, stop))
    return Run(
        np.array([p.outputs[wanted] for p in points]),
        np.array([p.report.evaluations for p in points if p.report is not None]),
    )


def profiles() -> dict[str, Profile]:
    """A corrugation of 350 Hz, which shows the orders, and a track of good quality."""
    x = np.linspace(0.0, SPEED * STOP + FADE_IN, 40_000)
    z = 1e-5 * np.sin(2 * np.pi * x / 0.2)
    return {
        "waves of 0.2 m": Profile(name="waves", x=x, left=z, right=z, fade=FADE_IN),
        "german-low": synthesise("german-low", SPEED * STOP),
    }


def positions(folder: Path) -> np.ndarray:
    """Where the wheelsets stand, m."""
    files = folder / "Vehicle.fmu", folder / "Track.fmu"
    journey = Journey(speed=SPEED, held=True, profile=flat())
    with open_pair(*files, {}, journey) as pair:
        pair.system.begin(0.0)
        names = pair.system.names
        return np.array(
            [pair.system.outputs[names.index(f"vehicle.{w}.position")] for w in WHEELSETS]
        )


def errors_of(
    folder: Path,
    variant: Variant,
    profile: Profile,
    reference: ContactForces,
    steps: tuple[float, ...],
) -> np.ndarray:
    """Relative RMS errors of the forces' dynamic part."""
    found = []
    for step in steps:
        ours = run(
            folder, variant, step, STOP, Journey(speed=SPEED, held=True, profile=profile),
            {"contact.nonlinear": False, "contact.stiffness": K_H},
        ).forces  # fmt: skip
        theirs = reference.at(np.linspace(0.0, STOP, len(ours)))
        dynamic = theirs - reference.rest
        found.append(np.sqrt(np.mean((ours - theirs) ** 2) / np.mean(dynamic**2)))
    return np.array(found)


def orders(folder: Path) -> None:
    """Print errors and observed orders."""
    where = positions(folder)
    model = compression_model(folder / "Vehicle.fmu", folder / "Track.fmu", where)
    rest = np.full(8, Vehicle().wheel_load / K_H)
    for name, profile in profiles().items():
        reference = converged_forces(
            model, LinearContact(k_H=K_H), rest, profile.under(where, SPEED), STOP
        )
        table = Table(title=f"{name}: error of the contact forces, {K_H / 1e9:g} GN/m")
        for column in ("variant", *(f"{1e3 * h:g} ms" for h in STEPS), "order", "claimed"):
            table.add_column(column, justify="left" if column == "variant" else "right")
        with console.status("") as status:
            for key, variant in VARIANTS.items():
                status.update(f"{name}, {key}")
                errors = errors_of(folder, variant, profile, reference, STEPS)
                clear = errors[errors > max(ABOVE * reference.error, CLEAR)]
                order = np.log2(clear[-2] / clear[-1]) if len(clear) > 1 else np.nan
                cells = (f"{e:.1e}" for e in errors)
                table.add_row(key, *cells, f"{order:.2f}", str(variant.order))
        console.print(table)


def long_steps(folder: Path) -> None:
    """Print what becomes of eight wheels over dips."""
    load = Vehicle().wheel_load
    dips = tuple(Dip(depth=3e-3, length=0.15, at=30.0 + 2.7 * k) for k in range(8))
    table = Table(title=f"Dips of 150 mm, Hertz, wheels roll, steps of {1e3 * LONG:g} ms")
    for column in ("variant", "GN/m", "contact lost", "late", "evaluations", "more than 2"):
        table.add_column(column, justify="left" if column == "variant" else "right")
    for key, variant in VARIANTS.items():
        for k_H in STIFFNESSES:
            ours = run(
                folder, variant, LONG, UNTIL,
                Journey(speed=SPEED, held=False, profile=flat(), defects=dips),
                {"contact.hertz_coefficient": coefficient_for(k_H, load)},
            )  # fmt: skip
            late = np.abs(ours.forces[-LATE:] / load - 1).max()
            counts = ours.evaluations[1:]  # the first measures the compliance
            table.add_row(
                key, f"{k_H / 1e9:g}", f"{(ours.forces == 0).mean():.1%}", f"{late:.1%}",
                f"{counts.max()}", f"{(counts > 2).mean():.1%}",
            )  # fmt: skip
    console.print(table)


def main() -> None:
    """Print both tables."""
    with TemporaryDirectory() as folder:
        place = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(folder)
        if len(sys.argv) == 1:
            export(Vehicle(), Track(), place, runtime=WITH_STATES)
        long_steps(place)
        orders(place)


if __name__ == "__main__":
    main()
