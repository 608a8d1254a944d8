"""railcosim transmission."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from railcosim.track.irregularity import QUALITIES

from .decay_rate_command import bands_of, nominal
from .option_types import OutFile, PlotFile, Speed
from .options import UsageError, speed_of, stiffness_of
from .parameter_options import PairOptions
from .progress import progress
from .results import PICTURES, RESULTS, keep
from .terminal import console

if TYPE_CHECKING:
    import xarray as xr


class Input(StrEnum):
    """What acts on the rails."""

    FORCE = "force"
    IRREGULARITY = "irregularity"


def transmission(
    *,
    given: PairOptions,
    against: Annotated[
        Path | None,
        typer.Option(
            help="Track that the insertion loss is against, TOML or a built-in one, as it is: "
            "--set changes --track.",
            metavar="F.toml",
        ),
    ] = None,
    input_: Annotated[
        Input,
        typer.Option(
            "--input",
            help="force: 1 N on one rail; irregularity: a vehicle that runs over a class of track.",
        ),
    ] = Input.FORCE,
    name: Annotated[
        str, typer.Option("--class", help=f"Of irregularity: {', '.join(QUALITIES)}.")
    ] = "german-low",
    speed: Speed = 80.0,
    contact_stiffness: Annotated[
        str | None,
        typer.Option(help="k_H of every contact, N/m; Hertz's at its static load if not given."),
    ] = None,
    bands: Annotated[str, typer.Option(help="Third octaves from:to, Hz.", metavar="F:F")] = "4:315",
    position: Annotated[
        str,
        typer.Option(
            help="Of the force or the last wheelset: railseat, midspan, or m.", metavar="X"
        ),
    ] = "railseat",
    out: OutFile = None,
    plot: PlotFile = None,
) -> None:
    """Force on the foundation in third octaves, slab vibration, insertion loss of a track.

    On a track without end, vertical; the force on all of the foundation, and the most per metre.
    """
    from railcosim.analysis.response.transmission import (
        Excitation,
        UnitForce,
        irregularity_under,
    )
    from railcosim.analysis.response.transmission import transmission as of
    from railcosim.plots.transmission import transmission_chart
    from railcosim.track.files import read_track

    RESULTS.check(out)
    PICTURES.check(plot)
    lowest, highest = bands_of(bands)
    if input_ is Input.FORCE and given.tells_vehicle:
        raise UsageError(f"{given.tells_vehicle}: is of a vehicle; give --input irregularity")
    track = given.rails()
    other = None if against is None else read_track(against)
    k_H = None if contact_stiffness is None else stiffness_of(contact_stiffness)
    acts: Excitation = UnitForce()
    if input_ is Input.IRREGULARITY:
        acts = irregularity_under(
            given.stock(), irregularity=name, speed=speed_of(speed), contact_stiffness=k_H
        )
    with progress("solving") as update:
        result = of(
            track, other, excitation=acts, lowest=lowest, highest=highest, position=position,
            progress=update,
        )  # fmt: skip
    console.print(_table(result))
    if "slab_level" in result or "against.slab_level" in result:
        console.print("levels: root mean square of the slab's velocity, dB re 1e-6 mm/s")
    keep(result, out, f"{result.sizes['frequency']} third octaves", plot, transmission_chart)


def _table(result: xr.Dataset) -> Table:
    table = Table(title="Force on the foundation")
    shown = {
        "force": f"force, {result['force'].attrs['units']}",
        "force_per_metre": f"at most, {result['force_per_metre'].attrs['units']}",
        "slab_level": "slab, dB",
        "against.force": "against: force",
        "against.slab_level": "slab, dB",
        "insertion_loss": "insertion loss, dB",
    }
    shown = {name: heading for name, heading in shown.items() if name in result}
    for heading in ("Hz", *shown.values()):
        table.add_column(heading, justify="right")
    for f in result["frequency"].values:
        one = result.sel(frequency=f)
        numbers = [
            f"{float(one[n]):.1f}" if one[n].attrs["units"] == "dB" else f"{float(one[n]):.4g}"
            for n in shown
        ]
        table.add_row(nominal(float(f)), *numbers)
    return table
