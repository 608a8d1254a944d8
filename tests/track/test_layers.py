"""Tracks with layers: against closed forms, rolland's published tables, and finite elements whole.

A rail on what is continuous: residues of its receptance in the wavenumber. A rail on single
supports: a free rail's Green's function, and as many reactions as there are supports. Both are
formulas of textbooks; nothing of `railcosim.track` is in them but numbers of the rail.
"""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.linalg import eigh
from scipy.sparse.linalg import splu

from railcosim.mechanics.ports import Layout, Z
from railcosim.parameters import ParameterError, changed, read_toml, write_toml
from railcosim.reference.ring import build_ring
from railcosim.track.below import Crossing
from railcosim.track.decay import decay_along
from railcosim.track.files import read_track
from railcosim.track.layers import Layer
from railcosim.track.names import BUILT_IN
from railcosim.track.parameters import Fastening, Foundation, Mesh, Rail, Slab, Track
from railcosim.track.receptance import Point, direct_receptance, infinite_receptance
from railcosim.track.reduced import reduce_track
from railcosim.track.section import SPATIAL

from .test_passivity import power
from .test_reduced import direct_driving_point, driving_point

NO_SLAB = Slab(present=False)
FOUR_CELLS, TWELVE_BAYS = Mesh(cells=4, elements_per_bay=4), Mesh(cells=12, elements_per_bay=4)
SLEEPER = {"kind": "sleeper", "unsupported": 0.5}

# rolland (BSD-3-Clause, github.com/mantelmax/rolland), tests/data/data_analytical_methods.csv of
# commit c0a1ed8: |mobility| at the load, m/(N s), by frequency in Hz. Euler rail on one layer and
# on two, viscous; Timoshenko rail (kappa 0.4, G 81 GPa, loss factor 0.02) on 241 single supports
# 0.6 m apart, over the middle one, of one layer (300 MN/m, loss factor 0.25) and of two (162 kg on
# 50 MN/m, loss factor 1).
ROLLAND = np.array([
    (20.0, 3.88704301e-07, 1.12899432e-06, 2.71669096e-07, 9.63598426e-07),
    (99.51967978652435, 2.04812734e-06, 7.46124403e-06, 1.39622982e-06, 4.97305812e-06),
    (298.31887925283525, 1.27255097e-05, 6.05554023e-06, 5.92243859e-06, 2.60259005e-06),
    (596.5176784523015, 7.27065563e-06, 7.4257842e-06, 8.25801744e-06, 8.95488495e-06),
    (894.7164776517678, 4.91714766e-06, 4.92969846e-06, 4.2389917e-06, 4.25088401e-06),
    (1093.5156771180787, 4.25905521e-06, 4.26219133e-06, 7.23045553e-07, 7.37105972e-07),
    (1491.1140760507005, 3.50930079e-06, 3.50913652e-06, 4.81635487e-06, 4.8348602e-06),
])  # fmt: skip
F, CONT_1, CONT_2, SINGLE_1, SINGLE_2 = ROLLAND.T
UIC60 = {"young_modulus": 2.1e11, "mass_per_length": 60.2, "area": 76.7e-4}
THEIRS = Rail(**UIC60, poisson_ratio=2.1 / 1.62 - 1, shear_coefficient=0.4,
              second_moment=3.0383e-5, loss_factor=0.02)  # fmt: skip


def at_load(track, omega, x=0.0):
    """Deflection of a rail under equal unit forces on both, endless track."""
    both = [Point(x=x, side=s) for s in (-1, 1)]
    return infinite_receptance(track, omega, both, both[:1]).sum(axis=2)[:, 0]


