"""The spatial vehicle where its wheels meet rails: modes against M, C and K, wheels by hand.

Where a point of a wheel goes is found here from the cross product of rigid-body kinematics, and
what it answers from a solution in the Laplace domain: no modes, no parity.
"""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from railcosim.mechanics.motion import FromOutside, Inputs, Mover
from railcosim.mechanics.ports import DIRECTIONS, OF_WHEELS, SIDES, Layout
from railcosim.vehicle.modal import modal_form, vehicle_body
from railcosim.vehicle.multibody import SPATIAL, build_multibody
from railcosim.vehicle.parameters import (
    Geometry,
    PrimarySuspension,
    SecondarySuspension,
    Vehicle,
    Wheelset,
)
from railcosim.vehicle.train import Train, TrainVehicle

LATERAL = Vehicle(
    primary_suspension=PrimarySuspension(damping_x=3e3, damping_y=5e3),
    secondary_suspension=SecondarySuspension(damping_y=3e4, yaw_damper=4e5, roll_stiffness=9.4e5),
)
VEHICLES = {
    "paper": Vehicle(),
    "dampers": LATERAL,
    # Two alike, of equal poles, and one that runs with its rear in front.
    "train": Train(
        vehicles=(
            TrainVehicle(vehicle=Vehicle()),
            TrainVehicle(vehicle=Vehicle()),
            TrainVehicle(vehicle=LATERAL, reversed=True),
        )
    ),
}
LEVEL = Geometry(
    carbody_height=0.0, bogie_height=0.0, primary_height=0.0, wheelset_height=0.0
)  # nothing that acts along the track turns a body about y
NAMES = ("z", "y", "roll", "x", "yaw")


@pytest.fixture(scope="module", params=VEHICLES)
def multibody(request):
    return build_multibody(VEHICLES[request.param], SPATIAL)


@pytest.fixture(scope="module")
def body(multibody):
    return vehicle_body(multibody)


def by_hand(multibody):
    """Motion at all ports by the coordinates: of the point (0, s b, r0) of each wheelset."""
    rows = []
    for side, axle in product((-1.0, 1.0), multibody.axles):
        wheel = multibody.wheels[multibody.axles.index(axle)]
        point = np.array([0.0, side * wheel.half_distance, wheel.radius])
        moved = {}
        for name, turn in zip(("roll", "spin", "yaw"), np.eye(3), strict=True):
            moved[name] = np.concatenate([np.cross(turn, point), turn])
        moved["y"], moved["z"] = np.eye(6)[1], np.eye(6)[2]
        motion = np.zeros((6, len(multibody.coordinates)))  # x, y, z, roll, pitch, yaw
        for name, what in moved.items():
            motion[:, multibody.at(axle, name)] = what
        rows += [motion[k] for k in (2, 1, 3, 0, 5)]  # z, y, roll, x, yaw
    return np.array(rows)


def laplace(body, s):
    """Motions per force on the rails, (ports, ports), at a real s."""
    return body.at(np.empty(0)).compliance(1 / (s - body.poles), 1 / s**2)


def test_ports(body):
    names = [f"wheelset[2].right.wheel_{name}" for name in NAMES]
    assert [name for name in body.layout.names("wheel_{}") if "[2].right" in name] == names
    assert body.layout.sides == SIDES
    assert tuple(d.name for d in body.layout.directions) == NAMES
    assert body.layout.directions == OF_WHEELS["spatial"] == DIRECTIONS


@pytest.mark.parametrize("s", [0.3, 4.0, 60.0, 900.0])
def test_ports_in_the_laplace_domain(multibody, body, s):
    """What pushes a rail pushes a wheel the other way."""
    P, m = by_hand(multibody), multibody
    expected = -P @ np.linalg.solve(s**2 * m.M + s * m.C + m.K, P.T)
    found = laplace(body, s)
    # A metre and a radian, a newton and a newton metre are of like size here. 1e-8: `modal_form`.
    size = np.sqrt(np.abs(np.outer(np.diag(expected), np.diag(expected))))
    assert np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()
    assert (np.abs(found - expected) < 1e-6 * size).all()


