"""Wheels over defects, and at speeds that change: against equations solved by somebody else.

First a wheel on a rail that is a mass on a spring, by the same schemes and signals as the pair, and
by scipy's integrators with defects written by hand; then the pair of FMUs against the monolithic
solution.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from railcosim.analysis.comparison.in_time import newmark_forces
from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.time_run import run_pair
from railcosim.master.component import Variable
from railcosim.master.connections import connect_by_name
from railcosim.master.cosimulation import cosimulate
from railcosim.master.course import Course
from railcosim.master.law import Law
from railcosim.master.linear_component import LinearComponent
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.interface_jacobian import interface_jacobian
from railcosim.master.signals import Signal
from railcosim.master.system import System
from railcosim.mechanics.law import HertzContact, LinearContact
from railcosim.mechanics.ports import FORCE, Layout, Z
from railcosim.parameters import ArgumentError
from railcosim.reference.agreement import relative_rms
from railcosim.reference.contacts import Pressing
from railcosim.reference.monolithic import assemble
from railcosim.track.irregularity import Corrugation, Dip, Flat, FreshFlat, flat
from railcosim.track.irregularity.met import Wheels
from railcosim.track.travel import InTime, Steady

R, SPEED = 0.46, 20.0  # m, m/s
WHEEL, RAIL, STIFFNESS, DAMPING = 900.0, 100.0, 8e7, 5e4  # kg, kg, N/m, N s/m
LOAD, C = 80e3, 1e11  # N, N/m^1.5: loads are of the wheel and of what it carries
HERTZ = {"contact.nonlinear": True}
LINEAR = {"contact.nonlinear": False, "contact.stiffness": 1e9}
FALL = (LOAD / C) ** (2 / 3)  # m, at rest


def ours(journey, stop, step):
    """Contact force of a wheel at 0 m, by the master."""

    def mass(name, m, k, c, sign, held):
        force = Variable(name="force", unit="N")
        z = Variable(name=f"{name}_z", unit="m")
        A, B = [[0, 1], [-k / m, -c / m]], [[0], [sign / m]]
        return LinearComponent(
            name, A=A, B=np.hstack([B, [[0], [held / m]]]), C=[[1, 0]], D=[[0, 0]],
            inputs=[force, Variable(name="weight", unit="N")], outputs=[z],
            x0=[LOAD / STIFFNESS + (FALL if name == "wheel" else 0.0), 0.0],
        )  # fmt: skip

    lies = journey.under(Wheels(np.zeros(1), np.full(1, R)), (Z,))
    motions = [Variable(name=n, unit="m") for n in ("wheel_z", "rail_z", "irregularity_z")]
    law = Law(
        "contact", HertzContact(C=C), motions, [Variable(name="force", unit="N")], [[1, -1, -1]]
    )
    surface = Signal("surface", [motions[2]], lambda t: lies(t)[..., :1], vectorised=True)
    weight = Signal("weight", [Variable(name="weight", unit="N")], lambda t: [LOAD])
    parts = [
        surface, weight, mass("wheel", WHEEL, 0.0, 0.0, -1, 1.0), law,
        mass("rail", RAIL, STIFFNESS, DAMPING, 1, 0.0),
    ]  # fmt: skip
    system = System(parts, connect_by_name(parts))
    column = system.names.index("contact.force")
    points = list(cosimulate(system, interface_jacobian(), step, stop))
    return np.array([p.time for p in points]), np.array([p.outputs[column] for p in points])


def by_hand(depth, times, until):
    """The same forces from scipy's, with a surface by hand."""

    def rates(t, x):
        F = C * max(x[0] - x[2] - float(depth(t)), 0.0) ** 1.5
        return [x[1], (LOAD - F) / WHEEL, x[3], (F - STIFFNESS * x[2] - DAMPING * x[3]) / RAIL]

    rest = [LOAD / STIFFNESS + FALL, 0.0, LOAD / STIFFNESS, 0.0]
    found = solve_ivp(
        rates, (0.0, until), rest, method="DOP853", t_eval=times, rtol=1e-6, atol=1e-9,
        max_step=1e-3,
    )  # fmt: skip
    return C * np.maximum(found.y[0] - found.y[2] - depth(found.t), 0.0) ** 1.5


