"""A short run as reference data: what an FMU must answer to inputs that anyone can repeat.

The run is made by the Python models, which share no code with the native runtime.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.contact.profiled import Profiled
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import FORCE, IRREGULARITY, RAIL, WHEEL, Port, Z

from ..interface import Scalar
from ..python_runtime.models import Model
from ..roles import Role

STEP, STEPS = 1e-4, 200  # s
SPEED = 250 / 3.6  # m/s
BRAKING = -20.0  # m/s2: hard enough to be seen
OF_NOMINAL = 0.1  # as large as lateral forces are beside vertical ones


@dataclass(frozen=True)
class Wave:
    """An input u = mean (1 + depth sin(2 pi frequency t + k)), k = 0, 1, ... for the wheels.

    Attributes
    ----------
    mean : float or None
        In the unit of the input; None is its start value, or where that is 0 a part of the nominal
        one.
    depth : float
        Relative amplitude.
    frequency : float
        Hz.
    """

    mean: float | None
    depth: float
    frequency: float


WAVES = {
    FORCE: Wave(None, 0.2, 50.0),
    WHEEL.motion: Wave(1.5e-3, 0.02, 50.0),  # about the deflection under the static load
    RAIL.motion: Wave(-1e-4, 0.2, 50.0),  # about the compression under it
    IRREGULARITY: Wave(1e-5, 1.0, 120.0),
    WHEEL.rate: Wave(None, 0.5, 50.0),
    RAIL.rate: Wave(None, 0.5, 50.0),
}
"""Of what goes down; in other directions means are parts of nominal values."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """Inputs and outputs at communication points.

    Attributes
    ----------
    time : array, shape (n,)
        s.
    inputs, outputs : dict of array, shape (n,)
        By name of variable. Outputs of a row are those at the end of the step that leads to it,
        the inputs of the row before being held; those of the first row are at rest under its
        inputs.
    formulas : dict of str
        Inputs as functions of time t and number k of the wheel, by quantity.
    """

    time: FloatArray
    inputs: dict[str, FloatArray]
    outputs: dict[str, FloatArray]
    formulas: dict[str, str]


def reference_run(
    body: ModalBody, table: Sequence[Scalar], profiles: Profiled | None = None
) -> Run:
    """Step a model with inputs held over steps of 0.1 ms, all parameters at their start values.

    Parameters
    ----------
    body : ModalBody
        The model.
    table : sequence of Scalar
        The interface.
    profiles : Profiled, optional
        Of its wheels and rails.
    """
    time: FloatArray = STEP * np.arange(STEPS + 1, dtype=np.float64)
    known = [v for v in table if v.causality == "input"]
    wheels = {wheel: k for k, wheel in enumerate(body.layout.wheels)}
    u = np.array([_input(v, time, wheels) for v in known]).T  # (n, inputs)
    u = u.reshape(time.size, len(known))
    names = [v.name for v in table if v.causality == "output"]
    made = Model(body, [v.slot for v in table], profiles)
    made.configure(
        {(v.role, v.index): float(v.start or 0) for v in table if v.causality == "parameter"}
    )
    y = np.empty((time.size, len(names)))
    state, now = made.rest(made.read(u[0])), made.read(u[0])
    made.write(state, now, 0.0, y[0])
    behind = 0.0
    for k, end in enumerate(time[1:], start=1):
        held = u[k - 1]
        now = made.read(held)
        state = made.mover.step(state, now, now, STEP)
        behind += made.behind(time[k - 1], STEP, u[max(k - 2, 0)], held, held)
        made.write(state, now, made.speed(held) * end - behind, y[k])
    return Run(
        time=time,
        inputs={v.name: column for v, column in zip(known, u.T, strict=True)},
        outputs=dict(zip(names, y.T, strict=True)),
        formulas=_formulas(known),
    )


def _input(v: Scalar, time: FloatArray, wheels: Mapping[str, int]) -> FloatArray:
    if v.port is None:
        return float(v.start or 0) + _rates(v) * time
    wave, k = _wave(v, v.port), wheels[v.port.wheel]
    mean = _mean(v, wave)
    swing: FloatArray = mean * (1 + wave.depth * np.sin(2 * np.pi * wave.frequency * time + k))
    return swing


def _rates(v: Scalar) -> float:
    """By how much an input that is no port's changes in a second: a place, or the speed."""
    return BRAKING if v.role is Role.IN_SPEED else SPEED


def _mean(v: Scalar, wave: Wave) -> float:
    if wave.mean is None or (v.port and v.port.direction is not Z):
        return float(v.start or OF_NOMINAL * v.nominal)
    return wave.mean


def _wave(v: Scalar, port: Port) -> Wave:
    """The one of its quantity."""
    return next(wave for pattern, wave in WAVES.items() if port.name(pattern) == v.name)


def _formulas(known: Sequence[Scalar]) -> dict[str, str]:
    formulas = {}
    for v in known:
        quantity = v.quantity
        if v.port is None:
            formulas[quantity] = f"start value + {_rates(v)!r} t"
        elif quantity not in formulas:
            wave = _wave(v, v.port)
            mean = _mean(v, wave)
            formulas[quantity] = (
                f"{mean!r} (1 + {wave.depth:g} sin(2 pi {wave.frequency:g} t + k)) {v.unit}"
            )
    return formulas


def csv(time: FloatArray, columns: dict[str, FloatArray]) -> bytes:
    """Comma-separated values with a header, as the FMI cross-check has them; full precision."""
    header = ",".join(f'"{name}"' for name in ("time", *columns))
    rows = np.column_stack([time, *columns.values()]).tolist()
    lines = [header, *(",".join(map(repr, row)) for row in rows)]
    return ("\n".join(lines) + "\n").encode()


def scheme(name: str, run: Run, table: Sequence[Scalar]) -> str:
    """How the reference data came about, in words."""
    units = {v.name: v.unit for v in table}
    names = (*run.inputs, *run.outputs)
    formulas = "\n".join(f"  {quantity} = {text}" for quantity, text in run.formulas.items())
    columns = "\n".join(f"  {column}: {units[column]}" for column in names)
    return f"""Reference run of {name}

{name}_in.csv   inputs
{name}_ref.csv  outputs

Co-simulation from t = 0 s to {run.time[-1]:g} s with a communication step of {STEP:g} s and
input_hold = 0: the inputs of a row are set and held over the step to the next row.
The inputs of the first row are set in initialisation mode. All parameters have their start values.
Outputs of a row are read at the end of the step, before new inputs are set; those of the first
row after initialisation. Made in double precision by the Python models of railcosim, apart from
the runtime in this FMU; two runtimes differ by rounding (1e-9 of a column's largest value).

Inputs, t in s, k = 0, 1, ... for the wheels: left ones from the front, then right ones:
{formulas}

Columns and units, time in s:
{columns}
"""
