"""Vehicle, contacts and the whole ring of track as ONE set of sparse matrices.

The answer that every coupled result is held against. Of the track it shares the rail element, the
plate modes and the parameters with the FMUs, and nothing else: no Bloch waves, no symmetry, no
modes of the ring, no reduction.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from railcosim.mechanics.shape_functions import shape_functions
from railcosim.track.cell import EVEN, NODE_TOLERANCE, ODD, railseats
from railcosim.track.decay import check_ring
from railcosim.track.parameters import Track
from railcosim.track.rail import element_matrices
from railcosim.track.slab import PlateModes, free_plate_modes
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True)
class Monolithic:
    """M, C, K of everything, contacts apart.

    The unknowns are the vehicle's coordinates, [w, theta] at the nodes of the left rail and of the
    right one, then the slabs' modes. Contacts are those of the left wheels from the front, then
    those of the right ones.

    Attributes
    ----------
    M, C, K, K_loss : sparse array, shape (n, n)
        Mass, viscous damping, stiffness, hysteretic part (complex stiffness K + i K_loss).
    wheels : sparse array, shape (n_contacts, n)
        Wheel displacements.
    nodes : array
        Rail nodes round the ring, m.
    track : Track
        Its parameters.
    load : array, shape (n_contacts,)
        Static load of each wheel, N.
    coordinates : tuple of str
        Of the vehicle.
    """

    M: sparse.csc_array
    C: sparse.csc_array
    K: sparse.csc_array
    K_loss: sparse.csc_array
    wheels: sparse.csr_array
    nodes: FloatArray
    track: Track
    load: FloatArray
    coordinates: tuple[str, ...]

    def coordinate(self, name: str) -> int:
        """Place of a vehicle coordinate among the unknowns."""
        return self.coordinates.index(name)

    def rails(self, position: FloatArray) -> sparse.csr_array:
        """Rail deflections under wheelsets at their positions, as rows, shape (n_contacts, n)."""
        x = np.asarray(position) % self.track.length
        ends = np.append(self.nodes, self.track.length)
        e = np.searchsorted(ends, x + NODE_TOLERANCE, side="right") - 1
        e = np.clip(e, 0, self.nodes.size - 1)
        length = ends[e + 1] - ends[e]
        rail = self.track.rail
        phi = 12 * rail.bending_stiffness / (rail.shear_stiffness * length**2)
        N_w, _ = shape_functions((x - ends[e]) / length, length, phi)
        columns = np.concatenate([_rail_columns(self, e, side) for side in (0, 1)])
        rows = np.repeat(np.arange(2 * x.size), 4)
        entries = np.concatenate([N_w, N_w]).ravel()
        return sparse.csr_array(
            (entries, (rows, columns.ravel())), shape=(2 * x.size, self.K.shape[0])
        )


def _rail_columns(mono: Monolithic, e: NDArray[np.intp], side: int) -> NDArray[np.intp]:
    n = mono.nodes.size
    first = len(mono.coordinates) + 2 * n * side
    after = (e + 1) % n
    return first + np.stack([2 * e, 2 * e + 1, 2 * after, 2 * after + 1], axis=1)


def assemble(vehicle: Vehicle | Train, track: Track, position: FloatArray) -> Monolithic:
    """Assemble the whole system.

    Parameters
    ----------
    vehicle, track : Vehicle or Train, Track
        Parameters.
    position : array, shape (n_wheelsets,)
        Wheelset positions (m) that get a rail node, so that the loaded elements are exact there.

    Raises
    ------
    ParameterError
        If the vehicle meets itself through the ring.

    Warns
    -----
    RingWarning
        If the ring is too short for what `railcosim.track.decay` promises.
    """
    body = build_multibody(vehicle)
    check_ring(track, float(np.ptp(body.wheelset_x)))
    plates = (
        [free_plate_modes(track.slab, p, track.mesh.highest_slab_frequency) for p in (EVEN, ODD)]
        if track.slab.present
        else []
    )
    nodes = _ring_nodes(track, np.asarray(position) % track.length)
    M_r, K_r = _rail_ring(track, nodes)
    cells = track.mesh.cells
    omega = np.concatenate([p.omega for p in plates]) if plates else np.empty(0)
    omega = np.tile(omega, cells)
    per_mass = 1 / track.slab.mass_per_area
    eye = sparse.eye_array(omega.size)
    M = sparse.block_diag([body.M, M_r, M_r, eye])
    K = sparse.block_diag(
        [
            body.K,
            K_r,
            K_r,
            sparse.diags_array(omega**2 + track.foundation.series_stiffness * per_mass),
        ]
    )
    C = sparse.block_diag([body.C, 0 * M_r, 0 * M_r, track.foundation.damping * per_mass * eye])
    zero = sparse.csr_array(body.K.shape)
    K_loss = track.rail.loss_factor * sparse.block_diag([zero, K_r, K_r, 0 * eye])
    stretch = _stretch(track, nodes, plates, len(body.coordinates), M.shape[0])
    springs = stretch.T @ stretch
    f = track.fastening
    return Monolithic(
        M=M.tocsc(),
        C=(C + f.damping * springs).tocsc(),
        K=(K + f.stiffness * springs).tocsc(),
        K_loss=(K_loss + f.loss_factor * f.stiffness * springs).tocsc(),
        wheels=sparse.vstack(2 * [sparse.eye_array(*M.shape, format="csr")[body.wheelsets]]),
        nodes=nodes,
        track=track,
        load=np.tile(body.wheel_load, 2),
        coordinates=body.coordinates,
    )


def _ring_nodes(track: Track, extra: FloatArray) -> FloatArray:
    n = track.mesh.cells * track.bays * track.mesh.elements_per_bay
    regular = np.arange(n) * (track.length / n)
    ends = np.append(regular, track.length)
    new = [x for x in np.unique(extra) if np.min(np.abs(ends - x)) > NODE_TOLERANCE]
    return np.sort(np.concatenate([regular, new]))


def _rail_ring(track: Track, nodes: FloatArray) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Mass and stiffness of one rail closed into a ring."""
    n = nodes.size
    M_e, K_e = element_matrices(track.rail, np.diff(np.append(nodes, track.length)))
    e, after = np.arange(n), (np.arange(n) + 1) % n
    dofs = np.stack([2 * e, 2 * e + 1, 2 * after, 2 * after + 1], axis=1)
    rows, columns = np.repeat(dofs, 4, axis=1).ravel(), np.tile(dofs, (1, 4)).ravel()
    M, K = (
        sparse.csr_array((A.ravel(), (rows, columns)), shape=(2 * n, 2 * n)) for A in (M_e, K_e)
    )
    return M, K


