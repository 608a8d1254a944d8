"""Gauss-Seidel coupling: components step one after the other, later ones knowing more.

One hold serves all inputs of a component, so all of them have to be of one instant. The rule:

- components without inputs (signals) step first, so their outputs are always known at the end;
- a component all of whose feeders have stepped gets its inputs at the END of the step, and
  interpolates to them (linear) or holds them (constant);
- any other component gets all its inputs at the BEGINNING of the step, also those that are known
  later already, and extrapolates (linear) or holds them (constant).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from weakref import WeakKeyDictionary

from railcosim.master.component import Hold
from railcosim.master.schemes import (
    ONE_EVALUATION,
    StepReport,
    check_extrapolation,
    extrapolation_name,
    set_holds,
)
from railcosim.master.system import System


@dataclass(frozen=True)
class _Turn:
    """One component's place in the order."""

    component: int
    inputs_at_end: bool
    """Whether all its feeders have stepped before it."""


@dataclass(frozen=True)
class GaussSeidel:
    """See `gauss_seidel`."""

    first: tuple[str, ...]
    extrapolation: int
    _turns: WeakKeyDictionary[System, tuple[_Turn, ...]] = field(
        default_factory=WeakKeyDictionary, init=False, repr=False, compare=False
    )

    def prepare(self, system: System) -> tuple[str, ...]:
        """Settle the order and the holds; see `Scheme.prepare`."""
        turns = self._turns[system] = _take_turns(system, self.first)
        linear = (Hold.EXTRAPOLATE, Hold.INTERPOLATE)
        holds = {
            turn.component: linear[turn.inputs_at_end] if self.extrapolation else Hold.CONSTANT
            for turn in turns
        }
        return set_holds(system, holds)

    def step(self, system: System, t: float, h: float) -> StepReport:
        """Step one after the other, then exchange; see `Scheme.step`."""
        turns = self._turns.get(system)
        if turns is None:
            raise RuntimeError(f"{self}: call prepare(system) before the first step")
        for turn in turns:
            k = turn.component
            if turn.inputs_at_end:
                system.feed(k)
            system.step(k, t, h)
            if system.hold(k) is Hold.EXTRAPOLATE:
                system.extend_inputs(k, t + h)
            system.refresh(k)
        system.exchange()
        return ONE_EVALUATION

    def describe(self) -> str:
        """Name with settings."""
        order = ", then ".join(self.first)
        return f"Gauss-Seidel, {order} first, {extrapolation_name(self.extrapolation)} inputs"

    __str__ = describe


def gauss_seidel(*, first: str | tuple[str, ...], extrapolation: int = 1) -> GaussSeidel:
    """Couple in sequence.

    Parameters
    ----------
    first : str or tuple of str
        Name of the component that steps first, or several in order; the others follow in the
        order of the system.
    extrapolation : int, optional
        0 holds inputs constant: first order. 1 extrapolates the inputs of the first component and
        interpolates those of the others: second order.

    Returns
    -------
    GaussSeidel
        The scheme. To be prepared for a system before its first step.

    Raises
    ------
    ValueError
        For another extrapolation, or nobody named.

    References
    ----------
    .. [1] M. Busch, Zur effizienten Kopplung von Simulationsprogrammen, PhD thesis, Kassel, 2012.
    """
    check_extrapolation(extrapolation)
    names = (first,) if isinstance(first, str) else tuple(first)
    if not names or len(set(names)) < len(names):
        raise ValueError(f"first must name one or several different components, got {first!r}")
    return GaussSeidel(names, extrapolation)


def _take_turns(system: System, first: tuple[str, ...]) -> tuple[_Turn, ...]:
    """Find the order of the components, and what each of them knows."""
    everybody = range(len(system.components))
    signals = [k for k in everybody if not system.components[k].inputs]
    named = [k for k in map(system.index, first) if k not in signals]
    order = [*signals, *named, *(k for k in everybody if k not in {*signals, *named})]
    return tuple(
        _Turn(k, inputs_at_end=system.feeders(k) <= set(order[:i])) for i, k in enumerate(order)
    )
