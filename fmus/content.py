"""What the FMUs carry: interface, model as arrays, parameters; whatever runtime they get."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.law import tangent_stiffness
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import SIDES, Layout
from railcosim.parameters import write_toml
from railcosim.track.decay import check_ring, decay_along
from railcosim.track.parameters import Track
from railcosim.track.reduced import reduce_track
from railcosim.vehicle.files import write_stock
from railcosim.vehicle.modal import vehicle_body
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train, train_of

from .interface import Contact, Scalar, Start, interface, owns_contact

FloatArray = NDArray[np.float64]
Annotations = dict[str, dict[str, str]]


@dataclass(frozen=True, kw_only=True)
class Content:
    """One FMU before it is packed.

    Attributes
    ----------
    name : str
        Of the FMU.
    model : str
        track or vehicle.
    text : str
        One sentence.
    table : list of Scalar
        Its interface.
    body : ModalBody
        Its model.
    parameters : str
        What it was made from, as text for people.
    annotations : dict
        Of the model description, by element and attribute: what a master may want to know.
    """

    name: str
    model: str
    text: str
    table: list[Scalar]
    body: ModalBody
    parameters: str
    annotations: Annotations

    @property
    def has_contact(self) -> bool:
        """Whether it owns the contact springs."""
        return owns_contact(self.table)


def contact_defaults(vehicle: Vehicle | Train) -> Contact:
    """Contact parameters of the wheels: C, and k_H at their mean static load (eq. 18)."""
    train = train_of(vehicle)
    k_H = tangent_stiffness(train.hertz_coefficient, train.wheel_load)
    return Contact(k_H=k_H, C=train.hertz_coefficient)


def ring_annotations(track: Track) -> Annotations:
    """What a track says of its ring: its length, and what vehicle it is long enough for, m."""
    longest = decay_along(track).longest_span(track.mesh.cells)
    return {"Ring": {"length": repr(track.length), "longestVehicle": repr(longest)}}


def contents(
    vehicle: Vehicle | Train, track: Track, progress: Callable[[str], None] = lambda text: None
) -> list[Content]:
    """Vehicle, Track, VehicleWithContact and TrackWithContact.

    Raises
    ------
    ParameterError
        If the vehicle meets itself through the ring.

    Warns
    -----
    RingWarning
        If the ring is too short for what `railcosim.track.decay` promises.
    """
    cars = vehicle_body(build_multibody(vehicle))
    ahead = wheelset_x(cars)
    # The rearmost wheelset starts above a railseat, the paper's place.
    start = Start(
        loads=cars.preload.tolist(),
        positions=(ahead - ahead[-1] + track.fastening.spacing / 2).tolist(),
        contact=contact_defaults(vehicle),
    )
    rails = track_under(track, start, progress)
    made = []
    for with_contact in (False, True):
        made.append(
            Content(
                name="VehicleWithContact" if with_contact else "Vehicle",
                model="vehicle",
                text="Railway vehicle, vertical: "
                + ("rail motion to contact force." if with_contact else "contact force to motion."),
                table=interface(cars, start, with_contact=with_contact),
                body=cars,
                parameters=write_stock(vehicle),
                annotations={},
            )
        )
        made.append(_track(track, rails, start, with_contact=with_contact))
    return made


def wheelset_x(body: ModalBody) -> FloatArray:
    """Places of a vehicle's wheelsets, forward, m."""
    if body.coordinates is None:
        raise TypeError("a track has no wheelsets")
    return body.coordinates.wheelset_x


def track_contents(
    track: Track,
    start: Start,
    progress: Callable[[str], None] = lambda text: None,
    *,
    sides: tuple[str, ...] = SIDES,
) -> list[Content]:
    """Track and TrackWithContact for other people's wheelsets; see `contents`.

    Parameters
    ----------
    track : Track
        Parameters.
    start : Start
        Loads and positions of as many wheelsets as there are, from the front.
    sides : tuple of str
        Rails that are loaded; see `railcosim.mechanics.ports.Layout`.
    """
    rails = track_under(track, start, progress, sides=sides)
    return [_track(track, rails, start, with_contact=owned) for owned in (False, True)]


def track_under(
    track: Track,
    start: Start,
    progress: Callable[[str], None],
    *,
    sides: tuple[str, ...] = SIDES,
) -> ModalBody:
    """The reduced track under so many wheelsets, if the ring is long enough for them."""
    progress("measuring the decay along the track")
    check_ring(track, float(np.ptp(start.positions)))
    progress("reducing the track")
    return reduce_track(track).under(Layout(len(start.positions), sides))


def _track(track: Track, rails: ModalBody, start: Start, *, with_contact: bool) -> Content:
    return Content(
        name="TrackWithContact" if with_contact else "Track",
        model="track",
        text="Slab track, a ring of cells, vertical: "
        + ("wheel motion to contact force." if with_contact else "contact force to motion."),
        table=interface(rails, start, with_contact=with_contact),
        body=rails,
        parameters=write_toml(track, "Slab track"),
        annotations=ring_annotations(track),
    )
