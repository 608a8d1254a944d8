"""Profiles from and to CSV files, as spreadsheets and measuring cars write them."""

from __future__ import annotations

import re
import warnings
from array import array
from pathlib import Path

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.parameters import ParameterError
from railcosim.storage.whole import write_whole

from ..tables import bare, between_columns, lines_of, numbers_of
from .profile import MAX_ROWS, Profile
from .quantities import ASIDE, DOWN, QUANTITIES, SIDES, rails_of

MAX_LINES = 2 * MAX_ROWS  # with comments
RAILS = {f"{side}_{direction}": (direction, side) for direction in (DOWN, ASIDE) for side in SIDES}
SHORT = {side: f"{side}_{DOWN}" for side in SIDES}  # "left" is "left_z"
WANTED = (
    "x,left,right or x,left, perhaps with left_y,right_y; or x and some of "
    f"{','.join(QUANTITIES)}; each in m or mm (as in 'left (mm)')"
)
NAME = re.compile(
    rf"({'|'.join(['x', *SHORT, *RAILS, *QUANTITIES])})\s*(?:[(\[]\s*(m|mm)\s*[)\]])?"
)
UNITS = {None: 1.0, "m": 1.0, "mm": 1e-3}
FARTHEST = 1e8  # m, of x: beyond, a micrometre is lost in rounding
CLOSEST = 1e-6  # m, of neighbours
HIGHEST, FARTHEST_ASIDE, PLAUSIBLE = 1.0, 0.5, 0.1  # m: no track is so rough; it may be one in mm


def read_profile(path: Path) -> Profile:
    """A measured profile: a CSV file with the column x and where rails lie, or track geometry.

    Of the rails ``left`` and ``right`` (or ``left_z``, ``right_z``), down, and ``left_y``,
    ``right_y``, to the right; without one on the right both rails are alike. Or of the geometry
    ``vertical``, ``cross_level``, ``alignment`` and ``gauge`` as deviations with the signs of
    `QUANTITIES`; those that are missing are 0.

    Columns in any order, in m, or in mm where the header says ``(mm)``; between them commas,
    semicolons or tabs, and but for commas numbers may have a decimal comma. Lines that begin with
    ``#`` are comments.

    Raises
    ------
    ParameterError
        Naming the file, the line and what is wrong.

    Warns
    -----
    UserWarning
        If the heights look like millimetres.
    """
    lines = lines_of(path, MAX_LINES)
    number, header = next(lines, (1, ""))
    between, names, units = _columns(path, number, header)
    numbers = array("d")
    for number, line in lines:
        numbers.extend(numbers_of(path, number, line, between, len(names)))
        if len(numbers) > MAX_ROWS * len(names):
            raise ParameterError(f"{path}: over {MAX_ROWS} rows")
    table = np.array(numbers).reshape(-1, len(names)) * units
    at = {name: np.ascontiguousarray(table[:, k]) for k, name in enumerate(names)}
    x = at.pop("x")
    rails = _rails(at, np.zeros_like(x))
    _check(path, x, rails)
    level = rails[DOWN, "left"]
    return Profile(name=path.name, x=x, left=level, right=level).with_rails(x, rails)


def _rails(given: dict[str, FloatArray], nothing: FloatArray) -> dict[tuple[str, str], FloatArray]:
    """Rails by direction and side, from columns of either kind."""
    if not given.keys() <= RAILS.keys():
        return rails_of(given, nothing)
    found = {(DOWN, side): nothing for side in SIDES}
    for direction in (DOWN, ASIDE):
        left, right = (f"{side}_{direction}" for side in SIDES)
        if left in given:
            both = given[left], given.get(right, given[left])
            found |= {(direction, side): at for side, at in zip(SIDES, both, strict=True)}
    return found


def _columns(path: Path, number: int, header: str) -> tuple[str, list[str], FloatArray]:
    """What is between columns, their names and their units in m."""
    between = between_columns(header)
    cells = [re.sub(r"(?<=s)[- ](?=l)", "_", bare(cell).lower()) for cell in header.split(between)]
    found = [NAME.fullmatch(cell) for cell in cells]
    names = [SHORT.get(match[1], match[1]) for match in found if match]
    if len(names) < len(found) or not _wanted(names):
        raise ParameterError(
            f"{path}, line {number}: the header is {header[:60]!a}; wanted: {WANTED}"
        )
    return between, names, np.array([UNITS[match[2]] for match in found if match])


def _wanted(names: list[str]) -> bool:
    """Whether a profile can have these columns."""
    rest = set(names) - {"x"}
    if len(rest) + 1 != len(names) or not rest:  # x is missing, or something is there twice
        return False
    lonely = any(right in rest and left not in rest for left, right in _PAIRS)
    return rest <= QUANTITIES.keys() or (rest <= RAILS.keys() and not lonely)


_PAIRS = [tuple(f"{side}_{direction}" for side in SIDES) for direction in (DOWN, ASIDE)]


def _check(path: Path, x: FloatArray, rails: dict[tuple[str, str], FloatArray]) -> None:
    """Raise ParameterError if this cannot be a track, warn if it hardly can."""
    if x.size < 4 or np.abs(x).max() > FARTHEST or np.diff(x).min() < CLOSEST:
        raise ParameterError(
            f"{path}: x must increase, over four rows at least, by {CLOSEST:g} m or more, and stay "
            f"within +-{FARTHEST:g} m"
        )
    heights, aside = (
        np.array([z for (which, _), z in rails.items() if which == direction])
        for direction in (DOWN, ASIDE)
    )
    with np.errstate(over="ignore", invalid="ignore"):
        highest = float(np.abs(heights - heights.mean()).max())
    farthest = float(np.abs(aside).max(initial=0.0))  # half of 1435 mm is no deviation
    for size, most, slip, hint in (
        (highest, HIGHEST, f"heights of {highest:.3g} m about their mean", "left (mm)"),
        (farthest, FARTHEST_ASIDE, f"rails {farthest:.3g} m off their places aside", "gauge (mm)"),
    ):
        if not size <= most:
            raise ParameterError(
                f"{path}: {slip}; {most:g} m is allowed. Are they in mm? Write '{hint}'"
            )
        if size > PLAUSIBLE:
            warnings.warn(
                f"{path}: {slip}: meant mm? Then write '{hint}' in the header", stacklevel=3
            )


def write_profile(profile: Profile, path: Path) -> None:
    """Write a profile as `read_profile` reads it, in full precision."""
    names = {place: name for name, place in RAILS.items()}
    names |= {(DOWN, side): side for side in SIDES}
    columns = ["x", *(names[place] for place in profile.rails)]
    rows = np.stack([profile.x, *profile.rails.values()], axis=1)
    lines = [",".join(repr(float(value)) for value in row) for row in rows]
    signs = "down positive" if len(columns) == 3 else "down and to the right positive"
    head = [f"# {profile.name}; m, {signs}", ",".join(columns)]
    write_whole(path, "\n".join([*head, *lines]) + "\n")
