"""Synthesised profiles against the spectra they are made of; what a run meets of a profile."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal
from scipy.integrate import quad

from railcosim.analysis.response.estimate import band_difference, band_error
from railcosim.mechanics.ports import DIMENSIONS, IRREGULARITY, ROLL, Layout, Y, Z
from railcosim.parameters import ParameterError
from railcosim.track.irregularity import (
    QUALITIES,
    Profile,
    coherence,
    estimated_density,
    repeated,
    synthesise,
)
from railcosim.track.irregularity.synthesis import USUAL, _amplitudes


def hollow():
    """A measured one of 2 m, 1 mm deep 6 m from its beginning."""
    x = np.linspace(0.0, 12.0, 1201)
    z = 0.5e-3 * (1 + np.cos(np.pi * np.clip(x - 6.0, -1.0, 1.0)))
    return Profile(name="hollow", x=x, left=z, right=z, level_beyond=True)


LONG = [name for name, quality in QUALITIES.items() if quality.vertical.wavelengths[1] > 1]


def integral(spectrum, wavelengths) -> float:
    """One-sided: over positive wavenumbers between the longest and the shortest wave."""

    def density(log_wavenumber: float) -> float:
        Omega = np.array([np.exp(log_wavenumber)])
        return float(spectrum.density(Omega)[0] * Omega[0])

    ends = np.log(2 * np.pi / wavelengths[1]), np.log(2 * np.pi / wavelengths[0])
    return quad(density, *ends, limit=1000, epsrel=1e-8)[0]


@pytest.mark.parametrize("name", LONG)
def test_lines_have_the_integral_of_the_density(name) -> None:
    """All of them together, and at both ends half a line is within the wavelengths."""
    spectrum = QUALITIES[name].vertical
    power = _amplitudes(spectrum, USUAL) ** 2 / 2
    # Gauss errs by 1e-8, and by 2e-5 where a Chinese spectrum breaks within a line.
    assert power.sum() == pytest.approx(integral(spectrum, USUAL), rel=5e-5)
    line = 2 * np.pi / 50 / 100  # rad/m: 5 km
    inside = spectrum.density(line * np.array([100.25, 6249.75])) * line / 2
    assert power[[100, 6250]] == pytest.approx(inside, rel=1e-3)  # a quarter line: 1e-4
    assert not power[:100].any()
    assert not power[6251:].any()


def test_a_profile_is_a_sum_of_waves_written_out() -> None:
    """Both rails, cosine by cosine, where blocks of 5 km overlap: all four quantities.

    Left less right is the cross-level: a left rail that lies lower (down) has it positive. Right
    less left, aside, is the gauge: wider where the right rail is farther to the right.
    """
    profile = synthesise("german-low", 3000.0, seed=7, quantities=["all"])
    middle = 2 * np.pi / 5000 * np.arange(6252)
    at = np.array([0, 17, 12_345, 49_999, 50_000, 51_234, 60_000])
    x = 0.05 * at
    assert profile.x[at] == pytest.approx(x, rel=1e-12)

    def waves(spectrum, source):
        amplitude, z = _amplitudes(spectrum, USUAL), np.zeros(x.size)
        for block in (0, 1, 2):
            into = x - 2500 * (block - 1)  # blocks begin at -2.5 km, 0, 2.5 km
            phase = np.random.default_rng((7, source, block)).uniform(0, 2 * np.pi, middle.size)
            wave = (amplitude * np.cos(middle * into[:, None] + phase)).sum(axis=1)
            # Power that goes and power that comes: cos^2 and sin^2.
            z += wave * np.where((into >= 0) & (into < 5000), np.sin(np.pi * into / 5000), 0.0)
        return z

    quality = QUALITIES["german-low"]
    left, right = profile.left[at], profile.right[at]
    # Phases up to 4e4 rad: rounding of 1e-11.
    assert (left + right) / 2 == pytest.approx(waves(quality.vertical, 0), abs=1e-12)
    assert left - right == pytest.approx(waves(quality.cross_level, 1), abs=1e-12)
    left, right = profile.left_y[at], profile.right_y[at]
    assert (left + right) / 2 == pytest.approx(waves(quality.alignment, 2), abs=1e-12)
    assert right - left == pytest.approx(waves(quality.gauge, 3), abs=1e-12)


def test_variance_of_a_long_profile() -> None:
    """The integral of the density, within what 100 km of waves up to 50 m scatter by."""
    spectrum = QUALITIES["german-low"].vertical
    power = _amplitudes(spectrum, USUAL) ** 2 / 2
    # A sum of lines 1/L apart has a variance that scatters by sqrt(sum S^2) / sum S; over 100 km
    # there are 20 lots of 5 km.
    scatter = np.sqrt((power**2).sum() / 20) / power.sum()
    assert scatter < 0.03
    found = np.mean(synthesise("german-low", 100_000.0).left ** 2)
    assert found == pytest.approx(integral(spectrum, USUAL), rel=3 * scatter)


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


@pytest.mark.parametrize(("direction", "least", "greatest"), [("z", 0.1, 0.7), ("y", 0.8, 0.95)])
def test_left_and_right_are_as_coherent_as_the_class_says(direction, least, greatest) -> None:
    """Against scipy's estimate from 255 segments of 250 m."""
    profile = synthesise("german-low", 32_000.0, wavelengths=(1.6, 200.0), quantities=["all"])
    step = profile.x[1]
    segment = round(250 / step)
    rails = [profile.rails[direction, side] for side in ("left", "right")]
    n, estimate = signal.coherence(*rails, fs=1 / step, nperseg=segment)
    inside = (n > 0.012) & (n < 0.3)
    expected = coherence("german-low", 2 * np.pi * n[inside], direction)
    assert expected.min() < least
    assert expected.max() > greatest  # there is something to be seen
    # 128 independent segments: a standard error of 0.07 at most, a bias of 0.01.
    assert np.abs(estimate[inside] - expected).max() < 0.25
    assert np.abs(estimate[inside] - expected).mean() < 0.02


