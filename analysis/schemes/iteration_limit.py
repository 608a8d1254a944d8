"""How fast a scheme that iterates converges within a step, by running the FMUs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.cosimulation import cosimulate
from railcosim.master.schemes.iteration import Iterated, Until
from railcosim.master.system import System

from .exponentials import fastest

EVALUATIONS = range(8, 41)
"""After so many values are looked at: only what lasts is left."""
ROUNDING, FEWEST = 1e-12, 10
"""Of the largest force: errors that are smaller are not told from rounding. And of how many larger
ones it takes to tell what is left of them."""
BEFORE = 3
"""Steps at rest before it: a polynomial needs what was before."""
NEVER = 1e-15
"""Tolerance that is not met."""
APART = 0.01
"""Distance to a limit, of itself, at which convergence is measured."""


def contraction(
    system: System,
    forces: Sequence[int],
    scheme: Iterated,
    h: float,
    ready: Callable[[], None],
    near: float,
) -> float:
    """What an evaluation leaves of an error in a step.

    Errors turn as they shrink, so two of them tell little: exponentials are fitted to all that are
    no rounding; NaN if these are few.

    Parameters
    ----------
    system : System
        At rest, to be disturbed after `BEFORE` steps.
    forces : sequence of int
        Places of the contact forces among the outputs, in all directions: what lasts may be creep
        alone, which hardly presses wheels.
    scheme : Iterated
        The scheme.
    h : float
        Step, s.
    ready : callable
        Puts the system to rest.
    near : float
        About what is left.
    """
    found = list[FloatArray]()
    for count in EVALUATIONS:
        ready()
        until = Until(relative=NEVER, absolute=NEVER, max_evaluations=count, accept=True)
        *_, point = cosimulate(system, replace(scheme, until=until), h, (BEFORE + 1) * h)
        found.append(point.outputs[forces])
    errors = np.diff(found, axis=0)
    clear = np.abs(errors).max(axis=1) > ROUNDING * np.abs(found).max()
    errors = errors[: len(errors) if clear.all() else int(clear.argmin())]
    if len(errors) < FEWEST:
        return math.nan
    level = errors / near ** np.arange(len(errors))[:, None]
    return near * math.exp(fastest(level.astype(complex)))


def longest_that_converges(
    allowed: float, guess: float, measured: Callable[[float], float]
) -> float:
    """Step (s) at which an evaluation leaves so much of an error; NaN if not near the guess."""
    low, high = guess * (1.0 - APART), guess * (1.0 + APART)
    least, most = measured(low), measured(high)
    if not least <= allowed < most:
        return math.nan
    return low + (allowed - least) / (most - least) * (high - low)
