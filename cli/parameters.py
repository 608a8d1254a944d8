"""railcosim parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from railcosim.track.names import BUILT_IN as TRACKS
from railcosim.vehicle.names import BUILT_IN, PAPER

from .options import UsageError
from .parameter_options import TRACK, VEHICLE, SetOption, changes_of


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
    set_: SetOption = None,
) -> None:
    """Print a built-in parameter file, with units, ranges and sources as comments."""
    from railcosim.parameters import changed, write_toml
    from railcosim.track.files import read_track
    from railcosim.vehicle.files import read_stock, write_stock

    if vehicle == track:
        raise UsageError("parameters: give --vehicle or --track")
    known = TRACKS if track else BUILT_IN
    if of not in known:
        raise UsageError(f"--of {of}: must be one of {', '.join(known)}")
    what = TRACK if track else VEHICLE
    read: Any = read_track(of) if track else read_stock(Path(of))
    chosen = changed(read, changes_of(set_, {what: read})[what])
    # Plain print: the file goes to a file.
    print(write_toml(chosen, read.called) if track else write_stock(chosen), end="")
