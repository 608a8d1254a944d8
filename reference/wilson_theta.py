"""Wilson's theta method for the monolithic system, beside Newmark's and called like it.

Equilibrium holds beyond the end of a step, at theta steps, whatever lies between being of linear
acceleration; for theta above 1.37 it is stable for any step, and high frequencies die away.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from railcosim.mechanics.arrays import FloatArray

from .contacts import Contacts
from .monolithic import Monolithic
from .rest import equilibrium
from .state import Interval, State, met

THETA = 1.4  # the usual one; unconditionally stable from (1 + sqrt(3)) / 2 = 1.366 on
BETA, GAMMA = 1 / 6, 1 / 2  # linear acceleration


def wilson_theta(
    mono: Monolithic,
    contacts: Contacts,
    position: Callable[[float], FloatArray],
    irregularity: Callable[[float], FloatArray],
    step: float,
    steps: int,
    theta: float = THETA,
) -> Iterator[State]:
    """March from rest; yields the start and every step. See `railcosim.reference.newmark`.

    Positions and irregularities are asked for theta steps ahead, too.

    Parameters
    ----------
    mono, contacts, position, irregularity, step, steps
        As of `newmark`.
    theta : float
        How far beyond the step equilibrium holds, in steps; at least 1.

    Raises
    ------
    ValueError
        If theta is below 1.

    References
    ----------
    Wilson, E. L., Farhoomand, I. & Bathe, K. J. (1973), Nonlinear dynamic analysis of complex
    structures, Earthquake Eng. Struct. Dyn. 1(3), 241-252.
    Bathe, K. J. & Wilson, E. L. (1973), Stability and accuracy analysis of direct integration
    methods, Earthquake Eng. Struct. Dyn. 1(3), 283-291.
    """
    if not theta >= 1.0:
        raise ValueError(f"theta = {theta:g}: must be at least 1, and 1.37 for stability")
    state = equilibrium(mono, contacts, position(0.0), irregularity(0.0))
    yield state
    ahead = Interval(mono, contacts, theta * step, BETA, GAMMA)
    for n in range(1, steps + 1):
        t, beyond = n * step, (n - 1 + theta) * step
        there = ahead.end(state, position(beyond), irregularity(beyond))
        state = replace(within(state, there, step, theta), time=t)
        state = met(mono, contacts, state, position(t), irregularity(t))
        yield state


def within(begin: State, beyond: State, step: float, theta: float) -> State:
    """The state at the end of a step, on the line of accelerations to what lies beyond."""
    a = begin.a + (beyond.a - begin.a) / theta
    return replace(
        beyond,
        x=begin.x + step * begin.v + step**2 / 6 * (2 * begin.a + a),
        v=begin.v + step / 2 * (begin.a + a),
        a=a,
    )
