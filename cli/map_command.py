"""railcosim map."""

from __future__ import annotations

import warnings
from functools import partial
from typing import Annotated

import numpy as np
import typer
import xarray as xr
from rich.table import Table

from railcosim.analysis.critical import Critical, critical_points
from railcosim.analysis.frequency import Models, coupled, linear_models, on_rigid_track
from railcosim.analysis.memory import afford
from railcosim.analysis.plane import Transfer, plane, plane_dataset, transfer
from railcosim.analysis.resonance import resonance
from railcosim.master.component import FloatArray
from railcosim.plots.chart import Chart, Curve, Map, Mark

from .fmus import FreshOption, fmus_of
from .options import (
    LIMITS,
    ContactStiffness,
    Out,
    PlotFile,
    TrackFmu,
    UsageError,
    VehicleFmu,
    console,
    grid_of,
    progress,
    stiffness_of,
)
from .results import PICTURES, Suffixes, keep

VEHICLE = ["carbody.z", "carbody.pitch", "bogie[1].z", "bogie[1].pitch", "bogie[2].z",
           "bogie[2].pitch"]  # fmt: skip
WHEELSETS = [f"wheelset[{i}].left" for i in (1, 2, 3, 4)]
MODES = ("carbody.z", "carbody.pitch")
# Hz and points: where a car body may stand on its springs. What it does is largest at its own
# resonance, whatever the vehicle; those of the bogies below it are a fraction of that.
RANGE = (0.05, 20.0, 800)
ORDERS = (1, 2, 3)
FILES = Suffixes("--out", (".nc",))
MARGIN = 1e-3  # of the ends of the table, which may be one frequency
BYTES = 48  # for each value: complex, and both its parts as they are written


def map_command(
    out: Out,
    vehicle_fmu: VehicleFmu = None,
    track_fmu: TrackFmu = None,
    fresh: FreshOption = False,
    wavelengths: Annotated[
        str, typer.Option(help="start:stop:step in m, or start:stop:N@log.")
    ] = "0.1:60:0.15",
    speeds: Annotated[
        str, typer.Option(help="start:stop:step in km/h, or start:stop:N@log.")
    ] = "10:400:1",
    contact_stiffness: ContactStiffness = "1e9",
    plot: PlotFile = None,
    show: Annotated[
        str, typer.Option(help="Which response to draw, on flexible and on rigid track.")
    ] = "carbody.z",
) -> None:
    """Responses to irregularity over its wavelength and the speed, on flexible and rigid track.

    Every wheelset meets the irregularity with its lag. Prints the critical speeds of the car body:
    where the wavelength suits the distance of the bogies and speed over wavelength a resonance.
    """
    FILES.check(out)
    PICTURES.check(plot)
    k_H = stiffness_of(contact_stiffness)
    wavelength = grid_of("--wavelengths", wavelengths, "m")
    speed = grid_of("--speeds", speeds, "km/h") / 3.6
    outputs = [*(f"vehicle.{name}" for name in VEHICLE),
               *(f"vehicle.{w}.wheel_z" for w in WHEELSETS),
               *(f"track.{w}.rail_z" for w in WHEELSETS)]  # fmt: skip
    names = [name.partition(".")[2] for name in outputs]
    ends = float(speed[0] / wavelength[-1]), float(speed[-1] / wavelength[0])
    least, most = LIMITS["--frequencies"]
    if not least <= ends[0] <= ends[1] <= most:
        raise UsageError(
            f"--speeds {speeds} over --wavelengths {wavelengths}: are {ends[0]:g} to {ends[1]:g} "
            f"Hz; they must be from {least:g} to {most:g} Hz"
        )
    afford(
        BYTES * (len(outputs) + len(VEHICLE) + len(WHEELSETS)) * wavelength.size * speed.size,
        f"{wavelength.size} wavelengths at {speed.size} speeds",
        "take fewer --wavelengths or --speeds",
    )
    if show not in names:
        raise UsageError(f"--show {show}: must be one of {', '.join(names)}")
    with (
        fmus_of(vehicle_fmu, track_fmu, fresh=fresh) as (vehicle, track),
        progress("linearising") as update,
    ):
        models = linear_models(vehicle, track, update)
    span = ends[0] * (1 - MARGIN), ends[1] * (1 + MARGIN)
    on_track = [o for o in outputs if o.startswith("vehicle.")]
    tables = {
        "flexible": transfer(lambda w: coupled(models, w, k_H), outputs, *span),
        "rigid": transfer(lambda w: on_rigid_track(models, w, k_H), on_track, *span),
    }
    result = _dataset(tables, models, wavelength, speed, contact_stiffness=k_H)
    critical = {kind: _critical(models, kind, k_H) for kind in tables}
    console.print(_table(critical, tables, models))
    told = f"{wavelength.size} wavelengths, {speed.size} speeds"
    keep(result, out, told, plot, partial(_chart, show=show, critical=critical))


