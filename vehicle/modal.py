"""Modal form of a free vehicle: rigid bodies apart, everything else as complex modes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig, null_space, qr
from scipy.sparse.csgraph import connected_components

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.contact.geometry import LEFT, Cone
from railcosim.mechanics.coordinates import Coordinates
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import ROLL, WHEEL, YAW, Direction, Layout, X, Y, Z
from railcosim.mechanics.shapes import Everywhere

from .multibody import Multibody

RIGID = 1e-10  # of the largest stretch: rounding is 1e-15, levers and masses differ by 1e2
CHECK_TOLERANCE = 1e-8  # two digits looser than the eigenproblem's usual rounding
LOPSIDED = 1e-10  # of what springs on one side alone would do: their sums round to 1e-15


@dataclass(frozen=True, kw_only=True)
class Modes:
    """x = rigid r + Re(modes s), r'' = rigid^T f, s' = poles s + left f.

    Attributes
    ----------
    rigid : array, shape (n, n_rigid)
        Mass-normalised rigid-body modes.
    poles : array, shape (m,)
        rad/s, one of each conjugate pair.
    modes : array, shape (n, m)
        Displacements per mode.
    left : array, shape (m, n)
        How forces on the coordinates drive the modes.
    state_of : array, shape (m, n)
        Modal state of a displacement at rest.
    """

    rigid: FloatArray
    poles: ComplexArray
    modes: ComplexArray
    left: ComplexArray
    state_of: ComplexArray


@dataclass(frozen=True, kw_only=True)
class ModalVehicle(Modes):
    """All `Modes` of a vehicle.

    Attributes
    ----------
    even, even_rigid : int
        How many modes, and rigid-body modes, are their own mirror images; these come first.
    """

    even: int
    even_rigid: int


def modal_form(body: Multibody) -> ModalVehicle:
    """Split a free vehicle, or a train, into rigid-body and vibration modes.

    What no spring joins is split by itself, and so are motions that are their own mirror images
    from those that are the opposite: vehicles alike have the same poles, whose common eigenvectors
    nothing would tell apart, and a bounce and a sway may have.

    Raises
    ------
    ValueError
        If the vehicle is not its own mirror image between the rails.
    ArithmeticError
        If two poles coincide so closely that the modes do not reproduce M, C and K.
    """
    _check_mirror(body)
    halves = [np.flatnonzero(body.even), np.flatnonzero(~body.even)]
    made = [[_modes_of(body, own) for own in _apart(body, half)] for half in halves]
    each = [one for half in made for one in half]
    modal = ModalVehicle(
        rigid=np.hstack([m.rigid for m in each]),
        poles=np.concatenate([m.poles for m in each]),
        modes=np.hstack([m.modes for m in each]),
        left=np.vstack([m.left for m in each]),
        state_of=np.vstack([m.state_of for m in each]),
        even=sum(m.poles.size for m in made[0]),
        even_rigid=sum(m.rigid.shape[1] for m in made[0]),
    )
    _check(body, modal)
    return modal


def _check_mirror(body: Multibody) -> None:
    """No even motion may call for an odd force."""
    for A in (body.M, body.C, body.K):
        size = np.sqrt(np.abs(np.diag(A)))
        both = np.abs(A) > LOPSIDED * np.outer(size, size)
        both &= body.even[:, None] & ~body.even
        for i, j in np.argwhere(both)[:1]:
            raise ValueError(
                f"{body.coordinates[i]} and {body.coordinates[j]} are coupled: the vehicle must be "
                "its own mirror image between the rails; give both sides the same springs"
            )


def _apart(body: Multibody, half: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Parts of these coordinates that no spring joins."""
    S = body.stretch[:, half]
    count, part = connected_components(S.T @ S)
    return [half[part == k] for k in range(count)]


def _modes_of(body: Multibody, own: NDArray[np.intp]) -> Modes:
    """Modes of some coordinates that nothing joins to the others; shapes over all coordinates."""
    rigid, elastic = _split(body, own)
    C, K = (elastic.T @ A @ elastic for A in (body.C, body.K))
    m = elastic.shape[1]
    A = np.block([[np.zeros((m, m)), np.eye(m)], [-K, -C]])
    poles, right = eig(A)
    inverse: ComplexArray = np.linalg.inv(right)
    # One of each conjugate pair, counted twice; a real pole counts once.
    keep = poles.imag >= 0
    weight = np.where(poles.imag > 0, 2.0, 1.0)[keep]
    return Modes(
        rigid=rigid,
        poles=poles[keep],
        modes=elastic @ right[:m, keep] * weight,
        left=inverse[keep, m:] @ elastic.T,
        state_of=inverse[keep, :m] @ elastic.T @ body.M,
    )


