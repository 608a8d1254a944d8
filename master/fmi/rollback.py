"""Whether an FMU can go back to a saved state: tried, not believed.

Some FMUs declare that they can and forget a part of their state; a scheme that repeats steps then
gives wrong results without a word.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from railcosim.master.component import ComponentError, FloatArray, RunEnded
from railcosim.master.fmi.description import FmuDescription
from railcosim.master.fmi.fmu_parameters import Scalar
from railcosim.master.fmi.isolation import IsolatedComponent, IsolatedState

_STEP = 1e-3  # s, where the FMU names no step
_BEFORE, _AFTER = 2, 3
"""Steps before the snapshot and after it: enough for what an FMU remembers of its last inputs."""

_PARTS = (1.0, 1.0 / 16.0, 1.0 / 256.0)
"""Steps that are tried one after the other, over the first, where an FMU ends the run."""

Values = Mapping[str, Scalar]
Told = tuple[float, float | None, float | None]
_Key = tuple[object, ...]

_faults: dict[_Key, str | None] = {}
"""What was found, by all that it may depend on; see `_key`."""


def rollback_fault(
    description: FmuDescription,
    parameters: Values,
    inputs: FloatArray,
    told: Told,
    step: float | None,
) -> str | None:
    """Try on a new instance whether steps repeated from a snapshot give the same bits.

    The instance has a process of its own, so that nothing it does harms the one in use. Done once
    in a process for each file with the same parameters and start: what an FMU forgets may belong to
    a solver, or a part of the model, that a parameter chooses.

    Parameters
    ----------
    description : FmuDescription
        Of the FMU.
    parameters : mapping
        To set before.
    inputs : array, shape (n_inputs,)
        To step near.
    told : tuple of (float, float or None, float or None)
        Start, stop and tolerance, as of the instance in use.
    step : float or None
        Length of the steps, s; that of the run, if it is known.

    Returns
    -------
    str or None
        What is wrong, in one sentence; None if nothing is.
    """
    if not description.can_get_and_set_state:
        return "its canGetAndSetFMUstate is false"
    step = step or _STEP
    key = _key(description, parameters, told, step)
    if key not in _faults:
        _faults[key] = _try(description, parameters, inputs, told, step)
    return _faults[key]


def _key(description: FmuDescription, parameters: Values, told: Told, step: float) -> _Key:
    """What decides the result: not the inputs, which change all the time.

    Nor the step, unless the FMU has one length only: tried with another, it refuses.
    """
    steps = () if description.takes_any_step else (step,)
    values = tuple((name, type(x).__name__, repr(x)) for name, x in sorted(parameters.items()))
    return description.sha256, values, told, steps


def _try(
    description: FmuDescription,
    parameters: Values,
    inputs: FloatArray,
    told: Told,
    step: float,
) -> str | None:
    """Run the test; see `rollback_fault`. An FMU that ends too soon may take shorter steps."""
    ended = ""
    for part in _PARTS if description.takes_any_step else _PARTS[:1]:
        try:
            return _try_once(description, parameters, inputs, told, part * step)
        except RunEnded as end:
            ended = str(end)
    return ended


def _try_once(
    description: FmuDescription,
    parameters: Values,
    inputs: FloatArray,
    told: Told,
    step: float,
) -> str | None:
    """Run the test with steps of one length; RunEnded if the FMU ends before it."""
    try:
        with IsolatedComponent.load(description.path, name="test of rollback") as fmu:
            fmu.set_parameters(parameters)
            start, stop, tolerance = told
            end = start + (_BEFORE + _AFTER + 1) * step
            fmu.enter_initialization(start, stop and max(stop, end), tolerance)
            fmu.set_inputs(inputs)
            fmu.exit_initialization()
            fmu.keep_past()
            return _differs(fmu, inputs, start, step)
    except (ComponentError, ValueError) as error:  # FmuError is a ValueError
        return str(error)


def _differs(fmu: IsolatedComponent, inputs: FloatArray, start: float, h: float) -> str | None:
    """Take an initialised FMU through the same steps again and again."""
    _go(fmu, inputs, start, h, 0, _BEFORE)
    state = fmu.save_state()
    first = _go(fmu, inputs, start, h, _BEFORE, _AFTER)
    ways: dict[str, Callable[[], IsolatedState]] = {"it went back to a saved state": lambda: state}
    if fmu.description.can_serialize_state:
        data = fmu.serialize_state(state)
        ways["its state was written and read"] = lambda: fmu.deserialize_state(data)
    ways["it went back once more"] = lambda: state
    for way, snapshot in ways.items():
        fmu.restore_state(snapshot())
        again = _go(fmu, inputs, start, h, _BEFORE, _AFTER)
        unequal = np.argwhere(again.view(np.int64) != first.view(np.int64))
        if unequal.size:
            k, i = unequal[0]
            name, unit = fmu.outputs[i].name, fmu.outputs[i].unit
            value = f"{again[k, i]:.17g} {unit}".strip()
            return f"after {way}, step {k + 1} gave {name} = {value} and not {first[k, i]:.17g}"
    return None


def _go(
    fmu: IsolatedComponent, inputs: FloatArray, start: float, h: float, first: int, n_steps: int
) -> FloatArray:
    """Outputs, shape (n_steps, n_outputs), over steps with inputs that change a little."""
    nominal = np.array([v.nominal for v in fmu.inputs])
    outputs = []
    for k in range(first, first + n_steps):
        fmu.set_inputs(inputs + 1e-3 * nominal * np.sin(1.0 + k))
        fmu.do_step(start + k * h, h)
        outputs.append(fmu.get_outputs())
    return np.array(outputs)
