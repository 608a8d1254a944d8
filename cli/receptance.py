"""railcosim receptance (of any FMU), railcosim track-receptance (of the finite elements)."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
import xarray as xr

from railcosim.master.linear.linear_fmu import DIFFERENCES, EXACT, Pulses, Wanted, Way, best_way
from railcosim.master.linear.linear_form import error_estimate
from railcosim.plots.results import receptance_chart
from railcosim.track.cell import railseats
from railcosim.track.parameters import Track
from railcosim.track.receptance import Point, direct_receptance, infinite_receptance

from .options import (
    Frequencies,
    Out,
    PlotFile,
    TrackFile,
    UsageError,
    check_finite,
    console,
    frequencies_of,
    positive,
    progress,
    track_of,
)
from .results import PICTURES, RESULTS, keep

ANY = 1e-12, 1e12  # Hz: an FMU may be of any field


class Load(StrEnum):
    """On which rails a unit force acts."""

    BOTH = "both"
    SINGLE = "single"


class Method(StrEnum):
    """How an FMU is linearised."""

    BEST = "best"
    EXACT = "exact"
    DIFFERENCES = "differences"
    PULSES = "pulses"


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
    amplitude: Annotated[float, typer.Option(help="Pulse height, in the input's unit.")] = 1e4,
    plot: PlotFile = None,
) -> None:
    """Frequency response of any FMU between two variables, from a linear model of it."""
    RESULTS.check(out)
    PICTURES.check(plot)
    positive("--step", step, "s")
    positive("--amplitude", amplitude, "of the input's unit")
    frequency = frequencies_of(frequencies, ANY)
    omega = 2 * np.pi * frequency
    pulses = Pulses(amplitude=amplitude, step=step, steps=steps)
    ways: dict[Method, Way] = {
        Method.EXACT: EXACT,
        Method.DIFFERENCES: DIFFERENCES,
        Method.PULSES: pulses,
    }
    way = ways.get(method) or best_way(fmu, pulses)
    if way is pulses and frequency.max() > 0.5 / step:
        raise UsageError(
            f"--frequencies up to {frequency.max():g} Hz: pulses with --step {step:g} show up to "
            f"{0.5 / step:g} Hz; make the step smaller"
        )
    with progress(f"linearising ({way.description})") as update:
        model = way(fmu, fmu.stem, Wanted(inputs=[input_], outputs=[output]), update)
    values = model.frequency_response(omega)[:, 0, 0]
    error = float(error_estimate(model, omega).max())
    if error > 1.0:
        raise ArithmeticError(
            f"{way.description}: the response is known to {error:.1e} of itself only, so nothing "
            "is written; take another --method, --step, --steps or --amplitude"
        )
    unit = f"{model.outputs[0].unit or '1'}/{model.inputs[0].unit or '1'}"
    attributes = {
        "fmu": fmu.name, "input": input_, "output": output,
        "method": way.description, "error_estimate": error,
    }  # fmt: skip
    _keep(frequency, values, "receptance", unit, attributes, out, plot)
    known = f"estimated error {error:.1e}" if error else "exact but for rounding"
    console.print(f"{way.description}: {known}")


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
    ring: Annotated[
        bool, typer.Option("--ring", help="Of the ring of mesh.cells cells that the FMUs have.")
    ] = False,
    plot: PlotFile = None,
) -> None:
    """Driving-point receptance of the rail on a track without end, from the finite elements.

    Says by how much the ring of cells in the FMUs differs.
    """
    RESULTS.check(out)
    PICTURES.check(plot)
    parameters = track_of(track)
    frequency = frequencies_of(frequencies)
    x = _place(parameters, at)
    here = Point(x=x)
    loads = [here, Point(x=x, side=1)] if load is Load.BOTH else [here]
    solved = []
    for name, receptance_of in (("endless", infinite_receptance), ("ring", direct_receptance)):
        with progress(f"solving ({name})") as update:
            found = receptance_of(parameters, 2 * np.pi * frequency, loads, [here], update)
        solved.append(found[:, 0, :].sum(axis=1))
    endless, round_ = solved
    error = np.abs(round_ / endless - 1)
    worst = int(np.argmax(error))
    about = f"ring of {parameters.mesh.cells} cells, {parameters.length:g} m"
    attributes = {
        "at": f"{x:g} m from the beginning of a cell ({at})",
        "load": load.value,
        "track": about if ring else "endless",
        "ring_error": float(error[worst]),
        "ring_error_at": float(frequency[worst]),
    }
    _keep(frequency, round_ if ring else endless, "receptance", "m/N", attributes, out, plot)
    console.print(
        f"{about}: differs from the endless track by at most {error[worst]:.1e}, at "
        f"{frequency[worst]:g} Hz",
        highlight=False,
        soft_wrap=True,
    )


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
    check_finite(frequency, values)
    axis = ("frequency", frequency, {"units": "Hz", "long_name": "frequency"})
    column = ("frequency", values, {"units": unit, "long_name": name})
    title = ", ".join(
        str(v) for k, v in attributes.items() if not k.startswith(("error", "method", "ring"))
    )
    keep(
        xr.Dataset({name: column}, {"frequency": axis}, attributes),
        out,
        f"{frequency.size} frequencies",
        plot,
        lambda _: receptance_chart({name: (frequency, values)}, f"{name} ({unit})", title),
    )
