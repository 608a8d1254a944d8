"""What an importer's documented scheme gives, with our own FMUs and our own master."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.master.component import Variable
from railcosim.master.connections import Connection, connect_by_name
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.schemes import Scheme
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.signals import Signal
from railcosim.master.system import System

from .job import Drive, Job

FloatArray = NDArray[np.float64]


class Unsorted:
    """A component as an importer sees it that does not ask which output needs which input.

    Our master sets inputs before it reads outputs that depend on them at once. Where no output is
    said to depend on an input, it reads all outputs first and sets all inputs after: an output
    with direct feedthrough is then that for the inputs of the step before.
    """

    def __init__(self, component: FmuComponent) -> None:
        self._component = component
        self.feedthrough = np.zeros_like(component.feedthrough)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._component, name)


@dataclass(frozen=True, kw_only=True)
class Documented:
    """A scheme as an importer documents it.

    Attributes
    ----------
    scheme : Scheme
        Over a step.
    feedthrough : bool
        Whether outputs are read after the inputs that they depend on at once have been set.
    exchanges : int
        How often values are exchanged in initialisation; with 0, inputs start as the job says.
    first_inputs : float or None
        A value that all connected inputs have in the first step, whatever the outputs are; in
        initialisation they have the FMUs' own start values.
    refreshed : bool
        Whether what is shown is read again after the inputs have been set.
    """

    scheme: Scheme
    feedthrough: bool = False
    exchanges: int = 0
    first_inputs: float | None = None
    refreshed: bool = False

    def rows(self, job: Job) -> FloatArray:
        """All outputs of vehicle and track at the end of every step, (steps, outputs)."""
        with ExitStack() as stack:
            fmus = [
                stack.enter_context(FmuComponent.load(path, name=name))
                for name, path in job.fmus.items()
            ]
            for fmu in fmus:
                fmu.set_parameters(job.parameters[fmu.name])
                fmu.enter_initialization(0.0)
                start = {v.name: v.start for v in fmu.inputs}
                if not self.exchanges and self.first_inputs is None:
                    start |= job.inputs[fmu.name]
                fmu.set_inputs(np.array(list(start.values())))
            seen = fmus if self.feedthrough else [Unsorted(fmu) for fmu in fmus]
            system = System(seen, [Connection(*c) for c in job.connections])
            for _ in range(self.exchanges):
                system.exchange()
            for fmu in fmus:
                fmu.exit_initialization()
            begin = 0.0
            rows: list[FloatArray] = []
            if self.first_inputs is not None:
                begin = job.step
                for fmu in fmus:
                    start = {v.name: v.start for v in fmu.inputs}
                    start |= dict.fromkeys(job.inputs[fmu.name], self.first_inputs)
                    fmu.set_inputs(np.array(list(start.values())))
                    fmu.do_step(0.0, job.step)
            for point in cosimulate(system, self.scheme, job.step, job.steps * job.step, begin):
                shown = [fmu.get_outputs() for fmu in fmus] if self.refreshed else [point.outputs]
                rows.append(np.concatenate(shown))
        return np.array(rows[-job.steps :])


def driven(drive: Drive, scheme: Scheme, *, feedthrough: bool) -> FloatArray:
    """Outputs of one FMU driven by signals, at every communication point, (points, outputs)."""
    table = np.array(list(drive.signals.values())).T
    signal = Signal(
        "signals",
        [Variable(name=name) for name in drive.signals],
        lambda t: table[round(t / drive.step)],
    )
    with FmuComponent.load(drive.fmu, name="fmu") as fmu:
        seen = [signal, fmu if feedthrough else Unsorted(fmu)]
        system = System(seen, connect_by_name(seen))
        fmu.enter_initialization(0.0)
        system.exchange()
        fmu.exit_initialization()
        points = cosimulate(system, scheme, drive.step, drive.times[-1])
        return np.array([point.outputs[len(drive.signals) :] for point in points])


SCHEMES = {
    "Jacobi": {"scheme": jacobi(degree=0)},
    "Jacobi, feedthrough resolved": {"scheme": jacobi(degree=0), "feedthrough": True},
    "Gauss-Seidel, vehicle first": {"scheme": gauss_seidel(first="vehicle", degree=0)},
    "Gauss-Seidel, track first": {"scheme": gauss_seidel(first="track", degree=0)},
}


def difference(found: FloatArray, expected: FloatArray) -> float:
    """Largest difference of any output over the run, relative to how far that output moves."""
    assert found.shape == expected.shape
    moves = expected.max(axis=0) - expected.min(axis=0)
    return float((np.abs(found - expected).max(axis=0) / moves).max())
