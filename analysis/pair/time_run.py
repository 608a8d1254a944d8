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
from .pair import PLACES, Journey, Pair, open_pair
from .ring import check_line_of
from .sensors import marked
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
    journey.check(course.stop)
    with ExitStack() as own:
        opened = open_pair(vehicle, track, parameters, journey, load, course.told)
        pair = (held or own).enter_context(opened)
        if not journey.held:  # where it begins is checked where it is opened
            check_line_of(track, pair.wheels.start + float(journey.way.gone(course.stop)))
        if not course.repeats:
            journey.check_defects(pair.wheels, course.step, course.stop)
        about: dict[str, str | float] = {
            **_going(journey),
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
        run, stopped = recorded_run(
            pair.system, course, progress, about, against=(pair.vehicle.name,)
        )
        return marked(_true_places(run, pair), track), stopped


def _going(journey: Journey) -> dict[str, str | float]:
    """Speed and defects, as attributes."""
    way = journey.way
    named = way.name if way.changes else f"{3.6 * journey.speed:.0f} km/h"
    speed = {"speeds": way.name, "speeds sha256": way.digest}
    return {
        "title": f"{named}, irregularity {journey.profile.name}",
        **(speed if way.changes else {"speed": journey.speed}),
        **({"defects": " ".join(map(str, journey.defects))} if journey.defects else {}),
    }


def _true_places(run: xr.Dataset, pair: Pair) -> xr.Dataset:
    """Positions of wheels that do not go by themselves: those on the track, under their names."""
    names = pair.layout.of_axles("position")
    told = {f"{PLACES}.{name}": name for name in names if f"{PLACES}.{name}" in run}
    theirs = [f"{pair.vehicle.name}.{name}" for name in told.values()]
    return run.drop_vars(theirs).rename(told)
