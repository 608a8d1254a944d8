"""What sensors see beside places that are different: against the whole ring in finite elements.

Its matrices are changed by hand, and what a sensor tells is taken from its motions.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from railcosim.analysis.response.local_track import ChangedTrack, Local
from railcosim.fmus.sensor_variables import sensor_name
from railcosim.mechanics.ports import FORCE, RAIL, Layout, Z
from railcosim.reference.ring import build_ring
from railcosim.track.layers import Layer
from railcosim.track.local import LocalChange
from railcosim.track.local_modes import with_changes
from railcosim.track.parameters import Fastening, Mesh, Rail, Slab, Track
from railcosim.track.reduced import reduce_track
from railcosim.track.sensor_quantities import told_by
from railcosim.track.sensor_rows import weighed
from railcosim.track.sensors import Sensor

HANGS, SOFT, WHEEL, BESIDE = 1.5, 3.9, 2.3, 2.75  # m; railseats, a wheel, a place of the rail
CHANGES = [
    LocalChange(what="block", x=HANGS, value=0.0),
    LocalChange(what="fastening", x=SOFT, value=0.3, sides=(-1,)),
]
SENSORS = [
    ("rail", "left", BESIDE, "z,vz,bending_moment"), ("fastening", "left", SOFT, "force_z"),
    ("fastening", "left", HANGS, "force_z"),
    ("block", "left", HANGS, "z,force_z"), ("block", "left", SOFT, "force_z"),
]  # fmt: skip
TRACK = Track(
    rail=Rail(loss_factor=0.01), slab=Slab(present=False),
    layers=(Layer(name="block", mass=100.0, stiffness=3e7),),
    mesh=Mesh(cells=12, elements_per_bay=12, highest_frequency=4000),
    fastening=Fastening(spacing=0.6, loss_factor=0.1),
    sensor=tuple(
        Sensor(of=of, side=side, at=x, quantities=tuple(names.split(",")))
        for of, side, x, names in SENSORS
    ),
)  # fmt: skip
LOSS = 2 * np.pi * TRACK.mesh.loss_factor_frequency
OMEGA = 2 * np.pi * np.array([3.0, 40.0, 150.0, 420.0, 900.0])
E = 0.01  # m: a moment from rotations so far apart errs by (k E)^2 / 6, 5e-4 at 900 Hz


def by_hand(*, changed):
    """By a unit force on the left rail, at all frequencies: as the sensors stand."""
    ring = build_ring(TRACK, (Z,), np.array([WHEEL, BESIDE - E, BESIDE, BESIDE + E]))
    M, K, C = (A.toarray() for A in (ring.M, ring.K, ring.C + ring.K_loss / LOSS))
    block, pad, n = TRACK.layers[0], TRACK.fastening, K.shape[0]
    (chain,) = ring.chains
    rails = 2 * chain.section.size * chain.nodes.size

    def blocks(seat):
        """The motion of a block on the left, and on the right."""
        return [np.eye(1, n, rails + 2 * seat + side)[0] for side in range(2)]

    def pressed(x, seat):
        return [h - b for h, b in zip(ring.heads(np.array([x])).toarray(), blocks(seat),
                                      strict=True)]  # fmt: skip

    hanging, soft, over = blocks(2), pressed(SOFT, 6), pressed(HANGS, 2)
    k_pad, c_pad = pad.stiffness, pad.damping + pad.loss_factor * pad.stiffness / LOSS
    k_block, c_block = block.stiffness, block.damping + block.loss_factor * block.stiffness / LOSS
    left = 0.3 if changed else 1.0
    if changed:
        for row, k, c in (
            *((row, -k_block, -c_block) for row in hanging),
            (soft[0], -0.7 * k_pad, -0.7 * c_pad),
        ):
            K, C = K + k * np.outer(row, row), C + c * np.outer(row, row)
    turn = np.zeros((2, n))  # the left rail's rotation on either side
    for row, x in zip(turn, (BESIDE - E, BESIDE + E), strict=True):
        node = int(np.argmin(np.abs(chain.nodes - x)))
        row[chain.section.size * node + list(chain.section.unknowns).index("theta")] = 1.0
    found = []
    for w in OMEGA:
        s = 1j * w
        load = ring.heads(np.array([WHEEL])).toarray()[0]
        u = np.linalg.solve(K + s * C + s**2 * M, load)
        z = ring.heads(np.array([BESIDE])).toarray()[0] @ u
        EI = TRACK.rail.bending_stiffness * (1 + s * TRACK.rail.loss_factor / LOSS)
        of_pad, of_block = k_pad + s * c_pad, k_block + s * c_block
        found.append([
            z, s * z, EI * (turn[0] - turn[1]) @ u / (2 * E), left * of_pad * (soft[0] @ u),
            of_pad * (over[0] @ u), hanging[0] @ u,
            0.0 if changed else of_block * (hanging[0] @ u), of_block * (blocks(6)[0] @ u),
        ])  # fmt: skip
    return np.array(found)


@pytest.mark.parametrize("sides", [(-1,), (-1, 1)])
def test_in_time(sides):
    """The reduced ring's answer at a frequency; where sides differ no mode is a mirror image.

    Rails know nothing of each other on this track, so the left one is the same.
    """
    changes = [CHANGES[0], replace(CHANGES[1], sides=sides)]
    told, bare = told_by(TRACK, (Z,), changes), reduce_track(replace(TRACK, sensor=()))
    body = with_changes(TRACK, bare, changes).under(Layout(1))
    assert body.apart == (sides == (-1,))
    seen, n, s = body.observation, body.shared, 1j * OMEGA[:, None]
    into = body.at(np.array([WHEEL])).drive(np.array([1.0, 0.0])).s
    each = seen.poles.size // len(seen.shown)
    found = []
    for one, row in zip(told, seen.row, strict=True):
        shown = np.zeros(body.poles.size, dtype=complex)
        shown[:n] = seen.shown[row]
        own = slice(each * row, each * (row + 1))
        shown[n + 2 :][own] = seen.size[own]  # behind an oscillator at each of two wheels
        plus = np.sum(shown * into / (s - body.poles), axis=1)
        minus = np.sum(shown * into / (s.conj() - body.poles), axis=1)
        found.append(0.5 * (plus + minus.conj()) * weighed(one.weights, s[:, 0]))
    equal, exact = by_hand(changed=False), by_hand(changed=True)
    size = np.abs(np.stack([equal, exact])).max(axis=(0, 1))
    # Modes fade out from 4 kHz; measured 4e-4, of the moment 2e-3.
    assert (np.abs(np.array(found).T - exact) / size).max() < 4e-3


def test_in_frequency():
    """What a change adds, beside a model that answers nothing itself."""
    layout = Layout(1).down
    names = [f"{sensor_name(one.sensor)}.{one.name}" for one in told_by(TRACK, (Z,))]
    variables = [SimpleNamespace(name=name) for name in (*layout.names(RAIL.motion), *names)]
    forces = tuple(SimpleNamespace(name=name) for name in layout.names(FORCE))
    nothing = SimpleNamespace(
        inputs=forces, outputs=tuple(variables), name="track",
        frequency_response=lambda omega: np.zeros((omega.size, len(variables), 2)),
    )  # fmt: skip
    changed = ChangedTrack(nothing, Local(TRACK, CHANGES), np.array([WHEEL]))
    added = changed.frequency_response(OMEGA)[:, 2:, 0]
    equal, other = by_hand(changed=False), by_hand(changed=True)
    size = np.abs(np.stack([equal, other])).max(axis=0)
    error = (np.abs(added - (other - equal)) / size).max(axis=0)
    # The same finite elements but for a few nodes: 3e-3 with 6 elements to a bay.
    assert error.max() < 2e-3, error
    assert (np.abs(other - equal) / size).max(axis=0).min() > 0.05  # all feel it
