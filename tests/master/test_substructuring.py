"""Joined components against the whole system solved at once."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from railcosim.master.component import FloatArray
from railcosim.master.linear.joint import spring
from railcosim.master.linear.receptance import FrequencyResponse
from railcosim.master.linear.substructuring import couple

OMEGA = np.geomspace(0.1, 30.0, 200)
M1, M2 = np.diag([2.0, 1.0, 3.0]), np.diag([1.0, 0.5])
C1, C2 = 0.02 * np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]]), np.diag([0.1, 0.3])
K1 = 5.0 * np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]])  # free: a rigid body is left
K2 = np.array([[9.0, -4], [-4, 6]])
STIFFNESS = (7.0, 20.0)
JOINTS = [
    spring(
        f"wheel{j}.force",
        f"wheel{j}.gap",
        first=(f"f{j}", f"z{j}"),
        second=(f"f{j}", f"z{j}"),
        stiffness=STIFFNESS[j],
    )
    for j in (0, 1)
]


def free(name: str, M: FloatArray, C: FloatArray, K: FloatArray, sign: float) -> FrequencyResponse:
    """All motions for a force on every mass, positive up (-1) or down (+1)."""
    w = OMEGA[:, None, None]
    names = range(len(M))
    return FrequencyResponse(
        name=name,
        omega=OMEGA,
        outputs=tuple(f"z{i}" for i in names),
        inputs=tuple(f"f{i}" for i in names),
        values=np.asarray(sign * np.linalg.inv(-(w**2) * M + 1j * w * C + K), dtype=np.complex128),
    )


VEHICLE = free("vehicle", M1, C1, K1, -1.0)
TRACK = free("track", M2, C2, K2, 1.0)


def monolithic() -> tuple[NDArray[Any], NDArray[Any]]:
    """Displacements and joint forces, for forces on the vehicle, on the track, and gaps."""
    w = OMEGA[:, None, None]
    stretch = np.array([[1.0, 0, 0, -1, 0], [0, 1, 0, 0, -1]])  # z1 - z2 of each joint
    spring = np.diag(STIFFNESS)
    zero = np.zeros((3, 2))
    M, C, K = (np.block([[a, zero], [zero.T, b]]) for a, b in ((M1, M2), (C1, C2), (K1, K2)))
    load = np.hstack([np.diag([-1.0, -1, -1, 1, 1]), stretch.T @ spring])
    z = np.linalg.solve(
        -(w**2) * M + 1j * w * C + K + stretch.T @ spring @ stretch,
        np.broadcast_to(load + 0j, (len(OMEGA), *load.shape)),
    )
    gap = np.hstack([np.zeros((2, 5)), np.eye(2)])
    return z, spring @ (stretch @ z - gap)


def test_two_chains_joined_twice() -> None:
    coupled = couple(VEHICLE, TRACK, JOINTS)
    z, force = monolithic()
    assert coupled.outputs[2:] == (
        "vehicle.z2", "track.z0", "track.z1", "wheel0.force", "wheel1.force",
    )  # fmt: skip
    assert coupled.inputs[-3:] == ("track.f1", "wheel0.gap", "wheel1.gap")
    # Rounding times the condition of the system near its light resonances, some 1e3.
    for found, exact in ((coupled.values[:, :5], z), (coupled.values[:, 5:], force)):
        scale = np.abs(exact).max(axis=1, keepdims=True)
        assert np.all(np.abs(found - exact) < 1e-12 * scale)


def test_reciprocity() -> None:
    """Force here and motion there can change places; the vehicle's forces point up."""
    coupled = couple(VEHICLE, TRACK, JOINTS)
    there, back = coupled.of("track.z1", "vehicle.f2"), coupled.of("vehicle.z2", "track.f1")
    np.testing.assert_allclose(there, -back, rtol=1e-11)  # rounding, as above


def test_loads_that_act_together() -> None:
    """On inputs of both components and on a gap, over frequency: superposed by hand."""
    coupled = couple(VEHICLE, TRACK, JOINTS)
    acting = ["vehicle.f1", "track.f0", "vehicle.f2", "wheel1.gap"]
    turning = np.exp(-1j * np.outer(OMEGA, [0.1, 0.2, 0.3, 0.4]))
    loads = np.stack([turning, 2.0 * turning.conj()], axis=2)
    loads[:, 1, 1] = 0.0
    found = coupled.to(acting, loads)
    by_hand = coupled.values[:, :, coupled.columns(acting)] @ loads
    # Rounding times the condition near light resonances, as above.
    scale = np.abs(by_hand).max(axis=1, keepdims=True)
    assert np.all(np.abs(found - by_hand) < 1e-12 * scale)
    alone = coupled.combined(acting, turning)
    assert np.all(np.abs(alone - by_hand[:, :, 0]) < 1e-12 * scale[:, :, 0])


