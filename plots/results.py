"""Charts of the commands' results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from .chart import Chart, Curve, FloatArray, Panel

ROUNDING = (
    1e-9  # of the greatest of a group: what a mirror leaves out is not zero to the last digit
)


@dataclass(frozen=True)
class Group:
    """Variables of a dataset that are drawn together.

    Attributes
    ----------
    label : str
        Of the axis.
    curves : mapping of str to str
        Names of curves, by the variables; those that a dataset has not are left out.
    factor : float
        From the dataset's unit to the axis'.
    """

    label: str
    curves: Mapping[str, str]
    factor: float = 1.0


def time_chart(run: xr.Dataset, groups: Sequence[Group]) -> Chart:
    """Groups of variables over time, one above the other."""
    t = np.asarray(run["time"])
    span = (float(t[0]), float(t[-1])) if t.size > 1 else None
    rows = []
    for group in groups:
        curves = tuple(
            Curve(name=name, x=t, y=group.factor * np.asarray(run[variable]))
            for variable, name in group.curves.items()
            if variable in run
        )
        if curves:
            panel = Panel(x_label="time (s)", y_label=group.label, curves=curves, x_range=span)
            rows.append((panel,))
    return Chart(title=str(run.attrs.get("title", "")), rows=tuple(rows), share_x=True)


def size_chart(frf: xr.Dataset, groups: Sequence[Group]) -> Chart:
    """Magnitudes of groups of responses over frequency, those that are not rounding."""
    f = np.asarray(frf["frequency"])
    rows = []
    for group in groups:
        sizes = {
            name: group.factor * np.abs(np.asarray(frf[variable]))
            for variable, name in group.curves.items()
            if variable in frf
        }
        least = ROUNDING * max((size.max() for size in sizes.values()), default=0.0)
        curves = tuple(
            Curve(name=n, x=f, y=size) for n, size in sizes.items() if size.max() > least
        )
        if curves:
            rows.append((_over_frequency(group.label, curves),))
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
