"""Charts of hunting: critical speeds, and poles against the speed."""

from __future__ import annotations

import numpy as np
import xarray as xr

from .chart import Chart, Curve, Mark, Panel


def hunting_chart(critical: xr.Dataset, locus: xr.Dataset | None) -> Chart:
    """Poles of one conicity over the speed and in their plane, and critical speeds.

    Parameters
    ----------
    critical : Dataset
        ``critical_speed`` (km/h) and ``frequency`` (Hz) over ``conicity``.
    locus : Dataset or None
        ``growth`` (1/s) and ``frequency`` (Hz) over ``speed`` (km/h) and ``mode``.
    """
    rows = [] if locus is None else [_locus(critical, locus)]
    if critical.sizes["conicity"] > 1:
        x = np.asarray(critical["conicity"])
        speed = Curve(name="", x=x, y=np.asarray(critical["critical_speed"]))
        frequency = Curve(name="", x=x, y=np.asarray(critical["frequency"]))
        rows.append((
            Panel(x_label="conicity", y_label="critical speed (km/h)", curves=(speed,)),
            Panel(x_label="conicity", y_label="frequency there (Hz)", curves=(frequency,)),
        ))  # fmt: skip
    return Chart(title=f"{critical.attrs['title']}, gravity: {critical.attrs['gravity']}", rows=tuple(rows))


def _locus(critical: xr.Dataset, locus: xr.Dataset) -> tuple[Panel, Panel]:
    conicity = float(locus.attrs["conicity"])
    at = float(critical["critical_speed"].sel(conicity=conicity))
    speed, growth = np.asarray(locus["speed"]), np.asarray(locus["growth"])
    frequency = np.asarray(locus["frequency"])
    modes = [k for k in range(growth.shape[1]) if np.isfinite(growth[:, k]).sum() > 1]
    lowest = float(-1.5 * np.nanmax(np.abs(growth[:, modes].max(axis=0, initial=0.0)), initial=2.0))
    over = tuple(Curve(name=str(k), x=speed, y=growth[:, k]) for k in modes)
    plane = tuple(Curve(name=str(k), x=growth[:, k], y=frequency[:, k]) for k in modes)
    marks = (Mark(label=f"{at:.1f} km/h", x=at),) if np.isfinite(at) else ()
    return (
        Panel(
            x_label="speed (km/h)", y_label="growth (1/s)", curves=over, marks=marks,
            title=f"conicity {conicity:g}", y_range=(5 * lowest, -lowest),
            x_range=(float(speed[0]), float(speed[-1])),
        ),
        Panel(
            x_label="growth (1/s)", y_label="frequency (Hz)", curves=plane,
            marks=(Mark(label="grows to the right", x=0.0),),
            title=f"root locus, {speed[0]:.0f} to {speed[-1]:.0f} km/h", x_range=(5 * lowest, -lowest),
        ),
    )  # fmt: skip
