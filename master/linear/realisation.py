"""Poles and residues from a pulse response: the eigensystem realisation algorithm."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from railcosim.master.component import FloatArray

ComplexArray: TypeAlias = NDArray[np.complex128]

ROWS_PER_COLUMN = 2.5
"""An oblong matrix averages noise; beyond 2.5 the singular values hardly move."""
MIN_ROWS = 64
"""Offsets in the rows, however many outputs there are."""
TOLERANCES = 10.0 ** np.arange(-14, -3)
"""Relative singular values below which a state is taken for noise, tried from the largest order."""
GOOD_ENOUGH = 1e-11
"""Error relative to the response's peak at which no other order is tried."""
WORTH_REFINING, ABOUT_EQUAL = 10.0, 2.0
"""Errors over the least: of models worth least squares, and of those that count as equal then."""
DEPENDENT = 1e-13
"""Least squares: relative size below which a combination of poles is taken for rounding."""
BLOCK = 500
"""Samples whose powers are kept at once: more than poles, so that few exponentials are taken."""

_Candidate: TypeAlias = tuple[float, ComplexArray, ComplexArray]
"""Error, poles, amplitudes (n_outputs, n_poles) of e^pt."""


@dataclass(frozen=True, kw_only=True)
class Realisation:
    """What one input does to all outputs, as a sum over poles.

    The response to the input ``u`` is, at the angular frequency `omega`,
    ``direct + sum_n residues[:, n] / (i omega - poles[n])``.

    A double pole (a rigid body: receptance -1/(m omega^2)) appears as two poles some 1e-8 of a
    step's rate apart with large opposite residues, which costs half of the sixteen digits.

    Attributes
    ----------
    poles : ndarray of complex, shape (n_poles,)
        In 1/s, in conjugate pairs.
    residues : ndarray of complex, shape (n_outputs, n_poles)
        In units of the output per unit of the input and second.
    direct : ndarray, shape (n_outputs,)
        Feedthrough.
    """

    poles: ComplexArray
    residues: ComplexArray
    direct: FloatArray

    def frequency_response(self, omega: FloatArray) -> ComplexArray:
        """Response to a harmonic input of unit amplitude.

        Parameters
        ----------
        omega : ndarray, shape (n_omega,)
            Angular frequencies, rad/s.

        Returns
        -------
        ndarray of complex, shape (n_omega, n_outputs)
        """
        fractions = 1.0 / (1j * omega[:, None] - self.poles)
        response: ComplexArray = fractions @ self.residues.T + self.direct
        return response

    def after_pulse(self, length: float, sampling: float, count: int) -> FloatArray:
        """Response to an input of 1 held for a while, from its end on.

        Parameters
        ----------
        length : float
            Of the pulse, s.
        sampling : float
            Time between samples, s.
        count : int
            Number of samples.

        Returns
        -------
        ndarray, shape (count, n_outputs)
            The first at the end of the pulse, when the input is 0 again.
        """
        return _sum(self.poles, self.residues * held(self.poles, length), sampling, count)


