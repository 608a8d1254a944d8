"""Frequency response from the response to one pulse: poles where they last, samples between."""

from __future__ import annotations

from dataclasses import dataclass

import finufft
import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.linear.realisation import ComplexArray, Realisation, held, identify

NEGLIGIBLE = 1e-8
"""What the poles may leave of a response without its being kept, over the response's peak."""
WHOLE_COLUMNS, LASTING_COLUMNS, FIRST_COLUMNS = 250, 500, 100
"""Widths of the Hankel matrices. A vehicle needs 20 columns, the end of a track's response 150."""
LASTING_FROM = 0.7
"""Part of the record after which the lasting poles are looked for, where little hides them."""
LASTING = 16.0
"""Nepers of decay up to there of the fastest pole that counts as lasting. Going back to the
beginning magnifies its error as much, by 1e7; what it errs there is kept in the samples."""
FIRST_SAMPLES = 120
"""Samples of the beginning in which the first poles are looked for."""
FIRST_STEPS = 10
"""Steps in which they must be right: what the sum misses grows out of the first few samples."""
TRANSFORM_ERROR = 1e-13
"""Of the fast Fourier transform of the samples, relative to their largest one."""


@dataclass(frozen=True, kw_only=True)
class PulseResponse:
    """Response to an input of 1 held for one step, as a sum over poles and samples.

    Attributes
    ----------
    lasting : Realisation
        Poles that outlast the record, or all if they are few; with the feedthrough.
    rest : ndarray, shape (n_samples, n_outputs)
        What they leave, a step apart from the end of the pulse on. No samples if that is nothing.
    first : Realisation
        Poles that continue the rest between its first samples.
    step : float
        Length of the pulse and between samples, s.
    """

    lasting: Realisation
    rest: FloatArray
    first: Realisation
    step: float

    def frequency_response(self, omega: FloatArray) -> ComplexArray:
        """Response to a harmonic input of unit amplitude.

        Parameters
        ----------
        omega : ndarray, shape (n_omega,)
            Angular frequencies, rad/s. If there is a rest, so low that their sum with the highest
            one in it is below ``2 pi / step``.

        Returns
        -------
        ndarray of complex, shape (n_omega, n_outputs)

        Notes
        -----
        The rest is a smooth function for all times after the pulse, and has died down at the end:
        the sum of its samples differs from its integral by what happens at the beginning alone.
        The first poles, which need to be right for a few samples only, tell how much that is.
        """
        response = self.lasting.frequency_response(omega)
        if len(self.rest):
            response += _transform(self.rest, self.step, omega)
            response += _missed(self.first.poles, self.step, omega) @ self.first.residues.T
        return response

    def soon_after_pulse(self, length: float, sampling: float, count: int) -> FloatArray:
        """Response to another pulse, in the few steps in which the first poles hold.

        Parameters
        ----------
        length : float
            Of the pulse, s.
        sampling : float
            Time between samples, s.
        count : int
            Number of samples; their time should be less than `FIRST_STEPS` steps.

        Returns
        -------
        ndarray, shape (count, n_outputs)
            From the end of the pulse on.
        """
        parts = (self.lasting, self.first)
        return sum(
            (part.after_pulse(length, sampling, count) for part in parts),
            start=np.zeros((count, len(self.lasting.direct))),
        )


def analyse(
    record: FloatArray, beginning: FloatArray, finer: int, step: float, scale: FloatArray
) -> PulseResponse:
    """Find the frequency response behind a pulse response.

    Parameters
    ----------
    record : ndarray, shape (n_steps + 1, n_outputs)
        Outputs for an input of 1 held over the first step: at its beginning (the feedthrough) and
        after each step.
    beginning : ndarray, shape (n_samples, n_outputs)
        The same from the end of the pulse on, `finer` times a step.
    finer : int
        Samples of the beginning in a step.
    step : float
        s.
    scale : ndarray, shape (n_outputs,)
        Magnitude that makes the outputs comparable; 0 for an output to be left out.

    Returns
    -------
    PulseResponse
    """
    samples = record[1:]

    def left_by(model: Realisation) -> tuple[FloatArray, FloatArray]:
        return (
            samples - model.after_pulse(step, step, len(samples)),
            beginning - model.after_pulse(step, step / finer, len(beginning)),
        )

    found = identify(samples, step, step, scale, columns=WHOLE_COLUMNS)
    rest, rest_finer = left_by(found)
    nothing = Realisation(
        poles=np.empty(0, complex), residues=np.empty((len(scale), 0), complex), direct=record[0]
    )
    if all(np.all(np.abs(left) <= NEGLIGIBLE * scale) for left in (rest, rest_finer)):
        return PulseResponse(
            lasting=_with(found, record[0]), rest=rest[:0], first=nothing, step=step
        )
    found = _lasting(samples, step, scale)
    rest, rest_finer = left_by(found)
    first = identify(
        rest_finer[:FIRST_SAMPLES],
        step / finer,
        step,
        scale,
        columns=FIRST_COLUMNS,
        judged=finer * FIRST_STEPS,
    )
    return PulseResponse(lasting=_with(found, record[0]), rest=rest, first=first, step=step)


def _lasting(samples: FloatArray, step: float, scale: FloatArray) -> Realisation:
    """Poles that outlast the record, from its end."""
    start = round(LASTING_FROM * len(samples))
    tail = samples[start:]
    weight = np.zeros_like(scale)
    np.divide(1.0, scale, out=weight, where=scale > 0.0)
    peak = float(np.abs(tail * weight).max())
    found = identify(tail, step, step, peak * scale, columns=LASTING_COLUMNS, refine=True)
    lasts = np.abs(found.poles.real) * start * step < LASTING
    poles = found.poles[lasts]
    return Realisation(
        poles=poles,
        residues=found.residues[:, lasts] * np.exp(-poles * (start * step)),
        direct=found.direct,
    )


def _with(model: Realisation, direct: FloatArray) -> Realisation:
    """The same with a feedthrough."""
    return Realisation(poles=model.poles, residues=model.residues, direct=direct)


def _transform(rest: FloatArray, step: float, omega: FloatArray) -> ComplexArray:
    """Sum of samples over the transform of the pulse, shape (n_omega, n_outputs)."""
    # A non-uniform fast Fourier transform, 40 times as fast as the sum: samples are numbered from
    # the middle there, and the first is a step after the pulse began; the phase takes both back.
    rows = np.ascontiguousarray(rest.T, dtype=complex)
    summed = np.atleast_2d(finufft.nufft1d2(omega * step, rows, isign=-1, eps=TRANSFORM_ERROR)).T
    pulse = np.asarray(-1j * omega, dtype=np.complex128)
    shift = np.exp(-1j * omega * (step * (1 + len(rest) // 2)))
    transformed: ComplexArray = summed * (shift * step / held(pulse, step))[:, None]
    return transformed


def _missed(poles: ComplexArray, step: float, omega: FloatArray) -> ComplexArray:
    """What the sum of samples misses of 1/(i omega - pole), shape (n_omega, n_poles).

    The sum over all samples is a geometric series. Its difference from the pole's fraction has no
    pole itself, whether the samples die down or not, up to ``2 pi / step``.
    """
    a = poles[None, :] * step
    b = np.asarray(1j * omega[:, None] * step, dtype=np.complex128)
    series = _mean_exp(a) / _mean_exp(b) / -np.expm1(a - b)
    missed: ComplexArray = step * (1.0 / (b - a) - series)
    return missed


def _mean_exp(x: ComplexArray) -> ComplexArray:
    """(e^x - 1) / x, the mean of e^t from 0 to x."""
    return held(x, 1.0)