def _dataset(
    tables: dict[str, Transfer],
    models: Models,
    wavelength: FloatArray,
    speed: FloatArray,
    **attributes: object,
) -> xr.Dataset:
    """Variables ``name`` on flexible track and ``name.rigid`` on rigid track."""
    parts: dict[str, xr.DataArray] = {}
    for kind, table in tables.items():
        units = ["rad" if o.endswith("pitch") else "m" for o in table.outputs]
        part = plane_dataset(table, models.positions, wavelength, speed, units)
        suffix = "" if kind == "flexible" else ".rigid"
        parts |= {f"{name}{suffix}": part[name] for name in part}
    return xr.Dataset(parts, attrs={**models.attributes, **attributes})


def _critical(models: Models, kind: str, k_H: float) -> list[Critical]:
    """Critical points with the resonances of this track, from the response to a wheelset."""
    found = []
    frequency = np.geomspace(*RANGE)
    omega = 2 * np.pi * frequency
    rigid = kind == "rigid"
    system = on_rigid_track(models, omega, k_H) if rigid else coupled(models, omega, k_H)
    values = system.combined([f"{WHEELSETS[3]}.gap"], [1.0])
    for name in MODES:
        found.append(resonance(frequency, np.abs(values[:, system.rows([f"vehicle.{name}"])[0]])))
        if found[-1] in frequency[[0, -1]]:
            warnings.warn(
                f"{name} on {kind} track has no resonance between {RANGE[0]:g} and {RANGE[1]:g} Hz,"
                " so no critical speed is known of it", stacklevel=2,
            )  # fmt: skip
            found[-1] = np.nan
    bounce, pitch = found
    return critical_points(models.positions, bounce, pitch, ORDERS)


def _table(
    critical: dict[str, list[Critical]], tables: dict[str, Transfer], models: Models
) -> Table:
    table = Table(title="Critical speeds of the car body; response per m of irregularity")
    for heading in ("mode", "n", "at (m)", "track", "Hz", "km/h", "per m"):
        table.add_column(heading, justify="left" if heading in ("mode", "track") else "right")
    outputs = {"car body bounce": "vehicle.carbody.z", "car body pitch": "vehicle.carbody.pitch"}
    for kind, points in critical.items():
        for p in points:
            one = tables[kind].only(outputs[p.mode])
            low, high = np.exp(one.spline.x[[0, -1]])
            size = "outside"
            if low <= p.frequency <= high:
                at = np.array([p.wavelength]), np.array([p.speed])
                size = f"{abs(plane(one, models.positions, *at)[0, 0, 0]):.3g}"
            row = (p.mode, str(p.order), f"{p.wavelength:.2f}", kind, f"{p.frequency:.3f}",
                   f"{3.6 * p.speed:.1f}", size)  # fmt: skip
            table.add_row(*row)
    return table


def _chart(result: xr.Dataset, show: str, critical: dict[str, list[Critical]]) -> Chart:
    wavelength, speed = (np.asarray(result[axis]) for axis in ("wavelength", "speed"))
    modes = {"carbody.z": "car body bounce", "carbody.pitch": "car body pitch"}
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
                z_label=f"{show} ({result[name].attrs['units']})",
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
    return Chart(title=f"{show} per m of irregularity", rows=tuple((panel,) for panel in panels))
