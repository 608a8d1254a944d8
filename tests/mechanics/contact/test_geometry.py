"""Cone on circle against a search over the surfaces in space; conservation, symmetry, sides."""

import numpy as np
import pytest
from scipy.optimize import minimize

from railcosim.mechanics.contact.geometry import (
    COORDINATES,
    LEFT,
    RIGHT,
    Cone,
    TextbookCone,
    relative_pose,
)
from railcosim.mechanics.contact.numbers import derivatives
from railcosim.mechanics.contact.rolling import slip

R0, B, R = 0.43, 0.7465, 0.3
STEEL = {"shear_modulus": 2.059e11 / 2.6, "poisson_ratio": 0.3}
SIDES = np.array([LEFT, RIGHT])


def cone(kind=Cone, conicity=0.05):
    return kind(radius=R0, half_distance=B, conicity=conicity, head_radius=R, **STEEL)


def coordinates(**values):
    q = np.zeros(8)
    for name, value in values.items():
        q[COORDINATES.index(name)] = value
    return np.tile(q, (2, 1))


def random_coordinates(seed, yaw=True):
    q = np.random.default_rng(seed).normal(size=(2, 8)) * [
        3e-3, 1e-4, 2e-3, 0.1, 5e-3, 1e-3, 1e-4, 3e-3,
    ]  # fmt: skip
    q[:, 4] *= yaw
    return q


def searched(q, side, conicity):
    """Overlap and nearest point by a search over the cone, about an axle turned in space.

    The rail is a cylinder along x, so the distance that counts is that in the plane of y and z.
    """
    y, z, roll, _, yaw, rail_y, rail_z, rail_roll = q
    angle = np.arctan(conicity)
    centre = np.array([side * R * np.sin(angle), R * np.cos(angle)])
    c, s = np.cos(rail_roll), np.sin(rail_roll)
    centre = [side * B + rail_y, R0 + rail_z] + np.array([[c, -s], [s, c]]) @ centre
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    c, s = np.cos(roll), np.sin(roll)
    turn = turn @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])

    def point(where):
        out, round_ = where
        r = R0 - side * conicity * out
        at = np.array([r * np.sin(round_), side * B + out, r * np.cos(round_)])
        return turn @ at + [0, y, z]

    found = minimize(
        lambda w: np.hypot(*(point(w)[1:] - centre)), [0, 0], method="Nelder-Mead",
        options={"xatol": 1e-10, "fatol": 1e-16, "maxiter": 4000},
    )  # fmt: skip
    return R - found.fun, point(found.x) - [0, y, z], found.x


@pytest.mark.parametrize("conicity", [0.05, 0.3])
@pytest.mark.parametrize("seed", range(3))
def test_cone_on_circle_against_a_search(conicity, seed):
    q = random_coordinates(seed)
    touch = cone(conicity=conicity).touch(q, SIDES)
    for i, side in enumerate(SIDES):
        overlap, point, (out, _) = searched(q[i], side, conicity)
        # Yaw to its second order: what is left is yaw^2 times millimetres or millirad.
        assert touch.compression[i] == pytest.approx(overlap, abs=2e-3 * q[i, 4] ** 2 + 1e-12)
        # So is the place: b yaw^2; 1e-6 m is what a search finds where the overlap is flat.
        near = B * q[i, 4] ** 2 + 1e-6
        assert touch.y[i] == pytest.approx(side * B + out, abs=near)
        assert touch.radius[i] == pytest.approx(R0 - side * conicity * out, abs=conicity * near)
        # The contact goes where the axle takes it, and forward on the cone.
        ahead = -(touch.y[i] - touch.radius[i] * np.tan(touch.slope[i])) * q[i, 4]
        assert ahead == pytest.approx(point[0], rel=0.03)


@pytest.mark.parametrize("kind", [Cone, TextbookCone])
def test_gradient_is_the_derivative_of_the_compression(kind):
    geometry, q = cone(kind), random_coordinates(5)
    by = derivatives(lambda x: geometry.touch(x, SIDES).compression[..., None], q)[:, 0]
    assert geometry.touch(q, SIDES).gradient == pytest.approx(by, abs=1e-14)


def test_complex_step_against_differences():
    """The tool of all tangents, on the one formula that matters."""
    geometry, q, h = cone(), random_coordinates(6), 1e-6
    by = derivatives(lambda x: geometry.touch(x, SIDES).radius[..., None], q)[:, 0]
    for j in range(8):
        step = h * np.eye(8)[j]
        ahead, behind = (geometry.touch(q + s * step, SIDES).radius for s in (1, -1))
        assert by[:, j] == pytest.approx((ahead - behind) / (2 * h), abs=1e-9)  # rounding / h


def moved_together(q, dy, dz, turn):
    """Wheelset and rails as one rigid body, about the wheelset's designed centre."""
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s], [s, c]])
    there = q.copy()
    for i, side in enumerate(SIDES):
        for at, home in ((slice(0, 2), np.zeros(2)), (slice(5, 7), np.array([side * B, R0]))):
            there[i, at] = rotation @ (q[i, at] + home) - home + [dy, dz]
    there[:, [2, 7]] += turn
    return there


def test_a_rigid_motion_of_wheelset_and_rails_presses_nothing():
    geometry, q = cone(), random_coordinates(7, yaw=False)
    here, there = (geometry.touch(x, SIDES) for x in (q, moved_together(q, 2e-3, -1e-3, 4e-3)))
    assert there.compression == pytest.approx(here.compression, abs=1e-15)
    assert there.radius == pytest.approx(here.radius, abs=1e-15)


