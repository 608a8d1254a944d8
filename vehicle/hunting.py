"""From what speed on something grows: poles of a vehicle that creeps, against its speed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from .eigenmodes import SLOW

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Poles: TypeAlias = Callable[[float], ComplexArray]
"""All poles (rad/s) by the speed (m/s); real ones exactly so."""

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


def critical_speed(poles: Poles, speeds: FloatArray) -> Critical:
    """The lowest speed from which on something grows.

    Parameters
    ----------
    poles : callable
        By the speed.
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
        if greatest(poles(speed)).real > GROWS:
            break
        before = speed
    else:
        return Critical(speed=np.nan, frequency=np.nan)
    if before is None:
        return Critical(speed=0.0, frequency=np.nan)
    low, high = before, speed
    while high - low > SETTLED * high:
        middle = (low + high) / 2
        if greatest(poles(middle)).real > GROWS:
            high = middle
        else:
            low = middle
    return Critical(speed=high, frequency=abs(greatest(poles(high)).imag) / (2 * np.pi))


def greatest(poles: ComplexArray) -> complex:
    """The pole that grows fastest, or decays slowest."""
    moving = poles[(np.abs(poles) > SLOW) & (poles.imag >= 0)]
    return complex(moving[np.argmax(moving.real)])


def root_locus(poles_at: Poles, speeds: Sequence[float], highest: float) -> ComplexArray:
    """Poles that swing, followed over the speed.

    Parameters
    ----------
    poles_at : callable
        By the speed.
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
        poles = poles_at(speed)
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
