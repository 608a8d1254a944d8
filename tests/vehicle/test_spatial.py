"""The vehicle in space, against energies of turned bodies and mechanics by hand."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from railcosim.parameters import ParameterError
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.modal import modal_form
from railcosim.vehicle.multibody import SPATIAL, VERTICAL, build_multibody
from railcosim.vehicle.parameters import (
    CarBody,
    Geometry,
    PrimarySuspension,
    SecondarySuspension,
    Vehicle,
)
from railcosim.vehicle.train import Train, TrainVehicle

VEHICLE = Vehicle()
BODY = build_multibody(VEHICLE, SPATIAL)
# Everything there is, no two numbers alike.
FULL = Vehicle(
    primary_suspension=PrimarySuspension(
        stiffness=1.2e6, stiffness_x=3.1e6, stiffness_y=3.9e6,
        damping=4e3, damping_x=15e3, damping_y=2e3, half_span=1.02,
    ),
    secondary_suspension=SecondarySuspension(
        stiffness=0.43e6, stiffness_x=0.15e6, stiffness_y=0.17e6,
        damping=20e3, damping_x=3e3, damping_y=32e3, half_span=0.96,
        roll_stiffness=0.94e6, yaw_damper=2.5e5, yaw_damper_half_span=1.4, stop_stiffness=5e4,
    ),
    geometry=Geometry(
        carbody_height=1.1, bogie_height=-0.23, primary_height=0.11, wheelset_height=0.17,
        bogie_half_distance=8.2, axle_half_distance=1.3, toppling=True,
    ),
)  # fmt: skip


def energy(vehicle, damping=False):
    """Potential energy of bodies turned by any angles, from the parameters, spring by spring.

    An axle box turns with its wheelset about x and z, not about y. With `damping` the dampers
    instead of springs and weights: half their dissipation, of speeds.
    """
    p, s, g = vehicle.primary_suspension, vehicle.secondary_suspension, vehicle.geometry
    weight = not damping
    if damping:
        k_p, k_s = (p.damping_x, p.damping_y, p.damping), (s.damping_x, s.damping_y, s.damping)
        bar, stop, yaw = 0.0, 0.0, s.yaw_damper
    else:
        k_p = (p.stiffness_x, p.stiffness_y, p.stiffness)
        k_s = (s.stiffness_x, s.stiffness_y, s.stiffness)
        bar, stop, yaw = s.roll_stiffness, s.stop_stiffness, 0.0
    k_p, k_s = np.array(k_p), np.array(k_s)
    on_secondary = vehicle.carbody.mass * g.gravity / 4
    on_primary = (vehicle.carbody.mass / 2 + vehicle.bogie.mass) * g.gravity / 4
    wheel = on_primary + vehicle.wheelset.mass * g.gravity / 2
    # In the frame of the secondary plane; z down.
    z_bogie = -g.bogie_height
    places = [(0.0, 0.0, -g.carbody_height)]
    centres = [g.bogie_half_distance, -g.bogie_half_distance]
    places += [(x, 0.0, z_bogie) for x in centres]
    axles = [x + d for x in centres for d in (g.axle_half_distance, -g.axle_half_distance)]
    places += [(x, 0.0, z_bogie + g.wheelset_height) for x in axles]
    masses = [vehicle.carbody.mass, *2 * [vehicle.bogie.mass], *4 * [vehicle.wheelset.mass]]

    def total(q):
        q = q.reshape(-1, 7, 5)
        turn = q[..., 2:].copy()
        turn[:, 3:, 1] = 0.0
        R = Rotation.from_rotvec(turn.reshape(-1, 3)).as_matrix().reshape(-1, 7, 3, 3)

        def stretch(a, b, point):
            """Along x, y, z, each an array over q."""
            moved = [R[:, i] @ (np.array(point) - places[i]) + places[i] for i in (a, b)]
            for at, i in zip(moved, (a, b), strict=True):
                at[:, 1:] += q[:, i, :2]
            return (moved[0] - moved[1]).T

        V = 0.0
        for i, x in enumerate(centres):
            for side in (-1, 1):
                d = stretch(0, 1 + i, (x, side * s.half_span, 0.0))
                V += k_s @ d**2 / 2 + weight * on_secondary * d[2]
                V += yaw * stretch(0, 1 + i, (x, side * s.yaw_damper_half_span, 0.0))[0] ** 2 / 2
            V += stop * stretch(0, 1 + i, (x, 0.0, 0.0))[1] ** 2 / 2
            V += bar * (q[:, 0, 2] - q[:, 1 + i, 2]) ** 2 / 2
        for j, side in product(range(4), (-1, 1)):
            d = stretch(
                1 + j // 2, 3 + j, (axles[j], side * p.half_span, z_bogie + g.primary_height)
            )
            V += k_p @ d**2 / 2 + weight * on_primary * d[2]
        if weight:
            V -= q[..., 1] @ masses * g.gravity - 2 * wheel * q[:, 3:, 1].sum(axis=1)
        return V

    return total


def curvature(V, n=35, h=1e-3):
    """Second derivatives at 0 by differences, with their error of second order taken off."""

    def once(h):
        e = h * np.eye(n)
        pairs = [(e[:, None] + sign * e).reshape(-1, n) for sign in (1, -1)]
        same, opposite = (V(q) + V(-q) for q in pairs)
        return ((same - opposite) / (4 * h * h)).reshape(n, n)

    return (4 * once(h) - once(2 * h)) / 3


@pytest.mark.parametrize("vehicle", [VEHICLE, FULL], ids=["paper", "full"])
def test_stiffness_is_the_curvature_of_the_energy(vehicle):
    """K with its toppling terms, C with its dampers: turned bodies, no levers written out."""
    body = build_multibody(vehicle, SPATIAL)
    assert len(body.coordinates) == 35
    topple = vehicle.geometry.toppling
    for A, V in ((body.K, energy(vehicle)), (body.C, energy(vehicle, damping=True))):
        found = curvature(V)
        if A is body.K and not topple:
            found -= _weights(vehicle)
        size = np.sqrt(np.abs(np.diag(A))) + 1e-3 * np.sqrt(np.abs(A).max())
        # Rounding of 1e4 J at 1e-3 of a unit is 1e-6 N/m; what is left of the differences.
        assert np.abs(found - A).max() < 1e-5 * np.abs(A).max()
        assert (np.abs(found - A) / np.outer(size, size)).max() < 1e-4


def _weights(vehicle):
    """What weights add, by hand: to roll and pitch of car body and bogies, roll of wheelsets."""
    g, M = vehicle.geometry, vehicle.carbody.mass
    under = (M / 2 + vehicle.bogie.mass) * g.gravity  # what stands on the primary springs
    car = -M * g.gravity * g.carbody_height
    bogie = M / 2 * g.gravity * g.bogie_height - under * g.primary_height
    axle = -under / 2 * (g.wheelset_height - g.primary_height)
    rows = [[0, 0, car, car, 0], *2 * [[0, 0, bogie, bogie, 0]], *4 * [[0, 0, axle, 0, 0]]]
    return np.diag(np.concatenate(rows))


def test_toppling_by_hand():
    """Weight times height, and nothing where it is not asked for."""
    topple = replace(VEHICLE, geometry=Geometry(toppling=True))
    added = build_multibody(topple, SPATIAL).K - BODY.K
    assert added == pytest.approx(_weights(VEHICLE), rel=1e-9, abs=1e-6)
    assert added[2, 2] == pytest.approx(-0.68e6, rel=5e-3)
    # The vertical model has the pitch of it.
    upright = build_multibody(topple, VERTICAL).K - build_multibody(VEHICLE).K
    assert upright[1, 1] == pytest.approx(added[3, 3], rel=1e-9)


def held(vehicle):
    """Frequencies (Hz) and shapes on held wheelsets."""
    body = build_multibody(vehicle, SPATIAL)
    omega2, shapes = eigh(body.K[body.above, body.above], body.M[body.above, body.above])
    return body, np.sqrt(omega2) / (2 * np.pi), shapes


def of_most(vehicle, coordinate):
    """Frequency of the mode with most of a coordinate's energy."""
    body, hertz, shapes = held(vehicle)
    j = body.coordinates.index(coordinate)
    return hertz[np.argmax(np.abs(shapes[j]))]


