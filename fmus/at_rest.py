"""Where a vehicle and a track that owns the contact are at rest together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import Layout, Z

from .content import Content
from .roles import Role


def heights_at_rest(vehicles: Sequence[Content], track: Content) -> list[dict[str, float]]:
    """Heights of the wheelsets for which vehicles and track are at rest together.

    A height is the rail's deflection under all loads, and the contact's compression. Where the
    bodies above can follow any heights without strain, every wheel carries its static load,
    whatever the track; else its load depends on the heights.

    Parameters
    ----------
    vehicles : sequence of Content
        From the front, of `railcosim.fmus.content.contents`.
    track : Content
        The track with the contact, under all of them.

    Returns
    -------
    list of dict
        Each vehicle's parameters ``wheelset[i].start_z``, m, down.
    """
    start = {(v.role, v.index): float(v.start or 0) for v in track.table}
    rails, n = track.body, track.body.layout.wheelsets
    positions = [start[Role.IN_POSITION, i] for i in range(n)]
    down = vertical(rails.layout)
    G = rails.at(np.array(positions)).static_compliance()[np.ix_(down, down)]
    # Of all wheels, or of those of each wheelset, on both sides alike.
    C = np.resize([float(v.start or 0) for v in track.table if v.role is Role.HERTZ], len(G))
    ends = np.cumsum([vehicle.body.layout.wheelsets for vehicle in vehicles])[:-1]
    sides = len(rails.layout.sides)

    def sunk(heights: FloatArray) -> FloatArray:
        loads = [
            loads_on(vehicle.body, own)[vertical(vehicle.body.layout)].reshape(sides, -1)
            for vehicle, own in zip(vehicles, np.split(heights, ends), strict=True)
        ]
        load = np.hstack(loads).ravel()
        below: FloatArray = (G @ load + (load / C) ** (2 / 3))[:n]  # left and right alike
        return below

    def off(heights: FloatArray) -> FloatArray:
        return heights - sunk(heights)

    heights = root(off, sunk(np.zeros(n)), tol=1e-13).x
    told = [[v.name for v in one.table if v.role is Role.START_Z] for one in vehicles]
    each = np.split(heights, ends)
    return [
        dict(zip(names, own.tolist(), strict=True)) for names, own in zip(told, each, strict=True)
    ]


def loads_on(vehicle: ModalBody, heights: FloatArray) -> FloatArray:
    """Contact forces that hold a vehicle at rest on wheelsets at given heights, (ports,), N."""
    known = vehicle.coordinates
    if known is None:
        raise TypeError("a track does not stand on wheelsets")
    strained = np.where(known.strained, known.start_s, 0.0) @ heights
    pushed = (known.modes[known.wheelsets] @ (vehicle.poles**2 * strained)).real
    layout = vehicle.layout
    down = vertical(layout)[: layout.wheelsets]  # of the left side
    both = -np.linalg.solve(known.through[np.ix_(known.wheelsets, down)], pushed)
    return vehicle.preload + layout.at_wheelsets(both / len(layout.sides), Z)


def vertical(layout: Layout) -> NDArray[np.intp]:
    """Places of the vertical ports among all."""
    return np.flatnonzero([port.direction is Z for port in layout.ports])
