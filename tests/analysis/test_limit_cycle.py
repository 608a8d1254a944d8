"""Amplitudes against speed: of equations whose cycles are known, and of a published bogie."""

import signal
from dataclasses import dataclass

import numpy as np
import pytest

from railcosim.analysis.response.limit_cycle import Sweep, _passages, _settled, limit_cycles
from railcosim.parameters import ArgumentError
from railcosim.vehicle.hunting import critical_speed
from railcosim.vehicle.running import Equations

OMEGA = 2 * np.pi * 2.5
FAST = 10.0  # 1/s


@dataclass(frozen=True)
class NormalForm(Equations):
    """r' = FAST r (mu + c r^2 - r^4), r in cm, mu the speed over 50 m/s less 1; it turns by OMEGA.

    Beyond mu = 0 the rest is left. With c = 1, hard: cycles of r^2 = (1 + sqrt(1 + 4 mu)) / 2 last
    down to mu = -1/4. With c = -1, soft: r^2 = (sqrt(1 + 4 mu) - 1) / 2.
    """

    c: float

    across = np.array([0])
    rest = np.zeros(2)

    def mu(self, speed):
        return np.asarray(speed) / 50 - 1

    def rates(self, state, speed):
        y, w = np.moveaxis(state, -1, 0)
        r2 = (y**2 + (w / OMEGA) ** 2) * 1e4
        grows = FAST * (self.mu(speed) + self.c * r2 - r2**2)
        return np.stack([grows * y + w, grows * w - OMEGA**2 * y], axis=-1)

    def matrices(self, speed):
        growth = FAST * self.mu(speed)
        return np.eye(1), np.array([[-2 * growth]]), np.array([[OMEGA**2 + growth**2]])


def swept(equations, speeds, longest=60.0):
    speeds = np.asarray(speeds, float)
    critical = critical_speed(equations.poles, np.arange(5.0, 100.0, 2.0))
    sweep = Sweep(equations, speeds, critical, longest, lambda done, total: None)
    sweep.up()
    sweep.down()
    return sweep, *sweep.branches.values()


@pytest.mark.slow  # runs up and down over many speeds: 5 s
def test_a_hard_loss_of_stability():
    """Jump up at 50 m/s, down at 37.5, by closed form."""
    speeds = [30.0, 36.0, 37.0, 38.5, 41.0, 45.0, 49.0, 51.5, 55.0, 60.0]
    sweep, up, down = swept(NormalForm(c=1.0), speeds)
    assert sweep.critical.speed == pytest.approx(50.0, rel=1e-6)
    assert sweep.critical.frequency == pytest.approx(2.5, rel=1e-6)
    mu = np.array(speeds) / 50 - 1
    cycle = 1e-2 * np.sqrt((1 + np.sqrt(np.maximum(1 + 4 * mu, 0))) / 2)
    # Settled to 1e-3; seen at 2 ms steps: (OMEGA h / 2)^2 / 2 = 1e-4 short of the top.
    assert up.settled.all()
    assert up.amplitude == pytest.approx(np.where(mu > 0, cycle, 0.0), rel=2e-3)
    assert down.settled.all()
    assert down.amplitude == pytest.approx(np.where(mu > -0.25, cycle, 0.0), rel=2e-3)
    for branch in (up, down):
        found = sweep.frequency(branch)
        assert found[branch.alive] == pytest.approx(2.5, rel=1e-4)
        assert np.isnan(found[~branch.alive]).all()


# 5 s of many periods; the hard one stays.
@pytest.mark.slow
def test_a_soft_loss_of_stability():
    """Both ways are one."""
    speeds = np.array([40.0, 48.0, 52.0, 55.0, 60.0])
    _, up, down = swept(NormalForm(c=-1.0), speeds)
    mu = np.maximum(speeds / 50 - 1, 0)
    expected = 1e-2 * np.sqrt((np.sqrt(1 + 4 * mu) - 1) / 2)
    for branch in (up, down):
        assert branch.settled.all()
        assert branch.amplitude == pytest.approx(expected, rel=3e-3)


def test_what_has_not_settled_is_refused():
    """Near the critical speed nothing settles in a short time, and no number is given."""
    _, up, down = swept(NormalForm(c=-1.0), [49.99, 50.01], longest=5.0)
    assert up.settled.tolist() == [True, False]  # below, the rest is stable: 0
    assert np.isnan(up.amplitude[1])
    assert not down.settled.any()
    assert np.isnan(down.amplitude).all()


def test_an_interrupted_sweep_ends_with_what_it_has_found():
    """Ctrl-C before it comes down: what it found on the way up is there, the rest is told."""

    def interrupting(done, total):
        if done >= 1:
            signal.raise_signal(signal.SIGINT)

    # Stable at rest, so nothing is run on the way up.
    found = limit_cycles(speeds=np.array([20.0]), progress=interrupting)
    assert found.attrs["stopped"] == "interrupted"
    assert found["amplitude_up"].values.tolist() == [0.0]
    assert found["how_up"].values.tolist() == [0]
    assert found["how_down"].values.tolist() == [3]
    assert np.isnan(found["amplitude_down"].values).all()


def test_what_leaves_the_rails_is_told():
    @dataclass(frozen=True)
    class Unbounded(NormalForm):
        def rates(self, state, speed):
            y, w = np.moveaxis(state, -1, 0)
            return np.stack([9 * y + w, 9 * w - OMEGA**2 * y], axis=-1)

    _, up, _ = swept(Unbounded(c=1.0), [55.0])
    assert up.off.all()
    assert np.isnan(up.amplitude).all()
    assert not up.settled.any()


@pytest.mark.parametrize(
    ("seen", "known"),
    [
        ([1.0, 1.0, 1.0], True),
        ([1.0, 1.0], False),  # two windows tell no series
        ([1e-7], True),  # dead
        ([1.0, 1.1, 1.2], False),
        ([1.0, 0.9, 0.81], False),  # dies, by a tenth a window
        ([1.0, 1.0005, 1.00075], True),  # 2.5e-4 more to come
        ([1.0, 1.0005, 1.00099], False),  # hardly slower: 0.024 to come
        ([1.0, 1.2, 1.0], False),  # beats
    ],
)
def test_when_an_amplitude_is_known(seen, known):
    assert _settled([1e-3 * np.array([a]) if a > 1e-6 else np.array([a]) for a in seen])[0] == known


def test_frequency_of_passages():
    t = 1e-3 * np.arange(1000)
    assert _passages(np.sin(2 * np.pi * 7.3 * t - 1), 1e-3) == pytest.approx(7.3, rel=1e-4)
    assert np.isnan(_passages(np.sin(2 * np.pi * 0.7 * t), 1e-3))


def test_what_cannot_be_swept():
    for speeds, says in (([50.0, 40.0], "increase"), ([-1.0, 2.0], "increase"), ([], "increase")):
        with pytest.raises(ArgumentError, match=says):
            limit_cycles(speeds=np.array(speeds))
    with pytest.raises(ArgumentError, match="longest"):
        limit_cycles(speeds=np.array([30.0]), longest=0.0)
