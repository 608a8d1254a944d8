"""The whole ring of track as one set of sparse finite elements: both rails, and whole slabs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.ports import Direction
from railcosim.track.below import NODE_TOLERANCE, with_lines
from railcosim.track.cell import elements_per_bay, independent
from railcosim.track.layers import CONTINUOUS
from railcosim.track.parameters import Track
from railcosim.track.rail import section_matrices
from railcosim.track.section import Section, section_of

from .below import Line, bodies_of, unknowns_at
from .lying import Lying
from .slabs import slabs_of


@dataclass(frozen=True, kw_only=True)
class Chain:
    """M, C, K of what moves by itself: rails and all below, in directions that belong together.

    The unknowns are those of the section at the nodes of the left rail, at those of the right one,
    then those of slab after slab. All are in one frame: nothing is mirrored.

    Attributes
    ----------
    M, C, K, K_loss : sparse array, shape (n, n)
        Mass, viscous damping, stiffness, hysteretic part.
    nodes : array
        Rail nodes round the ring, m.
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
    directions: tuple[Direction, ...]
    section: Section


@dataclass(frozen=True, kw_only=True)
class TrackRing:
    """The whole ring: its chains, one behind the other.

    Attributes
    ----------
    M, C, K, K_loss : sparse array, shape (n, n)
        Mass, viscous damping, stiffness, hysteretic part.
    chains : tuple of Chain
        Each of directions that know nothing of the others.
    track : Track
        Its parameters.
    directions : tuple of Direction
        In which a rail is met.
    """

    M: sparse.csr_array
    C: sparse.csr_array
    K: sparse.csr_array
    K_loss: sparse.csr_array
    chains: tuple[Chain, ...]
    track: Track
    directions: tuple[Direction, ...]

    def heads(self, position: FloatArray) -> sparse.csr_array:
        """Motions of the heads at places, as rows.

        Those of the left rail, then of the right one; all directions of a place stand together.
        """
        x = np.asarray(position) % self.track.length
        height, count = -self.track.rail.head_height, len(self.directions)
        rows: dict[Direction, sparse.csr_array] = {}
        first, size = 0, self.K.shape[0]
        for chain in self.chains:
            line = Line(nodes=chain.nodes, section=chain.section, length=self.track.length)
            for direction in chain.directions:
                parts = chain.section.deflections(direction, 0.0, height)
                moved = sparse.vstack([line.rows(side, parts, x) for side in range(2)])
                behind = size - first - moved.shape[1]
                ends = (sparse.csr_array((2 * x.size, n)) for n in (first, behind))
                rows[direction] = sparse.hstack([next(ends), moved, next(ends)], format="csr")
            first += chain.K.shape[0]
        # All directions of a place together.
        order = np.arange(2 * x.size * count).reshape(count, -1).T.ravel()
        found = sparse.vstack([rows[d] for d in self.directions], format="csr")[order]
        found.eliminate_zeros()
        return sparse.csr_array(found)


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
    chains = tuple(_chain(track, group, points) for group in independent(track, directions))
    M, C, K, K_loss = (
        sparse.csr_array(sparse.block_diag([getattr(chain, name) for chain in chains]))
        for name in ("M", "C", "K", "K_loss")
    )
    return TrackRing(
        M=M, C=C, K=K, K_loss=K_loss, chains=chains, track=track, directions=directions
    )


def _chain(track: Track, directions: tuple[Direction, ...], points: FloatArray) -> Chain:
    nodes = _nodes(track, elements_per_bay(track, directions), points % track.length)
    section = with_lines(section_of(track.rail, directions), track.layers, track.fastening.spacing)
    M_r, K_r = _rail(track, nodes, section)
    slabs = slabs_of(track, directions)
    M_s, C_s, K_s = (
        sparse.diags_array(np.tile(diagonal, track.mesh.cells)) for diagonal in slabs.diagonals
    )
    between = [None if x.kind == CONTINUOUS else bodies_of(x, track) for x in track.layers]
    M_b, K_b = ([getattr(x, name) for x in between if x is not None] for name in ("M", "K"))
    M = sparse.block_diag([M_r, M_r, M_s, *M_b], format="csr")
    C = sparse.block_diag([0 * M_r, 0 * M_r, C_s, *(0 * x for x in M_b)], format="csr")
    K = sparse.block_diag([K_r, K_r, K_s, *K_b], format="csr")
    of_rail = np.isin(section.unknowns, section_of(track.rail, directions).unknowns)
    loss = np.zeros(K.shape[0])
    loss[: 2 * K_r.shape[0]] = track.rail.loss_factor * np.tile(of_rail, 2 * nodes.size)
    K_loss = sparse.diags_array(loss) @ K
    lying = Lying(track=track, nodes=nodes, section=section, slabs=slabs, between=between)
    for joint in lying.joints(directions):
        for spring in joint.springs:
            for side in range(2):
                stretch = joint.stretch(spring.direction, side)
                springs = stretch.T @ sparse.diags_array(joint.part) @ stretch
                C = C + spring.damping * springs
                K = K + spring.stiffness * springs
                K_loss = K_loss + joint.loss_factor * spring.stiffness * springs
    return Chain(M=M, C=C, K=K, K_loss=K_loss, nodes=nodes, directions=directions, section=section)


def _nodes(track: Track, a_bay: int, extra: FloatArray) -> FloatArray:
    n = track.mesh.cells * track.bays * a_bay
    regular = np.arange(n) * (track.length / n)
    ends = np.append(regular, track.length)
    new = [x for x in np.unique(extra) if np.min(np.abs(ends - x)) > NODE_TOLERANCE]
    return np.sort(np.concatenate([regular, new]))


def _rail(
    track: Track, nodes: FloatArray, section: Section
) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Mass and stiffness of one rail, with layers as continuous, closed into a ring."""
    lengths = np.diff(np.append(nodes, track.length))
    at = unknowns_at(np.arange(nodes.size), nodes.size, section.size)
    m, n = at.shape[1], section.size * nodes.size
    rows, columns = np.repeat(at, m, axis=1).ravel(), np.tile(at, (1, m)).ravel()
    M, K = (
        sparse.csr_array((A.ravel(), (rows, columns)), shape=(n, n))
        for A in section_matrices(section, lengths)
    )
    return M, K
