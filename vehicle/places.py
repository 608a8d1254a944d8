"""Where the parts of a vehicle are, and in what they differ from others there."""

from __future__ import annotations

from dataclasses import dataclass

from railcosim.mechanics.ports import MOST_WHEELSETS
from railcosim.parameters import ParameterSet, Usual, quantity

from .properties import (
    Bogie,
    CarBody,
    Coupler,
    PrimarySuspension,
    SecondarySuspension,
    Wheelset,
)

WHERE = "where it stands"
PLACE = Usual(-60.0, 60.0, "within an articulated set")


@dataclass(frozen=True, kw_only=True)
class CarBodyPlace(ParameterSet):
    """Where a car body is; `carbody` is what differs from the vehicle's [carbody]."""

    x: float = quantity(
        0.0, "m", "its centre of mass, forward of the vehicle's middle", usual=PLACE, source=WHERE
    )
    carbody: CarBody | None = None


@dataclass(frozen=True, kw_only=True)
class BogiePlace(ParameterSet):
    """Where a bogie is, and what stands on it; None: as the vehicle's tables say."""

    x: float = quantity(0.0, "m", "its centre, forward", usual=PLACE, source=WHERE)
    wheelsets: tuple[float, ...] = quantity(
        (1.25, -1.25), "m", "wheelsets, forward of the bogie's centre",
        usual=Usual(-4.0, 4.0, "up to four axles"), source=WHERE,
    )  # fmt: skip
    carbodies: tuple[int, ...] = quantity(
        (1,), "1", "numbers, from the front, of the car bodies on it; one for each suspension",
        minimum=1, maximum=MOST_WHEELSETS, usual=Usual(1, MOST_WHEELSETS, "a car body's number"),
        source=WHERE,
    )  # fmt: skip
    pivots: tuple[float, ...] = quantity(
        (), "m", "where each of these stands, forward of the bogie's centre; none: at its centre",
        usual=Usual(-2.0, 2.0, "within a bogie"), source=WHERE,
    )  # fmt: skip
    bogie: Bogie | None = None
    wheelset: Wheelset | None = None
    primary_suspension: PrimarySuspension | None = None
    secondary_suspension: SecondarySuspension | None = None


@dataclass(frozen=True, kw_only=True)
class AxlePlace(ParameterSet):
    """Where a wheelset is that carries a car body without a bogie."""

    x: float = quantity(0.0, "m", "forward", usual=PLACE, source=WHERE)
    carbody: int = quantity(
        1, "1", "number, from the front, of the car body on it", minimum=1, maximum=MOST_WHEELSETS,
        usual=Usual(1, MOST_WHEELSETS, "a car body's number"), source=WHERE,
    )  # fmt: skip
    wheelset: Wheelset | None = None
    primary_suspension: PrimarySuspension | None = None


@dataclass(frozen=True, kw_only=True)
class CouplerPlace(ParameterSet):
    """Where two car bodies of a vehicle are joined."""

    x: float = quantity(0.0, "m", "forward", usual=PLACE, source=WHERE)
    carbodies: tuple[int, ...] = quantity(
        (1, 2), "1", "numbers of the two", minimum=1, maximum=MOST_WHEELSETS,
        usual=Usual(1, MOST_WHEELSETS, "a car body's number"), source=WHERE,
    )  # fmt: skip
    coupler: Coupler | None = None
