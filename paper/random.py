"""Figure 3: random response, nonlinear runs in time against the linear frequency domain."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from railcosim.analysis.response.estimate import band_difference, band_error, welch_psd
from railcosim.analysis.response.random import acceleration_psd, response_psd
from railcosim.master.component import FloatArray
from railcosim.plots.chart import Chart, Curve, Panel
from railcosim.track.irregularity import QUALITIES
from railcosim.track.parameters import Fastening

from .figure import Figure
from .finding import Finding
from .laboratory import (
    SPECTRUM,
    SPEED,
    STEP,
    STIFFNESSES,
    WAVELENGTHS,
    Laboratory,
)

FORCE = "wheelset[1].left.force_z"
QUANTITIES = {
    "car body acceleration": ("vehicle.carbody.z", "carbody.az", "m/s²", "(m/s²)²/Hz"),
    "wheel-rail force": (FORCE, FORCE, "N", "N²/Hz"),
}
BAND = (SPEED / WAVELENGTHS[1], SPEED / WAVELENGTHS[0])  # Hz, where the irregularity is
COMPARED = (1.0, 300.0)  # Hz; third octaves wholly inside the irregularity's band
DYNAMIC = 4.0  # s; segments of Welch's estimate, 0.25 Hz apart
PASSING = SPEED / Fastening().spacing  # Hz
LARGE = 3.0  # dB: a factor of two in power, what an eye calls a large difference


def figure_3(lab: Laboratory) -> Figure:
    """Time against frequency domain at 250 km/h, three contact stiffnesses."""
    frequency = np.geomspace(*BAND, 10 * lab.effort.points)
    linear = {k: _linear(lab, frequency, k) for k in STIFFNESSES}
    segment = min(DYNAMIC, lab.effort.duration - lab.effort.settling)
    timed = {key: _timed(lab, *key, segment) for key in _cases(lab)}
    findings: list[Finding] = []
    bands = {}
    for quantity in QUANTITIES:
        for key, (f, psds, count) in timed.items():
            differences = band_difference(f, psds[quantity], frequency, linear[key[0]][quantity])
            inside = (differences[0] > COMPARED[0]) & (differences[0] < COMPARED[1])
            centres, decibel = (x[inside] for x in differences)
            bands[quantity, key] = (centres, decibel)
            findings.append(_finding(quantity, key, centres, decibel, count, segment))
    worst = {
        k: float(np.median([np.abs(bands[q, (k, False)][1]).mean() for q in QUANTITIES]))
        for k in STIFFNESSES
    }
    return Figure(
        number=3,
        title="Random response: time domain against frequency domain",
        text="Car body acceleration and contact force at 250 km/h over irregularity of the class "
        f"'{SPECTRUM}' (the paper does not name its spectrum). The nonlinear runs differ from the "
        "linear frequency domain by "
        + ", ".join(f"{worst[k]:.1f} dB at {k / 1e9:g} GN/m" for k in STIFFNESSES)
        + " in the mean over third octaves. A softer contact is not further from linear: what "
        "counts is the dynamic force against the static one, and a soft contact lowers it. Wheels "
        f"that roll also pass a fastening {PASSING:.0f} times a second, which no linear response "
        "at a fixed place knows.",
        chart=_chart(frequency, linear, timed, bands),
        data=_data(frequency, linear, timed, bands),
        findings=tuple(findings),
    )


def _cases(lab: Laboratory) -> list[tuple[float, bool]]:
    """Contact stiffness, and whether wheels roll."""
    return list(dict.fromkeys((run.k_H, run.rolling) for run in lab.runs))


def _linear(lab: Laboratory, frequency: FloatArray, k_H: float) -> dict[str, FloatArray]:
    """Densities by pseudo-excitation."""
    omega = 2 * np.pi * frequency
    system = lab.coupled(k_H)(omega)
    psd = response_psd(
        system, lab.positions, SPEED, {"vertical": QUALITIES[SPECTRUM].vertical.density}
    )
    columns = {q: psd[:, system.rows([names[0]])[0]] for q, names in QUANTITIES.items()}
    columns["car body acceleration"] = acceleration_psd(omega, columns["car body acceleration"])
    return columns


def _timed(
    lab: Laboratory, k_H: float, rolling: bool, segment: float
) -> tuple[FloatArray, dict[str, FloatArray], float]:
    """Welch's estimate, averaged over seeds: Hz, densities by quantity, number of averages."""
    psds: dict[str, list[FloatArray]] = {q: [] for q in QUANTITIES}
    averages, frequency = 0.0, np.empty(0)
    for run, recorded in lab.runs.items():
        if (run.k_H, run.rolling) == (k_H, rolling):
            settled = recorded.sel(time=slice(lab.effort.settling, None))
            for quantity, names in QUANTITIES.items():
                frequency, psd, count = welch_psd(settled[names[1]].values, STEP, segment)
                psds[quantity].append(psd)
            averages += count
    return frequency, {q: np.mean(found, axis=0) for q, found in psds.items()}, averages


