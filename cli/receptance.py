"""railcosim receptance (of any FMU), railcosim track-receptance (of the finite elements)."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from railcosim.analysis.response.choices import Method
from railcosim.track.names import PAPER

from .option_types import Frequencies, LocalOption, Out, PlotFile, PositionOption
from .options import UsageError, frequencies_of, positive
from .parameter_options import TrackOptions
from .progress import progress
from .results import PICTURES, RESULTS, keep
from .terminal import console

if TYPE_CHECKING:
    import xarray as xr

    from railcosim.plots.chart import Chart


ANY = 1e-12, 1e12  # Hz: an FMU may be of any field


class Along(StrEnum):
    """Along what a rail is loaded, or its motion seen."""

    DOWN = "z"
    RIGHT = "y"
    ROLL = "roll"


class Load(StrEnum):
    """On which rails a unit load acts."""

    BOTH = "both"
    SINGLE = "single"


def receptance(
    fmu: Annotated[
        Path, typer.Argument(help="Any FMU for Model Exchange, or that can save its state.")
    ],
    input_: Annotated[str, typer.Option("--input", help="Input to excite.")],
    output: Annotated[str, typer.Option("--output", help="Output to observe.")],
    out: Out,
    frequencies: Frequencies = "1:1000:400@log",
    method: Annotated[
        Method,
        typer.Option(
            metavar="NAME",
            help="exact: directional derivatives of Model Exchange; differences: finite ones; "
            "pulses: the response to a pulse in Co-Simulation; best: the first of these the FMU "
            "allows.",
        ),
    ] = Method.BEST,
    step: Annotated[
        float,
        typer.Option(
            help="Of pulses, s; one over it is above the FMU's highest frequency plus yours."
        ),
    ] = 1e-4,
    steps: Annotated[
        int,
        typer.Option(min=500, max=1_000_000, help="After a pulse: until what lasts moves alone."),
    ] = 13_500,
    position: PositionOption = None,
    amplitude: Annotated[float, typer.Option(help="Pulse height, in the input's unit.")] = 1e4,
    plot: PlotFile = None,
) -> None:
    """Frequency response of any FMU between two variables, from a linear model of it."""
    from railcosim.analysis.response import receptance as of
    from railcosim.master.linear.linear_fmu import Pulses

    RESULTS.check(out)
    PICTURES.check(plot)
    positive("--step", step, "s")
    positive("--amplitude", amplitude, "of the input's unit")
    frequency = frequencies_of(frequencies, ANY)
    pulses = Pulses(amplitude=amplitude, step=step, steps=steps)
    with progress(f"linearising ({of.way_of(fmu, method, pulses).description})") as update:
        result = of.receptance(
            fmu, input_, output, frequency,
            method=method, pulses=pulses, position=position, progress=update,
        )  # fmt: skip
    keep(result, out, f"{frequency.size} frequencies", plot, _chart)
    error = result.attrs["error_estimate"]
    known = f"estimated error {error:.1e}" if error else "exact but for rounding"
    console.print(f"{result.attrs['method']}: {known}")


def track_receptance(
    *,
    out: Out,
    given: TrackOptions,
    direction: Annotated[
        Along,
        typer.Option(help="Of the load at the head: z down, y to the right, roll a moment."),
    ] = Along.DOWN,
    response: Annotated[
        Along | None,
        typer.Option(
            help="Of the motion at the head, the left rail's; without it that of the load."
        ),
    ] = None,
    position: Annotated[
        str,
        typer.Option(
            "--position",
            "--at",
            help="railseat, midspan, or m along the track, from where a cell begins.",
        ),
    ] = "railseat",
    offset: Annotated[
        float,
        typer.Option(
            min=-1,
            max=1,
            help="Of load and response from the middle of the head towards the track's centre, m.",
        ),
    ] = 0.0,
    load: Annotated[
        Load,
        typer.Option(
            help="both: the same unit load on each rail (the paper's); single: on the left one."
        ),
    ] = Load.BOTH,
    frequencies: Frequencies = "1:2000:1",
    ring: Annotated[
        bool, typer.Option("--ring", help="Of the ring of mesh.cells cells that the FMUs have.")
    ] = False,
    local: LocalOption = None,
    then: Annotated[
        list[str] | None,
        typer.Option(
            "--then",
            help="Another kind of track from PLACE on, m: a file or a built-in one, such as "
            "ballasted@0. Repeat it for more; the last one has no end. --position is along them.",
            metavar="TRACK@PLACE",
        ),
    ] = None,
    plot: PlotFile = None,
) -> None:
    """Receptance of the rail on a track without end, where it is loaded, by finite elements.

    z for z is the vertical model's; all others are of rails that also bend sideways and twist.
    Says by how much the ring of cells in the FMUs differs.
    """
    import numpy as np

    from railcosim.analysis.response import track_receptance as of
    from railcosim.analysis.response.track_words import change_of, line_of

    RESULTS.check(out)
    PICTURES.check(plot)
    parameters = given.rails()
    frequency = frequencies_of(frequencies)
    if then:
        aside = {direction, response or direction} != {Along.DOWN}
        others = {"--ring": ring, "--local": local, "--offset": offset, "--direction": aside}
        for option in (name for name, told in others.items() if told):
            raise UsageError(
                f"{option}: --then joins tracks without end, each equal all along, in the vertical "
                "model; leave one out"
            )
        line = line_of(parameters, str(given.track or PAPER), then)
        with progress("solving") as update:
            result = of.transition_receptance(
                line, frequency, position=_metres(position), both_rails=load is Load.BOTH,
                progress=update,
            )  # fmt: skip
        keep(result, out, f"{frequency.size} frequencies", plot, _chart)
        return
    with progress("solving") as update:
        result = of.track_receptance(
            parameters, frequency,
            direction=direction, response=response or direction, position=position, offset=offset,
            both_rails=load is Load.BOTH, ring=ring, progress=update,
            changes=[change_of(parameters, text) for text in local or ()],
        )  # fmt: skip
    if not np.any(result["receptance"]):
        plot = None
        console.print(
            "none: upright rails loaded in the middle of the head move up or down only by vertical "
            "loads, and only so; see --offset, and [slab] tilts_rails"
        )
    keep(result, out, f"{frequency.size} frequencies", plot, _chart)
    console.print(
        f"{of.ring_of(parameters)}: differs from the endless track, relative to it, by at most "
        f"{result.attrs['ring_error']:.1e}, at {result.attrs['ring_error_at']:g} Hz",
    )


def _metres(position: str) -> float:
    """A place along several tracks, whose railseats are not at the same."""
    try:
        return float(position)
    except ValueError:
        raise UsageError(
            f"--position {position}: must be in m along the track with --then, such as -0.3125"
        ) from None


def _chart(result: xr.Dataset) -> Chart:
    import numpy as np

    from railcosim.plots.results import receptance_chart

    found = result["receptance"]
    curve = {"receptance": (np.asarray(found["frequency"]), np.asarray(found))}
    return receptance_chart(curve, f"receptance ({found.attrs['units']})", result.attrs["title"])
