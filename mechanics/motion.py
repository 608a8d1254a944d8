"""A body moved over one communication step, by forces from outside or by its own contacts.

Needs numpy only: a copy of this file travels in every FMU.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .law import ContactLaw
from .modal import Met, ModalBody
from .solve import OverStep, forces, solve_compression
from .stepping import (
    Coefficients,
    State,
    add_line,
    along,
    average,
    coefficients,
    rigid_weight,
)

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Inputs:
    """What comes from outside at one instant.

    Attributes
    ----------
    position : array, shape (wheelsets,)
        Of the wheelsets, m.
    load : array, shape (ports,)
        Contact forces (N) where they come from outside; else the height (m) of the surface that
        the body's own contacts press against.
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
        """Forces in a known state, shape (ports,), N."""

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
    """The body owns the contact springs, of this law.

    Over a step the body first goes on under the forces that its contacts have at the beginning,
    while the wheelsets roll. What the forces change by is a line in time, whose effects are those
    of wheelsets that stay where they are in the middle of the step. It is the line nearest to the
    law along the parabola with the compressions at the beginning, at the end and on average over
    the step. Where wheels do not roll these are exact for that line, so linear springs give up what
    its work on the body is, whatever the step: nothing grows, however stiff they are.

    References
    ----------
    E. Hairer, Energy-preserving variant of collocation methods, JNAIAM 5 (2010) 73-84: the same for
    free masses.
    """

    law: ContactLaw

    def at(self, met: Met, state: State, load: FloatArray) -> FloatArray:
        """See `Forces`."""
        return forces(self.law, met.body.sign * (met.motion(state) - load))

    def step(self, meet: Meet, c: Coefficients, state: State, inputs: Instants) -> State:
        """See `Forces`."""
        first, middle, last = (meet(now.position) for now in inputs)
        body, loads = first.body, [now.load for now in inputs]
        z = first.motion(state)
        begin = body.sign * (z - loads[0])
        force = forces(self.law, begin)
        drives = [met.drive(force - body.preload) for met in (first, middle, last)]
        after, mean = along(c, state, *drives), average(c, state, *drives)
        end = last.motion(after)
        # Exact where wheels do not roll; elsewhere Simpson's rule finds what the shapes change by.
        ends = [middle.motion(s) for s in (state, after)]
        rolled = (z + end - ends[0] - ends[1]) / 6
        height = (loads[0] + 4 * loads[1] + loads[2]) / 6
        free = body.sign * np.stack([middle.motion(mean) + rolled - height, end - loads[2]])
        line = self._line(middle, c, begin, free, force)
        add_line(c, after, middle.drive(line[0] - force), middle.drive(line[1]))
        return after

    def _line(
        self, met: Met, c: Coefficients, begin: FloatArray, free: FloatArray, force: FloatArray
    ) -> FloatArray:
        """Mean and slope of the forces, shape (2, ports), from compressions without changes."""
        k, ports = self.law.directions, begin.size
        P = [met.compliance(c.h * c.phi[j], rigid_weight(c, j)) for j in (1, 2, 3)]
        # Opening on average and at the end by means and by slopes: directions stand together.
        parts = [[P[1], 2 * P[2] - P[1]], [P[0], 2 * P[1] - P[0]]]
        G = -met.body.sign * np.array(parts)  # (2, 2, ports, ports)
        gap = free + G[:, 0] @ force
        contacts = (2, 2, ports // k, k, ports // k, k)
        matrix = G.reshape(contacts).transpose(2, 0, 3, 4, 1, 5).reshape(2 * ports, 2 * ports)
        law = OverStep(self.law, begin.reshape(-1, k))
        flat = gap.reshape(2, -1, k).transpose(1, 0, 2).ravel()
        pressed = solve_compression(law, matrix, flat, guess=flat)
        found = forces(law, pressed).reshape(-1, 2, k)
        line: FloatArray = found.transpose(1, 0, 2).reshape(2, ports)
        return line


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

        A step is one exact step of the modes where forces come from outside and no wheel moves;
        otherwise it is cut into internal ones.
        """
        outside = isinstance(self.forces, FromOutside)
        one = outside and np.array_equal(start.position, end.position)
        n = 1 if one else max(1, math.ceil(h / self.internal_step * (1 - 1e-9)))
        c = self._coefficients(h / n)
        begin = start
        for k in range(1, n + 1):
            middle, last = (start.toward(end, part / n) for part in (k - 0.5, k))
            state = self.forces.step(self.met, c, state, (begin, middle, last))
            begin = last
        return state

    def _coefficients(self, h: float) -> Coefficients:
        if h not in self._known:
            if len(self._known) >= 8:  # a master with varying steps must not fill the memory
                self._known.clear()
            self._known[h] = coefficients(self.body.poles, h)
        return self._known[h]
