"""Track parameters from measured receptances and decay rates, with confidence intervals."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.optimize import OptimizeResult, least_squares
from scipy.stats import qmc

from railcosim.master.component import FloatArray
from railcosim.master.progress import Progress, unheard
from railcosim.parameters import ArgumentError, ParameterError, UnusualWarning, changed
from railcosim.parameters.change import limits_of, value_at
from railcosim.track.dispersion import fine_enough
from railcosim.track.parameters import Track

from .identified import LEVEL, Identified, identified
from .measured import Measured, read_measured
from .table import DECAY

FARTHEST = 1e3  # times and through a start: a parameter that goes there follows no data
AROUND = 10.0  # times and through a start: where others are looked for
STARTS = 8  # of them, for each parameter
FOLLOWED = 2  # the best of them, and the given one
FEW = 48  # frequencies for finding which
ROUGHLY = 1e-3  # of a logarithm, for choosing among searches
STEP = 1e-4  # of a logarithm, for central differences: 1e-8 of curvature, 1e-6 of rounding
EVALUATIONS = 60  # of residuals, one search; it takes 5 to 15
MOST = 12  # parameters


@dataclass(frozen=True)
class Problem:
    """What is to be fitted to what.

    Attributes
    ----------
    track : Track
        Where the search starts.
    free : tuple of str
        Keys of what may change.
    measured : tuple of Measured
        To what.
    count : callable
        Told of every residual made.
    """

    track: Track
    free: tuple[str, ...]
    measured: tuple[Measured, ...]
    count: Callable[[], None]

    @cached_property
    def start(self) -> FloatArray:
        """Values of what is free."""
        return np.array([value_at(self.track, key) for key in self.free], dtype=float)

    def at(self, x: FloatArray) -> Track:
        """The track at logarithms from the start."""
        new = dict(zip(self.free, (self.start * np.exp(x)).tolist(), strict=True))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UnusualWarning)  # said of the solution alone
            return changed(self.track, new)

    def residual(self, x: FloatArray) -> FloatArray:
        """Of all that was measured."""
        self.count()
        track = self.at(x)
        return np.concatenate([one.residual(track) for one in self.measured])

    def jacobian(self, x: FloatArray) -> FloatArray:
        """By central differences: an endless track costs a tenth of a millisecond a frequency."""
        steps = STEP * np.eye(x.size)
        columns = [self.residual(x + h) - self.residual(x - h) for h in steps]
        return np.stack(columns, axis=1) / (2 * STEP)

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Logarithms within which parameters may be, and differences be taken."""
        low, high = np.array([limits_of(self.track, key) for key in self.free]).T
        with np.errstate(divide="ignore"):
            least, most = np.log(np.maximum(low, 0) / self.start), np.log(high / self.start)
        far, room = np.log(FARTHEST), 2 * STEP
        return np.maximum(least, -far) + room, np.minimum(most, far) - room

    def solved(self, x: FloatArray, within: float = 1e-10) -> OptimizeResult:
        """The least squares near a place, logarithms settled within something."""
        low, high = self.bounds()
        inside = np.clip(x, low + STEP, high - STEP)
        return least_squares(
            self.residual, inside, jac=self.jacobian, bounds=(low, high), max_nfev=EVALUATIONS,
            xtol=within, ftol=max(within**2, 1e-15), gtol=1e-15,
        )  # fmt: skip

    def of_few(self) -> Problem:
        """The same with few frequencies."""
        return replace(self, measured=tuple(one.thinned(FEW) for one in self.measured))

    @property
    def runs(self) -> list[slice]:
        """Residuals that are neighbours in frequency."""
        found, first = [], 0
        for one in self.measured:
            for _ in range(2 if np.iscomplexobj(one.values) else 1):
                found.append(slice(first, first + one.frequency.size))
                first += one.frequency.size
        return found


