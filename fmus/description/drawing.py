"""Pictures: icons of FMUs and terminals, and the sketch of the sign conventions."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch, Rectangle

from railcosim.mechanics.arrays import FloatArray

DARK, STEEL, BODY, SLAB, SPRING = "#263238", "#546e7a", "#2f6f9f", "#b0bec5", "#c0392b"
REACH = 75  # of the outer wheels, in the icon's 200 x 200; the front is at the right
PIXELS = 256
NO_METADATA = {"svg": {"Date": None, "Creator": None}, "png": {"Software": None}}
Drawing = dict[str, bytes]  # by ending of the file's name


def wheel_places(wheelsets: int) -> tuple[FloatArray, float]:
    """Where an icon has its wheels, and how large they are."""
    places = np.linspace(-REACH, REACH, wheelsets) if wheelsets > 1 else np.zeros(1)
    return places, min(19.0, 0.76 * REACH / max(wheelsets - 1, 1))


@cache
def vehicle_icon(*, with_contact: bool, wheelsets: int, bogies: int, carbodies: int) -> Drawing:
    """Car bodies, bogies and wheels; contact springs below them if the FMU owns these."""

    def draw(axes: Axes) -> None:
        base = -58 if with_contact else -94  # of the wheels
        body = base + 66
        places, r = wheel_places(wheelsets)
        for left, width in _side_by_side(carbodies):
            axes.add_patch(_box(left, body, width, 78, BODY, round_by=min(16, width / 2)))
            for x in np.arange(left + 16, left + width - 35, 34):
                axes.add_patch(_box(x, body + 38, 20, 24, "white", round_by=3))
        carrying = np.array_split(places, bogies) if bogies else places[:, None]
        for wheels in carrying:
            top = base + 2 * r
            if bogies:
                left, width = wheels[0] - 15 * r / 19, np.ptp(wheels) + 30 * r / 19
                axes.add_patch(_box(left, top, width, 13, STEEL, round_by=4))
                top += 13
            _spring(axes, wheels.mean(), top, body, 7 * r / 19)
        for x in places:
            axes.add_patch(
                Circle((x, base + r), r, facecolor="white", edgecolor=DARK, lw=4 * r / 19)
            )
            axes.add_patch(Circle((x, base + r), 4 * r / 19, color=DARK))
            if with_contact:
                _spring(axes, x, -98, base - 2, 8 * r / 19, SPRING)

    return _icon(draw)


def _side_by_side(count: int) -> list[tuple[float, float]]:
    """Left end and width of so many boxes over the icon."""
    apart = min(6.0, 94 / count)
    width = (188 + apart) / count - apart
    return [(-94 + k * (width + apart), width) for k in range(count)]


@cache
def track_icon(*, with_contact: bool, wheelsets: int) -> Drawing:
    """Rail on fastenings on slabs; contact springs above if the FMU owns them."""

    def draw(axes: Axes) -> None:
        rail = 44 if with_contact else 82
        if with_contact:
            places, r = wheel_places(wheelsets)
            for x in places:
                _spring(axes, x, rail + 14, 98, 8 * r / 19, SPRING)
        axes.add_patch(Rectangle((-96, rail), 192, 14, color=STEEL))
        for x in np.linspace(-80, 80, 6):
            axes.add_patch(Rectangle((x - 7, rail - 16), 14, 16, color=DARK))
            _spring(axes, x, rail - 104, rail - 54, 8)
        for x in (-96, 2):
            slab = Rectangle((x, rail - 54), 94, 38, facecolor=SLAB, edgecolor=DARK, lw=2)
            axes.add_patch(slab)
        axes.plot([-96, 96], [rail - 104] * 2, color=DARK, lw=3)
        for x in range(-88, 100, 16):
            axes.plot([x, x - 9], [rail - 104, rail - 117], color=DARK, lw=1.5)

    return _icon(draw)


@cache
def wheel_icon() -> Drawing:
    """A terminal: a wheel."""

    def draw(axes: Axes) -> None:
        axes.add_patch(Circle((0, 0), 84, facecolor="white", edgecolor=DARK, lw=14))
        axes.add_patch(Circle((0, 0), 18, color=DARK))

    return _icon(draw)


@cache
def signs() -> Drawing:
    """The sketch of the sign conventions."""

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2, width_ratios=[1.55, 1])
        _side_view(left)
        _one_contact(right)

    return drawn(draw, (9.6, 3.9))


def _side_view(axes: Axes) -> None:
    axes.set(xlim=(-118, 118), ylim=(-108, 100), aspect="equal")
    axes.axis("off")
    axes.add_patch(_box(-100, -2, 200, 56, BODY, round_by=12))
    axes.text(0, 26, "carbody", color="white", ha="center", va="center")
    for centre, j in ((-58, 2), (58, 1)):
        axes.add_patch(_box(centre - 38, -30, 76, 12, STEEL, round_by=4))
        axes.text(centre, -24, f"bogie[{j}]", color="white", ha="center", va="center", size=7.5)
        _spring(axes, centre, -18, -2, 5)
    for i, x in zip((4, 3, 2, 1), (-84, -32, 32, 84), strict=True):
        axes.add_patch(Circle((x, -50), 18, facecolor="white", edgecolor=DARK, lw=3))
        axes.text(x, -50, str(i), ha="center", va="center")
    axes.add_patch(Rectangle((-114, -76), 228, 7, color=STEEL))
    for x in np.linspace(-104, 104, 14):
        axes.add_patch(Rectangle((x - 3, -83), 6, 7, color=DARK))
    axes.add_patch(Rectangle((-114, -97), 112, 14, facecolor=SLAB, edgecolor=DARK, lw=1))
    axes.add_patch(Rectangle((2, -97), 112, 14, facecolor=SLAB, edgecolor=DARK, lw=1))
    _arrow(axes, (-14, 84), (34, 84), DARK, "x, forward", (38, 84))
    _arrow(axes, (-14, 84), (-14, 58), DARK, "z, down", (-10, 65))
    axes.text(-20, 84, "y, to the right,\ntowards you", ha="right", va="center", size=8)
    axes.text(
        0, -105, "wheelset[1], wheelset[2] ... from the front", ha="center", va="center", size=8
    )


def _one_contact(axes: Axes) -> None:
    """Wheel and rail apart, so that there is room for arrows."""
    axes.set(xlim=(-80, 86), ylim=(-108, 100), aspect="equal")
    axes.axis("off")
    axes.add_patch(Circle((0, 58), 30, facecolor="white", edgecolor=DARK, lw=3))
    axes.add_patch(Rectangle((-50, -62), 100, 10, color=STEEL))
    x = np.linspace(-50, 50, 101)
    axes.plot(x, -48 - 6 * np.sin(x / 9) * np.exp(-((x / 30) ** 2)), color=SPRING, lw=1.2)
    _arrow(axes, (0, -2), (0, 27), SPRING)
    _arrow(axes, (0, -12), (0, -44), SPRING)
    axes.text(6, -7, "force_z\n(compression > 0)", color=SPRING, va="center", size=8.5)
    _arrow(axes, (-44, 70), (-44, 42), BODY, "wheel_z", (-46, 78), align="center")
    _arrow(axes, (-60, -46), (-60, -74), BODY, "rail_z", (-60, -38), align="center")
    axes.text(53, -48, "irregularity_z\n(surface, down)", color=SPRING, va="center", size=7)
    axes.text(
        0, -96, "compression = wheel_z - rail_z - irregularity_z", ha="center", va="center", size=8
    )


def drawn(
    draw: Callable[[Figure], None],
    inches: tuple[float, float],
    endings: Sequence[str] = ("png", "svg"),
) -> Drawing:
    """A figure as PNG and SVG, the same bytes each time."""
    files = {}
    # Text stays text in the SVG; a fixed salt gives its parts fixed names.
    with rc_context({"svg.hashsalt": "railcosim", "svg.fonttype": "none", "font.size": 9}):
        figure = Figure(figsize=inches, layout="constrained")
        draw(figure)
        for ending in endings:
            buffer = io.BytesIO()
            # Neither the time nor matplotlib's version, so that equal FMUs are equal.
            figure.savefig(buffer, format=ending, dpi=144, metadata=NO_METADATA[ending])
            files[ending] = buffer.getvalue()
    return files


def _icon(draw: Callable[[Axes], None]) -> Drawing:
    def square(figure: Figure) -> None:
        figure.set_layout_engine("none")
        figure.patch.set_alpha(0)
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set(xlim=(-100, 100), ylim=(-100, 100))
        axes.axis("off")
        draw(axes)

    side = PIXELS / 144
    return drawn(square, (side, side))


def _box(
    x: float, y: float, width: float, height: float, colour: str, *, round_by: float
) -> FancyBboxPatch:
    r = round_by
    return FancyBboxPatch(
        (x + r, y + r), width - 2 * r, height - 2 * r, boxstyle=f"round,pad={r}", lw=0, color=colour
    )


def _spring(
    axes: Axes, x: float, bottom: float, top: float, width: float, colour: str = DARK
) -> None:
    y = np.linspace(bottom, top, 10)
    zigzag = np.array([0, 0, 1, -1, 1, -1, 1, -1, 0, 0]) * width
    line = min(1.6, 0.4 * width)
    axes.plot(x + zigzag, y, color=colour, lw=line, solid_joinstyle="round")


def _arrow(
    axes: Axes,
    start: tuple[float, float],
    end: tuple[float, float],
    colour: str,
    text: str = "",
    at: tuple[float, float] = (0, 0),
    align: str = "left",
) -> None:
    style = {"arrowstyle": "-|>", "color": colour, "lw": 1.8, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=end, xytext=start, arrowprops=style)
    axes.text(*at, text, color=colour, ha=align, va="center", size=8.5)
