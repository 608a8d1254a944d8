"""What the FMUs carry: interface, model as arrays, parameters; whatever runtime they get."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.parameters import ParameterError, write_toml
from railcosim.track.decay import check_ring, decay_along
from railcosim.track.parameters import Track
from railcosim.track.reduced import ReducedTrack, reduce_track
from railcosim.vehicle.contact import tangent_stiffness
from railcosim.vehicle.files import write_stock
from railcosim.vehicle.modal import modal_form
from railcosim.vehicle.multibody import Multibody, build_multibody
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train, train_of

from . import interface
from .interface import Scalar

Arrays = dict[str, NDArray[Any]]
Annotations = dict[str, dict[str, str]]
EQUAL = 1e-9  # of a load; loads that are equal by symmetry differ by rounding, 1e-15


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
    arrays : dict
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
    arrays: Arrays
    parameters: str
    annotations: Annotations

    @property
    def has_contact(self) -> bool:
        """Whether it owns the contact springs."""
        return interface.owns_contact(self.table)


def track_arrays(track: ReducedTrack) -> Arrays:
    """The reduced track; mode shapes as one table, (nodes, 2, modes): w and dw/dx.

    The last node of a cell, the first one of the next, is left out. The shapes are numbers of
    single precision, see `reduce_track`.
    """
    return {
        "poles": track.poles,
        "mu": track.mu,
        "partner": track.partner,
        "parity": track.parity,
        "table": np.stack([track.w, track.slope], axis=1)[:-1].astype(np.complex64),
        "residual_pole": np.array(track.residual_pole),
        "residual_shape": track.residual_shape,
        "cell_length": np.array(track.cell_length),
        "length": np.array(track.length),
    }


def vehicle_arrays(body: Multibody) -> Arrays:
    """The vehicle's modes, and how it rests on wheelsets held at given heights."""
    modal, follow = modal_form(body), body.following
    return {
        "poles": modal.poles,
        "rigid": modal.rigid,
        "modes": modal.modes,
        "left": modal.left,
        "inverse_mass": 1 / np.diag(body.M),
        "start_s": modal.state_of @ follow,
        "start_r": modal.rigid.T @ body.M @ follow,
        "wheel_load": np.array(one_load(body)),
        "wheelset_x": body.wheelset_x,
    }


def one_load(body: Multibody) -> float:
    """Static load of every wheel, N.

    Raises
    ------
    ParameterError
        If there are other than four wheelsets, or they carry different loads.
    """
    if body.wheelset_x.size != 4 or np.ptp(body.wheel_load) > EQUAL * body.wheel_load.max():
        raise ParameterError(
            f"{body.wheelset_x.size} wheelsets whose wheels carry {body.wheel_load.min():.0f} to "
            f"{body.wheel_load.max():.0f} N: an FMU has four that carry the same"
        )
    return float(body.wheel_load[0])


def contact_defaults(vehicle: Vehicle | Train) -> interface.Contact:
    """Contact parameters of the wheels: C, and k_H at their mean static load (eq. 18)."""
    train = train_of(vehicle)
    k_H = tangent_stiffness(train.hertz_coefficient, train.wheel_load)
    return interface.Contact(k_H=k_H, C=train.hertz_coefficient)


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
    body = build_multibody(vehicle)
    load = one_load(body)
    progress("measuring the decay along the track")
    check_ring(track, float(np.ptp(body.wheelset_x)))
    progress("reducing the track")
    reduced = track_arrays(reduce_track(track))
    vehicle_content = vehicle_arrays(body)
    # The rearmost wheelset starts above a railseat, the paper's place.
    positions = body.wheelset_x - body.wheelset_x[-1] + track.fastening.spacing / 2
    made = []
    for with_contact in (False, True):
        known = {
            "with_contact": with_contact,
            "wheel_load": load,
            "positions": positions.tolist(),
            "contact": contact_defaults(vehicle),
        }
        made += [
            Content(
                name="VehicleWithContact" if with_contact else "Vehicle",
                model="vehicle",
                text="Railway vehicle, vertical: "
                + ("rail motion to contact force." if with_contact else "contact force to motion."),
                table=interface.vehicle(**known),
                arrays=vehicle_content,
                parameters=write_stock(vehicle),
                annotations={},
            ),
            Content(
                name="TrackWithContact" if with_contact else "Track",
                model="track",
                text="Slab track, a ring of cells, vertical: "
                + (
                    "wheel motion to contact force." if with_contact else "contact force to motion."
                ),
                table=interface.track(**known),
                arrays=reduced,
                parameters=write_toml(track, "Slab track"),
                annotations=ring_annotations(track),
            ),
        ]
    return made