def test_what_a_single_push_does_at_once(multibody, body):
    """Impulses: each of the ports' directions on one side only, to velocities everywhere."""
    P, met = by_hand(multibody), body.at(np.empty(0))
    order = [multibody.coordinates.index(name) for name in body.coordinates.names]
    for k, row in enumerate(P):
        pushed = met.drive(np.eye(body.ports)[k])
        state = body.on(np.zeros(body.layout.wheelsets))
        state.s[:], state.v[:] = pushed.s, pushed.r
        velocity = -np.linalg.solve(multibody.M, row)
        assert body.velocities(state) == pytest.approx(
            velocity[order], abs=1e-9 * np.abs(velocity).max()
        )
        assert met.velocity(state, np.ones(body.ports)) == pytest.approx(
            P @ velocity, abs=1e-9 * np.abs(P @ velocity).max()
        )
        force = body.preload + np.eye(body.ports)[k]
        still = body.on(np.zeros(body.layout.wheelsets))
        assert body.accelerations(still, force) == pytest.approx(
            velocity[order], rel=1e-12, abs=1e-12 * np.abs(velocity).max()
        )


def test_signs_of_a_wheelset(multibody, body):
    """Words of SIDES and directions, one by one: a wheelset alone is pushed, the rest is heavy."""
    wheel, axle = multibody.wheels[0], multibody.axles[0]
    b, r0 = wheel.half_distance, wheel.radius
    expected = {  # by a unit of each coordinate: left z, y, x; right z, y, x
        "z": (1, 0, 0, 1, 0, 0),
        "y": (0, 1, 0, 0, 1, 0),
        "roll": (-b, -r0, 0, b, -r0, 0),  # the right side down, what is below to the left
        "spin": (0, 0, r0, 0, 0, r0),
        "yaw": (0, 0, b, 0, 0, -b),  # the front to the right: the left wheel forward
    }
    P = by_hand(multibody).reshape(2, -1, 5, len(multibody.coordinates))[:, 0][:, [0, 1, 3]]
    for name, motion in expected.items():
        assert P[..., multibody.at(axle, name)].ravel() == pytest.approx(motion, abs=1e-12)
    # Where the right wheel alone pushes its rail down the wheelset rises: it rolls to the left.
    at = Layout(body.layout.wheelsets, directions=body.layout.directions)
    force = [float(p.name("{effort}") == "wheelset[1].right.force_z") for p in at.ports]
    turned = body.accelerations(body.on(np.zeros(at.wheelsets)), body.preload + np.array(force))
    seen = dict(zip(body.coordinates.names, turned, strict=True))
    assert seen[f"{axle}.z"] < 0
    assert seen[f"{axle}.roll"] < 0
    assert seen[f"{axle}.y"] == seen[f"{axle}.yaw"] == seen[f"{axle}.spin"] == 0


def test_halves(multibody, body):
    """Even first: modes, rigid-body coordinates, coordinates; neither moves what the other does."""
    known, n, k = body.coordinates, body.even, body.even_rigid
    assert set(known.names) == set(multibody.coordinates)
    odd = [name.rpartition(".")[2] in ("y", "roll", "yaw") for name in known.names]
    assert odd == sorted(odd)
    assert sum(odd) == len(odd) - known.even
    assert not known.modes[: known.even, n:].any()
    assert not known.modes[known.even :, :n].any()
    assert not known.rigid[: known.even, k:].any()
    assert not known.rigid[known.even :, :k].any()
    assert known.modes[known.even :, n:].any()
    assert not known.start_r[k:].any()
    assert not known.start_s[n:].any()


def test_rigid_motions():
    """Of one vehicle free in space: y, z, roll, yaw, spins, and a pitch over freely followed rails.

    Without a coordinate along the track the car body's pitch drags secondary springs, which the
    bogies' pitch undoes, and the wheelsets follow.
    """
    modal = modal_form(build_multibody(Vehicle(), SPATIAL))
    assert modal.even_rigid == 1 + 4 + 1
    assert modal.rigid.shape[1] == modal.even_rigid + 3
    assert (modal.poles.real < 1e-9 * np.abs(modal.poles)).all()  # some have no damper
    assert (modal.poles.imag == 0).any()  # overdamped ones