def _finding(
    quantity: str,
    key: tuple[float, bool],
    centres: FloatArray,
    decibel: FloatArray,
    averages: float,
    segment: float,
) -> Finding:
    k_H, rolling = key
    error = band_error(centres, segment, averages)
    soft = k_H == min(STIFFNESSES)
    mean = float(np.abs(decibel).mean())
    large = mean > LARGE
    k = int(np.argmax(np.abs(decibel) / error))
    return Finding(
        figure="3",
        quantity=f"{quantity}, time against frequency, {k_H / 1e9:g} GN/m"
        + (", wheels roll" if rolling else ""),
        paper="large difference" if soft else "similar",
        ours=mean,
        unit="dB",
        agrees=large == soft,
        note=("a soft contact lowers the dynamic force, so it is less nonlinear; " if soft else "")
        + f"mean size of the difference over third octaves {centres[0]:.2g}-{centres[-1]:.3g} "
        f"Hz, of which {np.sqrt((error**2).mean()):.1f} dB are the scatter of the estimate; "
        f"furthest beyond it at {centres[k]:.3g} Hz: {decibel[k]:+.1f} dB",
    )


def _label(key: tuple[float, bool]) -> str:
    return f"time, {key[0] / 1e9:g} GN/m" + (", wheels roll" if key[1] else "")


def _chart(
    frequency: FloatArray,
    linear: dict[float, dict[str, FloatArray]],
    timed: dict[tuple[float, bool], tuple[FloatArray, dict[str, FloatArray], float]],
    bands: dict[tuple[str, tuple[float, bool]], tuple[FloatArray, FloatArray]],
) -> Chart:
    rows = []
    for k_H in STIFFNESSES:
        panels = []
        for quantity, (_, _, _, unit) in QUANTITIES.items():
            curves = [
                Curve(name=_label(key), x=f[1:], y=psds[quantity][1:])
                for key, (f, psds, _) in timed.items()
                if key == (k_H, False)
            ]
            curves.append(
                Curve(name="frequency domain", x=frequency, y=linear[k_H][quantity], dashed=True)
            )
            top = 5 * float(linear[k_H][quantity].max())
            panels.append(
                Panel(
                    x_label="frequency (Hz)",
                    y_label=f"density ({unit})",
                    curves=tuple(curves),
                    x_log=True,
                    y_log=True,
                    x_range=BAND,
                    y_range=(1e-7 * top, top),
                    title=f"{quantity}, k_H {k_H / 1e9:g} GN/m",
                )
            )
        rows.append(tuple(panels))
    rows.append(
        tuple(
            Panel(
                x_label="frequency (Hz)",
                y_label="time over frequency (dB)",
                curves=tuple(
                    Curve(name=_label(key), x=centres, y=decibel)
                    for (q, key), (centres, decibel) in bands.items()
                    if q == quantity
                ),
                x_log=True,
                x_range=BAND,
                title=f"{quantity}, third octaves",
            )
            for quantity in QUANTITIES
        )
    )
    return Chart(title="Figure 3: time and frequency domain, 250 km/h", rows=tuple(rows))


def _data(
    frequency: FloatArray,
    linear: dict[float, dict[str, FloatArray]],
    timed: dict[tuple[float, bool], tuple[FloatArray, dict[str, FloatArray], float]],
    bands: dict[tuple[str, tuple[float, bool]], tuple[FloatArray, FloatArray]],
) -> xr.Dataset:
    """All of it, each kind over its own axis."""
    variables = {}
    for quantity, (_, _, _, unit) in QUANTITIES.items():
        short = quantity.replace(" ", "_")
        for k_H, psds in linear.items():
            about = {"units": unit, "long_name": f"{quantity}, pseudo-excitation"}
            variables[f"{short}_linear_{k_H / 1e9:g}GN"] = ("frequency", psds[quantity], about)
        for key, (_, estimates, _) in timed.items():
            mark = f"{key[0] / 1e9:g}GN" + ("_rolling" if key[1] else "")
            about = {"units": unit, "long_name": f"{quantity}, Welch"}
            variables[f"{short}_time_{mark}"] = ("frequency_time", estimates[quantity], about)
            about = {"units": "dB", "long_name": f"{quantity}, time over frequency domain"}
            variables[f"{short}_difference_{mark}"] = ("centre", bands[quantity, key][1], about)
    hertz = {"units": "Hz"}
    axes = {
        "frequency": ("frequency", frequency, hertz),
        "frequency_time": ("frequency_time", next(iter(timed.values()))[0], hertz),
        "centre": ("centre", next(iter(bands.values()))[0], hertz),
    }
    attributes = {"spectrum": SPECTRUM, "speed": SPEED, "shortest_wave": WAVELENGTHS[0]}
    return xr.Dataset(variables, axes, attributes)


FIGURES: dict[int, Callable[[Laboratory], Figure]] = {3: figure_3}
