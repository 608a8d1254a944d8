"""The reduced model of the track: modes of the ring below a frequency, and what they leave out.

It is all arrays, so that an FMU can carry it and step it without the finite elements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d

from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import RAIL, Layout
from railcosim.mechanics.shapes import AlongRing

from .cell import EVEN, ODD, Cell, build_cell
from .parameters import Track
from .receptance import Point, direct_receptance
from .ring import RingModes, ring_modes

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

FADE_FROM = 0.6  # of the highest frequency kept; modes below count in full
FIT_FROM, FIT_TO = 0.1, 0.4  # of it: where the residual's inertia shows
LEAST_DAMPING, MOST_DAMPING = 1e-3, 0.9  # ratio of the residual's pole, whatever the fit finds
HIGHEST_POLE = 10.0  # of the residual, in highest frequencies kept
OTHERS, APART = 3, 1.5  # other wheelsets, and m to the next one; bogies have 1.8 m or more


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
    w, slope : array, shape (n_nodes, n)
        Deflection of the LEFT rail at the nodes and its slope dw/dx, for a unit force on one rail;
        numbers of single precision. Between nodes a deflection is Hermite's cubic.
    residual_pole : complex
        Pole of the local flexibility of the modes left out, rad/s.
    residual_shape : array, shape (n_nodes,)
        u at the nodes: ds/dt = pole s + u f, deflection Re(u s), for the force f on the same rail
        at the same place.
    cell_length, length : float
        Of a cell and of the ring, m.
    """

    poles: ComplexArray
    mu: FloatArray
    partner: NDArray[np.intp]
    parity: FloatArray
    nodes: FloatArray
    w: ComplexArray
    slope: ComplexArray
    residual_pole: complex
    residual_shape: ComplexArray
    cell_length: float
    length: float

    def under(self, layout: Layout) -> ModalBody:
        """The body that wheels meet at these ports: modes in a table, and an oscillator at each."""
        local = np.full(len(layout.ports), self.residual_pole)
        return ModalBody(
            layout=layout,
            face=RAIL,
            poles=np.concatenate([self.poles, local]),
            even=int((self.parity > 0).sum()),
            shapes=AlongRing(
                table=np.stack([self.w, self.slope], axis=1)[:-1].astype(np.complex64),
                mu=self.mu,
                partner=self.partner,
                local_table=self.residual_shape[:-1, None],
                cell_length=self.cell_length,
                cells=round(self.length / self.cell_length),
            ),
            rigid_out=np.zeros((layout.wheelsets, 0)),
            rigid_into=np.zeros((layout.wheelsets, 0)),
            preload=np.zeros(len(layout.ports)),
        )


