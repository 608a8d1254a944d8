"""Every wheelset meets the track after the first one: in time, and so wherever a phase says it.

What is expected comes from `Profile.under`, which places wheels along the track and knows nothing
of phases.
"""

import numpy as np
import pytest

from railcosim.analysis.response.frequency import response
from railcosim.analysis.response.plane import plane, transfer
from railcosim.analysis.response.random import response_psd
from railcosim.master.linear.receptance import FrequencyResponse
from railcosim.mechanics.ports import Layout
from railcosim.track.irregularity import Profile

WHEELS = Layout().wheels
WHEELSETS = Layout().axles

POSITIONS = np.array([18.2, 15.7, 2.5, 0.0])
SPEED = 60.0  # m/s
WAVES = np.array([3.0, 7.0, 31.0])  # m
FREQUENCY = SPEED / WAVES


def met(wavelength: float) -> np.ndarray:
    """Complex amplitudes (4,) under the wheelsets on a cosine that begins under the first one."""
    x = np.arange(0.0, 3 * wavelength + 20.0, wavelength / 400)
    z = np.cos(2 * np.pi * x / wavelength)
    heights = Profile(name="cosine", x=x, left=z, right=z).under(POSITIONS, SPEED)
    begun = 18.2 / SPEED  # all four are on it
    period = wavelength / SPEED
    t = begun + period * np.arange(64) / 64
    values = np.array([heights(s) for s in t])[:, :4]
    return 2 * np.mean(values * np.exp(-2j * np.pi * t / period)[:, None], axis=0)


MET = np.array([met(wavelength) for wavelength in WAVES])


def system(omega, rows) -> FrequencyResponse:
    """Outputs are combinations (n_omega, n, 8) of the eight gaps."""
    return FrequencyResponse(
        name="made up", omega=omega, outputs=tuple(f"y{k}" for k in range(rows.shape[1])),
        inputs=tuple(f"{w}.irregularity_z" for w in WHEELS), values=rows + 0j,
    )  # fmt: skip


def heights(omega) -> FrequencyResponse:
    """The mean height under each wheelset."""
    each = np.tile(np.eye(4) / 2, 2)
    return system(omega, np.broadcast_to(each, (len(omega), 4, 8)))


def test_the_first_wheelset_has_no_lag_and_the_others_come_later() -> None:
    # A spline of 400 samples a wave; by hand for the last: 18.2 m behind.
    assert MET[:, 0] == pytest.approx(np.ones(3), abs=1e-7)
    assert MET[:, 3] == pytest.approx(np.exp(-2j * np.pi * 18.2 / WAVES), abs=1e-7)


def test_response_to_irregularity_under_all_wheelsets() -> None:
    omega = 2 * np.pi * FREQUENCY
    found = response(heights(omega), "irregularity_z", POSITIONS, SPEED)
    assert found == pytest.approx(MET, abs=1e-7)


def test_response_to_irregularity_under_one_wheelset() -> None:
    omega = 2 * np.pi * FREQUENCY
    for i, wheelset in enumerate(WHEELSETS):
        found = response(heights(omega), f"{wheelset}.irregularity_z", POSITIONS, SPEED)
        assert found == pytest.approx(np.tile(np.eye(4)[i], (3, 1)))


def test_map() -> None:
    """Direction of the lag and the phase's reference: the irregularity under the first wheelset."""
    table = transfer(heights, [f"y{k}" for k in range(4)], 1.0, 100.0)
    found = plane(table, POSITIONS, WAVES, np.array([20.0, SPEED]))
    # Phases depend on the wavelength alone: the slower train meets the same shape.
    assert np.abs(found - MET.T[:, :, None]).max() < 1e-7


def test_random_response() -> None:
    """What takes the lags back sees all wheelsets in step: four times one, sixteen times its power.

    With the lags the other way about they would come twice.
    """
    omega = 2 * np.pi * FREQUENCY
    in_step = np.tile(MET.conj()[:, None, :] / 2, 2)
    psd = response_psd(
        system(omega, in_step), POSITIONS, SPEED, {"vertical": lambda Omega: 1 / Omega**2}
    )
    expected = 16 / (omega / SPEED) ** 2 * 2 * np.pi / SPEED
    assert psd[:, 0] == pytest.approx(expected, rel=1e-6)
