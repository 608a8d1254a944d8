"""Where a vehicle and a track that owns the contact are at rest together."""

from __future__ import annotations

import numpy as np

from .content import Content
from .interface import WHEELSETS
from .python_runtime.bodies import TrackBody


def heights_at_rest(vehicle: Content, track: Content) -> dict[str, float]:
    """Heights of the wheelsets for which vehicle and track are at rest together.

    Any four heights leave the suspensions' forces as they are, for bogies and car body follow
    them without strain. So every wheel carries its static load at rest, whatever the track:
    a height is the rail's deflection under all static loads, and the contact's compression.

    Parameters
    ----------
    vehicle, track : Content
        Of `railcosim.fmus.content.contents`; the track with the contact.

    Returns
    -------
    dict
        The vehicle's parameters ``wheelset[i].start_z``, m, down.
    """
    start = {v.name: float(v.start or 0) for v in track.table}
    load = float(vehicle.arrays["wheel_load"])
    body = TrackBody(track.arrays)
    positions = np.array([start[f"wheelset[{i}].position"] for i in WHEELSETS])
    compliance = body.static_compliance(body.shapes(positions))
    deflection = (compliance @ np.full(8, load))[:4]  # left and right alike
    heights = deflection + (load / start["contact.hertz_coefficient"]) ** (2 / 3)
    return {f"wheelset[{i}].start_z": float(z) for i, z in zip(WHEELSETS, heights, strict=True)}