def test_a_class_without_cross_level_says_which_have_one() -> None:
    with pytest.raises(ParameterError, match=r"fra-3.*no cross_level, only vertical.*german-low"):
        synthesise("fra-3", 100.0, quantities=["vertical", "cross_level"])
    assert synthesise("fra-3", 100.0, quantities=["all"]).left_y is None  # all that it has
    with pytest.raises(ParameterError, match=r"'twist'.*vertical, cross_level, alignment, gauge"):
        synthesise("german-low", 100.0, quantities=["twist"])
    with pytest.raises(ParameterError, match="of no quantity"):
        synthesise("german-low", 100.0, quantities=[])


def test_quantities_move_the_rails_to_their_sides() -> None:
    """A wider gauge: the right rail to the right (+y), the left one to the left; and so on."""
    half = {
        "vertical": (1, 1, None, None), "cross_level": (0.5, -0.5, None, None),
        "alignment": (0, 0, 1, 1), "gauge": (0, 0, -0.5, 0.5),
    }  # fmt: skip
    whole = synthesise("german-low", 100.0, quantities=["all"])
    for name, shares in half.items():
        profile = synthesise("german-low", 100.0, quantities=[name])
        waves = whole.quantities[name]  # the same, whatever else acts
        for share, rail in zip(
            shares, (profile.left, profile.right, profile.left_y, profile.right_y), strict=True
        ):
            if share is None:
                assert rail is None
            else:
                assert rail == pytest.approx(share * waves, abs=1e-17)  # rounding of the sum


def test_quantities_are_independent() -> None:
    """No two have phases in common: correlations of 40 km, of waves up to 50 m."""
    found = synthesise("german-low", 40_000.0, quantities=["all"]).quantities
    correlation = np.corrcoef(list(found.values())) - np.eye(4)
    # As two signals of N independent waves: 1/sqrt(N), N of some hundreds; three of these.
    assert np.abs(correlation).max() < 0.15


@pytest.mark.parametrize("wavelengths", [(0.0, 50.0), (50.0, 0.8), (1e-9, 50.0), (1.0, np.inf)])
def test_wavelengths_that_make_no_sense(wavelengths) -> None:
    with pytest.raises(ParameterError, match="wavelengths"):
        synthesise("german-low", 100.0, wavelengths=wavelengths)


