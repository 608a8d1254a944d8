"""What the FMUs carry: interface, model as arrays, parameters; whatever runtime they get."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.law import tangent_stiffness
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import DIMENSIONS, SIDES, Layout, Z
from railcosim.parameters import ParameterError, UnusualWarning, write_toml
from railcosim.track.decay import check_ring, decay_along
from railcosim.track.parameters import Track
from railcosim.track.reduced import reduce_track
from railcosim.track.section import moves_aside
from railcosim.vehicle.files import write_stock
from railcosim.vehicle.modal import vehicle_body
from railcosim.vehicle.multibody import MODELS, build_multibody
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train, train_of

from .interface import Contact, Scalar, Start, interface, owns_contact

FloatArray = NDArray[np.float64]
Annotations = dict[str, dict[str, str]]
ROUNDING = 1e-9
"""Of loads: the static ones of like wheels are solved for, to some 1e-14."""
WITHOUT_ROLLING = {
    "vertical": "these FMUs are vertical",
    "spatial": "these FMUs have no contact inside",
}
"""Why FMUs of a dimension do not say how wheels roll."""
PASSIVE_TO = 8
"""Elements a bay of rails that move aside: with 16 of the default track, power is given to wheels
over railseats near 4.6 kHz (docs/track.md); what is between was not looked at."""


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


def start_of(
    vehicle: Vehicle | Train, positions: Sequence[float], sides: tuple[str, ...] = SIDES
) -> Start:
    """Loads and contacts of a vehicle's wheels, for wheelsets that stand at positions (m).

    As many wheelsets as the vehicle has are its own; others carry its mean load.

    Raises
    ------
    ParameterError
        If they are others, and its wheels have no contact law in common.
    """
    cars, count = build_multibody(vehicle), len(positions)
    load, C = cars.wheel_load, cars.hertz_coefficient
    if load.size != count:
        if len(_in_common(C)) > 1:
            raise ParameterError(
                f"{count} wheelsets, but the vehicle has {load.size} whose wheels have different "
                f"contact laws (Hertz coefficients from {C.min():g} to {C.max():g} N/m1.5): must "
                f"be {load.size}, or all of one [wheelset] radius and [contact]"
            )
        load, C = np.full(count, load.mean()), np.full(count, C[0])
    loads = np.tile(load, len(sides)).tolist()
    return Start(loads=loads, positions=positions, contact=_contact(C, load))


def contact_defaults(vehicle: Vehicle | Train) -> Contact:
    """Contact parameters of the wheels: C, and k_H at their static load (eq. 18)."""
    cars = build_multibody(vehicle)
    return _contact(cars.hertz_coefficient, cars.wheel_load)


def _contact(C: FloatArray, load: FloatArray) -> Contact:
    return Contact(k_H=_in_common(tangent_stiffness(C, load)), C=_in_common(C))


def _in_common(of_wheelsets: FloatArray) -> tuple[float, ...]:
    """One number if all are the same but for rounding, else all."""
    alike = np.ptp(of_wheelsets) <= ROUNDING * of_wheelsets.max()
    return tuple((of_wheelsets[:1] if alike else of_wheelsets).tolist())


def ring_annotations(track: Track) -> Annotations:
    """What a track says of its ring: its length, and what vehicle it is long enough for, m."""
    longest = decay_along(track).longest_span(track.mesh.cells)
    return {"Ring": {"length": repr(track.length), "longestVehicle": repr(longest)}}


def contents(
    vehicle: Vehicle | Train,
    track: Track,
    progress: Callable[[str], None] = lambda text: None,
    *,
    separate: bool = False,
    dimension: str = "vertical",
) -> list[Content]:
    """Vehicle, Track, VehicleWithContact and TrackWithContact.

    The contact law inside knows the vertical direction only: spatial ones are Vehicle and Track.

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
        If the vehicle says how its wheels roll, and no FMU will know of it.
    """
    check_dimension(dimension)
    if train_of(vehicle).tells_rolling:
        warnings.warn(
            f"[rolling] is left out: {WITHOUT_ROLLING[dimension]}, whatever a file says of "
            "cones, creep and flanges (railcosim.vehicle.rolling makes a contact law of it)",
            UnusualWarning,
            stacklevel=2,
        )
    stock = {"": vehicle}
    if separate:
        stock = {str(number): one for number, one in enumerate(apart(vehicle), start=1)}
    ahead = build_multibody(vehicle).wheelset_x
    # The rearmost wheelset starts above a railseat, the paper's place.
    places = ahead - ahead[-1] + track.fastening.spacing / 2
    start = start_of(vehicle, places.tolist())
    rails = track_under(track, start, progress, dimension=dimension)
    bodies = {
        suffix: vehicle_body(build_multibody(one, MODELS[dimension]))
        for suffix, one in stock.items()
    }
    counts = [body.layout.wheelsets for body in bodies.values()]
    starts = [
        start_of(one, where.tolist())
        for one, where in zip(stock.values(), np.split(places, np.cumsum(counts)[:-1]), strict=True)
    ]
    made = []
    for with_contact in owners_in(rails.layout):
        for (suffix, body), its in zip(bodies.items(), starts, strict=True):
            made.append(_vehicle(stock[suffix], body, its, suffix, with_contact=with_contact))
        made.append(_track(track, rails, start, with_contact=with_contact))
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
) -> list[Content]:
    """Track and TrackWithContact for other people's wheelsets; see `contents`.

    The contact law inside knows the vertical direction only: of a spatial track there is Track.

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
    """
    rails = track_under(track, start, progress, sides=sides, dimension=dimension)
    return [_track(track, rails, start, with_contact=owned) for owned in owners_in(rails.layout)]


def owners_in(layout: Layout) -> tuple[bool, ...]:
    """Without the contact, and with it where its law is known: downwards."""
    return (False, True) if layout.directions == (Z,) else (False,)


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
) -> ModalBody:
    """The reduced track under so many wheelsets, if the ring is long enough for them."""
    check_dimension(dimension)
    directions, bay = DIMENSIONS[dimension], track.mesh.elements_per_bay
    if moves_aside(directions) and bay > PASSIVE_TO:
        warnings.warn(
            f"[mesh] elements_per_bay = {bay}: met aside, such a track may give power to wheels "
            f"over railseats, and a stiff contact grow; none was seen to with {PASSIVE_TO} or less",
            UnusualWarning,
            stacklevel=3,
        )
    progress("measuring the decay along the track")
    check_ring(track, float(np.ptp(start.positions)))
    progress("reducing the track")
    return reduce_track(track, directions).under(Layout(len(start.positions), sides, directions))


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
        annotations={},
    )


def _track(track: Track, rails: ModalBody, start: Start, *, with_contact: bool) -> Content:
    return Content(
        name="TrackWithContact" if with_contact else "Track",
        model="track",
        text=f"Slab track, a ring of cells, {rails.layout.dimension}: "
        + ("wheel motion to contact force." if with_contact else "contact force to motion."),
        table=interface(rails, start, with_contact=with_contact),
        body=rails,
        parameters=write_toml(track, "Slab track"),
        annotations=ring_annotations(track),
    )
