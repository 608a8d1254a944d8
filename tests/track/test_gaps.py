"""Gaps that close, in time: against the whole ring in finite elements, marched with contact."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from railcosim.analysis.response.track_words import change_of
from railcosim.mechanics.gaps import Gaps
from railcosim.mechanics.motion import FromOutside, Inputs, Mover
from railcosim.mechanics.ports import Layout, Z
from railcosim.mechanics.stepping import coefficients
from railcosim.parameters import ArgumentError, ParameterError
from railcosim.reference.ring import build_ring
from railcosim.track.layers import Layer
from railcosim.track.local import LocalChange
from railcosim.track.local_modes import with_changes
from railcosim.track.parameters import Fastening, Mesh, Rail, Slab, Track
from railcosim.track.receptance import Point, direct_receptance
from railcosim.track.reduced import reduce_track

TRACK = Track(
    rail=Rail(loss_factor=0.01), slab=Slab(present=False),
    layers=(Layer(name="block", mass=100.0, stiffness=3e7),),
    mesh=Mesh(cells=12, elements_per_bay=6, highest_frequency=4000),
    fastening=Fastening(spacing=0.6, loss_factor=0.1),
)  # fmt: skip
SEAT, GAP, FORCE = 1.5, 1e-3, 8e4  # m: the third railseat, and what hangs over it; N
BOTH = [LocalChange(what="block", x=SEAT, value=1.0, gap=GAP)]
LEFT = [LocalChange(what="block", x=SEAT, value=1.0, gap=GAP, sides=(-1,))]
LAYOUT = Layout(1)


@pytest.fixture(scope="module")
def equal():
    return reduce_track(TRACK)


def pressed(stretch, rate):
    """By one spring that never pulls."""
    block = TRACK.layers[0]
    over = stretch - GAP
    return np.where(over > 0, np.maximum(block.stiffness * over + block.damping * rate, 0.0), 0.0)


def newmark(position, step, sides):
    """Deflections of the left rail under a force on it that moves, and stretches of the gaps."""
    ring = build_ring(TRACK, (Z,), np.empty(0))
    M, K = ring.M, ring.K
    C = ring.C + ring.K_loss / (2 * np.pi * TRACK.mesh.loss_factor_frequency)
    (chain,) = ring.chains
    rails, block = 2 * chain.section.size * chain.nodes.size, TRACK.layers[0]
    B = np.zeros((K.shape[0], len(sides)))
    for i, side in enumerate(sides):
        B[rails + 2 * 2 + (side > 0), i] = 1.0
    K, C = K - block.stiffness * B @ B.T, C - block.damping * B @ B.T
    rows = ring.heads(position)[: position.size].toarray()  # the left rail's
    solve = splu(csc_array(4 / step**2 * M + 2 / step * C + K)).solve
    by_force, static = solve(B), splu(csc_array(K))
    # Open at first, which is seen to be so.
    u = static.solve(rows[0] * FORCE)
    assert (B.T @ u < GAP).all()
    v, a = np.zeros_like(u), np.zeros_like(u)
    found = [[rows[0] @ u, *(B.T @ u)]]
    for row in rows[1:]:
        right = row * FORCE + M @ (4 / step**2 * u + 4 / step * v + a) + C @ (2 / step * u + v)
        free = solve(np.asarray(right).ravel())
        # The pressing forces, by bisection of each and turns of all: no derivative of anything.
        q, F, G = B.T @ free, np.zeros(len(sides)), B.T @ by_force
        for _ in range(12):
            for i in np.flatnonzero(q > GAP):
                others = q[i] - G[i] @ F + G[i, i] * F[i]
                low, high = 0.0, 1e7
                for _ in range(50):
                    F[i] = (low + high) / 2
                    now = others - G[i, i] * F[i]
                    rate = 2 / step * (now - B[:, i] @ u) - B[:, i] @ v
                    low, high = (F[i], high) if pressed(now, rate) > F[i] else (low, F[i])
        new = free - by_force @ F
        speed = 2 / step * (new - u) - v
        a = 4 / step**2 * (new - u) - 4 / step * v - a
        u, v = new, speed
        found.append([row @ u, *(B.T @ u)])
    return np.array(found)


def rolled(body, position, step):
    mover, load = Mover(body, FromOutside(), step), np.array([FORCE, 0.0])
    state = body.at(position[:1]).rest(load)
    found = [[body.at(position[:1]).motion(state)[0], *body.gaps.stretch(state.s)]]
    for begin, end in pairwise(position):
        a, b = np.array([begin]), np.array([end])
        state = mover.step(state, Inputs(a, load), Inputs(b, load), step)
        found.append([body.at(b).motion(state)[0], *body.gaps.stretch(state.s)])
    return np.array(found)


@pytest.mark.slow  # 800 steps of three models in Python: 8 s each
@pytest.mark.parametrize(("changes", "sides"), [(BOTH, (-1, 1)), (LEFT, (-1,))])
def test_a_load_that_closes_a_gap(equal, changes, sides):
    """60 m/s, from four bays before to four bays behind; the ring's own steps are Newmark's."""
    step, speed = 1e-4, 60.0
    position = -0.9 + speed * step * np.arange(801)
    exact = newmark(position, step, sides)
    found = rolled(with_changes(TRACK, equal, changes).under(LAYOUT), position, step)
    assert exact[:, 1].max() > 1.2 * GAP  # it closes, and opens again
    assert exact[-1, 1] < GAP
    swing = np.ptp(exact, axis=0)
    # Measured 2e-2 and 6e-4. The first is 6 um: between nodes elements are that much too stiff.
    assert (np.abs(found - exact).max(axis=0)[:2] / swing[:2] < [0.025, 1e-3]).all()
    open_ = [LocalChange(what="block", x=SEAT, value=0.0, sides=changes[0].sides)]
    hangs = with_changes(TRACK, equal, open_).under(LAYOUT)
    mover, load = Mover(hangs, FromOutside(), step), np.array([FORCE, 0.0])
    state = hangs.at(position[:1]).rest(load)
    deflection = [hangs.at(position[:1]).motion(state)[0]]
    for begin, end in pairwise(position):
        a, b = np.array([begin]), np.array([end])
        state = mover.step(state, Inputs(a, load), Inputs(b, load), step)
        deflection.append(hangs.at(b).motion(state)[0])
    assert np.abs(deflection - exact[:, 0]).max() > 0.1 * swing[0]  # the gap does something


@pytest.mark.parametrize("x", [SEAT, 1.8])
def test_at_rest_it_is_the_equal_ring_less_the_gap(equal, x):
    """Closed, a spring with a gap is one without that is pulled by k times the gap."""
    body = with_changes(TRACK, equal, BOTH).under(LAYOUT)
    met, force = body.at(np.array([x])), np.array([1.6e5, 1.6e5])
    state = met.rest(force)
    assert (body.gaps.stretch(state.s) > GAP).all()
    points = [Point(x=x, side=side) for side in (-1, 1)]
    whole = direct_receptance(TRACK, np.zeros(1), points, points[:1], viscous=True)[0, 0].real.sum()
    hangs = [LocalChange(what="block", x=SEAT, value=0.0)]
    open_ = direct_receptance(TRACK, np.zeros(1), points, points[:1], changes=hangs)[
        0, 0
    ].real.sum()
    # The flexibility of waves above 4 kHz is not in the gap's modes: 8e-4. The gap counts as the
    # load at which it just closes.
    closing = GAP / (body.gaps.stretch(met_rest(equal, x))[0] / 1.6e5)
    expected = whole * (1.6e5 - closing) + open_ * closing
    assert met.motion(state)[0] == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("left", [1e-3, None])
def test_gaps_that_differ_from_side_to_side(equal, left):
    """Rails here know nothing of each other: either is as if both were as it is; or one hangs."""
    one = LocalChange(what="block", x=SEAT, value=0.0, gap=left, sides=(-1,))
    other = LocalChange(what="block", x=SEAT, value=1.0, gap=5e-4, sides=(1,))
    met, force = (
        with_changes(TRACK, equal, [one, other]).under(LAYOUT).at(np.array([1.8])),
        np.array([1.6e5, 1.6e5]),
    )
    moved = met.motion(met.rest(force))
    for side, its in enumerate((one, other)):
        alike = with_changes(TRACK, equal, [replace(its, sides=(-1, 1))]).under(LAYOUT)
        same = alike.at(np.array([1.8]))
        assert moved[side] == pytest.approx(same.motion(same.rest(force))[side], rel=1e-9)
    assert moved[0] > 1.02 * moved[1]


def met_rest(equal, x):
    hangs = with_changes(TRACK, equal, [LocalChange(what="block", x=SEAT, value=1.0, gap=1.0)])
    return hangs.under(LAYOUT).at(np.array([x])).rest(np.array([1.6e5, 1.6e5])).s


def test_nothing_is_gained():
    """A mass on a spring that falls on a stop: its energy stays, whatever the step."""
    omega, k = 50.0, 4e6
    gaps = Gaps(
        shown=np.array([[1 + 0j]]), stiffness=np.array([k]), damping=np.zeros(1),
        gap=np.array([1e-3]),
    )  # fmt: skip
    # q = Re s, s' = i omega s - i F / (m omega): a unit mass.
    gaps = Gaps(
        shown=np.array([[np.sqrt(1 / (1j * omega))]]),
        stiffness=gaps.stiffness,
        damping=gaps.damping,
        gap=gaps.gap,
    )
    poles = np.array([1j * omega])
    for h in (1e-4, 3e-3, 2e-2):
        c, s = coefficients(poles, h), np.array([4e-3 * np.sqrt(omega) * np.exp(0.3j)])
        energies = []
        for _ in range(400):
            q = gaps.stretch(s)[0]
            energies.append(omega * abs(s[0]) ** 2 / 2 + k * max(q - 1e-3, 0.0) ** 2 / 2)
            s = gaps.step(c, s, c.phi[0] * s)
        assert energies == pytest.approx(np.full(400, energies[0]), rel=1e-9)


def test_refused():
    points = [Point(x=SEAT)]
    with pytest.raises(ParameterError, match=r"block@1\.5=gap:0\.001: a gap that closes has"):
        direct_receptance(TRACK, np.ones(1), points, points, changes=BOTH)
    assert change_of(TRACK, "block@1.5=gap:1e-3") == BOTH[0]
    for text in ("block@1.5=gap:-1", "block@1.5=gap:1", "mass@1.5=gap:1e-3"):
        with pytest.raises(ArgumentError, match="must be a gap of 0 to"):
            change_of(TRACK, text)
