"""A run in time of any system: watched, recorded, kept through crashes and interruptions."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing
from importlib.metadata import version
from typing import Any

import xarray as xr

from railcosim.master.bonds import find_bonds
from railcosim.master.checkpoint import resume
from railcosim.master.component import ComponentError
from railcosim.master.connections import CouplingError
from railcosim.master.cosimulation import CommunicationPoint, Divergence, cosimulate
from railcosim.master.course import Course, count_steps
from railcosim.master.energy import EnergyMeter
from railcosim.master.memory import afford
from railcosim.master.progress import Progress
from railcosim.master.recording import Recorder, record
from railcosim.master.system import System
from railcosim.storage.interruption import finishing

Stopped = Divergence | ComponentError | KeyboardInterrupt | None
COPIES = 3  # of the outputs at once: recorded, as a dataset, and as what is written


def recorded_run(
    system: System,
    course: Course,
    progress: Progress,
    about: Mapping[str, str | float],
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
    against : tuple of str, optional
        Components that positive forces drive towards negative motion; see `master.bonds.Bond`.

    Returns
    -------
    Dataset
        All outputs at all communication points.
    exception or None
        What stopped the run early.
    """
    keeping = course.keeping
    if course.tolerance_fmu is not None:
        about = {**about, "tolerance of FMUs": course.tolerance_fmu}
    steps = count_steps(course.start, course.stop, course.step)
    columns = 1 + len(system.variables)
    afford(
        COPIES * 8.0 * steps * columns,
        f"{steps} steps of {columns} numbers",
        "take a longer step or less time",
    )
    try:
        run = cosimulate(
            system, course.scheme, course.pace, course.stop, course.start, limit=course.limit
        )
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
        if run.ended:
            attributes["ended"] = run.ended
            warnings.warn(run.ended, stacklevel=3)
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
