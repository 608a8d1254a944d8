"""Units as FMI and SSP define them, and the linear functions that convert between them."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree.ElementTree import Element

from railcosim.master.fmi.archive import DESCRIPTION, FmuError, parse_xml

BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


class UnitError(ValueError):
    """Two units cannot be converted into each other; the message says why."""


@dataclass(frozen=True)
class Linear:
    """The function ``factor * x + offset``."""

    factor: float = 1.0
    offset: float = 0.0

    def __call__(self, x: float) -> float:  # noqa: D102 (the class says it)
        # Times one and plus zero change no bit, but for the sign of a zero.
        return self.factor * x + self.offset

    def then(self, other: Linear) -> Linear:
        """Compose: this function first, then `other`."""
        return Linear(other.factor * self.factor, other(self.offset))


IDENTITY = Linear()


@dataclass(frozen=True)
class Table:
    """What becomes of Booleans, whole numbers, or items of enumerations, one by one, as in SSP.

    Attributes
    ----------
    kind : str
        ``Boolean``, ``Integer`` or ``Enumeration``.
    entries : tuple of (bool, int or str; the same)
        Source and target.
    """

    kind: str
    entries: tuple[tuple[bool | int | str, bool | int | str], ...]

    def of(self, value: bool | float | str) -> bool | int | str:
        """The target of a value; ValueError if there is none."""
        known: dict[float | str, bool | int | str] = {a: b for a, b in self.entries}  # noqa: C416
        if value not in known or isinstance(value, str) != (self.kind == "Enumeration"):
            listed = ", ".join(str(source) for source in known)
            raise ValueError(f"{value!r} is not in its {self.kind} mapping, which has {listed}")
        return known[value]

    def numbers(self, source: Mapping[str, int], target: Mapping[str, int]) -> dict[float, float]:
        """Source to target as numbers, by the items of enumerations at both ends."""
        if self.kind != "Enumeration":
            return {float(a): float(b) for a, b in self.entries}
        for name, items in [*((a, source) for a, _ in self.entries),
                            *((b, target) for _, b in self.entries)]:  # fmt: skip
            if name not in items:
                raise ValueError(f"an item {name!r} of its mapping is none of {', '.join(items)}")
        return {float(source[str(a)]): float(target[str(b)]) for a, b in self.entries}


@dataclass(frozen=True)
class Unit:
    """A unit: ``factor * x + offset`` of it is in SI's base units.

    Attributes
    ----------
    name : str
        As it is written.
    exponents : tuple of int
        Of `BASE_UNITS`.
    factor, offset : float
        To SI's base units.
    """

    name: str
    exponents: tuple[int, ...]
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Units:
    """The units that one file defines.

    Attributes
    ----------
    defined : mapping of str to Unit
        By name.
    """

    defined: Mapping[str, Unit] = field(default_factory=dict)

    @classmethod
    def of(cls, root: Element) -> Units:
        """Find the definitions in a model description, a system structure or a parameter set.

        Raises
        ------
        ValueError
            If a number is not one.
        """
        found: dict[str, Unit] = {}
        for element in root.iter():
            if _local(element) != "Unit":
                continue
            base = next((child for child in element if _local(child) == "BaseUnit"), None)
            if base is not None:
                name = element.get("name", "")
                found[name] = Unit(
                    name,
                    tuple(int(base.get(unit, "0")) for unit in BASE_UNITS),
                    float(base.get("factor", "1")),
                    float(base.get("offset", "0")),
                )
        return cls(found)

    def __or__(self, other: Units) -> Units:
        return Units({**self.defined, **other.defined})


def conversion(source: str, source_units: Units, target: str, target_units: Units) -> Linear:
    """Find the function that converts a value.

    Parameters
    ----------
    source, target : str
        Names of units; an empty one fits all.
    source_units, target_units : Units
        Where they are defined. Names that are the same need no definition.

    Returns
    -------
    Linear
        From a value in `source` to the value in `target`.

    Raises
    ------
    UnitError
        If the names differ and one of them is not defined, or for different dimensions.
    """
    a, b = source_units.defined.get(source), target_units.defined.get(target)
    if not source or not target or (source == target and (a is None or b is None)):
        return IDENTITY
    for name, unit in ((source, a), (target, b)):
        if unit is None:
            raise UnitError(f"{source} is not {target}, and {name} is not defined to convert it")
    assert a is not None
    assert b is not None
    if a.exponents != b.exponents:
        raise UnitError(f"{source} and {target} are of different dimensions")
    if (a.factor, a.offset) == (b.factor, b.offset):
        return IDENTITY
    return Linear(a.factor / b.factor, (a.offset - b.offset) / b.factor)


def fmu_units(path: Path) -> Units:
    """Read the units that an FMU file defines.

    Raises
    ------
    FmuError
        If a unit is not defined by numbers.
    """
    with zipfile.ZipFile(path) as archive:
        root = parse_xml(f"{path}: {DESCRIPTION}", archive.read(DESCRIPTION))
    try:
        return Units.of(root)
    except ValueError as error:
        raise FmuError(f"{path}: a unit is not defined by numbers ({error})") from None


def _local(element: Element) -> str:
    """Name of an element without its namespace."""
    return str(element.tag).rpartition("}")[2]
