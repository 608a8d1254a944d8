"""railcosim receptance (of any FMU), railcosim track-receptance (of the finite elements)."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
import xarray as xr

from railcosim.master.files import save
from railcosim.master.fmu import FmuComponent
from railcosim.master.linearise import linearise
from railcosim.master.receptance import receptance as receptance_of
from railcosim.plots.picture import save_picture
from railcosim.plots.results import receptance_chart
from railcosim.track.cell import railseats
from railcosim.track.parameters import Track
from railcosim.track.receptance import Point, direct_receptance

from .options import (
    PICTURES,
    RESULTS,
    Frequencies,
    Out,
    PlotFile,
    TrackFile,
    UsageError,
    console,
    frequencies_of,
    positive,
    progress,
    track_of,
)


class Load(StrEnum):
    """On which rails a unit force acts."""

    BOTH = "both"
    SINGLE = "single"


def receptance(
    fmu: Annotated[Path, typer.Argument(help="Any co-simulation FMU that can save its state.")],
    input_: Annotated[str, typer.Option("--input", help="Input to excite.")],
    output: Annotated[str, typer.Option("--output", help="Output to observe.")],
    out: Out,
    frequencies: Frequencies = "1:1000:400@log",
    step: Annotated[
        float, typer.Option(help="Step, s: half its inverse above the FMU's highest frequency.")
    ] = 4.5e-5,
    steps: Annotated[int, typer.Option(help="Number of steps.")] = 33_000,
    amplitude: Annotated[float, typer.Option(help="Pulse height, in the input's unit.")] = 1e4,
    plot: PlotFile = None,
) -> None:
    """Frequency response of any FMU between two variables, from its response to a pulse."""
    RESULTS.check(out)
    PICTURES.check(plot)
    positive("--step", step, "s")
    frequency = frequencies_of(frequencies)
    with FmuComponent.load(fmu) as component, progress("pulses") as update:
        if not component.can_rollback:
            raise UsageError(f"{fmu}: cannot save and restore its state, which linearising needs")
        known = {v.name: v for v in (*component.inputs, *component.outputs)}
        _known("--input", input_, [v.name for v in component.inputs])
        _known("--output", output, [v.name for v in component.outputs])
        component.enter_initialization(0.0)
        component.exit_initialization()
        model = linearise(
            component,
            at=np.array([v.start for v in component.inputs]),
            amplitude=amplitude,
            step=step,
            steps=steps,
            inputs=[input_],
            outputs=[output],
            progress=update,
        )
    values = receptance_of(model, 2 * np.pi * frequency)[:, 0, 0]
    unit = f"{known[output].unit or '1'}/{known[input_].unit or '1'}"
    error = float(model.error_estimate.max())
    attributes = {"fmu": fmu.name, "input": input_, "output": output, "error_estimate": error}
    _keep(frequency, values, "receptance", unit, attributes, out, plot)
    console.print(f"estimated error: {error:.1e} of the highest peak", highlight=False)


def track_receptance(
    out: Out,
    track: TrackFile = None,
    at: Annotated[
        str, typer.Option(help="railseat, midspan, or metres from the beginning of a cell.")
    ] = "railseat",
    load: Annotated[
        Load, typer.Option(help="both: a unit force on each rail (the paper's); single: on one.")
    ] = Load.BOTH,
    frequencies: Frequencies = "1:2000:1",
    plot: PlotFile = None,
) -> None:
    """Driving-point receptance of the rail, straight from the finite elements."""
    RESULTS.check(out)
    PICTURES.check(plot)
    parameters = track_of(track)
    frequency = frequencies_of(frequencies)
    x = _place(parameters, at)
    here = Point(x=x)
    loads = [here, Point(x=x, side=1)] if load is Load.BOTH else [here]
    with progress("solving") as update:
        solved = direct_receptance(parameters, 2 * np.pi * frequency, loads, [here], update)
    values = solved[:, 0, :].sum(axis=1)
    attributes = {"at": f"{x:g} m from the beginning of a cell ({at})", "load": load.value}
    _keep(frequency, values, "receptance", "m/N", attributes, out, plot)


def _place(track: Track, at: str) -> float:
    seat = float(railseats(track)[track.bays // 2])
    named = {"railseat": seat, "midspan": seat + track.fastening.spacing / 2}
    if at in named:
        return named[at]
    try:
        x = float(at)
    except ValueError:
        x = np.nan
    if not 0 <= x <= track.length:
        raise UsageError(f"--at {at}: must be railseat, midspan or 0 to {track.length:g} m")
    return x


def _known(option: str, name: str, allowed: list[str]) -> None:
    if name not in allowed:
        raise UsageError(f"{option} {name}: not in the FMU, which has {', '.join(allowed)}")


def _keep(
    frequency: np.ndarray,
    values: np.ndarray,
    name: str,
    unit: str,
    attributes: Mapping[str, object],
    out: Path,
    plot: Path | None,
) -> None:
    """Save, and draw if wanted."""
    axis = ("frequency", frequency, {"units": "Hz", "long_name": "frequency"})
    column = ("frequency", values, {"units": unit, "long_name": name})
    save(xr.Dataset({name: column}, {"frequency": axis}, attributes), out)
    console.print(f"{out}: {frequency.size} frequencies", highlight=False)
    if plot is not None:
        title = ", ".join(f"{v}" for k, v in attributes.items() if k != "error_estimate")
        chart = receptance_chart({name: (frequency, values)}, f"{name} ({unit})", title)
        save_picture(chart, plot)
        console.print(str(plot), highlight=False)
