"""Checking what a user wants an FMU's parameters to be, before the FMU is asked."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.description import FmuDescription, Parameter
from railcosim.master.suggest import suggest


@dataclass(frozen=True)
class _Kind:
    """How one FMI type is set."""

    function: str
    c_type: Any
    convert: Callable[[Any], Any]


_KINDS = {
    "Real": _Kind("fmi2SetReal", ctypes.c_double, float),
    "Integer": _Kind("fmi2SetInteger", ctypes.c_int, int),
    "Enumeration": _Kind("fmi2SetInteger", ctypes.c_int, int),
    "Boolean": _Kind("fmi2SetBoolean", ctypes.c_int, bool),
    "String": _Kind("fmi2SetString", ctypes.c_char_p, str),
}
_LARGEST = {ctypes.c_double: sys.float_info.max, ctypes.c_int: 2**31 - 1}
Scalar = float | int | bool | str
"""A value of a parameter: of an enumeration its number, or its name."""


def parameter_call(
    description: FmuDescription, name: str, value: Scalar, *, initialised: bool
) -> tuple[str, Any, Any]:
    """Find the FMI call that sets a parameter.

    Parameters
    ----------
    description : FmuDescription
        The FMU.
    name : str
        The parameter, or another variable that has a start value of its own.
    value : float, int, bool or str
        Its new value, in its unit.
    initialised : bool
        Whether initialisation is over: only tunable parameters can be set then.

    Returns
    -------
    tuple of (str, ctypes array, ctypes array)
        FMI function, value references, values.

    Raises
    ------
    FmuError
        For an unknown name, a variable that cannot be given a value, a parameter that cannot be
        set now, or a value that does not fit its type.
    """
    parameter = _find(description, name)
    path = description.path
    if initialised and parameter.variability != "tunable":
        raise FmuError(
            f"{path}: parameter {name} is {parameter.variability}; "
            "set it before the initialisation ends"
        )
    kind = _KINDS[parameter.type]
    number = _numbered(path, parameter, value)
    if not _fits(kind, number):
        raise FmuError(f"{path}: parameter {name} is a {parameter.type}; {value!r} does not fit")
    references = (ctypes.c_uint * 1)(parameter.reference)
    given = number.encode() if isinstance(number, str) else kind.convert(number)
    return kind.function, references, (kind.c_type * 1)(given)


def _numbered(path: Path, parameter: Parameter, value: Scalar) -> Scalar:
    """The number of an item of an enumeration; other values as they are."""
    if parameter.type != "Enumeration" or not parameter.items:
        return value
    items = dict(parameter.items)
    if (isinstance(value, str) and value in items) or value in items.values():
        return items[value] if isinstance(value, str) else value
    known = ", ".join(f"{name} = {number}" for name, number in parameter.items)
    raise FmuError(f"{path}: parameter {parameter.name} has no item {value!r}; it has {known}")


def _find(description: FmuDescription, name: str) -> Parameter:
    """Look up a parameter."""
    parameter = description.parameters.get(name, description.initials.get(name))
    if parameter is not None:
        return parameter
    causality = description.other_names.get(name)
    if causality is not None:
        raise FmuError(f"{description.path}: {name} is of causality {causality}, not a parameter")
    hint = suggest(name, description.parameters)
    raise FmuError(f"{description.path}: no parameter {name!r}{hint}")


def _fits(kind: _Kind, value: Scalar) -> bool:
    """Tell whether a value survives the conversion."""
    # bool is a kind of int in Python, so the two have to be told apart by hand.
    if isinstance(value, bool) != (kind.convert is bool):
        return False
    if isinstance(value, str) != (kind.convert is str):
        return False
    if not isinstance(value, str) and not abs(value) <= _LARGEST[kind.c_type]:
        return False  # beyond what the FMU can be given; no number never is
    try:
        return bool(kind.convert(value) == value)
    except (TypeError, ValueError, OverflowError):
        return False
