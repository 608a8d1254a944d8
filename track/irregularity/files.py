"""Profiles from and to CSV files, as spreadsheets and measuring cars write them."""

from __future__ import annotations

import math
import re
import warnings
from array import array
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from railcosim.parameters import ParameterError
from railcosim.storage.whole import write_whole

from .profile import MAX_ROWS, FloatArray, Profile

MAX_LINES = 2 * MAX_ROWS  # with comments
LONGEST_LINE = 1000  # characters
MARK = "\xef\xbb\xbf"  # byte order, of UTF-8, as spreadsheets write it
COLUMNS = ("x", "left", "right")
WANTED = "x,left,right or x,left, each in m or mm (as in 'left (mm)')"
NAME = re.compile(r"(x|left|right)\s*(?:[(\[]\s*(m|mm)\s*[)\]])?")
UNITS = {None: 1.0, "m": 1.0, "mm": 1e-3}
FARTHEST = 1e8  # m, of x: beyond, a micrometre is lost in rounding
CLOSEST = 1e-6  # m, of neighbours
HIGHEST, PLAUSIBLE = 1.0, 0.1  # m, about the mean: no track is so rough; it may be one in mm


def read_profile(path: Path) -> Profile:
    """A measured profile: a CSV file with the columns x, left and (optional) right.

    Columns in any order, in m, or in mm where the header says ``(mm)``; between them commas,
    semicolons or tabs, and but for commas numbers may have a decimal comma. Lines that begin with
    ``#`` are comments. Without `right` both rails are alike.

    Raises
    ------
    ParameterError
        Naming the file, the line and what is wrong.

    Warns
    -----
    UserWarning
        If the heights look like millimetres.
    """
    lines = _lines(path)
    number, header = next(lines, (1, ""))
    between, names, units = _columns(path, number, header)
    numbers = array("d")
    for number, line in lines:
        numbers.extend(_numbers(path, number, line, between, len(names)))
        if len(numbers) > MAX_ROWS * len(names):
            raise ParameterError(f"{path}: over {MAX_ROWS} rows")
    table = np.array(numbers).reshape(-1, len(names)) * units
    at = {name: np.ascontiguousarray(table[:, k]) for k, name in enumerate(names)}
    x, left = at["x"], at["left"]
    right = at.get("right", left)
    _check(path, x, np.concatenate([left, right]))
    return Profile(name=path.name, x=x, left=left, right=right)


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """Lines that are neither empty nor a comment, with their numbers."""
    try:
        # Numbers and names are ASCII; a comment in Latin-1 does no harm.
        with path.open(encoding="latin-1") as file:
            for number in range(1, MAX_LINES):
                line = file.readline(LONGEST_LINE + 1)
                if len(line) > LONGEST_LINE:
                    raise ParameterError(f"{path}, line {number}: over {LONGEST_LINE} characters")
                if not line:
                    return
                line = line.removeprefix(MARK).strip("\n")
                if line.strip(' ",;\t') and not line.lstrip(' "\t').startswith("#"):
                    yield number, line
    except OSError as error:
        raise ParameterError(f"{path}: cannot be read: {error.strerror}") from error
    raise ParameterError(f"{path}: over {MAX_LINES} lines")


def _columns(path: Path, number: int, header: str) -> tuple[str, list[str], FloatArray]:
    """What is between columns, their names and their units in m."""
    between = next((mark for mark in ";\t" if mark in header), ",")
    found = [NAME.fullmatch(_bare(cell).lower()) for cell in header.split(between)]
    names = [match[1] for match in found if match]
    if len(names) < len(found) or sorted(names) not in (["left", "x"], sorted(COLUMNS)):
        raise ParameterError(
            f"{path}, line {number}: the header is {header[:60]!a}; wanted: {WANTED}"
        )
    return between, names, np.array([UNITS[match[2]] for match in found if match])


def _numbers(path: Path, number: int, line: str, between: str, count: int) -> list[float]:
    """One row."""
    cells = [_bare(cell) for cell in line.split(between)]
    if between != ",":
        cells = [cell.replace(",", ".") for cell in cells]
    try:
        row = [float(cell) for cell in cells]
    except ValueError:
        row = []
    if len(row) != count or not all(map(math.isfinite, row)) or "_" in line:
        raise ParameterError(
            f"{path}, line {number}: {count} finite numbers are wanted, there is {line[:60]!a}"
        )
    return row


def _bare(cell: str) -> str:
    """Without blanks and the quotes around it."""
    cell = cell.strip()
    return cell[1:-1].strip() if len(cell) > 1 and cell[0] == cell[-1] == '"' else cell


def _check(path: Path, x: FloatArray, heights: FloatArray) -> None:
    """Raise ParameterError if this cannot be a track, warn if it hardly can."""
    if x.size < 4 or np.abs(x).max() > FARTHEST or np.diff(x).min() < CLOSEST:
        raise ParameterError(
            f"{path}: x must increase, over four rows at least, by {CLOSEST:g} m or more, and stay "
            f"within +-{FARTHEST:g} m"
        )
    with np.errstate(over="ignore", invalid="ignore"):
        highest = float(np.abs(heights - heights.mean()).max())
    slip = f"{path}: heights of {highest:.3g} m about their mean"
    if not highest <= HIGHEST:
        raise ParameterError(f"{slip}; {HIGHEST:g} m is allowed. Are they in mm? Write 'left (mm)'")
    if highest > PLAUSIBLE:
        warnings.warn(f"{slip}: meant mm? Then write 'left (mm)' in the header", stacklevel=3)


def write_profile(profile: Profile, path: Path) -> None:
    """Write a profile as `read_profile` reads it, in full precision."""
    rows = np.stack([profile.x, profile.left, profile.right], axis=1)
    lines = [",".join(repr(float(value)) for value in row) for row in rows]
    head = [f"# {profile.name}; m, down positive", "x,left,right"]
    write_whole(path, "\n".join([*head, *lines]) + "\n")
