"""One step as a linear map: roots counted around a circle against eigenvalues of whole matrices."""

import tracemalloc

import numpy as np
import pytest
from scipy.sparse import csc_array

from railcosim.master.component import Variable
from railcosim.master.connections import connect_by_name
from railcosim.master.law import Law, Tangents
from railcosim.master.linear.modal import Modal, modal, modes_of
from railcosim.master.linear.state_space import StateSpace
from railcosim.master.linear_component import LinearComponent
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.interface_jacobian import interface_jacobian
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.nepce import nepce
from railcosim.master.schemes.variants import VARIANTS
from railcosim.master.stability.amplification import SAME, merged
from railcosim.master.stability.amplifier import Amplifier
from railcosim.master.stability.argument_principle import (
    TurningLostError,
    solve_triangular,
    windings,
)
from railcosim.master.stability.determinant import Determinant
from railcosim.master.stability.open_component import Open
from railcosim.master.system import System

N = 2  # contacts
K = 3e6  # N/m
FORCE = [Variable(name=f"force[{i}]", unit="N", nominal=1e3) for i in range(N)]
WHEEL = [Variable(name=f"wheel[{i}]", unit="m", nominal=1e-3) for i in range(N)]
RAIL = [Variable(name=f"rail[{i}]", unit="m", nominal=1e-3) for i in range(N)]


class Stiff:
    """Linear springs, as a law."""

    def force(self, compression):
        return K * compression

    def tangent(self, compression):
        return np.full((*compression.shape, 1), K)


def beam(modes=30):
    """A., B, C of a beam's modes, 1 to 20 Hz times k squared, 1 % damped, met at two places."""
    k = np.arange(1, modes + 1)
    omega, shape = 20.0 * k**1.3, np.sin(np.outer(k, [0.9, 1.7])) / np.sqrt(200.0)
    A = np.zeros((2 * modes, 2 * modes))
    i = 2 * np.arange(modes)
    A[i, i + 1], A[i + 1, i], A[i + 1, i + 1] = 1.0, -(omega**2), -0.02 * omega
    B, C = np.zeros((2 * modes, N)), np.zeros((N, 2 * modes))
    B[i + 1], C[:, i] = shape, shape.T
    return A, B, C


def make_system(*, opened, wheel_too=False):
    """Masses on springs, met by a beam, the springs in the master."""
    m, c, k = 300.0, 2e3, 1e5
    A = np.kron(np.eye(N), [[0.0, 1.0], [-k / m, -c / m]])
    B, C = np.kron(np.eye(N), [[0.0], [-1.0 / m]]), np.kron(np.eye(N), [[1.0, 0.0]])
    D = np.zeros((N, N))
    wheel = LinearComponent("wheel", A=A, B=B, C=C, D=D, inputs=FORCE, outputs=WHEEL)
    if wheel_too:
        states = StateSpace(name="wheel", A=csc_array(A), B=B, C=C, D=D, inputs=tuple(FORCE),
                            outputs=tuple(WHEEL))  # fmt: skip
        wheel = Open("wheel", FORCE, WHEEL, states)
    A, B, C = beam()
    if opened:
        rail = Open("rail", FORCE, RAIL, modal("rail", A, B, C, D, tuple(FORCE), tuple(RAIL)))
    else:
        rail = LinearComponent("rail", A=A, B=B, C=C, D=D, inputs=FORCE, outputs=RAIL)
    S = np.hstack([np.eye(N), -np.eye(N)])
    parts = [wheel, Law("contact", Stiff(), [*WHEEL, *RAIL], FORCE, S), rail]
    return System(parts, connect_by_name(parts))


SCHEMES = {
    **{f"jacobi {d}": jacobi(degree=d) for d in range(3)},
    **{f"gauss-seidel {d}": gauss_seidel(first="rail", degree=d) for d in range(3)},
    "nepce": nepce(),
    # A tolerance so fine that every step is corrected: then it is a linear map.
    **{n: interface_jacobian(variant=v, tolerance=1e-10) for n, v in VARIANTS.items()},
}


