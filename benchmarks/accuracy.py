"""What the chain from finite elements to coupled frequency response loses, as five tables.

The ring of cells against the endless track, for less and less damping, and what the waves foretell
of it. The linear model that Track.fmu shows for Model Exchange, against the reduced model in it and
against the finite elements; what the master finds of it, against the reduced model; the reduced
model against the finite elements; the coupled response of the linearised FMUs against the
monolithic direct solve. Worst relative errors of magnitude and phase; but for the first two tables
outside 1 % of antiresonances.

    OPENBLAS_NUM_THREADS=1 python benchmarks/accuracy.py
"""

from __future__ import annotations

import runpy
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from railcosim.analysis.comparison.springs import frequency_errors
from railcosim.analysis.response.models import Models, linear_models
from railcosim.cli.compare import error_table
from railcosim.fmus.export import WITH_STATES, export
from railcosim.master.linear.receptance import frequency_response
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import Layout
from railcosim.mechanics.stepping import State
from railcosim.reference.agreement import near
from railcosim.reference.monolithic import assemble
from railcosim.track.cell import railseats
from railcosim.track.decay import PROMISED_TO, decay_along
from railcosim.track.parameters import MOST_CELLS, Fastening, Foundation, Mesh, Track
from railcosim.track.receptance import Point, direct_receptance, infinite_receptance
from railcosim.track.reduced import reduce_track
from railcosim.vehicle.parameters import Vehicle

WHEELS = Layout().wheels

FREQUENCY = np.unique(np.r_[np.geomspace(0.3, 2000, 500), np.arange(1040, 1081, 1.0)])
OMEGA = 2 * np.pi * FREQUENCY


def carried_receptance(
    body: ModalBody, omega: NDArray, position: NDArray, load: int = 0
) -> NDArray:
    """Response of the reduced model at the 8 contacts to one force, shape (n_omega, 8), m/N.

    Under cos(omega t) a mode is b/2 (e^{i omega t}/(i omega - p) + e^{-i omega t}/(-i omega - p));
    the deflections at omega t = 0 and -pi/2 are the receptance's real and imaginary part.
    """
    shapes, none = body.at(position), np.empty(0)
    b = shapes.drive(np.eye(8)[load]).s
    out = np.empty((omega.size, 8), dtype=complex)
    for k, w in enumerate(omega):
        plus, minus = b / (1j * w - body.poles), b / (-1j * w - body.poles)
        out[k] = shapes.motion(State((plus + minus) / 2, none, none))
        out[k] += 1j * shapes.motion(State(1j * (minus - plus) / 2, none, none))
    return out


def ring() -> Table:
    """The ring against the endless track, a unit force on each rail; the end of a cell foretold."""
    table = Table(title="Ring of 20 cells against the endless track: driving-point receptance")
    columns = ("dampers", "at", "to 200 Hz", "to 900 Hz", "to 1500 Hz", "foretold to 900 Hz",
               "cells for 1 %", "error with them to 900 Hz")  # fmt: skip
    for column in columns:
        table.add_column(column)
    frequency = np.unique(np.r_[np.arange(1.0, 1501), np.arange(1054, 1058, 0.1)])
    for share in (1.0, 0.3, 0.1):
        track = Track(
            fastening=Fastening(damping=share * Fastening().damping),
            foundation=Foundation(damping=share * Foundation().damping),
        )
        decay = decay_along(track)
        foretold, at = decay.worst(track.mesh.cells)
        needed = decay.cells_needed()
        longer = replace(track, mesh=Mesh(cells=needed or MOST_CELLS))
        seat = float(railseats(track)[3])
        for name, x in {"end of a cell": 0.0, "railseat": seat}.items():
            points = [Point(x=x), Point(x=x, side=1)]
            ways = [(infinite_receptance, track), (direct_receptance, track)]
            endless, short, long = (
                receptance(t, 2 * np.pi * frequency, points, points[:1]).sum(axis=2)[:, 0]
                for receptance, t in [*ways, (direct_receptance, longer)]
            )
            cells = [f"{share:g}", name]
            for top in (200, 900, 1500):
                error = np.abs(short / endless - 1)[frequency <= top]
                cells.append(f"{error.max():.1e} at {frequency[np.argmax(error)]:g} Hz")
            rest = np.abs(long / endless - 1)[frequency <= PROMISED_TO].max()
            cells += [f"{foretold:.1e} at {at:.3g} Hz", str(needed), f"{rest:.1e}"]
            table.add_row(*cells)
    return table


