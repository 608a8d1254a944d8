"""Random profiles from spectra, and the spectra of profiles."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.parameters import ParameterError

from .profile import MAX_ROWS, Profile
from .quantities import ALL, DOWN, QUANTITIES, rails_of
from .spectra import QUALITIES, Quality, Spectrum
from .usual import FADE_IN

USUAL = (0.8, 50.0)  # m, wavelengths that a profile contains if nothing else is asked for
BLOCK = 100  # longest waves in a block: its lines are a hundredth of the lowest wavenumber apart
SAMPLES_PER_WAVE = 16  # of the shortest wave: a cubic spline is then within 1e-4 of it
MAX_RATIO = 1e4  # of the longest to the shortest wave: 16 million samples in a block
BEYOND = 64  # samples behind the end: the end of a spline is felt by 0.27 of it a sample
LEAST = 16  # samples of a profile whose spectrum is estimated
STREAMS = {name: k for k, name in enumerate(QUANTITIES)}  # of random numbers, one a quantity


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
    quantities: Sequence[str] = ("vertical",),
) -> Profile:
    """A random profile with the spectrum of that name.

    Class, seed and wavelengths alone decide each quantity: a longer profile begins with the same
    numbers, to the last bit, and never repeats; one of more quantities has the same of each.

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
    quantities : sequence of str
        Of `QUANTITIES`, independent of each other, or ``all`` that the class has. With the mean
        height alone both rails are alike; with others they are as coherent as `coherence` says.

    Raises
    ------
    ParameterError
        If there is no such class, it does not have a quantity, the wavelengths make no sense or
        have nothing of it, or the profile were too long.

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
    spectra = spectra_of(name, quantities)
    from scipy.fft import next_fast_len  # noqa: PLC0415 - heavy

    half = next_fast_len(math.ceil(BLOCK * longest * SAMPLES_PER_WAVE / shortest / 2), real=True)
    step = BLOCK * longest / (2 * half)
    if not 0 < length <= MAX_ROWS * step:
        raise ParameterError(
            f"length {length:g} m: must be > 0 and, with waves of {shortest:g} m, at most "
            f"{MAX_ROWS * step:g} m"
        )
    n = math.ceil(length / step) + 1 + BEYOND
    x: FloatArray = step * np.arange(n, dtype=np.float64)
    found = {
        what: _waves(_amplitudes(spectrum, wavelengths), n, half, (seed, STREAMS[what]))
        for what, spectrum in spectra.items()
    }
    level = np.zeros_like(x)
    named = ", ".join(spectra)
    return Profile(
        name=f"{name}, seed {seed}", x=x, left=level, right=level, fade=FADE_IN,
        recipe=f"{name}, seed {seed}, {shortest!r} to {longest!r} m, {named}, {step!r} m",
    ).with_rails(x, rails_of(found, level))  # fmt: skip


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


def spectra_of(name: str, quantities: Sequence[str] = (ALL,)) -> dict[str, Spectrum]:
    """Spectra of a class by quantity, in the order of `QUANTITIES`.

    Parameters
    ----------
    name : str
        A key of `QUALITIES`.
    quantities : sequence of str
        Of `QUANTITIES`, or ``all`` that it has.

    Raises
    ------
    ParameterError
        If there is no such class or quantity, or the class does not have it.
    """
    have = quality(name).spectra
    if list(quantities) == [ALL]:
        return have
    for what in quantities:
        if what not in QUANTITIES:
            raise ParameterError(
                f"no quantity {what!r} of irregularity: there are {', '.join(QUANTITIES)}, or {ALL}"
            )
        if what not in have:
            others = [key for key, one in QUALITIES.items() if what in one.spectra]
            raise ParameterError(
                f"irregularity {name!r} has no {what}, only {', '.join(have)}; "
                f"{', '.join(others)} have one"
            )
    if not quantities:
        raise ParameterError(f"irregularity {name!r}: of no quantity; it has {', '.join(have)}")
    return {what: spectrum for what, spectrum in have.items() if what in quantities}


def coherence(name: str, Omega: FloatArray, direction: str = DOWN) -> FloatArray:
    """Coherence of the left and the right rail of a class in a direction.

    With quantities independent, the rails have the density S_m + S_d / 4 each, of their mean and of
    their difference, and the cross density S_m - S_d / 4.

    Parameters
    ----------
    name : str
        A key of `QUALITIES`.
    Omega : array
        rad/m.
    direction : str
        `DOWN`, of mean height and cross-level, or `ASIDE`, of alignment and gauge.

    Returns
    -------
    array
        Squared magnitude, 0 to 1.

    Raises
    ------
    ParameterError
        If the class does not have both quantities.
    """
    both = [what for what, quantity in QUANTITIES.items() if quantity.direction == direction]
    acting = [(QUANTITIES[what], S.density(Omega)) for what, S in spectra_of(name, both).items()]
    left = np.sum([q.left**2 * S for q, S in acting], axis=0)
    right = np.sum([q.right**2 * S for q, S in acting], axis=0)
    across = np.sum([q.left * q.right * S for q, S in acting], axis=0)
    squared: FloatArray = across**2 / (left * right)
    return squared


def estimated_density(
    profile: Profile, segment: float, quantity: str = "vertical"
) -> tuple[FloatArray, FloatArray]:
    """Density of a profile by Welch's method: its check.

    Parameters
    ----------
    profile : Profile
        Synthesised or measured; one of uneven spacing is interpolated linearly.
    segment : float
        m; the longest wave that is still told apart is a third of it.
    quantity : str
        One of `Profile.quantities`.

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
    z = np.interp(x, profile.x, profile.quantities[quantity])
    from scipy.signal import welch  # noqa: PLC0415 - heavy

    n, density = welch(z, fs=1 / step, nperseg=min(round(segment / step), z.size))
    return 2 * np.pi * n[1:], density[1:] / (2 * np.pi)
