"""railcosim parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from railcosim.track.names import BUILT_IN as TRACKS
from railcosim.vehicle.names import BUILT_IN, PAPER

from .options import UsageError


def parameters(
    vehicle: Annotated[bool, typer.Option("--vehicle", help="The vehicle's.")] = False,
    track: Annotated[bool, typer.Option("--track", help="The track's.")] = False,
    of: Annotated[
        str,
        typer.Option(
            help=f"Which vehicle's: {', '.join(BUILT_IN)}; or track's: {', '.join(TRACKS)}.",
            metavar="NAME",
        ),
    ] = PAPER,
) -> None:
    """Print a built-in parameter file, with units, ranges and sources as comments."""
    from railcosim.parameters import write_toml
    from railcosim.track.files import read_track
    from railcosim.vehicle.files import read_stock, write_stock

    if vehicle == track:
        raise UsageError("parameters: give --vehicle or --track")
    known = TRACKS if track else BUILT_IN
    if of not in known:
        raise UsageError(f"--of {of}: must be one of {', '.join(known)}")
    # Plain print: the file goes to a file.
    rails = read_track(of) if track else None
    text = write_toml(rails, rails.called) if rails else write_stock(read_stock(Path(of)))
    print(text, end="")
