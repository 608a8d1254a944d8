"""The direct receptance against the monolithic matrices, equilibrium, symmetry and publications."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import legendre

from railcosim.mechanics.law import LinearContact
from railcosim.reference.contacts import Pressing
from railcosim.reference.frequency import frequency_response, linearised
from railcosim.reference.monolithic import assemble
from railcosim.track.cell import EVEN, ODD, build_cell
from railcosim.track.parameters import Fastening, Foundation, Mesh, Rail, Slab, Track
from railcosim.track.receptance import Point, direct_receptance
from railcosim.track.slab import free_plate_modes
from railcosim.vehicle.parameters import Vehicle

COARSE = Mesh(cells=4, elements_per_bay=4, highest_slab_frequency=800)
OMEGA = 2 * np.pi * np.array([3.0, 31.0, 53.0, 140.0, 515.0, 1058.0, 1700.0])
LOSSY = {"rail": Rail(loss_factor=0.03), "fastening": Fastening(loss_factor=0.2)}


def apart(mono, position):
    """Vehicle and track that do not meet."""
    return linearised(mono, Pressing(LinearContact(k_H=0.0)), position)


def both(R):
    """Left rail under equal forces on both rails, from R with loads left, right."""
    return R[:, 0, 0] + R[:, 0, 1]


def pair(x):
    return [Point(x=x, side=-1), Point(x=x, side=1)]


@pytest.mark.parametrize("changes", [{}, LOSSY, {"slab": Slab(present=False)}])
def test_rails_against_the_monolithic_matrices(changes):
    """Sparse matrices of the whole ring, both rails and whole slabs: no Bloch waves, no parity."""
    track = Track(mesh=COARSE, **changes)
    position = np.array([19.84375, 7.5, 5.0, 0.3125])  # nodes; two meet at a cell's end
    mono = assemble(Vehicle(), track, position)
    rails = mono.rails(position).toarray()
    x = frequency_response(mono, OMEGA, apart(mono, position), rails.T)
    expected = rails @ x
    points = [Point(x=p, side=side) for side in (-1, 1) for p in position]
    found = direct_receptance(track, OMEGA, points, points)
    # One finite element model, two ways: rounding, times the condition of a resonant matrix.
    assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-12 * np.abs(expected).max())


def test_slab_against_the_monolithic_matrices():
    track = Track(mesh=COARSE)
    position = np.array([0.3125, 1.25, 2.5, 13.75])
    mono = assemble(Vehicle(), track, position)
    plates = [
        free_plate_modes(track.slab, p, track.mesh.highest_slab_frequency) for p in (EVEN, ODD)
    ]
    modes = sum(p.omega.size for p in plates)
    load = np.zeros((mono.K.shape[0], 1))
    third = load.shape[0] - (4 - 2) * modes + np.arange(modes)  # unknowns of the third slab

    def row(x, y):
        return np.concatenate([p.at(np.array([x - 2.5]), np.array([y]))[0] for p in plates])

    load[third, 0] = row(1.7, 0.9)
    x = frequency_response(mono, OMEGA, apart(mono, position), load)[:, :, 0]
    expected = np.column_stack([x[:, third] @ row(4.1, -0.2), x @ mono.rails(position).T.toarray()])
    observed = [Point(x=10 + 4.1, side=-1, slab_y=0.2)]
    observed += [Point(x=p, side=side) for side in (-1, 1) for p in position]
    found = direct_receptance(track, OMEGA, [Point(x=10 + 1.7, side=1, slab_y=0.9)], observed)
    assert np.abs(found[:, :, 0] - expected).max() < 1e-10 * np.abs(expected).max()  # rounding


def test_reciprocity():
    """Maxwell and Betti, for rail and slab points at places of no symmetry."""
    points = [
        Point(x=0.2),
        Point(x=3.3, side=1),
        Point(x=18.9),
        Point(x=6.1, side=1, slab_y=0.4),
        Point(x=12.0, slab_y=1.2),
    ]
    R = direct_receptance(Track(mesh=COARSE, **LOSSY), OMEGA, points, points)
    assert np.abs(R - np.swapaxes(R, 1, 2)).max() < 1e-12 * np.abs(R).max()  # rounding


def test_every_cell_is_as_every_other_and_left_is_as_right():
    track = Track(mesh=COARSE)
    loads, observed = [Point(x=1.3)], [Point(x=4.6), Point(x=1.3, side=1), Point(x=9, slab_y=0.5)]
    R = direct_receptance(track, OMEGA, loads, observed)
    for shift, swap in ((5.0, 1), (15.0, 1), (40.0, 1), (0.0, -1), (-5.0, -1)):

        def moved(points, shift=shift, swap=swap):
            return [replace(p, x=p.x + shift, side=swap * p.side) for p in points]

        other = direct_receptance(track, OMEGA, moved(loads), moved(observed))
        # Nodes given to the points move by a rounding of their place.
        assert other == pytest.approx(R, rel=1e-7)
    mirrored = direct_receptance(track, OMEGA, [Point(x=-1.3)], [Point(x=-4.6)])
    assert mirrored[:, 0, 0] == pytest.approx(R[:, 0, 0], rel=1e-7)  # slabs are symmetric


def test_both_loads_are_the_even_part():
    """Forces on both rails leave out everything odd: shown by slabs that could not roll."""
    track = Track(mesh=COARSE)
    R = direct_receptance(track, OMEGA, pair(2.2), pair(2.2))
    assert R[:, 0, 0] == pytest.approx(R[:, 1, 1], rel=1e-12)
    even, odd = R[:, 0, 0] + R[:, 0, 1], R[:, 0, 0] - R[:, 0, 1]
    # Against one parity's matrix alone, condensed to nothing: the closed ring assembled densely.
    for parity, part in ((EVEN, even), (ODD, odd)):
        cell = build_cell(track, parity, np.array([2.2]))
        assert part == pytest.approx(dense_ring(cell, OMEGA, 2.2), rel=1e-7)
    # Static: sinking together is softer than rolling.
    assert even[0].real > odd[0].real > 0


def dense_ring(cell, omega, x):
    """One parity of four cells in full, joined by their shared nodes."""
    n, rail, cells = cell.K.shape[0], cell.rail_size, 4
    size = cells * (n - 2)
    out = []
    for w in omega:
        D_cell = cell.dynamic_stiffness(np.array([w]))[0]
        D = np.zeros((size, size), dtype=complex)
        for c in range(cells):
            start, after = c * (n - 2), ((c + 1) % cells) * (n - 2)
            slab = start + rail - 2 + np.arange(n - rail)
            at = np.concatenate([start + np.arange(rail - 2), after + np.arange(2), slab])
            D[np.ix_(at, at)] += D_cell
        row = cell.rail_row(x)
        full = np.zeros(size)
        full[: rail - 2], full[n - 2 : n] = row[: rail - 2], row[rail - 2 : rail]
        out.append(full @ np.linalg.solve(D, full))
    return np.array(out)


def test_slabs_carry_all_the_load_to_the_foundation():
    """Statics: the pressure k w under all slabs sums to the force, wherever it is put."""
    track = Track(mesh=COARSE, foundation=Foundation(ca_layer_stiffness=1.3e9))
    slab = track.slab
    p, wx = legendre.leggauss(18)  # exact to degree 35; slabs bend in degrees 30 and 16
    q, wy = legendre.leggauss(10)
    points, weights = [], []
    for cell in range(track.mesh.cells):
        centre = (cell + 0.5) * track.cell_length
        for xi, a in zip(p, wx, strict=True):
            for eta, b in zip(q, wy, strict=True):
                x, y = centre + xi * slab.length / 2, eta * slab.width / 2
                points.append(Point(x=x, side=-1 if y < 0 else 1, slab_y=abs(y)))
                weights.append(a * b * slab.length * slab.width / 4)
    R = direct_receptance(track, np.zeros(1), [Point(x=1.1)], points)[0, :, 0].real
    series = 1 / (1 / track.foundation.stiffness + 1 / 1.3e9)
    assert series * np.dot(weights, R) == pytest.approx(1.0, rel=1e-9)  # rounding


def test_no_slab_is_the_limit_of_a_rigid_foundation():
    rigid = Track(mesh=COARSE, foundation=Foundation(stiffness=1e14, damping=0.0))
    none = Track(mesh=COARSE, slab=Slab(present=False))
    R, limit = (direct_receptance(t, OMEGA, pair(2.2), pair(2.2)) for t in (rigid, none))
    # The slab's give is 1e14 / m3 over 12 m2 against 3e7 N/m: 1e-6 of the fastening's at most.
    assert np.abs(R - limit).max() < 1e-5 * np.abs(limit).max()
    assert np.abs(limit[:, 0, 1]).max() == 0  # and rails on rigid ground know nothing of each other


def test_railpad_loss_factor_of_a_rail_that_only_bounces():
    """A rail loaded all along is one mass: R = 1 / (k (1 + i eta) + i omega c - omega^2 m)."""
    track = Track(
        slab=Slab(present=False), fastening=Fastening(loss_factor=0.3), mesh=Mesh(
            cells=4, elements_per_bay=2),
    )  # fmt: skip
    nodes = [Point(x=float(x)) for x in np.arange(4 * 8 * 2) * 0.3125]
    omega = 2 * np.pi * np.array([10.0, 100.0])
    R = direct_receptance(track, omega, nodes, nodes)
    force = np.linalg.solve(R, np.ones((len(nodes), 1)))[:, :, 0].sum(axis=1)
    k, c, m = 3e7 * (1 + 0.3j), 2.5e4, track.rail.mass_per_length * 0.625
    assert force / 32 == pytest.approx(k + 1j * omega * c - omega**2 * m, rel=1e-8)  # rounding


def test_loss_factor_of_everything_static():
    """With one loss factor everywhere, statics is divided by 1 + i eta."""
    eta = 0.1
    lossy = Track(
        rail=Rail(loss_factor=eta), fastening=Fastening(loss_factor=eta), slab=Slab(present=False),
        mesh=COARSE,
    )  # fmt: skip
    plain = Track(slab=Slab(present=False), mesh=COARSE)
    R, expected = (direct_receptance(t, np.zeros(1), pair(2.2), pair(2.2)) for t in (lossy, plain))
    assert R * (1 + 1j * eta) == pytest.approx(expected, rel=1e-9)  # rounding


def test_midspan_and_railseat(default_track):
    """Midspan is softer; the pinned-pinned resonance there is an antiresonance at the railseats."""
    seat, middle = Point(x=50.3125), Point(x=50.625)
    omega = 2 * np.pi * np.concatenate([[0.0], np.arange(1030.0, 1090, 2)])
    R = direct_receptance(default_track, omega, [seat, middle], [seat, middle])
    at_seat, at_middle = np.abs(R[:, 0, 0]), np.abs(R[:, 1, 1])
    assert at_middle[0] > at_seat[0]
    peak = np.argmax(at_middle)
    assert at_middle[peak] > 10 * at_seat[peak]
    assert np.argmin(at_seat[1:]) not in (0, omega.size - 2)  # a dip inside the band


@pytest.mark.parametrize(("ca_layer", "frequency"), [(0.0, 53.0), (1.3e9, 51.9)])
def test_first_rail_resonance(default_track, ca_layer, frequency):
    """52 Hz in Xu & Lu; 53.0 and 51.9 Hz by an independent finite track with ends."""
    track = replace(default_track, foundation=Foundation(ca_layer_stiffness=ca_layer))
    f = np.arange(48.0, 58.0, 0.1)
    R = both(direct_receptance(track, 2 * np.pi * f, pair(50.3125), pair(50.3125)))
    # The independent model has ends and other elements; measured 53.15 and 52.0.
    assert f[np.argmax(np.abs(R))] == pytest.approx(frequency, abs=0.3)


@pytest.fixture(scope="module")
def convergence():
    """Driving points (seat, midspan) x (single, both), by track, at 5 Hz steps to 2 kHz."""
    f = np.arange(5.0, 2001.0, 5.0)
    points = [*pair(50.3125), *pair(50.625)]

    def driving(**mesh):
        track = Track(mesh=Mesh(**mesh))
        R = direct_receptance(track, 2 * np.pi * f, points, points)
        return np.array([R[:, 0, 0], R[:, 0, 0] + R[:, 0, 1], R[:, 2, 2], R[:, 2, 2] + R[:, 2, 3]])

    return f, driving, driving()


def test_default_rail_mesh_against_16_elements(convergence):
    f, driving, default = convergence
    error = np.abs(default / driving(elements_per_bay=16) - 1).max(axis=0)
    # Measured 3.8e-3 below 1 kHz: the interpolation inside elements is static.
    assert error[f < 1000].max() < 6e-3
    # Measured 1.2e-2 to 2 kHz.
    assert error[np.abs(f / 1057 - 1) > 0.05].max() < 2e-2
    # Around the pinned-pinned resonance only its shift counts, see test_rail.


def test_default_plate_cut_off(convergence):
    f, driving, default = convergence
    error = np.abs(default / driving(highest_slab_frequency=5000) - 1).max(axis=0)
    # Measured 1.1e-3 at any frequency below 1.5 kHz: the slab's local give under the fastenings.
    assert error[f < 1500].max() < 2e-3
    assert error.max() < 3e-3  # measured 1.9e-3
