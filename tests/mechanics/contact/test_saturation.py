"""Saturation and FASTSIM: published creep curves, closed forms, convergence, no energy given."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipe, ellipkm1

from railcosim.mechanics.contact.creep import LINEAR, Patch
from railcosim.mechanics.contact.fastsim import Fastsim
from railcosim.mechanics.contact.numbers import derivatives
from railcosim.mechanics.contact.saturation import Saturated

# An example of CONTACT: a/b = 0.5, mu N 35.21 kN.
K, E = ellipkm1(0.25), ellipe(0.75)  # Johnson 4.26: b/a of the curvatures
PATCH = Patch.of(1.6, 1.6 * (K - E) / (4 * E - K), shear_modulus=82e9, poisson_ratio=0.28)
N, FRICTION = 106.7e3, 35.21 / 106.7
CREEPAGES = [4e-4, 1.2e-3, 2e-3, 2.8e-3, 4e-3]
FULL = [9112, 22820, 31040, 34620, 35180]
THEIR_FASTSIM = [9075, 22110, 29690, 33470, 35130]
THEIR_SHEN = [8863, 21870, 29687, 33635, 35194]
SHEN, FASTSIM = Saturated(friction=FRICTION), Fastsim(friction=FRICTION)
ALL = pytest.mark.parametrize("law", [LINEAR, SHEN, FASTSIM], ids=["linear", "Shen", "FASTSIM"])
BOUND = pytest.mark.parametrize("law", [SHEN, FASTSIM], ids=["Shen", "FASTSIM"])


def force(law, *creepages):
    creepage = np.array(creepages, float)
    return law.force(PATCH, np.full(len(creepage), N), creepage)


def along(law):
    return -force(law, *[[x, 0, 0] for x in CREEPAGES])[:, 0]


def test_the_patch_is_theirs():
    assert PATCH.ellipse.ratio == pytest.approx(0.5, rel=2e-4)


def test_published_creep_curve_by_shen():
    assert along(SHEN) == pytest.approx(THEIR_SHEN, rel=2e-4)  # their digits, and those of a/b
    assert along(SHEN) == pytest.approx(FULL, rel=0.05)


def test_published_creep_curve_by_fastsim():
    """Theirs has 48 x 44 elements and is 3 % stiffer at little creep than the converged theory."""
    assert along(FASTSIM) == pytest.approx(THEIR_FASTSIM, rel=0.03)
    # Where about half of the ellipse slips, the simplified theory is 5.5 % below the full one.
    assert along(FASTSIM) == pytest.approx(FULL, rel=0.06)


def strips_in_closed_form(creepage):
    """Force of the simplified theory along, a strip's integral by hand, the ellipse's by quad."""
    a, b = (float(s) for s in PATCH.ellipse.semi_axes(np.array(N)))
    greatest = FRICTION * 2 * N / (np.pi * a * b)
    L = 8 * a / (3 * 82e9 * float(PATCH.kalker.C11))
    w = creepage * a / (L * greatest)

    def strip(y):
        h = np.sqrt(1 - y**2)
        if w >= 2 * h:
            return 4 / 3 * h**3
        begin = w - h  # of the slip, towards the trailing edge at -h
        return w * (2 * h - w) ** 2 / 2 + h**2 * w - (begin**3 + h**3) / 3

    ends = [np.sqrt(max(1 - (w / 2) ** 2, 0))]
    whole = quad(strip, 0, 1, points=ends, epsabs=1e-13)[0] * 2
    return whole * greatest * a * b


def test_fastsim_against_the_closed_form():
    for x in CREEPAGES:
        fine = Fastsim(friction=FRICTION, slices=800, strips=100)
        assert -force(fine, [x, 0, 0])[0, 0] == pytest.approx(strips_in_closed_form(x), rel=2e-5)


def errors_of(settings, exact):
    """Over the resultant, and the moment over the resultant times the ellipse's size."""
    creepage = [8e-4, -6e-4, 0.3]
    true = force(Fastsim(friction=FRICTION, **exact), creepage)[0]
    a, b = PATCH.ellipse.semi_axes(np.array(N))
    size = np.hypot(*true[:2]) * np.array([1, 1, np.sqrt(a * b)])
    found = [force(Fastsim(friction=FRICTION, **one), creepage)[0] for one in settings]
    return [np.abs((one - true) / size).max() for one in found]


