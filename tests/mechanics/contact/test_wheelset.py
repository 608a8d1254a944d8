"""Wheelset on rails: K and C against differences, closed forms of the textbooks, and Klingel."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.linalg import eig

from railcosim.mechanics.contact.creep import LinearCreep
from railcosim.mechanics.contact.geometry import COORDINATES, LEFT, RIGHT, Cone, TextbookCone
from railcosim.mechanics.contact.rolling import Flange, RollingContact
from railcosim.mechanics.contact.wheelset import NAMES, at_rest, linear_wheelset, selection

R0, B, R, LAMBDA = 0.43, 0.7465, 0.3, 0.05
LOAD, SPEED = 79265.0, 40.0
CONE = Cone(
    radius=R0, half_distance=B, conicity=LAMBDA, head_radius=R,
    shear_modulus=2.059e11 / 2.6, poisson_ratio=0.3,
)  # fmt: skip
TEXTBOOK = TextbookCone(**{name: getattr(CONE, name) for name in CONE.__dataclass_fields__})
BOTH = pytest.mark.parametrize("geometry", [CONE, TEXTBOOK], ids=["normals", "textbook"])
SIDES = np.array([LEFT, RIGHT])
Y, Z, ROLL, SPIN, YAW = range(5)
PSI = YAW


@dataclass(frozen=True)
class Scaled:
    """Linear creep, so many times as stiff."""

    factor: float

    def force(self, patch, normal, creepage):
        return self.factor * LinearCreep().force(patch, normal, creepage)


NO_CREEP = Scaled(0.0)


def coefficients():
    return CONE.patch.creep_coefficients(np.array(LOAD))


@BOTH
def test_matrices_against_differences(geometry):
    """Central differences of the nonlinear forces, h^2 of 1e-9 m or rad."""
    found = linear_wheelset(geometry, speed=SPEED, load=LOAD)
    law = RollingContact(geometry=geometry, side=SIDES, speed=SPEED)
    S = selection()

    def forces(x, v):
        q = found.rest + np.einsum("nij,j->ni", S, x)
        return np.einsum("ni,nij->j", law.force(q, np.einsum("nij,j->ni", S, v)), S)

    none, h = np.zeros(11), 1e-8
    for j in range(11):
        step = h * np.eye(11)[j]
        by_q = (forces(step, none) - forces(-step, none)) / (2 * h)
        by_v = (forces(none, step) - forces(none, -step)) / (2 * h)
        # Rounding: 1e-15 of the load over 1e-8 is 1e-2 N/m; (h / 9e-5 m)^2 of 1e9 N/m is 12.
        assert -found.K[:, j] == pytest.approx(by_q, rel=1e-6, abs=30)
        assert -found.C[:, j] == pytest.approx(by_v, rel=1e-6, abs=0.1)


@BOTH
def test_rest(geometry):
    rest = at_rest(RollingContact(geometry=geometry, side=SIDES, speed=SPEED), LOAD)
    law = RollingContact(geometry=geometry, side=SIDES, speed=SPEED)
    force = law.force(rest, np.zeros((2, 8)))
    assert force[:, COORDINATES.index("rail_z")] == pytest.approx(LOAD, rel=1e-12)
    assert force[:, Z] == pytest.approx(-LOAD, rel=1e-12)
    total = np.einsum("ni,nij->j", force, selection())
    assert total[[Y, ROLL, YAW]] == pytest.approx(0, abs=1e-7)  # rounding of the load
    assert np.count_nonzero(rest[:, [Y, SPIN, YAW, 5, 6, 7]]) == 0


@BOTH
def test_creep_as_in_the_textbooks(geometry):
    """Wickens 2003, eqs of a single wheelset, without what is of higher order in conicity."""
    found = linear_wheelset(geometry, speed=SPEED, load=LOAD)
    f11, f22, _, f33 = coefficients()
    # Less creep altogether: only what it adds.
    without = linear_wheelset(geometry, speed=SPEED, load=LOAD, creep=NO_CREEP)
    K, C = found.K - without.K, found.C
    few = 6e-3  # lambda^2 is 0.0025; the load is taken along the normals
    assert C[Y, Y] == pytest.approx(2 * f22 / SPEED, rel=few)
    assert C[YAW, YAW] == pytest.approx(2 * (f11 * B**2 + f33) / SPEED, rel=few)
    assert K[Y, YAW] == pytest.approx(-2 * f22, rel=few)
    assert K[YAW, Y] == pytest.approx(2 * f11 * LAMBDA * B / R0, rel=0.02)  # and -2 f23 lambda..
    assert C[YAW, Y] == pytest.approx(-C[Y, YAW], rel=1e-6)
    assert C[SPIN, SPIN] == pytest.approx(2 * f11 * R0**2 / SPEED, rel=few)
    assert C[Y, ROLL] == pytest.approx(-2 * f22 * (R0 + LAMBDA * B) / SPEED, rel=few)  # inclined
    # Of spin: positive yaw rate is positive spin, which pushes to the left.
    assert C[Y, YAW] > 0


def test_gravity_stiffness_of_the_textbook():
    """Eqs 4 and 5: W lambda / b and -W lambda b, W the axle load; against the rails' middle."""
    K = linear_wheelset(TEXTBOOK, speed=SPEED, load=LOAD, creep=NO_CREEP).K
    W = 2 * LOAD
    assert K[Y, Y] == pytest.approx(W * LAMBDA / B, rel=1e-9)
    assert K[YAW, YAW] == pytest.approx(-W * LAMBDA * B, rel=1e-9)
    rails = [NAMES.index("left.rail_y"), NAMES.index("right.rail_y")]
    assert K[Y, rails] == pytest.approx(-W * LAMBDA / (2 * B), rel=1e-9)


