"""Speeds that change: where wheels are, against integrals, and files of them."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from railcosim.parameters import ParameterError
from railcosim.track.irregularity import Profile
from railcosim.track.travel import InPlace, InTime, Steady
from railcosim.track.travel_files import read_travel

TIMES = np.array([0.0, 1.0, 4.0, 4.5, 10.0])  # s
SPEEDS = np.array([0.0, 20.0, 20.0, 3.0, 60.0])  # m/s
PLACES = np.array([0.0, 10.0, 60.0, 61.0, 200.0])  # m
ASKED = np.linspace(0.0, 10.0, 97)


def test_the_way_is_the_integral_of_the_speed():
    travel = InTime("t", TIMES, SPEEDS)
    fine = np.linspace(0.0, 10.0, 1_000_001)
    v = np.interp(fine, TIMES, SPEEDS)
    way = np.concatenate([[0.0], np.cumsum((v[1:] + v[:-1]) / 2 * np.diff(fine))])
    # Lines whose ends are samples: the trapezium is exact.
    assert travel.gone(ASKED) == pytest.approx(np.interp(ASKED, fine, way), abs=1e-5)
    assert travel.gone(10.0) == pytest.approx(10 + 60 + 5.75 + 173.25)  # areas, by hand
    assert travel.speed(ASKED) == pytest.approx(np.interp(ASKED, TIMES, SPEEDS))
    assert (travel.until, travel.fastest) == (10.0, 60.0)


def test_a_speed_along_the_track_is_met_where_it_is_given():
    """dx/dt = v(x), against an integrator."""
    speeds = SPEEDS + 5.0
    travel = InPlace("x", PLACES, speeds)
    t = np.linspace(0.0, travel.until, 50)
    exact = solve_ivp(
        lambda t, x: np.interp(x, PLACES, speeds), (0.0, t[-1]), [0.0], t_eval=t, rtol=1e-10,
        atol=1e-9, max_step=0.01,
    ).y[0]  # fmt: skip
    assert travel.gone(t) == pytest.approx(exact, abs=1e-5)  # its steps go across corners of v
    assert travel.speed(t) == pytest.approx(np.interp(exact, PLACES, speeds), abs=1e-4)
    assert travel.gone(travel.times) == pytest.approx(PLACES, rel=1e-12)


@pytest.mark.parametrize("kind", [InTime, InPlace])
def test_one_speed_is_one_speed(kind):
    travel = kind("c", np.array([0.0, 3.0, 900.0]), np.full(3, 250 / 3.6))
    steady = Steady(250 / 3.6)
    assert not travel.changes
    assert travel.gone(ASKED[ASKED < 3.0]) == pytest.approx(
        steady.gone(ASKED[ASKED < 3.0]), rel=1e-15
    )
    many = travel.gone(ASKED)
    assert np.array_equal(many, [travel.gone(float(t)) for t in ASKED])


def test_irregularity_is_met_at_the_way_and_not_at_the_time():
    x = np.linspace(0.0, 300.0, 3001)
    profile = Profile(name="waves", x=x, left=1e-3 * np.sin(x), right=np.zeros_like(x))
    travel, start = InTime("t", TIMES, SPEEDS), np.array([5.0, 0.0])
    found = profile.under(start, travel)(ASKED)
    # Spline of a sine, 63 samples a wave; behind the beginning all is level.
    assert found[:, 0] == pytest.approx(1e-3 * np.sin(travel.gone(ASKED)), abs=1e-8)
    behind = np.maximum(travel.gone(ASKED) - 5.0, 0.0)
    assert found[:, 1] == pytest.approx(1e-3 * np.sin(behind), abs=1e-8)


def written(tmp_path, text):
    path = tmp_path / "speed.csv"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("text", "way", "time"),
    [("time,speed\n0,36\n10,72\n", 150.0, 10.0),
     ("speed (m/s);Time\n10;3\n20;13\n", 150.0, 10.0),  # begins at its first row
     ("position (km),speed\n1,36\n1.15,36\n", 150.0, 15.0),
     ("# braking\nposition,speed\n0,36\n150,36\n", 150.0, 15.0)],
)  # fmt: skip
def test_files(tmp_path, text, way, time):
    travel = read_travel(written(tmp_path, text))
    assert travel.until == pytest.approx(time)
    assert travel.gone(time) == pytest.approx(way)
    travel.check_covers(time)
    with pytest.raises(
        ParameterError, match=r"speed speed.csv: ends after .* s, and the run takes"
    ):
        travel.check_covers(1.01 * time)


@pytest.mark.parametrize(
    ("text", "said"),
    [("t,v\n0,1\n", r"speed.csv, line 1: the header is 't,v'; wanted: time,speed or position"),
     ("time,position,speed\n0,1,2\n", "wanted: time,speed"),
     ("time (m),speed\n0,1\n1,2\n", "wanted: time,speed"),
     ("time,speed\n0,36\n", "has two rows at least"),
     ("time,speed\n0,36\n1,x\n", "line 3: 2 finite numbers are wanted"),
     ("time,speed\n0,36\n1,nan\n", "line 3: 2 finite numbers are wanted"),
     ("time,speed\n0,36\n1,-5\n", "line 3: speed -5 km/h: must be from 0 to 10000"),
     ("time,speed\n0,36\n1,36\n1,40\n", "time must increase.*from 1 to 1"),
     ("position,speed\n0,36\n100,0\n", "line 3: speed 0 at a position is never reached")],
)  # fmt: skip
def test_files_that_are_none(tmp_path, text, said):
    with pytest.raises(ParameterError, match=said):
        read_travel(written(tmp_path, text))
