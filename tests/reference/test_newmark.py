"""The monolithic reference against one mass on its contact, equilibrium and its own refinement."""

from dataclasses import replace

import numpy as np
import pytest
from railcosim.reference.monolithic import assemble, frequency_response
from railcosim.reference.newmark import equilibrium, newmark
from railcosim.track.parameters import Fastening, Foundation, Mesh, Rail, Slab, Track
from railcosim.vehicle.contact import HertzContact, LinearContact
from railcosim.vehicle.parameters import PrimarySuspension, SecondarySuspension, Vehicle
from scipy.integrate import solve_ivp

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


def smooth(t):
    return np.zeros(8)


def test_equilibrium_carries_the_weight():
    """Contact forces are the wheel loads; so are the fastenings' and the foundation's."""
    vehicle = Vehicle()
    mono = assemble(vehicle, TRACK, POSITION)
    x, force = equilibrium(mono, HERTZ, mono.rails(POSITION), np.zeros(8))
    # Wheels are alike and so are the suspensions: rounding of Newton's method.
    assert force == pytest.approx(np.full(8, vehicle.wheel_load), rel=1e-9)
    residual = mono.K @ x - mono.rails(POSITION).T @ force
    residual -= 2 * vehicle.wheel_load * mono.wheels[:4].sum(axis=0) - mono.wheels.T @ force
    assert np.abs(residual).max() < 1e-6 * vehicle.wheel_load
    # The foundation's pressure is in the K of the slabs' rigid modes: their springs carry 8 loads.
    assert HERTZ.force(mono.wheels @ x - mono.rails(POSITION) @ x) == pytest.approx(force, rel=1e-9)


def test_equilibrium_on_an_uneven_rail():
    """Irregularity pulls loads apart within a bogie; their sum is the weight all the same."""
    vehicle = Vehicle()
    mono = assemble(vehicle, TRACK, POSITION)
    dip = 2e-4 * np.array([1, -1, 0.5, 0, 1, -1, 0.5, 0])
    x, force = equilibrium(mono, HERTZ, mono.rails(POSITION), dip)
    assert force.sum() == pytest.approx(8 * vehicle.wheel_load, rel=1e-9)
    # Wheelset 1 over a dip, 2 over a bump: 2 K_p/2 x 0.2 mm = some hundred newtons a wheel.
    assert 100 < force[1] - force[0] < 1500
    across = mono.wheels @ x - mono.rails(POSITION) @ x - dip
    assert HERTZ.force(across) == pytest.approx(force, rel=1e-8)


