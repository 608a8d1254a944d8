"""The whole ring of track as one set of sparse finite elements: both rails, and whole slabs."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.ports import ROLL, Direction, Y, Z
from railcosim.track.cell import EVEN, NODE_TOLERANCE, ODD, railseats
from railcosim.track.fastenings import springs_of
from railcosim.track.parameters import Track
from railcosim.track.rail import element_matrices
from railcosim.track.section import Section, moves_aside, section_of
from railcosim.track.slab import PlateModes, free_plate_modes

SIDES = (-1, 1)  # left, right


@dataclass(frozen=True, kw_only=True)
class Slabs:
    """What every slab can do: bend, by the modes of a free plate, and shift and yaw in its plane.

    Attributes
    ----------
    track : Track
        Its parameters.
    plates : tuple of PlateModes
        Bending; none where fastenings stand on rigid ground.
    sideways : bool
        Whether it shifts (m) and yaws (rad), as a rigid body.
    """

    track: Track
    plates: tuple[PlateModes, ...]
    sideways: bool

    @property
    def diagonals(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Mass, damping and stiffness of one slab's unknowns, on its foundation."""
        slab, ground = self.track.slab, self.track.foundation
        omega = np.concatenate([np.empty(0), *(plate.omega for plate in self.plates)])
        per_mass, one = 1 / slab.mass_per_area, np.ones(omega.size)
        area = slab.length * slab.width
        # About the middle; the layer below resists shear alike along and across.
        areas = area * np.array([1.0, (slab.length**2 + slab.width**2) / 12][: 2 * self.sideways])
        return (
            np.append(one, slab.mass_per_area * areas),
            np.append(ground.damping * per_mass * one, ground.damping_lateral * areas),
            np.append(
                omega**2 + ground.series_stiffness * per_mass, ground.stiffness_lateral * areas
            ),
        )

    def motion(self, direction: Direction, x: FloatArray, y: FloatArray) -> FloatArray:
        """Of the surface at points from the middle by a slab's unknowns, shape (points, n)."""
        half, tilts = self.track.slab.thickness / 2, float(self.track.slab.tilts_rails)
        none, aside = np.zeros((x.size, 2)), np.stack([np.ones_like(x), x], axis=1)
        across = {Y: aside}.get(direction, none)[:, : 2 * self.sideways]
        bent = {
            Z: lambda plate: plate.at(x, y),
            Y: lambda plate: tilts * half * plate.slope_across(x, y),
            ROLL: lambda plate: tilts * plate.slope_across(x, y),
        }[direction]
        return np.concatenate([*map(bent, self.plates), across], axis=1)


def slabs_of(track: Track, directions: Collection[Direction]) -> Slabs:
    """What slabs do for loads in directions."""
    there, top = track.slab.present, track.mesh.highest_slab_frequency
    return Slabs(
        track=track,
        plates=tuple(free_plate_modes(track.slab, p, top) for p in (EVEN, ODD)) if there else (),
        sideways=there and moves_aside(directions),
    )


@dataclass(frozen=True, kw_only=True)
class TrackRing:
    """M, C, K of the ring.

    The unknowns are those of the section at the nodes of the left rail, at those of the right one,
    then those of slab after slab. All are in one frame: nothing is mirrored.

    Attributes
    ----------
    M, C, K, K_loss : sparse array, shape (n, n)
        Mass, viscous damping, stiffness, hysteretic part.
    nodes : array
        Rail nodes round the ring, m.
    track : Track
        Its parameters.
    directions : tuple of Direction
        In which a rail is met.
    section : Section
        What moves of a rail.
    """

    M: sparse.csr_array
    C: sparse.csr_array
    K: sparse.csr_array
    K_loss: sparse.csr_array
    nodes: FloatArray
    track: Track
    directions: tuple[Direction, ...]
    section: Section

    def heads(self, position: FloatArray) -> sparse.csr_array:
        """Motions of the heads at places, as rows.

        Those of the left rail, then of the right one; all directions of a place stand together.
        """
        x = np.asarray(position) % self.track.length
        ends = np.append(self.nodes, self.track.length)
        e = np.searchsorted(ends, x + NODE_TOLERANCE, side="right") - 1
        e = np.clip(e, 0, self.nodes.size - 1)
        length = ends[e + 1] - ends[e]
        shapes = [m.shapes((x - ends[e]) / length, length) for m in self.section.members]
        own = [self.section.element_unknowns(i) for i in range(len(shapes))]
        height, count = -self.track.rail.head_height, len(self.directions)
        rows, columns, entries = [], [], []
        for j, direction in enumerate(self.directions):
            parts = self.section.deflections(direction, 0.0, height)
            for part, at, N in zip(parts, own, shapes, strict=True):
                for side in range(2):
                    rows.append(np.repeat((side * x.size + np.arange(x.size)) * count + j, at.size))
                    columns.append(self._element(e, side)[:, at].ravel())
                    entries.append((part * N).ravel())
        found = sparse.csr_array(
            (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))),
            shape=(2 * x.size * count, self.K.shape[0]),
        )
        found.eliminate_zeros()
        return found

    def _element(self, e: NDArray[np.intp], side: int) -> NDArray[np.intp]:
        return side * self.section.size * self.nodes.size + _unknowns(
            e, self.nodes.size, self.section.size
        )


