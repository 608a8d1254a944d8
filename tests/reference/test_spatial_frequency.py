"""The monolithic system in space against receptances, the vertical system, symmetry and statics."""

from dataclasses import replace

import numpy as np
import pytest

from railcosim.mechanics.contact.geometry import LEFT, RIGHT
from railcosim.mechanics.contact.rolling import RollingContact
from railcosim.mechanics.contact.wheelset import at_rest
from railcosim.mechanics.law import LinearContact
from railcosim.mechanics.ports import ROLL, Y, Z
from railcosim.reference.contacts import LinearRolling, Pressing, Rolling
from railcosim.reference.frequency import frequency_response, linearised
from railcosim.reference.monolithic import assemble
from railcosim.reference.slabs import slabs_of
from railcosim.track.parameters import Fastening, Mesh, Rail, Slab, Track
from railcosim.track.receptance import Point, direct_receptance
from railcosim.vehicle.multibody import SPATIAL, VERTICAL, build_multibody
from railcosim.vehicle.on_rails import cones_of, creeping, rolling, standing
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.properties import Geometry

pytestmark = pytest.mark.filterwarnings("ignore::railcosim.track.decay.RingWarning")

DIRECTIONS = (Z, Y, ROLL)
MESH = Mesh(cells=4, elements_per_bay=4, highest_slab_frequency=300)
TRACK = Track(mesh=MESH)
# Nothing is symmetric: every direction moves every other one.
TILTED = Track(
    mesh=MESH,
    slab=Slab(tilts_rails=True),
    rail=Rail(shear_centre_depth=0.033, warping_constant=2e-8, loss_factor=0.03),
    fastening=Fastening(loss_factor=0.2),
)
POSITION = np.array([18.75, 16.25, 2.65625, 0.3125])  # nodes: midspan, between, a railseat
OMEGA = 2 * np.pi * np.array([0.7, 3.0, 31.0, 93.0, 515.0, 1058.0])
VEHICLE = Vehicle()
SPEED = 20.0


def apart(mono):
    """Vehicle and track that do not meet."""
    return linearised(mono, Pressing(LinearContact(k_H=0.0)), POSITION)


@pytest.mark.parametrize("track", [TRACK, TILTED, replace(TRACK, slab=Slab(present=False))])
def test_rails_against_bloch_waves_of_half_a_track(track):
    """Every direction by every other, both rails: neither parity nor waves on one side."""
    mono = assemble(VEHICLE, track, POSITION, SPATIAL)
    rails = mono.rails(POSITION).toarray()
    found = rails @ frequency_response(mono, OMEGA, apart(mono), rails.T)
    points = [
        Point(x=x, side=side, direction=direction)
        for side in (-1, 1) for x in POSITION for direction in DIRECTIONS
    ]  # fmt: skip
    expected = direct_receptance(track, OMEGA, points, points)
    for i in range(3):
        for j in range(3):
            one, other = (R[:, i::3, j::3] for R in (found, expected))
            # Rounding, times the condition of a resonant matrix.
            assert np.abs(one - other).max() <= 1e-10 * np.abs(other).max()
    if track is TILTED:
        assert np.all(expected != 0)


def by_receptances(track, contacts):
    """Coupled motions and forces on rails per irregularity, from the vehicle's own matrices and
    receptances of the track: rails move by what they are given, R f."""
    body = build_multibody(VEHICLE, SPATIAL)
    n = len(body.coordinates)
    # In the order of NAMES: y, z, roll of the left rail, then of the right one, by wheelsets.
    points = [
        Point(x=x, side=side, direction=direction)
        for x in POSITION for side in (-1, 1) for direction in (Y, Z, ROLL)
    ]  # fmt: skip
    R = direct_receptance(track, OMEGA, points, points)
    K, C = contacts.with_rails(body)
    x, force = [], []
    for w, R_w in zip(OMEGA, R, strict=True):
        D = K + 1j * w * C
        D[:n, :n] += body.K + 1j * w * body.C - w**2 * body.M
        D[n:, n:] += np.linalg.inv(R_w)
        rough = [
            n + 6 * i + 3 * side + at
            for side in (0, 1) for i in range(4) for at in (1, 0)  # down, to the right
        ]  # fmt: skip
        moved = np.linalg.solve(D, -K[:, rough].astype(complex))
        x.append(moved)
        force.append(np.linalg.solve(R_w, moved[n:]))
    return np.array(x), np.array(force), n


