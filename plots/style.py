"""What paper and screen have in common: colours, and how much of a curve is shown."""

from __future__ import annotations

import numpy as np

from .chart import Panel

# Okabe & Ito: told apart by everyone, and in grey.
COLORS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"]
GREY = "#888888"
ROLL_OFF = 1e-6  # of the top: below there is roll-off and rounding, nothing to read


def color_of(panel: Panel, k: int) -> str:
    """Colour of a panel's k-th curve."""
    return COLORS[k % len(COLORS)]


def is_dashed(panel: Panel, k: int) -> bool:
    """Whether its line is: as it asks for, or because its colour has come before."""
    return panel.curves[k].dashed or k >= len(COLORS)


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
