"""Ride values of a car body that rides rigidly on the irregularity: all known by hand."""

import numpy as np
import pytest

from railcosim.analysis.response.comfort import sperling
from railcosim.analysis.response.ride import FLOOR, _with_floor
from railcosim.master.linear.receptance import FrequencyResponse


def test_floor_is_ahead_of_the_centre() -> None:
    """A positive pitch lifts the front: z down is smaller there."""
    values = np.array([[[2.0], [0.1]]]) + 0j
    body = FrequencyResponse(
        name="body",
        omega=np.array([1.0]),
        outputs=("carbody.z", "carbody.pitch"),
        inputs=("u",),
        values=values,
    )
    floor = _with_floor(body, 7.85)
    assert floor.outputs[-2:] == FLOOR
    assert floor.values[0, -2:, 0].real == pytest.approx([2 - 0.785, 2 + 0.785])  # by hand


def test_sperling_grows_with_the_three_tenth_power() -> None:
    f = np.linspace(0.5, 30, 500)
    psd = 1e-3 / f
    assert sperling(f, 100 * psd) == pytest.approx(10**0.3 * sperling(f, psd), rel=1e-12)
