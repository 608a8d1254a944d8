"""Ride values of a car body that rides rigidly on the irregularity: all known by hand."""

import numpy as np
import pytest

from railcosim.analysis.response.comfort import LATERAL, sperling, weighted_acceleration
from railcosim.analysis.response.ride import FLOOR, _with_floor, told
from railcosim.master.linear.receptance import FrequencyResponse
from railcosim.mechanics.ports import Layout
from railcosim.track.irregularity import QUALITIES


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


@pytest.mark.parametrize("across", [True, False])
def test_a_car_body_that_follows_its_first_wheelset(across):
    """Down as the mean height, to the right as the alignment, which is felt by W_d; else not."""
    omega = 2 * np.pi * np.geomspace(0.5, 20.0, 200)
    ways = "zy" if across else "z"
    gaps = [f"{wheel}.irregularity_{d}" for d in ways for wheel in Layout(4).wheels]
    follows = np.zeros((len(ways), len(gaps)), complex)
    for k, d in enumerate(ways):
        for side in ("left", "right"):
            follows[k, gaps.index(f"wheelset[1].{side}.irregularity_{d}")] = 0.5
    system = FrequencyResponse(
        name="made up", omega=omega, outputs=tuple(f"vehicle.carbody.{d}" for d in ways),
        inputs=tuple(gaps), values=np.broadcast_to(follows, (omega.size, *follows.shape)),
    )  # fmt: skip
    f, speed, quality = omega / (2 * np.pi), 60.0, QUALITIES["german-low"]
    found = told(system, f, np.array([18.2, 15.7, 2.5, 0.0]), speed, quality)
    felt = {"carbody.az": quality.vertical, "carbody.ay": quality.alignment}
    assert list(found.data_vars) == list(felt)[: len(ways)]
    for name in found.data_vars:
        expected = felt[name].density(omega / speed) * 2 * np.pi / speed * omega**4
        assert found[name].values == pytest.approx(expected, rel=1e-12)
    assert found["carbody.az"].attrs["weighting"] == "W_k"
    if across:
        about = found["carbody.ay"].attrs
        lateral = found["carbody.ay"].values
        assert about["weighting"] == "W_d"
        assert about["iso_2631"] == weighted_acceleration(f, lateral, LATERAL)
        assert about["sperling"] == sperling(f, lateral, LATERAL)
