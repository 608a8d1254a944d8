"""Synthesised profiles against the spectra they are made of; measured ones and their mistakes."""

import numpy as np
import pytest
from scipy import signal
from scipy.integrate import quad

from railcosim.analysis.estimate import band_difference, band_error
from railcosim.parameters import ParameterError
from railcosim.track.irregularity import (
    QUALITIES,
    Profile,
    coherence,
    estimated_density,
    read_profile,
    synthesise,
    write_profile,
)
from railcosim.track.irregularity.synthesis import USUAL

LONG = [name for name, quality in QUALITIES.items() if quality.vertical.wavelengths[1] > 1]


@pytest.mark.parametrize("name", LONG)
def test_variance_is_the_integral_of_the_density(name) -> None:
    """One-sided: the integral over positive wavenumbers between the longest and shortest wave."""

    def density(wavenumber: float) -> float:
        return float(QUALITIES[name].vertical.density(np.array([wavenumber]))[0])

    ends = 2 * np.pi / USUAL[1], 2 * np.pi / USUAL[0]
    expected = quad(density, *ends, limit=400)[0]
    z = synthesise(name, 1000.0).left[:-1]
    # A whole period holds every harmonic's variance exactly; the sum over 1230 of them replaces
    # the integral, to some per cent at the first, where the density falls steeply.
    assert np.var(z) == pytest.approx(expected, rel=0.06)


@pytest.mark.parametrize("name", ["german-low", "ballastless", "fra-5", "sncf-good"])
def test_spectrum_of_a_profile_is_its_class(name) -> None:
    """Welch's estimate, third octave by third octave, against the class."""
    Omega, S = estimated_density(synthesise(name, 8000.0), segment=250.0)
    target = QUALITIES[name].vertical.density(Omega)
    centres, decibel = band_difference(Omega, S, Omega, target)
    inside = (centres > 2 * np.pi / 25) & (centres < 2 * np.pi / 1.1)  # clear of both ends
    assert inside.sum() > 10
    # 60 averages of 250 m: band_error gives 0.6 dB at the widest wave, a tenth at the shortest.
    scatter = band_error(centres[inside], 250.0 / (2 * np.pi), 60.0)
    assert (np.abs(decibel[inside]) < 4 * scatter + 0.15).all()


def test_left_and_right_are_as_coherent_as_the_class_says() -> None:
    """Against scipy's estimate from 255 segments of 250 m."""
    profile = synthesise("german-low", 32_000.0, wavelengths=(1.6, 200.0), coherent=False)
    step = profile.x[1]
    segment = round(250 / step)
    n, estimate = signal.coherence(profile.left, profile.right, fs=1 / step, nperseg=segment)
    inside = (n > 0.012) & (n < 0.3)
    expected = coherence("german-low", 2 * np.pi * n[inside])
    assert expected.min() < 0.1
    assert expected.max() > 0.7  # there is something to be seen
    # 128 independent segments: a standard error of 0.07 at most, a bias of 0.01.
    assert np.abs(estimate[inside] - expected).max() < 0.25
    assert np.abs(estimate[inside] - expected).mean() < 0.02


def test_a_class_without_cross_level_says_which_have_one() -> None:
    with pytest.raises(ParameterError, match=r"fra-3.*german-low"):
        synthesise("fra-3", 100.0, coherent=False)


@pytest.mark.parametrize("wavelengths", [(0.0, 50.0), (50.0, 0.8), (1.0, 5000.0)])
def test_wavelengths_that_make_no_sense(wavelengths) -> None:
    with pytest.raises(ParameterError, match="wavelengths"):
        synthesise("german-low", 100.0, wavelengths=wavelengths)


def test_a_written_profile_is_read_back(tmp_path) -> None:
    profile = synthesise("ballastless", 50.0, coherent=False)
    write_profile(profile, tmp_path / "p.csv")
    again = read_profile(tmp_path / "p.csv")
    for name in ("x", "left", "right"):
        assert np.array_equal(getattr(profile, name), getattr(again, name))


def test_a_shorter_profile_is_part_of_a_longer_one() -> None:
    short, long = synthesise("german-low", 80.0), synthesise("german-low", 400.0)
    assert np.array_equal(short.left, long.left[: short.left.size])
    assert not np.array_equal(short.left, synthesise("german-low", 80.0, seed=2).left)


def test_every_wheelset_meets_the_same_profile_later() -> None:
    x = np.linspace(0, 60, 601)
    profile = Profile(name="dip", x=x, left=1e-3 * np.exp(-((x - 30) ** 2)), right=0 * x)
    start, speed = np.array([18.2, 15.7, 2.5, 0.0]), 50.0
    heights = profile.under(start, speed, fade=10.0)
    for i, behind in enumerate(18.2 - start):
        z = heights((30.0 + behind) / speed)
        assert z[i] == pytest.approx(1e-3, rel=1e-6)  # cubic spline of a bump 20 samples wide
        assert z[4 + i] == 0
    assert np.abs(heights(0.0)).max() == 0  # nothing under the wheels at the start


def test_measured_profile(tmp_path) -> None:
    path = tmp_path / "track.csv"
    path.write_text("# measured\nx,left,right\n" + "\n".join(f"{k},{k * 1e-4},0" for k in range(9)))
    profile = read_profile(path)
    assert profile.left[-1] == pytest.approx(8e-4)
    assert (profile.right == 0).all()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "header"),
        ("x,z\n0,0\n", "header"),
        ("x,left\n0,0\n1,0\n", "four rows"),
        ("x,left\n0,0\n1,0\n0.5,0\n2,0\n", "increase"),
        ("x,left\n0,0\n1,nan\n2,0\n3,0\n", "line 3"),
        ("x,left\n0,0\n1,soft\n2,0\n3,0\n", "line 3"),
        ("x,left\n0,0\n1,0,0\n2,0\n3,0\n", "line 3"),
    ],
)
def test_a_bad_profile_is_refused(tmp_path, text, says) -> None:
    path = tmp_path / "track.csv"
    path.write_text(text)
    with pytest.raises(ParameterError, match=says):
        read_profile(path)
