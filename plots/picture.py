"""Charts on paper: PNG, SVG or PDF by matplotlib."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
from cycler import cycler
from matplotlib import patheffects
from matplotlib import pyplot as plt
from matplotlib.colors import LogNorm

from railcosim.storage.whole import written_whole

from .chart import Chart, FloatArray, Map, Panel
from .style import COLORS, GREY, color_of, is_dashed, shown_range

WIDTH, HEIGHT = 4.6, 2.9  # of a panel, inch
STYLE: Any = {
    "figure.dpi": 150,
    "font.size": 9,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "0.88",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "axes.prop_cycle": cycler(color=COLORS),
    "lines.linewidth": 1.1,
    "svg.fonttype": "none",  # text stays text
    "svg.hashsalt": "railcosim",  # the same picture is the same file
}
OUTLINE = [patheffects.withStroke(linewidth=2.2, foreground="white")]


def save_picture(chart: Chart, *paths: Path) -> None:
    """Draw a chart into files.

    Parameters
    ----------
    chart : Chart
        What it shows.
    *paths : Path
        ``.png``, ``.svg`` or ``.pdf``.
    """
    columns = max(len(row) for row in chart.rows)
    size = (max(WIDTH * columns, 1.5 * WIDTH) + 1.2, HEIGHT * len(chart.rows) + 0.4)
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=size, layout="constrained")
        figure.suptitle(chart.title, x=0.01, ha="left", fontsize=10)
        bands = [chart.rows] if chart.share_x else [(row,) for row in chart.rows]
        parts = figure.subfigures(len(bands), 1, squeeze=False)[:, 0]
        for part, band in zip(parts, bands, strict=True):
            _band(part, band)
        for path in paths:
            save_figure(figure, path)
            figure.set_layout_engine("none")  # found once, good for all
        plt.close(figure)


def save_figure(figure: Any, path: Path) -> None:
    """Write a figure of matplotlib, whole; the same picture is the same file."""
    with written_whole(path) as partial:
        figure.savefig(partial, metadata={"Date": None} if path.suffix == ".svg" else {})


def _band(figure: Any, rows: tuple[tuple[Panel | Map, ...], ...]) -> None:
    """Rows with one x axis for each column; legends beside rows, once if they look alike."""
    above: dict[str, Any] = {}
    grid = figure.subplots(len(rows), len(rows[0]), sharex="col", squeeze=False)
    for axes_of_row, row in zip(grid, rows, strict=True):
        entries: dict[str, Any] = {}
        for axes, panel in zip(axes_of_row, row, strict=True):
            if isinstance(panel, Map):
                _map(figure, axes, panel)
            else:
                entries |= _curves(axes, panel)
                beside = axes
            axes.set_title(panel.title)
            axes.set_ylabel(panel.y_label)
            if row is rows[-1]:
                axes.set_xlabel(panel.x_label)
        looks = {name: (line.get_color(), line.get_linestyle()) for name, line in entries.items()}
        if len(looks) > 1 and looks != above:  # beside the curves, never on them
            beside.legend(entries.values(), entries.keys(), loc="upper left", bbox_to_anchor=(1, 1))
        above = looks


def _curves(axes: Any, panel: Panel) -> dict[str, Any]:
    entries = {}
    axes.set_xscale("log" if panel.x_log else "linear")
    axes.set_yscale("log" if panel.y_log else "linear")
    for k, curve in enumerate(panel.curves):
        style = {"color": color_of(panel, k), "linestyle": "--" if is_dashed(panel, k) else "-"}
        (entries[curve.name],) = axes.plot(curve.x, curve.y, label=curve.name, **style)
    if panel.x_range is not None:
        axes.set_xlim(panel.x_range)
    low_high = shown_range(panel)
    if low_high is not None:
        axes.set_ylim(low_high)
    for mark in panel.marks:
        axes.axvline(mark.x, color=GREY, linewidth=0.7, linestyle=":")
        axes.annotate(
            mark.label, (mark.x, 0.02), xycoords=("data", "axes fraction"), rotation=90,
            xytext=(-2, 0), textcoords="offset points", ha="right", va="bottom", fontsize=7,
            color="0.35", path_effects=OUTLINE,
        )  # fmt: skip
    if panel.second_x is not None:
        label, factor = panel.second_x
        top = axes.secondary_xaxis(
            "top", functions=(lambda x: x * factor, lambda x: x / factor)
        )  # fmt: skip
        top.set_xlabel(label, fontsize=8)
        axes.spines["top"].set_visible(True)
    return entries


def _map(figure: Any, axes: Any, panel: Map) -> None:
    top = float(panel.z.max())
    mesh = axes.pcolormesh(
        panel.x, panel.y, panel.z, shading="nearest", rasterized=True, cmap="viridis",
        norm=LogNorm(top * 10**-panel.decades, top),
    )  # fmt: skip
    axes.grid(False)
    figure.colorbar(mesh, ax=axes, label=panel.z_label, pad=0.02)
    for curve in panel.curves:
        axes.plot(curve.x, curve.y, color="white", linestyle="--", linewidth=1.0)
        at = int(0.75 * (curve.x.size - 1))
        _label(axes, curve.name, float(curve.x[at]), float(curve.y[at]), (4, -10))
    for mark in panel.marks:
        if mark.y is not None:
            axes.plot(mark.x, mark.y, "o", color="#D55E00", markeredgecolor="white", markersize=5)
            _label(axes, mark.label, mark.x, mark.y, (6, 5))
    axes.set_xlim(panel.x[0], panel.x[-1])
    axes.set_ylim(panel.y[0], panel.y[-1])


def _label(axes: Any, text: str, x: float, y: float, offset: tuple[float, float]) -> None:
    axes.annotate(
        text, (x, y), xytext=offset, textcoords="offset points", fontsize=8, color="black",
        path_effects=OUTLINE, annotation_clip=True,
    )  # fmt: skip


__all__ = ["FloatArray", "save_picture"]