@pytest.mark.parametrize("track", [TRACK, TILTED])
def test_coupled_response_at_a_speed_against_receptances(track):
    """Motions and forces by irregularities of each wheel, down and to the right."""
    body = build_multibody(VEHICLE, SPATIAL)
    contacts = rolling(body, cones_of(body, 0.05))(SPEED)
    x, force, n = by_receptances(track, contacts)
    mono = assemble(VEHICLE, track, POSITION, SPATIAL)
    linear = linearised(mono, LinearRolling(contacts), POSITION)
    solved = frequency_response(mono, OMEGA, linear, linear.loads)
    assert np.abs(solved[:, :n] - x[:, :n]).max() <= 1e-8 * np.abs(x[:, :n]).max()
    # Ports are z, y, roll, left ones first.
    order = [
        6 * i + 3 * side + at for side in (0, 1) for i in range(4) for at in (1, 0, 2)
    ]  # fmt: skip
    rails = mono.rails(POSITION) @ solved.transpose(1, 0, 2).reshape(solved.shape[1], -1)
    rails = rails.reshape(24, len(OMEGA), 16).transpose(1, 0, 2)
    found = linear.forces(OMEGA, solved, np.eye(16))
    for at in range(3):
        for one, other in ((rails, x[:, n:]), (found, force)):
            expected = other[:, order][:, at::3]
            # Of each quantity: rounding of an inverse of receptances, 1e4 in condition.
            assert np.abs(one[:, at::3] - expected).max() <= 1e-8 * np.abs(expected).max()


# k_px and k_sx act on pitch through heights, which the vertical model leaves out.
LEVEL = Vehicle(geometry=Geometry(carbody_height=0.0, bogie_height=0.0, wheelset_height=0.0))


def both_rails(values):
    """The same of the left and the right contact of each wheelset, (contacts, n_wheelsets)."""
    return np.tile(np.eye(4) * values, (2, 1))


def vertical_answers():
    """Displacements and contact forces by irregularities, alike on both rails."""
    body = build_multibody(LEVEL, VERTICAL)
    wheels = zip(body.wheels, body.wheel_load, strict=True)
    k_H = np.tile([wheel.patch.ellipse.stiffness(load) for wheel, load in wheels], 2)
    mono = assemble(LEVEL, TRACK, POSITION)
    linear = linearised(mono, Pressing(LinearContact(k_H=k_H)), POSITION)
    rough = both_rails(1.0)
    x = frequency_response(mono, OMEGA, linear, linear.loads @ rough)
    return mono, x, linear.forces(OMEGA, x, rough)


def contacts_of_cylinders(body):
    """Wheels without conicity: down they know nothing of creep."""
    return rolling(body, cones_of(body, 0.0))(SPEED)


@pytest.mark.parametrize("contacts", [standing, contacts_of_cylinders])
def test_mirrored_excitation_gives_the_vertical_answers(contacts):
    mono, x, force = vertical_answers()
    space = assemble(LEVEL, TRACK, POSITION, SPATIAL)
    linear = linearised(space, LinearRolling(contacts(space.body)), POSITION)
    rough = np.kron(both_rails(1.0), [[1.0], [0.0]])
    found = frequency_response(space, OMEGA, linear, linear.loads @ rough)
    for j, name in enumerate(mono.body.coordinates):
        one, other = found[:, space.coordinate(name)], x[:, j]
        assert np.abs(one - other).max() <= 1e-9 * np.abs(x[:, : len(mono.body.coordinates)]).max()
    pushed = linear.forces(OMEGA, found, rough)
    assert np.abs(pushed[:, ::3] - force).max() <= 1e-9 * np.abs(force).max()
    assert np.abs(pushed[:, 1::3]).max() <= 1e-9 * np.abs(force).max()
    rail, same = (
        (m.rails(POSITION)[:: len(m.directions)] @ by[0]) for m, by in ((space, found), (mono, x))
    )
    assert np.abs(rail - same).max() <= 1e-9 * np.abs(same).max()


def test_opposite_irregularities_move_nothing_of_the_vertical_system():
    """Cross-level alone: down, every body stays; and what is mirrored changes its sign."""
    space = assemble(VEHICLE, TILTED, POSITION, SPATIAL)
    contacts = rolling(space.body, cones_of(space.body, 0.05))(SPEED)
    linear = linearised(space, LinearRolling(contacts), POSITION)
    # Left up and right down; then both to the right: each its mirror image's opposite.
    odd = np.zeros((16, 2))
    odd[0, 0], odd[8, 0], odd[1, 1], odd[9, 1] = -1.0, 1.0, 1.0, 1.0
    x = frequency_response(space, OMEGA, linear, linear.loads @ odd)
    size = np.abs(x[:, : len(space.body.coordinates)]).max()
    for name in space.body.coordinates:
        even = name.endswith((".z", ".pitch", ".spin"))
        largest = np.abs(x[:, space.coordinate(name)]).max()
        assert (largest <= 1e-9 * size) == even
    force = linear.forces(OMEGA, x, odd).reshape(len(OMEGA), 2, 4, 3, 2)
    mirror = np.array([d.mirror for d in DIRECTIONS])[:, None]
    assert np.abs(force[:, 1] + mirror * force[:, 0]).max() <= 1e-9 * np.abs(force).max()


