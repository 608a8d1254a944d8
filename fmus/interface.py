"""The interface of the four FMUs as one table: names, units, causality, exact dependencies.

Every runtime is built from this table, and so is every modelDescription.xml.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from .variables import (
    SIDES,
    WHEELSETS,
    Contact,
    Scalar,
    axleboxes,
    bodies,
    contact_parameters,
    force,
    input_hold,
    internal_step,
    irregularity,
    journey,
    names,
    position,
    rail_vz,
    rail_z,
    start_heights,
    time,
    told_coefficient,
    wheel_vz,
    wheel_z,
    wheels,
)

__all__ = ["SIDES", "WHEELSETS", "Contact", "Scalar", "track", "vehicle", "wheels"]


def track(
    *, with_contact: bool, wheel_load: float, positions: list[float], contact: Contact
) -> list[Scalar]:
    """Track (force to motion) or TrackWithContact (wheel motion to force).

    Parameters
    ----------
    with_contact : bool
        Whether the track owns the contact spring.
    wheel_load : float
        Static load of a wheel, the forces' start value, N.
    positions : list of float
        Start positions of the wheelsets, m.
    contact : Contact
        Defaults of the contact law.
    """
    table = [time()]
    table += [position(i, "input", start=x) for i, x in zip(WHEELSETS, positions, strict=True)]
    for i, side in wheels():
        if with_contact:
            table += [wheel_z(i, side, "input"), irregularity(i, side)]
        else:
            table.append(force(i, side, "input", start=wheel_load))
    law = contact_parameters(contact) if with_contact else []
    everything = names(v for v in table if v.causality == "input") + names(law)
    for i, side in wheels():
        here = (position(i, "input").name,)
        # At rest the rails carry all forces, and do not move whatever these are.
        table += [
            replace(rail_z(i, side, "output"), depends_on=here, starts_from=everything),
            replace(rail_vz(i, side), depends_on=everything),
        ]
        if with_contact:
            own = here + names([wheel_z(i, side, "input"), irregularity(i, side), *law])
            pressed = force(i, side, "output")
            table.append(replace(pressed, depends_on=own, starts_from=everything))
    return [*table, input_hold(), internal_step(with_contact=with_contact), *law]


def owns_contact(table: Sequence[Scalar]) -> bool:
    """Whether an interface is that of an FMU with the contact springs inside."""
    return any(v.name == "contact.nonlinear" for v in table)


def vehicle(
    *, with_contact: bool, wheel_load: float, positions: list[float], contact: Contact
) -> list[Scalar]:
    """Vehicle (force to motion) or VehicleWithContact (rail motion to force); see `track`."""
    table = [time()]
    for i, side in wheels():
        if with_contact:
            table += [rail_z(i, side, "input"), irregularity(i, side)]
        else:
            table.append(force(i, side, "input", start=wheel_load))
    law = contact_parameters(contact) if with_contact else []
    trip, heights = journey(positions[-1]), start_heights()
    run = names([time(), *trip])
    table += [replace(position(i, "output"), depends_on=run, starts_from=run) for i in WHEELSETS]
    for i, side in wheels():
        start = names([heights[i - 1]])
        table += [replace(wheel_z(i, side, "output"), starts_from=start), wheel_vz(i, side)]
        if with_contact:
            own = names([rail_z(i, side, "input"), irregularity(i, side), *law])
            pressed = force(i, side, "output")
            table.append(replace(pressed, depends_on=own, starts_from=own + start))
    table += [*bodies(names(heights)), *axleboxes(names(heights), law)]
    if not with_contact:
        return [*table, input_hold(), *trip, *heights, told_coefficient(contact)]
    return [*table, input_hold(), *trip, *heights, internal_step(with_contact=True), *law]
