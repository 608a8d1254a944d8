"""One instant of the monolithic system, and the end of an interval that begins with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse.linalg import SuperLU, splu

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.solve import solve_compression

from .contacts import Contacts
from .monolithic import Monolithic


@dataclass(frozen=True, kw_only=True)
class State:
    """The system at one time.

    Attributes
    ----------
    time : float
        s.
    x, v, a : array, shape (n,)
        Displacements, velocities, accelerations.
    motion : array, shape (groups, k x orders)
        What the law of the contacts is given.
    force : array, shape (n_ports,)
        What wheels do to rails, as rows of `Monolithic.rails`, N and N m.
    """

    time: float = 0.0
    x: FloatArray
    v: FloatArray
    a: FloatArray
    motion: FloatArray
    force: FloatArray


class Interval:
    """Intervals of one length, at whose ends the equations of motion hold.

    Displacements and velocities go on by Newmark's formulas of beta and gamma.

    Parameters
    ----------
    mono : Monolithic
        The system; loss factors count as viscous damping, as in the FMUs.
    contacts : Contacts
        Between wheels and rails.
    length : float
        s.
    beta, gamma : float
        1/4 and 1/2: of constant average acceleration; 1/6 and 1/2: of linear acceleration.
    """

    def __init__(
        self, mono: Monolithic, contacts: Contacts, length: float, beta: float, gamma: float
    ) -> None:
        self.mono, self.contacts, self.length = mono, contacts, length
        self.C = mono.viscous_damping
        self.by_x = 1 / (beta * length**2)  # of the acceleration at the end
        self.rate_by_x = gamma / (beta * length)
        self.beta, self.gamma = beta, gamma
        self.factor: SuperLU = splu((mono.K + self.by_x * mono.M + self.rate_by_x * self.C).tocsc())
        self.weight = mono.wheels.T @ mono.load
        self.lowered, self.pushes = contacts.lowered(mono), contacts.pushes(mono)
        self.where: FloatArray | None = None

    def end(self, begin: State, position: FloatArray, irregularity: FloatArray) -> State:
        """The state at the end, wheelsets and irregularities as they are there."""
        self._meet(position)
        beta, gamma, h, law = self.beta, self.gamma, self.length, self.contacts.law
        x, v, a = begin.x, begin.v, begin.a
        known = self.weight + self.mono.M @ (self.by_x * x + v / (beta * h) + (0.5 / beta - 1) * a)
        known += self.C @ (
            self.rate_by_x * x + (gamma / beta - 1) * v + h * (gamma / (2 * beta) - 1) * a
        )
        free = self._moved(begin, self.factor.solve(known))
        gap = [self.rows @ free.x - self.lowered @ np.ravel(irregularity), self.rows @ free.v]
        motion = solve_compression(
            law, self.compliance, together(gap[: self.contacts.orders], law.directions),
            begin.motion.ravel(),
        ).reshape(begin.motion.shape)  # fmt: skip
        force = law.force(motion).ravel()
        moved = self._moved(begin, free.x - self.response @ force)
        return replace(moved, motion=motion, force=self.pushes @ force)

    def _moved(self, begin: State, x: FloatArray) -> State:
        """The state at the end by its displacements."""
        beta, gamma, h = self.beta, self.gamma, self.length
        a = self.by_x * (x - begin.x) - begin.v / (beta * h) - (0.5 / beta - 1) * begin.a
        v = begin.v + h * ((1 - gamma) * begin.a + gamma * a)
        return replace(begin, time=begin.time + h, x=x, v=v, a=a)

    def _meet(self, position: FloatArray) -> None:
        """What contacts at places do to each other by the end of an interval."""
        if self.where is not None and np.array_equal(position, self.where):
            return
        self.where, self.rows = position, self.contacts.rows(self.mono, position)
        # Displacements at the end by what resists there, shape (n, forces); the columns are sparse
        # and some the same, of a wheelset that has two contacts, which costs little.
        self.response = self.factor.solve(self.rows.toarray().T.copy())
        motions = self.rows @ self.response
        by = [motions, self.rate_by_x * motions][: self.contacts.orders]
        self.compliance = together(by, self.contacts.law.directions)


def together(orders: Sequence[FloatArray], k: int) -> FloatArray:
    """Motions (of all contacts, ...) and their rates, a contact's behind each other."""
    parts = [part.reshape(-1, k, *part.shape[1:]) for part in orders]
    joined: FloatArray = np.concatenate(parts, axis=1).reshape(-1, *orders[0].shape[1:])
    return joined


def apart(motion: FloatArray, orders: int) -> list[FloatArray]:
    """The same back again."""
    return [part.ravel() for part in np.split(motion, orders, axis=-1)]


def met(
    mono: Monolithic,
    contacts: Contacts,
    state: State,
    position: FloatArray,
    irregularity: FloatArray,
) -> State:
    """A state with the forces of its contacts where wheelsets and irregularities are."""
    rows, law = contacts.rows(mono, position), contacts.law
    orders = [rows @ state.x - contacts.lowered(mono) @ np.ravel(irregularity), rows @ state.v]
    motion = together(orders[: contacts.orders], law.directions).reshape(state.motion.shape)
    force = contacts.pushes(mono) @ law.force(motion).ravel()
    return replace(state, motion=motion, force=force)
