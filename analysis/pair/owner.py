"""Who owns the contact springs, and which FMUs that takes."""

from __future__ import annotations

from enum import StrEnum


class Owner(StrEnum):
    """Who owns the contact springs."""

    VEHICLE = "vehicle"
    TRACK = "track"
    MASTER = "master"


FMUS = {
    Owner.VEHICLE: ("VehicleWithContact", "Track"),
    Owner.TRACK: ("Vehicle", "TrackWithContact"),
    Owner.MASTER: ("Vehicle", "Track"),
}
"""Names of our vehicle's and track's FMUs, by owner of the contact."""
