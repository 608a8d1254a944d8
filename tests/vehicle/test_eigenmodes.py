"""Modes of a vehicle against one and two masses by hand, and their names from their shapes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from railcosim.vehicle.eigenmodes import oscillations, poles_of, swings
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.mode_names import names_of_modes
from railcosim.vehicle.multibody import SPATIAL, build_multibody
from railcosim.vehicle.on_rails import cones_of, rolling, standing
from railcosim.vehicle.parameters import Geometry, SecondarySuspension, Vehicle
from railcosim.vehicle.train import train_of

VEHICLE = Vehicle()


def modes_of(vehicle, contacts=None):
    """Names and modes of a vehicle, wheelsets held or on contacts."""
    body = build_multibody(vehicle, SPATIAL)
    if contacts is None:
        M, C, K = (A[body.above, body.above] for A in (body.M, body.C, body.K))
    else:
        K, C = contacts(body).on_rigid_rails(body)
        M, C, K = body.M, body.C + C, body.K + K
    place = dict(
        zip(body.names, (b.place[0] for b in train_of(vehicle).parts().bodies), strict=True)
    )
    x = np.array([place[c.rpartition(".")[0]] for c in body.coordinates[: len(M)]])
    found = oscillations(M, C, K, x)
    shapes, omega = [m.shape for m in found.modes], [m.damped for m in found.modes]
    names = names_of_modes(body.coordinates[: len(M)], np.diag(M), shapes, omega)
    return dict(zip(names, found.modes, strict=True)), found.free


def hertz(mode):
    return mode.undamped / (2 * np.pi)


def test_one_mass_at_three_dampings():
    """Below, at and above critical damping."""
    m, k = 3.0, 300.0
    for ratio in (0.1, 1.0, 1.7):
        c = 2 * ratio * np.sqrt(k * m)
        (mode,) = oscillations(*(np.array([[x]]) for x in (m, c, k)), np.zeros(1)).modes
        assert mode.undamped == pytest.approx(10.0, rel=1e-12)
        assert mode.damping_ratio == pytest.approx(ratio, rel=1e-7)  # a double pole: its root
        swinging = 10.0 * np.sqrt(max(1 - ratio**2, 0.0))
        assert mode.damped == pytest.approx(swinging, rel=1e-7, abs=1e-6)


def test_two_masses_with_dampers_of_each_mode():
    """Modal damping given, whatever it is, is found with its mode."""
    M = np.diag([2.0, 5.0])
    K = np.array([[700.0, -200.0], [-200.0, 300.0]])
    omega2, U = eigh(K, M)
    for ratios in ((0.05, 0.3), (1.4, 0.2), (0.2, 2.5), (1.1, 1.2)):
        C = M @ U @ np.diag(2 * np.array(ratios) * np.sqrt(omega2)) @ U.T @ M
        modes = oscillations(M, C, K, np.zeros(2)).modes
        assert [m.undamped for m in modes] == pytest.approx(np.sqrt(omega2), rel=1e-12)
        assert [m.damping_ratio for m in modes] == pytest.approx(ratios, rel=1e-9)


def test_what_grows_without_swinging_is_told():
    """A mass on a spring of less than nothing leaves as exp(2 t), and does not swing."""
    (mode,) = swings(np.eye(1), np.zeros((1, 1)), np.array([[-4.0]])).modes
    assert (mode.undamped, mode.damped) == pytest.approx((2.0, 0.0))
    assert mode.damping_ratio == pytest.approx(-1.0)


@pytest.mark.parametrize("place", [[5.0, -5.0], [-5.0, 5.0]])
def test_of_equal_frequencies_that_at_the_front_comes_first(place):
    first, second = oscillations(np.eye(2), 0.1 * np.eye(2), 4 * np.eye(2), np.array(place)).modes
    front = int(np.argmax(place))
    assert abs(first.shape[front]) == pytest.approx(1.0)
    assert abs(second.shape[1 - front]) == pytest.approx(1.0)


def test_shapes_are_real_where_they_have_most_energy():
    """Of one damper beside two springs, so that no two coordinates move in phase."""
    M, C = np.diag([2.0, 5.0]), np.diag([9.0, 0.0])
    K = np.array([[700.0, -200.0], [-200.0, 300.0]])
    for found in (swings(M, C, K), oscillations(M, C, K, np.zeros(2))):
        for mode in found.modes:
            energy = np.abs(mode.shape) ** 2 * np.diag(M)
            assert energy.sum() == pytest.approx(1.0)
            assert np.angle(mode.shape[np.argmax(energy)]) == pytest.approx(0.0, abs=1e-9)
            assert abs(np.angle(mode.shape[np.argmin(energy)])) % np.pi > 1e-3


def test_a_coordinate_without_mass():
    """A mass on a spring on what has a spring and a damper only: three poles, by hand."""
    m, k1, k2, c = 2.0, 300.0, 500.0, 7.0
    M, C = np.diag([m, 0.0]), np.diag([0.0, c])
    K = np.array([[k1, -k1], [-k1, k1 + k2]])
    poles, vectors = poles_of(M, C, K)
    expected = np.roots([m * c, m * (k1 + k2), k1 * c, k1 * k2])
    assert sorted(poles, key=np.imag) == pytest.approx(sorted(expected, key=np.imag), rel=1e-10)
    for s, v in zip(poles, vectors.T, strict=True):
        assert np.abs((s * s * M + s * C + K) @ v).max() < 1e-9 * np.abs(K).max()


def test_the_papers_vehicle():
    """Names and frequencies on held wheelsets: closed forms and an independent model's digits."""
    modes, free = modes_of(VEHICLE)
    assert free == 0
    assert len(modes) == 15
    expected = {
        "car body lower sway": 0.311,
        "car body bounce": 0.709,
        "car body pitch": 0.953,
        "bogie pitch in phase": 6.405,
    }
    for name, f in expected.items():
        assert hertz(modes[name]) == pytest.approx(f, abs=5e-4), name
    assert modes["bogie pitch in opposition"].damping_ratio == pytest.approx(1.03, abs=5e-3)
    assert {n.partition(" in ")[0] for n in modes} == {
        *(f"car body {what}" for what in ("lower sway", "upper sway", "bounce", "pitch", "yaw")),
        *(f"bogie {what}" for what in ("lateral", "bounce", "pitch", "roll", "yaw")),
    }


