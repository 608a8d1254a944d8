"""The law of rolling contact in the master: motions and rates of wheels and rails to forces."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from railcosim.fmus.native_runtime.rolling import compiled_rolling
from railcosim.fmus.python_runtime.models import rolling_contact
from railcosim.fmus.roles import Role
from railcosim.master.component import FloatArray, Variable
from railcosim.master.law import ForceLaw, Law
from railcosim.mechanics.contact.at_ports import PORTS, AtPorts, apart
from railcosim.mechanics.contact.profiled import Profiled
from railcosim.mechanics.ports import (
    FORCE,
    IRREGULARITY,
    RAIL,
    WHEEL,
    Face,
    Layout,
    Port,
)

from .contact import ROLLING, Parameters, numbers_of
from .wiring import force_of

SPEED = "speed"
"""Of whose own contacts creep, an input; of other vehicles a parameter; m/s."""
SENT = [k for k, (face, d) in enumerate(PORTS) if face is WHEEL or d.force == "N.m"]
"""Of the forces at `PORTS`, those that differ: a push is the same on wheel and rail, and a moment
about each one's own datum."""


def numbers(parameters: Parameters, layout: Layout) -> Callable[[Role], FloatArray]:
    """What gives a number of each contact, from complete parameters; see `at_ports`."""

    def each(role: Role) -> FloatArray:
        return np.resize(numbers_of(ROLLING[role], parameters, layout), layout.contacts)

    return each


def at_ports(
    parameters: Parameters, layout: Layout, profiles: Profiled | None = None, speed: float = 1.0
) -> AtPorts:
    """The law of complete parameters.

    Parameters
    ----------
    parameters : mapping
        Of the contact.
    layout : Layout
        Of the wheels.
    profiles : Profiled, optional
        Of wheels and rails; cones if not given.
    speed : float
        m/s, for who asks without one of the moment.

    Raises
    ------
    CouplingError
        If a number is missing.
    """
    return rolling_contact(numbers(parameters, layout), layout, profiles, speed)


@dataclass(frozen=True)
class OverRates:
    """A law at ports as a law of `GIVEN` numbers a contact; 8 forces."""

    law: AtPorts

    def force(self, motion: FloatArray) -> FloatArray:
        """See `railcosim.master.law.ForceLaw`."""
        return self.law.force(*apart(motion))

    def tangent(self, motion: FloatArray) -> FloatArray:
        """See `railcosim.master.law.ForceLaw`."""
        q, v, speed = apart(motion)
        by_q, by_v = self.law.tangents(q, v, speed)
        by_speed = self.law.by_speed(v, by_v, speed)
        return np.concatenate([by_q, by_v, by_speed[..., None]], axis=-1)


@dataclass(frozen=True)
class Sent:
    """Of the forces of a law at `PORTS` those that are `SENT`; a `ForceLaw`."""

    law: ForceLaw

    def force(self, motion: FloatArray) -> FloatArray:
        """See `railcosim.master.law.ForceLaw`."""
        return self.law.force(motion).take(SENT, axis=-1)

    def tangent(self, motion: FloatArray) -> FloatArray:
        """See `railcosim.master.law.ForceLaw`."""
        return self.law.tangent(motion)[..., SENT, :]


def rolling_law(
    parameters: Parameters,
    layout: Layout,
    nominal: Mapping[str, float],
    speed: float,
    profiles: Profiled | None = None,
) -> Law:
    """All contacts as a component, see `over_rates`: compiled where that can be.

    Parameters
    ----------
    parameters, layout, profiles
        See `at_ports`.
    nominal : mapping
        Nominal values of the forces, N and N m, by name.
    speed : float
        m/s, where nothing feeds it.
    """
    law = at_ports(parameters, layout, profiles)
    compiled = compiled_rolling(law, numbers(parameters, layout), profiles)
    return over_rates(Sent(compiled or OverRates(law)), layout, nominal, speed)


def over_rates(
    law: ForceLaw, layout: Layout, nominal: Mapping[str, float], speed: float | None = None
) -> Law:
    """All contacts as a component named ``contact``: motions and rates of wheel and rail to forces.

    A moment about the forward axis is two outputs, ``wheel_moment_x`` and ``rail_moment_x``:
    see `force_of`.

    Parameters
    ----------
    law : ForceLaw
        Of motions of a contact at `PORTS`, their rates and the speed, to forces `SENT`.
    layout : Layout
        Of the wheels.
    nominal : mapping
        Nominal values of the forces, N and N m, by name.
    speed : float, optional
        m/s, where nothing feeds it. None: the law, linear about one, does not ask for it.
    """
    motions: list[Variable] = []
    rows, rate_of = [], {}
    for contact in contacts_of(layout):
        for face, port in contact:
            d = port.direction
            rows.append([len(motions)])
            motions.append(Variable(name=port.name(face.motion), unit=d.motion, nominal=1e-3))
            if face is RAIL and d.motion == "m":
                rows[-1].append(len(motions))
                motions.append(Variable(name=port.name(IRREGULARITY), unit="m", nominal=1e-3))
        for face, port in contact:
            rate = port.name(face.rate)
            rows.append([len(motions)])
            rate_of[rate] = port.name(face.motion)
            motions.append(Variable(name=rate, unit=f"{port.direction.motion}/s", nominal=0.1))
        if speed is not None:
            rows.append([-1])  # one of all, the last input
    if speed is not None:
        motions.append(Variable(name=SPEED, unit="m/s", nominal=100.0, start=speed))
    compression = np.zeros((len(rows), len(motions)))
    for row, columns in zip(compression, rows, strict=True):
        row[columns] = 1.0  # what a rail's surface is displaced by is added to its motion
    forces = [
        Variable(
            name=force_of(*contact[k]), unit=contact[k][1].direction.force,
            nominal=nominal.get(contact[k][1].name(FORCE), 1e5),
        )
        for contact in contacts_of(layout)
        for k in SENT
    ]  # fmt: skip
    return Law(
        "contact", law, motions, forces, compression, contacts=layout.contacts,
        rate_of=rate_of,
    )  # fmt: skip


def contacts_of(layout: Layout) -> Iterator[list[tuple[Face, Port]]]:
    """Faces and ports of each contact, in the order of `PORTS`."""
    first = replace(layout, directions=layout.directions[:1])
    for port in first.ports:
        yield [(face, replace(port, direction=d)) for face, d in PORTS]
