"""Vertical multibody model: car body and bogies bounce and pitch, wheelsets bounce.

x forward, z down, pitch about y (to the right), so a positive pitch lifts the front. Displacements
are measured from the statically loaded vehicle whose wheels just touch the unloaded track.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from .parameters import Vehicle

FloatArray = NDArray[np.float64]

COORDINATES = (
    "carbody.z",
    "carbody.pitch",
    "bogie[1].z",
    "bogie[1].pitch",
    "bogie[2].z",
    "bogie[2].pitch",
    "wheelset[1].z",
    "wheelset[2].z",
    "wheelset[3].z",
    "wheelset[4].z",
)
WHEELSETS = slice(6, 10)


@dataclass(frozen=True, kw_only=True)
class Multibody:
    """The free vehicle in the coordinates of `COORDINATES`.

    Attributes
    ----------
    M, C, K : array, shape (10, 10)
        Mass, damping, stiffness.
    stretch : array, shape (6, 10)
        Stretch of every suspension per coordinate.
    wheelset_x : array, shape (4,)
        Wheelsets ahead of the car body's centre, from the front, m.
    wheel_load : float
        Static load of one wheel, N.
    """

    M: FloatArray
    C: FloatArray
    K: FloatArray
    stretch: FloatArray
    wheelset_x: FloatArray
    wheel_load: float

    @property
    def rigid_modes(self) -> FloatArray:
        """Motions that stretch no suspension, shape (10, 4).

        Bounce and pitch of the whole vehicle, and each bogie pitching with its two wheelsets.
        """
        modes: FloatArray = null_space(self.stretch)
        return modes


def build_multibody(vehicle: Vehicle) -> Multibody:
    """Assemble M, C and K from the parameters."""
    L_c, L_t = vehicle.geometry.bogie_half_distance, vehicle.geometry.axle_half_distance
    carbody, bogie, wheelset = vehicle.carbody, vehicle.bogie, vehicle.wheelset
    M = np.diag(
        [carbody.mass, carbody.inertia_pitch]
        + 2 * [bogie.mass, bogie.inertia_pitch]
        + 4 * [wheelset.mass]
    )
    stretch = []
    for j, x_bogie in enumerate((L_c, -L_c)):
        row = np.zeros(10)
        row[[0, 1]] = 1, -x_bogie
        row[2 + 2 * j] = -1
        stretch.append(row)
    for i in range(4):
        row = np.zeros(10)
        row[[2 + 2 * (i // 2), 3 + 2 * (i // 2)]] = 1, -(L_t if i % 2 == 0 else -L_t)
        row[6 + i] = -1
        stretch.append(row)
    S = np.array(stretch)
    primary, secondary = vehicle.primary_suspension, vehicle.secondary_suspension
    # Two sides a bogie, two wheels an axle.
    k = 2 * np.array(2 * [secondary.stiffness] + 4 * [primary.stiffness])
    c = 2 * np.array(2 * [secondary.damping] + 4 * [primary.damping])
    return Multibody(
        M=M,
        C=S.T @ (c[:, None] * S),
        K=S.T @ (k[:, None] * S),
        stretch=S,
        wheelset_x=np.array([L_c + L_t, L_c - L_t, -L_c + L_t, -L_c - L_t]),
        wheel_load=vehicle.wheel_load,
    )
