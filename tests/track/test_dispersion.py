"""Waves of the endless track against closed forms, the theorem of Bloch, and transfer matrices."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from numpy.polynomial import polynomial
from scipy.linalg import expm
from scipy.optimize import brentq

from railcosim.analysis.response.dispersion import _slowest
from railcosim.mechanics.ports import ROLL, Y, Z
from railcosim.plots.waves import dispersion_chart
from railcosim.track.cell import EVEN, ODD, build_cell, elements_per_bay
from railcosim.track.dispersion import bands, dispersion, fine_enough, stop_bands
from railcosim.track.layers import Layer
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Fastening, Mesh, Rail, Slab, Track
from railcosim.track.receptance import Point, infinite_receptance

K, C, SPACING = 4e7, 4e4, 0.05  # of a foundation per length, N/m2 and N s/m2
OMEGA = 2 * np.pi * np.array([20.0, 90.0, 129.0, 140.0, 400.0, 1200.0])
RIGID = Track(slab=Slab(present=False), mesh=Mesh(elements_per_bay=16))
SPACING_OF_BAYS = RIGID.fastening.spacing


def on_foundation(damping=C):
    """Railseats so near to each other that they are a foundation."""
    return Track(
        slab=Slab(present=False, length=0.5, joint=0),
        fastening=Fastening(stiffness=K * SPACING, damping=damping * SPACING, spacing=SPACING),
        mesh=Mesh(elements_per_bay=2),
    )


def timoshenko(rail, s, omega):
    """Wavenumbers with Im <= 0 of a beam with s on its deflection: see test_beam_on_foundation."""
    S, B = rail.shear_stiffness, rail.bending_stiffness
    j = S - rail.rotary_inertia * omega**2
    squared = polynomial.polyroots([s * j, S * j + s * B - S**2, S * B])
    kappa = np.sqrt(squared.astype(complex))
    return np.where(kappa.imag > 0, -kappa, kappa)


def by_decay(kappa):
    return kappa[np.argsort(-kappa.imag)]


def test_beam_on_a_foundation():
    """Both waves, complex, below and above the frequency sqrt(k / m) at which they begin to run."""
    track = on_foundation()
    found = np.stack([b.wavenumber for b in dispersion(track, OMEGA, Z, EVEN)], axis=1)
    for omega, waves in zip(OMEGA, found, strict=True):
        m = track.rail.mass_per_length
        exact = by_decay(timoshenko(track.rail, K + 1j * omega * C - m * omega**2, omega))
        kappa = by_decay(waves)
        # Below, two decay alike and run opposite ways: only that which runs ahead has its sign.
        ahead = np.where(kappa.real * exact.real < 0, -kappa.conj(), kappa)
        # Railseats 50 mm apart for a foundation: (kappa d)^4 / 720 of the stiffness; measured 4e-5.
        assert ahead == pytest.approx(exact, rel=2e-4)


def test_waves_begin_to_run_at_the_root_of_stiffness_over_mass():
    track = on_foundation(damping=0.0)
    natural = np.sqrt(K / track.rail.mass_per_length) / (2 * np.pi)
    ((low, high),) = stop_bands(track, 500.0, Z, EVEN)
    assert (low, high) == (0.0, pytest.approx(natural, rel=1e-4))  # found by halving to 1e-5


def bay_by_transfer(omega):
    """Phase of the wave of a rail on springs, by the exponential of its four equations."""
    rail, pad = RIGID.rail, RIGID.fastening
    B, S, m, J = (
        rail.bending_stiffness,
        rail.shear_stiffness,
        rail.mass_per_length,
        rail.rotary_inertia,
    )
    # d/dx of w, theta, moment B theta', shear force S (w' - theta).
    A = np.array([
        [0, 1, 0, 1 / S], [0, 0, 1 / B, 0],
        [0, -J * omega**2, 0, -1], [-m * omega**2, 0, 0, 0],
    ])  # fmt: skip
    half = expm(A * pad.spacing / 2).astype(complex)
    jump = np.eye(4, dtype=complex)
    jump[3, 0] = pad.stiffness + 1j * omega * pad.damping
    return np.linalg.eigvals(half @ jump @ half)


def test_rail_on_railseats_by_transfer_matrices():
    """No elements: the exponential of Timoshenko's equations over a bay."""
    omega = 2 * np.pi * np.array([60.0, 300.0, 900.0, 1058.0, 1090.0, 1700.0])
    fine = replace(RIGID, mesh=Mesh(elements_per_bay=32))
    found = np.stack([b.wavenumber for b in dispersion(fine, omega, Z, EVEN)], axis=1)
    for w, kappa in zip(omega, found, strict=True):
        factor = bay_by_transfer(w)
        factor = factor[np.argsort(-np.abs(factor))][2:]  # those that decay
        ours = np.exp(-1j * kappa * SPACING_OF_BAYS)
        ours = ours[np.argsort(-np.abs(ours))]
        # Of 32 elements, of second order; with 16 it is 2.2e-4.
        assert ours == pytest.approx(factor, rel=1e-4)


def test_pinned_pinned_stop_band():
    """Its lower edge: waves with nodes at railseats, a bay simply supported (Timoshenko)."""
    rail, n = RIGID.rail, np.pi / SPACING_OF_BAYS

    def pinned(f):
        w = 2 * np.pi * f
        S, B = rail.shear_stiffness, rail.bending_stiffness
        j = S - rail.rotary_inertia * w**2
        return (S * n**2 - rail.mass_per_length * w**2) * (B * n**2 + j) - S**2 * n**2

    edges = stop_bands(RIGID, 1500.0, Z, EVEN)
    assert len(edges) == 2  # below the cut-on, and this
    assert edges[1][0] == pytest.approx(brentq(pinned, 500, 1500), rel=1e-5)
    # Lateral bending has its own at 508 Hz; but torsion runs there, so that not all waves decay.
    aside = stop_bands(RIGID, 700.0, Y, EVEN)
    assert all(not low < 508.0 < high for low, high in aside)


