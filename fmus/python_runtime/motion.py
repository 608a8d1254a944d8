"""A body moved over one communication step, by forces from outside or by its own contacts.

Needs numpy only: a copy of this file travels in every FMU.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...vehicle.contact import ContactLaw, solve_compression
from .bodies import Body, Shapes
from .stepping import Coefficients, Drive, State, add_bulge, add_end, coefficients, free_step

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Inputs:
    """What comes from outside at one instant.

    Attributes
    ----------
    position : array, shape (4,)
        Of the wheelsets, m.
    load : array, shape (8,)
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

    def at(self, body: Body, shapes: Shapes, state: State, load: FloatArray) -> FloatArray:
        """Forces in a known state, shape (8,), N."""

    def at_end(
        self, body: Body, shapes: Shapes, c: Coefficients, free: State, load: FloatArray
    ) -> FloatArray:
        """Forces at the end of a step that so far went without them, shape (8,), N."""


class FromOutside:
    """Contact forces are inputs."""

    def at(self, body: Body, shapes: Shapes, state: State, load: FloatArray) -> FloatArray:
        """See `Forces`."""
        return load

    def at_end(
        self, body: Body, shapes: Shapes, c: Coefficients, free: State, load: FloatArray
    ) -> FloatArray:
        """See `Forces`."""
        return load


@dataclass(frozen=True)
class OwnContact:
    """The body owns the contact springs.

    Attributes
    ----------
    law : ContactLaw
        Force against compression.
    sign : int
        1 if moving down presses (wheels), -1 if it relieves (rails).
    """

    law: ContactLaw
    sign: int

    def at(self, body: Body, shapes: Shapes, state: State, load: FloatArray) -> FloatArray:
        """See `Forces`."""
        return self.law.force(self.sign * (body.motion(shapes, state) - load))

    def at_end(
        self, body: Body, shapes: Shapes, c: Coefficients, free: State, load: FloatArray
    ) -> FloatArray:
        """Solve the contact law against the body's compliance over the step."""
        G = -self.sign * body.end_compliance(shapes, c)
        gap = self.sign * (body.motion(shapes, free) - load) + G @ np.full(8, body.preload)
        return self.law.force(solve_compression(self.law, G, gap, guess=gap))


def _bulge(start: Drive, middle: Drive, end: Drive) -> Drive:
    """How far forces are off the line in the middle of a step."""
    return Drive(middle.s - 0.5 * (start.s + end.s), middle.r - 0.5 * (start.r + end.r))


class Mover:
    """Steps a body; keeps the coefficients of the last step sizes."""

    def __init__(self, body: Body, forces: Forces, internal_step: float) -> None:
        self.body, self.forces, self.internal_step = body, forces, internal_step
        self._known: dict[float, Coefficients] = {}

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
        body, preload = self.body, self.body.preload
        shapes = body.shapes(start.position)
        force = self.forces.at(body, shapes, state, start.load)
        drive = body.drive(shapes, force - preload)
        for k in range(1, n + 1):
            begun = drive
            if outside and not one:
                now = start.toward(end, (k - 0.5) / n)
                middle = body.drive(body.shapes(now.position), now.load - preload)
            now = start.toward(end, k / n)
            state = free_step(c, state, drive)
            new_shapes = body.shapes(now.position)
            new_force = self.forces.at_end(body, new_shapes, c, state, now.load)
            if new_shapes is not shapes or not np.array_equal(new_force, force):
                shapes, force = new_shapes, new_force
                drive = body.drive(shapes, force - preload)
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
