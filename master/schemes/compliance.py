"""Contact forces against a compliance that was measured over a step."""

from __future__ import annotations

import numpy as np

from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.law import ForceLaw
from railcosim.master.schemes.variants import Variant

MAX_ITERATIONS = 100  # Newton takes 3 to 10, more where a step is many times too long
SETTLED = 1e-12  # of the largest force, here or at first: four digits above rounding
SHORTEST = 1e-4  # of a Newton step, below which shortening it has not helped
NOISE = 1e-10  # of the compressions: a smaller change of them says nothing of the compliance


def solve_forces(
    law: ForceLaw, variant: Variant, G: FloatArray, start: FloatArray, force: FloatArray
) -> FloatArray:
    """Forces over a step that agree with the compressions they lead to.

    Solves ``force' = project law(start + answers G (force' - force))`` by Newton's method, its
    steps halved until they lead nearer. With the law's force rising with compression, and bodies
    that yield to forces, a held force has one solution; of higher polynomials in steps far too long
    for the contact this is not certain.

    Parameters
    ----------
    law : ForceLaw
        Of every spring.
    variant : Variant
        Which polynomial of the force is sought.
    G : array, shape (n_answers, n_springs, degree + 1, n_springs)
        Change of the compressions sampled, per Legendre coefficient of the forces, m/N.
    start : array, shape (n_nodes, n_springs)
        Compressions at the nodes found with `force`, m.
    force : array, shape (degree + 1, n_springs)
        Legendre coefficients of the forces with which they were found, N.

    Returns
    -------
    array, shape (degree + 1, n_springs)
        N.

    Raises
    ------
    ComponentError
        If there is none, or Newton's method does not find it.
    """
    # Matrices, by which products are several times faster than by tensors: compressions at all
    # nodes by all coefficients.
    slope = (variant.answers @ G.reshape(len(G), -1)).reshape(start.size, force.size)
    eye = np.eye(force.size)

    def imbalance(change: FloatArray) -> tuple[FloatArray, FloatArray]:
        delta = start + (slope @ change.ravel()).reshape(start.shape)
        return delta, force + change - variant.project @ law.force(delta)

    change = np.zeros_like(force)
    delta, residual = imbalance(change)
    for _ in range(MAX_ITERATIONS):
        tangent = law.stiffness(delta).reshape(-1, 1) * slope
        J = eye - (variant.project @ tangent.reshape(len(start), -1)).reshape(eye.shape)
        correction = np.linalg.solve(J, residual.ravel()).reshape(force.shape)
        size = float(np.abs(correction).max())
        largest = max(float(np.abs(force).max()), float(np.abs(force + change).max()))
        if size <= SETTLED * largest:
            return force + change - correction
        if not np.isfinite(size):
            break
        share, before = 1.0, float(np.linalg.norm(residual))
        while True:
            delta, residual = imbalance(change - share * correction)
            if float(np.linalg.norm(residual)) < before or share < SHORTEST:
                break
            share /= 2
        change = change - share * correction
    raise ComponentError(
        f"the forces of a step could not be found (largest compression {np.abs(start).max():g} m, "
        f"variant {variant.name}): motions are far off, or the step is far too long for the "
        "contact; use a shorter one, or the variant average-hold, which always has a solution"
    )


def broyden(G: FloatArray, change: FloatArray, answer: FloatArray, size: float) -> FloatArray:
    """Make the compliance agree with what a change of the forces has just done.

    Parameters
    ----------
    G : array, shape (n_answers, n_springs, degree + 1, n_springs)
        The compliance, m/N.
    change : array, shape (degree + 1, n_springs)
        Of the forces, N.
    answer : array, shape (n_answers, n_springs)
        Change of the compressions, m.
    size : float
        Largest compression or motion, m: the yardstick for rounding.

    Returns
    -------
    array
        Of the shape of `G`: the nearest to it that turns `change` into `answer`.

    References
    ----------
    .. [1] C. G. Broyden, Math. Comp. 19 (1965) 577-593.
    """
    if float(np.abs(answer).max()) <= NOISE * size:
        return G
    wrong = answer - np.tensordot(G, change, 2)
    updated: FloatArray = G + np.multiply.outer(wrong, change / (change**2).sum())
    return updated
