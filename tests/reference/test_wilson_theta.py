"""Wilson's theta method against its published matrix and example, in stability and in order."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import sparse

from railcosim.mechanics.law import HertzContact, LinearContact
from railcosim.reference.contacts import Pressing
from railcosim.reference.monolithic import assemble
from railcosim.reference.newmark import newmark
from railcosim.reference.state import Interval, State
from railcosim.reference.wilson_theta import BETA, GAMMA, THETA, wilson_theta, within
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.parameters import Vehicle

NONE = sparse.csr_array((1, 1))


class Spring:
    """A contact that is a spring from the last unknown to the ground."""

    orders = 1

    def __init__(self, k):
        self.law = LinearContact(k_H=k)

    def rows(self, mono, position):
        return sparse.eye_array(*mono.M.shape, format="csr")[[-1]]

    def lowered(self, mono):
        return NONE

    def pushes(self, mono):
        return NONE


def system(M, K, load):
    """What an interval knows of a system, undamped."""
    M, K = (sparse.csc_array(np.atleast_2d(A).astype(float)) for A in (M, K))
    eye = sparse.eye_array(*M.shape, format="csr")
    return SimpleNamespace(M=M, K=K, viscous_damping=0 * M, wheels=eye, load=np.array(load))


def steps_of(mono, spring, h, theta):
    """One step after the other, by the state."""
    ahead = Interval(mono, Spring(spring), theta * h, BETA, GAMMA)

    def step(x, v, a):
        begin = State(x=x, v=v, a=a, motion=np.zeros((1, 1)), force=np.zeros(1))
        end = within(begin, ahead.end(begin, np.zeros(1), np.zeros(1)), h, theta)
        return end.x, end.v, end.a

    return step


def amplification(omega_h, theta=THETA):
    """[a, v, x] of a mass on its contact's spring at the end of a step of 1 s, by those before."""
    step = steps_of(system(1.0, 0.0, [0.0]), omega_h**2, 1.0, theta)
    columns = [step(*(np.array([float(i == j)]) for i in (2, 1, 0))) for j in range(3)]
    return np.array([[a[0], v[0], x[0]] for x, v, a in columns]).T


@pytest.mark.parametrize("omega_h", [0.1, 0.6, 3.0, 50.0])
@pytest.mark.parametrize("theta", [1.0, THETA, 2.0])
def test_amplification_is_the_published_matrix(omega_h, theta):
    """Bathe, K. J., Finite Element Procedures, section 9.4.2, without damping and load."""
    beta = 1 / (theta / omega_h**2 + theta**3 / 6)
    published = [
        [1 - beta * theta**2 / 3 - 1 / theta, -beta * theta, -beta],
        [1 - 1 / (2 * theta) - beta * theta**2 / 6, 1 - beta * theta / 2, -beta / 2],
        [1 / 2 - 1 / (6 * theta) - beta * theta**2 / 18, 1 - beta * theta / 6, 1 - beta / 6],
    ]
    assert amplification(omega_h, theta) == pytest.approx(np.array(published), abs=1e-11)


def test_the_textbooks_example():
    """Bathe's two masses under a load applied at once: displacements as printed, 12 steps."""
    printed = [
        (0.00605, 0.366), (0.0525, 1.34), (0.196, 2.64), (0.490, 3.92), (0.952, 4.88), (1.54, 5.31),
        (2.16, 5.18), (2.67, 4.61), (2.92, 3.82), (2.82, 3.06), (2.33, 2.52), (1.54, 2.29),
    ]  # fmt: skip
    # 4 N/m of the second mass: 3 of its own, 1 of the contact.
    mono = system([[2, 0], [0, 1]], [[6, -2], [-2, 3]], [0.0, 10.0])
    step = steps_of(mono, 1.0, 0.28, THETA)
    state = (np.zeros(2), np.zeros(2), np.array([0.0, 10.0]))
    for expected in printed:
        state = step(*state)
        # Half of the last of three digits.
        assert state[0] == pytest.approx(expected, rel=5e-3)
        assert [float(f"{x:.3g}") for x in state[0]] == list(expected)


def turning(omega_h, theta=THETA):
    """Periods longer by what part, and damping as a ratio."""
    roots = np.linalg.eigvals(amplification(omega_h, theta))
    root = roots[np.argmax(roots.imag)]
    turn = float(np.angle(root))
    return omega_h / turn - 1, -np.log(np.abs(root)) / turn


