"""Iterated coupling: a step is repeated until the values it was made with are those it gives.

All components go back to the beginning of the step and follow polynomials to guesses of their
inputs at the END of the step. They go one after the other, in an order that needs few guesses:
only what a component needs from itself or from a later one is guessed, everything else is fresh.
What the step gives for the guessed values, less the guesses, is the residual; a method makes the
next guesses of it. Signals are known at the end and never guessed; what is fed in one direction
only, such as a position, costs no iteration.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from railcosim.master.component import FloatArray, Type
from railcosim.master.continuation import NAMES, History
from railcosim.master.polynomials import lagrange
from railcosim.master.schemes import (
    AT_END,
    ConvergenceError,
    StepReport,
    check_degree,
    check_rollback,
    set_continuations,
)
from railcosim.master.system import System

_GUESS_POINTS = 3
"""Of the past, through which the first guess is extrapolated: a parabola. More amplify what the
tolerance left open."""


@dataclass(frozen=True, kw_only=True)
class Until:
    """When an iteration ends.

    A guessed value is good if the step gives it back to within ``absolute * nominal + relative *
    |value|``; all have to be. `nominal` is that of the variable, so units do not matter.

    Attributes
    ----------
    relative, absolute : float
        Tolerances, without a unit.
    max_evaluations : int
        So many without success are an error.
    accept : bool
        Take the last evaluation instead of failing; `StepReport.converged` then is False.
    """

    relative: float = 1e-9
    absolute: float = 1e-9
    max_evaluations: int = 50
    accept: bool = False

    def __post_init__(self) -> None:
        for name in ("relative", "absolute"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} must be finite and not negative, got {value!r}")
        if self.relative + self.absolute == 0.0:
            raise ValueError("relative and absolute are both 0: rounding alone exceeds that")
        if self.max_evaluations < 1:
            raise ValueError(f"max_evaluations must be at least 1, got {self.max_evaluations!r}")


class Acceleration(Protocol):
    """A method at work on one system.

    Attributes
    ----------
    memory : object
        What it keeps from step to step; as `Stepper.memory`.
    """

    memory: Any

    def begin(self, h: float) -> None:
        """Begin a step of length `h` (s)."""

    def improve(self, x: FloatArray, residual: FloatArray, weight: FloatArray) -> FloatArray:
        """Give the next guess.

        Parameters
        ----------
        x, residual : array, shape (n,)
            Guess, and what the step gave for it less the guess.
        weight : array, shape (n,)
            Of each value, what is allowed of the residual; so ``residual / weight`` has no unit.
        """

    def end(self, x: FloatArray, residual: FloatArray) -> None:
        """Take note of the last guess and its residual: the step is done."""


class Method(Protocol):
    """How guesses are improved: settings."""

    def start(self) -> Acceleration:
        """Go to work, remembering nothing."""

    def describe(self) -> str:
        """Name with settings."""


@dataclass(frozen=True)
class Iterated:
    """Iterated coupling by a method; made by `picard`, `aitken` and `iqn_ils`."""

    method: Method
    degree: int
    until: Until

    def __post_init__(self) -> None:
        check_degree(self.degree)

    @property
    def order(self) -> int:
        """Order of the error in the step."""
        return self.degree + 1

    def start(self, system: System) -> IteratedStepper:
        """Settle the order of the components and what is guessed; see `Scheme.start`."""
        check_rollback(system)
        return IteratedStepper(system, self)

    def describe(self) -> str:
        """Name with settings."""
        return f"{self.method.describe()}, {NAMES[self.degree]} inputs"

    __str__ = describe


@dataclass(frozen=True)
class _Turn:
    """One component's turn: which of its inputs are guesses, and which guesses they are."""

    k: int
    inputs: NDArray[np.intp]
    guesses: NDArray[np.intp]


