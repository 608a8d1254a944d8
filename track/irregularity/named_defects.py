"""Defects as they are written on a command line: ``dip:depth=1e-3,length=1,at=30``."""

from __future__ import annotations

import difflib
import warnings
from collections.abc import Iterable
from dataclasses import MISSING

from railcosim.parameters import ArgumentError, ParameterError, UnusualWarning
from railcosim.parameters.quantity import quantities, quantity_of

from .defects import Defect, OnRail, OnWheel
from .rail_defects import Corrugation, Dip, Joint, Weld
from .wheel_defects import Flat, FreshFlat

KINDS: dict[str, type[OnRail] | type[OnWheel]] = {
    one.kind: one for one in (Dip, Joint, Weld, Corrugation, Flat, FreshFlat)
}
"""By what users call them."""


def defect(text: str) -> Defect:
    """The defect of ``KIND:name=value,name=value``.

    Parameters
    ----------
    text : str
        A kind of `KINDS`, and its numbers, SI.

    Raises
    ------
    ArgumentError
        Naming the kind, the number, the value and what is allowed.

    Warns
    -----
    UnusualWarning
        Of a number that is allowed and unusual.

    Examples
    --------
    >>> defect("flat:length=0.05,wheel=1.left").extent
    0.05
    """
    name, _, rest = text.partition(":")
    name = name.strip()
    if name not in KINDS:
        close = difflib.get_close_matches(name, KINDS, n=1)
        hint = f"; did you mean {close[0]}?" if close else ""
        raise ArgumentError("defect", text, f"must be {', '.join(KINDS)}{hint}")
    kind = KINDS[name]
    declared = {one.name: one for one in quantities(kind)}
    given: dict[str, str | float] = {}
    for part in filter(None, (part.strip() for part in rest.split(","))):
        key, equals, value = (word.strip() for word in part.partition("="))
        if not equals or not value or key not in declared:
            wanted = ", ".join(f"{one}=" for one in declared)
            raise ArgumentError("defect", text, f"{part!r}: wanted is some of {wanted}")
        if key in given:
            raise ArgumentError("defect", text, f"{key} is given twice")
        is_word = isinstance(declared[key].default, str)
        given[key] = value if is_word else _number(text, key, value)
    missing = [key for key, one in declared.items() if one.default is MISSING and key not in given]
    if missing:
        said = f"{missing[0]} ({quantity_of(declared[missing[0]]).unit})"
        raise ArgumentError("defect", text, f"a {name} needs {said}: add {missing[0]}=")
    try:
        made: Defect = kind(**given)  # type: ignore[arg-type]  # checked by itself
    except ParameterError as error:
        raise ArgumentError("defect", text, str(error)) from error
    for key, number in given.items():
        known = quantity_of(declared[key])
        if isinstance(number, float) and known.usual is not None:
            doubt = known.usual.doubt(f"--defect {name}: {key}", abs(number), known.unit)
            if doubt:
                warnings.warn(doubt, UnusualWarning, stacklevel=2)
    return made


def defects_of(given: Iterable[str | Defect]) -> tuple[Defect, ...]:
    """Several, each as it is or as text."""
    return tuple(defect(one) if isinstance(one, str) else one for one in given)


def _number(text: str, key: str, value: str) -> float:
    try:
        return float(value)
    except ValueError as error:
        raise ArgumentError("defect", text, f"{key} = {value}: must be a number") from error
