"""Charts of what was fitted to measured curves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import xarray as xr

from .chart import Chart, Curve, FloatArray, Panel
from .results import phase_ticks

Part = Callable[[np.ndarray], FloatArray]


def fit_chart(fitted: xr.Dataset) -> Chart:
    """Measured and fitted magnitude, their phases where these are known, and the residual.

    Parameters
    ----------
    fitted : Dataset
        ``measured``, ``fitted`` and ``residual`` over frequency; of several files ``measured[2]``
        and so on, which stand side by side.
    """
    names = [str(name) for name in fitted if str(name).startswith("measured")]
    columns = [_column(fitted, name.removeprefix("measured")) for name in names]
    most = max(map(len, columns)) - 1
    rows = [tuple(c[r] for c in columns if r < len(c) - 1) for r in range(most)]
    rows.append(tuple(c[-1] for c in columns))
    same = len({len(c) for c in columns}) == 1
    return Chart(title=str(fitted.attrs["title"]), rows=tuple(rows), share_x=same)


def _column(fitted: xr.Dataset, which: str) -> tuple[Panel, ...]:
    """Of one file, from the top."""
    measured, model = fitted[f"measured{which}"], fitted[f"fitted{which}"]
    f = np.asarray(measured[measured.dims[0]], float)
    unit, title = measured.attrs["units"], str(measured.attrs["long_name"])
    bars = "|receptance| ({})" if unit == "m/N" else "decay rate ({})"

    def panel(label: str, part: Part, *, y_log: bool = False, title: str = "") -> Panel:
        curves = (
            Curve(name="measured", x=f, y=part(measured.values)),
            Curve(name="fitted", x=f, y=part(model.values), dashed=True),
        )
        return _panel(f, label, curves, y_log=y_log, title=title)

    panels = [panel(bars.format(unit), np.abs, y_log=True, title=title)]
    if np.iscomplexobj(measured.values):
        phase = panel("phase of receptance (°)", lambda v: np.rad2deg(np.unwrap(np.angle(v))))
        shown: FloatArray = np.concatenate([c.y for c in phase.curves])
        ticks = phase_ticks(float(np.nanmin(shown)), float(np.nanmax(shown)))
        panels.append(replace(phase, y_ticks=ticks))
    off = np.asarray(fitted[f"residual{which}"], float)
    zero = Curve(name="0 dB", x=f[[0, -1]], y=np.zeros(2), dashed=True)
    curves = (Curve(name="fitted over measured", x=f, y=off), zero)
    return (*panels, _panel(f, "residual (dB)", curves))


def _panel(
    f: FloatArray, label: str, curves: tuple[Curve, ...], *, y_log: bool = False, title: str = ""
) -> Panel:
    return Panel(
        x_label="frequency (Hz)", y_label=label, curves=curves, x_log=True, y_log=y_log,
        x_range=(float(f[0]), float(f[-1])), title=title,
    )  # fmt: skip
