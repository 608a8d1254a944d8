"""Modal form of a free vehicle: rigid bodies apart, everything else as complex modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig, null_space, qr
from scipy.sparse.csgraph import connected_components

from railcosim.mechanics.coordinates import Coordinates
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import WHEEL, Layout
from railcosim.mechanics.shapes import Everywhere

from .multibody import Multibody

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

RIGID = 1e-10  # of the largest stretch: rounding is 1e-15, levers and masses differ by 1e2
CHECK_TOLERANCE = 1e-8  # two digits looser than the eigenproblem's usual rounding


@dataclass(frozen=True, kw_only=True)
class ModalVehicle:
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


def modal_form(body: Multibody) -> ModalVehicle:
    """Split a free vehicle, or a train, into rigid-body and vibration modes.

    What no spring joins is split by itself: vehicles alike have the same poles, whose common
    eigenvectors nothing would tell apart.

    Raises
    ------
    ArithmeticError
        If two poles coincide so closely that the modes do not reproduce M, C and K.
    """
    count, part = connected_components(body.stretch.T @ body.stretch)
    made = [_modes_of(body, np.flatnonzero(part == k)) for k in range(count)]
    modal = ModalVehicle(
        rigid=np.hstack([m.rigid for m in made]),
        poles=np.concatenate([m.poles for m in made]),
        modes=np.hstack([m.modes for m in made]),
        left=np.vstack([m.left for m in made]),
        state_of=np.vstack([m.state_of for m in made]),
    )
    _check(body, modal)
    return modal


def _modes_of(body: Multibody, own: NDArray[np.intp]) -> ModalVehicle:
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
    return ModalVehicle(
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


def vehicle_body(body: Multibody) -> ModalBody:
    """A vehicle's modes, and how it rests on wheelsets held at given heights.

    Of the vertical model: both wheels of a wheelset move alike, so all modes are even; a contact
    force lifts them.

    Raises
    ------
    ValueError
        If the model has other coordinates.
    """
    if any(name.endswith(".y") for name in body.coordinates):
        raise ValueError("wheels are met in the vertical direction only: take the vertical model")
    modal, follow, wheelsets = modal_form(body), body.following, body.wheelsets
    layout = Layout(body.wheelset_x.size)
    rigid = modal.rigid[wheelsets]
    through = np.zeros((len(body.coordinates), layout.wheelsets))
    through[wheelsets] = WHEEL.push * np.diag(1 / np.diag(body.M)[wheelsets])
    return ModalBody(
        layout=layout,
        face=WHEEL,
        poles=modal.poles,
        even=modal.poles.size,
        shapes=Everywhere(out=modal.modes[wheelsets], into=WHEEL.push * modal.left[:, wheelsets].T),
        rigid_out=rigid,
        rigid_into=WHEEL.push * rigid,
        preload=layout.at_wheelsets(body.wheel_load),
        coordinates=Coordinates(
            bodies=body.names,
            names=body.coordinates,
            wheelsets=wheelsets,
            modes=modal.modes,
            rigid=modal.rigid,
            through=through,
            start_s=modal.state_of @ follow,
            start_r=modal.rigid.T @ body.M @ follow,
            wheelset_x=body.wheelset_x,
        ),
    )


__all__ = ["ModalVehicle", "modal_form", "vehicle_body"]
