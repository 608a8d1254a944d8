"""Largest stable steps as runs of a pair of FMUs have them, where they were predicted."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from railcosim.master.schemes import Scheme
from railcosim.master.schemes.iteration import Iterated

from .growth import PATTERN, Bench, kicked_steps
from .iteration_limit import BEFORE, contraction, longest_that_converges
from .motion import fastest_motion
from .stability import LONGEST, Coupling, Window

APART = 0.004, 0.01, 0.025, 0.06, 0.1
"""Distances to a limit, of itself, at which growth is measured, until it is on both sides."""
INSIDE = 0.4
"""Of a window, at the most: growth rises to its middle."""
LOOKS = 17
"""Steps across a narrow window, to find where it grows most."""
BELOW = 0.97
"""Step in limits at which nothing may grow that was not foreseen."""
CERTAIN = 1.0
"""Growth, as a logarithm, in the second half of a run after a kick, that is no beat of others."""
STEEP = 1e-7
"""Height of a step, m: 100 N, so that what shrinks by 1e-9 is still no rounding."""
FAR = LONGEST * np.array([0.1, 0.3, 1.0])
"""Steps at which nothing may grow where nothing is said to, s."""


@dataclass(frozen=True, kw_only=True)
class Compared:
    """A largest stable step as it was found by runs.

    Attributes
    ----------
    step : float
        s; infinite if nothing grows, NaN if it is not within ten percent of the predicted one.
    at : float
        Step, s, just above the predicted limit, or where growth was looked for.
    predicted, measured : float
        Rates (1/s) there.
    """

    step: float
    at: float
    predicted: float
    measured: float


def limit_in_runs(
    bench: Bench, scheme: Scheme, coupling: Coupling, window: Window | None
) -> Compared:
    """Find the largest stable step where it was predicted.

    Growth is measured on both sides of it, of the motion that is predicted to grow fastest
    there; and after a kick, which excites all motions, somewhat below.

    Parameters
    ----------
    bench : Bench
        The pair.
    scheme : Scheme
        The scheme.
    coupling : Coupling
        Its prediction.
    window : Window or None
        The first of fast growth; None if there is none.
    """
    most = coupling.fast

    @cache
    def compared(h: float) -> Compared:
        motion = fastest_motion(coupling, h)
        if bench.hardly(motion) and window is not None and h < window.fast:
            # What nothing holds is slower than all else: that which is to grow is watched.
            above = (1.0 + APART[0]) * window.fast
            motion = fastest_motion(coupling, above)
            motion = replace(motion, rate=complex(0.0, motion.rate.imag * above / h))
        measured = bench.growth(scheme, h, motion)
        return Compared(step=h, at=h, predicted=motion.rate.real, measured=measured)

    def unforeseen(h: float) -> bool:
        rate = bench.kicked(scheme, h)
        return rate > most and rate * kicked_steps(h) * h > 2.0 * CERTAIN

    if window is None:
        tried = [compared(float(h)) for h in FAR]
        grows = any(one.measured > most or unforeseen(one.at) for one in tried)
        worst = max(tried, key=lambda one: one.predicted)
        return replace(worst, step=math.nan if grows else math.inf)
    guess = window.fast
    if isinstance(scheme, Iterated) and math.isinf(coupling.growth((1.0 + APART[0]) * guess)):
        return _iterating(bench, scheme, coupling, guess)
    widest = INSIDE * (window.end / guess - 1.0)
    if widest < APART[0]:  # perhaps no wider than its edges are exact: where it grows most
        steps = np.linspace(guess, window.end, LOOKS)[1:-1].tolist()
        widest = max(steps, key=coupling.growth) / guess - 1.0
    tried = list[Compared]()
    for apart in APART:
        low = compared(guess * (1.0 - apart))
        high = compared(guess * (1.0 + min(apart, widest)))
        tried.append(high)
        if low.measured <= most < high.measured:
            break
    else:
        return replace(tried[0], step=math.nan)
    while high.at > (1.0 + 2.5 * APART[0]) * low.at:
        middle = compared(math.sqrt(low.at * high.at))
        low, high = (low, middle) if middle.measured > most else (middle, high)
    found = math.sqrt(low.at * high.at)
    if math.isfinite(high.measured):
        part = (most - low.measured) / (high.measured - low.measured)
        found = low.at + part * (high.at - low.at)
    return replace(tried[0], step=math.nan if unforeseen(BELOW * found) else found)


def _iterating(bench: Bench, scheme: Iterated, coupling: Coupling, guess: float) -> Compared:
    """The limit where iterations begin to take too many evaluations."""
    kick = STEEP * np.resize(PATTERN, bench.heights)

    def measured(h: float) -> float:
        def ready() -> None:
            bench.system.restore_state(bench.rest)
            bench.disturbance.heights = lambda t: kick * (t > (BEFORE + 0.5) * h)

        return contraction(bench.system, bench.forces, scheme, h, ready, coupling.contraction)

    above = (1.0 + APART[0]) * guess
    return Compared(
        step=longest_that_converges(coupling.contraction, guess, measured),
        at=above,
        predicted=math.log(coupling.contracts(above)),
        measured=math.log(measured(above)),
    )
