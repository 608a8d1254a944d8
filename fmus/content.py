"""What the FMUs carry: interface, model as arrays, parameters; whatever runtime they get."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.parameters import write_toml
from railcosim.track.decay import check_ring, decay_along
from railcosim.track.parameters import Track
from railcosim.track.reduced import ReducedTrack, reduce_track
from railcosim.vehicle.contact import hertz_coefficient, tangent_stiffness
from railcosim.vehicle.modal import modal_form
from railcosim.vehicle.multibody import WHEELSETS, Multibody, build_multibody
from railcosim.vehicle.parameters import Vehicle

from . import interface
from .interface import Scalar

Arrays = dict[str, NDArray[Any]]
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
    modal = modal_form(body)
    above = slice(0, WHEELSETS.start)
    # Bodies above follow the wheelsets at rest; columns: unit height of one wheelset.
    follow = np.zeros((body.K.shape[0], 4))
    follow[WHEELSETS] = np.eye(4)
    follow[above] = -np.linalg.solve(body.K[above, above], body.K[above, WHEELSETS])
    return {
        "poles": modal.poles,
        "rigid": modal.rigid,
        "modes": modal.modes,
        "left": modal.left,
        "inverse_mass": 1 / np.diag(body.M),
        "start_s": modal.state_of @ follow,
        "start_r": modal.rigid.T @ body.M @ follow,
        "wheel_load": np.array(body.wheel_load),
        "wheelset_x": body.wheelset_x,
    }


def contact_defaults(vehicle: Vehicle) -> interface.Contact:
    """Contact parameters of the vehicle's wheels: C, and k_H at the static load (eq. 18)."""
    c = vehicle.contact
    C = hertz_coefficient(
        young_modulus=c.young_modulus,
        poisson_ratio=c.poisson_ratio,
        wheel_radius=vehicle.wheelset.radius,
        rail_radius=c.rail_radius,
    )
    return interface.Contact(k_H=tangent_stiffness(C, vehicle.wheel_load), C=C)


def ring_annotations(track: Track) -> Annotations:
    """What a track says of its ring: its length, and what vehicle it is long enough for, m."""
    longest = decay_along(track).longest_span(track.mesh.cells)
    return {"Ring": {"length": repr(track.length), "longestVehicle": repr(longest)}}


def contents(
    vehicle: Vehicle, track: Track, progress: Callable[[str], None] = lambda text: None
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
            "wheel_load": vehicle.wheel_load,
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
                parameters=write_toml(vehicle, "Vehicle"),
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
