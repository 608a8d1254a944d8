"""One coupled run of a vehicle and a track in time."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import xarray as xr

from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.schemes import Scheme

from .contact import Parameters
from .pair import Journey, Load, open_pair
from .recorded_run import OUTPUTS_ONLY, Course, Keeping, Progress, Repetition, Stopped, recorded_run

__all__ = ["Plan", "Progress", "Stopped", "run_pair"]


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What to run.

    Attributes
    ----------
    vehicle, track : Path
        FMUs. If neither owns the contact springs, the master does.
    parameters : mapping
        Of the contact, as far as they are given; see `open_pair`.
    journey : Journey
        Speed and irregularity.
    scheme : Scheme
        How to couple.
    step, stop : float
        Communication step and end, s.
    tolerance : float or None
        For steps chosen by an error estimate; see `Course`.
    keeping : Keeping
        What is kept beyond the outputs.
    load : callable
        Loads an FMU, from its path and name.
    """

    vehicle: Path
    track: Path
    parameters: Parameters
    journey: Journey
    scheme: Scheme
    step: float
    stop: float
    tolerance: float | None = None
    keeping: Keeping = OUTPUTS_ONLY
    load: Load = field(default=FmuComponent.load)


def run_pair(
    plan: Plan, progress: Progress, again: Repetition | None = None
) -> tuple[xr.Dataset, Stopped]:
    """Run the pair; also a run that stops early returns what was recorded, and why it stopped.

    Parameters
    ----------
    plan : Plan
        What to run.
    progress : callable
        Given the time and the end, s, now and then.
    again : Repetition, optional
        Make it once more, with a shorter step.

    Raises
    ------
    ParameterError
        If the irregularity ends before the run does.
    """
    journey = plan.journey
    journey.profile.check_covers(journey.speed * plan.stop)
    with open_pair(plan.vehicle, plan.track, plan.parameters, journey, plan.load) as pair:
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
        course = Course(
            scheme=plan.scheme, step=plan.step, stop=plan.stop, tolerance=plan.tolerance
        )
        keeping = plan.keeping
        if again is not None:
            course, keeping = course.again(again), OUTPUTS_ONLY
        # A contact force in compression lifts the vehicle, and z is down.
        return recorded_run(
            pair.system, course, progress, about, keeping, against=(pair.vehicle.name,)
        )
