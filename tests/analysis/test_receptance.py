"""Receptances where wheelsets are put, against the finite elements."""

import numpy as np
import pytest

from railcosim.analysis.response.frf import Assembly, frequency_response
from railcosim.analysis.response.receptance import receptance
from railcosim.analysis.response.track_receptance import track_receptance
from railcosim.mechanics.ports import ROLL, Y
from railcosim.parameters import ArgumentError
from railcosim.track.receptance import Point, infinite_receptance

FREQUENCY = np.array([20.0, 53.0, 120.0, 300.0, 600.0])  # modes begin to fade out at 900 Hz
FORCE, RAIL = "wheelset[4].left.force_z", "wheelset[4].left.rail_z"
WRONG = 2e-3  # what modes that fade out leave at 600 Hz; at 53 Hz it is 1e-6


@pytest.mark.parametrize("position", ["railseat", "midspan", 4.9])
def test_track_fmu_under_a_wheelset_there_is_the_finite_elements(exported, short_track, position):
    elements = track_receptance(
        short_track, FREQUENCY, position=position, both_rails=False, ring=True
    )
    x = float(elements.attrs["at"].split()[0])
    for cells in (0, 2):  # every cell is like the first one
        there = x + cells * short_track.cell_length
        fmu = receptance(exported["Track"], FORCE, RAIL, FREQUENCY, position=there)
        assert np.allclose(fmu["receptance"], elements["receptance"], rtol=WRONG)


def test_a_place_of_another_cell_is_that_of_the_first(short_track):
    one, other = (
        track_receptance(short_track, FREQUENCY[:2], position=x, ring=True)
        for x in (1.3, 1.3 + 3 * short_track.cell_length)
    )
    assert np.allclose(one["receptance"], other["receptance"], rtol=1e-9)


def test_railseat_and_midspan_are_told_apart(exported, short_track):
    seat, span = (
        receptance(exported["Track"], FORCE, RAIL, FREQUENCY[-1:], position=x)["receptance"]
        for x in (2.8125, 3.125)
    )
    assert abs(span / seat - 1) > 10 * WRONG


def test_a_position_that_is_none_is_refused(exported):
    with pytest.raises(ArgumentError, match=r"position nan: must be from -1e\+06"):
        receptance(exported["Track"], FORCE, RAIL, FREQUENCY, position=float("nan"))


def test_a_vehicle_moves_alike_wherever_it_stands(exported):
    wheel = "wheelset[4].left.wheel_z"
    here, there = (
        receptance(exported["Vehicle"], FORCE, wheel, FREQUENCY, position=x)["receptance"]
        for x in (None, 7.0)
    )
    assert np.array_equal(here, there)


@pytest.mark.slow  # finite elements
def test_coupled_responses_are_alike_a_cell_farther_and_not_between_railseats(
    exported, short_track
):
    pair = exported["Vehicle"], exported["Track"]
    here = 0.3125  # a railseat, where the vehicle starts
    outputs = ["carbody.z", "wheelset[4].left.wheel_z", "wheelset[1].left.rail_z"]
    start, cell, between = (
        np.array([frequency_response(*pair, FREQUENCY, position=x)[name] for name in outputs])
        for x in (here, here + short_track.cell_length, here + short_track.fastening.spacing / 2)
    )
    assert np.allclose(cell, start, rtol=1e-7)  # a ring of equal cells
    assert np.abs(between / start - 1).max() > 0.01


def test_rail_under_a_moved_vehicle_is_that_of_the_finite_elements(exported, short_track):
    apart = frequency_response(
        exported["Vehicle"], exported["Track"], FREQUENCY, position=3.125,
        excitation="wheelset[4].rail_force_z", assembly=Assembly.APART,
    )  # fmt: skip
    elements = track_receptance(short_track, FREQUENCY, position="midspan", ring=True)
    assert np.allclose(apart[RAIL], elements["receptance"], rtol=WRONG)


def test_directions_of_load_and_response(short_track):
    """Names, units, reciprocity; both rails pushed to the right, and a moment about x."""
    x, f = 1.3, FREQUENCY[1:3]
    y_for_roll = track_receptance(short_track, f, direction="roll", response="y", position=x)
    roll_for_y = track_receptance(short_track, f, direction="y", response="roll", position=x)
    assert y_for_roll["receptance"].attrs["units"] == "m/(N.m)"
    assert roll_for_y["receptance"].attrs["units"] == "rad/N"
    assert np.allclose(y_for_roll["receptance"], roll_for_y["receptance"], rtol=1e-9)
    omega = 2 * np.pi * f
    loads = [Point(x=x, side=side, direction=Y) for side in (-1, 1)]
    known = infinite_receptance(short_track, omega, loads, [Point(x=x, direction=ROLL)])
    assert np.allclose(roll_for_y["receptance"], known[:, 0].sum(axis=1), rtol=1e-12)
    # Beside the middle, towards the track's centre: on the left rail to the right.
    beside = track_receptance(
        short_track, f, direction="z", response="y", position=x, offset=0.02, both_rails=False
    )
    single = track_receptance(
        short_track, f, direction="roll", response="y", position=x, both_rails=False
    )
    assert np.allclose(beside["receptance"], 0.02 * single["receptance"], rtol=1e-9)
    with pytest.raises(ArgumentError, match="direction yaw: must be one of z, y, roll"):
        track_receptance(short_track, f, direction="yaw")