def fit(
    measured: str | Path | Sequence[str | Path],
    track: Track | None = None,
    *,
    free: Sequence[str],
    position: str | float | Sequence[str | float] | None = None,
    direction: str | None = None,
    both_rails: bool | None = None,
    unit: str | None = None,
    progress: Progress = unheard,
) -> xr.Dataset:
    """Fit numbers of a track to measured receptances or decay rates, by least squares.

    What is made small are the logarithms of measured over computed magnitudes, and differences of
    phase where phases are known; weighted by coherence where it is.

    Parameters
    ----------
    measured : str or Path, or several
        Files, see `railcosim.analysis.fitting.table`.
    track : Track, optional
        Where the search starts, and all that is not free; the paper's if not given.
    free : sequence of str
        Keys such as ``fastening.stiffness`` (see `railcosim.changed`); all above 0.
    position : str or float, or one a file, optional
        Where the rail was hit: ``railseat``, ``midspan``, or m. If not given what a file of ours
        says, else ``railseat``.
    direction : str, optional
        ``z`` or ``y``, of hammer and accelerometer; likewise, else ``z``.
    both_rails : bool, optional
        Whether equal forces acted on both rails; likewise, else not.
    unit : str, optional
        Of responses whose columns say none.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        Over ``parameter``: ``value``, ``lower``, ``upper`` (the 95 % interval) and ``start``; NaN,
        but of start, for what cannot be known from the data: the attribute ``not_identified`` says
        why. ``correlation`` of logarithms over ``parameter`` and ``with``. Over ``frequency`` (of
        several files ``frequency[2]`` and so on): ``measured``, ``fitted``, ``residual`` (dB).
        Attributes ``rms`` (dB), ``neighbours``: see `railcosim.analysis.fitting.identified`.

    Raises
    ------
    ParameterError
        If a file cannot be read, or there is no such parameter.
    ArgumentError
        If a parameter cannot be free, or there are as many as data.
    ArithmeticError
        If none of them can be known from the data.

    Warns
    -----
    UnusualWarning
        For every number found that is not a usual one.
    """
    track = track or Track()
    sources = [measured] if isinstance(measured, str | Path) else list(measured)
    places: list[str | float | None]
    if position is None or isinstance(position, str | float | int):
        places = [position]
    else:
        places = list(position)
    if len(places) not in {1, len(sources)}:
        raise ArgumentError("position", None, f"{len(places)} places for {len(sources)} files")
    curves = tuple(
        read_measured(
            Path(source), track, position=place, direction=direction, both_rails=both_rails,
            unit=unit,
        )
        for source, place in zip(sources, places * (len(sources) // len(places)), strict=True)
    )  # fmt: skip
    if all(one.unit == DECAY for one in curves):
        _check_unsaid(position=position, load=both_rails, unit=unit)
    highest = max(float(one.frequency[-1]) for one in curves)
    fine = track
    for direct in {one.direction for one in curves}:
        fine = fine_enough(fine, highest, direct)
    problem = Problem(fine, tuple(free), curves, partial(_counted, progress, [0], len(free)))
    _check(problem)
    found = _searched(problem)
    names, solution = list(problem.free), problem.at(found.x)
    known = identified(
        names, problem.jacobian(found.x), found.fun, problem.runs, _limits(problem, found.x)
    )
    progress(1, 1)
    if len(known.why_not) == len(names):
        raise ArithmeticError(
            "; ".join(f"{names[i]} {why}" for i, why in known.why_not.items())
            + ": nothing is known of any from this; free fewer, or measure elsewhere"
        )
    return _dataset(problem, found.x, solution, known)


def _check_unsaid(**given: object) -> None:
    """Refuse what says nothing of decay rates."""
    for name, value in given.items():
        if value is not None:
            raise ArgumentError(
                name, None, "says nothing of decay rates, which are of one rail that is hit at the "
                "standard's places, in dB/m; leave it out",
            )  # fmt: skip


def _check(problem: Problem) -> None:
    """Refuse what no search can find."""
    free, track = problem.free, problem.track
    if not free or len(free) > MOST:
        raise ArgumentError("free", ",".join(free), f"must be 1 to {MOST} numbers of the track")
    for key in free:
        value = value_at(track, key)  # ParameterError if there is none
        if isinstance(value, bool) or not isinstance(value, float):
            raise ArgumentError("free", key, "must be one number that is not a whole one")
        if not value > 0:
            raise ArgumentError(
                "free", key, f"is {value:g}; say where to start, --set {key}=... above 0"
            )
        if free.count(key) > 1:
            raise ArgumentError("free", key, "is given twice")
    data = sum(run.stop - run.start for run in problem.runs)
    if data <= len(free):
        raise ArgumentError(
            "free", ",".join(free), f"{len(free)} numbers from {data} measured ones: free fewer"
        )


def _searched(problem: Problem) -> OptimizeResult:
    """The best of several searches: from the start, and from the best of places around it."""
    few, size = problem.of_few(), len(problem.free)
    low, high = few.bounds()
    # The same places each time: the same data give the same numbers.
    around = np.log(AROUND) * (2 * qmc.LatinHypercube(size, seed=1).random(STARTS * size) - 1)
    places = np.clip(around, low + STEP, high - STEP)
    cost = [float(np.sum(few.residual(x) ** 2)) for x in places]
    first = [np.zeros(size), *places[np.argsort(cost)[:FOLLOWED]]]
    best = min((few.solved(x, ROUGHLY) for x in first), key=lambda one: float(one.cost))
    return problem.solved(best.x)


def _counted(progress: Progress, count: list[int], size: int) -> None:
    """How far it is, about: searches take some ten steps of as many differences."""
    count[0] += 1
    expected = STARTS * size + (FOLLOWED + 2) * 10 * (2 * size + 1)
    progress(min(count[0], 0.99 * expected), expected)


def _limits(problem: Problem, x: FloatArray) -> list[str]:
    """What each parameter has run against."""
    found = []
    bounds = np.transpose(problem.bounds())
    for key, start, value, ends in zip(problem.free, problem.start, x, bounds, strict=True):
        near = [end for end in ends.tolist() if abs(value - end) < 10 * STEP]
        allowed = limits_of(problem.track, key)
        at = "".join(f"goes to {start * np.exp(end):.3g}, the end of where it is looked for"
                     for end in near)  # fmt: skip
        if near and any(np.isclose(start * np.exp(near[0]), one, rtol=0.01) for one in allowed):
            at = f"goes to the end of what is allowed, {start * np.exp(near[0]):.3g}"
        found.append(at)
    return found


def _dataset(problem: Problem, x: FloatArray, solution: Track, known: Identified) -> xr.Dataset:
    value = problem.start * np.exp(x)
    value[list(known.why_not)] = np.nan
    factor = np.exp(known.half_width)
    names = np.array(problem.free)
    result = xr.Dataset(
        {
            "value": ("parameter", value, {"long_name": "fitted"}),
            "lower": ("parameter", value / factor, {"long_name": f"{LEVEL:.0%} from"}),
            "upper": ("parameter", value * factor, {"long_name": f"{LEVEL:.0%} to"}),
            "start": ("parameter", problem.start, {"long_name": "before"}),
            "correlation": (("parameter", "with"), known.correlation, {"units": "1"}),
        },
        {"parameter": names, "with": names},
    )
    squared = []
    for k, one in enumerate(problem.measured):
        which = f"[{k + 1}]" if len(problem.measured) > 1 else ""
        dim = "frequency" if k == 0 else f"frequency{which}"
        result = result.assign_coords({dim: (dim, one.frequency, {"units": "Hz"})})
        fitted = one.of(solution, one.frequency)
        off = 20 * np.log10(np.abs(fitted) / np.abs(one.values))
        about = {"units": one.unit, "long_name": one.name}
        result[f"measured{which}"] = dim, one.values, about
        result[f"fitted{which}"] = dim, fitted, about
        result[f"residual{which}"] = dim, off, {"units": "dB", "long_name": "fitted over measured"}
        squared.append(off**2)
    for key, number in zip(problem.free, value.tolist(), strict=True):
        if np.isfinite(number):
            changed(problem.track, {key: number})  # warns of what is not usual
    result.attrs = {
        "title": "track parameters fitted to what was measured",
        "level": LEVEL,
        "rms": float(np.sqrt(np.mean(np.concatenate(squared)))),
        "neighbours": known.neighbours,
        "inflation": known.inflation,
        "not_identified": {problem.free[i]: why for i, why in known.why_not.items()},
    }
    return result


__all__ = ["ParameterError", "fit"]
