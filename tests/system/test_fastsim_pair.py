"""A pair whose creep is FASTSIM, against one system of finite elements, and of all owners."""

from dataclasses import replace

import numpy as np
import pytest

from railcosim.analysis.compare import compare
from railcosim.analysis.pair.export_pair import export_pair
from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.fmus.export import BARE
from railcosim.master.cosimulation import cosimulate
from railcosim.master.schemes.interface_jacobian import interface_jacobian
from railcosim.master.schemes.iqn_ils import iqn_ils
from railcosim.master.schemes.jacobi import jacobi
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.track.irregularity import synthesise
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.properties import Rolling

pytestmark = [
    pytest.mark.slow,  # an export, 500 steps of eight such contacts, and finite elements in time
    pytest.mark.filterwarnings("ignore::railcosim.track.decay.RingWarning"),
]
TRACK = Track(mesh=Mesh(cells=6, elements_per_bay=4, highest_slab_frequency=400,
                        highest_frequency=2000))  # fmt: skip
STOCK = Vehicle(rolling=Rolling(creep="fastsim"))
SPEED, TIME = 30.0, 0.01  # m/s, s
PROFILE = replace(synthesise("german-low", 1.1 * SPEED * TIME), fade=0.2)


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fastsim")
    return export_pair(STOCK, TRACK, folder, dimension="spatial", runtime=BARE)


def test_forces_are_those_of_one_system(fmus) -> None:
    """In which the numpy law is balanced by Newmark's method; all irregularities act."""
    options = {"time": TIME, "speed": SPEED, "irregularity": PROFILE}
    found = compare(STOCK, TRACK, fmus, np.array([49.0]), **options)
    # Measured 4.5e-3 and 4.3e-3, as with Shen's law: of the step, and of what modes leave out.
    assert found.in_time < 8e-3
    assert max(found.of_forces.values()) < 8e-3


def test_whoever_owns_the_contact(fmus) -> None:
    names = [name.replace("force_z", "force_y") for name in Layout().names(FORCE)]
    schemes = {
        Owner.MASTER: (interface_jacobian(), "contact", 1e-4),
        Owner.TRACK: (jacobi(degree=1), "track", 5e-5),
        Owner.VEHICLE: (iqn_ils(), "vehicle", 5e-5),
    }
    found = {}
    for owner, (scheme, teller, step) in schemes.items():
        vehicle, track = (fmus[name] for name in FMUS[owner])
        journey = Journey(speed=SPEED, held=False, profile=PROFILE)
        with open_pair(vehicle, track, {}, journey) as pair:
            at = [pair.system.names.index(f"{teller}.{name}") for name in names]
            points = list(cosimulate(pair.system, scheme, step, TIME))
        found[owner] = np.array([p.outputs[at] for p in points])[:: round(1e-4 / step)]
    master = found.pop(Owner.MASTER)
    swing = np.ptp(master, axis=0).max()
    assert swing > 100.0  # N
    for forces in found.values():
        # Measured 5.3e-3 of the track and 5.0e-3 of the vehicle, of steps and of railseats.
        assert np.sqrt(np.mean((forces - master) ** 2)) < 0.01 * swing