@pytest.mark.parametrize(
    ("track", "direction", "parity"),
    [
        (replace(RIGID, mesh=Mesh(elements_per_bay=4)), Y, ODD),
        (Track(mesh=Mesh(highest_slab_frequency=500)), Z, EVEN),
    ],
)
def test_waves_are_those_of_bloch(track, direction, parity):
    """Frequency from phase, of the same cell without damping: another eigenproblem."""
    still = replace(
        track,
        fastening=replace(track.fastening, damping=0, damping_lateral=0, roll_damping=0),
        foundation=replace(track.foundation, damping=0, damping_lateral=0),
    )
    directions = (Z,) if direction is Z else (Y, ROLL)
    cell = build_cell(still, parity, directions=directions)
    natural = bands(cell, 7)
    for i, phase in enumerate(np.linspace(0, np.pi, 7)[1:-1], 1):
        f = natural[i][(natural[i] > 60) & (natural[i] < 1200)][::5]
        branches = dispersion(still, 2 * np.pi * f, direction, parity)
        kappa = np.stack([b.wavenumber for b in branches])
        factor = np.exp(-1j * kappa * cell.track.cell_length)
        off = np.abs(np.abs(np.angle(factor)) - phase) + np.abs(np.abs(factor) - 1)
        # Bands as flat as 1e-3 Hz a radian turn the rounding of a frequency into phase.
        assert np.nanmin(off, axis=0).max() < 1e-5


def test_wavenumbers_are_not_folded():
    """Those of a free rail, far above the resonance on its railpads, whatever the cell."""
    f = np.array([1500.0, 1800.0])
    for track in (Track(), RIGID, replace(RIGID, fastening=Fastening(stiffness=1e6, damping=1e3))):
        fine = fine_enough(track, 1800.0, Z)
        found = dispersion(fine, 2 * np.pi * f, Z, EVEN)[0].wavenumber
        for omega, kappa in zip(2 * np.pi * f, found, strict=True):
            free = timoshenko(Rail(), -60.64 * omega**2, omega).real.max()
            assert kappa.real == pytest.approx(free, rel=0.02)  # 2 pi / 5 m would be 20 %


def test_no_slab_tilts_no_rails():
    tilts, upright = (
        replace(RIGID, slab=Slab(present=False, tilts_rails=t)) for t in (True, False)
    )
    omega = 2 * np.pi * np.array([200.0, 700.0])
    found = [dispersion(track, omega, Y, ODD) for track in (tilts, upright)]
    assert [b.motion for b in found[0]] == [b.motion for b in found[1]]
    here = [Point(x=0.3125, direction=Z)]
    change = LocalChange(what="fastening", x=0.3125, value=0.0)
    infinite_receptance(tilts, omega, here, here, changes=[change])  # is not refused


def test_a_wave_that_travels_is_one_in_chart_and_table():
    """Of waves that decay by 0.19 and 0.21 of their wavenumber the first is drawn and told."""
    f = np.array([100.0, 200.0])
    axis = ("frequency", f)
    kappa = [np.array([1.0, 2.0]) * (1 - part * 1j) for part in (0.19, 0.21)]
    waves = xr.Dataset({"frequency": axis}, attrs={"stop_bands": np.empty(0), "title": ""})
    for i, k in enumerate(kappa):
        waves[f"wave[{i}].wavenumber"] = "frequency", k, {"long_name": str(i)}
        waves[f"wave[{i}].decay"] = "frequency", -k.imag
    drawn = [np.isfinite(c.y).all() for c in dispersion_chart(waves).rows[0][0].curves]
    assert drawn == [True, False]
    assert [bool(_slowest(f, k[None])) for k in kappa] == [True, False]


def test_fine_enough_for_a_layer_that_bends_more_than_the_rail():
    limp = Layer(kind="continuous", mass=200.0, bending_stiffness=1e4)
    k = (limp.mass / SPACING_OF_BAYS * (2 * np.pi * 500) ** 2 / limp.bending_stiffness) ** 0.25
    at = fine_enough(replace(RIGID, layers=(limp,)), 500.0, Z)
    least = 12 * k * SPACING_OF_BAYS / (2 * np.pi)
    assert 16 < least <= at.mesh.elements_per_bay < least + 4


def test_fine_enough():
    """Twelve elements to the shortest wave, of torsion if asked for; no fewer than given."""
    assert fine_enough(Track(), 500.0, Z).mesh.elements_per_bay == 8
    at = fine_enough(Track(), 5000.0, Y)
    k = 2 * np.pi * 5000 * np.sqrt(at.rail.polar_inertia / at.rail.torsional_rigidity)
    for direction in (Z, Y):  # what is told is what there is
        length = at.fastening.spacing / elements_per_bay(at, (direction,))
        nodes = build_cell(at, EVEN, directions=(direction,)).nodes
        assert np.diff(nodes) == pytest.approx(length, rel=1e-9)
    needed = 12 * k * at.fastening.spacing / (2 * np.pi)
    # Sixteen a step: quarters of what [mesh] has, and four times as many aside.
    assert 32 < needed <= elements_per_bay(at, (Y,)) < needed + 16
    assert fine_enough(Track(mesh=Mesh(elements_per_bay=64)), 10.0, Z).mesh.elements_per_bay == 64