def test_even_and_odd_poles_that_coincide():
    """Springs alike downwards and across, and no height between anything: bounce is sway."""
    vehicle = Vehicle(
        primary_suspension=PrimarySuspension(stiffness_y=1.27e6, damping_y=65e3),
        secondary_suspension=SecondarySuspension(stiffness_y=0.27e6, damping_y=16.5e3),
        geometry=LEVEL,
    )
    multibody = build_multibody(vehicle, SPATIAL)
    modal = modal_form(multibody)  # would not reproduce M, C, K if it mixed them
    even, odd = modal.poles[: modal.even], modal.poles[modal.even :]
    apart = np.abs(even[:, None] - odd).min(axis=1) / np.abs(even)
    assert (apart < 1e-9).sum() >= 2
    body = vehicle_body(multibody)
    P, s = by_hand(multibody), 5.0
    expected = -P @ np.linalg.solve(s**2 * multibody.M + s * multibody.C + multibody.K, P.T)
    assert laplace(body, s) == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


def test_mirrored_forces_move_the_vertical_vehicle():
    """Springs along the track act on pitch through heights, which the vertical model leaves out."""
    bodies = [vehicle_body(build_multibody(Vehicle(geometry=LEVEL), *d)) for d in ((), (SPATIAL,))]
    load = np.tile([9e3, -4e3, 7e3, 1e3], 2)
    heights, h, seen = np.array([1e-4, -2e-4, 3e-4, 5e-5]), 7e-4, []
    for body in bodies:
        force = np.zeros((8, len(body.layout.directions)))
        force[:, 0] = load
        mover, state = Mover(body, FromOutside(), np.inf), body.on(heights)
        places = body.coordinates.wheelset_x
        for k in range(60):
            begin, end = (
                Inputs(places, body.preload + np.cos(40.0 * h * j) * force.ravel())
                for j in (k, k + 1)
            )
            state = mover.step(state, begin, end, h)
        moved = body.at(places).motion(state).reshape(8, -1)
        assert np.abs(moved[:, 1:]).max(initial=0) < 1e-12 * np.abs(moved).max()  # nothing aside
        names, what = body.coordinates.names, body.displacements(state)
        known = dict(zip(names, what, strict=True))
        seen.append([*moved[:, 0], *(known[n] for n in sorted(known) if n.endswith((".z", "h")))])
    vertical, spatial = map(np.array, seen)
    assert np.abs(vertical).min() > 0
    assert spatial == pytest.approx(vertical, rel=1e-9, abs=1e-9 * np.abs(vertical).max())


def test_a_vehicle_that_is_no_mirror_image_is_refused():
    multibody = build_multibody(Vehicle(), SPATIAL)
    S = np.zeros(len(multibody.coordinates))
    S[[multibody.at("carbody", "z"), multibody.at("carbody", "roll")]] = 1.0, -0.9
    S[[multibody.at("bogie[1]", "z"), multibody.at("bogie[1]", "roll")]] = -1.0, 0.9
    lopsided = replace(
        multibody, K=multibody.K + 1e4 * np.outer(S, S), stretch=np.vstack([multibody.stretch, S])
    )
    with pytest.raises(ValueError, match=r"carbody\.z and carbody\.roll .* same springs"):
        vehicle_body(lopsided)


def test_toppling_grows():
    """A free vehicle falls over, sideways once, and pitches over rails that follow; held it stands.

    Its poles that grow are no error: what the wheels stand on decides.
    """
    multibody = build_multibody(Vehicle(geometry=Geometry(toppling=True)), SPATIAL)
    modal = modal_form(multibody)
    growing = modal.poles.real > 1e-9 * np.abs(modal.poles)  # else rounding
    assert growing[modal.even :].sum() == 1
    assert not modal.poles[growing].imag.any()
    shape = np.abs(modal.modes[:, modal.even :][:, growing[modal.even :]].ravel())
    assert multibody.coordinates[int(np.argmax(shape))].rpartition(".")[2] in ("roll", "y")
    held = multibody.K[multibody.above, multibody.above]
    assert np.linalg.eigvalsh(held).min() > 0
    assert vehicle_body(multibody).poles.real.max() > 0


def test_other_radii_and_widths():
    """Of every wheelset its own."""
    vehicle = replace(Vehicle(), wheelset=Wheelset(radius=0.5))
    multibody = build_multibody(vehicle, SPATIAL)
    body, P = vehicle_body(multibody), by_hand(multibody)
    assert body.rigid_out == pytest.approx(
        P[: len(P) // 2] @ modal_form(multibody).rigid, abs=1e-12
    )
    assert multibody.wheels[0].radius == 0.5
