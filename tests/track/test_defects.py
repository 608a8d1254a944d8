"""Single defects: how deep, how long, how often."""

import numpy as np
import pytest

from railcosim.parameters import ParameterError
from railcosim.track.irregularity import dip, joint, wheel_flat

START = np.zeros(4)


def under(profile, places):
    """Heights that a run meets there, through the spline that runs use."""
    heights = profile.under(START, 1.0)
    return np.array([heights(float(x) - profile.x[0])[0] for x in places])


def test_dip() -> None:
    profile = dip(length=2.0, depth=1e-3, at=12.0)
    assert profile.x[0] == 0
    places = np.array([10.5, 11.0, 11.5, 12.0, 12.5, 13.0, 14.0])
    expected = [0, 0, 0.5e-3, 1e-3, 0.5e-3, 0, 0]
    # A spline over 200 samples a wave meets the cosine to 1e-9 of it, its kinks at the ends to
    # (2 pi / 200)^2 / 10.
    assert under(profile, places) == pytest.approx(expected, abs=1e-7)


def test_joint_has_the_angle_it_says() -> None:
    """Slopes on both sides of the kink: together 8 depth / length."""
    profile = joint(length=1.0, depth=2e-3, at=5.0)
    left, middle, right = under(profile, [4.9, 5.0, 5.1])
    # By hand: depth (1 - 0.2)^2 = 1.28 mm at a tenth of the length from the kink.
    assert (left, right) == (pytest.approx(1.28e-3, rel=1e-3), pytest.approx(1.28e-3, rel=1e-3))
    assert middle == pytest.approx(2e-3, rel=1e-6)
    h = profile.x[np.searchsorted(profile.x, 5.0)] - profile.x[np.searchsorted(profile.x, 5.0) - 1]
    z = profile.left[np.searchsorted(profile.x, 5.0) - 1]
    assert 2 * (2e-3 - z) / h == pytest.approx(8 * 2e-3 / 1.0, rel=0.01)  # one sample off the kink


@pytest.mark.parametrize("at", [0.5, 1.0, 4.0, 30.0])
def test_a_defect_is_where_it_says(at) -> None:
    """From the first wheelset on, also where it is less than its level track away."""
    heights = dip(length=1.0, depth=1e-3, at=at).under(START, 1.0)
    assert heights(at)[0] == pytest.approx(1e-3, rel=1e-6)
    assert heights(at + 0.25)[0] == pytest.approx(0.5e-3, rel=1e-5)
    assert heights(at - 0.5)[0] == pytest.approx(0, abs=1e-7)


@pytest.mark.parametrize(("length", "at"), [(1.0, 0.4), (0.0, 3.0), (-1.0, 3.0), (1.0, np.inf)])
def test_a_defect_that_cannot_be_there(length, at) -> None:
    with pytest.raises(ParameterError, match="defect"):
        dip(length=length, depth=1e-3, at=at)


def test_wheel_flat_comes_back_every_turn() -> None:
    radius, length = 0.43, 0.05
    profile = wheel_flat(length, radius, at=6.0, turns=3)
    depth = length**2 / (16 * radius)
    turn = 2 * np.pi * radius
    found = under(profile, [6.0, 6.0 + turn, 6.0 + 2 * turn])
    assert found == pytest.approx([depth] * 3, rel=1e-6)  # sampled at its deepest
    assert under(profile, [6.0 + turn / 2, 6.0 + 3 * turn]) == pytest.approx([0, 0], abs=1e-9)
    assert (np.diff(profile.x) > 0).all()
