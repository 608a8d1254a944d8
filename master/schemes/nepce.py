"""Jacobi with constant inputs, corrected for what the hold missed (NEPCE).

Held over a step from `t` to `t + h`, an input misses the area under its change; by the trapezium
rule that is ``(u(t + h) - u(t)) h / 2``. It is a momentum, or a path, that went missing between
the components. Spread over the next step it is made up for, so that the errors of the steps do
not add up, and the coupling is of second order although all inputs are constant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.schemes import AT_END, ONE_EVALUATION, StepReport, set_continuations
from railcosim.master.schemes.family import Family
from railcosim.master.system import System


@dataclass(frozen=True)
class Nepce:
    """See `nepce`."""

    @property
    def order(self) -> int:
        """Order of the error in the step."""
        return 2

    def start(self, system: System) -> NepceStepper:
        """Let all components hold their inputs; see `Scheme.start`."""
        return NepceStepper(system)

    def describe(self) -> str:
        """Name."""
        return "NEPCE, constant inputs"

    __str__ = describe


class NepceStepper:
    """See `Stepper`; it remembers what the last step missed of each component's inputs."""

    stops = AT_END

    def __init__(self, system: System) -> None:
        everybody = range(len(system.components))
        self.fallbacks = set_continuations(system, 0, dict.fromkeys(everybody, False))
        # Length of the last step (s) and half the changes of the inputs over it: so what decides
        # the next step of that length does not depend on the length, as stability supposes.
        self.memory: tuple[float, tuple[FloatArray, ...]] | None = None
        self._system = system
        self._fed = [k for k in everybody if system.components[k].inputs]
        self._signals = tuple(k for k in everybody if not system.components[k].inputs)

    def step(self, t: float, h: float) -> StepReport:
        """Step all with corrected inputs, then exchange; see `Stepper.step`."""
        system = self._system
        before = [system.components[k].u.copy() for k in self._fed]
        last, missed = self.memory or (h, tuple(np.zeros_like(u) for u in before))
        system.step(self._signals, t, h)
        for k, u, half in zip(self._fed, before, missed, strict=True):
            system.step_along(k, t, h, (u + half * (last / h))[None])
        system.exchange()
        halves = [
            (system.components[k].u - u) * 0.5 for k, u in zip(self._fed, before, strict=True)
        ]
        for k, half in zip(self._fed, halves, strict=True):
            half[system.components[k].jumping] = 0.0  # whole numbers are never corrected
        self.memory = h, tuple(halves)
        return ONE_EVALUATION


def nepce() -> Nepce:
    """Couple in parallel, with constant inputs and nearly preserved energy.

    Returns
    -------
    Nepce
        The scheme; it needs nothing of the components.

    References
    ----------
    .. [1] M. Benedikt, D. Watzenig, J. Zehetner, A. Hofer, NEPCE - a nearly energy-preserving
       coupling element for weak-coupled problems and co-simulation, Coupled Problems 2013, Santa
       Eulalia, 1021-1032.
    """
    return Nepce()


FAMILIES = (Family(name="nepce", make=lambda degree, first: nepce(), degrees=(0,)),)
