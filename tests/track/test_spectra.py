"""Classes of irregularity against closed forms and numbers worked out by hand."""

import numpy as np
import pytest
from scipy.integrate import quad

from railcosim.track.irregularity import QUALITIES
from railcosim.track.irregularity.spectra import ISO_3095, ISO_CENTRES

POINT = np.array([1.0])  # rad/m


@pytest.mark.parametrize(("name", "A"), [("german-low", 4.032e-7), ("german-high", 1.08e-6)])
def test_german_variance(name, A) -> None:
    """Closed form over all wavenumbers: A Oc pi / (2 Or (Or + Oc))."""
    Oc, Or = 0.8246, 0.0206
    density = QUALITIES[name].vertical.density
    found = quad(lambda x: np.exp(x) * density(np.array([np.exp(x)]))[0], -20, 20, limit=500)[0]
    assert found == pytest.approx(A * Oc * np.pi / (2 * Or * (Or + Oc)), rel=1e-6)  # quadrature


def test_german_low_by_hand() -> None:
    """At 1 rad/m: 4.032e-7 0.8246^2 / ((1 + 0.0206^2)(1 + 0.8246^2)) = 1.6313e-7."""
    assert QUALITIES["german-low"].vertical.density(POINT)[0] == pytest.approx(1.6313e-7, rel=1e-4)


def test_german_cross_level_is_a_height() -> None:
    """The source's angle squared times the squared distance of the contact points, 1.5 m."""
    quality = QUALITIES["german-low"]
    ratio = quality.cross_level.density(POINT) / quality.vertical.density(POINT)
    # Angle: S_v b^-2 O^2 / (O^2 + Os^2); by hand at 1 rad/m with 2 b = 1.5 m: 4 / 1.191844.
    assert ratio[0] == pytest.approx(4 / (1 + 0.438**2), rel=1e-12)


def test_fra_unit_conversion() -> None:
    """Class 6 at 1 rad/m: 0.25 * 0.0339 cm2 rad/m * 0.8245^2 / (1 + 0.8245^2), in m2: 3.430e-7."""
    expected = 0.25 * 0.0339e-4 * 0.8245**2 / (1 + 0.8245**2)
    assert expected == pytest.approx(3.43e-7, rel=1e-3)
    assert QUALITIES["fra-6"].vertical.density(POINT)[0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "alignment", "gauge"),
    [("german-low", 6.1869e-7, 8.7887e-8), ("german-high", 1.7883e-6, 1.7049e-7)],
)
def test_german_alignment_and_gauge_by_hand(name, alignment, gauge) -> None:
    """At 0.5 rad/m, m2/(rad/m), with A_a 2.119e-7 and 6.125e-7, A_g 5.32e-8 and 1.032e-7 m2 rad/m.

    Alignment A Oc^2 / ((O^2 + Or^2)(O^2 + Oc^2)), gauge the same times O^2 / (O^2 + Os^2).
    """
    quality, at = QUALITIES[name], np.array([0.5])
    assert quality.alignment.density(at)[0] == pytest.approx(alignment, rel=1e-4)
    assert quality.gauge.density(at)[0] == pytest.approx(gauge, rel=1e-4)


@pytest.mark.parametrize(
    ("quantity", "wavenumber", "density"),
    [
        ("vertical", 0.01, 63.27), ("vertical", 0.03, 3.062), ("vertical", 0.1, 0.4577),
        ("vertical", 0.4, 0.009332),
        ("alignment", 0.01, 21.42), ("alignment", 0.1, 0.3790), ("alignment", 0.4, 0.009994),
        ("cross_level", 0.01, 10.32), ("cross_level", 0.1, 0.4858), ("cross_level", 0.4, 0.03124),
        ("gauge", 0.01, 2.492), ("gauge", 0.2, 0.1086), ("gauge", 0.4, 0.01265),
    ],
)  # fmt: skip
def test_chinese_ballastless_by_hand(quantity, wavenumber, density) -> None:
    """A / f^n of TB/T 3352-2014 in each piece, mm2/(1/m) at f in 1/m."""
    found = getattr(QUALITIES["ballastless"], quantity).density(2 * np.pi * np.array([wavenumber]))
    assert 1e6 * 2 * np.pi * found[0] == pytest.approx(density, rel=5e-4)  # four digits


