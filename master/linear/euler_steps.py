"""A linear model whose FMU makes one step of Euler's rule of each communication step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.linear.state_space import StateSpace


@dataclass(frozen=True, kw_only=True)
class EulerSteps(StateSpace):
    """What moves by x' = A x + B u, but goes x + h (A x + B u) in a step of length h.

    So do FMUs for Co-Simulation that OpenModelica makes unless told otherwise. Inputs count as they
    are at the beginning, whatever their derivatives: the rule asks for rates there only.
    """

    is_divisible = False

    def over(self, times: FloatArray, degree: int) -> tuple[FloatArray, FloatArray]:
        """Of one step each; see `StateSpace`."""
        n, m = self.B.shape
        h = times[..., None, None]
        driven = np.zeros((*times.shape, n, (degree + 1) * m))
        driven[..., :m] = h * self.B
        return np.eye(n) + h * self.A.toarray(), driven
