"""Iterated coupling with Aitken's dynamic relaxation."""

from __future__ import annotations

import math
from dataclasses import dataclass

from railcosim.master.component import FloatArray
from railcosim.master.schemes.family import Family
from railcosim.master.schemes.iteration import Iterated, Until


@dataclass(frozen=True)
class Aitken:
    """The method; see `aitken`."""

    relaxation: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.relaxation) and self.relaxation > 0.0):
            raise ValueError(f"relaxation must be positive, got {self.relaxation!r}")

    def start(self) -> AitkenAcceleration:
        """Go to work; see `Method`."""
        return AitkenAcceleration(self.relaxation)

    def describe(self) -> str:
        """Name."""
        return "Aitken"


class AitkenAcceleration:
    """See `Acceleration`; it remembers the relaxation factor."""

    def __init__(self, relaxation: float) -> None:
        self.memory: float = relaxation
        self._before: FloatArray | None = None

    def begin(self, h: float) -> None:
        """Begin with the last step's factor; see `Acceleration`."""
        self._before = None

    def improve(self, x: FloatArray, residual: FloatArray, weight: FloatArray) -> FloatArray:
        """Go a part of the residual; see `Acceleration`."""
        if self._before is not None:
            before, change = self._before / weight, (residual - self._before) / weight
            square = float(change @ change)
            if square > 0.0:
                self.memory = -self.memory * float(before @ change) / square
        self._before = residual
        return x + self.memory * residual

    def end(self, x: FloatArray, residual: FloatArray) -> None:
        """Do nothing; see `Acceleration`."""


_DEFAULT = Until()


def aitken(*, degree: int = 1, relaxation: float = 0.5, until: Until = _DEFAULT) -> Iterated:
    """Iterate with one relaxation factor for all values, found anew in every iteration.

    Parameters
    ----------
    degree : int, optional
        Of the polynomial by which inputs go to their values at the end of a step: 0 constant, at
        that value, 1 linear, 2 quadratic. The order of the error is one more.
    relaxation : float, optional
        The factor that the first step begins with; later ones begin with the last one found.
    until : Until, optional
        Tolerances, and what happens if they are not met.

    Returns
    -------
    Iterated
        The scheme. It needs components that can go back to a saved state.

    Raises
    ------
    ValueError
        For another degree, or a factor that is not positive.

    References
    ----------
    .. [1] U. Küttler, W. A. Wall, Fixed-point fluid-structure interaction solvers with dynamic
       relaxation, Computational Mechanics 43 (2008) 61-72.
    """
    return Iterated(Aitken(relaxation), degree, until)


FAMILIES = (Family(name="aitken", make=lambda degree, first: aitken(degree=degree), linear=False),)
