"""Charts of the commands' results."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from .chart import Chart, Curve, FloatArray, Panel

WHEELSETS = [f"wheelset[{i}]" for i in (1, 2, 3, 4)]
MOTION = [
    "carbody.z",
    "bogie[1].z",
    "bogie[2].z",
    "wheelset[4].left.wheel_z",
    "wheelset[4].left.rail_z",
]
FORCES = [f"{w}.left.force_z" for w in WHEELSETS]
FIRST = ["wheel_z", "rail_z", "irregularity_z"]
OVER_TIME = [  # label, factor, variables
    ("contact force, left (kN)", 1e-3, FORCES),
    ("down (mm)", 1e3, [f"wheelset[1].left.{name}" for name in FIRST]),
    ("bogie acceleration (m/s²)", 1.0, ["bogie[1].az", "bogie[2].az"]),
    ("car body acceleration (m/s²)", 1.0, ["carbody.az"]),
]


def run_chart(run: xr.Dataset) -> Chart:
    """Contact forces, wheel and rail motion, and accelerations over time."""
    t = np.asarray(run["time"])
    rows = []
    for label, factor, names in OVER_TIME:
        curves = tuple(
            Curve(
                name=name.removesuffix(".force_z").removesuffix(".left"),
                x=t,
                y=factor * np.asarray(run[name]),
            )
            for name in names
            if name in run
        )
        if curves:
            span = (float(t[0]), float(t[-1])) if t.size > 1 else None
            rows.append((Panel(x_label="time (s)", y_label=label, curves=curves, x_range=span),))
    return Chart(title=str(run.attrs.get("title", "")), rows=tuple(rows), share_x=True)


def response_chart(frf: xr.Dataset) -> Chart:
    """Magnitude of displacements and of contact forces over frequency."""
    per = "m" if str(frf.attrs["excitation"]).endswith("irregularity_z") else "N"
    f = np.asarray(frf["frequency"])
    rows = []
    for label, names in (
        (f"displacement (m/{per})", MOTION),
        (f"contact force (N/{per})", FORCES),
    ):
        sizes = {name: np.abs(np.asarray(frf[name])) for name in names if name in frf}
        curves = tuple(
            Curve(name=name.removesuffix(".force_z"), x=f, y=size)
            for name, size in sizes.items()
            if size.max() > 0
        )
        if curves:
            rows.append((_over_frequency(label, curves),))
    return Chart(title=str(frf.attrs.get("title", "")), rows=tuple(rows), share_x=True)


def receptance_chart(
    curves: Mapping[str, tuple[FloatArray, np.ndarray]], label: str, title: str
) -> Chart:
    """Magnitude and phase of responses (frequency in Hz, complex values) by name."""
    sizes = tuple(Curve(name=n, x=f, y=np.abs(values)) for n, (f, values) in curves.items())
    phases = tuple(
        Curve(name=n, x=f, y=np.degrees(np.angle(values))) for n, (f, values) in curves.items()
    )
    phase = Panel(
        x_label="frequency (Hz)", y_label="phase (°)", curves=phases, x_log=True,
        x_range=_span(phases), y_range=(-185.0, 185.0),
    )  # fmt: skip
    return Chart(title=title, rows=((_over_frequency(label, sizes),), (phase,)), share_x=True)


def _over_frequency(label: str, curves: tuple[Curve, ...]) -> Panel:
    return Panel(
        x_label="frequency (Hz)", y_label=label, curves=curves, x_log=True, y_log=True,
        x_range=_span(curves),
    )  # fmt: skip


def _span(curves: tuple[Curve, ...]) -> tuple[float, float] | None:
    low, high = min(c.x[0] for c in curves), max(c.x[-1] for c in curves)
    return (float(low), float(high)) if low < high else None
