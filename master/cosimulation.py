"""The loop over communication points. It stores nothing: see `recording` for that."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.schemes import Scheme, StepReport
from railcosim.master.system import System

_ROUNDING = 1e-6
"""Of a step: a remainder smaller than this is rounding in the user's numbers, not a step."""

_LIMIT = 1e6
"""Largest output, in nominal values. A contact force or a displacement in its own unit never gets
there (the force's nominal value is near the static load), while a coupling that diverges, growing
by a factor each step, passes it soon and long before it overflows."""


class Divergence(RuntimeError):  # noqa: N818 (it says what happened)
    """An output is not finite or absurdly large; the message says when, which, and what to try."""


class FallbackWarning(UserWarning):
    """A component cannot continue its inputs as the scheme asks."""


@dataclass(frozen=True, slots=True)
class CommunicationPoint:
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


def cosimulate(
    system: System,
    scheme: Scheme,
    step: float,
    stop: float,
    start: float = 0.0,
    *,
    limit: float = _LIMIT,
) -> Iterator[CommunicationPoint]:
    """Couple components over time.

    The components must be initialised at `start`. To let FMUs find their initial state from each
    other's values, call ``system.exchange()`` while they are in initialisation mode.

    Parameters
    ----------
    system : System
        What to couple.
    scheme : Scheme
        How to couple it.
    step : float
        Communication step, s. The last one is shorter if `stop` is not a multiple away.
    stop, start : float
        Time span, s.
    limit : float, optional
        Largest output, in its nominal values, that does not count as divergence.

    Yields
    ------
    CommunicationPoint
        At `start`, after every step, and last exactly at `stop`.

    Raises
    ------
    ValueError
        If step or span are not positive and finite, or the scheme does not suit the system.
    Divergence
        If an output is not finite or exceeds the limit.
    ComponentError
        If a component refuses a call.

    Warns
    -----
    FallbackWarning
        For every component that cannot continue its inputs as the scheme asks.

    Examples
    --------
    >>> for point in cosimulate(system, jacobi(), step=1e-4, stop=1.0):  # doctest: +SKIP
    ...     recorder.add(point)
    """
    if not (math.isfinite(step) and step > 0.0):
        raise ValueError(f"step must be positive and finite, got {step!r} s")
    if not (math.isfinite(start) and math.isfinite(stop) and stop > start):
        raise ValueError(f"stop must be finite and after start = {start!r} s, got {stop!r} s")
    for sentence in scheme.prepare(system):
        warnings.warn(sentence, FallbackWarning, stacklevel=2)
    return _loop(system, scheme, step=step, stop=stop, start=start, limit=limit)


def _loop(
    system: System, scheme: Scheme, *, step: float, stop: float, start: float, limit: float
) -> Iterator[CommunicationPoint]:
    """Generate the communication points."""
    largest = limit * np.array([variable.nominal for variable in system.variables])
    n_steps = max(1, math.ceil((stop - start) / step - _ROUNDING))
    remainder = stop - (start + (n_steps - 1) * step)
    # The same number for every full step: an FMU may keep matrices for the step it knows.
    last = step if abs(remainder - step) <= _ROUNDING * step else remainder
    t = start
    context = f"scheme {scheme.describe()}, step {step:g} s"
    try:
        system.forget()
        system.exchange()
        _check(system, largest, t, context)
        yield CommunicationPoint(t, system.outputs.copy(), None)
        for i in range(1, n_steps + 1):
            is_last = i == n_steps
            report = scheme.step(system, t, last if is_last else step)
            t = stop if is_last else start + i * step
            _check(system, largest, t, context)
            yield CommunicationPoint(t, system.outputs.copy(), report)
    except ComponentError as error:
        raise ComponentError(f"{error} (step from t = {t:.9g} s, {context})") from error


def _check(system: System, largest: FloatArray, t: float, context: str) -> None:
    """Raise Divergence if an output is out of bounds."""
    # One comparison finds large values and NaN, which compares false.
    inside = np.abs(system.outputs) <= largest
    if inside.all():
        return
    worst = int(np.argmin(inside))
    unit = system.variables[worst].unit
    raise Divergence(
        f"diverged at t = {t:.9g} s: {system.names[worst]} = {system.outputs[worst]:.6g} {unit} "
        f"(allowed: {largest[worst]:.3g}; {context}). Try a shorter step; the contact in the other "
        "component; Gauss-Seidel in place of Jacobi; or, if the value is right, a larger nominal "
        "value of the variable"
    )
