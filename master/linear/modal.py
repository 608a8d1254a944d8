"""A linear model as a sum over modes, and as few of them as its transfer function needs."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railcosim.master.component import FloatArray, Variable
from railcosim.master.linear.low_rank import factors
from railcosim.master.linear.partial_fractions import PartialFractions, of_modes
from railcosim.master.linear.state_space import ComplexArray, IndexArray, StateSpace

_UNDAMPED = 1e-9
"""Damping ratio below which a mode has no Gramian in double precision, and is kept as it is."""
_SILENT = 1e-12
"""Of the largest product of a mode's shape at inputs and outputs: modes below are not seen."""
_FACTOR = 1e-14
"""Of the Gramian's largest diagonal entry, where its factor ends: rounding is next."""
_BAND = 600
"""Modes at most that are condensed together, of like frequency: their Gramians are small enough to
be factored to rounding. Cut off before, the reduced model need not be stable: with 32 wheels in a
row it was not. Of a track under 4 wheelsets 6 % more modes are kept than without bands."""


@dataclass(frozen=True, kw_only=True)
class Modal:
    """y = 2 Re(C q) + D u, q' = poles q + B u: one of each pair of conjugate modes.

    Attributes
    ----------
    name : str
        What moves.
    poles : array of complex, shape (n,)
        In 1/s, imaginary parts not negative. A real pole counts half in `C`.
    B : array of complex, shape (n, n_inputs)
        What inputs do to modes.
    C : array of complex, shape (n_outputs, n)
        What modes do to outputs.
    D : array, shape (n_outputs, n_inputs)
        Feedthrough.
    inputs, outputs : tuple of Variable
        The interface.
    """

    name: str
    poles: ComplexArray
    B: ComplexArray
    C: ComplexArray
    D: FloatArray
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]

    def response(self, s: ArrayLike) -> ComplexArray:
        """Transfer function at complex frequencies (1/s), shape (n_s, n_outputs, n_inputs)."""
        at = np.asarray(s, dtype=complex)
        return self._fractions.at(at) + self.D

    @cached_property
    def _fractions(self) -> PartialFractions:
        return of_modes(self.poles, self.B, self.C)

    @cached_property
    def driven(self) -> tuple[Modal, FloatArray]:
        """The same modes with as few inputs as drive them, and these by all inputs, (n, n_inputs).

        A body that owns a contact law has a motion and a rate as inputs for each force on it.
        """
        few, by = factors(np.concatenate([self.B.real, self.B.imag]))
        n = len(self.poles)
        return replace(self, B=few[:n] + 1j * few[n:], D=np.zeros((len(self.C), len(by)))), by

    def real(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A, B, C in real states, sqrt(2) times the real parts of q, then the imaginary ones."""
        return real_form(self.poles, self.B, self.C)

    def condensed(self, tolerance: float) -> Modal:
        """Fewer modes with nearly the same transfer function, by balanced truncation of bands.

        Parameters
        ----------
        tolerance : float
            Hankel singular values below this part of the largest are left out; the error of the
            transfer function is at most twice their sum [1]_. Those are meant of each band of
            frequencies, as modes of different bands hardly know of each other.

        References
        ----------
        .. [1] A. C. Antoulas, Approximation of Large-Scale Dynamical Systems, SIAM, 2005, ch. 7.
        """
        size = np.linalg.norm(self.B, axis=1) * np.linalg.norm(self.C, axis=0)
        seen = size > _SILENT * size.max()
        damped = -self.poles.real > _UNDAMPED * np.abs(self.poles)
        kept, rest = self._only(seen & ~damped), self._only(seen & damped)
        turn = np.argsort(np.abs(rest.poles))
        count = max(1, math.ceil(len(turn) / _BAND))
        bands = [_Balanced.of(rest._only(some)) for some in np.array_split(turn, count)]
        least = tolerance * max(float(band.values.max(initial=0.0)) for band in bands)
        parts = [*(band.above(least) for band in bands), kept]
        return replace(
            self,
            poles=np.concatenate([part.poles for part in parts]),
            B=np.concatenate([part.B for part in parts]),
            C=np.concatenate([part.C for part in parts], axis=1),
        )

    def sampled(self, h: float | FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """What a step `h` (s) does: to the modes, and what inputs and two derivatives add.

        Returns
        -------
        E : array of complex, shape (..., n) for h of shape (...)
            Factor of every mode.
        G : array of complex, shape (..., n, 3 n_inputs)
            For value, first and second derivative of the inputs at the beginning.
        """
        step = np.asarray(h)[..., None]
        phi = _phi(self.poles * step)
        G = [(step ** (j + 1) * phi[j + 1])[..., None] * self.B for j in range(3)]
        return phi[0], np.concatenate(G, axis=-1)

    def _only(self, which: NDArray[np.bool_] | IndexArray) -> Modal:
        return Modal(
            name=self.name, poles=self.poles[which], B=self.B[which], C=self.C[:, which],
            D=self.D, inputs=self.inputs, outputs=self.outputs,
        )  # fmt: skip


@dataclass(frozen=True)
class _Balanced:
    """Modes, factors of their Gramians (real states), and how those are joined: Y^T X = U s V^T."""

    modes: Modal
    X: FloatArray
    Y: FloatArray
    U: FloatArray
    values: FloatArray
    Vt: FloatArray

    @classmethod
    def of(cls, modes: Modal) -> _Balanced:
        """Hankel singular values of modes, and what belongs to them."""
        X = _gramian_factor(modes.poles, modes.B)
        # The observed states are those of the adjoint system, whose modes turn the other way.
        Y = _gramian_factor(modes.poles.conj(), modes.C.T.conj())
        moved = np.concatenate([np.ones(len(modes.poles), bool), modes.poles.imag > 0.0])
        return cls(modes, X[moved], Y[moved], *np.linalg.svd(Y[moved].T @ X[moved]))

    def above(self, least: float) -> Modal:
        """What has larger singular values than `least`, as modes."""
        A, B, C = self.modes.real()
        r = int((self.values > least).sum())
        root = np.sqrt(self.values[:r])
        left, right = (self.Y @ self.U[:, :r]) / root, (self.X @ self.Vt[:r].T) / root
        m = self.modes
        return modal(
            m.name, left.T @ (A @ right), left.T @ B, C @ right, m.D, m.inputs, m.outputs
        )  # fmt: skip


def modal(
    name: str,
    A: ArrayLike,
    B: FloatArray,
    C: FloatArray,
    D: FloatArray,
    inputs: tuple[Variable, ...],
    outputs: tuple[Variable, ...],
) -> Modal:
    """Modes of dense real matrices, which must have a full set of them."""
    poles, V = np.linalg.eig(np.asarray(A))
    upper = poles.imag >= 0.0
    b = np.linalg.solve(V, B.astype(complex))[upper]
    c = (C @ V)[:, upper]
    poles = poles[upper]
    return Modal(
        name=name,
        poles=poles,
        B=b,
        C=np.where(poles.imag > 0.0, 1.0, 0.5) * c,
        D=D,
        inputs=inputs,
        outputs=outputs,
    )


def modes_of(model: StateSpace) -> Modal:
    """Modes of a state space that falls apart into blocks, each with a full set of modes."""
    parts = []
    for states in model.blocks():
        ordered = model.A[states.ravel()][:, states.ravel()].tocoo()
        size = states.shape[1]
        A = np.zeros((len(states), size, size), dtype=complex)
        A[ordered.row // size, ordered.row % size, ordered.col % size] = ordered.data
        poles, V = np.linalg.eig(A)
        b = np.linalg.solve(V, model.B[states].astype(complex))
        c = model.C[:, states].transpose(1, 0, 2) @ V
        parts.append(
            (
                poles.ravel(),
                b.reshape(-1, b.shape[2]),
                c.transpose(1, 0, 2).reshape(len(model.C), -1),
            )
        )
    poles = np.concatenate([p for p, _, _ in parts])
    B = np.concatenate([b for _, b, _ in parts])
    C = np.concatenate([c for _, _, c in parts], axis=1)
    upper = poles.imag >= 0.0
    return Modal(
        name=model.name, poles=poles[upper], B=B[upper],
        C=np.where(poles.imag > 0.0, 1.0, 0.5)[upper] * C[:, upper],
        D=model.D, inputs=model.inputs, outputs=model.outputs,
    )  # fmt: skip


def real_form(
    poles: ComplexArray, B: ComplexArray, C: ComplexArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Real matrices A, B, C of modes, one of each conjugate pair; see `Modal.real`."""
    n = len(poles)
    A = np.zeros((2 * n, 2 * n))
    k = np.arange(n)
    A[k, k] = A[n + k, n + k] = poles.real
    A[k, n + k], A[n + k, k] = -poles.imag, poles.imag
    both = np.sqrt(2.0) * np.concatenate([B.real, B.imag])
    seen = np.sqrt(2.0) * np.concatenate([C.real, -C.imag], axis=1)
    is_moved = np.concatenate([np.ones(n, bool), poles.imag != 0.0])
    return A[is_moved][:, is_moved], both[is_moved], seen[:, is_moved]


def _phi(z: ComplexArray) -> list[ComplexArray]:
    """phi_0 = exp(z), phi_j = (phi_{j-1} - 1/(j-1)!)/z up to j = 3."""
    near = np.abs(z) < 1.0
    found: list[ComplexArray] = [np.exp(z), *(np.empty_like(z) for _ in range(3))]
    far, small = z[~near], z[near]
    ahead = found[0][~near]
    for j, term in ((1, 1.0), (2, 1.0), (3, 0.5)):
        ahead = (ahead - term) / far
        found[j][~near] = ahead
    # Horner's rule for 3! phi_3 = sum_k z^k 3!/(k + 3)!; 18 terms: 1/18! is below rounding.
    series: ComplexArray = np.ones_like(small)
    for k in range(18, 0, -1):
        series = 1.0 + series * small / (k + 3)
    found[3][near] = series / 6.0
    found[2][near] = 0.5 + small * found[3][near]
    found[1][near] = 1.0 + small * found[2][near]
    return found


def _gramian_factor(poles: ComplexArray, B: ComplexArray) -> FloatArray:
    """L with L L^T the Gramian of the real states of `Modal.real`, by pivoted Cholesky [1]_.

    The entries have closed forms, so only the columns that are pivots are ever made.

    References
    ----------
    .. [1] H. Harbrecht, M. Peters, R. Schneider, On the low-rank approximation by the pivoted
       Cholesky decomposition, Applied Numerical Mathematics 62 (2012) 428-440.
    """
    n = len(poles)
    square, plain = (np.abs(B) ** 2).sum(axis=1), (B * B).sum(axis=1)
    mean, swing = square / (-2.0 * poles.real), plain / (-2.0 * poles)
    left = np.concatenate([mean + swing.real, mean - swing.real])
    top = float(left.max())
    L = np.zeros((2 * n, 2 * n))
    for k in range(L.shape[1]):
        j = int(left.argmax())
        if left[j] <= _FACTOR * top:
            return L[:, :k]
        i = j % n
        # E[q q_i^*] and E[q q_i]: real and imaginary parts are sums and differences of the two.
        one = (B @ B[i].conj()) / -(poles + poles[i].conj())
        two = (B @ B[i]) / -(poles + poles[i])
        column = (
            np.concatenate([(one + two).real, (one + two).imag])
            if j < n
            else np.concatenate([(two - one).imag, (one - two).real])
        )
        column -= L[:, :k] @ L[j, :k]
        column /= np.sqrt(left[j])
        L[:, k] = column
        left -= column**2
        left[j] = 0.0
    return L
