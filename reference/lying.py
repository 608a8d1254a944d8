"""What lies on what round the whole ring, and its springs, as rows of all unknowns."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.ports import Direction, Z
from railcosim.track.fastenings import Spring, springs_of
from railcosim.track.layers import CONTINUOUS
from railcosim.track.parameters import Track
from railcosim.track.section import Section

from .below import SIDES, Bodies, Line, places
from .slabs import Slabs

Rows = Callable[[Direction, int, FloatArray, FloatArray], sparse.csr_array]
"""Motion of points in a direction: which side (0 left, 1 right), x round the ring, y, m."""


@dataclass(frozen=True)
class Joint:
    """One thing on another at points on the right, and at their mirror images."""

    upper: Rows
    lower: Rows
    x: FloatArray
    y: FloatArray
    part: FloatArray
    springs: Sequence[Spring]
    loss_factor: float

    def stretch(self, direction: Direction, side: int) -> sparse.csr_array:
        """Motion of the upper less that of the lower."""
        at = (direction, side, self.x, SIDES[side] * self.y)
        return sparse.csr_array(self.upper(*at) - self.lower(*at))


@dataclass(frozen=True, kw_only=True)
class Lying:
    """Rails, layers, slabs and ground. Unknowns are those of rails, slabs, then layers."""

    track: Track
    nodes: FloatArray
    section: Section
    slabs: Slabs
    between: Sequence[Bodies | None]

    @property
    def sizes(self) -> list[int]:
        """Unknowns of both rails, of all slabs, and of each layer that is not continuous."""
        slab = self.slabs.diagonals[0].size
        own = [x.M.shape[0] for x in self.between if x is not None]
        return [2 * self.section.size * self.nodes.size, slab * self.track.mesh.cells, *own]

    def joints(self, directions: Collection[Direction]) -> Iterator[Joint]:
        """Each thing on the one below."""
        track, ground = self.track, self.track.foundation
        kinds = [CONTINUOUS if track.fastening.continuous else "", *(x.kind for x in track.layers)]
        held = [(springs_of(track.fastening, directions), track.fastening.loss_factor)]
        held += [([Spring(Z, x.stiffness, x.damping)], x.loss_factor) for x in track.layers]
        bodies = self._bodies()
        for i, (kind, (springs, loss_factor)) in enumerate(zip(kinds, held, strict=True)):
            on_slabs = track.slab.present and i == len(kinds) - 1
            layer = track.layers[i - 1] if i else None
            points = places(track, kind, layer, self.nodes, on_slabs=on_slabs)
            yield Joint(bodies[i], bodies[i + 1], *points, springs, loss_factor)
        if track.slab.present and ground.mounts:
            along = track.slab.length * (np.arange(ground.mounts) + 0.5) / ground.mounts
            begin = np.arange(track.mesh.cells)[:, None] * track.cell_length + track.slab.joint / 2
            x = (begin + along).ravel()
            y = np.full(x.size, ground.mount_distance / 2)
            springs = [Spring(Z, ground.mount_stiffness, ground.mount_damping)]
            yield Joint(bodies[-2], bodies[-1], x, y, np.ones(x.size), springs, 0.0)

    def _bodies(self) -> list[Rows]:
        line = Line(nodes=self.nodes, section=self.section, length=self.track.length)
        height, members = self.track.rail.centroid_height, len(self.section.members)

        def foot(direction: Direction, side: int, x: FloatArray, y: FloatArray) -> sparse.csr_array:
            parts = self.section.deflections(direction, 0.0, height)
            return self._among(line.rows(side, parts, x), 0)

        def slab(direction: Direction, side: int, x: FloatArray, y: FloatArray) -> sparse.csr_array:
            cell, inside = np.divmod(x, self.track.cell_length)
            moved = self.slabs.motion(direction, inside - self.track.cell_length / 2, y)
            n = moved.shape[1]
            columns = (n * cell[:, None] + np.arange(n)).astype(int)
            rows = np.repeat(np.arange(x.size), n)
            entries = (moved.ravel(), (rows, columns.ravel()))
            return self._among(sparse.csr_array(entries, shape=(x.size, self.sizes[1])), 1)

        def rigid(
            direction: Direction, side: int, x: FloatArray, y: FloatArray
        ) -> sparse.csr_array:
            return sparse.csr_array((x.size, sum(self.sizes)))

        bodies: list[Rows] = [foot]
        member, place = members - sum(x is None for x in self.between), 2
        for one in self.between:
            if one is None:
                bodies.append(self._line(line, np.eye(members)[member]))
                member += 1
            else:
                bodies.append(self._crossing(one, place))
                place += 1
        return [*bodies, *([slab] if self.track.slab.present else []), rigid]

    def _line(self, line: Line, parts: FloatArray) -> Rows:
        return lambda direction, side, x, y: self._among(line.rows(side, parts, x), 0)

    def _crossing(self, one: Bodies, place: int) -> Rows:
        return lambda direction, side, x, y: self._among(one.rows(x, y), place)

    def _among(self, rows: sparse.csr_array, place: int) -> sparse.csr_array:
        """Rows of some unknowns as rows of all."""
        sizes = self.sizes
        before, behind = sum(sizes[:place]), sum(sizes[place + 1 :])
        empty = [sparse.csr_array((rows.shape[0], n)) for n in (before, behind)]
        return sparse.csr_array(sparse.hstack([empty[0], rows, empty[1]]))
