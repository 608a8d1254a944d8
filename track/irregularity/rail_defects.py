"""Kinds of single defects of a rail."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.parameters import ParameterError, Usual, quantity

from .defects import OnRail, hollow
from .needed import needed

MOST_WAVES = 5000
DEEPEST, LONGEST = 0.1, 1e3  # m
_LENGTH = Usual(0.02, 30.0, "a wheel flat to a settlement")
_DEPTH = Usual(1e-6, 0.05, "roughness to a settlement; negative: a bump")


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
