"""The monolithic reference against one mass on its contact, equilibrium and its own refinement."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from railcosim.mechanics.law import HertzContact, LinearContact
from railcosim.reference.contacts import Pressing
from railcosim.reference.frequency import frequency_response, linearised
from railcosim.reference.monolithic import assemble
from railcosim.reference.newmark import newmark
from railcosim.reference.rest import equilibrium
from railcosim.track.parameters import Fastening, Foundation, Mesh, Rail, Slab, Track
from railcosim.vehicle.parameters import PrimarySuspension, SecondarySuspension, Vehicle

HERTZ = HertzContact(C=9.64e10)
POSITION = np.array([18.5, 16.0, 2.8, 0.3125])
TRACK = Track(mesh=Mesh(cells=4, elements_per_bay=2, highest_slab_frequency=300))
# Rails that do not give: what is left is the vehicle on its contacts.
RIGID = Track(
    slab=Slab(present=False),
    rail=Rail(young_modulus=2e17),
    fastening=Fastening(stiffness=1e16),
    mesh=Mesh(cells=4, elements_per_bay=2),
)


def held(t):
    return POSITION


def springs(mono, k_H, position):
    return linearised(mono, Pressing(LinearContact(k_H=k_H)), position)


def smooth(t):
    return np.zeros(8)


def test_equilibrium_carries_the_weight():
    """Contact forces are the wheel loads; so are the fastenings' and the foundation's."""
    vehicle = Vehicle()
    mono = assemble(vehicle, TRACK, POSITION)
    rest = equilibrium(mono, Pressing(HERTZ), POSITION, np.zeros(8))
    x, force = rest.x, rest.force
    # Wheels are alike and so are the suspensions: rounding of Newton's method.
    assert force == pytest.approx(np.full(8, vehicle.wheel_load), rel=1e-9)
    residual = mono.K @ x - mono.rails(POSITION).T @ force
    residual -= mono.wheels.T @ (mono.load - force)
    assert np.abs(residual).max() < 1e-6 * vehicle.wheel_load
    # The foundation's pressure is in the K of the slabs' rigid modes: their springs carry 8 loads.
    assert HERTZ.force(mono.wheels @ x - mono.rails(POSITION) @ x) == pytest.approx(force, rel=1e-9)


def test_equilibrium_on_an_uneven_rail():
    """Bogies pitch freely with their wheelsets, so every wheelset carries the same; but a rail
    lower than the other carries less of it."""
    vehicle = Vehicle()
    mono = assemble(vehicle, TRACK, POSITION)
    left = 1e-5 * np.array([1.0, -1.0, 2.0, 0.0])
    dip = np.concatenate([left, -left])
    rest = equilibrium(mono, Pressing(HERTZ), POSITION, dip)
    x, force = rest.x, rest.force
    # Rounding of the solve, of 1e-16 x the contacts' stiffness over the suspensions'.
    assert force[:4] + force[4:] == pytest.approx(np.full(4, 2 * vehicle.wheel_load), rel=1e-8)
    across = mono.wheels @ x - mono.rails(POSITION) @ x - dip
    assert HERTZ.force(across) == pytest.approx(force, rel=1e-8)
    assert np.all((force[4:] - force[:4])[:3] * left[:3] > 0)


def test_at_rest_nothing_moves():
    mono = assemble(Vehicle(), TRACK, POSITION)
    instants = list(newmark(mono, Pressing(HERTZ), held, smooth, 1e-4, 50))
    assert [i.time for i in instants] == pytest.approx(np.arange(51) * 1e-4)
    for instant in instants:
        assert instant.x == pytest.approx(instants[0].x, rel=1e-7, abs=1e-12)
        assert instant.force == pytest.approx(instants[0].force, rel=1e-8)


def soft_vehicle():
    """Suspensions so soft that a wheelset knows nothing of what is above."""
    return Vehicle(
        primary_suspension=PrimarySuspension(stiffness=1.0, damping=0.0),
        secondary_suspension=SecondarySuspension(damping=0.0),
    )


@pytest.mark.parametrize(
    ("law", "dip"),
    [(LinearContact(k_H=1.3e9), 2e-5), (HERTZ, 2e-5), (HERTZ, 4e-4)],
    ids=["linear", "Hertz", "loss of contact"],
)
def test_a_wheelset_is_one_mass_on_two_contacts(law, dip):
    """m z'' = 2 P - 2 F(z - r(t)) on rigid rails, by an integrator of high order."""
    vehicle, omega = soft_vehicle(), 2 * np.pi * 150
    mono, load = assemble(vehicle, RIGID, POSITION), vehicle.wheel_load

    def rough(t):
        return np.full(8, dip * 0.5 * (1 - np.cos(omega * t)))

    def fall(t, y):
        force = law.force(np.array([y[0] - rough(t)[0]]))[0]
        return [y[1], (2 * load - 2 * force) / vehicle.wheelset.mass]

    static = (load / law.C) ** (2 / 3) if isinstance(law, HertzContact) else load / law.k_H
    duration = 0.02
    exact = solve_ivp(fall, (0, duration), [static, 0.0], rtol=1e-9, atol=1e-14, max_step=1e-4)
    found = {}
    for steps in (400, 800):
        last = list(newmark(mono, Pressing(law), held, rough, duration / steps, steps))[-1]
        found[steps] = last.x[mono.coordinate("wheelset[2].z")]
    errors = [abs(found[n] - exact.y[0, -1]) for n in (400, 800)]
    scale = np.abs(exact.y[0] - static).max()
    # Newmark: phase error (omega_n h)^2 / 12 x omega_n t with omega_n = 1240 rad/s: 8e-3 and 2e-3;
    # the rails' give is 1e-6 of the contacts'.
    assert errors[1] < 5e-3 * scale
    assert errors[1] < errors[0] / 3  # second order
    if dip > 1e-4:
        compression = exact.y[0] - np.array([rough(t)[0] for t in exact.t])
        assert compression.min() < 0  # the wheel did leave the rail


def test_second_order_on_the_track():
    """Whole system, the rail's surface moving under held wheels.

    Wheels that roll meet the kinks of the rail elements' slope, where no method is of second order.
    """
    track, duration = TRACK, 6e-3
    mono = assemble(Vehicle(), track, POSITION)

    def rough(t):
        waves = np.cos(2 * np.pi * (POSITION + 70.0 * t) / 0.8)
        return 2e-5 * np.tile(waves, 2) * (t / duration) ** 3

    def final(steps):
        return list(newmark(mono, Pressing(HERTZ), held, rough, duration / steps, steps))[-1].force

    exact = final(1920)
    errors = [np.abs(final(n) - exact).max() for n in (120, 240, 480)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # Second order once the contact's resonance on the rail, 0.2 ms a radian, has some steps.
    assert orders.min() > 1.7, (errors, orders)


def test_no_numerical_damping():
    """Average acceleration keeps the energy of an undamped linear system for ever."""
    vehicle = soft_vehicle()
    law = LinearContact(k_H=1e9)
    mono = assemble(
        vehicle, replace(RIGID, fastening=Fastening(stiffness=1e16, damping=0)), POSITION
    )
    # Start out of balance: the irregularity of the start is gone at the first step.
    j, m = mono.coordinate("wheelset[1].z"), vehicle.wheelset.mass
    at_rest = vehicle.wheel_load / law.k_H
    energy = [
        m * i.v[j] ** 2 / 2 + law.k_H * (i.x[j] - at_rest) ** 2
        for i in newmark(
            mono, Pressing(law), held, lambda t: np.full(8, 2e-5 * (t == 0)), 2e-4, 2000
        )
    ]
    assert energy[0] == pytest.approx(law.k_H * 2e-5**2, rel=1e-4)  # rails give 1e-6 of it
    # From the second instant on: at the first the acceleration is that of the rail before its jump.
    # Rails and suspensions take 1e-6.
    assert np.array(energy[1:]) == pytest.approx(energy[1], rel=1e-4)


def test_loss_factors_are_those_of_the_frequency_domain_at_their_frequency():
    """Wheels on contacts on rails that do not bend on fastenings with a loss factor, in a fraction.

    By hand: a rail's force P is -r / (1/k_H - 2/(m w^2) + 8/(K (1 + i loss) - w^2 M)), K and M
    those of all fastenings and of both rails.
    """
    f, loss, k_H, r = 80.0, 0.5, 1e9, 1e-5
    track = replace(
        RIGID, fastening=Fastening(stiffness=3e7, damping=0.0, loss_factor=loss),
        mesh=replace(RIGID.mesh, loss_factor_frequency=f),
    )  # fmt: skip
    vehicle, omega, per_period = soft_vehicle(), 2 * np.pi * f, 100
    mono = assemble(vehicle, track, POSITION)
    K, M = 2 * 32 * 3e7 * (1 + 1j * loss), 2 * 20.0 * track.rail.mass_per_length
    m = vehicle.wheelset.mass
    by_hand = -r / (1 / k_H - 2 / (m * omega**2) + 8 / (K - omega**2 * M))

    def rough(t):
        return np.full(8, r * np.sin(omega * t))

    step = 1 / f / per_period
    instants = list(
        newmark(mono, Pressing(LinearContact(k_H=k_H)), held, rough, step, 9 * per_period)
    )
    # What began with the run has decayed by exp(-loss omega t / 2) nearly: 1e-5 after 8 periods.
    last = instants[-per_period:]
    beyond = np.array([i.force - vehicle.wheel_load for i in last])
    turn = np.exp(-1j * omega * np.array([i.time for i in last]))
    found = 2j * np.mean(beyond * turn[:, None], axis=0)
    # Newmark's phase error, (omega h)^2 / 12 = 3e-4, some times that near the resonance.
    assert found == pytest.approx(np.full(8, by_hand), rel=5e-3)


def test_coupled_receptance_of_one_wheel_on_rigid_rails():
    """Wheelset on two contacts: 1 / (2 k_H - omega^2 m), with the suspension's share far below."""
    mono = assemble(soft_vehicle(), RIGID, POSITION)
    omega, k_H = 2 * np.pi * np.array([20.0, 93.5, 300.0]), 0.3e9
    load = np.zeros((mono.K.shape[0], 1))
    j = mono.coordinate("wheelset[4].z")
    load[j] = 1.0
    found = frequency_response(mono, omega, springs(mono, k_H, POSITION), load)[:, j, 0]
    # Rails give 1e-6 of the contacts.
    assert found == pytest.approx(1 / (2 * k_H - omega**2 * 1680.0), rel=1e-4)


