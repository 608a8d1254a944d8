"""Wheels that roll, in the frequency domain, against all equations of motion solved at once."""

import numpy as np
import pytest

from railcosim.analysis.response.rolling import LinearContacts
from railcosim.master.linear.receptance import FrequencyResponse
from railcosim.master.linear.substructuring import couple
from railcosim.mechanics.ports import DIMENSIONS, FORCE, OF_WHEELS, RAIL, WHEEL, Layout
from railcosim.track.parameters import Mesh, Track
from railcosim.track.receptance import Point, direct_receptance
from railcosim.vehicle.multibody import SPATIAL, build_multibody
from railcosim.vehicle.on_rails import OF_RAILS, cones_of, rolling
from railcosim.vehicle.parameters import Vehicle

BODY = build_multibody(Vehicle(), SPATIAL)
N, SPEED, CONICITY = len(BODY.coordinates), 30.0, 0.15
OMEGA = 2 * np.pi * np.array([0.3, 1.0, 2.7, 9.0, 41.0, 130.0, 700.0])
TRACK = Track(mesh=Mesh(cells=10))
WHEELS = Layout(4, directions=OF_WHEELS["spatial"])
RAILS = Layout(4, directions=DIMENSIONS["spatial"])
SIDE = {"left": -1, "right": 1}


def at_wheels(body):
    """Motions of the points of wheels by coordinates, written out."""
    b, r0 = body.wheels[0].half_distance, body.wheels[0].radius
    rows = []
    for port in WHEELS.ports:
        own = {d: np.eye(N)[body.at(f"wheelset[{port.wheelset}]", d)]
               for d in ("y", "z", "roll", "spin", "yaw")}  # fmt: skip
        out = SIDE[port.side] * b
        rows.append({
            "z": own["z"] + out * own["roll"],
            "y": own["y"] - r0 * own["roll"],
            "roll": own["roll"],
            "x": r0 * own["spin"] - out * own["yaw"],
            "yaw": own["yaw"],
        }[port.direction.name])  # fmt: skip
    return np.array(rows)


def stiffness_of(body, omega):
    """Of the free vehicle, (n_omega, n, n)."""
    s = 1j * omega[:, None, None]
    return s * s * body.M + s * body.C + body.K


def vehicle():
    W = at_wheels(BODY)
    free = np.linalg.inv(stiffness_of(BODY, OMEGA))
    return FrequencyResponse(
        name="vehicle",
        omega=OMEGA,
        outputs=(*BODY.coordinates, *WHEELS.names(WHEEL.motion)),
        inputs=WHEELS.names(FORCE),
        values=-np.vstack([np.eye(N), W]) @ free @ W.T,
    )


@pytest.fixture(scope="module")
def rails():
    x = BODY.wheelset_x - BODY.wheelset_x[-1] + 0.1
    points = [
        Point(x=float(x[p.wheelset - 1]), side=SIDE[p.side], direction=p.direction)
        for p in RAILS.ports
    ]
    return FrequencyResponse(
        name="track",
        omega=OMEGA,
        outputs=RAILS.names(RAIL.motion),
        inputs=RAILS.names(FORCE),
        values=direct_receptance(TRACK, OMEGA, points, points),
    )


@pytest.fixture(scope="module")
def contacts():
    return LinearContacts.of(BODY, cones_of(BODY, CONICITY))


