"""Coupling schemes, one a file; what they have in common.

A scheme is a frozen object made by the factory in its file, for instance
``railcosim.master.schemes.jacobi.jacobi``. Started on a system it gives a stepper.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from railcosim.master.component import ComponentError
from railcosim.master.continuation import NAMES
from railcosim.master.system import System


@dataclass(frozen=True, slots=True)
class StepReport:
    """How a communication step went.

    Attributes
    ----------
    evaluations : int
        How often each component was stepped.
    residual : float
        What was left open at the end of the step; NaN if the scheme does not measure it.
    converged : bool
        Whether the scheme reached what it aims at; always, if it does not iterate.
    error : float
        Estimate of the error that the step added, in what is allowed; NaN if steps are not
        controlled.
    rejections : int
        How often a longer step was tried in vain; those evaluations count.
    """

    evaluations: int
    residual: float
    converged: bool
    error: float = math.nan
    rejections: int = 0


ONE_EVALUATION = StepReport(evaluations=1, residual=math.nan, converged=True)
"""The report of a scheme that steps everything once and measures nothing."""

AT_END: tuple[float, ...] = (1.0,)
"""Where a step stops if it does nowhere but at its end; see `Stepper.stops`."""


class Stepper(Protocol):
    """A scheme at work on one system.

    Attributes
    ----------
    fallbacks : tuple of str
        A sentence for every component that cannot do what the scheme asks for.
    memory : object
        Everything beyond the system's own state that decides the next steps: numbers, arrays, and
        tuples of them, never changed in place; None if there is nothing. Setting it goes back.
    stops : tuple of float
        Where in a step components without inputs are asked, in steps from its beginning.
    """

    fallbacks: tuple[str, ...]
    memory: Any
    stops: tuple[float, ...]

    def step(self, t: float, h: float) -> StepReport:
        """Take the system, consistent at `t`, to `t + h` (s), consistent again."""


class Scheme(Protocol):
    """A way to take coupled components over a communication step."""

    @property
    def order(self) -> int:
        """Order of the error in the step, if every component can do what is asked."""

    def start(self, system: System) -> Stepper:
        """Prepare the components, and go to work.

        Raises
        ------
        ValueError
            If the scheme does not suit the system.
        """

    def describe(self) -> str:
        """Name with settings, for people and for results."""


class ConvergenceError(ComponentError):
    """An iteration did not find the values exchanged; says which is open, and by how much.

    A run ends by it as by any step that could not be made.
    """


def check_rollback(system: System) -> None:
    """Refuse components that cannot go back to a saved state, and tell the others that they will.

    Raises
    ------
    ValueError
        Naming the first, and what is wrong with it.
    """
    for component in system.components:
        fault = component.rollback_fault
        if fault is not None:
            raise ValueError(
                f"{component.name} cannot go back to a saved state, which is needed to repeat a "
                f"step: {fault}. Use jacobi or gauss-seidel with a fixed step, or another FMU"
            )
        component.keep_past()


def check_degree(degree: int) -> None:
    """Refuse polynomials that nobody has."""
    if degree not in range(len(NAMES)):
        raise ValueError(
            f"degree must be 0 (constant), 1 (linear) or 2 (quadratic), got {degree!r}"
        )


def set_continuations(system: System, degree: int, at_end: Mapping[int, bool]) -> tuple[str, ...]:
    """Choose how the inputs of all components that have some go on over a step.

    Parameters
    ----------
    system : System
        The components.
    degree : int
        Of the polynomial.
    at_end : mapping of int to bool
        By index of component: whether its inputs at the end of a step are known.

    Returns
    -------
    tuple of str
        A sentence for each component that can only do with a lower degree.
    """
    sentences = (
        system.set_continuation(k, degree, at_end=known)
        for k, known in at_end.items()
        if system.components[k].inputs
    )
    return tuple(sentence for sentence in sentences if sentence is not None)