def reduce_track(track: Track) -> ReducedTrack:
    """Reduce a track to its modes below `track.mesh.highest_frequency` and a residual.

    Modes fade out over a band of frequencies. Cut off at once, what is left out would reach along
    the rail as slowly fading ripples that outweigh the true response 10 m away; faded out, it is
    local: the flexibility of short waves of the rail, hardly dependent on the place. It becomes one
    oscillator under every wheel, which keeps the rail's deflection a state: no force passes
    straight through, and no algebraic loop closes over a stiff contact. With it the model is
    passive: at no frequency do wheels draw power from the track, however stiff their contacts.
    Not quite so where fastenings all but clamp the rail, with dampers of 2.5e6 N s/m, 100 times
    the default: there real poles among the fading modes still give some, near 0.9 of the highest
    frequency.

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
    pole, residual_shape = _residual(track, cells, modes)
    sizes = [m.poles.size for m in modes]
    pairs = zip(cells, modes, strict=True)
    shapes = np.concatenate([_along_the_rail(cell, ring) for cell, ring in pairs], axis=2)
    # A force on one rail is half an even and half an odd one: sqrt(1/2) into shapes that are
    # used twice, receiving the force and giving the deflection.
    # Half as much to store, and to read in every step, for 1e-7 of the receptance.
    w, slope = (np.sqrt(0.5) * shapes).astype(np.complex64).astype(complex)
    return ReducedTrack(
        poles=np.concatenate([m.poles for m in modes]),
        mu=np.concatenate([m.mu for m in modes]),
        partner=np.concatenate([modes[0].partner, modes[1].partner + sizes[0]]),
        parity=np.repeat([1.0, -1.0], sizes),
        nodes=nodes,
        w=w,
        slope=slope,
        residual_pole=pole,
        residual_shape=residual_shape,
        cell_length=track.cell_length,
        length=track.length,
    )


def _faded(modes: RingModes, top: float) -> RingModes:
    """Weigh modes by cos^2 falling from 1 at `FADE_FROM * top` (rad/s) to 0 at `top`."""
    part = np.clip((np.abs(modes.poles) / top - FADE_FROM) / (1 - FADE_FROM), 0, 1)
    return modes.weighted(np.cos(0.5 * np.pi * part) ** 2)


def _along_the_rail(cell: Cell, ring: RingModes) -> ComplexArray:
    """Deflection and slope of the modes at the nodes of a cell, (2, n_nodes, n).

    The slope is the rotation and the shear angle, which is one in each element: the mean of both
    sides. With the elements' own interpolation a rolling wheel would feel a kink at every node, of
    up to half the largest slope, and between nodes the receptance would be wrong by 2.5 % at 1 kHz.
    """
    rail, size = cell.track.rail, cell.rail_size
    w, theta = ring.shapes[0:size:2], ring.shapes[1:size:2]
    L = np.diff(cell.nodes)[:, None]
    phi = 12 * rail.bending_stiffness / (rail.shear_stiffness * L**2)
    shear = phi / (1 + phi) * (np.diff(w, axis=0) / L - (theta[:-1] + theta[1:]) / 2)
    turn = np.exp(1j * ring.mu)  # the cell before and the cell behind
    around = np.concatenate([shear[-1:] / turn, shear, shear[:1] * turn])
    return np.stack([w, theta + (around[:-1] + around[1:]) / 2])


def _residual(
    track: Track, cells: list[Cell], modes: list[RingModes]
) -> tuple[complex, ComplexArray]:
    """Pole of the residual, and its shape at every node of the cell, (n_nodes,).

    What is left out is nearly (R0 + tau s) / (1 + d s + s^2 / omega_r^2). R0 and tau differ from
    place to place; omega_r, by least squares, and d do not.

    Complete, a track answers an impulse with a deflection that begins at 0. Some of its complex
    modes alone begin with a jump, and at a damped railseat against the force: above their
    frequencies the rail would give power to what rests on it. The residual jumps by
    tau omega_r^2, which must make up for it. And it must take no less power than what is left out:
    where waves run between wheels undamped, their powers nearly cancel. The d taken is the least
    that allows both.
    """
    top = 2 * np.pi * track.mesh.highest_frequency
    omega = np.concatenate([[0.0], np.linspace(FIT_FROM, FIT_TO, 8) * top])
    left_out = _left_out(track, cells, modes, omega)
    R0, R, w = left_out[0].real, left_out[1:], omega[1:, None]
    inertia = np.vdot(R * w**2, R - R0).real / np.vdot(R * w**2, R * w**2).real
    omega_r = 1 / np.sqrt(max(inertia, 1 / (HIGHEST_POLE * top) ** 2))
    # With tau below d R0 - loss, the residual takes no less power than what is left out.
    loss = np.max(-R.imag / w * (1 - (w / omega_r) ** 2), axis=0)
    needed = -_least_jump(track, cells, modes) / omega_r**2
    d = np.max(needed + loss) / np.max(R0)
    zeta = np.clip(0.5 * d * omega_r, LEAST_DAMPING, MOST_DAMPING)
    tau = np.maximum(2 * zeta / omega_r * R0 - loss, needed)
    pole = omega_r * complex(-zeta, np.sqrt(1 - zeta**2))
    # Re(u^2 / (s - pole)) has the jump Re(u^2) and the static value -Re(u^2 / pole).
    jump = tau * omega_r**2
    shape: ComplexArray = np.sqrt(jump - 1j * (R0 * omega_r**2 + jump * pole.real) / pole.imag)
    return pole, shape


def _left_out(
    track: Track, cells: list[Cell], modes: list[RingModes], omega: FloatArray
) -> ComplexArray:
    """Finite elements less modes, at every node for the force there, (n_omega, n_nodes)."""
    points = [Point(x=float(x)) for x in cells[0].nodes]
    total = direct_receptance(track, omega, points, points, viscous=True)
    left_out: ComplexArray = np.diagonal(total, axis1=1, axis2=2).copy()
    s = 1j * omega[:, None]
    for cell, ring in zip(cells, modes, strict=True):
        w = ring.shapes[0 : cell.rail_size : 2]
        residue = w * w[:, ring.partner]
        for p, r in ((ring.poles, residue), (ring.poles.conj(), residue.conj())):
            left_out -= 0.25 * (1 / (s - p)) @ r.T
    return left_out


def _least_jump(track: Track, cells: list[Cell], modes: list[RingModes]) -> FloatArray:
    """Deflection of the modes at once after an impulse, at every node, (n_nodes,), m/(N s).

    The least eigenvalue (Gershgorin) for all wheels of a vehicle, one being at the node, the others
    where they answer most; the two of a wheelset are pushed alike or oppositely.
    """
    nodes = cells[0].nodes
    places = np.linspace(0, track.cell_length, 2 * nodes.size - 1)
    own, others = np.empty((2, places.size)), np.zeros((2, places.size))
    for k, (cell, ring) in enumerate(zip(cells, modes, strict=True)):
        w = ring.shapes[0 : cell.rail_size : 2]
        shape, slope = _along_the_rail(cell, ring)
        along = np.empty((places.size, ring.poles.size), dtype=complex)
        L = np.diff(nodes)[:, None]
        along[::2] = shape
        along[1::2] = (shape[:-1] + shape[1:]) / 2 + L / 8 * (slope[:-1] - slope[1:])
        own[k] = np.sum(along * along[:, ring.partner], axis=1).real
        for c in (-1, 0, 1):  # ripples of the modes fade with distance
            J = ((along * np.exp(1j * ring.mu * c)) @ w[:, ring.partner].T).real
            far = np.abs(places[:, None] + c * track.cell_length - nodes) > APART
            others[k] = np.maximum(others[k], np.max(np.abs(J) * far, axis=1))
    least = np.min(own - OTHERS * others, axis=0)
    around: FloatArray = minimum_filter1d(least, 3, mode="nearest")[::2]
    return around
