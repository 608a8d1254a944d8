"""A chart of the outputs of any system."""

from __future__ import annotations

import numpy as np
import xarray as xr

from .chart import Chart, Curve, Panel
from .names import called
from .style import COLORS

MOST = len(COLORS)
"""Curves in a panel: there are as many colours."""
FAR = 100.0
"""So many times as large as the next smaller one, a curve leaves nothing of that to be seen."""


def outputs_chart(run: xr.Dataset) -> Chart:
    """All outputs over time, a panel for each unit, and more where sizes are too far apart.

    Parameters
    ----------
    run : Dataset
        Variables over ``time`` (s), each with the attribute ``units``.

    Returns
    -------
    Chart
        With the first `MOST` outputs of each panel; one with fewer than there are says so.
    """
    t = np.asarray(run["time"])
    names: dict[str, list[str]] = {}
    for name, variable in run.data_vars.items():
        names.setdefault(str(variable.attrs.get("units", "")), []).append(str(name))
    rows = []
    for unit, of_unit in names.items():
        for alike in _of_like_size(run, of_unit):
            shown = alike[:MOST]
            curves = tuple(
                Curve(name=words, x=t, y=np.asarray(run[name]))
                for name, words in called(run, shown).items()
            )
            label = f"outputs ({unit or 'no unit'})"
            if len(alike) > len(shown):
                label = f"first {MOST} of {len(alike)} {label}"
            span = (float(t[0]), float(t[-1])) if t.size > 1 else None
            panel = Panel(
                x_label="time (s)", y_label=label, curves=curves, x_range=span,
                title=curves[0].name if len(curves) == 1 else "",  # it has no legend
            )  # fmt: skip
            rows.append((panel,))
    return Chart(title=str(run.attrs.get("title", "")), rows=tuple(rows), share_x=True)


def _of_like_size(run: xr.Dataset, names: list[str]) -> list[list[str]]:
    """Parted where the next larger one is `FAR` times as large; zeros are with the smallest."""
    sizes = {name: _size(np.asarray(run[name])) for name in names}
    groups: list[list[str]] = []
    largest = 0.0
    for name in sorted(names, key=lambda name: sizes[name]):
        if not groups or (largest > 0 and sizes[name] > FAR * largest):
            groups.append([])
        groups[-1].append(name)
        largest = sizes[name]
    return [[name for name in names if name in group] for group in reversed(groups)]


def _size(values: np.ndarray) -> float:
    numbers = np.abs(values[np.isfinite(values)])
    return float(numbers.max(initial=0.0))
