"""railcosim frf."""

from __future__ import annotations

from typing import Annotated

import typer

from .options import (
    DimensionName,
    Frequencies,
    Out,
    PlotFile,
    PositionsOption,
    Speed,
    UsageError,
    frequencies_of,
    positions_of,
    progress,
    speed_of,
    stiffness_of,
)
from .parameter_options import FmuOptions
from .results import PICTURES, RESULTS, keep


def frf(
    *,
    out: Out,
    given: FmuOptions,
    dimension: Annotated[
        DimensionName,
        typer.Option(
            "--dimension",
            help="Of our FMUs. In space wheels roll at the speed, as the vehicle FMU tells, or "
            "[rolling] of --vehicle.",
        ),
    ] = DimensionName.VERTICAL,
    contact_stiffness: Annotated[
        str | None,
        typer.Option(
            "--contact-stiffness", help="Of FMUs that meet downwards only, N/m; 1e9 if not given."
        ),
    ] = None,
    frequencies: Frequencies = "1:200:0.5",
    excitation: Annotated[
        str,
        typer.Option(
            "--input",
            help="wheelset[i].force_z: unit force on a wheelset; wheelset[i].rail_force_z (or _y): "
            "on each rail under it; wheelset[i].irregularity_z: unit irregularity under it alone; "
            "irregularity_z: under all, met by each wheelset with its lag. In space also "
            "alignment, cross_level and gauge in its place.",
        ),
    ] = "wheelset[4].force_z",
    speed: Speed = 250.0,
    position: PositionsOption = None,
    uncoupled: Annotated[
        bool, typer.Option("--uncoupled", help="Vehicle and track without each other.")
    ] = False,
    rigid_track: Annotated[
        bool, typer.Option("--rigid-track", help="Vehicle on its contact springs alone.")
    ] = False,
    believe: Annotated[
        bool,
        typer.Option("--believe", help="Take the response of a vehicle that hunts as it is."),
    ] = False,
    plot: PlotFile = None,
) -> None:
    """Linearise a vehicle FMU and a track FMU and couple them in the frequency domain."""
    from railcosim.analysis.response.excitation import check_excitation, is_irregularity
    from railcosim.analysis.response.frf import Assembly, frequency_response
    from railcosim.vehicle.train import train_of

    from .pair_charts import response_chart

    RESULTS.check(out)
    PICTURES.check(plot)
    if uncoupled and rigid_track:
        raise UsageError("--uncoupled and --rigid-track exclude each other")
    k_H = None if contact_stiffness is None else stiffness_of(contact_stiffness)
    if k_H is not None and dimension is DimensionName.SPATIAL:
        raise UsageError("--contact-stiffness: is of the vertical model; in space wheels roll")
    stock = given.stock()
    v = speed_of(speed)
    if not given.vehicle_fmu:  # before ours is made
        check_excitation(
            excitation,
            sum(one.wheelsets for one in train_of(stock).vehicles),
            in_space=dimension is DimensionName.SPATIAL,
        )
    if uncoupled and is_irregularity(excitation):
        raise UsageError(f"--input {excitation}: has no effect with --uncoupled, without contact")
    if rigid_track and "rail_force" in excitation:
        raise UsageError(f"--input {excitation}: has no effect with --rigid-track")
    frequency = frequencies_of(frequencies)
    assembly = Assembly.RIGID_TRACK if rigid_track else Assembly.COUPLED
    with (
        given.fmus(dimension=dimension, told=True) as (vehicles, track),
        progress("linearising") as update,
    ):
        result = frequency_response(
            vehicles, track, frequency, excitation=excitation, contact_stiffness=k_H,
            stock=stock if given.tells_vehicle else None,
            speed=v, believe=believe, progress=update,
            position=positions_of(position),
            assembly=Assembly.APART if uncoupled else assembly,
        )  # fmt: skip
    keep(result, out, f"{frequency.size} frequencies", plot, response_chart)
