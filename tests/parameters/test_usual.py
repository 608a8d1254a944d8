"""Usual ranges: the paper's numbers are in them, and slips of the unit are guessed."""

import math
from dataclasses import fields

import pytest

from railcosim.cli.map_command import _plane
from railcosim.cli.options import UsageError, contact_parameters, doubted, speed_of
from railcosim.parameters import UnusualWarning, Usual, read_toml, write_toml
from railcosim.parameters.quantity import quantities, quantity_of
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import (
    AxlePlace,
    BogiePlace,
    CarBodyPlace,
    CouplerPlace,
    Vehicle,
)

PLACES = [CarBodyPlace(), BogiePlace(), AxlePlace(), CouplerPlace()]
SETS = [getattr(whole, f.name) for whole in (Vehicle(), Track()) for f in fields(whole)] + PLACES
QUANTITIES = [
    (type(chosen).__name__, declared, number)
    for chosen in SETS
    if chosen != ()  # arrays of tables, of which there are none by default
    for declared in quantities(chosen)
    if not isinstance(declared.default, (bool, str))
    for number in (declared.default if isinstance(declared.default, tuple) else [declared.default])
]


@pytest.mark.parametrize(("table", "declared", "value"), QUANTITIES)
def test_every_quantity_is_usual_by_default(table, declared, value) -> None:
    known = quantity_of(declared)
    assert known.usual is not None
    assert known.usual.doubt(declared.name, value, known.unit) is None
    assert known.usual.low < known.usual.high
    # A range that allows nothing, or all that is allowed, tells nothing.
    assert known.holds(known.usual.low) or known.holds(known.usual.high)
    assert known.usual.reason


SLIPS = [  # what the paper's number is in the other unit, and that unit
    (Track, "fastening", "stiffness", 30, "30 MN/m? That is 3e+07 N/m"),
    (Track, "fastening", "stiffness", 30e3, "30000 kN/m? That is 3e+07 N/m"),
    (Track, "fastening", "damping", 25, "25 kN.s/m? That is 25000 N.s/m"),
    (Track, "foundation", "stiffness", 60, "60 MN/m3? That is 6e+07 N/m3"),
    (Track, "rail", "young_modulus", 205.9, "205.9 GPa? That is 2.059e+11 N/m2"),
    (Track, "rail", "young_modulus", 205900, "205900 MPa? That is 2.059e+11 N/m2"),
    (Track, "rail", "area", 77.45, "77.45 cm2? That is 0.007745 m2"),
    (Track, "rail", "second_moment", 3215, "3215 cm4? That is 3.215e-05 m4"),
    (Track, "slab", "density", 2.5, "2.5 t/m3? That is 2500 kg/m3"),
    (Track, "slab", "thickness", 190, "190 mm? That is 0.19 m"),
    (Track, "mesh", "highest_frequency", 5, "5 kHz? That is 5000 Hz"),
    (Vehicle, "carbody", "mass", 49.08, "49.08 t? That is 49080 kg"),
    (Vehicle, "bogie", "mass", 4.42, "4.42 t? That is 4420 kg"),
    (Vehicle, "bogie", "inertia_pitch", 4.902, "4.902 t.m2? That is 4902 kg.m2"),
    (Vehicle, "wheelset", "radius", 430, "430 mm? That is 0.43 m"),
    (Vehicle, "primary_suspension", "stiffness", 1.27, "1.27 MN/m? That is 1.27e+06 N/m"),
    (Vehicle, "secondary_suspension", "stiffness", 270, "270 kN/m? That is 270000 N/m"),
    (Vehicle, "primary_suspension", "damping", 65, "65 kN.s/m? That is 65000 N.s/m"),
    (Vehicle, "geometry", "carbody_height", 1415, "1415 mm? That is 1.415 m"),
    (Vehicle, "geometry", "axle_half_distance", 1250, "1250 mm? That is 1.25 m"),
]


@pytest.mark.parametrize(("kind", "table", "key", "value", "meant"), SLIPS)
def test_a_slip_of_the_unit_is_guessed(tmp_path, kind, table, key, value, meant) -> None:
    path = tmp_path / "p.toml"
    path.write_text(f"[{table}]\n{key} = {value}\n")
    with pytest.warns(UnusualWarning) as caught:
        read = read_toml(kind, path)
    assert getattr(getattr(read, table), key) == value  # said, not changed
    (said,) = (str(warning.message) for warning in caught)
    assert said.startswith(f"{path}: [{table}] {key} = {value:g} ")
    assert said.endswith(f"Meant {meant}")


def test_usual_files_raise_no_doubt(tmp_path, recwarn) -> None:
    for whole, name in ((Vehicle(), "v"), (Track(), "t")):
        path = tmp_path / f"{name}.toml"
        path.write_text(write_toml(whole, name))
        read_toml(type(whole), path)
    assert not recwarn.list


def test_what_no_unit_explains_is_said_without_a_guess() -> None:
    usual = Usual(1e6, 3e9, "pads")
    said = usual.doubt("x", 2e13, "N/m")
    assert said == "x = 2e+13 N/m is unusual; 1e+06 to 3e+09 N/m is usual (pads)"
    assert usual.doubt("x", 0, "N/m") is None  # there is none
    assert "Meant" not in usual.doubt("x", -30, "N/m")


@pytest.mark.parametrize(
    ("value", "meant"),
    [(11.1, "11.1 m/s? That is 39.96 km/h"), (69.4, "69.4 m/s? That is 250 km/h"),
     (69.4444, "69.4444 m/s? That is 250 km/h"), (83.33, "83.33 m/s? That is 300 km/h")],
)  # fmt: skip
def test_a_speed_in_metres_a_second_is_guessed(value, meant) -> None:
    with pytest.warns(UnusualWarning, match="eant") as caught:
        assert speed_of(value) == value / 3.6
    assert len(caught) == 1
    assert str(caught[0].message).endswith(meant)


def test_the_highest_speed_of_a_map_counts(recwarn) -> None:
    _plane("10:60:10", "5:400:5")  # from a walk on is usual
    assert not recwarn.list
    with pytest.warns(UnusualWarning, match="--speeds = 83.3 km/h: meant 83.3 m/s"):
        _plane("10:60:10", "3.3:83.3:10")


@pytest.mark.parametrize("speed", [250.0, 70.0, 72.5, 160.0, 300.0, 350.5])
def test_usual_speeds_raise_no_doubt(speed, recwarn) -> None:
    assert math.isclose(speed_of(speed), speed / 3.6)
    assert not recwarn.list


def test_steps_and_contact_stiffness() -> None:
    with pytest.warns(UnusualWarning, match="Meant 0.1 ms"):
        doubted("--step", 0.1)
    with pytest.warns(UnusualWarning, match=r"Meant 1e\+06 kN/m\? That is 1e\+09 N/m"):
        contact_parameters("1e6")
    with pytest.raises(UsageError, match=r"Meant 1 GN/m\? That is 1e\+09 N/m"):
        contact_parameters("1")
