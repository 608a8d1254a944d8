"""Poles and residues from a pulse response: the eigensystem realisation algorithm."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import finufft
import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from railcosim.master.component import FloatArray

ComplexArray: TypeAlias = NDArray[np.complex128]

COLUMNS = (250, 1000)
"""Widths of the Hankel matrix, tried in turn: a vehicle needs 20 columns, a track 900."""
ROWS_PER_COLUMN = 2.5
"""An oblong matrix averages noise; beyond 2.5 the singular values hardly move."""
TOLERANCES = 10.0 ** np.arange(-13, -3)
"""Relative singular values below which a state is taken for noise, tried from the smallest."""
GOOD_ENOUGH = 1e-9
"""Error relative to the response's peak at which no other order is tried."""
NEGLIGIBLE = 1e-7
"""What the poles may leave of a response without its being kept: solvers err by as much."""
TRANSFORM_ERROR = 1e-12
"""Of the fast Fourier transform of what is kept, relative to it."""
BLOCK = 500
"""Steps whose powers are kept at once: more than poles, so that few exponentials are taken."""
FAST_SAMPLES = 16_000
"""Samples from which poles that die down are found; more would add noise."""
DEAD = 12.0
"""Nepers of decay over the record after which a pole's response is gone."""
SLOW = 5.0
"""Nepers of decay over half a record below which a pole is slow, and noise grows 150 times."""


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

    def pulse_response(self, step: float, steps: int) -> FloatArray:
        """Response to an input of 1 held over the first step and 0 from then on.

        Parameters
        ----------
        step : float
            Length of a step, s.
        steps : int
            Number of steps.

        Returns
        -------
        ndarray, shape (steps + 1, n_outputs)
            At the beginning of the pulse (the feedthrough) and after each step.
        """
        first = self.residues * _hold(self.poles, step)
        response = np.empty((steps + 1, len(self.direct)))
        response[0] = self.direct
        with np.errstate(over="ignore", invalid="ignore"):  # a spurious pole may be unstable
            # The powers of one block serve all: a later one only begins from other residues.
            powers = np.exp(np.outer(np.arange(min(BLOCK, steps)), self.poles * step))
            for begin in range(0, steps, BLOCK):
                shifted = first * np.exp(self.poles * (step * begin))
                block = (powers[: steps - begin] @ shifted.T).real
                response[1 + begin : 1 + begin + len(block)] = block
        return response


def identify(
    pulse: FloatArray,
    step: float,
    scale: FloatArray,
) -> Realisation:
    """Find the poles and residues behind a pulse response.

    Parameters
    ----------
    pulse : ndarray, shape (n_steps + 1, n_outputs)
        Outputs for an input of 1 held over the first step: at its beginning (the feedthrough) and
        after each step.
    step : float
        Length of a step, s. Poles with an imaginary part above ``pi / step`` are not resolved.
    scale : ndarray, shape (n_outputs,)
        Magnitude that makes the outputs comparable; 0 for an output to be left out.

    Returns
    -------
    Realisation
        Of the least order that reproduces the pulse response well.

    Notes
    -----
    The eigensystem realisation algorithm [1]_ with offsets of uneven spacing: the Hankel matrix
    holds the response at the samples ``t_i + s_j``, close together at first and far apart later,
    so that a matrix of 1000 columns sees 0.3 Hz as well as 2 kHz. Any sets of offsets will do, as
    the matrix is the product of the outputs' histories from each state and the states at ``s_j``.
    The same matrix one sample later gives the state matrix over one step, its eigenvalues by the
    logarithm the poles, and the exact inverse of the hold the residues.

    If that leaves more than `NEGLIGIBLE`, there are too many poles for one matrix. The few that do
    not die down within the record are found first, from its second half; then, from its beginning,
    those that do. What all these leave is small and dies down, so `pulse_transform` can deal with
    it: a wrong pole that dies down does no harm, as the rest makes up for it.

    References
    ----------
    .. [1] J.-N. Juang, R. S. Pappa, An eigensystem realization algorithm for modal parameter
       identification and model reduction, Journal of Guidance, Control, and Dynamics 8 (1985)
       620-627. https://doi.org/10.2514/3.20031
    """
    # A long record is given where one matrix would not do: the wide one is then not tried.
    whole = _fit(pulse, step, scale, COLUMNS if len(pulse) <= FAST_SAMPLES else COLUMNS[:1])
    left = pulse - whole.pulse_response(step, len(pulse) - 1)
    if not np.any(np.abs(left) > NEGLIGIBLE * scale):
        return whole

    slow = _slow_part(pulse, step, scale)
    after_slow = pulse - slow.pulse_response(step, len(pulse) - 1)
    fast = _fit(after_slow[:FAST_SAMPLES], step, scale, COLUMNS[1:])
    # A pole that rings on beyond the record is the slow part's business; here it is an artefact.
    dies = fast.poles.real * (len(pulse) - 1) * step < -DEAD
    return Realisation(
        poles=np.concatenate([slow.poles, fast.poles[dies]]),
        residues=np.concatenate([slow.residues, fast.residues[:, dies]], axis=1),
        direct=pulse[0],
    )


