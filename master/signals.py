"""Given functions of time as a component: irregularities, positions."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from railcosim.master.component import Component, Variable


class Signal(Component):
    """A component without inputs whose outputs are a function of time.

    Parameters
    ----------
    name : str
        Name, unique in a system.
    outputs : sequence of Variable
        What it gives.
    function : callable
        Of time (s) to values, shape (n_outputs,), in the units of `outputs`.
    start : float, optional
        Time (s) before the first step.
    """

    can_rollback = True

    def __init__(
        self,
        name: str,
        outputs: Sequence[Variable],
        function: Callable[[float], ArrayLike],
        start: float = 0.0,
    ) -> None:
        super().__init__(name, (), outputs)
        self._function = function
        self._time = start
        shape = np.shape(function(start))
        if shape != (len(self.outputs),):
            raise ValueError(
                f"signal {name}: its function returns shape {shape}, it must be "
                f"({len(self.outputs)},), one value for each output"
            )

    def write_inputs(self) -> None:
        """Do nothing: there are no inputs."""

    def read_outputs(self) -> None:
        """Evaluate the function at the present time."""
        self.y[:] = self._function(self._time)

    def do_step(self, t: float, h: float) -> None:
        """Go to time `t + h` (s)."""
        self._time = t + h

    def save_state(self) -> float:
        """Give the time: all the state there is."""
        return self._time

    def restore_state(self, state: float) -> None:
        """Go back in time."""
        self._time = state
