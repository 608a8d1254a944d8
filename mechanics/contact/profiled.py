"""Wheels on rails by tables of their profiles: a `Geometry`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray
from .creep import Patch
from .ellipse import Ellipse
from .geometry import Touch, relative_pose
from .kalker import Kalker
from .numbers import Numbers
from .profiles import COLUMNS, PER_LOAD, ProfileError, ProfileTable

Rows: TypeAlias = NDArray[np.int_]
NUMBERS = ("reference_radius", "half_distance", "first", "step", "shear_modulus")
"""What there is beside the table of like wheels: m, and N/m2."""
MOST_ROWS = 100_000  # of a table that comes from a file


@dataclass(frozen=True, kw_only=True, eq=False)
class Profiled:
    """Wheels and rails of given profiles; a `Geometry`.

    Right for displacements across and down, and to the square of a roll of the wheel on its rail;
    the length of the normal to such a roll times the slope.

    Attributes
    ----------
    reference_radius : float
        Of both wheels at their profiles' reference points, m.
    half_distance : float
        Of the reference points from the middle, m.
    left, right : ProfileTable
        Of the two wheels; of displacements alike.
    shear_modulus : float
        G of wheel and rail, N/m2.

    Raises
    ------
    ProfileError
        If the tables are not of the same displacements, with 0 among them.
    """

    reference_radius: float
    half_distance: float
    left: ProfileTable
    right: ProfileTable
    shear_modulus: float

    def __post_init__(self) -> None:
        one, other = self.left, self.right
        count = one.columns["height"].size
        alike = (one.first, one.step, count) == (
            other.first, other.step, other.columns["height"].size,
        )  # fmt: skip
        if not (alike and one.first <= 0 <= one.first + one.step * (count - 1)):
            raise ProfileError("tables of left and right wheels must be of the same displacements")

    def told(self) -> dict[str, Any]:
        """All of it as plain numbers, `NUMBERS` and `COLUMNS`, where left and right are alike."""
        if self.left is not self.right:
            raise ProfileError("left and right wheels must be alike to be told")
        about = {name: getattr(self, name) for name in NUMBERS if name not in ("first", "step")}
        table = {name: self.left.columns[name].tolist() for name in COLUMNS}
        return {**about, "first": self.left.first, "step": self.left.step, "columns": table}

    @classmethod
    def of(cls, told: Any) -> Profiled:
        """What `told` told, perhaps by strangers.

        Raises
        ------
        ProfileError
            If it is none.
        """
        try:
            about = {name: float(told[name]) for name in NUMBERS}
            columns = {name: np.array(told["columns"][name], dtype=float) for name in COLUMNS}
        except (TypeError, KeyError, ValueError) as error:
            raise ProfileError(f"no table of profiles: {error!r}") from error
        count = columns[COLUMNS[0]].size
        if not 2 <= count <= MOST_ROWS or any(c.shape != (count,) for c in columns.values()):
            raise ProfileError(f"a table of profiles: must be of 2 to {MOST_ROWS} rows")
        if not all(np.isfinite(c).all() for c in (*columns.values(), np.array([*about.values()]))):
            raise ProfileError("a table of profiles with a number that is not finite")
        above = [about[name] for name in NUMBERS if name != "first"]
        if min(above) <= 0 or min(columns[name].min() for name in PER_LOAD) <= 0:
            raise ProfileError("a table of profiles: radii, axes and moduli must be above 0")
        one = ProfileTable(first=about.pop("first"), step=about.pop("step"), columns=columns)
        return cls(left=one, right=one, **about)

    @cached_property
    def _columns(self) -> dict[str, FloatArray]:
        """Of the left wheel, then of the right one, shape (2, n)."""
        both = (self.left.columns, self.right.columns)
        return {name: np.stack([one[name] for one in both]) for name in both[0]}

    @cached_property
    def radius(self) -> float:
        """r0: the mean rolling radius in the middle, m."""
        places = np.zeros(2)
        z, _ = self._read("z", *self._place(places, np.array([0, 1])))
        return float(self.reference_radius + z.mean())

    @cached_property
    def _apart(self) -> FloatArray:
        """Heights of the reference points from the datum in the middle, shape (2,)."""
        return self._height(*self._place(np.zeros(2), np.array([0, 1])))[0]

    def touch(self, q: Numbers, side: FloatArray) -> Touch[Numbers]:
        """See `Geometry`."""
        which = (side > 0).astype(int)
        pose = relative_pose(
            q, side * self.half_distance, self.reference_radius, self._apart[which]
        )
        u, roll, yaw = side * pose.y, side * pose.roll, q[..., 4]
        place = self._place(u, which)
        height, slope, bend = self._height(*place)
        lever, lever_by = self._read("lever", *place)
        bow, bow_by = self._read("bow", *place)
        travel, _ = self._read("travel", *place)
        sinking, sinking_by = self._read("sinking", *place)
        # The height goes on with a roll as a parabola, whose derivatives are all that follows.
        below = pose.z - height - roll * lever + roll**2 / 2 * bow
        by_u = -slope - roll * lever_by + roll**2 / 2 * bow_by
        by_roll = -lever + roll * bow
        down: Numbers = (1 + slope**2) ** -0.5
        # They touch where they would if they went apart along the normal.
        back = below * down**2 * slope
        (y, y_by), (z, z_by) = (self._read(name, *place) for name in ("y", "z"))
        y = y + roll * travel + back * y_by
        z = z + roll * travel * slope + back * z_by
        return Touch(
            compression=below * down - sinking * yaw**2 / 2,
            gradient=pose.gradient(
                side * (by_u * down - below * down**3 * slope * bend - sinking_by * yaw**2 / 2),
                down,
                side * by_roll * down,
                -sinking * yaw,
            ),
            slope=side * (np.arctan(by_u) + roll),
            y=side * (self.half_distance + y),
            radius=self.reference_radius + z,
            **pose.from_datum(side * y, z),
            patch=self._patch(place),
        )

    def _place(self, u: Numbers, which: Rows) -> tuple[Rows, Rows, Numbers]:
        """Table, row and how far towards the next row."""
        along = (u - self.left.first) / self.left.step
        last = self.left.columns["height"].size - 1
        outside = (along.real < 0) | (along.real > last)
        if np.any(outside):
            ends = self.left.first + self.left.step * np.array([0, last])
            raise ArithmeticError(
                f"a wheel has gone {u.real[outside].flat[0]:g} m outwards on its rail: its "
                f"profiles were tabulated from {ends[0]:g} to {ends[1]:g} m"
            )
        row = np.clip(along.real.astype(int), 0, last - 1)
        return np.broadcast_to(which, row.shape), row, along - row

    def _read(self, name: str, which: Rows, row: Rows, part: Numbers) -> tuple[Numbers, FloatArray]:
        """A column between its rows, a line, and its derivative."""
        column = self._columns[name]
        begin, end = column[which, row], column[which, row + 1]
        value: Numbers = begin + part * (end - begin)
        return value, (end - begin) / self.left.step

    def _height(self, which: Rows, row: Rows, part: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """Height, slope and second derivative, by Hermite's cubic: the slopes are known."""
        h = self.left.step
        z, s = self._columns["height"], self._columns["slope"]
        z0, z1, s0, s1 = z[which, row], z[which, row + 1], s[which, row], s[which, row + 1]
        mean = (z1 - z0) / h
        c2, c3 = 3 * mean - 2 * s0 - s1, s0 + s1 - 2 * mean
        height: Numbers = z0 + h * part * (s0 + part * (c2 + part * c3))
        slope: Numbers = s0 + part * (2 * c2 + 3 * part * c3)
        bend: Numbers = (2 * c2 + 6 * part * c3) / h
        return height, slope, bend

    def _patch(self, place: tuple[Rows, Rows, Numbers]) -> Patch:
        read: dict[str, Any] = {name: self._read(name, *place)[0] for name in PER_LOAD}
        return Patch(
            ellipse=Ellipse(**{name: read[name] for name in PER_LOAD[:3]}),
            kalker=Kalker(**{name: read[name] for name in PER_LOAD[3:]}),
            shear_modulus=self.shear_modulus,
        )
