"""Single defects: of a rail, at one place; of a wheel, once every turn.

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
MOST_WAVES = 5000
DEEPEST, LONGEST = 0.1, 1e3  # m
_LENGTH = Usual(0.02, 30.0, "a wheel flat to a settlement")
_DEPTH = Usual(1e-6, 0.05, "roughness to a settlement; negative: a bump")


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
class Dip(OnRail):
    """A dip of the rail, depth / 2 (1 + cos(2 pi s / length))."""

    kind: ClassVar[str] = "dip"
    depth: float = needed(
        "m", "in the middle; negative: a bump", usual=_DEPTH, minimum=-DEEPEST, maximum=DEEPEST
    )
    length: float = needed("m", "from end to end", above=0.0, usual=_LENGTH, maximum=LONGEST)

    @property
    def extent(self) -> float:
        """See `Defect`."""
        return self.length

    def depth_at(self, s: FloatArray, radius: float) -> FloatArray:
        """See `Defect`."""
        return hollow(s, self.depth, self.length)


@dataclass(frozen=True, kw_only=True)
class Joint(OnRail):
    """A dipped joint: both rail ends bend down parabolically, depth (1 - 2 |s| / length)^2.

    They meet at an angle of 8 depth / length, which is what matters most.

    References
    ----------
    Jenkins, H. H. et al. (1974), The effect of track and vehicle parameters on wheel/rail vertical
    dynamic forces, Railway Eng. J. 3(1), 2-16.
    """

    kind: ClassVar[str] = "joint"
    depth: float = needed(
        "m", "at the rail ends; negative: peaked", usual=_DEPTH, minimum=-DEEPEST, maximum=DEEPEST
    )
    length: float = needed("m", "of both dips together", above=0.0, usual=_LENGTH, maximum=LONGEST)

    @property
    def extent(self) -> float:
        """See `Defect`."""
        return self.length

    @property
    def angle(self) -> float:
        """Of the kink, 2 alpha, rad."""
        return 8 * self.depth / self.length

    def depth_at(self, s: FloatArray, radius: float) -> FloatArray:
        """See `Defect`."""
        depth: FloatArray = self.depth * np.clip(1 - 2 * np.abs(s) / self.length, 0, 1) ** 2
        return depth


@dataclass(frozen=True, kw_only=True)
class Weld(OnRail):
    """A weld: a long hollow (or hump) with a short one in its middle, both cosines.

    References
    ----------
    Zhai, W. (2020), Vehicle-Track Coupled Dynamics: Theory and Applications, Springer: the two
    waves, 1 m and 0.1 m. Steenbergen, M. J. M. M. & Esveld, C. (2006), Rail weld geometry and
    assessment concepts, Proc. IMechE F 220, 257-271: it is the slope that matters.
    """

    kind: ClassVar[str] = "weld"
    depth: float = needed(
        "m", "of the long wave; negative: peaked", usual=_DEPTH, minimum=-DEEPEST, maximum=DEEPEST
    )
    length: float = quantity(
        1.0, "m", "of the long wave", source="Zhai (2020)", above=0.0, usual=_LENGTH,
        maximum=LONGEST,
    )  # fmt: skip
    short_depth: float = quantity(
        0.0, "m", "of the short wave, besides", source="-", usual=_DEPTH,
        minimum=-DEEPEST, maximum=DEEPEST,
    )  # fmt: skip
    short_length: float = quantity(
        0.1, "m", "of the short wave", source="Zhai (2020)", above=0.0, usual=_LENGTH,
        maximum=LONGEST,
    )  # fmt: skip

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.short_length <= self.length:
            raise ParameterError(
                f"short_length = {self.short_length:g} m: must be <= length = {self.length:g}"
            )

    @property
    def extent(self) -> float:
        """See `Defect`."""
        return self.length

    @property
    def shortest(self) -> float:
        """See `Defect`."""
        return self.short_length if self.short_depth else self.length

    def depth_at(self, s: FloatArray, radius: float) -> FloatArray:
        """See `Defect`."""
        long = hollow(s, self.depth, self.length)
        return long + hollow(s, self.short_depth, self.short_length)


@dataclass(frozen=True, kw_only=True)
class Corrugation(OnRail):
    """Hollows one behind the other, depth / 2 (1 - cos(2 pi s / length)); `at` is the beginning."""

    kind: ClassVar[str] = "corrugation"
    depth: float = needed(
        "m", "from crest to trough", usual=_DEPTH, minimum=-DEEPEST, maximum=DEEPEST
    )
    length: float = needed(
        "m", "of a wave", above=0.0, usual=Usual(0.01, 3.0, "pitch to long"), maximum=LONGEST
    )
    waves: int = quantity(
        100, "1", "how many", source="-", minimum=1, maximum=MOST_WAVES,
        usual=Usual(1, MOST_WAVES, "any"),
    )  # fmt: skip

    @property
    def extent(self) -> float:
        """See `Defect`."""
        return self.waves * self.length

    @property
    def shortest(self) -> float:
        """See `Defect`."""
        return self.length

    @property
    def middle(self) -> float:
        """See `OnRail`."""
        return self.at + self.extent / 2

    def depth_at(self, s: FloatArray, radius: float) -> FloatArray:
        """See `Defect`."""
        there = np.abs(s) < self.extent / 2
        wave = 1 - np.cos(2 * np.pi * (s + self.extent / 2) / self.length)
        depth: FloatArray = np.where(there, self.depth / 2 * wave, 0.0)
        return depth


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


@dataclass(frozen=True, kw_only=True)
class Flat(OnWheel):
    """A flat whose edges are worn round, d / 2 (1 + cos(2 pi s / l)), d = l^2 / (16 R) deep.

    References
    ----------
    Newton, S. G. & Clark, R. A. (1979), An investigation into the dynamic effects on the track of
    wheelflats on railway vehicles, J. Mech. Eng. Sci. 21(4), 287-297. Wu, T. X. & Thompson, D. J.
    (2002), A hybrid model for the noise generation due to railway wheel flats, J. Sound Vib.
    251(1), 115-139.
    """

    kind: ClassVar[str] = "flat"

    def depth_at(self, s: FloatArray, radius: float) -> FloatArray:
        """See `Defect`."""
        return hollow(s, self.length**2 / (16 * radius), self.length)


@dataclass(frozen=True, kw_only=True)
class FreshFlat(OnWheel):
    """A flat with sharp edges: a chord of the circle, l^2 / (8 R) deep.

    The wheel rolls about one edge, then about the other: its centre falls by (l/2 - |s|)^2 / (2 R)
    and meets a kink in the middle.

    References
    ----------
    See `Flat`.
    """

    kind: ClassVar[str] = "fresh-flat"

    def depth_at(self, s: FloatArray, radius: float) -> FloatArray:
        """See `Defect`."""
        depth: FloatArray = np.maximum(self.length**2 / 4 - s**2, 0.0) / (2 * radius)
        return depth


KINDS: dict[str, type[OnRail] | type[OnWheel]] = {
    one.kind: one for one in (Dip, Joint, Weld, Corrugation, Flat, FreshFlat)
}
"""By what users call them."""


def hollow(s: FloatArray, depth: float, length: float) -> FloatArray:
    """A cosine from level to level, deepest at 0; m."""
    there = np.clip(s / length, -0.5, 0.5)
    depths: FloatArray = depth / 2 * (1 + np.cos(2 * math.pi * there))
    return depths
