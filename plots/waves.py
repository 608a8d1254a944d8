"""Charts of waves along a track: dispersion, decay rates."""

from __future__ import annotations

import numpy as np
import xarray as xr

from railcosim.track.dispersion import TRAVELS

from .chart import Chart, Curve, FloatArray, Mark, Panel

LEAST, MOST = 1e-2, 1e3  # dB/m that are drawn
MARKED = 3  # stop bands: the widest
APART = 0.04  # of the axis, words beside edges
RATES = (0.01, 100.0)  # dB/m: EN 15461, clause 9.2


def dispersion_chart(waves: xr.Dataset, speed: float | None = None) -> Chart:
    """Wavenumber and decay of every wave over frequency.

    Parameters
    ----------
    waves : Dataset
        ``wave[i].wavenumber`` (rad/m) and ``wave[i].decay`` (dB/m) over ``frequency``.
    speed : float, optional
        Of a train, m/s: the line k = omega / V.
    """
    f = np.asarray(waves["frequency"])
    names = [str(name) for name in waves.data_vars if str(name).endswith(".wavenumber")]
    titles = [str(waves[name].attrs["long_name"]) for name in names]
    kappa = [np.asarray(waves[name]) for name in names]
    runs = [np.where(-k.imag < TRAVELS * np.abs(k.real), np.abs(k.real), np.nan) for k in kappa]
    curves = [Curve(name=t, x=f, y=k) for t, k in zip(titles, runs, strict=True)]
    top = 1.05 * max(float(np.max(y, where=~np.isnan(y), initial=0.1)) for y in runs)
    if speed is not None:
        curves.append(
            Curve(name=f"{3.6 * speed:g} km/h", x=f, y=2 * np.pi * f / speed, dashed=True)
        )
    span = (float(f[0]), float(f[-1]))
    marks = _marks(waves.attrs["stop_bands"].reshape(-1, 2), span)
    number = Panel(
        x_label="frequency (Hz)", y_label="|Re κ| of waves that run (rad/m)", curves=tuple(curves),
        marks=marks, x_range=span, y_range=(0.0, top),
    )  # fmt: skip
    decays = tuple(
        Curve(name=t, x=f, y=np.asarray(waves[n.replace(".wavenumber", ".decay")]))
        for t, n in zip(titles, names, strict=True)
    )
    decay = Panel(
        x_label="frequency (Hz)", y_label="decay (dB/m)", curves=decays, y_log=True, x_range=span,
        y_range=_shown(decays),
    )  # fmt: skip
    return Chart(title=str(waves.attrs["title"]), rows=((number,), (decay,)), share_x=True)


def _marks(bands: FloatArray, span: tuple[float, float]) -> tuple[Mark, ...]:
    """Edges of the widest stop bands, with words where these do not meet others."""
    widest = sorted(sorted(bands.tolist(), key=lambda e: e[0] - e[1])[:MARKED])
    marks: list[Mark] = []
    told = -np.inf
    for low, high in widest:
        apart = high - told > APART * (span[1] - span[0])
        told = high if apart else told
        words = f"none from {low:.0f} to {high:.0f} Hz" if apart else ""
        for edge, label in ((low, ""), (high, words)):
            if span[0] < edge < span[1]:
                marks.append(Mark(label=label, x=edge))
    return tuple(marks)


def _shown(curves: tuple[Curve, ...]) -> tuple[float, float]:
    values: FloatArray = np.concatenate([c.y[c.y > 0] for c in curves])
    if not values.size:
        return LEAST, MOST
    return max(LEAST, float(values.min()) / 1.5), min(MOST, 1.5 * float(values.max()))


def decay_rate_chart(rates: xr.Dataset) -> Chart:
    """Decay rates in third octaves, vertical and lateral one above the other.

    Parameters
    ----------
    rates : Dataset
        ``vertical``, ``vertical.wave``, ``vertical.limit``, and ``lateral`` alike, over
        ``frequency``.
    """
    f = np.asarray(rates["frequency"])
    half = 10**0.05
    x = np.stack([f / half, f * half], axis=1).ravel()  # bands as steps
    rows = []
    for name in (name for name in ("vertical", "lateral") if name in rates):
        curves = [
            Curve(name="EN 15461, receptances", x=x, y=np.repeat(np.asarray(rates[name]), 2)),
            Curve(name="slowest wave", x=f, y=np.asarray(rates[f"{name}.wave"])),
        ]
        limit = np.asarray(rates[f"{name}.limit"])
        if np.isfinite(limit).any():
            curves.append(Curve(name="least, ISO 3095", x=f, y=limit, dashed=True))
        panel = Panel(
            x_label="third octave (Hz)", y_label=f"{name} decay rate (dB/m)", curves=tuple(curves),
            x_log=True, y_log=True, x_range=(float(x[0]), float(x[-1])), y_range=RATES,
        )  # fmt: skip
        rows.append((panel,))
    return Chart(title=str(rates.attrs["title"]), rows=tuple(rows), share_x=True)
