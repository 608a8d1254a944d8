"""Weightings against the standard's table and against an older formula."""

import numpy as np
import pytest

from railcosim.analysis.response.comfort import (
    iso_2631_weight,
    reaction,
    sperling,
    sperling_weight,
    weighted_acceleration,
)

# ISO 2631-1:1997, table 3: W_k times 1000 at nominal third-octave frequencies (Hz).
TABLE = {
    0.5: 418, 0.63: 459, 0.8: 477, 1.0: 482, 1.25: 484, 1.6: 494, 2.0: 531, 2.5: 631, 3.15: 804,
    4.0: 967, 5.0: 1039, 6.3: 1054, 8.0: 1036, 10.0: 988, 12.5: 902, 16.0: 768, 20.0: 636,
    25.0: 513, 31.5: 405, 40.0: 314, 50.0: 246, 63.0: 186, 80.0: 132,
}  # fmt: skip


def test_table_of_the_standard() -> None:
    """Rounded to three digits there, and made at frequencies rounded to two or three."""
    frequency = np.array(list(TABLE))
    assert 1000 * iso_2631_weight(frequency) == pytest.approx(list(TABLE.values()), rel=0.006)


def narrow(frequency: float, amplitude: float):
    """Density of a sine, spread over a thousandth of its frequency."""
    f = np.linspace(frequency * 0.9995, frequency * 1.0005, 11)
    return f, np.full(11, amplitude**2 / 2 / (f[-1] - f[0]))


def test_weighted_sine() -> None:
    f, psd = narrow(8.0, 0.5)
    assert weighted_acceleration(f, psd) == pytest.approx(1.036 * 0.5 / np.sqrt(2), rel=1e-3)


@pytest.mark.parametrize("frequency", [1.0, 3.0, 5.0, 10.0])
def test_sperling_of_a_sine(frequency) -> None:
    """Against Sperling's first formula, 0.896 (a^3 F / f)^(1/10), a in cm/s2.

    The curves were drawn by hand then; up to 10 Hz they differ by 1.2 per cent at most.
    """
    a = 20.0
    F = 0.325 * frequency**2 if frequency < 5.9 else 400 / frequency**2
    older = 0.896 * (a**3 * F / frequency) ** 0.1
    assert sperling(*narrow(frequency, a / 100)) == pytest.approx(older, rel=0.015)


def test_sperling_in_metres() -> None:
    """The usual 4.42 a_w^0.3 with a_w in m/s2 r.m.s., B-weighted."""
    f, psd = narrow(4.0, 0.3)
    weighted = sperling_weight(np.array([4.0]))[0] * 0.3 / np.sqrt(2)
    # 4.42 has three digits.
    assert sperling(f, psd) == pytest.approx(4.42 * weighted**0.3, rel=2e-3)


def test_outside_its_band_sperling_hears_nothing() -> None:
    assert sperling(*narrow(40.0, 1.0)) == 0


@pytest.mark.parametrize(
    ("weighted", "says"),
    [(0.1, "not uncomfortable"), (0.7, "fairly uncomfortable"), (5.0, "extremely uncomfortable")],
)
def test_reactions(weighted, says) -> None:
    assert reaction(weighted) == says
