"""Classes of track irregularity: power spectral densities, with the units of their sources.

Sources differ in unit (cm2/(rad/m), mm2/(1/m), dB re 1 um) and in whether the density counts
negative wavenumbers as well. Both travel with the spectrum; what is asked of it is always the
one-sided density in m2/(rad/m), whose integral over positive wavenumbers is the variance.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .quantities import QUANTITIES

if TYPE_CHECKING:  # the classes are named by commands that never look into them
    from railcosim.mechanics.arrays import FloatArray

# Unit of a source to (factor to m2, wavenumber in it per rad/m).
CYCLES = 1 / (2 * math.pi)
UNITS = {
    "m2/(rad/m)": (1.0, 1.0),
    "cm2/(rad/m)": (1e-4, 1.0),
    "m2/(1/m)": (1.0, CYCLES),
    "mm2/(1/m)": (1e-6, CYCLES),
}
ORE = "ORE B176 (1989), as in Claus & Schiehlen, Vehicle System Dynamics 29 (1998) 538-552"
TB = "TB/T 3352-2014, PSD of ballastless track irregularities of high-speed railway"


@dataclass(frozen=True, kw_only=True)
class Spectrum:
    """A power spectral density over the wavenumber.

    Attributes
    ----------
    title, source : str
        What it is and where it is from.
    unit : str
        Of `native`, a key of `UNITS`: what the source has.
    sided : int
        1 if the source's integral over positive wavenumbers is the variance, 2 if half of it.
    wavelengths : tuple of float
        Shortest and longest (m) that the source gives it for; outside it is continued.
    native : callable
        Wavenumber to density, both in the source's unit, arrays.
    """

    title: str
    source: str
    unit: str
    sided: int
    wavelengths: tuple[float, float]
    native: Callable[[FloatArray], FloatArray]

    def density(self, Omega: FloatArray) -> FloatArray:
        """One-sided density.

        Parameters
        ----------
        Omega : array
            Wavenumber, rad/m, positive.

        Returns
        -------
        array
            m2/(rad/m).
        """
        import numpy as np  # noqa: PLC0415 - heavy

        area, per = UNITS[self.unit]
        # S dOmega = S' dn with n = per * Omega.
        density: FloatArray = self.sided * area * per * self.native(np.asarray(Omega) * per)
        return density


@dataclass(frozen=True, kw_only=True)
class Quality:
    """A class of track: what its irregularities are, each independent of the others.

    Attributes
    ----------
    vertical : Spectrum
        Mean height of both rails.
    cross_level, alignment, gauge : Spectrum or None
        As in `quantities.QUANTITIES`.
    """

    vertical: Spectrum
    cross_level: Spectrum | None = None
    alignment: Spectrum | None = None
    gauge: Spectrum | None = None

    @property
    def spectra(self) -> dict[str, Spectrum]:
        """Those that it has, by the name of the quantity."""
        given = {name: getattr(self, name) for name in QUANTITIES}
        return {name: spectrum for name, spectrum in given.items() if spectrum is not None}


def _german(name: str, A_v: float, A_a: float, A_g: float) -> Quality:
    """German classes, A in m2 rad/m. The source's cross-level is an ANGLE over 2 b = 1.5 m."""
    Oc, Or, Os = 0.8246, 0.0206, 0.438

    def simple(A: float) -> Callable[[FloatArray], FloatArray]:
        return lambda W: A * Oc**2 / ((W**2 + Or**2) * (W**2 + Oc**2))

    def third(A: float) -> Callable[[FloatArray], FloatArray]:
        return lambda W: A * Oc**2 * W**2 / ((W**2 + Or**2) * (W**2 + Oc**2) * (W**2 + Os**2))

    def spectrum(what: str, native: Callable[[FloatArray], FloatArray]) -> Spectrum:
        return Spectrum(
            title=f"German high-speed, {name} disturbance, {what}", source=ORE,
            unit="m2/(rad/m)", sided=1, wavelengths=(1.0, 100.0), native=native,
        )  # fmt: skip

    b = 0.75  # m; the angle's density A_v b^-2 times (2 b)^2 is that of the height difference
    return Quality(
        vertical=spectrum("vertical", simple(A_v)),
        cross_level=spectrum("cross-level", third(A_v * b**-2 * (2 * b) ** 2)),
        alignment=spectrum("alignment", simple(A_a)),
        gauge=spectrum("gauge", third(A_g)),
    )


