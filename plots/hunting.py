"""Charts of hunting: critical speeds, and poles against the speed."""

from __future__ import annotations

import numpy as np
import xarray as xr

from .chart import Chart, Curve, FloatArray, Mark, Panel

FEW = 20  # points of a curve that are marked


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
        few = x.size <= FEW
        speed = Curve(name="", x=x, y=np.asarray(critical["critical_speed"]), points=few)
        frequency = Curve(name="", x=x, y=np.asarray(critical["frequency"]), points=few)
        rows.append((
            Panel(x_label="conicity", y_label="critical speed (km/h)", curves=(speed,)),
            Panel(x_label="conicity", y_label="frequency there (Hz)", curves=(frequency,)),
        ))  # fmt: skip
    return Chart(
        title=f"{critical.attrs['title']}, gravity: {critical.attrs['gravity']}", rows=tuple(rows)
    )


def _locus(critical: xr.Dataset, locus: xr.Dataset) -> tuple[Panel, Panel]:
    conicity = float(locus.attrs["conicity"])
    at = float(critical["critical_speed"].sel(conicity=conicity))
    speed, growth = np.asarray(locus["speed"]), np.asarray(locus["growth"])
    frequency = np.asarray(locus["frequency"])
    most = max(2.0, float(np.nanmax(growth)))
    shown = (-4 * most, 1.5 * most)
    over = np.broadcast_to(speed[:, None], growth.shape)
    marks = (Mark(label=f"{at:.1f} km/h", x=at),) if at > 0 else ()
    return (
        Panel(
            x_label="speed (km/h)", y_label="growth (1/s)", curves=_curves(over, growth, growth),
            marks=marks, title=f"conicity {conicity:g}, modes below 15 Hz", y_range=shown,
            x_range=(float(speed[0]), float(speed[-1])),
        ),
        Panel(
            x_label="growth (1/s)", y_label="frequency (Hz)",
            curves=_curves(growth, frequency, growth), marks=(Mark(label="grows", x=0.0),),
            title=f"root locus, {speed[0]:.0f} to {speed[-1]:.0f} km/h", x_range=shown,
            y_range=(0.0, 15.0),
        ),
    )  # fmt: skip


def _curves(x: FloatArray, y: FloatArray, growth: FloatArray) -> tuple[Curve, ...]:
    """Of all modes that grow at some speed, and of all others."""
    grows = np.nanmax(growth, axis=0) > 0
    return tuple(
        Curve(name=name, x=_in_a_row(x[:, some]), y=_in_a_row(y[:, some]))
        for name, some in (("grow at last", grows), ("decay at all speeds", ~grows))
    )


def _in_a_row(columns: FloatArray) -> FloatArray:
    """Columns one behind the other, with a gap between."""
    return np.vstack([columns, np.full(columns.shape[1], np.nan)]).T.ravel()


def limit_cycle_chart(found: xr.Dataset) -> Chart:
    """Amplitudes and frequencies of limit cycles against speed, up and down.

    Parameters
    ----------
    found : Dataset
        ``amplitude_up``, ``amplitude_down`` (m), ``frequency_up`` and ``frequency_down`` (Hz) over
        ``speed`` (km/h).
    """
    x = np.asarray(found["speed"])
    at = float(found.attrs["critical_speed"])
    marks = (Mark(label=f"linear, {at:.1f} km/h", x=at),) if x[0] <= at <= x[-1] else ()
    panels = []
    for what, label, factor in (
        ("amplitude", "wheelsets across, at most (mm)", 1e3),
        ("frequency", "frequency (Hz)", 1.0),
    ):
        curves = tuple(
            Curve(
                name=way,
                x=x,
                y=factor * np.asarray(found[f"{what}_{way}"]),
                dashed=dashed,
                points=x.size <= FEW,
            )
            for way, dashed in (("down", False), ("up", True))
        )
        panels.append(Panel(x_label="speed (km/h)", y_label=label, curves=curves, marks=marks))
    return Chart(title=str(found.attrs["title"]), rows=tuple((panel,) for panel in panels),
                 share_x=True)  # fmt: skip
