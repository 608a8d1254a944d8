"""The two-mass oscillator, with amplification matrices worked out by hand, apart from any scheme.

Between communication points each half moves exactly, x' = A x + B u(t), and u is the polynomial
through inputs at points: x(h) = exp(A h) x(0) + sum_j Gamma_j u_j with Gamma_j the integral of
exp(A (h - t)) B times the j-th Lagrange polynomial. Everything else is which inputs are whose
outputs, when.
"""

import runpy
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.stability.amplifier import Amplifier

EXAMPLE = runpy.run_path(
    str(Path(__file__).parents[2] / "examples" / "two_mass_oscillator.py"), run_name="example"
)
SETTINGS = [  # k, c, k_c, c_c, h: N/m, N s/m, s
    (1.0, 0.2, 1.0, 0.2, 0.4),
    (4.0, 0.5, 9.0, 0.0, 0.3),
    (1.0, 0.0, 25.0, 0.4, 0.15),
    (9.0, 3.0, 2.0, 1.0, 1.5),
]


def integrals(A, B, h, points):
    """Gamma_j for inputs at points (steps from the beginning), by Gauss quadrature."""
    # Exact to rounding: 20 nodes for a polynomial of degree 2 times an exponential over h <= 1.5.
    nodes, weights = np.polynomial.legendre.leggauss(20)
    found = []
    for j, own in enumerate(points):
        others = [p for i, p in enumerate(points) if i != j]
        total = np.zeros_like(B)
        for x, w in zip((nodes + 1) / 2, weights / 2, strict=True):
            basis = np.prod([(x - p) / (own - p) for p in others])
            total = total + w * h * basis * scipy.linalg.expm(A * (1 - x) * h) @ B
        found.append(total)
    return found


def halves(kind, k, c, k_c, c_c):
    """A, B of the halves, and of both the inputs by the state (x1, v1, x2, v2)."""
    alone, inside = np.array([[0, 1], [-k, -c]]), np.array([[0, 1], [-k - k_c, -c - c_c]])
    left, right = np.eye(4)[:2], np.eye(4)[2:]
    coupling = np.array([[0.0, 0.0], [k_c, c_c]])
    if kind == "displacement/displacement":
        return (inside, coupling, right), (inside, coupling, left)
    force = np.array([[-k_c, -c_c, k_c, c_c]])
    return (alone, np.array([[0.0], [1.0]]), force), (inside, coupling, left)


def jacobi_matrix(kind, degree, k, c, k_c, c_c, h):
    """Acts on (state now, one step ago ...): both halves extrapolate what they got."""
    size = 4 * (degree + 1)
    M = np.zeros((size, size))
    M[4:, :-4] = np.eye(size - 4)
    points = [-float(j) for j in range(degree + 1)]
    for i, (A, B, U) in enumerate(halves(kind, k, c, k_c, c_c)):
        rows = slice(2 * i, 2 * i + 2)
        M[rows, rows] += scipy.linalg.expm(A * h)
        for j, gamma in enumerate(integrals(A, B, h, points)):
            M[rows, 4 * j : 4 * j + 4] += gamma @ U
    return M


def gauss_seidel_matrix(kind, degree, k, c, k_c, c_c, h):
    """Left extrapolates first; then right interpolates to where left has got."""
    M = jacobi_matrix(kind, degree, k, c, k_c, c_c, h)
    _, (A, B, _) = halves(kind, k, c, k_c, c_c)
    M[2:4] = 0.0
    M[2:4, 2:4] = scipy.linalg.expm(A * h)
    gammas = integrals(A, B, h, [1.0 - j for j in range(degree + 1)])
    M[2:4] += gammas[0] @ M[:2]
    for j, gamma in enumerate(gammas[1:]):
        M[2:4, 4 * j : 4 * j + 2] += gamma
    return M


@pytest.mark.parametrize("kind", EXAMPLE["COUPLINGS"])
@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize(
    ("by_hand", "scheme"),
    [(jacobi_matrix, jacobi), (gauss_seidel_matrix, lambda **o: gauss_seidel(first="left", **o))],
)
def test_eigenvalues_are_those_worked_out_by_hand(kind, degree, by_hand, scheme) -> None:
    for *parameters, h in SETTINGS:
        system = EXAMPLE["COUPLINGS"][kind](*parameters)
        one = Amplifier(system, scheme(degree=degree)).at(h)
        expected = np.linalg.eigvals(by_hand(kind, degree, *parameters, h))
        found = np.linalg.eigvals(one.N)
        # The scheme carries some values twice, and inputs of the past: eigenvalues of zero more.
        for value in expected[np.abs(expected) > 1e-3]:
            # Rounding, magnified where eigenvalues lie close together.
            assert np.abs(found - value).min() < 1e-8
        assert one.spectral_radius() == pytest.approx(np.abs(expected).max(), rel=1e-9)
        assert one.growing() == (np.abs(expected) > 1.0).sum()


@pytest.mark.parametrize(
    ("kind", "factor"), [("force/displacement", 0.375), ("displacement/displacement", 0.25)]
)
def test_undamped_oscillator_grows_at_every_step_if_inputs_are_held(kind, factor) -> None:
    # A held input is late by half a step, so its force misses h/2 times its rate. Masses against
    # each other, v and -v, amplitude V: with force/displacement that missing force does work
    # k_c h v^2 on the left and k_c h v^2 / 2 on the right, with displacement/displacement
    # k_c h v^2 / 2 on both. By the energy V^2 the amplitude grows at 3/8 or 1/4 of k_c h.
    h, k_c = 0.003, 1.0
    system = EXAMPLE["COUPLINGS"][kind](1.0, 0.0, k_c, 0.0)
    growth = np.log(Amplifier(system, jacobi(degree=0)).at(h).spectral_radius())
    # The next term of the expansion is h times the frequency, 0.005.
    assert growth == pytest.approx(factor * k_c * h**2, rel=0.01)


def test_growth_a_step_is_seen_in_a_run() -> None:
    system = EXAMPLE["force_displacement"](4.0, 0.5, 9.0, 0.0)
    scheme, h = jacobi(degree=1), 0.3
    rate = Amplifier(system, scheme).at(h).spectral_radius()
    M = jacobi_matrix("force/displacement", 1, 4.0, 0.5, 9.0, 0.0, h)
    assert np.abs(np.linalg.eigvals(M)).max() == pytest.approx(rate, rel=1e-9)
    stepper = scheme.start(system)
    system.components[0].x = np.array([1.0, 0.0])
    system.components[1].x = np.zeros(2)
    system.begin(0.0)
    size = []
    for n in range(400):
        stepper.step(n * h, h)
        size.append(np.abs(system.components[0].x).max())
    # Over whole swings; the pair of eigenvalues lets the size of one vary by some percent.
    measured = (max(size[380:]) / max(size[180:200])) ** (1 / 200)
    assert measured == pytest.approx(rate, rel=1e-3)
