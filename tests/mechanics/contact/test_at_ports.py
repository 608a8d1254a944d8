"""The rolling law at ports: signs by hand, power, what both sides feel, tangents."""

import numpy as np
import pytest

from railcosim.mechanics.contact.at_ports import PORTS, AtPorts
from railcosim.mechanics.contact.geometry import COORDINATES, LEFT, RIGHT, Cone
from railcosim.mechanics.contact.rolling import RollingContact
from railcosim.mechanics.contact.saturation import Saturated
from railcosim.mechanics.contact.wheelset import at_rest

B, R0 = 0.75, 0.43
CONE = Cone(
    radius=R0, half_distance=B, conicity=0.1, head_radius=0.3, shear_modulus=8e10, poisson_ratio=0.3
)
LAW = RollingContact(
    geometry=CONE, side=np.array([LEFT, RIGHT]), speed=50.0, creep=Saturated(friction=0.3)
)
PORTED = AtPorts(contact=LAW, half_distance=B)
NAMES = [f"{face.name}_{direction.name}" for face, direction in PORTS]


def at_ports(coordinates: np.ndarray) -> np.ndarray:
    """Motions of the material points by rigid-body kinematics: u + rotation x arm."""
    motions = np.zeros_like(coordinates)
    for k, side in enumerate((-1.0, 1.0)):
        y, z, roll, spin, yaw, *rail = coordinates[k]
        u = np.array([0.0, y, z]) + np.cross([roll, spin, yaw], [0.0, side * B, R0])
        motions[k] = [u[2], u[1], roll, u[0], yaw, rail[1], rail[0], rail[2]]
    return motions


def moved(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A wheelset pressed onto its rails, off the middle, and sliding."""
    rng = np.random.default_rng(seed)
    q = at_rest(LAW, 80e3) + 1e-6 * rng.standard_normal((2, 8))
    q[:, 0] += 2e-4
    v = 0.05 * rng.standard_normal((2, 8))
    for motion in (q, v):  # one wheelset
        motion[1, :5] = motion[0, :5]
    return q, v


def test_order() -> None:
    assert [
        *(f"wheel_{name}" for name in ("z", "y", "roll", "x", "yaw")),
        *(f"rail_{name}" for name in ("z", "y", "roll")),
    ] == NAMES


@pytest.mark.parametrize("seed", range(3))
def test_power_is_the_same(seed: int) -> None:
    """Forces times rates: at the wheels' and rails' data as by the wheelset's coordinates."""
    q, v = moved(seed)
    signs = np.array([-1.0] * 5 + [1.0] * 3)
    at_data = (signs * PORTED.force(at_ports(q), at_ports(v)) * at_ports(v)).sum()
    assert at_data == pytest.approx((LAW.force(q, v) * v).sum(), rel=1e-12)  # rounding


def test_both_feel_the_same_force_and_other_moments() -> None:
    """Down and to the right action is reaction. The moment about each one's own datum differs by
    the force times the way between the data: 0.2 mm and 80 kN, but for what is of second order."""
    q, v = moved(0)
    motions = at_ports(q)
    force = dict(zip(NAMES, PORTED.force(motions, at_ports(v)).T, strict=True))
    motion = dict(zip(NAMES, motions.T, strict=True))
    assert force["wheel_z"] == pytest.approx(force["rail_z"], rel=1e-12)
    assert force["wheel_y"] == pytest.approx(force["rail_y"], rel=1e-9)
    assert force["rail_z"] == pytest.approx(80e3, rel=0.5)  # presses the rail down: positive
    apart_y, apart_z = (motion[f"wheel_{d}"] - motion[f"rail_{d}"] for d in "yz")
    turned = apart_y * force["rail_z"] - apart_z * force["rail_y"]
    assert np.abs(turned).min() > 5.0
    # What is left: arms that turn, 0.75 m (1 - cos roll) and the like, of rolls of 1e-6.
    assert force["rail_roll"] - force["wheel_roll"] == pytest.approx(turned, abs=0.1)


def test_creep_drags_the_rail_along() -> None:
    """A wheel that slides forward, or to the right, takes its rail with it."""
    q, still = at_rest(LAW, 80e3), np.zeros((2, 8))
    for coordinate, name, sliding in (("spin", "wheel_x", 0.1), ("y", "rail_y", 0.1)):
        v = still.copy()
        v[:, COORDINATES.index(coordinate)] = sliding
        change = PORTED.force(at_ports(q), at_ports(v)) - PORTED.force(at_ports(q), still)
        assert (change[:, NAMES.index(name)] > 1e3).all()


def test_tangents() -> None:
    """Against central differences, whose own error is some 1e-7 of the largest."""
    q, v = (at_ports(motion) for motion in moved(1))
    for which, exact in enumerate(PORTED.tangents(q, v)):
        for k in range(8):
            step = np.zeros((2, 8))
            step[:, k] = (1e-8, 1e-5)[which]
            ends = [(q + s * step, v) if which == 0 else (q, v + s * step) for s in (1, -1)]
            slope = (PORTED.force(*ends[0]) - PORTED.force(*ends[1])) / (2 * step[0, k])
            np.testing.assert_allclose(exact[:, :, k], slope, atol=1e-5 * np.abs(exact).max())