def build_ring(track: Track, directions: tuple[Direction, ...], points: FloatArray) -> TrackRing:
    """Assemble the ring.

    Parameters
    ----------
    track : Track
        Parameters.
    directions : tuple of Direction
        In which rails move.
    points : array
        Positions (m) that get a rail node.
    """
    nodes, section = _nodes(track, points % track.length), section_of(track.rail, directions)
    M_r, K_r = _rail(track, nodes, directions, section)
    slabs = slabs_of(track, directions)
    M_s, C_s, K_s = (
        sparse.diags_array(np.tile(diagonal, track.mesh.cells)) for diagonal in slabs.diagonals
    )
    M = sparse.block_diag([M_r, M_r, M_s], format="csr")
    C = sparse.block_diag([0 * M_r, 0 * M_r, C_s], format="csr")
    K = sparse.block_diag([K_r, K_r, K_s], format="csr")
    K_loss = track.rail.loss_factor * sparse.block_diag([K_r, K_r, 0 * M_s], format="csr")
    for spring in springs_of(track.fastening, directions):
        stretch = _stretch(track, nodes, section, slabs, spring.direction)
        springs = stretch.T @ stretch
        C = C + spring.damping * springs
        K = K + spring.stiffness * springs
        K_loss = K_loss + track.fastening.loss_factor * spring.stiffness * springs
    return TrackRing(
        M=M, C=C, K=K, K_loss=K_loss, nodes=nodes, track=track, directions=directions,
        section=section,
    )  # fmt: skip


def _nodes(track: Track, extra: FloatArray) -> FloatArray:
    n = track.mesh.cells * track.bays * track.mesh.elements_per_bay
    regular = np.arange(n) * (track.length / n)
    ends = np.append(regular, track.length)
    new = [x for x in np.unique(extra) if np.min(np.abs(ends - x)) > NODE_TOLERANCE]
    return np.sort(np.concatenate([regular, new]))


def _unknowns(e: NDArray[np.intp], nodes: int, size: int) -> NDArray[np.intp]:
    """Of elements on a rail, of the node behind and then of the one in front, (n, 2 size)."""
    both = np.stack([e, (e + 1) % nodes], axis=1)[:, :, None] * size + np.arange(size)
    return both.reshape(e.size, -1)


def _rail(
    track: Track, nodes: FloatArray, directions: Collection[Direction], section: Section
) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Mass and stiffness of one rail closed into a ring."""
    lengths = np.diff(np.append(nodes, track.length))
    at = _unknowns(np.arange(nodes.size), nodes.size, section.size)
    m, n = at.shape[1], section.size * nodes.size
    rows, columns = np.repeat(at, m, axis=1).ravel(), np.tile(at, (1, m)).ravel()
    M, K = (
        sparse.csr_array((A.ravel(), (rows, columns)), shape=(n, n))
        for A in element_matrices(track.rail, lengths, directions)
    )
    return M, K


def _stretch(
    track: Track, nodes: FloatArray, section: Section, slabs: Slabs, direction: Direction
) -> sparse.csr_array:
    """Motion of the foot less that of the slab at every fastening, left rail first, as rows."""
    seats, cells, size = railseats(track), track.mesh.cells, section.size
    x = (np.arange(cells)[:, None] * track.cell_length + seats).ravel()
    at = np.argmin(np.abs(nodes[None, :] - x[:, None]), axis=1)
    rails, blocks = 2 * size * nodes.size, []
    parts = section.deflections(direction, 0.0, track.rail.centroid_height)
    for side, sign in enumerate(SIDES):
        foot = sparse.csr_array((x.size, rails))
        for i, part in enumerate(parts):
            first = side * size * nodes.size + section.element_unknowns(i)[0]
            foot = foot + sparse.csr_array(
                (np.full(x.size, part), (np.arange(x.size), first + size * at)), shape=foot.shape
            )
        y = np.full(seats.size, sign * track.rail.lateral_distance / 2)
        surface = slabs.motion(direction, seats - track.cell_length / 2, y)
        blocks.append(sparse.hstack([foot, sparse.kron(sparse.eye_array(cells), -surface)]))
    return sparse.vstack(blocks, format="csr")