def shown(path: Path) -> Table:
    """The linear model by directional derivatives; one wheel at each of four places in a bay."""
    table = Table(title="Track.fmu by Model Exchange: driving-point receptance, 0.3-2000 Hz")
    columns = ("at", "against the reduced model", "finite elements to 1500 Hz", "to 2000 Hz")
    for column in columns:
        table.add_column(column)
    track = Track()
    seat, spacing = float(railseats(track)[3]), track.fastening.spacing
    offsets = {"railseat": 0.0, "an eighth": 1 / 8, "a quarter": 1 / 4, "midspan": 1 / 2}
    x = seat + 20.0 * np.arange(4) + spacing * np.array(list(offsets.values()))
    script = runpy.run_path(str(Path(__file__).parents[1] / "examples" / "linear_track.py"))
    start = {f"wheelset[{i + 1}].position": float(x[i]) for i in range(4)}
    fmu = script["LinearFmu"](path, start)
    found = fmu.receptance(
        FREQUENCY, [f"{w}.force_z" for w in WHEELS], [f"{w}.rail_z" for w in WHEELS]
    )
    fmu.close()
    body = reduce_track(track).under(Layout())
    for k, name in enumerate(offsets):
        carried = carried_receptance(body, OMEGA, x, k)
        largest = np.abs(carried).max(axis=1)
        rounding = (np.abs(found[:, :, k] - carried).max(axis=1) / largest).max()
        point = [Point(x=float(x[k]))]
        direct = direct_receptance(track, OMEGA, point, point, viscous=True)[:, 0, 0]
        error = np.abs(found[:, k, k] / direct - 1)
        low = error[FREQUENCY <= 1500].max()
        table.add_row(name, f"{rounding:.1e}", f"{low:.1e}", f"{error.max():.1e}")
    return table


def identified(models: Models, body: ModalBody) -> Table:
    """Third table."""
    table = Table(title="Track.fmu identified, against the reduced model in it, 0.3-2000 Hz")
    table.add_column("receptance at")
    table.add_column("worst error")
    ours = frequency_response(models.track, OMEGA).values
    for k, wheel in enumerate(WHEELS):
        exact = carried_receptance(body, OMEGA, models.positions, k)[:, k]
        error = np.abs(ours[:, k, k] / exact - 1)[~near(FREQUENCY, FREQUENCY, exact)]
        table.add_row(wheel.replace("[", r"\["), f"{error.max():.1e}")
    return table


def reduced() -> Table:
    """Fourth table."""
    table = Table(title="Reduced model against the finite elements, a unit force on each rail")
    for column in ("highest_frequency (Hz)", "modes", "at", "to 1500 Hz", "to 2000 Hz"):
        table.add_column(column)
    seat = float(railseats(Track())[3])
    for highest in (Mesh().highest_frequency, 16000.0):
        track = Track(mesh=Mesh(highest_frequency=highest))
        model = reduce_track(track)
        body = model.under(Layout())
        for name, x in (("railseat", seat), ("midspan", seat + track.fastening.spacing / 2)):
            points = [Point(x=x), Point(x=x, side=1)]
            direct = direct_receptance(track, OMEGA, points, points[:1]).sum(axis=2)[:, 0]
            ours = carried_receptance(body, OMEGA, x + np.array([0.0, 10, 20, 30]), 0)[:, [0, 4]]
            error = np.abs(ours.sum(axis=1) / direct - 1)
            error[near(FREQUENCY, FREQUENCY, direct)] = 0
            low = error[FREQUENCY <= 1500].max()
            cells = [
                f"{highest:g}",
                str(model.poles.size),
                name,
                f"{low:.1e}",
                f"{error.max():.1e}",
            ]
            table.add_row(*cells)
    return table


def main() -> None:
    """Print the tables."""
    console, vehicle, track = Console(), Vehicle(), Track()
    console.print(ring())
    console.print(reduced())
    with TemporaryDirectory() as folder:
        fmus = export(vehicle, track, Path(folder), runtime=WITH_STATES)
        console.print(shown(fmus["Track"]))
        models = linear_models(fmus["Vehicle"], fmus["Track"], lambda done, total: None)
    console.print(identified(models, reduce_track(track).under(Layout())))
    mono = assemble(vehicle, track, models.positions)
    for k_H in (0.1e9, 0.3e9, 1e9, 8e9):
        frequency = np.geomspace(0.3, 1500, 100)
        errors = frequency_errors(models, mono, k_H, frequency, lambda done, total: None)
        console.print(error_table(errors, f"Coupled response, k_H = {k_H / 1e9:g} GN/m"))


if __name__ == "__main__":
    main()
