"""The track in all directions: one model with the vertical one, mirrors, reciprocity, power."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import legendre

from railcosim.mechanics.ports import ROLL, Y, Z
from railcosim.track.parameters import Fastening, Foundation, Mesh, Rail, Slab, Track
from railcosim.track.receptance import Point, direct_receptance, infinite_receptance

COARSE = Mesh(cells=4, elements_per_bay=4, highest_slab_frequency=800)
OMEGA = 2 * np.pi * np.array([0.0, 3.0, 31.0, 56.0, 140.0, 515.0, 690.0, 1700.0])
FULL = Track(
    mesh=COARSE,
    slab=Slab(tilts_rails=True),
    rail=Rail(shear_centre_depth=0.033, warping_constant=2e-8, loss_factor=0.02),
    fastening=Fastening(loss_factor=0.1),
)
POINTS = [
    Point(x=0.2, direction=Y),
    Point(x=0.2, direction=ROLL),
    Point(x=3.3, side=1, direction=Y, offset=0.01),
    Point(x=18.9, direction=Z, offset=-0.02),
    Point(x=-7.0, side=1, direction=ROLL),
    Point(x=-6.1, side=1, slab_y=0.4),
    Point(x=12.0, slab_y=1.2, direction=Y),
]
UNITS = np.array([10.0 if p.direction is ROLL else 1.0 for p in POINTS])  # m for rad, about
RECEPTANCES = [direct_receptance, infinite_receptance]


def both_scaled(R):
    return R / UNITS[:, None] / UNITS


def test_vertical_model_is_a_choice_of_directions():
    """Of upright rails: what moves them sideways leaves what moves them down as it was."""
    track = Track(mesh=COARSE)
    down = [Point(x=1.3), Point(x=4.6, side=1), Point(x=9.0, slab_y=0.5)]
    aside = [Point(x=1.3, direction=Y), Point(x=1.3, side=1, direction=ROLL)]
    vertical = direct_receptance(track, OMEGA, down, down)
    spatial = direct_receptance(track, OMEGA, [*down, *aside], [*down, *aside])
    assert spatial[:, :3, :3] == pytest.approx(vertical, rel=1e-11)  # rounding
    assert np.abs(spatial[:, :3, 3:]).max() == 0
    # Rails that tilt with the slab: some per mille of the deflection, and they go outwards.
    tilting = replace(track, slab=Slab(tilts_rails=True))
    found = direct_receptance(tilting, np.zeros(1), down[:1], [down[0], aside[0]])[0, :, 0]
    assert found[0] == pytest.approx(vertical[0, 0, 0], rel=1e-3)
    assert 0.01 < -found[1] / found[0] < 0.1


@pytest.mark.parametrize("receptance", RECEPTANCES)
@pytest.mark.parametrize("track", [Track(mesh=COARSE), FULL], ids=["default", "full"])
def test_reciprocity_and_power(track, receptance):
    """Maxwell and Betti, between any directions; and no force gets power out of the track."""
    R = receptance(track, OMEGA, POINTS, POINTS)
    size = np.abs(both_scaled(R)).max(axis=(1, 2))
    off = np.abs(both_scaled(R - np.swapaxes(R, 1, 2))).max(axis=(1, 2))
    assert (off < 1e-10 * size).all()  # rounding
    loss = -(R - np.conj(np.swapaxes(R, 1, 2))) / 2j
    assert (np.linalg.eigvalsh(both_scaled(loss))[:, 0] > -1e-10 * size).all()


@pytest.mark.parametrize("track", [Track(mesh=COARSE), FULL], ids=["default", "full"])
def test_mirrored_loads_make_mirrored_motions(track):
    """In the mirror between the rails: down is down, right is left, and rolls are opposite."""

    def mirrored(point):
        return replace(point, side=-point.side, offset=-point.offset)

    sign = np.array([p.direction.mirror for p in POINTS])
    R = direct_receptance(track, OMEGA, POINTS, POINTS)
    image = [mirrored(p) for p in POINTS]
    found = direct_receptance(track, OMEGA, image, image)
    assert found == pytest.approx(sign[:, None] * R * sign, rel=1e-9, abs=1e-20)  # rounding


@pytest.mark.parametrize("track", [Track(), FULL], ids=["default", "full"])
def test_a_long_ring_is_an_endless_track(track):
    """Closed by Bloch waves, or by what half a track without end is: 1 km apart."""
    mesh = replace(COARSE, cells=400)
    R = [f(replace(track, mesh=mesh), OMEGA, POINTS, POINTS) for f in RECEPTANCES]
    # Torsion at 690 Hz, with nodes at all railseats, decays by 1.4 % a cell of the default track.
    size = np.abs(both_scaled(R[1])).max(axis=(1, 2))
    off = np.abs(both_scaled(R[0] - R[1])).max(axis=(1, 2))
    assert (off < 1e-9 * size).all()


def test_undamped_track_is_the_limit_of_small_damping():
    """Five waves to either side, told by the way their power flows where they do not decay."""

    def damped(share):
        return replace(
            FULL, rail=Rail(shear_centre_depth=0.02),
            fastening=Fastening(
                damping=share * 2.5e4, damping_lateral=share * 2.5e4, roll_damping=share * 50
            ),
            foundation=Foundation(damping=share * 1e4, damping_lateral=share * 1e4),
        )  # fmt: skip

    some, omega = POINTS[:4], OMEGA[1:7]
    none, *little = (infinite_receptance(damped(s), omega, some, some) for s in (0, 1e-6, 1e-7))
    errors = [np.abs(R - none).max(axis=(1, 2)) / np.abs(none).max(axis=(1, 2)) for R in little]
    assert errors[0] == pytest.approx(10 * errors[1], rel=1e-2)  # linear in the damping
    assert errors[1].max() < 1e-3


def test_slabs_carry_all_lateral_load_to_the_ground():
    """Statics: lateral stiffness times the shift under all slabs sums to the force."""
    track = Track(mesh=COARSE, foundation=Foundation(stiffness_lateral=3e7))
    slab, shifts = track.slab, []
    nodes, weights = legendre.leggauss(2)  # a rigid body's shift is a line along the slab
    for cell in range(track.mesh.cells):
        x = (cell + 0.5) * track.cell_length + nodes * slab.length / 2
        points = [Point(x=p, slab_y=0.0, direction=Y) for p in x]
        R = direct_receptance(track, np.zeros(1), [Point(x=1.1, direction=Y)], points)[0, :, 0]
        shifts.append(weights @ R.real * slab.length / 2)
    assert 3e7 * slab.width * np.sum(shifts) == pytest.approx(1.0, rel=1e-9)  # rounding


def test_lateral_resonance_of_a_slab():
    """Alone, loosely held by the rails: sqrt(k / rho h), shifted by equal lateral forces."""
    track = Track(
        mesh=COARSE, rail=Rail(mass_per_length=15.0),
        fastening=Fastening(stiffness_lateral=1e4, damping_lateral=0.0),
        foundation=Foundation(damping_lateral=1e2),
    )  # fmt: skip
    natural = np.sqrt(track.foundation.stiffness_lateral / track.slab.mass_per_area)
    omega = natural * np.linspace(0.97, 1.03, 601)
    at = Point(x=2.5, slab_y=0.0, direction=Y)
    R = direct_receptance(track, omega, [at], [at])[:, 0, 0]
    assert omega[np.argmax(np.abs(R))] == pytest.approx(natural, rel=5e-4)
