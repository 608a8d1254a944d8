"""Numbers changed by their keys, in Python and by ``--set``."""

import pytest

from railcosim.cli.options import UsageError
from railcosim.cli.parameter_options import FmuOptions, PairOptions, VehicleOptions, changes_of
from railcosim.parameters import ParameterError, UnusualWarning, changed, keys_of
from railcosim.track.parameters import Fastening, Slab, Track
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.parameters import Vehicle


def test_is_what_the_constructor_makes():
    of = changed(Track(), {"fastening.stiffness": 6e7, "slab.present": False})
    assert of == Track(fastening=Fastening(stiffness=6e7), slab=Slab(present=False))
    assert changed(Track(), {}) == Track()


def test_what_fits_only_together_may_change_together():
    both = {"slab.length": 5.95, "fastening.spacing": 0.75}
    assert changed(Track(), both).bays == 8
    with pytest.raises(ParameterError, match=r"slab.length \+ slab.joint = 6 m"):
        changed(Track(), {"slab.length": 5.95})


def test_one_of_an_array_and_all_vehicles_of_a_train():
    wagon = changed(read_stock("wagon"), {"axles[2].x": -4.0})
    assert [axle.x for axle in wagon.axles] == [read_stock("wagon").axles[0].x, -4.0]
    train = read_stock("wagon", 3)
    masses = {"carbody.mass": 30000.0, "vehicles[2].carbody.mass": 31000.0, "coupler.damping": 1e4}
    of = changed(train, masses)
    assert [one.vehicle.carbody.mass for one in of.vehicles] == [30000.0, 31000.0, 30000.0]
    assert of.coupler.damping == 1e4


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [("fastening.stifness", 1.0, "did you mean fastening.stiffness"),
     ("foot.stiffness", 1.0, "allowed: numbers of rail"),
     ("fast.stiffness", 1.0, "did you mean fastening.stiffness"),
     ("slab.colour", 1.0, "allowed: slab.present, slab.young_modulus"),
     ("stiffness", 1.0, "allowed: numbers of rail, fastening, slab, foundation, mesh"),
     ("fastening.stiffness", -1.0, r"fastening.stiffness = -1 N/m: must be > 0"),
     ("fastening.stiffness", "soft", "fastening.stiffness = 'soft': must be a number in N/m"),
     ("mesh.cells", 7.5, "mesh.cells = 7.5: must be a whole number")],
)  # fmt: skip
def test_refuses(key, value, said):
    with pytest.raises(ParameterError, match=said):
        changed(Track(), {key: value})


def test_says_what_unit_may_be_meant():
    with pytest.warns(UnusualWarning, match="Meant 60 MN/m"):
        changed(Track(), {"fastening.stiffness": 60})


def test_no_key_is_of_vehicle_and_track():
    """So none needs its prefix; one that does is refused without it, below."""
    assert not set(keys_of(Vehicle())) & set(keys_of(Track()))


def test_keys_find_their_side():
    given = PairOptions(set_=["carbody.mass=3e4", "track.rail.loss_factor=0.01", "mesh.cells = 80"])
    stock, track = given.pair()
    assert stock.carbody.mass == 3e4
    assert (track.rail.loss_factor, track.mesh.cells) == (0.01, 80)
    with pytest.raises(UsageError, match=r"say vehicle.rail.area or track.rail.area"):
        changes_of(["rail.area=1"], {"vehicle": Track(), "track": Track()})
    assert changes_of(["track.rail.area=1"], {"vehicle": Track(), "track": Track()}) == {
        "vehicle": {},
        "track": {"rail.area": 1},
    }


def test_set_refuses_what_the_command_does_not_know():
    with pytest.raises(UsageError, match=r"stiffness=6e7: no such number; allowed"):
        VehicleOptions(set_=["fastening.stiffness=6e7"]).stock()
    with pytest.raises(UsageError, match="--set abc: must be KEY=VALUE"):
        PairOptions(set_=["abc"]).pair()


def test_an_fmu_has_its_own_numbers(tmp_path):
    given = FmuOptions(track_fmu=tmp_path / "Track.fmu", set_=["fastening.stiffness=6e7"])
    with (
        pytest.raises(
            UsageError, match=r"--set fastening\.stiffness: is of parameters; --track-fmu"
        ),
        given.fmus(),
    ):
        pass
