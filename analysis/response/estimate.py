"""Spectra from time records, and how two spectra differ from one third octave to the next."""

from __future__ import annotations

import numpy as np
import scipy

from railcosim.master.component import FloatArray

OVERLAP = 0.5  # of Hann segments: they then share little of what they show
INDEPENDENT = 0.947  # of overlapping segments: worth of one in degrees of freedom, Welch (1967)


def welch_psd(x: FloatArray, step: float, segment: float) -> tuple[FloatArray, FloatArray, float]:
    """Power spectral density of a record.

    Parameters
    ----------
    x : array, shape (n,)
        Samples.
    step : float
        Between them, s.
    segment : float
        Length of a segment, s.

    Returns
    -------
    frequency : array, shape (n_f,)
        Hz.
    psd : array, shape (n_f,)
        One-sided, unit squared per Hz.
    averages : float
        Number of independent segments it is worth.

    References
    ----------
    Welch, P. D. (1967), The use of fast Fourier transform for the estimation of power spectra,
    IEEE Trans. Audio Electroacoust. 15(2), 70-73.
    """
    n = min(round(segment / step), x.size)
    frequency, psd = scipy.signal.welch(
        x, fs=1 / step, window="hann", nperseg=n, noverlap=int(OVERLAP * n)
    )
    count = 1 + (x.size - n) // (n - int(OVERLAP * n))
    return frequency, psd, max(1.0, INDEPENDENT * count)


def third_octaves(frequency: FloatArray, psd: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean squares in the base-ten third octaves that a density covers wholly.

    Parameters
    ----------
    frequency : array, shape (n,)
        Increasing, spaced as you like, Hz.
    psd : array, shape (n,)
        One-sided.

    Returns
    -------
    centres, powers : array, shape (n_bands,)
        Hz (IEC 61260: 10^(k/10)), and the integral of the density over each band.
    """
    positive = frequency > 0
    f, s = frequency[positive], psd[positive]
    k = np.arange(np.ceil(10 * np.log10(f[0]) + 0.5), np.floor(10 * np.log10(f[-1]) - 0.5) + 1)
    edges = 10 ** ((np.append(k, k[-1] + 1) - 0.5) / 10) if k.size else np.empty(0)
    running = np.interp(edges, f, scipy.integrate.cumulative_trapezoid(s, f, initial=0))
    return 10 ** (k / 10), np.diff(running)


def band_difference(
    f1: FloatArray, psd1: FloatArray, f2: FloatArray, psd2: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Centres (Hz) of the third octaves both densities cover, and 10 lg(power 1 / power 2), dB.

    Infinite where one of them has no power.
    """
    (c1, p1), (c2, p2) = third_octaves(f1, psd1), third_octaves(f2, psd2)
    centres, i1, i2 = np.intersect1d(np.round(c1, 9), np.round(c2, 9), return_indices=True)
    with np.errstate(divide="ignore"):
        return centres, 10 * np.log10(p1[i1] / p2[i2])


def band_error(centres: FloatArray, segment: float, averages: float) -> FloatArray:
    """Standard error in dB of the power in third octaves estimated by `welch_psd`.

    A band of width B holds B times the segment's length independent lines (at least one; Hann's
    window makes 1.5 lines one), and every average counts again. The power is then chi-squared with
    two degrees of freedom a line.

    References
    ----------
    Bendat, J. S. & Piersol, A. G. (2010), Random Data, 4th ed., Wiley, section 8.5.
    """
    width = centres * (10**0.05 - 10**-0.05)
    lines = np.maximum(1.0, width * segment / 1.5) * averages
    error: FloatArray = 10 / np.log(10) / np.sqrt(lines)
    return error
