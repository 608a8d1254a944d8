"""Scheme and step that reach an accuracy at the least cost, of any system of FMUs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from railcosim.master.component import FloatArray
from railcosim.master.fmi.archive import FmuError
from railcosim.master.linear.state_space import ComplexArray
from railcosim.master.progress import Progress, Tell, foretold, unheard, unsaid
from railcosim.parameters import ArgumentError

from .advised import ROUND, Advice, cheapest_first, check_accuracy, longest_step
from .limits import LINEARISING, predictable
from .linear_system import linear_system
from .stability import FAILURES, Coupling
from .usual import PREDICTED

LASTS = 5.0
"""Time constants after which nothing is left of a motion: 0.7 % of it."""
FINER = 10.0
"""Times the shortest step at which limits are looked for: orders need short ones."""
MANY = 2000
"""Points of a run at which its error is looked at, at the most."""


class MotionError:
    """What a scheme makes of the motions of a system, each by itself and left alone.

    A motion exp(lambda t) of the system becomes z^k at the communication points, z being the
    eigenvalue of the scheme's step that is nearest to exp(lambda h). The error is the RMS of the
    difference over that of the motion, while it lasts (`LASTS`) or the run does; of all motions the
    worst. Nothing is assumed of what moves the system, nor foreseen of what that does.

    Parameters
    ----------
    poles : array of complex, shape (n,)
        Of the system coupled exactly, 1/s.
    duration : float
        Of the run, s.
    """

    def __init__(self, poles: ComplexArray, duration: float) -> None:
        self._poles = poles
        with np.errstate(divide="ignore"):
            self._until = np.minimum(duration, LASTS / np.abs(poles.real))

    def of(self, coupling: Coupling, h: float) -> float:
        """See `SchemeError`."""
        exact = np.exp(self._poles * h)
        try:
            found = np.concatenate([a.at(h).eigenvalues() for a in coupling.amplifiers])
        except FAILURES:
            return np.inf
        of, its = linear_sum_assignment(np.abs(exact[:, None] - found))
        return max(
            _apart(complex(exact[i]), complex(found[j]), math.ceil(self._until[i] / h - 1e-9))
            for i, j in zip(of, its, strict=True)
        )


def _apart(exact: complex, found: complex, steps: int) -> float:
    """Relative RMS of the difference of two powers, from none to some steps."""
    k = np.unique(np.linspace(0, steps, MANY).round()) if steps > MANY else np.arange(steps + 1.0)
    true = exact**k
    return float(np.linalg.norm(found**k - true) / np.linalg.norm(true))


def advise_system(
    path: str | Path,
    accuracy: float = 1e-3,
    *,
    schemes: Sequence[str] = PREDICTED,
    time: float | None = None,
    progress: Progress = unheard,
    tell: Tell = unsaid,
    **found: Any,
) -> Advice:
    """Name scheme and step that reach an accuracy at the least cost, before running.

    Parameters
    ----------
    path : str or Path
        An SSP file. The code in it is run.
    accuracy : float
        Error allowed of the system's own motions, see `MotionError`.
    schemes : sequence of str
        Names of the catalogue, or how they begin.
    time : float, optional
        How long the run is, s; the file's experiment if not given.
    progress : callable
        Told what is done and the total.
    tell : callable, optional
        Told how each FMU was linearised, how much there is to be done, and how long the rest takes.
    **found
        ``law``, ``step``, ``amplitude`` and ``load`` of `linear_system`.

    Raises
    ------
    ArgumentError
        If no scheme reaches it, or one cannot be predicted.
    FmuError, CouplingError, ComponentError
        See `system_stability`.
    """
    check_accuracy(accuracy)
    system = linear_system(path, **found, progress=lambda a, b: progress(LINEARISING * a / b, 1.0))
    boxes, known = system.boxes, system.schemes
    duration = system.duration if time is None else time
    if duration is None:
        raise FmuError(f"{path}: does not say when to stop; give --time")
    if not 0.0 < duration < math.inf:
        raise ArgumentError("time", duration, "must be > 0 s")
    names, steps = predictable(schemes, known), _steps(boxes.shortest / FINER, boxes.longest)
    for one, way in system.ways.items():
        tell(f"{one}: {way}")
    tell(f"{len(names)} searches")
    update = foretold(lambda a, b: progress(LINEARISING + (1 - LINEARISING) * a / b, 1.0), tell)
    error, options = MotionError(boxes.poles, duration), []
    for k, name in enumerate(names):
        try:
            coupling = Coupling(boxes, known[name].scheme)
            option = longest_step(name, None, coupling, accuracy, error, steps)
        except (ValueError, *FAILURES):  # it does not suit the system
            continue
        options += [option] if option is not None else []
        update(k + 1, len(names))
    doubts = {f"doubt of {name}": doubt for name, doubt in system.doubts.items()}
    about = {"accuracy": accuracy, "time": duration, **doubts}
    return cheapest_first(options, steps, boxes.exact, about)


def _steps(shortest: float, longest: float) -> FloatArray:
    """Round numbers (s) between two."""
    decades = 10.0 ** np.arange(math.floor(math.log10(shortest)), math.log10(longest))
    steps = np.sort(np.outer(decades, ROUND).ravel())
    within: FloatArray = steps[(steps >= shortest) & (steps <= longest)]
    return within
