"""The one balance of contact forces with what they move. Needs numpy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .arrays import FloatArray
from .law import ContactLaw, OwnLaw

MAX_ITERATIONS = 50  # Newton takes 3 or 4; far more means numbers without a physical meaning
RELATIVE_TOLERANCE = 1e-12  # of the largest force: four digits above rounding
SMALLEST_PART = 1e-3  # of a Newton step that is taken where all of it leads away


class ContactError(ArithmeticError):
    """The contact forces could not be found."""


def solve_compression(
    law: ContactLaw, G: FloatArray, gap: FloatArray, guess: FloatArray
) -> FloatArray:
    """Compressions for which the contact forces and what they deflect agree.

    Solves ``delta + G force(delta) = gap`` by Newton's method, until a step no longer changes the
    forces; where all of a step leads away, as creep that friction bounds may do, a part of it is
    taken. With G positive semi-definite and a force that never falls with compression, there is one
    solution.

    What a law needs to know may be more than it has forces, or something else than compressions:
    motions and their rates, say. Then there are m numbers a contact, and k forces.

    Parameters
    ----------
    law : ContactLaw
        The law of every contact, in k directions.
    G : array, shape (contacts x m, contacts x k)
        Compliance: by how much unit contact forces push the two bodies apart, m/N. What is of one
        contact stands together.
    gap : array, shape (contacts x m,)
        Overlap of the bodies without contact forces, m.
    guess : array, shape (contacts x m,)
        Where to start, m.

    Returns
    -------
    array, shape (contacts x m,)
        m.

    Raises
    ------
    ContactError
        If the numbers are not finite or Newton's method does not settle.
    """
    compliance = G.reshape(gap.size, -1, law.directions)
    eye, contacts = np.eye(gap.size), compliance.shape[1]
    delta, force = guess, law.force(guess.reshape(contacts, -1))
    balanced = np.full_like(force, np.inf)  # those that delta follows from
    for _ in range(MAX_ITERATIONS):
        tangent = law.tangent(delta.reshape(contacts, -1))
        softened = np.einsum("ncj,cjk->nck", compliance, tangent)
        residual = delta + G @ force.ravel() - gap
        change = -np.linalg.solve(eye + softened.reshape(eye.shape), residual)
        linear = force + np.einsum("cjm,cm->cj", tangent, change.reshape(contacts, -1))
        if np.abs(linear - balanced).max() <= RELATIVE_TOLERANCE * np.abs(linear).max():
            return delta + change
        if not np.isfinite(change).all():
            break
        part, wrong, begin, before = 1.0, np.linalg.norm(force - balanced), delta, balanced
        while True:
            delta = begin + part * change
            balanced = linear if part == 1.0 else before + part * (linear - before)
            force = law.force(delta.reshape(contacts, -1))
            if np.linalg.norm(force - balanced) <= wrong or part < SMALLEST_PART:
                break
            part /= 2
    raise ContactError(
        "the contact forces could not be found: the wheel or rail motions set from outside are "
        f"not finite or far off (largest force {np.abs(force).max():g} N)"
    )


def forces(law: ContactLaw, compression: FloatArray) -> FloatArray:
    """Forces of a law at all ports, from compressions of shape (n,), N."""
    return law.force(compression.reshape(-1, law.directions)).ravel()


@dataclass(frozen=True)
class AtRest:
    """A law as one of the body's own motions, nothing of which moves."""

    law: OwnLaw
    given: FloatArray

    @property
    def directions(self) -> int:
        """Of the body."""
        return self.law.directions

    def force(self, q: FloatArray) -> FloatArray:
        """Of motions, shape (contacts, k)."""
        return self.law.force(q, np.zeros_like(q), self.given)

    def tangent(self, q: FloatArray) -> FloatArray:
        """Its derivatives."""
        return self.law.tangents(q, np.zeros_like(q), self.given)[0]


@dataclass(frozen=True)
class AtOnce:
    """A law as one of the rates of the body's own motions, at an instant: these are known."""

    law: OwnLaw
    q: FloatArray
    given: FloatArray

    @property
    def directions(self) -> int:
        """Of the body."""
        return self.law.directions

    def force(self, v: FloatArray) -> FloatArray:
        """Of rates, shape (contacts, k)."""
        return self.law.force(self.q, v, self.given)

    def tangent(self, v: FloatArray) -> FloatArray:
        """Its derivatives."""
        return self.law.tangents(self.q, v, self.given)[1]


NODES, WEIGHTS = (np.polynomial.legendre.leggauss(3)[k] for k in (0, 1))
"""Of Gauss's rule on -1 .. 1: exact for a line times a parabola."""
_BOW = (3 * NODES**2 - 1) / 2
VALUES = np.stack([(_BOW - NODES) / 2, 1 - _BOW, (_BOW + NODES) / 2], axis=1)
"""At the nodes, one a row: a parabola by its value at the beginning, its mean, its value at the
end."""
RATES = np.stack([3 * NODES - 1, -6 * NODES, 3 * NODES + 1], axis=1)
"""Likewise its derivative, times the length of the step."""
LINE = np.stack([WEIGHTS / 2, 3 * NODES * WEIGHTS / 2], axis=1)
"""Mean and slope of the line mean + slope x that is nearest to a function, by what that is at the
nodes, one a row."""


@dataclass(frozen=True)
class OverStep:
    """A law over a step, as a law of twice as many directions.

    Motions of the body on average over the step and at its end, to mean and slope of the line in
    time that is nearest to the law's force along the parabola through them and those at the
    beginning. Its rates are the parabola's own. So the line does as much work on the body as the
    law does along the parabola at Gauss's nodes: creep, which takes energy there, takes it from the
    body, whatever the step.

    Attributes
    ----------
    law : OwnLaw
        In k directions.
    h : float
        Length of the step, s.
    begin : array, shape (contacts, k)
        Motions at the beginning.
    rolled : array, shape (3, contacts, k)
        By how much motions where the wheels are differ from those of the material in the middle of
        their way: at the beginning, on average, at the end. That is no motion of the material.
    given : array, shape (3, contacts, g)
        What the law is given, at the nodes.
    """

    law: OwnLaw
    h: float
    begin: FloatArray
    rolled: FloatArray
    given: FloatArray

    @property
    def directions(self) -> int:
        """Mean and slope of each."""
        return 2 * self.law.directions

    def force(self, motion: FloatArray) -> FloatArray:
        """Means, then slopes, shape (contacts, 2 k)."""
        f = self.law.force(*self._along(motion), self.given)
        found: FloatArray = np.einsum("jp,jck->cpk", LINE, f).reshape(motion.shape)
        return found

    def tangent(self, motion: FloatArray) -> FloatArray:
        """Their derivatives, shape (contacts, 2 k, 2 k)."""
        by_q, by_v = self.law.tangents(*self._along(motion), self.given)
        parts: FloatArray = np.einsum("jp,ja,jcik->cpiak", LINE, VALUES[:, 1:], by_q)
        parts += np.einsum("jp,ja,jcik->cpiak", LINE, RATES[:, 1:] / self.h, by_v)
        return parts.reshape(len(motion), self.directions, self.directions)

    def _along(self, motion: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Motions and their rates at the nodes, each of shape (3, contacts, k)."""
        way = np.stack([self.begin, *np.split(motion, 2, axis=1)])
        q = np.einsum("jp,pck->jck", VALUES, way)
        v = np.einsum("jp,pck->jck", RATES / self.h, way - self.rolled)
        return q, v
