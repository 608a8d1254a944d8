"""Modes of a vehicle as the library gives them: on held wheels, contact springs, a track."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import splu

from railcosim.analysis.response import modes_on_track
from railcosim.analysis.response.choices import Gravity, Wheels
from railcosim.analysis.response.hunting import way_of
from railcosim.analysis.response.vehicle_modes import vehicle_modes
from railcosim.master.files import load, save
from railcosim.parameters import ArgumentError, UnusualWarning
from railcosim.reference.monolithic import assemble
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.properties import Rolling
from railcosim.vehicle.train import train_of

VEHICLE = Vehicle()
TRACK = Track(mesh=Mesh(cells=6, highest_slab_frequency=300, highest_frequency=500))


@pytest.fixture(scope="module", autouse=True)
def reduced_once():
    """A track is reduced in seconds, and here it is one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(modes_on_track, "reduce_track", cache(modes_on_track.reduce_track))
        yield


def test_the_dataset_is_kept_in_either_file(tmp_path):
    result = vehicle_modes(VEHICLE)
    assert list(result.data_vars) == ["undamped_frequency", "damped_frequency", "damping_ratio"]
    pitch = result.sel(name="car body pitch")
    assert float(pitch["undamped_frequency"]) == pytest.approx(0.953, abs=5e-4)
    for suffix in ("csv", "nc"):
        path = tmp_path / f"modes.{suffix}"
        save(result, path)
        back = load(path)
        assert list(back["name"].values) == list(result["name"].values)
        for name in result.data_vars:
            assert (back[name].values == result[name].values).all()
            assert back[name].attrs["units"] == result[name].attrs["units"]


def test_manchester_vehicle_1():
    """Frequencies of its car body, by masses on springs in series where that is near enough."""
    result = vehicle_modes(read_stock(Path("manchester")))
    bounce = float(result.sel(name="car body bounce")["undamped_frequency"])
    series = 1 / (1 / (2 * 430e3) + 1 / (4 * 1.22e6))  # under one bogie
    # The bogies' mass lowers it, by 0.3 %.
    assert bounce == pytest.approx(np.sqrt(2 * series / 32000) / (2 * np.pi), rel=4e-3)


def test_gravity_is_a_choice_that_counts():
    known = [
        vehicle_modes(wheels=Wheels.CONTACT, speed=30.0, conicity=0.1, gravity=gravity)
        for gravity in Gravity
    ]
    hunting = [float(r["damping_ratio"].min()) for r in known]
    assert hunting[0] != pytest.approx(hunting[1], abs=1e-4)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"speed": 30.0}, "give --conicity as well"),
        ({"conicity": 0.1}, "give --speed as well"),
        ({"speed": 30.0, "conicity": 0.1}, "held do not creep"),
    ],
)
def test_what_does_not_go_together(given, message):
    with pytest.raises(ArgumentError, match=message):
        vehicle_modes(**given)


def test_rolling_is_not_passed_over_in_silence():
    vehicle = replace(Vehicle(), rolling=Rolling(conicity=0.3))
    with pytest.warns(UnusualWarning, match=r"\[rolling\] is left out: without speed"):
        vehicle_modes(vehicle)


# 5 s of finite elements.
@pytest.mark.slow
def test_on_the_track_as_vehicle_and_track_of_finite_elements():
    """Poles of wheelsets on rails, where the whole ring of elements has a pole.

    The vehicle without springs along the track, which the vertical one knows nothing of.
    """
    weak = replace(VEHICLE.primary_suspension, stiffness_x=1e-4)
    soft = replace(VEHICLE.secondary_suspension, stiffness_x=1e-4)
    vehicle = replace(VEHICLE, primary_suspension=weak, secondary_suspension=soft)
    result = vehicle_modes(vehicle, wheels=Wheels.RAILS, track=TRACK)
    names = [n for n in result["name"].values if n.startswith(("wheelset bounce", "car body b"))]
    assert len(names) == 5
    body = train_of(vehicle).parts().bodies
    x = np.array([b.place[0] for b in body if b.kind == "wheelset"])
    position = x - x[-1] + TRACK.fastening.spacing / 2
    whole = assemble(vehicle, TRACK, position)
    contact = whole.wheels - whole.rails(position)
    k = build_multibody(vehicle).wheels[0].patch.ellipse.stiffness(whole.load)
    K = whole.K + contact.T @ sparse.diags_array(k) @ contact

    def stiffness(s):
        loss = 1j * whole.K_loss if s.imag > 0 else 0 * whole.K_loss
        return (s * s * whole.M + s * whole.C + K + loss).tocsc()

    for name in names:
        one = result.sel(name=name)
        size, ratio = 2 * np.pi * float(one["undamped_frequency"]), float(one["damping_ratio"])
        s = begin = complex(-ratio * size, 2 * np.pi * float(one["damped_frequency"]))
        v = np.random.default_rng(0).normal(size=K.shape[0]) + 0j
        for _ in range(12):  # inverse iteration on the elements
            u = splu(stiffness(s)).solve((2 * s * whole.M + whole.C) @ v)
            s, v = s - np.vdot(v, v) / np.vdot(v, u), u / np.linalg.norm(u)
        # The track is reduced with an error of some 1e-3, here to 500 Hz; 6e-4 are measured.
        assert abs(s - begin) < 2e-3 * size, name


@pytest.mark.slow  # a track aside, reduced: 9 s
def test_the_reduced_track_is_as_near_to_growing_there():
    """Poles of vehicle and reduced track: at the critical speed one neither grows nor decays."""
    critical = way_of(None, Gravity.NORMALS, TRACK, rigid_track=False).on(0.1).critical()
    modes = vehicle_modes(wheels=Wheels.RAILS, speed=critical.speed, conicity=0.1, track=TRACK)
    least = modes.isel(name=int(np.argmin(modes["damping_ratio"].values)))
    assert str(least["name"].values).startswith("bogie hunting")
    assert float(least["damped_frequency"]) == pytest.approx(critical.frequency, rel=1e-3)
    # Measured: 1.3e-4. The speed goes by the endless track, this by the ring, reduced.
    assert abs(float(least["damping_ratio"])) < 5e-4