@pytest.mark.parametrize("length", [80.0, 2499.99, 2600.0])
def test_a_longer_profile_begins_with_the_shorter_one(length) -> None:
    """To the last bit, also what a run meets through the spline, to its very end."""
    short, long = synthesise("german-low", length), synthesise("german-low", 10_000.0)
    n = short.x.size
    for name in ("x", "left", "right"):
        assert np.array_equal(getattr(short, name), getattr(long, name)[:n])
    start, speed = np.array([18.2, 15.7, 2.5, 0.0]), 50.0
    one, other = short.under(start, speed), long.under(start, speed)
    for t in np.linspace(0.0, length / speed, 301):
        assert np.array_equal(one(t), other(t))
    assert short.digest == long.digest


def test_seed_and_fade_make_another_profile() -> None:
    profile = synthesise("german-low", 80.0)
    other = synthesise("german-low", 80.0, seed=2)
    assert not np.array_equal(profile.left, other.left)
    all_four = synthesise("german-low", 80.0, quantities=["all"])
    level = hollow()
    aside = replace(level, left_y=level.left, right_y=level.right)
    kinds = (profile, other, replace(profile, fade=0.0), all_four, level, aside)
    assert len({kind.digest for kind in kinds}) == 6


def test_a_profile_does_not_repeat() -> None:
    """Neither after a block of 5 km nor after its half."""
    z = synthesise("german-low", 20_000.0).left
    for period in (50_000, 100_000, 200_000):
        a, b = z[:100_000], z[period : period + 100_000]
        assert abs(np.corrcoef(a, b)[0, 1]) < 0.5  # 5 km: 100 waves of 50 m, 0.1 each


def test_cross_level_leaves_the_mean_as_it_is() -> None:
    alike, apart = (synthesise("ballastless", 100.0, quantities=q) for q in (["vertical"], ["all"]))
    assert (apart.left + apart.right) / 2 == pytest.approx(alike.left, abs=1e-18)  # rounding


def test_a_class_without_waves_of_that_length_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"ISO 3095.*0\.003 to 0\.45 m"):
        synthesise("iso-3095", 100.0)
    roughness = synthesise("iso-3095", 5.0, wavelengths=(0.01, 0.4))
    assert 1e-6 < roughness.left.std() < 1e-4


@pytest.mark.parametrize("length", [0.0, -1.0, np.nan, np.inf, 1e15])
def test_length_that_makes_no_sense(length) -> None:
    with pytest.raises(ParameterError, match="length"):
        synthesise("german-low", length)


def test_every_wheelset_meets_the_same_profile_later() -> None:
    x = np.linspace(0, 80, 801)
    profile = Profile(name="dip", x=x, left=1e-3 * np.exp(-((x - 30) ** 2)), right=0 * x)
    start, speed = np.array([18.2, 15.7, 2.5, 0.0]), 50.0
    heights = profile.under(start, speed)
    for i, behind in enumerate(18.2 - start):
        z = heights((30.0 + behind) / speed)
        assert z[i] == pytest.approx(1e-3, rel=1e-6)  # cubic spline of a bump 20 samples wide
        assert z[4 + i] == 0
    assert np.abs(heights(0.0)).max() < 1e-12  # nothing under the wheels at the start


def test_ports_of_a_surface_stand_as_those_of_a_layout() -> None:
    """Left wheels, then right ones; of each down and aside, where a wheelset is 2.5 m behind."""
    x = np.linspace(0, 10, 101)
    rails = {
        key: (k + 1) * 1e-3 * x
        for k, key in enumerate([("z", "left"), ("y", "left"), ("z", "right"), ("y", "right")])
    }
    profile = Profile(name="slopes", x=x, left=x, right=x).with_rails(x, rails)
    layout = Layout(2, directions=DIMENSIONS["spatial"]).surface
    assert [d.name for d in layout.directions] == ["z", "y"]
    start = np.array([2.5, 0.0])
    for t in (6.0, np.array([6.0, 7.0])):
        surface = profile.under(start, 1.0, layout.directions)(t)
        behind = np.array([0.0, 2.5, 0.0, 2.5])  # left 1, left 2, right 1, right 2
        slope = 1e-3 * np.array([[1, 2], [1, 2], [3, 4], [3, 4]])
        gone = np.asarray(t)[..., None] - behind
        expected = (gone[..., None] * slope).reshape(*np.shape(t), 8)
        assert surface == pytest.approx(expected, abs=1e-12)
    names = layout.names(IRREGULARITY)
    assert names[:2] == ("wheelset[1].left.irregularity_z", "wheelset[1].left.irregularity_y")
    assert names[6:] == ("wheelset[2].right.irregularity_z", "wheelset[2].right.irregularity_y")


