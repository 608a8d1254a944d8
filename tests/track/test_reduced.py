"""The reduced track, as an FMU carries and steps it, against the direct receptance.

The harmonic response is put together from the two things a step uses, `drive` and `motion`, so the
test holds for shapes, partners, parities and the residual at once.
"""

import runpy
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import splu

from railcosim.mechanics.ports import Layout
from railcosim.reference.ring import build_ring
from railcosim.track.along import rows_along
from railcosim.track.cell import EVEN, ODD, build_cell
from railcosim.track.parameters import Fastening, Mesh, Rail, Slab, Track
from railcosim.track.receptance import Point, direct_receptance
from railcosim.track.reduced import reduce_track
from railcosim.track.ring import ring_modes
from railcosim.track.section import VERTICAL

SEAT, QUARTER, MIDSPAN = 0.3125, 0.46875, 0.625  # m, nodes of the default mesh


SCRIPT = Path(__file__).parents[2] / "benchmarks" / "accuracy.py"
modal_receptance = runpy.run_path(str(SCRIPT))["carried_receptance"]


def driving_point(body, omega, x):
    """(single, both): the rail under a force on it, and under equal forces on both rails."""
    R = modal_receptance(body, omega, x + np.array([0.0, 10.0, 20.0, 30.0]))
    return np.array([R[:, 0], R[:, 0] + R[:, 4]])


def direct_driving_point(track, omega, x):
    points = [Point(x=x, side=-1), Point(x=x, side=1)]
    R = direct_receptance(track, omega, points[:1], points)[:, :, 0]
    return np.array([R[:, 0], R.sum(axis=1)])


@pytest.fixture(scope="module")
def grid():
    """Dense where rail bays resonate by themselves: 1040-1080 Hz."""
    f = np.concatenate([np.arange(4, 1501, 8.0), np.arange(1040, 1081, 1.0)])
    return 2 * np.pi * np.unique(f)


@pytest.fixture(scope="module")
def direct(default_track, grid):
    return {x: direct_driving_point(default_track, grid, x) for x in (SEAT, QUARTER, MIDSPAN)}


@pytest.fixture(scope="module")
def default_body(default_reduced):
    return default_reduced.under(Layout())


def relative_error(found, exact):
    return np.abs(found / exact - 1).max()


@pytest.mark.parametrize("x", [SEAT, QUARTER, MIDSPAN])
def test_default_reduction_to_1500_hz(default_body, grid, direct, x):
    # Measured 7e-4: what is left of modes that fade out below 5 kHz is one oscillator.
    assert relative_error(driving_point(default_body, grid, x), direct[x]) < 1e-3


def ring_driving_point(track, omega, x):
    """Of the whole ring in finite elements, with a node under the force and no other one more."""
    ring = build_ring(track, VERTICAL, np.array([x]))
    row = ring.heads(np.array([x]))[:1].toarray()[0].astype(complex)
    A = [sparse.csc_array(ring.K + 1j * w * ring.C - w**2 * ring.M) for w in omega]
    return np.array([row @ splu(a).solve(row) for a in A])


# m from a railseat: beside it, in the middle of elements, and a quarter from their ends.
@pytest.mark.parametrize("offset", [3e-4, 0.002, 0.01, 0.02, -0.03, 0.039, 0.156, 0.195, -0.273])
def test_between_nodes_to_1500_hz(offset):
    """The promise, wherever a wheel is, against elements of other code."""
    track = Track(mesh=Mesh(cells=4))
    body, x = short_ring(), 2.8125 + offset
    omega = 2 * np.pi * np.array([100.0, 500.0, 960.0, 1080.0, 1260.0, 1440.0, 1500.0])
    found = modal_receptance(body, omega, x + np.array([0.0, 5.0, 10.0, 15.0]))[:, 0]
    # Measured 3.7e-3. With a shape's kink at the railseat rounded off and the residual straight
    # from node to node 8e-3 beside it, with the kink alone 5e-3; with the elements' own
    # interpolation 4e-2.
    assert relative_error(found, ring_driving_point(track, omega, x)) < 4e-3


@cache
def short_ring():
    return reduce_track(Track(mesh=Mesh(cells=4))).under(Layout())