class IteratedStepper:
    """See `Stepper`; it remembers the guessed values of the past and the method's memory."""

    stops = AT_END

    def __init__(self, system: System, scheme: Iterated) -> None:
        self._system, self._scheme = system, scheme
        self._turns, self._guessed = _take_turns(system)
        self.fallbacks = set_continuations(
            system, scheme.degree, {turn.k: True for turn in self._turns}
        )
        self._acceleration = scheme.method.start()
        self._past: History = ()
        self._nominal = np.array([abs(system.variables[i].nominal) for i in self._guessed])
        self._jumping = np.array(
            [system.variables[i].type is not Type.REAL for i in self._guessed], bool
        )

    @property
    def memory(self) -> tuple[History, Any]:
        """See `Stepper`."""
        return self._past, self._acceleration.memory

    @memory.setter
    def memory(self, memory: tuple[History, Any]) -> None:
        self._past, self._acceleration.memory = memory

    def step(self, t: float, h: float) -> StepReport:
        """Repeat the step until it gives what it was made with; see `Stepper.step`."""
        system, until = self._system, self._scheme.until
        now = system.outputs[self._guessed]
        self._past = (*self._past[1 - _GUESS_POINTS :], (t, now))
        x = np.where(self._jumping, now, _extrapolate(self._past, t + h))
        state = system.save_state()
        self._acceleration.begin(h)
        for evaluations in range(1, until.max_evaluations + 1):
            if evaluations > 1:
                system.restore_state(state)
            self._evaluate(t, h, x)
            answer = system.outputs[self._guessed]
            residual = answer - x
            weight = until.absolute * self._nominal + until.relative * np.abs(answer)
            # A value and its residual that are both zero are exact, whatever is allowed.
            ratio = np.abs(residual) / np.where(weight > 0.0, weight, np.finfo(float).tiny)
            size = float(ratio.max(initial=0.0))
            if size <= 1.0 or not math.isfinite(size):
                break
            if evaluations < until.max_evaluations:
                x = self._acceleration.improve(x, residual, weight)
                # Between two values of what is no Real there may be none.
                x = np.where(self._jumping, answer, x)
        converged = size <= 1.0
        if not converged and not (until.accept and math.isfinite(size)):
            raise self._failure(t + h, evaluations, ratio, residual, weight)
        self._acceleration.end(x, residual)
        system.exchange()
        return StepReport(evaluations, size, converged)

    def _evaluate(self, t: float, h: float, x: FloatArray) -> None:
        """Make the step with the guesses `x`."""
        system = self._system
        for turn in self._turns:
            u = system.gather(turn.k)
            u[turn.inputs] = x[turn.guesses]
            system.step_towards(turn.k, t, h, u)
            if system.reacts(turn.k):
                system.write_inputs(turn.k)
            system.refresh(turn.k)

    def _failure(
        self,
        t: float,
        evaluations: int,
        ratio: FloatArray,
        residual: FloatArray,
        weight: FloatArray,
    ) -> ConvergenceError:
        """Say what is left open and what to do."""
        worst = int(np.argmax(np.where(np.isfinite(ratio), ratio, np.inf)))
        place = self._guessed[worst]
        unit = self._system.variables[place].unit
        return ConvergenceError(
            f"{self._scheme.describe()} did not converge at t = {t:.9g} s: after {evaluations} "
            f"evaluations {self._system.names[place]} still changes by {residual[worst]:.3g} "
            f"{unit} (allowed: {weight[worst]:.3g} {unit}; residual {ratio[worst]:.3g} times that)."
            " Try iqn-ils or aitken, the scheme interface-jacobian, a shorter step, larger "
            "tolerances or max_evaluations; or accept=True to go on with what there is"
        )


def _take_turns(system: System) -> tuple[tuple[_Turn, ...], NDArray[np.intp]]:
    """Find the order of the components, and the outputs that are guessed.

    Signals first; then always the component that adds fewest guesses.
    """
    everybody = range(len(system.components))
    n = len(system.outputs)
    needs = [{int(s) for s in system.sources(k) if s < n} for k in everybody]
    known: set[int] = set()
    guessed: dict[int, None] = {}
    order: list[int] = []
    waiting = sorted(everybody, key=lambda k: bool(system.components[k].inputs))
    late: dict[int, set[int]] = {}
    while waiting:
        k = min(waiting, key=lambda k: len(needs[k] - known - guessed.keys()))
        waiting.remove(k)
        order.append(k)
        late[k] = needs[k] - known
        guessed.update(dict.fromkeys(sorted(late[k])))
        own = system.own_outputs(k)
        known.update(range(own.start, own.stop))
    where = {output: i for i, output in enumerate(guessed)}
    turns = []
    for k in order:
        sources = system.sources(k)
        inputs = np.array([j for j, s in enumerate(sources) if int(s) in late[k]], dtype=np.intp)
        guesses = np.array([where[int(s)] for s in sources[inputs]], dtype=np.intp)
        turns.append(_Turn(k, inputs, guesses))
    return tuple(turns), np.array(list(guessed), dtype=np.intp)


def _extrapolate(past: History, t: float) -> FloatArray:
    """Value at `t` (s) of the polynomial through the points of the past."""
    times = np.array([time for time, _ in past])
    last, scale = past[-1][1], t - times[0]
    (weights,) = lagrange((times - t) / scale, np.zeros(1))
    # Differences to the last one: what does not change stays the same to the bit.
    value: FloatArray = last + weights @ (np.array([x for _, x in past]) - last)
    return value
