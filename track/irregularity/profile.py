"""Heights of both rails along the track: measured, or from elsewhere."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from railcosim.parameters import ParameterError
from railcosim.storage.whole import write_whole

FloatArray = NDArray[np.float64]

MAX_ROWS = 5_000_000  # of a measured profile: 1000 km at 0.2 m


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
    """

    name: str
    x: FloatArray
    left: FloatArray
    right: FloatArray

    def under(self, start: FloatArray, speed: float, fade: float) -> Callable[[float], FloatArray]:
        """Irregularity under four wheelsets that start at `start` (m) with `speed` (m/s).

        Ahead of the first wheelset the profile fades in over a length, so that a run starts from
        rest without a bump; behind its ends it is flat.

        Returns
        -------
        callable
            Time (s) to heights, left 1..4, right 1..4, m.
        """
        front = float(start.max())
        window = np.clip((self.x - self.x[0]) / fade, 0, 1) if fade > 0 else np.ones_like(self.x)
        window = 0.5 - 0.5 * np.cos(np.pi * window)
        z = np.stack([self.left, self.right], axis=1) * window[:, None]
        spline = CubicSpline(self.x - self.x[0] + front, z)
        first, last = spline.x[0], spline.x[-1]

        def heights(t: float) -> FloatArray:
            # np.clip and flattening by other means cost more than the spline.
            place = np.minimum(np.maximum(start + speed * t, first), last)
            at: FloatArray = spline(place).T.reshape(8)
            return at

        return heights


def read_profile(path: Path) -> Profile:
    """A measured profile: a CSV file with the columns x, left and (optional) right, all in m.

    Lines that begin with ``#`` are comments. Without `right` both rails are alike.

    Raises
    ------
    ParameterError
        Naming the file, the line and what is wrong.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ParameterError(f"{path}: cannot be read: {error}") from error
    numbered = [(k, line) for k, line in enumerate(lines, 1) if line.strip() and line[0] != "#"]
    if len(numbered) > MAX_ROWS:
        raise ParameterError(f"{path}: over {MAX_ROWS} rows")
    header = [cell.strip() for cell in numbered[0][1].split(",")] if numbered else []
    if header not in (["x", "left"], ["x", "left", "right"]):
        raise ParameterError(f"{path}: the header must be x,left,right (or x,left), in m")
    rows = []
    for (number, _), cells in zip(
        numbered[1:], csv.reader(t for _, t in numbered[1:]), strict=True
    ):
        try:
            row = [float(cell) for cell in cells]
        except ValueError as error:
            raise ParameterError(f"{path}, line {number}: {error}") from error
        if len(row) != len(header) or not np.isfinite(row).all():
            raise ParameterError(f"{path}, line {number}: {len(header)} finite numbers are wanted")
        rows.append(row)
    table = np.array(rows)
    if len(rows) < 4 or (np.diff(table[:, 0]) <= 0).any():
        raise ParameterError(f"{path}: x must increase, over four rows at least")
    return Profile(name=path.name, x=table[:, 0], left=table[:, 1], right=table[:, -1])


def flat(length: float) -> Profile:
    """No irregularity."""
    x = np.linspace(0, max(length, 1.0), 4)
    return Profile(name="none", x=x, left=np.zeros(4), right=np.zeros(4))


def write_profile(profile: Profile, path: Path) -> None:
    """Write a profile as `read_profile` reads it, in full precision."""
    rows = np.stack([profile.x, profile.left, profile.right], axis=1)
    lines = [",".join(repr(float(value)) for value in row) for row in rows]
    head = [f"# {profile.name}; m, down positive", "x,left,right"]
    write_whole(path, "\n".join([*head, *lines]) + "\n")
