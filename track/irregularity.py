"""Vertical track irregularity: power spectral densities, profiles made from them, measured ones."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from railcosim.parameters import ParameterError

FloatArray = NDArray[np.float64]

SHORTEST, LONGEST = 0.8, 50.0  # m, wavelengths that a synthesised profile contains
PERIOD = 1000.0  # m; a synthesised profile up to this long is a part of one and the same
SAMPLES_PER_WAVE = 16  # of the shortest wave: a cubic spline is then within 1e-4 of it
MAX_ROWS = 5_000_000  # of a measured profile: 1000 km at 0.2 m


@dataclass(frozen=True, kw_only=True)
class Spectrum:
    """A one-sided power spectral density over the wavenumber.

    Attributes
    ----------
    title, source : str
        What it is and where it is from.
    density : callable
        Omega (rad/m) to S (m2/(rad/m)), arrays; the variance is the integral over Omega > 0.
    """

    title: str
    source: str
    density: Callable[[FloatArray], FloatArray]


def _german(A_v: float) -> Callable[[FloatArray], FloatArray]:
    """A_v Oc^2 / ((O^2 + Or^2)(O^2 + Oc^2)), A_v in m2 rad/m."""
    Oc, Or = 0.8246, 0.0206

    def density(wavenumber: FloatArray) -> FloatArray:
        squared = wavenumber**2
        return A_v * Oc**2 / ((squared + Or**2) * (squared + Oc**2))

    return density


def _ballastless(wavenumber: FloatArray) -> FloatArray:
    """S = A / f^n in mm2/(1/m), piecewise in f (1/m), held outside 0.005 to 0.5 1/m."""
    f = np.clip(wavenumber / (2 * np.pi), 0.005, 0.5)
    piece = np.searchsorted([0.0187, 0.0474, 0.1533], f)
    A = np.array([1.0544e-5, 3.5588e-3, 1.9784e-2, 3.9488e-4])[piece]
    n = np.array([3.3891, 1.9271, 1.3643, 3.4516])[piece]
    density: FloatArray = A / f**n * 1e-6 / (2 * np.pi)
    return density


SPECTRA = {
    "german-low": Spectrum(
        title="German high-speed, low disturbance",
        source="ORE B176; Claus & Schiehlen 1998",
        density=_german(4.032e-7),
    ),
    "german-high": Spectrum(
        title="German high-speed, high disturbance",
        source="ORE B176; Claus & Schiehlen 1998",
        density=_german(1.08e-6),
    ),
    "ballastless": Spectrum(
        title="Chinese ballastless track", source="TB/T 3352-2014", density=_ballastless
    ),
}


@dataclass(frozen=True, kw_only=True)
class Profile:
    """Height of both rails along the track, below nominal (down positive).

    Attributes
    ----------
    name : str
        Where it is from.
    x : array, shape (n,)
        Increasing, m.
    left, right : array, shape (n,)
        m.
    """

    name: str
    x: FloatArray
    left: FloatArray
    right: FloatArray

    def under(self, start: FloatArray, speed: float, fade: float) -> Callable[[float], FloatArray]:
        """Irregularity under four wheelsets that start at `start` (m) with `speed` (m/s).

        Ahead of the first wheelset the profile fades in over a length, so that a run starts from
        rest without a bump; behind its ends it is flat.

        Returns
        -------
        callable
            Time (s) to heights, left 1..4, right 1..4, m.
        """
        front = float(start.max())
        window = np.clip((self.x - self.x[0]) / fade, 0, 1) if fade > 0 else np.ones_like(self.x)
        window = 0.5 - 0.5 * np.cos(np.pi * window)
        z = np.stack([self.left, self.right], axis=1) * window[:, None]
        spline = CubicSpline(self.x - self.x[0] + front, z)
        first, last = spline.x[0], spline.x[-1]

        def heights(t: float) -> FloatArray:
            at: FloatArray = spline(np.clip(start + speed * t, first, last)).T.ravel()
            return at

        return heights


def synthesise(name: str, length: float, seed: int = 1) -> Profile:
    """A random profile with the spectrum of that name, alike on both rails.

    Parameters
    ----------
    name : str
        A key of `SPECTRA`.
    length : float
        m.
    seed : int
        Of the random phases.

    References
    ----------
    Shinozuka, M. & Jan, C.-M. (1972), Digital simulation of random processes and its applications,
    J. Sound Vib. 25(1), 111-128.
    """
    if name not in SPECTRA:
        raise ParameterError(
            f"unknown irregularity {name!r}: allowed are none, {', '.join(SPECTRA)}, or a .csv file"
        )
    step = SHORTEST / SAMPLES_PER_WAVE
    # Whole periods, so that runs of different length meet the same profile.
    n = int(np.ceil(length / PERIOD)) * round(PERIOD / step)
    dO = 2 * np.pi / (n * step)
    wavenumber: FloatArray = dO * np.arange(n // 2 + 1, dtype=np.float64)
    longest, shortest = 2 * np.pi / LONGEST, 2 * np.pi / SHORTEST
    inside = (wavenumber >= longest) & (wavenumber <= shortest)
    amplitude = np.zeros_like(wavenumber)
    amplitude[inside] = np.sqrt(2 * SPECTRA[name].density(wavenumber[inside]) * dO)
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, wavenumber.size)
    z = np.fft.irfft(amplitude * np.exp(1j * phase), n) * n / 2
    keep = int(np.ceil(length / step)) + 1
    x: FloatArray = step * np.arange(keep, dtype=np.float64)
    return Profile(name=f"{name}, seed {seed}", x=x, left=z[:keep], right=z[:keep])


def read_profile(path: Path) -> Profile:
    """A measured profile: a CSV file with the columns x, left and (optional) right, all in m.

    Lines that begin with ``#`` are comments. Without `right` both rails are alike.

    Raises
    ------
    ParameterError
        Naming the file, the line and what is wrong.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ParameterError(f"{path}: cannot be read: {error}") from error
    numbered = [(k, line) for k, line in enumerate(lines, 1) if line.strip() and line[0] != "#"]
    if len(numbered) > MAX_ROWS:
        raise ParameterError(f"{path}: over {MAX_ROWS} rows")
    header = [cell.strip() for cell in numbered[0][1].split(",")] if numbered else []
    if header not in (["x", "left"], ["x", "left", "right"]):
        raise ParameterError(f"{path}: the header must be x,left,right (or x,left), in m")
    rows = []
    for (number, _), cells in zip(
        numbered[1:], csv.reader(t for _, t in numbered[1:]), strict=True
    ):
        try:
            row = [float(cell) for cell in cells]
        except ValueError as error:
            raise ParameterError(f"{path}, line {number}: {error}") from error
        if len(row) != len(header) or not np.isfinite(row).all():
            raise ParameterError(f"{path}, line {number}: {len(header)} finite numbers are wanted")
        rows.append(row)
    table = np.array(rows)
    if len(rows) < 4 or (np.diff(table[:, 0]) <= 0).any():
        raise ParameterError(f"{path}: x must increase, over four rows at least")
    return Profile(name=path.name, x=table[:, 0], left=table[:, 1], right=table[:, -1])


def flat(length: float) -> Profile:
    """No irregularity."""
    x = np.linspace(0, max(length, 1.0), 4)
    return Profile(name="none", x=x, left=np.zeros(4), right=np.zeros(4))