def _split(body: Multibody, own: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
    """Mass-orthonormal bases of what stretches no suspension and of all the rest.

    What the suspensions' forces accelerate, M^-1 S^T, is mass-orthogonal to what stretches none.
    Where there are more suspensions than motions they stretch, as many of them do.
    """
    M = body.M[np.ix_(own, own)]
    S = body.stretch[:, own]
    S = S[np.abs(S).max(axis=1, initial=0.0) > 0]
    _, R, order = qr((S / np.sqrt(np.diag(M))).T, mode="economic", pivoting=True)
    size = np.abs(np.diag(R))
    S = S[np.sort(order[: (size > RIGID * size.max(initial=0.0)).sum()])]

    def orthonormal(basis: FloatArray) -> FloatArray:
        L = np.linalg.cholesky(basis.T @ M @ basis)
        whole = np.zeros((len(body.M), basis.shape[1]))
        whole[own] = basis @ np.linalg.inv(L).T
        return whole

    return orthonormal(null_space(S)), orthonormal(np.linalg.solve(M, S.T).astype(np.float64))


def _check(body: Multibody, modal: ModalVehicle) -> None:
    """Hold the modes against M, C and K in the Laplace domain."""
    for s in (3.0 + 1.0j, 40.0 - 30.0j, 200.0 + 700.0j):
        direct = np.linalg.inv(s**2 * body.M + s * body.C + body.K)
        pole, conjugate = ((modal.modes, modal.left, modal.poles),
                           (modal.modes.conj(), modal.left.conj(), modal.poles.conj()))  # fmt: skip
        summed = modal.rigid @ modal.rigid.T / s**2 + 0.5 * sum(
            U @ (W / (s - p)[:, None]) for U, W, p in (pole, conjugate)
        )
        if np.abs(summed - direct).max() > CHECK_TOLERANCE * np.abs(direct).max():
            raise ArithmeticError(
                "the vehicle's modes do not reproduce its M, C, K: two poles coincide; change a "
                "damping or stiffness of the parameter file by a millionth part"
            )


FELT: dict[Direction, Callable[[Cone, float], dict[str, float]]] = {
    Z: lambda wheel, out: {"z": 1.0, "roll": out},
    Y: lambda wheel, out: {"y": 1.0, "roll": -wheel.radius},
    ROLL: lambda wheel, out: {"roll": 1.0},
    X: lambda wheel, out: {"spin": wheel.radius, "yaw": -out},
    YAW: lambda wheel, out: {"yaw": 1.0},
}
"""How a wheelset's coordinates move a point of its wheel in a direction: the one that is designed
to lie on the rail, a radius below the axle and `out` to the right of its middle, m."""


def at_left_wheels(body: Multibody) -> FloatArray:
    """Motion of the left wheels by the coordinates, (wheelsets x directions, n)."""
    motion = np.zeros((body.wheelset_x.size, len(body.directions), len(body.coordinates)))
    for rows, axle, wheel in zip(motion, body.axles, body.wheels, strict=True):
        for row, direction in zip(rows, body.directions, strict=True):
            for name, share in FELT[direction](wheel, LEFT * wheel.half_distance).items():
                if f"{axle}.{name}" in body.coordinates:
                    row[body.at(axle, name)] = share
    return motion.reshape(-1, len(body.coordinates))


def vehicle_body(body: Multibody) -> ModalBody:
    """A vehicle's modes as its wheels meet rails, and how it rests on wheelsets at given heights.

    Contact forces lift wheels and push them the way opposite to rails. A left wheel moves by even
    motions of bodies as the mirror image of the right one, by odd ones as the opposite.
    """
    modal, follow, wheelsets = modal_form(body), body.following, body.wheelsets
    at_wheels = at_left_wheels(body)
    layout = Layout(body.wheelset_x.size, directions=body.directions)
    rigid = at_wheels @ modal.rigid
    order = np.concatenate([np.flatnonzero(body.even), np.flatnonzero(~body.even)])
    through = WHEEL.push * (at_wheels / np.diag(body.M)).T
    return ModalBody(
        layout=layout,
        face=WHEEL,
        poles=modal.poles,
        even=modal.even,
        shapes=Everywhere(
            out=at_wheels @ modal.modes, into=WHEEL.push * (at_wheels @ modal.left.T)
        ),
        rigid_out=rigid,
        rigid_into=WHEEL.push * rigid,
        even_rigid=modal.even_rigid,
        preload=layout.at_wheelsets(body.wheel_load, Z),
        coordinates=Coordinates(
            bodies=body.names,
            names=tuple(body.coordinates[k] for k in order),
            even=int(body.even.sum()),
            wheelsets=np.argsort(order)[wheelsets],
            modes=modal.modes[order],
            rigid=modal.rigid[order],
            through=through[order],
            start_s=modal.state_of @ follow,
            start_r=modal.rigid.T @ body.M @ follow,
            wheelset_x=body.wheelset_x,
        ),
    )


__all__ = ["ModalVehicle", "at_left_wheels", "modal_form", "vehicle_body"]
