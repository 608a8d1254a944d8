"""railcosim parameters."""

from __future__ import annotations

from typing import Annotated

import typer

from railcosim.parameters import write_toml
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

from .options import UsageError


def parameters(
    vehicle: Annotated[bool, typer.Option("--vehicle", help="The vehicle's.")] = False,
    track: Annotated[bool, typer.Option("--track", help="The track's.")] = False,
) -> None:
    """Print the default parameter file, with units, ranges and sources as comments."""
    if vehicle == track:
        raise UsageError("parameters: give --vehicle or --track")
    # Plain print: the file goes to a file.
    text = write_toml(Vehicle(), "Vehicle") if vehicle else write_toml(Track(), "Slab track")
    print(text, end="")