# 6 s: several reductions of a track.
@pytest.mark.slow
@pytest.mark.parametrize("x", [SEAT, QUARTER, MIDSPAN])
def test_reduction_with_more_modes_is_better(finer_body, grid, direct, x):
    # Measured 5e-5: what is left out grows as the square of frequency over that of the modes.
    assert relative_error(driving_point(finer_body, grid, x), direct[x]) < 1e-4


@pytest.fixture(scope="module")
def finer_body():
    track = Track(mesh=Mesh(highest_frequency=16000))
    return reduce_track(track).under(Layout())


def test_static_deflection(default_track, default_body):
    """The residual compliance makes the static deflection right, not only nearly so."""
    for x in (SEAT, QUARTER, MIDSPAN):
        exact = direct_driving_point(default_track, np.zeros(1), x)
        found = driving_point(default_body, np.zeros(1), x)
        # Exact at the nodes for the force's own rail, and 1e-7 of it on the other.
        assert found == pytest.approx(exact, rel=1e-6)
        G = default_body.at(np.full(4, x)).static_compliance()
        assert G[0, 0] == pytest.approx(exact[0, 0].real, rel=1e-6)


def test_transfer_between_wheels(default_track, default_body, grid):
    """From wheelset 2's right wheel to all others, across cells and where the ring closes."""
    position = np.array([98.125, 3.75, 95.625, 51.25])
    some = grid[::12]
    loads = [Point(x=position[1], side=1)]
    observed = [Point(x=x, side=side) for side in (-1, 1) for x in position]
    exact = direct_receptance(default_track, some, loads, observed)[:, :, 0]
    found = modal_receptance(default_body, some, position, load=5)
    error = (np.abs(found - exact) / np.abs(exact[:, [5]])).max(axis=0)
    # Relative to the driving point: 4e-4 there, 1.5e-5 at the next wheel: what is left out is
    # local.
    assert error[5] < 1e-3
    assert np.delete(error, 5).max() < 5e-5


def without_slab(**fastening):
    return Track(
        slab=Slab(present=False),
        fastening=Fastening(**fastening),
        mesh=Mesh(cells=4, elements_per_bay=4, highest_frequency=4000),
    )


@pytest.mark.parametrize(
    ("damping", "tolerance"),
    # Measured 4e-4, 4.2e-3, 2.8e-2. Dampers of 2.5e5 N s/m on a rail node bring real poles just
    # where modes fade out, at 4 kHz; a residual oscillator is not made for them. With ten times
    # that, modes leave out less than nothing at a railseat, which no passive oscillator can mend.
    [(2.5e4, 1e-3), (2.5e5, 6e-3), (2.5e6, 4e-2)],
)
def test_overdamped_modes(damping, tolerance):
    """Fastenings so damped that the rail creeps: real poles, of standing and travelling waves."""
    track = without_slab(damping=damping)
    body = reduce_track(track).under(Layout())
    creeping = np.sum(np.abs(body.poles.imag) < 1e-9 * np.abs(body.poles))
    # A bay of rail on its fastening is overdamped from 2 sqrt(k m) = 6.7e4 N s/m.
    assert (creeping > 0) == (damping > 6.7e4)
    omega = 2 * np.pi * np.concatenate([[0.0, 0.1, 1, 5], np.arange(20.0, 1000, 40)])
    for x in (SEAT, QUARTER, MIDSPAN):
        exact = direct_driving_point(track, omega, x)
        assert relative_error(driving_point(body, omega, x), exact) < tolerance


def test_modes_that_share_a_pole():
    """Without slabs the ring repeats by the bay: a standing wave of cells is two waves of bays."""
    track = without_slab()
    body = reduce_track(track).under(Layout())
    position = np.array([0.3125, 3.125, 9.0625, 17.5])
    omega = 2 * np.pi * np.array([40.0, 110.0, 300.0, 700.0])
    observed = [Point(x=x) for x in position]
    exact = direct_receptance(track, omega, observed[:1], observed)[:, :, 0]
    found = modal_receptance(body, omega, position)
    # As any reduction; measured 4e-4.
    assert np.abs(found[:, :4] - exact).max() < 1e-3 * np.abs(exact[:, 0]).min()
    # Without a slab one rail knows nothing of the other.
    assert np.abs(found[:, 4:]).max() < 1e-9 * np.abs(exact).max()


