"""What FMUs say of themselves beside the standard, for whoever couples them."""

from __future__ import annotations

from collections.abc import Sequence

from railcosim.track.closed_line import ClosedLine
from railcosim.track.decay import decay_along
from railcosim.track.parameters import Track
from railcosim.track.sensor_quantities import Told
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train

from .sensor_variables import sensors_noted

Annotations = dict[str, dict[str, str]]


def ring_annotations(track: Track, told: Sequence[Told] = (), local: str = "") -> Annotations:
    """What a track says of its ring: its length, and what vehicle it is long enough for, m.

    And of its sensors and local changes, if any: FMI 2.0 has room for one element only.
    """
    longest = decay_along(track).longest_span(track.mesh.cells)
    ring = {"length": repr(track.length), "longestVehicle": repr(longest)}
    ring |= {"changes": local} if local else {}
    return {"Ring": ring | sensors_noted(track.sensor, told)}


def line_annotations(line: ClosedLine) -> Annotations:
    """What a track of several kinds says: its ring, the kinds, and where it is a line, m."""
    begin, end = line.clear
    ring = {"length": repr(line.length), "longestVehicle": repr(end - begin)}
    return {"Ring": ring | {"from": repr(begin), "to": repr(end), "kinds": str(line)}}


def wheel_annotations(vehicle: Vehicle | Train) -> Annotations:
    """What a vehicle says of its wheels: the radius of each wheelset's, m."""
    wheels = build_multibody(vehicle).wheels
    return {"Wheels": {"radius": " ".join(repr(float(wheel.radius)) for wheel in wheels)}}
