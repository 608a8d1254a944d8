"""Given functions of time as a component: irregularities, positions."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railcosim.master.component import FloatArray, Hold, Variable


class Signal:
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

    inputs: tuple[Variable, ...] = ()
    holds = frozenset(Hold)  # nothing to hold
    can_rollback = True

    def __init__(
        self,
        name: str,
        outputs: Sequence[Variable],
        function: Callable[[float], ArrayLike],
        start: float = 0.0,
    ) -> None:
        self.name = name
        self.outputs = tuple(outputs)
        self._function = function
        self._time = start
        shape = np.shape(function(start))
        if shape != (len(self.outputs),):
            raise ValueError(
                f"signal {name}: its function returns shape {shape}, it must be "
                f"({len(self.outputs)},), one value for each output"
            )

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        """Nothing depends on inputs, shape (n_outputs, 0)."""
        return np.zeros((len(self.outputs), 0), dtype=bool)

    def set_hold(self, hold: Hold) -> None:
        """Do nothing: there are no inputs."""

    def set_inputs(self, u: FloatArray) -> None:
        """Do nothing: there are no inputs."""

    def get_outputs(self) -> FloatArray:
        """Values at the present time, shape (n_outputs,)."""
        return np.asarray(self._function(self._time), dtype=np.float64)

    def do_step(self, t: float, h: float) -> None:
        """Go to time `t + h` (s)."""
        self._time = t + h

    def save_state(self) -> float:
        """Give the time: all the state there is."""
        return self._time

    def restore_state(self, state: float) -> None:
        """Go back in time."""
        self._time = state
