"""Values that an FMU cannot read and write where a system has them: converted on their way."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from railcosim.master.batch.call import Call
from railcosim.master.component import ComponentError, FloatArray, Type, Variable
from railcosim.master.fmi.kinds import EXACT, Passed, range_of
from railcosim.master.fmi.prepared import memory_of

Prepare = Callable[[str, Passed, Any], Call]
"""Binds a call that sets or gets to an array's memory."""


class Counted:
    """Neighbouring values that one FMI function passes: whole numbers, truths, short floats.

    Parameters
    ----------
    variables : sequence of Variable
        Which they are.
    values : array, shape (n,)
        What a system sees of them.
    call : Call
        Passes `own`.
    own : array, shape (n,)
        What the FMU sees.

    Attributes
    ----------
    call
        As given.
    """

    def __init__(
        self, variables: Sequence[Variable], values: FloatArray, call: Call, own: Any
    ) -> None:
        self.call = call
        self._variables, self._values, self._own = variables, values, own
        self._rounded = np.empty(len(values))
        self._is_whole = own.dtype.kind != "f"
        self._is_truth = variables[0].type is Type.BOOLEAN
        self._least, self._largest = range_of(own.dtype)
        self._is_long = own.dtype.itemsize == 8 and self._is_whole

    def to_own(self) -> None:
        """Before they are set; guesses of the interface Jacobian lie between whole numbers.

        Raises
        ------
        ComponentError
            For what the type does not hold.
        """
        rounded = np.rint(self._values, self._rounded) if self._is_whole else self._values
        fits = (rounded >= self._least) & (rounded <= self._largest)
        if not fits.all():
            k = int(np.argmin(fits))
            holds = f"numbers from {self._least:.9g} to {self._largest:.9g}"
            raise ComponentError(
                f"{self._variables[k].name} = {self._values[k]:.9g}: is of type "
                f"{self._variables[k].type.value}, which holds {'whole ' * self._is_whole}{holds}"
            )
        self._own[...] = rounded

    def to_values(self) -> None:
        """After they were got.

        Raises
        ------
        ComponentError
            For whole numbers that are no floating-point numbers.
        """
        # Any number but 0 is true in C, also in FMUs that should give 1.
        self._values[...] = self._own != 0 if self._is_truth else self._own
        if self._is_long:
            self._check_exact()

    def _check_exact(self) -> None:
        fits = (self._own <= EXACT) & (self._own >= -EXACT)
        if not fits.all():
            k = int(np.argmin(fits))
            raise ComponentError(
                f"{self._variables[k].name} = {self._own[k]}: is beyond {EXACT}, up to which whole "
                "numbers are exact here"
            )


def counted(
    way: str,
    variables: Sequence[Variable],
    passed: Sequence[Passed],
    values: FloatArray,
    prepare: Prepare,
) -> tuple[Counted, ...]:
    """Find the calls for all values that are not shared.

    Parameters
    ----------
    way : str
        ``Set`` or ``Get``.
    variables : sequence of Variable
        Inputs or outputs.
    passed : sequence of Passed
        How they are passed.
    values : array, shape (n_variables,)
        What a system sees of them.
    prepare : callable
        Binds a call.
    """
    found = []
    for some in passed:
        if not some.is_shared:
            own = np.zeros(some.count, dtype=np.dtype(some.c_type))
            call = prepare(way, some, memory_of(own, some.c_type))
            found.append(Counted(variables[some.part], values[some.part], call, own))
    return tuple(found)
