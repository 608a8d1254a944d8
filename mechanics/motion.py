"""A body moved over one communication step, by forces from outside or by its own contacts.

Needs numpy only: a copy of this file travels in every FMU.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .law import ContactLaw
from .modal import Met, ModalBody
from .solve import forces, solve_compression
from .stepping import Coefficients, Drive, State, add_bulge, add_end, coefficients, free_step

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


class Forces(Protocol):
    """Where the contact forces come from."""

    def at(self, met: Met, state: State, load: FloatArray) -> FloatArray:
        """Forces in a known state, shape (ports,), N."""

    def at_end(self, met: Met, c: Coefficients, free: State, load: FloatArray) -> FloatArray:
        """Forces at the end of a step that so far went without them, shape (ports,), N."""


class FromOutside:
    """Contact forces are inputs."""

    def at(self, met: Met, state: State, load: FloatArray) -> FloatArray:
        """See `Forces`."""
        return load

    def at_end(self, met: Met, c: Coefficients, free: State, load: FloatArray) -> FloatArray:
        """See `Forces`."""
        return load


@dataclass(frozen=True)
class OwnContact:
    """The body owns the contact springs, of this law."""

    law: ContactLaw

    def at(self, met: Met, state: State, load: FloatArray) -> FloatArray:
        """See `Forces`."""
        return forces(self.law, met.body.sign * (met.motion(state) - load))

    def at_end(self, met: Met, c: Coefficients, free: State, load: FloatArray) -> FloatArray:
        """Solve the contact law against the body's compliance over the step."""
        body = met.body
        G = -body.sign * met.compliance(c.P1, c.R1)
        gap = body.sign * (met.motion(free) - load) + G @ body.preload
        return forces(self.law, solve_compression(self.law, G, gap, guess=gap))


def _bulge(start: Drive, middle: Drive, end: Drive) -> Drive:
    """How far forces are off the line in the middle of a step."""
    return Drive(middle.s - 0.5 * (start.s + end.s), middle.r - 0.5 * (start.r + end.r))


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
        otherwise it is cut into internal steps, over each of which the forces on the modes go
        along a parabola or, where the body's own contacts make them, are held at the mean of both
        ends: along a line, a stiff contact would drive some modes to grow.
        """
        outside = isinstance(self.forces, FromOutside)
        one = outside and np.array_equal(start.position, end.position)
        n = 1 if one else max(1, math.ceil(h / self.internal_step * (1 - 1e-9)))
        c = self._coefficients(h / n)
        preload, met = self.body.preload, self.met(start.position)
        force = self.forces.at(met, state, start.load)
        drive = met.drive(force - preload)
        for k in range(1, n + 1):
            begun = drive
            if outside and not one:
                now = start.toward(end, (k - 0.5) / n)
                middle = self.met(now.position).drive(now.load - preload)
            now = start.toward(end, k / n)
            state = free_step(c, state, drive)
            new_met = self.met(now.position)
            new_force = self.forces.at_end(new_met, c, state, now.load)
            if new_met is not met or not np.array_equal(new_force, force):
                met, force = new_met, new_force
                drive = met.drive(force - preload)
            add_end(c, state, drive)
            if outside and not one:
                add_bulge(c, state, _bulge(begun, middle, drive))
        return state

    def _coefficients(self, h: float) -> Coefficients:
        if h not in self._known:
            if len(self._known) >= 8:  # a master with varying steps must not fill the memory
                self._known.clear()
            own = isinstance(self.forces, OwnContact)
            self._known[h] = coefficients(self.body.poles, h, held=own)
        return self._known[h]