def _slow_part(pulse: FloatArray, step: float, scale: FloatArray) -> Realisation:
    """Poles that outlast the record, from its second half, where little else is left to hide them.

    Their residues follow by going back in time, which noise does not stand for long.
    """
    start = len(pulse) // 2
    tail = pulse[start:]
    peak = float(np.abs(tail[1:] * _inverse(scale)).max())
    found = _fit(tail, step, peak * scale)
    slow = np.abs(found.poles.real) * start * step < SLOW
    back = np.exp(-found.poles[slow] * start * step)
    return Realisation(
        poles=found.poles[slow],
        residues=found.residues[:, slow] * back,
        direct=np.zeros(pulse.shape[1]),
    )


def _fit(
    pulse: FloatArray, step: float, scale: FloatArray, widths: tuple[int, ...] = COLUMNS
) -> Realisation:
    """Find the smallest single realisation that reproduces a response about as well as any."""
    weight = _inverse(scale)
    samples = pulse[1:] * weight

    def judge(model: Realisation) -> float:
        with np.errstate(over="ignore", invalid="ignore"):  # a spurious pole may be unstable
            missed = (model.pulse_response(step, len(samples)) - pulse) * weight
            return float(np.abs(missed).max())

    nothing = Realisation(
        poles=np.empty(0, complex), residues=np.empty((len(scale), 0), complex), direct=pulse[0]
    )
    candidates = [(judge(nothing), nothing)]
    for columns in widths:
        for A, B, C in _realisations(samples, columns):
            if candidates[-1][0] <= GOOD_ENOUGH:
                return candidates[-1][1]
            model = _diagonalised(A, B, scale[:, None] * C, pulse[0], step)
            candidates.append((judge(model), model))
    # Of models that err about equally the smallest explains the least noise.
    limit = 3.0 * min(error for error, _ in candidates if np.isfinite(error))
    enough = [model for error, model in candidates if error <= limit]
    return min(enough, key=lambda model: len(model.poles))


def _inverse(scale: FloatArray) -> FloatArray:
    """Weights of the outputs: 0 for one that is left out."""
    weight: FloatArray = np.zeros_like(scale)
    np.divide(1.0, scale, out=weight, where=scale > 0.0)
    return weight


def pulse_transform(pulse: FloatArray, step: float, omega: FloatArray) -> ComplexArray:
    """Frequency response from a response to a pulse, by a Fourier sum, without poles.

    Parameters
    ----------
    pulse : ndarray, shape (n_steps + 1, n_columns)
        Responses to an input of 1 over the first step, from its beginning; they must have died
        down at the end.
    step : float
        Length of a step, s.
    omega : ndarray, shape (n_omega,)
        Angular frequencies, rad/s, below ``pi / step``.

    Returns
    -------
    ndarray of complex, shape (n_omega, n_columns)
        Too large by the frequencies above ``pi / step`` that alias: the jump of the response (or
        of its slope) at the beginning has them. On a rail that is 2 % at a sixth of the sampling
        rate, so the sum is for small parts of a response.
    """
    # A non-uniform fast Fourier transform, 40 times as fast as the sum: samples are numbered from
    # the middle there, which the phase takes back.
    rows = np.ascontiguousarray(pulse.T, dtype=complex)
    summed = np.atleast_2d(finufft.nufft1d2(omega * step, rows, isign=-1, eps=TRANSFORM_ERROR)).T
    response = summed * np.exp(-1j * omega * step * (len(pulse) // 2))[:, None]
    held = _hold(
        np.asarray(-1j * omega, dtype=np.complex128), step
    )  # transform of the pulse itself
    transformed: ComplexArray = response * (step / held)[:, None]
    return transformed


def _realisations(
    samples: FloatArray, columns: int
) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """Discrete state matrix, first state and outputs, from the highest order to the lowest."""
    n_samples, n_outputs = samples.shape
    rows = max(64, round(ROWS_PER_COLUMN * columns / n_outputs))
    # A tenth of the record stays out of the matrix, so that a model also shows whether it foresees.
    last = (9 * n_samples // 10 - 2) // 2
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
        A = shifted[:order, :order] / root[:, None] / root
        # The first column of the matrix is the offset 0, and so are its first n_outputs rows.
        yield A, root * Vt[:order, 0], U[:n_outputs, :order] * root


def _offsets(count: int, last: int) -> NDArray[np.intp]:
    """About `count` different samples from 0 to `last`, cubically further apart."""
    return np.unique(np.rint(last * np.linspace(0.0, 1.0, count) ** 3).astype(np.intp))


def _diagonalised(
    A: FloatArray, B: FloatArray, C: FloatArray, direct: FloatArray, step: float
) -> Realisation:
    """Poles and residues of a discrete realisation."""
    z, vectors, inverse = _eigen(A)
    # A pole that is gone within a step has lost its rate: any fast one does as well.
    z[np.abs(z) < 1e-16] = 1e-16
    poles = np.asarray(np.log(z) / step, dtype=np.complex128)
    residues = (C @ vectors) * (inverse @ B) / _hold(poles, step)
    return Realisation(poles=poles, residues=residues, direct=direct)


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


def _hold(poles: ComplexArray, step: float) -> ComplexArray:
    """Integral of e^pt over a step, in s: what a held input of 1 leaves in each pole."""
    hold: ComplexArray = np.full(poles.shape, step, dtype=complex)
    np.divide(np.expm1(poles * step), poles, out=hold, where=poles != 0.0)
    return hold