def _powers(what: str, breaks: list[float], A: list[float], n: list[float]) -> Spectrum:
    """Chinese ballastless track: A / f^n in pieces of f (1/m), held outside 0.005 to 0.5 1/m."""

    def native(wavenumber: FloatArray) -> FloatArray:
        import numpy as np  # noqa: PLC0415 - heavy

        f = np.clip(wavenumber, 0.005, 0.5)
        piece = np.searchsorted(breaks, f)
        density: FloatArray = np.array(A)[piece] / f ** np.array(n)[piece]
        return density

    return Spectrum(
        title=f"Chinese ballastless track, {what}", source=TB, unit="mm2/(1/m)", sided=1,
        wavelengths=(2.0, 200.0), native=native,
    )  # fmt: skip


def _fra(number: int, A_v: float) -> Quality:
    """US classes 1 (worst) to 6, A_v in cm2 rad/m."""
    k, Oc = 0.25, 0.8245
    return Quality(
        vertical=Spectrum(
            title=f"FRA class {number}, vertical",
            source="Hamid & Yang, Transportation Research Record 838 (1981)",
            unit="cm2/(rad/m)",
            sided=1,
            wavelengths=(1.5, 300.0),
            native=lambda W: k * A_v * Oc**2 / (W**2 * (W**2 + Oc**2)),
        )
    )


def _sncf(name: str, factor: float) -> Quality:
    """French track, A in m2/(1/m) as 308e-6 times a factor of quality."""
    return Quality(
        vertical=Spectrum(
            title=f"SNCF, {name} track, vertical",
            source="SNCF longitudinal levelling, as in Berawi, PhD thesis, Porto 2013",
            unit="m2/(1/m)",
            sided=1,
            wavelengths=(2.0, 40.0),
            native=lambda n: 308e-6 * factor / (1 + n / 0.0489) ** 3,
        )
    )


# dB re 1 um, third octaves of wavelength from 40 cm down to 0.315 cm.
ISO_3095 = (
    17.1, 15, 13, 11, 9, 7, 4.9, 2.9, 0.9, -1.1, -3.2, -5, -5.6, -6.2, -6.8, -7.4, -8, -8.6, -9.2,
    -9.8, -10.4, -11,
)  # fmt: skip
ISO_CENTRES = tuple(10 ** ((16 - k) / 10) / 100 for k in range(len(ISO_3095)))
"""m; 10^1.6 cm is called 40 cm."""


def _roughness(wavenumber: FloatArray) -> FloatArray:
    """Roughness limit as a density (m2/(1/m)): each level spread evenly over its third octave."""
    import numpy as np  # noqa: PLC0415 - heavy

    levels = np.array(ISO_3095)
    wavelength = 1 / np.maximum(wavenumber, 1e-9)
    band = np.round(16 - 10 * np.log10(100 * wavelength)).astype(int)
    inside = (band >= 0) & (band < levels.size)
    at = np.clip(band, 0, levels.size - 1)
    width = (10**0.05 - 10**-0.05) / np.array(ISO_CENTRES)[at]
    density: FloatArray = np.where(inside, 1e-12 * 10 ** (levels[at] / 10) / width, 0.0)
    return density


QUALITIES: dict[str, Quality] = {
    "german-low": _german("low", 4.032e-7, 2.119e-7, 5.32e-8),
    "german-high": _german("high", 1.08e-6, 6.125e-7, 1.032e-7),
    "ballastless": Quality(
        vertical=_powers(
            "vertical",
            [0.0187, 0.0474, 0.1533],
            [1.0544e-5, 3.5588e-3, 1.9784e-2, 3.9488e-4],
            [3.3891, 1.9271, 1.3643, 3.4516],
        ),
        cross_level=_powers(
            "cross-level",
            [0.0258, 0.1163],
            [3.6148e-3, 4.3685e-2, 4.5867e-3],
            [1.7278, 1.0461, 2.0939],
        ),
        alignment=_powers(
            "alignment",
            [0.0450, 0.1234],
            [3.9513e-3, 1.1047e-2, 7.5633e-4],
            [1.8670, 1.5354, 2.8171],
        ),
        gauge=_powers(
            "gauge",
            [0.1090, 0.2938],
            [5.4978e-2, 5.0701e-3, 1.8778e-4],
            [0.8282, 1.9037, 4.5948],
        ),
    ),
    **{
        f"fra-{number}": _fra(number, A_v)
        for number, A_v in enumerate((1.2107, 1.0181, 0.6816, 0.5376, 0.2095, 0.0339), 1)
    },
    "sncf-good": _sncf("good", 0.509),
    "sncf-poor": _sncf("poor", 1.790),
    "iso-3095": Quality(
        vertical=Spectrum(
            title="ISO 3095 limit of rail roughness",
            source="ISO 3095:2013, figure C.1",
            unit="m2/(1/m)",
            sided=1,
            wavelengths=(0.003, 0.45),
            native=_roughness,
        )
    ),
}
