"""Maps over wavelength and speed against systems whose response is known."""

import numpy as np
import pytest

from railcosim.analysis.response.critical import bogie_distance, critical_points
from railcosim.analysis.response.plane import BySpeed, Tabulated, plane, transfer
from railcosim.analysis.response.resonance import resonance
from railcosim.master.linear.receptance import FrequencyResponse
from railcosim.mechanics.ports import Layout

WHEELS = Layout().wheels

POSITIONS = np.array([18.2, 15.7, 2.5, 0.0])
F_N, ZETA = 30.0, 1e-3  # a resonance 0.06 Hz wide


def oscillators(omega):
    """Bounce of a rigid body on four wheelsets, with one sharp resonance."""
    r = omega / (2 * np.pi * F_N)
    H = 1 / (1 - r**2 + 2j * ZETA * r)
    values = np.repeat((H / 8)[:, None, None], 8, axis=2)
    return FrequencyResponse(
        name="body", omega=omega, outputs=("body.z",), values=values,
        inputs=tuple(f"{w}.irregularity_z" for w in WHEELS),
    )  # fmt: skip


def test_plane_is_resonance_times_wheelbase_filter() -> None:
    wavelength, speed = np.linspace(0.5, 20, 60), np.linspace(3, 110, 70)
    table = transfer(oscillators, ["body.z"], speed[0] / wavelength[-1], speed[-1] / wavelength[0])
    found = np.abs(plane(table, POSITIONS, wavelength, speed)[0])
    f = speed / wavelength[:, None]
    H = 1 / np.abs(1 - (f / F_N) ** 2 + 2j * ZETA * f / F_N)
    shape = np.abs(np.cos(np.pi * 2.5 / wavelength) * np.cos(np.pi * 15.7 / wavelength))
    # The table is refined until midpoints are foreseen to 2e-3 of the local response.
    assert np.abs(found - H * shape[:, None]).max() < 4e-3 * H.max()
    assert (np.abs(found / (H * shape[:, None]) - 1) < 4e-3)[:, ::7].all()


def test_one_table_and_every_speed_by_itself_are_the_same() -> None:
    """A lag in time is one in place over the speed."""
    wavelength, speed = np.linspace(0.5, 20, 20), np.linspace(3, 110, 9)
    table = transfer(oscillators, ["body.z"], speed[0] / wavelength[-1], speed[-1] / wavelength[0])
    one = Tabulated(table=table, positions=POSITIONS).over(wavelength, speed)
    each = BySpeed(
        system=lambda omega, _: oscillators(omega), outputs=("body.z",), excitation="vertical",
        positions=POSITIONS,
    ).over(wavelength, speed)  # fmt: skip
    assert one == pytest.approx(each, abs=4e-3 * np.abs(each).max())  # the table's, as above
    assert np.abs(one / each - 1).max() < 4e-3


def test_the_table_is_fine_where_it_must_be() -> None:
    """A peak 0.06 Hz wide between 0.1 and 1000 Hz, without a million frequencies."""
    table = transfer(oscillators, ["body.z"], 0.1, 1000.0)
    assert table.points < 3000
    peak = np.abs(table.at(np.array([F_N]))).sum()
    # All four wheelsets together have the resonance's own height.
    assert peak == pytest.approx(1 / (2 * ZETA), rel=2e-3)


def test_a_response_that_cannot_be_tabulated_is_refused() -> None:
    rng = np.random.default_rng(0)

    def noise(omega):
        made = oscillators(omega)
        shape = made.values.shape
        values = rng.standard_normal(shape) + 0j
        return FrequencyResponse(
            name="noise", omega=omega, outputs=made.outputs, inputs=made.inputs, values=values
        )

    with pytest.raises(ArithmeticError, match="interpolated"):
        transfer(noise, ["body.z"], 1.0, 100.0)


def test_critical_points_by_hand() -> None:
    """Eqs 20 to 22 with the paper's 15.7 m."""
    assert bogie_distance(POSITIONS) == pytest.approx(15.7)
    points = critical_points(POSITIONS, bounce=0.709, pitch=0.93, orders=(1, 2))
    found = {(p.mode, p.order): (p.wavelength, 3.6 * p.speed) for p in points}
    assert found["car body bounce", 1] == pytest.approx((15.7, 40.07), rel=1e-3)  # by hand
    assert found["car body bounce", 2] == pytest.approx((7.85, 20.04), rel=1e-3)
    assert found["car body pitch", 1] == pytest.approx((31.4, 105.1), rel=1e-3)
    assert found["car body pitch", 2] == pytest.approx((31.4 / 3, 35.04), rel=1e-3)


def test_resonance_between_grid_points() -> None:
    """The top of a parabola in logarithms is met exactly; a grid point would be 0.5 % off."""
    frequency = np.geomspace(5, 20, 140)
    size = np.exp(-(np.log(frequency / 9.87) ** 2))
    assert resonance(frequency, size) == pytest.approx(9.87, rel=1e-9)
    assert resonance(frequency, 1 / size, dip=True) == pytest.approx(9.87, rel=1e-9)
    assert resonance(frequency, frequency) == 20  # rises to the end
