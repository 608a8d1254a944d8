"""Infinite Timoshenko beam on a viscoelastic foundation: the track without slabs, in closed form.

Equations of motion, forces down, with S = kappa G A, B = EI, J = rho I and a foundation k, c per
length::

    S (w'' - theta') - k w - c dw/dt - m d2w/dt2 + F = 0
    B theta'' + S (w' - theta) - J d2theta/dt2 = 0

A wave exp(i kappa x) with s = k + i omega c - m omega^2 (all that acts on w) and
j = S - J omega^2 (all that acts on theta) has theta = i kappa S w / (B kappa^2 + j), so a force
F delta(x) gives::

    w(kappa) = F (B kappa^2 + j) / ((S kappa^2 + s) (B kappa^2 + j) - S^2 kappa^2)

whose inverse transform at x >= 0 is i times the sum of residues in the upper half plane. A force
moving at v leaves a steady shape in x - v t: the same with omega = -kappa v.
"""

import numpy as np
import pytest
from numpy.polynomial import polynomial

from railcosim.mechanics.motion import FromOutside, Inputs, Mover
from railcosim.mechanics.ports import Layout
from railcosim.track.parameters import Fastening, Mesh, Rail, Slab, Track
from railcosim.track.receptance import Point, direct_receptance, infinite_receptance
from railcosim.track.reduced import reduce_track

K, C = 4e7, 4e4  # of the foundation per length, N/m2 and N s/m2: waves die out on the ring
AWAY = np.array([0.0, 0.05, 0.55, 1.05, 3.05])  # m from the load


def supported_rail(spacing=0.1, cells=100, damping=C, **mesh):
    """Cells of 1 m with railseats so near to each other that they are a foundation."""
    return Track(
        slab=Slab(present=False, length=1.0, joint=0),
        fastening=Fastening(stiffness=K * spacing, damping=damping * spacing, spacing=spacing),
        mesh=Mesh(cells=cells, elements_per_bay=2, **mesh),
    )


def residues(numerator, denominator, x):
    """i times the sum over poles in the upper half plane, at x >= 0; the mirror image below."""
    poles = polynomial.polyroots(denominator)
    side = np.where(x >= 0, 1, -1)[:, None]
    chosen = np.where(side * poles.imag > 0, 1.0, 0.0)
    value = polynomial.polyval(poles, numerator) / polynomial.polyval(
        poles, polynomial.polyder(denominator)
    )
    # Poles of the other side would grow beyond all numbers before they are left out.
    phase = np.exp(1j * np.where(chosen > 0, poles * x[:, None], 0))
    return (1j * side * chosen * value * phase).sum(axis=1)


def harmonic(rail, omega, x, damping=C):
    """Receptance of the infinite beam at a distance x from the force."""
    S, B = rail.shear_stiffness, rail.bending_stiffness
    on_w = np.array([K + 1j * omega * damping - omega**2 * rail.mass_per_length, 0, S])
    on_theta = np.array([S - omega**2 * rail.rotary_inertia, 0, B])
    denominator = polynomial.polymul(on_w, on_theta) - np.array([0, 0, S**2, 0, 0])
    return residues(on_theta, denominator, np.atleast_1d(x))


def moving(rail, v, xi):
    """Steady deflection at xi ahead of a unit force moving at v."""
    S, B = rail.shear_stiffness, rail.bending_stiffness
    on_w = np.array([K, -1j * v * C, S - v**2 * rail.mass_per_length])
    on_theta = np.array([S, 0, B - v**2 * rail.rotary_inertia])
    denominator = polynomial.polymul(on_w, on_theta) - np.array([0, 0, S**2, 0, 0])
    return residues(on_theta, denominator, np.atleast_1d(xi)).real


def error_at(frequency, spacing, damping=C, receptance=direct_receptance):
    """Of the receptance at all distances, relative to that under the load."""
    track = supported_rail(spacing, damping=damping)
    load = Point(x=50 + spacing / 2)  # a railseat
    omega = 2 * np.pi * np.atleast_1d(frequency)
    observed = [Point(x=load.x + d) for d in AWAY]
    R = receptance(track, omega, [load], observed)[:, :, 0]
    exact = np.array([harmonic(track.rail, w, AWAY, damping) for w in omega])
    return np.abs(R - exact) / np.abs(exact[:, :1])


def test_static_closed_form_has_the_euler_limit():
    """The closed form itself: 1 / (8 EI beta^3) for a beam stiff in shear, more with shear."""
    stiff = Rail(shear_coefficient=1, area=1e3, mass_per_length=1)
    beta = (K / (4 * stiff.bending_stiffness)) ** 0.25
    euler = 1 / (8 * stiff.bending_stiffness * beta**3)
    # Shear adds of the order beta^2 EI / kGA = 1e-6 here.
    assert harmonic(stiff, 0.0, 0.0)[0].real == pytest.approx(euler, rel=1e-5)
    # With shear: (1 + 2 a)^(-1/2) (1 + ... ) in the textbooks; here from B q^4 - a q^2 + k = 0.
    rail = Rail()
    S, B = rail.shear_stiffness, rail.bending_stiffness
    q2 = np.roots([B * S, -K * B, K * S])  # waves exp(-q x): BS q^4 - KB q^2 + KS = 0
    q = np.sqrt(q2.astype(complex))
    # w = a1 e^{-q1 x} + a2 e^{-q2 x}, theta = sum a (K - S q^2) / (S q): slope theta(0) = 0 and
    # shear force S (w' - theta) = -1/2 at x = 0+.
    turn = (K - S * q**2) / (S * q)
    a = np.linalg.solve([turn, -q - turn], [0, -0.5 / S])
    assert a.sum().real == pytest.approx(harmonic(rail, 0.0, 0.0)[0].real, rel=1e-10)  # rounding
    assert a.sum().real > 1.03 / (8 * B * (K / (4 * B)) ** 0.75)  # shear is some per cent