def test_the_vertical_run_is_the_choice_of_one_direction() -> None:
    """The same bits from a profile of all quantities as from its heights alone."""
    whole = synthesise("german-low", 60.0, quantities=["all"])
    heights = replace(whole, left_y=None, right_y=None)
    start, t = np.array([18.2, 15.7, 2.5, 0.0]), np.linspace(0.0, 1.2, 33)
    np.testing.assert_array_equal(whole.under(start, 50.0)(t), heights.under(start, 50.0)(t))
    aside = heights.under(start, 50.0, (Y,))(t)
    assert not aside.any()  # rails that lie straight
    with pytest.raises(ValueError, match="roll"):
        whole.under(start, 50.0, (Z, ROLL))


def test_many_times_at_once_give_the_same_bits() -> None:
    heights = synthesise("german-low", 60.0).under(np.array([18.2, 15.7, 2.5, 0.0]), 50.0)
    t = np.linspace(0.0, 1.2, 321)
    np.testing.assert_array_equal(heights(t), [heights(time) for time in t])
    assert heights(t).shape == (321, 8)
    with pytest.raises(ParameterError, match="needs 100 m"):
        heights(np.array([0.0, 2.0]))


def test_fade_is_half_a_cosine_over_its_length() -> None:
    x = np.linspace(5, 40, 701)  # wherever the profile begins
    profile = Profile(name="step", x=x, left=x**0, right=-(x**0), fade=8.0)
    heights = profile.under(np.array([18.2, 15.7, 2.5, 0.0]), 1.0)
    places = np.array([0.0, 2.0, 4.0, 6.0, 8.0, 20.0])
    # By hand: (1 - cos(pi s)) / 2 at s = 0, 1/4, 1/2, 3/4, 1 and beyond.
    expected = [0, 0.146447, 0.5, 0.853553, 1, 1]
    assert [heights(t)[0] for t in places] == pytest.approx(expected, abs=1e-5)  # spline, digits
    assert [heights(t)[4] for t in places] == pytest.approx([-z for z in expected], abs=1e-5)
    assert heights(8.0)[1] == pytest.approx(heights(8.0 - 2.5)[0])  # the second wheelset: later


def test_without_fade_a_profile_is_met_as_it_is() -> None:
    x = np.linspace(0, 40, 401)
    profile = Profile(name="slope", x=x, left=1e-3 + 1e-4 * x, right=0 * x)
    heights = profile.under(np.array([18.2, 15.7, 2.5, 0.0]), 1.0)
    # Level behind the beginning, as high as it is there: at rest, all wheels are alike.
    assert heights(0.0)[:4] == pytest.approx([1e-3] * 4)
    assert heights(5.0)[:4] == pytest.approx([1.5e-3, 1.25e-3, 1e-3, 1e-3])


@pytest.mark.parametrize("fade", [-1.0, np.nan, np.inf])
def test_fade_that_makes_no_sense(fade) -> None:
    with pytest.raises(ParameterError, match="fade"):
        replace(synthesise("german-low", 10.0), fade=fade)


def test_a_profile_is_never_met_beyond_its_end() -> None:
    profile = synthesise("german-low", 30.0)
    heights = profile.under(np.zeros(4), 10.0)
    profile.check_covers(30.0)
    heights(3.0)
    for ask in (lambda: profile.check_covers(40.0), lambda: heights(4.0)):
        with pytest.raises(ParameterError, match=r"seed 1: ends after 33.2 m.*needs 40 m"):
            ask()