def _stretch(
    track: Track, nodes: FloatArray, plates: list[PlateModes], first: int, size: int
) -> sparse.csr_array:
    """Stretch of every fastening, left rail first: rail minus slab, shape (n_fastenings, size).

    The rails' unknowns begin at `first`.
    """
    seats, cells, n = railseats(track), track.mesh.cells, nodes.size
    x = (np.arange(cells)[:, None] * track.cell_length + seats).ravel()
    at = np.argmin(np.abs(nodes[None, :] - x[:, None]), axis=1)
    first_slab = first + 4 * n
    blocks = []
    for side in (0, 1):
        rail = sparse.csr_array(
            (np.ones(x.size), (np.arange(x.size), first + 2 * n * side + 2 * at)),
            shape=(x.size, first_slab),
        )
        y = np.full(seats.size, (2 * side - 1) * track.rail.lateral_distance / 2)
        psi = np.concatenate(
            [p.at(seats - track.cell_length / 2, y) for p in plates], axis=1
        ) if plates else np.empty((seats.size, 0))  # fmt: skip
        slabs = sparse.kron(sparse.eye_array(cells), -psi)
        blocks.append(sparse.hstack([rail, slabs.reshape((x.size, size - first_slab))]))
    return sparse.vstack(blocks).tocsr()


def frequency_response(
    mono: Monolithic,
    omega: FloatArray,
    k_H: float | FloatArray,
    position: FloatArray,
    loads: FloatArray,
    progress: Callable[[int, int], None] | None = None,
) -> ComplexArray:
    """All displacements under harmonic loads, one direct solve a frequency.

    Parameters
    ----------
    mono : Monolithic
        The system.
    omega : array, shape (n_omega,)
        rad/s.
    k_H : float or array, shape (n_contacts,)
        Contact stiffness of all or of each, N/m; 0 leaves vehicle and track apart.
    position : array, shape (n_wheelsets,)
        Of the wheelsets, m.
    loads : array, shape (n, n_loads) or (n_omega, n, n_loads)
        Force amplitudes, N.
    progress : callable, optional
        Called with (done, total).

    Returns
    -------
    array, shape (n_omega, n, n_loads)
        Complex amplitudes.
    """
    compression = mono.wheels - mono.rails(position)
    stiffness = np.broadcast_to(k_H, compression.shape[:1])
    K = mono.K + 1j * mono.K_loss + compression.T @ (sparse.diags_array(stiffness) @ compression)
    out = np.empty((len(omega), K.shape[0], loads.shape[-1]), dtype=complex)
    for k, w in enumerate(omega):
        D = (K + 1j * w * mono.C - w**2 * mono.M).tocsc()
        load = loads if loads.ndim == 2 else loads[k]
        out[k] = splu(D).solve(load.astype(complex))
        if progress:
            progress(k + 1, len(omega))
    return out
