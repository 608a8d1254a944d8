"""One coupled run of a vehicle and a track in time."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import xarray as xr

from railcosim.master.course import Course
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.progress import Progress
from railcosim.master.recorded_run import Stopped, recorded_run

from .contact import Parameters
from .numbering import Vehicles
from .pair import Journey, open_pair
from .several import Load

__all__ = ["Progress", "Stopped", "run_pair"]


def run_pair(
    vehicle: Vehicles,
    track: Path,
    parameters: Parameters,
    journey: Journey,
    course: Course,
    progress: Progress,
    load: Load = FmuComponent.load,
    held: ExitStack | None = None,
) -> tuple[xr.Dataset, Stopped]:
    """Run a pair; also a run that stops early returns what was recorded, and why it stopped.

    Parameters
    ----------
    vehicle, track, parameters, journey, load
        See `open_pair`.
    course : Course
        Scheme, steps and span.
    progress : callable
        Given the time and the end, s, now and then.
    held : ExitStack, optional
        Closes the FMUs when its owner wants; else they are closed before the results are returned.

    Raises
    ------
    ParameterError
        If the irregularity ends before the run does.
    """
    journey.profile.check_covers(journey.speed * course.stop)
    with ExitStack() as own:
        opened = open_pair(vehicle, track, parameters, journey, load, course.told)
        pair = (held or own).enter_context(opened)
        about: dict[str, str | float] = {
            "title": f"{3.6 * journey.speed:.0f} km/h, irregularity {journey.profile.name}",
            "speed": journey.speed,
            "motion": "irregularity moves" if journey.held else "wheels roll",
            "irregularity": journey.profile.name,
            "irregularity fade": journey.profile.fade,
            "irregularity sha256": journey.profile.digest,
            **{f"parameter {k}": float(v) for k, v in pair.parameters.items()},
        }
        for fmu in (pair.vehicle, pair.track):
            for key, value in fmu.description.as_attributes().items():
                about[f"{fmu.name} {key}"] = value
        # A contact force in compression lifts the vehicle, and z is down.
        return recorded_run(pair.system, course, progress, about, against=(pair.vehicle.name,))
