"""The nonlinear law: tangents, energy, and Newton's method over a step with velocities."""

from dataclasses import dataclass

import numpy as np
import pytest

from railcosim.mechanics.contact.creep import LINEAR
from railcosim.mechanics.contact.fastsim import Fastsim
from railcosim.mechanics.contact.geometry import LEFT, RIGHT, Cone, TextbookCone
from railcosim.mechanics.contact.numbers import derivatives
from railcosim.mechanics.contact.rolling import Flange, OfMotion, RollingContact, slip
from railcosim.mechanics.contact.saturation import Saturated
from railcosim.mechanics.contact.wheelset import at_rest, selection
from railcosim.mechanics.solve import solve_compression

SIDES = np.array([LEFT, RIGHT])
KEYS = {
    "radius": 0.43, "half_distance": 0.7465, "conicity": 0.05, "head_radius": 0.3,
    "shear_modulus": 2.059e11 / 2.6, "poisson_ratio": 0.3,
}  # fmt: skip
CONE, TEXTBOOK = Cone(**KEYS), TextbookCone(**KEYS)
LOAD, SPEED = 79265.0, 30.0
FLANGE = Flange(stiffness=2e7, clearance=5e-3)
SHEN, FASTSIM = Saturated(friction=0.3), Fastsim(friction=0.3, slices=8, strips=6)
CREEP = pytest.mark.parametrize("creep", [LINEAR, SHEN, FASTSIM], ids=["linear", "Shen", "FASTSIM"])
S = selection()


@dataclass(frozen=True)
class NoCreep:
    def force(self, patch, normal, creepage):
        return 0 * creepage


def law(creep=LINEAR, geometry=CONE, flange=FLANGE):
    return RollingContact(geometry=geometry, side=SIDES, speed=SPEED, creep=creep, flange=flange)


def motions(seed):
    """Coordinates and rates; some wheels off the rail, some flanges closed."""
    random = np.random.default_rng(seed)
    q = random.normal(size=(2, 8)) * [3e-3, 3e-5, 3e-5, 0.1, 3e-3, 3e-4, 3e-5, 1e-4]
    q[:, 1] += 9e-5
    return q, random.normal(size=(2, 8)) * [0.05, 0.02, 0.03, 0.2, 0.05, 0.03, 0.02, 0.1]


@CREEP
@pytest.mark.parametrize("geometry", [CONE, TEXTBOOK], ids=["normals", "textbook"])
def test_tangents_against_differences(creep, geometry):
    rolling = law(creep, geometry)
    for seed in range(4):
        q, v = motions(seed)
        by_q, by_v = rolling.tangents(q, v)
        for j in range(8):
            step = np.eye(8)[j]
            for h, found, way in ((1e-9, by_q, (step, 0)), (1e-7, by_v, (0, step))):
                ahead, behind = (
                    rolling.force(q + s * h * way[0], v + s * h * way[1]) for s in (1, -1)
                )
                difference = (ahead - behind) / (2 * h)
                size = np.abs(found).max()
                # Rounding of 1e5 N: 1e-11 / 1e-9; curvature (h / 1e-5 m)^2.
                assert found[..., j] == pytest.approx(difference, rel=1e-5, abs=1e-7 * size)


def stored(rolling, q):
    """Energy in Hertz's springs and the flanges, J."""
    touch = rolling.geometry.touch(q, SIDES)
    closed = np.where(touch.compression.real > 0, touch.compression, 0)
    beyond = SIDES * (q[..., 0] - 0.444 * q[..., 2] - q[..., 5] + 0.014 * q[..., 7]) - 5e-3
    beyond = np.where(beyond.real > 0, beyond, 0)
    return 0.4 * touch.patch.ellipse.C * closed**2.5 + FLANGE.stiffness * beyond**2 / 2


