"""Pictures of results: labelled axes with units, readable in print."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from cycler import cycler

mpl.use("Agg")
from matplotlib import pyplot as plt

STYLE: Any = {
    "figure.dpi": 150,
    "font.size": 9,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "0.88",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "axes.prop_cycle": cycler(  # Okabe & Ito: told apart by everyone, and in grey
        color=["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"]
    ),
    "lines.linewidth": 1.1,
}
WHEELSETS = [f"wheelset[{i}]" for i in (1, 2, 3, 4)]


def save(figure: Any, path: Path) -> None:
    """Write the picture and forget it."""
    figure.savefig(path, bbox_inches="tight")
    plt.close(figure)


def _legend(axes: Any) -> None:
    """Beside the curves, never on them."""
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0)


def plot_run(run: xr.Dataset, path: Path) -> None:
    """Contact forces, wheel and rail motion, and accelerations over time."""
    candidates = [
        ("contact force, left (kN)", 1e-3, [f"{w}.left.force_z" for w in WHEELSETS]),
        (
            "down (mm)",
            1e3,
            [
                "wheelset[1].left.wheel_z",
                "wheelset[1].left.rail_z",
                "wheelset[1].left.irregularity_z",
            ],
        ),
        ("acceleration (m/s²)", 1.0, ["bogie[1].az", "bogie[2].az"]),
        ("acceleration (m/s²)", 1.0, ["carbody.az"]),
    ]
    rows = [(a, b, [n for n in names if n in run]) for a, b, names in candidates]
    rows = [row for row in rows if row[2]]
    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(
            len(rows), 1, figsize=(7.2, 1.9 * len(rows)), sharex=True, squeeze=False
        )
        panels = panels[:, 0]
        for axes, (label, factor, names) in zip(panels, rows, strict=True):
            for name in names:
                short = name.removesuffix(".force_z").removesuffix(".left")
                axes.plot(run["time"], factor * run[name], label=short)
            axes.set_ylabel(label)
            _legend(axes)
        panels[-1].set_xlabel("time (s)")
        panels[0].set_title(str(run.attrs.get("title", "")), loc="left")
        if run.sizes["time"] > 1:
            panels[0].set_xlim(float(run["time"][0]), float(run["time"][-1]))
        save(figure, path)


def plot_response(frf: xr.Dataset, path: Path) -> None:
    """Magnitude of displacements and of contact forces over frequency."""
    per = "m" if frf.attrs["excitation"] == "irregularity_z" else "N"
    motion = ["carbody.z", "bogie[1].z", "bogie[2].z", "wheelset[4].left.wheel_z",
              "wheelset[4].left.rail_z"]  # fmt: skip
    forces = [f"{w}.left.force_z" for w in WHEELSETS]
    panels_of = [
        (f"displacement (m/{per})", [n for n in motion if n in frf]),
        (f"contact force (N/{per})", [n for n in forces if n in frf]),
    ]
    panels_of = [p for p in panels_of if p[1]]
    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(
            len(panels_of), 1, figsize=(7.2, 2.9 * len(panels_of)), sharex=True, squeeze=False
        )
        for axes, (label, names) in zip(panels[:, 0], panels_of, strict=True):
            top = 0.0
            for name in names:
                size = np.abs(frf[name])
                if float(size.max()) > 0:
                    top = max(top, float(size.max()))
                    axes.loglog(frf["frequency"], size, label=name.removesuffix(".force_z"))
            # Below a millionth of the peak there is roll-off and rounding, nothing to read.
            axes.set_ylim(bottom=1e-6 * top, top=3 * top)
            axes.set_ylabel(label)
            _legend(axes)
        panels[-1, 0].set_xlabel("frequency (Hz)")
        panels[0, 0].set_xlim(float(frf["frequency"][0]), float(frf["frequency"][-1]))
        panels[0, 0].set_title(str(frf.attrs.get("title", "")), loc="left")
        save(figure, path)


def plot_receptances(
    curves: dict[str, tuple[Any, Any]], path: Path, label: str, title: str
) -> None:
    """Magnitude and phase of responses (frequency in Hz, complex values) by name."""
    with plt.rc_context(STYLE):
        figure, (size, phase) = plt.subplots(
            2, 1, figsize=(7.2, 5.2), sharex=True, height_ratios=[2.2, 1]
        )
        for name, (frequency, values) in curves.items():
            size.loglog(frequency, np.abs(values), label=name)
            phase.semilogx(frequency, np.degrees(np.angle(values)))
        size.set_ylabel(label)
        size.set_title(title, loc="left")
        _legend(size)
        phase.set_ylabel("phase (°)")
        phase.set_yticks([-180, -90, 0, 90, 180])
        phase.set_xlabel("frequency (Hz)")
        size.set_xlim(min(float(f[0]) for f, _ in curves.values()),
                      max(float(f[-1]) for f, _ in curves.values()))  # fmt: skip
        save(figure, path)
