"""What faded modes of a track leave out: a local flexibility, as oscillators under every wheel.

In each direction one, whose pole is that of the whole track. They are coupled at a place by their
shapes: the last direction's oscillator moves those before, as a rail that twists moves its head.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Direction

from .cell import Cell
from .parameters import Track
from .receptance import Point, direct_receptance
from .ring import RingModes
from .section import Bar

Directions = tuple[Direction, ...]

FIT_FROM, FIT_TO = 0.1, 0.4  # of the highest frequency kept: where the residual's inertia shows
LEAST_DAMPING, MOST_DAMPING = 1e-3, 0.9  # ratio of the residual's pole, whatever the fit finds
TRIFLE = 1e-6  # of a flexibility: rounding, to be left out as if it were there
MOSTLY_ELASTIC = 0.1  # imaginary by real part of what is left out
HIGHEST_POLE = 10.0  # of the residual, in highest frequencies kept
RIPPLES = 5.0  # m: those of the modes fade with distance
OTHERS, APART = 3, 1.5  # other wheelsets, and m to the next one; bogies have 1.8 m or more


def head_shapes(cell: Cell, ring: RingModes, directions: Directions) -> ComplexArray:
    """Motion and slope of the modes at the head of the left rail, (n_nodes, 2 k, n).

    Direction by direction. The slope is the rotation and the shear angle, which is one in each
    element: the mean of both sides. With the elements' own interpolation a rolling wheel would feel
    a kink at every node, of up to half the largest slope, and between nodes the receptance would be
    wrong by 2.5 % at 1 kHz.
    """
    section, d = cell.section, cell.section.size
    nodal = ring.shapes[: cell.rail_size].reshape(-1, d, ring.poles.size)
    L, turn = np.diff(cell.nodes)[:, None], np.exp(1j * ring.mu)  # the cell before, the cell behind
    out = np.zeros((cell.nodes.size, len(directions), 2, ring.poles.size), dtype=complex)
    parts = [section.deflections(n, 0.0, -cell.track.rail.head_height) for n in directions]
    for i, member in enumerate(section.members):
        first = section.element_unknowns(i)[0]
        w = nodal[:, first]
        if isinstance(member, Bar):
            constant, turned = np.diff(w, axis=0) / L, np.zeros_like(w)
        else:
            theta, phi = nodal[:, first + 1], member.softness(L)
            mean = (theta[:-1] + theta[1:]) / 2
            constant, turned = phi / (1 + phi) * (np.diff(w, axis=0) / L - mean), theta
        around = np.concatenate([constant[-1:] / turn, constant, constant[:1] * turn])
        slope = turned + (around[:-1] + around[1:]) / 2
        for k, direction in enumerate(directions):
            if parts[k][i]:
                part = direction.mirror * parts[k][i]
                out[:, k] += part * np.stack([w, slope], axis=1)
    return out.reshape(cell.nodes.size, -1, ring.poles.size)


def residual(
    track: Track, cells: list[Cell], modes: list[RingModes], directions: Directions
) -> tuple[ComplexArray, ComplexArray]:
    """Poles of the residual, (k,), and its shapes at every node of the cell, (n_nodes, k, k).

    What is left out is nearly (R0 + tau s) / (1 + d s + s^2 / omega_r^2) for each oscillator. R0
    and tau differ from place to place; omega_r, by least squares, and d do not.

    Complete, a track answers an impulse with a motion that begins at 0. Some of its complex modes
    alone begin with a jump, and at a damped railseat against the force: above their frequencies the
    rail would give power to what rests on it. The residual jumps by tau omega_r^2, which must make
    up for it. And it must take no less power than what is left out: where waves run between wheels
    undamped, their powers nearly cancel. The d taken is the least that allows both.

    Directions are taken apart first. What dampers at the foot still couple is carried by bending's
    oscillator: with the pole of torsion, a lower one, the same jump would give power at the
    railseats near 3.5 kHz.
    """
    top = 2 * np.pi * track.mesh.highest_frequency
    omega = np.concatenate([[0.0], np.linspace(FIT_FROM, FIT_TO, 8) * top])
    motions = [
        head_shapes(c, ring, directions)[:, ::2] for c, ring in zip(cells, modes, strict=True)
    ]
    left_out, whole = left_out_by(track, cells[0].nodes, motions, modes, directions, omega)
    apart = Apart.of(left_out[0].real, whole)
    N, w, k = apart.seen(left_out), omega[1:, None], len(directions)
    static = np.diagonal(apart.static, axis1=1, axis2=2)
    missing = _missing_jumps(track, cells, modes, directions, apart)
    poles, slope = np.empty(k, complex), np.zeros_like(apart.static)  # of the imaginary part
    for j in range(k):
        omega_r = natural(N[:, :, j, j], apart.known[:, j], w, top)
        falls = 1 - (w / omega_r) ** 2
        loss = np.max(-N[1:, :, j, j].imag / w * falls, axis=0)
        needed = missing[:, :, j, j].max(axis=0) / omega_r**2
        # With tau below d R0 - loss, the residual takes no less power than what is left out.
        d = np.max(needed + loss) / np.max(static[:, j])
        zeta = np.clip(0.5 * d * omega_r, LEAST_DAMPING, MOST_DAMPING)
        poles[j] = omega_r * complex(-zeta, np.sqrt(1 - zeta**2))
        slope[:, j, j] = -loss
        for i in range(j + 1, k):
            slope[:, i, j] = slope[:, j, i] = np.mean(N[1:, :, i, j].imag / w * falls, axis=0)
    jump, size = _jumps(slope, apart.static, poles), np.sqrt(np.max(static, axis=0))
    for least in missing:
        jump = at_least(jump, least, size)
    return poles, apart.U @ _shapes(jump, apart.static, poles)


def _around(at_places: FloatArray) -> FloatArray:
    """Values at nodes and midway between as those behind, at and before every node, (3, nodes)."""
    ends = np.concatenate([at_places[:1], at_places, at_places[-1:]])
    return np.stack([ends[:-2:2], ends[1:-1:2], ends[2::2]])


def at_least(J: FloatArray, least: FloatArray, size: FloatArray) -> FloatArray:
    """Symmetric matrices raised where they lie below others; `size` is that of coordinates."""
    unit = np.outer(size, size)
    value, vector = np.linalg.eigh((least - J) / unit)
    raised = (vector * np.maximum(value, 0)[:, None, :]) @ np.swapaxes(vector, 1, 2)
    above: FloatArray = J + raised * unit
    return above


@dataclass(frozen=True)
class Apart:
    """Coordinates in which the directions' flexibilities are apart on average: R0 = U static U'.

    A rail's head is moved sideways by its twist, most of all; what its own bending adds is damped
    far less, and that must not be drowned.

    Attributes
    ----------
    U : array, shape (k, k)
        Ones on the diagonal, and beside it what the later direction moves of the earlier one.
    static : array, shape (n_nodes, k, k)
        What is left out at rest, or a trifle.
    known : array, shape (n_nodes, k)
        Whether it is more: a mesh may have no modes above the highest frequency kept.
    """

    U: FloatArray
    static: FloatArray
    known: NDArray[np.bool_]

    @classmethod
    def of(cls, R0: FloatArray, whole: FloatArray) -> Apart:
        """Of what is left out at rest and of all, (n_nodes, k, k)."""
        rest = R0.mean(axis=0)
        U = np.eye(len(rest))
        for j in reversed(range(len(rest))):
            U[:j, j] = rest[:j, j] / max(rest[j, j], TRIFLE * whole[:, j, j].mean())
            rest = rest - rest[j, j] * np.outer(U[:, j], U[:, j])
        back = np.linalg.inv(U)
        static, diagonal = back @ R0 @ back.T, np.arange(len(U))
        trifle = TRIFLE * (back @ whole @ back.T)[:, diagonal, diagonal]
        # Fading modes may leave out less than nothing at a railseat that is all but clamped. An
        # oscillator of negative flexibility would give power at its resonance.
        known = static[:, diagonal, diagonal] > trifle
        static = static * (known[:, :, None] & known[:, None, :])
        static[:, diagonal, diagonal] = np.where(known, static[:, diagonal, diagonal], trifle)
        return cls(U, static, known)

    def seen(self, R: ComplexArray) -> ComplexArray:
        """Receptances, (..., k, k), in these coordinates."""
        apart: ComplexArray = self.back @ R @ self.back.T
        return apart

    @property
    def back(self) -> FloatArray:
        """Inverse of U."""
        return np.linalg.inv(self.U).astype(float)


def natural(N: ComplexArray, known: NDArray[np.bool_], w: FloatArray, top: float) -> float:
    """Natural frequency of an oscillator like this flexibility, static first; rad/s.

    Told by the nodes where damping does not decide.
    """
    if not known.any():
        return top
    elastic = np.max(np.abs(N.imag), axis=0) < MOSTLY_ELASTIC * np.max(np.abs(N.real), axis=0)
    told = elastic & known if (elastic & known).any() else known
    R, R0 = N[1:, told], N[0, told].real
    inertia = np.vdot(R * w**2, R - R0).real / np.vdot(R * w**2, R * w**2).real
    return float(1 / np.sqrt(max(inertia, 1 / (HIGHEST_POLE * top) ** 2)))


def _jumps(slope: FloatArray, static: FloatArray, poles: ComplexArray) -> FloatArray:
    """Jumps after an impulse of oscillators with given flexibilities, all (n_nodes, k, k).

    An oscillator (R0 + tau s) / (1 + d s + s^2 / omega^2) has the slope tau - d R0.
    """
    jump = np.zeros_like(slope)
    for j, pole in enumerate(poles):
        omega2, d = abs(pole) ** 2, -2 * pole.real / abs(pole) ** 2
        own = (slope[:, j:, j] + d * static[:, j:, j]) * omega2
        jump[:, j:, j] += own
        jump[:, j, j:] = jump[:, j:, j]
        carried = _carried(_column(own, static[:, j:, j], pole))[:, 1:, 1:]
        held = -(carried / pole).real
        rest = (..., slice(j + 1, None), slice(j + 1, None))
        slope, static = slope.copy(), static.copy()
        jump[rest] += carried.real
        slope[rest] -= carried.real / omega2 - d * held
        static[rest] -= held
    return jump


def _shapes(jump: FloatArray, static: FloatArray, poles: ComplexArray) -> ComplexArray:
    """Shapes U with the jump Re(U U') and the static flexibility -Re(U / poles U'), all (n, k, k).

    The first oscillator carries all of its direction, the next what is left.
    """
    U = np.zeros(jump.shape, dtype=complex)
    for j, pole in enumerate(poles):
        U[:, j:, j] = _column(jump[:, j:, j], static[:, j:, j], pole)
        carried = _carried(U[:, :, j])
        jump, static = jump - carried.real, static + (carried / pole).real
    return U


def _column(jump: FloatArray, static: FloatArray, pole: complex) -> ComplexArray:
    """Shape of an oscillator that carries the first direction, from that one's column, (n, j)."""
    residue = jump - 1j * (static * abs(pole) ** 2 + jump * pole.real) / pole.imag
    own = np.sqrt(residue[:, :1])
    shape: ComplexArray = np.concatenate([own, residue[:, 1:] / own], axis=1)
    return shape


