"""Numbers that have no default."""

from __future__ import annotations

from dataclasses import field
from typing import Any

from railcosim.parameters import Usual
from railcosim.parameters.quantity import Quantity

FARTHEST = 1e6  # m


def needed(
    unit: str,
    description: str,
    *,
    usual: Usual | None = None,
    above: float | None = None,
    minimum: float | None = None,
    maximum: float | None = None,
) -> Any:
    """Declare a number of a `ParameterSet` that must be given; see `quantity`."""
    known = Quantity(
        unit=unit, description=description, source="", usual=usual, above=above,
        minimum=minimum, maximum=maximum,
    )  # fmt: skip
    return field(metadata={"quantity": known})
