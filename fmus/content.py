"""What the FMUs carry: interface, model as arrays, parameters; whatever runtime they get."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.contact.profiled import Profiled
from railcosim.mechanics.law import tangent_stiffness
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import DIMENSIONS, SIDES, Layout
from railcosim.parameters import ParameterError, UnusualWarning, write_toml
from railcosim.track.closed_line import ClosedLine, check_places
from railcosim.track.decay import check_ring, decay_along
from railcosim.track.local import LocalChange
from railcosim.track.local_modes import with_changes
from railcosim.track.parameters import Track
from railcosim.track.reduced import ReducedTrack, reduce_track
from railcosim.track.reduced_line import reduce_line
from railcosim.track.section import VERTICAL
from railcosim.track.sensor_quantities import Told, told_by
from railcosim.vehicle.files import write_stock
from railcosim.vehicle.modal import vehicle_body
from railcosim.vehicle.multibody import MODELS, Multibody, build_multibody
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train, train_of

from .interface import Contact, Scalar, Start, interface, owns_contact
from .law_variables import OfContact, in_common
from .rolling_start import rolling_wheels, why_not_inside
from .rolling_variables import RollingWheels
from .sensor_variables import sensors_noted

Annotations = dict[str, dict[str, str]]
UNTOLD: Mapping[str, Callable[[Train], str]] = {
    "vertical": lambda train: (
        "[rolling] is left out: these FMUs are vertical, whatever a file says "
        "of cones, creep and flanges (--dimension spatial)"
        if train.tells_rolling
        else ""
    ),
    "spatial": why_not_inside,
}
"""What FMUs of a dimension do not know of a train."""


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
    profiles : Profiled or None
        Of wheels and rails where it tells or owns the contact of these.
    """

    name: str
    model: str
    text: str
    table: list[Scalar]
    body: ModalBody
    parameters: str
    annotations: Annotations
    profiles: Profiled | None = None

    @property
    def has_contact(self) -> bool:
        """Whether it owns the contact springs."""
        return owns_contact(self.table)


def start_of(
    vehicle: Vehicle | Train,
    positions: Sequence[float],
    sides: tuple[str, ...] = SIDES,
    dimension: str = "vertical",
) -> Start:
    """Loads and contacts of a vehicle's wheels, for wheelsets that stand at positions (m).

    As many wheelsets as the vehicle has are its own; others carry its mean load.

    Raises
    ------
    ParameterError
        If they are others, and its wheels have no contact law in common.
    """
    cars, count = build_multibody(vehicle), len(positions)
    load = cars.wheel_load
    if load.size != count:
        load = np.full(count, load.mean())
    contact = CONTACTS[dimension](train_of(vehicle), cars, load)
    return Start(loads=np.tile(load, len(sides)).tolist(), positions=positions, contact=contact)


def contact_defaults(vehicle: Vehicle | Train) -> Contact:
    """Contact parameters of the wheels: C, and k_H at their static load (eq. 18)."""
    cars = build_multibody(vehicle)
    return _pressed(train_of(vehicle), cars, cars.wheel_load)


def _pressed(train: Train, cars: Multibody, load: FloatArray) -> Contact:
    """Of the train's wheelsets, or of others that are all alike."""
    del train
    C = cars.hertz_coefficient
    if load.size != C.size:
        if len(in_common(C)) > 1:
            raise ParameterError(
                f"{load.size} wheelsets, but the vehicle has {C.size} whose wheels have different "
                f"contact laws (Hertz coefficients from {C.min():g} to {C.max():g} N/m1.5): must "
                f"be {C.size}, or all of one [wheelset] radius and [contact]"
            )
        C = np.full(load.size, C[0])
    return Contact(k_H=in_common(tangent_stiffness(C, load)), C=in_common(C))


CONTACTS: Mapping[str, Callable[[Train, Multibody, FloatArray], OfContact | None]] = {
    "vertical": _pressed,
    "spatial": rolling_wheels,
}
"""Start values of contact laws, by dimension."""


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


