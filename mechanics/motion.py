"""A body moved over one communication step, by forces from outside or by its own contacts.

Needs numpy only: a copy of this file travels in every FMU.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .arrays import FloatArray
from .gaps import MOST_TURNS, Gaps
from .law import OwnLaw
from .modal import Met, ModalBody
from .solve import VALUES, AtOnce, AtRest, OverStep, forces, solve_compression
from .stepping import (
    Coefficients,
    State,
    add_line,
    along,
    average,
    coefficients,
    rigid_weight,
)


@dataclass(frozen=True)
class Inputs:
    """What comes from outside at one instant.

    Attributes
    ----------
    position : array, shape (wheelsets,)
        Of the wheelsets, m.
    load : array, shape (ports,) or (contacts x g,)
        Contact forces (N) where they come from outside; else what the law of the body's own
        contacts is given, see `OwnLaw`.
    """

    position: FloatArray
    load: FloatArray

    def toward(self, end: Inputs, part: float) -> Inputs:
        """On the line to `end`."""
        return Inputs(
            self.position + part * (end.position - self.position),
            self.load + part * (end.load - self.load),
        )


Meet: TypeAlias = Callable[[FloatArray], Met]
Instants: TypeAlias = tuple[Inputs, Inputs, Inputs]


class Forces(Protocol):
    """Where the contact forces come from."""

    def at(self, met: Met, state: State, load: FloatArray) -> FloatArray:
        """Forces at the body's ports in a known state, shape (ports,), N."""

    def step(self, meet: Meet, c: Coefficients, state: State, inputs: Instants) -> State:
        """The state after an internal step, from inputs at its beginning, middle and end."""


class FromOutside:
    """Contact forces are inputs: those on the modes go along a parabola."""

    def at(self, met: Met, state: State, load: FloatArray) -> FloatArray:
        """See `Forces`."""
        return load

    def step(self, meet: Meet, c: Coefficients, state: State, inputs: Instants) -> State:
        """See `Forces`."""
        drives = []
        for now in inputs:
            met = meet(now.position)
            drives.append(met.drive(now.load - met.body.preload))
        return along(c, state, *drives)


@dataclass(frozen=True)
class OwnContact:
    """The body owns the contacts, of this law.

    Over a step the body first goes on under the forces that its contacts have at the beginning,
    while the wheelsets roll. What the forces change by is a line in time, whose effects are those
    of wheelsets that stay where they are in the middle of the step. It is the line nearest to the
    law along the parabola with the motions at the beginning, at the end and on average over the
    step, with the rates of that parabola; where wheels roll, with those of the one of the material
    in the middle of their way. Where wheels do not roll all is exact for that line, so linear
    springs give up what its work on the body is, and creep takes what it takes along the parabola,
    whatever the step: nothing grows, however stiff they are.

    A force that depends on rates jumps with them, and rates of a rail jump with the force, more
    than once over: f22 / speed times the mobility is above 1. At an instant it is what agrees with
    the rates that it makes, so it depends on the state and the inputs of that instant alone.

    References
    ----------
    E. Hairer, Energy-preserving variant of collocation methods, JNAIAM 5 (2010) 73-84: the same for
    free masses.
    """

    law: OwnLaw

    def at(self, met: Met, state: State, load: FloatArray) -> FloatArray:
        """See `Forces`."""
        contacts = met.body.layout.contacts
        q, given = (x.reshape(contacts, -1) for x in (met.motion(state), load))
        v = np.zeros_like(q)
        if self.law.of_rates:
            free = met.velocity(state, np.zeros(q.size))
            law = AtOnce(self.law, q, given)
            v = solve_compression(law, -met.through, free, guess=v.ravel()).reshape(q.shape)
        return self.law.force(q, v, given).ravel()

    def on_other(self, met: Met, state: State, load: FloatArray, force: FloatArray) -> FloatArray:
        """Forces at the ports of what the body meets, where those at its own are known."""
        known = (met.motion(state), met.velocity(state, force), load)
        contacts = met.body.layout.contacts
        return self.law.on_other(*(x.reshape(contacts, -1) for x in known)).ravel()

    def rest(self, met: Met, load: FloatArray) -> FloatArray:
        """Forces of a body at rest that has no rigid motions."""
        law = AtRest(self.law, load.reshape(met.body.layout.contacts, -1))
        compliance, none = met.static_compliance(), np.zeros(met.body.ports)

        def pressed(taken: FloatArray | float, lifted: FloatArray) -> FloatArray:
            G = compliance - taken
            return forces(law, solve_compression(law, -G, lifted, guess=none))

        gaps = met.body.gaps
        return pressed(0.0, none) if gaps is None else _rest_on(gaps, met, pressed)

    def step(self, meet: Meet, c: Coefficients, state: State, inputs: Instants) -> State:
        """See `Forces`."""
        first, middle, last = (meet(now.position) for now in inputs)
        body, loads = first.body, np.stack([now.load for now in inputs])
        force = self.at(first, state, loads[0])
        drives = [met.drive(force - body.preload) for met in (first, middle, last)]
        after, mean = along(c, state, *drives), average(c, state, *drives)
        # Where the wheels are, and in the middle of their way: at the beginning and at the end.
        ends = np.stack([first.motion(state), last.motion(after)])
        rolled = ends - np.stack([middle.motion(s) for s in (state, after)])
        # Exact where wheels do not roll; elsewhere Simpson's rule finds what the shapes change by.
        rolled = np.insert(rolled, 1, rolled.sum(axis=0) / 6, axis=0)
        loads[1] = (loads[0] + 4 * loads[1] + loads[2]) / 6
        contacts = body.layout.contacts
        law = OverStep(
            self.law,
            c.h,
            begin=ends[0].reshape(contacts, -1),
            rolled=rolled.reshape(3, contacts, -1),
            given=(VALUES @ loads).reshape(3, contacts, -1),
        )
        free = np.stack([middle.motion(mean) + rolled[1], ends[1]])
        line = _line(law, middle, c, free, force)
        add_line(c, after, middle.drive(line[0] - force), middle.drive(line[1]))
        return after


