"""Checking what a user wants an FMU's parameters to be, before the FMU is asked."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.description import FmuDescription
from railcosim.master.fmi.kinds import Kind
from railcosim.master.fmi.variables import Parameter
from railcosim.master.suggest import suggest

Scalar = float | int | bool | str
"""A value of a parameter: of an enumeration its number, or its name; bytes in hexadecimals."""


@dataclass(frozen=True)
class Setting:
    """A parameter, and a value that fits it.

    Attributes
    ----------
    kind : Kind
        How it is passed.
    reference : int
        FMI value reference.
    value : float, int, bool or bytes
        In its unit.
    element, size : int
        Which element of how many it is.
    is_structural : bool
        Whether it is the length of arrays.
    """

    kind: Kind
    reference: int
    value: Any
    element: int = 0
    size: int = 1
    is_structural: bool = False


def setting_of(
    description: FmuDescription, name: str, value: Scalar, *, initialised: bool
) -> Setting:
    """Check a value that a parameter is to have.

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

    Raises
    ------
    FmuError
        For an unknown name, a variable that cannot be given a value, a parameter that cannot be
        set now, or a value that does not fit its type.
    """
    parameter = _find(description, name)
    path = description.path
    if initialised and (parameter.variability != "tunable" or parameter.is_structural):
        raise FmuError(
            f"{path}: parameter {name} is {parameter.variability}; "
            "set it before the initialisation ends"
        )
    number = _numbered(path, parameter, value)
    if not _fits(parameter.kind, number):
        raise FmuError(
            f"{path}: parameter {name} is a {parameter.kind.name}; {value!r} does not fit"
        )
    given = _given(parameter.kind, number)
    return Setting(
        parameter.kind,
        parameter.reference,
        given,
        parameter.element,
        parameter.size,
        parameter.is_structural,
    )


def _given(kind: Kind, value: Scalar) -> Any:
    """A value as it is passed."""
    if not isinstance(value, str):
        return kind.convert(value)
    return bytes.fromhex(value) if kind.name == "Binary" else value.encode()


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


def _fits(kind: Kind, value: Scalar) -> bool:
    """Tell whether a value survives the conversion."""
    # bool is a kind of int in Python, so the two have to be told apart by hand.
    if isinstance(value, bool) != (kind.convert is bool):
        return False
    if isinstance(value, str) != (kind.convert is str):
        return False
    try:
        if isinstance(value, str):
            return _given(kind, value) is not None
        least, largest = kind.range
        return least <= value <= largest and bool(kind.convert(value) == value)
    except (TypeError, ValueError, OverflowError):
        return False