def contents(
    vehicle: Vehicle | Train,
    track: Track,
    progress: Callable[[str], None] = lambda text: None,
    *,
    separate: bool = False,
    dimension: str = "vertical",
    changes: Sequence[LocalChange] = (),
    line: ClosedLine | None = None,
) -> list[Content]:
    """Vehicle, Track, VehicleWithContact and TrackWithContact.

    Parameters
    ----------
    vehicle, track : Vehicle or Train, Track
        Parameters.
    progress : callable
        Told what is being done.
    separate : bool
        Each vehicle of a train by itself, from the front: Vehicle1, VehicleWithContact1, Vehicle2
        and so on, where they stand in the train. The tracks are under all of them.
    dimension : str
        In what directions wheels and rails meet, see `railcosim.mechanics.ports.OF_WHEELS`.
    changes : sequence of LocalChange
        What is different at single places of the track, see
        `railcosim.track.local_modes.with_changes`.
    line : ClosedLine or None
        Kinds of track that follow, the first of which is `track`.

    Raises
    ------
    ParameterError
        If the vehicle meets itself through the ring, vehicles by themselves had couplers, or
        there is no such dimension.

    Warns
    -----
    RingWarning
        If the ring is too short for what `railcosim.track.decay` promises.
    UnusualWarning
        If the vehicle says how its wheels roll, and these FMUs are vertical; or it says what
        contacts inside FMUs do not know, and there are Vehicle and Track only.
    """
    check_dimension(dimension)
    if missing := UNTOLD[dimension](train_of(vehicle)):
        warnings.warn(missing, UnusualWarning, stacklevel=2)
    stock = {"": vehicle}
    if separate:
        stock = {str(number): one for number, one in enumerate(apart(vehicle), start=1)}
    ahead = build_multibody(vehicle).wheelset_x
    # The rearmost wheelset starts above a railseat, the paper's place.
    places = ahead - ahead[-1] + track.fastening.spacing / 2
    start = start_of(vehicle, places.tolist(), dimension=dimension)
    rails = track_under(track, start, progress, dimension=dimension, changes=changes, line=line)
    bodies = {
        suffix: vehicle_body(build_multibody(one, MODELS[dimension]))
        for suffix, one in stock.items()
    }
    counts = [body.layout.wheelsets for body in bodies.values()]
    starts = [
        start_of(one, where.tolist(), dimension=dimension)
        for one, where in zip(stock.values(), np.split(places, np.cumsum(counts)[:-1]), strict=True)
    ]
    made = []
    for with_contact in owners_in(rails.layout, start):
        for (suffix, body), its in zip(bodies.items(), starts, strict=True):
            made.append(_vehicle(stock[suffix], body, its, suffix, with_contact=with_contact))
        made.append(_track(track, rails, start, changes, line, with_contact=with_contact))
    return made


def apart(stock: Vehicle | Train) -> list[Train]:
    """Vehicles of a train, each by itself.

    Raises
    ------
    ParameterError
        If there are couplers between them, which two FMUs cannot share.
    """
    train = train_of(stock)
    coupler = train.coupler
    if len(train.vehicles) > 1 and max(coupler.stiffness, coupler.damping) > 0.0:
        raise ParameterError(
            f"[coupler] stiffness = {coupler.stiffness:g} N/m, damping = {coupler.damping:g} "
            "N.s/m: must be 0 where each vehicle is an FMU of its own, which only the track joins"
        )
    return [replace(train, vehicles=(one,)) for one in train.vehicles]


