"""The one balance of contact forces with what they deflect. Needs numpy only."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .law import ContactLaw

FloatArray = NDArray[np.float64]

MAX_ITERATIONS = 50  # Newton takes 3 or 4; far more means numbers without a physical meaning
RELATIVE_TOLERANCE = 1e-12  # of the compression: four digits above rounding


class ContactError(ArithmeticError):
    """The contact forces could not be found."""


def solve_compression(
    law: ContactLaw, G: FloatArray, gap: FloatArray, guess: FloatArray
) -> FloatArray:
    """Compressions for which the contact forces and what they deflect agree.

    Solves ``delta + G force(delta) = gap`` by Newton's method. With G positive semi-definite and a
    force that never falls with compression, there is one solution.

    What a law needs to know may be more than it has forces: motions and their rates, say. Then
    there are m numbers a contact, and k forces.

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
    delta = guess
    eye, k = np.eye(gap.size), law.directions
    compliance = G.reshape(gap.size, -1, k)
    for _ in range(MAX_ITERATIONS):
        blocks = delta.reshape(compliance.shape[1], -1)
        residual = delta + G @ law.force(blocks).ravel() - gap
        softened = np.einsum("ncj,cjk->nck", compliance, law.tangent(blocks))
        change = np.linalg.solve(eye + softened.reshape(eye.shape), residual)
        delta = delta - change
        size = float(np.abs(change).max())
        if size <= RELATIVE_TOLERANCE * float(np.abs(delta).max()):
            return delta
        if not np.isfinite(size):
            break
    raise ContactError(
        "the contact forces could not be found: the wheel or rail motions set from outside are "
        f"not finite or far off (largest overlap {np.abs(gap).max():g} m)"
    )


def forces(law: ContactLaw, compression: FloatArray) -> FloatArray:
    """Forces of a law at all ports, from compressions of shape (n,), N."""
    return law.force(compression.reshape(-1, law.directions)).ravel()


NODES, WEIGHTS = (np.polynomial.legendre.leggauss(3)[k] for k in (0, 1))
"""Of Gauss's rule on -1 .. 1: exact for a line times a parabola."""


@dataclass(frozen=True)
class OverStep:
    """A law over a step, as a law of twice as many directions.

    Compressions on average over the step and at its end, to mean and slope of the line in time that
    is nearest to the law's force along the parabola through them and those at the beginning.

    Attributes
    ----------
    law : ContactLaw
        In k directions.
    begin : array, shape (contacts, k)
        Compressions at the beginning, m.
    """

    law: ContactLaw
    begin: FloatArray

    @property
    def directions(self) -> int:
        """Mean and slope of each."""
        return 2 * self.law.directions

    def force(self, compression: FloatArray) -> FloatArray:
        """Means, then slopes, shape (contacts, 2 k)."""
        found = np.zeros_like(compression).reshape(len(compression), 2, -1)
        for x, weight, pressed, _ in self._along(compression):
            f = weight * self.law.force(pressed)
            found += np.stack([f, 3 * x * f], axis=1)
        return found.reshape(compression.shape)

    def tangent(self, compression: FloatArray) -> FloatArray:
        """Their derivatives, shape (contacts, 2 k, 2 k)."""
        n, k = len(compression), self.law.directions
        found = np.zeros((n, 2, k, 2, k))
        for x, weight, pressed, by in self._along(compression):
            tangent = weight * self.law.tangent(pressed)
            for part, share in enumerate((1.0, 3 * x)):
                for at, how in enumerate(by):
                    found[:, part, :, at, :] += share * how * tangent
        return found.reshape(n, 2 * k, 2 * k)

    def _along(
        self, compression: FloatArray
    ) -> Iterator[tuple[float, float, FloatArray, tuple[float, float]]]:
        """Place, weight, compression there, and how much of those on average and at the end."""
        mean, end = np.split(compression, 2, axis=1)
        for x, weight in zip(NODES, WEIGHTS / 2, strict=True):
            bow = (3 * x**2 - 1) / 2
            begins, ends = (bow - x) / 2, (bow + x) / 2
            pressed = begins * self.begin + (1 - bow) * mean + ends * end
            yield x, weight, pressed, (1 - bow, ends)
