"""One step of a scheme, made again and again from memories in which one number is not zero."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.schemes import Scheme
from railcosim.master.stability.open_component import TICK, Open
from railcosim.master.stability.sampled import DIGITS, Asked, Fed
from railcosim.master.system import System

PROBE = 1e9
"""What the one number is, in its unit: large against every absolute tolerance of a scheme."""
_WARM_UP = 4
"""Steps at rest before the one observed: schemes reach back three at most."""


class NotLinear(ValueError):  # noqa: N818 (it says what is wrong)
    """A scheme whose step is no linear map; the message says why."""


Column: TypeAlias = tuple[FloatArray, FloatArray]
"""Memory after a step, and what was fed in it, by one number before it."""


class ObservedStep:
    """One step of a scheme on a system at rest, made again and again from other memories.

    Attributes
    ----------
    memory : array of int
        Places of the numbers that may decide the future.
    outputs : array of int
        Places of the system's outputs.
    asked : dict of str to list of Asked
        By open component: when it is looked at.
    fed : dict of str to list of Fed
        Likewise: the steps it makes.
    """

    def __init__(self, system: System, scheme: Scheme, h: float) -> None:
        self.h = h
        self._system, self._scheme = system, scheme
        self.opened = [c for c in system.components if isinstance(c, Open)]
        self.evaluations = 0
        for component in self.opened:
            component.motion.clear()
            component.begin()
        self._stepper = scheme.start(system)
        system.begin(0.0)
        for k in range(_WARM_UP):
            self._stepper.step(k * h, h)
            for component in self.opened:
                component.begin()
        self._rest = system.save_state(), self._stepper.memory
        self._arrays = list(_arrays(self._rest))
        self._sizes = [a.size for a in self._arrays]
        self._offset = np.concatenate([[0], np.cumsum(self._sizes)])
        # What is not zero at rest is no motion but a setting, such as a compliance.
        moves = np.repeat([not a.any() for a in self._arrays], self._sizes)
        self.memory = np.flatnonzero(moves)
        own = next(i for i, a in enumerate(self._arrays) if a is self._rest[0][2])
        self.outputs = np.arange(self._offset[own], self._offset[own + 1])
        self._make(self._arrays)  # so that all times asked for are known
        self.asked = {
            c.name: [Asked(round(tick * TICK / h, DIGITS), is_rate) for tick, is_rate in c.motion]
            for c in self.opened
        }
        self.fed = {
            c.name: [
                Fed(round(begin * TICK / h, DIGITS), round(length / h, DIGITS))
                for begin, length, _ in c.fed
            ]
            for c in self.opened
        }
        self.n_fed = sum(3 * len(c.inputs) * len(c.fed) for c in self.opened)
        self.size = int(self._offset[-1])

    def by_memory(self, k: int) -> Column:
        """What one number of the memory does to all of it, and to what is fed."""
        i = int(np.searchsorted(self._offset, k, side="right")) - 1
        changed = self._arrays[i].copy()
        changed.flat[k - self._offset[i]] = PROBE
        return self._make([*self._arrays[:i], changed, *self._arrays[i + 1 :]])

    def by_motion(self, component: Open) -> list[Column]:
        """What the motion of one component does, an output and time after the other."""
        columns = []
        for values in component.motion.values():
            for j in range(values.size):
                values[j] = PROBE
                columns.append(self._make(self._arrays))
                values[j] = 0.0
        return columns

    def _make(self, arrays: list[FloatArray]) -> Column:
        """Make the step."""
        state, memory = _rebuilt(self._rest, iter(arrays))
        self._system.restore_state(state)
        self._stepper.memory = memory
        report = self._stepper.step(_WARM_UP * self.h, self.h)
        self.evaluations = max(self.evaluations, report.evaluations)
        after = list(_arrays((self._system.save_state(), self._stepper.memory)))
        if [a.size for a in after] != self._sizes:
            raise NotLinear(f"{self._scheme.describe()}: its memory changes its form")
        fed = [taylor.ravel() for c in self.opened for _, _, taylor in c.fed]
        return (
            np.concatenate([a.ravel() for a in after]) / PROBE,
            np.concatenate([np.zeros(0), *fed]) / PROBE,
        )


def _arrays(state: Any) -> Iterator[FloatArray]:
    """Arrays of numbers in nested tuples and lists."""
    if isinstance(state, np.ndarray) and state.dtype == np.float64:
        yield state
    elif isinstance(state, tuple | list):
        for part in state:
            yield from _arrays(part)


def _rebuilt(state: Any, arrays: Iterator[FloatArray]) -> Any:
    """The same nest with other arrays."""
    if isinstance(state, np.ndarray) and state.dtype == np.float64:
        return next(arrays)
    if isinstance(state, tuple | list):
        parts = [_rebuilt(part, arrays) for part in state]
        return type(state)(*parts) if hasattr(state, "_fields") else type(state)(parts)
    return state
