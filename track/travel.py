"""How far wheels have come at a time: at one speed, or at one that changes along a line.

Between two rows a speed is a line, in time or along the track; where the wheels then are is known
in closed form, so nothing is integrated in steps.
"""

from __future__ import annotations

import hashlib
import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from railcosim.mechanics.arrays import FloatArray
from railcosim.parameters import ParameterError

SLACK = 1e-9  # of the time at the end: rounding of a step's end


class Travel(ABC):
    """From time (s), 0 at the beginning, to the way (m) and the speed (m/s)."""

    @property
    @abstractmethod
    def name(self) -> str:
        """What it is called."""

    @property
    @abstractmethod
    def changes(self) -> bool:
        """Whether the speed is not one."""

    @abstractmethod
    def gone(self, t: ArrayLike) -> FloatArray:
        """How far the wheels have come at times, of any shape, m."""

    @abstractmethod
    def speed(self, t: ArrayLike) -> FloatArray:
        """How fast they are, m/s."""

    @property
    @abstractmethod
    def until(self) -> float:
        """When it ends, s; nothing is known of what is behind."""

    @property
    @abstractmethod
    def fastest(self) -> float:
        """Highest speed, m/s."""

    @property
    @abstractmethod
    def slowest(self) -> float:
        """Lowest speed, m/s."""

    @property
    def digest(self) -> str:
        """Of what decides it; empty if the speed at the beginning does."""
        return ""

    def check_covers(self, time: float) -> None:
        """Raise ParameterError if it ends before a run of that time (s) does."""
        if time > self.until * (1 + SLACK):
            raise ParameterError(
                f"speed {self.name}: ends after {self.until:g} s, and the run takes {time:g} s: "
                "shorten the run (--time), or add a row"
            )


@dataclass(frozen=True)
class Steady(Travel):
    """One speed.

    Attributes
    ----------
    at : float
        m/s.
    """

    at: float

    @property
    def name(self) -> str:
        """In km/h."""
        return f"{3.6 * self.at:g} km/h"

    @property
    def changes(self) -> bool:
        """See `Travel`."""
        return False

    def gone(self, t: ArrayLike) -> FloatArray:
        """See `Travel`."""
        way: FloatArray = self.at * np.asarray(t, dtype=np.float64)
        return way

    def speed(self, t: ArrayLike) -> FloatArray:
        """See `Travel`."""
        return np.full(np.shape(t), self.at)

    @property
    def until(self) -> float:
        """Never."""
        return math.inf

    @property
    def fastest(self) -> float:
        """See `Travel`."""
        return self.at

    @property
    def slowest(self) -> float:
        """See `Travel`."""
        return self.at


@dataclass(frozen=True, eq=False)
class Changing(Travel):
    """A speed that is a line between rows.

    Attributes
    ----------
    called : str
        Where it is from.
    along : array, shape (n,)
        What the speed is given over, from 0, increasing.
    speeds : array, shape (n,)
        m/s.
    """

    called: str
    along: FloatArray
    speeds: FloatArray
    times: FloatArray = field(init=False)
    ways: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        """Time (s) and way (m) at the rows, from those that pass between them."""
        for name, passed in (("times", self._times()), ("ways", self._ways())):
            object.__setattr__(self, name, np.concatenate([[0.0], np.cumsum(passed)]))

    @property
    def name(self) -> str:
        """See `Travel`."""
        return self.called

    @property
    def changes(self) -> bool:
        """See `Travel`."""
        return bool(np.ptp(self.speeds) > 0)

    @property
    def _slope(self) -> FloatArray:
        """Of each line."""
        slope: FloatArray = np.diff(self.speeds) / np.diff(self.along)
        return slope

    @abstractmethod
    def _times(self) -> FloatArray:
        """That pass between rows, s."""

    @abstractmethod
    def _ways(self) -> FloatArray:
        """Between rows, m."""

    @property
    def until(self) -> float:
        """See `Travel`."""
        return float(self.times[-1])

    @property
    def fastest(self) -> float:
        """See `Travel`."""
        return float(self.speeds.max())

    @property
    def slowest(self) -> float:
        """See `Travel`."""
        return float(self.speeds.min())

    @property
    def digest(self) -> str:
        """See `Travel`."""
        content = type(self).__name__.encode() + np.stack([self.along, self.speeds]).tobytes()
        return hashlib.sha256(content).hexdigest()

    def _row(self, t: ArrayLike) -> tuple[np.ndarray, FloatArray]:
        """The last row at a time, which is no later than the last but one, and the time since."""
        t = np.asarray(t, dtype=np.float64)
        row = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, self.times.size - 2)
        return row, t - self.times[row]


class InTime(Changing):
    """Given over time (s): lines are of one acceleration, the way is a parabola."""

    def _times(self) -> FloatArray:
        passed: FloatArray = np.diff(self.along)
        return passed

    def _ways(self) -> FloatArray:
        ways: FloatArray = np.diff(self.along) * (self.speeds[:-1] + self.speeds[1:]) / 2
        return ways

    def gone(self, t: ArrayLike) -> FloatArray:
        """See `Travel`."""
        row, since = self._row(t)
        half = self._slope[row] * since / 2
        way: FloatArray = self.ways[row] + since * (self.speeds[row] + half)
        return way

    def speed(self, t: ArrayLike) -> FloatArray:
        """See `Travel`."""
        row, since = self._row(t)
        at: FloatArray = self.speeds[row] + self._slope[row] * since
        return at


class InPlace(Changing):
    """Given along the way (m): over a line speed and way are exponentials of time."""

    def _times(self) -> FloatArray:
        more = np.diff(self.speeds) / self.speeds[:-1]
        passed: FloatArray = np.diff(self.along) / self.speeds[:-1] * _by(more, np.log1p(more))
        return passed

    def _ways(self) -> FloatArray:
        ways: FloatArray = np.diff(self.along)
        return ways

    def gone(self, t: ArrayLike) -> FloatArray:
        """See `Travel`."""
        row, since = self._row(t)
        grown = self._slope[row] * since
        way: FloatArray = self.ways[row] + since * self.speeds[row] * _by(grown, np.expm1(grown))
        return way

    def speed(self, t: ArrayLike) -> FloatArray:
        """See `Travel`."""
        row, since = self._row(t)
        at: FloatArray = self.speeds[row] * np.exp(self._slope[row] * since)
        return at


def _by(z: FloatArray, f: FloatArray) -> FloatArray:
    """The quotient f / z, 1 where both are 0."""
    z = np.asarray(z)
    quotient: FloatArray = np.divide(f, z, out=np.ones_like(z), where=z != 0)
    return quotient
