"""The picture of a sweep: one variable over its axes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from .chart import Chart, Curve, Panel
from .names import words_of

FEW = 12  # points of a curve that are marked
CURVES, PANELS = 8, 4  # of one panel, and in all: more cannot be told apart


def sweep_chart(
    swept: xr.Dataset, axes: Sequence[str], shown: str | None = None, title: str = ""
) -> Chart:
    """Curves over the variable's own dimension, or over the first axis if it has none.

    Of complex numbers the absolute value. A curve for every value of the next axis and a panel for
    every value of the one behind, as many as can be told apart; of all else the first.

    Raises
    ------
    ValueError
        If there is no such variable.
    """
    name = shown or next(str(n) for n in swept.data_vars)
    if name not in swept.data_vars:
        raise ValueError(f"--show {name}: must be one of {', '.join(map(str, swept.data_vars))}")
    values = swept[name]
    turns = np.iscomplexobj(values)
    if turns:
        values = abs(values)
    first = [str(d) for d in values.dims[: len(axes)]]
    own = [str(d) for d in values.dims[len(axes) :]]
    numeric = [d for d in first if values[d].dtype.kind in "if"]
    along = own[-1] if own else (numeric or first)[0]
    rest = [d for d in (*first, *own[:-1]) if d != along]
    by, over = (rest[0] if rest else None), (rest[1] if len(rest) > 1 else None)
    values = values.isel(dict.fromkeys(rest[2:], 0))
    panels = []
    for k in _chosen(values.sizes[over] if over else 1, PANELS):
        part = values.isel({over: k}) if over else values
        curves = tuple(
            _curve(part.isel({by: i}) if by else part, along, _named(part, by, i))
            for i in _chosen(part.sizes[by] if by else 1, CURVES)
        )
        panels.append(
            (
                Panel(
                    x_label=_label(swept, along), y_label=_label(swept, name), curves=curves,
                    x_log=_even_in_ratios(values[along]) or (turns and _is_wide(values[along])),
                    y_log=turns or _spans_decades(values),
                    x_ticks=_words(values[along]), title=_named(values, over, k) if over else "",
                ),
            )
        )  # fmt: skip
    return Chart(title=title, rows=tuple(panels), share_x=True)


def _curve(values: xr.DataArray, along: str, name: str) -> Curve:
    x = values[along].values
    at = x if x.dtype.kind in "if" else np.arange(x.size)
    return Curve(
        name=name, x=np.asarray(at, float), y=np.asarray(values.values, float),
        points=x.size <= FEW,
    )  # fmt: skip


def _words(x: xr.DataArray) -> tuple[tuple[float, str], ...]:
    """Ticks of an axis of words."""
    return () if x.dtype.kind in "if" else tuple((float(k), str(w)) for k, w in enumerate(x.values))


def _chosen(count: int, most: int) -> list[int]:
    """As many of them, evenly."""
    return sorted({round(x) for x in np.linspace(0, count - 1, min(count, most))})


def _named(values: xr.DataArray, dim: str | None, k: int) -> str:
    if dim is None:
        return str(values.name)
    value = values[dim].values[k]
    if values[dim].dtype.kind not in "if":
        return f"{dim} {value}"
    return f"{dim} = {value:g} {values[dim].attrs.get('units', '')}".rstrip()


def _label(swept: xr.Dataset, name: str) -> str:
    unit = swept[name].attrs.get("units")
    bars = "|{}|" if np.iscomplexobj(swept[name]) else "{}"
    words = ", ".join(words_of(name) or (name,))
    return bars.format(words) + (f" ({unit})" if unit else "")


def _spans_decades(values: xr.DataArray) -> bool:
    """Whether they are all above zero, and some thousand times as large as others."""
    known = values.values[np.isfinite(values.values)]
    return known.size > 0 and bool(known.min() > 0 and known.max() > 1e3 * known.min())


def _is_wide(x: xr.DataArray) -> bool:
    """Whether an axis of a response, which is of frequencies, spans more than a decade."""
    return x.dtype.kind in "if" and bool(x.min() > 0 and x.max() > 10 * x.min())


def _even_in_ratios(x: xr.DataArray) -> bool:
    """Whether values are spaced as a logarithmic axis is."""
    v = x.values
    if v.dtype.kind not in "if" or v.size < 3 or v.min() <= 0:
        return False
    ratios = np.diff(np.log(v.astype(float)))
    return bool(np.ptp(ratios) < 0.01 * np.abs(ratios).max())