def test_no_joints_leave_them_apart() -> None:
    apart = couple(VEHICLE, TRACK, [])
    assert apart.outputs == ("vehicle.z0", "vehicle.z1", "vehicle.z2", "track.z0", "track.z1")
    np.testing.assert_array_equal(apart.of("vehicle.z0", "vehicle.f2"), VEHICLE.of("z0", "f2"))
    np.testing.assert_array_equal(apart.of("track.z1", "track.f0"), TRACK.of("z1", "f0"))
    assert not apart.of("track.z1", "vehicle.f0").any()


def test_mass_on_the_ground() -> None:
    """A free mass on a spring: z / gap = k / (k - m omega^2)."""
    mass = free("mass", np.diag([3.0]), np.zeros((1, 1)), np.zeros((1, 1)), -1.0)
    joint = spring(
        "contact.force", "contact.gap", first=("f0", "z0"), second=("", ""), stiffness=50.0
    )
    coupled = couple(mass, None, [joint])
    assert coupled.outputs == ("mass.z0", "contact.force")
    assert coupled.inputs == ("mass.f0", "contact.gap")
    dynamic = 50.0 - 3.0 * OMEGA**2
    # Rounding, magnified some 1e2 next to the undamped resonance.
    np.testing.assert_allclose(coupled.of("mass.z0", "contact.gap"), 50.0 / dynamic, rtol=1e-12)
    np.testing.assert_allclose(
        coupled.of("contact.force", "contact.gap"), 150.0 * OMEGA**2 / dynamic, rtol=1e-12
    )
    np.testing.assert_allclose(coupled.of("mass.z0", "mass.f0"), -1.0 / dynamic, rtol=1e-12)


@pytest.mark.parametrize("stiffness", [1e8, 8e9, np.inf])
def test_free_wheel_on_a_stiff_contact(stiffness: float) -> None:
    """A receptance 1e4 times the contact's, and 1e7 at the lowest frequency, costs no digit."""
    omega = 2.0 * np.pi * np.geomspace(0.01, 2000.0, 300)
    tonnes, rail = 1.0 / (8e3 * omega**2) + 0j, 1.0 / (1e8 + 4e5j * omega)
    wheel, track = (
        FrequencyResponse(
            name=name,
            omega=omega,
            outputs=("z",),
            inputs=("f",),
            values=np.asarray(values[:, None, None], dtype=np.complex128),
        )
        for name, values in (("wheel", tonnes), ("track", rail))
    )
    ends = ("f", "z")
    joint = spring("contact.force", "contact.gap", first=ends, second=ends, stiffness=stiffness)
    coupled = couple(wheel, track, [joint])
    flexibility = 1.0 / stiffness + rail
    lifted = tonnes * flexibility / (flexibility - tonnes)
    # All are products and quotients, so rounding is all there is.
    np.testing.assert_allclose(coupled.of("wheel.z", "wheel.f"), lifted, rtol=1e-13)
    np.testing.assert_allclose(
        coupled.of("track.z", "contact.gap"), -rail / (flexibility - tonnes), rtol=1e-13
    )
    np.testing.assert_allclose(
        coupled.of("wheel.z", "contact.gap"), -tonnes / (flexibility - tonnes), rtol=1e-13
    )


END = ("f0", "z0")


def test_refusals() -> None:
    shifted = replace(TRACK, omega=OMEGA + 1.0)
    with pytest.raises(ValueError, match="different frequencies"):
        couple(VEHICLE, shifted, JOINTS[:1])
    with pytest.raises(ValueError, match="not all different"):
        couple(VEHICLE, TRACK, [JOINTS[0], JOINTS[0]])
    with pytest.raises(ValueError, match="not all different"):
        couple(VEHICLE, VEHICLE, JOINTS)
    with pytest.raises(ValueError, match="no input"):
        couple(VEHICLE, TRACK, [spring("a", "b", first=("x", "z0"), second=END, stiffness=1.0)])
    with pytest.raises(ValueError, match="must be positive"):
        spring("a", "b", first=END, second=END, stiffness=0.0)
