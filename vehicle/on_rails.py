"""A vehicle whose wheels stand or roll on rails: what its contacts add to its matrices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.contact.geometry import LEFT, OF_WHEELSET, RIGHT, Cone, TextbookCone
from railcosim.mechanics.contact.wheelset import NAMES, linear_wheelset

from .multibody import Multibody
from .train import Train

FloatArray = NDArray[np.float64]

GRAVITY: dict[str, type[Cone]] = {"normals": Cone, "textbook": TextbookCone}
"""How the weight on conical wheels centres a wheelset, see the two classes."""
SIDES = {"left": LEFT, "right": RIGHT}


def cone_of(train: Train, conicity: float, gravity: str = "normals") -> Cone:
    """Conical wheels of a train on round heads.

    Parameters
    ----------
    train : Train
        Whose [wheelset] radius and [contact].
    conicity : float
        lambda, the tangent of the cone's angle.
    gravity : str
        One of `GRAVITY`.
    """
    vehicle = train.vehicles[0].vehicle
    steel = vehicle.contact
    return GRAVITY[gravity](
        radius=vehicle.wheelset.radius,
        half_distance=steel.half_distance,
        conicity=conicity,
        head_radius=steel.rail_radius,
        shear_modulus=steel.young_modulus / (2 * (1 + steel.poisson_ratio)),
        poisson_ratio=steel.poisson_ratio,
    )


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
        own = slice(0, len(OF_WHEELSET))
        S = of_wheelsets(body)
        K, C = (np.einsum("iab,ian,ibm->nm", A[:, own, own], S, S) for A in (self.K, self.C))
        return K, C


def of_wheelsets(body: Multibody) -> FloatArray:
    """Coordinates of each wheelset by those of the vehicle, shape (n_wheelsets, 5, n)."""
    axles = body.names[len(body.names) - body.wheelset_x.size :]
    at = [[body.at(axle, direction) for direction in OF_WHEELSET] for axle in axles]
    return np.eye(len(body.coordinates))[at]


def standing(body: Multibody, cone: Cone) -> Contacts:
    """Wheels on springs that are vertical: Hertz's at each static load. No creep."""
    k = cone.patch.ellipse.stiffness(body.wheel_load)
    K = np.zeros((k.size, len(NAMES), len(NAMES)))
    for name, side in SIDES.items():
        compression = np.zeros(len(NAMES))
        compression[NAMES.index("z")] = 1.0
        compression[NAMES.index("roll")] = side * cone.half_distance
        compression[NAMES.index(f"{name}.rail_z")] = -1.0
        K += k[:, None, None] * np.outer(compression, compression)
    return Contacts(K=K, C=np.zeros_like(K))


def rolling(body: Multibody, cone: Cone, speed: float) -> Contacts:
    """Wheels that creep, about straight running at a speed, m/s; and axles as gyroscopes.

    An axle that turns by -speed/r0 about y has an angular momentum along it, which a yaw turns
    forward and a roll down: moments about x and z are needed for it.
    """
    made = {
        load: linear_wheelset(cone, speed=speed, load=load)
        for load in set(body.wheel_load.tolist())
    }
    K, C = (np.array([getattr(made[load], of) for load in body.wheel_load.tolist()]) for of in "KC")
    spins = [body.at(f"wheelset[{i + 1}]", "spin") for i in range(body.wheelset_x.size)]
    momentum = np.diag(body.M)[spins] * speed / cone.radius
    roll, yaw = NAMES.index("roll"), NAMES.index("yaw")
    C[:, roll, yaw] += momentum
    C[:, yaw, roll] -= momentum
    return Contacts(K=K, C=C)
