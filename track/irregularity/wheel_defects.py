"""Kinds of single defects of a wheel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from railcosim.mechanics.arrays import FloatArray

from .defects import OnWheel, hollow


@dataclass(frozen=True, kw_only=True)
class Flat(OnWheel):
    """A flat whose edges are worn round, d / 2 (1 + cos(2 pi s / l)), d = l^2 / (16 R) deep.

    References
    ----------
    Newton, S. G. & Clark, R. A. (1979), An investigation into the dynamic effects on the track of
    wheelflats on railway vehicles, J. Mech. Eng. Sci. 21(4), 287-297. Wu, T. X. & Thompson, D. J.
    (2002), A hybrid model for the noise generation due to railway wheel flats, J. Sound Vib.
    251(1), 115-139.
    """

    kind: ClassVar[str] = "flat"

    def depth_at(self, s: FloatArray, radius: float) -> FloatArray:
        """See `Defect`."""
        return hollow(s, self.length**2 / (16 * radius), self.length)


@dataclass(frozen=True, kw_only=True)
class FreshFlat(OnWheel):
    """A flat with sharp edges: a chord of the circle, l^2 / (8 R) deep.

    The wheel rolls about one edge, then about the other: its centre falls by (l/2 - |s|)^2 / (2 R)
    and meets a kink in the middle.

    References
    ----------
    See `Flat`.
    """

    kind: ClassVar[str] = "fresh-flat"

    def depth_at(self, s: FloatArray, radius: float) -> FloatArray:
        """See `Defect`."""
        depth: FloatArray = np.maximum(self.length**2 / 4 - s**2, 0.0) / (2 * radius)
        return depth
