"""What is shown of sensors at fixed places of the track."""

from __future__ import annotations

from collections.abc import Iterator

import xarray as xr

from .results import Group

MOST = 7
"""Curves in one panel that are told apart."""
PANELS = {  # last parts of names: axis, unit it is shown in, and how many of it are one of ours
    ("z", "y"): ("displacement", "mm", 1e3),
    ("vz", "vy"): ("velocity", "mm/s", 1e3),
    ("az", "ay"): ("acceleration", "m/s²", 1.0),
    ("force_z", "force_y"): ("fastening force", "kN", 1e-3),
    ("line_force",): ("force", "kN/m", 1e-3),
    ("pressure",): ("pressure on the foundation", "kPa", 1e-3),
    ("bending_moment", "bending_moment_lateral"): ("bending moment", "kN m", 1e-3),
    ("stress",): ("bending stress", "MPa", 1e-6),
}


def sensor_groups(shown: xr.Dataset, per: str = "") -> Iterator[Group]:
    """Panels of what sensors see, a quantity each; `per` so much of an excitation, as it is."""
    seen = [str(name) for name, variable in shown.data_vars.items() if "at" in variable.attrs]
    for last, (axis, unit, factor) in PANELS.items():
        names = [name for name in seen if name.rpartition(".")[2] in last][:MOST]
        if not names:
            continue
        label = (
            f"|{axis}| ({shown[names[0]].attrs.get('units', '')})" if per else f"{axis} ({unit})"
        )
        words = {
            name: _short(name, str(shown[name].attrs.get("long_name", name))) for name in names
        }
        if len(words) == 1:  # has no legend
            label = f"{words[names[0]]}: {label}"
        yield Group(label, words, 1.0 if per else factor)


def _short(name: str, text: str) -> str:
    """Where it is; and along what, where that is not down."""
    where = text.partition(":")[0]
    return where if not name.endswith(("y", "lateral")) else f"{where}, aside"