def test_wheel_resonance_on_rigid_rails_is_the_papers():
    """93.5 Hz in Xu & Lu for k_H = 0.3 GN/m; eq. 19, without suspension, gives 95.1."""
    mono = assemble(Vehicle(), RIGID, POSITION)
    f = np.arange(85.0, 105.0, 0.25)
    load = np.zeros((mono.K.shape[0], 1))
    j = mono.coordinate("wheelset[4].z")
    load[j] = 1.0
    x = frequency_response(mono, 2 * np.pi * f, springs(mono, 0.3e9, POSITION), load)[:, j, 0]
    # By hand: wheelset and the bogie above it, whose damper adds and whose spring hardly does.
    K_p, c_p, m, m_t, J_t, L_t = 2.54e6, 1.3e5, 1680.0, 4420.0, 4902.0, 1.25
    omega = 2 * np.pi * f
    d = K_p + 1j * omega * c_p
    wheel = 6e8 + d - omega**2 * m
    bounce = 2 * d - omega**2 * m_t + 0.54e6 + 1j * omega * 3.3e4
    pitch = 2 * d * L_t**2 - omega**2 * J_t
    # Wheelsets i, k of a bogie: d / bounce +- d L_t^2 / pitch couples them.
    own, other = d**2 * (1 / bounce + L_t**2 / pitch), d**2 * (1 / bounce - L_t**2 / pitch)
    by_hand = (wheel - own) / ((wheel - own) ** 2 - other**2)
    # The hand's car body stands still: (1 Hz / 90 Hz)^2.
    assert x == pytest.approx(by_hand, rel=1e-3)
    # The paper's figure is read to 0.5 Hz; measured 94.25.
    assert f[np.argmax(np.abs(x))] == pytest.approx(93.5, abs=1.0)


def test_static_stiffness_with_everything_in_series():
    """By hand: rails and slabs that do not bend sink on all fastenings and the whole foundation."""
    track = Track(
        mesh=Mesh(cells=4, elements_per_bay=2, highest_slab_frequency=1.0),
        foundation=Foundation(stiffness=6e7, damping=0),
        rail=Rail(young_modulus=2e17),
    )
    mono = assemble(Vehicle(), track, POSITION)
    # Wheels at the ring's quarters: by symmetry all rails and slabs sink alike.
    quarters = np.array([0.3125, 5.3125, 10.3125, 15.3125])
    rails = mono.rails(quarters).toarray()
    x = frequency_response(
        mono, np.zeros(1) + 1e-3, springs(mono, 0.0, quarters), rails.T.sum(axis=1)[:, None]
    )[0, :, 0]
    fastenings = 2 * 32 * 3e7
    foundation = 4 * 4.95 * 2.4 * 6e7
    # 1e-6 for what rails of 1e6 times the stiffness bend.
    assert rails @ x == pytest.approx(np.full(8, 8 / fastenings + 8 / foundation), rel=1e-4)
