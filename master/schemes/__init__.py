"""Coupling schemes, one a file; what they have in common.

A scheme is a frozen object made by the factory in its file, for instance
``railcosim.master.schemes.jacobi.jacobi``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from railcosim.master.component import Hold
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
    """

    evaluations: int
    residual: float
    converged: bool


ONE_EVALUATION = StepReport(evaluations=1, residual=math.nan, converged=True)
"""The report of a scheme that steps everything once and measures nothing."""


class Scheme(Protocol):
    """A way to take coupled components over one communication step."""

    def prepare(self, system: System) -> tuple[str, ...]:
        """Set how the components hold their inputs; may be called again.

        Returns
        -------
        tuple of str
            A sentence for every component that cannot do what the scheme asks and falls back.

        Raises
        ------
        ValueError
            If the scheme does not suit the system.
        """

    def step(self, system: System, t: float, h: float) -> StepReport:
        """Take `system`, consistent at `t`, to `t + h` (s), consistent again."""

    def describe(self) -> str:
        """Name with settings, for people and for results."""


def check_extrapolation(extrapolation: int) -> None:
    """Refuse what no component can do."""
    if extrapolation not in (0, 1):
        raise ValueError(f"extrapolation must be 0 (constant) or 1 (linear), got {extrapolation!r}")


def extrapolation_name(extrapolation: int) -> str:
    """``constant`` or ``linear``."""
    return ("constant", "linear")[extrapolation]


def set_holds(system: System, holds: dict[int, Hold]) -> tuple[str, ...]:
    """Set the hold of every component that has inputs, and gather what they cannot do.

    Parameters
    ----------
    system : System
        The components.
    holds : dict of int to Hold
        By index of component.

    Returns
    -------
    tuple of str
        A sentence for each fallback.
    """
    sentences = (
        system.set_hold(k, hold) for k, hold in holds.items() if system.components[k].inputs
    )
    return tuple(sentence for sentence in sentences if sentence is not None)
