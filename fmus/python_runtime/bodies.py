"""The two bodies in modal form: how contact forces drive them and how their wheels or rails move.

Wheels are in the order left 1..4, right 1..4. Needs numpy only: a copy of this file travels in
every FMU.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...track.shape_functions import shape_functions
from .stepping import Coefficients, Drive, State

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Arrays = Mapping[str, NDArray[Any]]


class Body(Protocol):
    """What the stepping needs to know of a body."""

    poles: ComplexArray
    preload: float
    """Contact force that loads nothing: the vehicle's own weight, N."""

    def shapes(self, position: FloatArray) -> ComplexArray:
        """Mode shapes at the wheelsets' positions, shape (4, n)."""

    def drive(self, shapes: ComplexArray, force: FloatArray) -> Drive:
        """Generalised forces of contact forces, shape (8,), beyond the preload."""

    def motion(self, shapes: ComplexArray, state: State) -> FloatArray:
        """Displacements at the contacts, down, shape (8,), m."""

    def velocity(self, shapes: ComplexArray, state: State) -> FloatArray:
        """Their velocities, shape (8,), m/s."""

    def end_compliance(self, shapes: ComplexArray, c: Coefficients) -> FloatArray:
        """Displacement at the end of a step per contact force at its end, shape (8, 8), m/N."""


class TrackBody:
    """The ring's modes, and one residual oscillator under every wheel."""

    preload = 0.0

    def __init__(self, arrays: Arrays) -> None:
        residual = complex(arrays["residual_pole"])
        self.ring_poles: ComplexArray = arrays["poles"]
        self.poles = np.concatenate([self.ring_poles, np.full(8, residual)])
        # Re(u s) with s' = lambda s + u f is the oscillator R |lambda|^2 / (...) if u^2 is this:
        compliance = float(arrays["residual_compliance"])
        self.residual_shape = np.sqrt(compliance * abs(residual) ** 2 / (1j * residual.imag))
        self.mu: FloatArray = arrays["mu"]
        self.partner: NDArray[np.intp] = arrays["partner"]
        self.parity: FloatArray = arrays["parity"]
        self.table: ComplexArray = arrays["table"]  # (nodes, 2, n): w and theta
        self.phi = float(arrays["phi"])
        self.cell_length = float(arrays["cell_length"])
        self.length = float(arrays["length"])
        self.element = self.cell_length / (self.table.shape[0] - 1)
        self._known: tuple[FloatArray, ComplexArray] | None = None

    def shapes(self, position: FloatArray) -> ComplexArray:
        """Interpolate the table at the positions; remembers the last answer."""
        if self._known is not None and np.array_equal(self._known[0], position):
            return self._known[1]
        x = position % self.length
        cell, inside = np.divmod(x, self.cell_length)
        node, rest = np.divmod(inside, self.element)
        first = np.minimum(node.astype(int), self.table.shape[0] - 2)
        weights, _ = shape_functions(rest / self.element + (node - first), self.element, self.phi)
        rows = np.concatenate([self.table[first], self.table[first + 1]], axis=1)
        shapes = (weights[:, None, :] @ rows)[:, 0, :] * np.exp(1j * self.mu * cell[:, None])
        self._known = (position.copy(), shapes)
        return shapes

    def drive(self, shapes: ComplexArray, force: FloatArray) -> Drive:
        """Forces act through the partner's shape; the right rail with the mode's parity."""
        left, right = force.reshape(2, 4) @ shapes
        ring = (left + self.parity * right)[self.partner]
        return Drive(np.concatenate([ring, self.residual_shape * force]), np.empty(0))

    def motion(self, shapes: ComplexArray, state: State) -> FloatArray:
        """Deflection of the rails under the wheels."""
        return self._observe(shapes, state.s)

    def velocity(self, shapes: ComplexArray, state: State) -> FloatArray:
        """Velocity of the rails' material points under the wheels."""
        return self._observe(shapes, self.poles * state.s)

    def _observe(self, shapes: ComplexArray, s: ComplexArray) -> FloatArray:
        ring = s[:-8]
        both = shapes @ np.stack([ring, self.parity * ring], axis=1)
        observed: FloatArray = (both.T.ravel() + self.residual_shape * s[-8:]).real
        return observed

    def end_compliance(self, shapes: ComplexArray, c: Coefficients) -> FloatArray:
        """See `Body`."""
        return self._compliance(shapes, c.P1)

    def static_compliance(self, shapes: ComplexArray) -> FloatArray:
        """Static deflection per force, shape (8, 8), m/N."""
        return self._compliance(shapes, -1 / self.poles)

    def rest(self, shapes: ComplexArray, force: FloatArray) -> State:
        """The state at rest under constant forces."""
        return State(-self.drive(shapes, force).s / self.poles, np.empty(0), np.empty(0))

    def _compliance(self, shapes: ComplexArray, weight: ComplexArray) -> FloatArray:
        weighted, receiving = shapes * weight[:-8], shapes[:, self.partner].T
        same = (weighted @ receiving).real
        other = ((weighted * self.parity) @ receiving).real
        residual = (self.residual_shape**2 * weight[-1]).real
        return np.block([[same, other], [other, same]]) + residual * np.eye(8)


