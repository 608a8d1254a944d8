"""What a chart shows, apart from how it is drawn."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Curve:
    """A line through points.

    Attributes
    ----------
    name : str
        For the legend; curves of one name look alike in all panels of a chart.
    x, y : array, shape (n,)
        In the panel's units.
    dashed : bool
        Something to compare with rather than the result: thin, and never solid.
    points : bool
        Its points are marked.
    """

    name: str
    x: FloatArray
    y: FloatArray
    dashed: bool = False
    points: bool = False


@dataclass(frozen=True, kw_only=True)
class Mark:
    """A labelled place: a point, or without `y` a vertical line across the panel."""

    label: str
    x: float
    y: float | None = None


@dataclass(frozen=True, kw_only=True)
class Panel:
    """Curves over one axis.

    Attributes
    ----------
    x_label, y_label : str
        With units.
    curves : tuple of Curve
        In the order of the legend.
    marks : tuple of Mark
        Drawn over the curves.
    x_log, y_log : bool
        Logarithmic axes.
    x_range, y_range : tuple of float, optional
        What is shown; all of it if None.
    x_ticks, y_ticks : tuple of (float, str)
        Places on an axis and what is written there; of its own choice if empty.
    second_x : tuple of (str, float), optional
        Label of a second x axis on top, and its value per unit of the first one.
    title : str
        Above the panel.
    """

    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    marks: tuple[Mark, ...] = ()
    x_log: bool = False
    y_log: bool = False
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    x_ticks: tuple[tuple[float, str], ...] = ()
    y_ticks: tuple[tuple[float, str], ...] = ()
    second_x: tuple[str, float] | None = None
    title: str = ""


@dataclass(frozen=True, kw_only=True)
class Map:
    """A quantity over a plane, as colours on a logarithmic scale.

    Attributes
    ----------
    x, y : array, shape (n_x,), (n_y,)
        Increasing.
    z : array, shape (n_y, n_x)
        Positive.
    x_label, y_label, z_label : str
        With units.
    curves : tuple of Curve
        Drawn over the map, for instance where a frequency is a resonance.
    marks : tuple of Mark
        Points, for instance critical speeds.
    decades : float
        Colours span so many decades below the largest value.
    title : str
        Above the panel.
    """

    x: FloatArray
    y: FloatArray
    z: FloatArray
    x_label: str
    y_label: str
    z_label: str
    curves: tuple[Curve, ...] = ()
    marks: tuple[Mark, ...] = ()
    decades: float = 3.0
    title: str = ""


@dataclass(frozen=True, kw_only=True)
class Chart:
    """Panels in rows and columns.

    Attributes
    ----------
    title : str
        Above everything.
    rows : tuple of tuple of (Panel or Map)
        From the top, each from the left; rows may differ in length.
    share_x : bool
        Panels of a column have one x axis, labelled at the lowest.
    """

    title: str
    rows: tuple[tuple[Panel | Map, ...], ...] = field(default=())
    share_x: bool = False
