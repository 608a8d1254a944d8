"""Charts of what a track hands on to the ground, in third octaves."""

from __future__ import annotations

import numpy as np
import xarray as xr

from .chart import Chart, Curve, Panel


def transmission_chart(found: xr.Dataset) -> Chart:
    """Forces, slab velocity levels and the insertion loss, one above the other, as steps.

    Parameters
    ----------
    found : Dataset
        As `railcosim.analysis.response.transmission` gives it.
    """
    f = np.asarray(found["frequency"])
    half = 10**0.05
    x = np.stack([f / half, f * half], axis=1).ravel()

    def panel(label: str, names: dict[str, str], *, y_log: bool = False) -> tuple[Panel, ...]:
        curves = tuple(
            Curve(name=title, x=x, y=np.repeat(np.asarray(found[name]), 2), dashed=k > 0)
            for k, (name, title) in enumerate(names.items())
            if name in found
        )
        if not curves:
            return ()
        made = Panel(
            x_label="third octave (Hz)", y_label=label, curves=curves, x_log=True, y_log=y_log,
            x_range=(float(x[0]), float(x[-1])),
        )  # fmt: skip
        return (made,)

    def of_both(what: str) -> dict[str, str]:
        return {what: "this track", f"against.{what}": "the other"}

    unit = found["force"].attrs["units"]
    per = " per N" if unit == "N/N" else ""
    rows = [
        panel(f"force on the foundation ({unit})", of_both("force"), y_log=True),
        panel(f"slab level (dB re 1e-6 mm/s{per})", of_both("slab_level")),
        panel("insertion loss (dB)", {"insertion_loss": "insertion loss"}),
    ]
    return Chart(title=str(found.attrs["title"]), rows=tuple(r for r in rows if r), share_x=True)
