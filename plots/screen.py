"""Charts on screens: hover and zoom, by plotly."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.offline import get_plotlyjs
from plotly.subplots import make_subplots

from .chart import Chart, FloatArray, Map, Panel
from .style import GREY, Look, looks, on_screen, shown_range

HEIGHT = 340  # of a row, px
NEAR = 0.08  # of the width of a map, between points: nearer, words stand on other sides
CELLS = 160  # of a map each way: what a screen can show of it beside others
POINTS = 1500  # of a curve


def plotly_script() -> str:
    """The script that every page with charts needs once, inline."""
    return f"<script>{get_plotlyjs()}</script>"


def interactive(chart: Chart, name: str) -> str:
    """A chart as HTML: an element called `name` and the script that fills it.

    Parameters
    ----------
    chart : Chart
        What it shows.
    name : str
        Unique in the page.
    """
    columns = max(len(row) for row in chart.rows)
    specs: list[list[Any]] = [
        # A single panel is as wide as its row.
        [{"colspan": columns}, *[None] * (columns - 1)] if len(row) == 1 else [{}] * columns
        for row in chart.rows
    ]
    titles = [on_screen(panel.title) for row in chart.rows for panel in row]
    figure = make_subplots(
        rows=len(chart.rows), cols=columns, specs=specs, subplot_titles=titles,
        horizontal_spacing=0.12, vertical_spacing=min(0.2, 0.36 / len(chart.rows)),
    )  # fmt: skip
    given, above = looks(chart), set[str]()
    for i, row in enumerate(chart.rows, 1):
        names = {c.name for panel in row if isinstance(panel, Panel) for c in panel.curves}
        named = set(names) if names == above or len(names) == 1 else set[str]()
        above = names
        for j, panel in enumerate(row, 1):
            if isinstance(panel, Map):
                _map(figure, panel, i, j)
            else:
                _curves(figure, panel, i, j, named, given)
            figure.update_xaxes(title_text=on_screen(panel.x_label), row=i, col=j)
            figure.update_yaxes(title_text=on_screen(panel.y_label), row=i, col=j)
        top = figure.get_subplot(i, 1).yaxis.domain[1]
        figure.update_layout({_legend(i): {"x": 1.01, "y": top, "yanchor": "top"}})
    figure.update_layout(
        template="plotly_white", height=HEIGHT * len(chart.rows) + 80, margin=_margin(),
        font={"size": 12},
    )  # fmt: skip
    html: str = figure.to_html(
        full_html=False, include_plotlyjs=False, div_id=name,
        config={"responsive": True, "displaylogo": False},
    )  # fmt: skip
    return html


def _margin() -> dict[str, int]:
    return {"l": 70, "r": 20, "t": 50, "b": 60}


def _legend(i: int) -> str:
    """Name of a row's legend, beside it: what looks alike in two rows is told in each."""
    return "legend" if i == 1 else f"legend{i}"


def _curves(
    figure: Any, panel: Panel, i: int, j: int, named: set[str], given: dict[str, Look]
) -> None:
    """Draw curves; those named already are not in the legend again."""
    for curve in panel.curves:
        look = given[curve.name]
        width = 1.4 * look.width
        x, y = thinned(curve.x, curve.y, log=panel.x_log)
        if panel.y_log:
            y = np.where(y > 0, y, np.nan)
        figure.add_trace(
            go.Scatter(
                x=x, y=y, name=on_screen(curve.name), legendgroup=curve.name,
                mode="lines+markers" if curve.points else "lines",
                legend=_legend(i), showlegend=curve.name not in named,
                line={"color": look.color, "width": width,
                      "dash": ",".join(f"{width * d:.3g}px" for d in look.dash) or "solid"},
                hovertemplate=f"%{{x:.4g}}, %{{y:.3e}}<extra>{curve.name}</extra>",
            ),
            row=i, col=j,
        )  # fmt: skip
        named.add(curve.name)
    for mark in panel.marks:
        figure.add_vline(
            x=mark.x, line={"color": GREY, "width": 1, "dash": "dot"}, row=i, col=j
        )  # fmt: skip
        axes = figure.get_subplot(i, j)
        figure.add_annotation(  # placed in powers on a logarithmic axis
            x=np.log10(mark.x) if panel.x_log else mark.x, y=0,
            xref=axes.xaxis.plotly_name.replace("axis", ""),
            yref=axes.yaxis.plotly_name.replace("axis", "") + " domain", text=on_screen(mark.label),
            showarrow=False, textangle=-90, xanchor="right", yanchor="bottom",
            font={"size": 10, "color": "#555555"},
        )  # fmt: skip
    # A logarithmic axis is drawn over powers; plotly wants the range in them, too.
    for axis, log, shown, ticks in (
        ("xaxis", panel.x_log, panel.x_range, panel.x_ticks),
        ("yaxis", panel.y_log, shown_range(panel), panel.y_ticks),
    ):
        update = figure.update_xaxes if axis == "xaxis" else figure.update_yaxes
        update(type="log" if log else "linear", row=i, col=j)
        if ticks:
            places, words = zip(*ticks, strict=True)
            update(tickvals=places, ticktext=[on_screen(word) for word in words], row=i, col=j)
        if shown is not None:
            update(range=np.log10(shown).tolist() if log else list(shown), row=i, col=j)
        if log:
            update(exponentformat="power", dtick=1 if axis == "xaxis" else None, row=i, col=j)
    if panel.second_x is not None:
        _second(figure, panel, i, j)


