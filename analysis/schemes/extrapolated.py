"""What a system of FMUs does by itself: runs with ever shorter steps, extrapolated.

Nobody knows the exact motion of a black box. Runs of two schemes with a quarter, an eighth and a
sixteenth of the shortest step that is compared are extrapolated by the order that they show. How
far that can be believed is what the last halving changed of the extrapolation, or by how much the
two schemes differ, whichever is more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.cosimulation import Divergence
from railcosim.master.linear.state_space import IndexArray
from railcosim.master.polynomials import lagrange
from railcosim.master.schemes import Scheme

PARTS = (4, 8, 16)
"""Parts of the shortest step that is compared."""
BELIEVED = 0.1
"""Relative error of a reference above which nothing is measured against it."""
ORDERS = 0.5, 6.5
"""Between which an order that runs show is one; else their differences are noise, or kinks."""
AROUND = 6
"""Points of the polynomial between samples: of a higher order than any scheme."""

Runs = Callable[[Scheme, int], FloatArray]
"""Outputs over common times by a scheme, in steps that are so many times shorter than `step`."""


@dataclass(frozen=True, kw_only=True)
class Sampled:
    """Values over time at equal distances, each over what it moves.

    Attributes
    ----------
    begin, interval : float
        First sample and distance, s.
    values : array, shape (n_samples, n_columns)
        Over `scale`.
    columns : array of int, shape (n_columns,)
        Which outputs of the system.
    scale : array, shape (n_columns,)
        RMS of each one's deviation from where it starts.
    error : float
        Estimate, relative.
    """

    begin: float
    interval: float
    values: FloatArray
    columns: IndexArray
    scale: FloatArray
    error: float

    @property
    def rest(self) -> FloatArray:
        """Where all start."""
        start: FloatArray = self.values[0]
        return start

    def of(self, outputs: FloatArray) -> FloatArray:
        """What is compared, of outputs of the system."""
        chosen: FloatArray = outputs[..., self.columns] / self.scale
        return chosen

    def at(self, times: ArrayLike) -> FloatArray:
        """Values at some times (s), shape (n_times, n_columns)."""
        place = (np.asarray(times, dtype=float) - self.begin) / self.interval
        count = min(AROUND, len(self.values))
        first = np.clip(np.rint(place).astype(np.intp) - count // 2, 0, len(self.values) - count)
        weights = lagrange(np.arange(float(count)), place - first)
        around = self.values[first[:, None] + np.arange(count)]
        found: FloatArray = np.einsum("tj,tjc->tc", weights, around)
        return found


def extrapolated(
    runs: Runs, schemes: Sequence[Scheme], columns: IndexArray, begin: float, interval: float
) -> Sampled:
    """Extrapolate runs of several schemes, and take the one that changes least.

    Parameters
    ----------
    runs : callable
        Makes a run; the same number of rows whatever the steps.
    schemes : sequence of Scheme
        That do not share what is wrong with them.
    columns : array of int
        The outputs that are compared.
    begin, interval : float
        Of the rows, s.

    Raises
    ------
    ComponentError
        If no scheme comes to an end, nothing moves, or the error is above `BELIEVED`.
    """
    found, why = list[tuple[float, FloatArray]](), ""
    moves: IndexArray | None = None
    scale = np.ones(0)
    for scheme in schemes:
        try:
            rows = [runs(scheme, part)[:, columns] for part in PARTS]
        except (ComponentError, Divergence, ArithmeticError, ValueError) as error:
            why = str(error)
            continue
        if moves is None:
            size = np.sqrt(np.mean((rows[-1] - rows[-1][0]) ** 2, axis=0))
            moves = np.flatnonzero(size > np.finfo(float).eps * np.abs(rows[-1]).max(axis=0))
            if not len(moves):
                raise ComponentError("nothing that is exchanged moves: there is nothing to compare")
            scale = size[moves]
        found.append(_limit_of([row[:, moves] / scale for row in rows]))
    if moves is None:
        raise ComponentError(
            f"no reference: runs with a quarter of the shortest step do not end ({why}); take "
            "shorter steps"
        )
    found.sort(key=lambda one: one[0])
    off, values = found[0]
    off = max([off, *(_rms(values - other) for _, other in found[1:])])
    if not off <= BELIEVED:
        raise ComponentError(
            f"no reference: runs with a sixteenth of the shortest step are known to {off:.1g} of "
            "what moves; take shorter steps, or less time"
        )
    return Sampled(
        begin=begin, interval=interval, values=values, columns=columns[moves], scale=scale,
        error=off,
    )  # fmt: skip


def _limit_of(rows: list[FloatArray]) -> tuple[float, FloatArray]:
    """Estimate of the error, and where three runs with halved steps lead."""
    first, second = rows[0] - rows[1], rows[1] - rows[2]
    a, b = _rms(first), _rms(second)
    order = math.log2(a / b) if a > 0.0 and b > 0.0 else math.nan
    if not ORDERS[0] < order < ORDERS[1]:
        return b, rows[2]
    factor = 1.0 / (2.0**order - 1.0)
    fine, coarse = rows[2] - factor * second, rows[1] - factor * first
    return _rms(fine - coarse), fine


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