def solved_at_once(rails, irregularity):
    """Vehicle, rails and contacts as one matrix: coordinates, rail motions as ports, (n_omega, m).

    The contacts are the 11 coordinates of each wheelset and its rails, not the ports.
    """
    m = len(RAILS.ports)
    at_speed = rolling(BODY, cones_of(BODY, CONICITY))(SPEED)
    D = np.zeros((OMEGA.size, N + m, N + m), complex)
    D[:, :N, :N] = stiffness_of(BODY, OMEGA)
    D[:, N:, N:] = np.linalg.inv(rails.values)
    load = np.zeros((OMEGA.size, N + m), complex)
    port = {name: k for k, name in enumerate(RAILS.names(RAIL.motion))}
    for i in range(4):
        own = [BODY.at(f"wheelset[{i + 1}]", d) for d in ("y", "z", "roll", "spin", "yaw")]
        names = [f"wheelset[{i + 1}].{name}" for name in OF_RAILS]
        at = np.array([*own, *(N + port[name] for name in names)])
        s = 1j * OMEGA[:, None, None]
        D[:, at[:, None], at] += at_speed.K[i] + s * at_speed.C[i]
        lowered = np.zeros((OMEGA.size, 11), complex)
        for k, name in enumerate(names):
            lowered[:, 5 + k] = irregularity.get(name.replace("rail_", "irregularity_"), 0.0)
        load[:, at] -= lowered @ at_speed.K[i].T
    return np.linalg.solve(D, load[..., None])[..., 0]


@pytest.mark.parametrize(
    "moved",
    [
        {"wheelset[2].left.irregularity_y": 1.0},
        {"wheelset[1].right.irregularity_z": 1.0},
        {"wheelset[1].left.irregularity_y": 0.3 - 0.1j, "wheelset[4].right.irregularity_z": 1j},
    ],
)
def test_all_motions_are_those_of_one_matrix(rails, contacts, moved):
    """With gyroscopic moments, rails that roll, creep at the speed, each rail by itself."""
    coupled = couple(vehicle(), rails, contacts.at(SPEED).joints())
    found = coupled.combined(moved, list(moved.values()))
    at_once = solved_at_once(rails, moved)
    names = [f"vehicle.{c}" for c in BODY.coordinates]
    names += [f"track.{name}" for name in RAILS.names(RAIL.motion)]
    ours = found[:, coupled.rows(names)]
    # Rounding, 1e-16, times a vehicle's receptance over the contact's, 3e5 at 0.3 Hz.
    size = np.abs(at_once).max(axis=1, keepdims=True)
    assert np.all(np.abs(ours - at_once) < 1e-10 * size)
    strong = np.abs(at_once) > 1e-2 * size
    assert np.all(np.abs(ours / at_once - 1)[strong] < 1e-9)


def test_forces_are_those_that_bodies_and_rails_balance(rails, contacts):
    """What moves the rails as they move, and what wheels need beside their turning axles."""
    coupled = couple(vehicle(), rails, contacts.at(SPEED).joints())
    moved = {"wheelset[1].left.irregularity_y": 1.0, "wheelset[3].right.irregularity_z": 0.5}
    found = coupled.combined(moved, list(moved.values()))

    def of(names):
        return found[:, coupled.rows(names)]

    motion = of(f"track.{name}" for name in RAILS.names(RAIL.motion))
    on_rails = np.linalg.solve(rails.values, motion[..., None])[..., 0]
    told = [n.replace("moment_x", "rail_moment_x") for n in RAILS.names(FORCE)]
    size = np.abs(on_rails).max(axis=1, keepdims=True)
    assert np.all(np.abs(of(told) - on_rails) < 1e-10 * size)  # rounding, as of motions

    x, on_wheels = of(f"vehicle.{c}" for c in BODY.coordinates), of(WHEELS.names(FORCE))
    left = np.einsum("wij,wj->wi", stiffness_of(BODY, OMEGA), x) + on_wheels @ at_wheels(BODY)
    momentum = BODY.M[BODY.at("wheelset[1]", "spin")].max() / BODY.wheels[0].radius * SPEED
    for i in range(4):
        roll, yaw = (BODY.at(f"wheelset[{i + 1}]", d) for d in ("roll", "yaw"))
        # A yaw turns the angular momentum of an axle that rolls forward, to the left, backward.
        left[:, roll] += 1j * OMEGA * momentum * x[:, yaw]
        left[:, yaw] -= 1j * OMEGA * momentum * x[:, roll]
    assert np.all(np.abs(left) < 1e-10 * size)