def on_lines(rail, pad, layers, omega):
    """The same of a Timoshenko rail on layers (mass, EI, stiffness) per length, from the top."""
    k2, found = Polynomial([0, 1]), []
    m, EI = rail.mass_per_length, rail.bending_stiffness
    GA, rI = rail.shear_stiffness, rail.rotary_inertia
    for w in omega:
        below = (Polynomial([np.inf]), Polynomial([1.0]))  # a stiffness as a fraction: rigid ground
        for mass, bending, stiffness in reversed(layers):
            n, d = in_series(stiffness, below)
            below = (Polynomial([-mass * w**2, 0, bending]) * d + n, d)
        n, d = in_series(pad, below)
        turn = Polynomial([GA - rI * w**2, EI])
        Z = (Polynomial([-m * w**2, GA]) * turn - GA**2 * k2) * d + n * turn
        q = Z.roots()
        k = np.sqrt(q.astype(complex))
        k *= np.where(k.imag < 0, -1, 1)
        found.append(1j * np.sum((turn * d)(q) / (Z.deriv()(q) * 2 * k)))
    return np.array(found)


def in_series(stiffness, below):
    n, d = below
    if np.isinf(n.coef[0]):
        return Polynomial([stiffness]), Polynomial([1.0])
    return stiffness * n, n + stiffness * d


LOSS = 0.2


@pytest.mark.parametrize(
    "layers",
    [(), ((400.0, 0.0, 8e7),), ((400.0, 3e7, 8e7),), ((60.0, 0.0, 4e8), (900.0, 5e7, 1e8))],
    ids=["pad", "mass", "beam", "mass on beam"],
)
def test_continuous_layers_are_the_closed_form(layers):
    """With second order: elements half as long err by a quarter (16 a bay: below 0.2 %)."""
    omega, d = 2 * np.pi * np.array([5.0, 60.0, 150.0, 400.0, 900.0]), 0.6
    rail = Rail(second_moment=3.2e-5)
    exact = on_lines(
        rail, 1e8 * (1 + 1j * LOSS), [(m, EI, k * (1 + 1j * LOSS)) for m, EI, k in layers], omega
    )
    errors = []
    for elements in (8, 16):
        track = Track(
            rail=rail, slab=NO_SLAB, mesh=Mesh(elements_per_bay=elements),
            fastening=Fastening(
                continuous=True, stiffness=1e8 * d, damping=0, loss_factor=LOSS, spacing=d
            ),
            layers=tuple(
                Layer(kind="continuous", mass=m * d, bending_stiffness=EI, stiffness=k * d,
                      damping=0, loss_factor=LOSS) for m, EI, k in layers
            ),
        )  # fmt: skip
        errors.append(np.abs(at_load(track, omega) / exact - 1).max())
    assert errors[1] < 2e-3
    assert errors[0] / errors[1] > 3.5


def test_closed_form_of_an_euler_rail_is_rollands_table():
    """The formula above, of a rail that shear does not soften, gives what rolland prints."""
    omega = 2 * np.pi * F
    # Shear and rotary inertia made small by an area that is large: both go with 1/area.
    euler = Rail(**UIC60 | {"area": 76.7}, second_moment=3.0383e-5)
    pad = 3e8 + 3e4j * omega
    one = [on_lines(euler, p, [], [w])[0] for p, w in zip(pad, omega, strict=True)]
    two = [on_lines(euler, p, [(250.0, 0.0, 1e8 + 8e4j * w)], [w])[0]
           for p, w in zip(pad, omega, strict=True)]  # fmt: skip
    assert np.abs(omega * one) == pytest.approx(CONT_1, rel=1e-4)
    assert np.abs(omega * two) == pytest.approx(CONT_2, rel=1e-4)


SUPPORTS = {
    "one layer": ((), SINGLE_1),
    "two layers": (
        (Layer(kind="block", mass=162, stiffness=5e7, damping=0, loss_factor=1.0),), SINGLE_2
    ),
}  # fmt: skip


@pytest.mark.parametrize("layers", SUPPORTS)
def test_single_supports_are_rollands_table(layers):
    """Theirs is exact but for 1e-4 of its ends; ours converges to it with second order."""
    blocks, table = SUPPORTS[layers]
    errors = []
    for elements in (8, 32):
        track = Track(
            rail=THEIRS, layers=blocks, mesh=Mesh(elements_per_bay=elements),
            slab=Slab(present=False, length=0.6, joint=0.0),
            fastening=Fastening(spacing=0.6, stiffness=3e8, damping=0, loss_factor=0.25),
        )  # fmt: skip
        mobility = np.abs(2 * np.pi * F * at_load(track, 2 * np.pi * F, 0.3))
        errors.append(np.abs(mobility / table - 1).max())
    assert errors[1] < 1e-3  # measured 8e-4, at 1491 Hz
    assert errors[0] / errors[1] > 12


