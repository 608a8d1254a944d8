"""An FMU that cannot go back to a state, for those who start from one again and again.

It begins anew, and does once more what led to the state.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.master.component import Component, FloatArray, Hold
from railcosim.master.fmi.loaded_fmu import LoadedFmu


class BegunAnew(Component):
    """A component in whose place a new instance steps whenever it goes back.

    Parameters
    ----------
    make : callable
        Gives an initialised instance, always in the same state.
    """

    can_rollback = True

    def __init__(self, make: Callable[[], LoadedFmu]) -> None:
        self._make, self._fmu = make, make()
        super().__init__(self._fmu.name, self._fmu.inputs, self._fmu.outputs)
        self.u[:] = self._fmu.u
        self._past: list[tuple[FloatArray, float, float]] = []

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        """As of the FMU."""
        return self._fmu.feedthrough

    @property
    def states_dependence(self) -> NDArray[np.bool_]:
        """Likewise."""
        return self._fmu.states_dependence

    def set_hold(self, hold: Hold) -> None:
        """Only as it is: held."""
        self._fmu.set_hold(hold)

    def write_inputs(self) -> None:
        """Make `u` the inputs."""
        self._fmu.set_inputs(self.u)

    def read_outputs(self) -> None:
        """Read the outputs into `y`."""
        self.y[:] = self._fmu.get_outputs()

    def do_step(self, t: float, h: float) -> None:
        """Step, and take note of it."""
        self._past.append((self.u.copy(), t, h))
        self._fmu.do_step(t, h)

    def save_state(self) -> Any:
        """All steps so far."""
        return tuple(self._past)

    def restore_state(self, state: Any) -> None:
        """Begin anew, and make these steps again."""
        self._fmu.close()
        self._fmu = self._make()
        self._past = list(state)
        for u, t, h in state:
            self._fmu.set_inputs(u)
            self._fmu.do_step(t, h)

    def close(self) -> None:
        """Close the last instance."""
        self._fmu.close()