@pytest.mark.parametrize("name", SCHEMES)
def test_count_is_that_of_the_whole_matrix(name) -> None:
    whole, opened = (Amplifier(make_system(opened=o), SCHEMES[name]) for o in (False, True))
    for h in (1e-4, 1e-3, 3e-3, 1e-2):
        eigenvalues = np.abs(np.linalg.eigvals(whole.at(h).N))
        one = opened.at(h)
        assert one.growth() == pytest.approx(np.log(eigenvalues.max()) / h, rel=1e-7)  # rounding
        for rate in (0.5, 5.0, 50.0):
            edge = np.exp(rate * h)
            assert np.abs(eigenvalues - edge).min() > 1e-9  # else either number would be right
            assert one.growing(rate) == (eigenvalues > edge).sum()
            # The fastest is told from others that are slower by more than SAME.
            assert one.growth_above(rate) == pytest.approx(max(rate, one.growth()), rel=2 * SAME)


@pytest.mark.parametrize("name", SCHEMES)
def test_one_observation_holds_for_steps_of_every_length(name) -> None:
    """Where all that moves is open, a step of 1 ms is observed, and others follow from it."""
    whole = Amplifier(make_system(opened=False), SCHEMES[name])
    opened = Amplifier(make_system(opened=True, wheel_too=True), SCHEMES[name])
    for h in (1e-4, 1e-2):
        eigenvalues = np.abs(np.linalg.eigvals(whole.at(h).N))
        assert opened.at(h).growth() == pytest.approx(np.log(eigenvalues.max()) / h, rel=1e-7)


def damped_system(*, opened):
    """A mass over a mass, a spring and a damper between them in the master."""
    sides = {"wheel": (300.0, 1e5, 2e3, -1.0), "rail": (80.0, 4e6, 1e4, 1.0)}
    parts, motions = [], []
    for name, (m, k, c, way) in sides.items():
        A, B = np.array([[0.0, 1.0], [-k / m, -c / m]]), np.array([[0.0], [way / m]])
        outputs = [Variable(name=f"{name}.{q}", unit=u) for q, u in (("z", "m"), ("v", "m/s"))]
        one = {"A": A, "B": B, "C": np.eye(2), "D": np.zeros((2, 1))}
        if opened:
            states = StateSpace(name=name, **one | {"A": csc_array(A)}, inputs=tuple(FORCE[:1]),
                                outputs=tuple(outputs))  # fmt: skip
            parts.append(Open(name, FORCE[:1], outputs, states))
        else:
            parts.append(LinearComponent(name, **one, inputs=FORCE[:1], outputs=outputs))
        motions += outputs
    S, law = np.hstack([np.eye(2), -np.eye(2)]), Tangents(np.array([[[K, 3e3]]]))
    rates = {f"{name}.v": f"{name}.z" for name in sides}
    contact = Law("contact", law, motions, FORCE[:1], S, contacts=1, rate_of=rates)
    parts.insert(1, contact)
    return System(parts, connect_by_name(parts))


@pytest.mark.parametrize("name", ["jacobi 1", "average-hold", "radau-2", "conserving-4"])
def test_laws_of_rates_are_observed_at_two_lengths(name) -> None:
    """A scheme that makes rates of displacements divides by the length of the step."""
    whole, opened = (Amplifier(damped_system(opened=o), SCHEMES[name]) for o in (False, True))
    steps = np.array([1e-4, 7e-4, 3e-3])
    ends = opened.at(steps).real_ends()
    for h, at_ends in zip(steps.tolist(), ends, strict=True):
        growth = np.log(np.abs(np.linalg.eigvals(whole.at(h).N)).max()) / h
        assert opened.at(h).growth() == pytest.approx(growth, rel=1e-6)  # rounding
        assert opened.at(h).real_ends() == pytest.approx(at_ends, rel=1e-9)


def test_several_steps_at_once_are_each_by_itself() -> None:
    amplifier = Amplifier(make_system(opened=True, wheel_too=True), SCHEMES["gauss-seidel 1"])
    steps = np.array([1e-4, 1e-3, 1e-2])
    singly = np.array([amplifier.at(h).real_ends() for h in steps])
    assert amplifier.at(steps).real_ends() == pytest.approx(singly, rel=1e-9)  # rounding


