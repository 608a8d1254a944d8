"""One picture of curves from several results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from railcosim.analysis.overlay import Line
from railcosim.plots.chart import Chart, Curve, FloatArray, Panel
from railcosim.plots.names import LONGEST, words_of
from railcosim.plots.results import phase_panel

LEGIBLE = 40  # turns of a phase that can still be told apart
FEW = 60  # points of a curve that are marked: third octaves
LOG = 10.0  # an axis of frequency that spans more is logarithmic: 100 to 2000 Hz of a hammer test


def overlay_chart(lines: Sequence[Line], title: str = "") -> Chart:
    """Curves, a panel for each unit; files are named in the legend.

    Complex ones as magnitude, and phase below.
    """
    rows: list[tuple[Panel, ...]] = []
    for unit in dict.fromkeys(line.unit for line in lines):
        of_unit = [line for line in lines if line.unit == unit]
        alone = len({line.output for line in of_unit}) == 1
        names = [_name(line, alone=alone) for line in of_unit]
        panel = _panel(of_unit, names)
        turning = {
            name: (line.x, line.y)
            for name, line in zip(names, of_unit, strict=True)
            if np.iscomplexobj(line.y)
        }
        turns = max(map(_turns, turning.values()), default=0)
        if turns > LEGIBLE:
            panel = replace(panel, title=f"without phase, which turns over {turns} times")
        rows.append((panel,))
        if turning and turns <= LEGIBLE:
            rows.append((phase_panel(turning, _quantity(of_unit)),))
    return Chart(title=title, rows=tuple(rows), share_x=len({line.axis for line in lines}) == 1)


def _turns(curve: tuple[FloatArray, np.ndarray]) -> int:
    """How often a phase turns over, as with the lag from wheel to wheel."""
    return int((np.abs(np.diff(np.angle(curve[1]))) > np.pi).sum())


def _name(line: Line, *, alone: bool) -> str:
    words = "" if alone else ", ".join(_words(line))
    return ", ".join(part for part in (line.file, words, line.part) if part)


def _words(line: Line) -> tuple[str, ...]:
    """Whose a variable is and what of it: by its name, or as its result says before any comma."""
    told = tuple(part for part in line.told.partition(",")[0].split(": ") if part)
    known = told and all(len(part) <= LONGEST for part in told)
    return words_of(line.output) or (told if known else (line.output,))


def _quantity(lines: Sequence[Line]) -> str:
    """What is shown: the variable, or what several are of."""
    found = list(dict.fromkeys(map(_words, lines)))
    several = " / ".join(dict.fromkeys(one[-1] for one in found))
    return ", ".join(found[0]) if len(found) == 1 else several


def _panel(lines: Sequence[Line], names: Sequence[str]) -> Panel:
    is_complex = any(np.iscomplexobj(line.y) for line in lines)
    curves = tuple(
        Curve(
            name=name, x=line.x, y=np.abs(line.y) if np.iscomplexobj(line.y) else line.y,
            points=line.x.size <= FEW,
        )
        for name, line in zip(names, lines, strict=True)
    )  # fmt: skip
    first = lines[0]
    places: FloatArray = np.concatenate([line.x[line.x > 0] for line in lines])
    wide = places.size > 0 and places.max() > LOG * places.min()
    values: FloatArray = np.concatenate([c.y[np.isfinite(c.y)] for c in curves])
    positive = bool((values >= 0).all() and values.any())
    quantity = _quantity(lines)
    made = " / ".join(dict.fromkeys(line.words for line in lines if line.words))
    shown = f"|{quantity}|" if is_complex else quantity
    label = made or shown
    # One curve has no legend.
    title = ", ".join(filter(None, (shown if made else "", names[0] if len(lines) == 1 else "")))
    in_frequency = first.axis == "frequency"
    return Panel(
        x_label=f"{first.axis} ({first.x_unit})" if first.x_unit else first.axis,
        y_label=f"{label} ({first.unit})" if first.unit else label,
        curves=curves,
        title=title,
        x_log=in_frequency and bool(wide),
        y_log=in_frequency and first.unit != "dB" and positive,
    )
