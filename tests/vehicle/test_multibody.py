"""The vehicle against mechanics by hand: one mass or two masses at a time."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from railcosim.vehicle.modal import modal_form
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.parameters import (
    Bogie,
    CarBody,
    Geometry,
    PrimarySuspension,
    SecondarySuspension,
    Vehicle,
    Wheelset,
)

VEHICLE = Vehicle()
BODY = build_multibody(VEHICLE)
L_C, L_T = 7.85, 1.25
M_C, J_C, M_T, J_T, M_W = 49080.0, 1698400.0, 4420.0, 4902.0, 1680.0
K_P, K_S = 2 * 1.27e6, 2 * 0.27e6  # an axle, a bogie
C_P, C_S = 2 * 65e3, 2 * 16.5e3


def index(name):
    return BODY.coordinates.index(name)


def grounded():
    """M, C, K with the wheelsets held."""
    above = np.ix_(range(6), range(6))
    return BODY.M[above], BODY.C[above], BODY.K[above]


OTHER = Vehicle(
    carbody=CarBody(mass=31234.5, inertia_pitch=1.234e6),
    bogie=Bogie(mass=2777.7, inertia_pitch=1555.5),
    wheelset=Wheelset(mass=1234.5),
    primary_suspension=PrimarySuspension(stiffness=1e6 / 3, damping=7.7e3),
    secondary_suspension=SecondarySuspension(stiffness=0.37e6, damping=11.1e3),
    geometry=Geometry(bogie_half_distance=9.13, axle_half_distance=1.37, gravity=9.80665),
)


@pytest.mark.parametrize(("vehicle", "name"), [(VEHICLE, "paper"), (OTHER, "odd")])
def test_as_written_out_by_hand_before_bodies_and_springs(vehicle, name):
    """M, C, K of one vehicle, coordinate by coordinate, as an earlier version had them."""
    stored = json.loads((Path(__file__).parent / "frozen_multibody.json").read_text())[name]
    body = build_multibody(vehicle)
    for what in ("M", "C", "K"):
        expected = np.zeros((10, 10))
        for one, other, value in stored[what]:
            expected[index(one), index(other)] = value
        # Rounding: a place and a difference of two places.
        assert np.abs(getattr(body, what) - expected).max() < 1e-12 * np.abs(expected).max()
    assert body.wheelset_x == pytest.approx(stored["wheelset_x"], rel=1e-12)
    assert body.wheel_load == pytest.approx(np.full(4, stored["wheel_load"]), rel=1e-12)


def test_mass_and_symmetry():
    for A in (BODY.M, BODY.C, BODY.K):
        assert np.abs(A - A.T).max() < 1e-15 * np.abs(A).max()  # rounding
    assert np.linalg.eigvalsh(BODY.M).min() > 0
    up = np.array([name.endswith(".z") for name in BODY.coordinates], dtype=float)
    assert up @ BODY.M @ up == pytest.approx(M_C + 2 * M_T + 4 * M_W, rel=1e-14)  # rounding


def test_springs_and_dampers_of_the_bounce():
    """Two secondary suspensions a bogie, two primary ones an axle, in stiffness as in damping."""
    for A, secondary, primary in ((BODY.K, K_S, K_P), (BODY.C, C_S, C_P)):
        carbody, bogie, axle = (index(n) for n in ("carbody.z", "bogie[1].z", "wheelset[1].z"))
        assert A[carbody, carbody] == pytest.approx(2 * secondary, rel=1e-14)  # rounding
        assert A[bogie, bogie] == pytest.approx(secondary + 2 * primary, rel=1e-14)
        assert A[axle, axle] == pytest.approx(primary, rel=1e-14)
        assert A[carbody, bogie] == pytest.approx(-secondary, rel=1e-14)


def test_static_wheel_load():
    assert BODY.wheel_load == pytest.approx((M_C + 2 * M_T + 4 * M_W) * 9.81 / 8, rel=1e-14)
    assert BODY.wheel_load == pytest.approx(79e3, rel=5e-3)  # the paper rounds to kN


def test_rigid_motions_stretch_nothing_and_nothing_else_does():
    rigid = modal_form(BODY).rigid
    assert rigid.shape == (10, 4)
    scale = np.abs(BODY.K).max()
    assert np.abs(BODY.K @ rigid).max() < 1e-12 * scale  # rounding
    assert np.abs(BODY.C @ rigid).max() < 1e-12 * np.abs(BODY.C).max()
    # By hand: bounce; pitch of all about the car body's centre; each bogie with its wheelsets.
    x = [L_C + L_T, L_C - L_T, -L_C + L_T, -L_C - L_T]
    by_hand = np.array([
        [1, 0, 1, 0, 1, 0, 1, 1, 1, 1],
        [0, 1, -L_C, 1, L_C, 1, *(-np.array(x))],
        [0, 0, 0, 1, 0, 0, -L_T, L_T, 0, 0],
        [0, 0, 0, 0, 0, 1, 0, 0, -L_T, L_T],
    ])  # fmt: skip
    assert np.abs(BODY.K @ by_hand.T).max() < 1e-9 * scale
    assert np.linalg.matrix_rank(BODY.K) == 6
    assert BODY.wheelset_x == pytest.approx(x)


def test_positive_pitch_lifts_the_front():
    """z is down: pitch lifts the front bogie's pivot by L_c, which pulls that bogie up."""
    force = -BODY.K @ np.eye(10)[index("carbody.pitch")]
    assert force[index("bogie[1].z")] == pytest.approx(-K_S * L_C)
    assert force[index("bogie[2].z")] == pytest.approx(K_S * L_C)
    force = -BODY.K @ np.eye(10)[index("bogie[1].pitch")]
    assert force[index("wheelset[1].z")] == pytest.approx(-K_P * L_T)
    assert force[index("wheelset[2].z")] == pytest.approx(K_P * L_T)