def condensed(K):
    """Stiffness across of a wheelset that goes down and rolls as it must."""
    return K[Y, Y] - K[Y, [Z, ROLL]] @ np.linalg.solve(
        K[np.ix_([Z, ROLL], [Z, ROLL])], K[[Z, ROLL], Y]
    )


def test_gravity_stiffness_of_springs_along_normals():
    """2.11 times the textbook's across, with the load that goes from wheel to wheel.

    By a rigid wheelset on rigid circles, as a plane linkage (by hand below): the axle load stays in
    the middle, and the wheelset goes up where potential energy grows.
    """
    K = linear_wheelset(CONE, speed=SPEED, load=LOAD, creep=NO_CREEP).K
    found = condensed(K)
    assert found / (2 * LOAD * LAMBDA / B) == pytest.approx(2.11, abs=0.005)

    # Both compressions stay what they are: z and roll by y, then energy -W z.
    rest = linear_wheelset(CONE, speed=SPEED, load=LOAD, creep=NO_CREEP).rest

    def height(y):
        x = np.zeros(2)
        for _ in range(30):
            q = rest.copy()
            q[:, Y] += y
            q[:, [Z, ROLL]] += x
            touch = CONE.touch(q, SIDES)
            short = CONE.touch(rest, SIDES).compression - touch.compression
            x = x + np.linalg.solve(touch.gradient[:, [Z, ROLL]], short)
        return -x[0]

    h = 1e-3
    curvature = (height(h) - 2 * height(0) + height(-h)) / h**2
    # Rigid against Hertz springs: K_gy over k_H lambda^2, a few thousandths.
    assert found == pytest.approx(2 * LOAD * curvature, rel=5e-3)


def test_yaw_is_driven_on():
    """-W lambda b by the contacts' places, less what they go forward on the cones."""
    K = linear_wheelset(CONE, speed=SPEED, load=LOAD, creep=NO_CREEP).K
    expected = -2 * LOAD * LAMBDA * (B - R0 * LAMBDA)
    assert K[YAW, YAW] == pytest.approx(expected, rel=1e-9)


@BOTH
def test_contacts_without_creep_are_conservative(geometry):
    found = linear_wheelset(geometry, speed=SPEED, load=LOAD, creep=NO_CREEP)
    assert pytest.approx(found.K.T, abs=1e-3) == found.K  # rounding of 1e9 N/m
    assert np.count_nonzero(found.C) == 0


def test_wheelset_and_rails_together_feel_nothing():
    """Forces are between them: moved as one, nothing changes; and action is reaction."""
    found = linear_wheelset(CONE, speed=SPEED, load=LOAD)
    for name in ("y", "z"):
        together = np.array([float(n == name or n.endswith(f"rail_{name}")) for n in NAMES])
        assert found.C @ together == pytest.approx(0, abs=1e-6)
        assert together @ found.C == pytest.approx(0, abs=1e-6)
        assert found.K @ together == pytest.approx(0, abs=1e-3)
        assert together @ found.K == pytest.approx(0, abs=1e-3)


