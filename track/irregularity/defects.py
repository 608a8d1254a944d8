"""What single defects have in common: of a rail, at one place; of a wheel, once every turn.

What each is, is how far its surface lies inside that of a straight rail or a round wheel; down and
inwards are positive. How a wheel of some radius goes over it: `met`.
"""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.parameters import ParameterError, ParameterSet, Usual, quantity, word
from railcosim.parameters.quantity import quantities

from .needed import FARTHEST, needed
from .quantities import SIDES

BOTH = "both"


@dataclass(frozen=True, kw_only=True)
class Defect(ParameterSet, ABC):
    """What all have in common.

    Attributes
    ----------
    radius : float
        Of the wheels that meet it, m; 0: what the vehicle says.
    """

    kind: ClassVar[str]
    radius: float = quantity(
        0.0, "m", "of the wheels that meet it; 0: what the vehicle says",
        source="the vehicle", usual=Usual(0.2, 0.7, "trams to locomotives"),
        minimum=0.0, maximum=2.0,
    )  # fmt: skip

    def __str__(self) -> str:
        """As a command takes it."""
        told = [
            f"{one.name}={getattr(self, one.name)}"
            for one in quantities(self)
            if getattr(self, one.name) != one.default
        ]
        return f"{self.kind}:{','.join(told)}"

    @property
    @abstractmethod
    def extent(self) -> float:
        """Along the surface, m."""

    @property
    @abstractmethod
    def sides(self) -> tuple[str, ...]:
        """Rails, or wheels of the wheelset, that have it."""

    @property
    def shortest(self) -> float:
        """The shortest of its parts, m."""
        return self.extent

    @abstractmethod
    def depth_at(self, s: FloatArray, radius: float) -> FloatArray:
        """Depth (m) at places from its middle (m), nothing beyond `extent`; of a wheel's radius."""


@dataclass(frozen=True, kw_only=True)
class OnRail(Defect):
    """One that is met by each wheel that comes by.

    Attributes
    ----------
    at : float
        Place of its middle along the track, as positions of wheelsets are, m.
    side : str
        left, right or both.
    """

    at: float = needed(
        "m", "where its middle is, along the track as positions of wheelsets are",
        minimum=-FARTHEST, maximum=FARTHEST,
    )  # fmt: skip
    side: str = word(BOTH, f"{', '.join(SIDES)} or {BOTH}", source="-")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.side not in (*SIDES, BOTH):
            raise ParameterError(f"side = {self.side}: must be {', '.join(SIDES)} or {BOTH}")

    @property
    def middle(self) -> float:
        """Where its middle is, m."""
        return self.at

    @property
    def sides(self) -> tuple[str, ...]:
        """Rails that have it."""
        return SIDES if self.side == BOTH else (self.side,)


@dataclass(frozen=True, kw_only=True)
class OnWheel(Defect):
    """One that comes round with its wheel, every 2 pi radius.

    A wheel turns as it would roll without creep.

    Attributes
    ----------
    length : float
        Along the tread, m.
    wheel : str
        Number of the wheelset, from the front, and perhaps the side: ``1.left``.
    turn : float
        Part of a turn, from 0 to 1, that it makes before the middle first meets the rail.
    """

    length: float = needed(
        "m", "along the tread", above=0.0, maximum=0.5, usual=Usual(0.01, 0.2, "of flats")
    )
    wheel: str = word("1", "number of the wheelset, perhaps with a side: 1.left", source="-")
    turn: float = quantity(
        0.5, "1", "part of a turn before it first meets the rail; 0.5: at the top at first",
        source="-", minimum=0.0, maximum=1.0, usual=Usual(0.0, 1.0, "any"),
    )  # fmt: skip

    def __post_init__(self) -> None:
        super().__post_init__()
        if not re.fullmatch(r"[1-9]\d*(\.left|\.right)?", self.wheel):
            raise ParameterError(
                f"wheel = {self.wheel}: must be the number of a wheelset from the front, from 1 "
                "on, perhaps with a side, such as 1.left"
            )

    @property
    def wheelset(self) -> int:
        """Number, from 1."""
        return int(self.wheel.partition(".")[0])

    @property
    def sides(self) -> tuple[str, ...]:
        """Wheels of it that have it."""
        side = self.wheel.partition(".")[2]
        return (side,) if side else SIDES

    @property
    def extent(self) -> float:
        """See `Defect`."""
        return self.length


def hollow(s: FloatArray, depth: float, length: float) -> FloatArray:
    """A cosine from level to level, deepest at 0; m."""
    there = np.clip(s / length, -0.5, 0.5)
    depths: FloatArray = depth / 2 * (1 + np.cos(2 * math.pi * there))
    return depths
