"""The endless track and its waves: against long rings, closed forms, reciprocity, power."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from railcosim.mechanics.ports import ROLL, Y, Z
from railcosim.track.cell import EVEN, ODD, build_cell
from railcosim.track.condensation import condense
from railcosim.track.parameters import Fastening, Foundation, Mesh, Rail, Slab, Track
from railcosim.track.receptance import BOTH, Point, direct_receptance, infinite_receptance, shortest
from railcosim.track.waves import waves

COARSE = Mesh(elements_per_bay=4, highest_slab_frequency=800)
OMEGA = 2 * np.pi * np.array([0.0, 3.0, 31.0, 53.0, 67.5, 140.0, 515.0, 993.0, 1060.0, 1700.0])
LIGHT = Track(
    fastening=Fastening(damping=2.5e3), foundation=Foundation(damping=1e3), mesh=COARSE
)  # dampers / 10
UNDAMPED = replace(LIGHT, fastening=Fastening(damping=0), foundation=Foundation(damping=0))
POINTS = [
    Point(x=0.2),
    Point(x=3.3, side=1),
    Point(x=18.9),
    Point(x=-7.0, side=1),
    Point(x=-6.1, side=1, slab_y=0.4),
    Point(x=12.0, slab_y=1.2),
]


def condensed(track, parity, omega=OMEGA):
    cell = build_cell(track, parity)
    nothing = np.empty((cell.K.shape[0], 0))
    return condense(cell, omega, nothing, nothing)


def ends(cell, omega):
    """Dense: what the inner unknowns do to the ends, by the inverse of all of them."""
    at = np.r_[0:2, cell.rail_size - 2 : cell.rail_size]
    compliance = np.linalg.inv(cell.dynamic_stiffness(omega))[:, at[:, None], at]
    return np.linalg.inv(compliance)


@pytest.mark.parametrize("parity", [EVEN, ODD])
@pytest.mark.parametrize("slab", [True, False])
def test_condensation_against_the_dense_inverse(parity, slab):
    """A free cell: its flexibility at the ends, from all unknowns at once."""
    track = Track(mesh=COARSE, slab=Slab(present=slab), rail=Rail(loss_factor=0.02))
    cell = build_cell(track, parity, np.array([1.17]))
    row = cell.rail_row(1.17)[:, None]
    found = condense(cell, OMEGA, row, row)
    expected = ends(cell, OMEGA)
    size = np.abs(expected).max(axis=(1, 2))
    assert (np.abs(found.stiffness - expected).max(axis=(1, 2)) < 1e-9 * size).all()  # rounding
    # And a load inside, the ends being free.
    inside = (row.T @ np.linalg.inv(cell.dynamic_stiffness(OMEGA)) @ row)[:, 0, 0]
    back = found.motions @ np.linalg.solve(found.stiffness, found.forces) + found.within
    assert back[:, 0, 0] == pytest.approx(inside, rel=1e-8)  # rounding


@pytest.mark.parametrize("loss_factor", [0.0, 0.02])
def test_a_long_ring_is_an_endless_track(loss_factor):
    """400 cells closed by Bloch waves, no decaying wave in sight; the far side is 1 km away."""
    track = Track(rail=Rail(loss_factor=loss_factor), mesh=replace(COARSE, cells=400))
    endless = infinite_receptance(track, OMEGA, POINTS, POINTS)
    ring = direct_receptance(track, OMEGA, POINTS, POINTS)
    # The slowest wave at these frequencies, 0.82 a cell, arrives with 1e-17 at the far side.
    assert np.abs(endless - ring).max() < 1e-10 * np.abs(ring).max()
    assert np.abs(endless - ring).max(axis=(1, 2)) == pytest.approx(
        0, abs=1e-8 * np.abs(ring).max(axis=(1, 2)).min()
    )


def test_on_rigid_ground_a_bay_is_the_cell():
    """One of 0.625 m against a ring of cells of 5 m: both begin midway between railseats."""
    track = Track(slab=Slab(present=False), mesh=replace(COARSE, cells=100))
    assert shortest(track).cell_length == track.fastening.spacing
    on_nodes = [Point(x=0.15625 * k) for k in (2, 9, 121, -30)]
    endless = infinite_receptance(track, OMEGA, on_nodes, on_nodes)
    ring = direct_receptance(track, OMEGA, on_nodes, on_nodes)
    size = np.abs(ring).max(axis=(1, 2))
    assert (np.abs(endless - ring).max(axis=(1, 2)) < 1e-9 * size).all()  # rounding, 500 m round


@pytest.mark.parametrize("slab", [True, False])
@pytest.mark.parametrize("direction", [Z, Y, ROLL])
def test_loads_on_both_rails_are_two_loads(slab, direction):
    """Mirrored offsets, the same direction; and what is seen of both is the sum."""
    track = Track(slab=Slab(present=slab, tilts_rails=True), mesh=COARSE)
    omega, offset = OMEGA[1:6], 0.02
    one = [Point(x=1.3, side=s, direction=direction, offset=s * offset) for s in (-1, 1)]
    both = Point(x=1.3, side=BOTH, direction=direction, offset=offset)
    seen = [Point(x=2.9, direction=d) for d in (Z, Y)]
    each = infinite_receptance(track, omega, one, seen)
    found = infinite_receptance(track, omega, [both], seen)
    size = np.abs(each).max(axis=(1, 2))
    assert (np.abs(found[:, :, 0] - each.sum(axis=2)).max(axis=1) < 1e-10 * size).all()
    back = infinite_receptance(track, omega, seen, [both])
    assert (np.abs(back[:, 0] - found[:, :, 0]).max(axis=1) < 1e-9 * size).all()  # reciprocity


def test_number_of_cells_means_nothing_to_an_endless_track():
    few, many = (replace(LIGHT, mesh=replace(COARSE, cells=cells)) for cells in (4, 40))
    R = infinite_receptance(few, OMEGA, POINTS, POINTS)
    assert np.array_equal(R, infinite_receptance(many, OMEGA, POINTS, POINTS))
    # And light damping is where it matters: the ring of 20 cells is wrong by half.
    ring = direct_receptance(replace(LIGHT, mesh=replace(COARSE, cells=20)), OMEGA, POINTS, POINTS)
    assert np.abs(ring[:, 0, 0] / R[:, 0, 0] - 1).max() > 0.5


@pytest.mark.parametrize("track", [Track(mesh=COARSE), LIGHT, UNDAMPED])
def test_reciprocity_and_power(track):
    """Maxwell and Betti; and a force gives power to the track, which takes it away as waves."""
    R = infinite_receptance(track, OMEGA, POINTS, POINTS)
    assert np.abs(R - np.swapaxes(R, 1, 2)).max() < 1e-10 * np.abs(R).max()  # rounding
    # Power is omega/2 times minus the imaginary part of f* R f: nothing comes out for any f.
    loss = -(R - np.conj(np.swapaxes(R, 1, 2))) / 2j
    least = np.linalg.eigvalsh(loss)[:, 0]
    assert (least > -1e-9 * np.abs(R).max(axis=(1, 2))).all()  # rounding


def test_undamped_track_is_the_limit_of_small_damping():
    """Waves that do not decay are told by the way their power flows."""
    R = infinite_receptance(UNDAMPED, OMEGA, POINTS, POINTS)
    errors = []
    for share in (1e-5, 1e-6):
        little = replace(
            UNDAMPED,
            fastening=Fastening(damping=share * 2.5e4),
            foundation=Foundation(damping=share * 1e4),
        )
        near = infinite_receptance(little, OMEGA, POINTS, POINTS)
        errors.append(np.abs(near - R).max(axis=(1, 2)) / np.abs(R).max(axis=(1, 2)))
    # Linear in the damping; at 0 Hz there is none of it.
    assert errors[0][1:] == pytest.approx(10 * errors[1][1:], rel=1e-2)
    assert max(errors[1]) < 1e-4


def test_waves_solve_their_equation_and_decay():
    for track in (Track(mesh=COARSE), LIGHT):
        for parity in (EVEN, ODD):
            cell = condensed(track, parity)
            S, found = cell.stiffness, waves(cell)
            own, right, left = S[:, :2, :2] + S[:, 2:, 2:], S[:, :2, 2:], S[:, 2:, :2]
            for X, A, B in ((found.forward, right, left), (found.backward, left, right)):
                residual = B + own @ X + A @ X @ X
                size = np.abs(S).max(axis=(1, 2))
                assert (np.abs(residual).max(axis=(1, 2)) < 1e-11 * size).all()  # rounding
                spectrum = np.linalg.eigvals(X)
                slowest = np.abs(spectrum).max(axis=1)
                assert slowest == pytest.approx(np.abs(found.decay[:, 0]), rel=1e-6)
            assert (np.abs(found.decay) < 1).all()


def stiffly_supported(part):
    """A rail on railseats as near as a foundation, whose static waves meet where part is about 1.

    Waves exp(-q x) of a beam on a foundation: BS q^4 - KB q^2 + KS = 0, a square if K = 4 S^2 / B.
    """
    rail, spacing = Rail(), 0.05
    k = 4 * rail.shear_stiffness**2 / rail.bending_stiffness  # N/m2
    return Track(
        slab=Slab(present=False, length=0.1, joint=0),
        fastening=Fastening(stiffness=part * k * spacing, damping=0, spacing=spacing),
        mesh=Mesh(cells=400, elements_per_bay=2),
    )


def test_two_waves_that_become_one_lose_no_digits():
    """Eigenvectors would: where both waves are one there is one vector for two."""

    def difference(part):
        slow, fast = waves(condensed(stiffly_supported(part), EVEN, np.zeros(1))).decay[0]
        return ((slow - fast) ** 2).real  # below 0 where they oscillate

    double = brentq(difference, 0.5, 2.0, xtol=1e-13)
    assert abs(difference(double)) < 1e-10
    for part in (0.9 * double, double, 1.1 * double):
        track, point = stiffly_supported(part), [Point(x=0.025)]
        ring, endless = (
            f(track, np.zeros(1), point, point) for f in (direct_receptance, infinite_receptance)
        )
        assert endless == pytest.approx(ring, rel=1e-11)  # rounding; measured below
