"""A wheelset on two rails: at rest under its load, and linear about straight running."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import FloatArray
from .creep import LINEAR, CreepLaw
from .geometry import COORDINATES, LEFT, OF_RAIL, OF_WHEELSET, RIGHT, Geometry
from .numbers import Numbers, derivatives
from .rolling import RollingContact

NAMES = (*OF_WHEELSET, *(f"{side}.rail_{name}" for side in ("left", "right") for name in OF_RAIL))
"""Coordinates of a wheelset and its two rails."""
MOST_ITERATIONS = 50  # Newton takes five
SETTLED = 1e-12  # of the load: four digits above rounding


@dataclass(frozen=True, kw_only=True)
class LinearWheelset:
    """Forces of a wheelset's contacts about straight running: -K q - C v.

    Attributes
    ----------
    K, C : array, shape (11, 11)
        Stiffness and damping of the coordinates `NAMES`, in N, m and rad. Neither is symmetric:
        creep is not conservative.
    speed : float
        m/s.
    rest : array, shape (2, 8)
        Coordinates of the left and the right contact there.
    """

    K: FloatArray
    C: FloatArray
    speed: float
    rest: FloatArray


def selection() -> FloatArray:
    """Coordinates of both contacts by those of wheelset and rails, shape (2, 8, 11)."""
    chosen = np.zeros((2, len(COORDINATES), len(NAMES)))
    m = len(OF_WHEELSET)
    for i in range(2):
        chosen[i, :m, :m] = np.eye(m)
        chosen[i, m:, m + 3 * i : m + 3 * i + 3] = np.eye(3)
    return chosen


def at_rest(law: RollingContact, load: float) -> FloatArray:
    """Coordinates at which the wheels of a wheelset press the rails down as they should.

    Parameters
    ----------
    law : RollingContact
        Of a left and a right contact.
    load : float
        Static load of one wheel, N.

    Returns
    -------
    array, shape (2, 8)
        The wheelset stands in the middle, sunk and perhaps rolled; the rails are where they were.

    Raises
    ------
    ValueError
        If the load is not above 0.
    ArithmeticError
        If there is none.
    """
    if not (np.isfinite(load) and load > 0):
        raise ValueError(f"wheel load {load:g} N: must be above 0")
    chosen = selection()
    free = [NAMES.index("z"), NAMES.index("roll")]
    down = COORDINATES.index("rail_z")

    def pressing(x: Numbers) -> Numbers:
        q: Numbers = np.einsum("ijk,...k->...ij", chosen[:, :, free], x)
        found: Numbers = law.force(q, np.zeros_like(q))[..., down]
        return found

    x = np.array([1e-4, 0.0])  # any depth that closes both contacts
    for _ in range(MOST_ITERATIONS):
        missing = load - pressing(x)
        if np.abs(missing).max() <= SETTLED * load:
            return np.asarray(np.einsum("ijk,k->ij", chosen[:, :, free], x))
        x = x + np.linalg.solve(derivatives(pressing, x), missing)
    raise ArithmeticError(f"no rest under a wheel load of {load:g} N: check profiles and load")


def linear_wheelset(
    geometry: Geometry, *, speed: float, load: float, creep: CreepLaw = LINEAR
) -> LinearWheelset:
    """Linearise the contacts of a wheelset about straight running in the middle of its rails.

    K_vt and C_vt of eq. 8 are the parts of wheelset and rails against each other.

    Parameters
    ----------
    geometry : Geometry
        `Cone` has springs along the contact normals, `TextbookCone` the textbook's gravity
        stiffness.
    speed : float
        m/s, above 0.
    load : float
        Static load of one wheel, N.
    creep : CreepLaw
        Kalker's linear one if not given.

    Returns
    -------
    LinearWheelset

    References
    ----------
    Xu, L. & Lu, T. (2021), doi 10.1080/23248378.2020.1811170, eqs 2-8.
    """
    law = RollingContact(
        geometry=geometry,
        side=np.array([LEFT, RIGHT]),
        speed=speed,
        creep=creep,
    )
    rest = at_rest(law, load)
    by_q, by_v = law.tangents(rest, np.zeros_like(rest))
    S = selection()
    K, C = (-np.einsum("nia,nij,njb->ab", S, by, S) for by in (by_q, by_v))
    return LinearWheelset(K=K, C=C, speed=speed, rest=rest)
