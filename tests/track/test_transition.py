"""Tracks of several kinds joined: closed forms, a long finite track of cells, the track itself."""

import numpy as np
import pytest
from numpy.polynomial import polynomial
from scipy.sparse import lil_array
from scipy.sparse.linalg import splu

from railcosim.mechanics.ports import Y
from railcosim.parameters import ParameterError
from railcosim.track.cell import EVEN, ODD, build_cell
from railcosim.track.files import read_track
from railcosim.track.layers import Layer
from railcosim.track.parameters import Fastening, Mesh, Rail, Slab, Track
from railcosim.track.receptance import Point, infinite_receptance, shortest
from railcosim.track.transition import Line, line_receptance

OMEGA = 2 * np.pi * np.array([3.0, 60.0, 200.0, 500.0, 900.0])
SPACING = 0.1  # m: so near that they are a foundation
SOFT, STIFF = (2e7, 2e4), (1.5e8, 6e4)  # of it per length, N/m2 and N s/m2


def on_foundation(stiffness, damping):
    return Track(
        slab=Slab(present=False),
        fastening=Fastening(
            stiffness=stiffness * SPACING, damping=damping * SPACING, spacing=SPACING
        ),
        mesh=Mesh(elements_per_bay=4),
    )  # fmt: skip


def waves(rail, omega, k, c):
    """Wavenumbers that die out ahead, slopes, moments and shear forces per deflection."""
    S, B, j = rail.shear_stiffness, rail.bending_stiffness, 0.0
    s = k + 1j * omega * c - rail.mass_per_length * omega**2
    j = S - rail.rotary_inertia * omega**2
    kappa = polynomial.polyroots(
        polynomial.polymul([s, 0, S], [j, 0, B]) - np.array([0, 0, S**2, 0, 0])
    )
    kappa = kappa[kappa.imag > 0]
    theta = 1j * kappa * S / (B * kappa**2 + j)
    return kappa, theta, B * 1j * kappa * theta, S * (1j * kappa - theta)


def joined_beams(rail, omega, x):
    """Deflection at x of a beam on two foundations that meet at 0, for a force there."""
    (a, *behind), (b, *ahead) = (waves(rail, omega, *one) for one in (SOFT, STIFF))
    # Behind, x runs the other way: deflection and moment stay, slope and shear force turn round.
    rows = [
        np.concatenate([np.ones(2), -np.ones(2)]),
        np.concatenate([-behind[0], -ahead[0]]),
        np.concatenate([behind[1], -ahead[1]]),
        np.concatenate([-behind[2], -ahead[2]]),
    ]
    amplitude = np.linalg.solve(np.array(rows), np.array([0, 0, 0, 1.0 + 0j]))
    kappa, part = (b, amplitude[2:]) if x >= 0 else (a, amplitude[:2])
    return np.sum(part * np.exp(1j * kappa * abs(x)))


@pytest.mark.parametrize("x", [-1.0, -0.05, 0.0, 0.45, 2.0])
def test_beam_on_two_foundations(x):
    line = Line(tracks=(on_foundation(*SOFT), on_foundation(*STIFF)), joints=(0.0,))
    loads, here = ([Point(x=at, side=side) for side in (-1, 1)] for at in (0.0, x))
    found = line_receptance(line, OMEGA, loads, here[:1])[:, 0].sum(axis=1)
    exact = np.array([joined_beams(Rail(), omega, x) for omega in OMEGA])
    scale = np.abs([joined_beams(Rail(), omega, 0.0) for omega in OMEGA])
    # The elements, 25 mm, and the foundation as springs 0.1 m apart: 1e-3 at 900 Hz.
    assert (np.abs(found - exact) / scale).max() < 2e-3
    alone = infinite_receptance(on_foundation(*SOFT), OMEGA, loads, here[:1])[:, 0].sum(axis=1)
    assert (np.abs(found - alone) / scale).max() > 0.05


@pytest.mark.parametrize("name", ["paper", "ballasted", "two-layer", "embedded", "floating"])
def test_a_track_that_goes_on_as_it_is(name):
    """Slabs and all: joints between equal tracks are no joints."""
    track = read_track(name)
    cell, node = shortest(track).cell_length, track.fastening.spacing / 8
    points = [Point(x=x * node, side=side) for x in (-67, -3, 4, 23) for side in (-1, 1)]
    exact = infinite_receptance(track, OMEGA, points, points)
    scale = np.abs(exact).max(axis=(1, 2), keepdims=True)
    for count, joints in ((2, (0.0,)), (3, (-2 * cell, 3 * cell))):
        found = line_receptance(Line(tracks=(track,) * count, joints=joints), OMEGA, points, points)
        # Rounding; of a slab that is 12 times as stiff as all else, more.
        assert (np.abs(found - exact) / scale).max() < 1e-9


