"""Kalker's simplified theory: tractions along strips of the contact ellipse."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Generic

import numpy as np

from ..arrays import FloatArray
from .creep import Patch
from .numbers import Numbers
from .saturation import NO_LOAD


@dataclass(frozen=True, kw_only=True)
class Fastsim:
    """FASTSIM: a bed of springs with Kalker's flexibilities, under a parabolic bound of friction.

    A point of the wheel comes in at the leading edge without traction. Sliding on, it is strained
    by the creepages, and it slips where the traction would exceed the bound. Without spin it
    converges with the square of the slices, with spin as their number: 1 % with 40.

    Attributes
    ----------
    friction : float or array
        Coefficient, above 0; an array: of each contact.
    slices : int
        Along a strip, from the leading to the trailing edge, shorter towards both.
    strips : int
        Across the ellipse, narrower towards its ends.

    References
    ----------
    Kalker, J. J. (1982), A fast algorithm for the simplified theory of rolling contact, Vehicle
    System Dynamics 11, 1-13.
    """

    friction: float | FloatArray
    slices: int = 40
    strips: int = 20

    @cached_property
    def _across(self) -> tuple[FloatArray, FloatArray]:
        """Places of strips over b, and their widths over b: equal parts of the angle."""
        part = np.pi / self.strips
        angle = -np.pi / 2 + part * (np.arange(self.strips) + 0.5)
        return np.sin(angle), np.cos(angle) * part

    @cached_property
    def _along(self) -> list[tuple[float, float, float]]:
        """Where slices end, how long they are, and weights of the trapezoidal rule there.

        Short at the edges: with little creep, the traction falls from its greatest to nothing close
        to the trailing one. Both edges are without traction.
        """
        at = np.cos(np.pi * np.arange(self.slices + 1) / self.slices)
        step = at[:-1] - at[1:]
        weight = (step[:-1] + step[1:]) / 2
        return list(zip(at[1:-1].tolist(), step.tolist(), weight.tolist(), strict=False))

    def force(self, patch: Patch, normal: Numbers, creepage: Numbers) -> Numbers:
        """See `CreepLaw`."""
        pressed: Numbers = np.where(normal.real > NO_LOAD, normal, NO_LOAD)
        a, b = patch.ellipse.semi_axes(pressed)
        greatest = self.friction * 2 * pressed / (np.pi * a * b)
        place, width = self._across
        half = np.sqrt(1 - place**2)  # of a strip's length, over a
        y = b[..., None] * place
        long = a[..., None] * half
        strain = _strain(patch, a, b, creepage)
        p_x, p_y = np.zeros_like(y), np.zeros_like(y)
        sums = [np.zeros_like(y) for _ in range(3)]
        for at, step, weight in self._along:  # over the half-length
            middle = long * (at + step / 2)
            p_x = p_x - step * long * (strain.along[..., None] - strain.spin[..., None] * y)
            p_y = p_y - step * long * (strain.across[..., None] + strain.spin[..., None] * middle)
            p_x, p_y = _bounded(p_x, p_y, greatest[..., None] * (half**2 * (1 - at**2)))
            turning = long * at * p_y - y * p_x
            parts = zip(sums, (p_x, p_y, turning), strict=True)
            sums = [total + weight * part for total, part in parts]
        area = long * (b[..., None] * width)
        found: Numbers = np.stack([(part * area).sum(axis=-1) for part in sums], axis=-1)
        return np.where((normal.real > NO_LOAD)[..., None], found, np.zeros_like(found))


@dataclass(frozen=True)
class _Strain(Generic[Numbers]):
    """Creepages over the flexibilities, shape (...,), N/m3 and, of spin, N/m4."""

    along: Numbers
    across: Numbers
    spin: Numbers


def _strain(patch: Patch, a: Numbers, b: Numbers, creepage: Numbers) -> _Strain[Numbers]:
    """With the flexibilities that give the linear theory where nothing slips."""
    G, C = patch.shear_modulus, patch.kalker
    return _Strain(
        along=creepage[..., 0] * (3 * G * C.C11 / (8 * a)),
        across=creepage[..., 1] * (3 * G * C.C22 / (8 * a)),
        spin=creepage[..., 2] * (4 * G * C.C23 / (np.pi * a * np.sqrt(a / b))),
    )


def _bounded(p_x: Numbers, p_y: Numbers, bound: Numbers) -> tuple[Numbers, Numbers]:
    """Tractions brought back to the bound, N/m2."""
    size2 = p_x**2 + p_y**2
    slips = size2.real > bound.real**2
    back = np.where(slips, bound / np.sqrt(np.where(slips, size2, 1.0)), 1.0)
    return p_x * back, p_y * back
