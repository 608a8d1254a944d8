"""Steps as long as an accuracy allows.

Every step is made twice from the same state: once whole, and once in two halves, which are kept.
The difference estimates the error of the halves [1]_. It works with every scheme, for it asks
nothing of a scheme and only rollback of the components; it costs three evaluations a step instead
of the two that the halves need.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from railcosim.master.component import ComponentError, FloatArray, Type
from railcosim.master.pace import rounded_up
from railcosim.master.schemes import ConvergenceError, Stepper, StepReport, check_rollback
from railcosim.master.system import System

_SAFETY = 0.9
_LEAST, _MOST = 0.2, 4.0
"""Change of the step from one to the next."""
_TINY = 1e-4
"""An error below this is not told from none."""
_RUNG = 2.0**0.25
"""Steps are taken from a ladder with four rungs to a factor of two. FMUs may keep matrices for the
steps they know, and so half a step is one as well."""
_ROUNDING = 1e-6
"""Of a step: what is left before the end is rounding, not a step."""


class StepTooSmall(ComponentError):  # noqa: N818 (it says what happened)
    """The accuracy asked for needs a step below the smallest; says when, and what to do."""


@dataclass(frozen=True, kw_only=True)
class StepControl:
    """Steps chosen by an error estimate.

    Of every output the error that one step adds is kept within

        ``(absolute * nominal + relative * |value|) * max(absolute, relative)**(1 / order)``

    The last factor makes the error of a whole run proportional to the tolerances [2]_: about as
    large as they are, for each time constant of the system that the run is long.

    What two results do not differ by is not seen. A scheme that extrapolates signals (Jacobi)
    learns of a jump in one at the next point only: one in the second half of a step changes
    neither result. Schemes that step signals first (Gauss-Seidel, iterated) see it.

    Attributes
    ----------
    order : int
        Of the scheme in the step: `Scheme.order`, unless a component cannot do what it asks.
    relative, absolute : float
        Tolerances, without a unit; for an output without a nominal value that is 1 of its unit.
    largest : float
        Longest step, s; the first one tried. A bump shorter than half of it may be overlooked.
    smallest : float
        Shortest step, s. If the error is too large with it, the run ends with `StepTooSmall`.

    References
    ----------
    .. [1] E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd
       ed., Springer, 1993, II.4; the controller is of II, 2nd ed., 1996, IV.2.
    .. [2] M. Calvo, D. J. Higham, J. I. Montijano, L. Randez, Stepsize selection for tolerance
       proportionality in explicit Runge-Kutta codes, Advances in Computational Mathematics 7
       (1997) 361-382.
    """

    order: int
    relative: float = 1e-4
    absolute: float = 1e-4
    largest: float
    smallest: float

    def __post_init__(self) -> None:
        if self.order < 1:
            raise ValueError(f"order must be at least 1, got {self.order!r}")
        for name in ("relative", "absolute"):
            value = getattr(self, name)
            if not 0.0 <= value < 1.0:
                raise ValueError(f"{name} must be from 0 to below 1, got {value!r}")
        if self.relative + self.absolute == 0.0:
            raise ValueError("relative and absolute are both 0: no step is that good")
        if not 0.0 < self.smallest <= self.largest < math.inf:
            raise ValueError(
                "the smallest step must be positive and at most the largest, which must be finite; "
                f"got {self.smallest!r} s and {self.largest!r} s"
            )

    def walk(self, system: System, stepper: Stepper, start: float, stop: float) -> ControlledWalk:
        """Begin with the largest step; see `Pace.walk`."""
        check_rollback(system)
        return ControlledWalk(self, system, stepper, stop)

    @property
    def longest(self) -> float:
        """The longest step, s."""
        return self.largest

    def whole(self, start: float, stop: float) -> None:
        """There are no whole steps; see `Pace.whole`."""

    def reach(self, start: float, stop: float) -> float:
        """A time (s) that no step ends behind; see `Pace.reach`."""
        return rounded_up(stop)

    def describe(self) -> str:
        """For people and for results."""
        return (
            f"steps of {self.smallest:g} to {self.largest:g} s for relative {self.relative:g}, "
            f"absolute {self.absolute:g}"
        )


class ControlledWalk:
    """See `Walk`; it remembers where on the ladder the next step is, and the last error.

    Attributes
    ----------
    memory : tuple of (int, float)
        How many rungs the next step is below the largest, and the last error in what is allowed.
    """

    def __init__(self, pace: StepControl, system: System, stepper: Stepper, stop: float) -> None:
        self.memory: tuple[int, float] = (0, 1.0)
        self._pace, self._system, self._stepper, self._stop = pace, system, stepper, stop
        self._nominal = np.array([abs(v.nominal) for v in system.variables])
        self._jumping = [i for i, v in enumerate(system.variables) if v.type is not Type.REAL]
        self._strictness = max(pace.relative, pace.absolute) ** (1.0 / pace.order)

    def advance(self, t: float) -> tuple[float, StepReport]:
        """Make one step, as long as it may be; see `Walk.advance`."""
        k = self._pace.order + 1
        rung, before = self.memory
        state, memory = self._system.save_state(), self._stepper.memory
        evaluations = rejections = 0
        while True:
            h, last = self._length(t, rung)
            attempt = self._attempt(t, h, state, memory)
            evaluations += sum(report.evaluations for report in attempt.reports)
            if attempt.error <= 1.0:
                break
            if h <= self._pace.smallest:
                raise self._failure(t, h, attempt)
            rejections += 1
            wanted = max(_SAFETY * attempt.error ** (-1.0 / k), _LEAST)
            rung = self._rung(h * min(wanted, 1.0 / _RUNG))
            self._go_back(state, memory)
        # Proportional and integral, which damps the to and fro of steps at the limit of stability.
        error = max(attempt.error, _TINY)
        wanted = max(_SAFETY * error ** (-0.7 / k) * before ** (0.4 / k), _LEAST)
        self.memory = self._rung(h * min(wanted, 1.0 if rejections else _MOST)), error
        _, *halves = attempt.reports
        report = StepReport(
            evaluations,
            halves[-1].residual,
            all(half.converged for half in halves),
            attempt.error,
            rejections,
        )
        return (self._stop if last else t + h), report

    def _length(self, t: float, rung: int) -> tuple[float, bool]:
        """Length of a step from `t`, s, and whether it is the last."""
        h = max(self._pace.largest * _RUNG**-rung, self._pace.smallest)
        last = self._stop - t <= (1.0 + _ROUNDING) * h
        return (self._stop - t if last else h), last

    def _rung(self, h: float) -> int:
        """Give the highest rung that is not above `h` (s)."""
        rungs = math.log(self._pace.largest / h) / math.log(_RUNG)
        return max(0, math.ceil(rungs - _ROUNDING))

    def _attempt(self, t: float, h: float, state: Any, memory: Any) -> _Attempt:
        """Make a step whole and in halves."""
        system, stepper = self._system, self._stepper
        reports: list[StepReport] = []
        try:
            reports.append(stepper.step(t, h))
            whole = system.outputs.copy()
            self._go_back(state, memory)
            reports.append(stepper.step(t, 0.5 * h))
            reports.append(stepper.step(t + 0.5 * h, 0.5 * h))
        except ConvergenceError as failure:
            return _Attempt(np.full(len(system.outputs), math.inf), tuple(reports), failure)
        pace, values = self._pace, system.outputs
        size = np.maximum(np.abs(values), np.abs(whole))
        allowed = (pace.absolute * self._nominal + pace.relative * size) * self._strictness
        allowed[self._jumping] = math.inf  # they are right, or an event is elsewhere
        # Of order p, whole and halves differ by 2^p - 1 times the error of the halves.
        error = np.abs(values - whole) / (2.0**pace.order - 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(error == 0.0, 0.0, error / allowed)
        return _Attempt(np.where(np.isfinite(ratio), ratio, math.inf), tuple(reports), None)

    def _go_back(self, state: Any, memory: Any) -> None:
        """Go back to the beginning of the step."""
        self._system.restore_state(state)
        self._stepper.memory = memory

    def _failure(self, t: float, h: float, attempt: _Attempt) -> ComponentError:
        """Say what the smallest step is not enough for, and what to do."""
        if attempt.failure is not None:
            return attempt.failure
        worst = int(np.argmax(attempt.ratio))
        return StepTooSmall(
            f"the error of a step of {h:.3g} s, the smallest, is {attempt.error:.3g} times what is "
            f"allowed, at {self._system.names[worst]}, t = {t:.9g} s. Something jumps there, or "
            "the scheme is unstable: allow a smaller step or a larger error, or take the scheme "
            "interface-jacobian"
        )


class _Attempt(NamedTuple):
    """How a step went, whole and in halves.

    Attributes
    ----------
    ratio : array, shape (n_outputs,)
        Error of each output in what is allowed; infinite if there is no result.
    reports : tuple of StepReport
        Of the steps made.
    failure : ConvergenceError or None
        Why there is no result.
    """

    ratio: FloatArray
    reports: tuple[StepReport, ...]
    failure: ConvergenceError | None

    @property
    def error(self) -> float:
        """The largest error."""
        return float(self.ratio.max(initial=0.0))
