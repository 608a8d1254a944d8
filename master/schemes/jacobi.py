"""Jacobi coupling: all components step at once, with inputs from the step's beginning."""

from __future__ import annotations

from dataclasses import dataclass

from railcosim.master.continuation import NAMES
from railcosim.master.schemes import (
    AT_END,
    ONE_EVALUATION,
    StepReport,
    check_degree,
    set_continuations,
)
from railcosim.master.schemes.family import Family
from railcosim.master.system import System


@dataclass(frozen=True)
class Jacobi:
    """See `jacobi`."""

    degree: int

    @property
    def order(self) -> int:
        """Order of the error in the step."""
        return self.degree + 1

    def start(self, system: System) -> JacobiStepper:
        """Ask all components for the same polynomial; see `Scheme.start`."""
        return JacobiStepper(system, self.degree)

    def describe(self) -> str:
        """Name with settings."""
        return f"Jacobi, {NAMES[self.degree]} inputs"

    __str__ = describe


class JacobiStepper:
    """See `Stepper`; it remembers nothing."""

    memory = None
    stops = AT_END

    def __init__(self, system: System, degree: int) -> None:
        everybody = tuple(range(len(system.components)))
        self.fallbacks = set_continuations(system, degree, dict.fromkeys(everybody, False))
        self._system = system
        self._everybody = everybody

    def step(self, t: float, h: float) -> StepReport:
        """Step all, then exchange; see `Stepper.step`."""
        system = self._system
        system.step(self._everybody, t, h)
        system.exchange()
        return ONE_EVALUATION


def jacobi(*, degree: int = 1) -> Jacobi:
    """Couple in parallel.

    Parameters
    ----------
    degree : int, optional
        Of the polynomial by which inputs are extrapolated over a step: 0 constant, 1 linear, 2
        quadratic. The order of the error is one more; the largest stable step is often less.

    Returns
    -------
    Jacobi
        The scheme.

    Raises
    ------
    ValueError
        For another degree.

    References
    ----------
    .. [1] M. Busch, Zur effizienten Kopplung von Simulationsprogrammen, PhD thesis, Kassel, 2012.
    """
    check_degree(degree)
    return Jacobi(degree)


FAMILIES = (Family(name="jacobi", make=lambda degree, first: jacobi(degree=degree)),)
