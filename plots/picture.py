"""Charts on paper: PNG, SVG or PDF by matplotlib."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
from cycler import cycler
from matplotlib import pyplot as plt
from matplotlib.colors import LogNorm

from railcosim.storage.whole import written_whole

from .chart import Chart, FloatArray, Map, Panel
from .labels import Words, along, around, beside_line, fixed, short_log
from .style import COLORS, GREY, Look, look, looks, on_paper, shown_range

WIDTH, HEIGHT = 4.6, 2.9  # of a panel, inch
LEGEND, LETTER = 0.7, 0.07  # of a legend without words, and of a letter, inch
LETTERS = 38  # of the label of y in a line: as many as a panel is high


def line_of(look: Look) -> dict[str, Any]:
    """How matplotlib is told of a look."""
    style = (0, look.dash) if look.dash else "-"
    return {"color": look.color, "linestyle": style, "linewidth": look.width}


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
    "legend.handlelength": 3.2,  # a dash of each kind is seen whole
    "axes.prop_cycle": cycler(color=COLORS)
    + cycler(linestyle=[line_of(look(k))["linestyle"] for k in range(len(COLORS))]),
    "svg.fonttype": "none",  # text stays text
    "svg.hashsalt": "railcosim",  # the same picture is the same file
}


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
    given = looks(chart)
    legend = LEGEND + LETTER * max(map(len, given), default=0)
    size = (max(WIDTH * columns, 1.5 * WIDTH) + legend, HEIGHT * len(chart.rows) + 0.4)
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=size, layout="constrained")
        figure.suptitle(on_paper(chart.title), x=0.01, ha="left", fontsize=10)
        bands = [chart.rows] if chart.share_x else [(row,) for row in chart.rows]
        parts = figure.subfigures(len(bands), 1, squeeze=False)[:, 0]
        words = Words()
        for part, band in zip(parts, bands, strict=True):
            _band(part, band, given, words)
        constrained = figure.get_layout_engine()
        if constrained is not None:
            constrained.execute(figure)
        figure.set_layout_engine("none")  # found once, good for all
        words.settle(figure)
        for path in paths:
            save_figure(figure, path)
        plt.close(figure)


def save_figure(figure: Any, path: Path) -> None:
    """Write a figure of matplotlib, whole; the same picture is the same file."""
    with written_whole(path) as partial:
        figure.savefig(partial, metadata={"Date": None} if path.suffix == ".svg" else {})


def _band(
    figure: Any, rows: tuple[tuple[Panel | Map, ...], ...], given: dict[str, Look], words: Words
) -> None:
    """Rows with one x axis for each column; legends beside rows, once if they are the same."""
    above: set[str] = set()
    grid = figure.subplots(len(rows), len(rows[0]), sharex="col", squeeze=False)
    for axes_of_row, row in zip(grid, rows, strict=True):
        entries: dict[str, Any] = {}
        for axes, panel in zip(axes_of_row, row, strict=True):
            if isinstance(panel, Map):
                _map(figure, axes, panel, words)
            else:
                entries |= _curves(axes, panel, given, words)
                beside = axes
            axes.set_title(on_paper(panel.title))
            axes.set_ylabel(on_paper(fill(panel.y_label, LETTERS)))
            if row is rows[-1]:
                axes.set_xlabel(on_paper(panel.x_label))
        if len(entries) > 1 and set(entries) != above:  # beside the curves, never on them
            beside.legend(
                entries.values(), map(on_paper, entries), loc="upper left", bbox_to_anchor=(1, 1)
            )
        above = set(entries)


def _curves(axes: Any, panel: Panel, given: dict[str, Look], words: Words) -> dict[str, Any]:
    entries = {}
    # A value that a logarithmic axis has no place for is a gap, not a line to the bottom.
    axes.set_xscale("log", nonpositive="mask") if panel.x_log else axes.set_xscale("linear")
    axes.set_yscale("log", nonpositive="mask") if panel.y_log else axes.set_yscale("linear")
    for curve in panel.curves:
        style = line_of(given[curve.name])
        if curve.points:
            style |= {"marker": "o", "markersize": 3.5}
        (entries[curve.name],) = axes.plot(curve.x, curve.y, **style)
    if panel.x_range is not None:
        axes.set_xlim(panel.x_range)
    low_high = shown_range(panel)
    if low_high is not None:
        axes.set_ylim(low_high)
    for axis, log, ticks in (
        (axes.xaxis, panel.x_log, panel.x_ticks),
        (axes.yaxis, panel.y_log, panel.y_ticks),
    ):
        if ticks:
            fixed(axis, ticks)
        elif log:
            short_log(axis, *axis.get_view_interval())
    for mark in panel.marks:
        axes.axvline(mark.x, color=GREY, linewidth=0.7, linestyle=":")
        words.write(
            axes, mark.label, beside_line(mark.x), xycoords=("data", "axes fraction"), rotation=90
        )
    if panel.second_x is not None:
        label, factor = panel.second_x
        top = axes.secondary_xaxis(
            "top", functions=(lambda x: x * factor, lambda x: x / factor)
        )  # fmt: skip
        top.set_xlabel(on_paper(label), fontsize=8)
        axes.spines["top"].set_visible(True)
    return entries


def _map(figure: Any, axes: Any, panel: Map, words: Words) -> None:
    top = float(panel.z.max())
    mesh = axes.pcolormesh(
        panel.x, panel.y, panel.z, shading="nearest", rasterized=True, cmap="viridis",
        norm=LogNorm(top * 10**-panel.decades, top),
    )  # fmt: skip
    axes.grid(False)
    figure.colorbar(mesh, ax=axes, label=on_paper(panel.z_label), pad=0.02)
    axes.set_xlim(panel.x[0], panel.x[-1])
    axes.set_ylim(panel.y[0], panel.y[-1])
    for mark in panel.marks:
        if mark.y is not None:
            axes.plot(mark.x, mark.y, "o", color=COLORS[1], markeredgecolor="white", markersize=5)
            words.write(axes, mark.label, around(mark.x, mark.y), color="black", fontsize=8)
    for curve in panel.curves:
        axes.plot(curve.x, curve.y, color="white", linestyle="--", linewidth=1.0)
        if curve.x.size:
            words.write(axes, curve.name, along(curve.x, curve.y), color="black", fontsize=8)


__all__ = ["FloatArray", "save_picture"]
