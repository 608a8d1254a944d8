"""How wheels go over defects: the way of their centres, and which wheel meets what when.

A wheel of radius R touches a surface f (down) where it is highest under the round of the wheel, so
its centre at x goes down by

    z(x) = min over u of f(x + u) + u^2 / (2 R),

to u^2 / (4 R^2) of itself. It bridges hollows that are narrower than itself and rolls round edges.
For a defect of the wheel on a straight rail the same holds, along the circumference. Where both
touch beside the lowest point the force leans by u / R, which is left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.ports import Direction, Z
from railcosim.parameters import ArgumentError

from .defects import Defect, OnRail, OnWheel
from .quantities import SIDES

FINEST, COARSEST = 4000, 400  # samples over the shortest part of a defect
OVER_TOUCH = 50  # samples of how far a wheel touches ahead: the minimum is then known to 1e-4 of it
MOST_SAMPLES = 4_000_000
MOST_COMPARED = 1_000_000_000  # samples of the wheel with those of the defect: some seconds


@dataclass(frozen=True)
class Wheels:
    """Wheelsets that go over defects.

    Attributes
    ----------
    start : array, shape (wheelsets,)
        Where they are at first, m.
    radius : array, shape (wheelsets,)
        m; NaN where nobody tells.
    """

    start: FloatArray
    radius: FloatArray


@dataclass(frozen=True)
class Meeting:
    """A wheel and a defect.

    Attributes
    ----------
    defect : Defect
        Which.
    wheelset : int
        From 0.
    side : str
        Of the wheel.
    ahead : float
        How far the wheel goes until it is over its middle, m.
    period : float
        How far until it is again; infinite for a rail's.
    s, z : array, shape (n,)
        The way of the wheel's centre: from the middle, and down, m; 0 at both ends.
    """

    defect: Defect
    wheelset: int
    side: str
    ahead: float
    period: float
    s: FloatArray
    z: FloatArray

    def _from_middle(self, gone: FloatArray) -> FloatArray:
        s = gone - self.ahead
        if math.isfinite(self.period):
            s = s - self.period * np.round(s / self.period)
        return s

    def depth(self, gone: FloatArray) -> FloatArray:
        """How far down the centre is where the wheel has gone so far, m, of any shape."""
        depth: FloatArray = np.interp(self._from_middle(gone), self.s, self.z)
        return depth

    def is_on(self, gone: float) -> bool:
        """Whether the wheel is on it there."""
        return bool(abs(self._from_middle(np.float64(gone))) < self.s[-1])  # type: ignore[arg-type]

    def met_within(self, distance: float) -> bool:
        """Whether the wheel, which is not on it at first, comes to it on its way, m."""
        first = self.ahead if self.ahead > 0 else self.ahead + self.period
        return bool(0 < first < distance + self.s[-1])


def centre_path(defect: Defect, radius: float) -> tuple[FloatArray, FloatArray]:
    """The way of the centre of a wheel over a defect: from its middle, and down, m, shape (n,).

    Parameters
    ----------
    defect : Defect
        Of rail or wheel.
    radius : float
        Of the wheel, m.
    """
    half, shortest = defect.extent / 2, defect.shortest
    first = shortest / COARSEST
    f = defect.depth_at(np.arange(-half, half + first, first), radius)
    # A wheel touches where the surface is as steep as it is itself.
    touch = radius * float(np.abs(np.diff(f)).max()) / first
    step = min(max(touch / OVER_TOUCH, shortest / FINEST), first)
    step = half / math.ceil(half / step)  # ends and middle are samples
    n = math.ceil((half + touch) / step) + 1
    beside = math.ceil(touch / step)
    if 2 * n > MOST_SAMPLES or 4 * n * beside > MOST_COMPARED:
        raise ArgumentError(
            "defect", defect, f"{defect.extent:g} m with parts of {shortest:g} m and slopes of "
            f"{touch / radius:.2g} are too long, too fine or too steep for a wheel of {radius:g} m "
            f"({2 * n:.2g} samples): is a number in other units than m?",
        )  # fmt: skip
    s: FloatArray = step * np.arange(-n, n + 1, dtype=np.float64)
    near = step * np.arange(-beside, beside + 1)
    from scipy.ndimage import grey_erosion  # noqa: PLC0415 - heavy

    z: FloatArray = grey_erosion(
        defect.depth_at(s, radius), structure=-(near**2) / (2 * radius), mode="nearest"
    )
    return s, z


def meetings(defects: Sequence[Defect], wheels: Wheels) -> list[Meeting]:
    """All wheels with the defects that they may meet.

    Raises
    ------
    ArgumentError
        If there is no such wheel, its radius is not known, or it stands on a defect at first.
    """
    found = []
    for defect in defects:
        ways: dict[float, tuple[FloatArray, FloatArray]] = {}
        for i in _wheelsets(defect, wheels):
            radius = _radius(defect, wheels, i)
            if radius not in ways:
                ways[radius] = centre_path(defect, radius)
            for side in defect.sides:
                met = Meeting(
                    defect, i, side, *_when(defect, wheels.start[i], radius), *ways[radius]
                )
                if met.is_on(0.0):
                    raise ArgumentError(
                        "defect", defect, f"wheelset {i + 1} stands on it at first, at "
                        f"{wheels.start[i]:g} m: put it elsewhere",
                    )  # fmt: skip
                found.append(met)
    return found


def _wheelsets(defect: Defect, wheels: Wheels) -> Sequence[int]:
    count = wheels.start.size
    if not isinstance(defect, OnWheel):
        return range(count)
    if defect.wheelset > count:
        raise ArgumentError(
            "defect", defect, f"wheel = {defect.wheel}: there are {count} wheelsets"
        )
    return [defect.wheelset - 1]


def _radius(defect: Defect, wheels: Wheels, wheelset: int) -> float:
    radius = defect.radius or float(wheels.radius[wheelset])
    if math.isnan(radius):
        raise ArgumentError(
            "defect", defect, "the vehicle FMU does not say how large its wheels are; say "
            "it, such as radius=0.46 (m)",
        )  # fmt: skip
    return radius


def _when(defect: Defect, start: float, radius: float) -> tuple[float, float]:
    """How far a wheel goes to a defect, and until it is there again, m."""
    if isinstance(defect, OnRail):
        return defect.middle - float(start), math.inf
    assert isinstance(defect, OnWheel)
    period = 2 * math.pi * radius
    return defect.turn * period, period


def depths(
    met: Sequence[Meeting], wheelsets: int, directions: Sequence[Direction]
) -> Callable[[FloatArray], FloatArray]:
    """What all meetings together take off the rails' surface.

    Returns
    -------
    callable
        Way gone, shape (...,), to depths (..., ports), m: left wheels first, by directions, as
        `Profile.under` gives a surface.
    """
    down = list(directions).index(Z)

    def lies(gone: FloatArray) -> FloatArray:
        at = np.zeros((*gone.shape, len(SIDES), wheelsets, len(directions)))
        for one in met:
            at[..., SIDES.index(one.side), one.wheelset, down] += one.depth(gone)
        return at.reshape(*gone.shape, -1)

    return lies