def test_loss_factors_count_as_viscous_at_their_frequency():
    """There the reduced model has the hysteretic track's receptance."""
    frequency = 400.0
    track = replace(
        Track(),
        rail=Rail(loss_factor=0.02),
        fastening=Fastening(loss_factor=0.25),
        mesh=Mesh(cells=4, elements_per_bay=4, highest_slab_frequency=600,
                  highest_frequency=4000, loss_factor_frequency=frequency),
    )  # fmt: skip
    body = reduce_track(track).under(Layout())
    omega = 2 * np.pi * np.array([frequency, 100.0])
    error = np.abs(
        driving_point(body, omega, QUARTER) / direct_driving_point(track, omega, QUARTER) - 1
    )
    assert error[:, 0].max() < 2e-3  # as any reduction
    assert error[:, 1].min() > 1e-2  # and elsewhere it has not


def test_poles_are_independent_of_how_many_bays_make_a_cell():
    """The same ring as 8 cells of one bay or 4 of two: without slabs nothing tells them apart."""
    tracks = [
        Track(
            slab=Slab(present=False, length=0.625 * bays, joint=0),
            mesh=Mesh(cells=8 // bays, elements_per_bay=4),
        )
        for bays in (1, 2)
    ]
    # Once each: waves of one pole are kept once or twice as it happens.
    poles = [np.unique(np.round(ring_modes(build_cell(t, EVEN), 3000).poles, 2)) for t in tracks]
    assert poles[0].size == poles[1].size >= 8
    assert poles[0] == pytest.approx(poles[1], rel=1e-5)  # rounding to 0.01 rad/s


def test_poles_of_a_rail_on_soft_springs_in_closed_form():
    """Waves n of the free ring, kappa = 2 pi n / length, with k / m added to omega squared."""
    soft = 1e3  # N/m a railseat: 5 Hz, and no effect on how the rail bends
    track = Track(
        slab=Slab(present=False, length=5.0, joint=0),
        fastening=Fastening(stiffness=soft, damping=0.0),
        mesh=Mesh(cells=4, elements_per_bay=8),
    )
    rail, spring = track.rail, soft / track.fastening.spacing / track.rail.mass_per_length
    found = np.unique(np.round(ring_modes(build_cell(track, ODD), 1000).poles.imag, 1))
    m, J = rail.mass_per_length, rail.rotary_inertia
    S, B = rail.shear_stiffness, rail.bending_stiffness
    k2 = (2 * np.pi * np.arange(found.size) / track.length) ** 2
    a, b, c = m * J, -(m * (S + B * k2) + J * S * k2), S * B * k2**2
    expected = np.sqrt((-b - np.sqrt(b**2 - 4 * a * c)) / (2 * a) + spring)
    assert found.size == 16  # waves 0 to 15, of 1.33 m, below 1 kHz
    # Second order of the elements, 2e-3 for a wave of 1.25 m; 0.1 rad/s by which poles are told.
    assert found == pytest.approx(expected, rel=2e-3, abs=0.1)


def test_slopes_of_what_has_kinks_at_railseats():
    """Parabolas from seat to seat, whose slopes differences know exactly."""
    track = Track(mesh=Mesh(cells=4, elements_per_bay=4))
    spacing, rows = track.fastening.spacing, rows_along(track)
    node, share = rows.places
    behind = np.mod(rows.nodes[node] + share * rows.nodes[1] - spacing / 2, spacing)
    slopes = rows.with_slopes((behind * (spacing - behind))[:, None] + 0j)[:, 1, 0]
    between = np.minimum(behind, spacing - behind) > 1e-6
    assert slopes[between] == pytest.approx(spacing - 2 * behind[between], rel=1e-9, abs=1e-12)
    seats = (np.flatnonzero(np.diff(rows.node) == 0) + 1) * rows.parts
    assert slopes[seats] == pytest.approx(np.full(seats.size, spacing), rel=1e-9)
    assert slopes[seats - rows.parts] == pytest.approx(np.full(seats.size, -spacing), rel=1e-9)
