"""How fast a scheme that iterates converges within a step, by running the FMUs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from railcosim.master.cosimulation import cosimulate
from railcosim.master.schemes.iteration import Iterated, Until
from railcosim.master.system import System

EVALUATIONS = 20, 40
"""After so many errors are compared: then the slowest part of them is left."""
NEVER = 1e-15
"""Tolerance that is not met."""
APART = 0.01
"""Distance to a limit, of itself, at which convergence is measured."""


def contraction(system: System, scheme: Iterated, h: float, ready: Callable[[], None]) -> float:
    """What an evaluation leaves of an error in the first step.

    Parameters
    ----------
    system : System
        At rest, to be disturbed at once.
    scheme : Iterated
        The scheme.
    h : float
        Step, s.
    ready : callable
        Puts the system to rest.
    """
    left = []
    for count in EVALUATIONS:
        ready()
        until = Until(relative=NEVER, absolute=NEVER, max_evaluations=count, accept=True)
        *_, point = cosimulate(system, replace(scheme, until=until), h, h)
        assert point.report is not None
        left.append(point.report.residual)
    first, last = EVALUATIONS
    return float((left[1] / left[0]) ** (1.0 / (last - first)))


def longest_that_converges(
    allowed: float, guess: float, measured: Callable[[float], float]
) -> float:
    """Step (s) at which an evaluation leaves so much of an error; NaN if not near the guess."""
    low, high = guess * (1.0 - APART), guess * (1.0 + APART)
    least, most = measured(low), measured(high)
    if not least <= allowed < most:
        return math.nan
    return low + (allowed - least) / (most - least) * (high - low)
