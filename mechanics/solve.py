"""The one balance of contact forces with what they deflect. Needs numpy only."""

from __future__ import annotations

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

    Parameters
    ----------
    law : ContactLaw
        The law of every contact, in k directions.
    G : array, shape (n, n)
        Compliance: by how much unit contact forces push the two bodies apart, m/N. The k directions
        of a contact stand together.
    gap : array, shape (n,)
        Overlap of the bodies without contact forces, m.
    guess : array, shape (n,)
        Where to start, m.

    Returns
    -------
    array, shape (n,)
        m.

    Raises
    ------
    ContactError
        If the numbers are not finite or Newton's method does not settle.
    """
    delta = guess
    eye, k = np.eye(gap.size), law.directions
    for _ in range(MAX_ITERATIONS):
        blocks = delta.reshape(-1, k)
        residual = delta + G @ law.force(blocks).ravel() - gap
        softened = np.einsum("ncj,cjk->nck", G.reshape(gap.size, -1, k), law.tangent(blocks))
        change = np.linalg.solve(eye + softened.reshape(G.shape), residual)
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
