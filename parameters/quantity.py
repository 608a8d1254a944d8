"""Fields of a parameter set that know their unit, their allowed range and where they come from."""

from __future__ import annotations

import math
from dataclasses import Field, dataclass, field, fields
from typing import Any, TypeAlias

from .usual import Usual

WORDS = "words"  # in a field's metadata
MOST_NUMBERS = 64  # in one list; nothing that is built has more of anything
Value: TypeAlias = float | int | bool | str | tuple[float | int, ...] | tuple[str, ...]


class ParameterError(ValueError):
    """A parameter is unknown, of the wrong type or out of range; one line says which and why."""


class ArgumentError(ParameterError):
    """An argument of a function cannot be; on the command line its option has the same name.

    Parameters
    ----------
    argument : str
        Its name.
    value : object
        As it was given; None where that says nothing, as of a switch.
    text : str
        What is wrong, what is allowed, and what to do.
    """

    def __init__(self, argument: str, value: object, text: str) -> None:
        shown = "" if value is None else f" {value:g}" if isinstance(value, float) else f" {value}"
        self.option = f"--{argument.replace('_', '-')}{shown}: {text}"
        super().__init__(f"{argument}{shown}: {text}")


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """What is known of a number besides its value.

    Attributes
    ----------
    unit : str
        SI unit as FMI writes it; ``1`` for a pure number.
    description, source : str
        What it is, and where the default comes from.
    usual : Usual or None
        Where its values usually are; None for switches.
    above, minimum, maximum : float or None
        Allowed range: greater than `above`, not below `minimum`, not above `maximum`.
    """

    unit: str
    description: str
    source: str
    usual: Usual | None = None
    above: float | None = None
    minimum: float | None = None
    maximum: float | None = None

    @property
    def allowed(self) -> str:
        """The range in words, for messages and for the comments of a parameter file."""
        parts = []
        if self.above is not None:
            parts.append(f"> {self.above:g}")
        if self.minimum is not None:
            parts.append(f">= {self.minimum:g}")
        if self.maximum is not None:
            parts.append(f"<= {self.maximum:g}")
        return " and ".join(parts) or "any finite number"

    def holds(self, value: float) -> bool:
        """Whether `value` is finite and in the range."""
        return (
            math.isfinite(value)
            and (self.above is None or value > self.above)
            and (self.minimum is None or value >= self.minimum)
            and (self.maximum is None or value <= self.maximum)
        )


def quantity(
    default: float | tuple[float, ...],
    unit: str,
    description: str,
    *,
    source: str,
    usual: Usual,
    above: float | None = None,
    minimum: float | None = None,
    maximum: float | None = None,
) -> Any:
    """Declare a number of a `ParameterSet`, or several; an integer default makes it an integer.

    Parameters
    ----------
    default : float, int or tuple of them
        Its value unless a file says otherwise; a tuple makes it any number of numbers.
    unit, description, source, usual, above, minimum, maximum
        See `Quantity`.

    Returns
    -------
    Any
        A dataclass field (typed Any, as `dataclasses.field` is).
    """
    known = Quantity(
        unit=unit,
        description=description,
        source=source,
        usual=usual,
        above=above,
        minimum=minimum,
        maximum=maximum,
    )
    return field(default=default, metadata={"quantity": known})


def switch(default: bool, description: str, *, source: str) -> Any:
    """Declare a yes-or-no parameter of a `ParameterSet`."""
    known = Quantity(unit="", description=description, source=source)
    return field(default=default, metadata={"quantity": known})


def word(default: str, description: str, *, source: str) -> Any:
    """Declare a name among the parameters of a `ParameterSet`."""
    known = Quantity(unit="", description=description, source=source)
    return field(default=default, metadata={"quantity": known})


def words(description: str, *, source: str) -> Any:
    """Declare any number of names, none unless a file says otherwise."""
    known = Quantity(unit="", description=description, source=source)
    return field(default=(), metadata={"quantity": known, WORDS: True})


def quantity_of(declared: Field[Any]) -> Quantity:
    """The `Quantity` a dataclass field was declared with."""
    known: Quantity = declared.metadata["quantity"]
    return known


@dataclass(frozen=True, kw_only=True)
class ParameterSet:
    """Base of frozen parameter sets whose fields are declared by `quantity` and `switch`.

    Other fields are parameter sets themselves, or None.

    Raises
    ------
    ParameterError
        On construction, if a value is of the wrong type, not finite or out of range.
    """

    def __post_init__(self) -> None:
        for declared in quantities(self):
            value = check(declared, getattr(self, declared.name))
            object.__setattr__(self, declared.name, value)


def quantities(of: ParameterSet | type[ParameterSet]) -> list[Field[Any]]:
    """The fields declared by `quantity` and `switch`."""
    return [declared for declared in fields(of) if "quantity" in declared.metadata]


def check(declared: Field[Any], value: object) -> Value:
    """Return `value` in the type of the declared field, or say what is wrong with it."""
    if isinstance(declared.default, bool):
        if not isinstance(value, bool):
            raise ParameterError(f"{declared.name} = {value!r}: must be true or false")
        return value
    if isinstance(declared.default, str):
        if not isinstance(value, str):
            raise ParameterError(f"{declared.name} = {value!r}: must be a name in quotes")
        return value
    if declared.metadata.get(WORDS):
        return _words(declared, value)
    if not isinstance(declared.default, tuple):
        return _number(declared, value, whole=isinstance(declared.default, int))
    if not isinstance(value, (list, tuple)):
        raise ParameterError(f"{declared.name} = {value!r}: must be a list of numbers, [...]")
    if len(value) > MOST_NUMBERS:
        raise ParameterError(f"{declared.name}: {len(value)} numbers, at most {MOST_NUMBERS}")
    whole = bool(declared.default) and isinstance(declared.default[0], int)
    return tuple(_number(declared, one, whole=whole) for one in value)


def _words(declared: Field[Any], value: object) -> tuple[str, ...]:
    if not isinstance(value, (list, tuple)) or not all(isinstance(one, str) for one in value):
        raise ParameterError(f"{declared.name} = {value!r}: must be a list of names, [...]")
    if len(value) > MOST_NUMBERS:
        raise ParameterError(f"{declared.name}: {len(value)} names, at most {MOST_NUMBERS}")
    return tuple(value)


def _number(declared: Field[Any], value: object, *, whole: bool) -> float | int:
    known = quantity_of(declared)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ParameterError(f"{declared.name} = {value!r}: must be a number in {known.unit}")
    try:
        float(value)
    except OverflowError as error:  # a whole number may have any number of digits
        raise ParameterError(f"{declared.name}: must be {known.allowed}, below 1e308") from error
    if whole:
        if value != int(value if math.isfinite(value) else 0):
            raise ParameterError(f"{declared.name} = {value!r}: must be a whole number")
        value = int(value)
    else:
        value = float(value)
    if not known.holds(value):
        unit = "" if known.unit in {"", "1"} else f" {known.unit}"
        raise ParameterError(f"{declared.name} = {value:g}{unit}: must be {known.allowed}")
    return value
