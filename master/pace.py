"""How long the communication steps are."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from railcosim.master.schemes import Stepper, StepReport
from railcosim.master.system import System

_AHEAD = 256
"""Steps that components are told of at once."""
_SUMS = 4
"""Roundings on the way to the end of a step that is cut into parts."""
_ROUNDING = 1e-6
"""Of a step: a remainder smaller than this is rounding in the user's numbers, not a step."""


class Walk(Protocol):
    """A pace on its way through a span of time.

    Attributes
    ----------
    memory : object
        What decides the next steps; as `Stepper.memory`.
    """

    memory: Any

    def advance(self, t: float) -> tuple[float, StepReport]:
        """Make one step from `t`, however often it is tried; gives the new time (s)."""


class Pace(Protocol):
    """A rule for the lengths of communication steps.

    Attributes
    ----------
    longest : float
        Step, s.
    """

    @property
    def longest(self) -> float:
        """The longest step, s."""

    def walk(self, system: System, stepper: Stepper, start: float, stop: float) -> Walk:
        """Begin at `start` (s); the last step ends exactly at `stop`."""

    def reach(self, start: float, stop: float) -> float:
        """A time (s) that no step ends behind: `stop`, but for rounding."""

    def whole(self, start: float, stop: float) -> float | None:
        """The last time (s) up to `stop` that whole steps lead to; None if they differ."""

    def describe(self) -> str:
        """For people and for results."""


def rounded_up(time: float) -> float:
    """What a sum of a few numbers that should give `time` (s) does not exceed."""
    return time + _SUMS * math.ulp(time)


@dataclass(frozen=True)
class FixedStep:
    """All steps of one length (s); the last one is shorter if the end is not a multiple away."""

    step: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.step) and self.step > 0.0):
            raise ValueError(f"step must be positive and finite, got {self.step!r} s")

    def walk(self, system: System, stepper: Stepper, start: float, stop: float) -> Walk:
        """Begin; see `Pace.walk`."""
        return _FixedWalk(system, stepper, self, start, stop)

    @property
    def longest(self) -> float:
        """The step, s."""
        return self.step

    def whole(self, start: float, stop: float) -> float:
        """The last time (s) up to `stop` that whole steps lead to."""
        n_steps, last = self.last(start, stop)
        return stop if last == self.step else start + (n_steps - 1) * self.step

    def reach(self, start: float, stop: float) -> float:
        """A time (s) that no step ends behind; see `Pace.reach`."""
        n_steps, last = self.last(start, stop)
        return rounded_up(max(stop, start + (n_steps - 1) * self.step + last))

    def last(self, start: float, stop: float) -> tuple[int, float]:
        """How many steps there are, and the length of the last, s."""
        n_steps = max(1, math.ceil((stop - start) / self.step - _ROUNDING))
        remainder = stop - (start + (n_steps - 1) * self.step)
        # The same number for every full step: an FMU may keep matrices for the step it knows.
        is_full = abs(remainder - self.step) <= _ROUNDING * self.step
        return n_steps, self.step if is_full else remainder

    def describe(self) -> str:
        """For people and for results."""
        return f"step {float(self.step)!r} s"


class _FixedWalk:
    """See `Walk`; its memory is the number of steps made."""

    def __init__(
        self, system: System, stepper: Stepper, pace: FixedStep, start: float, stop: float
    ) -> None:
        self.memory = 0
        self._system, self._make = system, stepper.step
        self._stops = np.array(stepper.stops)
        self._step, self._start, self._stop = pace.step, start, stop
        self._foreseen = range(0)
        self._n_steps, self._last = pace.last(start, stop)

    def advance(self, t: float) -> tuple[float, StepReport]:
        """Make one step; see `Walk.advance`."""
        made = self.memory
        if made not in self._foreseen:
            self._foresee()
        self.memory = made = made + 1
        if made == self._n_steps:
            return self._stop, self._make(t, self._last)
        step = self._step
        report = self._make(t, step)
        return self._start + made * step, report

    def _foresee(self) -> None:
        """Tell when the next steps will stop, to the bit, so that signals can be asked at once."""
        first = self.memory
        self._foreseen = range(first, min(first + _AHEAD, self._n_steps))
        begins = self._start + np.array(self._foreseen) * self._step
        lengths = np.full(begins.size, self._step)
        if self._foreseen.stop == self._n_steps:
            lengths[-1] = self._last
        stops = (begins[:, None] + self._stops * lengths[:, None]).ravel()
        for component in self._system.components:
            component.foresee(stops)
