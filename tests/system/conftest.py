"""One small pair of FMUs for all system tests: a ring of 6 cells, the paper's otherwise."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from railcosim.cli.frequency import Models, linear_models
from railcosim.fmus.content import track_arrays
from railcosim.fmus.export import export
from railcosim.fmus.python_runtime.bodies import TrackBody
from railcosim.track.parameters import Mesh, Track
from railcosim.track.reduced import reduce_track
from railcosim.vehicle.parameters import Vehicle


@dataclass(frozen=True)
class Exported:
    """FMU files and the parameters they were made of."""

    folder: Path
    vehicle: Vehicle
    track: Track


@pytest.fixture(scope="session")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Exported:
    """Four FMUs; 30 m of ring hold the vehicle's 18 m, and the reference is quick to solve."""
    folder = tmp_path_factory.mktemp("fmus")
    vehicle, track = Vehicle(), Track(mesh=Mesh(cells=6))
    export(vehicle, track, folder)
    return Exported(folder, vehicle, track)


@pytest.fixture(scope="session")
def models(exported: Exported) -> Models:
    """Both FMUs linearised as black boxes."""
    folder = exported.folder
    return linear_models(folder / "Vehicle.fmu", folder / "Track.fmu", lambda done, total: None)


@pytest.fixture(scope="session")
def carried(exported: Exported, models: Models):
    """The 8 x 8 receptance of the reduced track that the FMU carries, as a function of omega."""
    body = TrackBody(track_arrays(reduce_track(exported.track)))
    shapes = body.shapes(models.positions)

    def receptance(omega: np.ndarray) -> np.ndarray:
        # Each sum is real for real weights, so both halves of 1 / (i omega - pole) are taken apart.
        out = np.empty((omega.size, 8, 8), dtype=complex)
        for k, w in enumerate(omega):
            s = 1j * w
            weight, other = 1 / (s - body.poles), 1 / (s - body.poles.conj())
            # Re(u b weight) with a complex weight: half the sum with the conjugate mode's.
            plus = body._compliance(shapes, 0.5 * (weight + other.conj()))
            minus = body._compliance(shapes, -0.5j * (weight - other.conj()))
            out[k] = plus + 1j * minus
        return out

    return receptance