class VehicleBody:
    """The free vehicle's modes and rigid bodies; both wheels of a wheelset move alike."""

    def __init__(self, arrays: Arrays) -> None:
        self.poles: ComplexArray = arrays["poles"]
        self.rigid: FloatArray = arrays["rigid"]  # (coordinates, n_rigid)
        self.modes: ComplexArray = arrays["modes"]  # (coordinates, n)
        self.left: ComplexArray = arrays["left"]  # (n, coordinates)
        self.inverse_mass: FloatArray = arrays["inverse_mass"]  # (coordinates,)
        self.start_s: ComplexArray = arrays["start_s"]  # (n, 4)
        self.start_r: FloatArray = arrays["start_r"]  # (n_rigid, 4)
        self.rest_stiffness: FloatArray = arrays["rest_stiffness"]  # (4, 4)
        self.preload = float(arrays["wheel_load"])
        self.wheelset_x: FloatArray = arrays["wheelset_x"]
        self._wheelsets = slice(-4, None)
        self._shapes = self.modes[self._wheelsets]

    def shapes(self, position: FloatArray) -> ComplexArray:
        """Mode shapes at the wheelsets, wherever they are."""
        del position
        return self._shapes

    def drive(self, shapes: ComplexArray, force: FloatArray) -> Drive:
        """Contact forces lift the wheels; the preload carries the weight."""
        down = self.net_force(force)
        return Drive(
            self.left[:, self._wheelsets] @ down, self.rigid[self._wheelsets].T @ down
        )  # fmt: skip

    def net_force(self, force: FloatArray) -> FloatArray:
        """What is left of weight and contact forces on every wheelset, down, shape (4,)."""
        return -force.reshape(2, 4).sum(axis=0)

    def motion(self, shapes: ComplexArray, state: State) -> FloatArray:
        """Displacement of the wheels."""
        return np.tile(self.coordinates(state)[self._wheelsets], 2)

    def velocity(self, shapes: ComplexArray, state: State) -> FloatArray:
        """Velocity of the wheels."""
        return np.tile(self.rates(state)[self._wheelsets], 2)

    def coordinates(self, state: State) -> FloatArray:
        """Displacements of all coordinates."""
        moved: FloatArray = self.rigid @ state.r + (self.modes @ state.s).real
        return moved

    def rates(self, state: State) -> FloatArray:
        """Velocities of all coordinates."""
        moving: FloatArray = self.rigid @ state.v + (self.modes @ (self.poles * state.s)).real
        return moving

    def accelerations(self, state: State, force: FloatArray) -> FloatArray:
        """Accelerations of all coordinates; only a force on a body itself acts at once."""
        a: FloatArray = (self.modes @ (self.poles**2 * state.s)).real
        a[self._wheelsets] += self.inverse_mass[self._wheelsets] * self.net_force(
            force - self.preload
        )
        return a

    def end_compliance(self, shapes: ComplexArray, c: Coefficients) -> FloatArray:
        """See `Body`."""
        w = self._wheelsets
        G = ((self.modes[w] * c.P1) @ self.left[:, w]).real
        G += c.h**2 / 6 * self.rigid[w] @ self.rigid[w].T
        return -np.tile(G, (2, 2))

    def rest(self, height: FloatArray) -> State:
        """The state at rest with the wheelsets at given heights, shape (4,), m."""
        return State(self.start_s @ height, self.start_r @ height, np.zeros(self.rigid.shape[1]))

    def rest_force(self, height: FloatArray) -> FloatArray:
        """Contact force on each wheel of a wheelset that keeps it there, shape (4,), N."""
        return self.preload - 0.5 * self.rest_stiffness @ height