def test_fastsim_converges_in_slices():
    settings = [{"slices": n, "strips": 20} for n in (20, 40, 80, 160)]
    errors = errors_of(settings, {"slices": 1280, "strips": 20})
    assert errors[1] < 1.5e-2  # with the 40 that are taken if nothing is said
    # First order: where it slips, the traction is turned after each slice, not within it.
    assert np.log2(errors[0] / errors[-1]) / 3 > 0.85


def test_fastsim_converges_in_strips():
    settings = [{"strips": n} for n in (10, 20, 40)]
    errors = errors_of(settings, {"strips": 320})
    assert errors[1] < 3e-3  # with the 20 that are taken
    assert errors[2] < errors[0] / 4


@BOUND
def test_little_creep_is_linear(law):
    few = np.array([[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 1e-6]])
    linear, found = force(LINEAR, *few), force(law, *few)
    assert found[0, 0] == pytest.approx(linear[0, 0], rel=2e-3)  # of the slices
    assert found[1, 1] == pytest.approx(linear[1, 1], rel=2e-3)
    assert found[2, 1] == pytest.approx(linear[2, 1], rel=2e-3)
    # The simplified theory has moments of its own, of the same sign.
    assert np.sign(found[1:, 2]).tolist() == np.sign(linear[1:, 2]).tolist()


@BOUND
@pytest.mark.parametrize("way", [[1, 0], [0, 1], [-0.6, 0.8]])
def test_sliding_is_coulombs(law, way):
    found = force(law, [*(0.5 * np.array(way)), 0])[0]
    assert np.hypot(*found[:2]) == pytest.approx(FRICTION * N, rel=2e-3)  # of slices and strips
    # Its direction is that of the flexibilities, which are not alike along and across.
    towards = np.array(way) * [float(PATCH.kalker.C11), float(PATCH.kalker.C22)]
    assert found[:2] / (FRICTION * N) == pytest.approx(-towards / np.hypot(*towards), abs=2e-3)


@BOUND
def test_never_beyond_friction(law):
    creepage = np.random.default_rng(1).normal(size=(400, 3)) * [5e-3, 5e-3, 3]
    found = force(law, *creepage)
    assert np.hypot(found[:, 0], found[:, 1]).max() <= FRICTION * N * (1 + 2e-3)  # of strips


@ALL
def test_creep_only_takes(law):
    random = np.random.default_rng(2)
    size = 10 ** random.uniform(-3, 1, size=(1000, 1))
    creepage = random.normal(size=(1000, 3)) * [2e-3, 2e-3, 0.3] * size
    found = force(law, *creepage)
    assert (creepage * found).sum(axis=1).max() <= 0


@ALL
def test_without_a_load_there_is_no_creep(law):
    found = law.force(PATCH, np.zeros(2), np.array([[1e-3, 2e-3, 0.1], [0, 0, 0]]))
    assert np.count_nonzero(found) == 0


@ALL
def test_derivatives(law):
    creepage = np.array([[3e-4, -2e-4, 0.1], [2e-3, 3e-3, -0.4], [0.02, 0.0, 1.0]])
    loads = np.full(3, N)
    by = derivatives(lambda x: law.force(PATCH, loads + 0j, x), creepage)
    for j, h in enumerate((1e-9, 1e-9, 1e-6)):
        step = h * np.eye(3)[j]
        ahead, behind = (law.force(PATCH, loads, creepage + s * step) for s in (1, -1))
        difference = (ahead - behind) / (2 * h)
        size = np.abs(by[..., j]).max()
        assert by[..., j] == pytest.approx(difference, rel=1e-5, abs=1e-6 * size)


def test_shen_doubles_what_spin_makes():
    """A wheel of 0.43 m on a head of 0.3 m at 2 rad/m: halves slip against each other.

    Shen takes the linear force of spin and does not know that.
    """
    patch = Patch.of(1 / 0.43, 1 / 0.3, shear_modulus=2.059e11 / 2.6, poisson_ratio=0.3)
    shen, fast = (
        law(friction=0.3).force(patch, np.array([79265.0]), np.array([[0, 0, 2.0]]))[0, 1]
        for law in (Saturated, Fastsim)
    )
    assert shen / fast == pytest.approx(2, abs=0.3)
