"""Hanging and soft fastenings in time: the reduced ring against the whole one in finite elements.

Its matrices are changed by hand, and it is marched by Newmark under a load that moves.
"""

from itertools import pairwise

import numpy as np
import pytest
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from railcosim.mechanics.motion import FromOutside, Inputs, Mover
from railcosim.mechanics.ports import Layout, Z
from railcosim.mechanics.stepping import State
from railcosim.parameters import ParameterError
from railcosim.reference.ring import build_ring
from railcosim.track.layers import Layer
from railcosim.track.local import LocalChange
from railcosim.track.local_modes import with_changes
from railcosim.track.parameters import Fastening, Mesh, Rail, Slab, Track
from railcosim.track.receptance import Point, direct_receptance
from railcosim.track.reduced import reduce_track

D = 0.6  # m, spacing
TRACK = Track(
    rail=Rail(loss_factor=0.01), slab=Slab(present=False),
    layers=(Layer(name="block", mass=100.0, stiffness=3e7),),
    mesh=Mesh(cells=12, elements_per_bay=6, highest_frequency=4000),
    fastening=Fastening(spacing=D, loss_factor=0.1),
)  # fmt: skip
HANGS, SOFT = 1.5, 3.9  # m: railseats
CHANGES = [
    LocalChange(what="block", x=HANGS, value=0.0),
    LocalChange(what="fastening", x=SOFT, value=0.3),
]
LAYOUT = Layout(1)


@pytest.fixture(scope="module")
def equal():
    return reduce_track(TRACK)


@pytest.fixture(scope="module")
def local(equal):
    return with_changes(TRACK, equal, CHANGES)


def receptance(body, omega, x):
    """Deflections of both rails at x for a force on the left one, (n_omega, 2)."""
    met, none = body.at(np.array([x])), np.empty(0)
    b = met.drive(np.array([1.0, 0.0])).s
    found = np.empty((omega.size, 2), complex)
    for k, w in enumerate(omega):
        plus, minus = b / (1j * w - body.poles), b / (-1j * w - body.poles)
        found[k] = met.motion(State((plus + minus) / 2, none, none))
        found[k] += 1j * met.motion(State(1j * (minus - plus) / 2, none, none))
    return found


@pytest.mark.parametrize("x", [HANGS, 1.8, 2.0, SOFT, 6.3])
def test_receptance(equal, local, x):
    """As near to the finite elements as the equal ring is; a one-sided load moves both parities."""
    omega = 2 * np.pi * np.array([3.0, 40.0, 150.0, 420.0, 900.0])
    points = [Point(x=x, side=side) for side in (-1, 1)]
    at = (TRACK, omega, points[:1], points)
    exact, before = (
        direct_receptance(*at, viscous=True, changes=changes)[:, :, 0] for changes in (CHANGES, ())
    )
    size = np.abs(exact[:, 0])
    error = np.abs(receptance(local.under(LAYOUT), omega, x) - exact).max(axis=1) / size
    usual = np.abs(receptance(equal.under(LAYOUT), omega, x) - before).max(axis=1) / size
    assert error.max() < max(2 * usual.max(), 1e-3)
    assert (np.abs(exact - before).max(axis=1) / size).max() > 10 * error.max()


def test_nothing_grows(equal, local):
    assert local.poles.size == pytest.approx(equal.poles.size, abs=4)  # some pass the highest
    assert local.poles.real.max() < 1e-9 * np.abs(local.poles).max()


def newmark(position, force, step, *, changed):
    """Deflection of the left rail under a force on it that moves, by the whole ring."""
    ring = build_ring(TRACK, (Z,), np.empty(0))
    loss = 2 * np.pi * TRACK.mesh.loss_factor_frequency
    M, K, C = ring.M, ring.K, ring.C + ring.K_loss / loss
    block, pad = TRACK.layers[0], TRACK.fastening
    (chain,) = ring.chains
    rails = 2 * chain.section.size * chain.nodes.size
    for side in range(2):
        hang = np.zeros(K.shape[0])
        hang[rails + 2 * 2 + side] = 1.0  # the third railseat's blocks
        seat = ring.heads(np.array([SOFT])).toarray()[side]
        seat[rails + 2 * 6 + side] -= 1.0
        for row, k, c in (
            (
                (hang, -block.stiffness, -block.damping),
                (seat, -0.7 * pad.stiffness, -0.7 * (pad.damping + 0.1 * pad.stiffness / loss)),
            )
            if changed
            else ()
        ):
            square = np.outer(row, row)
            K, C = K + k * square, C + c * square
    rows = ring.heads(position)[: position.size].toarray()  # the left rail's
    solve = splu(csc_array(4 / step**2 * M + 2 / step * C + K)).solve
    static = splu(csc_array(K)).solve(rows[0] * force)
    u, v, a = static, np.zeros_like(static), np.zeros_like(static)
    found = [rows[0] @ u]
    for row in rows[1:]:
        right = row * force + M @ (4 / step**2 * u + 4 / step * v + a) + C @ (2 / step * u + v)
        new = solve(np.asarray(right).ravel())
        speed = 2 / step * (new - u) - v
        a = 4 / step**2 * (new - u) - 4 / step * v - a
        u, v = new, speed
        found.append(row @ u)
    return np.array(found)


@pytest.mark.slow  # 800 steps of both in Python, twice
def test_a_load_that_moves_over_them(equal, local):
    """60 m/s from one bay before the hanging block to behind the soft pad."""
    step, speed, force = 1e-4, 60.0, 8e4
    position = 0.3 + speed * step * np.arange(801)
    exact = newmark(position, force, step, changed=True)
    before = newmark(position, force, step, changed=False)

    def deflection(reduced):
        body = reduced.under(LAYOUT)
        mover = Mover(body, FromOutside(), step)
        load = np.array([force, 0.0])
        start = np.array([position[0]])
        state = body.at(start).rest(load)
        found = [body.at(start).motion(state)[0]]
        for begin, end in pairwise(position):
            a, b = np.array([begin]), np.array([end])
            state = mover.step(state, Inputs(a, load), Inputs(b, load), step)
            found.append(body.at(b).motion(state)[0])
        return np.array(found)

    swing = np.ptp(exact)
    of_equal = deflection(equal)
    error = np.abs(deflection(local) - exact).max() / swing
    usual = np.abs(of_equal - before).max() / np.ptp(before)
    # Of modes to 4 kHz and of Newmark's steps, on either ring: 0.9 %.
    assert error < max(1.5 * usual, 0.01), (error, usual)
    assert np.abs(of_equal - exact).max() > 0.2 * swing


@pytest.mark.parametrize(
    ("change", "said"),
    [(LocalChange(what="mass", x=1.0, value=5.0), "fastenings and layers change, on both sides"),
     (LocalChange(what="block", x=HANGS, value=0.0, sides=(1,)), "on both sides alike"),
     (LocalChange(what="block", x=1.4, value=0.0), "there is no railseat")],
)  # fmt: skip
def test_refused(equal, change, said):
    with pytest.raises(ParameterError, match=said):
        with_changes(TRACK, equal, [change])
