"""Modal form of a free vehicle: rigid bodies apart, everything else as complex modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig

from .multibody import Multibody

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

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
    """Split a free vehicle into rigid-body and vibration modes.

    Raises
    ------
    ArithmeticError
        If two poles coincide so closely that the modes do not reproduce M, C and K.
    """
    rigid, elastic = _split(body)
    C, K = (elastic.T @ A @ elastic for A in (body.C, body.K))
    m = elastic.shape[1]
    A = np.block([[np.zeros((m, m)), np.eye(m)], [-K, -C]])
    poles, right = eig(A)
    inverse: ComplexArray = np.linalg.inv(right)
    # One of each conjugate pair, counted twice; a real pole counts once.
    keep = poles.imag >= 0
    weight = np.where(poles.imag > 0, 2.0, 1.0)[keep]
    modal = ModalVehicle(
        rigid=rigid,
        poles=poles[keep],
        modes=elastic @ right[:m, keep] * weight,
        left=inverse[keep, m:] @ elastic.T,
        state_of=inverse[keep, :m] @ elastic.T @ body.M,
    )
    _check(body, modal)
    return modal


def _split(body: Multibody) -> tuple[FloatArray, FloatArray]:
    """Mass-orthonormal bases of the rigid-body motions and of all the rest.

    What the suspensions' forces accelerate, M^-1 S^T, is mass-orthogonal to what stretches none.
    """
    elastic = np.linalg.solve(body.M, body.stretch.T).astype(np.float64)

    def orthonormal(basis: FloatArray) -> FloatArray:
        L = np.linalg.cholesky(basis.T @ body.M @ basis)
        return basis @ np.linalg.inv(L).T

    return orthonormal(body.rigid_modes), orthonormal(elastic)


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


__all__ = ["ModalVehicle", "modal_form"]