def test_what_is_kept_twice_is_one_and_all_motions_are_left() -> None:
    """Numbers that are equal after any step, and others that are equal because those are."""
    rng = np.random.default_rng(3)
    once, fed, seen = rng.normal(size=(3, 3)), rng.normal(size=(3, 2)), rng.normal(size=(2, 3))
    which = np.array([0, 1, 2, 1, 0, 1])
    N = np.zeros((6, 6))
    # Who reads a number reads one copy or another; those of the first step first differ in that.
    N[:, [3, 4, 2]] = once[which][:, [1, 0, 2]]
    N[4, [4, 0]], N[4, [3, 1]] = (0.0, N[4, 4]), (0.0, N[4, 3])
    Q = np.zeros((2, 6))
    Q[:, :3] = seen
    fewer = merged(N, fed[which], Q)
    assert len(fewer[0]) < 6
    z = np.exp(0.3j)
    through = Q @ np.linalg.solve(z * np.eye(6) - N, fed[which])
    n, r, q, place = fewer
    assert q @ np.linalg.solve(z * np.eye(len(n)) - n, r) == pytest.approx(through, rel=1e-12)
    assert place[1] == place[3] == place[5]
    kept = np.linalg.eigvals(n)
    for motion in np.linalg.eigvals(once):
        assert np.abs(kept - motion).min() < 1e-12  # rounding
    assert np.abs(np.linalg.det(z * np.eye(6) - N)) == pytest.approx(
        np.abs(np.linalg.det(z * np.eye(len(n)) - n)), rel=1e-12
    )


def test_a_step_is_looked_at_without_what_is_kept_twice_or_gone_after_it() -> None:
    """Else eight vehicles would take minutes a step: their springs' ends are kept three times."""
    one = Amplifier(make_system(opened=True, wheel_too=True), jacobi(degree=1)).at(1e-3)
    least = one.determinant
    # Wheels' states, and of forces and both motions what a line needs: now and a step before.
    assert len(least._T) <= 4 + 2 * 3 * N
    assert len(least._T) < len(one.N)
    assert np.count_nonzero(np.abs(one.eigenvalues()) > 1e-3) >= 2 * 30


def test_modes_that_nobody_meets_leave_those_of_the_memory() -> None:
    n = 2
    alone = Determinant(
        np.diag([0.5, 2.0]), np.zeros((n, 0)), np.zeros((0, n)), np.zeros((0, 0)),
        np.array([0.9j]), np.zeros((1, 0), complex), np.zeros((0, 1), complex),
    )  # fmt: skip
    assert alone.outside(1.0) == 1
    assert alone.zero_outside(1.0) == 2.0
    assert alone.zero_outside(3.0) == 0.0


def test_something_grows_with_long_steps_and_nothing_with_short_ones() -> None:
    amplifier = Amplifier(make_system(opened=True), jacobi(degree=1))
    assert amplifier.at(1e-4).growing(0.5) == 0
    assert amplifier.at(1e-2).growing(0.5) > 0


def test_modes_and_fewer_modes_have_the_same_response() -> None:
    A, B, C = beam()
    model = StateSpace(
        name="rail", A=csc_array(A), B=B, C=C, D=np.zeros((N, N)),
        inputs=tuple(FORCE), outputs=tuple(RAIL),
    )  # fmt: skip
    omega = np.geomspace(1.0, 3e3, 500)
    G = model.frequency_response(omega)
    modes = modes_of(model)
    top = np.abs(G).max()
    assert np.abs(modes.response(1j * omega) - G).max() < 1e-12 * top  # rounding
    fewer = modes.condensed(1e-3)
    assert len(fewer.poles) < len(modes.poles)
    # Twice the sum of the singular values left out, each below 1e-3 of the largest, which is at
    # most half the peak; there are less than twenty.
    assert np.abs(fewer.response(1j * omega) - G).max() < 20 * 1e-3 * top


def test_a_ring_under_many_wheels_is_condensed_to_a_stable_model() -> None:
    """Met at 32 places, it shows 800 modes in hardly fewer numbers than they have.

    Factors of 1200 columns, as there were, left one that grows by 1100 a second.
    """
    n, places = 400, 32
    k = np.repeat(np.arange(1, n + 1), 2)
    poles = 3.0 * k * (-0.02 + 1j)
    turns = np.outer(k, np.linspace(0.05, 6.2, places))
    shapes = np.where(np.arange(2 * n)[:, None] % 2, np.sin(turns), np.cos(turns))
    names = tuple(Variable(name=f"[{i}]", unit="m") for i in range(places))
    ring = Modal(
        name="ring", poles=poles, B=shapes.astype(complex),
        C=(shapes / (2j * poles.imag[:, None])).T, D=np.zeros((places, places)),
        inputs=names, outputs=names,
    )  # fmt: skip
    fewer = ring.condensed(1e-6)
    assert len(fewer.poles) < 2 * n
    assert fewer.poles.real.max() < 0.0
    omega = poles.imag[::7]
    H = ring.response(1j * omega)
    # Twice the sum of what is left out, which falls fast below the last that is kept.
    assert np.abs(fewer.response(1j * omega) - H).max() < 20 * 1e-6 * np.abs(H).max()