def _second(figure: Any, panel: Panel, i: int, j: int) -> None:
    """Say the second axis in the ticks of the first: both stay right when zoomed."""
    label, factor = panel.second_x or ("", 1.0)
    for trace in figure.select_traces(row=i, col=j):
        trace.customdata = factor * np.asarray(trace.x)
        trace.hovertemplate = (
            f"%{{x:.4g}}, %{{y:.3e}}<br>{label}: %{{customdata:.4g}}<extra>{trace.name}</extra>"
        )


def _map(figure: Any, panel: Map, i: int, j: int) -> None:
    x, y = (a[:: max(1, -(-a.size // CELLS))] for a in (panel.x, panel.y))
    steps = [max(1, -(-a.size // CELLS)) for a in (panel.y, panel.x)]
    z = panel.z[:: steps[0], :: steps[1]].astype(np.float32)
    top = float(np.log10(panel.z.max()))
    domain = figure.get_subplot(i, j)
    ticks = np.arange(np.ceil(top - panel.decades), np.floor(top) + 1)
    figure.add_trace(
        go.Heatmap(
            x=x.astype(np.float32), y=y.astype(np.float32), z=np.log10(z), colorscale="Viridis",
            zmin=top - panel.decades, zmax=top, zsmooth="best",
            colorbar={
                "title": {"text": on_screen(panel.z_label), "side": "right"}, "tickvals": ticks,
                "ticktext": [f"1e{t:.0f}" for t in ticks], "thickness": 14,
                "x": domain.xaxis.domain[1] + 0.01, "len": np.diff(domain.yaxis.domain)[0],
                "y": float(np.mean(domain.yaxis.domain)),
            },
            hovertemplate=f"{panel.x_label} %{{x:.3g}}<br>{panel.y_label} %{{y:.4g}}<br>"
            "1e%{z:.2f}<extra></extra>",
        ),
        row=i, col=j,
    )  # fmt: skip
    for curve in panel.curves:
        figure.add_trace(
            go.Scatter(
                x=curve.x, y=curve.y, mode="lines", name=curve.name, showlegend=False,
                line={"color": "white", "dash": "dash", "width": 1.5},
                hovertemplate=f"{curve.name}<extra></extra>",
            ),
            row=i, col=j,
        )  # fmt: skip
    points = [mark for mark in panel.marks if mark.y is not None]
    if points:
        figure.add_trace(
            go.Scatter(
                x=[m.x for m in points], y=[m.y for m in points], mode="markers+text",
                text=[on_screen(m.label) for m in points], showlegend=False,
                textposition=_beside([m.x for m in points], NEAR * float(np.ptp(panel.x))),
                textfont={"color": "white"},
                marker={"color": "#D55E00", "size": 9, "line": {"color": "white", "width": 1}},
                hovertemplate="%{text}: %{x:.2f}, %{y:.1f}<extra></extra>",
            ),
            row=i, col=j,
        )  # fmt: skip
    figure.update_xaxes(range=[float(panel.x[0]), float(panel.x[-1])], row=i, col=j)
    figure.update_yaxes(range=[float(panel.y[0]), float(panel.y[-1])], row=i, col=j)


def _beside(places: list[float], near: float) -> list[str]:
    """To the left of a point whose next one to the right is near, that words keep apart."""
    gaps = [min((b - a for b in places if b > a), default=np.inf) for a in places]
    return ["top left" if gap < near else "top right" for gap in gaps]


def thinned(x: FloatArray, y: FloatArray, *, log: bool = False) -> tuple[FloatArray, FloatArray]:
    """At most some `POINTS` points of a curve: the lowest and the highest of equal shares of x.

    Peaks are kept, which leaving out every other point would lose.

    Parameters
    ----------
    x, y : array, shape (n,)
        x increasing.
    log : bool
        Shares of a logarithmic axis, which shows x > 0 only.
    """
    if log:
        x, y = x[x > 0], y[x > 0]
    if x.size <= POINTS:
        return x, y
    place = np.log(x) if log else x
    share = (place - place[0]) / (place[-1] - place[0]) * (POINTS / 2)
    starts = np.flatnonzero(np.diff(np.floor(share), prepend=-1))
    kept = {0, x.size - 1}
    for begin, end in pairwise([*starts.tolist(), x.size]):
        kept |= {begin + int(np.argmin(y[begin:end])), begin + int(np.argmax(y[begin:end]))}
    at = np.array(sorted(kept))
    return x[at], y[at]