def errors(journey, depth, stop, steps):
    found = []
    for step in steps:
        t, F = ours(journey, stop, step)
        exact = by_hand(depth, t, stop + step)
        found.append(relative_rms(F[:, None], exact[:, None], np.array([LOAD])))
    return found, exact


@pytest.mark.slow  # 1000 steps in Python, and scipy's
def test_the_blow_of_a_fresh_flat():
    """Drop (l/2 - |s|)^2 / (2 R) by hand; the wheel leaves the rail, comes down, and swings."""
    length = 0.04
    one = FreshFlat(length=length, turn=0.05)
    first = 0.05 * 2 * np.pi * R
    journey = Journey(speed=SPEED, held=False, profile=flat(), defects=(one,))

    def depth(t):
        return np.maximum(length / 2 - np.abs(SPEED * t - first), 0.0) ** 2 / (2 * R)

    (coarse, fine), exact = errors(journey, depth, 0.02, (4e-5, 2e-5))
    assert exact.max() > 2 * LOAD
    assert exact.min() < 0.3 * LOAD
    assert fine < 0.01  # the kink lies within a step, so 2 is the order at best
    assert coarse > 2 * fine


@pytest.mark.slow  # likewise
def test_run_up_through_a_resonance():
    """Waves of 0.5 m, 15 to 30 m/s in 0.3 s: 30 to 60 Hz, past the wheel on its track at 45 Hz."""
    travel = InTime("up", np.array([0.0, 0.1, 1.0]), np.array([15.0, 15.0, 60.0]))
    one = Corrugation(depth=2e-4, length=0.5, at=1.0, waves=40)
    journey = Journey(speed=15.0, held=False, profile=flat(), defects=(one,), travel=travel)

    def depth(t):
        s = np.where(t < 0.1, 15.0 * t, 1.5 + 15.0 * (t - 0.1) + 25.0 * (t - 0.1) ** 2) - 1.0
        there = (s > 0) & (s < 20.0)
        slope = there * 1e-4 * 4 * np.pi * np.sin(4 * np.pi * s)
        # A wheel in waves that are long for it: -R f'^2 / 2.
        return there * 1e-4 * (1 - np.cos(4 * np.pi * s)) - R * slope**2 / 2

    (error,), exact = errors(journey, depth, 0.4, (4e-4,))
    assert error < 0.02  # four steps an oscillation of the contact, forty of the waves
    swing = np.abs(exact - LOAD)
    t = np.linspace(0.0, 0.4, swing.size)
    # It swings most past the resonance, not at the highest speed.
    assert 0.25 < t[swing.argmax()] < 0.36  # 22.5 m/s at 0.25 s
    assert swing.max() > 1.5 * max(swing[t < 0.2].max(), swing[t > 0.38].max())


@pytest.fixture
def run(exported):
    """Function: the pair, contacts of Hertz in the track."""

    def made(journey, stop, parameters=HERTZ):
        files = exported.folder / "Vehicle.fmu", exported.folder / "TrackWithContact.fmu"
        course = Course(scheme=gauss_seidel(first="vehicle"), step=1e-4, stop=stop)
        dataset, stopped = run_pair(*files, parameters, journey, course, lambda done, total: None)
        assert stopped is None
        return dataset

    return made


def forces(dataset):
    return np.stack([dataset[name].values for name in Layout().names(FORCE)], axis=1)


def place_of_first(run):
    still = Journey(speed=60.0, held=False, profile=flat())
    return float(run(still, 1e-3)["wheelset[1].position"][0])


def test_the_pair_meets_it_where_and_when_it_is(run, exported):
    """On the right rail, 1 m ahead of the first wheelset; the vehicle FMU tells its wheels."""
    start = place_of_first(run)
    defects = (Dip(depth=2e-4, length=0.2, at=start + 1.0, side="right"),)
    F = forces(run(Journey(speed=60.0, held=False, profile=flat(), defects=defects), 0.02))
    blow = np.abs(F - F[0]).max(axis=0) / F[0]
    assert blow[4] > 0.2  # the first on the right
    assert blow[5:].max() < 0.5 * blow[4]
    begins = np.argmax(np.abs(F[:, 4] / F[0, 4] - 1) > 0.1) * 1e-4
    assert 0.9 / 60.0 < begins < 1.0 / 60.0
    with pytest.raises(ArgumentError, match=r"no wheel comes to it within 0\.3 m"):
        run(Journey(speed=60.0, held=False, profile=flat(), defects=defects), 5e-3)


