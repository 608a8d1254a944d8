"""Rail elements against the closed forms of the Timoshenko beam."""

import numpy as np
import pytest
from scipy.linalg import eigh

from railcosim.mechanics.shape_functions import shape_functions
from railcosim.track.parameters import Mesh, Rail, Slab, Track
from railcosim.track.rail import assemble, element_matrices
from railcosim.track.receptance import Point, direct_receptance

RAIL = Rail()
BAY = 0.625


def beam(lengths):
    M, K = element_matrices(RAIL, np.asarray(lengths, dtype=float))
    return assemble(M), assemble(K)


def supported(size, fixed):
    return np.setdiff1d(np.arange(size), fixed)


def pinned_frequencies(half_waves, length):
    """Both roots (Hz) of the pinned-pinned Timoshenko beam, bending branch first.

    With w = sin kx, theta = cos kx the two equations of motion leave
    (kGA k^2 - m W) (kGA + EI k^2 - J W) = (kGA k)^2, W = omega^2, J = rho I.
    """
    m, J = RAIL.mass_per_length, RAIL.rotary_inertia
    S, B = RAIL.shear_stiffness, RAIL.bending_stiffness
    k2 = (half_waves * np.pi / length) ** 2
    squared = np.roots([m * J, -(m * (S + B * k2) + J * S * k2), S * B * k2**2])
    return np.sqrt(np.sort(squared)) / (2 * np.pi)


def pinned_fe(elements, length):
    M, K = beam(np.full(elements, length / elements))
    free = supported(M.shape[0], [0, 2 * elements])
    squared = eigh(K[np.ix_(free, free)], M[np.ix_(free, free)], eigvals_only=True)
    return np.sqrt(squared) / (2 * np.pi)


@pytest.mark.parametrize("length", [0.02, 0.078, 0.625, 5.0])
def test_rigid_body_motion_gives_no_force(length):
    _, K = element_matrices(RAIL, np.array([length]))
    motions = np.array([[1, 0, 1, 0], [0, 1, length, 1]]).T
    force = np.abs(K[0] @ motions)
    # Rounding of sums of entries as large as K's largest.
    assert force.max() < 1e-14 * np.abs(K).max() * max(1, length)
    # And nothing else does: two rigid motions, two stiffnesses.
    stiffness = np.linalg.eigvalsh(K[0])
    assert np.sum(stiffness > 1e-10 * stiffness.max()) == 2


@pytest.mark.parametrize("length", [0.02, 0.625, 5.0])
def test_mass_of_an_element(length):
    M, _ = element_matrices(RAIL, np.array([length]))
    up = np.array([1, 0, 1, 0])
    assert up @ M[0] @ up == pytest.approx(RAIL.mass_per_length * length, rel=1e-14)  # rounding
    assert M[0] == pytest.approx(M[0].T, rel=1e-14)
    assert np.linalg.eigvalsh(M[0]).min() > 0


def test_mass_of_an_element_bent_by_its_rotary_inertia():
    """Energy of theta = 1 everywhere with no deflection anywhere is rho I times the length."""
    length = 0.1
    M, _ = element_matrices(RAIL, np.array([length]))
    heavy, _ = element_matrices(Rail(area=RAIL.area / 2), np.array([length]))
    # Half the area at the same mass per length doubles rho I, and nothing else that a rigid turn of
    # the element can show.
    turn = np.array([-length / 2, 1, length / 2, 1])
    added = turn @ (heavy - M)[0] @ turn
    assert added == pytest.approx(RAIL.rotary_inertia * length, rel=1e-9)  # rounding


def test_cantilever_is_exact_at_every_node():
    """Tip force P: w = P x^2 (3 L - x) / 6 EI + P x / kGA, on unequal elements."""
    lengths = np.array([0.05, 0.3, 0.1, 0.45, 0.1])
    x, L = np.concatenate([[0], np.cumsum(lengths)]), lengths.sum()
    _, K = beam(lengths)
    free = supported(K.shape[0], [0, 1])
    force = np.zeros(K.shape[0])
    force[-2] = 1.0
    u = np.zeros_like(force)
    u[free] = np.linalg.solve(K[np.ix_(free, free)], force[free])
    expected = x**2 * (3 * L - x) / (6 * RAIL.bending_stiffness) + x / RAIL.shear_stiffness
    # The interpolation solves the static equations: only rounding, times a condition of 1e5.
    assert u[::2] == pytest.approx(expected, rel=1e-10)


