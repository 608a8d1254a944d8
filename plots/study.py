"""Order and work-precision diagrams of a study of schemes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import pyplot as plt

from .labels import short_log
from .picture import STYLE, line_of, save_figure
from .style import GREY
from .style import look as k_th_look

WIDTH, HEIGHT, LEGEND = 3.6, 3.2, 3.4  # inch, of a panel and of the legend
TOP = 3.0  # of the errors shown; what is unstable is marked there
UNSTABLE = 1.0  # relative error from which nothing is left of the solution
LOWEST = 1e-12
MARKERS = {1: "o", 2: "s", 3: "^", 4: "D"}  # by order
WORDS = ("constant", "linear", "quadratic")
DIAGRAMS = [  # label of x, and x from a scheme's row of the table
    ("communication step (s)", lambda row: row["step"].values),
    (
        "steps of each component per simulated second",
        lambda row: row["evaluations"].values / row["step"].values,
    ),
]


def save_study_picture(table: xr.Dataset, path: Path) -> None:
    """Draw error over step, and over cost, by contact (rows) and owner (columns).

    Parameters
    ----------
    table : xarray.Dataset
        With dimensions scheme, owner, contact and step, and `error`, `evaluations` and `order`.
    path : Path
        ``.png``, ``.svg`` or ``.pdf``.
    """
    contacts, owners = table["contact"].values, table["owner"].values
    n_rows, n_columns = 2 * len(contacts), len(owners)
    looks = _looks(table)
    low = _lowest(table)
    with plt.rc_context(STYLE):
        size = WIDTH * n_columns + LEGEND, HEIGHT * n_rows + 0.4
        figure, grid = plt.subplots(
            n_rows, n_columns, figsize=size, squeeze=False, sharey=True, layout="constrained"
        )
        entries: dict[str, Any] = {}
        for row, (contact, (label, cost)) in enumerate(
            (contact, diagram) for contact in contacts for diagram in DIAGRAMS
        ):
            for axes, owner in zip(grid[row], owners, strict=True):
                part = table.sel(contact=contact, owner=owner)
                entries |= _curves(axes, part, cost, looks)
                _frame(axes, label, low)
                if row % 2 == 0:
                    axes.set_title(f"contact {contact} in the {owner}")
                    _triangles(axes, part, low)
            compared = table.attrs.get("compared", "the contact forces").removeprefix("the ")
            grid[row][0].set_ylabel(f"relative error of {compared}")
        ordered = [name for name in looks if name in entries]
        figure.legend(
            [entries[name] for name in ordered], ordered, loc="outside right upper", fontsize=8
        )
        figure.suptitle(
            f"Error against {table.attrs.get('held_to', 'the monolithic solution')} (× at the top: "
            "unstable)",
            x=0.01, ha="left", fontsize=10,
        )  # fmt: skip
        save_figure(figure, path)
        plt.close(figure)


def _looks(table: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Choose a look by kind of scheme, a marker by order."""
    stems: dict[str, int] = {}
    looks = {}
    for name, order in zip(table["scheme"].values, table["order"].values.tolist(), strict=True):
        stem = "-".join(part for part in str(name).split("-") if part not in WORDS)
        k = stems.setdefault(stem, len(stems))
        looks[str(name)] = {**line_of(k_th_look(k)), "marker": MARKERS.get(order, "*")}
    return looks


def _lowest(table: xr.Dataset) -> float:
    """Find the lower end of the axis of errors, in whole decades."""
    error = table["error"].values
    stable = error[(error > LOWEST) & (error < UNSTABLE)]
    return float(10 ** np.floor(np.log10(stable.min()) - 0.3)) if stable.size else 1e-3


def _curves(
    axes: Any, part: xr.Dataset, cost: Any, looks: dict[str, dict[str, Any]]
) -> dict[str, Any]:
    """Draw all schemes; where one is unstable its curve has a gap and a cross at the top."""
    entries = {}
    crosses: dict[float, int] = {}
    for name, look in looks.items():
        row = part.sel(scheme=name)
        error = row["error"].values
        if np.isnan(error).all():
            continue
        x = np.where(np.isfinite(cost(row)), cost(row), 1.0 / row["step"].values)
        stable = error < UNSTABLE
        (entries[name],) = axes.plot(
            x, np.where(stable, np.maximum(error, LOWEST), np.nan), markersize=4, **look
        )
        for place in x[~stable & ~np.isnan(error)]:
            # Below one another, so that all of them are seen.
            k = crosses[place] = crosses.get(place, -1) + 1
            axes.plot(place, TOP / 1.6**k, "x", color=look["color"], markersize=4)
    return entries


def _frame(axes: Any, label: str, low: float) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    short_log(axes.xaxis, *axes.get_xlim())
    axes.set_ylim(low, 2 * TOP)
    axes.set_xlabel(label)


def _triangles(axes: Any, part: xr.Dataset, low: float) -> None:
    """Draw the slopes claimed from one corner at the lower right, where few curves come."""
    right = float(part["step"].values.max())
    left = right / 4.0
    for order in sorted(set(part["order"].values.tolist())):
        top = 2.0 * low * 4.0**order
        axes.plot(
            [left, right, right],
            [2.0 * low, top, 2.0 * low],
            color=GREY,
            linewidth=0.7,
            linestyle="-",
        )
        axes.annotate(
            str(order), (right, top), xytext=(3, -3), textcoords="offset points", fontsize=7,
            color="0.35",
        )  # fmt: skip
