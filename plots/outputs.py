"""A chart of the outputs of any system."""

from __future__ import annotations

import numpy as np
import xarray as xr

from .chart import Chart, Curve, Panel

MOST = 7
"""Curves in a panel: there are as many colours."""


def outputs_chart(run: xr.Dataset) -> Chart:
    """All outputs over time, a panel for each unit.

    Parameters
    ----------
    run : Dataset
        Variables over ``time`` (s), each with the attribute ``units``.

    Returns
    -------
    Chart
        With the first `MOST` outputs of each unit; a panel with fewer than there are says so.
    """
    t = np.asarray(run["time"])
    names: dict[str, list[str]] = {}
    for name, variable in run.data_vars.items():
        names.setdefault(str(variable.attrs.get("units", "")), []).append(str(name))
    rows = []
    for unit, of_unit in names.items():
        shown = of_unit[:MOST]
        curves = tuple(Curve(name=name, x=t, y=np.asarray(run[name])) for name in shown)
        left_out = len(of_unit) - len(shown)
        label = f"outputs ({unit or 'no unit'})"
        if left_out:
            label = f"first {MOST} of {len(of_unit)} {label}"
        span = (float(t[0]), float(t[-1])) if t.size > 1 else None
        rows.append((Panel(x_label="time (s)", y_label=label, curves=curves, x_range=span),))
    return Chart(title=str(run.attrs.get("title", "")), rows=tuple(rows), share_x=True)