BLOCKS = Track(
    rail=Rail(loss_factor=0.02), slab=Slab(present=False), mesh=Mesh(elements_per_bay=4),
    layers=(Layer(name="block", mass=150.0, stiffness=6e7, damping=8e4),),
    fastening=Fastening(spacing=0.6, loss_factor=0.2),
)  # fmt: skip
SLABS = Track(
    rail=Rail(loss_factor=0.02), mesh=Mesh(elements_per_bay=4, highest_slab_frequency=600)
)
SHORT = Track(
    rail=Rail(loss_factor=0.02), slab=Slab(present=False, length=3.0, joint=0.0),
    mesh=Mesh(elements_per_bay=4), fastening=Fastening(spacing=0.6, stiffness=2e7),
)  # fmt: skip


def finite(sections, points, joint, omega):
    """Cells of one parity chained one by one, dense as they are; free at both ends.

    Sections are (track, cells), points (m from the first one's beginning); `joint` shifts these.
    """
    found = []
    for parity in (EVEN, ODD):
        cells, begin = [], 0.0
        for track, count in sections:
            cell = build_cell(shortest(track), parity)
            for _ in range(count):
                cells.append((begin, cell))
                begin += cell.track.cell_length
        firsts, size = [], 2
        for _, cell in cells:
            firsts.append(size - 2)
            size += cell.K.shape[0] - 2
        at = []
        for first, (_, cell) in zip(firsts, cells, strict=True):
            n = cell.rail_size
            # Those of the last node stand behind all others, where the next cell begins.
            own = np.arange(first, first + cell.K.shape[0])
            inner = np.delete(np.arange(own.size), [n - 2, n - 1])
            place = np.empty(own.size, int)
            place[inner], place[[n - 2, n - 1]] = own[:-2], own[-2:]
            at.append(place)
        rows = np.zeros((len(points), size))
        for k, point in enumerate(points):
            x = point.x - joint
            c = max(j for j, (begin, _) in enumerate(cells) if begin <= x + 1e-9)
            local = Point(x=max(x - cells[c][0], 0.0), side=point.side)
            rows[k, at[c]] = local.row(cells[c][1])
        receptance = []
        for w in omega:
            K = lil_array((size, size), dtype=complex)
            for place, (_, cell) in zip(at, cells, strict=True):
                own = cell.dynamic_stiffness(np.array([w]))[0]
                K[np.ix_(place, place)] = K[np.ix_(place, place)] + own
            receptance.append(rows @ splu(K.tocsc()).solve(rows.T.astype(complex)))
        found.append(np.array(receptance))
    return (found[0] + found[1]) / 2


def test_is_a_long_finite_track():
    """Slabs, four bays of something soft, then blocks; both rails; loads on either side."""
    omega = OMEGA[[1, 3]]
    points = [
        Point(x=x, side=side) for x in (-2.1875, -0.3125, 0.3, 1.5, 2.4, 4.2) for side in (-1, 1)
    ]
    line = Line(tracks=(SLABS, SHORT, BLOCKS), joints=(0.0, 2.4))
    found = line_receptance(line, omega, points, points)
    behind = 12 * SLABS.cell_length
    exact = finite([(SLABS, 12), (SHORT, 4), (BLOCKS, 90)], points, -behind, omega)
    scale = np.abs(exact).max(axis=(1, 2), keepdims=True)
    # What comes back from the free ends, 54 and 60 m away: 1e-7.
    assert (np.abs(found - exact) / scale).max() < 1e-5
    # Betti's law, from one side to the other.
    assert found == pytest.approx(np.swapaxes(found, 1, 2), rel=1e-9, abs=1e-9 * scale.max())


def test_refused():
    with pytest.raises(ParameterError, match=r"whole cells of 0\.6 m; let it end at 2\.4 m"):
        Line(tracks=(BLOCKS, SHORT, BLOCKS), joints=(0.0, 2.2))
    here = [Point(x=0.0, direction=Y)]
    with pytest.raises(ParameterError, match="vertical model only"):
        line_receptance(Line(tracks=(BLOCKS, SHORT), joints=(0.0,)), OMEGA, here, here)
    with pytest.raises(ParameterError, match="tilts_rails = false"):
        Line(tracks=(BLOCKS, Track(slab=Slab(tilts_rails=True))), joints=(0.0,))
