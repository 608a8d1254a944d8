"""Units and what they are displayed in."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

from ..interface import Scalar

# Exponents of SI base units.
UNITS: dict[str, dict[str, int]] = {
    "s": {"s": 1},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "N.m2": {"kg": 1, "m": 3, "s": -2},
    "N/m": {"kg": 1, "s": -2},
    "N.m/m": {"kg": 1, "m": 1, "s": -2},
    "N/m2": {"kg": 1, "m": -1, "s": -2},
    "kg.m2": {"kg": 1, "m": 2},
    "N/m1.5": {},  # FMI has no fractional exponents
}
# How many display units make one unit.
DISPLAY_UNITS: dict[str, dict[str, float]] = {
    "s": {"ms": 1e3},
    "m": {"mm": 1e3},
    "m/s": {"mm/s": 1e3, "km/h": 3.6},
    "rad": {"mrad": 1e3},
    "rad/s": {"mrad/s": 1e3},
    "N": {"kN": 1e-3},
    "N.m": {"kN.m": 1e-3},
    "N/m": {"GN/m": 1e-9, "kN/m": 1e-3},
    "N.m/m": {"kN.m/m": 1e-3},
    "N/m2": {"MPa": 1e-6, "kPa": 1e-3},
}


def displayed(v: Scalar, value: float) -> tuple[float, str]:
    """A value in the unit that people read it in, and that unit."""
    if not v.display_unit:
        return value, v.unit
    return value * DISPLAY_UNITS[v.unit][v.display_unit], v.display_unit


def unit_definitions(root: Element, table: Sequence[Scalar]) -> None:
    """Add the units that the table uses; FMI 2.0 and 3.0 write them alike."""
    parent = SubElement(root, "UnitDefinitions")
    shown = {(v.unit, v.display_unit) for v in table}
    for name in sorted({v.unit for v in table} - {""}):
        unit = SubElement(parent, "Unit", name=name)
        if exponents := UNITS[name]:
            SubElement(unit, "BaseUnit", {k: str(v) for k, v in exponents.items()})
        for display, factor in DISPLAY_UNITS.get(name, {}).items():
            if (name, display) in shown:
                SubElement(unit, "DisplayUnit", name=display, factor=repr(factor))