def test_fixed_beam_with_a_midspan_force_is_exact():
    """w(L/2) = P L^3 / 192 EI + P L / 4 kGA."""
    L = 0.625
    _, K = beam([L / 2, L / 2])
    middle = K[2:4, 2:4]
    deflection = np.linalg.inv(middle)[0, 0]
    expected = L**3 / (192 * RAIL.bending_stiffness) + L / (4 * RAIL.shear_stiffness)
    assert deflection == pytest.approx(expected, rel=1e-13)  # rounding
    # Shear is most of it: an Euler beam would be four times too stiff, so locking would show.
    assert deflection > 3 * L**3 / (192 * RAIL.bending_stiffness)


def test_deflection_inside_an_unloaded_element_is_exact():
    """The interpolation between the nodes of a cantilever is the closed form itself."""
    L, B, S = 0.4, RAIL.bending_stiffness, RAIL.shear_stiffness
    x = np.linspace(0, L, 9)
    w = x**2 * (3 * L - x) / (6 * B) + x / S
    theta = x * (2 * L - x) / (2 * B)  # bending rotation: without the shear angle
    N_w, N_theta = shape_functions(x / L, L, 12 * B / (S * L**2))
    ends = np.array([w[0], theta[0], w[-1], theta[-1]])
    assert N_w @ ends == pytest.approx(w, rel=1e-12, abs=1e-20)  # rounding
    assert N_theta @ ends == pytest.approx(theta, rel=1e-12, abs=1e-20)


@pytest.mark.parametrize("half_waves", [1, 2])
@pytest.mark.parametrize("branch", [0, 1])
def test_pinned_frequencies_converge(half_waves, branch):
    exact = pinned_frequencies(half_waves, BAY)[branch]
    errors = []
    for elements in (16, 32, 64):
        found = pinned_fe(elements, BAY)
        errors.append(abs(found[np.argmin(np.abs(found - exact))] / exact - 1))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # Fourth order: the averaged mass cancels what is wrong by (k h)^2. A tenth for higher orders.
    assert orders.min() > 3.9, (errors, orders)
    assert errors[-1] < 1e-3  # (2 pi / 64)^2 / 12 = 8e-4 of the shorter wave


def test_default_mesh_finds_the_pinned_pinned_frequency():
    """The paper's 1056 Hz with eight elements a bay, too high by (pi / 8)^2 / 12 times a sixth."""
    exact = pinned_frequencies(1, BAY)[0]
    assert exact == pytest.approx(1056.1, abs=0.1)  # to the digits of the paper's reading
    found = pinned_fe(Mesh().elements_per_bay, BAY)[0]
    assert found == pytest.approx(exact, rel=2.5e-3)  # measured 2.0e-3


def test_pinned_pinned_frequency_shows_at_midspan():
    track = Track()
    frequency = np.arange(1030.0, 1090.0, 0.5)
    middle = Point(x=50.0)  # a cell's end is half-way between railseats
    R = direct_receptance(track, 2 * np.pi * frequency, [middle], [middle])[:, 0, 0]
    peak = frequency[np.argmax(np.abs(R))]
    # From the closed form to what eight elements make of it, 0.2 % higher, and the railseats' give.
    assert 1056 <= peak <= 1060
    stiff = np.abs(R[np.argmin(np.abs(frequency - 1030))])
    assert np.abs(R).max() > 10 * stiff  # it is a resonance, not the highest point of a slope


def test_ring_of_rail_without_slab_weighs_what_it_should():
    """Far above the bounce of the rail on its railpads, R = -1 / (omega^2 m) for uniform loads."""
    track = Track(slab=Slab(present=False), mesh=Mesh(cells=4, elements_per_bay=2))
    nodes = np.arange(4 * 8 * 2) * (BAY / 2)
    points = [Point(x=float(x)) for x in nodes]
    omega = np.array([2 * np.pi * 20.0])
    R = direct_receptance(track, omega, points, points)[0]
    # Loads that move the rail as a rigid body: its mass on its railpads, w = 1 everywhere.
    forces = np.linalg.solve(R, np.ones(nodes.size))
    fastening = track.fastening
    expected = (fastening.stiffness + 1j * omega[0] * fastening.damping) * 32 - omega[
        0
    ] ** 2 * RAIL.mass_per_length * track.length
    # w = 1 at every node makes the rotations follow only if nothing bends between the nodes:
    # railseats are nodes here, so the sum of forces is exact to rounding times R's condition.
    assert forces.sum() == pytest.approx(expected, rel=1e-8)
