"""One small pair of FMUs for all system tests: a ring of 6 cells, the paper's otherwise."""

import runpy
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from railcosim.analysis.response.models import Models, linear_models
from railcosim.fmus.export import BARE, export
from railcosim.mechanics.ports import Layout
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
    export(vehicle, track, folder, runtime=BARE)
    return Exported(folder, vehicle, track)


@pytest.fixture(scope="session")
def models(exported: Exported) -> Models:
    """Both FMUs linearised, exactly."""
    folder = exported.folder
    return linear_models(folder / "Vehicle.fmu", folder / "Track.fmu", lambda done, total: None)


@pytest.fixture(scope="session")
def carried(exported: Exported, models: Models):
    """Driving-point receptances (n_omega, 8) of the reduced track that the FMU carries."""
    script = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks" / "accuracy.py"))
    body = reduce_track(exported.track).under(Layout())

    def receptance(omega: np.ndarray) -> np.ndarray:
        response = script["carried_receptance"]
        return np.stack(
            [response(body, omega, models.positions, k)[:, k] for k in range(8)], axis=1
        )

    return receptance
