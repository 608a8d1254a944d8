"""From what speed on something grows: poles of a vehicle that creeps, against its speed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from .eigenmodes import SLOW, poles_of
from .multibody import Multibody
from .on_rails import cones_of, rolling

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Matrices: TypeAlias = tuple[FloatArray, FloatArray, FloatArray | ComplexArray]

GROWS = 1e-6  # 1/s: by a tenth in a day; poles of what nothing damps are rounded by 1e-9
SETTLED = 1e-9  # of the speed


@dataclass(frozen=True, kw_only=True)
class Critical:
    """Where growth begins.

    Attributes
    ----------
    speed : float
        m/s; nan if nothing grows up to the last speed.
    frequency : float
        At which it swings, Hz.
    """

    speed: float
    frequency: float


def on_rigid_rails(
    body: Multibody, conicity: float, gravity: str = "normals"
) -> Callable[[float], Matrices]:
    """M, C and K of a vehicle whose wheels creep on rigid rails, by the speed, m/s."""
    contacts = rolling(body, cones_of(body, conicity, gravity))

    def at(speed: float) -> Matrices:
        K, C = contacts(speed).on_rigid_rails(body)
        return body.M, body.C + C, body.K + K

    return at


def on_rails(
    body: Multibody, conicity: float, gravity: str, compliance: ComplexArray
) -> Callable[[float], Matrices]:
    """The same on rails that give way, and have no mass but what their compliance knows of.

    Parameters
    ----------
    body, conicity, gravity
        See `on_rigid_rails`.
    compliance : array, shape (6 n_wheelsets, 6 n_wheelsets)
        Of the rails' coordinates, see `Contacts.with_rails`; at one frequency, so of the poles only
        those that swing at it, neither growing nor decaying, are vehicle's and track's.
    """
    contacts = rolling(body, cones_of(body, conicity, gravity))
    n, m = len(body.coordinates), len(compliance)
    M, C_v = np.zeros((2, n + m, n + m))
    M[:n, :n], C_v[:n, :n] = body.M, body.C
    K_both = np.zeros((n + m, n + m), complex)
    K_both[:n, :n], K_both[n:, n:] = body.K, np.linalg.inv(compliance)

    def at(speed: float) -> Matrices:
        K, C = contacts(speed).with_rails(body)
        return M, C_v + C, K_both + K

    return at


def critical_speed(matrices: Callable[[float], Matrices], speeds: FloatArray) -> Critical:
    """The lowest speed from which on something grows.

    Parameters
    ----------
    matrices : callable
        M, C and K by the speed, m/s.
    speeds : array, shape (n,)
        Where growth is looked for, increasing; between two of them its beginning is found by
        halving.

    Returns
    -------
    Critical
        NaN where nothing grows; 0 and no frequency if something does at the first of them already.
    """
    before = None
    for speed in speeds.tolist():
        if _greatest(matrices(speed)).real > GROWS:
            break
        before = speed
    else:
        return Critical(speed=np.nan, frequency=np.nan)
    if before is None:
        return Critical(speed=0.0, frequency=np.nan)
    low, high = before, speed
    while high - low > SETTLED * high:
        middle = (low + high) / 2
        if _greatest(matrices(middle)).real > GROWS:
            high = middle
        else:
            low = middle
    return Critical(speed=high, frequency=abs(_greatest(matrices(high)).imag) / (2 * np.pi))


def _greatest(matrices: Matrices) -> complex:
    """The pole that grows fastest, or decays slowest."""
    poles, _ = poles_of(*matrices)
    moving = poles[(np.abs(poles) > SLOW) & (poles.imag >= 0)]
    return complex(moving[np.argmax(moving.real)])


def root_locus(
    matrices: Callable[[float], Matrices], speeds: Sequence[float], highest: float
) -> ComplexArray:
    """Poles that swing, followed over the speed.

    Parameters
    ----------
    matrices : callable
        M, C and K by the speed, m/s.
    speeds : sequence of float
        m/s, close to each other.
    highest : float
        Frequency, Hz: poles that stay above are left out.

    Returns
    -------
    array, shape (n_speeds, n_poles)
        rad/s; nan where a pole does not swing.
    """
    rows: list[ComplexArray] = []
    for speed in speeds:
        poles, _ = poles_of(*matrices(speed))
        found = poles[(poles.imag > 0) & (np.abs(poles) > SLOW)]
        rows.append(_in_the_order_of(rows[-1], found) if rows else found)
    width = max(row.size for row in rows)
    locus = np.full((len(rows), width), complex(np.nan, np.nan))
    for row, found in zip(locus, rows, strict=True):
        row[: found.size] = found
    low = np.nanmin(np.abs(locus.imag), axis=0) < 2 * np.pi * highest
    return locus[:, low]


def _in_the_order_of(before: ComplexArray, found: ComplexArray) -> ComplexArray:
    """Poles in the columns of the nearest ones before; new ones behind."""
    there = np.flatnonzero(np.isfinite(before))
    old, new = linear_sum_assignment(np.abs(before[there][:, None] - found))
    others = np.setdiff1d(np.arange(found.size), new)
    row = np.full(before.size + others.size, complex(np.nan, np.nan))
    row[there[old]] = found[new]
    row[before.size :] = found[others]
    return row