@pytest.mark.parametrize(
    ("name", "density"),
    [("fra-1", 1.225e-5), ("fra-2", 1.030e-5), ("fra-3", 6.896e-6), ("fra-4", 5.439e-6),
     ("fra-5", 2.120e-6), ("fra-6", 3.430e-7)],
)  # fmt: skip
def test_american_classes_by_hand(name, density) -> None:
    """0.25 A_v 0.8245^2 / (1 + 0.8245^2) at 1 rad/m, m2/(rad/m)."""
    assert QUALITIES[name].vertical.density(POINT)[0] == pytest.approx(density, rel=3e-4)


def test_wavenumber_conversion() -> None:
    """S dOmega = S' dn: SNCF at n = 0.0489 1/m is A/8 in m2/(1/m), and A/8/(2 pi) in m2/(rad/m).

    By hand: 308e-6 x 0.509 / 16 pi and 308e-6 x 1.790 / 16 pi.
    """
    at = np.array([2 * np.pi * 0.0489])
    for name, expected in (("sncf-good", 3.1189e-6), ("sncf-poor", 1.09682e-5)):
        assert QUALITIES[name].vertical.density(at)[0] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(
    ("quantity", "breaks"),
    [
        ("vertical", [0.0187, 0.0474, 0.1533]),
        ("cross_level", [0.0258, 0.1163]),
        ("alignment", [0.0450, 0.1234]),
        ("gauge", [0.1090, 0.2938]),
    ],
)
def test_pieces_meet(quantity, breaks) -> None:
    """A mistyped constant would tear the pieces of the Chinese spectra apart."""
    density = getattr(QUALITIES["ballastless"], quantity).density
    for f in breaks:
        left, right = density(2 * np.pi * np.array([f * (1 - 1e-9), f * (1 + 1e-9)]))
        # The breaks have three digits: with exponents up to 4.6 that is half a per cent.
        assert left == pytest.approx(right, rel=0.01)
    # And they meet nowhere else: a moved break would tear them by a tenth.
    densities = density(2 * np.pi * np.geomspace(0.0051, 0.49, 20_000))
    assert np.abs(np.diff(np.log(densities))).max() < 0.012


def test_roughness_limit_as_printed() -> None:
    """ISO 3095:2013, dB re 1 um, at the nominal wavelengths of third octaves in cm."""
    printed = {40: 17.1, 25: 13.0, 10: 4.9, 5: -1.1, 3.15: -5.0, 2.5: -5.6, 1: -8.0, 0.315: -11.0}
    density = QUALITIES["iso-3095"].vertical.density
    for centimetres, level in printed.items():
        wavelength = centimetres / 100
        # A third octave is 23 % of its centre wide, in wavenumber as well.
        width = 2 * np.pi / wavelength * (10**0.05 - 10**-0.05)
        power = density(np.array([2 * np.pi / wavelength]))[0] * width
        # Nominal wavelengths are rounded by up to half a per cent: 0.03 dB.
        assert 10 * np.log10(power / 1e-12) == pytest.approx(level, abs=0.05)


def test_roughness_levels() -> None:
    """The density over each third octave of wavelength gives back the standard's level."""
    density = QUALITIES["iso-3095"].vertical.density
    half = 10**0.05
    for centre, level in zip(ISO_CENTRES, ISO_3095, strict=True):
        ends = 2 * np.pi / (centre * half) * (1 + 1e-9), 2 * np.pi / (centre / half) * (1 - 1e-9)
        Omega = np.linspace(*ends, 2001)
        power = np.trapezoid(density(Omega), Omega)
        assert 10 * np.log10(power / 1e-12) == pytest.approx(level, abs=1e-6)  # constant in a band
    assert density(np.array([2 * np.pi / 0.5]))[0] == 0  # beyond the standard


@pytest.mark.parametrize("name", QUALITIES)
def test_standard_deviations_are_those_of_tracks(name) -> None:
    """A unit taken for another would be off by a hundred: 0.1 to 20 mm over 3 to 25 m is a track's.

    Roughness, which ends at 0.45 m, has micrometres.
    """
    spectrum = QUALITIES[name].vertical
    Omega = np.geomspace(2 * np.pi / 25, 2 * np.pi / 3, 500)
    low, high = 1e-4, 2e-2
    if name == "iso-3095":
        Omega, low, high = np.geomspace(2 * np.pi / 0.45, 2 * np.pi / 0.003, 5000), 1e-6, 1e-4
    sigma = np.sqrt(np.trapezoid(spectrum.density(Omega), Omega))
    assert low < sigma < high
