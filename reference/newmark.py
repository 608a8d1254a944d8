"""Newmark's method for the monolithic system, with the contact law solved at every step."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from railcosim.mechanics.arrays import FloatArray

from .contacts import Contacts
from .monolithic import Monolithic
from .rest import equilibrium
from .state import Interval, State

BETA, GAMMA = 0.25, 0.5  # constant average acceleration: second order, no numerical damping


def newmark(
    mono: Monolithic,
    contacts: Contacts,
    position: Callable[[float], FloatArray],
    irregularity: Callable[[float], FloatArray],
    step: float,
    steps: int,
) -> Iterator[State]:
    """March from rest; yields the start and every step.

    Parameters
    ----------
    mono : Monolithic
        The system; loss factors count as viscous damping, as in the FMUs.
    contacts : Contacts
        Between wheels and rails.
    position, irregularity : callable
        Of time (s): positions of the wheelsets, and what the contacts know of the rails' surface
        under the wheels, m.
    step : float
        s.
    steps : int
        How many.

    References
    ----------
    Newmark, N. M. (1959), A method of computation for structural dynamics, J. Eng. Mech. 85(3).
    """
    state = equilibrium(mono, contacts, position(0.0), irregularity(0.0))
    yield state
    interval = Interval(mono, contacts, step, BETA, GAMMA)
    for n in range(1, steps + 1):
        t = n * step
        state = replace(interval.end(state, position(t), irregularity(t)), time=t)
        yield state
