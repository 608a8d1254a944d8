"""The loop over communication points. It stores nothing: see `recording` for that."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.linalg.blas import dnrm2

from railcosim.master.component import ComponentError, FloatArray, RunEnded, Type, Variable
from railcosim.master.pace import FixedStep, Pace
from railcosim.master.schemes import Scheme, StepReport
from railcosim.master.system import System

LIMIT = 1e6
"""Largest output, in nominal values. A contact force or a displacement in its own unit never gets
there (the force's nominal value is near the static load), while a coupling that diverges, growing
by a factor each step, passes it soon and long before it overflows."""


_UNSTATED = 1e6
"""The same of what has no nominal value, such as pressures and powers in SI's units: a thousand
million of these is no divergence yet."""


def _yardstick(variable: Variable) -> float:
    """What an output is measured by; what jumps between whole numbers does not diverge."""
    if variable.type is not Type.REAL:
        return math.inf
    return variable.nominal if variable.has_nominal else _UNSTATED


class Divergence(RuntimeError):  # noqa: N818 (it says what happened)
    """An output is not finite or absurdly large; the message says when, which, and what to try."""


class FallbackWarning(UserWarning):
    """A component cannot continue its inputs as the scheme asks."""


class CommunicationPoint(NamedTuple):
    """The state of the exchange at one instant.

    Attributes
    ----------
    time : float
        Time, s.
    outputs : array, shape (n_variables,)
        All outputs, in the order of `System.names`; a copy, yours to keep.
    report : StepReport or None
        How the step to here went; None at the start.
    """

    time: float
    outputs: FloatArray
    report: StepReport | None


def _whole(system: System, pace: Pace, start: float, stop: float) -> float:
    """The end of a run (s), of whole steps where a component takes no others."""
    one = next((c.name for c in system.components if not c.takes_any_step), None)
    end = stop if one is None else pace.whole(start, stop)
    if end is None:
        raise ValueError(
            f"{one} takes steps of one length only (its canHandleVariableCommunicationStepSize is "
            "false): no tolerance by which steps are chosen"
        )
    if end != stop:
        warnings.warn(
            f"{one} takes steps of one length only, so the run ends at t = {end:.9g} s and not at "
            f"{stop:.9g} s",
            stacklevel=4,
        )
    return end


class Cosimulation(Iterator[CommunicationPoint]):
    """See `cosimulate`; an iterator over communication points.

    Attributes
    ----------
    system : System
        What is coupled.
    stepper : Stepper
        The scheme at work on it.
    walk : Walk
        The pace at work on it.
    time : float
        Where it has got to, s; NaN before the first point.
    start, stop : float
        Its span, s.
    ended : str
        What a component said that ended the run before; empty if none did.
    context : str
        Scheme and pace, for people.
    """

    def __init__(
        self, system: System, scheme: Scheme, pace: Pace, start: float, stop: float, limit: float
    ) -> None:
        self.system = system
        self.ended = ""
        stop = _whole(system, pace, start, stop)
        for component in system.components:
            component.expect_step(pace.longest)
        self.stepper = scheme.start(system)
        self.walk = pace.walk(system, self.stepper, start, stop)
        self.time = math.nan
        self.start, self.stop = start, stop
        self._limits = limit * np.array([_yardstick(v) for v in system.variables])
        self._alike = len(set(self._limits)) == 1
        self._most = float(self._limits[0]) if self._alike else 1.0
        self._scaled = np.zeros(max(len(system.variables), 1))  # BLAS takes no empty
        self._in_limits = self._scaled[: len(system.variables)]
        self.context = f"scheme {scheme.describe()}, {pace.describe()}"

    def __next__(self) -> CommunicationPoint:
        """Make the next step; see `cosimulate`."""
        for point in self:
            return point
        raise StopIteration

    def __iter__(self) -> Iterator[CommunicationPoint]:
        """All points from `time` on; where it has got to is in the object, not in the iterator."""
        # Looked up once and not at every point.
        advance, copy, limits = self.walk.advance, self.system.outputs.copy, self._limits
        alike, most, scaled, in_limits = self._alike, self._most, self._scaled, self._in_limits
        point, kind, norm, is_nan = tuple.__new__, CommunicationPoint, dnrm2, math.isnan
        report: StepReport | None = None
        while (t := self.time) != self.stop:
            try:
                if is_nan(t):  # at the beginning
                    t = self.start
                    self.system.begin(t)
                else:
                    t, report = advance(t)
            except RunEnded as end:
                self.ended, self.stop = str(end), t
                return
            except ComponentError as error:
                # Of the same kind: a step that does not converge is one of them.
                message = f"{error} (step from t = {t:.9g} s, {self.context})"
                raise type(error)(message) from error
            outputs = copy()
            # No value is larger than the norm of all, and NaN compares false.
            watched = outputs
            if not alike:
                np.divide(outputs, limits, in_limits)
                watched = scaled
            if not norm(watched) <= most:
                self._check(outputs, t)
            self.time = t
            # What CommunicationPoint(...) does, in half the time.
            yield point(kind, (t, outputs, report))

    def _check(self, outputs: FloatArray, t: float) -> None:
        """Raise Divergence if an output is out of bounds."""
        inside = np.abs(outputs) <= self._limits
        if inside.all():
            return
        worst = int(np.argmin(inside))
        variable = self.system.variables[worst]
        raise Divergence(
            f"diverged at t = {t:.9g} s: {self.system.names[worst]} = {outputs[worst]:.6g} "
            f"{variable.unit} (allowed: {self._limits[worst]:.3g}; {self.context}). "
            "Try a shorter step; the scheme interface-jacobian; the contact in another component; "
            "or, if the value is right, a larger nominal value of the variable, or a larger "
            "limit where one can be given (--limit of run and run-system)"
        )


def cosimulate(
    system: System,
    scheme: Scheme,
    step: float | Pace,
    stop: float,
    start: float = 0.0,
    *,
    limit: float = LIMIT,
) -> Cosimulation:
    """Couple components over time.

    The components must be initialised at `start`. To let FMUs find their initial state from each
    other's values, call ``system.exchange()`` while they are in initialisation mode.

    Parameters
    ----------
    system : System
        What to couple.
    scheme : Scheme
        How to couple it.
    step : float or Pace
        Communication step, s; the last one is shorter if `stop` is not a multiple away. Or a rule
        for it.
    stop, start : float
        Time span, s.
    limit : float, optional
        Largest output, in its nominal values, that does not count as divergence.

    Returns
    -------
    Cosimulation
        An iterator over communication points: at `start`, after every step, and last exactly at
        `stop`. It raises Divergence if an output is not finite or exceeds the limit, and
        ComponentError if a component refuses a call.

    Raises
    ------
    ValueError
        If step or span are not positive and finite, or the scheme does not suit the system.

    Warns
    -----
    FallbackWarning
        For every component that cannot continue its inputs as the scheme asks.

    Examples
    --------
    >>> for point in cosimulate(system, jacobi(), step=1e-4, stop=1.0):  # doctest: +SKIP
    ...     recorder.add(point)
    """
    if not (math.isfinite(start) and math.isfinite(stop) and stop > start):
        raise ValueError(f"stop must be finite and after start = {start!r} s, got {stop!r} s")
    pace = FixedStep(step) if isinstance(step, float | int) else step
    run = Cosimulation(system, scheme, pace, start, stop, limit)
    for sentence in run.stepper.fallbacks:
        warnings.warn(sentence, FallbackWarning, stacklevel=2)
    return run
