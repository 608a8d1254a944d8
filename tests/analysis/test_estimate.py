"""Spectral estimates against signals whose spectra are known."""

import numpy as np
import pytest

from railcosim.analysis.response.estimate import (
    band_difference,
    band_error,
    third_octaves,
    welch_psd,
)


def test_white_noise() -> None:
    """Variance 4 spread evenly to half the sampling rate."""
    step = 1e-3
    x = 2 * np.random.default_rng(1).standard_normal(200_000)
    frequency, psd, averages = welch_psd(x, step, 1.0)
    assert averages == pytest.approx(0.947 * 399, rel=1e-9)
    expected = 4 * 2 * step
    # The mean over 500 lines of 378 averages each scatters by 1/sqrt(2e5) = 0.2 %.
    assert psd[1:-1].mean() == pytest.approx(expected, rel=0.01)
    assert psd[1:-1].std() == pytest.approx(expected / np.sqrt(averages), rel=0.15)
    assert frequency[1] == pytest.approx(1.0)


def test_sine_in_its_band() -> None:
    """a^2/2 in the third octave that holds it."""
    step, a = 1e-3, 3.0
    t = step * np.arange(40_000)
    frequency, psd, _ = welch_psd(a * np.sin(2 * np.pi * 20.0 * t), step, 4.0)
    centres, power = third_octaves(frequency, psd)
    band = np.argmin(np.abs(np.log(centres / 20.0)))
    # Trapezoids over the five lines of Hann's window are exact but for rounding.
    assert power[band] == pytest.approx(a**2 / 2, rel=1e-3)


@pytest.mark.parametrize("grid", [np.linspace(0, 500, 40_000), np.geomspace(0.9, 500, 5_000)])
def test_bands_of_a_power_law(grid) -> None:
    """S = f: the integral over a band is (f2^2 - f1^2)/2, on any grid."""
    centres, power = third_octaves(grid, grid)
    half = 10**0.05
    expected = ((centres * half) ** 2 - (centres / half) ** 2) / 2
    high = centres > 10  # trapezoids of a straight line are exact; bands begin between points
    assert power[high] == pytest.approx(expected[high], rel=1e-4)
    assert centres[0] / half >= grid[grid > 0][0]
    assert centres[-1] * half <= grid[-1]


def test_difference_of_a_spectrum_and_its_double() -> None:
    f1, f2 = np.geomspace(0.5, 300, 4000), np.linspace(0.1, 200, 20_000)
    centres, decibel = band_difference(f1, 2 / f1, f2, 1 / f2)
    assert centres.size > 20
    assert decibel == pytest.approx(10 * np.log10(2), abs=0.05)  # trapezoids of 1/f on the grids


def test_scatter_is_as_large_as_it_says() -> None:
    """The power in a band of white noise, estimated 200 times."""
    rng, step, segment = np.random.default_rng(3), 1e-3, 1.0
    found = []
    for _ in range(200):
        frequency, psd, averages = welch_psd(rng.standard_normal(10_000), step, segment)
        centres, power = third_octaves(frequency, psd)
        found.append(10 * np.log10(power))
    band = np.argmin(np.abs(centres - 100))
    expected = band_error(centres, segment, averages)[band]
    # 200 repeats know a standard deviation to 5 %; the formula's lines and averages to 15 %.
    assert np.std(found, axis=0)[band] == pytest.approx(expected, rel=0.25)
