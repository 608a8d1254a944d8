"""Heights of both rails along the track, and how a run meets them."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railcosim.parameters import ParameterError

FloatArray = NDArray[np.float64]

MAX_ROWS = 5_000_000  # of a profile: 1000 km at 0.2 m
SLACK = 1e-6  # m beyond the end: rounding of a step's end


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Height of both rails along the track, below nominal (down positive).

    Attributes
    ----------
    name : str
        Where it is from.
    x : array, shape (n,)
        Increasing, m.
    left, right : array, shape (n,)
        m.
    fade : float
        m at the beginning over which it rises from nothing to its heights, as half a cosine, so
        that a run starts from rest without a bump; 0: met as it is.
    level_beyond : bool
        Whether the track is known to go on at the last height: that of a single defect is, a
        measured or a random one is not, and a run must not get there.
    recipe : str
        What its heights follow from whatever its length; empty if from nothing but themselves.
    """

    name: str
    x: FloatArray
    left: FloatArray
    right: FloatArray
    fade: float = 0.0
    level_beyond: bool = False
    recipe: str = ""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.fade) and self.fade >= 0):
            raise ParameterError(f"irregularity {self.name}: fade {self.fade:g} m must be >= 0")

    @property
    def length(self) -> float:
        """From end to end, m."""
        return float(self.x[-1] - self.x[0])

    @property
    def digest(self) -> str:
        """Of what decides the heights that a run meets: the same for a run that is longer.

        One name may stand for several profiles, such as those of an edited file.
        """
        heights = np.stack([self.x, self.left, self.right]).tobytes()
        decides = self.recipe.encode() or heights
        return hashlib.sha256(decides + f" fade {self.fade!r}".encode()).hexdigest()

    def check_covers(self, distance: float) -> None:
        """Raise ParameterError if the profile ends before a run over that distance (m) does."""
        if not self.level_beyond and distance > self.length + SLACK:
            raise ParameterError(
                f"irregularity {self.name}: ends after {self.length:g} m, and the run needs "
                f"{distance:.10g} m: shorten the run, or repeat the profile (--repeat)"
            )

    def under(self, start: FloatArray, speed: float) -> Callable[[ArrayLike], FloatArray]:
        """Irregularity under four wheelsets that start at `start` (m) with `speed` (m/s).

        The first wheelset starts at the beginning of the profile. Behind it the track is level, at
        the height with which the profile begins.

        Returns
        -------
        callable
            Time (s) to heights, left 1..4, right 1..4, m; times, shape (n,), to heights (n, 8).
            It raises ParameterError where the profile has ended, unless it is `level_beyond`.
        """
        front = float(start.max())
        z = np.stack([self.left, self.right], axis=1) * self._window()[:, None]
        from scipy.interpolate import CubicSpline  # noqa: PLC0415 - heavy

        spline = CubicSpline(self.x - self.x[0] + front, z)
        first, last = spline.x[0], spline.x[-1]
        until = math.inf if self.level_beyond else self.length + SLACK

        def heights(t: ArrayLike) -> FloatArray:
            gone = speed * np.asarray(t, dtype=float)
            if gone.max(initial=0.0) > until:
                self.check_covers(float(gone.max()))
            place = np.minimum(np.maximum(start + gone[..., None], first), last)
            at: FloatArray = spline(place).swapaxes(-1, -2).reshape(*gone.shape, -1)
            return at

        return heights

    def _window(self) -> FloatArray:
        """What the fade leaves of the heights."""
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
