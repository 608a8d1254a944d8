"""Charts of stability limits."""

from __future__ import annotations

import numpy as np
import xarray as xr

from .chart import Chart, Curve, Panel


def stability_chart(limits: xr.Dataset, longest: float) -> Chart:
    """Largest stable step over the contact stiffness, a panel for each owner of the contact.

    Parameters
    ----------
    limits : Dataset
        Over ``k_H``: a variable ``SCHEME.OWNER`` (s) for each scheme, infinite beyond the scan.
    longest : float
        Longest step scanned, s.
    """
    k_H = np.asarray(limits["k_H"])
    owners = dict.fromkeys(str(name).rpartition(".")[2] for name in limits.data_vars)
    steps = {str(name): np.asarray(limits[name]) for name in limits.data_vars}
    lowest = min((s[s > 0].min() for s in steps.values() if (s > 0).any()), default=longest)
    rows = []
    for owner in owners:
        curves = tuple(
            Curve(
                name=name.rpartition(".")[0],
                x=k_H / 1e9,
                # Nothing is stable: below the panel. All is: along its upper edge.
                y=1e3 * np.where(step > 0, np.minimum(step, longest), np.nan),
            )
            for name, step in steps.items()
            if name.endswith(f".{owner}")
        )
        rows.append(
            tuple(
                Panel(
                    x_label="contact stiffness (GN/m)",
                    y_label="largest stable step (ms)",
                    curves=part,
                    x_log=True,
                    y_log=True,
                    x_range=(k_H[0] / 1e9, k_H[-1] / 1e9) if k_H.size > 1 else None,
                    y_range=(1e3 * lowest / 1.5, 1.2e3 * longest),
                    title=f"contact in {owner}: {title}",
                )
                for title, part in _families(curves)
            )
        )
    return Chart(title="Largest stable step, predicted", rows=tuple(rows))


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
