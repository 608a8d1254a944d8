"""Wheel and rail by their profiles: where they touch is tabulated once, each wheel by itself.

A profile is of a right wheel or rail: y outwards, z down. The table says, by how far the wheel has
gone outwards on its rail, down to where it touches; with that, how the two press follows from an
energy. Two-point contact is left out: at most one place of a wheel carries, and where it jumps, so
do the forces' directions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray
from .creep import Patch

Rows: TypeAlias = NDArray[np.int_]

MOST_POINTS = 2000  # of a profile; its spline is a full matrix
SEARCHED = 4001  # places across, to find the nearest; Newton's method does the rest
POLISHED = 20  # steps of it, at most halves of what is searched
PER_LOAD = ("along", "across", "C", "C11", "C22", "C23", "C33")
COLUMNS = ("height", "slope", "y", "z", "lever", "travel", "bow", "sinking", *PER_LOAD)
"""Of a table, in the order in which FMUs have them."""


class ProfileError(ValueError):
    """Profiles that do not touch as wheel and rail do; one line says where."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A profile through points, as a natural cubic spline.

    Attributes
    ----------
    y, z : array, shape (n,)
        Outwards, growing, and down, from the profile's reference point, m.

    Raises
    ------
    ProfileError
        If there are too few or too many points, or they do not go outwards.
    """

    y: FloatArray
    z: FloatArray

    def __post_init__(self) -> None:
        n = self.y.size
        if not 4 <= n <= MOST_POINTS or self.z.size != n:
            raise ProfileError(f"a profile of {n} points: must be 4 to {MOST_POINTS}")
        if not (np.all(np.isfinite(self.y)) and np.all(np.isfinite(self.z))):
            raise ProfileError("a profile with a number that is not finite")
        if np.any(np.diff(self.y) <= 0):
            i = int(np.argmax(np.diff(self.y) <= 0)) + 1
            raise ProfileError(
                f"point {i + 1} of a profile, y = {self.y[i]:g} m, is not farther out than that "
                "before: list them outwards; walls that stand upright are left out"
            )

    @cached_property
    def _bends(self) -> FloatArray:
        """Second derivatives at the points."""
        h, slope = np.diff(self.y), np.diff(self.z) / np.diff(self.y)
        A = np.diag(2 * (h[:-1] + h[1:])) + np.diag(h[1:-1], 1) + np.diag(h[1:-1], -1)
        return np.concatenate([[0.0], np.linalg.solve(A, 6 * np.diff(slope)), [0.0]])

    def at(self, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Height, slope and second derivative."""
        i = np.clip(np.searchsorted(self.y, y) - 1, 0, self.y.size - 2)
        h, m0, m1 = np.diff(self.y)[i], self._bends[i], self._bends[i + 1]
        b = (y - self.y[i]) / h
        a = 1 - b
        step = (self.z[i + 1] - self.z[i]) / h
        value = a * self.z[i] + b * self.z[i + 1]
        value = value + ((a**3 - a) * m0 + (b**3 - b) * m1) * h**2 / 6
        slope = step + ((3 * b**2 - 1) * m1 - (3 * a**2 - 1) * m0) * h / 6
        return value, slope, a * m0 + b * m1


@dataclass(frozen=True, kw_only=True, eq=False)
class ProfileTable:
    """One wheel on its rail, by its relative displacement outwards, u.

    Attributes
    ----------
    first, step : float
        Of the displacements, m.
    columns : dict of array, shape (n,)
        ``height`` and ``slope`` of the wheel's reference point where it touches, from the rail's
        datum, down, and its derivative; ``y`` and ``z`` of the contact from the wheel's reference
        point; ``lever`` and ``bow``, the first derivative of that height by a roll of the wheel and
        less the second; ``travel``, how far the contact goes outwards per roll; ``sinking``, see
        `Cone.yaw_sinking`; and what is of the `Patch`.
    """

    first: float
    step: float
    columns: dict[str, FloatArray]


def tabulate(
    wheel: Curve,
    rail: Curve,
    displacement: FloatArray,
    *,
    radius: float,
    half_distance: float,
    shear_modulus: float,
    poisson_ratio: float,
) -> ProfileTable:
    """Find where a wheel touches its rail.

    Parameters
    ----------
    wheel, rail : Curve
        From the wheel's and the rail's reference point.
    displacement : array, shape (n,)
        Equally spaced, outwards, m: 0 where the reference points are one above the other.
    radius : float
        Of the wheel at its reference point, m.
    half_distance : float
        Of the reference points from the middle, m.
    shear_modulus, poisson_ratio : float
        Of wheel and rail.

    Returns
    -------
    ProfileTable

    Raises
    ------
    ProfileError
        If they touch at an end of a profile, or along a line.
    ValueError
        If a contact ellipse is longer than Kalker's table has it.

    References
    ----------
    Wickens, A. H. (2003), Fundamentals of Rail Vehicle Dynamics, Swets & Zeitlinger, chapter 2.
    """
    u = displacement
    y = _nearest(wheel, rail, u)
    z_wheel, slope, bend_wheel = wheel.at(y)
    z_rail, _, bend_rail = rail.at(y + u)
    bend = bend_rail - bend_wheel  # of the gap
    if np.any(bend <= 0):
        raise ProfileError(f"at u = {u[np.argmin(bend)]:g} m wheel and rail touch along a line")
    down = 1 / np.sqrt(1 + slope**2)  # the cosine of the contact angle, whose tangent is -slope
    r = radius + z_wheel
    patch = Patch.of(
        down / r, bend * down**3, shear_modulus=shear_modulus, poisson_ratio=poisson_ratio
    )
    own = {**vars(patch.ellipse), **vars(patch.kalker)}
    columns = {
        "height": z_rail - z_wheel,
        "slope": slope,
        "y": y,
        "z": z_wheel,
        "lever": -y - slope * z_wheel,
        "travel": 1 / (bend * down**2),
        "bow": 1 / (bend * down**4),
        "sinking": (half_distance + y + r * slope) * -slope * down,
        **{name: own[name] for name in PER_LOAD},
    }
    return ProfileTable(first=float(u[0]), step=float(u[1] - u[0]), columns=columns)


def _nearest(wheel: Curve, rail: Curve, u: FloatArray) -> FloatArray:
    """Where, from the wheel's reference point, the gap is least, shape (n,)."""
    low = np.maximum(wheel.y[0], rail.y[0] - u)
    high = np.minimum(wheel.y[-1], rail.y[-1] - u)
    if np.any(high <= low):
        raise ProfileError(f"at u = {u[np.argmax(high <= low)]:g} m the wheel is beside its rail")
    part = np.linspace(0, 1, SEARCHED)
    y = low[:, None] + (high - low)[:, None] * part
    gap = rail.at(y + u[:, None])[0] - wheel.at(y)[0]
    best = np.argmin(gap, axis=1)
    at_end = (best == 0) | (best == SEARCHED - 1)
    if np.any(at_end):
        raise ProfileError(
            f"at u = {u[np.argmax(at_end)]:g} m the profiles touch at the end of one of them: "
            "they must reach farther, or the displacements less far"
        )
    y, width = y[np.arange(u.size), best], (high - low) / (SEARCHED - 1)
    for _ in range(POLISHED):
        _, slope, bend = rail.at(y + u)
        _, slope_wheel, bend_wheel = wheel.at(y)
        bend = np.maximum(np.abs(bend - bend_wheel), 1e-9)
        y = y - np.clip((slope - slope_wheel) / bend, -width / 2, width / 2)
    return np.asarray(y)
