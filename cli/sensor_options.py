"""Sensors at fixed places of the track, as options."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

import typer

from railcosim.parameters import ParameterError

from .meeting_options import MeetingOptions
from .options import UsageError
from .parameter_options import FmuOptions, PairOptions, TrackOptions

if TYPE_CHECKING:
    from railcosim.track.parameters import Sensor, Track

FORM = re.compile(
    r"(?P<of>\w+)\.(?P<side>\w+)@(?P<name>railseat|midspan)?(?P<x>[^:]*)(:(?P<quantities>[\w,]+))?"
)
SensorOption = Annotated[
    list[str] | None,
    typer.Option(
        "--sensor",
        help="What is seen at a place of the track, such as rail.left@50.3, slab.middle@50 or "
        "rail.left@midspan+80; some of it with rail.left@50.3:z,stress. PLACE is in m along "
        "the track, as --position. Repeat it for more.",
        metavar="SENSOR",
    ),
]


@dataclass(frozen=True, kw_only=True)
class SensorOptions(TrackOptions):
    """Options of a command that shows what sensors of a track see."""

    sensor: SensorOption = None

    def rails(self, span: float = 0.0) -> Track:
        """See `TrackOptions`; with sensors beside those of its file."""
        track = super().rails(span)
        given = tuple(sensor_of(track, text) for text in self.sensor or ())
        try:
            return replace(track, sensor=(*track.sensor, *given))
        except ParameterError as error:
            raise UsageError(f"--{error}") from error

    @property
    def tells_track(self) -> str:
        """See `TrackOptions`."""
        return "--sensor" if self.sensor else super().tells_track


@dataclass(frozen=True, kw_only=True)
class ObservedPair(SensorOptions, PairOptions):
    """A vehicle and a track with sensors."""


@dataclass(frozen=True, kw_only=True)
class ObservedFmus(SensorOptions, FmuOptions):
    """FMUs, of which ours may have sensors."""


@dataclass(frozen=True, kw_only=True)
class ObservedMeeting(SensorOptions, MeetingOptions):
    """The same, and how they meet."""

    @property
    def may_have_sensors(self) -> bool:
        """Whether there may be sensors."""
        return self.track_fmu is not None or bool(self.rails().sensor)


def sensor_of(track: Track, text: str) -> Sensor:
    """Read ``WHAT.SIDE@PLACE`` with or without ``:QUANTITY,...``.

    A place is in m along the track, or ``railseat`` or ``midspan`` with ``+2`` so many bays
    further.
    """
    from railcosim.analysis.response.track_words import place_of
    from railcosim.track.parameters import Sensor

    found = FORM.fullmatch(text)
    try:
        if found is None:
            raise ValueError
        if found["name"]:
            at = place_of(track, found["name"]) + int(found["x"] or 0) * track.fastening.spacing
        else:
            at = float(found["x"])
        names = tuple(found["quantities"].split(",")) if found["quantities"] else ()
    except ValueError as error:
        raise UsageError(
            f"--sensor {text}: must be WHAT.SIDE@PLACE, such as rail.left@50.3, or with some "
            "quantities rail.left@50.3:z,stress"
        ) from error
    try:
        return Sensor(of=found["of"], side=found["side"], at=at, quantities=names)
    except ParameterError as error:
        raise UsageError(f"--sensor {text}: {error}") from error
