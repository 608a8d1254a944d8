"""Nonlinear equations of a vehicle on rigid rails: linear part, mirror, stops, order, rest."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from railcosim.mechanics.contact.numbers import derivatives
from railcosim.vehicle.eigenmodes import poles_of
from railcosim.vehicle.hunting import critical_speed
from railcosim.vehicle.multibody import SPATIAL, build_multibody
from railcosim.vehicle.on_rails import cones_of, rolling
from railcosim.vehicle.parameters import Rolling, Vehicle
from railcosim.vehicle.running import running
from railcosim.vehicle.train import Train, TrainVehicle

SPEED = np.array(40.0)


@pytest.fixture(scope="module")
def paper():
    return running(Vehicle())


def large(equations, seed=1):
    """A state that slides, flanges and nearly lifts wheels."""
    rng = np.random.default_rng(seed)
    state = equations.rest.copy()
    n = equations.size
    state[n:] *= SPEED
    state[:n] += 1e-5 * rng.normal(size=n)
    state[n:] += 1e-3 * rng.normal(size=n)
    state[equations.across] += [6e-3, -3e-3, 9.3e-3, 1e-3]
    return state


def test_at_rest_wheels_carry_their_loads(paper):
    """Straight running at any speed: nothing accelerates."""
    n = paper.size
    for speed in (5.0, 80.0):
        state = paper.rest.copy()
        state[n:] *= speed
        assert np.abs(paper.rates(state, np.array(speed))[n:]).max() < 1e-9  # digits of 9.81 m/s2
    (which, law), *others = paper.laws
    assert not others
    q = np.einsum("cij,j->ci", paper.contacts, paper.rest[:n])
    down = law.force(q[which], 0 * q[which])[:, 6]
    assert down == pytest.approx(
        np.repeat(paper.body.wheel_load, 2), rel=1e-6
    )  # spins do not press


def test_linear_about_straight_running():
    """With linear creep as the root locus has it, from the contacts of a wheelset at rest."""
    linear = running(Vehicle(rolling=Rolling(conicity=0.1, creep="linear")))
    body = build_multibody(Vehicle(), SPATIAL)
    contacts = rolling(body, cones_of(body, 0.1))

    def other(speed):
        K, C = contacts(speed).on_rigid_rails(body)
        return body.M, body.C + C, body.K + K

    for speed in (20.0, 60.0):
        for found, expected in zip(linear.matrices(speed), other(speed), strict=True):
            # Here an axle turns so that nothing drags; the other rests without: 20 N, whose part
            # in K, as the load changes them, is 9e-5 of the greatest.
            assert found == pytest.approx(expected, rel=1e-6, abs=2e-4 * np.abs(expected).max())
    speeds = np.arange(5.0, 400.0, 2.0) / 3.6
    found = critical_speed(linear.poles, speeds)
    expected = critical_speed(lambda speed: poles_of(*other(speed))[0], speeds)
    assert found.speed == pytest.approx(expected.speed, rel=1e-4)
    assert found.frequency == pytest.approx(expected.frequency, rel=1e-4)


@pytest.mark.parametrize("speed", [15.0, 90.0])
def test_matrices_are_what_the_rates_do_at_a_speed(paper, speed):
    """What is scaled from 1 m/s, gyroscopes included, against derivatives at the speed."""
    n, mass = paper.size, np.diag(paper.body.M)[:, None]
    rest = paper.rest.copy()
    rest[n:] *= speed
    by = derivatives(lambda x: paper.rates(x, np.full(x.shape[:-1], speed)), rest)[n:]
    _, C, K = paper.matrices(speed)
    gyroscope = np.abs(paper.turning).max() * speed
    assert gyroscope > 1e3
    assert -mass * by[:, :n] == pytest.approx(K, rel=1e-9, abs=1.0)
    assert -mass * by[:, n:] == pytest.approx(C, rel=1e-9, abs=1e-3 * gyroscope)


def test_the_mirror_image_moves_as_the_mirror_image(paper):
    signs = np.tile(np.where(paper.body.even, 1.0, -1.0), 2)
    state = large(paper)
    one, other = (paper.rates(x, SPEED) for x in (state, signs * state))
    assert other == pytest.approx(signs * one, rel=1e-9, abs=1e-9 * np.abs(one).max())


def test_many_runs_at_once_are_each_alone(paper):
    states = np.array([large(paper, seed) for seed in (1, 2, 3)])
    speeds = np.array([20.0, 40.0, 60.0])
    together = paper.rates(states, speeds)
    for state, speed, rates in zip(states, speeds, together, strict=True):
        assert rates == pytest.approx(paper.rates(state, speed), rel=1e-12, abs=1e-9)


def test_stops_act_behind_their_gap():
    """By hand: 1 MN/m beyond 10 mm, between car body and bogie, where the stretch is 12 mm."""
    plain = Vehicle()
    stopped = replace(
        plain,
        secondary_suspension=replace(
            plain.secondary_suspension, stop_stiffness=1e6, stop_gap=10e-3
        ),
    )
    with_stops, without = running(stopped), running(plain)
    n = with_stops.size
    for way in (1.0, -1.0):
        state = np.zeros(2 * n)
        state[:n] = without.rest[:n]
        state[with_stops.body.at("bogie[1]", "y")] = way * 12e-3
        state[with_stops.body.at("bogie[2]", "y")] = way * 9e-3  # within
        mass = np.diag(with_stops.body.M)
        force = mass * (with_stops.rates(state, SPEED) - without.rates(state, SPEED))[n:]
        assert force[with_stops.body.at("bogie[1]", "y")] == pytest.approx(-way * 2e3, rel=1e-9)
        assert force[with_stops.body.at("carbody", "y")] == pytest.approx(way * 2e3, rel=1e-9)
        assert force[with_stops.body.at("bogie[2]", "y")] == pytest.approx(0.0, abs=1e-6)


# 5 s of an integrator of small steps.
@pytest.mark.slow
def test_runs_against_another_integrator(paper):
    """Runge-Kutta's fourth order, against LSODA with tight tolerances, through a flange's blow."""
    begin, speed = large(paper), SPEED[None]
    length = 0.03
    exact = solve_ivp(
        lambda t, x: paper.rates(x, SPEED), (0, length), begin, method="LSODA", rtol=1e-10,
        atol=1e-13,
    ).y[:, -1]  # fmt: skip
    errors = []
    for count in (60, 120):
        end = paper.run(begin[None], speed, length / count, count, lambda state: None)[0]
        errors.append(np.abs(end - exact)[paper.across].max())
    assert errors[0] < 2e-5
    assert errors[1] < errors[0] / 3  # a flange's bend leaves second order


def test_wheels_of_several_kinds():
    """A train whose vehicles roll differently: each as alone, on its own law."""
    steep = Vehicle(rolling=Rolling(conicity=0.2))
    train = running(Train(vehicles=(TrainVehicle(vehicle=Vehicle()), TrainVehicle(vehicle=steep))))
    assert [which.tolist() for which, _ in train.laws] == [list(range(8)), list(range(8, 16))]
    alone = running(steep)
    rng = np.random.default_rng(5)
    state, small = np.zeros(2 * train.size), np.zeros(2 * alone.size)
    state[: train.size], small[: alone.size] = train.rest[: train.size], alone.rest[: alone.size]
    for i in range(1, 5):
        for direction in ("y", "yaw"):
            moved = 1e-3 * rng.normal()
            state[train.body.at(f"wheelset[{i + 4}]", direction)] = moved
            small[alone.body.at(f"wheelset[{i}]", direction)] = moved
    found, expected = train.rates(state, SPEED), alone.rates(small, SPEED)
    for i in range(1, 5):
        for direction in ("y", "roll", "spin", "yaw"):
            one = found[train.size + train.body.at(f"wheelset[{i + 4}]", direction)]
            other = expected[alone.size + alone.body.at(f"wheelset[{i}]", direction)]
            assert one == pytest.approx(other, rel=1e-9, abs=1e-9)


def test_very_low_speeds_need_very_short_steps(paper):
    with pytest.raises(ArithmeticError, match="begin at a higher speed"):
        paper.step_of(np.array([0.1, 10.0]))