def test_at_rest_nothing_moves():
    mono = assemble(Vehicle(), TRACK, POSITION)
    instants = list(newmark(mono, HERTZ, held, smooth, 1e-4, 50))
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
    vehicle, omega = soft_vehicle(), 2 * np.pi * 60
    mono, load = assemble(vehicle, RIGID, POSITION), vehicle.wheel_load

    def rough(t):
        return np.full(8, dip * 0.5 * (1 - np.cos(omega * t)))

    def fall(t, y):
        force = law.force(np.array([y[0] - rough(t)[0]]))[0]
        return [y[1], (2 * load - 2 * force) / vehicle.wheelset.mass]

    static = (load / law.C) ** (2 / 3) if isinstance(law, HertzContact) else load / law.k_H
    duration = 0.02
    exact = solve_ivp(fall, (0, duration), [static, 0.0], rtol=1e-10, atol=1e-14, max_step=1e-4)
    found = {}
    for steps in (400, 800):
        last = list(newmark(mono, law, held, rough, duration / steps, steps))[-1]
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
    """Wheels moving over an uneven rail, whole system."""
    track, duration = TRACK, 6e-3
    mono = assemble(Vehicle(), track, POSITION)

    def moving(t):
        return POSITION + 20.0 * t

    def rough(t):
        return 2e-5 * np.tile(1 - np.cos(2 * np.pi * moving(t) / 0.8), 2) * (t / duration) ** 3

    def final(steps):
        return list(newmark(mono, HERTZ, moving, rough, duration / steps, steps))[-1].force

    exact = final(960)
    errors = [np.abs(final(n) - exact).max() for n in (30, 60, 120)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # Second order once the contact resonance, 0.2 ms a radian, has some steps.
    assert orders[-1] > 1.7, (errors, orders)


def test_no_numerical_damping():
    """Average acceleration keeps the energy of an undamped linear system for ever."""
    vehicle = soft_vehicle()
    law = LinearContact(k_H=1e9)
    mono = assemble(
        vehicle, replace(RIGID, fastening=Fastening(stiffness=1e16, damping=0)), POSITION
    )
    # Start out of balance: the irregularity of the start is gone at the first step.
    heights = []
    for instant in newmark(
        mono, law, held, lambda t: np.full(8, 2e-5 if t == 0 else 0.0), 2e-4, 2000
    ):
        heights.append(instant.x[mono.coordinate("wheelset[1].z")])
    swing = np.array(heights) - vehicle.wheel_load / law.k_H
    # 2000 steps, 98 swings at the step's own frequency: the last are as high as the first.
    assert np.abs(swing[-200:]).max() == pytest.approx(np.abs(swing[:200]).max(), rel=1e-3)
    assert np.abs(swing).max() == pytest.approx(2e-5, rel=1e-2)


def test_coupled_receptance_of_one_wheel_on_rigid_rails():
    """Wheelset on two contacts: 1 / (2 k_H - omega^2 m), with the suspension's share far below."""
    mono = assemble(soft_vehicle(), RIGID, POSITION)
    omega, k_H = 2 * np.pi * np.array([20.0, 93.5, 300.0]), 0.3e9
    load = np.zeros((mono.K.shape[0], 1))
    j = mono.coordinate("wheelset[4].z")
    load[j] = 1.0
    found = frequency_response(mono, omega, k_H, POSITION, load)[:, j, 0]
    # Rails give 1e-6 of the contacts.
    assert found == pytest.approx(1 / (2 * k_H - omega**2 * 1680.0), rel=1e-4)


def test_wheel_resonance_on_rigid_rails_is_the_papers():
    """93.5 Hz in Xu & Lu for k_H = 0.3 GN/m; eq. 19 gives 95.1."""
    mono = assemble(Vehicle(), RIGID, POSITION)
    f = np.arange(85.0, 105.0, 0.25)
    load = np.zeros((mono.K.shape[0], 1))
    j = mono.coordinate("wheelset[4].z")
    load[j] = 1.0
    x = frequency_response(mono, 2 * np.pi * f, 0.3e9, POSITION, load)[:, j, 0]
    # Read from the paper's figure; grid of 0.25 Hz.
    assert f[np.argmax(np.abs(x))] == pytest.approx(93.5, abs=0.5)


def test_static_stiffness_with_everything_in_series():
    """Twelve unknown springs by hand: slabs that do not bend sink as rigid bodies."""
    track = Track(
        mesh=Mesh(cells=4, elements_per_bay=2, highest_slab_frequency=1.0),
        foundation=Foundation(stiffness=6e7, damping=0),
        rail=Rail(young_modulus=2e17),
    )
    mono = assemble(Vehicle(), track, POSITION)
    rails = mono.rails(POSITION).toarray()
    # All rails sink alike under equal forces on both only if the load is in the middle of the
    # ring's symmetry: eight wheels at quarters do it.
    quarters = np.array([0.3125, 5.3125, 10.3125, 15.3125])
    rails = mono.rails(quarters).toarray()
    x = frequency_response(mono, np.zeros(1) + 1e-3, 0.0, quarters, rails.T.sum(axis=1)[:, None])[
        0, :, 0
    ]
    fastenings = 2 * 32 * 3e7
    foundation = 4 * 4.95 * 2.4 * 6e7
    # 1e-6 for what rails of 1e6 times the stiffness bend.
    assert rails @ x == pytest.approx(np.full(8, 8 / fastenings + 8 / foundation), rel=1e-4)
