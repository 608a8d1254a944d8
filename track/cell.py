"""One cell of the track: a slab on its foundation with its length of rail, as open matrices.

The cross-section is symmetric, so loads split into an even part (on both rails, as in a mirror
between them) and an odd part (the opposite of that); each is a problem of ONE rail and half a slab.
A cell has both its end nodes; a ring joins the last to the first of the next, which need not be an
equal cell.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Direction, Y, Z

from .below import NODE_TOLERANCE, with_lines
from .fastenings import Support
from .parameters import Track
from .rail import assemble, section_matrices
from .section import VERTICAL, Section, moves_aside, section_of
from .slab import SlabModes, free_plate_modes, no_plate_modes
from .stack import add_crossings, check_directions, railseats, stack_of

EVEN, ODD = 1, -1
FINER = 4  # times as many elements where rails twist: bars are straight, and torsion's waves short


@dataclass(frozen=True, kw_only=True)
class Cell:
    """Matrices of one cell for one parity, per rail.

    The unknowns are those of the section at every node from end to end: the rail's and those of
    layers as continuous as it is; then those of blocks and sleepers, then the slab's modes. The
    rail is the right one; the left one is its mirror image (even) or its opposite.

    Attributes
    ----------
    M, C, K : array, shape (n, n)
        Mass, viscous damping, stiffness.
    K_loss : array, shape (n, n)
        Hysteretic part: the complex stiffness is K + i K_loss.
    supports : tuple of Support
        The springs and dampers in these matrices that stand between rail and slab.
    nodes : array, shape (n_nodes,)
        Rail nodes along the cell, m.
    parity : int
        EVEN or ODD.
    track : Track
        The parameters it was built from.
    section : Section
        What moves of the rail, [w, theta] of the vertical model, and of continuous layers.
    slab : SlabModes or None
        The slab's modes; None where all stands on rigid ground.
    """

    M: FloatArray
    C: FloatArray
    K: FloatArray
    K_loss: FloatArray
    supports: tuple[Support, ...]
    nodes: FloatArray
    parity: int
    track: Track
    section: Section
    slab: SlabModes | None

    @property
    def rail_size(self) -> int:
        """Number of unknowns of the rail and of layers as continuous."""
        return self.section.size * self.nodes.size

    def left(self, direction: Direction) -> int:
        """Sign of the left rail's motion in a direction to the right rail's."""
        return self.parity * direction.mirror

    def viscous_damping(self) -> FloatArray:
        """C with the hysteretic part made viscous at the stated frequency, for time domain."""
        return self.C + self.K_loss / self._loss_omega

    def made_viscous(self) -> Cell:
        """The cell with viscous damping only."""
        return replace(
            self,
            C=self.viscous_damping(),
            K_loss=np.zeros_like(self.K_loss),
            supports=tuple(s.made_viscous(self._loss_omega) for s in self.supports),
        )

    @property
    def _loss_omega(self) -> float:
        return 2 * np.pi * self.track.mesh.loss_factor_frequency

    def dynamic_stiffness(self, omega: FloatArray) -> ComplexArray:
        """K + i K_loss + i omega C - omega^2 M, shape (n_omega, n, n)."""
        w = np.asarray(omega, dtype=float)[:, None, None]
        D: ComplexArray = (self.K + 1j * self.K_loss) + 1j * w * self.C - w**2 * self.M
        return D

    def rail_row(self, x: float, direction: Direction = Z, offset: float = 0.0) -> FloatArray:
        """Participation of a point at the rail's head: its motion is row @ u, shape (n,).

        Parameters
        ----------
        x : float
            In the cell, m.
        direction : Direction
            Of its motion.
        offset : float
            To the right of the head's middle, m.
        """
        row, d = np.zeros(self.K.shape[0]), self.section.size
        e = int(np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, self.nodes.size - 2))
        L = self.nodes[e + 1] - self.nodes[e]
        parts = self.section.deflections(direction, offset, -self.track.rail.head_height)
        for i, (member, part) in enumerate(zip(self.section.members, parts, strict=True)):
            at = e * d + self.section.element_unknowns(i)
            row[at] = part * member.shapes((x - self.nodes[e]) / L, L)
        return row

    def slab_row(self, x: float, y: float, direction: Direction = Z) -> FloatArray:
        """Participation of a slab point, shape (n,); x in the cell, y from the centre line, m."""
        row = np.zeros(self.K.shape[0])
        if self.slab is not None:
            centre = self.track.cell_length / 2
            modes = self.slab.at(direction, np.array([x - centre]), np.array([y]))
            row[row.size - self.slab.size :] = modes
        return row


def independent(track: Track, directions: Collection[Direction]) -> list[tuple[Direction, ...]]:
    """Directions in groups that know nothing of each other: upright rails go down by themselves."""
    down = tuple(d for d in directions if d is Z)
    aside = tuple(d for d in directions if d is not Z)
    groups = [tuple(directions)] if track.rails_tilt else [down, aside]
    return [group for group in groups if group]


def build_cell(
    track: Track,
    parity: int,
    points: FloatArray | None = None,
    directions: Collection[Direction] = VERTICAL,
) -> Cell:
    """Assemble one cell.

    Parameters
    ----------
    track : Track
        Parameters.
    parity : int
        EVEN: both rails loaded as mirror images of each other; ODD: opposite to that.
    points : array, optional
        Rail positions in the cell (m) that get a node of their own: between the nodes of the
        regular mesh a point load finds the element too stiff by its own local flexibility, some
        per cent of the receptance at 1 kHz.
    directions : collection of Direction
        In which the track moves; the vertical model is that for Z alone.

    Returns
    -------
    Cell
    """
    check_directions(track, directions)
    nodes = _nodes(track, points, directions)
    section = with_lines(section_of(track.rail, directions), track.layers, track.fastening.spacing)
    slab = _slab(track, parity, directions) if track.slab.present else None
    stack = stack_of(track, parity, section, nodes, slab)
    size, n_rail = stack.unknowns, section.size * nodes.size
    M, C, K, K_loss = (np.zeros((size, size)) for _ in range(4))
    M_e, K_e = section_matrices(section, np.diff(nodes))
    M[:n_rail, :n_rail], K[:n_rail, :n_rail] = assemble(M_e), assemble(K_e)
    of_rail = np.isin(section.unknowns, section_of(track.rail, directions).unknowns)
    K_loss[:n_rail] += track.rail.loss_factor * np.tile(of_rail, nodes.size)[:, None] * K[:n_rail]
    add_crossings(M, K, stack)
    _add_slab(M, C, K, track, slab, size - (slab.size if slab else 0))
    supports = []
    for joint in stack.joints(directions):
        for spring in joint.springs:
            stretch = joint.stretch(spring.direction)
            loss = joint.loss_factor * spring.stiffness
            K += spring.stiffness * stretch.T @ stretch
            C += spring.damping * stretch.T @ stretch
            K_loss += loss * stretch.T @ stretch
            on_chain, below = (np.any(part) for part in np.split(stretch, [n_rail], axis=1))
            if on_chain and (below or not joint.points.all_along):
                supports.append(Support(stretch, spring.stiffness, spring.damping, loss))
    return Cell(
        M=M, C=C, K=K, K_loss=K_loss, supports=tuple(supports), nodes=nodes, parity=parity,
        track=track, section=section, slab=slab,
    )  # fmt: skip


def _slab(track: Track, parity: int, directions: Collection[Direction]) -> SlabModes:
    bends = Z in directions or track.rails_tilt
    plate = (
        free_plate_modes(track.slab, parity, track.mesh.highest_slab_frequency)
        if bends
        else no_plate_modes(track.slab)
    )
    # Equal motion of both rails to the right is the opposite of its mirror image.
    return SlabModes(
        slab=track.slab, plate=plate, sideways=moves_aside(directions) and parity == Y.mirror
    )  # fmt: skip


def elements_per_bay(track: Track, directions: Collection[Direction]) -> int:
    """How many elements a rail that moves in directions has between two railseats."""
    return track.mesh.elements_per_bay * (FINER if moves_aside(directions) else 1)


def regular_nodes(track: Track, a_bay: int) -> FloatArray:
    """Ends of so many equal parts of every bay along a cell, m, shape (bays * a_bay + 1,)."""
    return np.linspace(0, track.cell_length, track.bays * a_bay + 1)


def _nodes(
    track: Track, points: FloatArray | None, directions: Collection[Direction]
) -> FloatArray:
    """Regular nodes, railseats among them, and the extra points."""
    regular = regular_nodes(track, elements_per_bay(track, directions))
    if points is None:
        return regular
    extra = [x for x in np.unique(points) if np.min(np.abs(regular - x)) > NODE_TOLERANCE]
    # Places a whole number of cells apart are one but for rounding.
    apart = np.diff(extra, prepend=-np.inf) > NODE_TOLERANCE
    return np.sort(np.concatenate([regular, np.array(extra)[apart]]))


def _add_slab(
    M: FloatArray, C: FloatArray, K: FloatArray, track: Track, slab: SlabModes | None, first: int
) -> None:
    """Half a slab (one rail's share) on its foundation; the modes stay uncoupled on it."""
    if slab is None:
        return
    index, ground = np.arange(first, first + slab.size), track.foundation
    free = np.append(slab.plate.omega, np.zeros(slab.size - slab.plate.omega.size))
    M[index, index] = 0.5
    K[index, index] = 0.5 * (
        free**2 + slab.per_mass(ground.series_stiffness, ground.stiffness_lateral)
    )
    C[index, index] = 0.5 * slab.per_mass(ground.damping, ground.damping_lateral)


__all__ = ["EVEN", "ODD", "Cell", "build_cell", "railseats"]
