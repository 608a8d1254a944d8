"""The monolithic system in space in time: exact harmonics, mirrors, energy, Klingel, order."""

from dataclasses import replace

import numpy as np
import pytest

from railcosim.mechanics.contact.at_ports import AtPorts
from railcosim.mechanics.contact.geometry import COORDINATES, LEFT, RIGHT
from railcosim.mechanics.contact.rolling import RollingContact, slip
from railcosim.mechanics.contact.saturation import Saturated
from railcosim.mechanics.law import HertzContact
from railcosim.reference.contacts import LinearRolling, Pressing, Rolling
from railcosim.reference.frequency import frequency_response, linearised
from railcosim.reference.monolithic import assemble
from railcosim.reference.newmark import BETA, GAMMA, newmark
from railcosim.reference.rest import equilibrium
from railcosim.reference.state import Interval
from railcosim.reference.wilson_theta import wilson_theta
from railcosim.track.parameters import Fastening, Mesh, Rail, Slab, Track
from railcosim.vehicle.multibody import SPATIAL, build_multibody
from railcosim.vehicle.on_rails import cones_of, rolling
from railcosim.vehicle.parameters import PrimarySuspension, Vehicle
from railcosim.vehicle.properties import Geometry

pytestmark = pytest.mark.filterwarnings("ignore::railcosim.track.decay.RingWarning")

# Few unknowns: two fastenings a slab.
MESH = Mesh(cells=4, elements_per_bay=2, highest_slab_frequency=300)
TRACK = Track(mesh=MESH, fastening=Fastening(spacing=2.5))
TILTED = replace(TRACK, slab=Slab(tilts_rails=True), rail=Rail(shear_centre_depth=0.033))
POSITION = np.array([18.5, 16.0, 2.8, 0.3125])
SPEED = 70.0
VEHICLE = Vehicle()
# k_px and k_sx act on pitch through heights, which the vertical model leaves out.
LEVEL = Vehicle(geometry=Geometry(carbody_height=0.0, bogie_height=0.0, wheelset_height=0.0))


def held(t):
    return POSITION


def along(t):
    return POSITION + SPEED * t


def wheels(conicity, speed=SPEED, **changes):
    """Of the vehicle, that roll on cones."""
    cone = cones_of(build_multibody(VEHICLE, SPATIAL), conicity)[0]
    side = np.repeat([LEFT, RIGHT], 4)
    return Rolling(RollingContact(geometry=cone, side=side, speed=speed, **changes))


@pytest.mark.parametrize("frequency", [2.0, 40.0, 700.0])
def test_newmark_of_a_harmonic_is_the_frequency_response(frequency):
    """Exactly: average acceleration sees omega as 2/h tan(omega h/2), and nothing else."""
    body = build_multibody(VEHICLE, SPATIAL)
    contacts = LinearRolling(rolling(body, cones_of(body, 0.05))(20.0))
    mono = assemble(VEHICLE, TILTED, POSITION, SPATIAL)
    step, omega = 2e-4, 2 * np.pi * frequency
    seen = 2 / step * np.tan(omega * step / 2)
    rough = 1e-4 * np.exp(1j * np.arange(16.0))  # of each wheel, down and to the right
    linear = linearised(mono, contacts, POSITION)
    X = frequency_response(mono, np.array([seen]), linear, (linear.loads @ rough)[:, None])[0, :, 0]
    force = linear.forces(np.array([seen]), X[None, :, None], rough[:, None])[0, :, 0]
    rest = equilibrium(mono, contacts, POSITION, np.zeros(16))
    state = replace(
        rest, x=rest.x + X.real, v=rest.v + (1j * seen * X).real, a=(-(seen**2) * X).real
    )
    interval = Interval(mono, contacts, step, BETA, GAMMA)
    for n in range(1, 21):
        turn = np.exp(1j * omega * step * n)
        state = interval.end(state, POSITION, (rough * turn).real)
        moved = state.x - rest.x - rest.v * step * n
        # Rounding of displacements at rest of a mm, and of 1e9 N/m times that.
        assert moved == pytest.approx((X * turn).real, abs=1e-8 * np.abs(X).max())
        assert state.force - rest.force == pytest.approx(
            (force * turn).real, abs=1e-7 * np.abs(force).max()
        )


