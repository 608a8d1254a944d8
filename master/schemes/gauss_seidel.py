"""Gauss-Seidel coupling: components step one after the other, later ones knowing more.

One polynomial serves all inputs of a component, so all of them have to be of one instant. The rule:

- components without inputs (signals) step first, so their outputs are always known at the end;
- a component all of whose feeders have stepped gets its inputs at the END of the step, and
  interpolates to them, or holds them;
- any other component gets all its inputs at the BEGINNING of the step, also those that are known
  later already, and extrapolates, or holds them.
"""

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
class GaussSeidel:
    """See `gauss_seidel`."""

    first: tuple[str, ...]
    degree: int

    @property
    def order(self) -> int:
        """Order of the error in the step."""
        return self.degree + 1

    def start(self, system: System) -> GaussSeidelStepper:
        """Settle the order and the polynomials; see `Scheme.start`."""
        return GaussSeidelStepper(system, self.first, self.degree)

    def describe(self) -> str:
        """Name with settings."""
        order = ", then ".join(self.first)
        return f"Gauss-Seidel, {order} first, {NAMES[self.degree]} inputs"

    __str__ = describe


class GaussSeidelStepper:
    """See `Stepper`; it remembers nothing."""

    memory = None
    stops = AT_END

    def __init__(self, system: System, first: tuple[str, ...], degree: int) -> None:
        self._system = system
        self._turns = _take_turns(system, first)
        self._last = self._turns[-1][0]
        self.fallbacks = set_continuations(system, degree, dict(self._turns))

    def step(self, t: float, h: float) -> StepReport:
        """Step one after the other, then exchange; see `Stepper.step`."""
        system = self._system
        for k, at_end in self._turns:
            if at_end:
                system.step_towards(k, t, h, system.gather(k))
            else:
                system.step((k,), t, h)
            if k == self._last:  # nobody asks for it before the exchange, which reads it
                break
            if system.reacts(k):
                system.write_inputs(k)
            system.refresh(k)
        system.exchange()
        return ONE_EVALUATION


def gauss_seidel(*, first: str | tuple[str, ...], degree: int = 1) -> GaussSeidel:
    """Couple in sequence.

    Parameters
    ----------
    first : str or tuple of str
        Name of the component that steps first, or several in order; the others follow in the
        order of the system.
    degree : int, optional
        Of the polynomials by which the first component's inputs are extrapolated over a step and
        the others' interpolated: 0 constant, 1 linear, 2 quadratic. The order of the error is one
        more.

    Returns
    -------
    GaussSeidel
        The scheme.

    Raises
    ------
    ValueError
        For another degree, or nobody named.

    References
    ----------
    .. [1] M. Busch, Zur effizienten Kopplung von Simulationsprogrammen, PhD thesis, Kassel, 2012.
    """
    check_degree(degree)
    names = (first,) if isinstance(first, str) else tuple(first)
    if not names or len(set(names)) < len(names):
        raise ValueError(f"first must name one or several different components, got {first!r}")
    return GaussSeidel(names, degree)


def _take_turns(system: System, first: tuple[str, ...]) -> tuple[tuple[int, bool], ...]:
    """Find the order of the components, and whether all that feeds each one steps before it."""
    everybody = range(len(system.components))
    signals = [k for k in everybody if not system.components[k].inputs]
    named = [k for k in map(system.index, first) if k not in signals]
    order = [*signals, *named, *(k for k in everybody if k not in {*signals, *named})]
    return tuple((k, system.feeders(k) <= set(order[:i])) for i, k in enumerate(order))


FAMILIES = (
    Family(
        name="gauss-seidel",
        make=lambda degree, first: gauss_seidel(first=first, degree=degree),
        sequential=True,
    ),
)
