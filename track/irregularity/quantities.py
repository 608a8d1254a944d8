"""The four quantities of track geometry, and what each does to the two rails.

Deviations from the designed track, down and to the right as everywhere. The names of commands and
of columns in files; needs no numpy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # commands name the quantities, and never look into them
    from numpy import float64
    from numpy.typing import NDArray

DOWN, ASIDE = "z", "y"
"""Directions, by their names in `mechanics.ports`."""
SIDES = ("left", "right")


@dataclass(frozen=True)
class Quantity:
    """One of four, independent of the others.

    Attributes
    ----------
    title : str
        In words, and what is positive.
    direction : str
        `DOWN` or `ASIDE`: where it moves the rails.
    left, right : float
        By how much it moves each of them, m/m.
    """

    title: str
    direction: str
    left: float
    right: float


QUANTITIES = {
    "vertical": Quantity("mean height of both rails, down", DOWN, 1.0, 1.0),
    "cross_level": Quantity("height of the left rail less the right's, left low", DOWN, 0.5, -0.5),
    "alignment": Quantity("mean of both rails aside, to the right", ASIDE, 1.0, 1.0),
    "gauge": Quantity("distance of the rails, wider", ASIDE, -0.5, 0.5),
}
"""In the order in which random ones are drawn."""
ALL = "all"
"""Stands for all quantities that a class has."""


def rails_of(
    given: Mapping[str, NDArray[float64]], nothing: NDArray[float64]
) -> dict[tuple[str, str], NDArray[float64]]:
    """Where the rails lie, by direction and side, m.

    Parameters
    ----------
    given : mapping
        Quantities by name, m; those that are missing are nothing.
    nothing : array
        Zeros. Rails that nothing moves aside are left out.
    """
    rails = {}
    for direction in (DOWN, ASIDE):
        acting = {n: q for n, q in QUANTITIES.items() if q.direction == direction and n in given}
        if direction == DOWN or acting:
            for side in SIDES:
                parts = [getattr(q, side) * given[name] for name, q in acting.items()]
                rails[direction, side] = sum(parts, start=nothing)
    return rails
