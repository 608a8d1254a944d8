"""A law between motions and forces, in the master: a component without a state.

With it nobody who is coupled has to own the spring between them, and a scheme that knows the law
can solve for its forces.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railcosim.master.component import Component, FloatArray, Variable


class ForceLaw(Protocol):
    """Force of each of several like springs against its compression, arrays of one shape."""

    def force(self, compression: FloatArray) -> FloatArray:
        """Force (N), compression (m) positive."""

    def stiffness(self, compression: FloatArray) -> FloatArray:
        """Its derivative, N/m."""


class Law(Component):
    """Springs whose forces follow at once from the motions they are given.

    Parameters
    ----------
    name : str
        Name, unique in a system.
    law : ForceLaw
        Of every spring.
    motions : sequence of Variable
        The inputs, in m.
    forces : sequence of Variable
        The outputs, one a spring, in N.
    compression : array_like, shape (n_springs, n_motions)
        Which motions, with what sign, add up to the compression of each spring.

    Attributes
    ----------
    law
        As given.
    S : array, shape (n_springs, n_motions)
        `compression`.
    """

    can_rollback = True
    max_input_derivative = 2  # nothing happens within a step, so any polynomial will do

    def __init__(
        self,
        name: str,
        law: ForceLaw,
        motions: Sequence[Variable],
        forces: Sequence[Variable],
        compression: ArrayLike,
    ) -> None:
        super().__init__(name, motions, forces)
        self.law = law
        self.S: FloatArray = np.array(compression, dtype=np.float64)
        if self.S.shape != (len(self.outputs), len(self.inputs)):
            raise ValueError(
                f"{name}: compression is {self.S.shape}, it must have a row for each of "
                f"{len(self.outputs)} forces and a column for each of {len(self.inputs)} motions"
            )

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        """A force depends at once on the motions of its own spring."""
        depends: NDArray[np.bool_] = self.S != 0.0
        return depends

    def write_inputs(self) -> None:
        """Do nothing: `u` is all there is."""

    def read_outputs(self) -> None:
        """Evaluate the law."""
        self.y[:] = self.law.force(self.S @ self.u)

    def set_input_derivatives(self, derivatives: FloatArray) -> None:
        """Do nothing: only the inputs at the end of a step count."""

    def do_step(self, t: float, h: float) -> None:
        """Do nothing: there is no state."""

    def save_state(self) -> None:
        """Nothing to save."""

    def restore_state(self, state: None) -> None:
        """Nothing to restore."""