TRACKS = {
    "rigid sleepers": Track(slab=NO_SLAB, mesh=TWELVE_BAYS, layers=(Layer(**SLEEPER),)),
    "sleepers that bend, losses": Track(
        rail=Rail(loss_factor=0.02), fastening=Fastening(loss_factor=0.1), slab=NO_SLAB,
        mesh=TWELVE_BAYS, layers=(Layer(**SLEEPER, bending_stiffness=5e6, loss_factor=0.3),),
    ),
    "sleepers on ballast masses": Track(
        slab=NO_SLAB, mesh=TWELVE_BAYS,
        layers=(Layer(**SLEEPER), Layer(kind="block", mass=400, stiffness=8e7)),
    ),
    "sleepers on a beam": Track(
        slab=NO_SLAB, mesh=TWELVE_BAYS,
        layers=(Layer(**SLEEPER), Layer(kind="continuous", mass=400, bending_stiffness=3e7)),
    ),
    "continuous": Track(
        rail=Rail(loss_factor=0.02), fastening=Fastening(continuous=True), slab=NO_SLAB,
        mesh=TWELVE_BAYS, layers=(Layer(kind="continuous", bending_stiffness=3e7),) * 2,
    ),
    "blocks on slabs": Track(mesh=FOUR_CELLS, layers=(Layer(mass=100, stiffness=2e7),)),
    "embedded in slabs": Track(mesh=FOUR_CELLS, fastening=Fastening(continuous=True)),
    "slabs on mounts": Track(mesh=FOUR_CELLS, foundation=Foundation(stiffness=0, mounts=5)),
}  # fmt: skip
BENDING = ("sleepers that bend, losses",)


@pytest.mark.parametrize("kind", TRACKS)
def test_cells_are_the_whole_ring_in_finite_elements(kind):
    """No parity, no cells, sleepers of beam elements, whole: `railcosim.reference`."""
    track, omega = TRACKS[kind], 2 * np.pi * np.array([10.0, 150.0, 900.0])
    x = np.array([0.5, 1.5]) * track.fastening.spacing
    points = [Point(x=float(a), side=s) for s in (-1, 1) for a in x]
    got = direct_receptance(track, omega, points[:1], points)[:, :, 0]
    ring = build_ring(track, (Z,), x)
    heads = ring.heads(x)
    for w, found in zip(omega, got, strict=True):
        D = (ring.K + 1j * ring.K_loss + 1j * w * ring.C - w**2 * ring.M).tocsc()
        exact = heads @ splu(D).solve(heads[[0]].toarray()[0].astype(complex))
        # Polynomials of degree 24 or elements under a push at a point: measured 5e-5.
        limit = 2e-4 if kind in BENDING else 1e-10
        assert np.abs(found - exact).max() < limit * np.abs(exact).max()


def test_what_lies_under_one_rail_leaves_the_other_alone():
    omega, seat = 2 * np.pi * np.array([20.0, 200.0]), 0.3125
    ends = [Point(x=seat, side=s) for s in (-1, 1)]
    of = {kind: direct_receptance(TRACKS[kind], omega, ends[:1], ends)[:, :, 0]
          for kind in ("continuous", "rigid sleepers")}  # fmt: skip
    assert np.abs(of["continuous"][:, 1]).max() < 1e-12 * np.abs(of["continuous"]).max()
    assert np.abs(of["rigid sleepers"][:, 1]).max() > 1e-2 * np.abs(of["rigid sleepers"]).max()


