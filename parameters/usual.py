"""What a quantity usually is, and which slip of the unit an unusual number suggests."""

from __future__ import annotations

import math
from dataclasses import dataclass

SLIPS: dict[str, dict[str, float]] = {
    "N/m": {"kN/m": 1e3, "MN/m": 1e6, "GN/m": 1e9},
    "N.s/m": {"kN.s/m": 1e3, "MN.s/m": 1e6},
    "N/m2": {"MPa": 1e6, "GPa": 1e9},
    "N/m3": {"kN/m3": 1e3, "MN/m3": 1e6, "N/mm3": 1e9},
    "N.s/m3": {"kN.s/m3": 1e3, "MN.s/m3": 1e6},
    "N.m2": {"kN.m2": 1e3, "MN.m2": 1e6},
    "kg": {"t": 1e3},
    "kg.m2": {"t.m2": 1e3},
    "kg/m": {"t/m": 1e3},
    "kg/m3": {"t/m3": 1e3},
    "m": {"mm": 1e-3, "cm": 1e-2},
    "m2": {"cm2": 1e-4, "mm2": 1e-6},
    "m4": {"cm4": 1e-8, "mm4": 1e-12},
    "m6": {"cm6": 1e-12, "mm6": 1e-18},
    "N.m/rad": {"kN.m/rad": 1e3, "MN.m/rad": 1e6},
    "N.m.s/rad": {"kN.m.s/rad": 1e3, "MN.m.s/rad": 1e6},
    "Hz": {"kHz": 1e3},
    "s": {"ms": 1e-3, "us": 1e-6},
    "km/h": {"m/s": 3.6},
    "1": {"%": 1e-2},
}
"""Units that are written for another, and how many of the other one of them is."""


class UnusualWarning(UserWarning):
    """A number is allowed, but hardly what was meant."""


@dataclass(frozen=True)
class Usual:
    """Where a quantity usually is; 0, where it is allowed, says that there is none and is usual.

    Attributes
    ----------
    low, high : float
        In the quantity's unit.
    reason : str
        What is at either end.
    """

    low: float
    high: float
    reason: str

    def doubt(self, name: str, value: float, unit: str) -> str | None:
        """What is unusual about a value, with the slip it suggests; None if nothing is.

        Parameters
        ----------
        name : str
            As the user writes it.
        value : float
            As given.
        unit : str
            That it is taken in.
        """
        if value == 0 or self.low <= value <= self.high:
            return None
        of = "" if unit == "1" else f" {unit}"
        said = (
            f"{name} = {value:g}{of} is unusual; {self.low:g} to {self.high:g}{of} is usual "
            f"({self.reason})"
        )
        return said + self.slip(value, unit)

    def slip(self, value: float, unit: str) -> str:
        """The unit that an unusual value may be in, as a question; empty if none makes it usual."""
        middle = math.sqrt(self.low * self.high) if self.low > 0 else self.high
        fits = [
            (abs(math.log(value * factor / middle)), other, value * factor)
            for other, factor in SLIPS.get(unit, {}).items()
            if self.low <= value * factor <= self.high and value > 0
        ]
        if not fits:
            return ""
        _, other, meant = min(fits)
        return f". Meant {value:g} {other}? That is {meant:g}" + ("" if unit == "1" else f" {unit}")
