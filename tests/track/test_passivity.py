"""Wheels draw no power from the reduced track: not at any frequency, not through any spring.

A track that gives power would make exact coupling over a stiff contact diverge, and every scheme
with it. The model is put together from what a step uses, poles and shapes.
"""

import numpy as np
import pytest
from scipy.linalg import block_diag

from railcosim.mechanics.ports import ROLL, Layout
from railcosim.track.parameters import Fastening, Mesh, Slab, Track
from railcosim.track.reduced import reduce_track
from railcosim.track.section import SPATIAL

SEAT, BAY = 0.3125, 0.625  # m
# Wheelsets of a vehicle and of one whose four stand 4 bays apart, all over railseats.
WHEELSETS = (np.array([18.2, 15.7, 2.5, 0.0]), np.array([7.5, 5.0, 2.5, 0.0]))
MANY = np.arange(90.0, -1.0, -2.5)  # 37 wheelsets all round the ring
FREQUENCY = np.unique(np.r_[np.geomspace(1, 1000, 30), np.arange(1000.0, 30000, 150)])  # Hz


def carried(body, position):
    """(poles, B, C): s' = poles s + B f, motions Re(C s), for all ports."""
    shapes = body.at(position)
    B = np.stack([shapes.drive(f).s for f in np.eye(body.ports)], axis=1)
    even, odd = shapes.out[:, : body.even], shapes.out[:, body.even :]
    mirror = body.layout.mirror[:, None]
    ring = np.block([[even, odd], [mirror * even, -mirror * odd]])
    return body.poles, B, np.hstack([ring, block_diag(*shapes.local)])


def power(body, position):
    """Least eigenvalue of the mobilities' Hermitian part, by frequency; at infinity; and scale.

    Per unit force squared, s/kg. An impulse's jump of the deflection is the mobility at infinity.
    """
    poles, B, C = carried(body, position)
    # A roll counts by what it moves 0.1 m from its axis.
    size = np.array([0.1 if p.direction is ROLL else 1.0 for p in body.layout.ports])
    B, C = B * size, size[:, None] * C
    least, scale = [], 0.0
    for s in 2j * np.pi * FREQUENCY:
        Y = 0.5 * s * ((C / (s - poles)) @ B + (C.conj() / (s - poles.conj())) @ B.conj())
        least.append(np.linalg.eigvalsh(Y + Y.conj().T)[0] / 2)
        scale = max(scale, np.abs(Y).max())
    jump = (C @ B).real
    return np.array(least), np.linalg.eigvalsh(jump + jump.T)[0] / 2, scale


def coarse(**fastening):
    return Track(
        fastening=Fastening(**fastening),
        mesh=Mesh(cells=4, elements_per_bay=4, highest_slab_frequency=600, highest_frequency=4000),
    )


def without_slab(damping):
    return Track(
        slab=Slab(present=False),
        fastening=Fastening(damping=damping),
        mesh=Mesh(cells=4, elements_per_bay=4, highest_frequency=4000),
    )


@pytest.mark.parametrize("wheelsets", WHEELSETS)
@pytest.mark.parametrize("place", [0.0, 1 / 32, 1 / 8, 0.21, 1 / 2])
def test_default_track_gives_no_power(default_reduced, wheelsets, place):
    body = default_reduced.under(Layout())
    least, at_infinity, _ = power(body, SEAT + place * BAY + wheelsets)
    # Measured 2e-10 s/kg, at 1 Hz. Without a jump of the residual -2.8e-7, from 7.7 kHz up.
    assert least.min() > 0
    assert at_infinity > 0


def test_many_wheelsets_are_given_no_power(default_reduced):
    """The residual's jump is made for three others near by: more of them are farther off."""
    body = default_reduced.under(Layout(MANY.size))
    least, at_infinity, _ = power(body, SEAT + MANY)
    assert least.min() > 0  # measured 2.6e-10 s/kg
    assert at_infinity > 0  # measured 2.8e-9


@pytest.mark.parametrize(
    "track",
    [
        *(without_slab(damping) for damping in (1e3, 2.5e4, 2.5e5, 2.5e6)),
        coarse(loss_factor=0.25),
        coarse(stiffness=3e8, damping=5e4),
        Track(mesh=Mesh(cells=4, highest_frequency=2500)),
    ],
    ids=["hardly damped", "no slab", "overdamped", "clamped", "loss factor", "stiff", "few modes"],
)
def test_other_tracks_give_no_power(track):
    body = reduce_track(track).under(Layout())
    for place in (0.0, 1 / 16, 1 / 2):
        least, at_infinity, _ = power(body, SEAT + place * BAY + WHEELSETS[1])
        assert least.min() > 0
        assert at_infinity > 0


FINE = Mesh(cells=4, highest_slab_frequency=600)
SOON = Mesh(cells=4, elements_per_bay=4, highest_slab_frequency=600, highest_frequency=2000)


@pytest.mark.parametrize(
    "track",
    [
        Track(mesh=SOON),
        Track(mesh=SOON, fastening=Fastening(damping_lateral=2.5e6, roll_damping=4700.0)),
        *(
            pytest.param(track, marks=pytest.mark.slow)  # large eigenproblems, 10 s each
            for track in (
                Track(mesh=FINE),
                Track(mesh=FINE, fastening=Fastening(damping_lateral=1e3, roll_damping=2.0)),
                Track(mesh=FINE, fastening=Fastening(roll_stiffness=5.6e5, roll_damping=470.0)),
            )
        ),
    ],
    ids=["few modes", "all but clamped", "default", "hardly damped", "stiff in roll"],
)
def test_no_power_in_any_direction(track):
    """Forces down and to the right, and moments: in any combination, at all wheels."""
    body = reduce_track(track, SPATIAL).under(Layout(directions=SPATIAL))
    for place in (0.0, 1e-3, 1 / 64, 1 / 16, 1 / 2):
        least, at_infinity, scale = power(body, SEAT + place * BAY + WHEELSETS[1])
        assert least.min() > 0
        # Sideways and in roll nothing jumps, but for the single precision of shapes.
        assert at_infinity > -1e-7 * scale


def test_undamped_track_neither_gives_nor_takes():
    body = reduce_track(without_slab(0.0)).under(Layout())
    least, at_infinity, scale = power(body, SEAT + WHEELSETS[1])
    # Poles on the imaginary axis: rounding of the shapes to single precision near resonances.
    assert least.min() > -1e-6 * scale
    assert at_infinity > -1e-6 * scale


@pytest.fixture(scope="module")
def on_springs():
    """State matrices of the open track: x' = A x + B f, z = C x, all real."""
    body = reduce_track(coarse()).under(Layout())
    poles, B, C = carried(body, SEAT + WHEELSETS[1])
    A = np.block([[np.diag(poles.real), -np.diag(poles.imag)],
                  [np.diag(poles.imag), np.diag(poles.real)]])  # fmt: skip
    return A, np.vstack([B.real, B.imag]), np.hstack([C.real, -C.imag])


@pytest.mark.parametrize("k_H", [1e9, 8e9, 16e9, 100e9])
def test_rails_on_springs_at_the_wheels_come_to_rest(on_springs, k_H):
    """Wheels held still, contacts of any stiffness: no root of the coupled track grows."""
    A, B, C = on_springs
    # Without a jump of the residual a root grew, by 454 1/s at 8 GN/m. Waves with nodes at all
    # railseats are not damped: their roots are imaginary but for rounding, below 1e-9 1/s.
    assert np.linalg.eigvals(A - k_H * B @ C).real.max() < 1e-6
