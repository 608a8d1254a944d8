"""Derivatives of resonances against scaling laws, and differences of resonances found anew."""

import numpy as np
import pytest

from railcosim.analysis.response.free_motions import Endless
from railcosim.analysis.response.sensitivity import sensitivities
from railcosim.analysis.response.slopes import Resonance, slopes
from railcosim.parameters import change, changed
from railcosim.parameters.change import numbers_of, value_at
from railcosim.parameters.quantity import quantity_of
from railcosim.track.cell import EVEN
from railcosim.track.files import read_track
from railcosim.track.named_modes import named_modes
from railcosim.track.parameters import Track
from railcosim.track.section import VERTICAL
from railcosim.vehicle.eigenmodes import swings
from railcosim.vehicle.parameters import Vehicle

STIFF = {"N/m", "N/m2", "N/m3", "N.m/rad", "N.m2"}
DAMPS = {"N.s/m", "N.s/m3", "N.m.s/rad"}
HEAVY = {"kg", "kg.m2", "kg/m", "kg/m3", "kg.m"}


def summed(found, parameters, units):
    """Slopes of all parameters of some units, (resonances,)."""
    keys = [k for k in found["parameter"].values
            if quantity_of(change._key(parameters, str(k)).declared).unit in units]  # fmt: skip
    assert keys
    return found["frequency_slope"].sel(parameter=keys).sum("parameter").values


# Two assemblies for each of thirty numbers.
@pytest.mark.slow
def test_a_vehicle_scales_as_stiffness_over_mass():
    """All stiffness a times as much and damping sqrt(a) times: all poles are sqrt(a) times; and as
    1 / sqrt(a) with mass. Euler's theorem on the sums of slopes; no slope is made twice."""
    vehicle = Vehicle()
    found = sensitivities("vehicle", vehicle)
    f = found["frequency"].values
    k, c, m = (summed(found, vehicle, units) for units in (STIFF, DAMPS, HEAVY))
    # Differences of products of few numbers: 1e-8 of curvature.
    np.testing.assert_allclose(k + c / 2, f / 2, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(m + c / 2, -f / 2, rtol=1e-6, atol=1e-7)


# Cells of two groups of directions, two parities and 25 numbers.
@pytest.mark.slow
def test_a_track_scales_as_stiffness_over_mass():
    track = Track()
    found = sensitivities("track", track=track)
    f = found["frequency"].values
    # Modes of plates are kept to 3 kHz: with the stiffness one comes or goes, 1.4e-6.
    np.testing.assert_allclose(summed(found, track, STIFF), f / 2, rtol=1e-5)
    np.testing.assert_allclose(summed(found, track, HEAVY), -f / 2, rtol=1e-5)
    pinned = found.sel(name="pinned-pinned, vertical")
    assert abs(float(pinned["frequency_slope"].sel(parameter="fastening.stiffness"))) < 0.05


# Cells for each of thirty numbers.
@pytest.mark.slow
def test_slopes_are_those_of_modes_found_anew():
    """Of a ballasted track, whose rail on pads stands on sleepers: found by its name each time."""
    track = read_track("ballasted")
    name, key = "rail on fastenings, vertical", "sleeper.stiffness"
    found = sensitivities("track", track=track)
    at = f"{name} (rails alike)"

    def frequency(factor):
        other = changed(track, {key: value_at(track, key) * factor})
        return next(m.frequency for m in named_modes(other, VERTICAL, EVEN) if m.name == name)

    difference = (frequency(1.001) - frequency(0.999)) / 0.002
    slope = float(found["frequency_slope"].sel(parameter=key, name=at))
    assert slope == pytest.approx(difference, rel=1e-5)  # of curvature, 1e-6


def test_equal_poles_are_told_apart_by_what_parts_them():
    """Two equal masses on springs, whose eigenvectors are any mixture: 0 and 1/2 of one of them."""

    def of(k):
        return lambda s: np.diag([1.0, k]) + s[:, None, None] ** 2 * np.eye(2)

    turned = np.array([[0.6, 0.8], [-0.8, 0.6]])
    modes = [Resonance(name=str(i), pole=1j, right=v, left=v) for i, v in enumerate(turned + 0j)]
    by_hand = Vehicle()  # only `of` is asked; a parameter that is 1
    k = "carbody.mass"
    mass = by_hand.carbody.mass
    found = slopes(lambda one: of(one.carbody.mass / mass), by_hand, "", modes)
    np.testing.assert_allclose(sorted(found[k].imag), [0.0, 0.5], atol=1e-7)


# Modes followed onto the track, five times.
@pytest.mark.slow
def test_slopes_of_the_pair_are_those_of_poles_found_anew():
    """The wheels on the track, by a number of the vehicle and one of the track."""
    vehicle, track = Vehicle(), Track()

    def last(stock, rails):
        pair = Endless(stock, rails)
        first = swings(pair.body.M, pair.body.C, pair.stiffness(1e-9 + 0j, 0.0).real).modes[-1]
        return pair, pair.followed(first)

    pair, mode = last(vehicle, track)
    one = [Resonance(name="", pole=mode.pole, right=mode.shape, left=mode.shape)]
    assert (
        np.abs(pair.at(np.array([mode.pole]))[0] @ mode.shape).max()
        < 1e-6 * np.abs(np.diag(pair.at(np.array([mode.pole]))[0])).max()
    )
    of_track = slopes(lambda rails: Endless(vehicle, rails).at, track, "", one)
    new = {"fastening.stiffness": 1.002 * track.fastening.stiffness}
    old = {"fastening.stiffness": 0.998 * track.fastening.stiffness}
    difference = (
        last(vehicle, changed(track, new))[1].pole - last(vehicle, changed(track, old))[1].pole
    ) / 0.004
    assert of_track["fastening.stiffness"][0] == pytest.approx(difference, rel=1e-4)


def test_numbers_are_named_once():
    """A layer has a number and a name; zeros and whole numbers are no slopes."""
    keys = numbers_of(read_track("ballasted"))
    assert len(keys) == len(set(keys))
    assert sum(key.endswith(".unsupported") for key in keys) == 1
    assert "mesh.cells" not in keys
    assert "fastening.loss_factor" not in keys
