"""The interface of an FMU as one table: names, units, causality, exact dependencies.

Every runtime is built from this table, and so is every modelDescription.xml.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import Z

from .law_variables import Contact, contact_parameters, law_at, told_coefficient
from .port_variables import AtPort, ports_of, position
from .roles import Role
from .scalar import Scalar, names
from .stepping_variables import input_hold, internal_step, time
from .vehicle_variables import axleboxes, bodies, journey, start_heights

__all__ = ["Contact", "Scalar", "Start", "interface", "owns_contact"]


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
    contact : Contact
        Of the contact law.
    """

    loads: Sequence[float]
    positions: Sequence[float]
    contact: Contact


def interface(body: ModalBody, start: Start, *, with_contact: bool) -> list[Scalar]:
    """Variables of a track or a vehicle: contact forces to motion, or the other's motion to forces.

    Parameters
    ----------
    body : ModalBody
        The model.
    start : Start
        Start values.
    with_contact : bool
        Whether it owns the contact springs.
    """
    numbers, stays = body.layout.numbers, body.coordinates is None
    places = [
        position(i, "input", start=x) for i, x in zip(numbers, start.positions, strict=True)
    ] if stays else []  # fmt: skip
    trip = [] if stays else journey(start.positions[-1], numbers[-1])
    heights = [] if stays else start_heights(body)
    law = contact_parameters(start.contact) if with_contact else []
    inputs = [*places]
    loads = dict(zip(body.layout.wheels, start.loads, strict=True))
    for at in ports_of(body):
        load = loads[at.port.wheel] if at.port.direction is Z else 0.0
        if with_contact:
            inputs += [at.motion(body.face.other, "input"), at.irregularity()]
        else:
            inputs.append(at.force("input", start=load))
    table = [time(), *inputs]
    if not stays:
        run = names([time(), *trip])
        table += [replace(position(i, "output"), depends_on=run, starts_from=run) for i in numbers]
    for at in ports_of(body):
        table += _answers(at, names([*inputs, *law]), names(places), names(heights), law)
    table += [*bodies(body, names(heights)), *axleboxes(body, names(heights), law)]
    table += [input_hold(), *trip, *heights]
    if stays or with_contact:
        table.append(internal_step())
    # Whose wheels they are tells the law, also where another owns the contact.
    return [*table, *(law if stays or with_contact else told_coefficient(start.contact))]


def _answers(
    at: AtPort,
    everything: tuple[str, ...],
    places: tuple[str, ...],
    heights: tuple[str, ...],
    law: Sequence[Scalar],
) -> list[Scalar]:
    """Outputs of one port.

    A track at rest carries all forces, and does not move whatever these are; a vehicle stands on
    wheelsets held at their heights.
    """
    i = at.port.wheelset - 1
    here, own_height = places[i : i + 1], heights[i : i + 1]
    stays = bool(places)
    standing = own_height if at.port.direction is Z else ()
    at_rest = everything if stays else standing
    table = [
        replace(at.motion(at.body.face, "output"), depends_on=here, starts_from=at_rest),
        replace(at.rate(), depends_on=everything if stays else ()),
    ]
    if law:
        laws = law_at(law, at.port.wheelset)
        own = here + names([at.motion(at.body.face.other, "input"), at.irregularity(), *laws])
        start = everything if stays else own + own_height
        table.append(replace(at.force("output"), depends_on=own, starts_from=start))
    return table


def owns_contact(table: Sequence[Scalar]) -> bool:
    """Whether an interface is that of an FMU with the contact springs inside."""
    return any(v.role is Role.OUT_FORCE for v in table)