def identify(
    samples: FloatArray,
    sampling: float,
    length: float,
    scale: FloatArray,
    *,
    columns: int,
    judged: int | None = None,
    refine: bool = False,
) -> Realisation:
    """Find the poles and residues behind a pulse response.

    Parameters
    ----------
    samples : ndarray, shape (n_samples, n_outputs)
        Outputs for an input of 1 held for a while, from its end on.
    sampling : float
        Time between samples, s. Poles with an imaginary part above ``pi / sampling`` are not
        resolved.
    length : float
        Of the pulse, s.
    scale : ndarray, shape (n_outputs,)
        Magnitude that makes the outputs comparable; 0 for an output to be left out.
    columns : int
        Width of the Hankel matrix; it shows poles up to 0.6 of that.
    judged : int, optional
        How many samples, from the first, are to be reproduced well; all by default.
    refine : bool, optional
        Find the residues once more by least squares. They are then ten times as good over the
        record, and ten times worse for what is far below its peak at its beginning.

    Returns
    -------
    Realisation
        Of the least order that reproduces the response about as well as any; no feedthrough.

    Notes
    -----
    The eigensystem realisation algorithm [1]_ with offsets of uneven spacing: the Hankel matrix
    holds the response at the samples ``t_i + s_j``, close together at first and far apart later,
    so that a matrix of 500 columns sees 0.3 Hz as well as 2 kHz. Any sets of offsets will do, as
    the matrix is the product of the outputs' histories from each state and the states at ``s_j``.
    The same matrix one sample later gives the state matrix over one sample, its eigenvalues by the
    logarithm the poles, and the exact inverse of the hold the residues.

    References
    ----------
    .. [1] J.-N. Juang, R. S. Pappa, An eigensystem realization algorithm for modal parameter
       identification and model reduction, Journal of Guidance, Control, and Dynamics 8 (1985)
       620-627. https://doi.org/10.2514/3.20031
    """
    weight = np.zeros_like(scale)
    np.divide(1.0, scale, out=weight, where=scale > np.finfo(float).tiny)
    weighted = samples * weight
    compared = weighted[:judged]
    found = (np.empty(0, complex), np.empty((len(scale), 0), complex))
    candidates = [(float(np.abs(compared).max()), *found)]
    for z, amplitudes in _realisations(weighted, columns):
        if candidates[-1][0] <= GOOD_ENOUGH:
            break
        poles = _poles(z, sampling)
        candidates.append((_misfit(poles, amplitudes, compared, sampling), poles, amplitudes))
    # Of models that err about equally the smallest explains the least noise.
    least = min(error for error, _, _ in candidates if np.isfinite(error))
    good = [c for c in candidates if c[0] <= WORTH_REFINING * least]
    if refine:
        good = [_refined(candidate, compared, sampling) for candidate in good]
    limit = ABOUT_EQUAL * min(error for error, _, _ in good)
    _, poles, amplitudes = min((c for c in good if c[0] <= limit), key=lambda c: len(c[1]))
    return Realisation(
        poles=poles,
        residues=scale[:, None] * amplitudes / held(poles, length),
        direct=np.zeros_like(scale),
    )


def _refined(candidate: _Candidate, samples: FloatArray, sampling: float) -> _Candidate:
    """The same poles with amplitudes by least squares, if these are better."""
    poles, amplitudes = _least_squares(candidate[1], samples, sampling)
    return min(
        candidate,
        (_misfit(poles, amplitudes, samples, sampling), poles, amplitudes),
        key=lambda c: c[0],
    )


def held(poles: ComplexArray, length: float) -> ComplexArray:
    """Integral of e^pt over a while, in s: what a held input of 1 leaves in each pole."""
    hold: ComplexArray = np.full(poles.shape, length, dtype=complex)
    np.divide(np.expm1(poles * length), poles, out=hold, where=poles != 0.0)
    return hold


def _sum(poles: ComplexArray, amplitudes: ComplexArray, sampling: float, count: int) -> FloatArray:
    """Real part of the sum of amplitudes (n_outputs, n_poles) times e^pt at `count` samples."""
    response = np.empty((count, len(amplitudes)))
    with np.errstate(over="ignore", invalid="ignore"):  # a spurious pole may be unstable
        # The powers of one block serve all: a later one only begins from other amplitudes.
        powers = np.exp(np.outer(np.arange(min(BLOCK, count)), poles * sampling))
        for begin in range(0, count, BLOCK):
            shifted = amplitudes * np.exp(poles * (sampling * begin))
            response[begin : begin + BLOCK] = (powers[: count - begin] @ shifted.T).real
    return response


def _misfit(
    poles: ComplexArray, amplitudes: ComplexArray, samples: FloatArray, sampling: float
) -> float:
    """Largest error of a model over samples."""
    return float(np.abs(_sum(poles, amplitudes, sampling, len(samples)) - samples).max())


