"""A speed, or a file of one that changes, on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .options import UsageError, doubted, speed_of

if TYPE_CHECKING:
    from railcosim.track.travel import Travel

SpeedOrFile = Annotated[
    str,
    typer.Option(
        "--speed",
        help="km/h; or a CSV file with time,speed or position,speed (s, m, km/h), from where the "
        "run begins.",
        metavar="KMH|F.csv",
    ),
]


def travel_of(text: str, time: float) -> Travel:
    """How wheels go for so long, s.

    Raises
    ------
    UsageError, ParameterError
        If that is no speed, or the file cannot be read or ends before.
    """
    from railcosim.track.travel import Steady
    from railcosim.track.travel_files import read_travel

    if not text.lower().endswith(".csv"):
        try:
            kmh = float(text)
        except ValueError as error:
            raise UsageError(
                f"--speed {text}: must be a number, km/h, or a file that ends in .csv"
            ) from error
        return Steady(speed_of(kmh))
    travel = read_travel(Path(text))
    travel.check_covers(time)
    doubted("--speed", 3.6 * travel.fastest)
    return travel