def test_period_elongation_and_damping():
    """As small steps are: (6 theta^2 - 6 theta + 1) / 24 (omega h)^2, of the second order, five
    times central differences' and twice Newmark's 1/12; damping is of the third.

    By hand: on the line through the accelerations at both ends of a step, that at theta steps is
    less than the motion's by theta (theta - 1) / 2 h^2 of its second derivative, -omega^2 times it,
    as if the mass were more by that part; half of it is the period's. Linear acceleration itself
    has 1 / 24.
    """
    leading = (6 * THETA**2 - 6 * THETA + 1) / 24
    for omega_h in (0.02, 0.04):
        longer, damping = turning(omega_h)
        # The next term is of the order of (omega h)^2 of it: a third here measured.
        assert longer / omega_h**2 == pytest.approx(leading, rel=2 * omega_h**2)
        assert damping < 0.1 * omega_h**3
    assert turning(0.04)[1] / turning(0.02)[1] == pytest.approx(8.0, rel=0.01)


def test_period_and_amplitude_over_a_hundred_steps_are_the_eigenvalues():
    """At a tenth of a period a step, from marching: 6.1 % longer, 8.4 % less a period."""
    omega_h = 2 * np.pi / 10
    longer, damping = turning(omega_h)
    assert longer == pytest.approx(0.0615, abs=5e-5)
    assert 1 - np.exp(-2 * np.pi * damping) == pytest.approx(0.0841, abs=5e-5)
    step = steps_of(system(1.0, 0.0, [0.0]), omega_h**2, 1.0, THETA)
    state = (np.array([1.0]), np.array([0.0]), np.array([-(omega_h**2)]))
    x = [1.0]
    for _ in range(100):
        state = step(*state)
        x.append(state[0][0])
    n = np.arange(101)
    turn = omega_h / (1 + longer)
    waves = np.exp(-damping * turn * n) * np.array([np.cos(turn * n), np.sin(turn * n)])
    late = slice(20, None)  # the third root, that of no motion, has died away
    fitted, *_ = np.linalg.lstsq(waves[:, late].T, np.array(x)[late])
    assert waves[:, late].T @ fitted == pytest.approx(np.array(x)[late], abs=1e-9)


def test_stable_at_any_step_from_theta_of_1_37_on():
    """The textbook's limit; exactly (1 + sqrt(3)) / 2, where a period is much less than a step."""
    steps = np.geomspace(0.01, 1e4, 25)

    def growth(theta):
        return max(np.abs(np.linalg.eigvals(amplification(w, theta))).max() for w in steps)

    limit = (1 + np.sqrt(3)) / 2
    for theta in (limit + 1e-3, 1.37, THETA, 2.0):
        assert growth(theta) < 1 + 1e-9
    for theta in (1.0, 1.36, limit - 1e-3):
        assert growth(theta) > 1 + 1e-4


TRACK = Track(mesh=Mesh(cells=4, elements_per_bay=2, highest_slab_frequency=300))
POSITION = np.array([18.5, 16.0, 2.8, 0.3125])


# 4 s: small steps on finite elements.
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::railcosim.track.decay.RingWarning")
def test_second_order_on_the_track_towards_newmarks():
    """Whole system on Hertz's springs, rough under held wheels: both tend to the same."""
    duration, mono = 3e-3, assemble(Vehicle(), TRACK, POSITION)
    contacts = Pressing(HertzContact(C=9.64e10))

    def rough(t):
        waves = np.cos(2 * np.pi * (POSITION + 70.0 * t) / 0.8)
        return 2e-5 * np.tile(waves, 2) * (t / duration) ** 3

    def last(march, steps):
        run = march(mono, contacts, lambda t: POSITION, rough, duration / steps, steps)
        return list(run)[-1]

    coarse, middle, fine = (last(wilson_theta, n).force for n in (80, 160, 320))
    change = [np.abs(one - other).max() for one, other in ((coarse, middle), (middle, fine))]
    assert np.log2(change[0] / change[1]) > 1.8, change
    # A third of the last change is what is left of Wilson's error; Newmark's, half as large, has
    # its sign.
    assert np.abs(fine - last(newmark, 320).force).max() < change[1] / 3
    assert last(wilson_theta, 80).time == pytest.approx(duration)


def test_a_theta_below_one_is_refused():
    with pytest.raises(ValueError, match="at least 1"):
        next(wilson_theta(None, None, None, None, 1e-4, 1, theta=0.9))