def _realisations(samples: FloatArray, columns: int) -> Iterator[tuple[ComplexArray, ComplexArray]]:
    """Eigenvalues over one sample and amplitudes, from the highest order to the lowest."""
    n_samples, n_outputs = samples.shape
    rows = max(MIN_ROWS, round(ROWS_PER_COLUMN * columns / n_outputs))
    last = (n_samples - 2) // 2
    at = _offsets(rows, last)[:, None] + _offsets(columns, last)

    def hankel(shift: int) -> FloatArray:
        matrix: FloatArray = samples[at + shift].transpose(0, 2, 1).reshape(-1, at.shape[1])
        return matrix

    U, sigma, Vt = scipy.linalg.svd(hankel(0), full_matrices=False)
    shifted = U.T @ hankel(1) @ Vt.T
    # More states than 0.6 of the columns would be noise, or another matrix is wanted.
    limit = 6 * len(sigma) // 10 or len(sigma)
    for order in sorted({min(limit, int(np.sum(sigma > t * sigma[0]))) for t in TOLERANCES})[::-1]:
        root = np.sqrt(sigma[:order])
        z, vectors, inverse = _eigen(shifted[:order, :order] / root[:, None] / root)
        # The first column of the matrix is the offset 0, and so are its first n_outputs rows.
        yield z, ((U[:n_outputs, :order] * root) @ vectors) * (inverse @ (root * Vt[:order, 0]))


def _offsets(count: int, last: int) -> NDArray[np.intp]:
    """About `count` different samples from 0 to `last`, cubically further apart."""
    return np.unique(np.rint(last * np.linspace(0.0, 1.0, count) ** 3).astype(np.intp))


def _poles(z: ComplexArray, sampling: float) -> ComplexArray:
    # A pole that is gone within a sample has lost its rate: any fast one does as well.
    alive = np.where(np.abs(z) < 1e-16, 1e-16 + 0j, z)
    return np.asarray(np.log(alive) / sampling, dtype=np.complex128)


def _least_squares(
    poles: ComplexArray, samples: FloatArray, sampling: float
) -> tuple[ComplexArray, ComplexArray]:
    """The same poles, in another order, with the amplitudes that reproduce the samples best."""
    upper, real = poles[poles.imag > 0.0], poles[poles.imag == 0.0]
    n = len(upper)
    waves = np.exp(np.outer(np.arange(len(samples)) * sampling, np.append(upper, real)))
    # A wave is the sum of a conjugate pair: twice the real part of amplitude times e^pt.
    basis = np.hstack([2.0 * waves[:, :n].real, -2.0 * waves[:, :n].imag, waves[:, n:].real])
    solved = scipy.linalg.lstsq(basis, samples, cond=DEPENDENT, lapack_driver="gelsy")[0].T
    pairs = solved[:, :n] + 1j * solved[:, n : 2 * n]
    return (
        np.concatenate([upper, upper.conj(), real]),
        np.concatenate([pairs, pairs.conj(), solved[:, 2 * n :]], axis=1),
    )


def _eigen(A: FloatArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Eigenvalues, eigenvectors and their inverse, also of a matrix that has too few.

    A rigid body is a Jordan block. Rounding normally splits its eigenvalue into two, 1e-8 apart;
    if it happens not to, a perturbation of the size of the rounding does it [1]_.

    References
    ----------
    .. [1] E. B. Davies, Approximate diagonalization, SIAM Journal on Matrix Analysis and
       Applications 29 (2007) 1051-1064. https://doi.org/10.1137/060659909
    """
    noise = np.random.default_rng(0).standard_normal(A.shape)
    for size in (0.0, 1e-16, 1e-14):
        z, vectors = np.linalg.eig(A + size * np.linalg.norm(A, 2) * noise)
        try:
            inverse = np.linalg.inv(vectors)
        except np.linalg.LinAlgError:
            continue
        if np.linalg.norm(vectors, 1) * np.linalg.norm(inverse, 1) < 1e10:
            break
    return z.astype(np.complex128), vectors.astype(np.complex128), inverse.astype(np.complex128)
