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

FADE_FROM = 0.6  # of the highest frequency kept; modes below count in full
FIT_FROM, FIT_TO = 0.1, 0.4  # of it: where the residual's inertia shows
FIT_PLACES = (0.0, 0.25, 0.5)  # of the spacing from a railseat
LEAST_DAMPING, MOST_DAMPING = 1e-3, 0.9  # ratio of the residual's pole, whatever the fit finds
HIGHEST_POLE = 10.0  # of the residual, in highest frequencies kept


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
        Deflection and rotation of the LEFT rail at the nodes, for a unit force on one rail;
        numbers of single precision.
    phi : float
        Shear parameter of the elements between the nodes.
    residual_pole : complex
        Pole of the local flexibility of the modes left out, rad/s.
    residual_compliance : array, shape (n_nodes,)
        Its static value at the nodes, m/N, for the force on the same rail at the same place.
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
    residual_compliance: FloatArray
    cell_length: float
    length: float


def reduce_track(track: Track) -> ReducedTrack:
    """Reduce a track to its modes below `track.mesh.highest_frequency` and a residual.

    Modes fade out over a band of frequencies. Cut off at once, what is left out would reach along
    the rail as slowly fading ripples that outweigh the true response 10 m away; faded out, it is
    local: the flexibility of short waves of the rail, hardly dependent on the place. It becomes one
    oscillator under every wheel, which keeps the rail's deflection a state: no force passes
    straight through, and no algebraic loop closes over a stiff contact.

    Parameters
    ----------
    track : Track
        Parameters; loss factors count as viscous damping at `loss_factor_frequency`.

    Returns
    -------
    ReducedTrack
    """
    cells = [build_cell(track, parity) for parity in (EVEN, ODD)]
    top = track.mesh.highest_frequency
    modes = [_faded(ring_modes(cell, top), 2 * np.pi * top) for cell in cells]
    nodes = cells[0].nodes
    compliance = _residual_compliance(track, cells, modes)
    pole = _residual_pole(track, cells, modes)
    sizes = [m.poles.size for m in modes]
    # A force on one rail is half an even and half an odd one: sqrt(1/2) into shapes that are
    # used twice, receiving the force and giving the deflection.
    shapes = np.sqrt(0.5) * np.concatenate([m.shapes[: 2 * nodes.size] for m in modes], axis=1)
    # Half as much to store, and to read in every step, for 1e-7 of the receptance.
    shapes = shapes.astype(np.complex64).astype(complex)
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


def _faded(modes: RingModes, top: float) -> RingModes:
    """Weigh modes by cos^2 falling from 1 at `FADE_FROM * top` (rad/s) to 0 at `top`."""
    part = np.clip((np.abs(modes.poles) / top - FADE_FROM) / (1 - FADE_FROM), 0, 1)
    return modes.weighted(np.cos(0.5 * np.pi * part) ** 2)


def _residual_compliance(track: Track, cells: list[Cell], modes: list[RingModes]) -> FloatArray:
    """Static flexibility of what the modes leave out, at every node of the cell, (n_nodes,)."""
    points = [Point(x=float(x)) for x in cells[0].nodes]
    total = np.diagonal(direct_receptance(track, np.zeros(1), points, points, viscous=True)[0]).real
    by_modes = np.zeros_like(total)
    for cell, ring in zip(cells, modes, strict=True):
        w = ring.shapes[0 : cell.rail_size : 2]
        by_modes += 0.5 * (w * w[:, ring.partner] @ (-1 / ring.poles)).real
    residual: FloatArray = total - by_modes
    return residual


def _residual_pole(track: Track, cells: list[Cell], modes: list[RingModes]) -> complex:
    """Pole of the residual, from how what is left out changes with frequency.

    Fits R0 / R(omega) = 1 + i omega d - (omega / omega_r)^2 by least squares.
    """
    seat = track.fastening.spacing / 2
    top = 2 * np.pi * track.mesh.highest_frequency
    omega = np.concatenate([[0.0], np.linspace(FIT_FROM, FIT_TO, 8) * top])
    residual = np.empty((omega.size, len(FIT_PLACES)), dtype=complex)
    for k, place in enumerate(FIT_PLACES):
        x = seat + place * track.fastening.spacing
        point = Point(x=x)
        total = direct_receptance(track, omega, [point], [point], viscous=True)[:, 0, 0]
        residual[:, k] = total - _modal_receptance(cells, modes, omega, x)
    R0, R, w = residual[0].real, residual[1:], omega[1:, None]
    inertia = np.vdot(R * w**2, R - R0).real / np.vdot(R * w**2, R * w**2).real
    lossy = np.vdot(1j * R * w, R0 - R).real / np.vdot(R * w, R * w).real
    omega_r = 1 / np.sqrt(max(inertia, 1 / (HIGHEST_POLE * top) ** 2))
    zeta = np.clip(0.5 * lossy * omega_r, LEAST_DAMPING, MOST_DAMPING)
    return complex(-zeta * omega_r, omega_r * np.sqrt(1 - zeta**2))


def _modal_receptance(
    cells: list[Cell], modes: list[RingModes], omega: FloatArray, x: float
) -> ComplexArray:
    out = np.zeros(omega.size, dtype=complex)
    for cell, ring in zip(cells, modes, strict=True):
        shape = (cell.rail_row(x) @ ring.shapes)[None, :]
        out += 0.5 * ring.receptance(omega, shape, shape)[:, 0, 0]
    return out
