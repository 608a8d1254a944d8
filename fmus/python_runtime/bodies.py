"""The two bodies in modal form: how contact forces drive them and how their wheels or rails move.

Wheels are in the order left 1..4, right 1..4. Needs numpy only: a copy of this file travels in
every FMU.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...track.shape_functions import shape_functions
from .stepping import Coefficients, Drive, State

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Arrays = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class Shapes:
    """Mode shapes at the wheelsets, shape (4, n): as displacements, and as forces receive them.

    `local` is the shape of each contact's residual oscillator, shape (8,); empty without any.
    """

    out: ComplexArray
    into: ComplexArray
    local: ComplexArray


class Body(Protocol):
    """What the stepping needs to know of a body."""

    poles: ComplexArray
    preload: float
    """Contact force that loads nothing: the vehicle's own weight, N."""

    def shapes(self, position: FloatArray) -> Shapes:
        """Mode shapes at the wheelsets' positions."""

    def drive(self, shapes: Shapes, force: FloatArray) -> Drive:
        """Generalised forces of contact forces beyond the preload, shape (8,)."""

    def motion(self, shapes: Shapes, state: State) -> FloatArray:
        """Displacements at the contacts, down, shape (8,), m."""

    def end_compliance(self, shapes: Shapes, c: Coefficients) -> FloatArray:
        """Displacement at the end of a step per contact force at its end, shape (8, 8), m/N."""


class TrackBody:
    """The ring's modes, and one residual oscillator under every wheel."""

    preload = 0.0

    def __init__(self, arrays: Arrays) -> None:
        residual = complex(arrays["residual_pole"])
        self.poles: ComplexArray = np.concatenate([arrays["poles"], np.full(8, residual)])
        self.local_table: ComplexArray = arrays["residual_shape"]  # (nodes,)
        self.partner: NDArray[np.intp] = arrays["partner"]
        self.even = int((arrays["parity"] > 0).sum())  # even modes first, then odd ones
        # (nodes, 2, n): w and dw/dx; contiguous, for `shapes` reads neighbours as one block. The
        # last node is the first one of the next cell, not rounded by itself: a wheel must not feel
        # the joint.
        table: ComplexArray = arrays["table"].astype(complex)
        closing = table[:1] * np.exp(1j * arrays["mu"])
        self.table: ComplexArray = np.ascontiguousarray(np.concatenate([table, closing]))
        self.cell_length = float(arrays["cell_length"])
        self.length = float(arrays["length"])
        self.element = self.cell_length / (self.table.shape[0] - 1)
        cells = np.arange(round(self.length / self.cell_length))
        self.phase = np.exp(1j * cells[:, None] * arrays["mu"])  # (cells, n)
        self._known: tuple[FloatArray, Shapes] | None = None
        self._through: tuple[Shapes, FloatArray] | None = None

    def shapes(self, position: FloatArray) -> Shapes:
        """Interpolate the table at the positions; remembers the last answer."""
        if self._known is not None and np.array_equal(self._known[0], position):
            return self._known[1]
        cell, inside = np.divmod(position % self.length, self.cell_length)
        first = np.minimum((inside / self.element).astype(int), self.table.shape[0] - 2)
        xi = inside / self.element - first
        weights, _ = shape_functions(xi, self.element, 0.0)  # Hermite's cubic
        out = np.empty((4, self.partner.size), dtype=complex)
        for k, node in enumerate(first):
            # Two neighbouring nodes are one block of memory; as real numbers, one BLAS call.
            block = self.table[node : node + 2].reshape(4, -1).view(float)
            out[k] = (weights[k] @ block).view(complex)
        out *= self.phase[cell.astype(int)]
        local = (1 - xi) * self.local_table[first] + xi * self.local_table[first + 1]
        shapes = Shapes(out, out[:, self.partner], np.concatenate([local, local]))
        self._known = (position.copy(), shapes)
        return shapes

    def drive(self, shapes: Shapes, force: FloatArray) -> Drive:
        """The sum of both rails' forces moves even modes, the difference odd ones."""
        left, right = force[:4], force[4:]
        even = (left + right) @ shapes.into[:, : self.even]
        odd = (left - right) @ shapes.into[:, self.even :]
        return Drive(np.concatenate([even, odd, shapes.local * force]), np.empty(0))

    def motion(self, shapes: Shapes, state: State) -> FloatArray:
        """Deflection of the rails under the wheels."""
        return self._observe(shapes, state.s)

    def velocity(self, shapes: Shapes, state: State, force: FloatArray) -> FloatArray:
        """Velocity of the rails' material points; modes left out let a little force through."""
        if self._through is None or self._through[0] is not shapes:
            self._through = (shapes, self._compliance(shapes, np.ones_like(self.poles)))
        return self._observe(shapes, self.poles * state.s) + self._through[1] @ force

    def _observe(self, shapes: Shapes, s: ComplexArray) -> FloatArray:
        even = shapes.out[:, : self.even] @ s[: self.even]
        odd = shapes.out[:, self.even :] @ s[self.even : -8]
        ring = np.concatenate([even + odd, even - odd])
        return (ring + shapes.local * s[-8:]).real

    def end_compliance(self, shapes: Shapes, c: Coefficients) -> FloatArray:
        """See `Body`."""
        return self._compliance(shapes, c.P1)

    def static_compliance(self, shapes: Shapes) -> FloatArray:
        """Static deflection per force, shape (8, 8), m/N."""
        return self._compliance(shapes, -1 / self.poles)

    def rest(self, shapes: Shapes, force: FloatArray) -> State:
        """The state at rest under constant forces."""
        return State(-self.drive(shapes, force).s / self.poles, np.empty(0), np.empty(0))

    def _compliance(self, shapes: Shapes, weight: ComplexArray) -> FloatArray:
        """Sum over modes of out x weight x into, for all 8 contacts."""
        weighted, n = shapes.out * weight[:-8], self.even
        even = (weighted[:, :n] @ shapes.into[:, :n].T).real
        odd = (weighted[:, n:] @ shapes.into[:, n:].T).real
        G = np.empty((8, 8))
        G[:4, :4] = G[4:, 4:] = even + odd
        G[:4, 4:] = G[4:, :4] = even - odd
        G[np.diag_indices(8)] += (shapes.local**2 * weight[-1]).real
        return G


