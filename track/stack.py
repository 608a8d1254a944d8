"""What lies on what in a cell, from the rail down to rigid ground."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.ports import Direction, Z
from railcosim.parameters import ParameterError

from .below import (
    Body,
    Chain,
    Crossing,
    Foot,
    Ground,
    Joint,
    Line,
    Plate,
    Points,
    half_of,
    points_across,
    points_along,
    points_at,
)
from .fastenings import Spring, springs_of
from .layers import CONTINUOUS, SLEEPER, Layer
from .parameters import Track
from .section import Section, moves_aside
from .slab import SlabModes


@dataclass(frozen=True, kw_only=True)
class Stack:
    """Bodies of a cell.

    Attributes
    ----------
    track : Track
        Parameters.
    nodes : array
        Of the rail and of what is as continuous, m.
    bodies : list of Body
        The rail, the layers, then the slab, if there is one, and the ground.
    unknowns : int
        Of the cell.
    """

    track: Track
    nodes: FloatArray
    bodies: list[Body]
    unknowns: int

    def joints(self, directions: Collection[Direction]) -> Iterator[Joint]:
        """Each body on the one below; the slab only on its mounts."""
        track = self.track
        kinds = [CONTINUOUS if track.fastening.continuous else "", *(x.kind for x in track.layers)]
        held = [(springs_of(track.fastening, directions), track.fastening.loss_factor)]
        held += [([Spring(Z, x.stiffness, x.damping)], x.loss_factor) for x in track.layers]
        for i, (kind, (springs, loss_factor)) in enumerate(zip(kinds, held, strict=True)):
            upper, lower = self.bodies[i : i + 2]
            points = self._under(kind, track.layers[i - 1] if i else None, lower)
            yield Joint(
                upper=upper, lower=lower, points=points, springs=springs, loss_factor=loss_factor
            )
        ground = track.foundation
        if track.slab.present and ground.mounts:
            parts = (np.arange(ground.mounts) + 0.5) / ground.mounts - 0.5
            x: FloatArray = track.cell_length / 2 + track.slab.length * parts
            spring = Spring(Z, ground.mount_stiffness, ground.mount_damping)
            points = points_at(x, ground.mount_distance / 2)
            slab, rigid = self.bodies[-2:]
            yield Joint(upper=slab, lower=rigid, points=points, springs=[spring], loss_factor=0.0)

    def _under(self, kind: str, layer: Layer | None, lower: Body) -> Points:
        """Where something of a kind lies on what is below."""
        track, side = self.track, self.track.rail.lateral_distance / 2
        if kind == SLEEPER and layer is not None:
            return points_across(layer, railseats(track))
        if kind != CONTINUOUS:
            return points_at(railseats(track), side)
        gap = track.slab.joint / 2 if isinstance(lower, Plate) else 0.0
        span = np.array([gap, track.cell_length - gap])
        return points_along(self.nodes, side, track.fastening.spacing, span)


def railseats(track: Track) -> FloatArray:
    """Railseats along a cell, m: the middles of its bays, shape (bays,)."""
    return (np.arange(track.bays, dtype=np.float64) + 0.5) * track.fastening.spacing


def stack_of(
    track: Track, parity: int, section: Section, nodes: FloatArray, slab: SlabModes | None
) -> Stack:
    """The bodies of a cell of one parity, and their places among its unknowns."""
    seats, n_rail = railseats(track), section.size * nodes.size
    sizes = [
        0 if layer.kind == CONTINUOUS else half_of(layer, parity, seats, 0, 0).size
        for layer in track.layers
    ]
    size = n_rail + sum(sizes) + (slab.size if slab else 0)
    chain = Chain(section=section, nodes=nodes, unknowns=size)
    bodies: list[Body] = [Foot(chain=chain, height=track.rail.centroid_height)]
    member, first = len(section.members) - sizes.count(0), n_rail
    for layer, own in zip(track.layers, sizes, strict=True):
        bodies.append(
            half_of(layer, parity, seats, first, size) if own else Line(chain=chain, member=member)
        )
        member, first = member + (not own), first + own
    if slab is not None:
        bodies.append(Plate(slab=slab, middle=track.cell_length / 2, unknowns=size))
    return Stack(track=track, nodes=nodes, bodies=[*bodies, Ground(unknowns=size)], unknowns=size)


def add_crossings(M: FloatArray, K: FloatArray, stack: Stack) -> None:
    """Masses and bending of blocks and halves of sleepers."""
    for layer, body in zip(stack.track.layers, stack.bodies[1:], strict=False):
        if isinstance(body, Crossing):
            mass, bending = body.matrices(layer)
            n = body.degrees.size
            for seat in range(body.seats.size):
                own = slice(body.first + n * seat, body.first + n * (seat + 1))
                M[own, own], K[own, own] = mass, bending


def check_directions(track: Track, directions: Collection[Direction]) -> None:
    """Raise ParameterError where a track is to move aside, and no lateral stiffness is known."""
    what = [f"[[layers]] {layer.called}" for layer in track.layers]
    what += ["[fastening] continuous"] * track.fastening.continuous
    on_mounts = track.slab.present and track.foundation.mounts and not track.foundation.stiffness
    what += ["[foundation] mounts alone"] * bool(on_mounts)
    if what and moves_aside(directions):
        raise ParameterError(
            f"{what[0]}: has no lateral stiffness; such a track is vertical only, for loads and "
            "motions down in the middle of the heads"
        )
