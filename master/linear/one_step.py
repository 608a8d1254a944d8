"""Whether an FMU steps as its linear model moves: one step of its Co-Simulation tells."""

from __future__ import annotations

import math
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from scipy.linalg import expm

from railcosim.master.component import FloatArray, Hold
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


def apart_in_a_step(
    path: Path, model: StateSpace, wanted: Wanted, otherwise: float
) -> tuple[float, str]:
    """Largest difference of a Co-Simulation to a linear model of it after one step.

    From where `wanted` starts, with the one input changed to which an output answers most. The step
    is as long as the fastest motion of the model takes for one radian.

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
    float
        Over what the output should answer; zero if none does.
    str
        Which output, of which input and step.

    Raises
    ------
    FmuError, ComponentError
        If the FMU refuses.
    """
    h = _radian(model, otherwise)
    after = _held(model, h)
    sizes = np.abs(after) / np.array([v.nominal for v in model.outputs])[:, None]
    most = float(sizes.max(initial=0.0))
    if not 0.0 < most < math.inf:
        return 0.0, ""
    column = int(sizes.max(axis=0).argmax())
    seen = sizes[:, column] >= SEEN * most
    changed, expected = model.inputs[column].name, after[seen, column]
    left = _stepped(path, model, wanted, changed, 0.0, h)
    found = []
    for response in RESPONSES:
        change = response / most
        answer = _stepped(path, model, wanted, changed, change, h) - left
        found.append(np.abs(answer[seen] / change - expected) / np.abs(expected))
    best = min(found, key=lambda off: float(off.max()))
    output = model.outputs[int(np.flatnonzero(seen)[best.argmax()])].name
    return float(best.max()), f"{output} after a step of {h:.3g} s with {changed} changed"


def _radian(model: StateSpace, otherwise: float) -> float:
    """Time (s) in which the fastest motion turns, or dies, by one."""
    fastest = float(np.abs(np.linalg.eigvals(model.A.toarray())).max(initial=0.0))
    return 1.0 / fastest if fastest * otherwise > STILL else otherwise


def _held(model: StateSpace, h: float) -> FloatArray:
    """What outputs are after inputs of 1 have been held for `h`, shape (n_outputs, n_inputs)."""
    n, m = model.B.shape
    both = np.zeros((n + m, n + m))
    both[:n, :n], both[:n, n:] = model.A.toarray(), model.B
    found: FloatArray = model.C @ expm(h * both)[:n, n:] + model.D
    return found


def _stepped(
    path: Path, model: StateSpace, wanted: Wanted, changed: str, change: float, h: float
) -> FloatArray:
    """Outputs of the model after one step of a new instance."""
    with ExitStack() as stack:
        fmu = begun(stack, path, model.name, wanted)
        fmu.set_hold(Hold.CONSTANT)
        names = [v.name for v in fmu.inputs]
        u = at_start(fmu, wanted)
        u[names.index(changed)] += change
        fmu.set_inputs(u)
        fmu.do_step(0.0, h)
        told = dict(zip([v.name for v in fmu.outputs], fmu.get_outputs(), strict=True))
        return np.array([told[v.name] for v in model.outputs], dtype=float)