@pytest.mark.parametrize("geometry", [CONE, TEXTBOOK], ids=["normals", "textbook"])
def test_without_creep_forces_are_the_gradient_of_an_energy(geometry):
    rolling = law(NoCreep(), geometry)
    felt = set()
    for seed in range(20):
        q, v = motions(seed)
        by = derivatives(lambda x: stored(rolling, x)[..., None], q)[:, 0]
        force = rolling.force(q, v)
        assert force == pytest.approx(-by, rel=1e-9, abs=1e-9 * np.abs(force).max())
        felt |= set((rolling.normal_force(q) > 0).tolist())
    assert felt == {True, False}


@CREEP
def test_creep_only_takes(creep):
    """The power of tangential forces on what slides, and what all forces do with it."""
    rolling = law(creep)
    for seed in range(20):
        q, v = motions(seed)
        creepage, force = rolling.creep_forces(q, v)
        lost = SPEED * (creepage * force).sum(axis=1)
        assert lost.max() <= 0
        # Of it, what the vehicle's pull gives, and the rates of coordinates.
        pull = SPEED * (slip(CONE.touch(q, SIDES), q, CONE.radius).rolling * force).sum(axis=1)
        elastic = (derivatives(lambda x: stored(rolling, x)[..., None], q)[:, 0] * v).sum(axis=1)
        power = (rolling.force(q, v) * v).sum(axis=1)
        assert power == pytest.approx(lost - pull - elastic, rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_what_wheels_do_to_rails_turns_the_wheelset_back(seed):
    """The opposite, at the same point, is the yaw moment on the wheelset: x F_y - y F_x + M_z."""
    rolling, (q, v) = law(SHEN), motions(seed)
    f_x, f_y, f_z, m_x, m_z = np.moveaxis(rolling.at_datum(q, v), -1, 0)
    force = rolling.force(q, v)
    assert force[:, 5:] == pytest.approx(np.stack([f_y, f_z, m_x], axis=1))
    arm = SIDES * CONE.half_distance + q[:, 5] - q[:, 0]
    # Gravity's part to the first order: 1e5 N, yaw of 3e-3, slope of 0.05, 3 mm on the wheel.
    assert force[:, 4] == pytest.approx(-(m_z - arm * f_x), abs=0.2)


def test_a_wheel_that_is_held_to_the_right_pushes_its_rails():
    """Both rails to the right by the creep of a wheelset that slides to the right, and down."""
    rolling = law()
    rest = at_rest(rolling, LOAD)
    v = np.zeros((2, 8))
    v[:, 0] = 0.02
    change = rolling.at_datum(rest, v) - rolling.at_datum(rest, 0 * v)
    assert change[:, 1].min() > 0
    assert rolling.at_datum(rest, v)[:, 2].min() > 0.9 * LOAD
    # A wheelset that turns too slowly draws its rails forward with it.
    slow = np.zeros((2, 8))
    slow[:, 3] = 0.1  # about +y: less than the -V / r0 of rolling
    assert rolling.at_datum(rest, slow)[:, 0].min() > 0


# --- a wheelset on two rails over time ----------------------------------------------------------

MASS = np.diag([1680, 1680, 773.3, 130, 770.0, *2 * [60.0, 60.0, 0.3]])
SPRINGS = np.diag([2e5, 2e5, 2e5, 0, 2e5, *2 * [1e7, 3e7, 6e4]])


def stepped(rolling, q, v, h, count):
    """Trapezoidal rule; forces by Newton's method from what motions would be without them.

    Yields (q, v, contact forces) of the eleven coordinates.
    """
    B = S.reshape(16, 11)
    left = MASS + h**2 / 4 * SPRINGS
    answer = np.linalg.solve(left, B.T)  # acceleration at the end per force
    gain = np.concatenate([(S @ (h**2 / 4 * answer)), (S @ (h / 2 * answer))], axis=1).reshape(
        32, 16
    )
    weight = np.zeros(11)
    weight[1] = 2 * LOAD
    force = B.T @ rolling.force(S @ q, S @ v).ravel()
    a = np.linalg.solve(MASS, force + weight - SPRINGS @ q)
    motion = None
    yield q, v, force
    for _ in range(count):
        ahead_q, ahead_v = q + h * v + h**2 / 4 * a, v + h / 2 * a
        free = np.linalg.solve(left, weight - SPRINGS @ ahead_q)
        q_free, v_free = ahead_q + h**2 / 4 * free, ahead_v + h / 2 * free
        gap = np.concatenate([S @ q_free, S @ v_free], axis=1).ravel()
        motion = solve_compression(OfMotion(rolling), -gain, gap, gap if motion is None else motion)
        contact = OfMotion(rolling).force(motion.reshape(2, 16)).ravel()
        a = free + answer @ contact
        q, v = ahead_q + h**2 / 4 * a, ahead_v + h / 2 * a
        force = B.T @ contact
        yield q, v, force


def start(rolling, kick):
    rest = at_rest(rolling, LOAD)[0]
    q = np.zeros(11)
    q[:5] = rest[:5]
    q[[6, 9]] = LOAD / 3e7  # rails sunk; the wheelset with them
    q[1] += LOAD / 3e7
    v = np.zeros(11)
    v[:5] = kick
    return q, v


def energy(rolling, q, v):
    held = stored(rolling, S @ q).sum() + q @ SPRINGS @ q / 2 - 2 * LOAD * q[1]
    return held + v @ MASS @ v / 2


def test_energy_over_time_without_creep():
    """Kept, to the second order of the trapezoidal rule; flanges hit, wheels nearly lift."""
    rolling = law(NoCreep())
    drift = []
    for h in (2e-4, 1e-4):
        q, v = start(rolling, [0.15, 0.05, 0.1, 0, 0.1])
        all_energies = [
            energy(rolling, q, v) for q, v, _ in stepped(rolling, q, v, h, round(0.03 / h))
        ]
        drift.append(np.abs(np.array(all_energies) - all_energies[0]).max())
    kinetic = 1680 * 0.15**2 / 2
    assert drift[-1] < 1e-2 * kinetic
    assert drift[0] > 3 * drift[1]


@CREEP
def test_energy_over_time_with_creep(creep):
    """What is lost is what slides; the pull that keeps the speed gives the rest."""
    rolling = law(creep)
    q, v = start(rolling, [0.1, 0, 0, 0, 0.05])
    h = 1e-4
    balance, levels = [], []
    for q_now, v_now, _ in stepped(rolling, q, v, h, 60):
        creepage, force = rolling.creep_forces(S @ q_now, S @ v_now)
        rolled = slip(CONE.touch(S @ q_now, SIDES), S @ q_now, CONE.radius).rolling
        balance.append(SPEED * ((creepage - rolled) * force).sum())
        levels.append(energy(rolling, q_now, v_now))
    balance, levels = np.array(balance), np.array(levels)
    work = np.concatenate([[0], np.cumsum(h * (balance[1:] + balance[:-1]) / 2)])
    assert levels - levels[0] == pytest.approx(work, abs=0.04 * np.ptp(levels))  # of h, as h^2
    assert levels[-1] < levels[0]


@CREEP
@pytest.mark.parametrize("seed", range(6))
def test_newton_from_anywhere(creep, seed):
    """Random compliances and motions; also wheels off the rail, closed flanges, full sliding."""
    random = np.random.default_rng(seed)
    rolling = law(creep)
    A = random.normal(size=(16, 16)) * np.tile([1, 1, 1.3, 2, 1.3, 2, 2, 10], 2)[:, None]
    h = 1e-3
    response = A @ A.T / 16 / 1000  # of an inverse mass matrix
    gain = np.stack(
        [(h**2 / 4 * response).reshape(2, 8, 16), (h / 2 * response).reshape(2, 8, 16)], 1
    )
    gain = gain.reshape(32, 16)
    q, v = motions(seed + 50)
    gap = np.concatenate([q, v], axis=1).ravel()
    found = solve_compression(OfMotion(rolling), -gain, gap, gap)
    force = OfMotion(rolling).force(found.reshape(2, 16)).ravel()
    assert found == pytest.approx(gap + gain @ force, rel=1e-9, abs=1e-13)
