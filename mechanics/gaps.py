"""Springs with a gap that closes: they press where it is closed, and never pull.

Needs numpy only: a copy of this file travels in every FMU.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .arrays import ComplexArray, FloatArray
from .stepping import Coefficients

MOST_STEPS, SMALLEST_PART = 50, 1e-3
ROUNDING = 1e-13  # of a stretch
MOST_TURNS = 100  # of which gaps are closed at rest: each closes or opens a few times at most


@dataclass(frozen=True, kw_only=True)
class Gaps:
    """Springs at fixed places of a body, beside what its modes know of.

    Attributes
    ----------
    shown : array, shape (m, n)
        Stretches by the modes, down at the top; forces drive these by the same.
    stiffness, damping : array, shape (m,)
        Where closed, N/m and N s/m.
    gap : array, shape (m,)
        Stretch at which each closes, m.
    """

    shown: ComplexArray
    stiffness: FloatArray
    damping: FloatArray
    gap: FloatArray

    def stretch(self, s: ComplexArray) -> FloatArray:
        """By modes, of which those beyond n show nothing; shape (m,), m."""
        found: FloatArray = (self.shown @ s[: self.shown.shape[1]]).real
        return found

    def compliance(self, weight: ComplexArray) -> FloatArray:
        """Stretches by forces that move modes by a weight, (m, m)."""
        found: FloatArray = ((self.shown * weight[: self.shown.shape[1]]) @ self.shown.T).real
        return found

    def moved(self, weight: ComplexArray, force: FloatArray) -> ComplexArray:
        """What pressing forces move the modes by."""
        n = self.shown.shape[1]
        moved = np.zeros(weight.size, complex)
        moved[:n] = -weight[:n] * (force @ self.shown)
        return moved

    def step(self, c: Coefficients, before: ComplexArray, after: ComplexArray) -> ComplexArray:
        """Modes at the end of a step, from those at its ends without these springs.

        Over the step each has one force, which takes from the body just what the spring has more
        at the end, and what its damper takes: nothing grows.
        """
        weight = c.h * c.phi[1]
        begin = self.stretch(before)
        force = _balance(
            lambda end: self._over(c.h, begin, end), self.compliance(weight), self.stretch(after)
        )
        return after + self.moved(weight, force)

    def rest(self, poles: ComplexArray, s: ComplexArray) -> ComplexArray:
        """Modes at rest, from those without these springs."""
        force = _balance(self._at_rest, self.compliance(-1 / poles), self.stretch(s))
        return s + self.moved(-1 / poles, force)

    def _at_rest(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Forces of stretches, and their derivatives."""
        over = q - self.gap
        return self.stiffness * np.maximum(over, 0.0), np.where(over > 0, self.stiffness, 0.0)

    def _over(self, h: float, begin: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
        """One force for all of a step h, of the stretches at its ends, and its derivative.

        Times the way it is the change of the spring's energy; a damper takes part as far as the gap
        is closed on the way, and does not pull.
        """
        k, c = self.stiffness, self.damping / h
        p, q = (np.maximum(at - self.gap, 0.0) for at in (begin, end))
        mixed = (p > 0) != (q > 0)
        # Of the way, how much is closed.
        part = np.where(p > 0, 1.0, 0.0)
        part[mixed] = ((q - p) / np.where(mixed, end - begin, 1.0))[mixed]
        force = k * part * (p + q) / 2 + c * (q - p)
        closing = np.where(p > 0, k / 2, k * part * (1 - part / 2)) + c
        slope = np.where(q > 0, closing, k * part**2 / 2)
        return np.maximum(force, 0.0), np.where(force > 0, slope, 0.0)

    def closed_under(
        self, closed: NDArray[np.bool_], R: FloatArray, S: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """What closed ones take of a body's compliance at rest, and by how much they lift it.

        Parameters
        ----------
        closed : array of bool, shape (m,)
            Which are.
        R : array, shape (ports, m)
            Motions at the ports by forces of these, m/N.
        S : array, shape (m, m)
            Their stretches by their forces.
        """
        A = np.diag(1 / self.stiffness) + S
        part = R[:, closed] @ np.linalg.inv(A[np.ix_(closed, closed)])
        return part @ R[:, closed].T, part @ self.gap[closed]

    def are_closed(
        self, closed: NDArray[np.bool_], R: FloatArray, S: FloatArray, force: FloatArray
    ) -> NDArray[np.bool_]:
        """Which are closed at rest under forces at the ports, if those were."""
        A = np.diag(1 / self.stiffness) + S
        free, own = R.T @ force, np.zeros(self.gap.size)
        own[closed] = np.linalg.solve(A[np.ix_(closed, closed)], free[closed] - self.gap[closed])
        found: NDArray[np.bool_] = free - S @ own > self.gap
        return found


def _balance(
    law: Callable[[FloatArray], tuple[FloatArray, FloatArray]], G: FloatArray, free: FloatArray
) -> FloatArray:
    """Forces that agree with the stretches they leave, q + G force(q) = free, by Newton's method.

    Of a force that never falls with its stretch there is one solution; where all of a step leads
    away from it, as over a corner of the law, a part is taken.
    """
    q = free
    force, slope = law(q)
    off = q + G @ force - free
    for _ in range(MOST_STEPS):
        step, part = -np.linalg.solve(np.eye(q.size) + G * slope, off), 1.0
        begin, wrong = q, np.abs(off).max()
        while True:
            q = begin + part * step
            force, slope = law(q)
            off = q + G @ force - free
            if np.abs(off).max() <= wrong or part < SMALLEST_PART:
                break
            part /= 2
        if np.abs(step).max() <= ROUNDING * np.abs(q).max():
            break
    return force