# Finite elements in time, 1600 steps: 3 s.
@pytest.mark.slow
def test_the_pair_over_defects_while_it_brakes_is_the_monolithic_system(run, exported, models):
    """Flat and dip from 60 m/s down by 400 m/s2, which shows: wheels held, the surface moves."""
    travel = InTime("brakes", np.array([0.0, 0.1]), np.array([60.0, 20.0]))
    places = models.positions
    defects = (
        Dip(depth=3e-4, length=0.5, at=places[0] + 0.6), Flat(length=0.1, wheel="2.left", turn=0.4)
    )  # fmt: skip
    stop, found = 0.04, {}
    for name, way in {"braking": travel, "steady": None}.items():
        journey = Journey(speed=60.0, held=True, profile=flat(), defects=defects, travel=way)
        found[name] = forces(run(journey, stop, parameters=LINEAR))
    mono = assemble(exported.vehicle, exported.track, places)
    law = Pressing(LinearContact(k_H=1e9))
    journey = Journey(speed=60.0, held=True, profile=flat(), defects=defects, travel=travel)
    course = Course(scheme=gauss_seidel(first="vehicle"), step=1e-4, stop=stop)
    theirs = newmark_forces(mono, places, law, journey, course, lambda done, total: None)
    error = relative_rms(found["braking"], theirs, mono.load)
    # 0.03: the flat is passed in 17 steps; Newmark's are four times shorter.
    assert error < 0.04, error
    assert relative_rms(found["steady"], theirs, mono.load) > 10 * error


def test_where_wheels_are_while_they_brake(run):
    """60 m/s down by 50 m/s2, in closed form; and a dip is met when they are there."""
    travel = InTime("brakes", np.array([0.0, 1.0]), np.array([60.0, 10.0]))
    start = place_of_first(run)
    defects = (Dip(depth=2e-4, length=0.2, at=start + 1.0),)
    found = {}
    for name, way in {"braking": travel, "steady": None}.items():
        journey = Journey(speed=60.0, held=False, profile=flat(), defects=defects, travel=way)
        found[name] = run(journey, 0.03)
    t, braking = found["braking"]["time"].values, found["braking"]
    way = 60.0 * t - 25.0 * t**2
    # Rounded at 20 m.
    assert braking["wheelset[1].position"].values == pytest.approx(start + way, abs=1e-13)
    assert braking["speed"].values == pytest.approx(60.0 - 50.0 * t)
    # At the same place the force is the same, but for what 0.4 m/s of 60 change.
    steady = np.interp(way, 60.0 * t, forces(found["steady"])[:, 0])
    error = np.abs(forces(braking)[:, 0] - steady).max() / np.ptp(steady)
    late = np.abs(forces(braking)[:, 0] - forces(found["steady"])[:, 0]).max() / np.ptp(steady)
    assert error < 0.5 * late


def test_one_speed_from_a_file_has_the_bits_of_the_number(run):
    profile = flat()
    alike = InTime("c", np.array([0.0, 1.0]), np.full(2, 60.0))
    one, other = (
        run(Journey(speed=60.0, held=False, profile=profile, travel=way), 0.01)
        for way in (None, alike)
    )
    assert list(one) == list(other)
    assert all(np.array_equal(one[name], other[name]) for name in one)
    assert Journey(speed=60.0, held=False, profile=profile).way == Steady(60.0)


def test_held_wheels_meet_what_moves(run):
    """A flat of a wheel that is held comes round as well."""
    one = Flat(length=0.05, wheel="1", turn=0.1)
    F = forces(run(Journey(speed=60.0, held=True, profile=flat(), defects=(one,)), 0.01))
    assert np.abs(F[:, 0] / F[0, 0] - 1).max() > 0.2
    assert np.abs(F[:, 4] / F[0, 4] - 1).max() > 0.2
