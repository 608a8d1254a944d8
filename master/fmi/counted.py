"""Values of an FMU that are no Reals: integers to the FMU, numbers like all others to a system."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from railcosim.master.component import ComponentError, FloatArray, Type, Variable
from railcosim.master.fmi.fmu_instance import PreparedCall

_FUNCTIONS = {
    "Integer": frozenset({Type.INTEGER, Type.ENUMERATION}),
    "Boolean": frozenset({Type.BOOLEAN}),
}
"""Which FMI function passes which types."""
_LARGEST = 2**31 - 1

Prepare = Callable[[str, Any, Any], PreparedCall]
"""Binds a call to value references and values, ctypes arrays."""


class Counted:
    """Neighbouring values that one FMI function passes.

    Parameters
    ----------
    variables : sequence of Variable
        Which they are.
    values : array, shape (n,)
        What a system sees of them.
    call : PreparedCall
        Passes `integers`.
    integers : array of int32, shape (n,)
        What the FMU sees.

    Attributes
    ----------
    call
        As given.
    """

    def __init__(
        self, variables: Sequence[Variable], values: FloatArray, call: PreparedCall, integers: Any
    ) -> None:
        self.call = call
        self._variables, self._values, self._integers = variables, values, integers
        self._rounded = np.empty(len(values))

    def to_integers(self) -> None:
        """Before they are set; guesses of the interface Jacobian lie between integers.

        Raises
        ------
        ComponentError
            For what is no 32-bit integer.
        """
        np.rint(self._values, self._rounded)
        if not (np.abs(self._rounded) <= _LARGEST).all():
            k = int(np.argmin(np.abs(self._rounded) <= _LARGEST))
            raise ComponentError(
                f"{self._variables[k].name} = {self._values[k]:.9g}: is of type "
                f"{self._variables[k].type.value}, which holds whole numbers of 32 bits"
            )
        self._integers[...] = self._rounded

    def to_values(self) -> None:
        """After they were got."""
        self._values[...] = self._integers


def counted(
    way: str,
    variables: Sequence[Variable],
    references: Sequence[int],
    values: FloatArray,
    prepare: Prepare,
) -> tuple[Counted, ...]:
    """Find the calls for all values that are no Reals.

    Parameters
    ----------
    way : str
        ``Set`` or ``Get``.
    variables : sequence of Variable
        Inputs or outputs, those of one function together.
    references : sequence of int
        Their value references.
    values : array, shape (n_variables,)
        What a system sees of them.
    prepare : callable
        Binds a call.
    """
    found = []
    for name, types in _FUNCTIONS.items():
        where = [i for i, v in enumerate(variables) if v.type in types]
        if where:
            part = slice(where[0], where[-1] + 1)
            integers = np.zeros(len(where), dtype=np.int32)
            those = (ctypes.c_uint * len(where))(*references[part])
            memory = (ctypes.c_int * len(where)).from_buffer(integers.data)
            call = prepare(f"fmi2{way}{name}", those, memory)
            found.append(Counted(variables[part], values[part], call, integers))
    return tuple(found)