def test_mirrored_motions_make_mirrored_contacts():
    """A wheelset to the right with a roll is the mirror image of one to the left."""
    q = random_coordinates(8)
    odd = np.array([-1, 1, -1, 1, -1, -1, 1, -1])
    one, other = cone().touch(q, SIDES), cone().touch(odd * q[::-1], SIDES)
    assert one.compression == pytest.approx(other.compression[::-1], rel=1e-12)
    assert one.radius == pytest.approx(other.radius[::-1], rel=1e-14)
    assert one.slope == pytest.approx(-other.slope[::-1], rel=1e-14)
    assert one.gradient == pytest.approx(odd * other.gradient[::-1], abs=1e-14)


def test_sides():
    """To the right: the right wheel rolls on a greater radius, and is pressed to the left."""
    touch = cone().touch(coordinates(y=3e-3), SIDES)
    assert touch.radius[1] - R0 == pytest.approx(0.05 * 3e-3, rel=3e-3)  # lambda^2 = 0.0025
    assert touch.radius[0] - R0 == pytest.approx(-0.05 * 3e-3, rel=3e-3)
    assert touch.compression[1] > 0 > touch.compression[0]
    push = -touch.gradient[:, 0]  # of the wheel, per normal force
    assert push == pytest.approx([0.05, -0.05], rel=2e-3)
    assert -touch.gradient[:, 1] == pytest.approx(-1, rel=2e-3)  # upwards


def test_a_rolling_rail_takes_the_contact_along_its_circle():
    """Rolled by phi, the head's circle moves by R phi, and the contact with it, not with a point
    of the head."""
    roll = 2e-3
    touch = cone().touch(coordinates(rail_roll=roll), SIDES)
    assert touch.y - SIDES * B == pytest.approx(-R * roll, rel=3e-3)
    assert touch.radius - R0 == pytest.approx(SIDES * 0.05 * R * roll, rel=3e-3)


def test_slip_is_the_motion_of_material_points():
    """J and rolling against velocities of points, by cross products in space."""
    q, v, speed = random_coordinates(9), random_coordinates(10) * 10, 40.0
    touch = cone().touch(q, SIDES)
    slides = slip(touch, q, R0)
    found = np.einsum("nij,nj->ni", slides.J, v) + speed * slides.rolling
    for i in range(2):
        roll, yaw = q[i, 2], q[i, 4]
        axle = np.array([-yaw, np.cos(roll), np.sin(roll)])
        x = -(touch.y[i] - touch.radius[i] * np.tan(touch.slope[i])) * yaw
        c, s = np.cos(roll), np.sin(roll)
        r = np.array(
            [x, c * touch.y[i] - s * touch.radius[i], s * touch.y[i] + c * touch.radius[i]]
        )
        omega = (v[i, 3] - speed / R0) * axle + [v[i, 2], 0, v[i, 4]]
        wheel = np.array([speed, v[i, 0], v[i, 1]]) + np.cross(omega, r)
        arm = np.array([0, touch.rail_y[i], touch.rail_z[i]])
        rail = np.array([0, v[i, 5], v[i, 6]]) + np.cross([v[i, 7], 0, 0], arm)
        alpha = touch.slope[i] - roll
        normal, across = (
            np.array([0, np.sin(alpha), np.cos(alpha)]),
            np.array([0, np.cos(alpha), -np.sin(alpha)]),
        )
        assert np.cross([1, 0, 0], across) == pytest.approx(normal)  # right-handed
        expected = [(wheel - rail)[0], (wheel - rail) @ across, (omega - [v[i, 7], 0, 0]) @ normal]
        # The point ahead is of first order in yaw: speed / r0 yaw^2 times half a metre, at most.
        assert found[i] == pytest.approx(expected, rel=1e-9, abs=speed * yaw**2)
        # A wheelset that only rolls does not dig into the rail, to the same order.
        assert (speed * np.eye(3)[0] - speed / R0 * np.cross(axle, r)) @ normal == pytest.approx(
            0, abs=speed * abs(yaw) * (abs(yaw) + abs(roll)) * 2
        )


def test_no_slip_if_wheelset_and_rails_move_together():
    q = random_coordinates(11, yaw=False)
    J = slip(cone().touch(q, SIDES), q, R0).J
    h = 1e-6
    for way in np.eye(3):
        moved = [moved_together(q, *(s * h * way)) for s in (1, -1)]
        rate = (moved[0] - moved[1]) / (2 * h)
        assert np.einsum("nij,nj->ni", J, rate)[:, :2] == pytest.approx(0, abs=1e-8)


def test_pose_of_a_wheel():
    """By rotation matrices, with angles that are not small."""
    q = random_coordinates(12) * 100
    pose = relative_pose(q, SIDES * B, R0)
    for i, side in enumerate(SIDES):

        def turn(phi):
            return np.array([[np.cos(phi), -np.sin(phi)], [np.sin(phi), np.cos(phi)]])

        point = q[i, :2] + turn(q[i, 2]) @ [side * B, R0]
        datum = q[i, 5:7] + [side * B, R0]
        assert [pose.y[i], pose.z[i]] == pytest.approx(turn(-q[i, 7]) @ (point - datum))
