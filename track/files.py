"""Tracks from files, and those that are built in."""

from __future__ import annotations

from pathlib import Path

from railcosim.parameters import read_named, tables_of

from .names import BUILT_IN, FOLDER
from .parameters import Track


def read_track(source: str | Path) -> Track:
    """Read a track.

    Parameters
    ----------
    source : str or Path
        A parameter file, or the name of a built-in track, one of `BUILT_IN`.

    Returns
    -------
    Track

    Raises
    ------
    ParameterError
        One line with the file, the key, its value and what is allowed.

    Warns
    -----
    UnusualWarning
        For every number of a file that is not a usual one.
    """
    return read_named(Track, Path(source), BUILT_IN, FOLDER)


def tells_cells(source: str | Path) -> bool:
    """Whether a file of one's own says how many cells the ring has."""
    return str(source) not in BUILT_IN and "cells" in tables_of(Path(source)).get("mesh", {})
