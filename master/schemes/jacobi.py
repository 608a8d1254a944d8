"""Jacobi coupling: all components step at once, with inputs from the step's beginning."""

from __future__ import annotations

from dataclasses import dataclass

from railcosim.master.component import Hold
from railcosim.master.schemes import (
    ONE_EVALUATION,
    StepReport,
    check_extrapolation,
    extrapolation_name,
    set_holds,
)
from railcosim.master.system import System

_HOLDS = (Hold.CONSTANT, Hold.EXTRAPOLATE)


@dataclass(frozen=True)
class Jacobi:
    """See `jacobi`."""

    extrapolation: int

    def prepare(self, system: System) -> tuple[str, ...]:
        """Ask all components for the same hold; see `Scheme.prepare`."""
        hold = _HOLDS[self.extrapolation]
        return set_holds(system, dict.fromkeys(range(len(system.components)), hold))

    def step(self, system: System, t: float, h: float) -> StepReport:
        """Step all, then exchange; see `Scheme.step`."""
        for k in range(len(system.components)):
            system.step(k, t, h)
        system.exchange()
        return ONE_EVALUATION

    def describe(self) -> str:
        """Name with settings."""
        return f"Jacobi, {extrapolation_name(self.extrapolation)} inputs"

    __str__ = describe


def jacobi(*, extrapolation: int = 1) -> Jacobi:
    """Couple in parallel.

    Parameters
    ----------
    extrapolation : int, optional
        0 holds the inputs constant over a step: first order in the step. 1 extrapolates them
        linearly: second order, but often unstable from a shorter step on.

    Returns
    -------
    Jacobi
        The scheme.

    Raises
    ------
    ValueError
        For another extrapolation.

    References
    ----------
    .. [1] M. Busch, Zur effizienten Kopplung von Simulationsprogrammen, PhD thesis, Kassel, 2012.
    """
    check_extrapolation(extrapolation)
    return Jacobi(extrapolation)
