"""Where a vehicle and a track that owns the contact are at rest together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.contact.geometry import RIGHT
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import FORCE, WHEEL, Layout, Z

from .content import Content
from .python_runtime.models import Model
from .roles import Role

Heights: TypeAlias = Callable[[FloatArray], FloatArray]


def heights_at_rest(vehicles: Sequence[Content], track: Content) -> list[dict[str, float]]:
    """Heights of the wheelsets for which vehicles and track are at rest together.

    Rails are pressed as the track's own law says, vertical or rolling. Where the
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
    pressed, first = _pressed(track)
    n, sides = track.body.layout.wheelsets, len(track.body.layout.sides)
    ends = np.cumsum([vehicle.body.layout.wheelsets for vehicle in vehicles])[:-1]

    def loads(heights: FloatArray) -> FloatArray:
        found = [
            loads_on(vehicle.body, own)[vertical(vehicle.body.layout)].reshape(sides, -1)
            for vehicle, own in zip(vehicles, np.split(heights, ends), strict=True)
        ]
        left: FloatArray = np.hstack(found)[0]  # and right alike
        return left

    none = np.zeros(n)
    size = loads(none)
    begin = first(size)

    def off(heights: FloatArray) -> FloatArray:
        """In units of what is pressed at first."""
        missing: FloatArray = (pressed(heights * begin) - loads(heights * begin)) / size
        return missing

    heights = begin * root(off, np.ones(n), tol=1e-13).x
    told = [[v.name for v in one.table if v.role is Role.START_Z] for one in vehicles]
    each = np.split(heights, ends)
    return [
        dict(zip(names, own.tolist(), strict=True)) for names, own in zip(told, each, strict=True)
    ]


def _pressed(track: Content) -> tuple[Heights, Heights]:
    """Forces of the left wheels of a track at rest by their heights; and about the inverse.

    Whatever its law does: wheels on cones press rails apart as well, and creep by spinning.
    """
    rails, layout = track.body, track.body.layout
    start = {(v.role, v.index): float(v.start or 0) for v in track.table}
    model = Model(rails, [v.slot for v in track.table], track.profiles)
    model.configure(start)
    inputs, outputs = (
        [v for v in track.table if v.causality == way] for way in ("input", "output")
    )
    given = np.array([float(v.start or 0) for v in inputs])
    down = layout.down
    at = [[v.name for v in inputs].index(name) for name in down.names(WHEEL.motion)]
    told = [[v.name for v in outputs].index(name) for name in down.names(FORCE)]
    # Of all wheels, or of those of each wheelset.
    hertz = [start[key] for key in start if key[0] is Role.HERTZ]
    if track.profiles is not None:
        middle = track.profiles.touch(np.zeros((1, 8)), np.array([RIGHT]))
        hertz = middle.patch.ellipse.C.tolist()

    def pressed(heights: FloatArray) -> FloatArray:
        u, y = given.copy(), np.zeros(len(outputs))
        u[at] = np.tile(heights, len(layout.sides))
        now = model.read(u)
        model.write(model.rest(now), now, 0.0, y)
        found: FloatArray = y[told][: layout.wheelsets]
        return found

    def about(load: FloatArray) -> FloatArray:
        """The rails' deflection under loads, and what springs down are pressed by."""
        met = rails.at(np.array([start[Role.IN_POSITION, i] for i in range(layout.wheelsets)]))
        ports = vertical(layout)
        every = np.tile(load, len(layout.sides))
        C = np.resize(hertz, layout.wheelsets)
        below = met.static_compliance()[np.ix_(ports, ports)] @ every
        found: FloatArray = below[: layout.wheelsets] + (load / C) ** (2 / 3)
        return found

    return pressed, about


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
