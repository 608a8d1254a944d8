"""Whether an FMU steps as its linear model moves: steps of its Co-Simulation tell."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import fields
from pathlib import Path

import numpy as np

from railcosim.master.component import FloatArray, Hold
from railcosim.master.linear.euler_steps import EulerSteps
from railcosim.master.linear.linear_fmu import Wanted, at_start, begun
from railcosim.master.linear.state_space import StateSpace

ALIKE = 0.05
"""Relative difference that is told. Euler's rule makes 0.19 at least of a motion that turns by one
radian in the step, Heun's as much in its rate; Runge and Kutta's, with which limits are as they are
predicted, 0.01."""
RESPONSES = 1e-3, 1.0
"""Of the output that answers most, over its nominal value. Tolerances of solvers hide in the first
what bends in the second, so the better one counts."""
STILL = 1e-6
"""Turned in a step of the usual length: eigenvalues of what stands still are known to the root of
rounding where there are two of them."""
SEEN = 1e-3
"""Of that output's: one that answers less may be a solver's tolerance."""
BY_RULE = 1e-3
"""Relative difference up to which an FMU goes by Euler's rule: it has no tolerance, but what bends
and what finite differences err is there. Half steps of the rule would be off by a quarter."""
UNEQUAL = 1.0, 1.0 / 3.0
"""Steps, in radians, that tell: what the first moved moves in the second, and a rule of steps that
the FMU chooses is another in one of them."""


def as_it_steps(
    path: Path, model: StateSpace, wanted: Wanted, otherwise: float
) -> tuple[StateSpace, float, str]:
    """Find the rule by which an FMU's Co-Simulation moves its linear model.

    From where `wanted` starts, with the one input changed to which an output answers most. Steps
    are as long as the fastest motion of the model takes for one radian.

    Parameters
    ----------
    path : Path
        The FMU, for Co-Simulation as well.
    model : StateSpace
        Of it.
    wanted : Wanted
        Where that was made.
    otherwise : float
        Length of the step if nothing in the model moves by itself, s.

    Returns
    -------
    StateSpace
        The model; as `EulerSteps` if the FMU makes one step of Euler's rule of each step.
    float
        Largest difference to it after a step, over what the output should answer; zero if none
        does.
    str
        Which output, of which input and step.

    Raises
    ------
    FmuError, ComponentError
        If the FMU refuses.
    """
    h = _radian(model, otherwise)
    apart, of = _apart(path, model, wanted, [h])
    if apart > ALIKE:
        by_rule = EulerSteps(**{one.name: getattr(model, one.name) for one in fields(model)})
        if _apart(path, by_rule, wanted, [h * part for part in UNEQUAL])[0] <= BY_RULE:
            return by_rule, 0.0, ""
    return model, apart, of


def _apart(
    path: Path, model: StateSpace, wanted: Wanted, steps: Sequence[float]
) -> tuple[float, str]:
    """Largest difference of an FMU to a model after steps, and where; see `as_it_steps`."""
    after = _held(model, steps)
    sizes = np.abs(after) / np.array([v.nominal for v in model.outputs])[:, None]
    most = float(sizes.max(initial=0.0))
    if not 0.0 < most < math.inf:
        return 0.0, ""
    column = int(sizes.max(axis=0).argmax())
    seen = sizes[:, column] >= SEEN * most
    changed, expected = model.inputs[column].name, after[seen, column]
    left = _stepped(path, model, wanted, changed, 0.0, steps)
    found = []
    for response in RESPONSES:
        change = response / most
        answer = _stepped(path, model, wanted, changed, change, steps) - left
        found.append(np.abs(answer[seen] / change - expected) / np.abs(expected))
    best = min(found, key=lambda off: float(off.max()))
    output = model.outputs[int(np.flatnonzero(seen)[best.argmax()])].name
    return float(best.max()), f"{output} after a step of {steps[0]:.3g} s with {changed} changed"


def _radian(model: StateSpace, otherwise: float) -> float:
    """Time (s) in which the fastest motion turns, or dies, by one."""
    fastest = float(np.abs(np.linalg.eigvals(model.A.toarray())).max(initial=0.0))
    return 1.0 / fastest if fastest * otherwise > STILL else otherwise


def _held(model: StateSpace, steps: Sequence[float]) -> FloatArray:
    """What outputs are after inputs of 1 have been held, shape (n_outputs, n_inputs)."""
    x = np.zeros(model.B.shape)
    for free, driven in zip(*model.over(np.array(steps), 0), strict=True):
        x = free @ x + driven
    found: FloatArray = model.C @ x + model.D
    return found


def _stepped(
    path: Path,
    model: StateSpace,
    wanted: Wanted,
    changed: str,
    change: float,
    steps: Sequence[float],
) -> FloatArray:
    """Outputs of the model after steps of a new instance."""
    with ExitStack() as stack:
        fmu = begun(stack, path, model.name, wanted)
        fmu.set_hold(Hold.CONSTANT)
        names = [v.name for v in fmu.inputs]
        u = at_start(fmu, wanted)
        u[names.index(changed)] += change
        t = 0.0
        for h in steps:
            fmu.set_inputs(u)
            fmu.do_step(t, h)
            t += h
        told = dict(zip([v.name for v in fmu.outputs], fmu.get_outputs(), strict=True))
        return np.array([told[v.name] for v in model.outputs], dtype=float)
