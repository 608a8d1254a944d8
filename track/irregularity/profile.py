"""Where both rails lie along the track, and how a run meets them."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.ports import ROUGH, Direction, Z
from railcosim.parameters import ParameterError

from ..travel import Steady, Travel
from .quantities import ASIDE, DOWN, SIDES

MAX_ROWS = 5_000_000  # of a profile: 1000 km at 0.2 m
SLACK = 1e-6  # m beyond the end: rounding of a step's end


@dataclass(frozen=True, kw_only=True)
class Profile:
    """By how much both rails lie off their nominal places along the track.

    Attributes
    ----------
    name : str
        Where it is from.
    x : array, shape (n,)
        Increasing, m.
    left, right : array, shape (n,)
        Down, m.
    left_y, right_y : array, shape (n,), optional
        To the right, both, m; rails lie straight if not given. A gauge that is wider has the right
        rail farther to the right and the left one farther to the left.
    fade : float
        m at the beginning over which it rises from nothing to what it is, as half a cosine, so
        that a run starts from rest without a bump; 0: met as it is.
    level_beyond : bool
        Whether the track is known to go on as it ends: that of a single defect is, a measured or a
        random one is not, and a run must not get there.
    recipe : str
        What it follows from whatever its length; empty if from nothing but itself.
    """

    name: str
    x: FloatArray
    left: FloatArray
    right: FloatArray
    left_y: FloatArray | None = None
    right_y: FloatArray | None = None
    fade: float = 0.0
    level_beyond: bool = False
    recipe: str = ""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.fade) and self.fade >= 0):
            raise ParameterError(f"irregularity {self.name}: fade {self.fade:g} m must be >= 0")

    @property
    def rails(self) -> dict[tuple[str, str], FloatArray]:
        """What is given of it, by direction and side: down first, left first."""
        given = {
            (DOWN, "left"): self.left,
            (DOWN, "right"): self.right,
            (ASIDE, "left"): self.left_y,
            (ASIDE, "right"): self.right_y,
        }
        return {key: value for key, value in given.items() if value is not None}

    def with_rails(self, x: FloatArray, rails: dict[tuple[str, str], FloatArray]) -> Profile:
        """The same of other samples, by the keys of `rails`."""
        return replace(
            self, x=x, left=rails[DOWN, "left"], right=rails[DOWN, "right"],
            left_y=rails.get((ASIDE, "left")), right_y=rails.get((ASIDE, "right")),
        )  # fmt: skip

    @property
    def quantities(self) -> dict[str, FloatArray]:
        """`QUANTITIES` by name, those down, and those aside if the rails do not lie straight."""
        found = {"vertical": (self.left + self.right) / 2, "cross_level": self.left - self.right}
        if self.left_y is not None and self.right_y is not None:
            found["alignment"] = (self.left_y + self.right_y) / 2
            found["gauge"] = self.right_y - self.left_y
        return found

    @property
    def length(self) -> float:
        """From end to end, m."""
        return float(self.x[-1] - self.x[0])

    @property
    def digest(self) -> str:
        """Of what decides the rails that a run meets: the same for a run that is longer.

        One name may stand for several profiles, such as those of an edited file.
        """
        decides = self.recipe.encode() or np.stack([self.x, *self.rails.values()]).tobytes()
        return hashlib.sha256(decides + f" fade {self.fade!r}".encode()).hexdigest()

    def check_covers(self, distance: float) -> None:
        """Raise ParameterError if the profile ends before a run over that distance (m) does."""
        if not self.level_beyond and distance > self.length + SLACK:
            raise ParameterError(
                f"irregularity {self.name}: ends after {self.length:g} m, and the run needs "
                f"{distance:.10g} m: shorten the run, or repeat the profile (--repeat)"
            )

    def under(
        self, start: FloatArray, speed: float | Travel, directions: Sequence[Direction] = (Z,)
    ) -> Callable[[ArrayLike], FloatArray]:
        """Irregularity under wheelsets that start at `start` (m) with `speed` (m/s).

        The first wheelset starts at the beginning of the profile. Behind it the track is level and
        straight, as the profile begins.

        Parameters
        ----------
        start : array, shape (wheelsets,)
            m.
        speed : float or Travel
            m/s, or how it changes.
        directions : sequence of Direction
            Of `ROUGH`: in which the rails' surfaces are asked for.

        Returns
        -------
        callable
            Time (s) to a surface, m: all wheels on the left, then all on the right, as the ports of
            a `Layout` of these directions. Times, shape (n,), to an array (n, ports). It raises
            ParameterError where the profile has ended, unless it is `level_beyond`.

        Raises
        ------
        ValueError
            If there is no irregularity in a direction.
        """
        if not set(directions) <= set(ROUGH):
            raise ValueError(
                f"directions {[d.name for d in directions]}: no surface lies off there"
            )
        front, rails = float(start.max()), self.rails
        travel = speed if isinstance(speed, Travel) else Steady(speed)
        straight = np.zeros_like(self.x)
        sides = [rails.get((d.name, side), straight) for side in SIDES for d in directions]
        z = np.stack(sides, axis=1) * self._window()[:, None]
        from scipy.interpolate import CubicSpline  # noqa: PLC0415 - heavy

        spline = CubicSpline(self.x - self.x[0] + front, z)
        first, last = spline.x[0], spline.x[-1]
        until = math.inf if self.level_beyond else self.length + SLACK

        def heights(t: ArrayLike) -> FloatArray:
            gone = travel.gone(t)
            if gone.max(initial=0.0) > until:
                self.check_covers(float(gone.max()))
            place = np.minimum(np.maximum(start + gone[..., None], first), last)
            at = spline(place).reshape(*place.shape, len(SIDES), -1)  # wheelsets, sides, directions
            surface: FloatArray = at.swapaxes(-3, -2).reshape(*gone.shape, -1)
            return surface

        return heights

    def _window(self) -> FloatArray:
        """What the fade leaves of it."""
        if self.fade == 0:
            return np.ones_like(self.x)
        ahead = np.clip((self.x - self.x[0]) / self.fade, 0, 1)
        window: FloatArray = 0.5 - 0.5 * np.cos(np.pi * ahead)
        return window


def flat() -> Profile:
    """No irregularity."""
    x = np.linspace(0.0, 1.0, 4)
    level = np.zeros(4)
    return Profile(name="none", x=x, left=level, right=level, level_beyond=True)
