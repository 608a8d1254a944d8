"""One coupled run in time: the loop, what is recorded, and what is said when it fails."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import xarray as xr

from railcosim.master.component import ComponentError
from railcosim.master.cosimulation import CommunicationPoint, Divergence, cosimulate
from railcosim.master.recording import Recorder, record
from railcosim.master.schemes import Scheme

from .pair import Journey, open_pair

Stopped = Divergence | ComponentError | KeyboardInterrupt | None
Progress = Callable[[float, float], None]


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What to run.

    Attributes
    ----------
    vehicle, track : Path
        FMUs, one of which owns the contact.
    parameters : dict
        Of the contact.
    journey : Journey
        Speed and irregularity.
    scheme : Scheme
        How to couple.
    step, stop : float
        Communication step and end, s.
    """

    vehicle: Path
    track: Path
    parameters: dict[str, float | bool]
    journey: Journey
    scheme: Scheme
    step: float
    stop: float


def run_pair(plan: Plan, progress: Progress) -> tuple[xr.Dataset, Stopped]:
    """Run the pair; also a run that stops early returns what was recorded, and why it stopped."""
    with open_pair(plan.vehicle, plan.track, plan.parameters, plan.journey) as pair:
        recorder = Recorder(pair.system)
        points = cosimulate(pair.system, plan.scheme, plan.step, plan.stop)
        stopped = record(watched(points, plan.stop, progress), recorder)
        journey = plan.journey
        attributes = {
            "title": f"{3.6 * journey.speed:.0f} km/h, irregularity {journey.profile.name}",
            "scheme": plan.scheme.describe(),
            "communication_step": plan.step,
            "speed": journey.speed,
            "motion": "irregularity moves" if journey.held else "wheels roll",
            "irregularity": journey.profile.name,
            "railcosim_version": version("railcosim"),
            "stopped": "no" if stopped is None else str(stopped) or "interrupted",
            **{f"inputs of {k}": how for k, how in pair.system.describe_inputs().items()},
            **{f"parameter {k}": float(v) for k, v in plan.parameters.items()},
        }
        for fmu in (pair.vehicle, pair.track):
            for key, value in fmu.description.as_attributes().items():
                attributes[f"{fmu.name} {key}"] = value
        return recorder.to_dataset(attributes), stopped


def watched(
    points: Iterator[CommunicationPoint], stop: float, progress: Progress
) -> Iterator[CommunicationPoint]:
    """Pass on points, and tell every hundredth time how far the run is; `stop` in s."""
    for k, point in enumerate(points):
        if k % 100 == 0:
            progress(point.time, stop)
        yield point
