"""What paper and screen have in common: how curves look, and how much of one is shown."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import count

import numpy as np

from .chart import Chart, FloatArray, Panel

# Okabe & Ito: told apart by everyone. Neighbours also differ in grey, as far as seven can.
COLORS = ("#0072B2", "#D55E00", "#000000", "#56B4E9", "#009E73", "#E69F00", "#CC79A7")
DASHES: tuple[tuple[float, ...], ...] = (
    (), (5, 2), (7, 1.5, 1.2, 1.5), (1.2, 1.2), (10, 2.5), (5, 1.5, 1.2, 1.5, 1.2, 1.5), (2.5, 1),
)  # fmt: skip
"""On and off, in widths of the line; none: solid."""
WIDTH, THIN = 1.2, 0.8  # points: of a result, and of what it is compared with
GREY = "#888888"
ROLL_OFF = 1e-6  # of the top: below there is roll-off and rounding, nothing to read
_SQUARES = re.compile(r"((?:\b(?:m/s|rad/s|N)|\)))2\b")
_SYMBOL = re.compile(r"\b([A-Za-zκω])_([A-Za-z0-9]+)\b")


@dataclass(frozen=True)
class Look:
    """How a curve is drawn: in colours or in grey told apart from the others of its panel."""

    color: str
    dash: tuple[float, ...] = ()
    width: float = WIDTH

    @property
    def grey(self) -> float:
        """Of the colour on paper without colours, from 0, black, to 1 (ITU-R BT.601)."""
        parts = [int(self.color[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        return float(np.dot((0.299, 0.587, 0.114), parts))


def look(k: int, *, compared: bool = False) -> Look:
    """The k-th look: 49 are apart in colour or in dashes, the first seven in both."""
    dash = DASHES[(k + k // len(COLORS)) % len(DASHES)]
    return Look(COLORS[k % len(COLORS)], dash, THIN if compared else WIDTH)


def looks(chart: Chart) -> dict[str, Look]:
    """One for each name of a curve: the same wherever it is, and another than its neighbours'.

    Neighbours are all curves of a row of panels, which have one legend.
    """
    rows = [
        [c for panel in row if isinstance(panel, Panel) for c in panel.curves] for row in chart.rows
    ]
    names = [{curve.name for curve in row} for row in rows]
    given: dict[str, int] = {}
    found: dict[str, Look] = {}
    for curve in (curve for row in rows for curve in row):
        if curve.name in given:
            continue
        near = set[str]().union(*(row for row in names if curve.name in row))
        taken = {given[name] for name in near if name in given}
        # What is compared with is never the solid line.
        k = next(k for k in count(int(curve.dashed)) if k not in taken)
        given[curve.name] = k
        found[curve.name] = look(k, compared=curve.dashed)
    return found


def on_paper(text: str) -> str:
    """Symbols with an index (``k_H``) as mathtext, units with a raised 2; a dollar stays one."""
    squared = _SQUARES.sub("\\1²", text.replace("$", r"\$"))
    return _SYMBOL.sub(r"$\1_\\mathrm{\2}$", squared)


def on_screen(text: str) -> str:
    """The same for plotly."""
    return _SYMBOL.sub(r"<i>\1</i><sub>\2</sub>", _SQUARES.sub("\\1²", text))


def shown_range(panel: Panel) -> tuple[float, float] | None:
    """Range of y to be shown; None where all of it is."""
    if panel.y_range is not None or not panel.y_log:
        return panel.y_range
    top = max((float(np.max(c.y, initial=0.0)) for c in panel.curves), default=0.0)
    low = min(
        (float(np.min(c.y, where=c.y > 0, initial=np.inf)) for c in panel.curves), default=np.inf
    )
    if not (top > 0 and np.isfinite(top)):
        return None
    return max(ROLL_OFF * top, low / 1.5), 2 * top


def parted(x: FloatArray, y: FloatArray, jump: float) -> tuple[FloatArray, FloatArray]:
    """Both with a gap wherever y jumps by more than this: no line is drawn across."""
    at = np.flatnonzero(np.abs(np.diff(y)) > jump) + 1
    return np.insert(x, at, x[at]), np.insert(y, at, np.nan)