def test_mirror():
    """What is even does not couple with what is odd."""
    found = linear_wheelset(CONE, speed=SPEED, load=LOAD)
    P = np.zeros((11, 11))
    signs = [-1, 1, -1, 1, -1]
    P[range(5), range(5)] = signs
    for i, sign in enumerate((-1, 1, -1)):
        P[5 + i, 8 + i] = P[8 + i, 5 + i] = sign
    assert pytest.approx(found.K, abs=1e-2) == P @ found.K @ P
    assert pytest.approx(found.C, abs=1e-6) == P @ found.C @ P


def rolling_wavelength(geometry, creep):
    """Of a wheelset without mass on rigid rails: (C s + K) q = 0."""
    found = linear_wheelset(geometry, speed=SPEED, load=LOAD, creep=creep)
    odd = [Y, ROLL, YAW]
    values = eig(-found.K[np.ix_(odd, odd)], found.C[np.ix_(odd, odd)], right=False)
    s = values[np.abs(values.imag) > 0]
    assert s.size == 2
    return 2 * np.pi * SPEED / np.abs(s[0].imag), s[0].real / np.abs(s[0])


@pytest.mark.parametrize(("head_radius", "conicity"), [(0.05, 0.02), (0.3, 0.02), (0.3, 0.1)])
def test_klingel(head_radius, conicity):
    """2 pi sqrt(b r0 / (lambda (1 + R lambda / b))): the head's circle makes the cone steeper."""
    geometry = replace(CONE, conicity=conicity, head_radius=head_radius)
    found, growth = rolling_wavelength(geometry, LinearCreep())
    expected = 2 * np.pi * np.sqrt(B * R0 / (conicity * (1 + head_radius * conicity / B)))
    # Gravity over creep, W lambda / b over 2 f22 times the wavenumber: 1e-3; slopes squared, and
    # the wheelset's roll times r0 / b.
    assert found == pytest.approx(expected, rel=0.01)
    assert abs(growth) < 0.01


def test_force_on_a_wheel_by_side():
    """A wheelset held to the right is steered to the left: the right wheel is pushed forward."""
    law = RollingContact(geometry=CONE, side=SIDES, speed=SPEED)
    q = at_rest(law, LOAD)
    q[:, Y] = 1e-3
    creepage, force = law.creep_forces(q, np.zeros((2, 8)))
    assert creepage[1, 0] < 0 < creepage[0, 0]  # the greater wheel turns too fast for its way
    assert force[1, 0] > 0 > force[0, 0]
    total = np.einsum("ni,nij->j", law.force(q, np.zeros((2, 8))), selection())
    assert total[YAW] < 0  # to the left


def test_flange_stops_the_wheel_that_goes_outwards():
    flange = Flange(stiffness=1e7, clearance=6e-3, depth=0.014)
    q = np.zeros((2, 8))
    q[:, Y] = 8e-3
    force = flange.force(q, SIDES, R0)
    assert np.count_nonzero(force[0]) == 0
    assert force[1, Y] == pytest.approx(-1e7 * 2e-3)
    assert force[1, 5] == pytest.approx(1e7 * 2e-3)  # the rail is pushed outwards
    assert force[1, ROLL] == pytest.approx(1e7 * 2e-3 * (R0 + 0.014))  # below the axle, to the left
    assert force[1, 7] == pytest.approx(-1e7 * 2e-3 * 0.014)  # below the datum
    assert np.count_nonzero(flange.force(-q, SIDES, R0)[0]) == 4


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan])
def test_creep_needs_a_speed(speed):
    with pytest.raises(ValueError, match="must be above 0"):
        linear_wheelset(CONE, speed=speed, load=LOAD)


@pytest.mark.parametrize("load", [0.0, -1.0, np.nan])
def test_a_wheelset_needs_a_load(load):
    with pytest.raises(ValueError, match="wheel load"):
        linear_wheelset(CONE, speed=SPEED, load=load)


@pytest.mark.parametrize("load", [10.0, 1e6])
def test_rest_under_any_load(load):
    rest = linear_wheelset(CONE, speed=SPEED, load=load).rest
    force = RollingContact(geometry=CONE, side=SIDES, speed=SPEED).force(rest, 0 * rest)
    assert force[:, COORDINATES.index("rail_z")] == pytest.approx(load, rel=1e-11)