@pytest.mark.parametrize("march", [newmark, wilson_theta])
def test_mirrored_excitation_gives_the_vertical_answers(march):
    """Wheels that roll along without conicity, rough rails alike on both sides."""
    contacts = wheels(0.0)
    springs = Pressing(HertzContact(C=float(contacts.contact.geometry.patch.ellipse.C)))
    space, vertical = (assemble(LEVEL, TRACK, POSITION, *d) for d in ((SPATIAL,), ()))

    def rough(t):
        return 2e-5 * np.tile(np.cos(2 * np.pi * along(t) / 0.8), 2)

    def in_space(t):
        return np.kron(rough(t), [1.0, 0.0])

    one = list(march(space, contacts, along, in_space, 1e-4, 30))
    other = list(march(vertical, springs, along, rough, 1e-4, 30))
    force, expected = (np.array([state.force for state in run]) for run in (one, other))
    dynamic = np.abs(expected - expected[0]).max()
    assert np.abs(force[:, ::3] - expected).max() < 1e-9 * dynamic
    assert np.abs(force[:, 1::3]).max() < 1e-9 * dynamic
    at = [space.coordinate(name) for name in vertical.body.coordinates]
    x, same = (np.array([s.x for s in run]) for run in (one, other))
    assert np.abs(x[:, at] - same[:, : len(at)]).max() < 1e-9 * np.abs(same).max()


def test_wheels_that_roll_on_cones_rest_and_stay_at_rest():
    """Mirrored: each rail is pushed outwards; spins go on at a steady rate.

    (With k_px at heights, bogies on rails that sink unlike load their axles unlike.)
    """
    contacts = wheels(0.05)
    mono = assemble(LEVEL, TRACK, POSITION, SPATIAL)
    start, *others = newmark(mono, contacts, held, lambda t: np.zeros(16), 1e-3, 20)
    force = start.force.reshape(2, 4, 3)
    assert force[..., 0] == pytest.approx(np.full((2, 4), VEHICLE.wheel_load), rel=1e-9)
    assert force[0, :, 1:] == pytest.approx(-force[1, :, 1:], rel=1e-6)
    # On a cone the normal goes outwards by its angle; spin creep adds a part of the same order.
    assert np.all(force[1, :, 1] > 0)
    assert np.all(force[1, :, 1] < 0.1 * VEHICLE.wheel_load)
    spins = [mono.coordinate(f"{axle}.spin") for axle in mono.body.axles]
    assert np.all(start.x[spins] == 0)
    assert np.all(start.v[spins] != 0)
    for state in others:
        assert state.force == pytest.approx(start.force, rel=1e-7, abs=1e-6)
        assert state.v[spins] == pytest.approx(start.v[spins], rel=1e-6)


def test_what_is_excited_in_the_mirror_moves_in_the_mirror():
    """Left for right, and y, roll and yaw the other way round, to rounding."""
    contacts = wheels(0.1, creep=Saturated(friction=0.3))
    mono = assemble(VEHICLE, TILTED, POSITION, SPATIAL)
    signs = np.array([1.0, -1.0])

    def rough(t):
        waves = np.cos(3.0 * np.arange(16).reshape(2, 4, 2) + 300.0 * t)
        return (1e-3 * waves * [0.01, 1.0]).ravel()

    def mirrored(t):
        return (rough(t).reshape(2, 4, 2)[::-1] * signs).ravel()

    one, other = (list(newmark(mono, contacts, along, r, 2e-4, 20)) for r in (rough, mirrored))
    force, image = (np.array([s.force for s in run]).reshape(-1, 2, 4, 3) for run in (one, other))
    expected = force[:, ::-1] * [1.0, -1.0, -1.0]
    assert np.abs(image - expected).max() < 1e-9 * np.abs(force).max()
    for name in mono.body.coordinates:
        at = mono.coordinate(name)
        sign = 1.0 if name.endswith((".z", ".pitch", ".spin")) else -1.0
        x, moved = (np.array([s.x[at] for s in run]) for run in (one, other))
        assert np.abs(moved - sign * x).max() < 1e-9
    assert np.abs(force[:, 0, :, 1] + force[:, 1, :, 1]).max() > 100  # something is odd


