"""Charts of the commands' results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from .chart import Chart, Curve, FloatArray, Panel
from .names import in_words
from .style import parted

TURNS = 3  # of a phase: of more, ticks at 90 degrees are too many
ROUNDING = (
    1e-9  # of the greatest of a group: what a mirror leaves out is not zero to the last digit
)


def phase_ticks(low: float, high: float) -> tuple[tuple[float, str], ...]:
    """Ticks of an axis of phases: at 90 degrees, of more than three turns at a whole one each."""
    step = 90 if high - low <= TURNS * 360 else 360
    first, last = int(np.floor(low / step)), int(np.ceil(high / step))
    at = range(step * first, step * last + 1, step)
    return tuple((float(k), f"{k}".replace("-", "\N{MINUS SIGN}")) for k in at)


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
    return Chart(title=in_words(str(run.attrs.get("title", ""))), rows=tuple(rows), share_x=True)


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
    return Chart(title=in_words(str(frf.attrs.get("title", ""))), rows=tuple(rows), share_x=True)


def receptance_chart(
    curves: Mapping[str, tuple[FloatArray, np.ndarray]], label: str, title: str
) -> Chart:
    """Magnitude and phase of responses (frequency in Hz, complex values) by name.

    `label` is of their quantity, with the unit in brackets: ``receptance (m/N)``.
    """
    sizes = tuple(Curve(name=n, x=f, y=np.abs(values)) for n, (f, values) in curves.items())
    quantity, _, unit = label.partition(" (")
    rows = ((_over_frequency(f"|{quantity}| ({unit}", sizes),), (phase_panel(curves, quantity),))
    return Chart(title=in_words(title), rows=rows, share_x=True)


def phase_panel(curves: Mapping[str, tuple[FloatArray, np.ndarray]], quantity: str) -> Panel:
    """Phases of responses by name, with a gap where they turn over."""
    phases = []
    for name, (f, values) in curves.items():
        x, y = parted(f, np.degrees(np.angle(values)), 180.0)
        phases.append(Curve(name=name, x=x, y=y))
    return Panel(
        x_label="frequency (Hz)", y_label=f"phase of {quantity} (°)", curves=tuple(phases),
        x_log=True, x_range=_span([f for f, _ in curves.values()]), y_range=(-190.0, 190.0),
        y_ticks=phase_ticks(-180.0, 180.0),
    )  # fmt: skip


def _over_frequency(label: str, curves: tuple[Curve, ...]) -> Panel:
    return Panel(
        x_label="frequency (Hz)", y_label=label, curves=curves, x_log=True, y_log=True,
        x_range=_span([c.x for c in curves]),
    )  # fmt: skip


def _span(axes: Sequence[FloatArray]) -> tuple[float, float] | None:
    low, high = min(x[0] for x in axes), max(x[-1] for x in axes)
    return (float(low), float(high)) if low < high else None