def _rest_on(
    gaps: Gaps, met: Met, pressed: Callable[[FloatArray, FloatArray], FloatArray]
) -> FloatArray:
    """Contact forces at rest where gaps close, those that are closed being found in turn."""
    R, S = met.by_gaps(), gaps.compliance(-1 / met.body.poles)
    closed = np.zeros(gaps.gap.size, dtype=bool)
    for _ in range(MOST_TURNS):
        force = pressed(*gaps.closed_under(closed, R, S))
        now = gaps.are_closed(closed, R, S, force)
        if np.array_equal(now, closed):
            break
        closed = now
    return force


def _line(
    law: OverStep, met: Met, c: Coefficients, free: FloatArray, force: FloatArray
) -> FloatArray:
    """Mean and slope of the forces, shape (2, ports), from motions under unchanged ones."""
    contacts, ports = met.body.layout.contacts, force.size
    P = [met.compliance(c.h * c.phi[j], rigid_weight(c, j)) for j in (1, 2, 3)]
    # Motions on average and at the end by means and by slopes.
    G = np.array([[P[1], 2 * P[2] - P[1]], [P[0], 2 * P[1] - P[0]]])  # (2, 2, ports, ports)

    def together(by_part: NDArray[Any]) -> NDArray[Any]:
        """What is of one contact, of both parts."""
        return by_part.reshape(2, contacts, -1).transpose(1, 0, 2).ravel()

    places = together(np.arange(2 * ports))
    matrix = -G.transpose(0, 2, 1, 3).reshape(2 * ports, 2 * ports)[np.ix_(places, places)]
    start, gap = together(free), together(free - G[:, 0] @ force)
    line = np.empty(2 * ports)
    line[places] = forces(law, solve_compression(law, matrix, gap, guess=start))
    return line.reshape(2, ports)


class Mover:
    """Steps a body; keeps the coefficients of the last step sizes, and where it was met last."""

    def __init__(self, body: ModalBody, forces: Forces, internal_step: float) -> None:
        self.body, self.forces, self.internal_step = body, forces, internal_step
        self._known: dict[float, Coefficients] = {}
        self._met: tuple[FloatArray, Met] | None = None

    def met(self, position: FloatArray) -> Met:
        """The body at these positions; remembers the last answer."""
        if self._met is None or not np.array_equal(self._met[0], position):
            self._met = (position.copy(), self.body.at(position))
        return self._met[1]

    def step(self, state: State, start: Inputs, end: Inputs, h: float) -> State:
        """Move from `start` to `end`, inputs on the line between them.

        A step is one exact step of the modes where forces come from outside, no wheel moves and
        there are no gaps; otherwise it is cut into internal ones.
        """
        gaps = self.body.gaps
        outside = isinstance(self.forces, FromOutside) and gaps is None
        one = outside and np.array_equal(start.position, end.position)
        n = 1 if one else max(1, math.ceil(h / self.internal_step * (1 - 1e-9)))
        c = self._coefficients(h / n)
        begin = start
        for k in range(1, n + 1):
            middle, last = (start.toward(end, part / n) for part in (k - 0.5, k))
            before = state.s
            state = self.forces.step(self.met, c, state, (begin, middle, last))
            if gaps is not None:
                state.s = gaps.step(c, before, state.s)
            begin = last
        return state

    def _coefficients(self, h: float) -> Coefficients:
        if h not in self._known:
            if len(self._known) >= 8:  # a master with varying steps must not fill the memory
                self._known.clear()
            self._known[h] = coefficients(self.body.poles, h)
        return self._known[h]
