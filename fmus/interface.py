"""The interface of an FMU as one table: names, units, causality, exact dependencies.

Every runtime is built from this table, and so is every modelDescription.xml.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import Layout, Z
from railcosim.track.sensor_quantities import Told

from .law_variables import Contact, OfContact, law_at
from .port_variables import ports_of, position
from .roles import Role
from .rolling_variables import RollingWheels, speed
from .scalar import Scalar, names
from .sensor_variables import sensor_outputs
from .stepping_variables import input_hold, internal_step, time
from .vehicle_variables import axleboxes, bodies, rolling_on, start_heights, start_place

__all__ = ["Contact", "RollingWheels", "Scalar", "Start", "interface", "owns_contact"]


@dataclass(frozen=True, kw_only=True)
class Start:
    """What inputs and parameters are at first.

    Attributes
    ----------
    loads : sequence of float
        Static vertical contact forces of the wheels, in their order, N; those in other directions
        are 0 at first.
    positions : sequence of float
        Of the wheelsets, m.
    contact : OfContact or None
        Of the contact law; None where no FMU knows it.
    """

    loads: Sequence[float]
    positions: Sequence[float]
    contact: OfContact | None


def interface(
    body: ModalBody, start: Start, *, with_contact: bool, seen: Sequence[Told] = ()
) -> list[Scalar]:
    """Variables of a track or a vehicle: contact forces to motion, or the other's motion to forces.

    Parameters
    ----------
    body : ModalBody
        The model.
    start : Start
        Start values.
    with_contact : bool
        Whether it owns the contact springs.
    seen : sequence of Told
        By sensors of a track, as its observation has them.
    """
    layout, stays = body.layout, body.coordinates is None
    numbers, own = layout.numbers, start.contact if with_contact else None
    places = [
        position(i, "input", start=x) for i, x in zip(numbers, start.positions, strict=True)
    ] if stays else []  # fmt: skip
    creeps = own is not None and own.of_rates
    fast = [speed()] if creeps else []
    trip = [] if stays else [start_place(start.positions[-1], numbers[-1])]
    if not (stays or creeps):
        trip = [rolling_on(), *trip]
    heights = [] if stays else start_heights(body)
    law = own.parameters() if own else []
    given = [own.given(body, k) if own else [] for k in range(layout.contacts)]
    inputs = [*places, *(v for rows in given for v in rows)]
    if not own:
        loads = dict(zip(layout.wheels, start.loads, strict=True))
        inputs += [
            at.force("input", body.face, loads[at.port.wheel] if at.port.direction is Z else 0.0)
            for at in ports_of(body)
        ]
    inputs += fast
    table = [time(), *inputs]
    if not stays:
        # A speed that is an input moves wheels over a step, never at once.
        run = names([time(), *trip])
        begun = run + names(fast)
        table += [
            replace(position(i, "output"), depends_on=run, starts_from=begun) for i in numbers
        ]
    what = Known(
        places=names(places),
        heights=names(heights),
        given=[names(v for v in (*rows, *fast) if own and own.counts(v)) for rows in given],
        law=law,
        jumps=creeps and stays,
        inputs=names(v for v in inputs if not own or own.counts(v)),
    )
    for k in range(layout.contacts):
        table += _answers(body, k, own.told_forces(body, k) if own else [], what)
    table += sensor_outputs(seen, what.everything)
    fed = [what.of_wheelset(layout, i) for i in numbers] if own else []
    table += [*bodies(body, names(heights)), *axleboxes(body, names(heights), fed)]
    table += [input_hold(), *trip, *heights]
    if stays or own:
        table.append(internal_step())
    # Whose wheels they are tells the law, also where another owns the contact.
    told = start.contact.told() if start.contact and not (stays or own) else []
    return [*table, *law, *told]


@dataclass(frozen=True, kw_only=True)
class Known:
    """What outputs may depend on.

    Attributes
    ----------
    places, heights : tuple of str
        Inputs of a track, parameters of a vehicle, one a wheelset.
    given : sequence of tuple of str
        Inputs that the forces of each contact depend on, where the body owns them.
    law : sequence of Scalar
        Parameters of the law.
    jumps : bool
        Whether rates of the body, and so all forces, change at once with each of these.
    inputs : tuple of str
        All that count.
    """

    places: tuple[str, ...]
    heights: tuple[str, ...]
    given: Sequence[tuple[str, ...]]
    law: Sequence[Scalar]
    jumps: bool
    inputs: tuple[str, ...]

    @property
    def everything(self) -> tuple[str, ...]:
        """Inputs and the law."""
        return self.inputs + names(self.law)

    def of_wheelset(self, layout: Layout, i: int) -> tuple[str, ...]:
        """What the forces of all its contacts depend on."""
        own = range(i - 1, layout.contacts, layout.wheelsets)
        return tuple(name for k in own for name in self.given[k]) + names(law_at(self.law, i))


def _answers(body: ModalBody, contact: int, forces: Sequence[Scalar], known: Known) -> list[Scalar]:
    """Outputs of one contact.

    A track at rest carries all forces, and does not move whatever these are; a vehicle stands on
    wheelsets held at their heights.
    """
    k, stays = len(body.layout.directions), bool(known.places)
    table = []
    for at in ports_of(body)[contact * k : (contact + 1) * k]:
        i = at.port.wheelset - 1
        here, own_height = known.places[i : i + 1], known.heights[i : i + 1]
        standing = own_height if at.port.direction is Z else ()
        at_rest = known.everything if stays else standing
        table += [
            replace(at.motion(body.face, "output"), depends_on=here, starts_from=at_rest),
            replace(at.rate(body.face, "output"), depends_on=known.everything if stays else ()),
        ]
    for force in forces:
        own = here + known.given[contact] + names(law_at(known.law, i + 1))
        table.append(
            replace(
                force,
                depends_on=known.everything if known.jumps else own,
                starts_from=known.everything if stays else own + own_height,
            )
        )
    return table


def owns_contact(table: Sequence[Scalar]) -> bool:
    """Whether an interface is that of an FMU with the contact springs inside."""
    return any(v.role is Role.OUT_FORCE for v in table)