def test_sway_with_and_without_toppling():
    """Lower sway 0.31 Hz, 0.19 with toppling; upper sway and car body pitch, to three digits."""
    topple = replace(VEHICLE, geometry=Geometry(toppling=True))
    assert of_most(VEHICLE, "carbody.y") == pytest.approx(0.31, abs=5e-3)
    assert of_most(topple, "carbody.y") == pytest.approx(0.19, abs=5e-3)
    assert of_most(VEHICLE, "carbody.pitch") == pytest.approx(0.953, abs=5e-4)
    assert of_most(VEHICLE, "carbody.z") == pytest.approx(0.709, abs=5e-4)


@pytest.mark.parametrize("toppling", [False, True])
def test_sway_and_yaw_of_a_car_body_in_closed_form(toppling):
    """On bogies that do not move: y and roll are two equations, yaw is one."""
    stiff = PrimarySuspension(stiffness=2e12, stiffness_x=2e12, stiffness_y=2e12)
    vehicle = Vehicle(primary_suspension=stiff, geometry=Geometry(toppling=toppling))
    _, hertz, _ = held(vehicle)
    k, k_z, h, b, L = 0.11e6, 0.27e6, 1.415, 0.978, 7.85
    M, J_x, J_z, W = 49080.0, 65700.0, 1447100.0, 49080.0 * 9.81 * toppling
    a, c = 4 * k / M, (4 * (k * h**2 + k_z * b**2) - W * h) / J_x
    coupling = (4 * k * h) ** 2 / (M * J_x)
    root = np.sqrt((a - c) ** 2 / 4 + coupling)
    expected = [(a + c) / 2 - root, (a + c) / 2 + root, 4 * (k * L**2 + k * b**2) / J_z]
    for omega2 in expected:
        # Bogies on 2e12 N/m give way by 1e-7.
        assert np.abs(hertz / (np.sqrt(omega2) / (2 * np.pi)) - 1).min() < 1e-6


