"""One cell of the track: a slab on its foundation with its length of rail, as open matrices.

The cross-section is symmetric, so loads split into an even part (equal on both rails) and an odd
part (opposite); each is a problem of ONE rail and half a slab. A cell has both its end nodes; a
ring joins the last to the first of the next, which need not be an equal cell.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.shape_functions import shape_functions

from .parameters import Track
from .rail import assemble, element_matrices
from .slab import PlateModes, free_plate_modes

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

EVEN, ODD = 1, -1
NODE_TOLERANCE = 1e-6  # m; a point this near to a node is that node


@dataclass(frozen=True, kw_only=True)
class Cell:
    """Matrices of one cell for one parity, per rail.

    The unknowns are [w, theta] of every rail node from end to end, then the slab's modes.

    Attributes
    ----------
    M, C, K : array, shape (n, n)
        Mass, viscous damping, stiffness.
    K_loss : array, shape (n, n)
        Hysteretic part: the complex stiffness is K + i K_loss.
    nodes : array, shape (n_nodes,)
        Rail nodes along the cell, m.
    parity : int
        EVEN or ODD.
    track : Track
        The parameters it was built from.
    plate : PlateModes or None
        The slab's modes; None where fastenings stand on rigid ground.
    """

    M: FloatArray
    C: FloatArray
    K: FloatArray
    K_loss: FloatArray
    nodes: FloatArray
    parity: int
    track: Track
    plate: PlateModes | None

    @property
    def rail_size(self) -> int:
        """Number of rail unknowns."""
        return 2 * self.nodes.size

    def viscous_damping(self) -> FloatArray:
        """C with the hysteretic part made viscous at the stated frequency, for time domain."""
        omega: float = 2 * np.pi * self.track.mesh.loss_factor_frequency
        return self.C + self.K_loss / omega

    def made_viscous(self) -> Cell:
        """The cell with viscous damping only."""
        return replace(self, C=self.viscous_damping(), K_loss=np.zeros_like(self.K_loss))

    def dynamic_stiffness(self, omega: FloatArray) -> ComplexArray:
        """K + i K_loss + i omega C - omega^2 M, shape (n_omega, n, n)."""
        w = np.asarray(omega, dtype=float)[:, None, None]
        D: ComplexArray = (self.K + 1j * self.K_loss) + 1j * w * self.C - w**2 * self.M
        return D

    def rail_row(self, x: float) -> FloatArray:
        """Participation of a rail point: w(x) = row @ u, shape (n,); x in the cell, m."""
        row = np.zeros(self.K.shape[0])
        e = int(np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, self.nodes.size - 2))
        L = self.nodes[e + 1] - self.nodes[e]
        phi = 12 * self.track.rail.bending_stiffness / (self.track.rail.shear_stiffness * L**2)
        N_w, _ = shape_functions((x - self.nodes[e]) / L, L, phi)
        row[2 * e : 2 * e + 4] = N_w
        return row

    def slab_row(self, x: float, y: float) -> FloatArray:
        """Participation of a slab point, shape (n,); x in the cell, y from the centre line, m."""
        row = np.zeros(self.K.shape[0])
        if self.plate is not None:
            centre = self.track.cell_length / 2
            row[self.rail_size :] = self.plate.at(np.array([x - centre]), np.array([y]))[0]
        return row


def railseats(track: Track) -> FloatArray:
    """Railseats along a cell, m: the middles of its bays, shape (bays,)."""
    return (np.arange(track.bays, dtype=np.float64) + 0.5) * track.fastening.spacing


def build_cell(track: Track, parity: int, points: FloatArray | None = None) -> Cell:
    """Assemble one cell.

    Parameters
    ----------
    track : Track
        Parameters.
    parity : int
        EVEN: both rails loaded alike; ODD: opposite.
    points : array, optional
        Rail positions in the cell (m) that get a node of their own: between the nodes of the
        regular mesh a point load finds the element too stiff by its own local flexibility, some
        per cent of the receptance at 1 kHz.

    Returns
    -------
    Cell
    """
    nodes = _nodes(track, points)
    M_e, K_e = element_matrices(track.rail, np.diff(nodes))
    plate = (
        free_plate_modes(track.slab, parity, track.mesh.highest_slab_frequency)
        if track.slab.present
        else None
    )
    n_rail, n_plate = 2 * nodes.size, plate.omega.size if plate else 0
    size = n_rail + n_plate
    M, C, K, K_loss = (np.zeros((size, size)) for _ in range(4))
    M[:n_rail, :n_rail], K[:n_rail, :n_rail] = assemble(M_e), assemble(K_e)
    K_loss += track.rail.loss_factor * K
    _add_slab(M, C, K, track, plate, n_rail)
    stretch = _fastening_stretch(track, plate, nodes, size)
    fastening = track.fastening
    K += fastening.stiffness * stretch.T @ stretch
    C += fastening.damping * stretch.T @ stretch
    K_loss += fastening.loss_factor * fastening.stiffness * stretch.T @ stretch
    return Cell(
        M=M, C=C, K=K, K_loss=K_loss, nodes=nodes, parity=parity, track=track, plate=plate
    )  # fmt: skip


def _nodes(track: Track, points: FloatArray | None) -> FloatArray:
    """Regular nodes, railseats among them, and the extra points."""
    regular = np.linspace(0, track.cell_length, track.bays * track.mesh.elements_per_bay + 1)
    if points is None:
        return regular
    extra = [x for x in np.unique(points) if np.min(np.abs(regular - x)) > NODE_TOLERANCE]
    return np.sort(np.concatenate([regular, extra]))


def _add_slab(
    M: FloatArray, C: FloatArray, K: FloatArray, track: Track, plate: PlateModes | None, first: int
) -> None:
    """Half a slab (one rail's share) on its foundation; the modes stay uncoupled on it."""
    if plate is None:
        return
    index = np.arange(first, first + plate.omega.size)
    per_mass = 1 / track.slab.mass_per_area
    M[index, index] = 0.5
    K[index, index] = 0.5 * (plate.omega**2 + track.foundation.series_stiffness * per_mass)
    C[index, index] = 0.5 * track.foundation.damping * per_mass


def _fastening_stretch(
    track: Track, plate: PlateModes | None, nodes: FloatArray, size: int
) -> FloatArray:
    """Rows giving rail minus slab deflection at every railseat, shape (bays, size)."""
    seats = railseats(track)
    stretch = np.zeros((seats.size, size))
    at = np.argmin(np.abs(nodes[None, :] - seats[:, None]), axis=1)
    stretch[np.arange(seats.size), 2 * at] = 1.0
    if plate is not None:
        side = np.full(seats.size, track.rail.lateral_distance / 2)
        stretch[:, 2 * nodes.size :] = -plate.at(seats - track.cell_length / 2, side)
    return stretch


__all__ = ["EVEN", "ODD", "Cell", "build_cell", "railseats"]