def track_contents(
    track: Track,
    start: Start,
    progress: Callable[[str], None] = lambda text: None,
    *,
    sides: tuple[str, ...] = SIDES,
    dimension: str = "vertical",
    changes: Sequence[LocalChange] = (),
    line: ClosedLine | None = None,
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
    dimension : str
        In what directions rails are met, see `railcosim.mechanics.ports.DIMENSIONS`.
    changes, line
        See `contents`.
    """
    rails = track_under(
        track, start, progress, sides=sides, dimension=dimension, changes=changes, line=line
    )
    return [
        _track(track, rails, start, changes, line, with_contact=owned)
        for owned in owners_in(rails.layout, start)
    ]


def owners_in(rails: Layout, start: Start) -> tuple[bool, ...]:
    """Without the contact, and with it where its law is one of wheels on these rails."""
    known = start.contact is not None and start.contact.directions == rails.directions
    return (False, True) if known else (False,)


def check_dimension(dimension: str) -> None:
    """Refuse what is none of `railcosim.mechanics.ports.DIMENSIONS`.

    Raises
    ------
    ParameterError
        Saying what there is.
    """
    if dimension not in DIMENSIONS:
        raise ParameterError(f"dimension = {dimension}: must be one of {', '.join(DIMENSIONS)}")


def track_under(
    track: Track,
    start: Start,
    progress: Callable[[str], None],
    *,
    sides: tuple[str, ...] = SIDES,
    dimension: str = "vertical",
    changes: Sequence[LocalChange] = (),
    line: ClosedLine | None = None,
) -> ModalBody:
    """The reduced track under so many wheelsets, if the ring is long enough for them."""
    check_dimension(dimension)
    directions = DIMENSIONS[dimension]
    progress("measuring the decay along the track")
    layout = Layout(len(start.positions), sides, directions)
    if line is not None:
        return _line_under(line, start, progress, dimension, changes).under(layout)
    check_ring(track, float(np.ptp(start.positions)))
    progress("reducing the track")
    bare = replace(track, sensor=()) if changes else track  # what is seen is of the changed ring
    reduced = reduce_track(bare, directions)
    if changes:
        reduced = with_changes(
            track, reduced, changes, lambda text: progress(f"finding the changed ring: {text}")
        )
    return reduced.under(layout)


def _line_under(
    line: ClosedLine,
    start: Start,
    progress: Callable[[str], None],
    dimension: str,
    changes: Sequence[LocalChange],
) -> ReducedTrack:
    """Of several kinds, if wheelsets stand where it is a line."""
    if DIMENSIONS[dimension] != VERTICAL:
        raise ParameterError(
            f"dimension = {dimension}: tracks of several kinds are vertical in time; must be "
            "vertical, or one kind"
        )
    if changes:
        raise ParameterError(
            f"{changes[0]}: in time single places are different on a track of one kind only; leave "
            "out it or the kinds that follow"
        )
    check_places(line, start.positions)
    return reduce_line(line, lambda text: progress(f"joining kinds of track: {text}"))


def profiles_json(profiles: Profiled) -> bytes:
    """For an FMU's resources, and whoever else owns the contact."""
    return json.dumps(profiles.told(), indent=1).encode()


def _profiles_of(start: Start) -> Profiled | None:
    contact = start.contact
    return contact.profiles if isinstance(contact, RollingWheels) else None


def _vehicle(
    vehicle: Vehicle | Train, body: ModalBody, start: Start, suffix: str, *, with_contact: bool
) -> Content:
    return Content(
        name=f"Vehicle{'WithContact' if with_contact else ''}{suffix}",
        model="vehicle",
        text=f"Railway vehicle, {body.layout.dimension}: "
        + ("rail motion to contact force." if with_contact else "contact force to motion."),
        table=interface(body, start, with_contact=with_contact),
        body=body,
        parameters=write_stock(vehicle),
        annotations=wheel_annotations(vehicle),
        profiles=_profiles_of(start),
    )


def _track(
    track: Track,
    rails: ModalBody,
    start: Start,
    changes: Sequence[LocalChange],
    line: ClosedLine | None,
    *,
    with_contact: bool,
) -> Content:
    told = told_by(track, rails.layout.directions, changes)
    local = " ".join(map(str, changes))
    kinds = [track] if line is None else line.tracks
    return Content(
        name="TrackWithContact" if with_contact else "Track",
        model="track",
        text=f"{track.called}, a ring of cells, {rails.layout.dimension}"
        + (f", with {local}: " if local else f", {line}: " if line else ": ")
        + ("wheel motion to contact force." if with_contact else "contact force to motion."),
        table=interface(rails, start, with_contact=with_contact, seen=told),
        body=rails,
        parameters="\n".join(write_toml(kind, kind.called) for kind in kinds),
        annotations=line_annotations(line) if line else ring_annotations(track, told, local),
        profiles=_profiles_of(start) if with_contact else None,
    )
