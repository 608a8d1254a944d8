"""In what the description of a track differs from that of a vehicle."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.shapes import AlongRing

from ..interface import Scalar, owns_contact
from .drawing import Drawing, track_icon, vehicle_icon


@dataclass(frozen=True, kw_only=True)
class Kind:
    """Vehicle or track.

    Attributes
    ----------
    icon : callable
        Interface and model to its drawing.
    terminals_below : bool
        Whether wheels are at its lower edge.
    use, theory : str
        Templates of the page's sections.
    facts : callable
        Its model to what is worth knowing at first sight.
    """

    icon: Callable[[Sequence[Scalar], ModalBody], Drawing]
    terminals_below: bool
    use: str
    theory: str
    facts: Callable[[ModalBody], dict[str, str]]


def _track_facts(body: ModalBody) -> dict[str, str]:
    n, shapes, wheels = body.shared, body.shapes, body.layout.contacts
    local = {1: "one local oscillator"}.get(
        k := len(body.layout.directions), f"{k} local oscillators"
    )
    frequency = np.abs(body.poles[:n]).max() / (2 * np.pi)
    parities = f"{body.even} even, {n - body.even} odd"
    if body.apart:
        parities = "none even or odd, the sides being no mirror images"
    facts = {
        "Modes": f"{n} complex ones up to {frequency:.0f} Hz: {parities}; and {local} under "
        f"each of the {wheels} wheels",
    }
    if isinstance(shapes, AlongRing):
        cells = f"{shapes.length:g} m, cells of {shapes.cell_length:g} m"
        return {"Ring": cells} | facts
    return facts


def _vehicle_facts(body: ModalBody) -> dict[str, str]:
    oscillating = int((body.poles.imag != 0).sum())
    n, least, most = body.poles.size, body.preload.min() / 1e3, body.preload.max() / 1e3
    load = f"{most:.2f} kN" if f"{least:.2f}" == f"{most:.2f}" else f"{least:.2f} to {most:.2f} kN"
    return {
        "Static load of a wheel": load,
        "Modes": f"{oscillating} oscillating and {n - oscillating} overdamped ones; "
        f"{body.rigid_out.shape[1]} rigid-body coordinates",
    }


def _track_icon(table: Sequence[Scalar], body: ModalBody) -> Drawing:
    return track_icon(with_contact=owns_contact(table), wheelsets=body.layout.wheelsets)


def _vehicle_icon(table: Sequence[Scalar], body: ModalBody) -> Drawing:
    return vehicle_icon(
        with_contact=owns_contact(table),
        wheelsets=body.layout.wheelsets,
        bogies=_how_many(table, "bogie"),
        carbodies=_how_many(table, "carbody"),
    )


def _how_many(table: Sequence[Scalar], kind: str) -> int:
    """Bodies of a kind, by what an interface tells of their heights."""
    return sum(re.fullmatch(rf"{kind}(\[\d+\])?\.z", v.name) is not None for v in table)


TRACK = Kind(
    icon=_track_icon,
    terminals_below=False,
    use="track_use.html.j2",
    theory="track.html.j2",
    facts=_track_facts,
)
VEHICLE = Kind(
    icon=_vehicle_icon,
    terminals_below=True,
    use="vehicle_use.html.j2",
    theory="vehicle.html.j2",
    facts=_vehicle_facts,
)
KINDS = {"track": TRACK, "vehicle": VEHICLE}
