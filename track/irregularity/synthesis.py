"""Random profiles from spectra, and the spectra of profiles."""

from __future__ import annotations

import math

import numpy as np

from railcosim.parameters import ParameterError

from .profile import MAX_ROWS, FloatArray, Profile
from .spectra import QUALITIES, Quality, Spectrum
from .usual import FADE_IN

USUAL = (0.8, 50.0)  # m, wavelengths that a profile contains if nothing else is asked for
BLOCK = 100  # longest waves in a block: its lines are a hundredth of the lowest wavenumber apart
SAMPLES_PER_WAVE = 16  # of the shortest wave: a cubic spline is then within 1e-4 of it
MAX_RATIO = 1e4  # of the longest to the shortest wave: 16 million samples in a block
BEYOND = 64  # samples behind the end: the end of a spline is felt by 0.27 of it a sample
LEAST = 16  # samples of a profile whose spectrum is estimated


def quality(name: str) -> Quality:
    """A class of track by its name; ParameterError if there is none."""
    if name not in QUALITIES:
        raise ParameterError(f"no class of track {name!r}: there are {', '.join(QUALITIES)}")
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

    Class, seed and wavelengths alone decide it: a longer one begins with the same numbers, to the
    last bit, and never repeats.

    Parameters
    ----------
    name : str
        A key of `QUALITIES`.
    length : float
        At least, m. There is a little more, so that a spline through the samples does not feel the
        end either.
    seed : int
        Of the random phases.
    wavelengths : tuple of float
        Shortest and longest that the profile contains, m.
    coherent : bool
        Both rails alike; otherwise they differ by the cross-level of the class, half of it on
        each, and are as coherent as `coherence` says. Their mean is the same profile.

    Raises
    ------
    ParameterError
        If there is no such class, it has no cross-level, the wavelengths make no sense or have
        nothing of it, or the profile were too long.

    Notes
    -----
    Blocks of 100 longest waves overlap by half. Each is a sum of waves of random phase [1]_, whose
    mean squares are the integrals of the density over their lines; it fades in as a sine and out as
    a cosine. The squares of both add up to one, so the variance is the integral of the density
    everywhere. What is lost is the resolution in wavenumber beyond a line or two.

    References
    ----------
    .. [1] Shinozuka, M. & Jan, C.-M. (1972), Digital simulation of random processes and its
       applications, J. Sound Vib. 25(1), 111-128.
    """
    shortest, longest = wavelengths
    if not (0 < shortest < longest < math.inf and longest <= MAX_RATIO * shortest):
        raise ParameterError(
            f"wavelengths {shortest:g} to {longest:g} m: must be > 0 and increase, by a factor of "
            f"{MAX_RATIO:g} at most"
        )
    if seed < 0:
        raise ParameterError(f"seed {seed}: must be >= 0")
    vertical, cross_level = quality(name).vertical, None if coherent else _cross_level(name)
    from scipy.fft import next_fast_len  # noqa: PLC0415 - heavy

    half = next_fast_len(math.ceil(BLOCK * longest * SAMPLES_PER_WAVE / shortest / 2), real=True)
    step = BLOCK * longest / (2 * half)
    if not 0 < length <= MAX_ROWS * step:
        raise ParameterError(
            f"length {length:g} m: must be > 0 and, with waves of {shortest:g} m, at most "
            f"{MAX_ROWS * step:g} m"
        )
    n = math.ceil(length / step) + 1 + BEYOND
    mean = _waves(_amplitudes(vertical, wavelengths), n, half, (seed, 0))
    apart: FloatArray | float = 0.0
    if cross_level is not None:
        apart = _waves(_amplitudes(cross_level, wavelengths), n, half, (seed, 1)) / 2
    x: FloatArray = step * np.arange(n, dtype=np.float64)
    rails = "alike" if coherent else "apart"
    return Profile(
        name=f"{name}, seed {seed}", x=x, left=mean + apart, right=mean - apart, fade=FADE_IN,
        recipe=f"{name}, seed {seed}, {shortest!r} to {longest!r} m, rails {rails}, {step!r} m",
    )  # fmt: skip


def _amplitudes(spectrum: Spectrum, wavelengths: tuple[float, float]) -> FloatArray:
    """Amplitudes of lines k / (block length): the power from half a line below to half above.

    What of that is outside the wavelengths does not count, so that all lines together have the
    integral of the density.
    """
    shortest, longest = wavelengths
    first, last = 2 * np.pi / longest, 2 * np.pi / shortest
    line = first / BLOCK
    middle: FloatArray = np.arange(round(last / line) + 2, dtype=np.float64)
    low, high = np.clip([(middle - 0.5) * line, (middle + 0.5) * line], first, last)
    # A line is a hundredth of its wavenumber wide at most: two points of Gauss give 1e-8.
    points, weights = np.polynomial.legendre.leggauss(2)
    at = (low + high)[:, None] / 2 + (high - low)[:, None] / 2 * points
    power = spectrum.density(at) @ weights * (high - low) / 2
    if not power.any():
        given = " to ".join(f"{wave:g}" for wave in spectrum.wavelengths)
        raise ParameterError(
            f"{spectrum.title}: has no waves between {shortest:g} and {longest:g} m, it is given "
            f"for {given} m"
        )
    amplitudes: FloatArray = np.sqrt(2 * power)
    return amplitudes


def _waves(amplitudes: FloatArray, n: int, half: int, seed: tuple[int, ...]) -> FloatArray:
    """The first n samples of blocks of two halves, each with random phases of its own."""
    window = np.sin(np.pi / (2 * half) * np.arange(2 * half))
    blocks = math.ceil(n / half) + 1
    z = np.zeros((blocks + 1) * half)
    for block in range(blocks):
        random = np.random.default_rng((*seed, block))
        phase = random.uniform(0, 2 * np.pi, amplitudes.size)
        waves = np.fft.irfft(amplitudes * np.exp(1j * phase), 2 * half) * half
        z[block * half : (block + 2) * half] += window * waves
    return z[half : half + n]


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

    Raises
    ------
    ParameterError
        If the profile has too few samples.
    """
    step = max(float(np.diff(profile.x).min()), profile.length / MAX_ROWS)
    x = np.arange(profile.x[0], profile.x[-1] + step / 2, step)
    if min(x.size, round(segment / step)) < LEAST:
        raise ParameterError(
            f"irregularity {profile.name}: {x.size} samples are too few for a spectrum"
        )
    z = np.interp(x, profile.x, profile.left)
    from scipy.signal import welch  # noqa: PLC0415 - heavy

    n, density = welch(z, fs=1 / step, nperseg=min(round(segment / step), z.size))
    return 2 * np.pi * n[1:], density[1:] / (2 * np.pi)
