"""The law of contacts from parameters and profiles of a file; what cannot be is said."""

import pickle
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

from railcosim.mechanics.contact.geometry import LEFT, RIGHT, TextbookCone
from railcosim.mechanics.contact.profiled import Profiled
from railcosim.mechanics.contact.saturation import Saturated
from railcosim.parameters import ParameterError, from_tables
from railcosim.vehicle.files import read_stock, write_stock
from railcosim.vehicle.parameters import Contact, Rolling, Vehicle
from railcosim.vehicle.rolling import CREEP, geometry_of, read_profile, rolling_law

SIDES = np.array([LEFT, RIGHT])


def law(folder=None, **values):
    return rolling_law(
        Rolling(**values), Contact(), radius=0.43, side=SIDES, speed=30.0, folder=folder
    )


def write(path, y, z, header="y,z"):
    points = zip(y.tolist(), z.tolist(), strict=True)
    path.write_text("\n".join([header, *(f"{a!r},{b!r}" for a, b in points)]))


@pytest.fixture
def profiles(tmp_path):
    y = np.linspace(-0.04, 0.04, 161)
    angle = np.arctan(0.05)
    write(tmp_path / "wheel.csv", y, -0.05 * y)
    out, down = 0.3 * np.sin(angle), 0.3 * np.cos(angle)
    write(tmp_path / "rail.csv", y, down - np.sqrt(0.09 - (y - out) ** 2))
    return tmp_path


NAMES = {"wheel_profile": "wheel.csv", "rail_profile": "rail.csv"}


def test_profiles_of_a_file_are_the_cone_they_show(profiles):
    q = np.zeros((2, 8))
    q[:, 0], q[:, 1] = 2e-3, 9e-5
    found, cone = law(profiles, **NAMES), law()
    assert found.flange is None
    assert cone.flange is not None
    # Points half a millimetre apart.
    assert found.force(q, 0 * q) == pytest.approx(cone.force(q, 0 * q), rel=2e-3, abs=20)


def test_names_choose():
    assert law(creep="saturated", friction=0.2).creep == Saturated(friction=0.2)
    assert isinstance(law(gravity="textbook").geometry, TextbookCone)
    assert set(CREEP) == {"linear", "saturated", "fastsim"}
    with pytest.raises(ParameterError, match="creep = 'shen': must be one of linear, saturated"):
        law(creep="shen")
    with pytest.raises(ParameterError, match="gravity = 'none': must be one of normals, textbook"):
        law(gravity="none")


def test_of_a_vehicles_file():
    vehicle = from_tables(Vehicle, {"rolling": {"conicity": 0.1, "creep": "fastsim"}})
    assert vehicle.rolling == replace(Rolling(), conicity=0.1, creep="fastsim")
    with pytest.raises(ParameterError, match=r"\[rolling\] friction = 0: must be > 0"):
        from_tables(Vehicle, {"rolling": {"friction": 0}})


def test_profiles_are_looked_for_beside_the_file_that_names_them(profiles):
    """Of a vehicle's file, and of one that a train's file names, wherever one works."""
    names = "".join(f'{key} = "{name}"\n' for key, name in NAMES.items())
    (profiles / "v.toml").write_text(f"[rolling]\n{names}")
    train = profiles.parent / f"{profiles.name}.toml"
    train.write_text(f'[[vehicle]]\nfile = "{profiles.name}/v.toml"\n')
    alone = read_stock(profiles / "v.toml")
    (first,) = read_stock(train).vehicles
    for stock in (alone, first.vehicle, pickle.loads(pickle.dumps(alone)), deepcopy(alone)):
        found = geometry_of(stock.rolling, stock.contact, radius=0.43)
        assert isinstance(found, Profiled)
    assert "wheel_profile = 'wheel.csv'" in write_stock(alone)  # no folder of this machine


def test_profiles_that_cannot_be(profiles):
    with pytest.raises(ParameterError, match="give both, or none"):
        law(profiles, wheel_profile="wheel.csv")
    with pytest.raises(ParameterError, match="is of cones"):
        law(profiles, gravity="textbook", **NAMES)
    with pytest.raises(ParameterError, match="must be in the vehicle file's folder"):
        law(profiles, wheel_profile="../wheel.csv", rail_profile="rail.csv")
    with pytest.raises(ParameterError, match="must be a CSV file"):
        law(profiles, wheel_profile="no.csv", rail_profile="rail.csv")
    with pytest.raises(ParameterError, match=r"wheel\.csv on rail\.csv: at u = "):
        law(profiles, profile_range=0.05, **NAMES)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x,z\n0,0\n", "first line must be y,z"),
        ("", "first line must be y,z"),
        ("y,z\n0,0\n1,a\n2,0\n3,0\n", "two numbers"),
        ("y,z\n0,0,1\n", "two numbers"),
        ("y,z\n0,0\n0,0\n1,0\n2,0\n", "list them outwards"),
        ("y,z\n0,0\n1,nan\n2,0\n3,0\n", "not finite"),
        ("y,z\n" + "0,0\n" * 2001, "2001 points, at most 2000"),
    ],
)
def test_files_that_are_no_profiles(tmp_path, text, said):
    path = tmp_path / "profile.csv"
    path.write_text(text)
    with pytest.raises(ParameterError, match=said) as caught:
        read_profile(path)
    assert str(path) in str(caught.value)
