"""The reduced model of the track: modes of the ring below a frequency, and what they leave out.

It is all arrays, so that an FMU can carry it and step it without the finite elements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .cell import EVEN, ODD, Cell, build_cell
from .parameters import Track
from .receptance import Point, direct_receptance
from .ring import RingModes, ring_modes

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

FIT_FROM, FIT_TO = 0.1, 0.5  # of the highest frequency kept: where the residual's inertia shows
LEAST_DAMPING = 1e-3  # ratio of the residual's pole, should the fit find none


@dataclass(frozen=True, kw_only=True)
class ReducedTrack:
    """Modes of both parities, tabulated along the rail of one cell, and one residual.

    Attributes
    ----------
    poles : array, shape (n,)
        rad/s, one of each conjugate pair.
    mu : array, shape (n,)
        Phase of a mode from cell to cell, rad.
    partner : array of int, shape (n,)
        Mode whose shape receives the force, see `RingModes`.
    parity : array, shape (n,)
        1 where both rails move alike, -1 where they move oppositely.
    nodes : array, shape (n_nodes,)
        Along the cell, both ends included, m.
    w, theta : array, shape (n_nodes, n)
        Deflection and rotation of the LEFT rail at the nodes, for a unit force on one rail.
    phi : float
        Shear parameter of the elements between the nodes.
    residual_pole : complex
        Pole of the local flexibility of the modes left out, rad/s.
    residual_compliance : float
        Its static value, m/N; the same at every point and on both rails.
    cell_length, length : float
        Of a cell and of the ring, m.
    """

    poles: ComplexArray
    mu: FloatArray
    partner: NDArray[np.intp]
    parity: FloatArray
    nodes: FloatArray
    w: ComplexArray
    theta: ComplexArray
    phi: float
    residual_pole: complex
    residual_compliance: float
    cell_length: float
    length: float


def reduce_track(track: Track) -> ReducedTrack:
    """Reduce a track to its modes below `track.mesh.highest_frequency` and a residual.

    The residual is the local flexibility of the modes left out. It does not depend on the place
    (all of them are short waves of the rail alone), so it is one oscillator under every wheel,
    which keeps the rail's deflection a state: no force passes straight through, and no algebraic
    loop closes over a stiff contact.

    Parameters
    ----------
    track : Track
        Parameters; loss factors count as viscous damping at `loss_factor_frequency`.

    Returns
    -------
    ReducedTrack
    """
    cells = [build_cell(track, parity) for parity in (EVEN, ODD)]
    modes = [ring_modes(cell, track.mesh.highest_frequency) for cell in cells]
    nodes = cells[0].nodes
    compliance, pole = _residual(track, cells, modes)
    sizes = [m.poles.size for m in modes]
    # A force on one rail is half an even and half an odd one: sqrt(1/2) into shapes that are
    # used twice, receiving the force and giving the deflection.
    shapes = np.sqrt(0.5) * np.concatenate([m.shapes[: 2 * nodes.size] for m in modes], axis=1)
    element = track.cell_length / (nodes.size - 1)
    return ReducedTrack(
        poles=np.concatenate([m.poles for m in modes]),
        mu=np.concatenate([m.mu for m in modes]),
        partner=np.concatenate([modes[0].partner, modes[1].partner + sizes[0]]),
        parity=np.repeat([1.0, -1.0], sizes),
        nodes=nodes,
        w=shapes[0::2],
        theta=shapes[1::2],
        phi=12 * track.rail.bending_stiffness / (track.rail.shear_stiffness * element**2),
        residual_pole=pole,
        residual_compliance=compliance,
        cell_length=track.cell_length,
        length=track.length,
    )


def _residual(
    track: Track, cells: list[Cell], modes: list[RingModes]
) -> tuple[float, complex]:
    """Static compliance and pole of the modes left out, from the direct receptance.

    Fits R0 / R(omega) = 1 + i omega d - (omega / omega_r)^2 by least squares.
    """
    seat = track.fastening.spacing / 2
    places = seat + track.fastening.spacing * np.array([0.0, 0.25, 0.5])
    top = 2 * np.pi * track.mesh.highest_frequency
    omega = np.concatenate([[0.0], np.linspace(FIT_FROM, FIT_TO, 8) * top])
    residual = np.empty((omega.size, places.size), dtype=complex)
    for k, x in enumerate(places):
        point = Point(x=float(x))
        total = direct_receptance(track, omega, [point], [point])[:, 0, 0]
        residual[:, k] = total - _modal_receptance(cells, modes, omega, float(x))
    R0 = float(residual[0].real.mean())
    R, w = residual[1:], omega[1:, None]
    inertia = np.vdot(R * w**2, R - R0).real / np.vdot(R * w**2, R * w**2).real
    lossy = np.vdot(1j * R * w, R0 - R).real / np.vdot(R * w, R * w).real
    omega_r = 1 / np.sqrt(inertia)
    zeta = max(0.5 * lossy * omega_r, LEAST_DAMPING)
    return R0, complex(-zeta * omega_r, omega_r * np.sqrt(1 - zeta**2))


def _modal_receptance(
    cells: list[Cell], modes: list[RingModes], omega: FloatArray, x: float
) -> ComplexArray:
    out = np.zeros(omega.size, dtype=complex)
    for cell, ring in zip(cells, modes, strict=True):
        shape = (cell.rail_row(x) @ ring.shapes)[None, :]
        out += 0.5 * ring.receptance(omega, shape, shape)[:, 0, 0]
    return out
