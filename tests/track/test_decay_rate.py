"""Decay rates by EN 15461 against closed forms; the grid and the limits as they are printed."""

from dataclasses import replace

import numpy as np
import pytest

from railcosim.analysis.response.decay_rate import track_decay_rate
from railcosim.mechanics.ports import Y, Z
from railcosim.parameters import ArgumentError
from railcosim.track.cell import EVEN, build_cell
from railcosim.track.decay_rate import NEPER, distances, lengths, rate, responses, slowest
from railcosim.track.files import read_track
from railcosim.track.parameters import Fastening, Mesh, Slab, Track
from railcosim.track.receptance import Point, infinite_receptance

RIGID = Track(slab=Slab(present=False))


def test_grid():
    """29 places, clause 6.7: to 2.5 bays by quarters, to 4 by halves, to 8 by bays, then to 66."""
    x = distances(Track(fastening=Fastening(spacing=0.5))) / 0.5
    assert x.size == 29
    assert x[:13].tolist() == [*np.arange(0, 2.6, 0.25), 3.0, 3.5]
    assert x[13:].tolist() == [4, 5, 6, 7, 8, 10, 12, 16, 20, 24, 30, 36, 42, 48, 54, 66]


def test_lengths():
    """Annex A.2: half to the next; halves to both sides; as much beyond the last as before it."""
    assert lengths(np.array([0.0, 0.5, 1.4])) == pytest.approx([0.25, 0.7, 0.9], rel=1e-12)


def test_one_wave_has_its_own_rate():
    """exp(-beta x) on a dense grid: 8.686 beta; on a coarse one the geometric series."""
    beta, x = 0.23, np.arange(0.0, 150.0, 1e-3)
    dense = rate(np.exp(-2 * beta * x)[None], x)[0]
    assert dense == pytest.approx(NEPER * beta, rel=1e-4)  # 4.343 for 4.3429, trapezoids
    x, q = 0.25 * np.arange(81), np.exp(-2 * beta * 0.25)
    series = 0.25 * (0.5 + q * (1 - q**80) / (1 - q))
    assert rate(np.exp(-2 * beta * x)[None], x)[0] == pytest.approx(4.343 / series, rel=1e-12)


def test_wave_and_receptances_where_there_is_but_one():
    """A rail on a soft foundation far above its resonance: waves exp(-i kappa x), in closed form.

    Euler's beam: kappa^4 = (m omega^2 - i omega c - k) / EI; shear takes 1 % at 60 Hz.
    """
    spacing, k, c = 0.05, 1e6, 3e3
    track = Track(
        slab=Slab(present=False, length=0.5, joint=0), mesh=Mesh(elements_per_bay=2),
        fastening=Fastening(stiffness=k * spacing, damping=c * spacing, spacing=spacing),
    )  # fmt: skip
    omega = 2 * np.pi * np.array([60.0])
    EI, m = track.rail.bending_stiffness, track.rail.mass_per_length
    kappa = ((m * omega**2 - 1j * omega * c - k) / EI) ** 0.25
    assert slowest(track, omega, Z) == pytest.approx(-NEPER * kappa.imag, rel=0.03)
    # A receptance, wave and near field: exp(-i kappa x) - i exp(-kappa x).
    x = distances(track)
    shape = np.abs(np.exp(-1j * kappa * x) - 1j * np.exp(-kappa * x)) ** 2
    found = np.abs(responses(track, omega, Z)[0]) ** 2
    assert found / found[0] == pytest.approx(shape / shape[0], rel=0.03)


@pytest.mark.parametrize("direction", [Z, Y])
def test_far_responses_decay_as_the_slowest_wave(direction):
    """Between places many bays away, at the same place of a bay: receptances, not waves."""
    omega = 2 * np.pi * np.array([300.0, 800.0])
    at = [Point(x=0.15625 + n * 0.625, direction=direction) for n in (0, 80, 120)]  # a node
    track = replace(RIGID, mesh=Mesh(elements_per_bay=32))
    found = np.abs(infinite_receptance(track, omega, at[:1], at)[:, :, 0])
    falls = 20 * np.log10(found[:, 1] / found[:, 2]) / (40 * 0.625)
    # The next wave decays faster by 3 dB/m or more: 150 dB over the first 50 m.
    assert slowest(track, omega, direction) == pytest.approx(falls, rel=1e-6)


def test_places_a_cell_apart_are_one_node():
    """But for rounding: elements of 1e-15 m would take all digits of what is far away."""
    near, far = 0.2, (0.2 + 80 * 0.625) % 0.625
    assert near != far
    nodes = build_cell(RIGID, EVEN, np.array([near, far])).nodes
    assert np.diff(nodes).min() > 1e-3


def test_dataset():
    result = track_decay_rate(RIGID, 630.0, 1250.0)
    assert result["frequency"].values == pytest.approx(10 ** (np.array([28, 29, 30, 31]) / 10))
    assert result["vertical.limit"].values.tolist() == [6.0, 2.19, 0.8, 0.8]
    assert result["lateral.limit"].values.tolist() == [0.43, 0.29, 0.2, 0.2]
    assert result.attrs["least_measurable"] == pytest.approx(4.343 / (66 * 0.625))
    # The pinned-pinned resonance of 1056 Hz is in the band of 1 kHz: hardly damped there.
    assert np.argmin(result["vertical"].values) == 2
    assert (result["vertical.drop"] > 10).all()


def test_a_track_without_lateral_stiffness_has_vertical_rates():
    result = track_decay_rate(read_track("ballasted"), 1000.0, 1000.0)
    assert "lateral" not in result
    assert float(result["vertical"][0]) > 0


@pytest.mark.parametrize("ends", [(0.0, 100.0), (200.0, 100.0), (5.0, 100.0), (100.0, 2e4),
                                  (100.0, np.inf)])  # fmt: skip
def test_bands_that_are_none(ends):
    with pytest.raises(ArgumentError, match=r"^bands .* lowest <= highest"):
        track_decay_rate(RIGID, *ends)
