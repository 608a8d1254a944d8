"""A run in time of any system: watched, recorded, kept through crashes and interruptions."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import xarray as xr

from railcosim.master.bonds import find_bonds
from railcosim.master.checkpoint import Checkpoints, resume
from railcosim.master.component import ComponentError
from railcosim.master.connections import CouplingError
from railcosim.master.cosimulation import CommunicationPoint, Divergence, cosimulate
from railcosim.master.energy import EnergyMeter
from railcosim.master.pace import FixedStep, Pace
from railcosim.master.recording import Recorder, record
from railcosim.master.schemes import Scheme
from railcosim.master.step_control import StepControl
from railcosim.master.system import System
from railcosim.storage.interruption import finishing

from .memory import TooLargeError, afford

Stopped = Divergence | ComponentError | KeyboardInterrupt | None
Progress = Callable[[float, float], None]


@dataclass(frozen=True, kw_only=True)
class Keeping:
    """What is kept of a run beyond its outputs.

    Attributes
    ----------
    checkpoints : Checkpoints or None
        Where and how often the run is written, so that it can be resumed.
    resume : Path or None
        The checkpoint that the run goes on from.
    energy : bool
        Whether the energy is recorded that the coupling creates at every interface.
    """

    checkpoints: Checkpoints | None = None
    resume: Path | None = None
    energy: bool = False

    def __post_init__(self) -> None:
        if self.energy and (self.checkpoints or self.resume):
            raise ValueError(
                "the energy of the interfaces is not kept in checkpoints: leave it out"
            )


OUTPUTS_ONLY = Keeping()
MOST_STEPS = 10**9  # a day and a night of computing where a step is 0.1 ms
COPIES = 3  # of the outputs at once: recorded, as a dataset, and as what is written
SHORTEST = 1e-4  # of the longest step: below it, no coupling of ours has gained anything


def count_steps(start: float, stop: float, step: float) -> int:
    """How many communication steps of `step` (s) lead from `start` to `stop` (s).

    Raises
    ------
    TooLargeError
        If the time does not move on by a step, one step is longer than all, or they are more than
        `MOST_STEPS`.
    """
    span = stop - start
    if step > (1 + 1e-9) * span:  # a whole run of one step may be rounded
        raise TooLargeError(f"a step of {step:g} s is longer than the run of {span:g} s")
    if span / step > MOST_STEPS or stop - step == stop:
        raise TooLargeError(
            f"from {start:g} to {stop:g} s there are {span / step:.3g} steps of {step:g} s; at "
            f"most {MOST_STEPS:.0e} are run, and a step must move the time on: take a longer step "
            "or less time"
        )
    return math.ceil(span / step)


@dataclass(frozen=True, kw_only=True)
class Repetition:
    """How a run is made once more, with nothing kept but its outputs.

    Attributes
    ----------
    factor : int
        By which the step is divided.
    until : float
        Where it ends, s.
    """

    factor: int
    until: float


@dataclass(frozen=True, kw_only=True)
class Course:
    """How a system is taken through time.

    Attributes
    ----------
    scheme : Scheme
        How it is coupled.
    step : float
        Communication step, s; the longest one if there is a tolerance.
    start, stop : float
        s.
    tolerance : float or None
        Relative and absolute error (in nominal values) that steps are chosen for; None for
        steps of one length.
    """

    scheme: Scheme
    step: float
    stop: float
    start: float = 0.0
    tolerance: float | None = None

    def __post_init__(self) -> None:
        count_steps(self.start, self.stop, self.step)

    def again(self, how: Repetition) -> Course:
        """The same with a shorter step; steps that are chosen, for a smaller tolerance."""
        tolerance = None if self.tolerance is None else self.tolerance / how.factor
        return replace(self, step=self.step / how.factor, stop=how.until, tolerance=tolerance)

    @property
    def pace(self) -> Pace:
        """The rule for the steps."""
        if self.tolerance is None:
            return FixedStep(self.step)
        return StepControl(
            order=self.scheme.order,
            relative=self.tolerance,
            absolute=self.tolerance,
            largest=self.step,
            smallest=SHORTEST * self.step,
        )


def recorded_run(
    system: System,
    course: Course,
    progress: Progress,
    about: Mapping[str, str | float],
    keeping: Keeping = OUTPUTS_ONLY,
    against: tuple[str, ...] = (),
) -> tuple[xr.Dataset, Stopped]:
    """Run a system; also a run that stops early returns what was recorded, and why it stopped.

    Parameters
    ----------
    system : System
        Its components initialised.
    course : Course
        Scheme, step, start and stop.
    progress : callable
        Given the time and the end, s, now and then.
    about : mapping
        All else that the run is made with; becomes attributes of the result.
    keeping : Keeping, optional
        What is kept beyond outputs.
    against : tuple of str, optional
        Components that positive forces drive towards negative motion; see `master.bonds.Bond`.

    Returns
    -------
    Dataset
        All outputs at all communication points.
    exception or None
        What stopped the run early.
    """
    steps = count_steps(course.start, course.stop, course.step)
    columns = 1 + len(system.variables)
    afford(
        COPIES * 8.0 * steps * columns,
        f"{steps} steps of {columns} numbers",
        "take a longer step or less time",
    )
    try:
        run = cosimulate(system, course.scheme, course.pace, course.stop, course.start)
    except ValueError as error:  # the scheme does not suit the system
        raise CouplingError(str(error)) from error
    recorder = Recorder(system)
    if keeping.resume is not None:
        resume(keeping.resume, run, recorder, about)
    points: Iterator[CommunicationPoint] = run
    meter = _meter(system, against) if keeping.energy else None
    if meter is not None:
        points = meter.watch(points)
    with ExitStack() as held:
        if keeping.checkpoints is not None:
            # Closed at once: what stopped the run keeps it alive, and with it the checkpoint held.
            points = held.enter_context(closing(keeping.checkpoints.watch(run, recorder, about)))
        stopped = record(_watched(points, course.stop, progress), recorder)
    with finishing():  # a second Ctrl-C must not take what the first one left
        attributes: dict[str, Any] = {
            **about,
            "scheme": course.scheme.describe(),
            "communication_step": (
                course.step if course.tolerance is None else course.pace.describe()
            ),
            "railcosim_version": version("railcosim"),
            "stopped": "no" if stopped is None else str(stopped) or "interrupted",
            **{f"inputs of {name}": how for name, how in system.describe_inputs().items()},
        }
        dataset = recorder.to_dataset(attributes)
        if meter is not None:
            dataset = xr.merge([dataset, meter.to_dataset()], join="left", combine_attrs="override")
        return dataset, stopped


def _meter(system: System, against: tuple[str, ...]) -> EnergyMeter | None:
    """A meter for all interfaces whose power is known."""
    bonds = find_bonds(system, against)
    if bonds:
        return EnergyMeter(system, bonds)
    warnings.warn(
        "no interface has both a force and the velocity it moves with, so no energy is recorded; "
        "with the contact in the master it is known",
        stacklevel=3,
    )
    return None


def _watched(
    points: Iterator[CommunicationPoint], stop: float, progress: Progress
) -> Iterator[CommunicationPoint]:
    """Pass on points, and tell every hundredth time how far the run is; `stop` in s."""
    for k, point in enumerate(points):
        if k % 100 == 0:
            progress(point.time, stop)
        yield point
    progress(stop, stop)