def test_bounce_and_yaw_of_a_bogie_in_closed_form():
    """Where car bodies weigh much, bogies move alone between springs."""
    heavy = CarBody(mass=1e12, inertia_roll=1e14, inertia_pitch=1e14, inertia_yaw=1e14)
    body, hertz, shapes = held(Vehicle(carbody=heavy))
    b, L = 0.978, 1.25
    yaw = 4 * (1.24e6 * (L**2 + b**2)) + 2 * 0.11e6 * b**2
    expected = {
        "z": (2 * 0.27e6 + 4 * 1.27e6) / 4420.0,
        "yaw": yaw / 3551.0,
    }
    for what, omega2 in expected.items():
        size = np.abs(shapes[body.coordinates.index(f"bogie[1].{what}")])
        assert hertz[np.argmax(size)] == pytest.approx(np.sqrt(omega2) / (2 * np.pi), rel=1e-6)


def pulls(coordinate, on, vehicle=VEHICLE):
    """Force on one coordinate where another is displaced by 1."""
    body = build_multibody(vehicle, SPATIAL)
    unit = np.zeros(35)
    unit[body.coordinates.index(coordinate)] = 1.0
    return (-body.K @ unit)[body.coordinates.index(on)]


# x forward, y to the right, z down, right-handed: roll lowers the right, pitch lifts the front,
# yaw turns the front to the right.
@pytest.mark.parametrize(
    ("moved", "felt", "sign"),
    [
        ("carbody.y", "bogie[1].y", 1),
        ("carbody.z", "bogie[1].z", 1),
        ("carbody.roll", "bogie[1].roll", 1),
        ("carbody.roll", "bogie[1].y", -1),  # its feet are below it: they go left
        ("carbody.pitch", "bogie[1].z", -1),
        ("carbody.pitch", "bogie[2].z", 1),
        ("carbody.yaw", "bogie[1].y", 1),
        ("carbody.yaw", "bogie[2].y", -1),
        ("carbody.yaw", "bogie[1].yaw", 1),
        ("bogie[1].yaw", "wheelset[1].y", 1),
        ("bogie[1].yaw", "wheelset[2].y", -1),
        ("bogie[1].roll", "wheelset[1].roll", 1),
        ("wheelset[1].y", "bogie[1].y", 1),
        ("wheelset[1].y", "wheelset[1].roll", -1),  # held back above its middle, it leans back
    ],
)
def test_signs(moved, felt, sign):
    assert sign * pulls(moved, felt) > 1e3  # N or N m of the softest spring


def test_a_spinning_axle_pulls_at_nothing():
    body = build_multibody(FULL, SPATIAL)
    spins = [body.coordinates.index(f"wheelset[{i}].spin") for i in (1, 2, 3, 4)]
    assert not body.K[spins].any()
    assert not body.C[spins].any()
    assert np.diag(body.M)[spins] == pytest.approx(4 * [130.0])


