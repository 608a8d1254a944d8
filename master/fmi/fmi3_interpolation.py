"""Inputs that go along polynomials: set anew wherever an FMI 3.0 FMU asks for them in its step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from railcosim.master.batch.call import Call
from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.fmi.calls import WARNING, Calls
from railcosim.master.fmi.fmu_log import status_name
from railcosim.master.fmi.kinds import Passed
from railcosim.master.fmi.prepared import memory_of


class Interpolation:
    """The Real inputs of an FMU that provides intermediate updates.

    Parameters
    ----------
    calls : Calls
        Of the FMU.

    Attributes
    ----------
    references : tuple of int
        The inputs that are set.
    begin : float or None
        Beginning of the step, s, if it goes on after an early return.
    """

    def __init__(self, calls: Calls) -> None:
        self._calls = calls
        # None of them where an array of length 0 is the only one.
        shared = [p.references for p in calls._description.passed_in if p.is_shared]
        self.references = shared[0] if shared else ()
        self.begin: float | None = None
        self._u: FloatArray = np.empty(0)
        self._derivatives: FloatArray = np.empty((0, 0))
        self._order = 0
        self._values: FloatArray = np.empty(0)
        self._set: Call | None = None
        self._failure = ""

    def bind(self, passed: Passed, u: FloatArray, highest: int) -> Callable[[FloatArray], None]:
        """Take the values of the beginning from `u`; what takes their derivatives."""
        self._u, self._values = u, np.empty(passed.count)
        self._derivatives = np.zeros((highest, passed.count))
        self._set = self._calls.passing("Set", passed, memory_of(self._values))

        def give(derivatives: FloatArray) -> None:
            self._order = len(derivatives)
            self._derivatives[: self._order] = derivatives

        return give

    def over(self) -> None:
        """Forget the derivatives: the step is over."""
        self._order, self.begin = 0, None

    def check(self) -> None:
        """Raise what went wrong in a step."""
        if self._failure:
            failure, self._failure = self._failure, ""
            raise ComponentError(failure)

    def update(
        self,
        environment: int,
        time: float,
        wants_inputs: bool,
        gives_outputs: bool,
        is_step_over: bool,
        can_return: bool,
        wants_return: Any,
        return_time: Any,
    ) -> None:
        """Set the inputs at `time`, s; the FMU calls it within its step."""
        if wants_return:
            wants_return[0] = False
        if return_time:
            return_time[0] = 0.0
        if not wants_inputs or self._set is None or not self._order:
            return
        dt = time - (self._calls.step.span.begin.value if self.begin is None else self.begin)
        values = self._values
        values[...] = self._derivatives[self._order - 1]
        for k in range(self._order - 1, 0, -1):  # Horner's rule
            values *= dt / (k + 1)
            values += self._derivatives[k - 1]
        values *= dt
        values += self._u
        status = self._set.function(*self._set.arguments) or 0
        if status > WARNING:
            self._failure = (
                f"{self._calls._name}: {self._set.name} within a step, at t = {time:.9g} s, gave "
                f"status {status_name(status)}"
            )