@pytest.mark.parametrize(("parity", "lambdas"), [(0, (4.7300407, 10.995608)), (1, (7.8532046,))])
def test_a_free_sleeper_swings_as_a_free_beam(parity, lambdas):
    layer = Layer(kind="sleeper", mass=150.0, bending_stiffness=7e6, length=2.6)
    half = Crossing(
        seats=np.zeros(1), half_length=1.3, degrees=np.arange(parity, 25.0, 2), first=0, unknowns=13
    )
    M, K = half.matrices(layer)
    omega = np.sqrt(eigh(K, M, eigvals_only=True)[1 : 1 + len(lambdas)])
    exact = (np.array(lambdas) / 2.6) ** 2 * np.sqrt(7e6 / (300 / 2.6))
    assert omega == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("name", [name for name in BUILT_IN if name != "paper"])
def test_built_in_tracks_reduce_and_give_no_power(name):
    """Of a ring of 24 bays (floating: 6 slabs); the errors are those of the paper's track."""
    track = read_track(name)
    assert decay_along(track).worst(track.mesh.cells)[0] < 0.01  # what docs/track.md promises
    slabs = track.slab.present
    track = changed(track, {"mesh.cells": 6 if slabs else 24, "mesh.highest_slab_frequency": 800.0})
    body = reduce_track(track).under(Layout())
    omega = 2 * np.pi * np.array([5.0, 25.0, 80.0, 200.0, 450.0, 700.0, 900.0])
    for x in np.array([0.5, 1.0]) * track.fastening.spacing:
        found, exact = driving_point(body, omega, x), direct_driving_point(track, omega, x)
        assert np.abs(found / exact - 1).max() < 2e-3
    least, at_infinity, _ = power(
        body, track.fastening.spacing / 2 + np.array([9.6, 7.2, 2.4, 0.0])
    )
    assert least.min() > 0
    assert at_infinity > 0


def test_round_trip_and_names(tmp_path):
    track = read_track("ballasted")
    (tmp_path / "t.toml").write_text(write_toml(track, track.called), encoding="utf-8")
    assert read_toml(Track, tmp_path / "t.toml") == track
    assert changed(track, {"sleeper.stiffness": 5e7}).layers[0].stiffness == 5e7
    assert changed(track, {"layers[1].stiffness": 5e7}).layers[0].stiffness == 5e7
    with pytest.raises(ParameterError, match=r"no built-in track; these are paper, ballasted"):
        read_track("balasted")


LINE, BLOCK = Layer(kind="continuous"), Layer(kind="block")
REFUSED = {
    r"kind = 'mat': must be one of block, sleeper, continuous": {"layers": (Layer(kind="mat"),)},
    "name = 'rail': must be": {"layers": (Layer(name="rail"),)},
    "name = 'mass': must be": {"layers": (Layer(name="mass"),)},
    "name = 'a': two have it": {"layers": (Layer(name="a"), Layer(name="a"))},
    "continuous and lies on block": {"layers": (LINE, BLOCK)},
    "a sleeper on a sleeper": {"layers": (Layer(**SLEEPER), Layer(**SLEEPER))},
    "unsupported = 3 m: must be <": {"layers": (Layer(kind="sleeper", unsupported=3.0),)},
    r"must be > \[rail\] lateral_distance": {"layers": (Layer(kind="sleeper", length=1.4),)},
    "cannot lie on block": {"layers": (BLOCK,), "fastening": Fastening(continuous=True)},
    "must lie on something": {"foundation": Foundation(stiffness=0.0)},
    "a slab on one pair tips; at least 2": {"foundation": Foundation(stiffness=0.0, mounts=1)},
    r"must be within slab\.width": {"layers": (Layer(kind="sleeper", length=2.6),)},
}


@pytest.mark.parametrize("said", REFUSED)
def test_refuses_layers_that_cannot_be(said):
    with pytest.raises(ParameterError, match=said):
        Track(**REFUSED[said])


def test_is_vertical_only():
    with pytest.raises(ParameterError, match=r"sleeper: has no lateral stiffness"):
        reduce_track(read_track("ballasted"), SPATIAL)
    with pytest.raises(ParameterError, match=r"mounts alone: has no lateral stiffness"):
        reduce_track(read_track("floating"), SPATIAL)
