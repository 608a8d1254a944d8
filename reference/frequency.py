"""Direct solves of the monolithic system, one a frequency."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from railcosim.mechanics.arrays import ComplexArray, FloatArray

from .contacts import Contacts
from .monolithic import Monolithic


@dataclass(frozen=True, kw_only=True)
class Linearised:
    """Contacts about a state: forces K q + C dq/dt resist motions q = rows x - lowered r.

    Attributes
    ----------
    rows : sparse array, shape (m, n)
        Motions by the unknowns.
    K, C : sparse array, shape (m, m)
        Creep's are not symmetric.
    lowered : sparse array, shape (m, n_irregularities)
        What irregularities take from motions; from rates, nothing.
    pushes : sparse array, shape (n_ports, m)
        Forces on rails by those that resist.
    """

    rows: sparse.csr_array
    K: sparse.csr_array
    C: sparse.csr_array
    lowered: sparse.csr_array
    pushes: sparse.csr_array

    @property
    def loads(self) -> FloatArray:
        """What unit irregularities do to the unknowns, shape (n, n_irregularities)."""
        return np.asarray((self.rows.T @ (self.K @ self.lowered)).toarray())

    def forces(
        self, omega: FloatArray, x: ComplexArray, irregularity: FloatArray | None = None
    ) -> ComplexArray:
        """What wheels do to rails.

        Parameters
        ----------
        omega : array, shape (n_omega,)
            rad/s.
        x : array, shape (n_omega, n, n_loads)
            Displacements.
        irregularity : array, shape (n_irregularities, n_loads), optional
            Amplitudes, m, of which the loads are; none if not given.

        Returns
        -------
        array, shape (n_omega, n_ports, n_loads)
            In the order of `Monolithic.rails`, N and N m.
        """
        resisting = [
            (self.K + 1j * w * self.C) @ (self.rows @ at) for w, at in zip(omega, x, strict=True)
        ]
        if irregularity is not None:
            resisting = [force - self.K @ (self.lowered @ irregularity) for force in resisting]
        return np.array([self.pushes @ force for force in resisting])


def linearised(
    mono: Monolithic,
    contacts: Contacts,
    position: FloatArray,
    motion: FloatArray | None = None,
) -> Linearised:
    """Contacts about a state.

    Parameters
    ----------
    mono : Monolithic
        The system.
    contacts : Contacts
        Between wheels and rails.
    position : array, shape (n_wheelsets,)
        Of the wheelsets, m.
    motion : array, optional
        What the law is given there, in rows; zeros, for one that is linear, if not given.
    """
    rows, k = contacts.rows(mono, position), contacts.law.directions
    if motion is None:
        motion = np.zeros((rows.shape[0] // k, k * contacts.orders))
    by = np.split(contacts.law.tangent(motion), contacts.orders, axis=-1)
    K, C = (sparse.block_diag(list(one), format="csr") for one in (by[0], sum(by[1:], 0 * by[0])))
    return Linearised(
        rows=rows, K=K, C=C, lowered=contacts.lowered(mono), pushes=contacts.pushes(mono)
    )


def frequency_response(
    mono: Monolithic,
    omega: FloatArray,
    contacts: Linearised,
    loads: FloatArray | ComplexArray,
    progress: Callable[[int, int], None] | None = None,
) -> ComplexArray:
    """All displacements under harmonic loads, one direct solve a frequency.

    Parameters
    ----------
    mono : Monolithic
        The system.
    omega : array, shape (n_omega,)
        rad/s.
    contacts : Linearised
        Between wheels and rails.
    loads : array, shape (n, n_loads) or (n_omega, n, n_loads)
        Force amplitudes, N; for irregularities, `Linearised.loads`.
    progress : callable, optional
        Called with (done, total).

    Returns
    -------
    array, shape (n_omega, n, n_loads)
        Complex amplitudes.
    """
    rows = contacts.rows
    K = mono.K + 1j * mono.K_loss + rows.T @ (contacts.K @ rows)
    C = mono.C + rows.T @ (contacts.C @ rows)
    out = np.empty((len(omega), K.shape[0], loads.shape[-1]), dtype=complex)
    for k, w in enumerate(omega):
        D = (K + 1j * w * C - w**2 * mono.M).tocsc()
        load = loads if loads.ndim == 2 else loads[k]
        out[k] = splu(D).solve(load.astype(complex))
        if progress:
            progress(k + 1, len(omega))
    return out