def powers(mono, contacts, state):
    """Energy; power of creep, of what keeps the speed, and of dampers."""
    law = contacts.contact
    rows = contacts.rows(mono, POSITION)
    q, v = ((rows @ part).reshape(-1, len(COORDINATES)) for part in (state.x, state.v))
    creepage, tangential = law.creep_forces(q, v)
    touch = law.geometry.touch(q, law.side)
    C, speed = law.geometry.patch.ellipse.C, law.speed
    energy = state.v @ (mono.M @ state.v) / 2 + state.x @ (mono.K @ state.x) / 2
    energy -= (mono.wheels.T @ mono.load) @ state.x
    energy += np.sum(0.4 * C * touch.compression**2.5)
    creep = speed * np.sum(tangential * creepage)
    engine = -speed * np.sum(tangential * slip(touch, q, law.geometry.radius).rolling)
    return energy, creep, engine, -state.v @ (mono.viscous_damping @ state.v)


def test_creep_only_takes_and_nothing_is_created():
    """Energy changes by what creep and dampers take and by what keeps the speed, to h^2.

    After the rails have moved aside and back smoothly, left and right by turns.
    """
    mono, contacts = assemble(VEHICLE, TRACK, POSITION, SPATIAL), wheels(0.1, speed=20.0)
    moving, duration, missing = 0.02, 0.04, []

    def rough(t):
        aside = 1e-3 * np.sin(np.pi * t / moving) ** 4 * (t < moving)
        return aside * np.kron(np.tile([1.0, -1.0, 0.5, 0.2], 2), [0.0, 1.0])

    for steps in (60, 120):
        step = duration / steps
        states = list(newmark(mono, contacts, held, rough, step, steps))[steps // 2 :]
        energy, creep, engine, dampers = np.array([powers(mono, contacts, s) for s in states]).T
        assert np.all(creep < 0)
        assert np.all(dampers <= 0)
        given = np.trapezoid(creep + engine + dampers, dx=step)
        missing.append(abs(energy[-1] - energy[0] - given) / np.trapezoid(-creep, dx=step))
    assert missing[1] < 1e-4
    assert missing[1] < missing[0] / 3.5, missing  # second order: a quarter


def test_second_order_with_rolling_contact():
    """Whole system, the rails' surfaces moving down and aside under held wheels that roll."""
    mono, contacts = assemble(VEHICLE, TRACK, POSITION, SPATIAL), wheels(0.1)
    duration = 3e-3

    def rough(t):
        waves = np.cos(2 * np.pi * (np.repeat(POSITION, 2) + 70.0 * t) / 0.8 + np.arange(8) % 2)
        return np.tile([2e-5, 2e-4], 8) * np.tile(waves, 2) * (t / duration) ** 3

    def last(steps):
        return list(newmark(mono, contacts, held, rough, duration / steps, steps))[-1].force

    coarse, middle, fine = (last(n).reshape(8, 3) for n in (40, 80, 160))
    change = [np.abs(one - other).max(axis=0) for one, other in ((coarse, middle), (middle, fine))]
    # Of forces down, to the right, and moments: a quarter.
    assert np.all(np.log2(change[0] / change[1]) > 1.8)


STIFF = Track(
    slab=Slab(present=False),
    rail=Rail(young_modulus=2e16, torsional_rigidity=1e10),
    fastening=Fastening(spacing=2.5, stiffness=1e14, stiffness_lateral=1e14, roll_stiffness=1e12),
    mesh=MESH,
)


@pytest.mark.parametrize("conicity", [0.05, 0.1])
def test_klingel(conicity):
    """A free wheelset on stiff rails winds along them, on a round head a little faster:
    2 pi sqrt(b r0 / (lambda (1 + R lambda / b)))."""
    free = Vehicle(primary_suspension=PrimarySuspension(stiffness_x=1.0, stiffness_y=1.0))
    speed, step = 5.0, 0.02
    contacts = wheels(conicity, speed=speed)
    cone = contacts.contact.geometry
    wave = 2 * np.pi * np.sqrt(
        cone.half_distance * cone.radius
        / (conicity * (1 + cone.head_radius * conicity / cone.half_distance))
    )  # fmt: skip
    mono = assemble(free, STIFF, POSITION, SPATIAL)
    state = equilibrium(mono, contacts, POSITION, np.zeros(16))
    y, yaw = (mono.coordinate(f"wheelset[2].{name}") for name in ("y", "yaw"))
    state.x[y], state.v[yaw] = 1e-3, -((2 * np.pi / wave) ** 2) * 1e-3 * speed
    interval, track = Interval(mono, contacts, step, BETA, GAMMA), [state.x[y]]
    for n in range(1, round(0.9 * wave / speed / step)):
        state = interval.end(state, POSITION + speed * step * n, np.zeros(16))
        track.append(state.x[y])
    at = np.array(track)
    n = np.flatnonzero(at[:-1] * at[1:] < 0)
    crossed = (n + at[n] / (at[n] - at[n + 1])) * step * speed
    # Newmark's (omega h)^2 / 12 is 3e-4 at most; inertia and gravity are as little beside creep.
    assert 2 * np.diff(crossed)[0] == pytest.approx(wave, rel=1e-3)
    assert 4 * crossed[0] == pytest.approx(wave, rel=1e-3)


def test_forces_are_those_of_the_law_at_the_ports():
    """What two bodies exchange at the data of wheel and rail moves the system as here."""
    contacts = wheels(0.1, creep=Saturated(friction=0.3))
    mono = assemble(VEHICLE, TILTED, POSITION, SPATIAL)
    rough = np.tile([2e-5, 1e-3], 8) * np.cos(np.arange(16.0))
    *_, state = newmark(mono, contacts, held, lambda t: rough * np.sin(300 * t), 2e-4, 20)
    rails = mono.rails(POSITION)
    surface = np.zeros((8, 3))
    surface[:, :2] = rough.reshape(8, 2) * np.sin(300 * state.time)
    q, v = (
        np.hstack([(mono.wheel_ports @ part).reshape(8, 5), (rails @ part).reshape(8, 3) + off])
        for part, off in ((state.x, surface), (state.v, 0.0))
    )
    law = AtPorts(contact=contacts.contact, half_distance=contacts.contact.geometry.half_distance)
    force = law.force(q, v)
    assert force[:, 5:].ravel() == pytest.approx(state.force, abs=1e-9 * np.abs(force).max())
    at_ports = rails.T @ force[:, 5:].ravel() - mono.wheel_ports.T @ force[:, :5].ravel()
    here = -contacts.rows(mono, POSITION).T @ contacts.law.force(state.motion).ravel()
    assert at_ports == pytest.approx(here, abs=1e-9 * np.abs(here).max())


def test_about_rest_small_harmonics_are_the_frequency_response():
    """The rolling law linear where rails have rolled under their load, not where they lay."""
    contacts, step, omega = wheels(0.1), 2e-4, 2 * np.pi * 30.0
    mono = assemble(VEHICLE, TILTED, POSITION, SPATIAL)
    seen = np.array([2 / step * np.tan(omega * step / 2)])
    rest = equilibrium(mono, contacts, POSITION, np.zeros(16))
    linear = linearised(mono, contacts, POSITION, rest.motion)
    rough = 1e-8 * np.exp(1j * np.arange(16.0))
    X = frequency_response(mono, seen, linear, (linear.loads @ rough)[:, None])
    force = linear.forces(seen, X, rough[:, None])[0, :, 0]
    X = X[0, :, 0]
    state = replace(
        rest, x=rest.x + X.real, v=rest.v + (1j * seen * X).real, a=(-(seen**2) * X).real
    )
    interval = Interval(mono, contacts, step, BETA, GAMMA)
    for n in range(1, 21):
        turn = np.exp(1j * omega * step * n)
        state = interval.end(state, POSITION, (rough * turn).real)
        beyond = (state.force - rest.force).reshape(8, 3)
        expected = (force * turn).real.reshape(8, 3)
        # 1e-8 m beside compressions of 1e-4 m; and Newton's 1e-12 of them.
        assert np.abs(beyond - expected).max() < 1e-3 * np.abs(force).max()