def test_frequencies_on_held_wheelsets_in_closed_form():
    M, _, K = grounded()
    found = np.sqrt(eigh(K, M, eigvals_only=True)) / (2 * np.pi)
    # Bounce: M_c on 2 K_s, two bogies on 2 K_p each; pitch: the same with levers; bogies pitch.
    expected = [np.sqrt(2 * K_P * L_T**2 / J_T) / (2 * np.pi)] * 2
    for inertia, lever in ((M_C, 1.0), (J_C, L_C)):
        K2 = 2 * np.array([[K_S * lever**2, -K_S * lever], [-K_S * lever, K_S + 2 * K_P]])
        M2 = np.diag([inertia, 2 * M_T])
        a, b = M2[0, 0] * M2[1, 1], -(M2[0, 0] * K2[1, 1] + M2[1, 1] * K2[0, 0])
        squared = np.roots([a, b, np.linalg.det(K2)])
        expected += list(np.sqrt(squared.real) / (2 * np.pi))
    assert found == pytest.approx(np.sort(expected), rel=1e-10)  # rounding


@pytest.mark.parametrize(
    ("inertia", "lever", "hertz"), [(M_C, 1.0, 0.709), (J_C, L_C, 0.946)], ids=["bounce", "pitch"]
)
def test_car_body_is_a_mass_on_springs_in_series(inertia, lever, hertz):
    series = 1 / (1 / K_S + 1 / (2 * K_P))  # under one bogie
    by_hand = np.sqrt(2 * series * lever**2 / inertia) / (2 * np.pi)
    M, _, K = grounded()
    found = np.sqrt(eigh(K, M, eigvals_only=True)) / (2 * np.pi)
    nearest = found[np.argmin(np.abs(found - by_hand))]
    # The bogies' mass lowers it, by m_t (K_s / 2 K_p)^2 / 2 of M_c / 2 and less: measured 0.1 %.
    assert nearest == pytest.approx(by_hand, rel=2e-3)
    assert nearest < by_hand
    assert nearest == pytest.approx(hertz, abs=5e-4)  # the independent model's three digits


def test_bogie_pitch_is_critically_damped():
    """Undamped 6.39 Hz, zeta about 1.03: why the paper's 6.2 Hz cannot be found."""
    omega = np.sqrt(2 * K_P * L_T**2 / J_T)
    zeta = 2 * C_P * L_T**2 / (2 * J_T * omega)
    assert omega / (2 * np.pi) == pytest.approx(6.39, abs=0.02)
    assert zeta == pytest.approx(1.03, abs=0.01)
    M, C, K = grounded()
    p = index("bogie[1].pitch")
    assert C[p, p] / (2 * np.sqrt(K[p, p] * M[p, p])) == pytest.approx(zeta, rel=1e-12)


@pytest.mark.parametrize(
    "vehicle",
    [
        VEHICLE,
        Vehicle(
            primary_suspension=PrimarySuspension(damping=1e3),
            secondary_suspension=SecondarySuspension(damping=0.0),
        ),
    ],
    ids=["default", "hardly damped"],
)
def test_modal_form_against_a_direct_solve(vehicle):
    body = build_multibody(vehicle)
    modal = modal_form(body)
    assert modal.poles.real.max() < 0
    for omega in 2 * np.pi * np.array([0.05, 0.7, 0.95, 6.3, 30.0, 400.0]):
        direct = np.linalg.inv(body.K + 1j * omega * body.C - omega**2 * body.M)
        s = 1j * omega
        found = -modal.rigid @ modal.rigid.T / omega**2 + 0.5 * (
            modal.modes @ (modal.left / (s - modal.poles)[:, None])
            + modal.modes.conj() @ (modal.left.conj() / (s - modal.poles.conj())[:, None])
        )
        # Rounding, times the condition of a nearly critically damped pair.
        assert np.abs(found - direct).max() < 1e-9 * np.abs(direct).max()


def test_modal_state_of_a_displacement():
    """Displacements at rest are what their modal state says, with no velocity."""
    modal = modal_form(BODY)
    x = np.array([1e-3, 1e-4, -2e-3, 3e-4, 5e-4, -1e-4, 1e-3, -1e-3, 2e-3, 0.0])
    s, r = modal.state_of @ x, modal.rigid.T @ BODY.M @ x
    assert modal.rigid @ r + (modal.modes @ s).real == pytest.approx(x, abs=1e-14)  # rounding
    assert (modal.modes @ (modal.poles * s)).real == pytest.approx(np.zeros(10), abs=1e-11)


def test_rigid_modes_are_mass_orthonormal():
    modal = modal_form(BODY)
    assert modal.rigid.T @ BODY.M @ modal.rigid == pytest.approx(np.eye(4), abs=1e-12)
    assert np.abs(modal.rigid.T @ BODY.M @ modal.modes).max() < 1e-9  # rigid and elastic apart


def test_wheelsets_are_the_last_coordinates():
    names = tuple(f"wheelset[{i}].z" for i in (1, 2, 3, 4))
    assert tuple(BODY.coordinates[j] for j in BODY.wheelsets) == names
    assert BODY.coordinates[: BODY.above.stop] == BODY.coordinates[:-4]
