"""Iterated coupling by the fixed-point iteration: the next guess is what the step gave."""

from __future__ import annotations

from dataclasses import dataclass

from railcosim.master.component import FloatArray
from railcosim.master.schemes.family import Family
from railcosim.master.schemes.iteration import Iterated, Until


@dataclass(frozen=True)
class Picard:
    """The method; it has no settings."""

    def start(self) -> PicardAcceleration:
        """Go to work; see `Method`."""
        return PicardAcceleration()

    def describe(self) -> str:
        """Name."""
        return "Picard"


class PicardAcceleration:
    """See `Acceleration`; it remembers nothing."""

    memory: None = None

    def begin(self, h: float) -> None:
        """Do nothing; see `Acceleration`."""

    def improve(self, x: FloatArray, residual: FloatArray, weight: FloatArray) -> FloatArray:
        """Give what the step gave; see `Acceleration`."""
        return x + residual

    def end(self, x: FloatArray, residual: FloatArray) -> None:
        """Do nothing; see `Acceleration`."""


_DEFAULT = Until()


def picard(*, degree: int = 1, until: Until = _DEFAULT) -> Iterated:
    """Iterate by the fixed-point iteration.

    It converges for short steps only: over a stiff spring a change of a guess comes back larger,
    with the other sign.

    Parameters
    ----------
    degree : int, optional
        Of the polynomial by which inputs go to their values at the end of a step: 0 constant, at
        that value, 1 linear, 2 quadratic. The order of the error is one more.
    until : Until, optional
        Tolerances, and what happens if they are not met.

    Returns
    -------
    Iterated
        The scheme. It needs components that can go back to a saved state.

    Raises
    ------
    ValueError
        For another degree.

    References
    ----------
    .. [1] R. Kübler, W. Schiehlen, Two methods of simulator coupling, Mathematical and Computer
       Modelling of Dynamical Systems 6 (2000) 93-113.
    """
    return Iterated(Picard(), degree, until)


FAMILIES = (Family(name="picard", make=lambda degree, first: picard(degree=degree)),)