def _carried(shape: ComplexArray) -> ComplexArray:
    return shape[:, :, None] * shape[:, None, :]


def left_out_by(
    track: Track,
    nodes: FloatArray,
    motions: list[ComplexArray],
    modes: list[RingModes],
    directions: Directions,
    omega: FloatArray,
) -> tuple[ComplexArray, FloatArray]:
    """Finite elements less modes, at every node for forces there, (n_omega, n_nodes, k, k).

    And the finite elements at rest, (n_nodes, k, k). `motions` are those of the modes, of either
    parity (n_nodes, k, n).
    """
    k = len(directions)
    points = [Point(x=float(x), direction=d) for x in nodes for d in directions]
    total = direct_receptance(track, omega, points, points, viscous=True)
    same = np.arange(nodes.size)
    total = total.reshape(omega.size, nodes.size, k, nodes.size, k)
    left_out: ComplexArray = np.moveaxis(total[:, same, :, same], 0, 1).copy()
    whole = left_out[0].real.copy()
    s = 1j * omega[:, None]
    for w, ring in zip(motions, modes, strict=True):
        for i in range(k):
            for j in range(k):
                residue = w[:, i] * w[:, j][:, ring.partner]
                for p, r in ((ring.poles, residue), (ring.poles.conj(), residue.conj())):
                    left_out[:, :, i, j] -= 0.25 * (1 / (s - p)) @ r.T
    return left_out, whole