class VehicleBody:
    """The free vehicle's modes and rigid bodies; both wheels of a wheelset move alike."""

    def __init__(self, arrays: Arrays) -> None:
        self.poles: ComplexArray = arrays["poles"]
        self.rigid: FloatArray = arrays["rigid"]  # (coordinates, n_rigid)
        self.modes: ComplexArray = arrays["modes"]  # (coordinates, n)
        self.inverse_mass: FloatArray = arrays["inverse_mass"][-4:]
        self.start_s: ComplexArray = arrays["start_s"]  # (n, 4)
        self.start_r: FloatArray = arrays["start_r"]  # (n_rigid, 4)
        self.preload = float(arrays["wheel_load"])
        self.wheelset_x: FloatArray = arrays["wheelset_x"]
        # Wheelsets are the last coordinates; a contact force lifts them.
        self._shapes = Shapes(self.modes[-4:], -arrays["left"][:, -4:].T, np.empty(0, complex))
        self._rigid = self.rigid[-4:]

    def shapes(self, position: FloatArray) -> Shapes:
        """Mode shapes at the wheelsets, wherever they are."""
        del position
        return self._shapes

    def drive(self, shapes: Shapes, force: FloatArray) -> Drive:
        """Both wheels of a wheelset push it up."""
        up = force.reshape(2, 4).sum(axis=0)
        return Drive(up @ shapes.into, -up @ self._rigid)

    def motion(self, shapes: Shapes, state: State) -> FloatArray:
        """Displacement of the wheels."""
        return np.tile(self._rigid @ state.r + (shapes.out @ state.s).real, 2)

    def coordinates(self, state: State) -> FloatArray:
        """Displacements of all coordinates, shape (10,)."""
        moved: FloatArray = self.rigid @ state.r + (self.modes @ state.s).real
        return moved

    def rates(self, state: State) -> FloatArray:
        """Velocities of all coordinates."""
        moving: FloatArray = self.rigid @ state.v + (self.modes @ (self.poles * state.s)).real
        return moving

    def accelerations(self, state: State, force: FloatArray) -> FloatArray:
        """Accelerations of all coordinates; a force acts at once only on its own body."""
        a: FloatArray = (self.modes @ (self.poles**2 * state.s)).real
        a[-4:] -= self.inverse_mass * (force - self.preload).reshape(2, 4).sum(axis=0)
        return a

    def end_compliance(self, shapes: Shapes, c: Coefficients) -> FloatArray:
        """See `Body`."""
        G = ((shapes.out * c.P1) @ shapes.into.T).real - c.R1 * self._rigid @ self._rigid.T
        return np.tile(G, (2, 2))

    def rest(self, height: FloatArray) -> State:
        """The state at rest with the wheelsets at given heights, shape (4,), m."""
        return State(self.start_s @ height, self.start_r @ height, np.zeros(self.rigid.shape[1]))
