"""A vehicle whose wheels stand or roll on rails: what its contacts add to its matrices."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.contact.geometry import (
    LEFT,
    OF_WHEELSET,
    RIGHT,
    Cone,
    Geometry,
    TextbookCone,
)
from railcosim.mechanics.contact.wheelset import NAMES, linear_wheelset
from railcosim.parameters import ArgumentError

from .multibody import Multibody
from .train import Train

GRAVITY: dict[str, type[Cone]] = {"normals": Cone, "textbook": TextbookCone}
"""How the weight on conical wheels centres a wheelset, see the two classes."""
OF_RAILS = NAMES[len(OF_WHEELSET) :]
SIDES = {"left": LEFT, "right": RIGHT}


def check_cones(train: Train) -> None:
    """Refuse vehicles that say how their wheels roll, where cones are given instead.

    Raises
    ------
    ArgumentError
        If a vehicle has a table ``[rolling]`` of its own.
    """
    if train.tells_rolling:
        raise ArgumentError(
            "vehicle",
            None,
            "its [rolling] is for the contact law in time, railcosim.vehicle.rolling; here wheels "
            "are cones of --conicity that creep linearly: leave [rolling] out",
        )


def cones_of(body: Multibody, conicity: float, gravity: str = "normals") -> tuple[Cone, ...]:
    """Conical wheels of each wheelset on round heads.

    Parameters
    ----------
    body : Multibody
        Whose wheels.
    conicity : float
        lambda, the tangent of the cone's angle.
    gravity : str
        One of `GRAVITY`.
    """
    return tuple(GRAVITY[gravity](**asdict(one) | {"conicity": conicity}) for one in body.wheels)


@dataclass(frozen=True, kw_only=True)
class Contacts:
    """What the contacts of all wheelsets add, as forces -K q - C dq/dt.

    Attributes
    ----------
    K, C : array, shape (n_wheelsets, 11, 11)
        Of the coordinates `railcosim.mechanics.contact.wheelset.NAMES`.
    """

    K: FloatArray
    C: FloatArray

    def on_rigid_rails(self, body: Multibody) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping of the vehicle's coordinates, each (n, n)."""
        n = len(body.coordinates)
        K, C = self.with_rails(body)
        return K[:n, :n], C[:n, :n]

    def with_rails(self, body: Multibody) -> tuple[FloatArray, FloatArray]:
        """The same of the vehicle's coordinates, then the rails' under each wheelset.

        Those are six a wheelset, y, z and roll of the left rail and of the right one, `OF_RAILS`.
        """
        own, count = len(OF_WHEELSET), body.wheelset_x.size
        n, m = len(body.coordinates), len(NAMES) - own
        S = np.zeros((count, len(NAMES), n + m * count))
        S[:, :own, :n] = of_wheelsets(body)
        for i in range(count):
            S[i, own:, n + m * i : n + m * (i + 1)] = np.eye(m)
        K, C = (np.einsum("iab,ian,ibm->nm", A, S, S, optimize=True) for A in (self.K, self.C))
        return K, C


def of_wheelsets(body: Multibody) -> FloatArray:
    """Coordinates of each wheelset by those of the vehicle, shape (n_wheelsets, 5, n)."""
    at = [[body.at(axle, direction) for direction in OF_WHEELSET] for axle in body.axles]
    return np.eye(len(body.coordinates))[at]


def standing(body: Multibody) -> Contacts:
    """Wheels on springs that are vertical: Hertz's at each static load. No creep."""
    K = np.zeros((body.wheelset_x.size, len(NAMES), len(NAMES)))
    for i, (cone, load) in enumerate(zip(body.wheels, body.wheel_load, strict=True)):
        k = float(cone.patch.ellipse.stiffness(load))
        for name, side in SIDES.items():
            compression = np.zeros(len(NAMES))
            compression[NAMES.index("z")] = 1.0
            compression[NAMES.index("roll")] = side * cone.half_distance
            compression[NAMES.index(f"{name}.rail_z")] = -1.0
            K[i] += k * np.outer(compression, compression)
    return Contacts(K=K, C=np.zeros_like(K))


def creeping(body: Multibody, wheels: Sequence[Geometry]) -> Contacts:
    """Wheels that creep, about straight running at 1 m/s.

    Creepages are velocities over the speed, so the damping of linear creep falls with it; the
    stiffness is that of every speed.
    """
    under = list(zip(wheels, body.wheel_load.tolist(), strict=True))
    made = {one: linear_wheelset(one[0], speed=1.0, load=one[1]) for one in set(under)}
    return Contacts(
        K=np.array([made[one].K for one in under]), C=np.array([made[one].C for one in under])
    )


def gyroscopes(body: Multibody, wheels: Sequence[Geometry]) -> FloatArray:
    """Moments of turning axles by their rates at 1 m/s, shape (n_wheelsets, 11, 11).

    An axle that turns by -speed/r0 about y has an angular momentum along it, which a yaw turns
    forward and a roll up: moments about x and z are needed for it.
    """
    spins = [body.at(axle, "spin") for axle in body.axles]
    momentum = np.diag(body.M)[spins] / [wheel.radius for wheel in wheels]
    roll, yaw = NAMES.index("roll"), NAMES.index("yaw")
    G = np.zeros((len(wheels), len(NAMES), len(NAMES)))
    G[:, roll, yaw], G[:, yaw, roll] = momentum, -momentum
    return G


def rolling(body: Multibody, wheels: Sequence[Geometry]) -> Callable[[float], Contacts]:
    """Wheels that creep, and axles as gyroscopes, by the speed, m/s."""
    slow, turning = creeping(body, wheels), gyroscopes(body, wheels)
    return lambda speed: Contacts(K=slow.K, C=slow.C / speed + speed * turning)