def _missing_jumps(
    track: Track,
    cells: list[Cell],
    modes: list[RingModes],
    directions: Directions,
    apart: Apart,
) -> FloatArray:
    """What the residual must jump by at least after an impulse, m/(N s), (6, n_nodes, k, k).

    Less the modes' own motion at once under the wheel that is pushed, and what all other wheels may
    take of each coordinate (Gershgorin): as many as a vehicle has, where they answer most. The two
    of a wheelset are pushed alike or oppositely. At every node, and midway to those beside.
    """
    nodes, k = cells[0].nodes, len(directions)
    places = np.linspace(0, track.cell_length, 2 * nodes.size - 1)
    size = np.sqrt(np.max(np.diagonal(apart.static, axis1=1, axis2=2), axis=0))
    cells_near = int(np.ceil(RIPPLES / track.cell_length - 1e-9))
    missing = []
    for cell, ring in zip(cells, modes, strict=True):
        shape = head_shapes(cell, ring, directions)
        w, slope = shape[:, ::2], shape[:, 1::2]
        along = np.empty((places.size, k, ring.poles.size), dtype=complex)
        L = np.diff(nodes)[:, None, None]
        along[::2] = w
        along[1::2] = (w[:-1] + w[1:]) / 2 + L / 8 * (slope[:-1] - slope[1:])
        along, w = apart.back @ along, apart.back @ w
        own, others = np.empty((places.size, k, k)), np.zeros((places.size, k))
        for i in range(k):
            for j in range(k):
                own[:, i, j] = np.sum(along[:, i] * along[:, j][:, ring.partner], axis=1).real
        two = w[:, :, ring.partner].reshape(-1, ring.poles.size)
        for c in range(-cells_near, cells_near + 1):
            one = (along * np.exp(1j * ring.mu * c)).reshape(-1, ring.poles.size)
            J = np.abs((one @ two.T).real).reshape(places.size, k, nodes.size, k)
            far = np.abs(places[:, None] + c * track.cell_length - nodes) > APART
            most = np.max(J * far[:, None, :, None], axis=2)
            others = np.maximum(others, (most * size[:, None] / size).sum(axis=2))
        missing.append(_around(OTHERS * others[:, :, None] * np.eye(k) - own))
    return np.concatenate(missing)
