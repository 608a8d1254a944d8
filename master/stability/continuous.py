"""What grows where components are coupled exactly: without steps, and without all eigenvalues.

Rates to the right of a line are numbers outside the unit circle by z = (a + s) / (a - s), which
are counted there by the argument principle, whatever the size of the component that is left open.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.linear.modal import real_form
from railcosim.master.linear.state_space import ComplexArray
from railcosim.master.stability.argument_principle import TurningLostError
from railcosim.master.stability.determinant import Determinant

MIDDLE = 600.0
"""a, rad/s: what turns so fast is a quarter of the circle away from what stands."""
LEAST = 1e-3
"""Rate (1/s) of growth that is told from none: motions that nothing damps are on the edge."""
SAME = 1e-6
"""Of a rate: one that is faster by less is that of the same motion."""


@dataclass(frozen=True, kw_only=True)
class Continuous:
    """x' = N x + R f, w = Q x + P f; by modes back to f: q' = poles q + B w, f = 2 Re C q.

    Attributes
    ----------
    N, R, Q, P : array
        A few states, and what goes straight through.
    poles, B, C : array of complex, shapes (n,), (n, n_w) and (n_f, n)
        The modes, 1/s, one of each conjugate pair; a real one counts half in C.
    """

    N: FloatArray
    R: FloatArray
    Q: FloatArray
    P: FloatArray
    poles: ComplexArray
    B: ComplexArray
    C: ComplexArray

    def growth(self) -> float:
        """Rate (1/s) at which the fastest-growing motion grows; zero if none does."""
        found, beyond = 0.0, LEAST
        try:
            while (line := self.right_of(beyond)).outside(1.0):
                z = line.zero_outside(1.0)
                if not z:
                    return max(0.0, self._fastest)
                found = beyond + (MIDDLE * (z - 1.0) / (z + 1.0)).real
                beyond = found + SAME * found
        except TurningLostError:  # a motion is on the line
            return max(0.0, self._fastest)
        return found

    def right_of(self, rate: float) -> Determinant:
        """Whose zeros outside the unit circle are the motions that grow faster than `rate`, 1/s."""
        a, one = MIDDLE, np.eye(len(self.N))
        near = np.linalg.inv((a + rate) * one - self.N).astype(np.float64)
        N = ((a - rate) * one + self.N) @ near
        R, Q = 2.0 * a * near @ self.R, self.Q @ near
        P = self.P + Q @ self.R
        poles = 1.0 / (a + rate - self.poles)
        E, G = (a - rate + self.poles) * poles, 2.0 * a * poles[:, None] * self.B
        C = self.C * poles
        D = 2.0 * (C @ self.B).real  # of w, at once: it agrees with what it makes of itself
        agreed = np.linalg.inv(np.eye(len(P)) - P @ D).astype(np.float64)
        Q, P = agreed @ Q, agreed @ P
        return Determinant(N + R @ D @ Q, R + R @ D @ P, Q, P, E, G, C)

    @cached_property
    def _fastest(self) -> float:
        """The same from all eigenvalues, which take the third power of their number."""
        A, B, C = real_form(self.poles, self.B, self.C)
        few = np.hstack([self.N, self.R @ C])
        modes = B @ np.hstack([self.Q, self.P @ C])
        modes[:, len(self.N) :] += A
        return float(np.linalg.eigvals(np.concatenate([few, modes])).real.max())