def test_what_each_part_adds():
    """Yaw dampers, roll bar, stops: to the coordinates they are for."""
    s = SecondarySuspension()

    def added(of, coordinate, **change):
        other = Vehicle(secondary_suspension=replace(s, **change))
        j = BODY.coordinates.index(coordinate)
        return (getattr(build_multibody(other, SPATIAL), of) - getattr(BODY, of))[j, j]

    assert added("C", "bogie[1].yaw", yaw_damper=1e5, yaw_damper_half_span=1.4) == pytest.approx(
        2 * 1e5 * 1.4**2, rel=1e-9
    )
    assert added("K", "bogie[2].roll", roll_stiffness=1e6) == pytest.approx(1e6, rel=1e-9)
    assert added("K", "bogie[2].y", stop_stiffness=3e5) == pytest.approx(3e5, rel=1e-9)
    assert added("K", "bogie[2].y", stop_stiffness=3e5, stop_gap=0.02) == 0.0


def test_mirrored_forces_give_the_vertical_answers():
    """Both wheels of every wheelset alike; springs along the track as weak as can be."""
    weak = replace(VEHICLE.primary_suspension, stiffness_x=1e-4)
    soft = replace(VEHICLE.secondary_suspension, stiffness_x=1e-4)
    vehicle = replace(VEHICLE, primary_suspension=weak, secondary_suspension=soft)
    upright, space = build_multibody(vehicle), build_multibody(vehicle, SPATIAL)
    b, force = 0.7465, np.random.default_rng(1).normal(size=4)

    def answer(body, omega):
        f = np.zeros(len(body.coordinates))
        for i, size in enumerate(force):
            f[body.at(f"wheelset[{i + 1}]", "z")] += 2 * size
            if body is space:  # force and lever of either wheel
                f[body.at(f"wheelset[{i + 1}]", "roll")] += size * b - size * b
        x = np.linalg.solve(body.K + 1j * omega * body.C - omega**2 * body.M, f)
        return dict(zip(body.coordinates, x, strict=True))

    for omega in 2 * np.pi * np.array([0.3, 0.95, 6.0, 40.0, 500.0]):
        all_of, vertical = answer(space, omega), answer(upright, omega)
        size = max(map(abs, vertical.values()))
        for name, x in all_of.items():
            assert abs(x - vertical.get(name, 0.0)) < 1e-9 * size, name


@pytest.mark.parametrize("name", ["paper", "manchester", "wagon"])
def test_modes_in_space_against_a_direct_solve(name):
    """The modal form takes any choice of coordinates; free motions: y, z, roll, yaw, the spins."""
    body = build_multibody(read_stock(Path(name)), SPATIAL)
    modal = modal_form(body)
    assert modal.poles.real.max() < 1e-9  # 1/s: nothing damps wheelsets sideways
    s = 2j * np.pi * 3.0
    direct = np.linalg.inv(body.K + s * body.C + s**2 * body.M)
    found = modal.rigid @ modal.rigid.T / s**2 + 0.5 * (
        modal.modes @ (modal.left / (s - modal.poles)[:, None])
        + modal.modes.conj() @ (modal.left.conj() / (s - modal.poles.conj())[:, None])
    )
    # Rounding, times the condition of nearly critically damped pairs.
    assert np.abs(found - direct).max() < 1e-8 * np.abs(direct).max()


def test_energy_is_kept_without_dampers():
    """Half v M v + half x K x of a free undamped vehicle, thrown anyhow, over ten seconds."""
    none = Vehicle(
        primary_suspension=PrimarySuspension(damping=0.0),
        secondary_suspension=SecondarySuspension(damping=0.0, damping_y=0.0),
    )
    body = build_multibody(none, SPATIAL)
    modal = modal_form(body)
    rng = np.random.default_rng(2)
    x, v = 1e-2 * rng.normal(size=35), 0.1 * rng.normal(size=35)
    s = modal.state_of @ x + modal.left @ (body.M @ v)
    r, r_v = modal.rigid.T @ body.M @ x, modal.rigid.T @ body.M @ v
    held_back = []
    for t in np.linspace(0.0, 10.0, 41):
        now = np.exp(modal.poles * t) * s
        x = modal.rigid @ (r + t * r_v) + (modal.modes @ now).real
        v = modal.rigid @ r_v + (modal.modes @ (modal.poles * now)).real
        held_back.append(v @ body.M @ v / 2 + x @ body.K @ x / 2)
    assert np.ptp(held_back) < 1e-9 * held_back[0]  # rounding of poles times 10 s


def test_a_train_topples_as_one():
    with pytest.raises(ParameterError, match="toppling: must be as vehicle 1"):
        Train(vehicles=(TrainVehicle(vehicle=VEHICLE), TrainVehicle(vehicle=FULL)))