def test_sway_is_lower_where_its_axis_is_below():
    """By hand: y and roll of the car body alike in sign, so that no point above it stands still."""
    modes, _ = modes_of(VEHICLE)
    y, roll = (build_multibody(VEHICLE, SPATIAL).at("carbody", d) for d in ("y", "roll"))
    for name, below in (("car body lower sway", True), ("car body upper sway", False)):
        shape = modes[name].shape
        axis = (shape[y] / shape[roll]).real  # m below the centre of mass
        assert (axis > 0) == below
    assert hertz(modes["car body lower sway"]) < hertz(modes["car body upper sway"])


def test_toppling_lowers_the_lower_sway():
    topple = replace(VEHICLE, geometry=Geometry(toppling=True))
    assert hertz(modes_of(topple)[0]["car body lower sway"]) == pytest.approx(0.19, abs=5e-3)
    weak = SecondarySuspension(stiffness=1e5)
    with pytest.raises(ArithmeticError, match="topples over"):
        modes_of(replace(topple, secondary_suspension=weak))


def test_names_do_not_go_by_order():
    """A car body that is heavy to turn pitches below its bounce; the names go with the shapes."""
    carbody = replace(VEHICLE.carbody, inertia_pitch=4 * VEHICLE.carbody.inertia_pitch)
    modes, _ = modes_of(replace(VEHICLE, carbody=carbody))
    assert hertz(modes["car body pitch"]) == pytest.approx(0.953 / 2, rel=2e-3)
    assert hertz(modes["car body bounce"]) == pytest.approx(0.709, abs=5e-4)


def test_on_contact_springs():
    """A wheelset between its contact springs and the primary ones; what slides is left out."""
    modes, free = modes_of(VEHICLE, standing)
    assert free == 6  # y and yaw of the whole, four axles
    k = float(
        build_multibody(VEHICLE).wheels[0].patch.ellipse.stiffness(np.array(VEHICLE.wheel_load))
    )
    bounce = np.sqrt((2 * k + 2 * 1.27e6) / 1680.0) / (2 * np.pi)
    # Bogies, a hundredth as fast, hardly move.
    assert hertz(modes["wheelset bounce in phase"]) == pytest.approx(bounce, rel=1e-5)
    roll = np.sqrt((2 * k * 0.7465**2 + 2 * 1.27e6 * 0.978**2) / 773.3) / (2 * np.pi)
    assert hertz(modes["wheelset roll in phase"]) == pytest.approx(roll, rel=1e-4)


def test_vehicles_apart_have_modes_of_their_own():
    """Two wagons without a coupler: each mode twice, at a place of its own."""
    wagons = read_stock(Path("wagon"), 2)
    modes, _ = modes_of(wagons)
    alone, _ = modes_of(read_stock(Path("wagon")))
    assert len(modes) == 2 * len(alone)
    for name, mode in alone.items():
        for i in (1, 2):
            twin = modes[f"{name} of carbody[{i}]"]
            assert twin.undamped == pytest.approx(mode.undamped, rel=1e-9)


@pytest.mark.parametrize("conicity", [0.05, 0.1, 0.2])
def test_slow_wheelsets_hunt_as_klingel_says(conicity):
    """Each on the wave of a free wheelset on round heads, where springs do not push them apart."""
    speed = 2 / 3.6
    soft = replace(VEHICLE.primary_suspension, stiffness_x=1e3, stiffness_y=1e3)
    body = build_multibody(replace(VEHICLE, primary_suspension=soft), SPATIAL)
    K, C = rolling(body, cones_of(body, conicity))(speed).on_rigid_rails(body)
    found = swings(body.M, body.C + C, body.K + K)
    names = names_of_modes(
        body.coordinates, np.diag(body.M), [m.shape for m in found.modes],
        [m.damped for m in found.modes], speed,
    )  # fmt: skip
    hunting = [m for n, m in zip(names, found.modes, strict=True) if "hunting" in n]
    assert len(hunting) == 4
    b, r0, R = 0.7465, 0.43, 0.3
    free = 2 * np.pi * np.sqrt(b * r0 / (conicity * (1 + R * conicity / b)))
    for mode in hunting:
        assert speed / (mode.damped / (2 * np.pi)) == pytest.approx(
            free, rel=1e-3
        )  # lambda^2 and spin: 7e-5 to 9e-4


def test_hunting_is_what_leads_the_vehicle_away():
    """Above the critical speed a bogie's hunting grows; slower, nothing does."""
    for kmh, growing in ((40.0, 0), (250.0, 4)):
        speed = kmh / 3.6
        body = build_multibody(VEHICLE, SPATIAL)
        K, C = rolling(body, cones_of(body, 0.1))(speed).on_rigid_rails(body)
        found = swings(body.M, body.C + C, body.K + K)
        names = names_of_modes(
            body.coordinates, np.diag(body.M), [m.shape for m in found.modes],
            [m.damped for m in found.modes], speed,
        )  # fmt: skip
        grow = [n for n, m in zip(names, found.modes, strict=True) if m.damping_ratio < 0]
        assert len(grow) == growing
        assert all(n.startswith("bogie hunting") for n in grow)
