"""In what the description of a track differs from that of a vehicle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..content import Arrays
from ..python_runtime.models import TrackModel, VehicleModel
from .drawing import Drawing, track_icon, vehicle_icon
from .structure import States, track_states, vehicle_states


@dataclass(frozen=True, kw_only=True)
class Kind:
    """Vehicle or track.

    Attributes
    ----------
    model : type
        The Python model, which makes the reference run.
    states : callable
        Arrays to continuous states.
    icon : callable
        Draws it, ``with_contact`` or without.
    terminals_below : bool
        Whether wheels are at its lower edge.
    use, theory : str
        Templates of the page's sections.
    facts : callable
        Arrays to what is worth knowing at first sight.
    """

    model: type[TrackModel] | type[VehicleModel]
    states: Callable[[Arrays], States]
    icon: Callable[..., Drawing]
    terminals_below: bool
    use: str
    theory: str
    facts: Callable[[Arrays], dict[str, str]]


def _track_facts(arrays: Arrays) -> dict[str, str]:
    even = int((arrays["parity"] > 0).sum())
    n = arrays["poles"].size
    frequency = np.abs(arrays["poles"]).max() / (2 * np.pi)
    return {
        "Ring": f"{float(arrays['length']):g} m, cells of {float(arrays['cell_length']):g} m",
        "Modes": f"{n} complex ones up to {frequency:.0f} Hz: {even} even, {n - even} odd; "
        "and one local oscillator under each of the 8 wheels",
    }


def _vehicle_facts(arrays: Arrays) -> dict[str, str]:
    oscillating = int((arrays["poles"].imag != 0).sum())
    n = arrays["poles"].size
    return {
        "Static load of a wheel": f"{float(arrays['wheel_load']) / 1e3:.2f} kN",
        "Modes": f"{oscillating} oscillating and {n - oscillating} overdamped ones; "
        f"{arrays['rigid'].shape[1]} rigid-body coordinates",
    }


TRACK = Kind(
    model=TrackModel,
    states=track_states,
    icon=track_icon,
    terminals_below=False,
    use="track_use.html.j2",
    theory="track.html.j2",
    facts=_track_facts,
)
VEHICLE = Kind(
    model=VehicleModel,
    states=vehicle_states,
    icon=vehicle_icon,
    terminals_below=True,
    use="vehicle_use.html.j2",
    theory="vehicle.html.j2",
    facts=_vehicle_facts,
)
KINDS = {"track": TRACK, "vehicle": VEHICLE}
