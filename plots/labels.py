"""Words within a picture that do not lie on each other, and ticks of short logarithmic axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import patheffects
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter
from matplotlib.transforms import Bbox

from .style import on_paper

OUTLINE = [patheffects.withStroke(linewidth=2.2, foreground="white")]
SHORT = 1.5  # decades: of fewer, also 2 and 5 are labelled
PLAIN = 1e-3, 1e5  # numbers between are written as they are, others as powers
APART = 1.5  # px between words
CROSSED = 0.1  # a curve behind words, as so much of their area on other words: they have an outline


@dataclass(frozen=True)
class Spot:
    """Where words may stand.

    Attributes
    ----------
    xy : tuple of float
        What they belong to, in the annotation's coordinates.
    offset : tuple of float
        From there, points.
    align : tuple of str
        Of the words, across and up.
    """

    xy: tuple[float, float]
    offset: tuple[float, float]
    align: tuple[str, str]

    def put(self, text: Any) -> None:
        """Move words here."""
        text.xy, text.xyann = self.xy, self.offset
        text.set(ha=self.align[0], va=self.align[1])


class Words:
    """The words of a picture: each is written where it first fits."""

    def __init__(self) -> None:
        self._all: list[tuple[Any, list[Spot]]] = []

    def write(self, axes: Any, text: str, spots: Sequence[Spot], **look: Any) -> None:
        """Write at the first of several spots; `settle` may choose another."""
        if not text:
            return
        look = {"color": "0.2", "fontsize": 7.5, "path_effects": OUTLINE, **look}
        written = axes.annotate(
            on_paper(text), spots[0].xy, xytext=spots[0].offset, textcoords="offset points",
            annotation_clip=True, zorder=5, **look,
        )  # fmt: skip
        written.set_in_layout(False)
        spots[0].put(written)
        self._all.append((written, list(spots)))

    def settle(self, figure: Any) -> None:
        """Choose spots, the layout being done: within the axes, and off each other."""
        renderer = figure.canvas.get_renderer()
        taken: dict[Any, list[Bbox]] = {}
        for text, spots in self._all:
            others = taken.setdefault(text.axes, [])
            curves = [_drawn(line) for line in text.axes.lines if line.get_linestyle() != ":"]
            costs = []
            for spot in spots:
                spot.put(text)
                costs.append(_cost(_box(text, renderer), others, curves, text.axes.bbox))
            spots[costs.index(min(costs))].put(text)
            others.append(_box(text, renderer))


def _box(text: Any, renderer: Any) -> Bbox:
    return Bbox(text.get_window_extent(renderer)).padded(APART)


def _drawn(line: Any) -> Any:
    """A curve as a path in pixels."""
    return line.get_transform().transform_path(line.get_path()).cleaned(remove_nans=True)


def _cost(box: Bbox, others: list[Bbox], curves: list[Any], inside: Bbox) -> float:
    """Of a box, in parts of its area: what lies outside or on others, and curves it lies on."""
    area = box.width * box.height
    shared = Bbox.intersection(box, inside)
    on = (Bbox.intersection(box, other) for other in others)
    lost = area - (shared.width * shared.height if shared else 0.0)
    lost += sum(both.width * both.height for both in on if both)
    crossed = sum(path.intersects_bbox(box, filled=False) for path in curves)
    return float(lost / area + CROSSED * crossed)


def beside_line(x: float) -> list[Spot]:
    """Spots of words that are written along a vertical line."""
    return [
        Spot((x, y), (2.0 * side, 0.0), ("right" if side < 0 else "left", "bottom"))
        for y in (0.02, 0.3, 0.58)
        for side in (-1, 1)
    ]


def around(x: float, y: float) -> list[Spot]:
    """Spots about a point."""
    turns = ((1, 1), (-1, 1), (1, -1), (-1, -1))
    return [
        Spot(
            (x, y), (a * far, b * far),
            ("left" if a > 0 else "right", "bottom" if b > 0 else "top"),
        )
        for far in (4.0, 9.0)
        for a, b in turns
    ]  # fmt: skip


def along(x: Any, y: Any) -> list[Spot]:
    """Spots along a curve, below and above it."""
    if not len(x):
        return []
    at = [int(part * (len(x) - 1)) for part in (0.75, 0.5, 0.9, 0.3)]
    return [spot for k in at for spot in around(float(x[k]), float(y[k]))[2:4]]


def short_log(axis: Any, low: float, high: float) -> None:
    """Ticks of a logarithmic axis: labelled where there is room, in plain numbers if they are."""
    decades = np.log10(high / low)
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if decades < SHORT else (1.0,)))
    if decades < SHORT:
        axis.set_minor_locator(LogLocator(subs=[float(d) for d in range(1, 10)]))
    axis.set_minor_formatter(NullFormatter())
    if PLAIN[0] <= low and high <= PLAIN[1]:
        axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    elif decades < SHORT:
        axis.set_major_formatter(FuncFormatter(lambda v, _: _power(v)))


def _power(value: float) -> str:
    exponent = int(np.floor(np.log10(value) + 1e-9))
    digit = round(value / 10.0**exponent)
    return f"$10^{{{exponent}}}$" if digit == 1 else rf"${digit}\cdot 10^{{{exponent}}}$"


def fixed(axis: Any, ticks: Sequence[tuple[float, str]]) -> None:
    """Ticks at given places with given words."""
    axis.set_major_locator(FixedLocator([place for place, _ in ticks]))
    axis.set_ticklabels([on_paper(words) for _, words in ticks])
    axis.set_minor_formatter(NullFormatter())
