"""Charts of stability limits."""

from __future__ import annotations

import numpy as np
import xarray as xr

from .chart import Chart, Curve, FloatArray, Panel

FRAME = 1.1
"""Of a stiffness, to either side: the width of the frame about a window."""


def stability_chart(limits: xr.Dataset, longest: float) -> Chart:
    """Largest stable step over the contact stiffness, a panel for each owner of the contact.

    Parameters
    ----------
    limits : Dataset
        Over ``k_H``: a variable ``SCHEME.OWNER`` (s) for each scheme, infinite if all is stable;
        ``SCHEME.OWNER.window[i].begin`` and ``.end``, NaN where there are fewer.
    longest : float
        Longest step searched, s.
    """
    k_H = np.asarray(limits["k_H"])
    if k_H.size == 1:
        return _at_one(limits, longest)
    steps = {str(n): np.asarray(limits[n]) for n in limits.data_vars if "window" not in str(n)}
    owners = dict.fromkeys(name.rpartition(".")[2] for name in steps)
    lowest = min((s[s > 0].min() for s in steps.values() if (s > 0).any()), default=longest)
    rows = []
    for owner in owners:
        curves = tuple(
            Curve(
                name=name.rpartition(".")[0],
                x=np.concatenate([k_H / 1e9, x]),
                # Nothing is stable: below the panel. All is: along its upper edge.
                y=1e3 * np.concatenate([np.where(s > 0, np.minimum(s, longest), np.nan), y]),
            )
            for name, s in steps.items()
            if name.endswith(f".{owner}")
            for x, y in [_frames(limits, name)]
        )
        rows.append(
            tuple(
                Panel(
                    x_label="contact stiffness (GN/m)",
                    y_label="largest stable step (ms)",
                    curves=part,
                    x_log=True,
                    y_log=True,
                    x_range=(k_H[0] / FRAME / 1e9, k_H[-1] * FRAME / 1e9) if k_H.size > 1 else None,
                    y_range=(1e3 * lowest / 1.5, 1.2e3 * longest),
                    title=f"contact in {owner}: {title}",
                )
                for title, part in _families(curves)
            )
        )
    return Chart(
        title="Largest stable step, predicted; frames: windows above it in which something grows",
        rows=tuple(rows),
    )


def _at_one(limits: xr.Dataset, longest: float) -> Chart:
    """Of one stiffness: for every scheme the steps that are stable, as bars, shortest first."""
    one = limits.isel(k_H=0)
    steps = {str(n): float(one[n]) for n in one.data_vars if "window" not in str(n)}
    finite = [s for s in steps.values() if s > 0]
    least = min(finite, default=longest) / 3
    rows = []
    for owner in dict.fromkeys(name.rpartition(".")[2] for name in steps):
        named = sorted((n for n in steps if n.endswith(f".{owner}")), key=lambda n: steps[n])
        stable: list[tuple[float, float]] = []
        grows: list[tuple[float, float]] = []
        for k, name in enumerate(named):
            if steps[name] > 0:
                stable += [(least, k), (min(steps[name], longest), k), (np.nan, k)]
            for low, high in _windows(one, name):
                grows += [(low, k), (min(high, longest), k), (np.nan, k)]
        curves = [
            Curve(name=what, x=1e3 * places[:, 0], y=places[:, 1], points=True)
            for what, ends in (("stable", stable), ("window in which something grows", grows))
            if ends
            for places in [np.array(ends)]
        ]
        panel = Panel(
            x_label="step (ms)", y_label="", curves=tuple(curves), x_log=True,
            x_range=(1e3 * least, 1.2e3 * longest), y_range=(-0.7, len(named) - 0.3),
            y_ticks=tuple((float(k), _scheme(n, steps[n])) for k, n in enumerate(named)),
            title=f"contact in {owner}",
        )  # fmt: skip
        rows.append((panel,))
    k_H = float(limits["k_H"][0]) / 1e9
    title = f"Stable steps, predicted, k_H {k_H:.3g} GN/m"
    return Chart(title=title, rows=tuple(rows), share_x=True)


def _scheme(name: str, step: float) -> str:
    """What stands beside a bar, or in its place."""
    return name.rpartition(".")[0] + ("" if step > 0 else ": none")


def _windows(one: xr.Dataset, name: str) -> list[tuple[float, float]]:
    """Windows of a scheme at one stiffness, s."""
    begins = [str(n) for n in one.data_vars if str(n).startswith(f"{name}.window")]
    ends = [
        (float(one[n]), float(one[n.removesuffix("begin") + "end"]))
        for n in begins
        if n.endswith(".begin")
    ]
    return [(low, high) for low, high in ends if np.isfinite(low)]


def _frames(limits: xr.Dataset, name: str) -> tuple[FloatArray, FloatArray]:
    """A frame about each closed window of a scheme: stiffness (GN/m) and step (s)."""
    x, y = [np.nan], [np.nan]
    for begin in (str(n) for n in limits.data_vars):
        if not (begin.startswith(f"{name}.window") and begin.endswith(".begin")):
            continue
        ends = limits[begin.removesuffix("begin") + "end"]
        for k, low, high in zip(
            limits["k_H"].values, limits[begin].values, ends.values, strict=True
        ):
            if np.isfinite(high):
                left, right = k / 1e9 / FRAME, k / 1e9 * FRAME
                x += [left, right, right, left, left, np.nan]
                y += [low, low, high, high, low, np.nan]
    return np.array(x), np.array(y)


def _families(curves: tuple[Curve, ...]) -> list[tuple[str, tuple[Curve, ...]]]:
    """Not more curves in a panel than there are colours: explicit schemes, and others."""
    explicit = tuple(c for c in curves if c.name.startswith(("jacobi", "gauss-seidel", "nepce")))
    others = tuple(c for c in curves if c not in explicit)
    named = [("one evaluation a step", explicit), ("several", others)]
    return [(title, part) for title, part in named if part]


def advice_chart(advice: xr.Dataset) -> Chart:
    """Predicted error over the step, of six of the cheapest ways to couple.

    Parameters
    ----------
    advice : Dataset
        ``errors`` over ``option``, cheapest first, and ``tried`` (s).
    """
    steps = 1e3 * np.asarray(advice["tried"])
    accuracy = float(advice.attrs["accuracy"])
    curves = [
        Curve(name=str(name), x=steps[np.isfinite(errors)], y=errors[np.isfinite(errors)])
        for name, errors in zip(
            np.asarray(advice["option"]).tolist()[:6],
            np.asarray(advice["errors"])[:6],
            strict=True,
        )
    ]
    asked = Curve(name="asked for", x=steps[[0, -1]], y=np.full(2, accuracy), dashed=True)
    panel = Panel(
        x_label="step (ms)",
        y_label="relative error of contact forces",
        curves=(*curves, asked),
        x_log=True,
        y_log=True,
        y_range=(accuracy / 10, max(1.0, 100 * accuracy)),
    )
    return Chart(title="Predicted error, cheapest ways to couple", rows=((panel,),))
