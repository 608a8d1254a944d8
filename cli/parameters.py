"""railcosim parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from railcosim.vehicle.names import BUILT_IN, PAPER

from .options import UsageError


def parameters(
    vehicle: Annotated[bool, typer.Option("--vehicle", help="The vehicle's.")] = False,
    track: Annotated[bool, typer.Option("--track", help="The track's.")] = False,
    of: Annotated[
        str, typer.Option(help=f"Which vehicle's: {', '.join(BUILT_IN)}.", metavar="NAME")
    ] = PAPER,
) -> None:
    """Print a built-in parameter file, with units, ranges and sources as comments."""
    from railcosim.parameters import write_toml
    from railcosim.track.parameters import Track
    from railcosim.vehicle.files import read_stock, write_stock

    if vehicle == track:
        raise UsageError("parameters: give --vehicle or --track")
    if of not in BUILT_IN or (track and of != PAPER):
        raise UsageError(f"--of {of}: with --vehicle, one of {', '.join(BUILT_IN)}")
    # Plain print: the file goes to a file.
    text = write_stock(read_stock(Path(of))) if vehicle else write_toml(Track(), "Slab track")
    print(text, end="")