def test_what_is_rounding_is_not_followed_for_ever() -> None:
    """Noise turns between points however many there are: memory would be full first.

    Points are counted before they are asked for: each that is steep asks for dozens.
    """
    rng, asked = np.random.default_rng(1), []

    def noise(phi):
        asked.append(phi.size)
        return 1j * rng.uniform(-np.pi, np.pi, len(phi))

    with pytest.raises(TurningLostError, match="still turns"):
        windings(noise, np.array([0.5 + 0.0j]), 1.0)
    assert len(asked) > 1
    assert max(asked) <= 2 * 100_000  # each with its neighbour


@pytest.mark.parametrize("sign", [1, -1])
def test_a_root_or_pole_on_the_circle_is_told(sign) -> None:
    """Not counted as nothing, nor a failure of arithmetic: a free body's is at 1."""
    with pytest.raises(TurningLostError, match="is on the circle"):
        windings(lambda phi: sign * np.log(np.exp(1j * phi) - 1.0), np.zeros(0, dtype=complex), 1.0)


def test_where_it_is_not_followed_eigenvalues_are_counted(monkeypatch) -> None:
    one, again = (Amplifier(make_system(opened=True), jacobi(degree=1)).at(1e-2) for _ in range(2))
    known = one.growing(0.5), one.growth_above(0.5)

    def lost(self, *args, **more):
        raise TurningLostError("lost")

    monkeypatch.setattr(Determinant, "outside", lost)
    monkeypatch.setattr(Determinant, "zero_outside", lost)
    assert 0 < known[0] < len(again.eigenvalues()) / 2
    assert again.growing(0.5) == known[0]
    assert again.growth_above(0.5) == pytest.approx(known[1], rel=2 * SAME)


def test_many_points_of_a_circle_take_no_more_memory_than_some() -> None:
    """A circle may take 200,000 points: what lies between them and F is made piece by piece."""
    random, n, few = np.random.default_rng(5), 60, 12
    one = Determinant(
        *(
            0.1 * random.standard_normal(shape)
            for shape in ((n, n), (n, few), (few, n), (few, few))
        ),
        0.9 * np.exp(1j * np.linspace(0.1, 3.0, n)),
        *(random.standard_normal(shape).astype(complex) for shape in ((n, few), (few, n))),
    )
    z = 1.1 * np.exp(1j * np.linspace(0.0, np.pi, 20_000))
    tracemalloc.start()
    found = one._factor(z)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 50e6  # 0.4 GB at once
    np.testing.assert_allclose(found[-3:], one._factor(z[-3:]), rtol=1e-9)


@pytest.mark.parametrize("n", [1, 11, 12, 13, 40])  # about as many rows as are solved together
def test_a_triangular_system_at_many_points(n) -> None:
    """Each against LAPACK; columns of a point stand together."""
    random = np.random.default_rng(n)
    T = np.triu(random.standard_normal((n, n)) + 1j * random.standard_normal((n, n))) / n
    B, z = random.standard_normal((n, 3)), 3.0 * np.exp(1j * np.linspace(0.0, np.pi, 5))
    found = solve_triangular(T, B, z).reshape(n, 5, 3)
    for k in range(5):
        one = np.linalg.solve(z[k] * np.eye(n) - T, B)
        assert found[:, k] == pytest.approx(one, rel=1e-12, abs=1e-14)  # rounding


def test_modes_have_as_few_inputs_as_drive_them() -> None:
    """A motion and a rate that drive a body as one force: the step's answers stay, to rounding."""
    random = np.random.default_rng(0)
    n = 20
    poles = -random.random(n) + 50j * random.random(n)
    few = random.standard_normal((n, 2)) + 1j * random.standard_normal((n, 2))
    by = random.standard_normal((2, 6)) * [1.0, 1e6, 1.0, 1e-3, 1.0, 1.0]  # of different units
    names = [Variable(name=f"u{k}") for k in range(6)]
    model = Modal(
        name="body", poles=poles, B=few @ by, C=few.T.conj(), D=np.zeros((2, 6)),
        inputs=tuple(names), outputs=tuple(names[:2]),
    )  # fmt: skip
    thin, told = model.driven
    assert thin.B.shape == (n, 2)
    assert thin.B @ told == pytest.approx(model.B, rel=1e-12)
