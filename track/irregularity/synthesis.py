"""Random profiles from spectra, and the spectra of profiles."""

from __future__ import annotations

import numpy as np
from scipy.signal import welch

from railcosim.parameters import ParameterError

from .profile import Profile
from .spectra import QUALITIES, FloatArray, Quality, Spectrum

USUAL = (0.8, 50.0)  # m, wavelengths that a profile contains if nothing else is asked for
PERIOD = 1000.0  # m; a synthesised profile up to this long is a part of one and the same
SAMPLES_PER_WAVE = 16  # of the shortest wave: a cubic spline is then within 1e-4 of it


def quality(name: str) -> Quality:
    """A class of track by its name; ParameterError if there is none."""
    if name not in QUALITIES:
        raise ParameterError(
            f"unknown irregularity {name!r}: allowed are none, {', '.join(QUALITIES)}, or a .csv "
            "file"
        )
    return QUALITIES[name]


def synthesise(
    name: str,
    length: float,
    seed: int = 1,
    *,
    wavelengths: tuple[float, float] = USUAL,
    coherent: bool = True,
) -> Profile:
    """A random profile with the spectrum of that name.

    Parameters
    ----------
    name : str
        A key of `QUALITIES`.
    length : float
        m.
    seed : int
        Of the random phases.
    wavelengths : tuple of float
        Shortest and longest that the profile contains, m.
    coherent : bool
        Both rails alike; otherwise they differ by the cross-level of the class, half of it on
        each, and are as coherent as `coherence` says.

    Raises
    ------
    ParameterError
        If there is no such class, it has no cross-level, or the wavelengths make no sense.

    References
    ----------
    Shinozuka, M. & Jan, C.-M. (1972), Digital simulation of random processes and its applications,
    J. Sound Vib. 25(1), 111-128.
    """
    shortest, longest = wavelengths
    if not 0 < shortest < longest <= PERIOD:
        raise ParameterError(
            f"wavelengths {shortest:g} to {longest:g} m: must be > 0, increasing, to {PERIOD:g} m"
        )
    vertical, cross_level = quality(name).vertical, None if coherent else _cross_level(name)
    step = shortest / SAMPLES_PER_WAVE
    # Whole periods, so that runs of different length meet the same profile.
    n = int(np.ceil(length / PERIOD)) * round(PERIOD / step)
    random = np.random.default_rng(seed)
    mean = _waves(vertical, n, step, wavelengths, random)
    half = 0.0 if cross_level is None else _waves(cross_level, n, step, wavelengths, random) / 2
    keep = min(int(np.ceil(length / step)) + 1, n)
    x: FloatArray = step * np.arange(keep, dtype=np.float64)
    left, right = (mean + half)[:keep], (mean - half)[:keep]
    return Profile(name=f"{name}, seed {seed}", x=x, left=left, right=right)


def _waves(
    spectrum: Spectrum,
    n: int,
    step: float,
    wavelengths: tuple[float, float],
    random: np.random.Generator,
) -> FloatArray:
    """Sum of waves of random phase over n samples, whose mean squares are the density's."""
    dO = 2 * np.pi / (n * step)
    wavenumber: FloatArray = dO * np.arange(n // 2 + 1, dtype=np.float64)
    shortest, longest = wavelengths
    inside = (wavenumber >= 2 * np.pi / longest) & (wavenumber <= 2 * np.pi / shortest)
    amplitude = np.zeros_like(wavenumber)
    amplitude[inside] = np.sqrt(2 * spectrum.density(wavenumber[inside]) * dO)
    phase = random.uniform(0, 2 * np.pi, wavenumber.size)
    waves: FloatArray = np.fft.irfft(amplitude * np.exp(1j * phase), n) * n / 2
    return waves


def _cross_level(name: str) -> Spectrum:
    spectrum = quality(name).cross_level
    if spectrum is None:
        have = [key for key, q in QUALITIES.items() if q.cross_level is not None]
        raise ParameterError(
            f"irregularity {name!r} has no cross-level, so both rails are alike; {', '.join(have)} "
            "have one"
        )
    return spectrum


def coherence(name: str, Omega: FloatArray) -> FloatArray:
    """Coherence of the left and the right rail of a class with cross-level.

    With mean height and cross-level independent, both rails have the density S_v + S_c / 4 and the
    cross density S_v - S_c / 4.

    Parameters
    ----------
    name : str
        A key of `QUALITIES`.
    Omega : array
        rad/m.

    Returns
    -------
    array
        Squared magnitude, 0 to 1.
    """
    S_v, S_c = quality(name).vertical.density(Omega), _cross_level(name).density(Omega)
    squared: FloatArray = ((S_v - S_c / 4) / (S_v + S_c / 4)) ** 2
    return squared


def estimated_density(profile: Profile, segment: float) -> tuple[FloatArray, FloatArray]:
    """Density of a profile's left rail by Welch's method: the check of a profile.

    Parameters
    ----------
    profile : Profile
        Synthesised or measured; one of uneven spacing is interpolated linearly.
    segment : float
        m; the longest wave that is still told apart is a third of it.

    Returns
    -------
    Omega : array, shape (n,)
        rad/m, without zero.
    S : array, shape (n,)
        One-sided, m2/(rad/m).
    """
    step = float(np.diff(profile.x).min())
    x = np.arange(profile.x[0], profile.x[-1] + step / 2, step)
    z = np.interp(x, profile.x, profile.left)
    n, density = welch(z, fs=1 / step, nperseg=min(round(segment / step), z.size))
    return 2 * np.pi * n[1:], density[1:] / (2 * np.pi)
