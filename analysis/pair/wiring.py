"""How a vehicle and a track are wired, whoever owns the contact."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from railcosim.master.component import Component
from railcosim.master.connections import Connection, connect_by_name
from railcosim.master.law import Law
from railcosim.mechanics.contact.at_ports import PORTS
from railcosim.mechanics.ports import FORCE, RAIL, WHEEL, Face, Layout, Port

TURNING = {d for face, d in PORTS if face is RAIL and d.force == "N.m"}
"""About what wheel and rail feel different moments, each about its own datum, which moves."""


def force_of(face: Face, port: Port) -> str:
    """What a law in the master calls the force on a face, which each FMU calls `FORCE`."""
    return port.name(face.effort if port.direction in TURNING else FORCE)


def wired(
    irregularity: Component, cars: Component, law: Sequence[Law], rails: Component, layout: Layout
) -> tuple[Connection, ...]:
    """Connect outputs to inputs of their names; and what a law in the master names by faces.

    A rate that answers to forces at once is given late to whose forces answer to it.

    Parameters
    ----------
    irregularity, cars, law, rails : Component
        All of the pair.
    layout : Layout
        Of the wheels.

    Raises
    ------
    CouplingError
        If a position or a force is not connected.
    """
    components = [irregularity, cars, *law, rails]
    by_face = [
        Connection(one.name, name, body.name, port.name(FORCE))
        for one in law
        for body, face in ((cars, WHEEL), (rails, RAIL))
        for port in layout.ports
        if (name := force_of(face, port)) in {v.name for v in one.outputs}
        and name != port.name(FORCE)
    ]
    made = {c.input for c in by_face}
    taken = {v.name for component in components for v in component.inputs}
    # A vehicle that owns the contact gives a rail no more than it feels.
    needed = {*layout.down.names(FORCE), *(n for n in layout.names(FORCE) if n in taken)} - made
    found = connect_by_name(components, required=[*layout.of_axles("position"), *needed])
    late = {*_jumping(cars, layout), *_jumping(rails, layout)}
    return tuple(replace(c, delayed=(c.source, c.output) in late) for c in (*found, *by_face))


def _jumping(component: Component, layout: Layout) -> Iterator[tuple[str, str]]:
    """Rates of a component that depend on forces at once."""
    rates = {*layout.names(WHEEL.rate), *layout.names(RAIL.rate)}
    pushed = [k for k, v in enumerate(component.inputs) if v.name in set(layout.names(FORCE))]
    for row, output in zip(component.feedthrough, component.outputs, strict=True):
        if output.name in rates and row[pushed].any():
            yield component.name, output.name
