"""The coordinates of a free vehicle's bodies, beside its modes.

Needs numpy only: a copy of this file travels in every FMU.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .arrays import ComplexArray, FloatArray

APART = 1e-9  # of unit heights: what is less is rounding of the mode shapes


@dataclass(frozen=True, kw_only=True)
class Coordinates:
    """Those of the bodies of a free vehicle, and how it rests on wheelsets held at given heights.

    Attributes
    ----------
    bodies : tuple of str
        Names of the bodies.
    names : tuple of str
        Of the coordinates: a body's name and its direction, ``carbody.z``; those first that even
        modes move.
    even : int
        How many these are.
    wheelsets : array of int, shape (wheelsets,)
        Places of the wheelsets' vertical ones.
    modes : array, shape (c, n)
        Displacements per mode.
    rigid : array, shape (c, n_rigid)
        Mass-normalised rigid-body modes.
    through : array, shape (c, rows)
        Acceleration at once per force, even or odd as the coordinate is.
    start_s, start_r : array, shape (n, wheelsets) and (n_rigid, wheelsets)
        The state at rest per height.
    wheelset_x : array, shape (wheelsets,)
        Wheelsets, forward, m.
    """

    bodies: tuple[str, ...]
    names: tuple[str, ...]
    even: int
    wheelsets: NDArray[np.intp]
    modes: ComplexArray
    rigid: FloatArray
    through: FloatArray
    start_s: ComplexArray
    start_r: FloatArray
    wheelset_x: FloatArray

    def place(self, body: str, direction: str) -> int | None:
        """Which coordinate a body's direction is; None if it has no such one."""
        name = f"{body}.{direction}"
        return self.names.index(name) if name in self.names else None

    @property
    def following(self) -> FloatArray:
        """Displacements at rest per height of a wheelset, shape (c, wheelsets)."""
        moved: FloatArray = self.rigid @ self.start_r + (self.modes @ self.start_s).real
        return np.where(np.abs(moved) > APART, moved, 0.0)

    @property
    def strained(self) -> NDArray[np.bool_]:
        """Which modes a wheelset's height alone strains, shape (n, wheelsets).

        None where the bodies above can follow any heights.
        """
        size = np.abs(self.modes).max(axis=0)[:, None]
        felt: NDArray[np.bool_] = size * np.abs(self.start_s) > APART
        return felt
