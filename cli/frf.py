"""railcosim frf."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from .option_types import Frequencies, Out, PlotFile, Speed
from .options import UsageError, frequencies_of, speed_of
from .progress import progress
from .results import PICTURES, RESULTS, keep
from .sensor_options import ObservedMeeting

if TYPE_CHECKING:
    from railcosim.analysis.response.frf import Assembly


def frf(
    out: Out,
    pair: ObservedMeeting,
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
    from railcosim.analysis.response.frf import frequency_response
    from railcosim.vehicle.train import train_of

    from .pair_charts import response_chart

    RESULTS.check(out)
    PICTURES.check(plot)
    assembly = _assembly(uncoupled, rigid_track, excitation)
    arguments, v = pair.arguments(), speed_of(speed)
    if not pair.vehicle_fmu:  # before ours is made
        wheelsets = sum(one.wheelsets for one in train_of(pair.stock()).vehicles)
        check_excitation(excitation, wheelsets, in_space=pair.in_space)
    frequency = frequencies_of(frequencies)
    with pair.files() as (vehicles, track), progress("linearising") as update:
        result = frequency_response(
            vehicles, track, frequency, excitation=excitation, speed=v, assembly=assembly,
            progress=update, **arguments,
        )  # fmt: skip
    keep(result, out, f"{frequency.size} frequencies", plot, response_chart)


def _assembly(uncoupled: bool, rigid_track: bool, excitation: str) -> Assembly:
    """What responds, if the excitation does something to it."""
    from railcosim.analysis.response.excitation import is_irregularity
    from railcosim.analysis.response.frf import Assembly

    if uncoupled and rigid_track:
        raise UsageError("--uncoupled and --rigid-track exclude each other")
    if uncoupled and is_irregularity(excitation):
        raise UsageError(f"--input {excitation}: has no effect with --uncoupled, without contact")
    if rigid_track and "rail_force" in excitation:
        raise UsageError(f"--input {excitation}: has no effect with --rigid-track")
    if uncoupled:
        return Assembly.APART
    return Assembly.RIGID_TRACK if rigid_track else Assembly.COUPLED
