"""A linear model of an FMU file, by the best of the ways it allows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from railcosim.master.component import Component, FloatArray, Type, Variable
from railcosim.master.fmi.archive import FmuError, description_of
from railcosim.master.fmi.flaws import read_raw
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.linear.begun_anew import BegunAnew
from railcosim.master.linear.linear_form import LinearForm
from railcosim.master.linear.linearise import linearise
from railcosim.master.linear.model_exchange import Slope, adjoint, differences, exact, linear_model
from railcosim.master.progress import Progress
from railcosim.master.suggest import suggest


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """Where an FMU is linearised, and what of it.

    Attributes
    ----------
    inputs, outputs : sequence of str or None
        What to keep; all if None.
    at : mapping of str to float
        Inputs that do not keep their start values.
    parameters : mapping of str to float, int or bool
        Parameters that do not keep their defaults.
    """

    inputs: Sequence[str] | None = None
    outputs: Sequence[str] | None = None
    at: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float | int | bool] = field(default_factory=dict)


class Way(Protocol):
    """A way to linearise an FMU."""

    @property
    def description(self) -> str:
        """In a few words, for results."""

    def __call__(self, path: Path, name: str, wanted: Wanted, progress: Progress) -> LinearForm:
        """Linearise the file `path`; the model is called `name`.

        Raises
        ------
        FmuError
            If the FMU does not allow it, or a name or value is wrong.
        ComponentError
            If the FMU refuses a call.
        """


@dataclass(frozen=True)
class ModelExchange:
    """From inside, by Model Exchange: `EXACT`, `ADJOINT` or `DIFFERENCES`."""

    description: str
    slope: Slope

    def __call__(self, path: Path, name: str, wanted: Wanted, progress: Progress) -> LinearForm:
        """Linearise; see `Way`."""
        return linear_model(
            path,
            name=name,
            inputs=wanted.inputs,
            outputs=wanted.outputs,
            at=wanted.at,
            parameters=wanted.parameters,
            slope=self.slope,
            progress=progress,
        )


EXACT = ModelExchange("Model Exchange, directional derivatives", exact)
ADJOINT = ModelExchange("Model Exchange, adjoint derivatives", adjoint)
DIFFERENCES = ModelExchange("Model Exchange, finite differences", differences)


@dataclass(frozen=True, kw_only=True)
class Pulses:
    """From outside, by Co-Simulation; the attributes are those of `linearise`."""

    amplitude: ArrayLike
    step: float
    steps: int
    directions: ArrayLike | None = None
    description: str = "Co-Simulation, pulses"

    def __call__(self, path: Path, name: str, wanted: Wanted, progress: Progress) -> LinearForm:
        """Linearise; see `Way`. An FMU that cannot go back begins anew for each record."""
        with ExitStack() as stack:
            fmu = stack.enter_context(FmuComponent.load(path, name=name))
            _check_names(path, wanted, fmu)
            # Asked of one with these parameters; it is left alone.
            fmu.set_parameters(wanted.parameters)
            able = fmu.rollback_fault is None
            make = partial(begun, stack, path, name, wanted)
            component: Component = make() if able else BegunAnew(make)
            return linearise(
                component,
                at=at_start(fmu, wanted),
                amplitude=self.amplitude,
                step=self.step,
                steps=self.steps,
                inputs=_reals(fmu.inputs) if wanted.inputs is None else wanted.inputs,
                outputs=_reals(fmu.outputs) if wanted.outputs is None else wanted.outputs,
                directions=self.directions,
                progress=progress,
            )


def begun(stack: ExitStack, path: Path, name: str, wanted: Wanted) -> FmuComponent:
    """Give a new instance for Co-Simulation, initialised where `wanted` says; `stack` closes it."""
    fmu = stack.enter_context(FmuComponent.load(path, name=name))
    fmu.set_parameters(wanted.parameters)
    fmu.enter_initialization(0.0)
    fmu.set_inputs(at_start(fmu, wanted))
    fmu.exit_initialization()
    return fmu


def at_start(fmu: FmuComponent, wanted: Wanted) -> FloatArray:
    """All inputs of an instance there."""
    return np.array([wanted.at.get(v.name, v.start) for v in fmu.inputs])


def _check_names(path: Path, wanted: Wanted, fmu: FmuComponent) -> None:
    """Refuse names of what the FMU does not have, or what is no Real."""
    for kind, names, known in (
        ("input", [*wanted.at, *(wanted.inputs or ())], fmu.inputs),
        ("output", wanted.outputs or (), fmu.outputs),
    ):
        allowed = _reals(known)
        for one in names:
            if one not in allowed:
                raise FmuError(f"{path}: no {kind} {one}{suggest(one, allowed)}")


def _reals(variables: Sequence[Variable]) -> list[str]:
    """The names of those that can be linear in anything."""
    return [v.name for v in variables if v.type is Type.REAL]


def best_way(path: Path, pulses: Pulses) -> Way:
    """The most exact way an FMU allows: from inside if it can be seen, else by pulses.

    Parameters
    ----------
    path : Path
        The ``.fmu`` file.
    pulses : Pulses
        The way for an FMU that is for Co-Simulation only.

    Raises
    ------
    FmuError
        If the file is not a usable FMU.
    """
    with description_of(path) as folder:
        kind = read_raw(path, folder).modelExchange
    if kind is None:
        return pulses
    if kind.providesDirectionalDerivative:
        return EXACT
    return ADJOINT if kind.providesAdjointDerivatives else DIFFERENCES
