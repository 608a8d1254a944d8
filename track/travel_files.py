"""Speeds from CSV files: over time, or along the track."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from railcosim.parameters import ParameterError

from .tables import bare, between_columns, lines_of, numbers_of
from .travel import Changing, InPlace, InTime, Steady, Travel

KINDS: dict[str, type[Changing]] = {"time": InTime, "position": InPlace}
UNITS = {"time": {"s": 1.0}, "position": {"m": 1.0, "km": 1e3},
         "speed": {"km/h": 1 / 3.6, "m/s": 1.0}}  # fmt: skip
"""Of the columns, the usual one first."""
NAME = re.compile(r"(time|position|speed)\s*(?:[(\[]\s*(s|m|km|km/h|m/s)\s*[)\]])?")
WANTED = "time,speed or position,speed, in s, m and km/h; or 'speed (m/s)', 'position (km)'"
MAX_ROWS = 1_000_000
FASTEST = 1e4 / 3.6  # m/s
CLOSEST = 1e-6  # s or m, of rows


def read_travel(path: Path) -> Travel:
    """A speed that changes: a CSV file with the columns ``time,speed`` or ``position,speed``.

    s, m and km/h, or as the header says: ``speed (m/s)``. Between rows the speed is a line. Where
    the first row is, the run begins.

    Raises
    ------
    ParameterError
        Naming the file, the line and what is wrong.
    """
    lines = lines_of(path, 2 * MAX_ROWS)
    number, header = next(lines, (1, ""))
    between = between_columns(header)
    found = [NAME.fullmatch(bare(cell).lower()) for cell in header.split(between)]
    names = [match[1] for match in found if match]
    units = [match[2] or next(iter(UNITS[match[1]])) for match in found if match]
    kind = next((name for name in names if name in KINDS), None)
    fits = all(unit in UNITS[name] for name, unit in zip(names, units, strict=True))
    if kind is None or not fits or len(found) != 2 or sorted(names) != sorted([kind, "speed"]):
        raise ParameterError(
            f"{path}, line {number}: the header is {header[:60]!a}; wanted: {WANTED}"
        )
    size = np.array([UNITS[name][unit] for name, unit in zip(names, units, strict=True)])
    rows = []
    for number, line in lines:
        rows.append(numbers_of(path, number, line, between, 2))
        _check(path, number, dict(zip(names, rows[-1] * size, strict=True)), kind)
        if len(rows) > MAX_ROWS:
            raise ParameterError(f"{path}: over {MAX_ROWS} rows")
    if len(rows) < 2:
        raise ParameterError(f"{path}: a speed that changes has two rows at least")
    table = dict(zip(names, (np.array(rows) * size).T, strict=True))
    along, speeds = table[kind] - table[kind][0], table["speed"].copy()
    if np.diff(along).min() < CLOSEST:
        row = int(np.argmin(np.diff(along) >= CLOSEST))
        raise ParameterError(
            f"{path}: {kind} must increase, by {CLOSEST:g} at least; it does not from "
            f"{rows[row][names.index(kind)]:g} to {rows[row + 1][names.index(kind)]:g}"
        )
    return KINDS[kind](path.name, along, speeds)


def travel_of(speed: float | str | Path | Travel) -> Travel:
    """How wheels go, by their speed (m/s) or a CSV file."""
    if isinstance(speed, Travel):
        return speed
    return read_travel(Path(speed)) if isinstance(speed, str | Path) else Steady(speed)


def _check(path: Path, number: int, row: dict[str, float], kind: str) -> None:
    """Raise ParameterError for a speed that no wheels have."""
    v = row["speed"]
    if not 0 <= v <= FASTEST:
        raise ParameterError(
            f"{path}, line {number}: speed {3.6 * v:g} km/h: must be from 0 to {3.6 * FASTEST:g}"
        )
    if kind == "position" and v == 0:
        raise ParameterError(
            f"{path}, line {number}: speed 0 at a position is never reached, for towards it wheels "
            "are ever slower; give the speed over time"
        )
