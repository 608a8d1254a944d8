"""Contact forces against a compliance that was measured over a step."""

from __future__ import annotations

import math

import numpy as np

from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.law import Law
from railcosim.master.schemes.nodes import Nodes

MAX_ITERATIONS = 100  # Newton takes 3 to 10, more where a step is many times too long
SETTLED = 1e-12  # of the largest force, here or at first: four digits above rounding
SHORTEST = 1e-4  # of a Newton step, below which shortening it has not helped
QUICK = 0.03  # of an imbalance: a step that leaves more shows that the inverse is stale
NOISE = 1e-10  # of the displacements: a smaller change of them says nothing of the compliance


class Balance:
    """Forces over a step that agree with the motions they lead to.

    Solves ``force' = project law(start + answers G (force' - force))`` by Newton's method, its
    steps halved until they lead nearer. With the law's force rising with compression, and bodies
    that yield to forces, a held force has one solution; of higher polynomials in steps far too long
    for the contact this is not certain. What corrects them is kept for as long as it leads there
    quickly, from step to step, and learns from what each correction leaves: to find it anew,
    tangents of the law and the inverse of a matrix, costs several times what the law's forces do.

    Parameters
    ----------
    law : Law
        The law.
    nodes : Nodes
        Where it is asked, and which polynomial of the force is sought.

    Attributes
    ----------
    inverse : array or None, shape ((degree + 1) n_forces, the same)
        Of the derivatives of what forces differ by from the law's, by the forces, where it was last
        found; None: to be found.
    """

    def __init__(self, law: Law, nodes: Nodes) -> None:
        self._law, self._nodes = law, nodes
        self.inverse: FloatArray | None = None
        self._least = SETTLED * max(v.nominal for v in law.outputs)  # where contacts are open

    def solve(self, h: float, G: FloatArray, start: FloatArray, force: FloatArray) -> FloatArray:
        """Find the forces.

        Parameters
        ----------
        h : float
            Length of the step, s.
        G : array, shape (n_answers, n_displacements, degree + 1, n_forces)
            Change of the displacements sampled, per Legendre coefficient of the forces, m/N.
        start : array, shape (n_nodes, n_contacts, m)
            Motions at the nodes found with `force`.
        force : array, shape (degree + 1, n_forces)
            Legendre coefficients of the forces with which they were found, N.

        Returns
        -------
        array, shape (degree + 1, n_forces)
            N.

        Raises
        ------
        ComponentError
            If there is none, or Newton's method does not find it.
        """
        change, slow, shrinks = np.zeros_like(force), False, 1.0
        scale = max(_largest(force), self._least)
        motion, residual = start, self._left(start, force)
        for _ in range(MAX_ITERATIONS):
            fresh = self.inverse is None
            correction = self._correction(h, G, motion, residual)
            moved = _largest(correction)
            # What it leaves to correct is as much less again as the last one left.
            if moved * shrinks <= SETTLED * scale:
                return force + change - correction
            if slow or not math.isfinite(moved):
                self.inverse, fresh = None, True
                correction = self._correction(h, G, motion, residual)
                if not np.isfinite(correction).all():
                    break
            share, before = 1.0, _norm(residual)
            while True:
                further = change - share * correction
                tried = self._imbalance(h, G, start, force, further)
                left = _norm(tried[1])
                if left < before or share < SHORTEST:
                    break
                if fresh:
                    share /= 2
                    continue
                self.inverse, fresh = None, True
                correction = self._correction(h, G, motion, residual)
            slow = not left < QUICK * before
            if not slow:
                self._learn(correction, tried[1])
            shrinks = 1.0 if slow else left / before
            change, (motion, residual) = further, tried
            scale = max(scale, _largest(force + change))
        farthest = float(np.abs(start[..., self._nodes.places]).max())
        raise ComponentError(
            f"the forces of a step could not be found (largest displacement {farthest:g} m, "
            f"variant {self._nodes.variant.name}): motions are far off, or the step is far too "
            "long for the contact; use a shorter one, or the variant average-hold, which always "
            "has a solution"
        )

    def wrong(self, h: float, G: FloatArray, start: FloatArray, force: FloatArray) -> float:
        """How far forces are from those, N: by the first correction, of a kept inverse."""
        return _largest(self._correction(h, G, start, self._left(start, force)))

    def _imbalance(
        self, h: float, G: FloatArray, start: FloatArray, force: FloatArray, change: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Motions at the nodes, and what changed forces differ by from the law's."""
        answer = (G.reshape(-1, change.size) @ change.ravel()).reshape(len(G), -1)
        motion = start + self._nodes.answer(answer, h)
        return motion, self._left(motion, force + change)

    def _left(self, motion: FloatArray, force: FloatArray) -> FloatArray:
        """What forces differ by from the law's."""
        forces = self._law.law.force(motion).reshape(len(motion), -1)
        differ: FloatArray = force - self._nodes.variant.project @ forces
        return differ

    def _correction(
        self, h: float, G: FloatArray, motion: FloatArray, residual: FloatArray
    ) -> FloatArray:
        """By Newton's method, with the kept inverse if there is one."""
        if self.inverse is None:
            self.inverse = self._inverted(h, G, motion)
        corrected: FloatArray = self.inverse @ residual.ravel()
        return corrected.reshape(residual.shape)

    def _learn(self, correction: FloatArray, residual: FloatArray) -> None:
        """Make the kept inverse agree with what a correction has left; see `broyden`."""
        assert self.inverse is not None
        was, further = correction.ravel(), self.inverse @ residual.ravel()
        row = (was @ self.inverse) / (was @ (was - further))
        self.inverse = self.inverse + np.multiply.outer(further, row)

    def _inverted(self, h: float, G: FloatArray, motion: FloatArray) -> FloatArray:
        contacts = self._nodes.contacts
        by = self._nodes.gather(self._law.law.tangent(motion), h)
        size = len(by) * len(self._law.outputs)
        # Matrices of the displacements of one contact, many times faster than tensors.
        parts = G.reshape(len(G), contacts, -1, size).swapaxes(0, 1).reshape(contacts, -1, size)
        own = by.transpose(2, 0, 3, 1, 4).reshape(contacts, -1, parts.shape[1])
        turned = (own @ parts).reshape(contacts, len(by), -1, size).swapaxes(0, 1)
        J: FloatArray = np.eye(size) - turned.reshape(size, size)
        found: FloatArray = np.asarray(np.linalg.inv(J), dtype=np.float64)
        return found


def broyden(G: FloatArray, change: FloatArray, answer: FloatArray, size: float) -> FloatArray:
    """Make the compliance agree with what a change of the forces has just done.

    Parameters
    ----------
    G : array, shape (n_answers, n_displacements, degree + 1, n_forces)
        The compliance, m/N.
    change : array, shape (degree + 1, n_forces)
        Of the forces, N.
    answer : array, shape (n_answers, n_displacements)
        Change of the displacements, m.
    size : float
        The largest of them, m: the yardstick for rounding.

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
    told = (G.reshape(-1, change.size) @ change.ravel()).reshape(answer.shape)
    updated: FloatArray = G + np.multiply.outer(answer - told, change / (change**2).sum())
    return updated


def _largest(values: FloatArray) -> float:
    return float(np.abs(values).max())


def _norm(values: FloatArray) -> float:
    flat = values.ravel()
    return math.sqrt(flat @ flat)
