"""Given functions of time as a component: irregularities, positions."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from railcosim.master.component import Component, FloatArray, Variable


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
    vectorised : bool, optional
        Whether `function` also takes times, shape (n,), and gives values, shape (n, n_outputs),
        to the bit those that it gives for each time alone. It is then asked for many at once.
    """

    can_rollback = True

    def __init__(
        self,
        name: str,
        outputs: Sequence[Variable],
        function: Callable[[Any], ArrayLike],
        start: float = 0.0,
        *,
        vectorised: bool = False,
    ) -> None:
        super().__init__(name, (), outputs)
        self._function = function
        self._time = start
        self._vectorised = vectorised
        self._foreseen: dict[float, int] = {}
        """Where among `_times` a time is, whose values are known."""
        self._times, self._values = np.empty(0), np.empty((0, len(self.outputs)))
        shape = np.shape(function(start))
        if shape != (len(self.outputs),):
            raise ValueError(
                f"signal {name}: its function returns shape {shape}, it must be "
                f"({len(self.outputs)},), one value for each output"
            )

    def write_inputs(self) -> None:
        """Do nothing: there are no inputs."""

    def read_outputs(self) -> None:
        """Evaluate the function at the present time, unless that has been done."""
        at = self._foreseen.get(self._time)
        self.y[...] = self._function(self._time) if at is None else self._values[at]

    def foresee(self, times: FloatArray) -> None:
        """Evaluate the function at many times; see `Component`."""
        if self._vectorised:
            # What it cannot be asked for it will refuse when it is really asked.
            with contextlib.suppress(ValueError, ArithmeticError):
                self._values = np.asarray(self._function(times), dtype=np.float64)
                self._times = times
                self._foreseen = {time: at for at, time in enumerate(times.tolist())}

    def do_step(self, t: float, h: float) -> None:
        """Go to time `t + h` (s)."""
        self._time = t + h

    def through(self, t: float, ends: FloatArray) -> FloatArray:
        """Evaluate the function at many times; see `Component`."""
        if not self._vectorised:
            return super().through(t, ends)
        self._time = float(ends[-1])
        at = self._foreseen.get(float(ends[0]), len(self._times))
        if np.array_equal(self._times[at : at + len(ends)], ends):
            found = self._values[at : at + len(ends)]
        else:
            found = np.asarray(self._function(ends), dtype=np.float64)
        self.y[...] = found[-1]
        return found

    def save_state(self) -> float:
        """Give the time: all the state there is."""
        return self._time

    def restore_state(self, state: float) -> None:
        """Go back in time."""
        self._time = state
