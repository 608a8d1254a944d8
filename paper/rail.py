"""Figures 13, 22 and 23: receptance of the rail, what the vehicle and the contact make of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from railcosim.analysis.response.frequency import apart
from railcosim.master.component import FloatArray
from railcosim.plots.chart import Chart, Curve, Mark, Panel

from .figure import RAIL, RAIL_FORCES, Figure, curves_dataset, dip, peak, sizes
from .finding import Finding
from .laboratory import K_H, Laboratory

PINNED = (1000.0, 1120.0)  # Hz; the pinned-pinned resonance is looked for between
FIRST = (15.0, 80.0)  # Hz; the first resonance
# k_H to what an independent model of the same vehicle and track gives, Hz.
ANTIRESONANCES = {0.1e9: 55.0, 0.3e9: 95.0, 1e9: 174.0, 3e9: 301.0, 8e9: 491.0}
RESONANCES = {0.1e9: 27.9, 0.3e9: 32.2, 1e9: 33.8, 3e9: 34.3, 8e9: 34.4}
CONVERGED = 0.01  # of the resonance with rigid contact: what the eye takes for converged


def figure_13(lab: Laboratory) -> Figure:
    """Receptance of the rail at a railseat (and mid-span, if linearised there too)."""
    places = {"railseat": lab.models}
    if lab.midspan is not None:
        places["mid-span"] = lab.midspan
    frequency = np.union1d(lab.frequencies(1.0, 1500.0), np.arange(1040.0, 1072.0, 0.1))
    omega = 2 * np.pi * frequency
    curves = {}
    for place, models in places.items():
        for with_vehicle in (False, True):
            system = lab.coupled(models=models)(omega) if with_vehicle else apart(models, omega)
            (size,) = sizes(system, RAIL_FORCES, models.positions, [RAIL])
            curves[place, with_vehicle] = size
    findings = _findings_13(frequency, curves)
    value = {finding.quantity: finding.ours for finding in findings}
    panels = tuple(
        Panel(
            x_label="frequency (Hz)",
            y_label="|receptance| (m/N)",
            curves=tuple(
                Curve(name=place, x=frequency, y=curves[place, with_vehicle]) for place in places
            ),
            marks=(Mark(label=first, x=float(first)), Mark(label="1062", x=1062.0)),
            x_log=True,
            y_log=True,
            x_range=(1.0, 1500.0),
            title=title,
        )
        for with_vehicle, title, first in (
            (False, "without vehicle", "52"),
            (True, "with vehicle", "33"),
        )
    )
    return Figure(
        number=13,
        title="Driving-point receptance of the rail",
        text=f"The vehicle's wheelsets pull the first resonance from "
        f"{value['rail, first peak, without vehicle']:.1f} Hz down to "
        f"{value['rail, first peak, with vehicle']:.1f} Hz and put an antiresonance at "
        f"{value['rail, antiresonance, with vehicle']:.1f} Hz, where a wheel on its contact spring "
        "absorbs the force. The pinned-pinned resonance keeps its frequency.",
        chart=Chart(title="Figure 13: receptance of the rail", rows=(panels,)),
        data=curves_dataset(
            frequency,
            {
                f"{place}_{'with' if v else 'without'}_vehicle": (size, "m/N")
                for (place, v), size in curves.items()
            },
            contact_stiffness=K_H,
        ),
        findings=tuple(findings),
    )


def _findings_13(
    frequency: FloatArray, curves: dict[tuple[str, bool], FloatArray]
) -> list[Finding]:
    def row(quantity: str, paper: float, ours: float) -> Finding:
        return Finding(figure="13", quantity=quantity, paper=paper, ours=ours, unit="Hz",
                       agrees=abs(ours / paper - 1) < 0.05)  # fmt: skip

    alone, loaded = curves["railseat", False], curves["railseat", True]
    anti = dip(frequency, loaded, 60, 150)
    findings = [
        row("rail, first peak, without vehicle", 52.0, peak(frequency, alone, 30, 90)),
        row("rail, first peak, with vehicle", 33.0, peak(frequency, loaded, *FIRST)),
        Finding(figure="13", quantity="rail, antiresonance, with vehicle",
                paper="a bit below 100", ours=anti, unit="Hz", agrees=85 < anti < 100,
                note="eq. 19 puts the wheel's resonance at 95.1 Hz"),
    ]  # fmt: skip
    if ("mid-span", True) not in curves:
        return findings
    pinned = {v: peak(frequency, curves["mid-span", v], *PINNED) for v in (False, True)}
    at = (frequency > PINNED[0]) & (frequency < PINNED[1])
    top = {v: float(curves["mid-span", v][at].max()) for v in (False, True)}
    return [
        *findings,
        row("pinned-pinned, mid-span, without vehicle", 1062.0, pinned[False]),
        row("pinned-pinned, mid-span, with vehicle", 1062.0, pinned[True]),
        Finding(figure="13", quantity="pinned-pinned peak, with over without vehicle",
                paper="lower than 1", ours=top[True] / top[False], unit="1",
                agrees=top[True] < 0.99 * top[False]),
    ]  # fmt: skip


def figure_22(lab: Laboratory) -> Figure:
    """Receptance of the rail for three k_H, with those of contact spring and unsprung mass."""
    frequency = lab.frequencies(5.0, 1000.0)
    omega = 2 * np.pi * frequency
    half = lab.vehicle.wheelset.mass / 2
    mass = 1 / (half * omega**2)
    sizes_by = {k_H: _railseat(lab, omega, k_H) for k_H in ANTIRESONANCES}
    findings = []
    for k_H, independent in ANTIRESONANCES.items():
        predicted = np.sqrt(k_H / half) / (2 * np.pi)  # eq. 19: where both receptances meet
        ours = dip(frequency, sizes_by[k_H], 0.6 * predicted, 1.3 * predicted)
        findings.append(
            Finding(
                figure="22",
                quantity=f"rail antiresonance, k_H {k_H / 1e9:g} GN/m",
                paper=predicted,
                ours=ours,
                unit="Hz",
                agrees=abs(ours / predicted - 1) < 0.05,
                note="paper: where spring and mass receptances meet (eq. 19); an independent "
                f"model gives {independent:g} Hz",
            )
        )
    shown = (0.1e9, 1e9, 8e9)
    curves = [Curve(name=f"rail, k_H {k / 1e9:g} GN/m", x=frequency, y=sizes_by[k]) for k in shown]
    curves.append(Curve(name="unsprung mass", x=frequency, y=mass, dashed=True))
    curves += [
        Curve(name=f"spring {k / 1e9:g} GN/m", x=frequency, y=np.full_like(frequency, 1 / k),
              dashed=True)
        for k in shown
    ]  # fmt: skip
    panel = Panel(
        x_label="frequency (Hz)", y_label="|receptance| (m/N)", curves=tuple(curves),
        x_log=True, y_log=True, x_range=(5.0, 1000.0), y_range=(1e-11, 1e-7),
    )  # fmt: skip
    data = {f"rail_{k / 1e9:g}GN": (size, "m/N") for k, size in sizes_by.items()}
    return Figure(
        number=22,
        title="Receptance of the rail and of what stands on it",
        text="The rail has an antiresonance where the contact spring and the unsprung mass have "
        "equal receptances. A stiffer contact moves it up, and leaves the first resonance almost "
        "where it is.",
        chart=Chart(title="Figure 22: receptance of the rail for three k_H", rows=((panel,),)),
        data=curves_dataset(frequency, {**data, "unsprung_mass": (mass, "m/N")}),
        findings=tuple(findings),
    )


def _railseat(lab: Laboratory, omega: FloatArray, k_H: float) -> FloatArray:
    (size,) = sizes(lab.coupled(k_H)(omega), RAIL_FORCES, lab.positions, [RAIL])
    return size


def figure_23(lab: Laboratory) -> Figure:
    """First resonance of the rail against the contact stiffness."""
    stiffness = np.geomspace(0.05e9, 12e9, 60)
    frequency = np.geomspace(*FIRST, 200)  # a parabola through the top does the rest
    omega = 2 * np.pi * frequency

    def first(k_H: float) -> float:
        return peak(frequency, _railseat(lab, omega, k_H), *FIRST)

    found = np.array([first(k) for k in stiffness])
    limit = first(np.inf)
    converged = float(np.interp(limit * (1 - CONVERGED), found, stiffness))
    findings = [
        Finding(figure="23", quantity=f"first resonance, k_H {k / 1e9:g} GN/m",
                paper="plotted, not printed", ours=first(k), unit="Hz",
                note=f"an independent model gives {independent:g} Hz")
        for k, independent in RESONANCES.items()
    ]  # fmt: skip
    findings.append(
        Finding(
            figure="23",
            quantity="k_H from which the first resonance converges",
            paper=3.0,
            ours=converged / 1e9,
            unit="GN/m",
            agrees=1 < converged / 1e9 < 4,
            note=f"ours: within {CONVERGED:.0%} of {limit:.2f} Hz, that of rigid contact; "
            f"at 3 GN/m {first(3e9):.2f} Hz",
        )
    )
    panel = Panel(
        x_label="contact stiffness k_H (GN/m)", y_label="first resonance (Hz)",
        curves=(
            Curve(name="vehicle on track", x=stiffness / 1e9, y=found),
            Curve(name="rigid contact", x=stiffness[[0, -1]] / 1e9, y=np.full(2, limit),
                  dashed=True),
        ),
        marks=(Mark(label="3", x=3.0),), x_range=(0.0, 12.0),
    )  # fmt: skip
    axis = ("contact_stiffness", stiffness, {"units": "N/m", "long_name": "contact stiffness"})
    column = ("contact_stiffness", found, {"units": "Hz", "long_name": "first resonance"})
    return Figure(
        number=23,
        title="First resonance of the rail against contact stiffness",
        text=f"The resonance rises with the contact stiffness towards {limit:.1f} Hz and is within "
        f"{CONVERGED:.0%} of it from {converged / 1e9:.1f} GN/m on: the track is then the softer "
        "of the two springs.",
        chart=Chart(title="Figure 23: first resonance of the rail", rows=((panel,),)),
        data=xr.Dataset({"first_resonance": column}, {"contact_stiffness": axis}),
        findings=tuple(findings),
    )


FIGURES: dict[int, Callable[[Laboratory], Figure]] = {13: figure_13, 22: figure_22, 23: figure_23}
