"""What the chain from finite elements to coupled frequency response loses, as three tables.

Identified FMU against the reduced model it carries; reduced model against the finite elements;
coupled response of the linearised FMUs against the monolithic direct solve. Worst relative errors
of magnitude and phase, outside 1 % of antiresonances.

    OPENBLAS_NUM_THREADS=1 python benchmarks/accuracy.py
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from railcosim.analysis.frequency import Models, linear_models
from railcosim.analysis.pair import WHEELS
from railcosim.cli.compare import error_table, frequency_errors
from railcosim.fmus.content import track_arrays
from railcosim.fmus.export import export
from railcosim.fmus.python_runtime.bodies import TrackBody
from railcosim.fmus.python_runtime.stepping import State
from railcosim.master.receptance import frequency_response
from railcosim.reference.agreement import near
from railcosim.reference.monolithic import assemble
from railcosim.track.cell import railseats
from railcosim.track.parameters import Mesh, Track
from railcosim.track.receptance import Point, direct_receptance
from railcosim.track.reduced import reduce_track
from railcosim.vehicle.parameters import Vehicle

FREQUENCY = np.unique(np.r_[np.geomspace(0.3, 2000, 500), np.arange(1040, 1081, 1.0)])
OMEGA = 2 * np.pi * FREQUENCY


def carried_receptance(
    body: TrackBody, omega: NDArray, position: NDArray, load: int = 0
) -> NDArray:
    """Response of the reduced model at the 8 contacts to one force, shape (n_omega, 8), m/N.

    Under cos(omega t) a mode is b/2 (e^{i omega t}/(i omega - p) + e^{-i omega t}/(-i omega - p));
    the deflections at omega t = 0 and -pi/2 are the receptance's real and imaginary part.
    """
    shapes, none = body.shapes(position), np.empty(0)
    b = body.drive(shapes, np.eye(8)[load]).s
    out = np.empty((omega.size, 8), dtype=complex)
    for k, w in enumerate(omega):
        plus, minus = b / (1j * w - body.poles), b / (-1j * w - body.poles)
        out[k] = body.motion(shapes, State((plus + minus) / 2, none, none))
        out[k] += 1j * body.motion(shapes, State(1j * (minus - plus) / 2, none, none))
    return out


def identified(models: Models, body: TrackBody) -> Table:
    """First table."""
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
    """Second table."""
    table = Table(title="Reduced model against the finite elements, a unit force on each rail")
    for column in ("highest_frequency (Hz)", "modes", "at", "to 1500 Hz", "to 2000 Hz"):
        table.add_column(column)
    seat = float(railseats(Track())[3])
    for highest in (Mesh().highest_frequency, 16000.0):
        track = Track(mesh=Mesh(highest_frequency=highest))
        model = reduce_track(track)
        body = TrackBody(track_arrays(model))
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
    console.print(reduced())
    with TemporaryDirectory() as folder:
        fmus = export(vehicle, track, Path(folder))
        models = linear_models(fmus["Vehicle"], fmus["Track"], lambda done, total: None)
    console.print(identified(models, TrackBody(track_arrays(reduce_track(track)))))
    mono = assemble(vehicle, track, models.positions)
    for k_H in (0.1e9, 0.3e9, 1e9, 8e9):
        frequency = np.geomspace(0.3, 1500, 100)
        errors = frequency_errors(models, mono, k_H, frequency, lambda done, total: None)
        console.print(error_table(errors, f"Coupled response, k_H = {k_H / 1e9:g} GN/m"))


if __name__ == "__main__":
    main()
