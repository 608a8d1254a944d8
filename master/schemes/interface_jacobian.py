"""Interface-Jacobian coupling: the master solves the contact law against both sides' compliance.

A step begins with a trial under forces carried over from the last one. How the motions at the law
answer to the forces over the step, the compliance, was measured once; with it the law is solved
for all springs together, and the step made again with the forces found. If components are linear
and the compliance is right, that is all: two evaluations, one where the forces were foreseen.
What the motions then differ by from what was foretold corrects the compliance, not the law.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.law import Law
from railcosim.master.schemes import ConvergenceError, StepReport, check_rollback
from railcosim.master.schemes.compliance import Balance, broyden
from railcosim.master.schemes.family import Family
from railcosim.master.schemes.sweep import Sweep
from railcosim.master.schemes.variants import AVERAGE_HOLD, VARIANTS, Variant
from railcosim.master.system import System

_ENOUGH = 4
"""Evaluations of a step; if one takes more, the compliance is measured again."""
_SAME = 1e-9
"""Relative difference of steps that is rounding."""
_KEPT = 4
"""Step lengths whose compliance is kept: a step, its halves, and the step before it was changed."""
_TRIAL = 1e-3
"""Change of a force to measure by, of its size: far above rounding, and small for a component that
is not linear."""


@dataclass(frozen=True)
class InterfaceJacobian:
    """See `interface_jacobian`."""

    variant: Variant
    tolerance: float
    max_evaluations: int

    @property
    def order(self) -> int:
        """Order of the error in the step."""
        return self.variant.order

    def start(self, system: System) -> InterfaceJacobianStepper:
        """Find the law, and what it acts on; see `Scheme.start`."""
        return InterfaceJacobianStepper(system, self)

    def describe(self) -> str:
        """Name with settings."""
        return f"interface Jacobian, {self.variant.name}"

    __str__ = describe


def interface_jacobian(
    *,
    variant: Variant = AVERAGE_HOLD,
    tolerance: float = 0.05,
    max_evaluations: int = 10,
) -> InterfaceJacobian:
    """Couple by solving the law between components for its forces.

    Parameters
    ----------
    variant : Variant, optional
        Which polynomial of the forces is held over a step: `AVERAGE_HOLD`, `RADAU_2`, `HERMITE`,
        `CONSERVING_4` or `CONSERVING_6`.
    tolerance : float, optional
        A step is evaluated twice, and again while a further evaluation would change a force by
        more than this, in the largest force or its nominal value. Where the compliance is right
        the change is rounding. While wheels roll it is off by a few per cent, and so is what is
        left of a blow after the first correction; a tighter tolerance takes a third evaluation
        there. On our pair that makes no difference to the error below steps of 0.5 ms.
    max_evaluations : int, optional
        So many evaluations of one step without reaching the tolerance are an error.

    Returns
    -------
    InterfaceJacobian
        The scheme. It needs a `Law` in the system, and components that can go back to a saved
        state.

    Raises
    ------
    ValueError
        For a tolerance or number that makes no sense.

    References
    ----------
    .. [1] S. Sicklinger et al., Interface Jacobian-based co-simulation, Int. J. Numer. Meth. Engng
       98 (2014) 418-444.
    """
    if not 0.0 < tolerance < 1.0:
        raise ValueError(f"tolerance must be between 0 and 1, got {tolerance!r}")
    if max_evaluations < 2:
        raise ValueError(f"max_evaluations must be at least 2, got {max_evaluations!r}")
    return InterfaceJacobian(variant, tolerance, max_evaluations)


class _Memory(NamedTuple):
    """What the next step needs of the last one.

    Attributes
    ----------
    h : float
        Its length, s.
    force : array, shape (degree + 1, n_forces)
        Legendre coefficients of the forces, N.
    samples : array
        See `Sweep`.
    compliances : tuple of (float, array)
        Lengths of steps (s) and what was found for them, see `Balance`; the latest first.
    carried : array
        Over it, see `Drift`.
    inverse : array
        See `Balance`.
    """

    h: float
    force: FloatArray
    samples: FloatArray
    compliances: tuple[tuple[float, FloatArray], ...]
    carried: FloatArray
    inverse: FloatArray


class InterfaceJacobianStepper:
    """See `Stepper`."""

    fallbacks: tuple[str, ...]
    stops: tuple[float, ...]

    def __init__(self, system: System, scheme: InterfaceJacobian) -> None:
        self._memory: _Memory | None = None
        self._system, self._scheme = system, scheme
        check_rollback(system)
        self._law, place = _find_law(system)
        if scheme.variant.rates and self._law.rates.size:
            raise ValueError(
                f"the variant {scheme.variant.name} begins a step with the rates of its beginning, "
                f"and {self._law.name} asks for rates, which may jump with its forces there: use "
                "average-hold, radau-2, conserving-4 or conserving-6"
            )
        self._sweep = Sweep(system, place, scheme.variant)
        self.fallbacks, self.stops = self._sweep.fallbacks, self._sweep.stops
        self._balance = Balance(self._law, self._sweep.nodes)
        self._nominal = max(v.nominal for v in self._law.outputs)

    @property
    def memory(self) -> Any:
        """What the next step needs of the last one; None before the first."""
        return self._memory

    @memory.setter
    def memory(self, memory: Any) -> None:
        self._memory = None if memory is None else _Memory(*memory)
        self._balance.inverse = None if self._memory is None else self._memory.inverse

    def step(self, t: float, h: float) -> StepReport:
        """Try, solve, step, and compare; see `Stepper.step`."""
        sweep, scheme, balance = self._sweep, self._scheme, self._balance
        force, G = self._begin(h)
        given = sweep.look_ahead(t, h) + sweep.nodes.begin(sweep.beginning(h), h)
        states = sweep.save()
        found = sweep.run(t, h, force)
        trials = 0
        if G is None:
            G, found, trials = self._measure(t, h, states, force, found)
        evaluations, residual = 1, np.inf
        while residual > scheme.tolerance:
            if evaluations == scheme.max_evaluations:
                raise ConvergenceError(self._give_up(residual))
            better = balance.solve(h, G, self._start(h, given, found), force)
            sweep.restore(states)
            answer = sweep.run(t, h, better)
            evaluations += 1
            G = broyden(G, better - force, answer - found, float(np.abs(found).max()))
            force, found = better, answer
            wrong = balance.wrong(h, G, self._start(h, given, found), force)
            residual = wrong / self._scale(force)
        self._tell_rates(h)
        carried = sweep.drift.carried[-1].copy()
        assert balance.inverse is not None
        self._memory = _Memory(
            h, force, sweep.samples, self._kept(h, G, evaluations), carried, balance.inverse
        )
        self._system.exchange()
        return StepReport(evaluations + trials, residual, converged=True)

    def _kept(
        self, h: float, G: FloatArray, evaluations: int
    ) -> tuple[tuple[float, FloatArray], ...]:
        """Compliances to remember after a step."""
        known = self._memory.compliances if self._memory else ()
        others = tuple((length, other) for length, other in known if not _same(length, h))
        return ((h, G), *others)[:_KEPT] if evaluations <= _ENOUGH else others

    def _start(self, h: float, given: FloatArray, found: FloatArray) -> FloatArray:
        """Motions of the law at the nodes, as they were found."""
        return given + self._sweep.nodes.answer(found, h, self._sweep.drift.at_points())

    def _tell_rates(self, h: float) -> None:
        """Let the law know the rates at the end of a step; see `Law.tell`."""
        drift, before = self._sweep.drift, self._memory
        if drift.inputs.size:
            past = None if before is None else (before.samples[0], before.carried)
            ratio = 1.0 if before is None else before.h / h
            self._law.tell(drift.inputs, drift.end_rates(past, ratio, h, self._sweep.samples))

    def _give_up(self, residual: float) -> str:
        """Say what failed, and what to do."""
        scheme = self._scheme
        return (
            f"after {scheme.max_evaluations} evaluations the forces of {self._law.name} still "
            f"change by {residual:.3g} of the largest (tolerance {scheme.tolerance:g}): use a "
            "shorter step, another variant, or a larger tolerance or max_evaluations"
        )

    def _begin(self, h: float) -> tuple[FloatArray, FloatArray | None]:
        """Forces to begin with, and the compliance if it is known."""
        memory, variant = self._memory, self._scheme.variant
        if memory is None:
            self._sweep.predict(None, 1.0)
            force = np.zeros((variant.degree + 1, len(self._law.outputs)))
            force[0] = self._law.y
            return force, None
        ratio = h / memory.h
        if not _same(memory.h, h):  # those of rates are by the step
            self._balance.inverse = None
        self._sweep.predict(memory.samples, ratio)
        # The mean of the last step, held. Longer polynomials foresee more where all is smooth, and
        # far too much where it is not: after a blow, or in steps too long for the contact.
        force = np.zeros_like(memory.force)
        force[0] = memory.force[0]
        return force, next((G for length, G in memory.compliances if _same(length, h)), None)

    def _measure(
        self, t: float, h: float, states: Any, force: FloatArray, found: FloatArray
    ) -> tuple[FloatArray, FloatArray, int]:
        """Measure the compliance about a step just made.

        Returns
        -------
        compliance : array
            See `Balance`.
        found : array
            What the step, where it had to be made again, found.
        trials : int
            How many steps that took.
        """
        derivative = self._sweep.derivative()
        if derivative is not None:
            return derivative, found, 0
        amplitude = _TRIAL * self._scale(force)
        G = np.empty((*found.shape, *force.shape))
        for place in np.ndindex(force.shape):
            changed = force.copy()
            changed[place] += amplitude
            self._sweep.restore(states)
            G[(..., *place)] = (self._sweep.run(t, h, changed) - found) / amplitude
        self._sweep.restore(states)
        return G, self._sweep.run(t, h, force), force.size + 1

    def _scale(self, force: FloatArray) -> float:
        """Yardstick for forces, N."""
        return max(float(np.abs(force).max()), self._nominal)


def _same(length: float, h: float) -> bool:
    """Whether two steps differ by rounding only."""
    return abs(length - h) <= _SAME * h


def _find_law(system: System) -> tuple[Law, int]:
    """Find the one law of a system, and its index."""
    laws = [k for k, component in enumerate(system.components) if isinstance(component, Law)]
    if len(laws) != 1:
        raise ValueError(
            f"the scheme interface-jacobian solves one law in the master, and the system has "
            f"{len(laws)}: let the master own the contact, or use another scheme"
        )
    law = system.components[laws[0]]
    assert isinstance(law, Law)
    return law, laws[0]


def _family(name: str, variant: Variant) -> Family:
    """One variant; the degree of its polynomials is its own."""
    return Family(
        name="interface-jacobian" + (f"-{name}" if variant is not AVERAGE_HOLD else ""),
        make=lambda degree, first: interface_jacobian(variant=variant),
        degrees=(1,),
        solves_law=True,
    )


FAMILIES = tuple(_family(name, variant) for name, variant in VARIANTS.items())
