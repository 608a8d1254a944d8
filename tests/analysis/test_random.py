"""Pseudo-excitation against closed forms."""

import numpy as np
import pytest

from railcosim.analysis.response.random import acceleration_psd, response_psd, standard_deviation
from railcosim.master.linear.receptance import FrequencyResponse
from railcosim.mechanics.ports import Layout

WHEELS = Layout().wheels

POSITIONS = np.array([18.2, 15.7, 2.5, 0.0])  # wheel bases of 2.5 m, bogies 15.7 m apart
SPEED = 60.0


def system(omega, rows, across=None):
    """A made-up response: outputs are given combinations of the eight gaps down, and aside."""
    shape = (omega.size, *np.shape(rows))
    aside = np.broadcast_to(np.zeros(8) if across is None else np.asarray(across), shape)
    values = np.broadcast_to(np.asarray(rows, dtype=complex), (omega.size, *np.shape(rows)))
    return FrequencyResponse(
        name="made up",
        omega=omega,
        outputs=tuple(f"y{k}" for k in range(len(rows))),
        inputs=tuple(f"{w}.irregularity_{d}" for d in "zy" for w in WHEELS),
        values=np.concatenate([values, aside], axis=-1),
    )


def density(Omega):
    return 1e-7 / (0.01 + Omega**2)


def test_variance_survives_the_change_of_variable() -> None:
    """Integral over Hz of what one wheel meets = integral over rad/m of the density."""
    omega = np.geomspace(1e-3, 1e5, 20_001)
    psd = response_psd(system(omega, [np.eye(8)[0]]), POSITIONS, SPEED, {"vertical": density})[:, 0]
    expected = 1e-7 * np.pi / 2 / 0.1  # closed form of the integral over Omega > 0
    sigma = standard_deviation(omega / (2 * np.pi), psd)
    assert sigma**2 == pytest.approx(expected, rel=1e-3)  # trapezoids, and the ends left out


def test_wheelbase_filters() -> None:
    """Bounce |cos(pi d1/l) cos(pi D/l)| and pitch |cos(pi d1/l) sin(pi D/l)| of a rigid vehicle."""
    omega = np.linspace(1.0, 500.0, 400)
    bounce = np.full(8, 1 / 8)
    pitch = np.tile([1, 1, -1, -1], 2) / 8
    psd = response_psd(system(omega, [bounce, pitch]), POSITIONS, SPEED, {"vertical": density})
    l = 2 * np.pi * SPEED / omega  # noqa: E741 - wavelength
    single = density(omega / SPEED) * 2 * np.pi / SPEED
    shared = np.cos(np.pi * 2.5 / l)
    assert psd[:, 0] == pytest.approx(single * (shared * np.cos(np.pi * 15.7 / l)) ** 2, abs=1e-20)
    assert psd[:, 1] == pytest.approx(single * (shared * np.sin(np.pi * 15.7 / l)) ** 2, abs=1e-20)


def test_cross_level_moves_the_difference_of_the_rails_only() -> None:
    omega = np.linspace(1.0, 100.0, 50)
    mean, difference = np.repeat([1, 1], 4) / 8, np.repeat([1, -1], 4) / 4
    both = system(omega, [mean, difference, np.eye(8)[0]])
    alike = response_psd(both, POSITIONS, SPEED, {"vertical": density})
    other = response_psd(
        both, POSITIONS, SPEED, {"vertical": density, "cross_level": lambda W: 3 * density(W)}
    )
    assert other[:, 0] == pytest.approx(alike[:, 0], rel=1e-12)  # rounding
    assert alike[:, 1] == pytest.approx(0, abs=1e-25)
    # One wheel: S_v + S_c / 4.
    assert other[:, 2] == pytest.approx(alike[:, 2] * (1 + 3 / 4), rel=1e-12)


def test_alignment_and_gauge_move_both_rails_and_their_difference() -> None:
    """Right less left is the gauge; mean the alignment; the right rail's own: S_a + S_g / 4."""
    omega = np.linspace(1.0, 100.0, 50)
    mean, wider, right = np.zeros((3, 8))
    mean[[0, 4]], wider[[0, 4]], right[4] = 0.5, [-1, 1], 1.0
    across = system(omega, np.zeros((3, 8)), [mean, wider, right])
    psd = response_psd(
        across, POSITIONS, SPEED, {"alignment": density, "gauge": lambda W: 3 * density(W)}
    )
    single = density(omega / SPEED) * 2 * np.pi / SPEED
    for k, times in enumerate((1.0, 3.0, 1.75)):
        assert psd[:, k] == pytest.approx(times * single, rel=1e-12)


def test_oscillator_under_white_noise() -> None:
    """Displacement of m x'' + c x' + k x = c g' + k g under white g'': closed form.

    With the base acceleration white of (one-sided) density G per Hz, the stretch has the variance
    G / (8 zeta omega_n^3), Crandall & Mark 1963.
    """
    omega_n, zeta, G = 30.0, 0.1, 2.0
    omega = np.geomspace(0.05, 3e4, 40_001)
    stretch = omega**2 / (omega_n**2 - omega**2 + 2j * zeta * omega_n * omega)
    base = system(omega, [np.eye(8)[0]])
    values = base.values * stretch[:, None, None]
    made = FrequencyResponse(
        name="oscillator", omega=omega, outputs=("stretch",), inputs=base.inputs, values=values
    )
    # Irregularity whose acceleration at SPEED is white: S_f omega^4 = G.
    white = {"vertical": lambda W: G / (W * SPEED) ** 4 * SPEED / (2 * np.pi)}
    psd = response_psd(made, POSITIONS, SPEED, white)
    variance = standard_deviation(omega / (2 * np.pi), psd[:, 0]) ** 2
    assert variance == pytest.approx(G / (8 * zeta * omega_n**3), rel=1e-3)  # trapezoids
    assert acceleration_psd(omega, psd).shape == psd.shape
    assert acceleration_psd(omega, psd)[10, 0] == pytest.approx(psd[10, 0] * omega[10] ** 4)