def test_a_wheelset_moved_aside_with_its_rails_feels_nothing():
    """All rails moved alike, to the right or down, far below every resonance: all follow."""
    space = assemble(VEHICLE, TRACK, POSITION, SPATIAL)
    contacts = LinearRolling(creeping(space.body, cones_of(space.body, 0.05)))
    linear = linearised(space, contacts, POSITION)
    together = np.tile(np.eye(2), (8, 1))
    x = frequency_response(space, np.array([1e-4]), linear, linear.loads @ together)[0]
    for axle in space.body.axles:
        # To second order of 1e-4 rad/s over that of the softest mode, and c w/k.
        assert x[space.coordinate(f"{axle}.z")] == pytest.approx([1.0, 0.0], abs=1e-3)
        assert x[space.coordinate(f"{axle}.y")] == pytest.approx([0.0, 1.0], abs=1e-3)


def test_the_rolling_law_about_rest_is_the_linear_one():
    """Eight coordinates a contact from the law itself, eleven a wheelset from `on_rails`."""
    space = assemble(VEHICLE, TRACK, POSITION, SPATIAL)
    cone = cones_of(space.body, 0.05)[0]
    law = RollingContact(geometry=cone, side=np.repeat([LEFT, RIGHT], 4), speed=SPEED)
    load = float(space.body.wheel_load[0])
    one = at_rest(replace(law, side=np.array([LEFT, RIGHT])), load)
    rest = np.repeat(one, 4, axis=0)
    motion = np.concatenate([rest, np.zeros_like(rest)], axis=1)
    linear = linearised(space, Rolling(law), POSITION, motion)
    slow = creeping(space.body, cones_of(space.body, 0.05))
    expected = linearised(
        space, LinearRolling(replace(slow, C=slow.C / SPEED)), POSITION
    )  # fmt: skip
    for one, other in (
        (linear.rows.T @ linear.K @ linear.rows, expected.rows.T @ expected.K @ expected.rows),
        (linear.rows.T @ linear.C @ linear.rows, expected.rows.T @ expected.C @ expected.rows),
        (linear.loads, expected.loads),
    ):
        difference = abs(one - other).max()
        assert difference <= 1e-12 * abs(other).max()
    x = frequency_response(space, OMEGA[:2], linear, linear.loads)
    one, other = (made.forces(OMEGA[:2], x, np.eye(16)) for made in (linear, expected))
    assert np.abs(one - other).max() <= 1e-8 * np.abs(other).max()


def test_static_stiffness_to_the_right_with_everything_in_series():
    """By hand: stiff rails shift and roll on all fastenings, on slabs that shift on their layer."""
    track = Track(mesh=MESH, rail=Rail(young_modulus=2e17, torsional_rigidity=1.9587e11))
    mono = assemble(VEHICLE, track, POSITION, SPATIAL)
    quarters = np.array([0.3125, 5.3125, 10.3125, 15.3125])  # by symmetry all bodies move alike
    rails = mono.rails(quarters).toarray()
    load = rails[1::3].sum(axis=0)[:, None]
    x = frequency_response(mono, np.array([1e-3]), apart(mono), load)[0, :, 0]
    rail, fastening, slab = track.rail, track.fastening, track.slab
    seats, area = 4 * 8, 4 * slab.length * slab.width
    arm = rail.head_height + rail.centroid_height
    roll = arm * 4 / (seats * fastening.roll_stiffness)
    aside = 4 / (seats * fastening.stiffness_lateral) + 8 / (
        area * track.foundation.stiffness_lateral
    )
    # 1e-6 for what rails of 1e6 times the stiffness give.
    assert rails[2::3] @ x == pytest.approx(np.full(8, roll), rel=1e-4)
    assert rails[1::3] @ x == pytest.approx(np.full(8, aside + arm * roll), rel=1e-4)
    assert rails[0::3] @ x == pytest.approx(np.zeros(8), abs=1e-12 * aside)


def test_slabs_yaw_on_their_layer():
    """By hand: one free slab under a couple of lateral forces, on a layer that shears alike along
    and across: k (L^2 + W^2) / 12 times its area."""
    slabs = slabs_of(TRACK, DIRECTIONS)
    M, C, K = (d[-2:] for d in slabs.diagonals)
    slab, ground = TRACK.slab, TRACK.foundation
    x, y = np.meshgrid(
        (np.arange(400) + 0.5) / 400 * slab.length - slab.length / 2,
        (np.arange(200) + 0.5) / 200 * slab.width - slab.width / 2,
    )
    area = slab.length * slab.width
    second = np.mean(x**2 + y**2) * area
    for of, per_area in (
        (M, slab.mass_per_area), (C, ground.damping_lateral), (K, ground.stiffness_lateral)
    ):  # fmt: skip
        # A sum over 400 x 200 points: 1 / 200^2.
        assert of == pytest.approx(per_area * np.array([area, second]), rel=1e-4)
    assert slabs.motion(Y, np.array([2.0]), np.array([0.7]))[0, -2:] == pytest.approx([1.0, 2.0])
