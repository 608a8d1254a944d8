"""Where over the step something grows: the edges of all ranges, without trying every step.

What grows is looked for in two ways. Motions that start to grow while they turn, `count` finds at
steps a few per cent apart. Those that do so by half or whole turns, where a mode meets its own
mirror image, grow over ranges as narrow as their damping over their frequency; there a determinant
at z = 1 or -1 changes its sign, which costs a tenth of counting and is looked at far more densely,
and between two looks where it comes near to zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import groupby, pairwise

import numpy as np

from railcosim.master.component import FloatArray

COARSE, FINE = 1.02, 1.004
"""Ratios of steps at which growing motions are counted, and signs of the determinants looked at."""
LONG = 1.1
"""Ratio of steps where something grows fast: shorter ranges in between are no use to anyone."""
SHORT = 1.25
"""Ratio of steps too short for any motion to turn by half."""
RESOLUTION = 5e-4
"""Relative, of the edges."""
_FAST = 2
_NEAR = 0.3
"""Of a determinant, to which a parabola must lead if a minimum is to be looked into."""
_LOOKS = 4
"""Looks into a minimum, each at the vertex of the parabola through the last ones."""


@dataclass(frozen=True)
class Probe:
    """What can be asked at a step h (s).

    Attributes
    ----------
    grade : callable
        How fast things grow: 0 if nothing does, 1 slowly, 2 fast.
    ends : callable
        Determinants that change sign when a real eigenvalue crosses the unit circle, of several
        steps, shape (n_steps, n).
    """

    grade: Callable[[float], int]
    ends: Callable[[FloatArray], FloatArray]


def unstable_ranges(
    probe: Probe, shortest: float, resonant: float, longest: float
) -> list[tuple[float, float, int, float]]:
    """Find the ranges of steps at which something grows.

    Parameters
    ----------
    probe : Probe
        Of a coupling.
    shortest, longest : float
        Range of steps that is searched, s.
    resonant : float
        Step at which the fastest motion turns by half, s: shorter ones have no narrow ranges.

    Returns
    -------
    list of (float, float, int, float)
        Steps (s) between which something grows, the grade, and the step nearest to the middle at
        which that was seen, in order; ranges of different grades may touch. The first begins at 0
        if something grows at the shortest step, the last is endless if something does at the
        longest.
    """
    looks = sorted(_looks(probe, shortest, resonant, longest))
    suspects = [h for run in _stable_runs(looks, resonant) for h in _suspects(probe.ends, run)]
    looks = sorted([*looks, *((h, probe.grade(h)) for h in suspects)])
    looks = list(_resolved(probe, looks))
    found = []
    begin = 0.0
    inside = list[float]()
    for (before, was), (after, now) in pairwise(looks):
        inside.append(before)
        if was != now:
            if was:
                end = after if now == 0 else before
                found.append((begin, end, was, _nearest(inside, 0.5 * (begin + end))))
            begin, inside = before, []
    if looks[-1][1]:
        found.append((begin, math.inf, looks[-1][1], looks[-1][0]))
    return found


def _nearest(steps: list[float], middle: float) -> float:
    return min(steps, key=lambda h: abs(h - middle))


def _looks(
    probe: Probe, shortest: float, resonant: float, longest: float
) -> Iterator[tuple[float, int]]:
    """Steps at which growing motions are counted, and the grade there."""
    h, before, was = shortest, shortest, 0
    while True:
        grade = probe.grade(h)
        yield h, grade
        if was == _FAST and grade < _FAST:  # what came on the way
            count = math.ceil(math.log(h / before) / math.log(COARSE))
            for between in np.geomspace(before, h, count + 1)[1:-1].tolist():
                yield between, probe.grade(between)
        if h >= longest:
            return
        ratio = LONG if grade == _FAST else SHORT if h < resonant else COARSE
        h, before, was = min(h * ratio, longest), h, grade


def _stable_runs(looks: list[tuple[float, int]], resonant: float) -> Iterator[list[float]]:
    """Of each run of steps without fast growth, the most stable one and what is on either side."""
    for is_fast, group in groupby(range(len(looks)), key=lambda i: looks[i][1] == _FAST):
        places = [i for i in group if looks[i][0] * SHORT > resonant]
        if not is_fast and places:
            around = looks[max(places[0] - 1, 0) : places[-1] + 2]
            best = min(places, key=lambda i: looks[i][1])
            yield [looks[best][0], around[0][0], around[-1][0]]


def _suspects(ends: Callable[[FloatArray], FloatArray], run: list[float]) -> Iterator[float]:
    """Steps in a run at which a determinant has another sign than at a stable one."""
    stable, first, last = run
    usual = np.where(ends(np.array([stable]))[0] < 0.0, -1.0, 1.0)
    steps = np.geomspace(first, last, math.ceil(math.log(last / first) / math.log(FINE)) + 1)
    values = ends(steps)
    for k in range(len(usual)):
        row = usual[k] * values[:, k]
        yield from steps[row < 0.0].tolist()
        lowest = (row[1:-1] >= 0.0) & (row[1:-1] <= np.minimum(row[:-2], row[2:]))
        for i in np.flatnonzero(lowest):
            around = list(zip(steps[i : i + 3].tolist(), row[i : i + 3].tolist(), strict=True))
            yield from _below_zero(partial(_one_of, ends, usual, k), around)


def _one_of(ends: Callable[[FloatArray], FloatArray], usual: FloatArray, k: int, h: float) -> float:
    return float((usual * ends(np.array([h]))[0])[k])


def _below_zero(
    value: Callable[[float], float], around: list[tuple[float, float]]
) -> Iterator[float]:
    """Step near a minimum, by three points about it, at which a function is below zero."""
    for _ in range(_LOOKS):
        h, v = np.array(around).T
        bend, slope, level = np.polyfit(h - h[1], v, 2)
        if bend <= 0.0 or level - slope**2 / (4.0 * bend) > _NEAR * v[1]:
            return
        step = float(h[1] - slope / (2.0 * bend))
        if any(math.isclose(step, other, rel_tol=RESOLUTION / 10) for other, _ in around):
            return
        new = value(step)
        if new < 0.0:
            yield step
            return
        around = sorted([*around, (step, new)])
        lowest = min(range(1, 3), key=lambda i: around[i][1])
        around = around[lowest - 1 : lowest + 2]


def _resolved(probe: Probe, looks: list[tuple[float, int]]) -> Iterator[tuple[float, int]]:
    """The same looks and one on either side of each edge; there may be two between neighbours."""
    for first, (above, now) in pairwise(looks):
        below, was = first
        yield first
        while was != now:
            before, after = _edge(probe, below, above, was)
            if before > below:
                yield before, was
            below, was = after, probe.grade(after)
            if after < above:
                yield after, was
    yield looks[-1]


def _edge(probe: Probe, below: float, above: float, grade: int) -> tuple[float, float]:
    """Two neighbouring steps between which a grade ends."""
    while above > below * (1.0 + RESOLUTION):
        middle = math.sqrt(below * above)
        if probe.grade(middle) == grade:
            below = middle
        else:
            above = middle
    return below, above
