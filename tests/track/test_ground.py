"""Forces on the ground against Newton's law on finite elements whole, closed forms, and power."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse.linalg import splu

from railcosim.analysis.response.transmission import irregularity_under, transmission
from railcosim.mechanics.law import LinearContact
from railcosim.mechanics.ports import Z
from railcosim.parameters import changed
from railcosim.reference.below import bodies_of
from railcosim.reference.contacts import Pressing
from railcosim.reference.frequency import frequency_response, linearised
from railcosim.reference.monolithic import assemble
from railcosim.reference.ring import build_ring
from railcosim.reference.slabs import slabs_of
from railcosim.track.files import read_track
from railcosim.track.ground import force_along, force_on_ground
from railcosim.track.irregularity.synthesis import quality
from railcosim.track.layers import CONTINUOUS, Layer
from railcosim.track.names import BUILT_IN
from railcosim.track.parameters import Fastening, Foundation, Mesh, Slab, Track
from railcosim.track.receptance import BOTH, Point, infinite_receptance
from railcosim.vehicle.parameters import Vehicle

OMEGA = 2 * np.pi * np.array([12.0, 71.0, 240.0])
BAYS = 3.75  # where the load is: at a node, for a finer mesh in each cell is another track
COARSE = Mesh(cells=4, elements_per_bay=4, highest_slab_frequency=300)


def place(track):
    return BAYS * track.fastening.spacing


def coarse(name):
    return replace(read_track(name), mesh=COARSE)


def lifted(ring):
    """All of a ring of finite elements moved down by 1, in its unknowns."""
    (chain,) = ring.chains
    track, rails = ring.track, 2 * chain.nodes.size
    node = [float(name.startswith("w") and name != "warp") for name in chain.section.unknowns]
    parts = [np.tile(node, rails)]
    if track.slab.present:
        # Any few points: a plate that moves as one has no other modes.
        y = np.linspace(-0.9, 0.9, 7)
        x = np.repeat(np.linspace(-0.8, 0.8, 9), 7)
        moved = slabs_of(track, (Z,)).motion(Z, x, np.tile(y, 9))
        slab = np.linalg.lstsq(moved, np.ones(x.size), rcond=None)[0]
        parts.append(np.tile(slab, track.mesh.cells))
    for layer in track.layers:
        if layer.kind != CONTINUOUS:
            bodies = bodies_of(layer, track)
            across = bodies.across(np.linspace(-1.25, 1.25, 200))
            one = np.linalg.lstsq(across, np.ones(200), rcond=None)[0]
            parts.append(np.tile(one, bodies.seats.size))
    return np.concatenate(parts)


@pytest.mark.parametrize("name", ["paper", "floating", "ballasted", "booted"])
def test_what_the_ground_gets_is_what_acts_less_what_it_takes_to_move_the_track(name):
    """On a ring of four cells, whole: F + omega^2 sum of m w, by Newton; no spring is asked.

    The sum over a ring is that over a track without end, whatever its length.
    """
    track = coarse(name)
    ring = build_ring(track, (Z,), np.array([place(track)]))
    load = ring.heads(np.array([place(track)]))[[0]].toarray()[0]
    down = lifted(ring)
    found = force_on_ground(track, OMEGA, [Point(x=place(track))])[:, 0]
    for omega, force in zip(OMEGA, found, strict=True):
        D = ring.K + 1j * ring.K_loss + 1j * omega * ring.C - omega**2 * ring.M
        w = splu(D.tocsc().astype(complex)).solve(load.astype(complex))
        newton = down @ load + omega**2 * (down @ (ring.M @ w))
        # Sleepers that bend are polynomials here and beams there: 5e-5 of their receptance.
        assert force == pytest.approx(newton, rel=2e-4 if name == "ballasted" else 1e-8)


@pytest.mark.parametrize("name", BUILT_IN)
def test_at_rest_the_ground_carries_the_load(name):
    track = read_track(name)
    found = force_on_ground(track, np.array([1e-3]), [Point(x=place(track))])[0, 0]
    assert found == pytest.approx(1.0, rel=1e-6)


def test_two_layers_all_along_are_two_masses_on_springs():
    """Of a load at a point the part without phase moves all alike: mass-spring transmissibility."""
    layer = Layer(name="ballast", kind=CONTINUOUS, mass=150.0, stiffness=1e8, damping=5e4,
                  loss_factor=0.1)  # fmt: skip
    track = Track(
        fastening=Fastening(stiffness=8e7, damping=1e4, loss_factor=0.2, continuous=True),
        layers=(layer,), slab=Slab(present=False), mesh=COARSE,
    )  # fmt: skip
    omega, spacing = OMEGA, track.fastening.spacing
    pad = 8e7 * (1 + 0.2j) + 1j * omega * 1e4
    bed = 1e8 * (1 + 0.1j) + 1j * omega * 5e4
    rail, mass = track.rail.mass_per_length * spacing, 150.0
    closed = pad * bed / ((pad - omega**2 * rail) * (pad + bed - omega**2 * mass) - pad**2)
    found = force_on_ground(track, omega, [Point(x=place(track))])[:, 0]
    np.testing.assert_allclose(found, closed, rtol=1e-9)


def test_forces_along_the_track_add_up_and_take_the_power():
    """Dampers below blocks are all that takes any: their work is that of the load."""
    track = changed(
        read_track("booted"),
        {"fastening.damping": 0.0, "block.damping": 1e5, "block.loss_factor": 0.0},
    )
    track = changed(track, {"fastening.loss_factor": 0.0, "rail.loss_factor": 0.0})
    omega, block = np.array([2 * np.pi * 90.0]), track.layers[0]
    load = [Point(x=place(track), side=BOTH)]
    along = force_along(track, omega, load, range(-60, 61))[0, :, 0]
    assert along.sum() == pytest.approx(force_on_ground(track, omega, load)[0, 0], rel=1e-6)
    moved = along / 2 / (block.stiffness + 1j * omega * block.damping)
    lost = 2 * np.sum(0.5 * omega**2 * block.damping * np.abs(moved) ** 2)
    driven = 1j * omega * infinite_receptance(track, omega, load, [Point(x=place(track))])[0, 0, 0]
    assert lost == pytest.approx(2 * 0.5 * driven.real, rel=1e-6)


def test_a_track_is_no_better_than_itself():
    track = coarse("floating")
    found = transmission(track, track, lowest=8, highest=12.5)
    assert (found["insertion_loss"] == 0).all()
    assert found["force"].attrs["units"] == "N/N"
    level = 20 * np.log10(found["slab_velocity"] / 1e-9)  # 1e-6 mm/s
    np.testing.assert_allclose(found["slab_level"], level)


def test_far_above_its_resonance_a_floating_slab_isolates_as_a_mass_on_a_spring():
    """At 20 Hz rails and slab are one mass: f0^2 / f^2 - 1 of the stiff track's force.

    Within a dB: the slab bends, and its rails lie on pads.
    """
    floating = read_track("floating")
    stiff = replace(floating, foundation=Foundation(stiffness=1e10, damping=1e4, mounts=0))
    found = transmission(floating, stiff, lowest=20, highest=20)
    slab = floating.slab
    mass = slab.mass_per_area * slab.length * slab.width
    mass += 2 * floating.rail.mass_per_length * floating.cell_length
    f0 = np.sqrt(8 * floating.foundation.mount_stiffness / mass) / (2 * np.pi)
    f = 20 * 10 ** np.linspace(-0.05, 0.05, 101)
    damped = 8 * floating.foundation.mount_damping * 2 * np.pi * f
    k = 8 * floating.foundation.mount_stiffness + 1j * damped
    of_mass = np.abs(k / (k - mass * (2 * np.pi * f) ** 2))
    assert f0 < 15
    expected = -10 * np.log10(np.mean(of_mass**2))
    assert float(found["insertion_loss"][0]) == pytest.approx(expected, abs=1.0)


# The monolithic system of a ring of 20 cells.
@pytest.mark.slow
def test_a_vehicle_on_irregular_rails_against_the_monolithic_solution():
    """Forces of wheels, and of the ground by Newton; what is left is the ring's error."""
    k_H, speed = 1.2e9, 22.0
    acts = irregularity_under(irregularity="fra-5", speed=speed, contact_stiffness=k_H)
    track = Track(mesh=replace(COARSE, cells=20))
    loads = acts.loads(track, "railseat")
    f = np.array([9.0, 55.0, 130.0])
    omega = 2 * np.pi * f
    forces = acts.forces(track, f, loads)
    position = np.array([one.x for one in loads])
    mono = assemble(Vehicle(), track, position)
    linear = linearised(mono, Pressing(LinearContact(k_H=k_H)), position)
    for k, w in enumerate(omega):
        lag = np.exp(-1j * w * (position[0] - position) / speed)
        # One line of a third octave is all of it: the density times its width is the square.
        density = quality("fra-5").vertical.density(np.array([w / speed]))[0] * 2 * np.pi / speed
        rough = np.tile(lag, 2)[:, None].astype(complex)
        x = frequency_response(mono, omega[k : k + 1], linear, linear.loads @ rough)
        reference = linear.forces(omega[k : k + 1], x, rough)[0, :, 0]
        band = np.round(10 * np.log10(f[k]))
        width = 10 ** ((band + 0.5) / 10) - 10 ** ((band - 0.5) / 10)
        scale = np.sqrt(density * width)
        assert forces[k] == pytest.approx(scale * reference[:4], rel=1e-3)
        ring = mono.ring
        newton = reference.sum() + w**2 * (
            lifted(ring) @ (ring.M @ x[0, mono.body.K.shape[0] :, 0])
        )
        ground = force_on_ground(track, omega[k : k + 1], loads)[0] @ forces[k]
        assert ground == pytest.approx(scale * newton, rel=1e-3)
