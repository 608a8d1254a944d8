"""Poles with springs added, from those without: against the eigenvalues of the matrices changed."""

import numpy as np
import pytest

from railcosim.track.changed_ring import Equal, Springs, poles_below

N, TOP = 12, 1e3


def eigen(K, C):
    """Poles and shapes of unit masses."""
    zero, one = np.zeros((N, N)), np.eye(N)
    poles, states = np.linalg.eig(np.block([[zero, one], [-K, -C]]))
    return poles, states[:N]


def system(damping):
    rng = np.random.default_rng(4)
    root = rng.normal(size=(N, N))
    return root @ root.T * 100 + 50 * np.eye(N), damping * np.diag(rng.random(N))


def found(K, C, B, springs):
    poles, shapes = eigen(K, C)
    poles, shapes = poles[poles.imag > 0], shapes[:, poles.imag > 0]
    assert poles.size == N
    a = np.einsum("im,ij,jm->m", shapes, C, shapes) + 2 * poles * np.sum(shapes**2, axis=0)
    c = B.T @ shapes
    R = np.moveaxis(c[:, None] * c / a, 2, 0)
    both, index = np.concatenate([poles, poles.conj()]), np.arange(2 * N)
    ring = Equal(
        poles=both, residues=np.concatenate([R, R.conj()]),
        moving=np.ones(2 * N, int), mirror=(index + N) % (2 * N),
    )  # fmt: skip
    s = poles_below(ring, springs, TOP, lambda text: None)
    return s.of(ring)


def check(K, C, B, springs):
    """Against the dense eigenvalues of the system with the springs put in."""
    M, *of_rest = (np.eye(N) + B @ springs.dm @ B.T, K + B @ springs.dk @ B.T,
                   C + B @ springs.dc @ B.T)  # fmt: skip
    poles, _ = eigen(*(np.linalg.solve(M, A) for A in of_rest))
    exact = np.sort_complex(poles[poles.imag >= 0])
    nearest = np.abs(found(K, C, B, springs)[:, None] - exact)
    assert nearest.shape == (exact.size, exact.size)
    small = 1e-12 * max(100, np.abs(exact).max())  # of the dense eigenvalues, 1e-13 of the largest
    assert nearest.min(axis=0).max() < small
    assert nearest.min(axis=1).max() < small
    return exact


@pytest.mark.parametrize("places", [1, 2, 4])
@pytest.mark.parametrize("damping", [0.0, 2.0, 12.0])
def test_poles(places, damping):
    K, C = system(damping)
    springs = Springs(
        dk=np.diag([-30.0, 900.0, -20.0, 300.0][:places]),
        dc=np.diag([5.0, 0.0, 9.0, 3.0][:places]),
        dm=np.diag([0.0, 0.4, 2.0, 0.0][:places]),
    )
    check(K, C, np.eye(N)[:, :places], springs)


def test_springs_between_places():
    """As where an element ends at another node: no place has a spring of its own."""
    K, C = system(2.0)
    dk, dc, dm = np.zeros((3, 3, 3))
    dk[0, 1] = dk[1, 0] = -100.0
    dk[0, 2] = dk[2, 0] = 100.0
    dk[1, 1], dk[2, 2], dm[1, 1], dm[2, 2], dc[2, 2] = -20.0, 20.0, -0.2, 0.2, 3.0
    check(K, C, np.eye(N)[:, :3], Springs(dk=dk, dc=dc, dm=dm))


def test_a_damper_that_stops_swinging():
    """A mode swings no more: two real poles, each followed by itself in the end."""
    K, C = system(0.5)
    one = np.zeros((1, 1))
    exact = check(K, C, np.eye(N)[:, :1], Springs(dk=one, dc=one + 3e3, dm=one))
    assert (exact.imag == 0).sum() >= 2
