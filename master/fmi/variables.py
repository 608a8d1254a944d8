"""What FMPy has read of a variable, as scalars: of an array each element."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from railcosim.master.component import Type, Variable
from railcosim.master.fmi.kinds import Kind

MOST = 1_000_000
"""Scalars that a model description may have; a wrong number of elements fills no memory."""

Sizes = Mapping[str, int]
"""Structural parameters that do not keep their defaults."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One parameter of an FMU, or one element of an array of them.

    Attributes
    ----------
    name, unit, description : str
        As in the model description; of an element with its indices.
    type : str
        ``Real``, ``Integer``, ``Boolean``, ``Enumeration``, ``String`` or ``Binary``.
    variability : str
        ``fixed`` (settable until initialisation ends), ``tunable`` or ``constant``.
    start : str
        The default, as written.
    reference : int
        FMI value reference.
    items : tuple of (str, int)
        Of an enumeration: its names, and their numbers.
    kind : Kind
        How it is passed.
    element, size : int
        Which element of how many it is.
    is_structural : bool
        Whether it is the length of arrays.
    """

    name: str
    type: str
    variability: str
    start: str
    unit: str
    description: str
    reference: int
    kind: Kind
    items: tuple[tuple[str, int], ...] = ()
    element: int = 0
    size: int = 1
    is_structural: bool = False


def shape_of(variable: Any, sizes: Sizes) -> tuple[int, ...]:
    """Lengths of an array; empty for a scalar."""
    return tuple(
        d.start if d.start is not None else int(sizes.get(d.variable.name, d.variable.start))
        for d in variable.dimensions
    )


def size_of(variable: Any, sizes: Sizes) -> int:
    """How many scalars a variable is.

    Raises
    ------
    ValueError
        If they are too many.
    """
    size = math.prod(shape_of(variable, sizes))
    if not 0 <= size <= MOST:
        raise ValueError(f"{variable.name} has {size} elements; the limit is {MOST}")
    return size


def names_of(variable: Any, sizes: Sizes) -> list[str]:
    """Names of its elements, the last index running first; from 1 on, as FMI has it."""
    name: str = variable.name
    if not variable.dimensions:
        return [name]
    size_of(variable, sizes)
    ranges = [range(1, n + 1) for n in shape_of(variable, sizes)]
    return [f"{name}[{','.join(map(str, index))}]" for index in itertools.product(*ranges)]


def scalars_of(variable: Any, kind: Kind, sizes: Sizes) -> list[Variable]:
    """An input or output as a system has it."""
    # The schema asks for a start value of every input; 0 is for outputs, where it is not used.
    nominal = abs(read(_declared(variable, "nominal") or 0.0, f"nominal of {variable.name}"))
    names = names_of(variable, sizes)
    assert kind.type is not None
    return [
        Variable(
            name=name,
            unit=(_declared(variable, "unit") or "") if kind.type is Type.REAL else "",
            description=variable.description or "",
            nominal=nominal or 1.0,
            has_nominal=bool(nominal),
            start=_number(start, kind, name),
            type=kind.type,
            items=_items(variable),
        )
        for name, start in zip(names, _starts(variable, names, sizes), strict=True)
    ]


def parameters_of(variable: Any, kind: Kind, sizes: Sizes) -> list[Parameter]:
    """A parameter, or the elements of an array of them."""
    names = names_of(variable, sizes)
    return [
        Parameter(
            name=name,
            type=kind.common,
            variability=variable.variability,
            start=start or "",
            unit=(_declared(variable, "unit") or "") if kind.type is Type.REAL else "",
            description=variable.description or "",
            reference=variable.valueReference,
            items=_items(variable),
            kind=kind,
            element=k,
            size=len(names),
            is_structural=variable.causality == "structuralParameter",
        )
        for k, (name, start) in enumerate(zip(names, _starts(variable, names, sizes), strict=True))
    ]


def _starts(variable: Any, names: list[str], sizes: Sizes) -> list[str | None]:
    """Start values of the elements, as written."""
    start: str | None = variable.start
    if not variable.dimensions or start is None or variable.type in {"String", "Binary"}:
        return [start] * len(names)
    values = start.split()
    if len(values) == len(names):
        return [*values]
    if len(values) == 1:  # of all
        return [*values] * len(names)
    if shape_of(variable, sizes) != shape_of(variable, {}):  # those of another length
        return [None] * len(names)
    raise ValueError(f"{variable.name} has {len(values)} start values for {len(names)} elements")


def _number(start: str | None, kind: Kind, name: str) -> float:
    """A start value as written, as a number."""
    words = {"true": 1.0, "false": 0.0}
    if start in words:
        return words[start]
    whole = kind.type in {Type.INTEGER, Type.ENUMERATION}
    return read(start or 0.0, f"start of {name}", int if whole else float)


def read(text: str | float, what: str, kind: type[int] | type[float] = float) -> float:
    """A number as written; ValueError, which says of what it is, if it is none."""
    try:
        return float(kind(text))
    except (ValueError, OverflowError):
        number = "whole number" if kind is int else "number"
        raise ValueError(f"{what} is {text!r}, which is no {number}") from None


def _declared(variable: Any, attribute: str) -> str | None:
    """Look up an attribute of a variable, or of its declared type if the variable leaves it out."""
    value: str | None = getattr(variable, attribute)
    if value is None and variable.declaredType is not None:
        value = getattr(variable.declaredType, attribute)
    return value


def _items(variable: Any) -> tuple[tuple[str, int], ...]:
    """Names and numbers of an enumeration."""
    kind = variable.declaredType
    return tuple((i.name, int(i.value)) for i in (kind.items if kind is not None else None) or ())
