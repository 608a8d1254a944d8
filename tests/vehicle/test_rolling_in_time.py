"""A vehicle in space that owns its contacts, on rigid rails: one step, as a linear map.

The eigenvalues of that map are exp(pole h). The poles are those of M, C and K with the contacts
linearised by hand elsewhere, which know of no step.
"""

from pathlib import Path

import numpy as np
import pytest

from railcosim.mechanics.contact.at_ports import AtPorts, Rolls
from railcosim.mechanics.contact.geometry import LEFT, RIGHT, Cone
from railcosim.mechanics.contact.rolling import RollingContact
from railcosim.mechanics.contact.wheelset import at_rest
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.motion import Inputs, Mover, OwnContact
from railcosim.mechanics.ports import WHEEL
from railcosim.mechanics.stepping import State
from railcosim.vehicle.eigenmodes import poles_of
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.hunting import critical_speed
from railcosim.vehicle.modal import vehicle_body
from railcosim.vehicle.multibody import SPATIAL, build_multibody
from railcosim.vehicle.on_rails import cones_of, rolling

CONICITY = 0.1


@pytest.fixture(scope="module")
def wagon():
    return build_multibody(read_stock(Path("wagon")), SPATIAL)


def rolls(cone: Cone, wheelsets: int, speed: float, inertia: float) -> Rolls:
    side = np.repeat([LEFT, RIGHT], wheelsets)
    contact = RollingContact(geometry=cone, side=side, speed=speed, axle_inertia=inertia)
    return Rolls(AtPorts(contact=contact, half_distance=cone.half_distance), WHEEL)


def numbers(state: State) -> np.ndarray:
    return np.concatenate([state.s.real, state.s.imag, state.r, state.v])


def one_step(body: ModalBody, law: Rolls, height: float, h: float) -> np.ndarray:
    """Poles of the step about rest on wheelsets held at a height; real modes stay real."""
    n, r = body.poles.size, body.rigid_out.shape[1]
    there = np.concatenate([np.ones(n), body.poles.imag != 0, np.ones(2 * r)]).astype(bool)
    wheelsets = body.layout.wheelsets
    given = np.zeros((2 * wheelsets, law.given))
    given[:, -1] = law.law.contact.speed
    rails = Inputs(np.zeros(wheelsets), given.ravel())
    mover = Mover(body, OwnContact(law), h)
    rest = numbers(body.on(np.full(wheelsets, height)))

    def after(x: np.ndarray) -> np.ndarray:
        state = State(x[:n] + 1j * x[n : 2 * n], x[2 * n : -r], x[-r:])
        return numbers(mover.step(state, rails, rails, h))

    size = 1e-6 * np.abs(rest).max()
    columns = [after(rest + size * e) - after(rest - size * e) for e in np.eye(rest.size)[there]]
    step = (np.array(columns).T / (2 * size))[there]
    return np.log(np.linalg.eigvals(step).astype(complex)) / h


def matrices(multibody, cones, speed):
    """With the gyroscopic moments of the axles."""
    K, C = rolling(multibody, cones)(speed).on_rigid_rails(multibody)
    return multibody.M, multibody.C + C, multibody.K + K


def test_hunting_begins_at_the_linear_critical_speed(wagon):
    body, cones = vehicle_body(wagon), cones_of(wagon, CONICITY)
    inertia = wagon.M[wagon.at(wagon.axles[0], "spin"), wagon.at(wagon.axles[0], "spin")]
    critical = critical_speed(
        lambda speed: poles_of(*matrices(wagon, cones, speed))[0], np.arange(2.0, 100.0, 4.0)
    )
    assert 2.0 < critical.speed < 98.0
    wheelset = RollingContact(geometry=cones[0], side=np.array([LEFT, RIGHT]), speed=1.0)
    height = at_rest(wheelset, wagon.wheel_load[0])[0, 1]
    for part in (0.98, 1.02):
        speed = part * critical.speed
        exact, _ = poles_of(*matrices(wagon, cones, speed))
        found = one_step(body, rolls(cones[0], 2, speed, inertia), height, 1e-3)
        swinging = found[np.abs(found) > 0.1]
        assert (swinging.real.max() > 0) == (part > 1)
        slow = exact[(exact.imag > 1.0) & (np.abs(exact) < 2 * np.pi * 20)]
        apart = [np.abs(found - pole).min() / abs(pole) for pole in slow]
        # Rest on cones is not quite that of cylinders: wheels turn on by 1e-4 of their speed.
        assert max(apart) < 1e-4, apart