def test_level_track_goes_on_where_that_is_known() -> None:
    profile = hollow()
    profile.check_covers(1e6)
    assert profile.under(np.zeros(4), 10.0)(1e5) == pytest.approx(np.zeros(8), abs=1e-12)


def test_what_is_measured_does_not_fade() -> None:
    """1 mm at 6 m is 1 mm; faded over 10 m it was 0.65."""
    assert hollow().under(np.zeros(4), 1.0)(6.0) == pytest.approx([1e-3] * 8, rel=1e-6)


def test_a_period_repeats_as_it_is() -> None:
    x = np.linspace(3.0, 8.0, 501)
    wave = 1e-3 * np.sin(2 * np.pi * (x - 3.0) / 2.5)
    profile = repeated(Profile(name="wave", x=x, left=wave, right=-wave), 33.0)
    profile.check_covers(33.0)
    assert "every 5 m" in profile.name
    assert "blended" not in profile.name
    heights = profile.under(np.zeros(4), 1.0)
    t = np.linspace(0.0, 33.0, 1234)
    found = np.array([heights(s) for s in t])
    # A cubic spline of 250 samples a wave.
    assert found[:, 0] == pytest.approx(1e-3 * np.sin(2 * np.pi * t / 2.5), abs=1e-9)
    assert found[:, 7] == pytest.approx(-found[:, 0], abs=1e-18)


def test_rails_are_repeated_in_all_directions() -> None:
    x = np.linspace(0.0, 60.0, 601)
    ramp = Profile(name="ramp", x=x, left=1e-4 * x, right=0 * x, left_y=2e-4 * x, right_y=-1e-4 * x)
    profile = repeated(ramp, 200.0)
    assert profile.left_y == pytest.approx(2 * profile.left, abs=1e-17)
    assert profile.right_y == pytest.approx(-profile.left, abs=1e-17)
    wave = 1e-3 * np.sin(2 * np.pi * x / 6)
    closed = Profile(name="wave", x=x, left=wave, right=wave, left_y=1e-4 * x, right_y=0 * x)
    assert "blended" in repeated(closed, 200.0).name  # of one rail's ends that do not meet


def test_ends_that_do_not_meet_are_blended() -> None:
    """By hand: 0.1 mm a m over 60 m; the last 10 m go over into the first ten."""
    x = np.linspace(0.0, 60.0, 601)
    ramp = Profile(name="ramp", x=x, left=1e-4 * x, right=0 * x)
    profile = repeated(ramp, 200.0)
    assert "every 50 m, blended over 10 m" in profile.name
    heights = profile.under(np.zeros(4), 1.0)
    for period in (0, 1, 2):
        at = 50.0 * period
        assert heights(at + 20.0)[0] == pytest.approx(2e-3)
        assert heights(at + 49.0)[0] == pytest.approx(4.9e-3)
        # Half-way: (5.5 + 0.5) / 2 mm. At a quarter: 5.25 mm and 0.25 mm by 0.853553, 0.146447.
        assert heights(at + 55.0)[0] == pytest.approx(3e-3)
        assert heights(at + 52.5)[0] == pytest.approx(4.517765e-3)
        assert heights(at + 60.0)[0] == pytest.approx(1e-3)
    assert heights(5.0)[0] == pytest.approx(0.5e-3)  # the first time the beginning is as it is
    steepest = np.abs(np.diff(profile.left) / np.diff(profile.x)).max()
    assert steepest < 5e-3 / 10 * np.pi / 2 + 1e-4  # of half a cosine of 5 mm over 10 m
    assert repeated(ramp, 300.0).digest == profile.digest


def test_any_few_samples_can_be_repeated() -> None:
    x, z = np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 1e-3, 0.0, 1e-3])
    profile = repeated(Profile(name="short", x=x, left=z, right=z), 100.0)
    profile.check_covers(100.0)
    assert (np.diff(profile.x) > 0).all()
    assert repeated(profile, profile.length) is profile
    with pytest.raises(ParameterError, match="rows"):
        repeated(profile, 1e12)
