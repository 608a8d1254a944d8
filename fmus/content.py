"""What the FMUs carry: interface, model as arrays, parameters; whatever runtime they get."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from railcosim.mechanics.contact.profiled import Profiled
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import SIDES, Layout
from railcosim.parameters import ParameterError, UnusualWarning, write_toml
from railcosim.track.closed_line import ClosedLine
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Track
from railcosim.track.sensor_quantities import told_by
from railcosim.vehicle.files import write_stock
from railcosim.vehicle.modal import vehicle_body
from railcosim.vehicle.multibody import MODELS, build_multibody
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train, train_of

from .annotations import Annotations, line_annotations, ring_annotations, wheel_annotations
from .interface import Scalar, Start, interface, owns_contact
from .rolling_start import why_not_inside
from .rolling_variables import RollingWheels
from .start import start_of
from .track_under import check_dimension, track_under

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
