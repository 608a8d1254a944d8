"""Figures 7 to 12 and 14 to 17: responses over the plane of wavelength and speed."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np
import xarray as xr

from railcosim.analysis.response.critical import Critical, critical_points
from railcosim.analysis.response.plane import Transfer, plane, plane_dataset, transfer
from railcosim.analysis.response.resonance import resonance
from railcosim.master.component import FloatArray
from railcosim.plots.chart import Chart, Curve, Map, Mark, Panel

from .figure import FORCE, Figure, peak, sizes
from .finding import Finding
from .laboratory import K_H, Laboratory

SPEEDS = (10 / 3.6, 400 / 3.6)  # m/s
WAVELENGTHS = (0.1, 60.0)  # m, over all figures
VEHICLE = {
    7: ("car body bounce", "vehicle.carbody.z", "m", 20.0, 140 / 3.6, (15.7, 7.85)),
    8: ("car body pitch", "vehicle.carbody.pitch", "rad", 60.0, 400 / 3.6, (31.4, 10.47)),
}
MODES = {7: "car body bounce", 8: "car body pitch"}
PAPER_CRITICAL = {7: (40.0, 15.7), 8: (106.6, 31.8)}  # km/h and m, n = 1
WHEELS = {
    **{8 + i: (f"wheelset {i}", f"vehicle.wheelset[{i}].left.wheel_z") for i in (1, 2, 3, 4)},
    **{
        13 + i: (f"rail under wheelset {i}", f"track.wheelset[{i}].left.rail_z")
        for i in (1, 2, 3, 4)
    },
}
SLICE = 2.0  # m, the wavelength of the slices of figures 9 to 12 and 14 to 17
LONGEST = 5.0  # m, on the same figures
OUTPUTS = (*(row[1] for row in VEHICLE.values()), *(row[1] for row in WHEELS.values()))
FINE = 2000  # speeds of a slice


@lru_cache(maxsize=4)  # ten figures share two tables
def _table(lab: Laboratory, *, rigid: bool) -> Transfer:
    outputs = [o for o in OUTPUTS if not (rigid and o.startswith("track."))]
    system = lab.rigid() if rigid else lab.coupled()
    return transfer(system, outputs, SPEEDS[0] / WAVELENGTHS[1], SPEEDS[1] / WAVELENGTHS[0])


def _over(
    lab: Laboratory, output: str, wavelength: FloatArray, speed: FloatArray, *, rigid: bool = False
) -> FloatArray:
    """Magnitude per k_H A, shape (n_wavelength, n_speed)."""
    table = _table(lab, rigid=rigid)
    values = plane(table, lab.positions, wavelength, speed)[table.outputs.index(output)]
    size: FloatArray = np.abs(values) / K_H
    return size


def resonances(lab: Laboratory) -> tuple[float, float, float]:
    """Car body bounce and pitch, wheel on track: Hz, from the response to wheelset 4."""
    frequency = lab.frequencies(0.3, 80.0)
    outputs = ["vehicle.carbody.z", "vehicle.carbody.pitch", "vehicle.wheelset[4].left.wheel_z"]
    size = sizes(lab.coupled()(2 * np.pi * frequency), FORCE, lab.positions, outputs)
    windows = ((0.4, 1.2), (0.5, 1.4), (20, 60))
    bounce, pitch, wheel = (
        peak(frequency, s, *window) for s, window in zip(size, windows, strict=True)
    )
    return bounce, pitch, wheel


def figure_body(lab: Laboratory, number: int) -> Figure:
    """Figure 7 or 8: car body, with the critical points of eqs 21 and 22."""
    name, output, unit, longest, fastest, slices = VEHICLE[number]
    bounce, pitch, _ = resonances(lab)
    frequency = {7: bounce, 8: pitch}[number]
    points = [
        point
        for point in critical_points(lab.positions, bounce, pitch, (1, 2, 3))
        if point.mode == MODES[number] and point.wavelength <= longest
    ]
    wavelength = np.linspace(WAVELENGTHS[0], longest, lab.effort.points)
    speed = np.linspace(SPEEDS[0], fastest, lab.effort.points)
    size = _over(lab, output, wavelength, speed)
    chart = Chart(
        title=f"Figure {number}: {name} over wavelength and speed",
        rows=(
            (_map(name, unit, wavelength, speed, size, frequency, points),),
            tuple(_slice(lab, output, unit, wave, fastest, frequency) for wave in slices),
        ),
    )
    first = points[0]
    return Figure(
        number=number,
        title=f"{name.capitalize()} over wavelength and speed",
        text=f"The car body answers along the line where speed over wavelength is its resonance, "
        f"{frequency:.3f} Hz, and most where the wavelength also suits the bogies: first at "
        f"{first.wavelength:.1f} m and {3.6 * first.speed:.1f} km/h.",
        chart=chart,
        data=_dataset(lab, output, unit, wavelength, speed),
        findings=(*_critical(lab, number, output, points, size, wavelength, speed),),
    )


def _critical(
    lab: Laboratory,
    number: int,
    output: str,
    points: list[Critical],
    size: FloatArray,
    wavelength: FloatArray,
    speed: FloatArray,
) -> list[Finding]:
    """Critical speeds by the equations, and where the map itself is highest."""
    paper_speed, paper_wave = PAPER_CRITICAL[number]
    rows = []
    for point in points:
        along = np.linspace(0.7, 1.3, FINE) * point.speed
        for track, rigid in (("flexible", False), ("rigid", True)):
            values = _over(lab, output, np.array([point.wavelength]), along, rigid=rigid)[0]
            found = 3.6 * resonance(along, values)
            is_first = point.order == 1
            rows.append(
                Finding(
                    figure=str(number),
                    quantity=f"critical speed, {point.mode}, n = {point.order}, {track} track",
                    paper=paper_speed if is_first else "plotted, not printed",
                    ours=found,
                    unit="km/h",
                    agrees=abs(found / paper_speed - 1) < 0.05 if is_first else None,
                    note=f"largest on the map at {point.wavelength:.2f} m; eq. 20 with "
                    f"{point.frequency:.3f} Hz gives {3.6 * point.speed:.1f} km/h",
                )
            )
    wave = points[0].wavelength
    rows.append(
        Finding(figure=str(number), quantity="critical wavelength, n = 1", paper=paper_wave,
                ours=wave, unit="m", agrees=abs(wave / paper_wave - 1) < 0.005,
                note="" if number == 7 else "twice 15.7 m is 31.4 m; the paper prints 31.8 m")
    )  # fmt: skip
    row, column = np.unravel_index(np.argmax(size), size.shape)
    at = 3.6 * speed[column]
    rows.append(
        Finding(figure=str(number), quantity="speed where the map is highest", paper=paper_speed,
                ours=float(at), unit="km/h", agrees=bool(abs(at / paper_speed - 1) < 0.1),
                note=f"at a wavelength of {wavelength[row]:.1f} m; n = 1 is the highest")
    )  # fmt: skip
    return rows


def figure_wheel(lab: Laboratory, number: int) -> Figure:
    """Figure 9 to 12 or 14 to 17: a wheelset, or the rail under it."""
    name, output = WHEELS[number]
    *_, wheel = resonances(lab)
    wavelength = np.linspace(WAVELENGTHS[0], LONGEST, lab.effort.points)
    speed = np.linspace(*SPEEDS, lab.effort.points)
    size = _over(lab, output, wavelength, speed)
    along = np.linspace(*SPEEDS, FINE)
    values = _over(lab, output, np.array([SLICE]), along)[0]
    inside = (along / SLICE > 20) & (along / SLICE < 55)
    found = resonance(along[inside], values[inside]) / SLICE
    paper = 32.7 if number <= 12 else 33.0
    finding = Finding(
        figure=str(number), quantity=f"{name}: speed over wavelength at the peak, 2 m",
        paper=paper, ours=found, unit="Hz", agrees=abs(found / paper - 1) < 0.1,
        note="the wheels' phases shift the peak a little" if abs(found / wheel - 1) > 0.01 else "",
    )  # fmt: skip
    return Figure(
        number=number,
        title=f"{name.capitalize()} over wavelength and speed",
        text=f"The bright band is where speed over wavelength is the resonance of the wheels on "
        f"the track, {wheel:.1f} Hz; at 2 m it is met at {3.6 * found * SLICE:.0f} km/h. The "
        "stripes across it are the phases between the wheels.",
        chart=Chart(
            title=f"Figure {number}: {name}",
            rows=(
                (
                    _map(name, "m", wavelength, speed, size, wheel, []),
                    _slice(lab, output, "m", SLICE, SPEEDS[1], wheel),
                ),
            ),
        ),
        data=_dataset(lab, output, "m", wavelength, speed),
        findings=(finding,),
    )


def _map(
    name: str,
    unit: str,
    wavelength: FloatArray,
    speed: FloatArray,
    size: FloatArray,
    frequency: float,
    points: list[Critical],
) -> Map:
    inside = (wavelength * frequency > speed[0]) & (wavelength * frequency < speed[-1])
    line = Curve(
        name=f"{frequency:.2f} Hz", x=wavelength[inside], y=3.6 * wavelength[inside] * frequency
    )
    return Map(
        x=wavelength, y=3.6 * speed, z=size.T, x_label="wavelength (m)", y_label="speed (km/h)",
        z_label=f"|{name}| ({unit} per N of k_H A)", curves=(line,),
        marks=tuple(
            Mark(label=f"n = {p.order}", x=p.wavelength, y=3.6 * p.speed) for p in points
        ),
    )  # fmt: skip


def _slice(
    lab: Laboratory,
    output: str,
    unit: str,
    wave: float,
    fastest: float,
    frequency: float,
) -> Panel:
    """Response against speed at one wavelength, with speed over wavelength on top."""
    speed = np.linspace(SPEEDS[0], fastest, FINE)
    curves = [Curve(name="flexible track", x=3.6 * speed,
                    y=_over(lab, output, np.array([wave]), speed)[0])]  # fmt: skip
    if not output.startswith("track."):
        rigid = _over(lab, output, np.array([wave]), speed, rigid=True)[0]
        curves.append(Curve(name="rigid track", x=3.6 * speed, y=rigid, dashed=True))
    return Panel(
        x_label="speed (km/h)", y_label=f"|response| ({unit} per N of k_H A)", curves=tuple(curves),
        marks=(Mark(label=f"{frequency:.2f} Hz", x=3.6 * wave * frequency),), y_log=True,
        x_range=(3.6 * SPEEDS[0], 3.6 * fastest),
        second_x=("speed over wavelength (Hz)", 1 / (3.6 * wave)), title=f"wavelength {wave:g} m",
    )  # fmt: skip


def _dataset(
    lab: Laboratory, output: str, unit: str, wavelength: FloatArray, speed: FloatArray
) -> xr.Dataset:
    """Rigid and flexible track, complex, per m of irregularity."""
    parts: dict[str, xr.DataArray] = {}
    for track, rigid in (("flexible", False), ("rigid", True)):
        table = _table(lab, rigid=rigid)
        if output in table.outputs:
            chosen = table.only(output)
            part = plane_dataset(chosen, lab.positions, wavelength, speed, [unit])
            parts |= {f"{name}_{track}": part[name] for name in part}
    return xr.Dataset(parts, attrs={"contact_stiffness": K_H, "excitation": "irregularity_z"})


FIGURES: dict[int, Callable[[Laboratory], Figure]] = {
    **{n: partial(figure_body, number=n) for n in VEHICLE},
    **{n: partial(figure_wheel, number=n) for n in WHEELS},
}