def test_closed_form_satisfies_the_fourier_integral():
    """The residues against the integral itself, away from the load where it converges fast."""
    rail, omega, x = Rail(), 2 * np.pi * 300, 0.7
    S, B = rail.shear_stiffness, rail.bending_stiffness
    s = K + 1j * omega * C - omega**2 * rail.mass_per_length
    j = S - omega**2 * rail.rotary_inertia
    kappa = np.linspace(0, 4000, 2_000_001)
    w = (B * kappa**2 + j) / ((S * kappa**2 + s) * (B * kappa**2 + j) - (S * kappa) ** 2)
    integral = np.trapezoid(w * np.cos(kappa * x), kappa) / np.pi
    # The tail beyond 4000 1/m is 1 / (pi S 4000^2 x) = 1e-4 of the receptance there.
    assert harmonic(rail, omega, x)[0] == pytest.approx(integral, rel=3e-4)


@pytest.mark.parametrize(
    ("frequency", "tolerance"),
    # What a wave of number kappa notices of railseats and elements grows with (kappa spacing)^2
    # and, far from the load, with the number of waves. Measured 1.3e-4, 4.0e-4, 2.3e-3 (4 for 1).
    [(0.0, 2e-4), (60.0, 2e-4), (129.4, 3e-4), (300.0, 6e-4), (500.0, 1e-3), (1000.0, 6e-3)],
)
def test_receptance_of_the_infinite_beam(frequency, tolerance):
    """0 Hz, below, at, and above the cut-on of waves, sqrt(K / m) / 2 pi = 129.3 Hz."""
    assert error_at(frequency, 0.1).max() < tolerance


def test_endless_track_without_damping_is_the_infinite_beam():
    """With a thousandth of the damping the ring of 100 m is no beam without end any more."""
    frequency, little = [0.0, 60.0, 200.0, 300.0, 500.0], 1e-3 * C
    endless = error_at(frequency, 0.1, little, infinite_receptance)
    # Railseats for a foundation, as above; 200 Hz is nearer to the cut-on, and does more.
    assert (endless.max(axis=1) < [2e-4, 2e-4, 6e-4, 6e-4, 1e-3]).all()
    ring = error_at(frequency, 0.1, little)
    assert (ring.max(axis=1)[2:] > 0.3).all()
    assert (ring.max(axis=1)[:2] < 2e-4).all()  # no waves below the cut-on


def test_railseats_become_a_foundation_with_the_square_of_their_spacing():
    frequencies = [60.0, 500.0, 1500.0]
    wide, narrow = error_at(frequencies, 0.1), error_at(frequencies, 0.05)
    order = np.log2(wide[:, 0] / narrow[:, 0])
    # Second order; a tenth is left to the next one.
    assert order == pytest.approx(2, abs=0.1)


@pytest.fixture(scope="module")
def moving_track():
    return reduce_track(supported_rail(cells=60)).under(Layout())


@pytest.mark.parametrize("v", [0.0, 100.0, 250.0, 400.0])
def test_moving_force(moving_track, v):
    """A force held constant and moved for 0.06 s, over 20 decay times 2 m / C of the rail."""
    body, duration = moving_track, 0.06
    mover = Mover(body, FromOutside(), internal_step=5e-5)
    force = np.zeros(8)
    force[0] = 1.0  # wheelset 1, left
    start = Inputs(np.array([10.0, 12.0, 14.0, 16.0]), force)
    end = Inputs(start.position + v * duration, force)
    state = mover.step(body.at(start.position).rest(force), start, end, duration)
    distance = np.array([0.0, -1.0, 0.5, 1.0])
    # Residuals are local to the wheels, so places away from the load are seen with none.
    found = body.at(end.position[0] + distance).motion(state)[:4]
    expected = moving(Rail(), v, distance)
    # Railseats for a foundation: measured 4e-4 at every speed, as in the static case.
    assert found == pytest.approx(expected, rel=8e-4)


def test_speed_deepens_the_deflection_below_the_critical_speed(moving_track):
    """The closed form used above depends on speed enough for its tolerance to see it."""
    # Euler beam without damping: 1 / sqrt(1 - (v / v_cr)^2), v_cr^4 = 4 K EI / m^2.
    rail = Rail()
    critical = (4 * K * rail.bending_stiffness / rail.mass_per_length**2) ** 0.25
    assert 700 < critical < 800
    under = np.array([moving(rail, v, 0.0)[0] for v in (0.0, 100.0, 250.0, 400.0)])
    assert np.all(np.diff(under) > 5e-3 * under[0])
    behind, ahead = moving(rail, 250.0, np.array([-1.0, 1.0]))
    assert behind > 1.1 * ahead  # damping makes the trough lag
