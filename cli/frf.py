"""railcosim frf."""

from __future__ import annotations

from typing import Annotated

import typer

from .fmus import FreshOption, fmus_of
from .options import (
    ContactStiffness,
    Frequencies,
    Out,
    PlotFile,
    PositionsOption,
    Speed,
    TrackFmu,
    UsageError,
    VehicleFmus,
    frequencies_of,
    positions_of,
    progress,
    speed_of,
    stiffness_of,
)
from .results import PICTURES, RESULTS, keep


def frf(
    out: Out,
    vehicle_fmu: VehicleFmus = None,
    track_fmu: TrackFmu = None,
    fresh: FreshOption = False,
    contact_stiffness: ContactStiffness = "1e9",
    frequencies: Frequencies = "1:200:0.5",
    excitation: Annotated[
        str,
        typer.Option(
            "--input",
            help="wheelset[i].force_z: unit force on a wheelset; wheelset[i].rail_force_z: on each "
            "rail under it; wheelset[i].irregularity_z: unit irregularity under it alone; "
            "irregularity_z: under all, met by each wheelset with its lag.",
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
    plot: PlotFile = None,
) -> None:
    """Linearise a vehicle FMU and a track FMU and couple them in the frequency domain."""
    from railcosim.analysis.response.excitation import check_excitation
    from railcosim.analysis.response.frf import Assembly, frequency_response
    from railcosim.mechanics.ports import Layout

    from .pair_charts import response_chart

    RESULTS.check(out)
    PICTURES.check(plot)
    if uncoupled and rigid_track:
        raise UsageError("--uncoupled and --rigid-track exclude each other")
    k_H = stiffness_of(contact_stiffness)
    v = speed_of(speed)
    if not vehicle_fmu:  # before ours is made
        check_excitation(excitation, Layout().wheelsets)
    if uncoupled and "irregularity" in excitation:
        raise UsageError(f"--input {excitation}: has no effect with --uncoupled, without contact")
    if rigid_track and "rail_force" in excitation:
        raise UsageError(f"--input {excitation}: has no effect with --rigid-track")
    frequency = frequencies_of(frequencies)
    assembly = Assembly.RIGID_TRACK if rigid_track else Assembly.COUPLED
    with (
        fmus_of(vehicle_fmu, track_fmu, fresh=fresh) as (vehicle, track),
        progress("linearising") as update,
    ):
        result = frequency_response(
            vehicle, track, frequency,
            excitation=excitation, contact_stiffness=k_H, speed=v, progress=update,
            position=positions_of(position),
            assembly=Assembly.APART if uncoupled else assembly,
        )  # fmt: skip
    keep(result, out, f"{frequency.size} frequencies", plot, response_chart)
