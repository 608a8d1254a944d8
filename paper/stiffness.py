"""Figures 18 to 21: vehicle on flexible track for three k_H, per m of irregularity."""

from __future__ import annotations

from functools import partial

import numpy as np
import xarray as xr

from railcosim.master.component import FloatArray
from railcosim.plots.chart import Chart, Curve, Panel

from .figure import IRREGULARITY, WHEEL, Figure, curves_dataset, peak, sizes
from .finding import Finding
from .laboratory import STIFFNESSES, Laboratory

BODIES = {
    18: ("car body", "vehicle.carbody"),
    19: ("front bogie", "vehicle.bogie[1]"),
    20: ("rear bogie", "vehicle.bogie[2]"),
}
WINDOWS = {"bounce": (0.4, 1.2), "pitch": (0.5, 1.4)}  # Hz, first peaks
UNITS = {"bounce": "m/m", "pitch": "rad/m", "wheelset 4": "m/m"}
Curves = dict[float, FloatArray]  # by k_H


def figure_body(lab: Laboratory, number: int) -> Figure:
    """Figure 18, 19 or 20: bounce and pitch of one body."""
    name, body = BODIES[number]
    frequency, curves = _solve(lab, {"bounce": f"{body}.z", "pitch": f"{body}.pitch"}, 200.0)
    findings = []
    for motion, by in curves.items():
        found = [peak(frequency, by[k], *WINDOWS[motion]) for k in STIFFNESSES]
        quantity = f"{name} {motion}, first peak: change over k_H"
        if np.isnan(found).any():
            findings.append(
                Finding(figure=str(number), quantity=quantity, paper="none", ours="no peak",
                        unit="1", note="so heavily damped that there is no peak to move")
            )  # fmt: skip
            continue
        spread = max(found) / min(found) - 1
        findings.append(
            Finding(figure=str(number), quantity=quantity, paper="none", ours=spread, unit="1",
                    agrees=spread < 0.01, note=f"{min(found):.3f} to {max(found):.3f} Hz")
        )  # fmt: skip
    return Figure(
        number=number,
        title=f"Response of the {name} to irregularity, three contact stiffnesses",
        text=f"The contact stiffness does not move the resonances of the {name}, and below 20 Hz "
        "it does not matter at all: the wheel follows the surface. Above, a stiffer contact "
        "transmits more.",
        chart=_chart(f"Figure {number}: {name}", frequency, curves),
        data=_data(frequency, curves),
        findings=tuple(findings),
    )


def figure_wheel(lab: Laboratory) -> Figure:
    """Figure 21: wheelset 4 to irregularity under it."""
    frequency, curves = _solve(lab, {"wheelset 4": WHEEL}, 1000.0)
    by = curves["wheelset 4"]
    found = {k: peak(frequency, by[k], 20, 60) for k in STIFFNESSES}
    low = frequency < 100
    change = np.abs(by[8e9] / by[1e9] - 1)[low]
    findings = [
        Finding(figure="21", quantity=f"wheel on track, k_H {k / 1e9:g} GN/m", unit="Hz",
                paper="rises with k_H", ours=f,
                agrees=k == STIFFNESSES[0] or f > found[STIFFNESSES[0]])
        for k, f in found.items()
    ]  # fmt: skip
    findings.append(
        Finding(
            figure="21",
            quantity="response, 8 against 1 GN/m, largest change below 100 Hz",
            paper="almost none",
            ours=float(change.max()),
            unit="1",
            agrees=bool(change.max() < 0.1),
            note=f"median {np.median(change):.1%}; above 100 Hz it grows",
        )
    )
    return Figure(
        number=21,
        title="Response of wheelset 4 to irregularity under it",
        text=f"The wheel's resonance on the track rises from {found[0.1e9]:.1f} Hz to "
        f"{found[1e9]:.1f} and {found[8e9]:.1f} Hz as the contact stiffens from 0.1 to 1 and "
        "8 GN/m. Between the last two little changes: the track is the softer spring.",
        chart=_chart("Figure 21: wheelset 4", frequency, curves),
        data=_data(frequency, curves),
        findings=tuple(findings),
    )


def _solve(
    lab: Laboratory, outputs: dict[str, str], highest: float
) -> tuple[FloatArray, dict[str, Curves]]:
    frequency = lab.frequencies(0.1, highest)
    curves: dict[str, Curves] = {name: {} for name in outputs}
    for k_H in STIFFNESSES:
        system = lab.coupled(k_H)(2 * np.pi * frequency)
        values = sizes(system, IRREGULARITY, lab.positions, list(outputs.values()))
        for name, size in zip(outputs, values, strict=True):
            curves[name][k_H] = size
    return frequency, curves


def _chart(title: str, frequency: FloatArray, curves: dict[str, Curves]) -> Chart:
    panels = tuple(
        Panel(
            x_label="frequency (Hz)",
            y_label=f"|{name}| ({UNITS[name]})",
            curves=tuple(
                Curve(name=f"k_H {k / 1e9:g} GN/m", x=frequency, y=size) for k, size in by.items()
            ),
            x_log=True,
            y_log=True,
            x_range=(float(frequency[0]), float(frequency[-1])),
        )
        for name, by in curves.items()
    )
    return Chart(title=title, rows=(panels,))


def _data(frequency: FloatArray, curves: dict[str, Curves]) -> xr.Dataset:
    flat = {
        f"{name.replace(' ', '_')}_{k / 1e9:g}GN": (size, UNITS[name])
        for name, by in curves.items()
        for k, size in by.items()
    }
    return curves_dataset(frequency, flat, excitation=IRREGULARITY)


FIGURES = {n: partial(figure_body, number=n) for n in BODIES} | {21: figure_wheel}
