"""railcosim map."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from railcosim.track.irregularity.quantities import QUANTITIES

from .option_types import Out, PlotFile
from .options import LIMITS, UsageError, grid_of, speed_of
from .progress import progress
from .results import PICTURES, Suffixes, keep
from .sensor_options import ObservedMeeting
from .terminal import console

if TYPE_CHECKING:
    import xarray as xr

    from railcosim.analysis.response.critical import Critical
    from railcosim.analysis.response.map import CriticalSpeed
    from railcosim.master.component import FloatArray
    from railcosim.plots.chart import Chart


FILES = Suffixes("--out", (".nc",))


def map_command(
    out: Out,
    pair: ObservedMeeting,
    irregularity: Annotated[
        str,
        typer.Option(
            "--input",
            help=f"Which irregularity: {', '.join(QUANTITIES)}; all but the first in space.",
        ),
    ] = "vertical",
    wavelengths: Annotated[
        str, typer.Option(help="start:stop:step in m, or start:stop:N@log.")
    ] = "0.1:60:0.15",
    speeds: Annotated[
        str, typer.Option(help="start:stop:step in km/h, or start:stop:N@log.")
    ] = "10:400:1",
    plot: PlotFile = None,
    show: Annotated[
        str | None,
        typer.Option(
            help="Which response to draw, on flexible and on rigid track; of the car body, down or "
            "aside, if not given."
        ),
    ] = None,
) -> None:
    """Responses to irregularity over its wavelength and the speed, on flexible and rigid track.

    Every wheelset meets the irregularity with its lag. Prints the critical speeds of the car body:
    where the wavelength suits the distance of the bogies and speed over wavelength a resonance.
    In space every speed is solved for by itself, for wheels roll at it.
    """
    from railcosim.analysis.pair.sensors import outputs_of_sensors
    from railcosim.analysis.response.excitation import check_irregularity
    from railcosim.analysis.response.map import names_of, response_map

    FILES.check(out)
    PICTURES.check(plot)
    arguments = pair.arguments()
    wavelength, speed = _plane(wavelengths, speeds)
    check_irregularity(irregularity, in_space=pair.in_space)
    names, shown = names_of(in_space=pair.in_space), show or _moved(irregularity)
    if shown not in names and not pair.may_have_sensors:
        raise UsageError(f"--show {shown}: must be one of {', '.join(names)}")
    with pair.files() as (vehicle, track), progress("linearising") as update:
        names += outputs_of_sensors(track)
        if shown not in names:
            raise UsageError(f"--show {shown}: must be one of {', '.join(names)}")
        found = response_map(
            vehicle, track, wavelength, speed, irregularity=irregularity, progress=update,
            **arguments,
        )  # fmt: skip
    if found.critical:
        console.print(_table(found.critical))
    told = f"{wavelength.size} wavelengths, {speed.size} speeds"
    critical = {kind: found.critical_on(kind) for kind in ("flexible", "rigid")}
    keep(found.dataset, out, told, plot, partial(_chart, show=shown, critical=critical))


def _moved(irregularity: str) -> str:
    """What of the car body an irregularity moves."""
    from railcosim.analysis.response.excitation import is_mirrored

    return "carbody.z" if is_mirrored(irregularity) else "carbody.y"


def _plane(wavelengths: str, speeds: str) -> tuple[FloatArray, FloatArray]:
    """Wavelengths (m) and speeds (m/s) whose frequencies have limits, and that memory can hold."""
    from railcosim.analysis.response.map import afford_map

    wavelength = grid_of("--wavelengths", wavelengths, "m")
    kmh = grid_of("--speeds", speeds, "km/h")
    speed_of(float(kmh[-1]), "--speeds")  # the highest: a grid may begin at a walk
    speed = kmh / 3.6
    ends = float(speed[0] / wavelength[-1]), float(speed[-1] / wavelength[0])
    least, most = LIMITS["--frequencies"]
    if not least <= ends[0] <= ends[1] <= most:
        raise UsageError(
            f"--speeds {speeds} over --wavelengths {wavelengths}: are {ends[0]:g} to {ends[1]:g} "
            f"Hz; they must be from {least:g} to {most:g} Hz"
        )
    afford_map(wavelength.size, speed.size)
    return wavelength, speed


def _table(critical: list[CriticalSpeed]) -> Table:
    table = Table(title="Critical speeds of the car body; response per m of irregularity")
    for heading in ("mode", "n", "at (m)", "track", "Hz", "km/h", "per m"):
        table.add_column(heading, justify="left" if heading in ("mode", "track") else "right")
    for found in critical:
        p = found.point
        size = "outside" if math.isnan(found.response) else f"{found.response:.3g}"
        row = (p.mode, str(p.order), f"{p.wavelength:.2f}", found.track, f"{p.frequency:.3f}",
               f"{3.6 * p.speed:.1f}", size)  # fmt: skip
        table.add_row(*row)
    return table


def _chart(result: xr.Dataset, show: str, critical: dict[str, list[Critical]]) -> Chart:
    import numpy as np

    from railcosim.analysis.response.map import MODES
    from railcosim.plots.chart import Chart, Curve, Map, Mark
    from railcosim.plots.names import words_of

    wavelength, speed = (np.asarray(result[axis]) for axis in ("wavelength", "speed"))
    words = ", ".join(words_of(show) or (show,))
    modes = {name: mode for mode, name in MODES.items()}
    panels = []
    for kind, name in (("flexible", show), ("rigid", f"{show}.rigid")):
        if name not in result:
            continue
        points = [
            p for p in critical[kind] if p.mode == modes.get(show) and np.isfinite(p.frequency)
        ]
        curves = []
        if points:
            y = 3.6 * wavelength * points[0].frequency
            inside = (y >= 3.6 * speed[0]) & (y <= 3.6 * speed[-1])
            label = f"{points[0].frequency:.2f} Hz"
            if inside.any():
                curves = [Curve(name=label, x=wavelength[inside], y=y[inside])]
        panels.append(
            Map(
                x=wavelength,
                y=3.6 * speed,
                z=np.abs(np.asarray(result[name])).T,
                x_label="wavelength (m)",
                y_label="speed (km/h)",
                z_label=f"|{words}| ({result[name].attrs['units']})",
                curves=tuple(curves),
                marks=tuple(
                    Mark(label=f"n = {p.order}", x=p.wavelength, y=3.6 * p.speed)
                    for p in points
                    if speed[0] <= p.speed <= speed[-1]
                    and wavelength[0] <= p.wavelength
                    and p.wavelength <= wavelength[-1]
                ),
                title=f"{kind} track",
            )
        )
    return Chart(title=f"{words}, per m of irregularity", rows=tuple((panel,) for panel in panels))
