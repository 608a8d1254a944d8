"""Synthesised profiles against the spectra they are made of; measured ones and their mistakes."""

import numpy as np
import pytest
from scipy.integrate import quad

from railcosim.parameters import ParameterError
from railcosim.track.irregularity import (
    LONGEST,
    SHORTEST,
    SPECTRA,
    Profile,
    read_profile,
    synthesise,
)


@pytest.mark.parametrize("name", SPECTRA)
def test_variance_is_the_integral_of_the_density(name) -> None:
    """One-sided: the integral over positive wavenumbers between the longest and shortest wave."""

    def density(wavenumber: float) -> float:
        return float(SPECTRA[name].density(np.array([wavenumber]))[0])

    ends = 2 * np.pi / LONGEST, 2 * np.pi / SHORTEST
    expected = quad(density, *ends, limit=400)[0]
    z = synthesise(name, 1000.0).left[:-1]
    # A whole period holds every harmonic's variance exactly; the sum over 1230 of them replaces
    # the integral, to a few per cent at the first, where the density falls steeply.
    assert np.var(z) == pytest.approx(expected, rel=0.05)


def test_a_shorter_profile_is_part_of_a_longer_one() -> None:
    short, long = synthesise("german-low", 80.0), synthesise("german-low", 400.0)
    assert np.array_equal(short.left, long.left[: short.left.size])
    assert not np.array_equal(short.left, synthesise("german-low", 80.0, seed=2).left)


def test_german_low_density() -> None:
    """By hand at 1 rad/m: 4.032e-7 0.8246^2 / ((1 + 0.0206^2)(1 + 0.8246^2))."""
    assert SPECTRA["german-low"].density(np.array([1.0]))[0] == pytest.approx(1.6313e-7, rel=1e-4)


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
